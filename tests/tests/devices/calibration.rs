//! `phantom3 calibrate`, through files, real processes and the runs that use what it wrote.

#![allow(non_snake_case)] // Frames are capital letters: X_WF takes F to W.

use nalgebra::{Isometry3, Matrix3, Point3, Quaternion, Translation3, UnitQuaternion};
use patience::prelude::*;
use rustix::process::{Pid, Signal, kill_process};
use std::fmt::Write as _;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};
use system_tests::driver::{Driver, HANG};
use system_tests::recording::Table;
use system_tests::workplace::{Running, Said, Workplace};
use world::Layout;

/// Coordinates below 1 m, in which some 300 pairs with a condition below 10 round: see `calibration`'s own tests.
const ROUNDING: f64 = 4e-12;

fn quaternion(wxyz: [f64; 4]) -> UnitQuaternion<f64> {
    let [w, x, y, z] = wxyz;
    UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z))
}

/// Where the fiducial and the other device really stand.
fn truth() -> [Isometry3<f64>; 2] {
    [
        Isometry3::from_parts(Translation3::new(-0.15, 0.02, -0.3), quaternion([0.9, 0.1, 0.4, 0.0])),
        Isometry3::from_parts(Translation3::new(0.25, 0.0, 0.1), quaternion([0.5, 0.1, -0.8, 0.2])),
    ]
}

fn entry(pose: &Isometry3<f64>, prefix: &str) -> String {
    let (t, q) = (pose.translation.vector, pose.rotation);
    format!(
        "{prefix}position_m = [{:?}, {:?}, {:?}]\n{prefix}orientation_wxyz = [{:?}, {:?}, {:?}, {:?}]\n",
        t.x, t.y, t.z, q.w, q.i, q.j, q.k
    )
}

/// Points of the world on a curve through a box of 120 mm, as both devices measure them.
fn pairs_csv(count: usize, stretch: &Matrix3<f64>) -> String {
    let [X_WF, X_WN] = truth();
    let mut text = String::new();
    for i in 0..count {
        let p_W = place(i as f64 * 0.02);
        let f = X_WF.inverse() * p_W;
        let n = stretch * (X_WN.inverse() * p_W).coords;
        let _ = writeln!(text, "{:?},{:?},{:?},{:?},{:?},{:?}", f.x, f.y, f.z, n.x, n.y, n.z);
    }
    text
}

fn place(t: f64) -> Point3<f64> {
    Point3::new(0.06 * (5.0 * t).sin(), 0.05 + 0.06 * (3.1 * t).sin(), 0.06 * (4.3 * t + 1.0).sin())
}

#[track_caller]
fn assert_stands(layout: &Layout, device: usize, truth: &Isometry3<f64>) {
    let placed = layout.placement(device);
    let turned = (placed.matrix() - truth.rotation.to_rotation_matrix().matrix()).amax();
    let moved = (placed.position_m() - truth.translation.vector).amax();
    assert!(turned < ROUNDING && moved < ROUNDING, "{turned} {moved} {placed:?}");
}

#[track_caller]
fn done(said: &Said) {
    assert_eq!(said.status, Some(0), "{said:?}");
}

fn parse(text: &str) -> Layout {
    Layout::parse(text, Path::new("l.toml")).expect("a layout")
}

#[test]
fn a_layout_on_standard_output_places_the_device_where_it_stands() {
    let place = Workplace::new();
    place.write("pairs.csv", pairs_csv(300, &Matrix3::identity()));
    place.write("in.toml", format!("[[device]]\n{}", entry(&truth()[0], "")));
    let said = place.run(["calibrate", "--pairs", "pairs.csv", "--layout", "in.toml", "--plot", "r.svg"]);
    done(&said);
    let layout = parse(&said.out);
    assert_stands(&layout, 0, &truth()[0]);
    assert_stands(&layout, 1, &truth()[1]);
    for line in [
        "fit          rigid, device 1 against device 0, 300 pairs of pairs.csv",
        "residual ",
        "accuracy ",
        "outliers     none",
    ] {
        assert!(said.err.lines().any(|said| said.starts_with(line)), "{line}: {}", said.err);
    }
    let figure = std::fs::read_to_string(place.path("r.svg")).expect("a figure");
    assert!(figure.starts_with("<svg") || figure.starts_with("<?xml"), "{figure:.40}");
    assert!(!place.path("layout.toml").exists());
}

