//! The Friction Cone Algorithm on a sphere (Melder ch. 4.2.1), against closed forms.
//!
//! With the HIP at rho from the centre of a sphere of radius r and the god-object phi behind it, the
//! tangential force exceeds mu times the normal one by
//! `k (rho sqrt(1 + mu^2) sin(phi + atan mu) - mu r)`; its first root is where sliding ends.

use crate::common::*;
use haptics::{
    ConeInput, ContactState, Friction, FrictionCone, FrictionState, MAX_SLIDE_ROUNDS, Sphere, Surface,
};
use nalgebra::Vector3;
use proptest::prelude::*;

const R: f64 = 0.1;
const RHO: f64 = R - DEPTH;

fn still(hip_B: Vector3<f64>) -> ConeInput {
    ConeInput {
        hip_B,
        hip_velocity_B: Vector3::zeros(),
        stiffness_n_per_m: K,
        damping_n_s_per_m: 0.0,
        dt_s: DT,
    }
}

fn god_object_angle(point: &Vector3<f64>) -> f64 {
    point.x.atan2(point.y)
}

#[test]
fn it_breaks_away_within_one_tick_of_the_static_limit() {
    let entity = ball(R, stiction());
    let mut finger = point_finger();
    let limit = sphere_lag(MU_S, R, RHO).unwrap();
    let tick = 1e-5; // rad: 1 mm/s
    for i in 0.. {
        let phi = f64::from(i) * tick;
        let out = finger.step(std::slice::from_ref(&entity), &on_circle(RHO, phi), DT);
        if out.friction == ContactState::Slip {
            assert!(phi > limit && phi - limit <= tick, "slipped at {phi}, limit {limit}");
            break;
        }
        assert_eq!(out.god_object_W, Vector3::new(0.0, R, 0.0));
        assert!(phi <= limit + 1e-10);
    }
}

#[test]
//= melder#4.12 type=test
fn sliding_it_bears_the_dynamic_coefficient() {
    let entity = ball(R, stiction());
    let mut finger = point_finger();
    let lag = sphere_lag(MU_D, R, RHO).unwrap();
    let mut slips = 0;
    for i in 0..7000 {
        let phi = f64::from(i) * 1e-3; // 0.1 m/s
        let out = finger.step(std::slice::from_ref(&entity), &on_circle(RHO, phi), DT);
        if out.friction != ContactState::Slip {
            continue;
        }
        slips += 1;
        // The force and the god-object both know: the force is that of the rim, the god-object
        // may rest 1e-12 of the depth off it.
        assert!((ratio(&out, &(out.god_object_W / R)) - MU_D).abs() < 1e-13);
        let spring = out.god_object_W - on_circle(RHO, phi);
        let normal = spring.dot(&out.god_object_W) / R;
        let tangential = spring.cross(&out.god_object_W).norm() / R;
        assert!((tangential / normal - MU_D).abs() < 5e-12);
        // d(excess)/d(phi) is rho sqrt(1 + mu^2) cos(phi + atan mu) = 0.094: 1e-12 * 5 mm / 0.094
        // is 5e-14 rad, plus rounding of phi up to 7 (9e-16).
        let behind = (phi - god_object_angle(&out.god_object_W)).rem_euclid(std::f64::consts::TAU);
        assert!((behind - lag).abs() < 1e-13, "{behind} vs {lag}");
    }
    assert!(slips > 6500);
}

#[test]
fn one_projection_per_tick_would_miss_the_coefficient_by_more_than_one_in_ten_thousand() {
    // Melder eq. 4.12-4.14 as printed, apart from the sign: slide once, settle once.
    let (mut normal, mut worst) = (Vector3::y(), 0.0f64);
    for i in 0..2000 {
        let hip = on_circle(RHO, f64::from(i) * 1e-3);
        let depth = R - normal.dot(&hip);
        let surface_point = hip + normal * depth;
        let lag = normal * R - surface_point;
        if lag.norm() > MU_D * depth {
            normal = (surface_point + lag.normalize() * (MU_D * depth)).normalize();
            let spring = normal * R - hip;
            let normal_part = spring.dot(&normal);
            worst = worst.max(((spring - normal * normal_part).norm() / normal_part - MU_D).abs());
        }
    }
    assert!(worst > 1e-4, "{worst}");
}

#[test]
fn a_held_god_object_rides_out_any_motion_within_the_cone() {
    let entity = ball(R, Friction::coulomb(0.5).unwrap());
    let mut finger = point_finger();
    let reach = sphere_lag(0.5, R, RHO).unwrap() * 0.999;
    let mut noise = Noise(3);
    finger.step(std::slice::from_ref(&entity), &on_circle(RHO, 0.0), DT);
    for _ in 0..10_000 {
        let out =
            finger.step(std::slice::from_ref(&entity), &on_circle(RHO, noise.between(-reach, reach)), DT);
        assert_eq!(out.god_object_W, Vector3::new(0.0, R, 0.0));
        assert_eq!(out.friction, ContactState::Stick);
    }
}

