//! Meshes, patches and pictures.

#![allow(non_snake_case)] // Names carry their frame.

use crate::check_message;
use haptics::mesh::{Mesh, TriangleSoup};
use haptics::{Nurbs, NurbsPatch, Surface};
use nalgebra::Vector3;
use std::path::Path;
use world::model::{
    ModelError, Texture, line_of_face, read_appearance, read_ase, read_free_form, read_gltf, read_obj,
    read_obj_with_uv, read_patches, read_ply, read_stl, read_three_ds, write_patches,
};
use world::picture;

/// A Wavefront OBJ of polygons.
pub fn obj(bytes: &[u8]) {
    if let Err(error) = read_obj_with_uv(bytes) {
        check_message(&error.to_string());
    }
    let read = read_obj(bytes);
    if let Ok(soup) = &read {
        assert!(line_of_face(bytes, soup.faces.len() - 1).is_some(), "a face without a line");
    }
    build(read);
}

/// An STL, text or binary.
pub fn stl(bytes: &[u8]) {
    build(read_stl(bytes));
}

/// A PLY, text or binary.
pub fn ply(bytes: &[u8]) {
    build(read_ply(bytes));
}

/// A glTF, text or binary, that may name no file.
pub fn gltf(bytes: &[u8]) {
    let read = read_gltf(bytes, None);
    // In a directory that is not there.
    if let (Ok(soup), Ok(Some(looks))) = (&read, read_appearance(Path::new("none/a.glb"), bytes)) {
        let count = soup.faces.len();
        assert!(looks.of_face.len() == count && looks.uv.len() == count, "a face without looks");
        let is_there = |finish: &u32| (*finish as usize) < looks.finishes.len();
        assert!(looks.of_face.iter().all(is_there), "a finish that is not there");
        looks.unread.iter().for_each(|said| check_message(said));
    }
    build(read);
}

/// An ASE.
pub fn ase(bytes: &[u8]) {
    build(read_ase(bytes));
}

/// A 3DS.
pub fn three_ds(bytes: &[u8]) {
    build(read_three_ds(bytes));
}

/// Rational patches in TOML.
pub fn patches(bytes: &[u8]) {
    join(read_patches(Path::new("fuzz.toml"), bytes));
}

/// Free-form surfaces in OBJ.
pub fn patches_obj(bytes: &[u8]) {
    join(read_free_form(bytes));
}

/// A picture of heights.
pub fn png(bytes: &[u8]) {
    if let Err(error) = picture::read_png(bytes) {
        check_message(&error.to_string());
    }
    match Texture::read(bytes) {
        Ok(Texture { size: [columns, rows], texels, .. }) => {
            assert!(columns <= 4096 && rows <= 4096 && texels.len() == (columns * rows) as usize);
        }
        Err(said) => check_message(&said),
    }
}

fn build(read: Result<TriangleSoup, ModelError>) {
    if let Ok(soup) = &read {
        assert!(soup.vertices.iter().flatten().all(|x| x.is_finite()), "a vertex that is none");
        assert!(
            soup.faces.iter().flatten().all(|index| (*index as usize) < soup.vertices.len()),
            "a face without its vertex"
        );
        // A small file may have millions of faces in common: to build them is another matter.
        if soup.faces.len() > MOST_BUILT {
            return;
        }
    }
    match read.map(Mesh::build) {
        Ok(Ok((mesh, report))) => {
            let vertices = mesh.vertices().len() as u32;
            let indices = mesh.faces().iter().flat_map(|face| face.vertices);
            assert!(indices.into_iter().all(|index| index < vertices), "a face without its vertex");
            let _ = report.to_string();
            ask_mesh(&mesh);
        }
        Ok(Err(error)) => check_message(&error.to_string()),
        Err(error) => check_message(&error.to_string()),
    }
}

