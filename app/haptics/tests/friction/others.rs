//! Curves, Karnopp's model, bristles, the reset integrator, the fixed cone: what is special to each.

use crate::common::*;
use haptics::{
    Bristles, ContactState, Friction, FrictionCurve, FrictionLaw, FrictionMemory, FrictionQuery,
    FrictionState, ParameterError,
};
use nalgebra::Vector3;

/// Ratio against +x, god-object and state for each place of the HIP along x and depth.
fn along(law: &Friction, hips: impl IntoIterator<Item = (f64, f64)>) -> Vec<(f64, f64, ContactState)> {
    let (entity, mut finger) = ([table(law.clone())], point_finger());
    let mut step = |(x, depth): (f64, f64)| {
        let out = finger.step(&entity, &Vector3::new(x, -depth, 0.0), DT);
        (-out.force_on_user_W.x / out.force_on_user_W.y, out.god_object_W.x, out.friction)
    };
    hips.into_iter().map(&mut step).collect()
}

fn at_depth(places: impl IntoIterator<Item = f64>) -> impl Iterator<Item = (f64, f64)> {
    places.into_iter().map(|x| (x, DEPTH))
}

#[test]
fn karnopps_contact_sticks_again_below_its_speed_and_not_above() {
    let law = Friction::karnopp(MU_S, MU_D, 0.02, 0.0).unwrap();
    for (speed, sticks) in [(0.005, true), (0.0199, true), (0.0201, false), (0.1, false)] {
        let ticks = along(&law, at_depth((0..3000).map(|i| f64::from(i) * speed * DT)));
        let first_slip = ticks.iter().position(|tick| tick.2 == ContactState::Slip).unwrap();
        assert!(ticks[first_slip - 1].0 > MU_S - speed * DT / DEPTH, "borne up to mu_s");
        assert!((ticks[first_slip].0 - MU_D).abs() < 1e-12);
        let stuck = ticks[first_slip..].iter().filter(|tick| tick.2 == ContactState::Stick).count();
        assert_eq!(stuck > 0, sticks, "{speed} m/s");
    }
}

#[test]
//= melder#3.1 type=test
//= melder#3.2 type=test
fn karnopps_test_takes_the_magnitude_of_the_stick_force_and_slips_against_coulomb_friction() {
    let law = Friction::karnopp(MU_S, MU_D, 0.02, 0.1).unwrap();
    for way in [1.0, -1.0] {
        let ticks = along(&law, at_depth((0..4000).map(|i| way * f64::from(i) * 1e-4)));
        // As printed, with f_stick itself, it would break away to one side only,
        assert_eq!(ticks.last().unwrap().2, ContactState::Slip);
        // and slip with the viscous force alone: 0.01 instead of 0.31.
        assert!((ticks.last().unwrap().0 - way * (MU_D + 0.1 * 0.1)).abs() < 1e-11);
    }
}

#[test]
fn the_bristles_mean_and_spread_are_those_of_their_theory() {
    for bonds in [1, 5, 20] {
        let law = Friction::bristle(MU_D, bonds, 7).unwrap();
        // 1/150 of the stretch at which a bond snaps: steps of s lower the mean by s / 4 of it.
        let hips = at_depth((0..400_000).map(|i| f64::from(i) * 1.5e-5));
        let ratios: Vec<f64> = along(&law, hips).iter().skip(2000).map(|tick| tick.0).collect();
        let n = ratios.len() as f64;
        let mean = ratios.iter().sum::<f64>() / n;
        let spread = (ratios.iter().map(|ratio| (ratio - mean).powi(2)).sum::<f64>() / n).sqrt();
        // A bond lives 75 ticks on average: 5300 lives of each. The mean of N bonds is then known to
        // 0.35 / sqrt(5300 N) = 0.5 % (one sigma, N = 1), the spread to about 1 %.
        assert!((mean / MU_D - 1.0).abs() < 0.02, "{bonds} bonds: {mean}");
        let expected = MU_D / (8.0 * bonds as f64).sqrt();
        assert!((spread / expected - 1.0).abs() < 0.06, "{bonds} bonds: {spread}, {expected}");
    }
}

