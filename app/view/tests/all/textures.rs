//! Textures of models lie where their files say.

use crate::common;

use common::{SIZE, colour, studio};
use std::path::Path;
use view::{Eyes, Moment, Stage};
use world::Scene;

/// A square of 20 cm that faces the camera, with a picture of four places.
const SQUARE: &str = r#"{"asset": {"version": "2.0"}, "nodes": [{"mesh": 0}],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "mode": 5, "material": 0}]}],
    "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
    "textures": [{"source": 0}], "images": [{"uri": "four.png"}],
    "accessors": [{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
        {"bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC2"}],
    "bufferViews": [{"buffer": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 32}],
    "buffers": [{"uri": "four.bin", "byteLength": 80}]}"#;
const SCENE: &str = "[[finger]]\n[[entity]]\nname = \"square\"\nshape = { kind = \"mesh\", file = \"four.gltf\" }\n\
    [[camera]]\nposition_m = [0.0, 0.0, 0.5]\nlook_at_m = [0.0, 0.0, 0.0]\n";

fn write(place: &Path) {
    let corners = [[-0.1_f32, -0.1, 0.0], [0.1, -0.1, 0.0], [-0.1, 0.1, 0.0], [0.1, 0.1, 0.0]];
    // From the upper left corner of the picture.
    let uv = [[0.0_f32, 1.0], [1.0, 1.0], [0.0, 0.0], [1.0, 0.0]];
    let numbers = corners.as_flattened().iter().chain(uv.as_flattened());
    let bytes: Vec<u8> = numbers.flat_map(|number| number.to_le_bytes()).collect();
    std::fs::write(place.join("four.bin"), bytes).expect("written");
    std::fs::write(place.join("four.gltf"), SQUARE).expect("written");
    let file = std::fs::File::create(place.join("four.png")).expect("a file");
    let mut encoder = png::Encoder::new(file, 2, 2);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    let mut writer = encoder.write_header().expect("a header");
    writer.write_image_data(&[255, 0, 0, 0, 255, 0, 0, 0, 255, 255, 255, 0]).expect("written");
    writer.finish().expect("written");
}

#[test]
fn a_picture_lies_on_a_model_as_its_file_says() {
    let place = tempfile::tempdir().expect("a directory");
    write(place.path());
    let scene = Scene::parse(SCENE, &place.path().join("s.toml")).expect("a scene");
    let stage = Stage::new(&scene, &[]);
    assert!(stage.not_drawn.is_empty(), "{:?}", stage.not_drawn);
    let Some(mut studio) = studio(&stage, SIZE) else { return };
    let moment = Moment { poses: vec![Default::default()], ..Moment::default() };
    let picture = studio.take(&moment, &stage.cameras[0], &Eyes::default());
    // In the middles of its places: between them colours are mixed.
    for (x, y, is_lit) in [
        (-0.05, 0.05, [true, false, false]),
        (0.05, 0.05, [false, true, false]),
        (-0.05, -0.05, [false, false, true]),
        (0.05, -0.05, [true, true, false]),
    ] {
        let [r, g, b] = colour(&picture, &stage.cameras[0], [x, y, 0.0]);
        let brightest = r.max(g).max(b);
        let found = [r, g, b].map(|share| 2 * share > brightest);
        assert!(brightest > 60 && found == is_lit, "{x} {y}: {r} {g} {b}");
    }
}
