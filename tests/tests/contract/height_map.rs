//! Height maps, felt through scene, picture, model, hand and recording alone; and pictures that are none.

use nalgebra::Vector3;
use std::f64::consts::{PI, TAU};
use system_tests::recording::Sample;
use system_tests::workplace::{Said, Workplace, hand};

/// An egg crate of one hill and one dale: 0.5 + 0.5 sin(2 pi u) sin(2 pi v), 64 texels along a side, 16 bits.
const BUMPS: &[u8] = include_bytes!("../../../config/pictures/bumps.png");
const K: f64 = 1000.0;
const AMPLITUDE_M: f64 = 0.0005;
const SIZE_M: f64 = 0.01;

fn scene(shape: &str, height_map: &str, rest: &str) -> String {
    let height_map =
        if height_map.is_empty() { String::new() } else { format!("height_map = {{ {height_map} }}\n") };
    format!(
        "[[finger]]\nstart_m = [0.0, 0.1, 0.0]\n[[entity]]\nname = \"thing\"\nshape = {{ {shape} }}\n\
         stiffness_n_per_m = {K}\n{height_map}{rest}"
    )
}

const TABLE: &str = "kind = \"plane\", normal = [0.0, 1.0, 0.0], offset_m = 0.0";
const SIZED: &str = "file = \"bumps.png\", amplitude_m = 0.0005, size_m = [0.01, 0.01]";

fn felt(files: &[(&str, &[u8])], scene: &str, path: &str) -> Vec<Sample> {
    let place = Workplace::new();
    place.write("bumps.png", BUMPS);
    for (name, bytes) in files {
        place.write(name, bytes);
    }
    let samples = place.play(scene, path, &[]).finger("f0");
    samples.iter().for_each(Sample::check);
    samples
}

/// Down, across hills and dales, up.
fn across() -> String {
    hand([
        (0.0, [-0.021, 0.004, 0.0037]),
        (0.3, [-0.021, -0.002, 0.0037]),
        (1.3, [0.013, -0.0017, -0.0131]),
        (1.5, [0.013, 0.004, -0.0131]),
    ])
}

/// Height of the bumps and its slopes along x and z on a table, whose picture has its middle at the origin and v along -z.
/// A spline through 64 texels keeps this share of a wave.
fn bumps(x: f64, z: f64) -> (f64, [f64; 2]) {
    let angle = PI / 64.0;
    let kept = (angle.sin() / angle).powi(6);
    let (u, v) = (TAU * (x / SIZE_M + 0.5), TAU * (-z / SIZE_M + 0.5));
    let slope = 0.5 * AMPLITUDE_M * kept * TAU / SIZE_M;
    (
        AMPLITUDE_M * (0.5 + 0.5 * kept * u.sin() * v.sin()),
        [slope * u.cos() * v.sin(), -slope * u.sin() * v.cos()],
    )
}

/// Sixteen bits are 1e-5 of the height, and what the spline adds to a wave 1e-5 in each direction; slopes are 64 times as
/// sensitive to the latter, and a rounded texel (1 / 131,072 of the height) shifts a slope by up to twice as much a texel.
const HEIGHT_ERROR: f64 = 4e-5;
const SLOPE_ERROR: f64 = 3e-3;

#[test]
fn a_raised_table_is_felt_by_its_height_and_its_slope() {
    let samples = felt(&[], &scene(TABLE, SIZED, ""), &across());
    let mut touched = 0;
    for s in &samples {
        let (h, [slope_x, slope_z]) = bumps(s.hip.x, s.hip.z);
        let load_n = (K * (h - s.hip.y)).max(0.0);
        let expected = Vector3::new(-slope_x, 1.0, -slope_z) * load_n;
        let tolerance = K * AMPLITUDE_M * HEIGHT_ERROR + load_n * SLOPE_ERROR * AMPLITUDE_M * PI / SIZE_M;
        assert!((s.force - expected).norm() <= tolerance, "{s:?} {expected}");
        if s.touches() {
            // The god-object is on the raised surface.
            assert!((s.god.y - h).abs() <= AMPLITUDE_M * HEIGHT_ERROR, "{s:?} {h}");
            touched += 1;
        }
    }
    assert!(touched > 1000, "{touched}");
}

#[test]
fn along_the_force_the_height_is_added_and_nothing_pushes_sideways() {
    let map = format!("{SIZED}, form = \"along-force\"");
    let samples = felt(&[], &scene(TABLE, &map, ""), &across());
    for s in samples.iter().filter(|s| s.hip.y < 0.0) {
        let expected = Vector3::y() * (K * (bumps(s.hip.x, s.hip.z).0 - s.hip.y));
        assert!((s.force - expected).norm() <= K * AMPLITUDE_M * HEIGHT_ERROR, "{s:?} {expected}");
    }
}

