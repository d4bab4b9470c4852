//! When rows are, where the finger is in each, and which files say so.

use system_tests::recording::Table;
use system_tests::workplace::{Running, Workplace, felt, hand};

/// A finger that starts at a place of its own, over a table.
const SCENE: &str = "[[finger]]\nstart_m = [0.011, 0.022, -0.033]\n[[entity]]\nname = \"table\"\n\
    shape = { kind = \"plane\", normal = [0.0, 1.0, 0.0], offset_m = 0.0 }\n\
    friction = { model = \"stiction\", mu_s = 0.7, mu_d = 0.3 }\n";

/// The period of a tick is the whole number of nanoseconds nearest to 1 / rate; row k is at k periods.
fn check_times(table: &Table, rate_hz: f64, rows: usize) {
    let period_ns = (1e9 / rate_hz).round();
    assert_eq!(table.len(), rows, "{rate_hz} Hz");
    for (k, t) in table.numbers("t").into_iter().enumerate() {
        // A quotient of two whole numbers below 2^53 is correctly rounded, so this is exact.
        assert_eq!(t, k as f64 * period_ns / 1e9, "row {k} at {rate_hz} Hz");
    }
}

#[test]
fn rows_begin_at_zero_and_come_once_a_period_at_every_rate() {
    // 3000 Hz has no whole period in nanoseconds: 333333 ns it is, 1e-6 of the rate off.
    for (rate_hz, seconds, rows) in [
        (500.0, 1.2, 600),
        (1000.0, 0.75, 750),
        (3000.0, 1.0, 3000),
        (4000.0, 0.5, 2000),
        (10.0, 3.0, 30),
        (20e3, 0.1, 2000),
    ] {
        let arguments = ["--rate-hz", &format!("{rate_hz}"), "--seconds", &format!("{seconds}")];
        check_times(&Workplace::new().play(SCENE, "", &arguments), rate_hz, rows);
    }
}

#[test]
fn forces_and_friction_do_not_depend_on_the_rate() {
    let path = hand([(0.0, [0.0, -0.005, 0.0]), (1.0, [0.0613, -0.005, 0.0])]);
    for rate_hz in ["500", "1000", "3000", "4000"] {
        for s in felt(SCENE, &path, &["--rate-hz", rate_hz]) {
            assert_eq!(s.friction == "slip", s.hip.x > 0.7 * 0.005, "{rate_hz} Hz: {s:?}");
            assert_eq!(s.force.y, 1000.0 * 0.005, "k d: {s:?}");
            if s.friction == "slip" {
                // Nine digits, as at 1 kHz.
                assert!((-s.force.x / s.force.y - 0.3).abs() <= 1e-9, "{rate_hz} Hz: {s:?}");
            }
        }
    }
}

#[test]
fn a_run_lasts_as_long_as_asked_else_as_its_hand_and_at_least_a_second() {
    let until = |end: f64| hand([(0.0, [0.0; 3]), (end, [0.1, 0.0, 0.0])]);
    for (path, arguments, rows) in [
        (until(1.7), vec![], 1700),
        (until(0.3), vec![], 1000),
        (String::new(), vec![], 1000),
        (until(1.7), vec!["--seconds", "0.25"], 250),
        (until(0.3), vec!["--seconds", "2.5"], 2500),
        (until(0.3), vec!["--seconds", "0.001"], 1),
    ] {
        check_times(&Workplace::new().play(SCENE, &path, &arguments), 1000.0, rows);
    }
}

#[test]
fn the_hip_is_at_the_hand_files_rows_to_the_last_bit_and_on_a_line_between_them() {
    let rows = [
        (0.007, [0.1, 0.2, -0.3]),
        (0.013, [1.0 / 3.0, -0.0, 1e-300]),
        (0.5, [-0.123_456_789_012_345_68, 0.1, 0.2]),
        (0.5005, [0.7, 0.8, 0.9]), // falls between two ticks
        (0.9, [0.1 + 0.2, 1e-15, -1e-15]),
    ];
    let samples = felt("[[finger]]\n", &hand(rows), &["--seconds", "1.2"]);
    for s in &samples {
        let after = rows.iter().position(|(t, _)| *t > s.t).unwrap_or(rows.len());
        let here = |row: usize| nalgebra::Vector3::from(rows[row].1);
        let expected = match after {
            0 => here(0),
            _ if after == rows.len() || rows[after - 1].0 == s.t => here(after - 1),
            _ => {
                let ((from_s, _), (to_s, _)) = (rows[after - 1], rows[after]);
                let line = here(after - 1).lerp(&here(after), (s.t - from_s) / (to_s - from_s));
                // Two ways to round a point on a line: a few ulps of the larger end.
                let tolerance_m = 4.0 * f64::EPSILON * here(after - 1).amax().max(here(after).amax());
                assert!((s.hip - line).amax() <= tolerance_m, "{s:?} is not {line:?}");
                continue;
            }
        };
        assert_eq!(s.hip.map(f64::to_bits), expected.map(f64::to_bits), "{s:?}");
    }
    let on_rows = rows.iter().filter(|(t, _)| samples.iter().any(|s| s.t == *t)).count();
    assert_eq!(on_rows, 4, "all but the row between two ticks are met");
}

