//! Meshes that are all but flat: two layers back to back, as thin as rounding. Beyond their rims a finger is free.

use crate::common::meshes::*;
use crate::common::*;
use haptics::Friction;
use haptics::mesh::{Mesh, TriangleSoup};
use nalgebra::Vector3;

/// A square of 0.1 m in y = 0, and above and below its middle an apex: closed, and that thick.
fn lens(half_thickness_m: f64) -> TriangleSoup {
    let flat = |x: f64, z: f64| Vector3::new(x, 0.0, z);
    let mut vertices = vec![flat(-0.05, -0.05), flat(0.05, -0.05), flat(0.05, 0.05), flat(-0.05, 0.05)];
    vertices.extend([Vector3::y() * half_thickness_m, -Vector3::y() * half_thickness_m]);
    let faces = vec![[4, 1, 0], [4, 2, 1], [4, 3, 2], [4, 0, 3], [5, 0, 1], [5, 1, 2], [5, 2, 3], [5, 3, 0]];
    TriangleSoup { vertices, faces }
}

#[test]
fn beyond_the_rim_or_a_corner_of_a_fold_a_finger_is_free() {
    for thickness in [0.0, 1e-14, 1e-13, 1e-12, 1e-10, 1e-6] {
        for friction in [Friction::None, Friction::Coulomb { mu: 0.7 }] {
            let lens = touchable(&built(lens(thickness)), friction);
            for y in [-1e-3, -1e-12, -1e-13, -1e-14, 0.0, 1e-14, 1e-13] {
                // Over an edge, over an edge near a corner, and straight over the corner.
                for (z, beyond) in [(0.003, [0.06, 0.004]), (0.003, [-0.06, 0.07]), (0.01, [0.06, 0.06])] {
                    let mut finger = point_finger();
                    for y in [0.01, y] {
                        step(&mut finger, &lens, &Vector3::new(0.01, y, z));
                    }
                    let out = step(&mut finger, &lens, &Vector3::new(beyond[0], y, beyond[1]));
                    assert_eq!(out.entity, None, "{thickness:e}, {y:e}, {beyond:?}: {out:?}");
                }
            }
        }
    }
}

#[test]
fn a_fold_is_felt_from_above_and_from_below() {
    for thickness in [0.0, 1e-13, 1e-10, 1e-6] {
        let lens = touchable(&built(lens(thickness)), Friction::None);
        for side in [1.0, -1.0] {
            let mut finger = point_finger();
            for y in [0.01, -0.002] {
                let out = step(&mut finger, &lens, &Vector3::new(0.01, side * y, 0.003));
                let is_pressed = y < 0.0;
                assert_eq!(out.entity.is_some(), is_pressed, "{thickness:e}");
                // Its slope, at most 1e-6 / 0.05.
                let expected_n = if is_pressed { side * K * 0.002 } else { 0.0 };
                assert!((out.force_on_user_W - Vector3::y() * expected_n).norm() < 1e-3, "{out:?}");
            }
        }
    }
}

/// Two walls that nearly lie on one another, of which the rims fit as if both were one folded sheet.
#[test]
fn walls_that_lie_on_one_another_keep_their_surface() {
    for gap_m in [0.0, 1e-12, 1e-11, 1e-10, 1e-9, 1e-8, 1e-7, 1e-6] {
        for is_turned in [false, true] {
            let corners = [[0.0, -0.01, -0.03], [0.0, -0.01, 0.03], [0.0, 0.03, 0.03], [0.0, 0.03, -0.03]];
            let mut walls = TriangleSoup {
                vertices: corners.map(Vector3::from).to_vec(),
                faces: vec![[0, 1, 2], [0, 2, 3]],
            };
            for (i, j) in (0..=3).flat_map(|i| (0..=5).map(move |j| (f64::from(i), f64::from(j)))) {
                walls.vertices.push(Vector3::new(-gap_m, -0.01 + 0.04 / 3.0 * i, -0.031 + 0.012 * j));
            }
            for (i, j) in (0..3).flat_map(|i| (0..5).map(move |j| (i, j))) {
                let [a, b] = [4 + 6 * i + j, 4 + 6 * (i + 1) + j];
                for [p, q, r] in [[a, a + 1, b + 1], [a, b + 1, b]] {
                    walls.faces.push(if is_turned { [p, r, q] } else { [p, q, r] });
                }
            }
            let (mesh, report) = Mesh::build(walls).unwrap();
            let area_m2 = |face: &haptics::mesh::Face| {
                let [a, b, c] = face.vertices.map(|vertex| mesh.vertices()[vertex as usize]);
                0.5 * (b - a).cross(&(c - a)).norm()
            };
            let surface_m2: f64 = mesh.faces().iter().map(area_m2).sum();
            // Slivers of less than a micrometre may go, along rims of 0.2 m in all.
            assert!((surface_m2 - 0.0048).abs() < 4e-7, "{gap_m} {is_turned}: {surface_m2} m^2\n{report}");
        }
    }
}
