//! Force shading: the shaded normals themselves. That they are continuous over the surface is what all of it is for.
#![allow(non_snake_case)]

use crate::common;

use common::meshes::{built, bumpy_sphere, cube, icosphere, star, unit_vector, uv_sphere, wedge};
use common::*;
use haptics::mesh::{Mesh, SHARPEST_CREASE_RAD, TriangleSoup, VertexNormals, make};
use haptics::{Cuboid, Feature, Form, Shading, ShadingForm, Shape, SurfacePoint};
use nalgebra::{Matrix3, Vector3};
use std::f64::consts::PI;
use std::sync::Arc;

/// No edge is a crease.
const NONE: f64 = PI;

fn of_face(mesh: &Mesh, face: usize, point_B: Vector3<f64>) -> SurfacePoint {
    let normal_B = mesh.faces()[face].normal_B;
    SurfacePoint { point_B, normal_B, feature: Feature::Face, piece: face as u32 }
}

/// The shaded normal at a point of a face.
fn shaded(shading: &Shading, mesh: &Arc<Mesh>, face: usize, point_B: Vector3<f64>) -> Vector3<f64> {
    let shape = Shape::from(Arc::clone(mesh));
    shading.normal_at(&shape, &of_face(mesh, face, point_B))
}

fn corners(mesh: &Mesh, face: usize) -> Matrix3<f64> {
    let corners = mesh.faces()[face].vertices.map(|vertex| mesh.vertices()[vertex as usize]);
    Matrix3::from_columns(&corners)
}

/// Meshes with edges and vertices of all kinds: convex, concave, saddles, slivers at poles, turned, with a rim.
fn meshes() -> Vec<(&'static str, Arc<Mesh>)> {
    vec![
        ("cube", cube()),
        ("star", star()),
        ("coarse ball", uv_sphere(8)),
        ("bumpy ball", bumpy_sphere(24)),
        ("wedge", built(make::wedge(0.6, 0.1, 0.1))),
        ("pit", built(pit())),
        ("klein bottle", built(make::klein_bottle(20, 10, 0.1))),
        ("mobius strip", built(make::mobius_strip(24, 2, 0.1, 0.03))),
    ]
}

/// A block with an upside-down pyramid in its top.
fn pit() -> TriangleSoup {
    let mut soup = make::cuboid([0.08; 3]);
    let top: Vec<usize> = (0..soup.faces.len())
        .filter(|&face| soup.faces[face].iter().all(|&v| soup.vertices[v as usize].y > 0.0))
        .collect();
    let tip = soup.vertices.len() as u32;
    soup.vertices.push(Vector3::zeros());
    let rim: Vec<[u32; 2]> = top
        .iter()
        .flat_map(|&face| [0, 1, 2].map(|i| [soup.faces[face][i], soup.faces[face][(i + 1) % 3]]))
        .collect();
    let outer = rim.iter().filter(|[a, b]| !rim.contains(&[*b, *a]));
    let sides: Vec<[u32; 3]> = outer.map(|[a, b]| [*a, *b, tip]).collect();
    soup.faces.retain(|face| !face.iter().all(|&v| soup.vertices[v as usize].y > 0.0));
    soup.faces.extend(sides);
    soup
}

fn shadings(mesh: &Mesh, crease: f64) -> Vec<(String, Shading)> {
    let form = ShadingForm::Rotate;
    let mut all = vec![("interpolated".into(), Shading::interpolated(mesh, crease, form).unwrap())];
    for length_m in [0.5e-3, 5e-3, 1.0] {
        let shading = Shading::regions(mesh, length_m, crease, form).unwrap();
        all.push((format!("regions of {length_m} m"), shading));
    }
    all
}

/// Every edge that two faces share, with the angle between their normals: face, edge, face over it, cosine.
fn edges(mesh: &Mesh) -> impl Iterator<Item = (usize, usize, usize, f64)> + '_ {
    mesh.faces().iter().enumerate().flat_map(move |(index, face)| {
        (0..3).filter(move |&edge| !face.links[edge].is_boundary()).map(move |edge| {
            let link = face.links[edge];
            let over = &mesh.faces()[link.face() as usize];
            let sign = if link.is_turned() { -1.0 } else { 1.0 };
            (index, edge, link.face() as usize, sign * face.normal_B.dot(&over.normal_B))
        })
    })
}