#[test]
fn inverted_carved_and_levelled_maps_are_what_they_say() {
    let force = |map: &str| {
        let samples = felt(&[], &scene(TABLE, map, ""), &across());
        samples.into_iter().filter(|s| s.hip.y < -0.001).map(|s| (s.hip, s.force)).collect::<Vec<_>>()
    };
    for (map, height) in [
        (format!("{SIZED}, invert = true"), (|h| AMPLITUDE_M - h) as fn(f64) -> f64),
        (SIZED.replace("0.0005", "-0.0005"), |h| -h),
        (format!("{SIZED}, zero_level = 0.5"), |h| h - 0.5 * AMPLITUDE_M),
    ] {
        let felt = force(&map);
        assert!(felt.len() > 500);
        for (hip, force) in felt {
            let expected = K * (height(bumps(hip.x, hip.z).0) - hip.y);
            assert!(
                (force.y - expected).abs() <= K * AMPLITUDE_M * HEIGHT_ERROR,
                "{map}: {hip} {force} {expected}"
            );
        }
    }
}

#[test]
fn friction_and_a_round_finger_go_with_it() {
    let friction = "friction = { model = \"coulomb\", mu = 0.4 }\n";
    for radius in ["0.0", "0.004"] {
        let scene =
            scene(TABLE, SIZED, friction).replace("start_m", &format!("radius_m = {radius}\nstart_m"));
        let samples = felt(&[], &scene, &across());
        assert!(samples.iter().filter(|s| s.friction == "slip").count() > 500, "{radius}");
        for s in samples.iter().filter(|s| s.friction == "slip") {
            // Without knowing the normal: a slope of up to 0.16 leans a cone of friction of 0.4.
            let ratio = (s.force - Vector3::y() * s.force.y).norm() / s.force.y;
            assert!(ratio < (0.4f64.atan() + 0.16f64.atan()).tan() + 1e-9, "{s:?}");
        }
    }
}

#[test]
fn a_mesh_with_texture_coordinates_feels_like_the_table() {
    // A block under the path, whose upper side has the coordinates that the plane has.
    let half = 0.05;
    let corners = [[-half, -half], [half, -half], [half, half], [-half, half]];
    let mut obj = String::new();
    for [x, z] in corners {
        let (u, v) = (x / SIZE_M + 0.5, -z / SIZE_M + 0.5);
        obj += &format!("v {x} 0 {z}\nvt {u} {v}\n");
    }
    for [x, z] in corners {
        obj += &format!("v {x} -0.05 {z}\n");
    }
    obj += "f 4/4 3/3 2/2 1/1\nf 5/1 6/1 7/1 8/1\n";
    for (a, b) in [(1, 2), (2, 3), (3, 4), (4, 1)] {
        obj += &format!("f {a}/1 {b}/1 {}/1 {}/1\n", b + 4, a + 4);
    }
    let carved = "file = \"bumps.png\", amplitude_m = 0.0005, zero_level = 1.0";
    for friction in ["", "friction = { model = \"stiction\", mu_s = 0.7, mu_d = 0.3 }\n"] {
        let mesh = felt(
            &[("a.obj", obj.as_bytes())],
            &scene("kind = \"mesh\", file = \"a.obj\"", carved, friction),
            &across(),
        );
        let plane =
            felt(&[], &scene(TABLE, &format!("{carved}, size_m = [0.01, 0.01]"), friction), &across());
        for (a, b) in mesh.iter().zip(&plane) {
            // Coordinates of 5 pictures in single precision: 3e-7 of a picture, of a slope of 0.16 over 10 mm, that
            // bends by as much in a sixth of it.
            assert!((a.force - b.force).norm() <= 1e-5, "{a:?}\n{b:?}");
            assert_eq!((a.touches(), &a.friction), (b.touches(), &b.friction));
        }
    }
}

#[test]
fn every_shape_takes_a_picture() {
    for shape in [
        "kind = \"sphere\", radius_m = 0.03",
        "kind = \"box\", size_m = [0.06, 0.06, 0.06]",
        "kind = \"cylinder\", radius_m = 0.03, length_m = 0.06",
        "kind = \"cone\", radius_bottom_m = 0.03, radius_top_m = 0.03, length_m = 0.06",
        "kind = \"capsule\", radius_m = 0.03, length_m = 0.04",
        "kind = \"torus\", ring_radius_m = 0.02, tube_radius_m = 0.01",
        "kind = \"ellipsoid\", radii_m = [0.03, 0.02, 0.03]",
        "kind = \"cylinder\", radius_m = 0.03, length_m = 0.06, scale = [1.0, 1.0, 0.5]",
    ] {
        // Along +x, in from the side and around.
        let path =
            hand([(0.0, [0.04, 0.0, 0.001]), (0.3, [0.028, 0.0, 0.001]), (1.3, [0.027, 0.001, 0.008])]);
        let map = "file = \"bumps.png\", amplitude_m = 0.0005, repeat = [24, 24]";
        let (plain, raised) =
            (felt(&[], &scene(shape, "", ""), &path), felt(&[], &scene(shape, map, ""), &path));
        let changed = plain.iter().zip(&raised).filter(|(a, b)| (a.force - b.force).norm() > 0.05).count();
        assert!(changed > 300, "{shape}: {changed}");
        assert!(raised.iter().all(|s| s.force.norm() < 8.0), "{shape}");
    }
}

