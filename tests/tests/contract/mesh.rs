//! Meshes, felt through scene file, model file, hand file and recording alone; and files that are none.

use crate::written::Format;
use haptics::mesh::{TriangleSoup, make};
use nalgebra::Vector3;
use system_tests::recording::Sample;
use system_tests::workplace::{Said, Workplace, hand};

/// A scene around one thing.
fn scene(shape: &str, rest: &str) -> String {
    format!(
        "[[finger]]\nstart_m = [0.0, 0.2, 0.0]\n[[entity]]\nname = \"thing\"\n\
         shape = {{ {shape} }}\nstiffness_n_per_m = 1000.0\n{rest}"
    )
}

fn mesh(file: &str) -> String {
    scene(&format!("kind = \"mesh\", file = \"{file}\""), "")
}

/// Plays a scene beside these files; nothing may be said on standard error.
fn felt_with(files: &[(&str, &[u8])], scene: &str, path: &str) -> Vec<Sample> {
    let place = Workplace::new();
    for (name, bytes) in files {
        place.write(name, bytes);
    }
    let samples = place.play(scene, path, &[]).finger("f0");
    samples.iter().for_each(Sample::check);
    samples
}

/// A cube whose corners are exact in binary, in single precision and in decimals.
const HALF_M: f64 = 0.03125;

fn cube() -> TriangleSoup {
    make::cuboid([2.0 * HALF_M; 3])
}

/// Over the top of the cube, across an edge of it, along its side, and away.
fn around_the_cube() -> String {
    hand([
        (0.0, [0.003, 0.04, 0.002]),
        (0.2, [0.003, 0.0285, 0.002]),
        (0.6, [-0.013, 0.0281, 0.017]),
        (1.2, [0.0271, 0.0277, 0.011]),
        (1.6, [0.0302, 0.0269, 0.008]),
        (2.4, [0.0287, -0.0151, -0.013]),
        (2.6, [0.0411, -0.0151, -0.013]),
    ])
}

const FRICTIONS: [&str; 3] = [
    "",
    "friction = { model = \"coulomb\", mu = 0.5 }\n",
    "friction = { model = \"stiction\", mu_s = 0.6, mu_d = 0.3 }\n",
];

#[test]
fn a_cube_of_triangles_feels_like_a_box_tick_by_tick() {
    let obj = Format::Obj.write(&cube());
    for friction in FRICTIONS {
        let of_triangles = scene("kind = \"mesh\", file = \"cube.obj\"", friction);
        let of_equations = scene("kind = \"box\", size_m = [0.0625, 0.0625, 0.0625]", friction);
        let path = around_the_cube();
        let meshes = felt_with(&[("cube.obj", &obj)], &of_triangles, &path);
        let boxes = felt_with(&[], &of_equations, &path);
        let touching = boxes.iter().filter(|s| s.touches()).count();
        assert!(touching > 2000, "{touching}");
        for (mesh, box_) in meshes.iter().zip(&boxes) {
            // Both slides are exact but for rounding of centimetres, times the stiffness.
            let difference_n = (mesh.force - box_.force).norm();
            assert!(difference_n <= 1e-9, "{friction}: {difference_n} N apart\nmesh {mesh:?}\nbox  {box_:?}");
            assert_eq!(mesh.friction, box_.friction, "mesh {mesh:?}\nbox  {box_:?}");
        }
    }
}

#[test]
fn obj_and_both_kinds_of_stl_give_the_same_recording() {
    let path = around_the_cube();
    let play = |name: &str, format: Format| {
        let place = Workplace::new();
        place.write(name, format.write(&cube()));
        place.play(&scene(&format!("kind = \"mesh\", file = \"{name}\""), FRICTIONS[2]), &path, &[]);
        std::fs::read(place.path("out.csv")).expect("a recording")
    };
    let obj = play("cube.obj", Format::Obj);
    assert!(obj == play("cube.stl", Format::Stl), "binary STL");
    assert!(obj == play("cube.STL", Format::StlText), "text STL");
    // Names that say nothing.
    assert!(obj == play("cube", Format::Obj), "OBJ by content");
    assert!(obj == play("cube.mesh", Format::Stl), "binary STL by content");
    assert!(obj == play("obj", Format::StlText), "text STL by content");
}