/// A few faces are asked for from in front of them, from behind and from their own plane.
fn ask_mesh(mesh: &Mesh) {
    let step = mesh.faces().len().div_ceil(MOST_ASKED);
    for face in mesh.faces().iter().step_by(step) {
        assert_unit(&face.normal_B);
        let middle_B = face.vertices.iter().map(|&i| mesh.vertices()[i as usize]).sum::<Vector3<f64>>() / 3.0;
        let [above_B, below_B] = [1.0, -1.0].map(|side| middle_B + face.normal_B * (side * mesh.extent_m()));
        for p_B in [middle_B, above_B, below_B] {
            let (nearest, _) = mesh.nearest_and_side(&p_B);
            let ways = [Some(nearest), mesh.way_out(&p_B)];
            for way in ways.into_iter().flatten() {
                assert_finite(&way.point_B);
                assert!(way.distance_m >= 0.0, "{} m away", way.distance_m);
            }
            let away_m = mesh.nearest_unbounded(&p_B).distance_m;
            let slack_m = MESH_SLACK * mesh.extent_m() + SMALLEST_M;
            assert!(
                away_m <= (p_B - middle_B).norm() + slack_m,
                "{away_m} m from {p_B} with a face at {middle_B}"
            );
            let clearance_m = mesh.clearance(&p_B, f64::MAX);
            assert!(clearance_m <= away_m + slack_m, "clearance {clearance_m} m, {away_m} m away");
        }
        let hit = mesh.first_hit(&above_B, &below_B);
        assert!(hit.is_none_or(|hit| hit.point_B.iter().all(|x| x.is_finite())), "a hit that is nowhere");
        // A face as thin as roundings may be passed by.
        let is_wide = height_m(&face.vertices.map(|i| mesh.vertices()[i as usize])) > WIDE * mesh.extent_m();
        assert!(hit.is_some() || !is_wide, "no face between {above_B} and {below_B}");
    }
}

/// Of a triangle over its longest edge.
fn height_m([a, b, c]: &[Vector3<f64>; 3]) -> f64 {
    let longest_m = (b - a).norm().max((c - b).norm()).max((a - c).norm());
    (b - a).cross(&(c - a)).norm() / longest_m
}

/// The parts of a surface at their corners and in their middle, and what is nearest to places around these.
fn ask_surface(nurbs: &Nurbs) {
    let surfaces = [0.0, 0.1].map(|share| nurbs.surface(share * nurbs.extent_m()));
    let step = nurbs.parts().div_ceil(MOST_ASKED);
    for part in (0..nurbs.parts()).step_by(step) {
        for [u, v] in [[0.0, 0.0], [0.0, 1.0], [0.5, 0.5], [1.0, 0.3], [1.0, 1.0]] {
            let (point_B, normal_B) = nurbs.at(part, u, v);
            assert_finite(&point_B);
            assert_unit(&normal_B);
            let [above_B, below_B] = [0.5, -0.5].map(|side| point_B + normal_B * (side * nurbs.extent_m()));
            for surface in &surfaces {
                assert!(!surface.signed_distance(&above_B).is_nan(), "no distance from {above_B}");
                let entry = surface.entry(&above_B, &below_B);
                for at in [surface.nearest(&above_B), surface.nearest(&point_B)].into_iter().chain(entry) {
                    let on_plane_B = at.point_B + at.normal_B.yzx() * (0.01 * nurbs.extent_m());
                    for at in [at, surface.settle(&at, &on_plane_B)] {
                        assert_finite(&at.point_B);
                        assert_unit(&at.normal_B);
                    }
                }
            }
        }
    }
}

fn assert_finite(point: &Vector3<f64>) {
    assert!(point.iter().all(|x| x.is_finite()), "a point at {point}");
}

fn assert_unit(normal: &Vector3<f64>) {
    assert!((normal.norm() - 1.0).abs() < UNIT, "a normal {normal} of length {}", normal.norm());
}

/// Roundings of a vector's squares and of its division by their root are a few of 1e-16.
const UNIT: f64 = 1e-12;
/// Of the largest coordinate: places on a face are rounded a few times, each by 1e-16 of it.
const MESH_SLACK: f64 = 1e-12;
/// Boxes are compared by squares in `f32`, which have no digits left where distances are smaller.
const SMALLEST_M: f64 = 1e-18;
/// Of the largest coordinate: far above the roundings of a place on a segment.
const WIDE: f64 = 1e-9;
/// So many faces and parts are asked for.
const MOST_ASKED: usize = 8;

/// More take more memory than a fuzzer allows.
const MOST_BUILT: usize = 200_000;

fn join(read: Result<Vec<NurbsPatch>, ModelError>) {
    let patches = match read {
        Ok(patches) => patches,
        Err(error) => return check_message(&error.to_string()),
    };
    match Nurbs::build(&patches) {
        Ok((nurbs, report)) => {
            check_message(&report.to_string());
            ask_surface(&nurbs);
        }
        Err(error) => check_message(&error.to_string()),
    }
    let again = read_patches(Path::new("fuzz.toml"), write_patches(&patches).as_bytes());
    assert_eq!(again.expect("what was written"), patches, "patches that are written come back");
}
