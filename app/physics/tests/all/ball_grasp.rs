//! Two balls that hold a box between them and are led around it by a hand that turns.
//!
//! A device that tells no orientation says nothing of how its ball turns. A ball that sticks is taken to turn along with what
//! it holds, as fingertips do while the hand turns with them: its centre is carried around with the object. A ball that never
//! turned would roll over it instead, by `r theta`. By statics of this grasp (h = 25 mm, r = 10 mm, 3 mm deep) the object would
//! then go ahead of the hand: 118 degrees at the hand's 90, the balls 20.6 mm along its faces; and at mu = 0.5 it would slip
//! out after 53 degrees of the hand.
#![allow(non_snake_case)]

use crate::common;

use std::f64::consts::{FRAC_PI_2, PI};

use common::*;
use haptics::{ContactState, Cuboid, Entity, Finger};
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use physics::{Body, FingerSettings, FingerTick, Manipulation, MassProperties, Settings, SoftFinger, Touch};

const HALF: f64 = 0.025;
const RADIUS: f64 = 0.01;
const MASS: f64 = 0.1;
const SQUEEZE: f64 = 0.003;
const K: f64 = 800.0;
/// About any axis through the middle.
const INERTIA: f64 = MASS * (2.0 * HALF) * (2.0 * HALF) / 6.0;
const OPEN: f64 = HALF + RADIUS + 1e-3;
const CLOSED: f64 = HALF + RADIUS - SQUEEZE;

struct Hand {
    entities: Vec<Entity>,
    manipulation: Manipulation,
    fingers: [Finger; 2],
    touches: Vec<Touch>,
    ticks: [FingerTick; 2],
}

impl Hand {
    fn new() -> Self {
        Self::of(1.0, 0.0, Vector3::zeros(), SoftFinger::POINT)
    }

    /// The box's damping, gravity (m/s^2), where its centre of mass is, and what the balls' pads are.
    fn of(damping: f64, gravity: f64, centre: Vector3<f64>, soft: SoftFinger) -> Self {
        let cube = object(Cuboid::new([2.0 * HALF; 3]).unwrap(), Isometry3::identity(), K, 0.5);
        let cube = cube.with_damping(damping).unwrap();
        let mass = MassProperties::of_shape(&cube.shape, MASS).unwrap().with_centre(centre);
        let body = Body::at_rest(mass, &cube.X_WB);
        let entities = vec![cube];
        let settings = Settings { gravity_W: Vector3::y() * -gravity, ..Settings::default() };
        let manipulation = Manipulation::new(&entities, &[(0, body)], settings).unwrap();
        let of_finger = FingerSettings { soft: soft.validated().unwrap(), attachment: None };
        let manipulation = manipulation.with_fingers(&[of_finger; 2]);
        let fingers = [0, 1].map(|_| Finger::new(RADIUS, 1).unwrap().with_ramp_in(0.0).unwrap());
        let ticks = [FingerTick::at(Vector3::zeros()); 2];
        let mut hand = Self { entities, manipulation, fingers, touches: Vec::new(), ticks };
        // They come from outside.
        hand.step_around(Vector3::zeros(), OPEN, 0.0);
        hand
    }

    fn body(&self) -> Body {
        self.manipulation.bodies()[0]
    }

    /// The balls' centres so far from the middle, turned about z by an angle (rad). Returns whether both stick.
    fn step(&mut self, apart: f64, turned: f64) -> bool {
        self.step_around(Vector3::zeros(), apart, turned)
    }

    /// The same, with the middle elsewhere.
    fn step_around(&mut self, middle: Vector3<f64>, apart: f64, turned: f64) -> bool {
        let way = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), turned) * Vector3::x() * apart;
        self.touches.clear();
        let mut both_stick = true;
        for (index, (finger, hip)) in self.fingers.iter_mut().zip([middle + way, middle - way]).enumerate() {
            self.ticks[index].hip_W = hip;
            let output = finger.step(&self.entities, &hip, DT);
            let is_sticking = output.friction == ContactState::Stick;
            both_stick &= is_sticking;
            let points = finger.touch_points(&self.entities, 0);
            for contact in finger.contacts() {
                self.touches.extend(points.as_slice().iter().map(|point| Touch::at(point, contact, index)));
            }
        }
        self.manipulation.step_with(&mut self.entities, &mut self.touches, &mut self.ticks, DT);
        both_stick
    }

    /// What a finger feels of its touches.
    fn felt(&self, finger: usize) -> Vector3<f64> {
        self.touches.iter().filter(|touch| touch.finger == finger).map(|touch| touch.force_on_user_W).sum()
    }
}

