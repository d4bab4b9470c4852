//! How well meshes stand for the ball that they approximate: forces along the standard path.

use std::sync::{Arc, OnceLock};

use crate::common::meshes::*;
use crate::common::path::{self, Phase, R, RadiusAt};
use crate::common::*;
use crate::mesh_oracle::descent::Descent;
use haptics::mesh::Mesh;
use haptics::{Entity, Finger, Friction};
use nalgebra::Vector3;

/// A million triangles, built once for all tests.
fn bumpy_ball_of_a_million() -> Arc<Mesh> {
    static BALL: OnceLock<Arc<Mesh>> = OnceLock::new();
    Arc::clone(BALL.get_or_init(|| bumpy_sphere(1000)))
}

/// HIP and force of every tick of the slide over the ball.
fn slide(meridians: usize, friction: Friction) -> Vec<(Vector3<f64>, Vector3<f64>)> {
    slide_over(&touchable(&uv_sphere(meridians), friction), path::smooth)
}

fn slide_over(ball: &Entity, radius_at: RadiusAt) -> Vec<(Vector3<f64>, Vector3<f64>)> {
    let mut finger = point_finger();
    let path = path::standard_path(radius_at);
    let felt = path.iter().map(|(phase, hip)| (*phase, *hip, step(&mut finger, ball, hip).force_on_user_W));
    felt.filter(|(phase, ..)| *phase == Phase::Slide).map(|(_, hip, force)| (hip, force)).collect()
}

fn rms_error_n(slide: &[(Vector3<f64>, Vector3<f64>)]) -> f64 {
    let error =
        |(hip, force): &(Vector3<f64>, Vector3<f64>)| force - hip.normalize() * (K * (R - hip.norm()));
    (slide.iter().map(|tick| error(tick).norm_squared()).sum::<f64>() / slide.len() as f64).sqrt()
}

fn largest_change_n(slide: &[(Vector3<f64>, Vector3<f64>)]) -> f64 {
    slide.windows(2).map(|pair| (pair[1].1 - pair[0].1).norm()).fold(0.0, f64::max)
}

/// Meridians, largest RMS error and largest change per tick \[N\].
///
/// A face of edge length h lies up to h^2 / (4 R) below the ball, is tilted by up to h / (2 R), and passing an edge
/// turns the force of 2.5 N by h / R. An exact walk was measured at 0.320, 0.0649, 0.0188, 0.0059 and 0.484, 0.2184,
/// 0.07001, 0.0222 N.
///
/// The third change was meant to be 0.07 N at most, and is 1.2e-5 N above: a god-object stays on its face as long as the
/// foot of the HIP's perpendicular lies there, so that in one tick it goes on over a vertex to the face diagonally
/// opposite, and 2.4995 N turn by a meridian and a ring at once, 0.0280 rad; an exact descent does the same, and only
/// the nearest point of all faces, which has no memory, changes by less (0.06976 N).
const BOUNDS: [(usize, f64, f64); 4] =
    [(32, 0.33, 0.49), (100, 0.065, 0.22), (316, 0.02, 0.0701), (1000, 0.008, 0.0225)];

#[test]
fn the_standard_path_is_what_it_says() {
    let path = path::standard_path(path::smooth);
    assert_eq!(path.len(), 16_000);
    let of = |phase| path.iter().filter(move |(of, _)| *of == phase).map(|(_, hip)| *hip);
    let slide: Vec<_> = of(Phase::Slide).collect();
    for pair in slide.windows(2) {
        // 0.2 mm of the surface are 0.19 mm at the HIP; a chord, and one midpoint per step, change it by a hundredth
        // where the spiral turns most, near the poles.
        let step_m = (pair[1] - pair[0]).norm();
        assert!((step_m / (0.95 * path::STEP_M) - 1.0).abs() < 0.01, "{step_m}");
    }
    assert!(slide.iter().all(|hip| (R - hip.norm() - DEPTH).abs() < 1e-16));
    assert!(of(Phase::Free).all(|hip| (hip.norm() - path::FREE_M).abs() < 1e-16));
    let lowest = slide.last().unwrap().y / (R - DEPTH);
    assert!((-1.0..-0.95).contains(&lowest), "from pole to pole: {lowest}");
    // No leap between phases: 0.24 mm at most while free.
    assert!(path.windows(2).all(|pair| (pair[1].1 - pair[0].1).norm() < 2.5e-4));
}

#[test]
fn frictionless_forces_come_close_to_the_ball_s_and_do_not_jump() {
    for (meridians, most_rms_n, most_change_n) in BOUNDS {
        let slide = slide(meridians, Friction::None);
        let (rms_n, change_n) = (rms_error_n(&slide), largest_change_n(&slide));
        println!("{meridians} meridians: rms {rms_n:.5} N, largest change {change_n:.5} N");
        assert!(rms_n <= most_rms_n, "{meridians} meridians: rms error {rms_n} N");
        assert!(change_n <= most_change_n, "{meridians} meridians: largest change {change_n} N");
    }
}

