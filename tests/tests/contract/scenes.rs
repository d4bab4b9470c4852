//! Scenes of many parts as a user sees them: templates, included files, rooms, flags; and the commands about scenes.

use system_tests::recording::Sample;
use system_tests::workplace::{Said, Workplace, hand};

const CONFIG: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../config");

/// Down onto what is at the origin, along it and up again.
fn path() -> String {
    hand([
        (0.0, [0.0, 0.1, 0.0]),
        (0.5, [0.0, 0.045, 0.0]),
        (1.0, [0.01, 0.045, 0.0]),
        (1.5, [0.0, 0.1, 0.0]),
    ])
}

fn check(place: &Workplace, arguments: &[&str]) -> Said {
    place.run(["check"].iter().chain(arguments))
}

fn json(said: &Said) -> serde_json::Value {
    serde_json::from_str(&said.out).unwrap_or_else(|error| panic!("{error}\n{}{}", said.out, said.err))
}

#[test]
fn templates_and_included_files_run_like_the_same_scene_written_out() {
    let written_out = "[[finger]]\n[[entity]]\nname = \"a\"\nshape = { kind = \"sphere\", radius_m = 0.05 }\n\
                       friction = { model = \"stiction\", mu_s = 0.7, mu_d = 0.2 }\n\
                       [[entity]]\nname = \"b\"\nmass_kg = 0.1\nposition_m = [0.3, 0.0, 0.0]\n\
                       shape = { kind = \"sphere\", radius_m = 0.02 }\nfriction = { model = \"coulomb\", mu = 0.5 }\n";
    let parts = "include = [\"parts/balls.toml\"]\n[[finger]]\n[[entity]]\nname = \"a\"\ntemplate = \"ball\"\n\
                 friction = { mu_d = 0.2 }\n";
    let balls = "[[template]]\nname = \"ball\"\nshape = { kind = \"sphere\", radius_m = 0.05 }\n\
                 friction = { model = \"stiction\", mu_s = 0.7, mu_d = 0.3 }\n\
                 [[entity]]\nname = \"b\"\ntemplate = \"ball\"\nshape = { radius_m = 0.02 }\nmass_kg = 0.1\n\
                 position_m = [0.3, 0.0, 0.0]\nfriction = { model = \"coulomb\", mu = 0.5 }\n";
    let place = Workplace::new();
    std::fs::create_dir(place.path("parts")).expect("a directory");
    place.write("parts/balls.toml", balls);
    let [one, other] = [written_out, parts].map(|scene| place.play(scene, &path(), &[]));
    assert_eq!(one.columns(), other.columns());
    assert_eq!(one.rows(), other.rows());
    assert!(one.finger("f0").iter().any(Sample::touches), "it was felt");
}

#[test]
fn a_room_is_felt_from_inside_and_so_is_a_mesh() {
    // A cube of 0.1 m around the origin, as walls and as triangles.
    let cube = "v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1\n\
                f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 3 4 8 7\nf 1 5 8 4\nf 2 3 7 6\n";
    let rooms = [
        "kind = \"room\"\nsize_m = [0.1, 0.1, 0.1]\n",
        "kind = \"mesh\"\nfile = \"cube.obj\"\nscale = 0.05\n",
    ];
    for room in rooms {
        let place = Workplace::new();
        place.write("cube.obj", cube);
        // To 2 mm beyond the right wall, then beyond the ceiling, and home.
        let path = hand([
            (0.0, [0.001, 0.002, 0.003]),
            (0.5, [0.052, 0.002, 0.003]),
            (1.0, [0.001, 0.002, 0.003]),
            (1.5, [0.001, 0.052, 0.003]),
            (2.0, [0.001, 0.002, 0.003]),
        ]);
        let scene = format!("[[finger]]\n[[environment]]\nname = \"cave\"\nstiffness_n_per_m = 1000\n{room}");
        let samples = place.play(&scene, &path, &[]).finger("f0");
        for (tick, inwards) in [(500, [-1.0, 0.0, 0.0]), (1500, [0.0, -1.0, 0.0])] {
            let force = samples[tick].force;
            // 2 mm at 1000 N/m, without friction.
            let wanted = nalgebra::Vector3::from(inwards) * 2.0;
            assert!((force - wanted).norm() < 1e-9, "{room}: {force:?} at tick {tick}");
        }
        assert_eq!(samples[1000].force.norm(), 0.0, "{room}: in the middle it is free");
    }
}

#[test]
fn what_is_not_haptic_carries_others_and_what_is_not_collidable_lets_them_fall() {
    let scene = |flags: &str| {
        format!(
            "[[finger]]\n[[entity]]\nname = \"table\"\nshape = {{ kind = \"box\", size_m = [1.0, 0.1, 1.0] }}\n{flags}\n\
             [[entity]]\nname = \"cube\"\nshape = {{ kind = \"box\", size_m = [0.04, 0.04, 0.04] }}\n\
             position_m = [0.2, 0.0702, 0.0]\nmass_kg = 0.1\n"
        )
    };
    let played = |flags: &str| {
        let place = Workplace::new();
        let table = place.play(&scene(flags), &path(), &[]);
        let felt = table.finger("f0").iter().any(Sample::touches);
        let lowest = table.numbers("cube_y").into_iter().fold(f64::INFINITY, f64::min);
        (felt, lowest)
    };
    let (felt, lowest) = played("");
    // 0.1 kg on four springs of 500 N/m sink by half a millimetre, and by twice that as they fall.
    assert!(felt && lowest > 0.068, "{felt} {lowest}");
    let (felt, lowest) = played("haptic = false");
    assert!(!felt && lowest > 0.068, "{felt} {lowest}");
    let (felt, lowest) = played("collidable = false");
    // Free fall for 1.5 s: 11 m.
    assert!(felt && lowest < -10.0, "{felt} {lowest}");
    let (felt, lowest) = played("haptic = false\ncollidable = false");
    assert!(!felt && lowest < -10.0, "only seen: {felt} {lowest}");
}

#[test]
fn check_tells_all_that_is_wrong_with_places_and_runs_nothing() {
    let place = Workplace::new();
    place.write(
        "scene.toml",
        "hand = \"none.csv\"\n[[finger]]\n[[entity]]\nname = \"a\"\nshape = { kind = \"mesh\", file = \"none.obj\" }\n\
         [[entity]]\nname = \"b\"\nalgorithm = \"classic\"\nshape = { kind = \"csg\", op = \"union\", children = \
         [{ shape = { kind = \"sphere\", radius_m = 1 } }] }\n",
    );
    let before = place.snapshot();
    let said = check(&place, &["scene.toml", "--json"]);
    assert_eq!(said.status, Some(2));
    let told = json(&said);
    let messages: Vec<&str> = told["problems"]
        .as_array()
        .expect("a list")
        .iter()
        .map(|it| it["message"].as_str().expect("text"))
        .collect();
    assert_eq!(messages.len(), 3, "{messages:?}");
    assert!(messages[0].contains("cannot read the hand file"), "{messages:?}");
    assert!(
        messages[1].starts_with("scene.toml:5: entity[0].shape.file: none.obj: no such file"),
        "{messages:?}"
    );
    assert!(messages[2].starts_with("scene.toml:6: entity b is a csg"), "{messages:?}");
    assert_eq!((told["ok"].as_bool(), told["problems"][1]["line"].as_u64()), (Some(false), Some(5)));
    assert_eq!(told["problems"][1]["key"], "entity[0].shape.file");
    assert!(place.snapshot() == before, "nothing was written");
    // The first of them is what `run` says.
    let run = place.run(["run", "scene.toml", "--clock", "virtual"]);
    assert_eq!((run.status, run.err.trim_end()), (Some(2), format!("phantom3: {}", messages[0]).as_str()));
}

