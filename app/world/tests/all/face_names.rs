//! Names that model files give their faces.

use crate::made::{self, chunk};
use haptics::mesh::TriangleSoup;
use nalgebra::Vector3;
use std::path::Path;
use world::model::{self, FaceNames};

/// The names of a file, and of each face the number of the first of these that it has.
fn labels(file: &str, bytes: &[u8], wanted: &[&str]) -> (Vec<(String, usize)>, Vec<u16>) {
    let soup = model::read(Path::new(file), bytes).expect("a model");
    let names: FaceNames = model::read_names(Path::new(file), bytes).expect("a model").expect("names");
    let lists: Vec<Vec<String>> = wanted.iter().map(|name| vec![(*name).to_owned()]).collect();
    let labels = names.labels(&lists);
    assert_eq!(labels.len(), soup.faces.len());
    (names.all().into_iter().map(|(name, faces)| (name.to_owned(), faces)).collect(), labels)
}

fn all(names: &[(&str, usize)]) -> Vec<(String, usize)> {
    names.iter().map(|(name, faces)| ((*name).to_owned(), *faces)).collect()
}

/// A square.
fn square() -> TriangleSoup {
    let vertices =
        [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]].map(Vector3::from).to_vec();
    TriangleSoup { vertices, faces: vec![[0, 1, 2], [0, 2, 3]] }
}

#[test]
fn objects_groups_and_materials_of_an_obj_name_its_faces() {
    let text = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 2 0 0\n\
                f 1 2 3\n\
                o The Wheel\ng tyre outer\nusemtl soft rubber # of all\nf 1 2 3 4\n\
                usemtl steel\nf 2 5 3\n\
                g\nf 1 \\\n 2 5\n";
    let (names, labels) = labels("a.obj", text.as_bytes(), &["steel", "outer"]);
    let expected = [("The Wheel", 4), ("outer", 3), ("soft rubber", 2), ("steel", 2), ("tyre", 3)];
    assert_eq!(names, all(&expected));
    // A polygon of four corners is two triangles.
    assert_eq!(labels, [0, 2, 2, 1, 1]);
}

#[test]
fn nodes_meshes_and_materials_of_gltf_name_its_triangles() {
    let soup = square();
    let text = made::gltf_text(&soup, "");
    let named = text
        .replacen("{\"mesh\":0}", "{\"mesh\":0,\"name\":\"node\"},{\"mesh\":0,\"name\":7}", 1)
        .replacen(
            "\"meshes\":[{",
            "\"materials\":[{},{\"name\":\"felt\"}],\"meshes\":[{\"name\":\"cloth\",",
            1,
        )
        .replacen("\"nodes\":[0]", "\"nodes\":[0,1]", 1)
        .replacen("\"material\":7", "\"material\":1", 1);
    let bytes = made::glb(&named, &made::buffer(&soup));
    let (names, own) = labels("a.glb", &bytes, &["node"]);
    assert_eq!(names, all(&[("cloth", 4), ("felt", 4), ("node", 2)]), "{named}");
    assert_eq!(own, [1, 1, 0, 0]);
    // A material that is not there names nothing.
    let bytes = made::glb(&text, &made::buffer(&soup));
    assert_eq!(labels("a.glb", &bytes, &["felt"]), (Vec::new(), vec![0, 0]));
}

#[test]
fn nodes_and_materials_of_ase_name_its_faces_and_parts_of_materials_too() {
    let one = made::ase(&square());
    let materials = "*MATERIAL_LIST {\n*MATERIAL_COUNT 2\n*MATERIAL 0 {\n*MATERIAL_NAME \"steel\"\n}\n\
        *MATERIAL 1 {\n*MATERIAL_NAME \"mixed\"\n*SUBMATERIAL 0 {\n*MATERIAL_NAME \"cork\"\n}\n\
        *SUBMATERIAL 5 {\n*MATERIAL_NAME \"wood\"\n}\n}\n}\n";
    let begin = one.find("*GEOMOBJECT").expect("an object");
    let mut parts = one[begin..].to_owned();
    assert!(parts.contains("*NODE_NAME"), "{parts}");
    // The second face of the first object is of another part of its material.
    let second = parts.find("*MESH_FACE 1").or_else(|| parts.find("*MESH_FACE    1")).expect("two faces");
    let end = second + parts[second..].find('\n').expect("a line");
    parts.insert_str(end, " *MESH_SMOOTHING 1 *MESH_MTLID 5");
    let last = parts.rfind('}').expect("an end");
    parts.insert_str(last, "*MATERIAL_REF 1\n");
    let text = format!("{}{materials}{parts}{}", &one[..begin], &one[begin..]);
    let (names, labels) = labels("a.ase", text.as_bytes(), &["wood", "mixed"]);
    let counts: Vec<_> =
        names.iter().filter(|(name, _)| ["cork", "mixed", "wood"].contains(&&**name)).collect();
    assert_eq!(counts.iter().map(|(_, faces)| *faces).collect::<Vec<_>>(), [1, 2, 1], "{names:?}");
    assert!(names.iter().any(|(_, faces)| *faces == 4), "both objects have the same name: {names:?}");
    assert_eq!(labels, [2, 1, 0, 0]);
}

#[test]
fn objects_and_materials_of_3ds_name_its_faces() {
    let whole = made::three_ds(&square());
    // Its list of faces goes on with the second face's material.
    let of_material = chunk(0x4130, &[&b"red\0"[..], &[1, 0, 1, 0]].concat());
    let at = whole.windows(2).rposition(|two| two == [0x50, 0x41]).expect("smoothing groups");
    let mut bytes = whole.clone();
    bytes.splice(at..at, of_material.iter().copied());
    // All chunks around it are longer now.
    for kind in [0x4D4D_u16, 0x3D3D, 0x4000, 0x4100, 0x4120] {
        let head = kind.to_le_bytes();
        let begin = bytes.windows(2).position(|two| two == head).expect("a chunk");
        let length = u32::from_le_bytes(bytes[begin + 2..begin + 6].try_into().expect("four bytes"));
        bytes[begin + 2..begin + 6].copy_from_slice(&(length + of_material.len() as u32).to_le_bytes());
    }
    let (names, face_labels) = labels("a.3ds", &bytes, &["red", "thing"]);
    assert_eq!(names, all(&[("red", 1), ("thing", 2)]));
    assert_eq!(face_labels, [2, 1]);
    // What is wrong with names does not take the shape along.
    let begin = bytes.windows(4).position(|four| four == *b"red\0").expect("a name");
    bytes[begin + 4] = 200;
    assert_eq!(labels("a.3ds", &bytes, &["thing"]).1, [1, 1]);
}

#[test]
fn formats_without_names_have_none() {
    for (file, bytes) in [("a.ply", made::ply(&square(), made::Ply::Text)), ("a.stl", vec![0; 84])] {
        assert!(model::read_names(Path::new(file), &bytes).expect("no names").is_none());
    }
}
