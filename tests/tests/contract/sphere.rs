//! Balls, felt through scene file, hand file and recording alone.

use nalgebra::Vector3;
use system_tests::recording::Sample;
use system_tests::workplace::{felt, hand};

const RADIUS_M: f64 = 0.05;
/// Nothing about it is round, so that every sum rounds.
const CENTRE: Vector3<f64> = Vector3::new(-0.083, 0.061, 0.017);
/// Sliding ratios are promised to nine digits.
const RATIO_TOLERANCE: f64 = 1e-9;

fn ball(friction: &str, finger_radius_m: f64) -> String {
    format!(
        "[[finger]]\nradius_m = {finger_radius_m:?}\nstart_m = [-0.083, 0.2, 0.017]\n\
         [[entity]]\nname = \"ball\"\nshape = {{ kind = \"sphere\", radius_m = {RADIUS_M:?} }}\n\
         position_m = {:?}\nstiffness_n_per_m = 800.0\n{friction}",
        CENTRE.as_slice()
    )
}

const STICTION: &str = "friction = { model = \"stiction\", mu_s = 0.7, mu_d = 0.3 }\n";

/// The top of the ball and the direction of the stroke over it.
fn axes() -> (Vector3<f64>, Vector3<f64>) {
    (Vector3::y(), Vector3::new(0.8, 0.0, 0.6))
}

/// Onto the top, to `reach_m` from the centre, and along an arc of that radius at `speed_m_s`.
fn arc(reach_m: f64, speed_m_s: f64) -> String {
    let (up, along) = axes();
    let at = |rho: f64, angle: f64| (CENTRE + up * (rho * angle.cos()) + along * (rho * angle.sin())).into();
    let press = [(0.0, at(reach_m + 0.02, 0.0)), (0.1, at(reach_m, 0.0)), (0.2, at(reach_m, 0.0))];
    let ticks = ((1.5 * reach_m / speed_m_s) * 1000.0) as u32;
    let slide = (1..=ticks).map(move |tick| {
        let s = f64::from(tick) / 1000.0;
        (0.2 + s, at(reach_m, s * speed_m_s / reach_m))
    });
    hand(press.into_iter().chain(slide))
}

/// Outward normal at a god-object, and how far it is from the centre.
fn normal_at(s: &Sample) -> (Vector3<f64>, f64) {
    let out = s.god - CENTRE;
    (out.normalize(), out.norm())
}

/// The printed god-object is a rounded sum of numbers of about 0.1 m; a few of those roundings.
const PLACE_TOLERANCE_M: f64 = 8.0 * f64::EPSILON * 0.1;

#[test]
fn sliding_ratio_on_a_ball_is_mu_d_in_every_slip_row_at_every_speed() {
    // From a crawl to the fastest stroke of a person.
    for speed_m_s in [0.02, 0.1, 0.5, 2.0] {
        for finger_radius_m in [0.0, 0.007] {
            let reach_m = RADIUS_M + finger_radius_m - 0.005;
            let samples = felt(&ball(STICTION, finger_radius_m), &arc(reach_m, speed_m_s), &[]);
            let slipping: Vec<&Sample> = samples.iter().filter(|s| s.friction == "slip").collect();
            assert!(slipping.len() >= 20, "{} slip rows at {speed_m_s} m/s", slipping.len());
            for s in &slipping {
                let (normal, distance_m) = normal_at(s);
                let (normal_n, tangential) = s.split(&normal);
                let ratio = tangential.norm() / normal_n;
                assert!((ratio - 0.3).abs() <= RATIO_TOLERANCE, "ratio {ratio} at {speed_m_s} m/s: {s:?}");
                let off_m = distance_m - RADIUS_M - finger_radius_m;
                assert!(
                    off_m.abs() <= PLACE_TOLERANCE_M,
                    "the god-object is {off_m} m off the surface: {s:?}"
                );
                let depth_m = RADIUS_M + finger_radius_m - normal.dot(&(s.hip - CENTRE));
                assert!((normal_n - 800.0 * depth_m).abs() <= 800.0 * PLACE_TOLERANCE_M, "k d: {s:?}");
            }
            // The hand rests at the end of the arc.
            for pair in slipping.windows(2).filter(|pair| pair[0].hip != pair[1].hip) {
                let (_, tangential) = pair[1].split(&normal_at(pair[1]).0);
                assert!(
                    tangential.dot(&(pair[1].god - pair[0].god)) < 0.0,
                    "friction pushes back: {:?}",
                    pair[1]
                );
            }
        }
    }
}

#[test]
fn contact_on_a_ball_breaks_away_within_one_tick_at_mu_s() {
    let samples = felt(&ball(STICTION, 0.0), &arc(0.045, 0.0613), &[]);
    let (up, along) = axes();
    // The god-object holds at the top, so depth and gap are measured in the plane that touches there.
    let excess_m = |s: &Sample| {
        let from_centre = s.hip - CENTRE;
        along.dot(&from_centre) - 0.7 * (RADIUS_M - up.dot(&from_centre))
    };
    let first = samples.iter().position(|s| s.touches() && excess_m(s) > 0.0).expect("it breaks away");
    assert!(
        excess_m(&samples[first]).min(-excess_m(&samples[first - 1])) > 1e-9,
        "no row is a matter of rounding"
    );
    let touching = samples.iter().enumerate().filter(|(_, s)| s.touches());
    for (tick, s) in touching {
        assert_eq!(s.friction, if tick < first { "stick" } else { "slip" }, "tick {tick} of {first}: {s:?}");
        if tick < first {
            let moved_m = (s.god - CENTRE - up * RADIUS_M).norm();
            assert!(moved_m <= PLACE_TOLERANCE_M, "it holds at the top: {s:?}");
        }
    }
}

#[test]
fn without_friction_a_ball_pushes_straight_away_from_its_centre() {
    for friction in ["", "friction = { model = \"none\" }\n"] {
        for s in felt(&ball(friction, 0.0), &arc(0.045, 0.1), &[]).iter().filter(|s| s.touches()) {
            let out = (s.hip - CENTRE).normalize();
            let depth_m = RADIUS_M - (s.hip - CENTRE).norm();
            // Nine digits of the depth, as for the ratios.
            let tolerance_m = RATIO_TOLERANCE * depth_m.abs() + PLACE_TOLERANCE_M;
            assert!((s.god - CENTRE - out * RADIUS_M).norm() <= tolerance_m, "the nearest point: {s:?}");
            assert!((s.force - out * (800.0 * depth_m)).norm() <= 800.0 * tolerance_m, "no drag: {s:?}");
        }
    }
}

#[test]
fn a_finger_that_starts_inside_is_pushed_out_along_the_nearest_way() {
    let inside = CENTRE + Vector3::new(0.03, 0.02, -0.01);
    let out = (inside - CENTRE).normalize();
    let scene = ball(STICTION, 0.0).replace("[-0.083, 0.2, 0.017]", &format!("{:?}", inside.as_slice()));
    for s in felt(&scene, "", &[]) {
        assert_eq!(s.hip, inside);
        let expected = out * (800.0 * (RADIUS_M - (inside - CENTRE).norm()));
        assert!((s.force - expected).norm() <= 800.0 * PLACE_TOLERANCE_M, "{s:?}");
    }
}
