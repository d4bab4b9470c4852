//! Every mistake in a command line or a file: status 2, one message that a stranger can act on, and nothing
//! half-started.

mod damaged_recordings;
mod foreign_recordings;
mod mcap_bytes;
mod outputs;
mod pipes;

use haptics::NurbsPatch;
use haptics::nurbs::MAX_DEGREE;
use std::ffi::{OsStr, OsString};
use std::os::unix::ffi::OsStrExt;
use std::os::unix::fs::PermissionsExt;
use std::os::unix::process::CommandExt;
use std::path::Path;
use system_tests::workplace::{Running, Said, Workplace};
use world::model::write_patches;

const SCENE: &str = "[[finger]]\n[[entity]]\nname = \"table\"\n\
    shape = { kind = \"plane\", normal = [0.0, 1.0, 0.0], offset_m = 0.0 }\n";
const HAND: &str = "t,f0_x,f0_y,f0_z\n0,0,0,0\n1,0,0,0\n";
/// An object file of the thesis' own program.
const BALL: &str = "Name=ball\nType=Object\nShape=Sphere\nRadius=0.03\nMass=0.1\n";
/// A recording that must not be lost.
const PRECIOUS: &str = "an earlier recording\n";

/// A workplace with a good scene, a good hand and an earlier recording.
fn workplace() -> Workplace {
    let place = Workplace::new();
    place.write("scene.toml", SCENE);
    place.write("hand.csv", HAND);
    place.write("out.csv", PRECIOUS);
    place
}

/// Runs and checks everything that must hold for whatever is wrong.
fn refused(place: &Workplace, arguments: &[impl AsRef<OsStr>]) -> String {
    let before = place.snapshot();
    let said = place.run(arguments);
    let asked: Vec<_> = arguments.iter().map(|argument| argument.as_ref().to_string_lossy()).collect();
    check_refusal(&said, &format!("phantom3 {}", asked.join(" ")));
    assert!(place.snapshot() == before, "phantom3 {}: files have changed", asked.join(" "));
    assert_eq!(place.processes(), Vec::<u32>::new(), "phantom3 {}: left behind", asked.join(" "));
    said.err
}

fn check_refusal(said: &Said, asked: &str) {
    assert_eq!(said.status, Some(2), "{asked}\n{}", said.err);
    assert_eq!(said.out, "", "{asked}");
    let is_ours = said.err.starts_with("phantom3: ") && said.err.lines().count() == 1;
    // What clap says ends in its advice to ask for help.
    let is_claps =
        said.err.starts_with("error: ") && said.err.contains("For more information, try '--help'.");
    assert!(is_ours || is_claps, "{asked}: not one clear message:\n{}", said.err);
    assert!(!said.err.contains("panicked"), "{asked}\n{}", said.err);
}

fn assert_says(message: &str, parts: &[&str]) {
    for part in parts {
        assert!(message.contains(part), "`{part}` is missing in: {message}");
    }
}

/// The clocks that start something: one process, or two.
const CLOCKS: [&str; 2] = ["virtual", "real"];

