//! Triangle soups by formula, for tests, benches and first experiments.
//!
//! All are wound counter-clockwise seen from outside and centred on the origin, with y up. Vertices are shared, so
//! [`super::Mesh::build`] finds nothing to repair in them. `nu` counts segments around, `nv` rings of quads, each
//! of two triangles.
//!
//! # Panics
//! With fewer segments than named at each.

mod closed_curves;
mod prism;
mod shuffled;

pub use closed_curves::{klein_bottle, mobius_strip, torus};
pub use prism::{cuboid, star, wedge};
pub use shuffled::shuffled;

use super::TriangleSoup;
use nalgebra::Vector3;
use std::f64::consts::{PI, TAU};

/// A sphere of `nu >= 3` meridians and `nv >= 2` rings of quads from pole to pole, the poles on the y axis.
///
/// It has 2 nu (nv - 1) triangles: at the poles one triangle of each quad has no area and is left out. The standard
/// sizes have nv = nu / 2 + 1 rings, hence nu^2 triangles: nu = 32, 100, 316, 1000 gives 1024, 10,000, 99,856,
/// 1,000,000. With nu / 2 rings they would be fewer: 960, 9,800, 99,224, 998,000.
pub fn uv_sphere(nu: usize, nv: usize, radius_m: f64) -> TriangleSoup {
    globe(nu, nv, |_, _| radius_m)
}

/// A [`uv_sphere`] with hills and dales: r = R (1 + 0.05 sin 8u sin 8v), with the azimuth u from 0 to 2 pi and the
/// polar angle v from 0 to pi.
pub fn bumpy_sphere(nu: usize, nv: usize, radius_m: f64) -> TriangleSoup {
    globe(nu, nv, |u, v| radius_m * (1.0 + 0.05 * (8.0 * u).sin() * (8.0 * v).sin()))
}

/// Both poles are single vertices, surrounded by a fan.
fn globe(nu: usize, nv: usize, radius_m: impl Fn(f64, f64) -> f64) -> TriangleSoup {
    assert!(nu >= 3 && nv >= 2, "a sphere of {nu} meridians and {nv} rings; allowed are at least 3 and 2");
    let angles = |i: usize, j: usize| (TAU * i as f64 / nu as f64, PI * j as f64 / nv as f64);
    let point = |i, j| {
        let (u, v) = angles(i, j);
        radius_m(u, v) * Vector3::new(v.sin() * u.cos(), v.cos(), v.sin() * u.sin())
    };
    let parallels = (1..nv).flat_map(|j| (0..nu).map(move |i| (i, j)));
    let mut vertices = vec![Vector3::new(0.0, radius_m(0.0, 0.0), 0.0)];
    vertices.extend(parallels.map(|(i, j)| point(i, j)));
    vertices.push(Vector3::new(0.0, -radius_m(0.0, PI), 0.0));

    let (top, bottom) = (0, vertices.len() - 1);
    let index = |i: usize, j: usize| 1 + (j - 1) * nu + i % nu;
    let mut faces = Vec::with_capacity(2 * nu * (nv - 1));
    faces.extend((0..nu).map(|i| triangle(top, index(i + 1, 1), index(i, 1))));
    for j in 1..nv - 1 {
        faces.extend(
            (0..nu).flat_map(|i| quad(index(i, j), index(i + 1, j), index(i + 1, j + 1), index(i, j + 1))),
        );
    }
    faces.extend((0..nu).map(|i| triangle(bottom, index(i, nv - 1), index(i + 1, nv - 1))));
    TriangleSoup { vertices, faces }
}

fn triangle(a: usize, b: usize, c: usize) -> [u32; 3] {
    [a, b, c].map(|index| u32::try_from(index).expect("fewer than 2^32 vertices"))
}

/// Corners counter-clockwise.
fn quad(a: usize, b: usize, c: usize, d: usize) -> [[u32; 3]; 2] {
    [triangle(a, b, c), triangle(a, c, d)]
}