fn run(files: &[(&str, &[u8])], scene: &str) -> Said {
    let place = Workplace::new();
    for (name, bytes) in files {
        place.write(name, bytes);
    }
    place.write("scene.toml", scene);
    place.run(["run", "scene.toml", "--clock", "virtual", "--headless", "--seconds", "0.1"])
}

#[test]
fn a_picture_or_model_that_will_not_do_is_refused_with_its_place() {
    let mesh = "kind = \"mesh\", file = \"a.obj\"";
    let ball = "kind = \"sphere\", radius_m = 0.05";
    let plain_obj: &[u8] = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    let repeated = "file = \"bumps.png\", amplitude_m = 0.0005, repeat = [2.5, 1]";
    let whole = "file = \"bumps.png\", amplitude_m = 0.0005";
    let cases: [(&str, &str, &[u8], &[&str]); 5] = [
        (TABLE, SIZED, b"", &["scene.toml:7: entity[0].height_map.file: bumps.png: found an empty file"]),
        (TABLE, SIZED, &BUMPS[..300], &["bumps.png: found a PNG file that is cut short or damaged"]),
        (
            mesh,
            whole,
            BUMPS,
            &["scene.toml:5: entity[0].shape.file: a.obj: line 4: found corner `1` without a texture"],
        ),
        (
            ball,
            repeated,
            BUMPS,
            &["scene.toml:7: entity[0].height_map: a picture repeated 2.5 times around", "whole"],
        ),
        (
            TABLE,
            &SIZED.replace("bumps", "none"),
            BUMPS,
            &["entity[0].height_map.file: none.png: no such file"],
        ),
    ];
    for (shape, map, picture, parts) in cases {
        let said = run(&[("bumps.png", picture), ("a.obj", plain_obj)], &scene(shape, map, ""));
        assert_eq!(
            (said.status, said.out.as_str(), said.err.lines().count()),
            (Some(2), "", 1),
            "{}",
            said.err
        );
        for part in parts {
            assert!(said.err.contains(part), "`{part}` is missing in: {}", said.err);
        }
    }
}

#[test]
fn a_recording_is_never_written_over_its_picture() {
    let place = Workplace::new();
    place.write("bumps.png", BUMPS);
    place.write("scene.toml", scene(TABLE, SIZED, ""));
    let said = place.run(["run", "scene.toml", "--clock", "virtual", "--headless", "--record", "bumps.png"]);
    assert_eq!(said.status, Some(2), "{}", said.err);
    assert_eq!(std::fs::read(place.path("bumps.png")).expect("the picture"), BUMPS);
}

#[test]
fn check_tells_of_heights_that_are_not_felt_as_drawn() {
    let place = Workplace::new();
    place.write("bumps.png", BUMPS);
    let board = "kind = \"box\", size_m = [0.2, 0.005, 0.2]";
    let bumps = |rest: &str| format!("file = \"bumps.png\", size_m = [0.01, 0.01], {rest}");
    let [steep, deep, high, step] = [
        "rises by more than 63 degrees on",
        "deep, and the thing 0.005 m thick",
        "high, and the thing 0.2 m long",
        "thing is met with a step of up to 9.988 N",
    ];
    for (shape, map, told) in [
        (TABLE, SIZED.to_owned(), &[][..]),
        (board, bumps("amplitude_m = 0.0005"), &[]),
        (board, bumps("amplitude_m = 0.02"), &[steep]),
        // Held from where it came in, a finger feels the whole dent.
        (board, bumps("amplitude_m = -0.004"), &[]),
        (board, bumps("amplitude_m = -0.006"), &[deep]),
        (board, bumps("amplitude_m = 0.006, zero_level = 1.0"), &[deep]),
        (board, bumps("amplitude_m = 0.5"), &[steep, high]),
        (TABLE, bumps("amplitude_m = 0.01, form = \"along-force\""), &[steep, step]),
    ] {
        place.write("scene.toml", scene(shape, &map, ""));
        let said = place.run(["check", "scene.toml"]);
        assert_eq!(said.status, Some(0), "{}", said.out);
        for words in [steep, deep, high, step] {
            assert_eq!(said.out.contains(words), told.contains(&words), "{map}: {words}: {}", said.out);
        }
    }
}