#[test]
fn a_scene_that_is_wrong_is_refused_with_file_line_key_finding_and_remedy() {
    let entity = |rest: &str| format!("{SCENE}{rest}\n");
    let shape = |shape: &str| format!("[[finger]]\n[[entity]]\nshape = {shape}\n");
    let cases: Vec<(String, &[&str])> = vec![
        ("x = = 1".into(), &["scene.toml:1:5: not valid TOML"]),
        ("[[finger]".into(), &["scene.toml:1:", "not valid TOML"]),
        (String::new(), &["scene.toml: no [[finger]]", "allowed: 1 to 8"]),
        ("[[finger]]\n".repeat(9), &["scene.toml:9: finger[8]", "9 entries", "at most 8"]),
        (
            "[[finger]]\n[[figner]]\n".into(),
            &["scene.toml:2: figner", "unknown key", "did you mean `finger`"],
        ),
        ("[[finger]]\nradius = 1\n".into(), &["scene.toml:2: finger[0].radius", "unknown key", "`radius_m`"]),
        (
            "[[finger]]\nradius_m = \"1\"\n".into(),
            &["scene.toml:2: finger[0].radius_m", "the string \"1\"", "a number, 0 or more"],
        ),
        (
            "[[finger]]\nradius_m = \"5 mm\"\n".into(),
            &["finger[0].radius_m", "the string \"5 mm\"", "a number, 0 or more; numbers have no units"],
        ),
        (
            "[[finger]]\nradius_m = 5 mm\n".into(),
            &["scene.toml:2:12: not valid TOML: found 5 mm, allowed: a number alone; numbers have no units"],
        ),
        ("[[finger]]\nradius_m = nan\n".into(), &["finger[0].radius_m", "found nan", "a number, 0 or more"]),
        (
            "[[finger]]\nradius_m = -inf\n".into(),
            &["finger[0].radius_m", "found -inf", "a number, 0 or more"],
        ),
        (
            "[[finger]]\nradius_m = -0.01\n".into(),
            &["scene.toml:2: finger[0].radius_m", "found -0.01", "0 or more"],
        ),
        (
            "[[finger]]\nstart_m = [0.0, 1.0]\n".into(),
            &["finger[0].start_m", "an array of length 2", "an array of 3 numbers"],
        ),
        ("[[finger]]\nstart_m = [0.0, nan, 0.0]\n".into(), &["finger[0].start_m[1]", "found nan"]),
        ("[[finger]]\nname = \"a,b\"\n".into(), &["finger[0].name", "\"a,b\"", "A-Z a-z 0-9 _ -"]),
        (
            "[[finger]]\nname = \"a\"\n[[finger]]\nname = \"a\"\n".into(),
            &["scene.toml:4: finger[1].name", "\"a\"", "line 2"],
        ),
        (
            "[[finger]]\nname = \"f1\"\n[[finger]]\n".into(),
            &["finger[1].name", "\"f1\" (the default name)", "line 2"],
        ),
        ("[[finger]]\ndevice = 8\n".into(), &["finger[0].device", "found 8", "0 to 7"]),
        ("[[finger]]\n[[entity]]\n".into(), &["scene.toml:2: entity[0].shape", "missing"]),
        (entity("name = \"b\""), &["scene.toml:5", "not valid TOML", "duplicate key"]),
        (
            entity(&format!(
                "[[entity]]\nname = \"table\"\n{}",
                "shape = { kind = \"sphere\", radius_m = 1.0 }"
            )),
            &["entity[1].name", "\"table\"", "line 3"],
        ),
        (
            entity("velocity_m_s = [0, 1, 0]"),
            &["entity[0].mass_kg", "missing", "an entity with `velocity_m_s` moves"],
        ),
        (entity("mass_kg = -1.0"), &["scene.toml:5: entity[0].mass_kg", "found -1.0", "above 0"]),
        (
            entity("mass_kg = 0.1\ndensity_kg_m3 = 500.0"),
            &["scene.toml:6: entity[0].density_kg_m3", "found 500.0", "not both"],
        ),
        (
            entity("mass_kg = 0.1"),
            &["scene.toml:2: entity table: a plane cannot move", "leave out `mass_kg`"],
        ),
        (
            entity("").replace(
                "kind = \"plane\", normal = [0.0, 1.0, 0.0], offset_m = 0.0",
                "kind = \"sphere\", radius_m = 0.1",
            ) + "mass_kg = 0.1\ninertia_kg_m2 = [1e-5, 1e-5, 3e-5]",
            &["scene.toml:2: entity table", "inertia_kg_m2 is [0.00001, 0.00001, 0.00003]", "sum"],
        ),
        (
            entity("").replace(
                "kind = \"plane\", normal = [0.0, 1.0, 0.0], offset_m = 0.0",
                "kind = \"sphere\", radius_m = 0.1",
            ) + "mass_kg = 0.1\ninertia_kg_m2 = [1e-3, 1e-9, 1e-3]",
            &["scene.toml:2: entity table", "inertia_kg_m2 is 0.000000001 about y", "at least 0.00000066"],
        ),
        (
            entity("").replace(
                "kind = \"plane\", normal = [0.0, 1.0, 0.0], offset_m = 0.0",
                "kind = \"sphere\", radius_m = 0.1",
            ) + "mass_kg = 1e-200",
            &["scene.toml:2: entity table", "mass_kg", "1e-15 to 1e15"],
        ),
        (entity("stiffness_n_per_m = 0"), &["entity[0].stiffness_n_per_m", "found 0", "above 0"]),
        (entity("damping_n_s_per_m = -1"), &["entity[0].damping_n_s_per_m", "found -1", "0 or more"]),
        (
            entity("orientation_wxyz = [1.0, 1.0, 0.0, 0.0]"),
            &["entity[0].orientation_wxyz", "length 1.414", "of length 1"],
        ),
        (entity("friction = 0.5"), &["entity[0].friction", "found 0.5", "{ model = \"coulomb\", mu = 0.5 }"]),
        (
            entity("friction = { model = \"columb\", mu = 0.5 }"),
            &["friction.model", "`columb`", "did you mean `coulomb`"],
        ),
        (
            entity("friction = { model = \"lugre\" }"),
            &["scene.toml:5: entity[0].friction.mu_s", "missing", "a number, 0 or more"],
        ),
        (
            entity("friction = { model = \"coulomb\" }"),
            &["entity[0].friction.mu", "missing", "a number, 0 or more"],
        ),
        (entity("friction = { model = \"coulomb\", mu = -0.1 }"), &["entity[0].friction.mu", "found -0.1"]),
        (
            entity("friction = { model = \"curve\", speed_m_s = [0.0, 0.1], mu = [0.5] }"),
            &["entity[0].friction.mu", "an array of length 1", "an array of 2 numbers"],
        ),
        (
            entity("algorithm = \"god-object\""),
            &["scene.toml:5: entity[0].algorithm", "`god-object`", "friction-cone, vector-field, classic"],
        ),
        (
            shape("{ kind = \"torus\", ring_radius_m = 0.02, tube_radius_m = 0.03 }"),
            &["entity[0].shape.tube_radius_m", "found 0.03", "below ring_radius_m = 0.02"],
        ),
        (
            shape("{ kind = \"mesh\", file = \"none.obj\" }"),
            &["scene.toml:3: entity[0].shape.file: none.obj: no such file"],
        ),
        (
            shape("{ kind = \"mesh\", file = \"hand.csv\" }"),
            &["entity[0].shape.file: hand.csv", "of no kind that is read"],
        ),
        (
            shape("{ kind = \"sphere\", radius_m = 1e200, scale = 1e200 }"),
            &["entity[0].shape.radius_m", "found 1e200", "1e6 at most"],
        ),
        (
            entity("damping_n_s_per_m = 1e308"),
            &["scene.toml:5: entity[0].damping_n_s_per_m", "found 1e308", "1e6 at most"],
        ),
        (
            entity("friction = { model = \"stiction\", mu_s = 0.3, mu_d = 0.7 }"),
            &["friction.mu_d", "found 0.7", "from 0 to mu_s = 0.3"],
        ),
        (
            shape("{ kind = \"box\", size_m = [1.0, -1.0, 1.0] }"),
            &["scene.toml:3: entity[0].shape.size_m[1]", "found -1.0", "a number above 0"],
        ),
        (shape("{ kind = \"spehre\", radius_m = 1.0 }"), &["`spehre`", "did you mean `sphere`"]),
        (
            shape("{ kind = \"sphere\", radius_m = 0.0 }"),
            &["entity[0].shape.radius_m", "found 0.0", "above 0"],
        ),
        (
            shape("{ kind = \"plane\", normal = [0.0, 0.0, 0.0], offset_m = 0.0 }"),
            &["entity[0].shape.normal", "zero vector", "a direction"],
        ),
    ];
    let place = workplace();
    for (index, (scene, parts)) in cases.iter().enumerate() {
        place.write("scene.toml", scene);
        let clock = CLOCKS[index % 2];
        assert_says(&refused(&place, &["run", "scene.toml", "--clock", clock, "--record", "out.csv"]), parts);
    }
}