#[test]
fn a_quad_obj_with_negative_indices_is_the_same_cube() {
    let mut obj = String::from("# six quads\r\nmtllib nowhere.mtl\r\no cube\r\n");
    for corner in 0..8 {
        let side = |bit: u32| if corner >> bit & 1 == 1 { HALF_M } else { -HALF_M };
        obj += &format!("v {} {} {} 1.0\r\n", side(0), side(1), side(2));
    }
    for quad in
        ["-8 -6 -5 -7", "5/1/1 6/2/1 8/3/1 7/4/1", "1//2 2//2 6//2 5//2", "3 7 8 4", "1 5 7 3", "2 4 8 6"]
    {
        obj += &format!("f {quad}\r\n");
    }
    let path = around_the_cube();
    let quads = felt_with(&[("cube.obj", obj.as_bytes())], &mesh("cube.obj"), &path);
    let triangles = felt_with(&[("cube.obj", &Format::Obj.write(&cube()))], &mesh("cube.obj"), &path);
    for (a, b) in quads.iter().zip(&triangles) {
        // Its diagonals may run the other way, which changes roundings.
        assert!((a.force - b.force).norm() <= 1e-9, "{a:?}\n{b:?}");
    }
}

#[test]
fn scale_makes_metres_of_millimetres_and_stretches_along_the_axes() {
    let path = around_the_cube();
    let metres = felt_with(&[("a.obj", &Format::Obj.write(&cube()))], &mesh("a.obj"), &path);
    let as_said = |bytes: &[u8], scale: &str| {
        let scene = scene(&format!("kind = \"mesh\", file = \"a.obj\", scale = {scale}"), "");
        felt_with(&[("a.obj", bytes)], &scene, &path)
    };
    let large = Format::Obj.write(&make::cuboid([62.5; 3]));
    for scaled in [as_said(&large, "0.001"), as_said(&large, "[0.001, 0.001, 0.001]")] {
        for (a, b) in metres.iter().zip(&scaled) {
            assert!((a.force - b.force).norm() <= 1e-9, "{a:?}\n{b:?}");
        }
    }
    let flat = Format::Obj.write(&make::cuboid([2.0 * HALF_M, 1.0, 4.0 * HALF_M]));
    for (a, b) in metres.iter().zip(&as_said(&flat, "[1, 0.0625, 0.5]")) {
        assert!((a.force - b.force).norm() <= 1e-9, "{a:?}\n{b:?}");
    }
}

/// A block with a pit in its top: a pyramid upside down, whose tip lies 2 cm below the rim.
const PIT: &str = "v -0.04 -0.04 -0.04\nv 0.04 -0.04 -0.04\nv 0.04 -0.04 0.04\nv -0.04 -0.04 0.04\n\
    v -0.04 0 -0.04\nv 0.04 0 -0.04\nv 0.04 0 0.04\nv -0.04 0 0.04\nv 0 -0.02 0\n\
    f 1 2 3 4\nf 1 5 6 2\nf 2 6 7 3\nf 3 7 8 4\nf 4 8 5 1\nf 9 6 5\nf 9 7 6\nf 9 8 7\nf 9 5 8\n";

#[test]
fn a_god_object_rests_on_a_face_an_edge_and_a_vertex_of_a_pit() {
    // Onto a side of the pit, to the edge between two of its sides, to its tip: each time straight down at last.
    let over = |x: f64, z: f64, tip: f64| {
        hand([
            (0.0, [x, 0.02, z]),
            (0.4, [x, tip - 0.003, z]),
            (0.8, [x, tip - 0.003, z]),
            (1.2, [x, 0.02, z]),
        ])
    };
    let height = |x: f64, z: f64| -0.02 + 0.5 * x.abs().max(z.abs());
    // Slopes of one half: the normal of a side leans by atan(1/2).
    let (n_up, n_in) = (1.0 / 1.25f64.sqrt(), 0.5 / 1.25f64.sqrt());
    for (x, z, feature, normal) in [
        (0.012, 0.003, "face", Vector3::new(-n_in, n_up, 0.0)),
        // Between the sides towards +x and +z: the edge runs along (2, 1, 2), so the shortest way is across it.
        (0.012, 0.012, "edge", Vector3::new(-1.0, 4.0, -1.0).normalize()),
        (0.0, 0.0, "vertex", Vector3::y()),
    ] {
        let samples = felt_with(&[("pit.obj", PIT.as_bytes())], &mesh("pit.obj"), &over(x, z, height(x, z)));
        let deep: Vec<&Sample> = samples.iter().filter(|s| s.t > 0.4 && s.t < 0.8).collect();
        for s in &deep {
            assert_eq!(s.feature, feature, "{s:?}");
            // 3 mm straight below the surface: the way out is shorter by the cosine of its lean.
            let expected = normal * (1000.0 * 0.003 * normal.y);
            assert!((s.force - expected).norm() <= 1e-6, "{feature}: {:?}, not {expected:?}", s.force);
        }
        assert!(!samples.last().is_some_and(Sample::touches), "and lets go");
    }
}