#[test]
fn few_pairs_are_fitted_with_a_warning_and_enough_without() {
    let place = Workplace::new();
    place.write("in.toml", format!("[[device]]\n{}", entry(&truth()[0], "")));
    let calibrated = |count: usize| {
        place.write("pairs.csv", pairs_csv(count, &Matrix3::identity()));
        let said = place.run(["calibrate", "--pairs", "pairs.csv", "--layout", "in.toml"]);
        done(&said);
        said.err
    };
    let few = calibrated(3);
    assert!(few.contains("WARNING      3 pairs are few: the noise is known to 41 % only"), "{few}");
    assert!(few.contains("3 degrees of freedom") && few.contains("gather 8 or more"), "{few}");
    let enough = calibrated(8);
    assert!(!enough.contains("WARNING") && enough.contains("18 degrees of freedom"), "{enough}");
}

#[test]
fn a_written_layout_keeps_comments_and_the_other_devices() {
    let place = Workplace::new();
    place.write("pairs.csv", pairs_csv(300, &Matrix3::identity()));
    let fiducial = entry(&truth()[0], "");
    let before = format!(
        "# the lab's desk, since May\n[[device]]   # thumb\n{fiducial}\n[[device]]  # index\nposition_m = [9.0, 0.0, 0.0]\n\
         matrix = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]\n\n# do not touch\n[[device]]\nposition_m = [0.0, 0.0, 0.3]  # middle\n"
    );
    let file = place.write("layout.toml", before);
    let link = place.path("link.toml");
    std::os::unix::fs::symlink(&file, &link).expect("a link");
    let said = place.run(["calibrate", "--pairs", "pairs.csv", "--write", "link.toml"]);
    done(&said);
    assert_eq!(said.out, "");
    let text = std::fs::read_to_string(&file).expect("still there");
    assert!(link.is_symlink());
    for kept in [
        "# the lab's desk, since May\n[[device]]   # thumb\n",
        "[[device]]  # index\n",
        "# do not touch\n[[device]]\nposition_m = [0.0, 0.0, 0.3]  # middle\n",
        "# calibrated against device 0: rigid, 300 pairs",
    ] {
        assert!(text.contains(kept), "{kept}:\n{text}");
    }
    assert!(!text.contains("matrix"), "a rigid placement has none:\n{text}");
    let layout = parse(&text);
    assert_stands(&layout, 0, &truth()[0]);
    assert_stands(&layout, 1, &truth()[1]);
    assert_eq!(layout.pose(2).translation.vector.z, 0.3);
    // Once more, over its own work.
    done(&place.run(["calibrate", "--pairs", "pairs.csv", "--write", "layout.toml"]));
    assert_eq!(std::fs::read_to_string(&file).expect("there"), text);
    assert_eq!(place.snapshot().len(), 3, "nothing else lies about: {:?}", place.snapshot().keys());
}

#[test]
fn a_layout_with_master_and_camera_gets_an_entry_relative_to_the_master() {
    let place = Workplace::new();
    place.write("pairs.csv", pairs_csv(300, &Matrix3::identity()));
    let [X_WF, X_WN] = truth();
    let camera = Isometry3::from_parts(Translation3::new(0.0, 0.4, 0.8), quaternion([0.9, -0.3, 0.1, 0.0]));
    let head = format!(
        "master = 0\nattached_to = \"camera\"\n\n[camera]\n{}\n[[device]]\n{}",
        entry(&camera, ""),
        entry(&(camera.inverse() * X_WF), "")
    );
    place.write("desk.toml", head);
    done(&place.run(["calibrate", "--pairs", "pairs.csv", "--write", "desk.toml"]));
    let layout = Layout::load(place.path("desk.toml")).expect("in order");
    assert_stands(&layout, 0, &X_WF);
    assert_stands(&layout, 1, &X_WN);
    let said = place.run([
        "calibrate",
        "--pairs",
        "pairs.csv",
        "--write",
        "desk.toml",
        "--device",
        "0",
        "--fiducial",
        "1",
    ]);
    assert_eq!(said.status, Some(2));
    assert!(said.err.contains("device 0 is the layout's master"), "{}", said.err);
}

