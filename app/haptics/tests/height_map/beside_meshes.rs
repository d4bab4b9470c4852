//! Pictures on meshes: against the same picture on a plane, whatever the build made of the faces.

use crate::common::pictures::*;
use crate::common::*;
use haptics::mesh::{CornerUv, Mesh, MeshError, TriangleSoup, make};
use haptics::{Entity, Friction, HeightForm, Shape};
use nalgebra::Vector3;
use std::sync::Arc;

const HALF_M: f64 = 0.04;
const SIZE_M: f64 = 0.01;
const AMPLITUDE_M: f64 = 5e-4;

/// A sheet at y = 0 of uneven triangles, wound upward.
fn sheet(cells: u32) -> TriangleSoup {
    let mut noise = Noise(31);
    let (n, cell) = (cells + 1, 2.0 * HALF_M / f64::from(cells));
    let mut vertices = Vec::new();
    for j in 0..n {
        for i in 0..n {
            let inner = |k: u32| if k == 0 || k == cells { 0.0 } else { 0.3 * cell };
            let [x, z] = [(i, inner(i)), (j, inner(j))]
                .map(|(k, wobble)| f64::from(k) * cell - HALF_M + wobble * noise.between(-1.0, 1.0));
            vertices.push(Vector3::new(x, 0.0, z));
        }
    }
    let index = |i: u32, j: u32| j * n + i;
    let quad = |i: u32, j: u32| {
        let [a, b, c, d] = [index(i, j), index(i, j + 1), index(i + 1, j + 1), index(i + 1, j)];
        [[a, b, c], [a, c, d]]
    };
    let faces = (0..cells).flat_map(|j| (0..cells).flat_map(move |i| quad(i, j))).collect();
    TriangleSoup { vertices, faces }
}

/// The coordinates that a plane has, in pictures of this size.
fn flat_uv(soup: &TriangleSoup) -> Vec<CornerUv> {
    let uv = |v: &Vector3<f64>| [v.x / SIZE_M + 0.5, -v.z / SIZE_M + 0.5];
    soup.faces.iter().map(|face| face.map(|v| uv(&soup.vertices[v as usize]))).collect()
}

fn on_mesh(soup: TriangleSoup, uv: &[CornerUv], friction: Friction, form: HeightForm) -> Entity {
    let mesh = Arc::new(Mesh::build_with_uv(soup, uv).unwrap().0);
    // All of it carved: then touch begins at the base on both.
    let map = repeated(&rough(16, 8), AMPLITUDE_M, [1.0; 2]).with_zero_level(1.0).unwrap();
    with(entity(Shape::from(mesh), friction), map.with_form(form))
}

fn on_plane(friction: Friction, form: HeightForm) -> Entity {
    let map = sized(&rough(16, 8), AMPLITUDE_M, SIZE_M).with_zero_level(1.0).unwrap();
    with(table(friction), map.with_form(form))
}

#[test]
fn a_mesh_with_the_coordinates_of_a_plane_feels_like_the_plane() {
    for form in [HeightForm::Gradient, HeightForm::AlongForce] {
        for friction in [Friction::None, Friction::coulomb(0.4).unwrap(), stiction()] {
            let soup = sheet(12);
            let uv = flat_uv(&soup);
            let (mesh, plane) =
                (on_mesh(soup, &uv, friction.clone(), form), on_plane(friction.clone(), form));
            let (mut on_mesh, mut on_plane) = (point_finger(), point_finger());
            let mut noise = Noise(32);
            let mut touched = 0;
            for i in 0..4000 {
                let t = f64::from(i) * DT;
                let hip = Vector3::new(
                    0.02 * (3.0 * t).sin(),
                    -1.5e-3 + 2e-3 * (5.0 * t).cos(),
                    0.02 * (4.1 * t).sin(),
                ) + noise.vector(1e-6);
                let (a, b) = (tick(&mut on_mesh, &mesh, &hip), tick(&mut on_plane, &plane, &hip));
                // Coordinates of up to 4 pictures in single precision: 2e-7 of a picture. The rough picture's slope is
                // up to 16 amplitudes a picture, and changes by up to 4 x 16^2 of them.
                let tolerance = K * AMPLITUDE_M * 2.4e-7 * (16.0 + 3.5e-3 / SIZE_M * 1500.0);
                let difference = (a.force_on_user_W - b.force_on_user_W).norm();
                assert!(difference <= tolerance, "{form:?} {hip}: {difference} of {tolerance} {a:?} {b:?}");
                touched += u32::from(a.entity.is_some());
            }
            assert!(touched > 2000, "{touched}");
        }
    }
}