#[test]
fn a_bumpy_ball_pushes_outward_by_a_spring_and_lets_slide() {
    let bumpy = Format::Stl.write(&make::bumpy_sphere(48, 24, 0.04));
    // Around it near the equator, where the slopes of its hills stay below 0.4, at 68 mm/s.
    let at = |reach: f64, angle: f64| [reach * angle.cos(), 0.003, reach * angle.sin()];
    let arc = (0..=1000).map(|tick| (0.3 + f64::from(tick) * 1e-3, at(0.034, f64::from(tick) * 2e-3)));
    let path = hand([(0.0, at(0.06, 0.0))].into_iter().chain(arc));
    let friction = "friction = { model = \"stiction\", mu_s = 0.3, mu_d = 0.2 }\n";
    let samples =
        felt_with(&[("b.stl", &bumpy)], &scene("kind = \"mesh\", file = \"b.stl\"", friction), &path);
    let touching: Vec<&Sample> = samples.iter().filter(|s| s.touches()).collect();
    assert!(touching.len() > 900, "{}", touching.len());
    for s in &touching {
        assert!(s.force.dot(&s.god) > 0.0, "outward: {s:?}");
        // The spring between the two, on faces as on edges.
        let stretch_m = (s.god - s.hip).norm();
        assert!((s.force.norm() - 1000.0 * stretch_m).abs() <= 1e-9, "{s:?}");
        // 8 mm deep at most, and a cone that leans by the friction's angle and the hill's.
        assert!(stretch_m < 0.008 / (0.3f64.atan() + 0.4f64.atan()).cos(), "{stretch_m} m: {s:?}");
    }
    assert!(touching.iter().filter(|s| s.friction == "slip").count() > 500);
    assert!(["face", "edge"].iter().all(|feature| touching.iter().any(|s| s.feature == *feature)));
}

#[test]
fn a_klein_bottle_has_no_inside_and_is_felt_from_both_sides() {
    let place = Workplace::new();
    place.write("klein.stl", Format::Stl.write(&make::klein_bottle(32, 16, 0.08)));
    place.write("scene.toml", mesh("klein.stl"));
    // Right through it, from above and from the side, and back.
    let rows = [
        (0.0, [0.03, 0.06, 0.0]),
        (1.0, [0.03, -0.06, 0.001]),
        (2.0, [-0.06, 0.002, 0.03]),
        (3.0, [0.06, 0.0, 0.03]),
    ];
    place.write("hand.csv", hand(rows));
    let said = place.run([
        "run",
        "scene.toml",
        "--hand",
        "hand.csv",
        "--clock",
        "virtual",
        "--headless",
        "--record",
        "out.csv",
    ]);
    assert_eq!(said.status, Some(0), "{}", said.err);
    assert!(said.err.contains("cannot be oriented"), "whoever loads it is told: {}", said.err);
    assert!(!said.err.contains("merged"), "STL has no other way to share a vertex: {}", said.err);
    let samples = system_tests::recording::Table::read(&place.path("out.csv")).finger("f0");
    assert!(samples.iter().any(Sample::touches));
    for s in samples.iter().filter(|s| s.touches()) {
        assert!((s.force - (s.god - s.hip) * 1000.0).norm() <= 1e-9, "a spring and nothing else: {s:?}");
    }
}

