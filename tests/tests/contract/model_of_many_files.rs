//! A model that consists of several files, as glTF does: nothing is written into any of them, and recordings have them all.

use patience::prelude::*;
use rustix::process::{Pid, Signal, kill_process};
use std::fs;
use std::process::Stdio;
use system_tests::faults::terminal::Terminal;
use system_tests::workplace::{Workplace, hand};

/// A box of 10 cm, with its numbers and its picture in a directory beside it.
const BOX: &str = r#"{"asset": {"version": "2.0"}, "nodes": [{"mesh": 0}],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 0}]}],
    "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
    "textures": [{"source": 0}], "images": [{"uri": "parts/skin%201.png"}],
    "accessors": [{"bufferView": 0, "componentType": 5126, "count": 8, "type": "VEC3"},
        {"bufferView": 1, "componentType": 5121, "count": 36, "type": "SCALAR"}],
    "bufferViews": [{"buffer": 0, "byteLength": 96}, {"buffer": 0, "byteOffset": 96, "byteLength": 36}],
    "buffers": [{"uri": "parts/box.bin", "byteLength": 132}]}"#;
const SCENE: &str =
    "[[finger]]\nstart_m = [0.0, 0.06, 0.0]\n[[entity]]\nshape = { kind = \"mesh\", file = \"box.gltf\" }\n";
const PICTURE: &[u8] = b"no picture, but precious";

fn with_box() -> Workplace {
    let place = Workplace::new();
    let corner = |k: u8| [k & 1, k >> 1 & 1, k >> 2].map(|bit| 0.1 * f32::from(bit) - 0.05);
    let corners = (0..8).flat_map(corner).flat_map(f32::to_le_bytes);
    // Of each axis both sides, counter-clockwise from outside.
    let quads = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let faces = quads.iter().flat_map(|[a, b, c, d]| [*a, *b, *c, *a, *c, *d]);
    fs::create_dir(place.path("parts")).expect("a directory");
    place.write("parts/box.bin", corners.chain(faces).collect::<Vec<u8>>());
    place.write("parts/skin 1.png", PICTURE);
    place.write("box.gltf", BOX);
    place.write("scene.toml", SCENE);
    place.write(
        "hand.csv",
        hand([(0.0, [0.0, 0.06, 0.0]), (0.2, [0.0, 0.048, 0.0]), (0.3, [0.01, 0.048, 0.0])]),
    );
    place
}

const RUN: [&str; 7] = ["run", "scene.toml", "--hand", "hand.csv", "--clock", "virtual", "--headless"];

#[test]
fn nothing_is_written_into_a_file_that_a_model_consists_of() {
    let place = with_box();
    for output in
        [["--record", "parts/box.bin"], ["--snapshot", "0.1:parts/skin 1.png"], ["--events", "parts/box.bin"]]
    {
        let before = place.snapshot();
        let said = place.run(RUN.iter().chain(&output));
        assert_eq!(said.status, Some(2), "{output:?}: {}", said.err);
        assert_eq!(place.snapshot(), before, "{output:?}: {}", said.err);
    }
    // A model that is only seen is one of the run's files, too.
    place.write("other.toml", SCENE.replace("kind = \"mesh\", file = \"box.gltf\" }", "kind = \"sphere\", radius_m = 0.05 }\nvisual = { shape = { kind = \"mesh\", file = \"box.gltf\" } }"));
    for output in ["parts/box.bin", "box.gltf"] {
        let said = place.run(["run", "other.toml", "--clock", "virtual", "--headless", "--record", output]);
        assert_eq!(said.status, Some(2), "{output}: {}", said.err);
    }
}

#[test]
fn a_recording_has_all_files_that_a_model_consists_of() {
    let place = with_box();
    let said = place.run(RUN.iter().chain(&["--record", "r.mcap", "--record", "r.csv"]));
    assert_eq!(said.status, Some(0), "{}", said.err);
    let table = fs::read_to_string(place.path("r.csv")).expect("a table");
    assert!(table.lines().last().is_some_and(|row| !row.contains("free")), "it touches");
    for file in ["box.gltf", "parts/box.bin", "parts/skin 1.png", "scene.toml"] {
        fs::remove_file(place.path(file)).expect("ours");
    }
    let said = place.run(["replay", "r.mcap"]);
    assert_eq!(said.status, Some(0), "{}", said.err);
    assert!(said.out.contains("identical"), "{}", said.out);
}

#[test]
fn a_texture_that_cannot_be_seen_is_a_warning() {
    let place = with_box();
    for file in ["box.gltf", "scene.toml"] {
        let said = place.run(["check", file]);
        assert_eq!(said.status, Some(0), "{}", said.err);
        let words =
            "images[0] (`parts/skin%201.png`): found a file of another kind; allowed: a PNG or JPEG file";
        assert!(said.out.contains(words), "{file}: {}", said.out);
    }
}

/// Eight textures of 67 million places each take many seconds.
#[test]
fn a_run_that_reads_for_long_says_what_and_a_signal_ends_it() {
    let place = with_box();
    let mut picture = Vec::new();
    let mut encoder = png::Encoder::new(&mut picture, 8192, 8192);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(png::BitDepth::One);
    encoder.write_header().expect("a header").write_image_data(&vec![0x55; 1 << 23]).expect("a picture");
    let numbers = 0..8;
    for k in numbers.clone() {
        place.write(format!("parts/{k}.png"), &picture);
    }
    let list = |of: fn(u8) -> String| numbers.clone().map(of).collect::<Vec<_>>().join(", ");
    let materials =
        list(|k| format!(r#"{{"pbrMetallicRoughness": {{"baseColorTexture": {{"index": {k}}}}}}}"#));
    let textures = list(|k| format!(r#"{{"source": {k}}}"#));
    let images = list(|k| format!(r#"{{"uri": "parts/{k}.png"}}"#));
    let many = BOX
        .replace(r#"{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}"#, &materials)
        .replace(r#"{"source": 0}"#, &textures)
        .replace(r#"{"uri": "parts/skin%201.png"}"#, &images);
    place.write("box.gltf", many);
    let terminal = Terminal::open();
    let mut program = place.phantom3();
    program.args(["run", "scene.toml", "--clock", "virtual", "--seconds", "5", "--snapshot", "0:a.png"]);
    let mut child = program.stdout(Stdio::null()).stderr(terminal.end()).spawn().expect("it starts");
    terminal.wait_for("phantom3: reading scene.toml (1 s)");
    kill_process(Pid::from_child(&child), Signal::INT).expect("it runs");
    terminal.wait_for("ended by signal 2 before its time");
    let status = child.bounded_wait();
    assert_eq!(status.code(), Some(128 + 2));
    assert!(!place.path("a.png").exists());
}
