//! Fields, guides, magnetism and vibration, felt through scene file, hand file and recording alone.

use nalgebra::Vector3;
use std::f64::consts::TAU;
use system_tests::recording::{Sample, Table};
use system_tests::workplace::{Workplace, hand};

/// The rows of `f0`; what was computed is what an ideal device rendered.
fn felt(scene: &str, hand: &str, arguments: &[&str]) -> Vec<Sample> {
    let samples = Workplace::new().play(scene, hand, arguments).finger("f0");
    assert!(!samples.is_empty());
    samples.iter().for_each(|s| assert_eq!(s.applied, s.force, "{s:?}"));
    samples
}

/// What a scene is refused with.
fn refused(scene: &str, arguments: &[&str]) -> String {
    let place = Workplace::new();
    place.write("scene.toml", scene);
    let said = place.run(["run", "scene.toml", "--clock", "virtual"].iter().chain(arguments));
    assert_eq!((said.status, said.out.as_str()), (Some(2), ""), "{}", said.err);
    assert_eq!(said.err.lines().count(), 1, "{}", said.err);
    said.err
}

/// From a place to another in a second.
fn stroke(from: [f64; 3], to: [f64; 3]) -> String {
    hand([(0.0, from), (1.0, to)])
}

fn rest(at: [f64; 3]) -> String {
    hand([(0.0, at)])
}

/// Differences of positions of up to 0.2 m over 1 ms, times 5 N s/m.
const BY_DIFFERENCE_N: f64 = 1e-12;

#[test]
fn a_viscous_field_slows_by_its_damping_along_each_of_its_axes() {
    // Turned by 90 degrees about z: what is 4 along x acts along y.
    let scene = "[[finger]]\n[[field]]\nkind = \"viscous\"\ndamping_n_s_per_m = [4.0, 1.0, 0.0]\n\
                 orientation_wxyz = [0.7071067811865476, 0.0, 0.0, 0.7071067811865476]\n";
    let samples = felt(scene, &stroke([0.0, 0.0, 0.0], [0.1, 0.2, 0.05]), &[]);
    let expected = Vector3::new(-0.1 * 1.0, -0.2 * 4.0, 0.0);
    for s in &samples[2..1000] {
        assert!((s.force - expected).norm() < BY_DIFFERENCE_N, "{s:?}");
        assert_eq!((s.friction.as_str(), s.god), ("free", s.hip), "nothing is touched");
    }
}

#[test]
fn a_field_in_a_box_begins_and_ends_at_its_surface_and_fades_over_its_rim() {
    let scene = "[[finger]]\n[[field]]\nkind = \"viscous\"\ndamping_n_s_per_m = 5\nposition_m = [0.1, 0.0, 0.0]\n\
                 shape = { kind = \"box\", size_m = [0.1, 1.0, 1.0] }\nrim_m = 0.01\n";
    let mut whole = 0;
    for s in &felt(scene, &stroke([0.0; 3], [0.2, 0.0, 0.0]), &[])[1..1000] {
        let depth = 0.05 - (s.hip.x - 0.1).abs();
        let x = (depth / 0.01).clamp(0.0, 1.0);
        let expected = -5.0 * 0.2 * x * x * (3.0 - 2.0 * x);
        assert!((s.force.x - expected).abs() < BY_DIFFERENCE_N, "{expected}: {s:?}");
        whole += u32::from(x == 1.0);
    }
    // 80 mm at 0.2 mm a tick; its ends to a tick.
    assert!((399..=401).contains(&whole), "{whole}");
}

#[test]
fn a_constant_field_pulls_all_the_time() {
    let scene = "[[finger]]\n[[field]]\nkind = \"constant\"\nforce_n = [0.5, -1.0, 0.25]\n";
    for s in felt(scene, &stroke([0.0; 3], [0.2, 0.0, 0.0]), &[]) {
        assert_eq!(s.force, Vector3::new(0.5, -1.0, 0.25));
    }
}

#[test]
fn an_inertial_field_is_felt_as_a_mass_behind_its_filter() {
    let scene = "[[finger]]\n[[field]]\nkind = \"inertial\"\nmass_kg = 0.2\ncutoff_hz = 8.0\n";
    let (amplitude, w, corner) = (0.02, TAU * 1.5, TAU * 8.0);
    let rows = (0..=3000).map(|i| {
        let t = f64::from(i) / 1000.0;
        (t, [amplitude * (w * t).sin(), 0.0, 0.0])
    });
    let size = 0.2 * amplitude * w * w / (1.0 + (w / corner).powi(2));
    let lag = 2.0 * (w / corner).atan();
    for s in felt(scene, &hand(rows), &[]).iter().filter(|s| (1.0..2.999).contains(&s.t)) {
        let expected = size * (w * s.t - lag).sin();
        // Straight from row to row: (w T)^2 / 12 of the sine, and its ripple behind the filter.
        assert!((s.force.x - expected).abs() < 1e-3 * size, "{expected}: {s:?}");
    }
}