/// Runs a scene with a mesh whose file holds `bytes`.
fn run_with(name: &str, bytes: &[u8]) -> Said {
    let place = Workplace::new();
    place.write(name, bytes);
    place.write("scene.toml", mesh(name));
    place.run(["run", "scene.toml", "--clock", "virtual", "--headless", "--seconds", "0.1"])
}

#[test]
fn a_broken_model_is_refused_with_scene_line_model_and_offender() {
    let good = String::from_utf8(Format::Obj.write(&cube())).expect("text");
    let stl = Format::Stl.write(&cube());
    let text = String::from_utf8(Format::StlText.write(&cube())).expect("text");
    let with_nan = [&stl[..100], &f32::NAN.to_le_bytes(), &stl[104..]].concat();
    let cases: Vec<(&str, Vec<u8>, &[&str])> = vec![
        ("a.obj", b"".into(), &["found no triangle"]),
        ("a.obj", b"v 0 0 0\n".into(), &["found no triangle"]),
        ("a.obj", good.replacen("v ", "w ", 1).into(), &["line 1: found `w`", "statements of OBJ"]),
        ("a.obj", (good.clone() + "f 1 2 99\n").into(), &["found vertex 99", "1 to 8"]),
        ("a.obj", (good.clone() + "f 1 2 0\n").into(), &["found vertex 0"]),
        ("a.obj", (good.clone() + "v 1 nan 0\n").into(), &["found `nan`", "a finite number"]),
        (
            "a.obj",
            (good + "surf 0 1 0 1 1 2 3\n").into(),
            &["`surf`", "free-form", "export the model as a mesh"],
        ),
        ("a.obj", b"v 0 0 0\nv 1 1 1\nv 2 2 2\nf 1 2 3\n".into(), &["none of the 1 faces has an area"]),
        (
            "a.obj",
            b"v 0 0 0\nv 1e300 0 0\nv 0 1 0\nf 1 2 3\n".into(),
            &["vertex 1 is at [1", "correct the vertex or the unit"],
        ),
        ("a.stl", stl[..stl.len() - 1].into(), &["byte 683", "after 11 of the 12 triangles", "cut short"]),
        ("a.stl", stl[..50].into(), &["byte 50", "at least 84 bytes"]),
        ("a.stl", [&stl[..80], &[13, 0, 0, 0], &stl[84..]].concat(), &["after 12 of the 13 triangles"]),
        ("a.stl", [&stl[..], b"more"].concat(), &["byte 684", "4 bytes behind the 12 triangles"]),
        ("a.stl", with_nan, &["byte 96", "corner 0 of triangle 0", "NaN"]),
        (
            "a.stl",
            text[..text.rfind("endloop").expect("a loop")].into(),
            &["line ", "cut short", "`endloop`"],
        ),
        (
            "a.stl",
            text.replacen("endloop", "loop", 1).into(),
            &["line 7: found `loop`", "allowed: `endloop`"],
        ),
        ("a.ply", b"ply\nformat ascii 1.0\n".into(), &["line 3", "`end_header`"]),
        ("a.fbx", b"Kaydara FBX Binary".into(), &["a file of FBX", "export as glTF"]),
    ];
    for (name, bytes, parts) in cases {
        let said = run_with(name, &bytes);
        assert_eq!(said.status, Some(2), "{parts:?}: {}", said.err);
        assert_eq!((said.out.as_str(), said.err.lines().count()), ("", 1), "one message: {}", said.err);
        let place = format!("phantom3: scene.toml:5: entity[0].shape.file: {name}: ");
        assert!(said.err.starts_with(&place), "{place}: {}", said.err);
        for part in parts {
            assert!(said.err.contains(part), "`{part}` is missing in: {}", said.err);
        }
    }
}

