//! Faces of a mesh that are made of different things, through scene file, model file and recording.

use nalgebra::Vector3;
use system_tests::recording::Table;
use system_tests::workplace::{Workplace, hand};

/// A floor of four rectangles, 100 mm by 100 mm: of ice, of cork, of cork in another group, and without a name.
const FLOOR: &str = "v 0 0 0\nv 0.1 0 0\nv 0.2 0 0\nv 0.3 0 0\nv 0.4 0 0\n\
    v 0 0 -0.1\nv 0.1 0 -0.1\nv 0.2 0 -0.1\nv 0.3 0 -0.1\nv 0.4 0 -0.1\n\
    usemtl ice\nf 1 2 7 6\nusemtl cork\nf 2 3 8 7\ng end\nf 3 4 9 8\ng\nusemtl\nf 4 5 10 9\n";
const FACES: &str = "[[entity.faces]]\nof = \"ice\"\nfriction = { model = \"coulomb\", mu = 0.05 }\n\
    [[entity.faces]]\nof = [\"end\"]\nstiffness_n_per_m = 2000.0\n\
    [[entity.faces]]\nof = \"cork\"\nfriction = { model = \"coulomb\", mu = 0.9 }\n";

fn scene(radius_m: f64, faces: &str) -> String {
    format!(
        "[[finger]]\nstart_m = [0.02, 0.02, -0.05]\nradius_m = {radius_m:?}\n\
         [[entity]]\nname = \"floor\"\nshape = {{ kind = \"mesh\", file = \"floor.obj\" }}\n\
         friction = {{ model = \"coulomb\", mu = 0.4 }}\n{faces}"
    )
}

/// Down to a depth of 2 mm, and from one end to the other at 0.2 m/s.
fn stroke(radius_m: f64) -> String {
    let y = radius_m - 2e-3;
    let high = [0.02, radius_m + 0.01, -0.05];
    hand([(0.0, high), (0.2, [0.02, y, -0.05]), (2.0, [0.38, y, -0.05])])
}

#[test]
fn every_material_of_a_file_is_felt_where_its_faces_are() {
    for radius_m in [0.0, 5e-3] {
        let place = Workplace::new();
        place.write("floor.obj", FLOOR);
        place.write("scene.toml", scene(radius_m, FACES));
        place.write("hand.csv", stroke(radius_m));
        let run = ["run", "scene.toml", "--hand", "hand.csv", "--clock", "virtual", "--headless"];
        // It is told that the floor has rims.
        let said = place.run(run.iter().chain(&["--record", "out.csv"]));
        assert_eq!(said.status, Some(0), "{}", said.err);
        let table = Table::read(&place.path("out.csv"));
        let (forces, gods) = (table.vectors("f0_force"), table.vectors("f0_god"));
        let felt = |x: f64| {
            let at = gods.iter().position(|god: &Vector3<f64>| god.x > x).expect("it comes by");
            (forces[at].y, -forces[at].x / forces[at].y)
        };
        // Normal force and friction; on the stiffer part, at 20 mm from its edge, the spring of 1 of the 2 mm that was not
        // to be had there is back.
        for (x, normal_n, mu) in [(0.06, 2.0, 0.05), (0.15, 2.0, 0.9), (0.24, 4.0, 0.4), (0.35, 2.0, 0.4)] {
            let (is_n, is_mu) = felt(x);
            assert!((is_n - normal_n).abs() < 1e-6, "{radius_m} at {x}: {is_n} N");
            assert!((is_mu - mu).abs() < 1e-6, "{radius_m} at {x}: {is_mu}");
        }
        // Over the edges nothing leaps up: 0.2 mm a tick, of 2000 N/m and friction.
        let rises = forces.windows(2).map(|two| two[1].norm() - two[0].norm());
        assert!(rises.fold(0.0, f64::max) < 0.2e-3 * 2000.0 * 1.5, "{radius_m}");
    }
}

#[test]
fn a_name_that_no_face_has_is_refused_with_those_that_there_are() {
    let place = Workplace::new();
    place.write("floor.obj", FLOOR);
    place.write("scene.toml", scene(0.0, "[[entity.faces]]\nof = \"crok\"\nmaterial = \"rubber\"\n"));
    let said = place.run(["run", "scene.toml", "--clock", "virtual", "--headless"]);
    assert_eq!(said.status, Some(2));
    let words = "scene.toml:9: entity[0].faces[0].of: found \"crok\", which no face of";
    assert!(said.err.contains(words), "{}", said.err);
    let allowed = "allowed: the names in the file (did you mean `cork`?): cork, end, ice\n";
    assert!(said.err.ends_with(allowed), "{}", said.err);

    place.write("floor.stl", [&[0_u8; 80][..], &1_u32.to_le_bytes(), &[0; 50]].concat());
    place.write("scene.toml", scene(0.0, FACES).replace("floor.obj", "floor.stl"));
    let said = place.run(["check", "scene.toml"]);
    assert!(said.out.contains("allowed: none, since the file names no faces"), "{}{}", said.out, said.err);

    let of_a_ball = scene(0.0, FACES)
        .replace("kind = \"mesh\", file = \"floor.obj\"", "kind = \"sphere\", radius_m = 0.1");
    place.write("scene.toml", of_a_ball);
    let said = place.run(["check", "scene.toml"]);
    assert!(
        said.out.contains("found faces of a sphere; allowed: faces of a mesh"),
        "{}{}",
        said.out,
        said.err
    );
}

