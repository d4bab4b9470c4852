//! The models with a strain that yields: Dahl, Hayward and Armstrong, LuGre.
//!
//! Their strain is the gap between god-object and surface point, so that a tick in which the HIP moves
//! by h gives closed forms: with `z_max` the strain of sliding and `r = h / z_max`, Dahl's implicit
//! step is `z_n = (z + h) / (1 + r)`, and from rest `z_n = z_max (1 - (1 + r)^-n)`.

use crate::common::*;
use haptics::{Finger, Friction, FrictionLaw, FrictionMemory, FrictionQuery, HaywardArmstrong, Stribeck};
use nalgebra::Vector3;

const MU: f64 = 0.5;
const Z_MAX: f64 = MU * DEPTH;

/// Force against +x over k, along these places of the HIP.
fn strains(law: &Friction, places: impl IntoIterator<Item = f64>) -> Vec<f64> {
    let (entity, mut finger) = ([table(law.clone())], point_finger());
    places.into_iter().map(|x| -step(&mut finger, &entity, x).0 / K).collect()
}

/// Force along x, and the god-object's place.
fn step(finger: &mut Finger, entity: &[haptics::Entity], x: f64) -> (f64, f64) {
    let out = finger.step(entity, &Vector3::new(x, -DEPTH, 0.0), DT);
    assert_eq!(out.force_on_user_W.y, K * DEPTH, "friction does not press");
    (out.force_on_user_W.x, out.god_object_W.x)
}

#[test]
fn from_rest_dahls_force_rises_along_its_exponential() {
    for h in [1e-6, 1e-5, 1e-4, 1e-3, 1.0] {
        let r: f64 = h / Z_MAX;
        for (n, z) in strains(&Friction::dahl(MU).unwrap(), (0..500).map(|n| n as f64 * h)).iter().enumerate()
        {
            let recurrence = -Z_MAX * (-(n as f64) * r.ln_1p()).exp_m1();
            // Every tick rounds a position of up to 500 m or so; the strain forgets that in 1/r ticks.
            let rounding = 1e-16 * n as f64 * h * (1.0 + 1.0 / r) + 1e-12 * Z_MAX;
            assert!((z - recurrence).abs() <= rounding, "{h}, tick {n}: {z}, {recurrence}");
            // The differential equation's own solution: an implicit step of r is off by r/2 of the change.
            let exponential = -Z_MAX * (-(n as f64) * r).exp_m1();
            assert!((z - exponential).abs() <= 0.5 * r * 0.37 * Z_MAX + rounding || r > 1.0);
        }
    }
}

#[test]
fn dahls_loop_is_the_closed_exponential() {
    // Out until it slides, back until it slides the other way, and out again.
    let (h, r) = (1e-5, 1e-5 / Z_MAX);
    let turn = 4000;
    let place = |i: i32| h * f64::from(turn - (i % (2 * turn) - turn).abs());
    let strain = strains(&Friction::dahl(MU).unwrap(), (0..6 * turn).map(place));
    for i in 2 * turn..6 * turn {
        let since = f64::from(i % turn);
        let going_out = (i / turn) % 2 == 0;
        let expected = Z_MAX * (1.0 - 2.0 * (-since * f64::ln_1p(r)).exp());
        let expected = if going_out { expected } else { -expected };
        // After 16 z_max of path each branch is within e^-16 = 1.2e-7 of its end.
        assert!((strain[i as usize] - expected).abs() < 3e-7 * Z_MAX, "tick {i}");
    }
}