#[test]
fn a_model_that_cannot_be_read_is_refused() {
    let place = Workplace::new();
    std::fs::create_dir(place.path("directory.obj")).expect("a directory");
    place.write("pointer.obj", "version https://git-lfs.github.com/spec/v1\noid sha256:4d7a\nsize 12345\n");
    place.write("packed.stl", b"\x1f\x8b\x08\x00\x00\x00\x00\x00");
    for (file, part) in [
        ("none.obj", "none.obj: no such file"),
        ("directory.obj", "directory.obj: it is a directory, no regular file"),
        ("/dev/zero", "/dev/zero: it is a device, no regular file"),
        ("scene.toml/a.obj", "scene.toml/a.obj: cannot be read"),
        ("pointer.obj", "pointer.obj: cannot be read: it is a pointer of Git LFS"),
        ("packed.stl", "packed.stl: cannot be read: it is compressed by gzip; unpack it with gunzip"),
    ] {
        place.write("scene.toml", mesh(file));
        let said = place.run(["run", "scene.toml", "--clock", "virtual", "--headless"]);
        assert_eq!(said.status, Some(2), "{}", said.err);
        assert!(
            said.err.contains("scene.toml:5: entity[0].shape.file") && said.err.contains(part),
            "{}",
            said.err
        );
    }
}

#[test]
fn a_model_lies_relative_to_the_scene_file_and_not_to_where_one_stands() {
    let place = Workplace::new();
    for directory in ["scenes", "meshes"] {
        std::fs::create_dir(place.path(directory)).expect("a directory");
    }
    place.write("meshes/cube.obj", Format::Obj.write(&cube()));
    place.write("scenes/scene.toml", mesh("../meshes/cube.obj"));
    let said =
        place.run(["run", "scenes/scene.toml", "--clock", "virtual", "--headless", "--seconds", "0.1"]);
    assert_eq!((said.status, said.err.as_str()), (Some(0), ""));
}

#[test]
fn what_was_repaired_is_told_once_however_many_entities_use_it() {
    // A face turned over, one given twice, one without an area; used by two entities.
    let obj = String::from_utf8(Format::Obj.write(&cube())).expect("text");
    let first = obj.lines().find(|line| line.starts_with('f')).expect("a face").to_owned();
    let numbers: Vec<&str> = first.split(' ').skip(1).collect();
    let [a, b, c] = numbers[..] else { panic!("a triangle") };
    let spoilt = obj.replacen(&first, &format!("f {a} {c} {b}"), 1) + &format!("f {a} {b} {c}\nf 1 1 2\n");
    let place = Workplace::new();
    place.write("cube.obj", spoilt);
    let again =
        "[[entity]]\nshape = { kind = \"mesh\", file = \"cube.obj\" }\nposition_m = [1.0, 0.0, 0.0]\n";
    place.write("scene.toml", mesh("cube.obj") + again);
    let said = place.run(["run", "scene.toml", "--clock", "virtual", "--headless", "--seconds", "0.1"]);
    assert_eq!(said.status, Some(0), "{}", said.err);
    let lines: Vec<&str> = said.err.lines().collect();
    assert!(lines.iter().all(|line| line.starts_with("phantom3: cube.obj: ")), "{}", said.err);
    assert!(lines[0].ends_with("12 faces, 8 vertices, 1 part"), "{}", said.err);
    for part in ["turned over", "given before", "without an area"] {
        assert_eq!(
            lines.iter().filter(|line| line.contains(part)).count(),
            1,
            "`{part}` once in: {}",
            said.err
        );
    }
}

#[test]
fn a_recording_does_not_overwrite_a_model() {
    let place = Workplace::new();
    let bytes = Format::Obj.write(&cube());
    place.write("cube.obj", &bytes);
    place.write("scene.toml", mesh("cube.obj"));
    let said = place.run(["run", "scene.toml", "--clock", "virtual", "--headless", "--record", "cube.obj"]);
    assert_eq!(said.status, Some(2), "{}", said.err);
    assert!(said.err.contains("would overwrite the input cube.obj"), "{}", said.err);
    assert_eq!(std::fs::read(place.path("cube.obj")).expect("still there"), bytes);
}

#[test]
fn a_finger_with_a_radius_is_refused_on_a_mesh_by_the_algorithm_that_knows_points_only() {
    let place = Workplace::new();
    place.write("cube.obj", Format::Obj.write(&cube()));
    let scene = mesh("cube.obj").replace("start_m", "radius_m = 0.005\nstart_m");
    place.write("scene.toml", scene + "algorithm = \"classic\"\n");
    let said = place.run(["run", "scene.toml", "--clock", "virtual", "--headless"]);
    assert_eq!(said.status, Some(2), "{}", said.err);
    for part in [
        "scene.toml:4: finger f0 has radius_m = 0.005",
        "entity thing, a mesh",
        "allowed: radius_m = 0",
        "algorithm = \"friction-cone\"",
    ] {
        assert!(said.err.contains(part), "`{part}` is missing in: {}", said.err);
    }
}

