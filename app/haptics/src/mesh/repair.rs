//! Merges equal vertices and leaves out faces without an area.
//!
//! Problem: STL repeats a vertex for each of its faces; modelling programs leave zero-area faces behind.
//!
//! Model: vertices merge if they are equal up to a few roundings of the mesh's largest coordinate. CAD programs write
//! the same vertex as 0 for one face and as 3e-17 for the next; a larger tolerance would merge what a fine mesh tells
//! apart. A face has no area if its height over its longest edge drowns in the rounding of its coordinates;
//! this scales with the mesh and keeps the thinnest needle that can be told from a line.

use super::order::{Curve, Triangle};
use super::report::{Finding, MeshReport};
use super::sliver::{Sliver, divide};
use super::{MeshError, TriangleSoup, weld};
use nalgebra::Vector3;

/// The faces that have an area, between vertices that are all different.
pub(super) fn proper_triangles(
    soup: &TriangleSoup,
    report: &mut MeshReport,
) -> Result<Vec<Triangle>, MeshError> {
    let merged = weld::merge(&soup.vertices, &mut report.welded_vertices);
    report.unused_vertices = unused(soup);
    let curve = Curve::through(&soup.vertices);
    let mut triangles = Vec::with_capacity(soup.faces.len());
    let mut slivers = Vec::new();
    let mut block = [([0; 3], [Vector3::zeros(); 3]); BLOCK];
    for (number, faces) in soup.faces.chunks(BLOCK).enumerate() {
        for (face, (corners, points)) in faces.iter().zip(&mut block) {
            *corners = face.map(|v| merged[v as usize]);
            *points = corners.map(|v| soup.vertices[v as usize]);
        }
        for (i, (corners, points)) in block[..faces.len()].iter().enumerate() {
            let origin = number * BLOCK + i;
            if has_area(points) {
                triangles.push(Triangle::new(*corners, points, origin as u32, &curve));
            } else {
                report.degenerate.note(origin);
                slivers.extend(Sliver::new(*corners, points));
            }
        }
    }
    if triangles.is_empty() {
        return Err(MeshError::NothingLeft { faces: soup.faces.len() });
    }
    if !slivers.is_empty() {
        divide(&mut triangles, slivers, &soup.vertices, &curve, &mut report.divided);
    }
    Ok(triangles)
}

/// Faces whose points are fetched together: where their order is random each is a cache miss, and those of a block
/// overlap.
const BLOCK: usize = 64;

fn unused(soup: &TriangleSoup) -> Finding {
    let mut used = vec![false; soup.vertices.len()];
    for face in &soup.faces {
        face.iter().for_each(|&v| used[v as usize] = true);
    }
    let mut finding = Finding::default();
    (0..used.len()).filter(|&v| !used[v]).for_each(|v| finding.note(v));
    finding
}

/// Twice the area vector, from the two shortest edges: the long ones of a needle would cancel.
pub(crate) fn area_vector([a, b, c]: &[Vector3<f64>; 3]) -> Vector3<f64> {
    let [ab, bc, ca] = [b - a, c - b, a - c];
    let [l_ab, l_bc, l_ca] = [ab, bc, ca].map(|edge| edge.norm_squared());
    if l_ab >= l_bc && l_ab >= l_ca {
        bc.cross(&ca)
    } else if l_bc >= l_ca {
        ca.cross(&ab)
    } else {
        ab.cross(&bc)
    }
}

pub(super) fn has_area(corners: &[Vector3<f64>; 3]) -> bool {
    let [a, b, c] = corners;
    let longest = (b - a).norm_squared().max((c - b).norm_squared()).max((a - c).norm_squared()).sqrt();
    let height = area_vector(corners).norm() / longest;
    let size = a.amax().max(b.amax()).max(c.amax());
    // Not a number if all three corners are one: no area.
    height > ROUNDING * size
}

/// Of the largest coordinate. Each corner is rounded by half an epsilon an axis, which moves a height by up to
/// 2 sqrt(3) halves; ten times that, so that what is left has a normal good to a tenth or better.
pub(super) const ROUNDING: f64 = 16.0 * f64::EPSILON;

#[cfg(test)]
mod tests {
    use super::*;

    fn corners(flat: [f64; 9]) -> [Vector3<f64>; 3] {
        let [a, b, c, d, e, f, g, h, i] = flat;
        [Vector3::new(a, b, c), Vector3::new(d, e, f), Vector3::new(g, h, i)]
    }

    #[test]
    fn the_thinnest_needle_has_an_area_and_a_line_has_none_at_any_scale() {
        let needle = corners([1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 1e-12, 0.0]);
        // Thirds and sevenths are rounded: the three points are on a line only up to that.
        let line = corners([1.0 / 3.0, 1.0 / 7.0, 0.0, 2.0 / 3.0, 2.0 / 7.0, 0.0, 7.0 / 3.0, 1.0, 0.0]);
        for scale in [1e-6, 1e-3, 1.0, 0.3, 1e3] {
            assert!(has_area(&needle.map(|v| v * scale)), "needle times {scale}");
            assert!(!has_area(&line.map(|v| v * scale)), "line times {scale}");
        }
    }

    #[test]
    fn three_equal_points_have_no_area_anywhere() {
        assert!(!has_area(&[Vector3::zeros(); 3]));
        assert!(!has_area(&[Vector3::new(1.0, 2.0, 3.0); 3]));
    }
}
