//! Answers of the laws where a question has no load, no time or no motion, and at the very limit between two answers.

use crate::common::laws::{drift_free, drifting, without_any};
use crate::common::*;
use haptics::{Friction, FrictionCurve, FrictionLaw, FrictionMemory, FrictionQuery, FrictionState, Stribeck};

/// Of a contact that slid. Powers of two, of which products and quotients are exact.
fn slid(gap_m: f64, load_m: f64) -> FrictionQuery {
    FrictionQuery {
        state: FrictionState::Slip,
        gap_m,
        load_m,
        dt_s: 1.0 / 1024.0,
        stiffness_n_per_m: 512.0,
        ..Default::default()
    }
}

fn holds(law: &Friction, query: FrictionQuery) -> bool {
    law.holds(&query, &mut FrictionMemory::default())
}

fn slide(law: &Friction, query: FrictionQuery) -> f64 {
    law.slide(&query, &FrictionMemory::default())
}

/// The next larger number.
fn above(limit: f64) -> f64 {
    f64::from_bits(limit.to_bits() + 1)
}

#[test]
fn without_load_every_law_draws_the_god_object_to_the_surface_point() {
    for (name, law) in drift_free().into_iter().chain(drifting()) {
        for hip_travel_m in [0.0, 1e-5] {
            let asked = FrictionQuery { hip_travel_m, ..slid(1e-3, 0.0) };
            assert_eq!(slide(&law, asked), asked.gap_m, "{name}, the HIP moves by {hip_travel_m} m");
        }
        let back = FrictionQuery { hip_travel_m: 1e-5, gap_along_hip_m: -1e-3, ..slid(1e-3, 0.0) };
        assert_eq!(law.drag_m(&back, &FrictionMemory::default()), 0.0, "{name} drags nothing");
    }
}

#[test]
fn a_load_that_is_not_a_number_is_none_for_laws_with_a_strain() {
    let hayward = ("hayward-armstrong", Friction::hayward_armstrong(0.5, 0.5).unwrap());
    for (name, law) in drifting().into_iter().chain([hayward]) {
        let asked = FrictionQuery { hip_travel_m: 1e-5, ..slid(1e-3, f64::NAN) };
        assert_eq!(slide(&law, asked), asked.gap_m, "{name}");
    }
}

#[test]
fn without_coefficients_nothing_holds_not_even_where_nothing_pulls() {
    for (name, law) in without_any() {
        for state in [FrictionState::Stick, FrictionState::Slip] {
            assert!(!holds(&law, FrictionQuery { state, ..slid(0.0, DEPTH) }), "{name}, {state:?}");
        }
    }
}

#[test]
fn without_load_what_sticks_and_slips_does_not_stick_again() {
    for law in [
        Friction::stiction(0.75, 0.25).unwrap(),
        Friction::reset_integrator(0.75, 0.25, 1.0).unwrap(),
        Friction::fixed_cone(1.0, Some(1.5)).unwrap(),
    ] {
        assert!(!holds(&law, slid(0.0, 0.0)), "{law:?}");
    }
}

#[test]
fn a_fixed_cone_that_slid_sticks_again_only_clearly_inside_its_dynamic_circle() {
    let law = Friction::fixed_cone(1.0, Some(1.5)).unwrap();
    let rim_m = 1.0 / 512.0;
    assert!(holds(&law, slid(0.979 * rim_m, 1e-2)) && !holds(&law, slid(0.981 * rim_m, 1e-2)));
    // Without a static force of its own there is nothing to come back, and no margin.
    let law = Friction::fixed_cone(1.0, None).unwrap();
    assert!(holds(&law, slid(rim_m, 1e-2)) && !holds(&law, slid(above(rim_m), 1e-2)));
}

#[test]
fn where_time_is_unknown_a_curve_is_its_value_at_rest() {
    let (mu_s, load_m) = (0.625, 1.0 / 256.0);
    let curve = FrictionCurve::new(mu_s, &[(0.0, 0.5), (0.1, 0.25)]).unwrap();
    let stribeck = Stribeck::new(mu_s, 0.25, 0.05, 0.125).unwrap();
    for dt_s in [0.0, -1e-3, f64::NAN, f64::INFINITY] {
        for (law, at_rest) in [(Friction::Curve(curve.clone()), 0.5), (Friction::Stribeck(stribeck), mu_s)] {
            // Also where it has got farther than to its rim.
            for (gap_m, travel_m) in [(3e-3, 0.0), (1e-3, 1e-5)] {
                let asked = FrictionQuery { dt_s, travel_m, ..slid(gap_m, load_m) };
                assert_eq!(slide(&law, asked), gap_m - at_rest * load_m, "{law:?}, {dt_s} s");
            }
            let rim_m = mu_s * load_m;
            let asked = |gap_m| FrictionQuery { dt_s, ..slid(gap_m, load_m) };
            assert!(holds(&law, asked(rim_m)) && !holds(&law, asked(above(rim_m))), "{law:?}, {dt_s} s");
        }
    }
}