#[test]
fn the_other_algorithms_feel_a_mesh_without_friction() {
    let obj = Format::Obj.write(&cube());
    let path =
        hand([(0.0, [0.003, 0.04, 0.002]), (0.3, [0.003, 0.0285, 0.002]), (1.0, [-0.013, 0.0281, 0.011])]);
    for algorithm in ["friction-cone", "vector-field", "classic"] {
        let friction =
            if algorithm == "friction-cone" { "" } else { "friction = { model = \"coulomb\", mu = 0.5 }\n" };
        let rest = format!("algorithm = \"{algorithm}\"\n{friction}");
        for shape in
            ["kind = \"mesh\", file = \"cube.obj\"", "kind = \"box\", size_m = [0.0625, 0.0625, 0.0625]"]
        {
            let samples = felt_with(&[("cube.obj", &obj)], &scene(shape, &rest), &path);
            for s in &samples {
                let expected = Vector3::y() * (1000.0 * (HALF_M - s.hip.y).max(0.0));
                assert!((s.force - expected).norm() <= 1e-9, "{algorithm} on {shape}: {s:?}");
            }
            assert!(samples.iter().filter(|s| s.touches()).count() > 700);
        }
    }
}

#[test]
fn check_tells_how_a_model_is_understood_and_writes_what_needs_no_repair() {
    let place = Workplace::new();
    // A ball with a face missing and another turned over.
    let mut soup = make::bumpy_sphere(24, 12, 0.03);
    soup.faces.remove(100);
    soup.faces[7].swap(0, 1);
    place.write("ball.obj", Format::Obj.write(&soup));
    let said = place.run(["check", "ball.obj", "--repair", "whole.obj"]);
    assert_eq!((said.status, said.err.as_str()), (Some(0), ""), "{}", said.out);
    for part in [
        "1 face wound against the neighbours",
        "1 hole closed with a lid",
        "from outside",
        "group `lid`",
        "can be felt",
    ] {
        assert!(said.out.contains(part), "`{part}` is missing in: {}", said.out);
    }
    let checked = |arguments: &[&str]| -> serde_json::Value {
        let said = place.run(["check"].iter().chain(arguments).chain(&["--json"]));
        serde_json::from_str(&said.out).unwrap_or_else(|error| panic!("{error}\n{}{}", said.out, said.err))
    };
    let [first, again] = ["ball.obj", "whole.obj"].map(|file| checked(&[file]));
    assert_eq!(
        (&first["mesh"]["is_clean"], &again["mesh"]["is_clean"]),
        (&false.into(), &true.into()),
        "{again}"
    );
    assert_eq!((&first["mesh"]["faces_of_lids"], &again["mesh"]["faces_of_lids"]), (&1.into(), &0.into()));
    for what in ["triangles", "vertices", "low", "high", "area", "volume", "is_solid"] {
        assert_eq!(first["mesh"][what], again["mesh"][what], "{what}");
    }
    // The hole stays open where that is asked for, and is told with its place.
    let open = checked(&["ball.obj", "--close-holes", "0"]);
    assert_eq!(
        (&open["mesh"]["open_holes"], &open["mesh"]["is_solid"]),
        (&1.into(), &false.into()),
        "{open}"
    );
    assert!(
        open["mesh"]["largest_open_holes"][0]["size"].as_f64().is_some_and(|size| size > 0.0 && size < 0.02),
        "{open}"
    );
    let said = place.run(["check", "ball.obj", "--close-holes", "0"]);
    for part in ["1 hole stays open, the largest: ", "from both sides, as a sheet"] {
        assert!(said.out.contains(part), "`{part}` is missing in: {}", said.out);
    }
}

