//! No steps and no energy from nothing: bounds on the change of force, and work over closed loops.

use crate::common::pictures::*;
use crate::common::*;
use haptics::{Border, Entity, Friction, HeightForm};
use nalgebra::Vector3;
use proptest::prelude::*;
use std::f64::consts::TAU;

const TEXELS: usize = 16;
const SIZE_M: f64 = 0.008;
const AMPLITUDE_M: f64 = 3e-4;
const DEPTH_M: f64 = 2e-3;

/// Largest change of force from step to step along a line over many pictures.
fn largest_change(entity: &Entity, step_m: f64) -> f64 {
    let direction = Vector3::new(0.83, 0.0, 0.557);
    let mut finger = point_finger();
    let hip = |i: u32| direction * (f64::from(i) * step_m - 0.02) - Vector3::y() * DEPTH_M;
    let mut last = tick(&mut finger, entity, &hip(0)).force_on_user_W;
    (1..(0.04 / step_m) as u32).fold(0.0, |largest, i| {
        let force = tick(&mut finger, entity, &hip(i)).force_on_user_W;
        let change = (force - last).norm();
        last = force;
        f64::max(largest, change)
    })
}

/// How much the force changes per metre at most, between texels of any height: with A the amplitude and p the size of a
/// texel, the spline's slope is at most A / p in each direction (its weights' slopes sum to twice 1/2, times 1, per p),
/// together sqrt(2) A / p, and its second derivatives at most 4 A / p^2 along each axis (weights 1, -2, 1) and 1 A / p^2
/// mixed (1/2 by 1/2, four times), together at most 5 A / p^2.
fn steepest() -> (f64, f64) {
    let texel_m = SIZE_M / TEXELS as f64;
    (2f64.sqrt() * AMPLITUDE_M / texel_m, 5.0 * AMPLITUDE_M / (texel_m * texel_m))
}

#[test]
fn the_force_has_no_steps_at_borders_of_texels_and_pictures() {
    let (slope, bend) = steepest();
    for seed in 0..5 {
        for border in [Border::Repeat, Border::Clamp] {
            let map = sized(&rough(TEXELS, seed), AMPLITUDE_M, SIZE_M).with_border(border);
            for step_m in [1e-5, 1e-6] {
                let raised = with(table(Friction::None), map.clone());
                let change = largest_change(&raised, step_m);
                // d(k (d + h) (n - grad h)) <= k (|grad h| sqrt(1 + |grad h|^2) + (d + h) |bend|) ds.
                let most =
                    K * (slope * (1.0 + slope * slope).sqrt() + (DEPTH_M + AMPLITUDE_M) * bend) * step_m;
                assert!(change <= most, "{change} of {most}");
                // The bound is not idle.
                assert!(change > 0.05 * most, "{change} of {most}");
                let lengthened = with(table(Friction::None), map.clone().with_form(HeightForm::AlongForce));
                let change = largest_change(&lengthened, step_m);
                assert!(change <= K * slope * step_m, "{change}");
                assert!(change > 0.05 * K * slope * step_m, "{change}");
            }
        }
    }
}

#[test]
fn a_bilinear_slope_would_step() {
    // What the spline is for: the same texels joined by straight lines have slopes that differ by up to 2 A / p from
    // one texel to the next, however small the step of the finger.
    let grid = rough(TEXELS, 1);
    let texel_m = SIZE_M / TEXELS as f64;
    let row = &grid.values()[..TEXELS];
    let slope = |i: usize| f64::from(row[(i + 1) % TEXELS] - row[i]) * AMPLITUDE_M / texel_m;
    let step = (0..TEXELS).map(|i| (slope((i + 1) % TEXELS) - slope(i)).abs()).fold(0.0, f64::max);
    let (bend_most, tiny_m) = (steepest().1, 1e-6);
    assert!(step > 20.0 * bend_most * tiny_m, "{step} against {}", bend_most * tiny_m);
}

/// Work done on the user around a closed path in n steps, by the trapezoidal rule.
fn work(entity: &Entity, path: impl Fn(f64) -> Vector3<f64>, n: usize) -> f64 {
    let mut finger = point_finger();
    let mut force = |i: usize| tick(&mut finger, entity, &path(i as f64 / n as f64)).force_on_user_W;
    // Once to settle.
    force(0);
    let mut last = (path(0.0), force(0));
    let mut work = 0.0;
    for i in 1..=n {
        let here = (path(i as f64 / n as f64), force(i));
        work += (last.1 + here.1).dot(&(here.0 - last.0)) / 2.0;
        last = here;
    }
    work
}

/// Down at one place, over a hill, up again, and back.
fn rectangle(from_x: f64, to_x: f64, [shallow, deep]: [f64; 2]) -> impl Fn(f64) -> Vector3<f64> {
    move |t: f64| {
        let (leg, part) = ((4.0 * t).floor() as i32 % 4, (4.0 * t).fract());
        let between = |a: f64, b: f64| a + (b - a) * part;
        let (x, depth) = match leg {
            0 => (from_x, between(shallow, deep)),
            1 => (between(from_x, to_x), deep),
            2 => (to_x, between(deep, shallow)),
            _ => (between(to_x, from_x), shallow),
        };
        Vector3::new(x, -depth, 0.001)
    }
}

