//! A symmetric top that turns about a fixed point under gravity, against Lagrange's closed forms.
//!
//! There are no joints: the body is the top about its fixed point, its moments are those about that point, and what turns it
//! is the torque of its weight, as a pull of m g where the centre of mass is beside one of -m g at the fixed point. What is tested
//! is what makes motion of torques: rows to wrench, wrench to angular momentum, angular momentum to a turn.
//!
//! With `implicit`, a torque of the tick's beginning holds all the tick: the leapfrog method, if the angular momentum is that of
//! half a tick earlier; so its tops start there. Its frequencies are off by `(w dt)^2 / 24`, those of a turn about the axes of the
//! tick's middle by up to its square over 12. With `rk4` the weight goes round with the body within the tick, and the error is of
//! the fourth order. That halving the tick quarters the first, and divides the second by sixteen, is what tells the closed forms
//! and the method from anything that is nearly right.
#![allow(non_snake_case)]

use crate::common;

use std::f64::consts::{PI, TAU};

use common::{DT, G, object};
use haptics::Sphere;
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use physics::{Body, Integrator, Manipulation, MassProperties, Pull, Settings};

const MASS: f64 = 0.1;
/// From the fixed point to the centre of mass, along the axis of figure.
const LENGTH: f64 = 0.03;
/// Moments about the fixed point: across the axis and along it.
const ACROSS: f64 = 1.2e-4;
const ALONG: f64 = 2.0e-5;
/// m g l
const PULL: f64 = MASS * G * LENGTH;

struct Top {
    entities: Vec<haptics::Entity>,
    manipulation: Manipulation,
    dt_s: f64,
}

impl Top {
    /// Leaned by an angle (rad) about x from the vertical; its axis y is the axis of figure.
    fn new(lean: f64, angular_velocity_W: Vector3<f64>, integrator: Integrator, dt_s: f64) -> Self {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), lean);
        let pose = Isometry3::from_parts(Vector3::zeros().into(), turn);
        let entity = object(Sphere::new(0.02).unwrap(), pose, 1000.0, 0.0);
        let mass = MassProperties::given(MASS, Vector3::zeros(), [ACROSS, ALONG, ACROSS]).unwrap();
        let mut body = Body::at_rest(mass, &pose).moving(Vector3::zeros(), angular_velocity_W);
        if integrator == Integrator::Implicit {
            body.angular_momentum_W -= torque_W(&body) * (0.5 * dt_s);
        }
        let settings = Settings { gravity_W: Vector3::zeros(), integrator, ..Settings::default() };
        let entities = vec![entity];
        let manipulation = Manipulation::new(&entities, &[(0, body)], settings).unwrap();
        Self { entities, manipulation, dt_s }
    }

    fn step(&mut self) {
        let weight_W = Vector3::y() * (MASS * G);
        let pull = |point_W, force_on_user_W| Pull {
            entity: 0,
            finger: 0,
            point_W,
            force_on_user_W,
            stiffness_n_per_m: 0.0,
        };
        let mut pulls = [pull(self.axis_W() * LENGTH, weight_W), pull(Vector3::zeros(), -weight_W)];
        self.manipulation.step_pulled(&mut self.entities, &mut [], &mut pulls, &mut [], self.dt_s);
    }

    fn axis_W(&self) -> Vector3<f64> {
        axis_W(&self.manipulation.bodies()[0])
    }

    fn lean(&self) -> f64 {
        let axis_W = self.axis_W();
        axis_W.xz().norm().atan2(axis_W.y)
    }

    /// Where it leans to, about the vertical.
    fn azimuth(&self) -> f64 {
        let axis_W = self.axis_W();
        axis_W.x.atan2(axis_W.z)
    }
}

fn axis_W(body: &Body) -> Vector3<f64> {
    body.orientation * Vector3::y()
}

fn torque_W(body: &Body) -> Vector3<f64> {
    (axis_W(body) * LENGTH).cross(&(Vector3::y() * (-MASS * G)))
}

