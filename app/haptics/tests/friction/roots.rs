//! Which solution a slide takes where the curve of friction falls with speed.
//!
//! The oracle is the definition: walk from the speed before, upwards while the spring pulls more than
//! friction holds and downwards while it pulls less; the first change of sign is the solution.

use crate::common::*;
use haptics::{ContactState, Friction, FrictionCurve, FrictionLaw, FrictionMemory, FrictionQuery};
use haptics::{FrictionState, Stribeck};
use nalgebra::Vector3;

/// A law that knows its own curve.
struct Case {
    law: Friction,
    mu_s: f64,
    ratio_at: Box<dyn Fn(f64) -> f64>,
}

fn any_case(noise: &mut Noise) -> Case {
    let mu_s = noise.between(0.1, 1.5);
    if noise.uniform() < 0.5 {
        let v_s = 10f64.powf(noise.between(-4.0, 1.0));
        let mu_v = if noise.uniform() < 0.5 { 0.0 } else { noise.between(0.0, 2.0) };
        let law = Stribeck::new(mu_s, mu_s * noise.uniform(), v_s, mu_v).unwrap();
        return Case { law: Friction::Stribeck(law), mu_s, ratio_at: Box::new(move |v| law.ratio_at(v)) };
    }
    let mut points = vec![(0.0, mu_s * noise.between(0.2, 1.0))];
    for _ in 0..(noise.uniform() * 8.0) as usize {
        let speed = points.last().unwrap().0 + 10f64.powf(noise.between(-3.0, 0.5));
        points.push((speed, noise.between(0.0, 1.5)));
    }
    let law = FrictionCurve::new(mu_s, &points).unwrap();
    Case { law: Friction::Curve(law.clone()), mu_s, ratio_at: Box::new(move |v| law.ratio_at(v)) }
}

/// What a contact is asked that slid at `before_m_s`, and its answer: the move, or `None` to hold.
fn asked(law: &Friction, gap_m: f64, load_m: f64, before_m_s: f64) -> Option<f64> {
    let state = if before_m_s > 0.0 { FrictionState::Slip } else { FrictionState::Stick };
    let query = FrictionQuery {
        state,
        gap_m,
        load_m,
        dt_s: DT,
        last_travel_m: before_m_s * DT,
        ..Default::default()
    };
    let mut memory = FrictionMemory::default();
    let holds = law.holds(&query, &mut memory);
    (!holds).then(|| law.slide(&FrictionQuery { state: FrictionState::Slip, ..query }, &memory))
}

#[test]
//= melder#4.8 type=test
fn it_is_the_first_one_met_from_the_speed_before() {
    let mut noise = Noise(7);
    let (mut held, mut near, mut far) = (0, 0, 0);
    for _ in 0..20_000 {
        let case = any_case(&mut noise);
        let load = 10f64.powf(noise.between(-5.0, -1.5));
        let before = if noise.uniform() < 0.4 { 0.0 } else { 10f64.powf(noise.between(-5.0, 1.0)) };
        let gap = load * noise.between(0.0, 2.0) + if noise.uniform() < 0.3 { before * DT } else { 0.0 };
        let pull = |x: f64| gap - x - load * (case.ratio_at)(x / DT);
        let start = before * DT;
        let answer = asked(&case.law, gap, load, before);
        // Held, or let rest in slip: walking down there is no solution.
        let Some(x) = answer.filter(|x| *x != 0.0) else {
            held += 1;
            assert!(gap <= case.mu_s * load, "nothing is held that the spring can move");
            for i in 0..500 {
                // Sticking again takes no more than the solutions that the margin gives away.
                assert!(start == 0.0 || pull(start * f64::from(i) / 500.0) <= 1e-15 + 1e-13 * load);
            }
            continue;
        };
        assert!(x > 0.0 && x <= gap * (1.0 + 1e-15), "{x} of {gap}");
        // Either to rounding, or, where the curve is so steep that a rounding of x shows, on both sides.
        let is_between = pull(x * (1.0 - 1e-12)) >= 0.0 && pull(x * (1.0 + 1e-12)) <= 0.0;
        assert!(is_between || pull(x).abs() <= 1e-14 * gap + 1e-13 * load, "{x} solves: {}", pull(x));
        // The steps end 1e-6 before it, where rounding and the slope of the curve cannot decide.
        for i in 0..500 {
            let between = start + (x - start) * (1.0 - 1e-6) * f64::from(i) / 500.0;
            let towards = pull(between) * (x - start).signum();
            assert!(towards >= -1e-14 * gap, "passed over {between} on the way from {start} to {x}");
        }
        if x / DT < 0.3 * before.max(1e-3) { near += 1 } else { far += 1 }
    }
    assert!(held > 1000 && near > 300 && far > 5000, "{held} {near} {far}");
}