#[test]
fn an_affine_calibration_finds_the_stretch_and_a_run_uses_it() {
    let place = Workplace::new();
    // The other device's own idea of its links is off by a few percent.
    let stretch = Matrix3::new(1.03, 0.0, 0.01, 0.0, 0.97, 0.0, 0.02, 0.0, 1.0);
    place.write("pairs.csv", pairs_csv(300, &stretch));
    place.write("in.toml", format!("[[device]]\n{}", entry(&truth()[0], "")));
    let arguments =
        ["calibrate", "--pairs", "pairs.csv", "--layout", "in.toml", "--affine", "--write", "out.toml"];
    let said = place.run(arguments.iter().chain(&["--json"]));
    done(&said);
    let json: serde_json::Value = serde_json::from_str(&said.out).expect("JSON");
    assert_eq!(json["written_to"].as_str(), Some("out.toml"));
    // A name that a terminal would act on is the same in JSON, and does not reach it.
    const EVIL: &str = "\u{9b}31m\u{202e}.toml";
    let said = place.run(["calibrate", "--pairs", "pairs.csv", "--affine", "--json", "--write", EVIL]);
    done(&said);
    let written: serde_json::Value = serde_json::from_str(&said.out).expect("JSON");
    assert_eq!(written["written_to"].as_str(), Some(EVIL));
    assert!(!said.out.contains(['\u{9b}', '\u{202e}']), "{:?}", said.out);
    assert_eq!((json["model"].as_str(), json["pairs"].as_u64()), (Some("affine"), Some(300)));
    assert!(json["residual_rms_m"].as_f64().is_some_and(|rms| rms < ROUNDING), "{json}");
    let placed = Layout::load(place.path("out.toml")).expect("in order").placement(1);
    let wanted = truth()[1].rotation.to_rotation_matrix().matrix() * stretch.try_inverse().expect("mild");
    assert!((placed.matrix() - wanted).amax() < ROUNDING, "{placed:?}");
    // Ideal devices follow a script of the world: there is nothing to correct.
    place.write("free.toml", SCENE);
    let said = place.run(["run", "free.toml", "--clock", "virtual", "--layout", "out.toml"]);
    assert_eq!(said.status, Some(2));
    assert!(said.err.contains("device 1 has a matrix"), "{}", said.err);
}

#[test]
fn outliers_are_reported_and_left_out_on_request() {
    let place = Workplace::new();
    let spoilt = |line: &str| {
        let (x, rest) = line.split_once(',').expect("six columns");
        format!("{:?},{rest}", x.parse::<f64>().expect("a number") + 0.03)
    };
    let text = pairs_csv(100, &Matrix3::identity());
    let lines = text.lines().enumerate();
    let lines: Vec<String> =
        lines.map(|(i, line)| if i % 10 == 6 { spoilt(line) } else { line.into() }).collect();
    place.write("pairs.csv", format!("xf yf zf xn yn zn\n{}", lines.join("\n")));
    let with = place.run(["calibrate", "--pairs", "pairs.csv"]);
    done(&with);
    // The header is line 1, so row 6 is line 8.
    assert!(
        with.err.contains("outliers     10 further than") && with.err.contains("on lines 8 (30.0"),
        "{}",
        with.err
    );
    assert!(with.err.contains("--reject-outliers leaves them out"), "{}", with.err);
    let X_FN = truth()[0].inverse() * truth()[1];
    let off = (parse(&with.out).pose(1).translation.vector - X_FN.translation.vector).norm();
    assert!(off > 1e-4, "ten of a hundred pairs at 30 mm pull: {off}");
    let without = place.run(["calibrate", "--pairs", "pairs.csv", "--reject-outliers"]);
    done(&without);
    assert_stands(&parse(&without.out), 1, &X_FN);
}