#[test]
fn bristles_are_random_but_the_same_in_every_run() {
    let run = |seed| {
        along(&Friction::bristle(MU_D, 8, seed).unwrap(), at_depth((0..2000).map(|i| f64::from(i) * 1e-5)))
    };
    assert_eq!(run(1), run(1));
    assert_ne!(run(1), run(2));
}

#[test]
fn bristles_of_two_fingers_do_not_rasp_in_step() {
    let law = Friction::bristle(MU_D, 8, 1).unwrap();
    let ratios = |from: f64, step: f64, depth: f64| -> Vec<f64> {
        let ticks = along(&law, (0..4000).map(|i| (from + f64::from(i) * step, depth)));
        ticks.iter().skip(1000).map(|tick| tick.0).collect()
    };
    let correlation = |one: &[f64], other: &[f64]| {
        let of = |a: &[f64], b: &[f64]| -> f64 {
            let mean = |x: &[f64]| x.iter().sum::<f64>() / x.len() as f64;
            a.iter().zip(b).map(|(x, y)| (x - mean(a)) * (y - mean(b))).sum()
        };
        of(one, other) / (of(one, one) * of(other, other)).sqrt()
    };
    let one = ratios(0.0, 1e-5, DEPTH);
    // As fast and a thousandth deeper, or as deep and a thousandth faster.
    for other in [ratios(0.0, 1e-5, DEPTH * 1.001), ratios(0.0, 1.001e-5, DEPTH)] {
        // 3000 ticks are some 27 lives of each of 8 bonds: uncorrelated within 1 / sqrt(27), three times that.
        let together = correlation(&one, &other);
        assert!(together.abs() < 0.6, "{together}");
    }
    // Elsewhere, under the same circumstances, it is the same contact.
    assert!(correlation(&one, &ratios(0.3, 1e-5, DEPTH)) > 0.999);
}

#[test]
fn bristles_that_never_slid_snap_together_at_one_and_a_half_times_the_mean() {
    let ticks =
        along(&Friction::bristle(MU_D, 20, 3).unwrap(), at_depth((0..2300).map(|i| f64::from(i) * 1e-6)));
    let first_slip = ticks.iter().position(|tick| tick.2 == ContactState::Slip).unwrap();
    assert!((ticks[first_slip - 1].0 - 1.5 * MU_D).abs() < 3e-4, "a tick is 2e-4");
    assert!((0.5 * MU_D..MU_D).contains(&ticks[first_slip].0), "0.75 of the mean, +- 1.5 / sqrt(240)");
}

/// Bonds as places on a line, the definition itself, beside the stretches in the memory of the law.
#[test]
fn bristles_follow_bonds_that_are_places_also_when_the_motion_reverses() {
    let (law, bonds, snap) = (Friction::bristle(MU_D, 12, 5).unwrap(), 12, 1.5 * MU_D * DEPTH);
    let mut memory = FrictionMemory::default();
    // S moves; bond i is at S - stretch; the god-object at the mean bond.
    let (mut s, mut god, mut places) = (0.0f64, 0.0f64, [0.0f64; 12]);
    let mut noise = Noise(3);
    let (mut speed, mut crossings, mut snaps) = (1e-5, 0, 0);
    for tick in 0..200_000 {
        if noise.uniform() < 1e-3 {
            speed = noise.between(-3e-5, 3e-5);
        }
        let before = s;
        s += speed;
        crossings += u32::from((s - god) * (before - god) < 0.0);
        let side = if s >= god { 1.0 } else { -1.0 };
        let query = FrictionQuery {
            gap_m: (s - god).abs(),
            load_m: DEPTH,
            hip_travel_m: speed.abs(),
            dt_s: DT,
            ..Default::default()
        };
        let holds = law.holds(&query, &mut memory);
        let is_snapped = |place: &f64| (s - place).abs() > snap * (1.0 + 1e-9);
        let is_whole = |place: &f64| (s - place).abs() < snap * (1.0 - 1e-9);
        if places.iter().any(is_snapped) {
            assert!(!holds, "tick {tick}");
        }
        if places.iter().all(is_whole) {
            assert!(holds, "tick {tick}");
        }
        for (place, stretch) in places.iter_mut().zip(&memory.words[..bonds]) {
            let now = s - side * stretch;
            // Those that are whole have not moved, but for the rounding of many turns.
            let has_moved = (now - *place).abs() > 1e-9;
            assert!(!(holds && has_moved), "tick {tick}: nothing snapped, and yet a bond moved");
            snaps += u32::from(has_moved);
            *place = now;
        }
        if !holds {
            let query = FrictionQuery { state: FrictionState::Slip, ..query };
            god += side * law.slide(&query, &memory);
        }
        let mean = places.iter().sum::<f64>() / bonds as f64;
        assert!((god - mean).abs() < 1e-9, "the god-object is where the mean bond is");
    }
    assert!(crossings > 20 && snaps > 5_000, "{crossings} {snaps}");
}