#[test]
fn a_heavier_device_may_have_more_and_the_limit_goes_by_the_rate() {
    let viscous = |b: f64, more: &str| {
        format!("[[finger]]\n[[field]]\nkind = \"viscous\"\ndamping_n_s_per_m = {b:?}\n{more}\n")
    };
    let said = refused(&viscous(7.0, ""), &[]);
    for part in
        ["scene.toml:2: field[0]: ", "damping_n_s_per_m is 7; allowed is at most 5.8905", "device_mass"]
    {
        assert!(said.contains(part), "`{part}`: {said}");
    }
    felt(&viscous(7.0, "device_mass_kg = 0.05"), "", &[]);
    // pi/4 0.03 / (1.5 2 ms + 2.5 ms)
    assert!(refused(&viscous(5.0, ""), &["--rate-hz", "500"]).contains("at most 4.2840"));
}

const LINE: &str =
    "[[finger]]\n[[guide]]\nkind = \"line\"\npoint_m = [0.0, 0.1, 0.0]\ndirection = [3.0, 0.0, 4.0]\n";

#[test]
fn a_guide_along_a_line_is_not_felt_on_it_and_pulls_towards_it() {
    let on = felt(LINE, &stroke([0.0, 0.1, 0.0], [0.06, 0.1, 0.08]), &[]);
    for s in &on {
        // The hand's line and the guide's differ by roundings of 1e-17 m: over 1 ms, times 2 N s/m.
        assert!(s.force.norm() < 1e-12, "{s:?}");
    }
    for s in &felt(LINE, &stroke([0.0, 0.103, 0.0], [0.06, 0.103, 0.08]), &[])[..1000] {
        assert!((s.force + Vector3::y() * (500.0 * 0.003)).norm() < 1e-11, "{s:?}");
    }
    let scene = LINE.to_owned() + "stiffness_n_per_m = 300\ndamping_n_s_per_m = 5\ndeadband_m = 0.001\n";
    for s in &felt(&scene, &stroke([0.0, 0.106, 0.0], [0.0, 0.112, 0.0]), &[])[1..1000] {
        // Twice the deadband is passed: the whole damper.
        let expected = -300.0 * (s.hip.y - 0.101) - 5.0 * 0.006;
        assert!((s.force.y - expected).abs() < 1e-11, "{expected}: {s:?}");
    }
}

#[test]
fn a_guide_to_a_plane_a_segment_and_a_path_pulls_towards_each() {
    let guides = [
        (
            "kind = \"plane\"\npoint_m = [0, 0.1, 0]\nnormal = [0, 5, 0]",
            [0.05, 0.104, 0.01],
            [0.0, -0.004, 0.0],
        ),
        (
            "kind = \"segment\"\nfrom_m = [0, 0, 0]\nto_m = [0.1, 0, 0]",
            [0.103, 0.004, 0.0],
            [-0.003, -0.004, 0.0],
        ),
        (
            "kind = \"path\"\npoints_m = [[0, 0, 0], [0.1, 0, 0], [0.1, 0.1, 0]]",
            [0.098, 0.05, 0.001],
            [0.002, 0.0, -0.001],
        ),
    ];
    for (keys, at, way) in guides {
        for s in felt(&format!("[[finger]]\n[[guide]]\n{keys}\n"), &rest(at), &[]) {
            assert!((s.force - Vector3::from(way) * 500.0).norm() < 1e-11, "{keys}: {s:?}");
        }
    }
}

#[test]
fn a_guide_captures_near_and_breaks_away_far() {
    let scene = LINE.to_owned() + "damping_n_s_per_m = 0\ncapture_m = 0.002\nbreak_away_n = 2\n";
    // Down to the line and up again, 10 mm in a second.
    let up = [0.0, 0.11, 0.0];
    let samples = felt(&scene, &hand([(0.0, up), (1.0, [0.0, 0.1, 0.0]), (2.0, up)]), &[]);
    let pulled: Vec<&Sample> = samples.iter().filter(|s| s.force.norm() > 1e-9).collect();
    let (first, last) = (pulled[0].hip.y - 0.1, pulled[pulled.len() - 1].hip.y - 0.1);
    // To a tick of 0.01 mm, and on the way out the 20 ms of letting go.
    assert!((first - 0.002).abs() < 2.1e-5, "{first}");
    assert!((0.004..0.0043).contains(&last), "{last}");
    let strongest = samples.iter().map(|s| s.force.norm()).fold(0.0, f64::max);
    assert!((strongest - 2.0).abs() < 0.01, "a tick's way of the spring: {strongest}");
    assert!(samples.iter().all(|s| s.force.y <= 0.0));
}