#[test]
fn a_box_between_two_balls_turns_as_far_as_the_hand_that_leads_them() {
    let mut hand = Hand::new();
    for tick in 0..200 {
        hand.step(OPEN + (CLOSED - OPEN) * f64::from(tick) / 199.0, 0.0);
    }
    // A quarter turn in two seconds, slow at either end; then still.
    for tick in 0..2500 {
        let share = 0.5 - 0.5 * (PI * (f64::from(tick) / 2000.0).min(1.0)).cos();
        assert!(hand.step(CLOSED, FRAC_PI_2 * share), "tick {tick} slips");
    }
    let cube = hand.body();
    let quarter = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), FRAC_PI_2);
    // What the dampers have left of the swing between the springs.
    let off = cube.orientation.angle_to(&quarter);
    assert!(off < 1e-4 && cube.centre_W.norm() < 1e-6, "{off} rad, {cube:?}");
    for touch in &hand.touches {
        let at_B = cube.orientation.inverse() * (touch.point_W - cube.centre_W);
        // In the middle of its faces, where they took hold.
        assert!((at_B.x.abs() - HALF).abs() < 1e-5 && at_B.y.abs() < 1e-5, "{at_B}");
    }
}

#[test]
fn both_balls_feel_in_every_tick_what_the_box_got_and_carry_half_of_its_weight_each() {
    let mut hand = Hand::of(2.0, G, Vector3::zeros(), SoftFinger::POINT);
    let weight = Vector3::y() * (-MASS * G);
    for tick in 0..4000 {
        // Lifted, led aside and turned for two seconds, so that all forces and torques change.
        let share = 0.5 - 0.5 * (PI * (f64::from(tick) / 2000.0).min(1.0)).cos();
        let before = hand.body();
        let middle = Vector3::new(0.05, 0.1, 0.02) * share;
        assert!(hand.step_around(middle, CLOSED, 0.3 * share), "tick {tick} slips");
        let after = hand.body();
        let (mut force_W, mut torque_W) = (weight, Vector3::zeros());
        for touch in &hand.touches {
            force_W -= touch.force_on_user_W;
            torque_W -= (touch.point_W - before.centre_W).cross(&touch.force_on_user_W);
        }
        let gained_W = (after.velocity_W - before.velocity_W) * MASS;
        // Roundings of forces of some newtons for a millisecond, and of their torques.
        assert!((gained_W - force_W * DT).norm() < 1e-17, "tick {tick}: {gained_W}, {force_W}");
        let turned_W = after.angular_momentum_W - before.angular_momentum_W;
        assert!((turned_W - torque_W * DT).norm() < 1e-18, "tick {tick}: {turned_W}, {torque_W}");
    }
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 0.3);
    for finger in 0..2 {
        let inwards = turn * Vector3::x() * if finger == 0 { 1.0 } else { -1.0 };
        // The springs' pull on the hand: as hard as the box is squeezed, and half of the weight. What still swings.
        let expected = inwards * (K * SQUEEZE) + weight * 0.5;
        assert!((hand.felt(finger) - expected).norm() < 1e-3, "{finger}: {}", hand.felt(finger));
    }
    let down = hand.body().centre_W - Vector3::new(0.05, 0.1, 0.02);
    assert!((down + Vector3::y() * (MASS * G / (2.0 * K))).norm() < 1e-5, "{down}");
}

