//! What is seen and what is felt are independent of each other, and whoever draws finds all that is needed.
#![allow(non_snake_case)]

use std::path::{Path, PathBuf};
use std::sync::Arc;

use nalgebra::Vector3;
use world::seen::{SeenForm, SeenPart};
use world::{Scene, ShapeSpec};

const MESHES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../config/meshes");

/// A finely drawn thing that feels coarse, ten of them; the reverse; a ball that is seen as it feels; and what is felt only.
fn scene() -> Scene {
    let text = format!(
        "[[finger]]\n\
         [[template]]\nname = \"fine\"\nshape = {{ kind = \"mesh\", file = \"{MESHES}/coarse.obj\" }}\n\
         visual = {{ shape = {{ kind = \"mesh\", file = \"{MESHES}/bumpy.obj\", scale = 0.5 }}, \
         colour = [0.1, 0.2, 0.3, 0.4], position_m = [0.0, 0.01, 0.0], casts_shadow = false }}\n\
         [[entity]]\nname = \"thing\"\ntemplate = \"fine\"\ngrid = {{ count = [10, 1, 1], spacing_m = [0.1, 0.1, 0.1] }}\n\
         [[entity]]\nname = \"reverse\"\nshape = {{ kind = \"mesh\", file = \"{MESHES}/bumpy.obj\" }}\n\
         visual = {{ shape = {{ kind = \"mesh\", file = \"{MESHES}/coarse.obj\" }} }}\n\
         [[entity]]\nname = \"ball\"\nshape = {{ kind = \"sphere\", radius_m = 0.05 }}\nvisual = {{ colour = [1, 0, 0] }}\n\
         [[entity]]\nname = \"hidden\"\nshape = {{ kind = \"sphere\", radius_m = 0.05 }}\nvisual = false\n\
         [[light]]\nkind = \"ambient\"\n[[camera]]\nposition_m = [0, 0, 1]\n"
    );
    Scene::parse(&text, Path::new("s.toml")).unwrap_or_else(|error| panic!("{error}"))
}

fn felt_file(part: &SeenPart<'_>) -> PathBuf {
    let ShapeSpec::Mesh(mesh) = &part.entity.shape else { panic!("{:?}", part.entity.shape) };
    PathBuf::from(mesh.file.file_name().expect("a file"))
}

fn faces(part: &SeenPart<'_>) -> usize {
    let SeenForm::Triangles { soup, .. } = &part.form else { panic!("{:?}", part.form) };
    soup.faces.len()
}

#[test]
fn a_fine_picture_lies_over_a_coarse_feel_and_the_reverse() {
    let scene = scene();
    let seen = scene.seen();
    assert!(seen.unreadable.is_empty(), "{:?}", seen.unreadable);
    assert_eq!((seen.parts.len(), seen.lights.len(), seen.cameras.len()), (12, 1, 1));
    let (fine, reverse) = (&seen.parts[0], &seen.parts[10]);
    assert_eq!(
        [felt_file(fine), felt_file(reverse)].map(|file| file.display().to_string()),
        ["coarse.obj", "bumpy.obj"]
    );
    assert!(faces(fine) > 10 * faces(reverse), "{} {}", faces(fine), faces(reverse));
    // All that is needed to draw it.
    let SeenForm::Triangles { scale, .. } = &fine.form else { panic!("{:?}", fine.form) };
    assert_eq!((*scale, fine.colour, fine.casts_shadow), ([0.5; 3], [0.1, 0.2, 0.3, 0.4], false));
    let X_WV = seen.parts[3].entity.pose * fine.X_BV;
    // A sum of numbers below 1.
    assert!((X_WV.translation.vector - Vector3::new(0.3, 0.01, 0.0)).norm() < 1e-15);
}

#[test]
fn a_file_is_read_once_however_many_show_it() {
    let scene = scene();
    let seen = scene.seen();
    let SeenForm::Triangles { soup, .. } = &seen.parts[0].form else { panic!("{:?}", seen.parts[0].form) };
    let is_shared = |part: &SeenPart<'_>| matches!(&part.form, SeenForm::Triangles { soup: own, .. } if Arc::ptr_eq(own, soup));
    assert!(seen.parts[..10].iter().all(is_shared));
    assert!(!is_shared(&seen.parts[10]));
}

#[test]
fn what_has_no_picture_of_its_own_is_seen_as_it_is_felt_and_what_is_hidden_is_not() {
    let scene = scene();
    let seen = scene.seen();
    let ball = seen.parts.last().expect("the ball");
    assert!(matches!(ball.form, SeenForm::Shape(ShapeSpec::Sphere { radius_m: 0.05 })), "{:?}", ball.form);
    assert_eq!((ball.entity.name.as_str(), ball.colour), ("ball", [1.0, 0.0, 0.0, 1.0]));
    assert!(seen.parts.iter().all(|part| part.entity.name != "hidden"));
}

#[test]
fn a_picture_that_is_not_there_is_told_once_with_its_place() {
    let text = "[[finger]]\n[[entity]]\nshape = { kind = \"sphere\", radius_m = 1 }\n\
                visual = { shape = { kind = \"mesh\", file = \"none.obj\" } }\n\
                grid = { count = [3, 1, 1], spacing_m = [3, 3, 3] }\n";
    let scene = Scene::parse(text, Path::new("s.toml")).unwrap();
    let seen = scene.seen();
    assert!(seen.parts.is_empty());
    let told: Vec<String> =
        seen.unreadable.iter().map(|(at, _)| format!("{}:{}", at.file.display(), at.line)).collect();
    assert_eq!(told, ["s.toml:4"]);
}

#[test]
fn faces_with_a_colour_of_their_own_are_parts_of_their_own() {
    let place = tempfile::tempdir().expect("a directory");
    let corners = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 2 0 0\n";
    let text = format!(
        "{corners}usemtl red\nf 1 2 3\nusemtl blue\nf 1 3 4\nusemtl plain\nf 2 5 3\ng rest\nf 1 5 4\n"
    );
    std::fs::write(place.path().join("a.obj"), text).expect("written");
    let text = "[[finger]]\n[[entity]]\nshape = { kind = \"mesh\", file = \"a.obj\" }\nvisual = { colour = [0, 1, 0] }\n\
                [[entity.faces]]\nof = \"plain\"\nstiffness_n_per_m = 500\n\
                [[entity.faces]]\nof = [\"red\", \"rest\"]\ncolour = [1, 0, 0]\n\
                [[entity.faces]]\nof = \"blue\"\ncolour = [0, 0, 1, 0.5]\n\
                [[entity]]\nname = \"other\"\nshape = { kind = \"mesh\", file = \"a.obj\" }\n";
    let scene = Scene::parse(text, &place.path().join("s.toml")).unwrap_or_else(|error| panic!("{error}"));
    let seen = scene.seen();
    let told: Vec<_> = seen.parts.iter().map(|part| (part.colour, faces(part))).collect();
    let [green, red, blue] = [[0.0, 1.0, 0.0, 1.0], [1.0, 0.0, 0.0, 1.0], [0.0, 0.0, 1.0, 0.5]];
    // What is plain comes first of those that name it, whatever else it is.
    let grey = world::VisualSpec::DEFAULT_COLOUR;
    assert_eq!(told, [(green, 2), (red, 1), (blue, 1), (grey, 4)]);
    for part in &seen.parts {
        let SeenForm::Triangles { soup, .. } = &part.form else { panic!("{:?}", part.form) };
        assert!(soup.faces.iter().flatten().all(|corner| (*corner as usize) < soup.vertices.len()));
        assert!(soup.vertices.len() <= 3 * soup.faces.len());
    }
}