/// A name that says nothing is that of a model if the content is one's, else that of a scene.
#[test]
fn check_knows_a_model_without_an_ending_by_its_content() {
    let place = Workplace::new();
    for (name, format) in [("cube", Format::Obj), ("cube.bak", Format::Stl), ("cube.2", Format::StlText)] {
        place.write(name, format.write(&cube()));
        let said = place.run(["check", name]);
        assert_eq!(said.status, Some(0), "{said:?}");
        assert!(said.out.contains(&format!("{name}: can be felt")), "{}", said.out);
    }
    place.write("scene", "[[finger]]\n");
    assert!(place.run(["check", "scene"]).out.contains("scene          scene\n"));
    // What is called a scene is one, whatever is in it.
    place.write("cube.toml", Format::Obj.write(&cube()));
    let said = place.run(["check", "cube.toml"]);
    assert!(said.status == Some(2) && said.out.contains("not valid TOML"), "{said:?}");
}

/// A flat bicubic patch of 0.3 m x 0.6 m.
const PATCH: &str = "\
v 0 0 0\nv 0.1 0 0\nv 0.2 0 0\nv 0.3 0 0\nv 0 0 0.2\nv 0.1 0 0.2\nv 0.2 0 0.2\nv 0.3 0 0.2
v 0 0 0.4\nv 0.1 0 0.4\nv 0.2 0 0.4\nv 0.3 0 0.4\nv 0 0 0.6\nv 0.1 0 0.6\nv 0.2 0 0.6\nv 0.3 0 0.6
cstype bezier\ndeg 3 3\nsurf 0 1 0 1 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16\nparm u 0 1\nparm v 0 1\nend
";

#[test]
fn check_tells_how_patches_are_understood_and_what_a_scene_says_of_them() {
    let place = Workplace::new();
    place.write("patch.obj", PATCH);
    let said = place.run(["check", "patch.obj"]);
    assert_eq!(said.status, Some(0), "{said:?}");
    for words in [
        "1 patch of 1 polynomial in 1 cell, 0 seams",
        "a sheet",
        "size           0.3 x 0 x 0.6\n",
        "patch.obj: can be felt\n",
    ] {
        assert!(said.out.contains(words), "`{words}` is missing in: {}", said.out);
    }
    let shape =
        said.out.lines().find_map(|line| line.strip_prefix("scene ")).expect("a line for scenes").trim();
    place.write("scene.toml", format!("[[finger]]\n[[entity]]\n{shape}\n"));
    let said = place.run(["check", "scene.toml"]);
    assert_eq!(said.status, Some(0), "{said:?}");
    let said = place.run(["check", "patch.obj", "--json"]);
    assert!(said.out.contains("\"patches\": 1"), "{said:?}");
    let said = place.run(["check", "patch.obj", "--repair", "out.obj"]);
    assert_eq!(said.status, Some(2), "{said:?}");
}

#[test]
fn check_refuses_models_outputs_and_options_that_do_not_fit() {
    let place = Workplace::new();
    place.write("cube.obj", Format::Obj.write(&cube()));
    place.write("cube.fbx", b"Kaydara FBX Binary");
    place.write("broken.ply", b"ply\n");
    place.write("scene.toml", mesh("cube.obj"));
    let cases: [(&[&str], &str); 6] = [
        (&["cube.fbx"], "cube.fbx: found a file of FBX, which is not read"),
        (&["broken.ply"], "broken.ply: line 2: found the end of the file"),
        (&["none.glb"], "none.glb: no such file"),
        (&["cube.obj", "--repair", "cube.obj"], "--repair cube.obj would overwrite the input cube.obj"),
        (&["cube.obj", "--repair", "cube.stl"], "--repair cube.stl writes OBJ; let the name end in .obj"),
        (&["scene.toml", "--repair", "out.obj"], "--repair and --close-holes are for a model file"),
    ];
    for (arguments, words) in cases {
        let said = place.run(["check"].iter().chain(arguments));
        assert_eq!(said.status, Some(2), "{arguments:?}: {}{}", said.out, said.err);
        assert!(said.out.contains(words), "{arguments:?}: `{words}` is missing in: {}", said.out);
    }
    assert!(!place.path("out.obj").exists() && !place.path("cube.stl").exists());
}