#[test]
fn a_hand_that_is_wrong_is_refused_with_file_line_column_finding_and_remedy() {
    let cases: &[(&str, &[&str])] = &[
        ("", &["hand.csv:1", "an empty file", "a header line"]),
        ("\n\n", &["hand.csv:1", "an empty file"]),
        ("t,f0_x,f0_y,f0_z\n", &["hand.csv:1", "end of the file after the header", "at least one row"]),
        ("f0_x,f0_y,f0_z\n1,2,3\n", &["hand.csv:1", "`f0_x`", "`t`"]),
        ("t\n0\n", &["hand.csv:1", "no columns beside the time", "f0"]),
        ("t,f0_x,f0_y\n0,1,2\n", &["hand.csv:1", "`f0_z`", "all three coordinates"]),
        ("t,f7_x,f7_y,f7_z\n0,1,2,3\n", &["hand.csv:1", "`f7_x`", "f0"]),
        ("t,f0_x,f0_x,f0_y,f0_z\n0,1,2,3,4\n", &["hand.csv:1", "`f0_x`", "different"]),
        (
            "t,f0_x,f0_y,f0_z\n0,1,2,3\n0,1,2,3\n",
            &["hand.csv:3", "column `t`", "found 0 s after 0 s", "later"],
        ),
        ("t,f0_x,f0_y,f0_z\n1,1,2,3\n0.5,1,2,3\n", &["hand.csv:3", "column `t`", "0.5 s after 1 s"]),
        ("t,f0_x,f0_y,f0_z\n0,1,two,3\n", &["hand.csv:2", "column `f0_y`", "`two`", "a finite number"]),
        ("t,f0_x,f0_y,f0_z\n0,1,nan,3\n", &["hand.csv:2", "column `f0_y`", "`nan`", "a finite number"]),
        ("t,f0_x,f0_y,f0_z\n0,1,inf,3\n", &["hand.csv:2", "column `f0_y`", "`inf`", "a finite number"]),
        ("t,f0_x,f0_y,f0_z\n0,1,1e300,3\n", &["hand.csv:2", "`1e300`", "1e15"]),
        ("t,f0_x,f0_y,f0_z\n0,1,,3\n", &["hand.csv:2", "column `f0_y`", "nothing"]),
        ("t,f0_x,f0_y,f0_z\n0,1,2\n", &["hand.csv:2", "3 cells", "allowed: 4"]),
        ("t,f0_x,f0_y,f0_z\n0,1,2,3,4\n", &["hand.csv:2", "5 cells", "allowed: 4"]),
        ("t,f0_x,f0_y,f0_z\n0,1,2,3\n\n1,1,2,3\n", &["hand.csv:3", "0 cells"]),
        ("t;f0_x;f0_y;f0_z\n0;1;2;3\n", &["hand.csv:1", "`t;f0_x;f0_y;f0_z`", "`t`", "it has semicolons"]),
        ("t\tf0_x\tf0_y\tf0_z\n0\t1\t2\t3\n", &["hand.csv:1", "it has tabs", "separated by commas"]),
        ("t,f0_x,f0_y,f0_z\n0,5,0,01,0,2,0,3\n", &["hand.csv:2", "8 cells", "write points, as in 0.1"]),
        (
            "t,f0_x,f0_y,f0_z\n1700000000,0,0,0\n1700000001,0,0,0\n",
            &["hand.csv", "t = 1700000001.00 s", "at most 86400 s", "subtract the first time"],
        ),
    ];
    let place = workplace();
    for (index, (hand, parts)) in cases.iter().enumerate() {
        place.write("hand.csv", hand);
        let clock = CLOCKS[index % 2];
        let message = refused(
            &place,
            &["run", "scene.toml", "--hand", "hand.csv", "--clock", clock, "--record", "out.csv"],
        );
        assert_says(&message, parts);
    }
    place.write("hand.csv", [0x74, 0xff, 0xfe]);
    assert_says(&refused(&place, &["run", "scene.toml", "--hand", "hand.csv"]), &["hand.csv", "UTF-8"]);
}

#[test]
fn a_hand_that_cannot_be_read_is_refused_and_the_message_says_who_asked_for_it() {
    let place = workplace();
    for clock in CLOCKS {
        let with = |hand: &str| {
            refused(&place, &["run", "scene.toml", "--hand", hand, "--clock", clock, "--record", "out.csv"])
        };
        assert_says(&with("none.csv"), &["none.csv", "--hand", "No such file"]);
        assert_says(&with("."), &["the hand file .", "not a regular file"]);
        // Every device reads the file for itself, which a pipe would not survive, and zeros never end.
        assert_says(&with("/dev/zero"), &["/dev/zero", "not a regular file", "allowed: a file"]);
    }
    place.write("scene.toml", format!("hand = \"none.csv\"\n{SCENE}"));
    let message = refused(&place, &["run", "scene.toml", "--record", "out.csv"]);
    assert_says(&message, &["none.csv", "named by scene.toml", "No such file"]);
}