#[test]
fn bad_input_ends_with_status_2_and_says_what_to_do() {
    let place = Workplace::new();
    place.write("pairs.csv", pairs_csv(300, &Matrix3::identity()));
    place.write("short.csv", "1 2 3\n");
    place.write("utf16.csv", b"\xff\xfe1\0,\0");
    place.write("few.csv", pairs_csv(2, &Matrix3::identity()));
    place.write("mm.csv", pairs_csv(100, &(Matrix3::identity() * 1000.0)));
    place.write("cm.csv", pairs_csv(100, &(Matrix3::identity() * 100.0)));
    place.write("near.csv", pairs_csv(100, &(Matrix3::identity() * 0.05)));
    place.write("packed.csv", b"\x1f\x8b\x08\0");
    place.write("mac.csv", pairs_csv(100, &Matrix3::identity()).replace('\n', "\r"));
    place.write(
        "line.csv",
        (0..50).map(|i| format!("{i} 0 0 0 {i} 0\n").replace(' ', "e-2 ")).collect::<String>(),
    );
    let far = "9e-1 0 0 -4e0 0 0\n";
    place.write("spoilt.csv", pairs_csv(100, &Matrix3::identity()) + far);
    place.write("bad.toml", "[[device]]\nwobble = 1\n");
    place.write("a.toml", "[[device]]\n");
    place.write("b.toml", "[[device]]\n");
    let cases: [(&[&str], &[&str]); 26] = [
        (
            &["--pairs", "utf16.csv"],
            &["utf16.csv: cannot be read: it is UTF-16 text; save the file as UTF-8"],
        ),
        (&[], &["--pairs", "--live"]),
        (&["--pairs", "none.csv"], &["none.csv: cannot be read"]),
        (&["--pairs", "."], &[".: cannot be read"]),
        (&["--pairs", "short.csv"], &["short.csv: line 1: found 3 cells; allowed: 6"]),
        (&["--pairs", "few.csv"], &["few.csv: found 2 pairs", "at least 3"]),
        (
            &["--pairs", "mm.csv"],
            &["mm.csv: the points of the other device", "millimetres", "divide them by 1000"],
        ),
        (
            &["--pairs", "cm.csv"],
            &["cm.csv: the points of the other device", "centimetres", "divide them by 100\n"],
        ),
        (
            &["--pairs", "near.csv"],
            &["near.csv: the points of the fiducial lie 20.", "divide centimetres by 100"],
        ),
        (&["--pairs", "packed.csv"], &["packed.csv: cannot be read: it is compressed by gzip", "gunzip"]),
        (&["--pairs", "mac.csv"], &["mac.csv: cannot be read: its lines end in carriage returns alone"]),
        (&["--pairs", "pairs.csv", "--write", "-"], &["--write -: found `-`, allowed: a file"]),
        (&["--pairs", "pairs.csv", "--plot", "-"], &["-: found another ending"]),
        (
            &["--pairs", "spoilt.csv"],
            &["spoilt.csv: ", "found: 1, the first on line 101", "--reject-outliers"],
        ),
        (&["--pairs", "pairs.csv", "--write", "."], &["--write .: found something else than a file"]),
        (&["--pairs", "line.csv"], &["line.csv: the points lie on a line", "all three directions"]),
        (&["--pairs", "pairs.csv", "--device", "8"], &["found 8, allowed: a device's index, 0 to 7"]),
        (&["--pairs", "pairs.csv", "--device", "0"], &["--device 0 and --fiducial 0"]),
        (&["--pairs", "pairs.csv", "--plot", "r.pdf"], &["r.pdf", "allowed: .svg or .png"]),
        (&["--pairs", "pairs.csv", "--layout", "bad.toml"], &["bad.toml:2", "unknown key"]),
        (&["--pairs", "pairs.csv", "--write", "bad.toml"], &["bad.toml:2", "unknown key"]),
        (&["--pairs", "pairs.csv", "--write", "pairs.csv"], &["--pairs and --write name the same file"]),
        (
            &["--pairs", "pairs.csv", "--layout", "a.toml", "--write", "b.toml"],
            &["would replace that layout"],
        ),
        (&["--pairs", "pairs.csv", "--seconds", "3"], &["--seconds"]),
        (&["--live", "none.sock"], &["no driver is running"]),
        (&["--live", "none.sock", "--seconds", "0"], &["allowed: 0.1 to 3600 seconds"]),
    ];
    let before = place.snapshot();
    for (arguments, parts) in cases {
        let said = place.run([&["calibrate"], arguments].concat());
        assert_eq!((said.status, said.out.as_str()), (Some(2), ""), "{arguments:?}: {said:?}");
        for part in parts {
            assert!(said.err.contains(part), "{arguments:?}: {part}:\n{}", said.err);
        }
    }
    assert_eq!(place.snapshot(), before, "nothing was written");
}

