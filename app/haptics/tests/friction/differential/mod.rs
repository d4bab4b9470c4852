//! Every friction law through a finger, against the law's own differential equation.
//!
//! The laws alone are tested elsewhere; here is what joins them to a finger: which way is along, how fast what moves, what is
//! remembered from tick to tick, on a plane, on triangles and on a ball, at 500 Hz, 1 kHz and 4 kHz.
//!
//! Tolerance: where the answer depends on the way alone, a tick is exact, but for a slide's end (1e-12 of the load) and
//! roundings. The others step implicitly: with `z' = v - u(z)`, `u` growing with z, a tick is off by `dt^2 |z''| / 2`, of
//! which the later ones forget as much as `u' dt` of each; summed up that is at most `dt max |z'| / 2 <= dt max(|v|, |u|)`.
//! So the error shrinks as the ticks do, and it must at each of the rates.

mod bonds;
mod branches;
mod equations;
mod ground;
mod motion;
mod slider;
mod told;

use equations::{Pair, all};
use ground::{Drawn, GROUNDS, Ground};
use motion::Motion;
use slider::Slider;

/// Ticks in a second.
const RATES_HZ: [u32; 3] = [500, 1000, 4000];

/// Where a tick is exact: a slide ends within 1e-12 of 5 mm, of which a ball's slope makes a little more.
const EXACT_M: f64 = 2e-14;

/// Draws a finger and its oracle along the motion.
fn compare(pair: &Pair, ground: Ground, rate_hz: u32, motion: &Motion) {
    let dt_s = 1.0 / f64::from(rate_hz);
    let mut drawn = Drawn::begin(ground, &pair.friction, dt_s);
    let mut slider = Slider::new(ground);
    for (tick, place) in motion.places(rate_hz).enumerate() {
        let felt = drawn.to(place);
        slider.tick(&*pair.equation, place, dt_s);
        let step_m = slider.highest_speed_m_s * dt_s;
        let tolerance_m = if pair.is_exact { EXACT_M } else { EXACT_M + (1.0 + pair.gain) * step_m };
        let (spring_m, god_m) = (slider.spring_m(&*pair.equation), slider.g);
        let is_near =
            (felt.spring_m - spring_m).abs() <= tolerance_m && (felt.god_m - god_m).abs() <= tolerance_m;
        assert!(
            is_near,
            "{} on {ground:?} at {rate_hz} Hz, {}, tick {tick} (HIP at {place} m): {felt:?}, by the equation a \
             spring of {spring_m} and a god-object at {god_m}; tolerance {tolerance_m} m",
            pair.name, motion.name
        );
    }
}

fn compare_everywhere(motion: &Motion) {
    for pair in all() {
        for ground in GROUNDS {
            RATES_HZ.iter().for_each(|rate_hz| compare(&pair, ground, *rate_hz, motion));
        }
    }
}

#[test]
fn steady_sliding_follows_every_laws_equation_at_every_speed() {
    // Each speed at each of the rates, and each law on each ground at each of them, but not all with all.
    for (number, speed_m_s) in [0.06, 0.1, 0.3, -0.1].into_iter().enumerate() {
        let motion = Motion::steady(speed_m_s);
        for (law, pair) in all().iter().enumerate() {
            for (place, ground) in GROUNDS.into_iter().enumerate() {
                compare(pair, ground, RATES_HZ[(number + law + place) % RATES_HZ.len()], &motion);
            }
        }
    }
}

#[test]
fn when_the_motion_reverses_the_force_follows_every_laws_equation() {
    compare_everywhere(&Motion::reversals());
}

#[test]
fn stopping_and_starting_again_follow_every_laws_equation() {
    compare_everywhere(&Motion::stops());
}

#[test]
fn small_strokes_make_every_laws_own_loops() {
    compare_everywhere(&Motion::strokes());
}

/// What is exact only to first order above, exactly: triangles of a plane are the plane.
#[test]
fn on_triangles_every_law_does_what_it_does_on_the_plane() {
    for pair in all() {
        for motion in [Motion::reversals(), Motion::stops(), Motion::strokes()] {
            let mut fingers =
                [Ground::Plane, Ground::Triangles].map(|ground| Drawn::begin(ground, &pair.friction, 1e-3));
            for (tick, place) in motion.places(1000).enumerate() {
                let [plane, triangles] = fingers.each_mut().map(|finger| finger.to(place));
                let is_same = (plane.spring_m - triangles.spring_m).abs() < EXACT_M
                    && (plane.god_m - triangles.god_m).abs() < EXACT_M
                    && plane.state == triangles.state;
                assert!(is_same, "{}, {}, tick {tick}: {plane:?}, {triangles:?}", pair.name, motion.name);
            }
        }
    }
}

/// The oracle beside what can be written down.
#[test]
fn the_integrated_equations_are_the_closed_forms() {
    use crate::common::DEPTH;
    let integrated = |name: &str, places: &[f64]| {
        let pairs = all();
        let pair = pairs.iter().find(|pair| pair.name == name).expect("a law");
        let mut slider = Slider::new(Ground::Plane);
        places.iter().for_each(|place| slider.tick(&*pair.equation, *place, 1e-3));
        slider.gap_m()
    };
    let z_max_m = 0.5 * DEPTH;
    // Runge and Kutta's steps are 6 um of 2.5 mm, 62 us of 10 ms: off by the fourth power of 6e-3 over 120, of a millimetre.
    let tolerance_m = 1e-13;
    let out: Vec<f64> = (1..=100).map(|tick| 1e-4 * f64::from(tick)).collect();
    let dahl = -z_max_m * (-0.01 / z_max_m).exp_m1();
    assert!((integrated("dahl", &out) - dahl).abs() < tolerance_m);
    let back: Vec<f64> =
        out.iter().copied().chain((1..=20).map(|tick| 0.01 - 1e-4 * f64::from(tick))).collect();
    let reversed = (dahl + z_max_m) * (-2e-3 / z_max_m).exp() - z_max_m;
    assert!((integrated("dahl", &back) - reversed).abs() < tolerance_m);
    // The time constant is 2 s/m * 5 mm = 10 ms; 0.1 m/s for 100 ms.
    let viscous = 2.0 * DEPTH * 0.1 * -(-10.0_f64).exp_m1();
    assert!((integrated("viscous", &out) - viscous).abs() < tolerance_m);
    assert!((integrated("coulomb", &back) - (z_max_m - 2e-3)).abs() < 1e-17 * 64.0);
    assert!((integrated("stiction", &out) - 0.3 * DEPTH).abs() < 1e-17 * 64.0);
}