#[test]
fn a_command_line_that_is_wrong_is_refused_with_what_was_found_and_what_is_allowed() {
    let cases: &[(&[&str], &[&str])] = &[
        (&["--rate-hz", "0"], &["--rate-hz", "found 0", "10 to 20000 Hz"]),
        (&["--rate-hz", "-1000"], &["--rate-hz", "found -1000", "10 to 20000 Hz"]),
        (&["--rate-hz", "abc"], &["--rate-hz", "found abc", "10 to 20000 Hz"]),
        (&["--rate-hz", "1e9"], &["--rate-hz", "found 1e9", "10 to 20000 Hz"]),
        (&["--rate-hz", "nan"], &["--rate-hz", "found nan", "10 to 20000 Hz"]),
        (&["--rate-hz"], &["--rate-hz", "a value is required"]),
        (&["--seconds", "0"], &["--seconds", "found 0", "more than 0"]),
        (&["--duration", "0"], &["--seconds", "found 0", "more than 0"]),
        (&["--seconds", "-1"], &["--seconds", "found -1", "more than 0"]),
        (&["--seconds", "nan"], &["--seconds", "found nan", "at most 86400"]),
        (&["--seconds", "inf"], &["--seconds", "found inf", "at most 86400"]),
        (
            &["--seconds", "1e-9", "--clock", "virtual"],
            &["--seconds 0.000000001", "at least one tick, 0.001 s"],
        ),
        (&["--clock", "foo"], &["'foo'", "--clock", "virtual, lockstep, real"]),
        (&["--hand-mode", "foo"], &["'foo'", "--hand-mode", "kinematic, impedance"]),
        (&["--seed", "x"], &["--seed", "found x", "a whole number from 0"]),
        (&["--seed", "-1"], &["--seed", "found -1", "a whole number from 0"]),
        (&["--layout", "none.toml"], &["none.toml", "no such file"]),
        (&["--layout", "scene.toml"], &["scene.toml:1: finger", "unknown key", "allowed: device"]),
        (&["--attach", "none.sock"], &["none.sock", "no driver is running", "io-driver run"]),
        (&["--attach", "hand.csv"], &["hand.csv", "not a driver's socket"]),
        (&["--attach", "."], &["not a driver's socket"]),
        (&["--attach", "none.sock", "--clock", "virtual"], &["--attach", "--clock virtual"]),
        (&["--attach", "none.sock", "--hand", "hand.csv"], &["--attach", "--hand"]),
        (&["--attach", "none.sock", "--rate-hz", "1000"], &["--attach", "--rate-hz"]),
        (&["--grace", "-1"], &["--grace", "found -1", "0 to 3600"]),
        (&["--wobble"], &["--wobble"]),
        (&["another.toml"], &["another.toml"]),
    ];
    let place = workplace();
    for (more, parts) in cases {
        let arguments = [&["run", "scene.toml", "--record", "out.csv"], *more].concat();
        assert_says(&refused(&place, &arguments), parts);
    }
    assert_says(&refused(&place, &["run"]), &["<SCENE>"]);
    assert_says(&refused(&place, &["frobnicate"]), &["frobnicate"]);
    assert_says(&refused(&place, &["scene.toml"]), &["scene.toml"]);
}

#[test]
fn a_scene_that_cannot_be_read_is_refused() {
    let place = workplace();
    place.write("binary.toml", [0x7f, b'E', b'L', b'F', 2, 1, 1, 0, 0xff, 0xfe]);
    std::fs::create_dir(place.path("directory.toml")).expect("a directory");
    let long = "a/".repeat(3000) + "scene.toml";
    let name = "n".repeat(300);
    let cases: [(&str, &[&str]); 6] = [
        ("none.toml", &["none.toml: no such file"]),
        ("", &["a value is required for '<SCENE>'"]),
        ("directory.toml", &["directory.toml: cannot be read", "directory"]),
        ("binary.toml", &["binary.toml:1", "not UTF-8 text"]),
        (&long, &["cannot be read", "too long"]),
        (&name, &["cannot be read", "too long"]),
    ];
    for (scene, parts) in cases {
        assert_says(&refused(&place, &["run", scene, "--record", "out.csv"]), parts);
    }
    assert_says(&refused(&place, &["run", "/dev/zero"]), &["/dev/zero", "a device, no regular file"]);
}

#[test]
fn names_of_files_need_not_be_text() {
    let place = workplace();
    let named = |bytes: &[u8]| OsString::from(OsStr::from_bytes(bytes));
    let (missing, scene, hand) = (named(b"\xffnone.toml"), named(b"\xffscene.toml"), named(b"\xffhand.csv"));
    assert_says(&refused(&place, &[named(b"run"), missing]), &["none.toml: no such file"]);
    place.write(&scene, SCENE);
    place.write(&hand, HAND);
    let run = |clock: &str| {
        [named(b"run"), scene.clone(), "--clock".into(), clock.into(), "--seconds".into(), "0.1".into()]
    };
    let said = place.run(run("virtual").iter().cloned().chain(["--hand".into(), hand.clone()]));
    assert_eq!((said.status, said.err.as_str()), (Some(0), ""));
    let said = place.run(run("lockstep"));
    assert_eq!((said.status, said.err.as_str()), (Some(0), ""));
    // Only the way to the driver, a TOML text, is closed to such names.
    let arguments: Vec<OsString> = run("real").into_iter().chain(["--hand".into(), hand]).collect();
    assert_says(&refused(&place, &arguments), &["hand.csv is not UTF-8", "rename it"]);
}

#[test]
fn a_recording_that_cannot_be_made_or_would_destroy_an_input_is_refused() {
    let place = workplace();
    let scene = place.write("named.toml", format!("hand = \"own.csv\"\n{SCENE}"));
    place.write("own.csv", HAND);
    place.write("layout.toml", "");
    std::os::unix::fs::symlink(&scene, place.path("symbolic.csv")).expect("a link");
    std::os::unix::fs::symlink(place.path("layout.toml"), place.path("layout.csv")).expect("a link");
    std::fs::create_dir(place.path("folder.csv")).expect("a directory");
    std::fs::hard_link(place.path("own.csv"), place.path("hard.csv")).expect("a link");
    let long = format!("{}.csv", "n".repeat(300));
    for clock in CLOCKS {
        let onto = |record: &str, more: &[&str]| {
            refused(&place, &[&["run", "named.toml", "--clock", clock, "--record", record], more].concat())
        };
        assert_says(
            &onto("none/out.csv", &[]),
            &["none/out.csv", "No such file or directory", "a directory that exists"],
        );
        assert_says(&onto("folder.csv", &[]), &["cannot create the recording folder.csv", "Is a directory"]);
        assert_says(&onto("", &[]), &["a value is required for '--record"]);
        assert_says(&onto("own.csv/out.csv", &[]), &["own.csv/out.csv", "Not a directory"]);
        assert_says(&onto(&long, &[]), &["too long"]);
        assert_says(&onto(".", &[]), &["no ending that names a format", "allowed: .csv"]);
        assert_says(&onto("named.toml", &[]), &["overwrite the input named.toml", "name another"]);
        assert_says(&onto("./named.toml", &[]), &["overwrite the input named.toml"]);
        assert_says(&onto("symbolic.csv", &[]), &["overwrite the input named.toml"]);
        assert_says(&onto("own.csv", &[]), &["overwrite the input", "own.csv", "name another"]);
        assert_says(&onto("hard.csv", &[]), &["overwrite the input", "own.csv"]);
        assert_says(&onto("hand.csv", &["--hand", "hand.csv"]), &["overwrite the input hand.csv"]);
        assert_says(&onto("layout.csv", &["--layout", "layout.toml"]), &["overwrite the input layout.toml"]);
    }
}