const SCENE: &str = "[[finger]]\nstart_m = [0.0, 0.05, 0.0]\n[[finger]]\nstart_m = [0.0, 0.05, 0.0]\n";

/// A driver whose two ideal devices are moved along one path of the world, seen from two bases.
fn driver(place: &Workplace) -> Driver {
    let mut hand = String::from("t,f0_x,f0_y,f0_z\n");
    for i in 0..6000 {
        let t = f64::from(i) * 0.005;
        let p = self::place(t);
        let _ = writeln!(hand, "{t:?},{:?},{:?},{:?}", p.x, p.y, p.z);
    }
    let hand = place.write("hand.csv", hand);
    let mut config = String::from("clock = \"real\"\n[real_time]\npriority = 0\nlock_memory = false\n");
    for (index, base) in truth().iter().enumerate() {
        let _ = write!(
            config,
            "[[device]]\nname = \"arm{index}\"\nbackend = \"ideal\"\nfinger = \"f0\"\nhand = \"{}\"\n{}",
            hand.display(),
            entry(base, "base_")
        );
    }
    place.write("free.toml", SCENE);
    Driver::start(&config)
}

/// The ideal hand plays while somebody commands.
fn commander(place: &Workplace, driver: &Driver) -> Running {
    let mut command = place.phantom3();
    command.args(["run", "free.toml", "--seconds", "3000", "--attach"]).arg(driver.socket());
    Running::start(command)
}

fn signal(running: &Running, signal: Signal) {
    let pid = Pid::from_raw(running.child.id().cast_signed()).expect("a process");
    kill_process(pid, signal).expect("our own child");
}

fn live(place: &Workplace, driver: &Driver, arguments: &[&str]) -> Command {
    let mut command = place.phantom3();
    command.arg("calibrate").arg("--live").arg(driver.socket()).args(arguments);
    command.env("XDG_CONFIG_HOME", place.path("config"));
    command
}

/// Records both fingers while attached.
fn record(place: &Workplace, driver: &Driver, layout: &[&str]) -> (Table, Said) {
    let mut command = place.phantom3();
    command.args(["run", "free.toml", "--seconds", "1", "--record", "out.csv"]).args(layout);
    command.arg("--attach").arg(driver.socket()).env("XDG_CONFIG_HOME", place.path("config"));
    let said = Running::start(command).wait();
    done(&said);
    (Table::read(&place.path("out.csv")), said)
}