/// The god-object's place after each of these HIP positions, and its state.
fn along(law: &Friction, places: impl IntoIterator<Item = f64>) -> Vec<(f64, f64, ContactState)> {
    let entity = [table(law.clone())];
    let mut finger = point_finger();
    let mut step = |x| {
        let out = finger.step(&entity, &Vector3::new(x, -DEPTH, 0.0), DT);
        (out.god_object_W.x, -out.force_on_user_W.x / out.force_on_user_W.y, out.friction)
    };
    places.into_iter().map(&mut step).collect()
}

#[test]
fn from_rest_it_breaks_away_with_the_least_jump() {
    // Slowly past the static rim it creeps on the steep curve; faster, there is no solution near rest.
    let law = Friction::stribeck(MU_S, MU_D, 0.05, 0.0).unwrap();
    let rim = MU_S * DEPTH;
    let creeping = along(&law, [0.0, rim + 1e-8])[1];
    assert!(creeping.0 > 0.0 && creeping.0 < 2e-8, "{creeping:?}");
    let jumping = along(&law, [0.0, rim + 1e-6])[1];
    assert!((jumping.1 - MU_D).abs() < 1e-12, "all of the fall in one tick: {jumping:?}");
}

#[test]
fn a_tick_without_motion_does_not_stop_a_slide_but_backing_off_does() {
    // Encoders that do not count in every tick: 6 um steps at 3 mm/s. v_s is slower still.
    let curve = [(0.0, MU_S), (1e-4, MU_D), (1.0, MU_D)];
    for law in [Friction::stribeck(MU_S, MU_D, 1e-4, 0.0).unwrap(), Friction::curve(MU_S, &curve).unwrap()] {
        let hip = |i: usize| MU_S * DEPTH + (i as f64 * 3e-6 / 6e-6).floor() * 6e-6;
        let mut places: Vec<f64> = std::iter::once(0.0).chain((0..1000).map(hip)).collect();
        let at_rest = *places.last().unwrap() - MU_D * DEPTH;
        let slid = along(&law, places.iter().copied());
        assert!(slid[10..].iter().all(|tick| tick.2 == ContactState::Slip && tick.1 <= MU_D + 1.3e-3));
        let back = |part: f64| at_rest + MU_D * DEPTH * (1.0 - part);
        places.extend([back(0.015), back(0.025), at_rest + 0.69 * DEPTH]);
        let after = &along(&law, places)[1001..];
        assert_eq!(after[0].2, ContactState::Slip, "within the margin");
        assert_eq!(after[1].2, ContactState::Stick, "beyond");
        assert_eq!((after[2].0, after[2].2), (after[1].0, ContactState::Stick), "and bears mu_s again");
        assert!((after[2].1 - 0.69).abs() < 3e-3, "{after:?}");
    }
}

#[test]
fn dragged_where_the_curve_falls_steeply_it_sticks_and_slips_by_turns() {
    let law = Friction::stribeck(MU_S, MU_D, 0.05, 0.0).unwrap();
    let ticks = along(&law, (0..20_000).map(|i| f64::from(i) * 1e-5));
    let peaks = ticks.windows(2).filter(|w| w[0].2 == ContactState::Stick && w[1].2 == ContactState::Slip);
    let peaks: Vec<f64> = peaks.map(|w| w[0].1).collect();
    // 0.2 m of path over (mu_s - mu_d) 5 mm = 2 mm a turn.
    assert!((95..=101).contains(&peaks.len()), "{}", peaks.len());
    assert!(peaks.iter().all(|peak| *peak > MU_S - 2.1e-3 && *peak <= MU_S + 1e-12));
}

#[test]
fn no_viscous_coefficient_makes_a_slide_chatter() {
    for mu_v in [1e-3, 0.1, 0.25, 1.0, 10.0, 1e3, 1e6] {
        let points = [(0.0, 0.3), (1e3, 0.3 + mu_v * 1e3)];
        for law in [
            Friction::stribeck(0.3, 0.3, 0.05, mu_v).unwrap(),
            Friction::stribeck(0.3001, 0.3, 1.0, mu_v).unwrap(),
            Friction::karnopp(0.3, 0.3, 1e-3, mu_v).unwrap(),
            Friction::curve(0.3, &points).unwrap(),
        ] {
            let ratios = along(&law, (0..3000).map(|i| 0.31 * DEPTH + f64::from(i) * 1e-4));
            for pair in ratios[2..].windows(2) {
                // Positions of up to 0.3 m are rounded to 6e-17, a slide to 1e-12 of the depth.
                assert!(pair[1].1 >= pair[0].1 - 5e-12, "mu_v {mu_v}: {:?} {:?}", pair[0], pair[1]);
            }
        }
    }
}