#[test]
fn whatever_the_build_does_to_faces_they_keep_their_coordinates() {
    let plain = sheet(7);
    let uv = flat_uv(&plain);
    let spoilt = {
        let (mut soup, mut uv) = (plain.clone(), uv.clone());
        // Wound the other way round, and all in another order.
        for face in [3, 10, 40] {
            soup.faces[face].swap(0, 2);
            uv[face].swap(0, 2);
        }
        soup.faces.reverse();
        uv.reverse();
        for (i, (face, uv)) in soup.faces.iter_mut().zip(&mut uv).enumerate() {
            face.rotate_left(i % 3);
            uv.rotate_left(i % 3);
        }
        // A face given twice, and vertices given for each face apart.
        soup.faces.push(soup.faces[0]);
        uv.push(uv[0]);
        let vertices: Vec<_> = soup.faces.iter().flatten().map(|&v| soup.vertices[v as usize]).collect();
        let faces = (0..soup.faces.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        (TriangleSoup { vertices, faces }, uv)
    };
    let (mesh, report) = Mesh::build_with_uv(spoilt.0, &spoilt.1).unwrap();
    assert!(report.flipped.count > 0 && report.duplicate.count == 1, "{report}");
    for (face, uv) in mesh.faces().iter().zip(mesh.uv().unwrap()) {
        for (vertex, uv) in face.vertices.iter().zip(uv) {
            let v = mesh.vertices()[*vertex as usize];
            assert_eq!(*uv, [v.x / SIZE_M + 0.5, -v.z / SIZE_M + 0.5].map(|x| x as f32));
        }
    }
}

#[test]
fn a_divided_face_has_the_coordinates_of_the_whole_one() {
    // A square whose lower side is given in two halves to a face without an area, which is left out: the face above it is
    // divided in the middle.
    let vertices = [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0], [1.0, 0.0], [1.0, -1.0]];
    let vertices: Vec<_> = vertices.iter().map(|[x, y]| Vector3::new(*x, *y, 0.0)).collect();
    let faces = vec![[0, 1, 2], [0, 2, 3], [0, 4, 1], [0, 5, 4], [4, 5, 1]];
    let soup = TriangleSoup { vertices, faces };
    let uv = |v: &Vector3<f64>| [0.25 * v.x, 0.125 * v.y + 0.5];
    let corners: Vec<CornerUv> =
        soup.faces.iter().map(|face| face.map(|v| uv(&soup.vertices[v as usize]))).collect();
    let (mesh, report) = Mesh::build_with_uv(soup, &corners).unwrap();
    assert_eq!(report.divided.count, 1, "{report}");
    for (face, found) in mesh.faces().iter().zip(mesh.uv().unwrap()) {
        for (vertex, found) in face.vertices.iter().zip(found) {
            // Sums of a few halves and quarters, exact; only the share of the middle is a quotient.
            let expected = uv(&mesh.vertices()[*vertex as usize]);
            assert!(
                (0..2).all(|i| (f64::from(found[i]) - expected[i]).abs() < 1e-7),
                "{found:?} {expected:?}"
            );
        }
    }
}

#[test]
fn coordinates_that_are_missing_or_no_numbers_are_refused() {
    let soup = make::cuboid([0.1; 3]);
    let told = |uv: &[CornerUv]| Mesh::build_with_uv(soup.clone(), uv).unwrap_err();
    assert_eq!(told(&[]), MeshError::UvNumber { found: 0, faces: 12 });
    assert_eq!(
        told(&[]).to_string(),
        "0 faces have texture coordinates, but there are 12 faces; allowed are three for each"
    );
    let mut uv = vec![[[0.0; 2]; 3]; 12];
    for bad in [f64::NAN, f64::INFINITY, 2e4] {
        uv[7][1][0] = bad;
        let message = told(&uv).to_string();
        assert!(message.starts_with("face 7 has the texture coordinates [["), "{message}");
    }
    assert!(Mesh::build(soup).unwrap().0.chart(0, &Vector3::zeros()).is_none());
}