#[test]
fn karnopps_contact_sticks_again_at_its_speed_itself() {
    let law = Friction::karnopp(0.5, 0.25, 0.0625, 0.0).unwrap();
    let at_its_speed_m = 0.0625 / 1024.0;
    let asked = |hip_travel_m| FrictionQuery { hip_travel_m, ..slid(0.0, DEPTH) };
    assert!(holds(&law, asked(at_its_speed_m)) && !holds(&law, asked(above(at_its_speed_m))));
}

#[test]
fn hayward_and_armstrongs_contact_sticks_up_to_its_stick_strain() {
    let law = Friction::hayward_armstrong(0.5, 0.75).unwrap();
    let (load_m, limit_m) = (1.0 / 256.0, 0.375 / 256.0);
    for state in [FrictionState::Stick, FrictionState::Slip] {
        let asked = |gap_m| FrictionQuery { state, ..slid(gap_m, load_m) };
        assert!(holds(&law, asked(limit_m)) && !holds(&law, asked(above(limit_m))), "{state:?}");
    }
}

/// Static coefficient of [`falling`].
const STATIC: f64 = 0.75;

/// Friction force over normal force at a speed (m/s).
type Ratio = Box<dyn Fn(f64) -> f64>;

/// Laws with a curve that is worth a search, with that curve.
fn falling() -> [(Friction, Ratio); 2] {
    let stribeck = Stribeck::new(STATIC, 0.25, 0.03, 1.0).unwrap();
    let curve = FrictionCurve::new(STATIC, &[(0.0, STATIC), (0.06, 0.3), (1.0, 1.5)]).unwrap();
    [
        (Friction::Stribeck(stribeck), Box::new(move |v| stribeck.ratio_at(v))),
        (Friction::Curve(curve.clone()), Box::new(move |v| curve.ratio_at(v))),
    ]
}

/// Load of those (m): a spring of some of their ratios is in balance at two speeds.
const LOAD_M: f64 = 1.0 / 256.0;

#[test]
fn asked_again_where_it_has_got_to_a_slide_is_what_is_left_to_the_curve() {
    for (law, ratio_at) in falling() {
        let excess = |query: &FrictionQuery| query.gap_m - LOAD_M * ratio_at(query.travel_m / query.dt_s);
        let mut left = 0;
        for i in 0..200 {
            let asked = slid((0.76 + 2e-3 * f64::from(i)) * LOAD_M, LOAD_M);
            let x = slide(&law, asked);
            let there = FrictionQuery { gap_m: asked.gap_m - x, travel_m: x, ..asked };
            // Nothing is searched there any more, so the answer is the excess to the last bit.
            assert!(excess(&there).abs() <= 1e-13 * LOAD_M, "{law:?}, gap {}", asked.gap_m);
            assert_eq!(slide(&law, there), excess(&there), "{law:?}, gap {}", asked.gap_m);
            left += u32::from(excess(&there) != 0.0);
            // Ten times as far from the curve as what counts as on it: a move by the excess would miss by four times that.
            let beside = FrictionQuery { gap_m: there.gap_m + 1e-12 * LOAD_M, ..there };
            let more = slide(&law, beside);
            let then = FrictionQuery { gap_m: beside.gap_m - more, travel_m: x + more, ..asked };
            // Some roundings of a gap.
            assert!(excess(&then).abs() <= 1e-14 * LOAD_M, "{law:?}: {}", excess(&then));
        }
        assert!(left > 20, "{law:?}: {left} with a rounding left");
    }
}

/// What a law remembers that slid at this speed (m/s).
fn having_slid(law: &Friction, speed_m_s: f64) -> FrictionMemory {
    let (asked, mut memory) = (slid(2.0 * LOAD_M, LOAD_M), FrictionMemory::default());
    law.holds(&FrictionQuery { last_travel_m: speed_m_s * asked.dt_s, ..asked }, &mut memory);
    memory
}