#[test]
fn a_frictionless_slide_around_the_sphere_costs_no_work() {
    let entity = ball(R, Friction::None);
    let mut finger = point_finger();
    let (mut work, mut before) = (0.0, None);
    for i in 0..=6284 {
        let hip = on_circle(RHO, f64::from(i) * 1e-3);
        let out = finger.step(std::slice::from_ref(&entity), &hip, DT);
        // No drag at all: the force is radial at the god-object.
        let off_axis = out.force_on_user_W.cross(&out.god_object_W).norm() / R;
        assert!(off_axis < 1e-15 * K * DEPTH * 10.0, "{off_axis}");
        if let Some((hip_before, force_before)) = before.replace((hip, out.force_on_user_W)) {
            // Trapezoids: (n1 + n0).(n1 - n0) = 0, so the rule adds no error of its own.
            work += 0.5 * (out.force_on_user_W + force_before).dot(&(hip - hip_before));
        }
    }
    // The god-object rests within 1e-12 of the depth: K * 1e-12 * 5 mm over 0.6 m of path, 1.5e-12 J;
    // friction of 0.001 would cost 1.5e-3 J.
    assert!(work.abs() < 1.5e-12, "{work}");
}

#[test]
fn at_the_centre_the_god_object_is_on_top_and_then_stays_held() {
    let entity = ball(R, Friction::coulomb(0.5).unwrap());
    let mut finger = point_finger();
    let out = finger.step(std::slice::from_ref(&entity), &Vector3::zeros(), DT);
    assert_eq!(out.god_object_W, Vector3::new(0.0, R, 0.0));
    assert_eq!(out.force_on_user_W, Vector3::new(0.0, K * R, 0.0));
    // Within rho < r sin(atan mu) no god-object can leave the cone, wherever the HIP goes.
    let mut noise = Noise(4);
    for _ in 0..1000 {
        let hip = on_circle(0.99 * R * 0.5f64.atan().sin(), noise.between(-3.2, 3.2));
        let out = finger.step(std::slice::from_ref(&entity), &hip, DT);
        assert_eq!((out.god_object_W, out.friction), (Vector3::new(0.0, R, 0.0), ContactState::Stick));
    }
}

#[test]
fn a_tiny_ball_passed_in_one_tick_is_not_felt() {
    let entity = ball(1e-4, stiction());
    let mut finger = point_finger();
    finger.step(std::slice::from_ref(&entity), &Vector3::new(-1e-3, 0.0, 0.0), DT);
    assert_eq!(finger.step(std::slice::from_ref(&entity), &Vector3::new(1e-3, 0.0, 0.0), DT).entity, None);
}

/// From a god-object `phi` behind a HIP at `rho`, one tick; (angle left, rounds, state).
fn one_tick(law: &Friction, rho: f64, phi: f64) -> (f64, u32, FrictionState) {
    let sphere = Sphere::new(R).unwrap();
    let mut cone = FrictionCone::new(sphere.nearest(&Vector3::y()));
    let force = cone.update(&sphere, law, &still(on_circle(rho, phi)));
    (phi - god_object_angle(&cone.god_object().point_B), force.rounds, cone.state())
}

#[test]
fn deep_inside_a_slide_ends_within_the_bound_where_one_step_per_round_would_need_hundreds() {
    for rho in [0.5, 0.1, 0.02] {
        let rho = rho * R;
        let (left, rounds, _) = one_tick(&Friction::None, rho, 1.0);
        // Unaccelerated, the angle shrinks by 1 - rho / r per round: 28 / (rho / r) rounds to 1e-12.
        assert!(rounds <= 20, "rho {rho}: {rounds} rounds");
        assert!(left.abs() <= 1e-12 * R / rho, "rho {rho}: {left}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn wherever_it_slides_it_ends_at_the_closed_form(
        rho in 0.02..0.9999f64, mu in 0.0..2.0f64, where_between in 0.0..1.0f64,
    ) {
        let rho = rho * R;
        let Some(end) = sphere_lag(mu, R, rho) else { return Ok(()) };
        let theta = mu.atan();
        // It slides from between the two roots of the excess; near their meeting point the slope
        // vanishes and the end is ill-conditioned.
        let other = std::f64::consts::PI - (end + theta) - theta;
        prop_assume!((end + theta).cos() > 0.05);
        let phi = end + (other - end) * (0.001 + 0.99 * where_between);
        let (left, rounds, state) = one_tick(&Friction::coulomb(mu).unwrap(), rho, phi);
        prop_assert_eq!(state, FrictionState::Slip);
        prop_assert!(rounds < MAX_SLIDE_ROUNDS, "{} rounds", rounds);
        // Rest is a slide of 1e-12 loads; the load is below 2 r, the slope as in the module's docs.
        let slope = rho * (1.0 + mu * mu).sqrt() * (end + theta).cos();
        let tolerance = 2.0 * (1e-12 * 2.0 * R + 1e-15 * R) / slope + 1e-15;
        prop_assert!((left - end).abs() <= tolerance, "{} vs {}, {} rounds", left, end, rounds);
    }
}
