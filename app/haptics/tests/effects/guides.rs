//! Guides: nothing along the track, a spring and damper towards it, capture and break-away.

use crate::common::*;
use crate::effects::{Felt, limits, moving, resting};
use haptics::{Guide, Track};
use nalgebra::Vector3;

const K: f64 = 500.0;
const B: f64 = 2.0;
/// Capturing takes 50 ms.
const CAPTURE_TICKS: u32 = 50;

fn v3(x: f64, y: f64, z: f64) -> Vector3<f64> {
    Vector3::new(x, y, z)
}

fn guide(track: Track) -> Guide {
    Guide::new(track, K, B, &limits()).unwrap()
}

/// A line through (0, 0.1, 0), and a unit vector along it.
fn line() -> (Track, Vector3<f64>) {
    (Track::line(v3(0.0, 0.1, 0.0), v3(3.0, 0.0, 4.0)).unwrap(), v3(0.6, 0.0, 0.8))
}

/// A finger that the guide has had for long.
fn held(guide: Guide, at: Vector3<f64>) -> Felt {
    let mut felt = Felt::new(vec![], vec![guide], vec![]);
    for _ in 0..=CAPTURE_TICKS {
        felt.beside(resting(at));
    }
    assert!(felt.state.is_captured(0));
    felt
}

#[test]
fn on_the_line_there_is_no_force_however_fast() {
    let (track, along) = line();
    let mut felt = held(guide(track), v3(0.0, 0.1, 0.0));
    for i in -100..100 {
        let at = v3(0.0, 0.1, 0.0) + along * (f64::from(i) * 1e-3);
        let force = felt.beside(moving(at, along * 0.5));
        // The foot of a point on the line is off it by roundings of 1e-17 m, the velocity's part across by 1e-16.
        assert!(force.norm() < 1e-13, "{i}: {force}");
    }
}

#[test]
fn off_the_line_a_spring_and_a_damper_pull_towards_it_and_nothing_along_it() {
    let (track, along) = line();
    let mut felt = held(guide(track), v3(0.0, 0.1, 0.0));
    let mut noise = Noise(7);
    for _ in 0..1000 {
        let (s, off) = (noise.gaussian() * 0.1, noise.vector(2e-3));
        let (off, v) = (off - along * along.dot(&off), noise.vector(0.05));
        let force = felt.beside(moving(v3(0.0, 0.1, 0.0) + along * s + off, v));
        let across = v - along * along.dot(&v);
        // Positions of up to 0.5 m are rounded to 1e-16, times K; the damper's fade at ends is not of lines.
        assert!((force + off * K + across * B).norm() < 1e-12, "{force}");
        assert!(force.dot(&along).abs() < 1e-12);
    }
}

#[test]
fn a_plane_guides_along_its_normal_alone() {
    let normal = v3(1.0, 2.0, 2.0) / 3.0;
    let point = v3(0.01, 0.0, 0.02);
    let mut felt = held(guide(Track::plane(point, normal * 7.0).unwrap()), point);
    let mut noise = Noise(8);
    for _ in 0..1000 {
        let (at, v) = (point + noise.vector(2e-3), noise.vector(0.05));
        let expected = normal * (-K * normal.dot(&(at - point)) - B * normal.dot(&v));
        assert!((felt.beside(moving(at, v)) - expected).norm() < 1e-13);
    }
}

#[test]
fn a_path_pulls_towards_its_nearest_point() {
    let points = [v3(0.0, 0.0, 0.0), v3(0.1, 0.0, 0.0), v3(0.1, 0.05, 0.0)];
    let mut felt = held(guide(Track::path(&points).unwrap()), points[0]);
    let cases = [
        (v3(0.05, 0.001, 0.002), v3(0.0, 0.001, 0.002)), // on the first piece
        (v3(0.102, 0.03, 0.0), v3(0.002, 0.0, 0.0)),     // on the second
        (v3(0.103, -0.004, 0.0), v3(0.003, -0.004, 0.0)), // beyond its corner
        (v3(-0.003, 0.0, 0.004), v3(-0.003, 0.0, 0.004)), // beyond its beginning
        (v3(0.1, 0.052, 0.001), v3(0.0, 0.002, 0.001)),  // beyond its end
    ];
    for (at, off) in cases {
        // Sums of numbers of 0.1 times K.
        assert!((felt.beside(resting(at)) + off * K).norm() < 1e-13, "{at}");
    }
}

#[test]
fn passing_the_end_of_a_segment_gives_no_step() {
    let points = [v3(0.0, 0.0, 0.0), v3(0.1, 0.0, 0.0)];
    let mut felt = held(guide(Track::path(&points).unwrap()), points[0]);
    let v = v3(0.1, 0.05, 0.0);
    for height in [0.0, 1e-4, 1e-3] {
        let step_m = 1e-6;
        let mut last = felt.beside(moving(v3(0.098, height, 0.0), v));
        for i in 1..8000 {
            let force = felt.beside(moving(v3(0.098 + step_m * f64::from(i), height, 0.0), v));
            // The spring's slope, and the damper's: along the track all of it within about a millimetre.
            assert!((force - last).norm() <= (K + 3.0 * B * 0.1 / 1e-3) * step_m, "{height} {i}");
            last = force;
        }
        // 6 mm beyond: the spring, and the damper along the track all but in full: 36 parts of 38 at least.
        assert!((last.x + K * 0.005999 + B * 0.1).abs() < 0.06 * B * 0.1, "{height}: {last}");
    }
}