#[test]
fn a_recording_that_cannot_be_made_costs_none_of_the_others() {
    let place = workplace();
    let outputs = ["--record", "out.csv", "--record", "new.csv", "--events", "out.jsonl"];
    place.write("out.jsonl", PRECIOUS);
    for clock in CLOCKS {
        for bad in [["--record", "/dev/full"], ["--events", "none/x.csv"], ["--frames", "hand.csv"]] {
            let arguments = [&["run", "scene.toml", "--clock", clock][..], &outputs, &bad].concat();
            assert_says(&refused(&place, &arguments), &[bad[1]]);
        }
    }
    with_recordings(&place);
    for bad in ["none/x.csv", "/dev/full"] {
        let arguments = ["replay", "good.mcap", "--record", "out.csv", "--record", bad];
        assert_says(&refused(&place, &arguments), &[bad]);
    }
}

/// Permissions do not hold for root, who therefore tries as nobody, with a copy of the program that nobody
/// may start.
#[test]
fn what_permissions_forbid_is_refused() {
    let place = workplace();
    let mode = |path: &Path, bits: u32| {
        std::fs::set_permissions(path, std::fs::Permissions::from_mode(bits)).expect("our own file");
    };
    let copy = place.path("program");
    // By a process of its own: a child of another test would hold what is written here, and it could not be run.
    let mut copying = place.prepare(std::process::Command::new("cp"));
    copying.arg(place.phantom3().get_program()).arg(&copy);
    assert_eq!(Running::start(copying).wait().status, Some(0));
    mode(&copy, 0o755);
    mode(&place.write("locked.toml", SCENE), 0o000);
    mode(&place.path(""), 0o555);
    let try_it = |arguments: &[&str]| {
        let mut program = place.prepare(std::process::Command::new(&copy));
        if rustix::process::geteuid().is_root() {
            const NOBODY: u32 = 65534;
            program.uid(NOBODY).gid(NOBODY);
        }
        program.args(arguments);
        let said = Running::start(program).wait();
        check_refusal(&said, &arguments.join(" "));
        said.err
    };
    assert_says(&try_it(&["run", "locked.toml"]), &["locked.toml: cannot be read", "Permission denied"]);
    for clock in CLOCKS {
        let hand = try_it(&["run", "scene.toml", "--clock", clock, "--hand", "locked.toml"]);
        assert_says(&hand, &["locked.toml", "Permission denied"]);
    }
    let record = try_it(&["run", "scene.toml", "--clock", "virtual", "--record", "new.csv"]);
    assert_says(&record, &["cannot create the recording new.csv", "Permission denied", "can be written"]);
    mode(&place.path(""), 0o755);
}

/// A recording of a tenth of a second in each format.
fn with_recordings(place: &Workplace) {
    for file in ["good.mcap", "good.csv"] {
        let arguments = ["run", "scene.toml", "--clock", "virtual", "--seconds", "0.1", "--record", file];
        assert_eq!(place.run(arguments).status, Some(0), "{file}");
    }
}

/// A broken file can be one line of megabytes.
#[test]
fn of_what_a_file_holds_no_message_repeats_more_than_a_beginning() {
    let place = workplace();
    with_recordings(&place);
    let long = "x".repeat(100_000);
    let table = std::fs::read_to_string(place.path("good.csv")).expect("a table");
    let (header, rows) = table.split_once('\n').expect("a header");
    let bad = [
        format!("t,\"{long}_hip_x\n0,1\n"),
        format!("t,{long}_hip_x\n0,1\n"),
        format!("t,\u{1b}{long}_hip_x\n0,1\n"),
        format!("{header},{long}\n{rows}"),
        format!("{header}\n{}", rows.replacen("0.0", &long, 2)),
    ];
    for (number, text) in bad.iter().enumerate() {
        place.write("bad.csv", text);
        for command in ["export bad.csv new.csv", "replay bad.csv", "plot bad.csv --svg-only --out new"] {
            let arguments: Vec<_> = command.split(' ').collect();
            // One draws the columns that it knows, the other wants a scene first.
            if matches!((number, arguments[0]), (3, "plot") | (4, "replay")) {
                continue;
            }
            assert_is_short(&refused(&place, &arguments), &format!("{command} of {number}"));
        }
    }
    place.write("bad.csv", table.replace("f0_", &format!("{long}_")));
    let plot = ["plot", "bad.csv", "--finger", "none", "--svg-only", "--out", "new"];
    assert_is_short(&refused(&place, &plot), "plot --finger");
    place.write("pairs.csv", format!("0 0 0 0 0 {long}\n"));
    place.write("objects.ini", format!("GameObject {long}\n"));
    for (command, words) in
        [("calibrate --pairs pairs.csv", "pairs.csv"), ("convert objects.ini", "objects.ini")]
    {
        let said = place.run(command.split(' '));
        assert_eq!(said.status, Some(2), "{command}: {}", said.err);
        assert_says(&said.err, &[words]);
        assert_is_short(&said.err, command);
    }
    let mesh = format!("[[entity]]\nshape = {{ kind = \"mesh\", file = \"{long}.obj\" }}\n");
    for scene in
        [format!("hand = \"{long}\"\n{SCENE}"), format!("include = [\"{long}\"]\n"), SCENE.to_owned() + &mesh]
    {
        place.write("bad.toml", scene);
        assert_is_short(&refused(&place, &["run", "bad.toml"]), "run");
    }
}

fn assert_is_short(message: &str, asked: &str) {
    assert!(message.contains("xxx...") && message.len() < 600, "{asked}: {} bytes", message.len());
}

/// With room for so many megabytes of addresses.
pub(crate) fn run_in_little_memory(place: &Workplace, megabytes: u32, arguments: &[&str]) -> Said {
    let mut program = place.prepare(std::process::Command::new("sh"));
    program.args(["-c", &format!("ulimit -v {megabytes}000; exec \"$0\" \"$@\"")]);
    program.arg(place.phantom3().get_program()).args(arguments);
    Running::start(program).wait()
}

