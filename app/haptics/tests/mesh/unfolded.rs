//! Slivers that are folded over their neighbour, as CAD programs and decimation leave them.

use crate::common::meshes::*;
use crate::common::*;
use haptics::Friction;
use haptics::mesh::{Mesh, MeshReport, TriangleSoup, make};
use nalgebra::Vector3;
use std::sync::Arc;

/// A slab on four corners whose top is divided along the x axis; on that edge there is a vertex `off_m` to the side, beyond which
/// its sliver is folded over.
fn folded(off_m: f64, along: f64) -> (Mesh, MeshReport) {
    const HALF_M: f64 = 0.03;
    let ring = [[-HALF_M, 0.0], [0.0, -HALF_M], [HALF_M, 0.0], [0.0, HALF_M]];
    let mut vertices: Vec<_> =
        [0.0, -0.01].iter().flat_map(|y| ring.map(|[x, z]| Vector3::new(x, *y, z))).collect();
    vertices.push(Vector3::new(along * HALF_M, 0.0, -off_m));
    let (a, c, b, d, p) = (0, 1, 2, 3, 8);
    let mut faces = vec![[b, a, c], [a, b, p], [a, p, d], [p, b, d]];
    for i in 0..4 {
        let j = (i + 1) % 4;
        faces.extend([[i, j, i + 4], [j, j + 4, i + 4]]);
    }
    faces.extend([[4, 5, 6], [4, 6, 7]]);
    // Seen from above the ring runs the other way round.
    let faces = faces.into_iter().map(|[a, b, c]| [a, c, b]).collect();
    Mesh::build(TriangleSoup { vertices, faces }).unwrap()
}

#[test]
fn a_sliver_that_is_folded_over_its_neighbour_is_unfolded() {
    for off_m in [1e-12, 1e-9, 5e-7, 5e-6] {
        for along in [-0.9, -0.2, 0.0, 0.6] {
            let (mesh, report) = folded(off_m, along);
            assert_eq!((report.unfolded.count, report.is_clean()), (1, false), "{off_m} {along}: {report}");
            let on_top = mesh
                .faces()
                .iter()
                .filter(|face| face.vertices.iter().all(|vertex| mesh.vertices()[*vertex as usize].y == 0.0));
            let heights: Vec<_> = on_top.map(|face| face.normal_B.y).collect();
            assert!(heights.len() == 4 && heights.iter().all(|y| *y > 0.999), "{off_m} {along}: {heights:?}");
        }
    }
    // What can be seen is as the model has it, and what lies flat is no fold.
    for off_m in [2e-5, 1e-3, -5e-7, -1e-3] {
        let (_, report) = folded(off_m, 0.1);
        assert_eq!(report.unfolded.count, 0, "{off_m}: {report}");
    }
}

/// Its longest edge is one of the slab's rim, and it is folded over faces beside its others.
#[test]
fn a_sliver_at_a_sharp_edge_is_unfolded_into_the_wall() {
    let mut soup = make::cuboid([0.06, 0.01, 0.06]);
    // The edge of the top at z = 0.03, and the corner of the top that is not on it.
    let at = |x: f64, y: f64, z: f64| {
        let near = |v: &Vector3<f64>| (v - Vector3::new(x, y, z)).norm() < 1e-9;
        soup.vertices.iter().position(near).unwrap() as u32
    };
    let (a, b) = (at(-0.03, 0.005, 0.03), at(0.03, 0.005, 0.03));
    let is_on_top = |face: &[u32; 3]| face.iter().all(|v| soup.vertices[*v as usize].y > 0.0);
    let is_there = |face: &[u32; 3]| is_on_top(face) && face.contains(&a) && face.contains(&b);
    let index = soup.faces.iter().position(is_there).unwrap();
    let face = soup.faces[index];
    let first = (0..3).find(|&i| face[i] == a || face[i] == b).unwrap();
    let turned =
        if (face[(first + 1) % 3] == a) || (face[(first + 1) % 3] == b) { first } else { (first + 2) % 3 };
    let [from, to, other] = [0, 1, 2].map(|i| face[(turned + i) % 3]);
    let p = soup.vertices.len() as u32;
    // A nanometre beyond the rim.
    soup.vertices.push(Vector3::new(0.004, 0.005, 0.03 + 1e-9));
    soup.faces[index] = [from, p, other];
    soup.faces.extend([[p, to, other], [p, from, to]]);
    let (mesh, report) = Mesh::build(soup).unwrap();
    assert_eq!(report.unfolded.count, 1, "{report}");
    for face in mesh.faces() {
        let corners = face.vertices.map(|v| mesh.vertices()[v as usize]);
        let outward = (corners[0] + corners[1] + corners[2]) / 3.0;
        assert!(face.normal_B.dot(&outward) > 0.0, "{face:?}");
    }
}

#[test]
fn a_point_that_is_stroked_over_a_fold_is_free_when_it_is_lifted() {
    for seed in 0..400 {
        let mut noise = Noise(seed);
        let off_m = 10f64.powf(noise.between(-12.0, -5.3));
        let (mesh, _) = folded(off_m, noise.between(-0.9, 0.9));
        let entity = touchable(&Arc::new(mesh), Friction::None);
        let mut finger = point_finger();
        let x = noise.between(-0.015, 0.015);
        let depth_m = 10f64.powf(noise.between(-6.0, -2.5));
        let mut hip = Vector3::new(x, 1e-3, noise.between(-2e-3, 2e-3));
        for tick in 0..60 {
            hip.y = if tick < 5 { 1e-3 } else { -depth_m };
            hip += Vector3::new(noise.between(-1e-4, 1e-4), 0.0, noise.between(-2e-4, 2e-4));
            let out = step(&mut finger, &entity, &hip);
            // A step over the fold, and nothing beyond.
            let most_n = K * (depth_m + 3e-5);
            assert!(out.force_on_user_W.norm() <= most_n, "{seed}, tick {tick}: {out:?}");
        }
        hip.y = 1e-4;
        let out = step(&mut finger, &entity, &hip);
        assert!(out.entity.is_none(), "{seed}: {out:?}");
    }
}
