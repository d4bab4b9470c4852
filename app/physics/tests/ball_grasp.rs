//! Two balls that hold a box between them and are led around it by a hand that turns.
//!
//! A device that tells no orientation says nothing of how its ball turns. A ball that sticks is taken to turn along with what
//! it holds, as fingertips do while the hand turns with them: its centre is carried around with the object. A ball that never
//! turned would roll over it instead, by `r theta`. By statics of this grasp (h = 25 mm, r = 10 mm, 3 mm deep) the object would
//! then go ahead of the hand: 118 degrees at the hand's 90, the balls 20.6 mm along its faces; and at mu = 0.5 it would slip
//! out after 53 degrees of the hand.
#![allow(non_snake_case)]

mod common;

use std::f64::consts::{FRAC_PI_2, PI};

use common::*;
use haptics::{ContactState, Cuboid, Entity, Finger};
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use physics::{Manipulation, Settings, Touch};

const HALF: f64 = 0.025;
const RADIUS: f64 = 0.01;
const MASS: f64 = 0.1;
const SQUEEZE: f64 = 0.003;

struct Hand {
    entities: Vec<Entity>,
    manipulation: Manipulation,
    fingers: [Finger; 2],
    touches: Vec<Touch>,
}

impl Hand {
    fn new() -> Self {
        let cube = object(Cuboid::new([2.0 * HALF; 3]).unwrap(), Isometry3::identity(), 800.0, 0.5);
        let body = body(&cube, MASS);
        let entities = vec![cube];
        let settings = Settings { gravity_W: Vector3::zeros(), ..Settings::default() };
        let manipulation = Manipulation::new(&entities, &[(0, body)], settings).unwrap();
        let fingers = [0, 1].map(|_| Finger::new(RADIUS, 1).unwrap().with_ramp_in(0.0).unwrap());
        Self { entities, manipulation, fingers, touches: Vec::new() }
    }

    /// The balls' centres so far from the middle, turned about z by an angle (rad). Returns whether both stick.
    fn step(&mut self, apart: f64, turned: f64) -> bool {
        let way = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), turned) * Vector3::x() * apart;
        self.touches.clear();
        let mut both_stick = true;
        for (index, (finger, hip)) in self.fingers.iter_mut().zip([way, -way]).enumerate() {
            let output = finger.step(&self.entities, &hip, DT);
            let is_sticking = output.friction == ContactState::Stick;
            both_stick &= is_sticking;
            let points = finger.touch_points(&self.entities, 0);
            self.touches.extend(points.as_slice().iter().map(|point| Touch {
                entity: 0,
                finger: index,
                point_W: point.point_W,
                normal_W: point.normal_W,
                force_on_user_W: point.force_on_user_W,
                is_sticking,
            }));
        }
        self.manipulation.step(&mut self.entities, &mut self.touches, DT);
        both_stick
    }
}

#[test]
fn a_box_between_two_balls_turns_as_far_as_the_hand_that_leads_them() {
    let mut hand = Hand::new();
    let (open, closed) = (HALF + RADIUS + 1e-3, HALF + RADIUS - SQUEEZE);
    for tick in 0..200 {
        hand.step(open + (closed - open) * f64::from(tick) / 199.0, 0.0);
    }
    // A quarter turn in two seconds, slow at either end; then still.
    for tick in 0..2500 {
        let share = 0.5 - 0.5 * (PI * (f64::from(tick) / 2000.0).min(1.0)).cos();
        assert!(hand.step(closed, FRAC_PI_2 * share), "tick {tick} slips");
    }
    let cube = hand.manipulation.bodies()[0];
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