/// A sound patch of so many spans along each side, which falls into that many polynomials of the highest degree.
fn patch(spans: usize, height: impl Fn(usize) -> f64) -> NurbsPatch {
    let count = spans + MAX_DEGREE;
    let knot = |knot: usize| (knot.clamp(MAX_DEGREE, count) - MAX_DEGREE) as f64;
    let knots: Vec<f64> = (0..count + MAX_DEGREE + 1).map(knot).collect();
    let point = |index: usize| [(index % count) as f64, height(index), (index / count) as f64, 1.0];
    NurbsPatch {
        degree: [MAX_DEGREE; 2],
        knots: [knots.clone(), knots],
        points: (0..count * count).map(point).collect(),
    }
}

/// Its polynomials alone took 735 MB before they were refused, half of which does not fit here.
#[test]
fn a_file_of_patches_that_would_fill_the_memory_is_refused_in_little_of_it() {
    let place = workplace();
    let jagged = |index: usize| if index.is_multiple_of(2) { 50.0 } else { -50.0 };
    place.write("scene.toml", "[[finger]]\n[[entity]]\nshape = { kind = \"nurbs\", file = \"p.toml\" }\n");
    for patch in [patch(210, |_| 0.0), patch(100, jagged)] {
        place.write("p.toml", write_patches(&[patch]));
        let said = run_in_little_memory(&place, 512, &["check", "scene.toml"]);
        assert_eq!((said.status, said.err.as_str()), (Some(2), ""), "{}", said.out);
        let words =
            ["scene.toml:3: entity[0].shape", "p.toml", "the patches would take more than", "MB of memory"];
        assert_says(&said.out, &words);
    }
    // Room for what is no mistake.
    place.write("p.toml", write_patches(&[patch(4, |_| 0.0)]));
    let said = run_in_little_memory(&place, 512, &["check", "scene.toml"]);
    assert_eq!(said.status, Some(0), "{}{}", said.out, said.err);
}

#[test]
fn a_recording_whose_lengths_are_lies_is_told_as_damaged_and_takes_no_memory_for_them() {
    let place = workplace();
    with_recordings(&place);
    let good = std::fs::read(place.path("good.mcap")).expect("a recording");
    // Behind the magic: the length of the header's first text, and that of a later record and of the texts in it.
    let metadata = 8 + good[8..].windows(12).position(|at| at == b"phantom3.run").expect("metadata") - 4;
    let lies: [(usize, &[u8]); 4] = [
        (8 + 9, &[0xff; 4]),
        (metadata, &[0xff; 4]),
        (metadata, &[0, 0, 0, 0x10]),
        (metadata - 8, &[0xff, 0xff, 0xff, 0x7f, 1, 0, 0, 0]),
    ];
    for (at, lie) in lies {
        let mut bad = good.clone();
        bad[at..at + lie.len()].copy_from_slice(lie);
        place.write("bad.mcap", &bad);
        for command in [&["export", "bad.mcap", "--csv", "out2.csv"][..], &["replay", "bad.mcap"]] {
            let said = run_in_little_memory(&place, 2000, command);
            assert!(!said.err.contains("panicked") && !said.err.contains("allocation"), "{at}: {}", said.err);
            assert!(
                matches!(said.status, Some(0 | 2 | 3)),
                "{at} {command:?}: {:?} {}",
                said.status,
                said.err
            );
        }
    }
}

/// Scripts that expand too much fill no terminal.
#[test]
fn arguments_that_would_fill_screens_are_cut_short() {
    let place = workplace();
    let long = "x".repeat(100_000);
    let option = format!("--seconds={long}");
    for arguments in [
        &["run", &long][..],
        &["check", &long],
        &["plot", &long],
        &["convert", &long],
        &["run", "scene.toml", "--rate-hz", &long],
        &["run", "scene.toml", &option],
        &["run", "scene.toml", "--attach", &long],
        &["settings", "--set", &long],
        &[&long],
    ] {
        let said = place.run(arguments);
        assert_eq!(said.status, Some(2), "{}", said.err);
        let told = said.out.len() + said.err.len();
        assert!((20..1000).contains(&told), "{}: {told} bytes", arguments[0]);
    }
    let said = refused(&place, &["settings", "--set", "window.fullscreen=yes"]);
    assert_says(&said, &["found yes, allowed: true or false"]);
    let said = refused(&place, &["plot", "out.csv", "--from", "0,5"]);
    assert_says(&said, &["tip: a decimal number has a point, as in 0.1"]);
}

#[test]
fn a_thesis_file_without_a_word_is_refused() {
    let place = workplace();
    for text in ["", "// nothing\n\n"] {
        place.write("list.ini", text);
        assert_says(&refused(&place, &["convert", "list.ini"]), &["list.ini: found nothing but comments"]);
    }
}

#[test]
fn a_line_without_an_end_takes_no_memory_for_it() {
    let place = workplace();
    // Holes, which are read as zeros.
    std::fs::File::create(place.path("holes.csv")).and_then(|file| file.set_len(200 << 30)).expect("holes");
    for command in [
        &["plot", "holes.csv"][..],
        &["export", "holes.csv", "--csv", "out2.csv"],
        &["replay", "holes.csv", "--scene", "scene.toml"],
    ] {
        let said = run_in_little_memory(&place, 2000, command);
        assert_eq!(said.status, Some(2), "{command:?}: {}", said.err);
        assert_says(&said.err, &["holes.csv", "a line has more than 67108864 bytes"]);
    }
    let script = "ulimit -v 3000000; \"$0\" \"$@\" < /dev/zero";
    let said = place.shell(script, &["--clock", "lockstep", "--seconds", "2", "--orders", "-"]);
    assert_eq!(said.status, Some(0), "{}", said.err);
    assert_says(&said.err, &["--orders -: a line has more than 65536 bytes", "no orders are read"]);
    assert_says(&said.err, &["allowed: lines of text of 1000 bytes at most"]);
}

#[test]
fn a_line_of_the_standard_input_that_is_no_order_costs_none_of_those_behind_it() {
    let place = workplace();
    let script = r#"{ printf 'key \377 down\n'; printf 'text 0.5 0.5 1 %2000d\n' 0; printf 'key 32 down\n'; } |
        "$0" "$@""#;
    let said = place.shell(script, &["--clock", "lockstep", "--seconds", "2", "--orders", "-"]);
    assert_eq!(said.status, Some(0), "{}", said.err);
    assert_says(&said.out, &["orders       1\n"]);
    let refusals: Vec<&str> = said.err.lines().filter(|line| line.contains("order refused: ")).collect();
    assert_eq!(refusals.len(), 2, "{}", said.err);
    assert_says(refusals[0], &["line 1 is not UTF-8 text"]);
    assert_says(refusals[1], &["a line of 2015 bytes, allowed: at most 1000"]);
}

