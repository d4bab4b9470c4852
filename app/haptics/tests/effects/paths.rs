//! Guides along paths: no step inside of corners, in loops or where a path crosses itself, and no energy for nothing.

use crate::common::*;
use crate::effects::{Felt, limits, moving, resting};
use haptics::{Guide, Track};
use nalgebra::Vector3;
use std::f64::consts::FRAC_PI_2;

const K: f64 = 500.0;
/// In a tick of 1 ms a foot slides so far (m).
const SLIDE_M: f64 = Guide::SLIDE_M_PER_S * DT;

fn v3(x: f64, y: f64, z: f64) -> Vector3<f64> {
    Vector3::new(x, y, z)
}

fn guide(points: &[Vector3<f64>], damping: f64) -> Guide {
    let guide = Guide::new(Track::path(points).unwrap(), K, damping, &limits()).unwrap();
    guide.with_force_limit(10.0).unwrap()
}

/// A finger that the guide has had here for long.
fn held(guide: Guide, at: Vector3<f64>) -> Felt {
    let mut felt = Felt::new(vec![], vec![guide], vec![]);
    for _ in 0..60 {
        felt.beside(resting(at));
    }
    felt
}

fn right_angle() -> [Vector3<f64>; 3] {
    [v3(-0.1, 0.0, 0.0), Vector3::zeros(), v3(0.0, 0.1, 0.0)]
}

/// Distance of a path, looked for piece by piece (m).
fn distance(points: &[Vector3<f64>], p: &Vector3<f64>) -> f64 {
    let of_piece = |pair: &[Vector3<f64>]| {
        let way = pair[1] - pair[0];
        let share = (way.dot(&(p - pair[0])) / way.norm_squared()).clamp(0.0, 1.0);
        (p - pair[0] - way * share).norm()
    };
    points.windows(2).map(of_piece).fold(f64::INFINITY, f64::min)
}

#[test]
fn five_millimetres_inside_a_right_angle_a_micrometre_gives_no_step() {
    let from = v3(-0.008, 0.005, 0.0);
    let mut felt = held(guide(&right_angle(), 0.0), from);
    let (mut last, mut most) = (felt.beside(resting(from)), 0.0_f64);
    assert!((last - v3(0.0, -K * 0.005, 0.0)).norm() < 1e-12, "to the first leg: {last}");
    for tick in 1..=6000 {
        let at = from + v3(1e-6, 0.0, 0.0) * f64::from(tick);
        let force = felt.beside(resting(at));
        most = most.max((force - last).norm());
        last = force;
    }
    // Of the spring the way and the slide, as much again of a change.
    assert!(most <= K * (1e-6 + 2.0 * SLIDE_M) * 1.001, "{most} N in a tick");
    // The other leg is nearer by 3 mm by now.
    assert!((last - v3(K * 0.002, 0.0, 0.0)).norm() < 1e-9, "to the second leg: {last}");
}

#[test]
fn where_a_branch_ends_the_foot_slides_over_at_a_bounded_speed() {
    // An obtuse corner, 4 mm inside: the second leg is nearer by less than what makes a finger change over.
    let points = [v3(-0.1, 0.0, 0.0), Vector3::zeros(), v3(0.1, 0.05, 0.0)];
    let from = v3(-1e-3, 0.004, 0.0);
    let mut felt = held(guide(&points, 0.0), from);
    let (mut last, mut slid) = (felt.beside(resting(from)), 0);
    for tick in 1..=1200 {
        let at = from + v3(1e-6, 0.0, 0.0) * f64::from(tick);
        let force = felt.beside(resting(at));
        let change = (force - last).norm();
        assert!(change <= K * (1e-6 + SLIDE_M) * 1.001, "{tick}: {change} N");
        slid += i32::from(change > K * 1e-5);
        last = force;
    }
    // 4 mm times the sine of 27 degrees, 1.8 mm at 0.1 mm a tick.
    assert!((15..25).contains(&slid), "{slid} ticks");
    let at = v3(2e-4, 0.004, 0.0);
    assert!((last.norm() - K * distance(&points, &at)).abs() < 1e-9, "{last}");
}

#[test]
fn a_finger_beside_a_crossing_stays_on_its_branch() {
    // An eight: the second diagonal crosses the first.
    let points = [
        v3(-0.05, 0.0, 0.0),
        v3(0.05, 0.0, 0.0),
        v3(0.05, 0.05, 0.0),
        v3(0.0, 0.05, 0.0),
        v3(0.0, -0.05, 0.0),
    ];
    let off = v3(0.0, 0.9e-3, 0.0);
    let mut felt = held(guide(&points, 0.0), v3(-0.02, 0.0, 0.0) + off);
    for tick in 0..400 {
        let force = felt.beside(resting(v3(-0.02 + 1e-4 * f64::from(tick), 0.0, 0.0) + off));
        assert!((force + off * K).norm() < 1e-12, "{tick}: {force}");
    }
}

#[test]
fn a_closed_path_goes_on_where_it_began() {
    // A triangle that begins in the middle of an edge.
    let points =
        [v3(0.0, 0.0, 0.0), v3(0.05, 0.0, 0.0), v3(0.0, 0.0, 0.05), v3(-0.05, 0.0, 0.0), v3(0.0, 0.0, 0.0)];
    let off = v3(0.0, 0.003, 0.0);
    let along = v3(0.05, 0.0, 0.0);
    for back in [1.0, -1.0] {
        let from = v3(-0.01 * back, 0.0, 0.0) + off;
        let mut felt = held(guide(&points, 2.0), from);
        for tick in 0..400 {
            let at = from + v3(5e-5 * back * f64::from(tick), 0.0, 0.0);
            let force = felt.beside(moving(at, along * back));
            // Nothing along it, also where it begins.
            assert!((force + off * K).norm() < 1e-11, "{back} {tick}: {force}");
        }
    }
}