#[test]
fn check_tells_all_that_the_reader_finds_too() {
    let place = Workplace::new();
    place.write(
        "scene.toml",
        "nam = \"x\"\n[[finger]]\nradius_m = -1\n[[entity]]\nshape = { kind = \"cube\" }\n",
    );
    let said = check(&place, &["scene.toml"]);
    assert_eq!(said.status, Some(2));
    let lines: Vec<&str> = said.out.lines().collect();
    assert_eq!(lines.len(), 4, "{lines:?}");
    assert!(lines[0].starts_with("scene.toml:1: nam: unknown key"), "{lines:?}");
    assert!(lines[1].starts_with("scene.toml:3: finger[0].radius_m: found -1"), "{lines:?}");
    assert!(
        lines[2].starts_with("scene.toml:5: entity[0].shape.kind: unknown shape kind `cube`"),
        "{lines:?}"
    );
    assert_eq!(lines[3], "scene.toml: cannot be run; problems: 3, warnings: 0");
}

#[test]
fn check_warns_of_what_runs_but_hardly_as_meant() {
    let place = Workplace::new();
    place.write(
        "scene.toml",
        "[[finger]]\n[[template]]\nname = \"unused\"\n\
         [[entity]]\nname = \"rock\"\nstiffness_n_per_m = 90000.0\nposition_m = [1.0, 0.0, 0.0]\nshape = { kind = \"sphere\", radius_m = 0.1 }\n\
         [[entity]]\nname = \"around\"\nshape = { kind = \"sphere\", radius_m = 0.1 }\n\
         visual = { shape = { kind = \"mesh\", file = \"none.obj\" } }\n\
         [[entity]]\nname = \"die\"\nmass_kg = 0.1\nposition_m = [1.1, 0.0, 0.0]\nshape = { kind = \"box\", size_m = [0.04, 0.04, 0.04] }\n",
    );
    let said = check(&place, &["scene.toml", "--json"]);
    assert_eq!(said.status, Some(0), "{}{}", said.out, said.err);
    let told = json(&said);
    let warnings: Vec<&str> =
        told["warnings"].as_array().expect("a list").iter().map(|it| it.as_str().expect("text")).collect();
    for wanted in [
        "rock (90000 N/m) may buzz: at 1000 Hz and 0 N s/m a lightly held Premium stands",
        "die begins 20.00 mm deep in rock",
        "nothing is below die",
        "finger f0 starts inside of around",
        "none.obj: no such file",
        "no entity is made from template unused",
    ] {
        assert_eq!(
            warnings.iter().filter(|warning| warning.contains(wanted)).count(),
            1,
            "{wanted}: {warnings:?}"
        );
    }
    assert_eq!(warnings.len(), 6, "{warnings:?}");
    assert_eq!(told["summary"]["entities"]["moving"], 1);
    assert_eq!(told["summary"]["shapes"]["sphere"], 2);
}

#[test]
fn check_tells_of_solids_of_which_nothing_is_left() {
    let place = Workplace::new();
    let solid = |name: &str, op: &str, size_m: f64| {
        format!(
            "[[entity]]\nname = \"{name}\"\nshape = {{ kind = \"csg\", op = \"{op}\", children = [{{ shape = {{ kind = \"sphere\", \
             radius_m = 0.02 }} }}, {{ shape = {{ kind = \"box\", size_m = [{size_m}, {size_m}, {size_m}] }}, position_m = [0.0, 0.03, 0.0] }}] \
             }}\n"
        )
    };
    let scene = ["[[finger]]\n".to_owned()]
        .into_iter()
        .chain([solid("swapped", "difference", 0.2), solid("bitten", "difference", 0.05)])
        .chain([solid("apart", "intersection", 0.015), solid("slice", "intersection", 0.05)])
        .collect::<String>();
    // However thin, plates are felt and measured.
    let plate = |name: &str, x: f64| {
        let cube = "shape = { kind = \"box\", size_m = [0.1, 0.1, 0.1] }";
        format!(
            "[[entity]]\nname = \"{name}\"\nshape = {{ kind = \"csg\", op = \"difference\", children = [{{ {cube} }}, \
             {{ {cube}, position_m = [{x}, 0.0, 0.0] }}] }}\n"
        )
    };
    place.write("scene.toml", scene + &plate("thin", 0.001) + &plate("foil", 0.00001) + &plate("gone", 0.0));
    let said = check(&place, &["scene.toml"]);
    for (name, size) in [("thin", "0.001 x 0.1 x 0.1"), ("foil", "0.00001 x 0.1 x 0.1")] {
        assert!(said.out.contains(&format!("{name}: csg, {size} m")), "{}", said.out);
        assert!(!said.out.contains(&format!("{name} is felt but not drawn")), "{}", said.out);
    }
    assert!(
        said.out.contains("of gone nothing is drawn, for nothing is left or all of it is too thin"),
        "{}",
        said.out
    );
    for name in ["thin", "foil", "gone"] {
        assert!(!said.out.contains(&format!("of {name} nothing is left, and")), "{}", said.out);
    }
    for (name, is_nothing) in [("swapped", true), ("bitten", false), ("apart", true), ("slice", false)] {
        let is_told = said.out.contains(&format!("of {name} nothing is left, and nobody feels it"));
        let is_measured = said.out.contains(&format!("{name}: csg, nothing is left of it"));
        assert_eq!([is_told, is_measured], [is_nothing; 2], "{name}: {}", said.out);
    }
    assert!(!said.out.contains("without an end"), "{}", said.out);
}

/// A sheet is not thin: nothing sinks through by being soft. Of a paper no stiffness makes more.
#[test]
fn check_says_of_thin_things_only_what_helps() {
    let place = Workplace::new();
    place.write("quad.obj", "v -1 0 -1\nv 1 0 -1\nv 1 0 1\nv -1 0 1\nf 4 3 2 1\n");
    let scene = |thing: &str| {
        format!(
            "contact_stiffness = {{ kind = \"by-mass\" }}\n[[finger]]\n[[entity]]\nname = \"floor\"\nshape = {{ kind = \"mesh\", file = \
             \"quad.obj\" }}\n[[entity]]\nname = \"thing\"\nmass_kg = 0.1\n{thing}\n"
        )
    };
    for (thing, told) in [
        ("position_m = [0, 0.0202, 0]\nshape = { kind = \"sphere\", radius_m = 0.02 }", None),
        (
            "position_m = [0, 2e-5, 0]\nshape = { kind = \"box\", size_m = [0.2, 2e-5, 0.2] }",
            Some(
                "the thinner one is 0.020 mm thick, and contacts are 0.010 mm deep at rest; make it thicker",
            ),
        ),
    ] {
        place.write("scene.toml", scene(thing));
        let said = check(&place, &["scene.toml"]);
        assert!(!said.out.contains("sinks"), "{}", said.out);
        assert_eq!(told.is_some_and(|words| said.out.contains(words)), told.is_some(), "{}", said.out);
    }
}