#[test]
fn a_scene_says_which_holes_of_a_mesh_are_closed() {
    // A cube without one of its sides.
    let mut open = cube();
    open.faces.retain(|face| face.iter().any(|&v| open.vertices[v as usize].y < 0.0));
    let obj = Format::Obj.write(&open);
    let place = Workplace::new();
    place.write("cube.obj", obj);
    let told = |key: &str| {
        place.write("scene.toml", scene(&format!("kind = \"mesh\", file = \"cube.obj\"{key}"), ""));
        let said = place.run(["check", "scene.toml"]);
        assert_eq!(said.status, Some(0), "{}{}", said.out, said.err);
        said.out
    };
    // The box around its rim is 0.0625 m x 0.0625 m.
    for key in ["", ", close_holes_m = 0", ", close_holes_m = 0.08"] {
        let said = told(key);
        assert!(said.contains("1 hole stays open, the largest: 0.0884 m at [0, 0.0312, 0]"), "{key}: {said}");
    }
    let said = told(", close_holes_m = 0.09");
    assert!(said.contains("1 hole closed with a lid") && !said.contains("open"), "{said}");
}

#[test]
fn a_mesh_feels_the_same_from_ply_gltf_ase_and_obj() {
    let soup = cube();
    let path = around_the_cube();
    let obj = felt_with(&[("cube.obj", &Format::Obj.write(&soup))], &mesh("cube.obj"), &path);
    assert!(obj.iter().filter(|s| s.touches()).count() > 2000);
    let mut ply = format!(
        "ply\nformat ascii 1.0\nelement vertex 8\nproperty float x\nproperty float y\nproperty float z\nelement face {}\n\
         property list uchar int vertex_indices\nend_header\n",
        soup.faces.len()
    );
    let mut ase = String::from("*3DSMAX_ASCIIEXPORT 200\n*GEOMOBJECT {\n*MESH {\n*MESH_VERTEX_LIST {\n");
    let mut buffer = Vec::new();
    for (index, vertex) in soup.vertices.iter().enumerate() {
        let [x, y, z] = vertex.data.0[0].map(|x| x as f32);
        ply += &format!("{x} {y} {z}\n");
        ase += &format!("*MESH_VERTEX {index} {x} {y} {z}\n");
        buffer.extend([x, y, z].into_iter().flat_map(f32::to_le_bytes));
    }
    ase += "}\n*MESH_FACE_LIST {\n";
    for (index, face @ [a, b, c]) in soup.faces.iter().enumerate() {
        ply += &format!("3 {a} {b} {c}\n");
        ase += &format!("*MESH_FACE {index}: A: {a} B: {b} C: {c}\n");
        buffer.extend(face.iter().map(|&index| index as u8));
    }
    ase += "}\n}\n}\n";
    let count = 3 * soup.faces.len();
    let gltf = format!(
        "{{\"asset\":{{\"version\":\"2.0\"}},\"scenes\":[{{\"nodes\":[0]}}],\"nodes\":[{{\"mesh\":0}}],\
         \"meshes\":[{{\"primitives\":[{{\"attributes\":{{\"POSITION\":0}},\"indices\":1}}]}}],\
         \"accessors\":[{{\"bufferView\":0,\"componentType\":5126,\"count\":8,\"type\":\"VEC3\"}},\
         {{\"bufferView\":1,\"componentType\":5121,\"count\":{count},\"type\":\"SCALAR\"}}],\
         \"bufferViews\":[{{\"buffer\":0,\"byteLength\":96}},{{\"buffer\":0,\"byteOffset\":96,\"byteLength\":{count}}}],\
         \"buffers\":[{{\"uri\":\"cube.bin\",\"byteLength\":{}}}]}}",
        buffer.len()
    );
    let others = [
        ("cube.ply", felt_with(&[("cube.ply", ply.as_bytes())], &mesh("cube.ply"), &path)),
        ("cube.ase", felt_with(&[("cube.ase", ase.as_bytes())], &mesh("cube.ase"), &path)),
        (
            "cube.gltf",
            felt_with(&[("cube.gltf", gltf.as_bytes()), ("cube.bin", &buffer)], &mesh("cube.gltf"), &path),
        ),
    ];
    for (name, samples) in others {
        assert!(samples == obj, "{name}");
    }
}
