//! Solids with flat sides and sharp edges, convex and concave.

use super::{quad, triangle};
use crate::mesh::TriangleSoup;
use nalgebra::{Vector2, Vector3};
use std::f64::consts::PI;

/// A box with these side lengths, of 12 triangles.
pub fn cuboid(size_m: [f64; 3]) -> TriangleSoup {
    let [x, y, z] = size_m.map(|side| 0.5 * side);
    let outline = [[x, y], [-x, y], [-x, -y], [x, -y]].map(|[x, y]| Vector2::new(x, y));
    along_z(&outline, z)
}

/// A prism like a blade, whose sharp edge runs along z through the origin and points up (+y).
///
/// Its two flanks meet there under `angle_rad` (below pi) and reach `length_m` down from it; it is `width_m` wide.
pub fn wedge(angle_rad: f64, length_m: f64, width_m: f64) -> TriangleSoup {
    let (sin, cos) = (0.5 * angle_rad).sin_cos();
    let [left, right] = [-sin, sin].map(|x| length_m * Vector2::new(x, -cos));
    along_z(&[Vector2::zeros(), left, right], 0.5 * width_m)
}

/// A prism over a star of `points >= 2` rays in the x-z plane, with a concave edge between any two of them.
///
/// The tips are `outer_m` from the y axis, the edges between them `inner_m`; it reaches from -height / 2 to
/// height / 2 along y.
pub fn star(points: usize, outer_m: f64, inner_m: f64, height_m: f64) -> TriangleSoup {
    assert!(points >= 2, "a star of {points} rays; allowed are at least 2");
    let corner = |i: usize| {
        let (sin, cos) = (PI * i as f64 / points as f64).sin_cos();
        Vector2::new(cos, sin) * if i.is_multiple_of(2) { outer_m } else { inner_m }
    };
    let outline: Vec<_> = (0..2 * points).map(corner).collect();
    let mut soup = along_z(&outline, 0.5 * height_m);
    // From z to y, as a rotation.
    soup.vertices.iter_mut().for_each(|v| *v = Vector3::new(v.x, v.z, -v.y));
    soup
}

/// The prism over an outline around the origin, counter-clockwise seen from +z, from -z to z.
///
/// A fan around its centre covers each end of an outline that may be concave; one from a corner the others.
fn along_z(outline: &[Vector2<f64>], z: f64) -> TriangleSoup {
    let n = outline.len();
    let end = |z: f64| outline.iter().map(move |p| Vector3::new(p.x, p.y, z));
    let mut soup = TriangleSoup { vertices: end(z).chain(end(-z)).collect(), faces: Vec::new() };
    soup.faces.extend((0..n).flat_map(|i| quad(i, n + i, n + (i + 1) % n, (i + 1) % n)));
    if n <= 4 {
        soup.faces.extend((1..n - 1).flat_map(|i| [triangle(0, i, i + 1), triangle(n, n + i + 1, n + i)]));
        return soup;
    }
    soup.vertices.extend([z, -z].map(|z| Vector3::new(0.0, 0.0, z)));
    let (front, back) = (2 * n, 2 * n + 1);
    let fan = |i| [triangle(front, i, (i + 1) % n), triangle(back, n + (i + 1) % n, n + i)];
    soup.faces.extend((0..n).flat_map(fan));
    soup
}
