//! Slivers that are folded over their neighbour, as CAD programs and decimation leave them.

use crate::common::meshes::*;
use crate::common::*;
use haptics::mesh::{Mesh, MeshError, MeshReport, Sides, TriangleSoup, make};
use haptics::{Entity, Friction};
use nalgebra::Vector3;
use std::sync::Arc;

/// A slab on four corners whose top is divided along the x axis; on that edge there is a vertex `off_m` to the side, beyond which
/// its sliver is folded over, and so high above the slab.
fn folded(off_m: f64, along: f64, up_m: f64) -> (Mesh, MeshReport) {
    const HALF_M: f64 = 0.03;
    let ring = [[-HALF_M, 0.0], [0.0, -HALF_M], [HALF_M, 0.0], [0.0, HALF_M]];
    let mut vertices: Vec<_> =
        [0.0, -0.01].iter().flat_map(|y| ring.map(|[x, z]| Vector3::new(x, *y, z))).collect();
    vertices.push(Vector3::new(along * HALF_M, up_m, -off_m));
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
            let (mesh, report) = folded(off_m, along, 0.0);
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
        let (_, report) = folded(off_m, 0.1, 0.0);
        assert_eq!(report.unfolded.count, 0, "{off_m}: {report}");
    }
}

/// One alone is no mesh, and beside a body it is left out, or one side of it.
#[test]
fn what_is_nothing_but_a_double_sliver_vanishes() {
    let vertices = [[0.0, 0.0, 0.0], [0.0, 1e-5, 7e-7], [2e-9, 0.0, 0.0], [0.0, -0.03, 0.0]];
    let mut vanished = 0;
    for mirrored in 0..8 {
        let sign = |axis: usize| if mirrored >> axis & 1 == 0 { 1.0 } else { -1.0 };
        let vertices: Vec<_> = vertices.map(|v| Vector3::from_fn(|axis, _| sign(axis) * v[axis])).into();
        let sliver = TriangleSoup { vertices, faces: vec![[0, 1, 3], [1, 2, 3]] };
        let mut beside = make::cuboid([0.05; 3]);
        let first = beside.vertices.len() as u32;
        beside.vertices.extend(sliver.vertices.iter().map(|vertex_B| vertex_B + Vector3::y()));
        beside.faces.extend(sliver.faces.iter().map(|face| face.map(|corner| corner + first)));
        let (mesh, report) = Mesh::build(beside).unwrap();
        assert_eq!(report.unfolded.count, 1, "{mirrored}: {report}");
        match Mesh::build(sliver) {
            Ok((alone, _)) => assert_eq!((alone.faces().len(), mesh.faces().len()), (1, 13), "{mirrored}"),
            Err(error) => {
                assert_eq!((error, mesh.faces().len()), (MeshError::OnlySlivers { faces: 2 }, 12));
                assert!(mesh.extent_m() < 0.051, "{mirrored}: {}", mesh.extent_m());
                vanished += 1;
            }
        }
    }
    assert!(vanished > 0);
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

/// A frictionless point comes down somewhere within so far of the middle (m, along x and z), is stroked about for so many ticks,
/// and lifted: its force is that of its depth, and then none.
fn stroke_and_lift(seed: u64, entity: &Entity, noise: &mut Noise, [x_m, z_m]: [f64; 2], ticks: u32) {
    let mut finger = point_finger();
    let x = noise.between(-x_m, x_m);
    let depth_m = 10f64.powf(noise.between(-6.0, -2.5));
    let mut hip = Vector3::new(x, 1e-3, noise.between(-z_m, z_m));
    for tick in 0..ticks {
        hip.y = if tick < 5 { 1e-3 } else { -depth_m };
        hip += Vector3::new(noise.between(-1e-4, 1e-4), 0.0, noise.between(-2e-4, 2e-4));
        let out = step(&mut finger, entity, &hip);
        // A step over the fold, and nothing beyond.
        let most_n = K * (depth_m + 3e-5);
        assert!(out.force_on_user_W.norm() <= most_n, "{seed}, tick {tick}, {depth_m} m: {out:?}");
    }
    hip.y = 1e-4;
    let out = step(&mut finger, entity, &hip);
    assert!(out.entity.is_none(), "{seed}, {depth_m} m: {out:?}");
}

#[test]
fn a_point_that_is_stroked_over_a_fold_is_free_when_it_is_lifted() {
    for seed in 0..400 {
        let mut noise = Noise(seed);
        let off_m = 10f64.powf(noise.between(-12.0, -5.3));
        let (mesh, _) = folded(off_m, noise.between(-0.9, 0.9), 0.0);
        let entity = touchable(&Arc::new(mesh), Friction::None);
        stroke_and_lift(seed, &entity, &mut noise, [0.015, 2e-3], 60);
    }
}

/// A flap over a slit that no finger feels, however wide.
#[test]
fn a_flap_over_a_slit_is_unfolded_and_a_point_that_is_stroked_over_it_is_free_when_it_is_lifted() {
    for seed in 0..400 {
        let mut noise = Noise(seed);
        let [off_m, up_m] =
            [(-5.0, -2.7), (-9.0, -5.3)].map(|(low, high)| 10f64.powf(noise.between(low, high)));
        // Where it dips below the face beside it the slit is on its other side, and up to 20 times as wide.
        let up_m = if seed % 4 == 0 { -up_m / 20.0 } else { up_m };
        let (mesh, report) = folded(off_m, noise.between(-0.9, 0.9), up_m);
        assert_eq!(report.unfolded.count, 1, "{seed}, {off_m}, {up_m}: {report}");
        let entity = touchable(&Arc::new(mesh), Friction::None);
        stroke_and_lift(seed, &entity, &mut noise, [0.015, 4e-3], 60);
    }
    // A slit that is felt is as the model has it.
    for up_m in [1e-5, 1e-4] {
        let (_, report) = folded(1e-3, 0.1, up_m);
        assert_eq!(report.unfolded.count, 0, "{up_m}: {report}");
    }
}

/// Vertices in front of an edge of the slab's top, so many and as far off it as that; some of them lie beyond it.
struct Ragged {
    soup: TriangleSoup,
    /// As they run along the edge, with its ends.
    chain: Vec<u32>,
}

impl Ragged {
    /// Without faces between the edge and the vertices.
    fn new(noise: &mut Noise) -> Self {
        const HALF_M: f64 = 0.03;
        let ring = [[-HALF_M, 0.0], [0.0, -HALF_M], [HALF_M, 0.0], [0.0, HALF_M]];
        let mut vertices: Vec<_> =
            [0.0, -0.01].iter().flat_map(|y| ring.map(|[x, z]| Vector3::new(x, *y, z))).collect();
        let inner = 2 + noise.between(0.0, 5.0) as usize;
        let mut along_m: Vec<_> = (0..inner).map(|_| noise.between(-0.0045, 0.0045)).collect();
        along_m.sort_by(f64::total_cmp);
        let mut chain = vec![8];
        vertices.push(Vector3::new(-0.005, 0.0, 0.0));
        for x in along_m {
            // Two of them are no further apart than a sliver of a mesh of this size may be high, 6 um.
            let off_m = 10f64.powf(noise.between(-7.0, -5.53));
            chain.push(vertices.len() as u32);
            vertices.push(Vector3::new(x, 0.0, if noise.between(0.0, 1.0) < 0.6 { -off_m } else { off_m }));
        }
        chain.push(vertices.len() as u32);
        vertices.push(Vector3::new(0.005, 0.0, 0.0));
        let (a, c, b, d) = (0, 1, 2, 3);
        let (first, last) = (chain[0], chain[chain.len() - 1]);
        let mut faces = vec![[a, c, first], [first, c, last], [last, c, b], [a, first, d], [last, b, d]];
        faces.extend(chain.windows(2).map(|pair| [pair[0], pair[1], d]));
        for i in 0..4 {
            let j = (i + 1) % 4;
            faces.extend([[j, i, i + 4], [j, i + 4, j + 4]]);
        }
        faces.extend([[4, 6, 5], [4, 7, 6]]);
        // The faces of the top as they are wound here look down.
        faces.iter_mut().for_each(|face| face.swap(1, 2));
        Self { soup: TriangleSoup { vertices, faces }, chain }
    }

    /// With slivers there that all have this vertex of the chain for a corner, side by side and upon each other.
    fn with_fan(mut self, hub: usize) -> TriangleSoup {
        let count = self.chain.len();
        let others: Vec<_> = (1..count).map(|i| self.chain[(hub + i) % count]).collect();
        let hub = self.chain[hub];
        self.soup.faces.extend(others.windows(2).map(|pair| [hub, pair[0], pair[1]]));
        self.soup
    }
}

fn read_again(mesh: &Mesh) -> (Mesh, MeshReport) {
    let faces = mesh.faces().iter().map(|face| face.vertices).collect();
    Mesh::build(TriangleSoup { vertices: mesh.vertices().to_vec(), faces }).unwrap()
}

/// Meshes with ragged slits: closed by a lid, and by slivers.
fn ragged() -> impl Iterator<Item = (u64, Mesh, MeshReport)> {
    (0..300).map(|seed| {
        let mut noise = Noise(seed);
        let ragged = Ragged::new(&mut noise);
        let soup = if seed % 2 == 0 {
            ragged.soup
        } else {
            let hub = noise.between(0.0, ragged.chain.len() as f64) as usize;
            ragged.with_fan(hub)
        };
        let (mesh, report) = Mesh::build(soup).unwrap();
        (seed, mesh, report)
    })
}

#[test]
fn folds_of_ragged_slits_are_unfolded_whether_lids_or_slivers_close_them() {
    let mut unfolded = [0, 0];
    for (seed, mesh, report) in ragged() {
        assert_eq!(mesh.sides(), Sides::Solid, "{seed}: {report}");
        assert_eq!(report.closed_holes.count, usize::from(seed % 2 == 0), "{seed}: {report}");
        unfolded[(seed % 2) as usize] += usize::from(report.unfolded.count > 0);
        for face in mesh.faces() {
            let is_on_top = face.vertices.iter().all(|vertex| mesh.vertices()[*vertex as usize].y == 0.0);
            assert!(!is_on_top || face.normal_B.y > 0.999, "{seed}: {face:?}");
        }
    }
    assert!(unfolded.iter().all(|count| *count > 100), "{unfolded:?}");
}

#[test]
fn a_mesh_that_was_unfolded_is_the_same_when_it_is_read_again() {
    for (seed, mesh, _) in ragged() {
        let (again, report) = read_again(&mesh);
        assert!(report.is_clean(), "{seed}: {report}");
        assert_eq!(again.vertices(), mesh.vertices(), "{seed}");
        assert_eq!(again.faces(), mesh.faces(), "{seed}");
    }
}

#[test]
fn a_point_that_is_stroked_over_a_ragged_slit_is_free_when_it_is_lifted() {
    for (seed, mesh, _) in ragged() {
        let entity = touchable(&Arc::new(mesh), Friction::None);
        let mut noise = Noise(seed + 1000);
        for _ in 0..10 {
            stroke_and_lift(seed, &entity, &mut noise, [0.005, 1e-3], 40);
        }
    }
}