#[test]
fn an_order_piped_with_a_byte_order_mark_is_an_order() {
    let place = workplace();
    let script = r#"printf '\357\273\277key 32 down\r\n' | "$0" "$@""#;
    let said = place.shell(script, &["--clock", "lockstep", "--seconds", "2", "--orders", "-"]);
    assert_eq!((said.status, &*said.err), (Some(0), ""), "{}", said.err);
    assert_says(&said.out, &["orders       1\n"]);
}

#[test]
fn a_recording_whose_times_leap_or_fall_is_refused_with_its_line() {
    let place = workplace();
    with_recordings(&place);
    let good = std::fs::read_to_string(place.path("good.csv")).expect("a recording");
    let with_time = |time: &str| {
        let mut lines: Vec<String> = good.lines().map(str::to_owned).collect();
        let (_, rest) = lines[50].split_once(',').expect("columns");
        lines[50] = format!("{time},{rest}");
        lines.join("\n") + "\n"
    };
    for (time, parts) in [
        ("1e12", ["bad.csv:51:", "t is 1000000000000.0", "allowed: at most"]),
        ("4000", ["bad.csv:51:", "t is 4000.0 after 0.048", "at most 3600 s from a row to the next"]),
        ("nan", ["bad.csv:51:", "t is \"nan\"", "allowed: a number"]),
        ("inf", ["bad.csv:51:", "t is \"inf\"", "allowed: a number"]),
        ("0.01", ["bad.csv:51:", "t is 0.01 after 0.048", "rise from row to row"]),
        ("0.048", ["bad.csv:51:", "t is 0.048 after 0.048", "rise from row to row"]),
    ] {
        place.write("bad.csv", with_time(time));
        for command in [
            &["replay", "bad.csv", "--scene", "scene.toml"][..],
            &["export", "bad.csv", "--csv", "out2.csv"],
            &["plot", "bad.csv", "--svg-only"],
        ] {
            let said = place.run(command);
            assert_eq!(said.status, Some(3), "{time} {command:?}: {}{}", said.out, said.err);
            assert_says(&said.err, &parts);
        }
    }
    // What is no number is none in any column.
    let row = good.lines().nth(50).expect("a row");
    let (hip, _) = row.split_once(',').and_then(|(_, cells)| cells.split_once(',')).expect("columns");
    place.write("bad.csv", good.replacen(row, &row.replacen(&format!(",{hip},"), ",NaN,", 1), 1));
    for command in [&["export", "bad.csv", "out2.csv"][..], &["plot", "bad.csv", "--svg-only"]] {
        let said = place.run(command);
        assert_eq!(said.status, Some(3), "{command:?}: {}{}", said.out, said.err);
        assert_says(&said.err, &["bad.csv:51:", "f0_hip_x is \"NaN\"", "allowed: a number"]);
    }
    // No step between two times says how long a tick is.
    let [header, first] = [0, 1].map(|line| good.lines().nth(line).expect("a recording"));
    let (_, cells) = first.split_once(',').expect("columns");
    place.write("bad.csv", format!("{header}\n{first}\ninf,{cells}\n"));
    let said = place.run(["replay", "bad.csv", "--scene", "scene.toml"]);
    assert_eq!(said.status, Some(3), "{}{}", said.out, said.err);
    assert_says(&said.err, &["bad.csv:3:", "t is \"inf\"", "allowed: a number"]);
    let late = good.lines().take(1).chain(good.lines().skip(1).take(1)).collect::<Vec<_>>().join("\n");
    place.write("late.csv", late.replace("\n0.0,", "\n5000.0,").replace("\n0,", "\n5000,") + "\n");
    let said = place.run(["replay", "late.csv", "--scene", "scene.toml"]);
    assert_eq!(said.status, Some(2), "{}{}", said.out, said.err);
    assert_says(&said.err, &["late.csv", "its first row is at t = 5000.0", "at most 3600 s"]);
}

#[test]
fn orders_that_an_editor_of_windows_saved_are_orders() {
    let place = workplace();
    place.write("orders.txt", "\u{feff}at 0.01 stiffness 1.1\r\nat 0.02 reset\r\n");
    let said = place.run(
        ["run", "scene.toml", "--clock", "virtual", "--seconds", "0.1", "--orders", "orders.txt"].as_slice(),
    );
    assert_eq!(said.status, Some(0), "{}", said.err);
    assert!(said.out.lines().any(|line| line.starts_with("orders") && line.contains('2')), "{}", said.out);
}

#[test]
fn a_command_that_is_left_out_or_mistyped_is_answered_with_how_a_scene_is_played() {
    let place = workplace();
    const TIP: &str = "tip: a scene is played with 'phantom3 run SCENE.toml'";
    for arguments in [&["scene.toml"][..], &["--headless", "scene.toml"], &["rnu", "scene.toml"]] {
        assert_says(&refused(&place, arguments), &["unrecognized subcommand", TIP]);
    }
    for arguments in [&["study", "scene.toml"][..], &["driver", "rnu"], &["replai"]] {
        let said = refused(&place, arguments);
        assert!(said.contains("unrecognized subcommand") && !said.contains(TIP), "{said}");
    }
}