/// The slow rate of steady precession: `A cos(theta) W^2 - C w3 W + m g l = 0`.
fn precession(lean: f64, spin: f64) -> f64 {
    let b = ALONG * spin;
    2.0 * PULL / (b + (b * b - 4.0 * ACROSS * lean.cos() * PULL).sqrt())
}

/// A top that precesses steadily, and nods besides at this rate (rad/s).
fn steady(lean: f64, spin: f64, nods: f64, integrator: Integrator, dt_s: f64) -> Top {
    let axis_W = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), lean) * Vector3::y();
    let rate = precession(lean, spin);
    let around_W = (Vector3::y() - axis_W * lean.cos()) * rate + axis_W * spin;
    Top::new(lean, around_W + Vector3::x() * nods, integrator, dt_s)
}

/// Who carries angular momentum, and what halving the tick leaves of its error.
const CARRIERS: [(Integrator, f64); 2] = [(Integrator::Implicit, 0.27), (Integrator::Rk4, 0.08)];
/// A tick in which these tops turn by less than a quarter of a radian, and half of it (s).
const TICKS: [f64; 2] = [5e-4, 2.5e-4];
const SPIN: f64 = 400.0;
const LEAN: f64 = 0.5;

/// By what share a steady top's rate of precession is off in 20 s, and how far it nods (rad).
fn precesses(integrator: Integrator, dt_s: f64) -> (f64, f64) {
    let mut top = steady(LEAN, SPIN, 0.0, integrator, dt_s);
    let (mut turned, mut last, mut nodded) = (0.0, top.azimuth(), 0.0_f64);
    let ticks = (20.0 / dt_s) as usize;
    for _ in 0..ticks {
        top.step();
        let now = top.azimuth();
        turned += (now - last + PI).rem_euclid(TAU) - PI;
        last = now;
        nodded = nodded.max((top.lean() - LEAN).abs());
    }
    (turned / (precession(LEAN, SPIN) * ticks as f64 * dt_s) - 1.0, nodded)
}

#[test]
fn a_steady_top_precesses_at_its_rate_and_does_not_nod() {
    for (integrator, halved) in CARRIERS {
        let [(off, nodded), (half_off, half_nodded)] = TICKS.map(|dt_s| precesses(integrator, dt_s));
        println!("{}: off by {off:e}, {half_off:e}; nods {nodded:e}, {half_nodded:e}", integrator.name());
        // (0.2 rad)^2 / 12, times the ratio of precession to nutation, 1/18.
        assert!(off.abs() < 1.8e-4 && nodded < 1.8e-4, "{}: {off:e} {nodded:e}", integrator.name());
        // Roundings of 20,000 ticks are left.
        assert!(half_off.abs() < halved * off.abs() + 1e-9, "{}: {half_off:e}", integrator.name());
        assert!(half_nodded < halved * nodded + 1e-9, "{}: {half_nodded:e}", integrator.name());
    }
}

/// How often it nods (rad/s): from the first to the last passage of the middle.
fn nutation(integrator: Integrator, dt_s: f64) -> f64 {
    let mut top = steady(LEAN, SPIN, 0.05, integrator, dt_s);
    let (mut first, mut last, mut passages) = (0.0, 0.0, 0);
    let mut was = top.lean() - LEAN;
    for tick in 1..=(4.0 / dt_s) as usize {
        top.step();
        let now = top.lean() - LEAN;
        if was < 0.0 && now >= 0.0 {
            last = (tick as f64 - now / (now - was)) * dt_s;
            first = if passages == 0 { last } else { first };
            passages += 1;
        }
        was = now;
    }
    f64::from(passages - 1) * TAU / (last - first)
}