#[test]
fn in_noise_the_god_objects_speed_over_the_hips_is_the_strain_over_its_limit() {
    // dw = alpha z |dx|: exact in every tick, since the step is implicit.
    let stick = 0.6;
    let alpha = move |part: f64| ((part - stick) / (1.0 - stick)).max(0.0);
    type Law = (Friction, Box<dyn Fn(f64) -> f64>);
    let laws: [Law; 2] = [
        (Friction::dahl(MU).unwrap(), Box::new(|_| 1.0)),
        (Friction::hayward_armstrong(MU, stick).unwrap(), Box::new(alpha)),
    ];
    for (law, alpha) in laws {
        let (entity, mut finger, mut noise) = ([table(law)], point_finger(), Noise(31));
        let mut before: Option<(Vector3<f64>, Vector3<f64>)> = None;
        let (mut yielded, mut limited) = (0, 0);
        for i in 0..50_000 {
            let hip = Vector3::new(0.03 * (f64::from(i) * 1e-3).sin(), -DEPTH, 0.0) + noise.vector(1e-3);
            let out = finger.step(&entity, &hip, DT);
            let god = out.god_object_W;
            let Some((hip_before, god_before)) = before.replace((hip, god)) else { continue };
            let part = ratio(&out, &Vector3::y()) / MU;
            assert!(part <= 1.0 + 1e-10, "{part}");
            let path =
                (Vector3::new(hip.x, 0.0, hip.z) - Vector3::new(hip_before.x, 0.0, hip_before.z)).norm();
            let expected = alpha(part) * part * path;
            if part > 1.0 - 1e-9 {
                // The load fell: the god-object slid further, to stay within the cone.
                assert!((god - god_before).norm() >= expected - 1e-12);
                limited += 1;
                continue;
            }
            yielded += u32::from(expected > 0.0);
            // A slide ends within 1e-12 of the load; alpha rises by 2.5 per unit of the part.
            assert!(((god - god_before).norm() - expected).abs() < 1e-12 + 1e-11 * path, "tick {i}");
        }
        assert!(yielded > 10_000 && limited < 100, "{yielded} {limited}");
    }
}

#[test]
fn when_the_load_falls_the_strain_is_cut_to_what_it_bears() {
    for law in [
        Friction::dahl(MU).unwrap(),
        Friction::hayward_armstrong(MU, 0.6).unwrap(),
        Friction::lugre(MU, MU, 0.05, 0.0, 0.0).unwrap(),
    ] {
        let (entity, mut finger) = ([table(law)], point_finger());
        for i in 0..2000 {
            step(&mut finger, &entity, f64::from(i) * 1e-4);
        }
        for depth in [0.7 * DEPTH, 0.2 * DEPTH, 0.0] {
            // Lifted straight up: no path along the surface, and yet it must let go.
            let out = finger.step(&entity, &Vector3::new(0.1999, -depth, 0.0), DT);
            let expected = -MU * K * depth;
            assert!((out.force_on_user_W.x - expected).abs() < 1e-12, "{depth}: {}", out.force_on_user_W.x);
        }
    }
}

#[test]
fn below_its_stick_strain_hayward_and_armstrongs_model_is_a_spring() {
    let law = Friction::hayward_armstrong(MU, 0.6).unwrap();
    let amplitude = 0.599 * Z_MAX;
    let entity = [table(law)];
    let mut finger = point_finger();
    for i in 0..10_000 {
        let x = amplitude * (f64::from(i) * 0.01).sin();
        assert_eq!(step(&mut finger, &entity, x), (K * -x, 0.0), "no loop, no slide");
    }
    let (_, god) = step(&mut finger, &entity, 0.7 * Z_MAX);
    assert!(god > 0.0, "beyond, it yields");
    // Also if the law is asked for a slide of such a strain, as on a curved surface it may be.
    let law = HaywardArmstrong::new(MU, 0.6).unwrap();
    let query = FrictionQuery { gap_m: amplitude, load_m: DEPTH, hip_travel_m: 1e-3, ..Default::default() };
    assert_eq!(law.slide(&query, &FrictionMemory::default()), 0.0);
}

#[test]
fn hayward_and_armstrongs_strain_solves_its_implicit_equation_at_every_step_length() {
    for stick in [0.0, 0.3, 0.9, 0.999] {
        for h in [1e-9, 1e-6, 1e-4, 1e-2, 1.0] {
            let law = Friction::hayward_armstrong(MU, stick).unwrap();
            let strain = strains(&law, (0..200).map(|n| n as f64 * h));
            for pair in strain.windows(2) {
                let (before, z) = (pair[0] + h, pair[1]);
                let alpha = ((z / Z_MAX - stick) / (1.0 - stick)).max(0.0) / Z_MAX;
                // Positions of up to 200 h are rounded; near 1 / (1 - stick) = 1000 the slope is steep.
                let tolerance = 1e-13 * (h + Z_MAX) * (1.0 + h / Z_MAX) / (1.0 - stick);
                assert!((before - z - h * alpha * z).abs() <= tolerance, "{stick} {h}: {before} {z}");
                assert!(z <= Z_MAX * (1.0 + 1e-12));
            }
        }
    }
}