#[test]
fn a_slide_that_has_got_part_of_its_way_goes_on_to_the_same_place() {
    for (law, _) in falling() {
        for before_m_s in [0.0, 0.02, 0.3] {
            for i in 1..100 {
                let asked = slid((0.5 + 0.01 * f64::from(i)) * STATIC * LOAD_M, LOAD_M);
                let (memory, start_m) = (having_slid(&law, before_m_s), before_m_s * asked.dt_s);
                let x = law.slide(&asked, &memory);
                // Up to the speed that it had the answer does not depend on where it is.
                let travel_m = 0.875 * start_m.min(x);
                let gap_m = asked.gap_m - travel_m;
                let rest = law.slide(&FrictionQuery { gap_m, travel_m, ..asked }, &memory);
                // Roundings of the gap, and a hundred of them where the curve is nearly as steep as the spring.
                let is_same = (travel_m + rest - x).abs() <= 1e-14 * LOAD_M;
                assert!(is_same, "{law:?}, from {before_m_s} m/s, gap {gap_m}: {x}, {travel_m} and {rest}");
            }
        }
    }
}

#[test]
fn a_contact_that_sticks_forgets_how_fast_it_slid_and_one_that_only_pauses_does_not() {
    for (law, _) in falling() {
        let before = having_slid(&law, 0.3);
        let after = |query: FrictionQuery| {
            let mut memory = before;
            law.holds(&query, &mut memory);
            memory
        };
        let asked = slid(2.0 * LOAD_M, LOAD_M);
        assert_eq!(after(asked), before, "{law:?}: a tick without motion");
        for dt_s in [0.0, f64::NAN] {
            assert_eq!(
                after(FrictionQuery { last_travel_m: 1e-5, dt_s, ..asked }),
                before,
                "{law:?}, {dt_s} s"
            );
        }
        let stuck = FrictionQuery { state: FrictionState::Stick, last_travel_m: 1e-5, ..asked };
        assert_eq!(after(stuck), FrictionMemory::default(), "{law:?}");
    }
}

#[test]
fn at_the_rim_of_the_static_circle_a_slide_goes_on() {
    for (law, ratio_at) in falling() {
        let asked = slid(STATIC * LOAD_M, LOAD_M);
        let x = law.slide(&asked, &having_slid(&law, 0.3));
        let is_fast = x / asked.dt_s > 0.1;
        let excess_m = asked.gap_m - x - LOAD_M * ratio_at(x / asked.dt_s);
        assert!(is_fast && excess_m.abs() < 1e-14 * LOAD_M, "{law:?}: {x} m leave {excess_m} m");
    }
}

#[test]
fn at_the_rim_of_the_static_circle_rest_is_the_smallest_solution_of_a_stribeck_curve() {
    // Which is level there; a curve that falls from rest on is not at rest there.
    let [(law, _), _] = falling();
    assert_eq!(law.slide(&slid(STATIC * LOAD_M, LOAD_M), &having_slid(&law, 0.0)), 0.0);
}

#[test]
fn where_no_slide_is_in_balance_the_god_object_goes_back_to_where_it_was_within_the_circle() {
    for (law, _) in falling() {
        let asked = |gap_m, travel_m| FrictionQuery { travel_m, ..slid(gap_m, LOAD_M) };
        assert_eq!(slide(&law, asked(0.125 * LOAD_M, 1e-5)), -1e-5, "{law:?}");
        // Round a needle it can be farther beyond S than the circle reaches.
        let circle_m = STATIC * LOAD_M;
        assert_eq!(slide(&law, asked(-2.0 * circle_m, 1e-5)), -circle_m, "{law:?}");
    }
}

#[test]
fn a_stribeck_curve_without_a_fall_is_coulomb_friction_with_viscous_friction() {
    let flat = Friction::stribeck(0.5, 0.5, 0.05, 0.25).unwrap();
    let other = Friction::coulomb_viscous(0.5, 0.25).unwrap();
    for i in 0..100 {
        for state in [FrictionState::Stick, FrictionState::Slip] {
            let asked = FrictionQuery { state, travel_m: 1e-6, ..slid(0.01 * f64::from(i) * LOAD_M, LOAD_M) };
            assert_eq!(holds(&flat, asked), holds(&other, asked), "{asked:?}");
            assert_eq!(slide(&flat, asked), slide(&other, asked), "{asked:?}");
        }
    }
}