#[test]
fn a_live_calibration_makes_two_devices_meet_in_one_world() {
    let place = Workplace::new();
    let driver = driver(&place);
    let commander = commander(&place, &driver);
    place.write("in.toml", format!("[[device]]\n{}", entry(&truth()[0], "")));
    std::fs::create_dir_all(place.path("config/phantom3")).expect("a directory");
    std::fs::copy(place.path("in.toml"), place.path("config/phantom3/layout.toml")).expect("a copy");
    let gathering = Running::start(live(&place, &driver, &["--save-pairs", "pairs.csv", "--write"]));
    patience::until("it gathers", || gathering.said_so_far().contains("pairs"));
    // Somebody edits the layout meanwhile.
    let edited = std::fs::read_to_string(place.path("config/phantom3/layout.toml")).expect("there");
    place.write("config/phantom3/layout.toml", format!("# mine\n{edited}"));
    let said = gathering.wait();
    done(&said);
    let written = std::fs::read_to_string(place.path("config/phantom3/layout.toml")).expect("there");
    assert!(written.starts_with("# mine\n"), "{written}");
    for words in ["hold the end points of arm0 and arm1 together", "somebody commands", "move"] {
        assert!(said.err.contains(words), "{words}: {}", said.err);
    }
    let layout = Layout::load(place.path("config/phantom3/layout.toml")).expect("written");
    assert_stands(&layout, 0, &truth()[0]);
    assert_stands(&layout, 1, &truth()[1]);
    let pairs = std::fs::read_to_string(place.path("pairs.csv")).expect("kept");
    assert!(pairs.lines().count() > 200, "{}", pairs.lines().count());
    // The kept pairs give the same again.
    let again = place.run(["calibrate", "--pairs", "pairs.csv", "--layout", "in.toml"]);
    done(&again);
    assert_eq!(parse(&again.out).placement(1), layout.placement(1));

    // Pairs that cannot be saved and a layout that somebody spoils cost nothing else.
    std::fs::create_dir(place.path("gone")).expect("a directory");
    std::fs::copy(place.path("in.toml"), place.path("out.toml")).expect("a copy");
    let arguments = ["--seconds", "4", "--save-pairs", "gone/pairs.csv", "--write", "out.toml"];
    let gathering = Running::start(live(&place, &driver, &arguments));
    patience::until("it gathers", || gathering.said_so_far().contains("pairs"));
    std::fs::remove_dir_all(place.path("gone")).expect("our own");
    place.write("out.toml", "[[device]\n");
    let unsaved = gathering.wait();
    assert_eq!(unsaved.status, Some(3), "{unsaved:?}");
    for words in ["pairs.csv: cannot be written", "out.toml:1", "all else is done"] {
        assert!(unsaved.err.contains(words), "{words}: {}", unsaved.err);
    }
    assert_eq!(std::fs::read_to_string(place.path("out.toml")).expect("there"), "[[device]\n");
    assert_stands(&parse(&unsaved.out), 1, &truth()[1]);

    signal(&commander, Signal::INT);
    commander.wait();
    let gap = |(table, _): &(Table, Said)| {
        let gaps: Vec<f64> = table
            .vectors("f0_hip")
            .iter()
            .zip(table.vectors("f1_hip"))
            .map(|(a, b)| (a - b).norm())
            .collect();
        assert!(gaps.len() > 100, "{} rows", gaps.len());
        gaps.into_iter().fold(0.0, f64::max)
    };
    let found = record(&place, &driver, &[]);
    assert!(
        found.1.err.contains("the devices stand as") && found.1.err.contains("config/phantom3/layout.toml"),
        "{}",
        found.1.err
    );
    // Both errors, seen at up to 0.5 m from the bases.
    assert!(gap(&found) < 4.0 * ROUNDING, "{}", gap(&found));
    // And it was the layout that did it.
    assert!(gap(&record(&place, &driver, &["--layout", "in.toml"])) > 0.1);
}

/// Both halves in one unit agree, so that only their size can tell.
#[test]
fn points_further_apart_than_those_of_desktop_devices_are_fitted_with_a_warning() {
    let place = Workplace::new();
    let text = pairs_csv(300, &Matrix3::identity());
    let scaled = |line: &str| {
        let numbers = line.split(',').map(|cell| cell.parse::<f64>().expect("a number") * 10.0);
        numbers.map(|number| number.to_string()).collect::<Vec<_>>().join(",") + "\n"
    };
    place.write("near.csv", &text);
    place.write("far.csv", text.lines().map(scaled).collect::<String>());
    for (file, warns) in [("near.csv", false), ("far.csv", true)] {
        let said = place.run(["calibrate", "--pairs", file, "--json"]);
        done(&said);
        let words = "if these are centimetres, divide them by 100";
        assert_eq!(said.err.contains(words), warns, "{}", said.err);
        assert_eq!(said.out.contains(words), warns, "{}", said.out);
    }
}

#[test]
fn a_layout_that_cannot_be_written_is_not_lost() {
    let place = Workplace::new();
    place.write("pairs.csv", pairs_csv(300, &Matrix3::identity()));
    // Below a file there is no directory.
    let said = place.run(["calibrate", "--pairs", "pairs.csv", "--write", "pairs.csv/layout.toml"]);
    assert_eq!(said.status, Some(3), "{said:?}");
    assert!(said.err.contains("pairs.csv/layout.toml: cannot be written"), "{}", said.err);
    assert_stands(&parse(&said.out), 1, &(truth()[0].inverse() * truth()[1]));
}

