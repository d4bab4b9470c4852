//! Curves with two branches: a slide keeps to its own until that ends, and rest begins with the slow one.
//!
//! The curve rises to 0.5 at 10 mm/s, falls to 0.25 at 12 mm/s and rises again. A spring of 0.3 to 0.5 of the load is in balance
//! on both branches: which it is depends on what was before.

use super::equations::Curve;
use super::ground::{Drawn, GROUNDS};
use super::motion::{Motion, UNEVEN};
use super::slider::Slider;
use super::{Pair, RATES_HZ, compare};
use crate::common::DEPTH;
use haptics::{ContactState, Friction};

const POINTS: [(f64, f64); 4] = [(0.0, 0.3), (0.01, 0.5), (0.012, 0.25), (0.5, 0.7)];

fn pair() -> Pair {
    Pair {
        name: "curve of two branches",
        friction: Friction::curve(0.3, &POINTS).unwrap(),
        equation: Curve::linear(0.3, &POINTS, 0.25),
        is_exact: false,
        // A jump may come a tick later.
        gain: 1.0,
    }
}

fn compare_everywhere(name: &str, pieces: &[(f64, u32)]) {
    for ground in GROUNDS {
        RATES_HZ.iter().for_each(|rate_hz| compare(&pair(), ground, *rate_hz, &Motion::new(name, pieces)));
    }
}

/// From rest to the slow branch and along it: 6 mm, of which 2 mm load the spring.
const SLOW: [(f64, u32); 2] = [(0.007, 600), (0.004, 400)];
/// To the fast branch and along it.
const FAST: [(f64, u32); 2] = [(0.2, 80), (0.1, 80)];

#[test]
fn from_rest_it_slides_on_the_slow_branch_and_stays_there() {
    compare_everywhere("slow", &[&SLOW[..], &[(0.009, 300), (0.0, 60), (0.007, 200)]].concat());
}

#[test]
fn past_the_end_of_the_slow_branch_it_slides_on_the_fast_one_and_stays_there() {
    compare_everywhere("fast", &[&SLOW[..], &FAST, &[(0.05, 100), (0.3, 60)]].concat());
}

#[test]
fn a_tick_in_which_the_god_object_rests_does_not_change_the_branch() {
    // Back by less than what sticks, a 50th of 1.25 mm, and on.
    compare_everywhere("a pause", &[&FAST[..], &[(0.0, 60), (-0.002, 2), (0.1, 100)]].concat());
}

/// Back by 0.2 mm, of a gap of 1.25 mm, and on slowly.
const STUCK: [(f64, u32); 4] = [(0.0, 60), (-0.05, 4), (0.0, 20), (0.007, 400)];

#[test]
fn once_stuck_it_begins_with_the_slow_branch_again() {
    let pieces = [&FAST[..], &STUCK].concat();
    compare_everywhere("stuck meanwhile", &pieces);
    let mut drawn = Drawn::begin(super::Ground::Plane, &pair().friction, 1e-3);
    let felt: Vec<_> = Motion::new("", &pieces).places(1000).map(|place| drawn.to(place)).collect();
    assert_eq!(felt[230].state, ContactState::Stick);
    let ratio = felt.last().unwrap().spring_m / DEPTH;
    // The time constant is 20 s/m * 5 mm = 0.1 s: it has not quite got to 0.44.
    assert!((0.42..0.45).contains(&ratio), "on the slow branch: {ratio}");
}

/// The oracle itself, beside the two answers that are possible.
#[test]
fn the_integrated_curve_has_two_answers_at_one_gap() {
    let pair = pair();
    let slid = |pieces: &[(f64, u32)]| {
        let mut slider = Slider::new(super::Ground::Plane);
        Motion::new("", pieces).places(1000).for_each(|place| slider.tick(&*pair.equation, place, 1e-3));
        slider.gap_m() / DEPTH
    };
    let slow = 0.3 + 0.2 * UNEVEN * 0.007 / 0.01;
    let found = slid(&[(0.007, 4000)]);
    // The spring is looked at after the slide of a 16th of a tick: 0.4 um of 5 mm.
    assert!((found - slow).abs() < 1e-4, "{found} {slow}");
    let fast = 0.25 + 0.45 * (UNEVEN * 0.2 - 0.012) / 0.488;
    let found = slid(&[(0.2, 400)]);
    assert!((found - fast).abs() < 3e-3, "13 um: {found} {fast}");
    assert!((slow - fast).abs() < 0.02, "the same spring, at 7 mm/s and at 0.2 m/s");
}