#[test]
fn bristles_that_snap_against_the_motion_leave_no_more_force_than_there_was() {
    // The load has just fallen, so that the bond bent forwards is the only one too long.
    let law = Bristles::new(MU_D, 3, 1).unwrap();
    let mut memory = FrictionMemory::default();
    memory.words[..3].copy_from_slice(&[-4.6e-4, 4.4e-4, 4.4e-4]);
    let mean = 1.4e-4;
    memory.words[20] = mean;
    let query = FrictionQuery { gap_m: mean, load_m: 1e-3, dt_s: DT, ..Default::default() };
    assert_eq!(law.held_limit_m(&query, &memory), 1.5 * MU_D * 1e-3, "between the two");
    assert!(!law.holds(&query, &mut memory));
    assert_eq!(law.slide(&query, &memory), 0.0, "it is not driven away from S");
    let now: f64 = memory.words[..3].iter().sum::<f64>() / 3.0;
    assert!((now - mean).abs() < 1e-18, "and its bonds agree with where it is");
}

#[test]
fn the_reset_integrator_sticks_again_as_soon_as_the_motion_reverses() {
    let law = Friction::reset_integrator(MU_S, MU_D, 0.0).unwrap();
    // Slides, backs off by a micrometre, and goes on.
    let mut places: Vec<f64> = (0..1000).map(|i| f64::from(i) * 1e-5).collect();
    let last = *places.last().unwrap();
    places.extend([last - 1e-6, last + 1e-3, last + 1.9e-3, last + 2.1e-3]);
    let ticks = along(&law, at_depth(places));
    assert_eq!(ticks[999].2, ContactState::Slip);
    assert!((ticks[999].0 - MU_D).abs() < 1e-12);
    for tick in &ticks[1000..1003] {
        assert_eq!((tick.1, tick.2), (ticks[999].1, ContactState::Stick), "bonded at once, without margin");
    }
    assert!((ticks[1002].0 - (MU_D + 1.9e-3 / DEPTH)).abs() < 1e-12, "and above mu_d");
    assert!(ticks[1003].2 == ContactState::Slip && (ticks[1003].0 - MU_D).abs() < 1e-12, "up to mu_s");
}

#[test]
fn the_reset_integrator_damps_its_strain_while_stuck_only() {
    let law = Friction::reset_integrator(MU_S, MU_D, 2.0).unwrap();
    let speed = 0.02;
    let ticks = along(&law, at_depth((0..1000).map(|i| f64::from(i) * speed * DT)));
    for (i, tick) in ticks.iter().enumerate().skip(1) {
        let spring = i as f64 * speed * DT / DEPTH;
        let damping = 2.0 * speed / (K * DEPTH);
        let expected = if tick.2 == ContactState::Stick { (spring + damping).min(MU_S) } else { MU_D };
        assert!((tick.0 - expected).abs() < 1e-12, "tick {i}: {tick:?}");
    }
    assert!(ticks.iter().any(|tick| tick.2 == ContactState::Slip));
}