//= melder#4.25 type=test
//= melder#4.28 type=test
//= melder#4.29 type=test
#[test]
fn on_an_edge_both_faces_have_the_same_shaded_normal() {
    // Right to the ends, where regions overlap and vertices take over.
    let shares = [0.0, 1e-12, 1e-9, 1e-6, 1e-3, 0.03, 0.1, 0.25, 0.5, 0.77, 0.999, 1.0 - 1e-9, 1.0];
    for crease in [NONE, 0.8] {
        for (name, mesh) in meshes() {
            for (how, shading) in shadings(&mesh, crease) {
                let mut compared = 0;
                for (face, edge, over, cos) in edges(&mesh) {
                    // Creases are allowed to leap; a tenth of a degree off the limit, rounding does not decide.
                    if cos < crease.min(SHARPEST_CREASE_RAD).cos() + 1e-3 {
                        continue;
                    }
                    let at = corners(&mesh, face);
                    let (start, end) = (at.column(edge).into_owned(), at.column((edge + 1) % 3).into_owned());
                    let turned = if mesh.faces()[face].links[edge].is_turned() { -1.0 } else { 1.0 };
                    for share in shares {
                        let point = start + (end - start) * share;
                        let [here, there] = [face, over].map(|face| shaded(&shading, &mesh, face, point));
                        // Positions are rounded to 1e-17 m; against distances of 1e-13 m from a vertex that is a
                        // ratio off by 1e-4, of what is mixed in by 1e-12 / 1e-3 there.
                        let leap = (here - there * turned).norm();
                        assert!(leap <= 1e-11, "{name}, {how}: {leap} at {share} of edge {edge} of {face}");
                        compared += 1;
                    }
                }
                assert!(compared >= 26, "{name}, {how}: {compared}");
            }
        }
    }
}

/// The largest change of the shaded normal per way, in steps of this length, over straight ways through faces.
fn steepest_per_m(shading: &Shading, mesh: &Arc<Mesh>, seed: u64, step_m: f64) -> f64 {
    let mut noise = Noise(seed);
    let mut steepest = 0.0_f64;
    for _ in 0..4000 {
        let face = (noise.uniform() * mesh.faces().len() as f64) as usize;
        let at = corners(mesh, face);
        // From near a corner as often as from anywhere.
        let near = noise.uniform().powi(6);
        let split = noise.uniform();
        let weights = Vector3::new(1.0 - near, near * split, near * (1.0 - split));
        let from = at * weights;
        let towards = at * Vector3::from_fn(|_, _| noise.uniform()).normalize();
        let along = towards - from;
        let flat = along - mesh.faces()[face].normal_B * mesh.faces()[face].normal_B.dot(&along);
        let to = from + flat.normalize() * step_m;
        if (at.try_inverse().unwrap_or_else(Matrix3::zeros) * to).min() < 0.0 {
            continue;
        }
        let [a, b] = [from, to].map(|point| shaded(shading, mesh, face, point));
        steepest = steepest.max((a - b).norm() / step_m);
    }
    steepest
}

#[test]
fn a_shaded_normal_changes_no_faster_than_its_regions_are_short() {
    // Continuous means: a hundredth of the step, a hundredth of the change. A leap would make it a hundred times steeper.
    for (name, mesh) in meshes() {
        for (how, shading) in shadings(&mesh, NONE) {
            let [coarse, fine] = [1e-6, 1e-8].map(|step_m| steepest_per_m(&shading, &mesh, 3, step_m));
            assert!(fine <= 1.5 * coarse + 1e-6, "{name}, {how}: {fine} per m, and {coarse} in larger steps");
        }
    }
}

/// The shaded normal at a corner of a face.
fn at_corner(shading: &Shading, mesh: &Arc<Mesh>, face: usize, corner: usize) -> Vector3<f64> {
    shaded(shading, mesh, face, corners(mesh, face).column(corner).into_owned())
}

#[test]
fn a_vertex_normal_does_not_depend_on_how_flat_pieces_are_cut() {
    // At each corner of the cube three right angles meet, some of them cut by a diagonal.
    let mesh = cube();
    for (how, shading) in shadings(&mesh, NONE) {
        for face in 0..mesh.faces().len() {
            for corner in 0..3 {
                let point = corners(&mesh, face).column(corner).into_owned();
                let off = (at_corner(&shading, &mesh, face, corner) - point.normalize()).norm();
                assert!(off < 1e-15, "{how}: {off}, the rounding of a sum of six");
            }
        }
    }
}