const MAGNET: &str = "[[finger]]\n[[entity]]\nname = \"plate\"\nstiffness_n_per_m = 800\n\
    shape = { kind = \"plane\", normal = [0.0, 1.0, 0.0], offset_m = 0.0 }\n\
    magnetism = { force_n = 1.0, distance_m = 0.012 }\n";

#[test]
fn a_magnet_pulls_within_its_reach_and_hands_over_to_the_contact_without_a_step() {
    let mut last: Option<f64> = None;
    for s in felt(MAGNET, &stroke([0.0, 0.015, 0.0], [0.0, -0.003, 0.0]), &[]) {
        let x = s.hip.y / 0.012;
        let expected = match x {
            x if x <= 0.0 => -800.0 * s.hip.y,
            x if x < 1.0 => -27.0 / 4.0 * x * (1.0 - x).powi(2),
            _ => 0.0,
        };
        // Positions of some millimetres, rounded to 2e-18, times 800 N/m.
        assert!((s.force.y - expected).abs() < 1e-13, "{expected}: {s:?}");
        assert_eq!(s.entity.is_empty(), s.hip.y > 0.0, "being attracted is no contact: {s:?}");
        // 0.018 mm a tick, of the steeper slope.
        assert!(last.is_none_or(|last| (s.force.y - last).abs() < 1.001 * 800.0 * 1.8e-5));
        last = Some(s.force.y);
    }
    let said = refused(&MAGNET.replace("force_n = 1.0", "force_n = 2.0"), &[]);
    for part in ["scene.toml:2: entity plate: ", "force_n is 2; allowed is at most 1.7778"] {
        assert!(said.contains(part), "`{part}`: {said}");
    }
}

const HUM: &str = "[[finger]]\n[[entity]]\nstiffness_n_per_m = 1000\n\
    shape = { kind = \"plane\", normal = [0.0, 1.0, 0.0], offset_m = 0.0 }\n\
    vibration = { frequency_hz = 137.0, amplitude_n = 0.3, full_load_n = 1.0 }\n";

/// Strength of the whole frequency `hz` in a second at 1 kHz.
fn line_at(hz: usize, signal: &[f64]) -> f64 {
    let angle = |i: usize| TAU * ((hz * i) % 1000) as f64 / 1000.0;
    let sum =
        |part: fn(f64) -> f64| -> f64 { signal.iter().enumerate().map(|(i, x)| x * part(angle(i))).sum() };
    sum(f64::cos).hypot(sum(f64::sin)) / 500.0
}

/// A run on this clock.
fn on_clock(clock: &str, scene: &str, hand: &str) -> Table {
    let place = Workplace::new();
    place.write("scene.toml", scene);
    place.write("hand.csv", hand);
    let words =
        ["run", "scene.toml", "--headless", "--hand", "hand.csv", "--record", "out.csv", "--clock", clock];
    let said = place.run(words);
    assert_eq!(said.status, Some(0), "{}", said.err);
    Table::read(&place.path("out.csv"))
}

#[test]
fn a_vibration_has_its_line_at_its_frequency_and_is_the_same_on_every_clock() {
    let hand = rest([0.0, -0.004, 0.0]);
    let [virtually, lockstep] = ["virtual", "lockstep"].map(|clock| on_clock(clock, HUM, &hand));
    assert_eq!(virtually.rows(), lockstep.rows(), "cell by cell");
    let force: Vec<f64> = virtually.finger("f0").iter().map(|s| s.force.y - 4.0).collect();
    assert_eq!(force.len(), 1000);
    for hz in 1..500 {
        let expected = if hz == 137 { 0.3 } else { 0.0 };
        // 4 N are rounded to 4e-16; a thousand of them.
        assert!((line_at(hz, &force) - expected).abs() < 1e-12, "{hz} Hz: {}", line_at(hz, &force));
    }
    // In real time each row that there is holds the same number: the phase is that of its time.
    for s in on_clock("real", HUM, &hand).finger("f0") {
        let row = (s.t * 1000.0).round() as usize;
        assert_eq!(s.force.y - 4.0, force[row], "{s:?}");
    }
}