#[test]
fn check_judges_stiffness_on_the_sum_at_a_place() {
    let place = Workplace::new();
    let wall = |name: &str, normal: &str| {
        format!(
            "[[entity]]\nname = \"{name}\"\nstiffness_n_per_m = 600.0\n\
             shape = {{ kind = \"plane\", normal = {normal}, offset_m = 0.0 }}\n"
        )
    };
    let told = |walls: String| {
        place.write("scene.toml", format!("[[finger]]\nstart_m = [0.2, 0.2, 0.2]\n{walls}"));
        let told = json(&check(&place, &["scene.toml", "--json"]));
        let warnings = told["warnings"].as_array().expect("a list").iter();
        warnings.map(|it| it.as_str().expect("text").to_owned()).collect::<Vec<_>>()
    };
    // A corner of three such walls is no stiffer along any axis than one of them.
    let corner = ["[1.0, 0.0, 0.0]", "[0.0, 1.0, 0.0]", "[0.0, 0.0, 1.0]"];
    assert_eq!(told(corner.iter().enumerate().map(|(i, n)| wall(&format!("w{i}"), n)).collect()), [""; 0]);
    let layers: String = (0..10).map(|i| wall(&format!("w{i}"), "[0.0, 1.0, 0.0]")).collect();
    let warnings = told(layers);
    assert_eq!(warnings.len(), 1, "{warnings:?}");
    assert!(
        warnings[0]
            .contains("w7 and 2 more together may buzz: a finger at (0, -0.001, 0) feels 6000 N/m of them"),
        "{warnings:?}"
    );
}

/// Warnings of `check` for this scene with a finger.
fn warnings(scene: &str) -> Vec<String> {
    let place = Workplace::new();
    place.write("scene.toml", format!("[[finger]]\nstart_m = [0.2, 0.2, 0.2]\n{scene}"));
    let told = json(&check(&place, &["scene.toml", "--json"]));
    let warnings = told["warnings"].as_array().unwrap_or_else(|| panic!("{told}")).iter();
    warnings.map(|it| it.as_str().expect("text").to_owned()).collect()
}

/// Viscous fields of this damping in boxes of 0.1 m, so far from each other along x.
fn fields(count: u32, damping: f64, apart_m: f64) -> String {
    let field = |at: u32| {
        format!(
            "[[field]]\nkind = \"viscous\"\ndamping_n_s_per_m = {damping}\nposition_m = [{}, 0.0, 0.0]\n\
             shape = {{ kind = \"box\", size_m = [0.1, 0.1, 0.1] }}\n",
            f64::from(at) * apart_m
        )
    };
    (0..count).map(field).collect()
}

#[test]
fn check_judges_damping_and_mass_on_the_sum_at_a_place() {
    let none: [String; 0] = [];
    let told = warnings(&"[[field]]\nkind = \"viscous\"\ndamping_n_s_per_m = 5.8\n".repeat(8));
    assert_eq!(told.len(), 1, "{told:?}");
    assert!(told[0].starts_with("field[0], field[1], field[2],"), "{told:?}");
    assert!(told[0].contains("feels 46.4 N s/m of them, and 5.9 are stable"), "{told:?}");
    // Side by side they are felt one by one.
    assert_eq!(warnings(&fields(8, 5.8, 0.1)), none);
    // Each reaches 10 mm into the next one.
    let told = warnings(&fields(3, 5.8, 0.09));
    assert_eq!(told.len(), 2, "{told:?}");
    assert!(told.iter().any(|it| it.starts_with("field[0], field[1] together may swing")), "{told:?}");
    assert!(told.iter().any(|it| it.starts_with("field[1], field[2] together may swing")), "{told:?}");
    // Two are stable, and in the middle there are three.
    let told = warnings(&fields(3, 2.8, 0.04));
    assert_eq!(told.len(), 1, "{told:?}");
    assert!(told[0].starts_with("field[0], field[1], field[2] together may swing"), "{told:?}");
    let heavy = "[[field]]\nkind = \"inertial\"\nmass_kg = 0.2\n";
    assert_eq!(warnings(heavy), none);
    let told = warnings(&heavy.repeat(2));
    assert!(told.len() == 1 && told[0].contains("0.40 kg of them, and 0.32 are stable"), "{told:?}");
}

#[test]
fn check_judges_effects_and_contacts_together() {
    let none: [String; 0] = [];
    let ball = |damping: f64, more: &str| {
        format!(
            "[[entity]]\nname = \"ball\"\nstiffness_n_per_m = 500.0\ndamping_n_s_per_m = {damping}\n{more}\
             shape = {{ kind = \"sphere\", radius_m = 0.03 }}\n"
        )
    };
    assert_eq!(warnings(&ball(4.0, "")), none);
    let told = warnings(&ball(8.0, ""));
    assert!(told.len() == 1 && told[0].starts_with("ball (8 N s/m) may swing: at 1000 Hz"), "{told:?}");
    // Heavy things between fingers swing on: by e in m / b.
    let swings = |mass: &str| {
        let told = warnings(&ball(1.0, mass));
        told.iter().any(|it| it.starts_with("ball (20 s) may swing between two fingers")) || {
            assert!(!told.iter().any(|it| it.contains("may swing between")), "{told:?}");
            false
        }
    };
    assert!(swings("mass_kg = 20.0\n") && !swings("mass_kg = 4.0\n"));
    // What only other things touch may be damped as it likes.
    assert_eq!(warnings(&ball(8.0, "haptic = false\n")), none);
    let told = warnings(&(fields(1, 4.0, 0.0) + &ball(4.0, "")));
    assert!(told.len() == 1 && told[0].starts_with("ball, field[0] together may swing"), "{told:?}");
    assert!(told[0].contains("feels 8.0 N s/m of them, and 5.9 are stable"), "{told:?}");
    // In another place it adds nothing.
    assert_eq!(warnings(&(fields(1, 4.0, 0.0) + &ball(4.0, "position_m = [0.2, 0.0, 0.0]\n"))), none);
    let rail = |x: f64, direction: &str| {
        format!(
            "[[guide]]\nkind = \"line\"\npoint_m = [{x}, 0.0, 0.0]\ndirection = {direction}\n\
             stiffness_n_per_m = 600.0\ndamping_n_s_per_m = 0.0\n"
        )
    };
    let crossing = rail(0.0, "[0.0, 1.0, 0.0]") + &rail(0.1, "[1.0, 0.0, 0.0]");
    let told = warnings(&crossing);
    assert!(told.len() == 1 && told[0].contains("1200 N/m of them, and 1000 are stable"), "{told:?}");
    assert_eq!(warnings(&(rail(0.0, "[0.0, 1.0, 0.0]") + &rail(0.1, "[0.0, 1.0, 0.0]"))), none, "apart");
    // A guide that lets go is not felt 20 mm beside its track; one that does not let go is.
    let beside = |more: &str| {
        let guide = "[[guide]]\nkind = \"line\"\npoint_m = [0.0, 0.07, 0.0]\ndirection = [1.0, 0.0, 0.0]\n";
        warnings(&format!("{}{guide}{more}", fields(1, 4.0, 0.0)))
    };
    assert_eq!(beside("break_away_n = 3.0\n"), none);
    assert!(beside("")[0].contains("feels 6.0 N s/m"), "{:?}", beside(""));
    let magnet = "magnetism = { force_n = 1.0, distance_m = 0.01 }\n";
    assert_eq!(warnings(&ball(1.0, magnet)), none);
    let told = warnings(&(ball(1.0, magnet) + &ball(1.0, magnet).replace("\"ball\"", "\"other\"")));
    assert!(told.iter().any(|it| it.starts_with("ball, other together may swing")), "{told:?}");
}