#[test]
fn a_layout_that_did_not_fit_onto_the_disk_is_no_success() {
    let place = Workplace::new();
    place.write("pairs.csv", pairs_csv(300, &Matrix3::identity()));
    let full = std::fs::File::options().write(true).open("/dev/full").expect("every Linux has one");
    let mut program = place.phantom3();
    let said = program
        .args(["calibrate", "--pairs", "pairs.csv"])
        .stdout(full)
        .stderr(Stdio::piped())
        .spawn()
        .expect("it runs")
        .bounded_output();
    let err = String::from_utf8_lossy(&said.stderr);
    assert_eq!(said.status.code(), Some(3), "{err}");
    assert!(err.contains("standard output: cannot be written: No space left"), "{err}");
    assert!(err.contains("make room on that disk"), "{err}");
}

#[test]
fn a_run_of_scripted_fingers_never_reads_the_calibrated_layout() {
    let place = Workplace::new();
    place.write("free.toml", SCENE);
    std::fs::create_dir_all(place.path("config/phantom3")).expect("a directory");
    place.write("config/phantom3/layout.toml", "this is no layout");
    let mut command = place.phantom3();
    command.args(["run", "free.toml", "--clock", "virtual"]).env("XDG_CONFIG_HOME", place.path("config"));
    let said = Running::start(command).wait();
    assert_eq!((said.status, said.err.as_str()), (Some(0), ""));
    // One that attaches reads it, and says what is wrong with it.
    let mut command = place.phantom3();
    command.args(["run", "free.toml", "--attach"]).env("XDG_CONFIG_HOME", place.path("config"));
    let said = Running::start(command).wait();
    assert_eq!(said.status, Some(2));
    assert!(said.err.contains("layout.toml:1"), "{}", said.err);
}

#[test]
fn devices_that_nobody_moves_or_that_are_not_there_are_refused() {
    let place = Workplace::new();
    let driver = driver(&place);
    // Without a commander the script does not play: the tips rest.
    for (arguments, words) in [
        (&["--seconds", "0.5"][..], "found 1 pair; a rigid transform needs at least 3"),
        (&["--device", "5"], "the driver has no device 5; it has 0 (arm0), 1 (arm1)"),
    ] {
        let said = Running::start(live(&place, &driver, arguments)).wait();
        assert_eq!((said.status, said.out.as_str()), (Some(2), ""), "{said:?}");
        assert!(said.err.contains(words), "{words}: {}", said.err);
    }
    // What is there stays: of another kind for good, pairs for lack of others.
    let pairs = "fiducial_x_m,fiducial_y_m,fiducial_z_m,other_x_m,other_y_m,other_z_m\n0,0,0,1,1,1\n";
    for (file, text, words) in [
        ("table.csv", "tick,t\n1,0.001\n", "found a file that holds no pairs"),
        ("pairs.csv", pairs, "found 1 pair"),
    ] {
        place.write(file, text);
        let arguments = ["--seconds", "0.5", "--save-pairs", file];
        let said = Running::start(live(&place, &driver, &arguments)).wait();
        assert!(said.status == Some(2) && said.err.contains(words), "{said:?}");
        assert_eq!(std::fs::read_to_string(place.path(file)).expect("there"), text);
    }
}