/// What a terminal would act on.
fn is_plain(text: &str) -> bool {
    let is_harmful = |c: char| {
        c != '\n' && c.is_control()
            || matches!(c, '\u{200b}'..='\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
    };
    !text.contains(is_harmful)
}

/// Any format will do, and the words do not ask for a certain one.
#[test]
fn an_export_without_a_table_to_write_asks_for_one_of_any_format() {
    let place = workplace();
    with_recordings(&place);
    for recording in ["good.mcap", "good.csv"] {
        let said = refused(&place, &["export", recording]);
        assert_says(&said, &["required", "not provided:\n  <OUT>...\n", "export <RECORDING> <OUT>..."]);
        assert!(!said.contains("--parquet") && !said.contains("--csv"), "{said}");
    }
    let help = place.run(["export", "--help"]).out;
    assert_says(&help, &["OUT.csv", "OUT.parquet", "lift.mcap - | head"]);
}

/// A recording with one more object, of this name.
fn with_object(recording: &str, name: &str) -> String {
    let columns: String = ["x", "y", "z", "qw", "qx", "qy", "qz", "vx", "vy", "vz", "wx", "wy", "wz"]
        .map(|of| format!(",{name}_{of}"))
        .concat();
    let mut lines = recording.lines();
    let header = lines.next().expect("a first line");
    let rows: String = lines.map(|row| format!("{row},0,0,0,1{}\n", ",0".repeat(9))).collect();
    format!("{header}{columns}\n{rows}")
}

#[test]
fn a_recording_whose_names_hold_control_characters_is_refused_with_line_and_column() {
    let place = workplace();
    with_recordings(&place);
    let good = std::fs::read_to_string(place.path("good.csv")).expect("a recording");
    place.write("good2.csv", with_object(&good, "ball"));
    assert_eq!(
        place.run(["export", "good2.csv", "-"]).status,
        Some(0),
        "what is tested below is the name only"
    );
    let row = good.lines().nth(50).expect("a row");
    for (evil, told) in
        [("\u{1b}[2J", "\"\\u{1b}[2J\""), ("\u{9b}31m", "\"\\u{9b}31m\""), ("a\u{202e}b", "\"a\\u{202e}b\"")]
    {
        let damaged = row.replacen(",table,", &format!(",{evil},"), 1);
        assert_ne!(damaged, row, "it touches the table");
        place.write("cell.csv", good.replacen(row, &damaged, 1));
        place.write("object.csv", with_object(&good, evil));
        for command in [
            &["export", "FILE", "-"][..],
            &["export", "FILE", "--csv", "out2.csv"],
            &["replay", "FILE", "--scene", "scene.toml"],
            &["plot", "FILE", "--svg-only"],
        ] {
            let of = |file| {
                command.iter().map(|&word| if word == "FILE" { file } else { word }).collect::<Vec<_>>()
            };
            let said = place.run(of("cell.csv"));
            assert_eq!(said.status, Some(3), "{evil:?} {command:?}: {}{}", said.out, said.err);
            let parts = ["cell.csv:51: column 11 (f0_entity): found", told, "no control characters"];
            assert_says(&said.err, &parts);
            assert!(is_plain(&said.out) && is_plain(&said.err), "{command:?}: {said:?}");
            let said = place.run(of("object.csv"));
            assert_eq!(said.status, Some(2), "{evil:?} {command:?}: {}{}", said.out, said.err);
            let name = told.replace('"', "");
            assert_says(&said.err, &["object.csv", "its column ", &name, "no control characters"]);
        }
    }
}

#[test]
fn foreign_names_never_act_on_the_terminal() {
    const EVIL: &str = "\u{1b}[2J\u{1b}]0;mine\u{7}\u{9b}31m\u{202e}x";
    /// Some seconds.
    const ONE_CASE: [&str; 6] = ["--rates", "1000", "--modes", "same-tick", "--dampings", "0"];
    let place = workplace();
    with_recordings(&place);
    let (csv, scene) = (format!("{EVIL}\nphantom3: all is well.csv"), format!("{EVIL}.toml"));
    place.write("named.toml", format!("name = \"\\u001b[2J\\nphantom3: all is well\\u202e\"\n{SCENE}"));
    place.write(&scene, SCENE.replace("[[finger]]", "[[finger]]\n\"\\u001b[2J\" = 1"));
    let good = std::fs::read_to_string(place.path("good.csv")).expect("a recording");
    place.write(&csv, good.replace("f0_", "\u{1b}[2Jf0_"));
    place.write("broken.csv", good.replace(",none,", ",\u{1b}[2J,"));
    place.write("cell.csv", good.replace(",table,", ",\u{1b}[2J,"));
    place.write("object.csv", with_object(&good, "\u{1b}[2J"));
    place.write("turned.ini", format!("{BALL}Glow=\u{202e}x\n"));
    let hand = format!("{EVIL}-hand.toml");
    place.write(&hand, include_str!("../../../config/hands/models/pen-grip.toml"));
    for arguments in [
        &["check", "named.toml"][..],
        &["check", "named.toml", "--json"],
        &["check", &scene],
        &["check", &scene, "--json"],
        &["run", "named.toml", "--clock", "virtual", "--seconds", "0.01"],
        &["run", &scene],
        &["run", EVIL],
        &["run", "scene.toml", "--hand", &csv],
        &["run", "scene.toml", "--rate-hz", EVIL],
        &["run", "scene.toml", EVIL],
        &["replay", &csv, "--scene", "scene.toml"],
        &["replay", "broken.csv", "--scene", "scene.toml"],
        &["replay", "good.mcap", "--change", &format!("name=\"{EVIL}\"")],
        &["export", &csv, "--csv", &format!("{EVIL}.out.csv")],
        &["plot", &csv],
        &["plot", EVIL],
        &["convert", &csv],
        &["convert", "turned.ini"],
        &["export", "cell.csv", "-"],
        &["export", "object.csv", "-"],
        &["study", "integrators", "--spins", "1", "--seconds", "0.01", "--masses", "1", "--out", EVIL],
        &[&["study", "stiffness", "--hands", &hand, "--out", EVIL], &ONE_CASE[..]].concat(),
        &["study", "stiffness", "--device", EVIL],
    ] {
        let said = place.run(arguments);
        assert!(is_plain(&said.out), "{arguments:?} prints {:?}", said.out);
        assert!(is_plain(&said.err), "{arguments:?} says {:?}", said.err);
        let is_forged =
            said.err.lines().chain(said.out.lines()).any(|line| line.starts_with("phantom3: all is well"));
        assert!(!is_forged, "{arguments:?}: {}{}", said.out, said.err);
    }
    let json = place.run(["check", "named.toml", "--json"]).out;
    assert!(
        json.contains(r"\u001b[2J\nphantom3: all is well\u202e"),
        "what JSON says is what it was: {json}"
    );
}