#[test]
fn the_fixed_cone_bears_the_same_force_at_every_depth() {
    let (friction, limit) = (1.0, 1.5);
    let law = Friction::fixed_cone(friction, Some(limit)).unwrap();
    for depth in [1e-6, 1e-4, 1e-3, 1e-2] {
        let ticks = along(&law, (0..8000).map(|i| (f64::from(i) * 1e-6, depth)));
        let force = |tick: &(f64, f64, ContactState)| tick.0 * K * depth;
        let first_slip = ticks.iter().position(|tick| tick.2 == ContactState::Slip).unwrap();
        // One micrometre is 0.5 mN.
        assert!((force(&ticks[first_slip - 1]) - limit).abs() < 6e-4, "depth {depth}");
        assert!(ticks[first_slip..].iter().all(|tick| (force(tick) - friction).abs() < 1e-12));
    }
    // Pressed harder in the middle of it, nothing changes; without any pressure there is no friction.
    let pressed = along(&law, [(0.0, 1e-3), (2e-3, 1e-3), (2e-3, 5e-2), (2e-3, 0.0)]);
    assert!(pressed[..3].iter().all(|tick| tick.1 == 0.0 && tick.2 == ContactState::Stick));
    assert_eq!(pressed[3].1, 2e-3, "let go");
}

#[test]
fn a_contact_that_sticks_lies_within_the_circle_of_its_model() {
    // 2.5 N at 500 N/m.
    let (load_m, stiffness_n_per_m) = (5e-3, 500.0);
    let curve = [(0.0, 0.3), (0.1, 0.2)];
    for (model, circle_m) in [
        (Ok(Friction::None), 0.0),
        (Friction::coulomb(0.5), 2.5e-3),
        (Friction::stiction(0.7, 0.3), 3.5e-3),
        (Friction::viscous(2.0), 0.0),
        (Friction::coulomb_viscous(0.4, 2.0), 2e-3),
        (Friction::stribeck(0.6, 0.3, 0.1, 1.0), 3e-3),
        (Friction::curve(0.6, &curve), 3e-3),
        (Friction::karnopp(0.6, 0.3, 0.1, 1.0), 3e-3),
        (Friction::dahl(0.5), 2.5e-3),
        (Friction::hayward_armstrong(0.5, 0.6), 2.5e-3),
        (Friction::lugre(0.6, 0.3, 0.1, 1.0, 1.0), 3e-3),
        (Friction::reset_integrator(0.6, 0.3, 1.0), 3e-3),
        (Friction::bristle(0.5, 5, 7), 3.75e-3),
        (Friction::fixed_cone(1.0, Some(1.5)), 3e-3),
        (Friction::fixed_cone(1.0, None), 2e-3),
    ] {
        let model = model.expect("in range");
        let found_m = model.circle_m(load_m, stiffness_n_per_m).expect("a model of ours");
        // The rounding of a product.
        assert!((found_m - circle_m).abs() <= f64::EPSILON * circle_m, "{model:?}: {found_m}");
    }
    assert_eq!(Friction::own(Friction::coulomb(0.5).expect("in range")).circle_m(load_m, 500.0), None);
}

#[test]
fn a_curve_is_what_it_was_drawn_from() {
    let points = [(0.0, 0.3), (0.1, 0.2), (0.3, 0.4)];
    let curve = FrictionCurve::new(0.6, &points).expect("in range");
    assert_eq!((curve.mu_s(), curve.points()), (0.6, &points[..]));
    for (speed_m_s, ratio) in [(0.0, 0.3), (0.05, 0.25), (-0.05, 0.25), (0.1, 0.2), (0.2, 0.3), (9.0, 0.4)] {
        // The rounding of an interpolation.
        assert!((curve.ratio_at(speed_m_s) - ratio).abs() < 1e-15, "{speed_m_s} m/s");
    }
}

#[test]
fn a_curve_that_begins_with_zero_draws_a_god_object_that_went_too_far_back_to_the_surface_point() {
    let law = FrictionCurve::new(0.3, &[(0.0, 0.0), (1.0, 0.3)]).expect("in range");
    // Round a needle a slide can pass S by more than all of its way; nothing holds it back there.
    let asked = FrictionQuery {
        state: FrictionState::Slip,
        gap_m: -2e-4,
        travel_m: 1e-4,
        load_m: DEPTH,
        dt_s: DT,
        ..Default::default()
    };
    assert_eq!(law.slide(&asked, &FrictionMemory::default()), asked.gap_m);
}

