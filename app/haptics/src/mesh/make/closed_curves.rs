//! Surfaces that a closed curve, or a segment, sweeps on its way around the y axis.

use super::quad;
use crate::mesh::TriangleSoup;
use nalgebra::Vector3;
use std::f64::consts::TAU;

/// A ring around the y axis: circles of radius `minor_m` about a circle of radius `major_m`, of
/// 2 nu nv triangles, nu >= 3, nv >= 3.
pub fn torus(nu: usize, nv: usize, major_m: f64, minor_m: f64) -> TriangleSoup {
    assert!(nu >= 3 && nv >= 3, "a torus of {nu} segments and {nv} rings; allowed are at least 3 and 3");
    let point = |i, j| {
        let (sin, cos) = turn(j as f64, nv).sin_cos();
        around_y(turn(i as f64, nu), major_m + minor_m * cos, minor_m * sin)
    };
    let faces = |i, j| {
        let index = |i, j| i % nu * nv + j % nv;
        quad(index(i, j), index(i + 1, j), index(i + 1, j + 1), index(i, j + 1))
    };
    sweep(nu, nv, nv, point, faces)
}

/// A Klein bottle: a figure eight that makes half a turn on its way around the y axis, about `size_m` across.
///
/// Closed, but neither side is the outside; it passes through itself. 2 nu nv triangles, nu >= 3, nv >= 3. The
/// winding changes once, where the way around closes.
pub fn klein_bottle(nu: usize, nv: usize, size_m: f64) -> TriangleSoup {
    assert!(
        nu >= 3 && nv >= 3,
        "a Klein bottle of {nu} segments and {nv} rings; allowed are at least 3 and 3"
    );
    const RADIUS: f64 = 3.0;
    let scale = 0.5 * size_m / (RADIUS + 1.0);
    let point = |i, j| {
        // Half a step away from where the eight crosses itself: there two vertices would be one.
        let (u, v) = (turn(i as f64, nu), turn(j as f64 + 0.5, nv));
        let (sin, cos) = (0.5 * u).sin_cos();
        let out = RADIUS + cos * v.sin() - sin * (2.0 * v).sin();
        scale * around_y(u, out, sin * v.sin() + cos * (2.0 * v).sin())
    };
    let faces = |i, j: usize| {
        // After the half turn v has become -v.
        let index = |i, j| if i < nu { i * nv + j % nv } else { nv - 1 - j % nv };
        quad(index(i, j), index(i + 1, j), index(i + 1, j + 1), index(i, j + 1))
    };
    sweep(nu, nv, nv, point, faces)
}

/// A strip `width_m` wide that makes half a turn on its way around the y axis, at `radius_m` from it.
///
/// Open, with one rim, and without an outside. 2 nu nv triangles, nu >= 3, nv >= 1.
pub fn mobius_strip(nu: usize, nv: usize, radius_m: f64, width_m: f64) -> TriangleSoup {
    assert!(nu >= 3 && nv >= 1, "a strip of {nu} segments and {nv} rings; allowed are at least 3 and 1");
    let point = |i, j| {
        let u = turn(i as f64, nu);
        let (sin, cos) = (0.5 * u).sin_cos();
        let across = width_m * (j as f64 / nv as f64 - 0.5);
        around_y(u, radius_m + across * cos, across * sin)
    };
    let faces = |i, j| {
        let index = |i, j| if i < nu { i * (nv + 1) + j } else { nv - j };
        quad(index(i, j), index(i + 1, j), index(i + 1, j + 1), index(i, j + 1))
    };
    sweep(nu, nv, nv + 1, point, faces)
}

fn sweep(
    nu: usize,
    nv: usize,
    points_each: usize,
    point: impl Fn(usize, usize) -> Vector3<f64>,
    faces: impl Fn(usize, usize) -> [[u32; 3]; 2],
) -> TriangleSoup {
    let grid = |width: usize| (0..nu).flat_map(move |i| (0..width).map(move |j| (i, j)));
    TriangleSoup {
        vertices: grid(points_each).map(|(i, j)| point(i, j)).collect(),
        faces: grid(nv).flat_map(|(i, j)| faces(i, j)).collect(),
    }
}

fn turn(step: f64, steps: usize) -> f64 {
    TAU * step / steps as f64
}

/// The point `out` from the y axis and `up` along it, turned by `u` from x towards -z.
fn around_y(u: f64, out: f64, up: f64) -> Vector3<f64> {
    Vector3::new(out * u.cos(), up, -out * u.sin())
}