#[test]
fn check_judges_constant_forces_and_vibrations_on_the_sum_at_a_place() {
    let none: [String; 0] = [];
    let wind = |force: &str, x: f64| {
        format!(
            "[[field]]\nkind = \"constant\"\nforce_n = {force}\nposition_m = [{x}, 0.0, 0.0]\n\
             shape = {{ kind = \"box\", size_m = [0.1, 0.1, 0.1] }}\n"
        )
    };
    assert_eq!(warnings(&wind("[9.0, 0.0, 0.0]", 0.0)), none);
    let told = warnings(&wind("[9.0, 0.0, 0.0]", 0.0).repeat(10));
    assert_eq!(told.len(), 1, "{told:?}");
    assert!(told[0].starts_with("field[0], field[1], field[2],"), "{told:?}");
    assert!(told[0].contains("together may pull too hard: a finger at ("), "{told:?}");
    assert!(told[0].ends_with("feels 90.0 N of them, and one field may have 10.0"), "{told:?}");
    // Side by side they are felt one by one, and against each other they are nothing.
    assert_eq!(warnings(&(wind("[9.0, 0.0, 0.0]", 0.0) + &wind("[9.0, 0.0, 0.0]", 0.1))), none);
    assert_eq!(warnings(&(wind("[9.0, 0.0, 0.0]", 0.0) + &wind("[-9.0, 0.0, 0.0]", 0.0))), none);
    // A small one against two takes away where all three are, and nothing beside that; so for everywhere, and for the middle.
    let small = |x: f64| wind("[-9.0, 0.0, 0.0]", x).replace("0.1, 0.1, 0.1", "0.04, 0.04, 0.04");
    let large = wind("[9.0, 0.0, 0.0]", 0.0).replace("0.1, 0.1, 0.1", "0.2, 0.2, 0.2").repeat(2);
    let everywhere = "[[field]]\nkind = \"constant\"\nforce_n = [9.0, 0.0, 0.0]\n".repeat(2);
    let hidden = [
        large.clone() + &small(0.05),
        large.clone() + &small(0.05).repeat(2),
        large.clone() + &small(0.0).repeat(2),
        small(0.05) + &large,
        everywhere.clone() + &small(0.05).repeat(2),
        everywhere + &small(0.0).repeat(2),
    ];
    for scene in hidden {
        let told = warnings(&scene);
        assert_eq!(told.len(), 1, "{told:?}");
        assert!(told[0].contains("feels 18.0 N of them"), "{told:?}");
    }
    let whole = wind("[-9.0, 0.0, 0.0]", 0.0).replace("0.1, 0.1, 0.1", "0.4, 0.4, 0.4");
    assert_eq!(warnings(&(large + &whole)), none, "it takes away everywhere");
    let plate = |name: &str, amplitude: f64, place: &str| {
        format!(
            "[[entity]]\nname = \"{name}\"\nposition_m = {place}\nstiffness_n_per_m = 100.0\n\
             shape = {{ kind = \"box\", size_m = [0.1, 0.02, 0.1] }}\n\
             vibration = {{ frequency_hz = 100.0, amplitude_n = {amplitude:?}, full_load_n = {amplitude:?} }}\n"
        )
    };
    let layers = |amplitude: f64| -> String {
        (0..10).map(|at| plate(&format!("p{at}"), amplitude, "[0.0, 0.0, 0.0]")).collect()
    };
    assert_eq!(warnings(&layers(0.9)), none);
    let told = warnings(&layers(9.0));
    assert_eq!(told.len(), 1, "{told:?}");
    assert!(told[0].starts_with("p0, p1, p2,") && told[0].contains("feels 90.0 N of them"), "{told:?}");
    // A field and what is touched in it.
    let told = warnings(&(plate("plate", 9.0, "[0.0, 0.0, 0.0]") + &wind("[0.0, -9.0, 0.0]", 0.0)));
    assert!(told.len() == 1 && told[0].starts_with("plate, field[0] together may pull too hard"), "{told:?}");
    assert!(told[0].contains("feels 18.0 N of them"), "{told:?}");
    assert_eq!(
        warnings(&(plate("plate", 9.0, "[0.3, 0.0, 0.0]") + &wind("[0.0, -9.0, 0.0]", 0.0))),
        none,
        "apart"
    );
    let told = warnings(&plate("plate", 12.0, "[0.0, 0.0, 0.0]"));
    assert!(told.len() == 1 && told[0].starts_with("plate (12 N) may hum too hard"), "{told:?}");
}