#[test]
fn a_top_nods_at_its_rate_the_better_the_shorter_the_tick() {
    let rate = precession(LEAN, SPIN);
    let across = PULL / ACROSS;
    // Of the effective potential of the lean.
    let exact = (rate * rate + (across / rate).powi(2) - 2.0 * across * LEAN.cos()).sqrt();
    for (integrator, halved) in CARRIERS {
        let off = TICKS.map(|dt_s| nutation(integrator, dt_s) / exact - 1.0);
        println!("{}: {exact} rad/s, off by {off:?}", integrator.name());
        // (0.2 rad)^2 / 12; nods of 0.8 mrad change their own rate by 1e-6.
        assert!(off[0].abs() < 3.3e-3, "{}: {off:?}", integrator.name());
        assert!(off[1].abs() < halved * off[0].abs() + 2e-6, "{}: {off:?}", integrator.name());
    }
}

/// The lean of a top that spins upright, leaned by a little at first: `|cosh(s t) - i C w3 / (2 A s) sinh(s t)|`.
fn sleeping(spin: f64, t: f64) -> f64 {
    let half = 0.5 * ALONG * spin / ACROSS;
    let square = PULL / ACROSS - half * half;
    let rate = square.abs().sqrt();
    let (cosh, sinh) = if square > 0.0 {
        ((rate * t).cosh(), (rate * t).sinh())
    } else {
        ((rate * t).cos(), (rate * t).sin())
    };
    cosh.hypot(half / rate * sinh)
}

/// The largest error of a sleeping top's lean, as a share of it or of the first lean; and how far it leaned.
fn sleeps(share: f64, integrator: Integrator, dt_s: f64) -> (f64, f64) {
    // (C w3)^2 = 4 A m g l
    let spin = share * (4.0 * ACROSS * PULL).sqrt() / ALONG;
    let lean = 1e-5;
    let axis_W = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), lean) * Vector3::y();
    let mut top = Top::new(lean, axis_W * spin, integrator, dt_s);
    let (mut worst, mut farthest) = (0.0_f64, 0.0_f64);
    for tick in 1..=(3.0 / dt_s) as usize {
        top.step();
        farthest = farthest.max(top.lean());
        let exact = lean * sleeping(spin, tick as f64 * dt_s);
        // As long as the sine is the angle, to 2e-6 of it.
        if exact > 3e-3 {
            break;
        }
        worst = worst.max((top.lean() - exact).abs() / exact.max(lean));
    }
    (worst, farthest)
}

#[test]
fn a_top_sleeps_above_its_critical_spin_and_falls_below_it() {
    for (integrator, halved) in CARRIERS {
        for share in [0.9, 0.97, 1.03, 1.2] {
            let [(worst, farthest), (half, _)] = [DT, 0.5 * DT].map(|dt_s| sleeps(share, integrator, dt_s));
            println!("{} {share}: off by {worst:e}, {half:e}, leaned to {farthest}", integrator.name());
            assert_eq!(share < 1.0, farthest > 2e-3, "{} {share}: {farthest}", integrator.name());
            // The rate of falling or swaying is the root of a difference of squares that nearly take each other away. Each is off
            // by some (w dt)^2 of 31 rad/s, the rate by that over 2 |1 - share^2|, 0.8 %, and over ten of its periods the
            // lean by ten times as much, and by the sway's own factor of 4: a quarter. Half a tick, a quarter of that.
            assert!(worst < 0.25, "{} {share}: {worst}", integrator.name());
            assert!(half < halved * worst + 2e-5, "{} {share}: {half} after {worst}", integrator.name());
        }
    }
}

#[test]
fn without_its_gyroscopic_torque_a_spinning_top_falls_like_a_stick() {
    let mut top = steady(LEAN, SPIN, 0.0, Integrator::ThesisEuler, DT);
    let mut true_top = steady(LEAN, SPIN, 0.0, Integrator::Implicit, DT);
    for _ in 0..150 {
        top.step();
        true_top.step();
    }
    // m g l / A = 245 /s^2: 0.5 rad become 2 within 0.15 s.
    assert!(top.lean() > 1.5 && (true_top.lean() - LEAN).abs() < 1e-4, "{} {}", top.lean(), true_top.lean());
}