#[test]
fn every_name_that_no_face_has_is_told_in_one_go() {
    let place = Workplace::new();
    place.write("floor.obj", FLOOR);
    let tables = "[[entity.faces]]\nof = \"crok\"\nmaterial = \"rubber\"\n\
        [[entity.faces]]\nof = \"ice\"\nmaterial = \"rubber\"\n\
        [[entity.faces]]\nof = [\"eis\", \"cork\", \"steel\"]\nmaterial = \"rubber\"\n";
    // The second floor, which is read no second time, has the same mistakes.
    let second = format!(
        "[[entity]]\nname = \"floor2\"\nshape = {{ kind = \"mesh\", file = \"floor.obj\" }}\n{tables}"
    );
    place.write("scene.toml", scene(0.0, &format!("{tables}{second}")));
    let said = place.run(["check", "scene.toml"]);
    assert_eq!(said.status, Some(2), "{}{}", said.out, said.err);
    let told: Vec<&str> = said.out.lines().filter(|line| line.contains("which no face of")).collect();
    let expected = [
        "scene.toml:9: entity[0].faces[0].of: found \"crok\"",
        "scene.toml:15: entity[0].faces[2].of: found \"eis\"",
        "scene.toml:15: entity[0].faces[2].of: found \"steel\"",
        "scene.toml:21: entity[1].faces[0].of: found \"crok\"",
        "scene.toml:27: entity[1].faces[2].of: found \"eis\"",
        "scene.toml:27: entity[1].faces[2].of: found \"steel\"",
    ];
    assert_eq!(told.len(), expected.len(), "{}", said.out);
    told.iter().zip(expected).for_each(|(told, expected)| assert!(told.contains(expected), "{told}"));
    assert!(said.out.contains("problems: 6, warnings: 0"), "{}", said.out);
}

#[test]
fn check_warns_of_a_table_that_no_face_is_left_for() {
    let place = Workplace::new();
    place.write("floor.obj", FLOOR);
    // Those of "end" are of cork, too.
    let last = "[[entity.faces]]\nof = [\"end\", \"ice\"]\ndamping_n_s_per_m = 1.0\n";
    place.write("scene.toml", scene(0.0, &format!("{FACES}{last}")));
    let said = place.run(["check", "scene.toml"]);
    assert_eq!(said.status, Some(0), "{}{}", said.out, said.err);
    let warning = "scene.toml:18: entity[0].faces[3].of: no face is left for end, ice: tables before it have all that \
        it names; put it before them, or leave it out";
    assert!(said.out.contains(warning), "{}", said.out);
    assert!(!said.out.contains("faces[2].of: no face"), "one of cork is left: {}", said.out);
    place.write("scene.toml", scene(0.0, FACES));
    let said = place.run(["check", "scene.toml"]);
    assert!(!said.out.contains("no face is left"), "{}", said.out);
}

#[test]
fn check_lists_the_names_that_a_scene_may_use() {
    let place = Workplace::new();
    // A face without an area is left out.
    place.write("floor.obj", FLOOR.to_owned() + "usemtl ice\nf 1 2 3\n");
    let said = place.run(["check", "floor.obj"]);
    assert!(
        said.out.contains("\nnames          cork (4), end (2), ice (2): of faces, for `[[entity.faces]]`\n"),
        "{}",
        said.out
    );
    let said = place.run(["check", "floor.obj", "--json"]);
    let json: serde_json::Value = serde_json::from_str(&said.out).expect("JSON");
    assert_eq!(json["mesh"]["names"], serde_json::json!({ "cork": 4, "end": 2, "ice": 2 }));
}

#[test]
fn check_warns_of_faces_that_are_too_stiff_or_too_damped() {
    let place = Workplace::new();
    place.write("floor.obj", FLOOR);
    let stiff = FACES.replace("stiffness_n_per_m = 2000.0", "stiffness_n_per_m = 60000.0");
    let damped = format!("{stiff}[[entity.faces]]\nof = \"cork\"\ndamping_n_s_per_m = 90.0\n");
    place.write("scene.toml", scene(0.0, &damped));
    let said = place.run(["check", "scene.toml"]);
    assert!(said.out.contains("warning: end of floor (60000 N/m) may buzz"), "{}", said.out);
    assert!(said.out.contains("warning: cork of floor (90 N s/m) may swing"), "{}", said.out);
}
