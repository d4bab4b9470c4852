//! Height maps of a scene: what is read, what is refused with which words; and texture coordinates of OBJ files.

use haptics::mesh::CornerUv;
use haptics::{Border, HeightForm, PictureScale};
use std::path::{Path, PathBuf};
use world::model::{read_obj, read_obj_with_uv, read_with_uv};
use world::{HeightMapSpec, Scene};

const BALL: &str = "{ kind = \"sphere\", radius_m = 0.05 }";
const PLANE: &str = "{ kind = \"plane\", normal = [0, 1, 0], offset_m = 0 }";
const MESH: &str = "{ kind = \"mesh\", file = \"a.obj\" }";

fn scene(shape: &str, height_map: &str) -> String {
    format!("[[finger]]\n[[entity]]\nshape = {shape}\nheight_map = {height_map}\n")
}

fn read(shape: &str, rest: &str) -> HeightMapSpec {
    let text = scene(shape, &format!("{{ file = \"a.png\", amplitude_m = 0.001{rest} }}"));
    let scene =
        Scene::parse(&text, Path::new("dir/s.toml")).unwrap_or_else(|error| panic!("{error}\n{text}"));
    scene.entities[0].height_map.clone().expect("a height map")
}

#[track_caller]
fn refused(shape: &str, height_map: &str, message: &str) {
    let error = Scene::parse(&scene(shape, height_map), Path::new("s.toml")).expect_err("the scene is wrong");
    assert_eq!(error.to_string(), format!("s.toml:4: entity[0].height_map{message}"));
}

#[test]
fn a_height_map_is_a_raised_surface_unless_something_else_is_said() {
    let plain = read(BALL, "");
    assert_eq!(plain.file, PathBuf::from("dir/a.png"), "relative to the scene");
    assert_eq!((plain.amplitude_m, plain.zero_level, plain.invert), (0.001, 0.0, false));
    assert_eq!((plain.form, plain.border), (HeightForm::Gradient, Border::Repeat));
    assert_eq!(plain.scale, PictureScale::Repeat([1.0; 2]), "one picture over all of it");
    assert_eq!(plain.at.to_string(), "dir/s.toml:4: entity[0].height_map");
    assert_eq!(plain.file_at.to_string(), "dir/s.toml:4: entity[0].height_map.file");
    let said = read(
        PLANE,
        ", size_m = [0.05, 0.02], form = \"along-force\", invert = true, zero_level = 0.5, border = \"clamp\"",
    );
    assert_eq!(said.scale, PictureScale::Size([0.05, 0.02]));
    assert_eq!((said.form, said.border), (HeightForm::AlongForce, Border::Clamp));
    assert_eq!((said.zero_level, said.invert), (0.5, true));
    assert_eq!(
        read(MESH, ", repeat = [4, 2.5], form = \"gradient\"").scale,
        PictureScale::Repeat([4.0, 2.5])
    );
    let bare = Scene::parse(&format!("[[finger]]\n[[entity]]\nshape = {BALL}\n"), Path::new("s.toml"));
    assert_eq!(bare.expect("a scene").entities[0].height_map, None);
}