#[test]
fn ticks_with_force_are_left_out_and_nothing_but_force_is_refused() {
    let place = Workplace::new();
    let driver = driver(&place);
    // The whole path lies deep in a soft table.
    let table = "[[entity]]\nname = \"table\"\nstiffness_n_per_m = 10.0\n\
        shape = { kind = \"plane\", normal = [0.0, 1.0, 0.0], offset_m = 0.3 }\n";
    place.write("free.toml", format!("{SCENE}{table}"));
    let commander = commander(&place, &driver);
    let observer = driver.observe();
    let begun = Instant::now();
    let is_pressed =
        |frame: shm_abi::Frame| frame.devices[0].force_on_user_n_applied.iter().any(|f| f.abs() > 0.1);
    while !observer.driver.read_latest().is_some_and(is_pressed) {
        assert!(begun.elapsed() < HANG, "no force");
        std::thread::sleep(Duration::from_millis(5));
    }
    let missed = || observer.driver.counters.replies_missed.load(Ordering::Relaxed);
    // Where the commander is late for some ticks, the force goes, and what is measured then may be kept.
    // Each attempt has a file of its own: pairs that are there stay where there are no others.
    let undisturbed = ["1.csv", "2.csv", "3.csv", "4.csv", "5.csv"].into_iter().find_map(|pairs| {
        let before = missed();
        let live = live(&place, &driver, &["--seconds", "1", "--save-pairs", pairs]);
        let said = Running::start(live).wait();
        (missed() == before).then_some((said, pairs))
    });
    if let Some((said, pairs)) = undisturbed {
        assert_eq!(said.status, Some(2), "{said:?}");
        assert!(!place.path(pairs).exists(), "none was kept");
        assert!(said.err.contains("a device rendered force in every tick"), "{}", said.err);
    } else {
        println!("skipped: the machine is too busy for a second without a reply missed");
    }
    signal(&commander, Signal::INT);
    commander.wait();
}

/// Waits until its first line of progress tells of the pair that resting tips are.
fn gathers(gathering: &Running) {
    let begun = Instant::now();
    while !gathering.said_so_far().contains("1 pairs") {
        assert!(begun.elapsed() < HANG, "{}", gathering.said_so_far());
        std::thread::sleep(Duration::from_millis(5));
    }
}

#[test]
fn ctrl_c_ends_the_gathering_with_what_there_is() {
    let place = Workplace::new();
    let driver = driver(&place);
    let gathering =
        Running::start(live(&place, &driver, &["--seconds", "3000", "--save-pairs", "pairs.csv"]));
    gathers(&gathering);
    signal(&gathering, Signal::INT);
    let said = gathering.wait();
    // The tips rest, so one pair is what there is.
    assert_eq!(said.status, Some(2), "{said:?}");
    assert!(said.err.contains("found 1 pair"), "{}", said.err);
    let pairs = std::fs::read_to_string(place.path("pairs.csv")).expect("kept all the same");
    assert_eq!(pairs.lines().count(), 2);
}

#[test]
fn a_driver_that_ends_meanwhile_is_a_fault_and_the_pairs_are_kept() {
    let place = Workplace::new();
    let mut driver = driver(&place);
    let gathering =
        Running::start(live(&place, &driver, &["--seconds", "3000", "--save-pairs", "pairs.csv"]));
    gathers(&gathering);
    driver.child.kill().expect("our own child");
    driver.wait();
    let said = gathering.wait();
    assert_eq!(said.status, Some(3), "{said:?}");
    assert!(said.err.contains("the driver has ended"), "{}", said.err);
    assert!(place.path("pairs.csv").exists());
}

/// Whoever holds two arms together wants to know within a second or so that nothing is gathered.
#[test]
fn a_driver_that_stands_still_is_told_soon_and_ends_as_before() {
    let place = Workplace::new();
    let driver = driver(&place);
    let pid = Pid::from_child(&driver.child);
    // While it is gathered, and while it is asked.
    let gathering = Running::start(live(&place, &driver, &["--seconds", "3000"]));
    gathers(&gathering);
    kill_process(pid, Signal::STOP).expect("our own child");
    let soon = |gathering: &Running, words: &str| {
        let begun = Instant::now();
        patience::until("it is told", || gathering.said_so_far().contains(words));
        // It is looked on for 5 s, and asked for 2 s.
        assert!(begun.elapsed() < Duration::from_millis(1900), "{:?}", begun.elapsed());
    };
    soon(&gathering, "the driver has told nothing for 500 ms; it may be stopped (see `ps`), looking on");
    let said = gathering.wait();
    assert_eq!(said.status, Some(3), "{said:?}");
    assert!(said.err.contains("the driver has told nothing for 5 s"), "{}", said.err);
    let asking = Running::start(live(&place, &driver, &["--seconds", "3000"]));
    soon(&asking, "the driver has not answered yet; it may be stopped");
    let said = asking.wait();
    assert_eq!(said.status, Some(2), "{said:?}");
    assert!(said.err.contains("does not answer within 2 s"), "{}", said.err);
    kill_process(pid, Signal::CONT).expect("our own child");
}