#[test]
fn a_deadband_is_felt_from_its_end_on_without_a_step() {
    let deadband = 0.002;
    let guide = guide(Track::plane(Vector3::zeros(), Vector3::y()).unwrap()).with_deadband(deadband).unwrap();
    let mut felt = held(guide, Vector3::zeros());
    let v = Vector3::y() * 0.1;
    assert_eq!(felt.beside(moving(Vector3::y() * 0.0019, v)), Vector3::zeros());
    let expected = |y: f64| {
        let x = ((y - deadband) / deadband).clamp(0.0, 1.0);
        -K * (y - deadband).max(0.0) - B * 0.1 * x * x * (3.0 - 2.0 * x)
    };
    for i in 0..8000 {
        let y = 1e-6 * f64::from(i);
        // A stretch is the difference of numbers of some millimetres.
        assert!((felt.beside(moving(Vector3::y() * y, v)).y - expected(y)).abs() < 1e-14, "{y}");
        assert!((expected(y + 1e-6) - expected(y)).abs() <= (K + 1.5 * B * 0.1 / deadband) * 1e-6 * 1.001);
    }
}

/// Captures within 2 mm, lets go above 2 N: at 4 mm.
fn latch() -> Guide {
    let track = Track::plane(Vector3::zeros(), Vector3::y()).unwrap();
    guide(track).with_capture(0.002).unwrap().with_break_away(2.0).unwrap()
}

#[test]
fn a_guide_captures_near_and_lets_go_further_out() {
    let mut felt = Felt::new(vec![], vec![latch()], vec![]);
    let mut toggles = Vec::new();
    let mut was_captured = false;
    // Twice in from 10 mm and out again, 0.01 mm a tick.
    for tick in 0..4000i32 {
        let y = 1e-5 * f64::from((tick % 2000 - 1000).abs());
        let force = felt.beside(resting(Vector3::y() * y));
        let is_captured = felt.state.is_captured(0);
        if is_captured != was_captured {
            toggles.push((y, is_captured));
        }
        if !is_captured && !was_captured && y > 0.005 {
            assert_eq!(force, Vector3::zeros(), "let go for longer than it takes to fade");
        }
        was_captured = is_captured;
    }
    assert_eq!(toggles.len(), 4, "{toggles:?}");
    for pair in toggles.chunks(2) {
        // To the tick: 0.01 mm.
        assert!(pair[0].1 && (pair[0].0 - 0.002).abs() < 1.01e-5, "{toggles:?}");
        assert!(!pair[1].1 && (pair[1].0 - 0.004).abs() < 1.01e-5, "{toggles:?}");
    }
}

#[test]
fn capturing_and_letting_go_have_no_step() {
    let mut felt = Felt::new(vec![], vec![latch()], vec![]);
    let mut last = 0.0;
    for tick in 0..2000i32 {
        let y = 1e-5 * f64::from((tick - 1000).abs());
        let force = felt.beside(resting(Vector3::y() * y)).y;
        // Letting go takes 20 ticks of 2 N and the little that the spring grows meanwhile; 0.01 mm of the spring.
        assert!((force - last).abs() < 2.2 / 20.0 + K * 1e-5, "{tick}: {last} {force}");
        last = force;
    }
}

#[test]
fn who_is_captured_and_breaks_away_spends_more_than_he_is_given() {
    let mut felt = Felt::new(vec![], vec![latch()], vec![]);
    for speed in [1e-6, 1e-5, 1e-4] {
        let ticks = (0.01 / speed) as i32;
        let (mut given, mut last): (f64, Option<(f64, f64)>) = (0.0, None);
        for tick in 0..2 * ticks {
            let y = speed * f64::from((tick - ticks).abs());
            let force = felt.beside(resting(Vector3::y() * y)).y;
            if let Some((last_y, last_force)) = last {
                given += 0.5 * (force + last_force) * (y - last_y);
            }
            last = Some((y, force));
        }
        // Stretched to 4 mm it takes K 4^2 / 2 = 4 mJ, from 2 mm it gives 1 mJ at most.
        assert!(given < -0.0025, "{speed} m a tick: {given} J");
    }
}

#[test]
fn a_guide_without_break_away_never_lets_go_and_pulls_no_more_than_its_limit() {
    let track = Track::plane(Vector3::zeros(), Vector3::y()).unwrap();
    let guide = guide(track).with_force_limit(3.0).unwrap().with_capture(0.001).unwrap();
    let mut felt = Felt::new(vec![], vec![guide], vec![]);
    for _ in 0..100 {
        assert_eq!(felt.beside(resting(Vector3::y() * 0.0011)), Vector3::zeros(), "not yet captured");
    }
    for _ in 0..100 {
        felt.beside(resting(Vector3::zeros()));
    }
    assert_eq!(felt.beside(resting(Vector3::y() * 0.5)), Vector3::y() * -3.0);
    assert!(felt.state.is_captured(0));
    felt.state.reset();
    assert_eq!(felt.beside(resting(Vector3::y() * 0.5)), Vector3::zeros(), "forgotten");
}