/// Both laws along the same random path, on a plane and on a ball.
fn largest_difference(a: &Friction, b: &Friction, step: f64) -> f64 {
    let mut largest: f64 = 0.0;
    for (a, b) in [(table(a.clone()), table(b.clone())), (ball(0.1, a.clone()), ball(0.1, b.clone()))] {
        let (mut fingers, mut noise) = ((point_finger(), point_finger()), Noise(12));
        let top = if a.shape == table(Friction::None).shape { 0.0 } else { 0.1 };
        let mut hip = Vector3::new(0.0, top - DEPTH, 0.0);
        for _ in 0..20_000 {
            hip += noise.vector(step);
            hip += (Vector3::new(0.0, top - DEPTH, 0.0) - hip) * 0.01;
            let one = fingers.0.step(std::slice::from_ref(&a), &hip, DT);
            let other = fingers.1.step(std::slice::from_ref(&b), &hip, DT);
            largest = largest.max((one.god_object_W - other.god_object_W).norm());
            largest = largest.max((one.force_on_user_W - other.force_on_user_W).norm() / K);
        }
    }
    largest
}

#[test]
fn drawn_as_a_curve_the_classical_models_are_what_they_were() {
    let coulomb = Friction::coulomb(0.4).unwrap();
    let constant = Friction::curve(0.4, &[(0.0, 0.4)]).unwrap();
    assert!(largest_difference(&coulomb, &constant, 2e-4) < 1e-16, "a rounding of 0.1 m");
    let viscous = Friction::coulomb_viscous(0.4, 0.3).unwrap();
    let straight = Friction::curve(0.4, &[(0.0, 0.4), (100.0, 30.4)]).unwrap();
    // Each slide ends within 1e-12 of the load, and 20,000 of them wander apart.
    assert!(largest_difference(&viscous, &straight, 2e-4) < 1e-12);
    let unstribeck = Friction::stribeck(0.4, 0.4, 0.05, 0.3).unwrap();
    assert_eq!(largest_difference(&viscous, &unstribeck, 2e-4), 0.0);
    let uncone = Friction::karnopp(0.4, 0.4, 1e6, 0.3).unwrap();
    assert_eq!(largest_difference(&viscous, &uncone, 2e-4), 0.0, "always slow, it sticks as Coulomb does");
}

#[test]
fn a_stribeck_curve_drawn_in_fine_points_is_the_stribeck_curve() {
    // Flat enough to be slid on everywhere: v_s = 4 m/s, steps of at most 1 m/s.
    let law = Stribeck::new(MU_S, MU_D, 4.0, 0.02).unwrap();
    let points: Vec<(f64, f64)> =
        (0..64).map(|i| f64::from(i) * 0.05).map(|v| (v, law.ratio_at(v))).collect();
    let drawn = Friction::curve(MU_S, &points).unwrap();
    // A chord is off by at most (mu_s - mu_d) / v_s^2 (0.05 m/s)^2 / 4 = 1.6e-5, times 5 mm.
    let difference = largest_difference(&Friction::Stribeck(law), &drawn, 2e-4);
    assert!(difference > 0.0 && difference < 8e-8 * 4.0, "{difference}");
}

#[test]
fn a_stribeck_curve_that_falls_at_once_is_stiction() {
    let places = || (0..40_000).map(|i| 0.02 * (f64::from(i) * 2e-4).sin());
    let stiction = along(&stiction(), places());
    let stribeck = along(&Friction::stribeck(MU_S, MU_D, 1e-7, 0.0).unwrap(), places());
    let both = |state| stiction.iter().filter(|tick| tick.2 == state).count();
    assert!(both(ContactState::Stick) > 1000 && both(ContactState::Slip) > 10_000);
    for (a, b) in stiction.iter().zip(&stribeck) {
        // The fall takes some v_s dt, 1e-10 m.
        assert!((a.0 - b.0).abs() < 1e-9 && (a.2 == b.2), "{a:?} {b:?}");
    }
}