#[test]
fn lugre_friction_is_on_the_stribeck_curve_at_every_steady_speed_also_where_it_falls() {
    let curve = Stribeck::new(MU_S, MU_D, 0.05, 0.1).unwrap();
    let law = Friction::lugre(MU_S, MU_D, 0.05, 0.1, 2.0).unwrap();
    for speed in (1..60).map(|i| f64::from(i) * 5e-3) {
        // 40 times the longest strain.
        let ticks = (0.14 / (speed * DT)) as usize + 10;
        let last = *strains(&law, (0..ticks).map(|n| n as f64 * speed * DT)).last().unwrap();
        assert!((last / DEPTH - curve.ratio_at(speed)).abs() < 1e-11, "{speed} m/s");
    }
}

#[test]
fn inside_a_ball_lugres_bristle_is_longer_by_the_god_objects_way_over_the_fingers() {
    let (r, rho, step) = (0.1, 0.1 - DEPTH, 1e-3);
    let curve = Stribeck::new(MU_S, MU_D, 0.05, 0.0).unwrap();
    let (entity, mut finger) =
        ([ball(r, Friction::lugre(MU_S, MU_D, 0.05, 0.0, 0.0).unwrap())], point_finger());
    let mut last = None;
    for i in 0..2000 {
        let hip = on_circle(rho, f64::from(i) * step);
        let out = finger.step(&entity, &hip, DT);
        let normal = out.god_object_W / r;
        // Between the two places of the HIP, as its way and its plane are.
        let cosine = normal.dot(&on_circle(1.0, (f64::from(i) - 0.5) * step));
        last = Some((ratio(&out, &normal), cosine));
    }
    let (found, cosine) = last.unwrap();
    let along_m_s = rho * step * cosine / DT;
    let expected = curve.ratio_at(along_m_s) * r / (rho * cosine);
    // The plane turns by 1e-3 in a tick, the bristle's way and the chord with its square.
    assert!((found / expected - 1.0).abs() < 1e-4, "{found} {expected}");
    assert!((found / curve.ratio_at(along_m_s) - 1.05).abs() < 0.005, "{found}");
}

#[test]
fn lugre_presliding_is_elastic_with_a_closed_loop() {
    let law = Friction::lugre(MU_S, MU_D, 0.05, 0.0, 0.0).unwrap();
    let (amplitude, per_turn) = (0.2 * MU_S * DEPTH, 4000);
    let place = |i: i32| amplitude * (std::f64::consts::TAU * f64::from(i) / f64::from(per_turn)).sin();
    let strain = strains(&law, (0..60 * per_turn).map(place));
    let area = |turn: i32| {
        let piece = |i: i32| strain[i as usize] * (place(i) - place(i - 1));
        (turn * per_turn + 1..=(turn + 1) * per_turn).map(piece).sum::<f64>()
    };
    let (one, next) = (area(57), area(58));
    assert!((one / next - 1.0).abs() < 1e-6, "closed: {one} {next}");
    // Small amplitudes A lose 4/3 A^3 / z_max a turn (Dahl 1976), more exactly as A / z_max -> 0.
    let expected = 4.0 / 3.0 * amplitude.powi(3) / (MU_S * DEPTH);
    assert!((one / expected - 1.0).abs() < 0.1, "{}", one / expected);
    let stiffness = strain[(58 * per_turn + per_turn / 4) as usize] / amplitude;
    assert!((0.85..1.0).contains(&stiffness), "nearly the contact's own: {stiffness}");
}

#[test]
fn lugre_damping_is_that_of_the_strain_and_stays_within_the_cone() {
    let damped = |b| Friction::lugre(MU_S, MU_D, 0.05, 0.0, b).unwrap();
    let speed = 0.01;
    let places = || (0..2000).map(|n| f64::from(n) * speed * DT);
    let (without, with) = (strains(&damped(0.0), places()), strains(&damped(2.0), places()));
    // z' = (z_n - z_(n-1)) / dt, since the step is implicit; the strain itself is the same.
    for n in 1..2000 {
        let rate = (without[n] - without[n - 1]) / DT;
        let room = MU_S * DEPTH - without[n];
        let expected = (2.0 / K * rate).min(room);
        assert!((with[n] - without[n] - expected).abs() < 1e-14, "tick {n}");
    }
    // However fast and damped, and whichever way it turns.
    let law = damped(100.0);
    let (entity, mut finger, mut noise) = ([table(law)], point_finger(), Noise(5));
    for _ in 0..20_000 {
        let sigma = 10f64.powf(noise.between(-6.0, -3.0));
        let hip = Vector3::new(0.0, -DEPTH, 0.0) + noise.vector(sigma);
        let out = finger.step(&entity, &hip, DT);
        assert!(out.entity.is_none() || ratio(&out, &Vector3::y()) <= MU_S * (1.0 + 1e-12));
    }
}
