//! Meshes, patches and pictures.

use crate::check_message;
use haptics::mesh::{Mesh, TriangleSoup};
use haptics::{Nurbs, NurbsPatch};
use std::path::Path;
use world::model::{
    ModelError, line_of_face, read_ase, read_free_form, read_gltf, read_obj, read_obj_with_uv, read_patches,
    read_ply, read_stl, read_three_ds, write_patches,
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
    build(read_gltf(bytes, None));
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
        }
        Ok(Err(error)) => check_message(&error.to_string()),
        Err(error) => check_message(&error.to_string()),
    }
}

/// More take more memory than a fuzzer allows.
const MOST_BUILT: usize = 200_000;

fn join(read: Result<Vec<NurbsPatch>, ModelError>) {
    let patches = match read {
        Ok(patches) => patches,
        Err(error) => return check_message(&error.to_string()),
    };
    match Nurbs::build(&patches) {
        Ok((_, report)) => check_message(&report.to_string()),
        Err(error) => check_message(&error.to_string()),
    }
    let again = read_patches(Path::new("fuzz.toml"), write_patches(&patches).as_bytes());
    assert_eq!(again.expect("what was written"), patches, "patches that are written come back");
}
