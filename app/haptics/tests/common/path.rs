//! The standard path over a ball of 0.1 m, for tests of quality and benches of speed: the same HIPs for every mesh.
//!
//! At 1 kHz: 5 s free, 20 mm off the ball; 0.5 s radially to 5 mm under the surface; 10 s slide along a spiral from
//! near one pole to near the other, 0.2 mm of surface a tick; 0.5 s radially out again. On the bumpy ball the depth is
//! measured radially from the bumpy surface at the same angles.
//!
//! The spiral has `u = 0.0137 + 10 (theta - 0.05)`, u being the azimuth and theta the polar angle from +y: it crosses
//! meridians and parallels of a UV sphere under all kinds of angles and never runs along an edge. The free phase comes
//! along the same spiral backwards, to where the finger dips in.
#![allow(dead_code)]

use nalgebra::Vector3;

/// Radius of the ball \[m\].
pub(crate) const R: f64 = 0.1;
/// How far under the surface the HIP slides \[m\].
pub(crate) const DEPTH_M: f64 = 5e-3;
/// Distance from the centre while free \[m\].
pub(crate) const FREE_M: f64 = 0.12;
/// Stiffness of the path's entities \[N/m\].
pub(crate) const K_N_PER_M: f64 = 500.0;
/// Length of a tick \[s\].
pub(crate) const TICK_S: f64 = 1e-3;
/// Way along the ball's surface per tick \[m\].
pub(crate) const STEP_M: f64 = 2e-4;
/// Turns of the azimuth per turn of the polar angle.
const WINDING: f64 = 10.0;
const START: (f64, f64) = (0.05, 0.0137);

/// Rings of quads of a path's balls: `nu / 2 + 1`, so that 32, 100, 316 and 1000 meridians make 1024, 10,000, 99,856
/// and 1,000,000 triangles.
pub(crate) fn rings(meridians: usize) -> usize {
    meridians / 2 + 1
}

/// What the finger does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Phase {
    Free,
    Approach,
    Slide,
    Exit,
}

pub(crate) const PHASES: [(Phase, usize); 4] =
    [(Phase::Free, 5000), (Phase::Approach, 500), (Phase::Slide, 10_000), (Phase::Exit, 500)];

/// A ball's radius at an azimuth u and a polar angle \[m\].
pub(crate) type RadiusAt = fn(f64, f64) -> f64;

pub(crate) fn smooth(_u: f64, _theta: f64) -> f64 {
    R
}

/// Radius of the fingers with volume that feel these balls \[m\].
pub(crate) const FINGER_M: f64 = 1e-3;

/// On which such a finger's centre rolls.
pub(crate) fn smooth_for_a_ball(_u: f64, _theta: f64) -> f64 {
    R + FINGER_M
}

/// Nearly that on which such a finger's centre rolls: by less than 0.1 mm, since the bumps are no steeper than 0.4.
pub(crate) fn bumpy_for_a_ball(u: f64, theta: f64) -> f64 {
    bumpy(u, theta) + FINGER_M
}

pub(crate) fn bumpy(u: f64, theta: f64) -> f64 {
    R * (1.0 + 0.05 * (8.0 * u).sin() * (8.0 * theta).sin())
}

/// One HIP per tick.
pub(crate) fn standard_path(radius_at: RadiusAt) -> Vec<(Phase, Vector3<f64>)> {
    let spiral = spiral(10_000);
    let under = |&(theta, u): &(f64, f64)| point(radius_at(u, theta) - DEPTH_M, theta, u);
    let mut path = Vec::with_capacity(16_000);
    for (phase, ticks) in PHASES {
        match phase {
            Phase::Free => {
                path.extend(spiral[..ticks].iter().rev().map(|&(theta, u)| (phase, point(FREE_M, theta, u))));
            }
            Phase::Approach => path.extend(radially(ticks, &spiral[0], radius_at, true).map(|p| (phase, p))),
            Phase::Slide => path.extend(spiral.iter().map(|angles| (phase, under(angles)))),
            Phase::Exit => {
                path.extend(radially(ticks, spiral.last().unwrap(), radius_at, false).map(|p| (phase, p)));
            }
        }
    }
    path
}

/// (theta, u) per tick, in equal steps along the surface of the smooth ball.
pub(crate) fn spiral(ticks: usize) -> Vec<(f64, f64)> {
    let turned = |at: f64| STEP_M / (R * (1.0 + (WINDING * at.sin()).powi(2)).sqrt());
    let mut theta = START.0;
    let mut angles = Vec::with_capacity(ticks);
    for _ in 0..ticks {
        angles.push((theta, START.1 + WINDING * (theta - START.0)));
        theta += turned(theta + 0.5 * turned(theta));
    }
    angles
}

fn radially(
    ticks: usize,
    &(theta, u): &(f64, f64),
    radius_at: RadiusAt,
    is_inward: bool,
) -> impl Iterator<Item = Vector3<f64>> {
    let low_m = radius_at(u, theta) - DEPTH_M;
    (0..ticks).map(move |i| {
        let share = (i + 1) as f64 / ticks as f64;
        let share = if is_inward { 1.0 - share } else { share };
        point(low_m + (FREE_M - low_m) * share, theta, u)
    })
}

/// At a distance from the centre, with y the axis of the poles.
pub(crate) fn point(r: f64, theta: f64, u: f64) -> Vector3<f64> {
    r * Vector3::new(theta.sin() * u.cos(), theta.cos(), theta.sin() * u.sin())
}