#[test]
fn around_a_loop_the_raised_surface_gives_nothing_and_the_thesis_form_does() {
    let (hill, dale) = (SIZE_M * -0.25, SIZE_M * 0.25);
    let depths = [1e-3, 3e-3];
    let map = sized(&wave(), AMPLITUDE_M, SIZE_M);
    let raised = with(table(Friction::None), map.clone());
    let lengthened = with(table(Friction::None), map.with_form(HeightForm::AlongForce));
    let loop_ = || rectangle(hill, dale, depths);
    // Only up and down does the thesis' form do work: k (h(to) - h(from)) over the difference of depths. At a quarter
    // the wave is at its highest and lowest, A kept apart.
    let expected = K * (depths[1] - depths[0]) * AMPLITUDE_M * kept();
    let gained = work(&lengthened, loop_(), 4000);
    assert!((gained.abs() - expected).abs() <= expected * 2.0 * WAVE_ERROR, "{gained} {expected}");
    // The other way round it takes as much.
    let lost = work(&lengthened, |t| loop_()(1.0 - t), 4000);
    assert!((gained + lost).abs() <= expected * 1e-9, "{gained} {lost}");
    // The trapezoidal rule is wrong by the square of the step: 8 mm over 4000 steps is 4e-6 of the wave's length.
    let nothing = work(&raised, loop_(), 4000);
    assert!(nothing.abs() < 1e-5 * expected, "{nothing} of {expected}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(30))]

    /// The spline is C1: what the trapezoidal rule leaves of a loop falls with the square of the step.
    #[test]
    fn no_loop_over_a_raised_surface_gains_or_loses(
        seed: u64, centre in prop::array::uniform2(-0.02..0.02f64), radii in prop::array::uniform2(1e-4..6e-3f64),
        depth in -5e-4..3e-3f64, swing in 0.0..2e-3f64, phase in 0.0..TAU, level in 0.0..=1.0f64, reaches in prop::bool::ANY,
    ) {
        let map = sized(&rough(TEXELS, seed), AMPLITUDE_M, SIZE_M).with_zero_level(level).unwrap();
        let loop_ = |t: f64| {
            let angle = TAU * t;
            let depth = depth + swing * (angle + phase).sin() * if reaches { 1.5 } else { 1.0 };
            Vector3::new(centre[0] + radii[0] * angle.cos(), -depth, centre[1] + radii[1] * angle.sin())
        };
        let raised = with(table(Friction::None), map.clone());
        let left = work(&raised, loop_, 20_000);
        let scale = 0.5 * K * (depth.abs() + 1.5 * swing + AMPLITUDE_M).powi(2);
        // Also where the loop leaves the surface and comes back: the force has no step there.
        // 20,000 steps of at most 2 um; what is left falls with their square, and is some 1e-7 of the energy stored.
        prop_assert!(left.abs() <= 3e-6 * scale, "{left} of {scale}");
    }
}

#[test]
fn on_a_ball_a_loop_gains_the_share_that_the_depth_has_in_its_radius() {
    let (radius, depth) = (0.03, 1e-3);
    let map = repeated(&wave(), 1e-4, [24.0, 1.0]);
    let raised = with(ball(radius, Friction::None), map.clone());
    let lengthened = with(ball(radius, Friction::None), map.with_form(HeightForm::AlongForce));
    let quarter = TAU / 24.0 / 4.0;
    let loop_ = |t: f64| {
        let across = rectangle(-quarter, quarter, [depth, 3.0 * depth])(t);
        Vector3::new(across.x.sin(), 0.0, across.x.cos()) * (radius + across.y)
    };
    let gained = work(&lengthened, loop_, 8000).abs();
    let error = work(&raised, loop_, 8000).abs();
    // The slope is taken at the surface; at a depth d below it the same difference A of heights is passed over a way that
    // is shorter by d / R, and k (d + h) A d / R is missing, h being A / 2 in the mean.
    let missing = |d: f64| K * (d + 0.5e-4) * 1e-4 * d / radius;
    let expected = missing(3.0 * depth) - missing(depth);
    assert!((error - expected).abs() < 0.01 * expected, "{error} {expected}");
    // A seventh of what the other form makes.
    assert!(error < 0.14 * gained, "{error} of {gained}");
}

#[test]
fn a_height_map_costs_no_change_to_what_has_none() {
    let plain = table(stiction());
    let flat = with(table(stiction()), sized(&even(0.0), AMPLITUDE_M, SIZE_M));
    let (mut a, mut b) = (point_finger(), point_finger());
    let mut noise = Noise(6);
    for i in 0..3000 {
        let t = f64::from(i) * DT;
        let hip = Vector3::new(0.02 * (2.0 * t).sin(), 2e-3 * (3.0 * t).cos(), 0.0) + noise.vector(1e-4);
        // Only its normal is made a unit vector again, and its force scaled by it.
        let difference =
            tick(&mut a, &plain, &hip).force_on_user_W - tick(&mut b, &flat, &hip).force_on_user_W;
        assert!(difference.norm() < 1e-15, "{difference}");
    }
}