#[test]
fn hand_files_may_come_from_a_spreadsheet() {
    let text = "\u{feff}t, f0_x ,f0_y,f0_z\r\n0, 1e-2 ,0.5,+0.25\r\n1,0.02,.5,1.\r\n\r\n";
    let samples = felt("[[finger]]\n", text, &[]);
    assert_eq!(samples[0].hip, nalgebra::Vector3::new(0.01, 0.5, 0.25));
    assert_eq!(samples.len(), 1000);
}

#[test]
fn a_finger_without_a_hand_rests_at_its_start() {
    let start = nalgebra::Vector3::new(0.011, 0.022, -0.033);
    assert!(felt(SCENE, "", &[]).iter().all(|s| s.hip == start));
    let two = format!("[[finger]]\nname = \"thumb\"\n{SCENE}");
    let table = Workplace::new().play(&two, "t,thumb_x,thumb_y,thumb_z\n0,1,1,1\n1,2,2,2\n", &[]);
    assert!(table.finger("f1").iter().all(|s| s.hip == start), "the second finger's default name is f1");
    assert_eq!(table.finger("thumb")[500].hip, nalgebra::Vector3::repeat(1.5));
}

#[test]
fn the_scenes_own_hand_is_found_beside_the_scene_and_an_argument_overrides_it() {
    let place = Workplace::new();
    std::fs::create_dir_all(place.path("lab/hands")).expect("directories");
    std::fs::create_dir_all(place.path("elsewhere")).expect("a directory");
    place.write("lab/scene.toml", format!("hand = \"hands/own.csv\"\n{SCENE}"));
    place.write("lab/hands/own.csv", hand([(0.0, [1.0, 1.0, 1.0]), (1.1, [1.0, 1.0, 1.0])]));
    place.write("elsewhere/mine.csv", hand([(0.0, [2.0, 2.0, 2.0]), (1.2, [2.0, 2.0, 2.0])]));
    for (arguments, at, rows) in [(&[][..], 1.0, 1100), (&["--hand", "mine.csv"][..], 2.0, 1200)] {
        // Started elsewhere: the scene's hand is relative to the scene, arguments are relative to us.
        let mut program = place.phantom3();
        program.current_dir(place.path("elsewhere"));
        program
            .args(["run", "../lab/scene.toml", "--clock", "virtual", "--record", "out.csv"])
            .args(arguments);
        let said = Running::start(program).wait();
        assert_eq!((said.status, said.err.as_str()), (Some(0), ""));
        let samples = Table::read(&place.path("elsewhere/out.csv")).finger("f0");
        assert!(samples.iter().all(|s| s.hip == nalgebra::Vector3::repeat(at)));
        assert_eq!(samples.len(), rows);
    }
}

/// Two fingers over the default scene, which slide and stick on a ball and a table.
const DEFAULT_SCENE: &str = include_str!("../../../config/scenes/default.toml");
const DEFAULT_HAND: &str = include_str!("../../../config/hands/default.csv");

fn play_default(layout: &str) -> (Table, Vec<u8>) {
    let place = Workplace::new();
    place.write("layout.toml", layout);
    let scene = DEFAULT_SCENE.replace("hand =", "# hand =");
    let arguments: &[&str] = if layout.is_empty() { &[] } else { &["--layout", "layout.toml"] };
    let table = place.play(&scene, DEFAULT_HAND, arguments);
    (table, std::fs::read(place.path("out.csv")).expect("the recording"))
}

#[test]
fn a_layout_of_devices_at_the_origin_changes_not_one_bit() {
    let identity =
        "[[device]]\n[[device]]\nposition_m = [0.0, 0.0, 0.0]\norientation_wxyz = [1.0, 0.0, 0.0, 0.0]\n";
    assert!(play_default("").1 == play_default(identity).1, "the recordings differ");
}

#[test]
fn where_the_devices_stand_changes_nothing_in_the_world() {
    let turned = "[[device]]\nposition_m = [-0.4, 0.3, 0.1]\norientation_wxyz = [0.8, 0.0, 0.6, 0.0]\n\
        [[device]]\nposition_m = [0.2, 0.0, -0.7]\norientation_wxyz = [0.5, -0.5, 0.5, 0.5]\n";
    let (plain, moved) = (play_default("").0, play_default(turned).0);
    for finger in ["f0", "f1"] {
        for (a, b) in plain.finger(finger).iter().zip(moved.finger(finger)) {
            // World to device and back: some twenty products and sums of lengths below 1 m each way.
            let place_m = 64.0 * f64::EPSILON;
            // The ball gives 800 and the table 1000 N/m, and a slide ends within 1e-12 of the load (6 N).
            let force_n = 1000.0 * place_m + 1e-9;
            assert!(
                (a.hip - b.hip).amax() <= place_m && (a.god - b.god).amax() <= place_m + 1e-12,
                "{a:?}\n{b:?}"
            );
            assert!((a.force - b.force).amax() <= force_n, "{a:?}\n{b:?}");
            assert!((b.applied - b.force).amax() <= force_n, "through the device's frame and back: {b:?}");
            let words = |s: &system_tests::recording::Sample| {
                (s.entity.clone(), s.feature.clone(), s.friction.clone())
            };
            assert_eq!(words(a), words(&b), "{a:?}\n{b:?}");
        }
    }
}