/// When something crosses zero upwards, in ticks and parts of them.
fn crossings(values: &[f64]) -> Vec<f64> {
    let crosses = |(at, pair): (usize, &[f64])| {
        (pair[0] < 0.0 && pair[1] >= 0.0).then(|| at as f64 - pair[0] / (pair[1] - pair[0]))
    };
    values.windows(2).enumerate().filter_map(crosses).collect()
}

/// Over all whole periods (rad/s).
fn frequency(values: &[f64]) -> f64 {
    let at = crossings(values);
    assert!(at.len() > 4, "{at:?}");
    2.0 * PI * (at.len() - 1) as f64 / ((at[at.len() - 1] - at[0]) * DT)
}

/// The hand turns by 2 mrad at once, and the box swings after it. A ball that sticks goes around with the box: its spring is
/// pulled sideways by `(h + r) a` and pulls at the arm h, and what squeezes turns along with the box, `h (h + r - s) k` a ball.
#[test]
fn the_box_swings_between_the_balls_as_fast_as_springs_and_inertia_have_it() {
    let mut hand = Hand::of(0.0, 0.0, Vector3::zeros(), SoftFinger::POINT);
    let turned = 2e-3;
    (0..10).for_each(|_| assert!(hand.step(CLOSED, 0.0)));
    let angle = |hand: &mut Hand| {
        assert!(hand.step(CLOSED, turned));
        hand.body().orientation.scaled_axis().z - turned
    };
    let angles: Vec<f64> = (0..500).map(|_| angle(&mut hand)).collect();
    // Forces of the tick's beginning, with what the springs give in the tick as inertia.
    let inertia = INERTIA + 2.0 * K * HALF * HALF * DT * DT;
    let steady = (2.0 * K * HALF * (HALF + RADIUS - SQUEEZE) / inertia).sqrt();
    let expected = 2.0 * (0.5 * steady * DT).asin() / DT;
    let got = frequency(&angles);
    assert!((got / expected - 1.0).abs() < 1e-3, "{got} {expected}");
    // Nothing damps it.
    let most = angles[400..].iter().fold(0.0_f64, |most, angle| most.max(angle.abs()));
    assert!((most / turned - 1.0).abs() < 0.02, "{most}");
}

#[test]
fn what_hangs_beside_the_balls_swings_between_points_and_is_held_by_pads() {
    // From the line between the balls to the centre of mass.
    let (arm, off) = (0.01, 0.1_f64);
    let hung = Vector3::new(0.0, -arm * off.cos(), arm * off.sin());
    let mut hand = Hand::of(1.0, G, hung, SoftFinger::POINT);
    let mut angles = Vec::new();
    for _ in 0..3000 {
        assert!(hand.step(CLOSED, 0.0));
        // Of the centre from straight below the line.
        angles.push(off - hand.body().orientation.scaled_axis().x);
    }
    let inertia = INERTIA + MASS * arm * arm;
    // A pendulum's, by 0.1 rad: slower by a^2 / 16. The line hangs on springs, m g / 2 k, and gives by a part in some hundreds.
    let expected = (MASS * G * arm / inertia).sqrt() * (1.0 - off * off / 16.0);
    let got = frequency(&angles);
    assert!((got / expected - 1.0).abs() < 5e-3, "{got} {expected}");
    // A third of that beside the line, and pads, which 9.6 N mm would turn: more than twice what it swings up to.
    let beside = 0.003;
    let soft = SoftFinger::default();
    let mut hand = Hand::of(1.0, G, Vector3::z() * beside, soft);
    (0..3000).for_each(|_| assert!(hand.step(CLOSED, 0.0)));
    let turned = hand.body().orientation.scaled_axis();
    let expected = MASS * G * beside * turned.x.cos() / (2.0 * soft.stiffness_nm_per_rad);
    // Pulled down at +z it turns about +x. What still swings after three seconds.
    assert!((turned - Vector3::x() * expected).norm() < 1e-6, "{turned} {expected}");
    for tick in &hand.ticks {
        let torque = tick.torque_on_user_W.x;
        let half = 0.5 * MASS * G * beside * turned.x.cos();
        assert!((torque - half).abs() < 1e-6, "{torque} {half}");
    }
}