#[test]
fn a_height_map_that_is_wrong_is_refused_with_its_place() {
    let with = |rest: &str| format!("{{ file = \"a.png\", amplitude_m = 0.001, {rest} }}");
    refused(
        BALL,
        "\"a.png\"",
        ": found the string \"a.png\"; allowed: a table such as { file = \"bumps.png\", amplitude_m = 0.0005, \
         size_m = [0.05, 0.05] }",
    );
    refused(
        BALL,
        "{ amplitude_m = 0.001 }",
        ".file: missing; allowed: the path of a PNG file, relative to this file",
    );
    refused(
        BALL,
        "{ file = \"a.png\" }",
        ".amplitude_m: missing; allowed: a number from -1 to 1, the height of white above black",
    );
    refused(
        BALL,
        "{ file = \"a.png\", amplitude_m = 2 }",
        ".amplitude_m: found 2; allowed: a number from -1 to 1, the height of white above black",
    );
    refused(
        BALL,
        "{ file = \"a.png\", amplitude = 0.001 }",
        ".amplitude: unknown key (did you mean `amplitude_m`?); allowed: file, amplitude_m, size_m, repeat, form, \
         invert, zero_level, border",
    );
    refused(
        BALL,
        &with("form = \"bumpy\""),
        ".form: unknown form of a height map `bumpy`; allowed: gradient, along-force",
    );
    refused(
        BALL,
        &with("border = \"clam\""),
        ".border: unknown border `clam` (did you mean `clamp`?); allowed: repeat, clamp",
    );
    refused(BALL, &with("invert = 1"), ".invert: found 1; allowed: true or false");
    refused(
        BALL,
        &with("zero_level = 1.5"),
        ".zero_level: found 1.5; allowed: a number from 0 (black) to 1 (white)",
    );
    refused(BALL, &with("size_m = 0.05"), ".size_m: found 0.05; allowed: an array of 2 numbers above 0");
    refused(BALL, &with("repeat = [1, 0]"), ".repeat[1]: found 0; allowed: a number above 0");
    refused(
        BALL,
        &with("repeat = [1, 1], size_m = [1, 1]"),
        ".repeat: found an array of length 2; allowed: either size_m, the size of one picture, or repeat, how many there are",
    );
    refused(PLANE, &with("invert = true"), ".size_m: missing; allowed: an array of 2 numbers above 0");
    refused(
        PLANE,
        &with("repeat = [4, 4]"),
        ".repeat: found an array of length 2; allowed: size_m instead, the size of one picture, since a plane has no ends \
         to repeat it between",
    );
    refused(
        MESH,
        &with("size_m = [1, 1]"),
        ".size_m: found an array of length 2; allowed: repeat instead, since the texture coordinates of a mesh count \
         pictures, not metres",
    );
}

/// A square of two triangles, or of one quad.
const VERTICES: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";
const TEXTURES: &str = "vt 0 0\nvt 2 0\nvt 2 3\nvt 0 3 0.5\n";

fn uv(text: &str) -> Vec<CornerUv> {
    read_obj_with_uv(text.as_bytes()).unwrap_or_else(|error| panic!("{error}\n{text}")).1
}

#[track_caller]
fn obj_refused(text: &str, message: &str) {
    let error = read_obj_with_uv(text.as_bytes()).expect_err("the file is wrong");
    assert_eq!(error.to_string(), message, "{text}");
}

#[test]
fn corners_of_an_obj_have_the_texture_coordinates_that_they_name() {
    let expected = [[[0.0, 0.0], [2.0, 0.0], [2.0, 3.0]], [[0.0, 0.0], [2.0, 3.0], [0.0, 3.0]]];
    for faces in [
        "f 1/1 2/2 3/3\nf 1/1 3/3 4/4\n",
        "f 1/1 2/2 3/3 4/4\n",
        "vn 0 0 1\nf 1/1/1 2/2/1 3/3/1 4/4/1\n",
        "f -4/-4 -3/-3 -2/-2 -1/-1\n",
        "f 1/1 2/2 3/3 \\\n4/4\n",
    ] {
        assert_eq!(uv(&format!("{VERTICES}{TEXTURES}{faces}")), expected, "{faces}");
        // Faces may come first.
        if !faces.contains("-4") {
            assert_eq!(uv(&format!("{faces}{TEXTURES}{VERTICES}")), expected, "{faces}");
        }
    }
    let one = uv(&format!("{VERTICES}vt 0.5\nf 1/1 2/1 3/1\n"));
    assert_eq!(one, [[[0.5, 0.0]; 3]], "along a line of a picture");
}