#[test]
fn a_curve_that_never_falls_sticks_again_at_once_and_one_that_falls_with_a_margin() {
    let holds_within_a_thousandth = |mu_s: f64, points: &[(f64, f64)]| {
        let law = FrictionCurve::new(mu_s, points).expect("in range");
        let asked = |gap_m: f64| FrictionQuery {
            state: FrictionState::Slip,
            gap_m,
            load_m: DEPTH,
            dt_s: DT,
            ..Default::default()
        };
        let rim_m = points[0].1 * DEPTH;
        assert!(law.holds(&asked(0.9 * rim_m), &mut FrictionMemory::default()), "{points:?}");
        law.holds(&asked(0.999 * rim_m), &mut FrictionMemory::default())
    };
    assert!(holds_within_a_thousandth(0.3, &[(0.0, 0.3)]));
    assert!(holds_within_a_thousandth(0.3, &[(0.0, 0.3), (0.1, 0.5)]));
    assert!(!holds_within_a_thousandth(0.6, &[(0.0, 0.3), (0.1, 0.5)]));
}

#[test]
fn constructors_refuse_what_no_material_has() {
    for bad in [-1e-9, f64::NAN, f64::INFINITY] {
        for refused in [
            Friction::stribeck(bad, 0.0, 1.0, 0.0),
            Friction::stribeck(0.5, bad, 1.0, 0.0),
            Friction::stribeck(0.5, 0.3, bad, 0.0),
            Friction::stribeck(0.5, 0.3, 1.0, bad),
            Friction::karnopp(0.5, 0.3, bad, 0.0),
            Friction::karnopp(0.5, bad, 0.1, 0.0),
            Friction::karnopp(0.5, 0.3, 0.1, bad),
            Friction::dahl(bad),
            Friction::hayward_armstrong(bad, 0.5),
            Friction::hayward_armstrong(0.5, bad),
            Friction::lugre(0.5, 0.3, 0.1, 0.0, bad),
            Friction::bristle(bad, 5, 0),
            Friction::reset_integrator(0.5, bad, 0.0),
            Friction::reset_integrator(0.5, 0.3, bad),
            Friction::fixed_cone(bad, None),
            Friction::fixed_cone(0.5, Some(bad)),
            Friction::curve(bad, &[(0.0, 0.1)]),
            Friction::curve(0.5, &[(0.0, bad)]),
            Friction::curve(0.5, &[(0.0, 0.1), (bad, 0.1)]),
        ] {
            let message = refused.expect_err("out of range").to_string();
            assert!(message.contains(&bad.to_string()) && message.contains("allowed"), "{message}");
        }
    }
    let below = Err(ParameterError::StaticBelowDynamic { mu_s: 0.2, mu_d: 0.3 });
    assert_eq!(Friction::stribeck(0.2, 0.3, 0.1, 0.0), below);
    assert_eq!(Friction::karnopp(0.2, 0.3, 0.1, 0.0), below);
    assert_eq!(Friction::lugre(0.2, 0.3, 0.1, 0.0, 0.0), below);
    assert_eq!(Friction::reset_integrator(0.2, 0.3, 0.0), below);
    assert_eq!(Friction::curve(0.2, &[(0.0, 0.3)]), below);
    for refused in [
        Friction::stribeck(0.5, 0.3, 0.0, 0.0),
        Friction::karnopp(0.5, 0.3, 0.0, 0.0),
        Friction::hayward_armstrong(0.5, 1.0),
        Friction::bristle(0.5, 0, 0),
        Friction::bristle(0.5, 21, 0),
        Friction::fixed_cone(0.5, Some(0.4)),
        Friction::curve(0.5, &[]),
        Friction::curve(0.5, &[(0.0, 0.1); 65]),
        Friction::curve(0.5, &[(0.1, 0.1)]),
    ] {
        assert!(refused.is_err(), "{refused:?}");
    }
    let message = Friction::curve(0.5, &[(0.0, 0.1), (0.0, 0.2)]).unwrap_err().to_string();
    let expected = "point 1 of the curve is (0 m/s, 0.2); allowed are speeds that begin with 0 and increase";
    assert_eq!(message, expected);
}
