//! Slow and obvious answers to what meshes are asked: every face is looked at, by other formulas.
#![allow(dead_code)]

pub(crate) mod coulomb;
pub(crate) mod descent;

use haptics::mesh::{Mesh, Sides};
use nalgebra::Vector3;
use std::f64::consts::TAU;

pub(crate) fn corners(mesh: &Mesh, face: usize) -> [Vector3<f64>; 3] {
    mesh.faces()[face].vertices.map(|vertex| mesh.vertices()[vertex as usize])
}

/// Distance from the nearest face.
pub(crate) fn distance(mesh: &Mesh, p: &Vector3<f64>) -> f64 {
    let distances = (0..mesh.faces().len()).map(|face| (p - closest(&corners(mesh, face), p)).norm());
    distances.fold(f64::INFINITY, f64::min)
}

/// Ericson, Real-Time Collision Detection, ch. 5.1.5: by barycentric regions.
pub(crate) fn closest([a, b, c]: &[Vector3<f64>; 3], p: &Vector3<f64>) -> Vector3<f64> {
    let (ab, ac) = (b - a, c - a);
    let [(d1, d2), (d3, d4), (d5, d6)] = [a, b, c].map(|corner| {
        let to_p = p - corner;
        (ab.dot(&to_p), ac.dot(&to_p))
    });
    if d1 <= 0.0 && d2 <= 0.0 {
        return *a;
    }
    if d3 >= 0.0 && d4 <= d3 {
        return *b;
    }
    if d6 >= 0.0 && d5 <= d6 {
        return *c;
    }
    let (va, vb, vc) = (d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2);
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return a + ab * (d1 / (d1 - d3));
    }
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return a + ac * (d2 / (d2 - d6));
    }
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        return b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)));
    }
    a + ab * (vb / (va + vb + vc)) + ac * (vc / (va + vb + vc))
}

/// The first fraction at which a segment enters a face whose barycentric coordinates may be as low as `least`:
/// a little below 0 for faces that are a little larger than they are. Möller and Trumbore 1997.
pub(crate) fn first_fraction(mesh: &Mesh, from: &Vector3<f64>, to: &Vector3<f64>, least: f64) -> Option<f64> {
    let path = to - from;
    let fractions = (0..mesh.faces().len()).filter_map(|face| {
        let [a, b, c] = corners(mesh, face);
        let (ab, ac) = (b - a, c - a);
        let across = path.cross(&ac);
        let determinant = ab.dot(&across);
        let is_entered = if mesh.sides() == Sides::Solid { determinant > 0.0 } else { determinant != 0.0 };
        let from_a = from - a;
        let u = from_a.dot(&across) / determinant;
        let v = path.dot(&from_a.cross(&ab)) / determinant;
        let fraction = ac.dot(&from_a.cross(&ab)) / determinant;
        let is_met = u >= least && v >= least && 1.0 - u - v >= least && (0.0..=1.0).contains(&fraction);
        (is_entered && is_met).then_some(fraction)
    });
    fractions.min_by(f64::total_cmp)
}

/// Winding number of the closed parts of a mesh around a point: 1 inside, 0 outside.
pub(crate) fn winding_number(mesh: &Mesh, p: &Vector3<f64>) -> f64 {
    let is_solid = |face: &usize| mesh.faces()[*face].sides == Sides::Solid;
    (0..mesh.faces().len()).filter(is_solid).map(|face| solid_angle(mesh, face, p)).sum::<f64>() / (2.0 * TAU)
}

/// The same of all faces, sheets too: what a place has of an inside, open though it may be.
pub(crate) fn winding_number_of_all(mesh: &Mesh, p: &Vector3<f64>) -> f64 {
    (0..mesh.faces().len()).map(|face| solid_angle(mesh, face, p)).sum::<f64>() / (2.0 * TAU)
}

/// Solid angle under which a face is seen (van Oosterom & Strackee 1983).
fn solid_angle(mesh: &Mesh, face: usize, p: &Vector3<f64>) -> f64 {
    let [a, b, c] = corners(mesh, face).map(|corner| corner - p);
    let [la, lb, lc] = [a.norm(), b.norm(), c.norm()];
    let below = la * lb * lc + a.dot(&b) * lc + b.dot(&c) * la + c.dot(&a) * lb;
    2.0 * a.dot(&b.cross(&c)).atan2(below)
}