#[test]
fn a_vibration_fades_in_with_the_load_and_is_refused_where_ticks_are_too_few() {
    for s in felt(HUM, &stroke([0.0, 0.001, 0.0], [0.0, -0.002, 0.0]), &[]) {
        let load = (-1000.0 * s.hip.y).max(0.0);
        let expected = load + 0.3 * load.min(1.0) * (TAU * 137.0 * s.t).sin();
        // The argument of the sine is up to 861, rounded to 1e-13.
        assert!((s.force.y - expected).abs() < 1e-12, "{expected}: {s:?}");
        assert!(s.force.y >= 0.0);
    }
    let said = refused(HUM, &["--rate-hz", "300"]);
    assert!(said.contains("frequency_hz is 137; allowed is at most 120.0"), "{said}");
    let said = refused(&HUM.replace("full_load_n = 1.0", "full_load_n = 0.1"), &[]);
    assert!(said.contains("amplitude_n is 0.3; allowed is at most 0.1"), "{said}");
}

#[test]
fn what_a_contact_and_effects_give_is_added_in_the_recording() {
    let scene = format!("{MAGNET}[[field]]\nkind = \"constant\"\nforce_n = [0.1, 0.0, 0.0]\n");
    for s in felt(&scene, &rest([0.0, -0.002, 0.0]), &[]) {
        assert_eq!(s.force, Vector3::new(0.1, 1.6, 0.0), "{s:?}");
        assert_eq!(s.entity, "plate");
    }
}

#[test]
fn the_strongest_damper_is_calm_in_a_simulated_hand_on_a_simulated_arm() {
    let strongest = "[[finger]]\n[[field]]\nkind = \"viscous\"\ndamping_n_s_per_m = 5.89\n\
                     [[guide]]\nkind = \"plane\"\npoint_m = [0, 0, 0]\nnormal = [0, 1, 0]\nstiffness_n_per_m = 1000\n";
    // A stroke, and two seconds of rest, with the hand's tremor and steps of the encoders.
    let hand = hand([(0.0, [0.0; 3]), (0.5, [0.03, 0.0, 0.0]), (2.5, [0.03, 0.0, 0.0])]);
    let place = Workplace::new();
    place.write("scene.toml", strongest);
    place.write("hand.csv", hand);
    let said = place.run([
        "run",
        "scene.toml",
        "--hand",
        "hand.csv",
        "--hand-mode",
        "impedance",
        "--clock",
        "virtual",
        "--headless",
        "--record",
        "out.csv",
    ]);
    assert_eq!(said.status, Some(0), "{}", said.err);
    let samples = Table::read(&place.path("out.csv")).finger("f0");
    let stroke = samples.iter().map(|s| s.force.norm()).fold(0.0, f64::max);
    let late: Vec<f64> = samples.iter().filter(|s| s.t > 2.0).map(|s| s.force.x).collect();
    let swing = late.iter().map(|force| force.abs()).fold(0.0, f64::max);
    assert!(stroke > 0.2, "0.06 m/s and more were damped: {stroke} N");
    // Tremor of 0.1 mm at 10 Hz is 6 mm/s, an encoder's steps are some more: 0.1 N. A damper that swings by itself
    // goes up to its bound of 10 N, or to what the motors have.
    assert!(swing < 0.25, "{swing} N of {stroke} N");
}

#[test]
fn the_committed_scene_has_one_of_each_effect_and_each_is_felt() {
    let config = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../config");
    let read = |file: &str| std::fs::read_to_string(config.join(file)).expect("a file");
    let scene = read("scenes/effects.toml").replace("../hands/effects.csv", "hand.csv");
    let samples = felt(&scene, &read("hands/effects.csv"), &[]);
    let beside = |s: &Sample| s.force + Vector3::y() * 0.2;
    let any = |from: f64, to: f64, is: &dyn Fn(&Sample) -> bool| {
        samples.iter().any(|s| (from..to).contains(&s.t) && is(s))
    };
    assert!(any(0.3, 1.0, &|s| beside(s).x < -0.4), "water: 3 N s/m at 0.15 m/s");
    assert!(any(1.9, 2.1, &|s| s.entity.is_empty() && beside(s).norm() < 1e-9), "air");
    assert!(any(2.5, 4.0, &|s| s.entity.is_empty() && beside(s).y < -0.99), "the magnet's pull");
    let touching: Vec<f64> =
        samples.iter().filter(|s| (4.1..4.9).contains(&s.t)).map(|s| beside(s).y).collect();
    let [low, high] = [f64::min, f64::max].map(|of| touching.iter().copied().reduce(of).expect("rows"));
    // 3 N and 0.3 N of vibration on either side.
    assert!((low - 2.7).abs() < 0.01 && (high - 3.3).abs() < 0.01, "{low} {high}");
    assert!(any(7.0, 8.0, &|s| beside(s).y < -2.4), "the rail holds up to 2.5 N");
    // There is water again: 3 N s/m at 25 mm/s.
    assert!(any(7.9, 8.0, &|s| beside(s).norm() < 0.08), "and then lets go");
}