#[test]
fn at_a_crease_each_side_has_its_own_normal_and_a_crease_that_ends_parts_nothing() {
    let mesh = cube();
    for (how, shading) in shadings(&mesh, 1.5) {
        for (face, record) in mesh.faces().iter().enumerate() {
            for corner in 0..3 {
                let off = (at_corner(&shading, &mesh, face, corner) - record.normal_B).norm();
                assert!(off < 1e-15, "{how}: {off}, the rounding of a mean of two");
            }
        }
    }
    // A roof whose ridge flattens out: sharp at one end, gone at the other. Around the flat end all faces are one fan.
    let (sharp, flat) = ([0.0, 0.05, -0.1], [0.0, 0.0, 0.1]);
    let points = [
        sharp,
        flat,
        [-0.05, 0.0, -0.1],
        [0.05, 0.0, -0.1],
        [-0.1, 0.0, 0.1],
        [0.1, 0.0, 0.1],
        [0.0, 0.0, 0.2],
    ];
    let vertices = points.map(Vector3::from).to_vec();
    let faces = vec![[0, 2, 1], [0, 1, 3], [2, 4, 1], [1, 5, 3], [4, 6, 1], [1, 6, 5]];
    let mesh = built(TriangleSoup { vertices, faces });
    // The ridge's flanks are 86 degrees apart, and 43 from the flat parts.
    let shading = Shading::interpolated(&mesh, 60.0_f64.to_radians(), ShadingForm::Rotate).unwrap();
    let at = |point: [f64; 3]| {
        let mut normals: Vec<Vector3<f64>> = Vec::new();
        for (face, record) in mesh.faces().iter().enumerate() {
            for corner in 0..3 {
                if mesh.vertices()[record.vertices[corner] as usize] == Vector3::from(point) {
                    let normal = at_corner(&shading, &mesh, face, corner);
                    if normals.iter().all(|other| (other - normal).norm() > 1e-12) {
                        normals.push(normal);
                    }
                }
            }
        }
        normals.len()
    };
    assert_eq!((at(sharp), at(flat)), (2, 1));
}

#[test]
fn memory_is_one_normal_for_each_vertex_and_more_only_at_creases() {
    let ball = built(icosphere(3, 0.1));
    let (faces, vertices) = (ball.faces().len(), ball.vertices().len());
    let bytes = |mesh: &Mesh, crease| VertexNormals::of(mesh, crease).unwrap().bytes();
    assert_eq!(bytes(&ball, NONE), 24 * vertices);
    assert_eq!(Shading::regions(&ball, 1.0, NONE, ShadingForm::Rotate).unwrap().bytes(), 32 * vertices);
    assert_eq!(Shading::None.bytes(), 0);
    // All creases: as many normals as corners, and an index for each corner.
    assert_eq!(bytes(&ball, 0.0), (24 + 4) * 3 * faces);
    // The cube: three sides at each of eight corners.
    assert_eq!(bytes(&cube(), 1.5), 24 * 24 + 12 * 12);
}

#[test]
fn a_region_of_activation_is_no_longer_than_small_triangles_allow_and_faces_stay_flat_beyond() {
    let mesh = built(icosphere(3, 0.1));
    let shading = Shading::regions(&mesh, 1.0, NONE, ShadingForm::Rotate).unwrap();
    for face in 0..mesh.faces().len() {
        // The middle of the circle inside, weighted with the lengths of the sides opposite.
        let at = corners(&mesh, face);
        let side = |i: usize| (at.column((i + 1) % 3) - at.column((i + 2) % 3)).norm();
        let weights = Vector3::new(side(0), side(1), side(2));
        let middle = at * weights / weights.sum();
        let off = (shaded(&shading, &mesh, face, middle) - mesh.faces()[face].normal_B).norm();
        // A region ends there, with the share 0 but for the rounding of a distance by 1e-17 m, of some mm.
        assert!(off < 1e-13, "{off}");
    }
}

//= melder#4.28 type=test
//= melder#4.29 type=test
#[test]
fn one_region_alone_mixes_both_normals_by_the_distance_from_the_edge() {
    // A ridge of 120 degrees in the material, 0.1 m long, its flanks 0.1 m wide: far from all other edges.
    let mesh = built(wedge(240.0));
    let l = 4e-3;
    let shading = Shading::regions(&mesh, l, NONE, ShadingForm::Rotate).unwrap();
    let mut compared = 0;
    for (face, edge, over, cos) in edges(&mesh) {
        let at = corners(&mesh, face);
        let (start, end) = (at.column(edge).into_owned(), at.column((edge + 1) % 3).into_owned());
        let is_ridge = start.xy().norm() < 1e-12 && end.xy().norm() < 1e-12;
        if !is_ridge {
            continue;
        }
        let [n1, n2] = [face, over].map(|face| mesh.faces()[face].normal_B);
        assert!((cos - (60.0_f64).to_radians().cos()).abs() < 1e-9);
        let inward = n1.cross(&(end - start)).normalize();
        for dist in [0.0, 1e-5, 1e-3, 2e-3, 3.9e-3, 4e-3, 5e-3] {
            let alpha: f64 = (0.5 + 0.5 * dist / l).min(1.0);
            let expected = (n1 * alpha + n2 * (1.0 - alpha)).normalize();
            let point = start + (end - start) * 0.5 + inward * dist;
            // As printed, alpha = dist / l: at the edge it is n2, from the other side n1.
            assert!((shaded(&shading, &mesh, face, point) - expected).norm() < 1e-13);
            compared += 1;
        }
    }
    assert_eq!(compared, 14);
}

