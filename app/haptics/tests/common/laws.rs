//! Friction of every kind: one of each, and any.

use haptics::{Friction, FrictionLaw, FrictionQuery};
use proptest::prelude::*;

use super::{K, MU_D, MU_S};

/// Every model that does not drift under noise, each bearing at least 0.7 times a depth of 5 mm.
pub(crate) fn drift_free() -> Vec<(&'static str, Friction)> {
    let curve = [(0.0, MU_S), (0.02, 0.4), (0.1, MU_D), (1.0, 0.5)];
    vec![
        ("coulomb", Friction::coulomb(MU_S).unwrap()),
        ("stiction", Friction::stiction(MU_S, MU_D).unwrap()),
        ("coulomb-viscous", Friction::coulomb_viscous(MU_S, 0.5).unwrap()),
        ("stribeck", Friction::stribeck(MU_S, MU_D, 0.05, 0.1).unwrap()),
        ("curve", Friction::curve(MU_S, &curve).unwrap()),
        ("karnopp", Friction::karnopp(MU_S, MU_D, 0.02, 0.1).unwrap()),
        // Holds up to 0.9 of its coefficient.
        ("hayward-armstrong", Friction::hayward_armstrong(MU_S / 0.9, 0.9).unwrap()),
        ("bristle", Friction::bristle(MU_S, 20, 1).unwrap()),
        ("reset integrator", Friction::reset_integrator(MU_S, MU_D, 1.0).unwrap()),
        ("fixed cone", Friction::fixed_cone(0.75, Some(1.75)).unwrap()),
    ]
}

pub(crate) fn drifting() -> Vec<(&'static str, Friction)> {
    vec![
        ("dahl", Friction::dahl(MU_S).unwrap()),
        ("lugre", Friction::lugre(MU_S, MU_D, 0.05, 0.1, 0.5).unwrap()),
    ]
}

/// Every model with all coefficients zero.
pub(crate) fn without_any() -> Vec<(&'static str, Friction)> {
    vec![
        ("coulomb", Friction::coulomb(0.0).unwrap()),
        ("stiction", Friction::stiction(0.0, 0.0).unwrap()),
        ("viscous", Friction::viscous(0.0).unwrap()),
        ("coulomb-viscous", Friction::coulomb_viscous(0.0, 0.0).unwrap()),
        ("stribeck", Friction::stribeck(0.0, 0.0, 0.05, 0.0).unwrap()),
        ("curve", Friction::curve(0.0, &[(0.0, 0.0), (0.1, 0.0)]).unwrap()),
        ("karnopp", Friction::karnopp(0.0, 0.0, 0.02, 0.0).unwrap()),
        ("dahl", Friction::dahl(0.0).unwrap()),
        ("hayward-armstrong", Friction::hayward_armstrong(0.0, 0.5).unwrap()),
        ("lugre", Friction::lugre(0.0, 0.0, 0.05, 0.0, 5.0).unwrap()),
        ("bristle", Friction::bristle(0.0, 20, 1).unwrap()),
        ("reset integrator", Friction::reset_integrator(0.0, 0.0, 5.0).unwrap()),
        ("fixed cone", Friction::fixed_cone(0.0, None).unwrap()),
    ]
}

/// The largest ratio of tangential to normal force that the law allows at this normal force, where that
/// does not depend on speed.
pub(crate) fn largest_ratio(friction: &Friction, normal_force_n: f64) -> Option<f64> {
    match friction {
        Friction::Viscous { mu_v_s_per_m } | Friction::CoulombViscous { mu_v_s_per_m, .. }
            if *mu_v_s_per_m > 0.0 =>
        {
            return None;
        }
        Friction::Stribeck(law) if law.ratio_at(1e12) > law.ratio_at(0.0) => return None,
        Friction::Karnopp(law) if law.ratio_at(1.0) > law.ratio_at(0.0) => return None,
        Friction::LuGre(law) if law.ratio_at(1e12) > law.ratio_at(0.0) => return None,
        Friction::Curve(law) => {
            return Some(law.points().iter().map(|point| point.1).fold(law.mu_s(), f64::max));
        }
        _ => {}
    }
    let load_m = normal_force_n / K;
    let query = FrictionQuery { load_m, stiffness_n_per_m: K, dt_s: 1e-3, ..Default::default() };
    Some(if load_m > 0.0 {
        friction.held_limit_m(&query, &haptics::FrictionMemory::default()) / load_m
    } else {
        0.0
    })
}

/// Any friction with parameters from nothing to far beyond any material's.
pub(crate) fn any_friction() -> impl Strategy<Value = Friction> {
    let mu = || prop_oneof![1 => Just(0.0), 4 => 0.0..3.0f64];
    let mu_v = || prop_oneof![Just(0.0), (-3.0..6.0f64).prop_map(|e| 10f64.powf(e))];
    let part = || prop_oneof![Just(0.0), Just(1.0), 0.0..=1.0f64];
    let speed = || (-5.0..2.0f64).prop_map(|e| 10f64.powf(e));
    let points = prop::collection::vec((1e-4..0.5f64, 0.0..3.0f64), 1..8);
    prop_oneof![
        Just(Friction::None),
        mu().prop_map(|mu| Friction::Coulomb { mu }),
        (mu(), part()).prop_map(|(mu_s, part)| Friction::Stiction { mu_s, mu_d: mu_s * part }),
        mu_v().prop_map(|mu_v_s_per_m| Friction::Viscous { mu_v_s_per_m }),
        (mu(), mu_v()).prop_map(|(mu, mu_v_s_per_m)| Friction::CoulombViscous { mu, mu_v_s_per_m }),
        (mu(), part(), speed(), mu_v()).prop_map(|(mu_s, part, v_s, mu_v)| Friction::stribeck(
            mu_s,
            mu_s * part,
            v_s,
            mu_v
        )
        .unwrap()),
        (mu(), points).prop_map(|(above, points)| any_curve(above, &points)),
        (mu(), part(), speed(), mu_v()).prop_map(|(mu_s, part, v, mu_v)| Friction::karnopp(
            mu_s,
            mu_s * part,
            v,
            mu_v
        )
        .unwrap()),
        mu().prop_map(|mu| Friction::dahl(mu).unwrap()),
        (mu(), 0.0..0.999f64).prop_map(|(mu, part)| Friction::hayward_armstrong(mu, part).unwrap()),
        (mu(), part(), speed(), mu_v(), 0.0..20.0f64).prop_map(|(mu, part, v_s, mu_v, b)| Friction::lugre(
            mu,
            mu * part,
            v_s,
            mu_v,
            b
        )
        .unwrap()),
        (mu(), 1..=20usize, any::<u64>())
            .prop_map(|(mu, bonds, seed)| Friction::bristle(mu, bonds, seed).unwrap()),
        (mu(), part(), 0.0..20.0f64)
            .prop_map(|(mu, part, b)| Friction::reset_integrator(mu, mu * part, b).unwrap()),
        (0.0..5.0f64, mu())
            .prop_map(|(force, more)| Friction::fixed_cone(force, Some(force + more)).unwrap()),
    ]
}

/// From steps of speed and ratios.
fn any_curve(above: f64, steps: &[(f64, f64)]) -> Friction {
    let mut speed = 0.0;
    let mut points = Vec::new();
    for (step, mu) in steps {
        points.push((speed, *mu));
        speed += step;
    }
    Friction::curve(points[0].1 + above, &points).unwrap()
}