#[test]
fn the_largest_change_on_the_ball_of_100k_is_that_of_an_exact_descent() {
    let mesh = uv_sphere(316);
    let felt = slide(316, Friction::None);
    let change_n = |tick: &usize| (felt[tick + 1].1 - felt[*tick].1).norm();
    let largest = (0..felt.len() - 1).max_by(|a, b| change_n(a).total_cmp(&change_n(b))).unwrap();
    assert!((change_n(&largest) - 0.070_012).abs() < 1e-6, "{}", change_n(&largest));
    // From some ticks before on, the walk that looks at every face.
    let mut oracle = Descent::new(&mesh);
    let (hip, force) = felt[largest - 10];
    oracle.god_object = Some(hip + force / K);
    for (hip, force) in &felt[largest - 9..largest + 10] {
        let at = oracle.step(hip).unwrap();
        // Roundings of 0.1 m, times 500 N/m.
        assert!(((at - hip) * K - force).norm() < 1e-13, "{hip:?}");
    }
    // From a face to the one diagonally opposite, by a meridian and a ring at once. Measured is 0.06 % less, since so
    // near the equator (0.05 rad) meridians have come that much closer.
    let steps = [std::f64::consts::TAU / 316.0, std::f64::consts::PI / path::rings(316) as f64];
    let turn = felt[largest].1.angle(&felt[largest + 1].1);
    assert!((turn / steps[0].hypot(steps[1]) - 1.0).abs() < 2e-3, "{turn}");
    // Without memory it would have gone three ticks earlier, and there with less force.
    let nearest = felt.iter().map(|(hip, _)| (*hip, (mesh.nearest_unbounded(hip).point_B - hip) * K));
    let nearest_n = largest_change_n(&nearest.collect::<Vec<_>>());
    assert!((nearest_n - 0.069_763).abs() < 1e-6, "{nearest_n}");
}

#[test]
fn with_friction_the_slide_is_as_smooth_and_drags_with_its_coefficient() {
    let mu = 0.5;
    let frictionless = BOUNDS[2].2;
    let slide = slide(316, Friction::Coulomb { mu });
    // The first millimetres are spent on breaking away.
    let sliding = &slide[200..];
    // Friction turns with the normal, and is mu times it.
    let change_n = largest_change_n(sliding);
    assert!(change_n <= frictionless * (1.0 + mu), "{change_n}");
    let outward = |(hip, force): &(Vector3<f64>, Vector3<f64>)| {
        let (n, f) = (hip.normalize(), force);
        (f - n * f.dot(&n)).norm() / f.dot(&n)
    };
    let ratios: Vec<_> = sliding.iter().map(outward).collect();
    let mean = ratios.iter().sum::<f64>() / ratios.len() as f64;
    println!("ratio about the HIP's radius: mean {mean}");
    // The god-object trails by mu d = 2.5 mm, and its normal is turned by 2.5 / 100 from the HIP's radius.
    let lag = sphere_lag(mu, R, R - DEPTH).unwrap();
    let expected = (mu.atan() + lag).tan();
    assert!((mean / expected - 1.0).abs() < 0.02, "{mean}, expected {expected}");
}

#[test]
fn under_a_bumpy_ball_of_a_million_triangles_no_contact_is_lost_or_met_anew() {
    let mesh = bumpy_ball_of_a_million();
    for friction in [Friction::None, Friction::Coulomb { mu: 0.5 }] {
        let ball = touchable(&mesh, friction);
        // With a ramp: what is found inside begins with a hundredth of its force.
        let mut finger = Finger::new(0.0, 1).unwrap();
        let (mut leaps, mut last) = (0, None);
        for (tick, (phase, hip)) in path::standard_path(path::bumpy).iter().enumerate() {
            let out = step(&mut finger, &ball, hip);
            if *phase != Phase::Slide {
                continue;
            }
            assert_eq!(out.entity, Some(0), "{tick}");
            let spring = (out.god_object_W - hip) * K;
            if ball.friction == Friction::None {
                // Roundings of 0.1 m, times 500 N/m.
                assert!((out.force_on_user_W - spring).norm() < 1e-12, "{tick}: {out:?}");
            } else {
                // All of the depth's force, and of the rest no more than there is.
                let [felt, most] = [out.force_on_user_W.norm(), spring.norm()];
                assert!(felt > 0.8 * most && felt < most * (1.0 + 1e-9), "{tick}: {felt} of {most}");
            }
            // A god-object held in a dale comes over the saddle, and goes in one tick to where the HIP is by then.
            let leap_m = last.map_or(0.0, |last: Vector3<f64>| (out.god_object_W - last).norm());
            leaps += u32::from(leap_m > 5e-3);
            last = Some(out.god_object_W);
        }
        assert!((1..=5).contains(&leaps), "{leaps}");
    }
}

#[test]
fn on_a_bumpy_ball_of_a_million_triangles_the_force_stays_that_of_the_depth() {
    let slide = slide_over(&touchable(&bumpy_ball_of_a_million(), Friction::None), path::bumpy);
    // Around the pole bumps are needles, 3 mm high and 4 mm apart: there a god-object rests in the dale it is in, and
    // the HIP goes on under the hills.
    let forces_n: Vec<_> = slide[500..].iter().map(|(_, force)| force.norm()).collect();
    let mean_n = forces_n.iter().sum::<f64>() / forces_n.len() as f64;
    let largest_n = forces_n.iter().copied().fold(0.0, f64::max);
    println!("mean {mean_n}, largest {largest_n}");
    // 5 mm are measured radially: nothing on this side is further away than that, but for half a facet's height.
    assert!(largest_n < K * DEPTH * 1.001, "{largest_n}");
    // Slopes reach 0.4 along a meridian, and more along a parallel near the poles; on slopes the surface is nearer.
    assert!((0.9..1.0).contains(&(mean_n / (K * DEPTH))), "{mean_n}");
}