#[test]
fn a_box_is_shaded_as_its_triangles_are_and_continuous_over_edges_and_corners() {
    let cuboid = Cuboid::new([0.1; 3]).unwrap();
    let l = 3e-3;
    let of_box = Shading::box_regions(&cuboid, l, ShadingForm::Rotate).unwrap();
    let mesh = cube();
    let of_mesh = Shading::regions(&mesh, l, NONE, ShadingForm::Rotate).unwrap();
    let box_normal = |point_B: Vector3<f64>, axis: usize| {
        let mut normal_B = Vector3::zeros();
        normal_B[axis] = point_B[axis].signum();
        let at = SurfacePoint { point_B, normal_B, feature: Feature::Face, piece: 0 };
        of_box.normal_at(&Shape::Form(Form::Cuboid(cuboid)), &at)
    };
    let mut noise = Noise(2);
    for _ in 0..2000 {
        // On the top, near an edge, but far from a corner: there the diagonals of the mesh count.
        let point = Vector3::new(0.05 - l * noise.uniform(), 0.05, noise.between(-0.03, 0.03));
        let face = mesh.nearest(&point).face as usize;
        let of_triangles = shaded(&of_mesh, &mesh, face, point);
        assert!((box_normal(point, 1) - of_triangles).norm() < 1e-13, "{point:?}");
        // On the edge, from either face, right to the corner.
        let to_corner = 0.01 * noise.uniform().powi(8);
        let edge = Vector3::new(0.05, 0.05, 0.05 - to_corner);
        let [x, y] = [0, 1].map(|axis| box_normal(edge, axis));
        assert!((x - y).norm() < 1e-14, "{edge:?}");
        // And a little step anywhere there changes little: by 4 / l per way at most, found 2.6 / l.
        let inwards = l * noise.uniform().powi(4);
        let [a, b] = [0.0, 1e-9].map(|step| box_normal(edge - Vector3::x() * (inwards + step), 1));
        assert!((a - b).norm() < 4.0 / l * 1e-9, "{edge:?} {}", (a - b).norm());
    }
}

#[test]
fn numbers_that_make_no_shading_are_refused_with_what_is_allowed() {
    let mesh = cube();
    let form = ShadingForm::Rotate;
    for bad in [-0.1, 3.2, f64::NAN, f64::INFINITY] {
        let message = Shading::interpolated(&mesh, bad, form).unwrap_err().to_string();
        assert_eq!(message, format!("crease_angle_rad is {bad}; allowed is a number from 0 to pi"));
        assert!(Shading::regions(&mesh, 1e-3, bad, form).is_err());
    }
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let message = Shading::regions(&mesh, bad, 1.0, form).unwrap_err().to_string();
        assert_eq!(message, format!("length_m is {bad}; allowed is a finite number > 0"));
        assert!(Shading::box_regions(&Cuboid::new([1.0; 3]).unwrap(), bad, form).is_err());
    }
}

#[test]
fn a_surface_point_of_any_kind_has_a_unit_normal() {
    let mut noise = Noise(8);
    let odd = [0.0, -0.0, 1e-320, 1e-160, 1e-9, 0.1, 1e9, 1e200, f64::MAX, f64::INFINITY, f64::NAN];
    for (name, mesh) in meshes() {
        let shape = Shape::from(Arc::clone(&mesh));
        for (how, shading) in shadings(&mesh, NONE).into_iter().chain(shadings(&mesh, 0.5)) {
            for i in 0..3000_usize {
                let pick = |noise: &mut Noise| odd[(noise.uniform() * odd.len() as f64) as usize];
                let point_B = match i % 3 {
                    0 => Vector3::from_fn(|_, _| pick(&mut noise)),
                    1 => mesh.vertices()[i % mesh.vertices().len()],
                    _ => noise.vector(0.1),
                };
                let normal_B = unit_vector(&mut noise);
                let feature =
                    [Feature::None, Feature::Surface, Feature::Face, Feature::Edge, Feature::Vertex][i % 5];
                // Also faces that are none.
                let piece = (noise.uniform() * 1.1 * mesh.faces().len() as f64) as u32;
                let normal = shading.normal_at(&shape, &SurfacePoint { point_B, normal_B, feature, piece });
                let is_odd = point_B.iter().any(|x| !x.is_finite() || x.abs() > 1e100);
                assert!(
                    (normal.norm() - 1.0).abs() < 1e-12 || is_odd,
                    "{name}, {how}: {normal:?} at {point_B:?}"
                );
            }
        }
    }
}