#[test]
fn a_seam_gives_one_vertex_several_texture_coordinates() {
    let text = format!("{VERTICES}{TEXTURES}vt 7 7\nf 1/1 2/2 3/3\nf 1/5 3/3 4/4\n");
    assert_eq!(uv(&text)[1][0], [7.0, 7.0]);
    assert_eq!(uv(&text)[0][0], [0.0, 0.0]);
}

#[test]
fn concave_polygons_are_divided_alike_with_and_without_texture_coordinates() {
    // Vertices named in another order than they stand in the file, and texture coordinates in a third.
    let places = [[0, 0], [4, 0], [4, 4], [2, 1], [0, 4]];
    let order = [3, 0, 4, 1, 2];
    let mut text = String::new();
    for place in order {
        text += &format!("v {} {} 0\n", places[place][0], places[place][1]);
    }
    for [x, y] in places.iter().rev() {
        text += &format!("vt {x} {y}\n");
    }
    let index = |place: usize| order.iter().position(|&i| i == place).expect("a vertex") + 1;
    let corners: Vec<String> = (0..5).map(|place| format!("{}/{}", index(place), 5 - place)).collect();
    text += &format!("f {}\n", corners.join(" "));
    let plain = read_obj(text.as_bytes()).expect("a polygon");
    let (soup, uv) = read_obj_with_uv(text.as_bytes()).expect("a polygon");
    assert_eq!(soup, plain);
    assert_eq!(uv.len(), 3);
    for (face, uv) in soup.faces.iter().zip(uv) {
        for (vertex, uv) in face.iter().zip(uv) {
            let vertex = soup.vertices[*vertex as usize];
            assert_eq!(uv, [vertex.x, vertex.y], "each its own");
        }
    }
}

#[test]
fn missing_texture_coordinates_are_refused_with_their_line() {
    obj_refused(
        &format!("{VERTICES}{TEXTURES}f 1/1 2/2 3/3\nf 1 3 4\n"),
        "line 10: found corner `1` without a texture coordinate; allowed: corners such as 7/2 or 7/2/3, and lines `vt`, \
         since a picture is to lie on this model",
    );
    obj_refused(
        &format!("{VERTICES}vn 0 0 1\nf 1//1 2//1 3//1\n"),
        "line 6: found corner `1//1` without a texture coordinate; allowed: corners such as 7/2 or 7/2/3, and lines \
         `vt`, since a picture is to lie on this model",
    );
    obj_refused(
        &format!("{VERTICES}{TEXTURES}f 1/1 2/5 3/3\n"),
        "line 9: found texture coordinate 5; allowed: 1 to 4, or -4 to -1, since there are 4 texture coordinates",
    );
    obj_refused(
        &format!("{VERTICES}f 1/1 2/2 3/3\n"),
        "line 5: found texture coordinate 1; allowed: a texture coordinate, but there is none",
    );
    obj_refused(
        &format!("{VERTICES}{TEXTURES}f 1/0 2/2 3/3\n"),
        "line 9: found texture coordinate 0; allowed: 1 to 4, or -4 to -1, since there are 4 texture coordinates",
    );
    obj_refused(
        &format!("{VERTICES}vt nan 0\nf 1/1 2/1 3/1\n"),
        "line 5: found `nan`; allowed: a finite number",
    );
    obj_refused(
        &format!("{VERTICES}vt\nf 1/1 2/1 3/1\n"),
        "line 5: found a texture coordinate of 0 numbers; allowed: one to three of them",
    );
    // Nobody minds where no picture is to lie on it.
    assert!(read_obj(format!("{VERTICES}vt nan 0\nf 1 2 3\n").as_bytes()).is_ok());
    let stl = read_with_uv(Path::new("a.stl"), &[0; 84]).expect_err("no coordinates").to_string();
    assert_eq!(
        stl,
        "found no OBJ file, and of others no texture coordinates are read; allowed under a height map: an OBJ file with `vt`"
    );
}