#[test]
fn check_finds_where_constant_fields_add_up_that_no_pair_tells() {
    // Rims where some of several overlap, far from where most of them do: found by 50,000 random places.
    type Wind = ([f64; 3], [f64; 3], &'static [f64], f64);
    let crowd: &[Wind] = &[
        ([-4.4062, 0.0481, 1.5492], [-0.0044, 0.0362, 0.0053], &[0.083, 0.132, 0.1148], 0.001),
        ([-7.5141, 1.6502, 4.3083], [0.0029, 0.0229, -0.0052], &[0.0735], 0.01),
        ([1.5113, -1.0142, -4.4585], [0.1703, -0.0479, -0.0024], &[0.1051, 0.1305, 0.0534], 0.001),
        ([2.9305, 0.3096, 1.9969], [0.0856, -0.0315, -0.0433], &[0.1326, 0.1126, 0.1352], 0.005),
        ([4.1267, -2.2835, -5.7867], [0.0085, 0.0186, -0.0102], &[0.1408, 0.1131, 0.1311], 0.005),
        ([-1.6987, -0.8748, -6.8577], [0.0376, 0.0432, -0.0098], &[0.0636], 0.005),
        ([4.1088, 7.6437, 1.6773], [-0.0115, 0.0527, -0.0407], &[0.0217], 0.01),
    ];
    let few: &[Wind] = &[
        ([-1.3367, -3.2719, -0.1235], [-0.006, -0.0011, 0.04], &[0.0501, 0.0634, 0.0726], 0.005),
        ([-6.2054, 1.9051, 1.8053], [-0.0164, -0.0698, 0.0471], &[0.0495], 0.01),
        ([4.0841, 7.6663, -0.2202], [0.0219, 0.0219, 0.0276], &[0.0512], 0.001),
        ([1.6649, 4.1512, -2.6016], [-0.0804, -0.0238, 0.0776], &[0.1361, 0.1281, 0.1182], 0.005),
    ];
    for (winds, felt_n) in [(crowd, 13.6), (few, 13.4)] {
        let field = |(force_n, at_m, size_m, rim_m): &Wind| {
            let shape = match size_m {
                [radius_m] => format!("kind = \"sphere\", radius_m = {radius_m}"),
                _ => format!("kind = \"box\", size_m = {size_m:?}"),
            };
            format!(
                "[[field]]\nkind = \"constant\"\nforce_n = {force_n:?}\nposition_m = {at_m:?}\nrim_m = {rim_m}\n\
                 shape = {{ {shape} }}\n"
            )
        };
        let told = warnings(&winds.iter().map(field).collect::<String>());
        let newtons = |told: &String| told.split("feels ").nth(1)?.split(' ').next()?.parse::<f64>().ok();
        let most_n = told.iter().filter_map(newtons).fold(0.0, f64::max);
        assert!(most_n >= felt_n, "{felt_n}: {told:?}");
    }
}

#[test]
fn check_adds_the_pulls_of_guides_magnets_and_thin_fields() {
    let none: [String; 0] = [];
    let line = |x: f64, more: &str| {
        format!(
            "[[guide]]\nkind = \"line\"\npoint_m = [{x}, 0.0, 0.0]\ndirection = [0.0, 0.0, 1.0]\nstiffness_n_per_m = 90.0\n\
             damping_n_s_per_m = 0.1\nforce_limit_n = 10.0\n{more}"
        )
    };
    assert_eq!(warnings(&line(0.0, "")), none);
    let told = warnings(&line(0.0, "").repeat(10));
    assert_eq!(told.len(), 1, "{told:?}");
    assert!(told[0].contains("together may pull too hard"), "{told:?}");
    assert!(told[0].contains("feels 100.0 N of them"), "{told:?}");
    // A track in a field; and tracks far from each other, which let go.
    let wind = "[[field]]\nkind = \"constant\"\nforce_n = [9.0, 0.0, 0.0]\n";
    let told = warnings(&(line(0.0, "") + wind));
    assert!(told.len() == 1 && told[0].contains("feels 19.0 N of them"), "{told:?}");
    let lets_go = "break_away_n = 9.0\n";
    assert_eq!(warnings(&(line(0.0, lets_go) + &line(3.0, lets_go))), none);
    let magnet = |name: &str, y: f64| {
        format!(
            "[[entity]]\nname = \"{name}\"\nposition_m = [0.0, {y}, 0.0]\nstiffness_n_per_m = 100.0\n\
             shape = {{ kind = \"box\", size_m = [0.1, 0.02, 0.1] }}\nmagnetism = {{ force_n = 9.0, distance_m = 0.3 }}\n"
        )
    };
    assert_eq!(warnings(&magnet("below", 0.0)), none);
    let told = warnings(&(magnet("below", 0.0) + wind));
    assert!(told.iter().any(|it| it.contains("below, field[0] together may pull too hard")), "{told:?}");
    // A field that is thinner than two rims is felt most in its middle.
    let slab = |thick_m: f64| {
        format!(
            "[[field]]\nkind = \"constant\"\nforce_n = [9.0, 0.0, 0.0]\n\
             shape = {{ kind = \"box\", size_m = [0.1, {thick_m}, 0.1] }}\n"
        )
        .repeat(10)
    };
    for (thick_m, value) in [(0.008, "80.6"), (0.006, "58.3"), (0.004, "31.7")] {
        let told = warnings(&slab(thick_m));
        assert!(told.len() == 1 && told[0].contains(&format!("feels {value} N of them")), "{told:?}");
    }
    // Two across each other, and a third one that takes away from both where all are.
    let turned = |force: &str, at: &str| {
        format!(
            "[[field]]\nkind = \"constant\"\nforce_n = {force}\nposition_m = {at}\nrim_m = 0.002\n\
             shape = {{ kind = \"box\", size_m = [0.05, 0.05, 0.05] }}\n"
        )
    };
    let three = turned("[8.0, 0.0, 0.0]", "[0.0, 0.0, 0.0]")
        + &turned("[0.0, 8.0, 0.0]", "[0.03, 0.03, 0.0]")
        + &turned("[-3.0, -3.0, 7.0]", "[0.02, 0.02, 0.02]");
    let told = warnings(&three);
    assert!(
        told.len() == 1 && told[0].starts_with("field[0], field[1] together may pull too hard"),
        "{told:?}"
    );
    assert!(told[0].contains("feels 11.3 N of them"), "{told:?}");
}

#[test]
fn check_of_fields_that_meet_thousands_of_things_takes_a_moment() {
    let field = "[[field]]\nkind = \"constant\"\nforce_n = [0.1, 0.0, 0.0]\n".repeat(64);
    let shelf = "[[entity]]\nname = \"c\"\ngrid = { count = [20, 15, 10], spacing_m = [0.1, 0.1, 0.1] }\n\
                 shape = { kind = \"box\", size_m = [0.05, 0.05, 0.05] }\n";
    let place = Workplace::new();
    place.write("scene.toml", format!("[[finger]]\nstart_m = [0.0, -1.0, 0.0]\n{field}{shelf}"));
    let begun = std::time::Instant::now();
    let said = check(&place, &["scene.toml"]);
    assert!(said.out.contains("can be run"), "{}", said.out);
    // Half a second by itself, and thirty before; other tests share the cores.
    assert!(begun.elapsed().as_secs() < 10, "{:?}", begun.elapsed());
}

/// Nothing falls.
const WEIGHTLESS: &str = "gravity_m_s2 = [0.0, 0.0, 0.0]\n";

/// A finger over a cube of this size, mass and place.
fn with_cube(size: &str, mass: &str, place: &str) -> String {
    format!(
        "[[finger]]\nstart_m = [0.0, 0.2, 0.0]\n[[entity]]\nname = \"cube\"\n\
         shape = {{ kind = \"box\", size_m = {size} }}\nmass_kg = {mass}\nposition_m = {place}\n"
    )
}

#[test]
fn check_tells_the_size_the_place_and_the_mass_of_everything() {
    let place = Workplace::new();
    let cube = with_cube("[0.05, 0.1, 0.05]", "0.1", "[0.0, 0.05, 0.0]");
    place.write("scene.toml", format!("{WEIGHTLESS}{cube}"));
    let said = check(&place, &["scene.toml"]);
    assert!(
        said.out.contains("cube: box, 0.05 x 0.1 x 0.05 m, at (0, 0.05, 0) m, 0.1 kg (400 kg/m^3)"),
        "{}",
        said.out
    );
    assert!(said.out.contains("problems: 0, warnings: 0"), "{}", said.out);
    let told = json(&check(&place, &["scene.toml", "--json"]));
    let measures = &told["summary"]["measures"][0];
    assert_eq!((measures["size_m"][1].as_f64(), measures["mass_kg"].as_f64()), (Some(0.1), Some(0.1)));
}

#[test]
fn check_measures_a_mesh_that_is_only_seen_by_its_file() {
    let place = Workplace::new();
    let scene = |file: &str, scale: f64| {
        format!(
            "[[finger]]\n[[entity]]\nname = \"wall\"\nhaptic = false\ncollidable = false\n\
             shape = {{ kind = \"mesh\", file = \"{file}\", scale = {scale:?} }}\nposition_m = [0, 2, 0]\n"
        )
    };
    // Its middle is beside its origin.
    place.write("wall.obj", "v 0 0 0\nv 1 0 0\nv 0 4 0\nv 0 0 2\nf 1 2 3\nf 1 2 4\n");
    place.write("scene.toml", scene("wall.obj", 0.5));
    let said = check(&place, &["scene.toml"]);
    assert!(said.out.contains("wall: mesh, 0.5 x 2 x 1 m, at (0.25, 3, 0.5) m"), "{}", said.out);
    let told = json(&check(&place, &["scene.toml", "--json"]));
    assert_eq!(told["summary"]["measures"][0]["size_m"], serde_json::json!([0.5, 2.0, 1.0]));
    place.write("scene.toml", scene("wall.obj", 500.0));
    let said = check(&place, &["scene.toml"]);
    assert!(
        said.out.contains("wall is 2000 m long, as large as a house; its file wall.obj may be"),
        "{}",
        said.out
    );
    place.write("scene.toml", scene("none.obj", 1.0));
    let said = check(&place, &["scene.toml"]);
    assert!(said.out.contains("wall: mesh, size not measured"), "{}", said.out);
    assert!(said.out.contains("none.obj") && said.out.contains("it is for the window only"), "{}", said.out);
}

/// A finger over a row of cubes of 5 cm, of which some are to be 50 m long.
fn row_of_cubes(count: usize, large: &[usize]) -> String {
    let cube = |number: usize| {
        let size_m = if large.contains(&number) { 50.0 } else { 0.05 };
        format!(
            "[[entity]]\nname = \"cube{number}\"\nshape = {{ kind = \"box\", size_m = [{size_m:?}, 0.05, 0.05] }}\n\
             position_m = [0.0, 0.0, {:?}]\n",
            0.1 * number as f64
        )
    };
    let cubes: String = (0..count).map(cube).collect();
    format!("[[finger]]\nstart_m = [0.0, 0.2, 0.0]\n{cubes}")
}

#[test]
fn check_tells_the_sizes_of_the_first_twenty_things_and_of_all_that_it_suspects() {
    let place = Workplace::new();
    let told = |count: usize, large: &[usize]| {
        place.write("scene.toml", row_of_cubes(count, large));
        let said = check(&place, &["scene.toml"]);
        let cubes = 0..count;
        let sizes: Vec<usize> =
            cubes.filter(|number| said.out.contains(&format!(" cube{number}: box,"))).collect();
        let all = json(&check(&place, &["scene.toml", "--json"]));
        assert_eq!(all["summary"]["measures"].as_array().map(Vec::len), Some(count));
        (sizes, said.out)
    };
    let (sizes, out) = told(20, &[]);
    assert_eq!(sizes, (0..20).collect::<Vec<_>>());
    assert!(!out.contains("which --json tells"), "{out}");
    let (sizes, out) = told(21, &[]);
    assert_eq!(sizes, (0..20).collect::<Vec<_>>());
    assert!(out.contains("and 1 more, which --json tells\n"), "{out}");
    let (sizes, out) = told(21, &[20]);
    assert_eq!(sizes, (0..21).collect::<Vec<_>>());
    assert!(!out.contains("which --json tells"), "{out}");
    // More than twenty warnings of sizes leave none of them out.
    let large: Vec<usize> = (5..45).step_by(2).chain([46, 48]).collect();
    let (sizes, out) = told(50, &large);
    let expected: Vec<usize> = (0..50).filter(|number| *number < 20 || large.contains(number)).collect();
    assert_eq!(sizes, expected);
    assert!(out.contains(&format!("and {} more, which --json tells\n", 50 - expected.len())), "{out}");
    for number in large {
        assert!(out.contains(&format!("warning: cube{number} is 50 m long")), "{number}: {out}");
    }
}

#[test]
fn check_suspects_numbers_of_another_unit() {
    let place = Workplace::new();
    for (scene, warning) in [
        (
            with_cube("[50, 50, 50]", "0.1", "[0.0, 30.0, 0.0]"),
            "cube is 50 m long, as large as a house; lengths are in metres: if millimetres were meant, write `size_m = [0.05, 0.05, 0.05]`",
        ),
        (
            with_cube("[0.05, 0.05, 0.05]", "0.1", "[0.0, 60.0, 0.0]")
                .replace("kind = \"box\", size_m = [0.05, 0.05, 0.05]", "kind = \"sphere\", radius_m = 50"),
            "cube is 100 m long, as large as a house; lengths are in metres: if millimetres were meant, write `radius_m = 0.05`",
        ),
        (
            with_cube("[0.05, 0.05, 0.05]", "100", "[0.0, 0.0, 0.0]"),
            "cube has 100 kg, 800000 kg/m^3, denser than any metal; masses are in kilograms: if grams were meant, write 0.1",
        ),
        (
            with_cube("[0.05, 0.05, 0.05]", "1", "[0.0, 0.0, 0.0]")
                .replace("mass_kg = 1", "density_kg_m3 = 7.85"),
            "cube has 7.85 kg/m^3, as light as foam; densities are in kg/m^3: if g/cm^3 were meant, write 7850",
        ),
        (
            with_cube("[0.05, 0.05, 0.05]", "0.1", "[0.0, 0.0, 300.0]"),
            "more than 10 m away from every finger: cube; places are in metres",
        ),
        (
            with_cube(
                "[0.05, 0.05, 0.05]",
                "0.1",
                "[0.0, 0.0, 0.0]\nangular_velocity_rad_s = [0.0, 360.0, 0.0]",
            ),
            "cube turns at 360 rad/s, 57.3 times a second; if degrees were meant, write 6.283",
        ),
        (
            with_cube(
                "[0.05, 0.05, 0.05]",
                "0.1",
                "[0.0, 0.0, 0.0]\norientation_wxyz = [0.0, 0.0, 0.0, 1.0]",
            ),
            "cube is turned by 180 degrees about z; if no turn was meant, orientation_wxyz is [1.0, 0.0, 0.0, 0.0], w first",
        ),
        (
            with_cube("[0.05, 0.05, 0.05]", "0.1", "[0.0, 0.0, 0.0]")
                .replace("start_m", "radius_m = 8.0\nstart_m"),
            "finger f0 has a radius of 8 m; if millimetres were meant, write 0.008",
        ),
        (
            format!(
                "gravity_m_s2 = [0.0, -981.0, 0.0]\n{}",
                with_cube("[0.05, 0.05, 0.05]", "0.1", "[0.0, 0.0, 0.0]")
            ),
            "gravity is 981 m/s^2; on Earth it is 9.81",
        ),
    ] {
        place.write("scene.toml", &scene);
        let said = check(&place, &["scene.toml"]);
        assert!(said.out.contains(&format!("warning: {warning}\n")), "{warning}\n{}{}", said.out, said.err);
    }
}

#[test]
fn check_suspects_hands_and_layouts_of_another_unit() {
    let place = Workplace::new();
    let cube = with_cube("[0.05, 0.05, 0.05]", "0.1", "[0.0, 0.0, 0.0]");
    place.write("scene.toml", format!("{WEIGHTLESS}{cube}"));
    place.write("mm.csv", "t,f0_x,f0_y,f0_z\n0,0,80,0\n1,50,20,0\n");
    place.write("far.csv", "t,f0_x,f0_y,f0_z\n0,0,80,0\n");
    place.write("m.csv", "t,f0_x,f0_y,f0_z\n0,0,0.08,0\n1,0.05,0.02,0\n");
    place.write("ms.csv", "t,f0_x,f0_y,f0_z\n0,0,0.08,0\n900,0.05,0.02,0\n");
    let rows = |step_s: f64, step_m: f64| {
        let row = |row| format!("{},{},0.08,0\n", f64::from(row) * step_s, f64::from(row % 20) * step_m);
        format!("t,f0_x,f0_y,f0_z\n{}", (0..50).map(row).collect::<String>())
    };
    place.write("many_ms.csv", rows(1.0, 0.001));
    place.write("many.csv", rows(0.4, 0.001));
    place.write("sparse.csv", rows(1.0, 0.01));
    place.write("mm.toml", "[[device]]\nposition_m = [-150, 0, 0]\n");
    place.write("m.toml", "[[device]]\nposition_m = [-0.15, 0, 0]\n");
    let divide =
        "farther than an arm reaches; places are in metres: if millimetres were meant, divide them by 1000";
    let start = with_cube("[0.05, 0.05, 0.05]", "0.1", "[0.0, 0.0, 0.0]").replacen(
        "[0.0, 0.2, 0.0]",
        "[0.0, 50.0, 0.0]",
        1,
    );
    place.write("start.toml", &start);
    let said = check(&place, &["start.toml"]);
    assert!(
        said.out.contains("finger f0 begins at (0, 50, 0) m, farther than an arm reaches"),
        "{}",
        said.out
    );
    for (arguments, parts) in [
        (["--hand", "mm.csv"], &["finger f0 goes along 60 m in", "mm.csv", divide][..]),
        (["--hand", "far.csv"], &["finger f0 goes as far as 80 m from the origin in", "far.csv", divide]),
        (["--layout", "mm.toml"], &["device 0 stands at (-150, 0, 0) m", "it is at (-0.15, 0, 0)"]),
        (["--hand", "ms.csv"], &["the hand takes 900 s for 2 rows in", "if milliseconds were meant, divide"]),
        (["--hand", "many_ms.csv"], &["the hand takes 49 s for 50 rows in", "many_ms.csv"]),
        (["--hand", "many.csv"], &[]),
        (["--hand", "sparse.csv"], &[]),
        (["--hand", "m.csv"], &[]),
        (["--layout", "m.toml"], &[]),
    ] {
        let said = check(&place, &["scene.toml", arguments[0], arguments[1]]);
        let warnings: Vec<_> = said.out.lines().filter(|line| line.starts_with("warning: ")).collect();
        assert_eq!(warnings.len(), usize::from(!parts.is_empty()), "{arguments:?}: {}", said.out);
        assert!(parts.iter().all(|part| warnings[0].contains(part)), "{arguments:?}: {warnings:?}");
    }
}

#[test]
fn a_run_suspects_a_hand_of_another_unit_as_check_does() {
    let place = Workplace::new();
    place.write("scene.toml", with_cube("[0.05, 0.05, 0.05]", "0.1", "[0.0, 0.0, 0.0]"));
    place.write("mm.csv", "t,f0_x,f0_y,f0_z\n0,0,80,0\n0.1,50,20,0\n");
    place.write("m.csv", "t,f0_x,f0_y,f0_z\n0,0,0.08,0\n0.1,0.05,0.02,0\n");
    for (hand, is_suspected) in [("mm.csv", true), ("m.csv", false)] {
        let said = place.run(["run", "scene.toml", "--hand", hand, "--clock", "virtual", "--headless"]);
        assert_eq!(said.status, Some(0), "{}", said.err);
        let warning = "phantom3: warning: finger f0 goes along 60 m in";
        assert_eq!(said.err.contains(warning), is_suspected, "{}", said.err);
    }
}

#[test]
fn every_committed_scene_can_be_run_as_check_says() {
    let place = Workplace::new();
    for directory in ["scenes", "scenes/kinds"] {
        let files = std::path::Path::new(CONFIG).join(directory).read_dir().expect("scenes");
        for file in files.map(|entry| entry.expect("an entry").path()) {
            if file.is_file() {
                let said = check(&place, &[file.to_str().expect("UTF-8")]);
                assert_eq!(said.status, Some(0), "{}{}", said.out, said.err);
                assert!(said.out.ends_with("problems: 0, warnings: 0\n"), "{}", said.out);
            }
        }
    }
}

#[test]
fn ten_thousand_things_of_one_mesh_are_a_scene_like_any_other() {
    let place = Workplace::new();
    place.write(
        "scene.toml",
        format!(
            "[[finger]]\nstart_m = [0.0, -1.0, 0.0]\n[[template]]\nname = \"thing\"\n\
             shape = {{ kind = \"mesh\", file = \"{CONFIG}/meshes/bumpy-100k.stl\", scale = 0.1 }}\n\
             [[entity]]\nname = \"item\"\ntemplate = \"thing\"\ngrid = {{ count = [10, 100, 10], spacing_m = [0.1, 0.1, 0.1] }}\n"
        ),
    );
    let said = check(&place, &["scene.toml", "--json"]);
    assert_eq!(said.status, Some(0), "{}{}", said.out, said.err);
    let summary = &json(&said)["summary"];
    assert_eq!(summary["entities"]["fixed"], 10_000);
    assert_eq!(summary["meshes"].as_array().map(Vec::len), Some(1), "it is loaded once");
    // A mesh has some 15 MB; ten thousand of them would have 150 GB.
    let most = summary["memory_bytes"]["most"].as_u64().expect("Linux says");
    assert!(most < 400 << 20, "{most} bytes");
}

#[test]
fn the_scene_files_of_the_thesis_become_the_committed_scene() {
    let place = Workplace::new();
    let list = format!("{CONFIG}/scenes/thesis/objects.ini");
    let objects = format!("{CONFIG}/scenes/thesis/objects");
    let out = place.path("figure-7-2.toml");
    let arguments = ["convert", &list, "--objects", &objects, "--meshes", "../../meshes", "--out"];
    let said = place.run(arguments.into_iter().chain([out.to_str().expect("UTF-8")]));
    assert_eq!((said.status, said.out.as_str()), (Some(0), ""), "{}", said.err);
    let plain = |text: String| text.replace(&format!("{objects}/"), "objects/");
    let converted = plain(std::fs::read_to_string(out).expect("a scene"));
    let committed =
        std::fs::read_to_string(format!("{CONFIG}/scenes/thesis/figure-7-2.toml")).expect("a scene");
    assert_eq!(converted, committed);
    assert!(said.err.contains("a moment of inertia is missing"), "{}", said.err);
    let said = place.run(["run", &format!("{CONFIG}/scenes/thesis/figure-7-2.toml"), "--clock", "virtual"]);
    assert_eq!(said.status, Some(0), "{}", said.err);
}

#[test]
fn an_object_file_by_itself_becomes_an_entity_and_what_is_missing_is_told() {
    let place = Workplace::new();
    let object = format!("{CONFIG}/scenes/thesis/objects/Mesh_01.ini");
    let said = place.run(["convert", &object]);
    assert_eq!(said.status, Some(0), "{}", said.err);
    assert!(said.out.starts_with("[[entity]]\nname = \"Mesh_01\"\n"), "{}", said.out);
    place.write("objects.ini", "GameObject Nothing_01\n");
    let said = place.run(["convert", "objects.ini"]);
    assert_eq!(said.status, Some(2));
    assert!(said.err.starts_with("phantom3: objects.ini:1: no object file Nothing_01"), "{}", said.err);
}

#[test]
fn settings_are_layered_and_say_where_data_is() {
    let place = Workplace::new();
    for directory in ["scenes", "meshes", "hands"] {
        std::fs::create_dir(place.path(directory)).expect("a directory");
    }
    place.write(
        "p.toml",
        "[data]\nscenes = [\"scenes\"]\nmeshes = [\"meshes\"]\nhands = [\"hands\"]\n[driver]\nclock = \"virtual\"\n[window]\nshadows = true\n",
    );
    place.write(
        "scenes/s.toml",
        "hand = \"h.csv\"\n[[finger]]\n[[entity]]\nshape = { kind = \"mesh\", file = \"tetra.obj\" }\n",
    );
    place.write(
        "meshes/tetra.obj",
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n",
    );
    place.write("hands/h.csv", "t,f0_x,f0_y,f0_z\n0,2,2,2\n1,2,2,2\n");
    let said = place.run(["--settings", "p.toml", "settings", "--set", "window.shadows=false"]);
    assert_eq!(said.status, Some(0), "{}", said.err);
    let line = |key: &str| {
        said.out.lines().find(|line| line.starts_with(key)).unwrap_or_else(|| panic!("{}", said.out))
    };
    assert!(line("window.shadows").ends_with("--set:1  (for the window)"), "{}", said.out);
    assert!(line("driver.clock").ends_with("p.toml:6"), "{}", said.out);
    assert!(line("stereo.mode").contains("built in"), "{}", said.out);
    // On the virtual clock no driver is started, and all three files are found.
    let said = place.run(["run", "s.toml", "--settings", "p.toml"]);
    assert_eq!(said.status, Some(0), "{}", said.err);
    assert!(said.out.starts_with("clock        virtual"), "{}", said.out);
    let said = place.run(["run", "s.toml"]);
    assert_eq!(said.status, Some(2), "without the settings the scene is not found");
    // A table is played again in that scene; what goes by no settings takes none.
    let said = place.run(["run", "s.toml", "--settings", "p.toml", "--record", "r.csv"]);
    assert_eq!(said.status, Some(0), "{}", said.err);
    let replay = ["replay", "r.csv", "--expect-same", "--scene", "s.toml"];
    let said = place.run(replay.iter().chain(&["--settings", "p.toml"]));
    assert_eq!(said.status, Some(0), "{}", said.err);
    assert_eq!(place.run(replay).status, Some(2), "without the settings the scene is not found");
    let said = place.run(replay.iter().chain(&["--set", "entity.cube.mass_kg=1"]));
    assert!(said.status == Some(2) && said.err.contains("--set:1: entity: unknown key"), "{}", said.err);
    let said = place.run(["plot", "r.csv", "--set", "window.shadows=true"]);
    assert!(said.status == Some(2) && said.err.contains("this command goes by none"), "{}", said.err);
    let said = place.run(["--settings", "none.toml", "settings"]);
    assert_eq!(
        (said.status, said.err.as_str()),
        (Some(2), "phantom3: none.toml: no such file; name an existing TOML file\n")
    );
}

/// Against runs on the virtual clock: lengths of files, and pairs that can be counted by hand.
#[test]
fn check_tells_what_a_scene_takes_as_a_run_takes_it() {
    // Six cubes on a floor, two of them side by side: of each one pair, and one more.
    let places = [0.0, 0.045, 0.2, 0.3, 0.4, 0.5];
    let cubes = places.iter().enumerate().map(|(at, x)| {
        format!(
            "[[entity]]\nname = \"c{at}\"\nposition_m = [{x}, 0.02, 0]\nmass_kg = 0.1\n\
             shape = {{ kind = \"box\", size_m = [0.04, 0.04, 0.04] }}\n"
        )
    });
    let floor =
        "[[entity]]\nname = \"floor\"\nshape = { kind = \"plane\", normal = [0, 1, 0], offset_m = 0 }\n";
    let scene = format!("[[finger]]\nstart_m = [0, 0.5, 0]\n{floor}{}", cubes.collect::<String>());
    for (lists, in_two_lists) in [("", false), ("lists = { fast_bodies = 3 }\n", true)] {
        let place = Workplace::new();
        place.write("scene.toml", format!("{lists}{scene}"));
        let told = json(&check(&place, &["scene.toml", "--json"]));
        let told = &told["summary"]["capacities"];
        let number = |key: &str| told[key].as_f64().unwrap_or_else(|| panic!("{key}: {told}"));
        assert_eq!(number("pairs"), 7.0, "{told}");
        assert!(number("pair_room") >= 7.0, "{told}");
        assert_eq!(told["slow_tick_ns"].is_number(), in_two_lists, "{told}");
        if in_two_lists {
            assert_eq!(number("slow_awake"), 6.0, "{told}");
        } else {
            assert_eq!(number("awake"), 6.0, "{told}");
        }
        assert!(number("fast_tick_at_rest_ns") < 1e6 && number("awake_body_ns") < 1e6, "{told}");
        assert!(number("awake_bodies_in_a_tick") >= 1.0, "{told}");
        let [csv, mcap] = bytes_a_second(&place);
        assert!(
            csv <= number("csv_bytes_per_s") && mcap <= number("mcap_bytes_per_s"),
            "{csv} {mcap} {told}"
        );
        let said = check(&place, &["scene.toml"]).out;
        for line in [
            "capacities     pairs near each other: 7 at the start",
            "fast tick: ",
            "things awake: ",
            "recording: ",
        ] {
            assert!(said.contains(line), "{line}: {said}");
        }
        assert_eq!(said.contains("slow list: a tick takes "), in_two_lists, "{said}");
    }
}

/// Bytes of a table and of an MCAP in half a second, which is as long as an MCAP's chunk; but for its first row, which comes with
/// what stands before it.
fn bytes_a_second(place: &Workplace) -> [f64; 2] {
    let bytes = |name: &str, seconds: &str| {
        let run = ["run", "scene.toml", "--headless", "--clock", "virtual", "--seconds", seconds];
        let said = place.run(run.iter().chain(&["--record", name]));
        let length =
            std::fs::metadata(place.path(name)).unwrap_or_else(|error| panic!("{error}: {}", said.err)).len();
        length as f64
    };
    ["a.csv", "a.mcap"].map(|file| (bytes(file, "0.5") - bytes(file, "0.001")) / 0.499)
}

/// The most is what all takes while it flies and spins: of 12 things, and of 150, of which an MCAP tells changes.
#[test]
fn check_tells_what_recordings_take_while_everything_moves() {
    for (count, lists) in [("[3, 2, 2]", ""), ("[10, 5, 3]", "lists = { fast_bodies = 200 }\n")] {
        let scene = format!(
            "gravity_m_s2 = [0, 0, 0]\n{lists}[[finger]]\nstart_m = [0, 5, 0]\n[[entity]]\nname = \"c\"\nmass_kg = 0.1\n\
             shape = {{ kind = \"box\", size_m = [0.04, 0.05, 0.06] }}\nvelocity_m_s = [0.13, 0.117, 0.2371]\n\
             angular_velocity_rad_s = [1.37, 2.711, 3.1]\ngrid = {{ count = {count}, spacing_m = [0.2, 0.2, 0.2] }}\n"
        );
        let place = Workplace::new();
        place.write("scene.toml", scene);
        let told = json(&check(&place, &["scene.toml", "--json"]));
        let told = &told["summary"]["capacities"];
        // The velocities of what flies stay, which is packed well, and a finger that rests has short numbers.
        let expected = [("csv_bytes_per_s", 0.6), ("mcap_bytes_per_s", 0.05)];
        for (found, (key, least)) in bytes_a_second(&place).into_iter().zip(expected) {
            let share = found / told[key].as_f64().unwrap_or_else(|| panic!("{key}: {told}"));
            assert!((least..=1.0).contains(&share), "{count} {key}: {found} B/s, {told}");
        }
    }
}