#[test]
fn a_face_whose_coordinates_are_all_the_same_is_level() {
    let soup = sheet(3);
    let uv = vec![[[0.3, 0.7]; 3]; soup.faces.len()];
    let mesh = on_mesh(soup, &uv, Friction::None, HeightForm::Gradient);
    for x in [-0.03, 0.0, 0.02] {
        let mut finger = point_finger();
        let force =
            [0.01, -2e-3].map(|y| tick(&mut finger, &mesh, &Vector3::new(x, y, 0.001)).force_on_user_W)[1];
        assert!(force.x == 0.0 && force.z == 0.0 && force.y > 0.0, "{force}");
    }
}

#[test]
fn without_coordinates_a_mesh_has_no_relief() {
    let mesh = Arc::new(Mesh::build(make::cuboid([0.1; 3])).unwrap().0);
    let plain = entity(Shape::from(mesh), Friction::None);
    let hip = Vector3::new(0.01, 0.048, 0.02);
    let map = repeated(&rough(8, 2), 1e-3, [3.0; 2]);
    assert_eq!(force_at(&with(plain.clone(), map), &hip), force_at(&plain, &hip));
}

#[test]
fn both_sides_of_a_sheet_are_raised_towards_the_finger() {
    let soup = sheet(5);
    let uv = flat_uv(&soup);
    let mesh = Arc::new(Mesh::build_with_uv(soup, &uv).unwrap().0);
    let entity = with(entity(Shape::from(mesh), Friction::None), repeated(&wave(), AMPLITUDE_M, [1.0; 2]));
    for x in [0.001, 0.0042, -0.0173] {
        let felt = |side: f64| {
            let mut finger = point_finger();
            [0.01, -1e-3]
                .map(|y| tick(&mut finger, &entity, &Vector3::new(x, side * y, 0.003)).force_on_user_W)[1]
        };
        let (above, below) = (felt(1.0), felt(-1.0));
        assert!(above.y > 0.5 && (above.y + below.y).abs() < 1e-12 && (above.x - below.x).abs() < 1e-12);
    }
}

#[test]
fn texture_coordinates_that_shrink_to_a_point_make_no_more_of_a_force_than_the_steepest_slope() {
    // A thousand pictures on a triangle of 10 mm, a wave of 10 um: slopes of 150.
    let soup = TriangleSoup {
        vertices: vec![Vector3::zeros(), Vector3::new(0.0, 0.0, 0.01), Vector3::new(0.01, 0.0, 0.0)],
        faces: vec![[0, 1, 2]],
    };
    let mesh = Arc::new(Mesh::build_with_uv(soup, &[[[0.0; 2], [0.0, 1000.0], [1000.0, 0.0]]]).unwrap().0);
    let map = repeated(&wave(), AMPLITUDE_M, [1.0; 2]).with_zero_level(1.0).unwrap();
    let sheet = with(entity(Shape::from(mesh), Friction::None), map);
    let (depth_m, mut largest_n, mut finger) = (1e-3, 0.0_f64, point_finger());
    finger.step(std::slice::from_ref(&sheet), &Vector3::new(0.002, 0.001, 0.002), DT);
    for i in 0..2000 {
        let hip = Vector3::new(0.002 + 1.7e-6 * f64::from(i), -depth_m, 0.002);
        largest_n = largest_n.max(finger.step(std::slice::from_ref(&sheet), &hip, DT).force_on_user_W.norm());
    }
    // A slope of 2 makes sqrt(5) of a load.
    assert!((0.5 * K * depth_m..K * depth_m * 5.0_f64.sqrt() + 1e-12).contains(&largest_n), "{largest_n}");
}