#[test]
fn the_damper_has_no_step_at_a_corner() {
    for height in [0.0, 1e-3] {
        let from = v3(-0.004, -height, 0.0);
        let v = v3(0.1, 0.04, 0.02);
        let mut felt = held(guide(&right_angle(), 2.0), from);
        let mut last = felt.beside(moving(from, v));
        for tick in 1..=10_000 {
            // Along the first leg, around the corner on its outer side, along the second leg.
            let s = -0.004 + 1e-6 * f64::from(tick);
            let turned = (s / f64::max(height, 1e-12)).clamp(0.0, FRAC_PI_2);
            let around = v3(turned.sin(), -turned.cos(), 0.0) * height;
            let at = around + v3(s.min(0.0), (s - FRAC_PI_2 * height).max(0.0), 0.0);
            let force = felt.beside(moving(at, v));
            // Its directions turn within a millimetre to either side, and it fades by the angle to them.
            assert!((force - last).norm() <= (K + 4.0 * 2.0 * v.norm() / 1e-3) * 1e-6, "{height} {tick}");
            last = force;
        }
    }
}

/// A random polyline: of some points, or closed, or turning by little from piece to piece.
fn random_path(noise: &mut Noise) -> Vec<Vector3<f64>> {
    let count = 3 + (noise.uniform() * 30.0) as usize;
    let flat = noise.uniform() < 0.5;
    let mut points = vec![Vector3::zeros()];
    let (mut way, turning, length) = (v3(1.0, 0.0, 0.0), noise.between(0.1, 3.0), noise.between(2e-3, 2e-2));
    for _ in 0..count {
        way += noise.vector(turning);
        if flat {
            way.z = 0.0;
        }
        way = way.normalize();
        points.push(points[points.len() - 1] + way * (length * noise.between(0.2, 2.0)));
    }
    if noise.uniform() < 0.4 {
        points.push(points[0]);
    }
    points
}

/// A closed way around a place of the path: sums of waves, of this many ticks.
fn random_way(
    noise: &mut Noise,
    points: &[Vector3<f64>],
    ticks: u32,
) -> impl Fn(u32) -> Vector3<f64> + use<> {
    let middle = points[(noise.uniform() * points.len() as f64) as usize];
    let waves: Vec<_> = (1..=4).map(|_| (noise.vector(5e-3), noise.vector(5e-3))).collect();
    move |tick| {
        let phase = std::f64::consts::TAU * f64::from(tick) / f64::from(ticks);
        let wave = |(n, (a, b)): (usize, &(Vector3<f64>, Vector3<f64>))| {
            let phase = phase * (n + 1) as f64;
            a * phase.sin() + b * phase.cos()
        };
        middle + waves.iter().enumerate().map(wave).sum::<Vector3<f64>>()
    }
}

/// Walks over random paths; what is asserted of every tick and of every round.
fn walk(seeds: std::ops::Range<u64>) {
    let (mut largest, mut changed) = (0.0_f64, 0_u64);
    for seed in seeds {
        let mut noise = Noise(seed);
        let points = random_path(&mut noise);
        let ticks = [100, 1000, 10_000][(seed % 3) as usize];
        let way = random_way(&mut noise, &points, ticks);
        let deadband = if noise.uniform() < 0.3 { 1e-3 } else { 0.0 };
        let mut felt = held(guide(&points, 0.0).with_deadband(deadband).unwrap(), way(0));
        let (mut at, mut force) = (way(0), felt.beside(resting(way(0))));
        let (began_j, mut given_j, mut allowed_j) = (felt.state.stored_j(), 0.0, 0.0);
        for tick in 1..=ticks {
            let next = way(tick);
            let step = (next - at).norm();
            // A force is held until the next tick, as a motor does.
            given_j += force.dot(&(next - at));
            allowed_j += 0.5 * K * step * step;
            let next_force = felt.beside(resting(next));
            let change = (next_force - force).norm();
            largest = largest.max(change - K * step);
            changed += u64::from(change > K * step * 1.001 + 1e-9);
            // Some roundings of forces of 10 N.
            assert!(change <= K * (step + 2.0 * SLIDE_M) + 1e-12, "{seed} {tick}: {change} N, {step} m");
            (at, force) = (next, next_force);
        }
        let left_j = felt.state.stored_j();
        // Sums of thousands of energies of up to 1 J.
        assert!(
            given_j <= began_j - left_j + allowed_j + 1e-10,
            "{seed}: {given_j} J of {began_j} J, {left_j} J are left"
        );
        // At rest it comes to a place that is about as near as any.
        for _ in 0..500 {
            force = felt.beside(resting(at));
        }
        let least_n = (K * (distance(&points, &at) - deadband).max(0.0)).min(10.0);
        let most_n = (K * (distance(&points, &at) - deadband).max(0.0) + K * Guide::CHANGE_M).min(10.0);
        assert!((least_n - 1e-9..=most_n + 1e-9).contains(&force.norm()), "{seed}: {force} of {least_n} N");
    }
    assert!(largest > 0.5 * K * SLIDE_M && changed > 100, "nothing slid: {largest} N, {changed} times");
}

#[test]
fn random_paths_give_no_step_and_no_energy() {
    walk(0..60);
}

#[test]
#[ignore = "minutes: the same over many more paths"]
fn many_random_paths_give_no_step_and_no_energy() {
    walk(60..30_000);
}
