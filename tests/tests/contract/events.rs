//! What `run --events` tells, against what the same run's rows say.

use nalgebra::Vector3;
use system_tests::recording::{Sample, Table};
use system_tests::workplace::Workplace;

const LIFT_SCENE: &str = include_str!("../../../config/scenes/lift.toml");
const LIFT_HAND: &str = include_str!("../../../config/hands/lift.csv");
const TABLE: &str = "hand = \"hand.csv\"\n[[finger]]\nstart_m = [0, 0.02, 0]\n\
    [[entity]]\nname = \"table\"\nshape = { kind = \"plane\", normal = [0, 1, 0], offset_m = 0 }\n";
/// Three taps, each deeper than the one before.
const TAPS: &str = "t,f0_x,f0_y,f0_z\n0,0,0.02,0\n0.2,0,-0.002,0\n0.4,0,0.01,0\n0.6,0.01,-0.003,0\n0.8,0.01,0.01,0\n\
    1.0,0.02,-0.004,0.01\n1.2,0,0.02,0\n";
/// Presses, then goes sideways and back.
const DRAG: &str = "t,f0_x,f0_y,f0_z\n0,0,0.02,0\n0.2,0,-0.003,0\n0.4,0,-0.003,0\n0.9,0.02,-0.003,0\n\
    1.1,0.02,-0.003,0\n1.5,0.005,-0.003,0\n1.7,0.005,0.02,0\n";
const DROP: &str = "[[finger]]\nstart_m = [0.5, 0.5, 0]\n\
    [[entity]]\nname = \"table\"\nshape = { kind = \"plane\", normal = [0, 1, 0], offset_m = 0 }\n\
    [[entity]]\nname = \"cube\"\nshape = { kind = \"box\", size_m = [0.05, 0.05, 0.05] }\nposition_m = [0, 0.08, 0]\n\
    mass_kg = 0.1\n";

/// Runs a scene, and reads rows and events.
fn ran(scene: &str, hand: &str, seconds: &str) -> (Workplace, Table, Table) {
    let place = Workplace::new();
    place.write("scene.toml", scene);
    place.write("hand.csv", hand);
    let run = ["run", "scene.toml", "--clock", "virtual", "--seconds", seconds, "--record", "rows.csv"];
    let said = place.run([&run[..], &["--events", "events.csv", "--events", "events.jsonl"]].concat());
    assert_eq!(said.status, Some(0), "{}{}", said.out, said.err);
    let (rows, events) = (Table::read(&place.path("rows.csv")), Table::read(&place.path("events.csv")));
    check_report(&said.out, &events);
    (place, rows, events)
}

/// The report counts things, not their beginnings and ends.
fn check_report(report: &str, events: &Table) {
    let line = report.lines().find_map(|line| line.strip_prefix("events       ")).expect("a line of events");
    for (class, kind) in
        [("contact", "contact-begin"), ("slip", "slip-begin"), ("pair", "pair-begin"), ("grasp", "grasp")]
    {
        let told = line.split(", ").find_map(|part| {
            let (count, word) = part.split_once(' ')?;
            let of_one = if count == "1" { word } else { word.strip_suffix('s')? };
            if of_one == class { count.parse().ok() } else { None }
        });
        assert_eq!(told.unwrap_or(0), of_kind(events, kind, "kind").len(), "{class} of: {line}");
    }
}

/// The cells of a column in the events of a kind.
fn of_kind<'t>(events: &'t Table, kind: &str, column: &str) -> Vec<&'t str> {
    let kinds = events.texts("kind").into_iter();
    kinds.zip(events.texts(column)).filter(|(is, _)| *is == kind).map(|(_, cell)| cell).collect()
}

fn numbers<T: std::str::FromStr<Err: std::fmt::Debug>>(cells: Vec<&str>) -> Vec<T> {
    cells.into_iter().map(|cell| cell.parse().expect("a number")).collect()
}

fn impulses(events: &Table, kind: &str) -> Vec<Vector3<f64>> {
    let [x, y, z] =
        ["x", "y", "z"].map(|axis| numbers::<f64>(of_kind(events, kind, &format!("impulse_{axis}_n_s"))));
    (0..x.len()).map(|event| Vector3::new(x[event], y[event], z[event])).collect()
}

#[test]
fn three_taps_are_three_contacts_whose_impulses_are_the_integrals_of_the_recorded_force() {
    let (_place, rows, events) = ran(TABLE, TAPS, "1.2");
    let begins: Vec<usize> = numbers(of_kind(&events, "contact-begin", "tick"));
    let ends: Vec<usize> = numbers(of_kind(&events, "contact-end", "tick"));
    let (impulses, samples) = (impulses(&events, "contact-end"), rows.finger("f0"));
    assert_eq!((begins.len(), ends.len(), impulses.len()), (3, 3, 3));
    for ((begin, end), impulse) in begins.into_iter().zip(ends).zip(impulses) {
        assert!(!samples[begin - 1].touches() && samples[begin].touches(), "begins in {begin}");
        assert!(samples[end - 1].touches() && !samples[end].touches(), "ends in {end}");
        let integral: Vector3<f64> = samples[begin..end].iter().map(|sample| sample.force * 1e-3).sum();
        // The same sum in the same order; the tick's length may differ by a bit.
        assert!((integral - impulse).norm() < 1e-12, "{integral} is not {impulse}");
        assert!(impulse.y > 1e-3, "hardly a tap: {impulse}");
    }
}

#[test]
fn slip_begins_and_ends_in_the_ticks_in_which_the_rows_say_so() {
    let scene = format!("{TABLE}friction = {{ model = \"stiction\", mu_s = 0.7, mu_d = 0.3 }}\n");
    let (_place, rows, events) = ran(&scene, DRAG, "1.7");
    let slips: Vec<bool> = rows.finger("f0").iter().map(|sample| sample.friction == "slip").collect();
    let touches: Vec<bool> = rows.finger("f0").iter().map(Sample::touches).collect();
    let changes = |to: bool| {
        let both = 1..slips.len();
        both.filter(|&tick| touches[tick] && slips[tick] == to && slips[tick - 1] != to).collect::<Vec<_>>()
    };
    assert_eq!(numbers::<usize>(of_kind(&events, "slip-begin", "tick")), changes(true));
    assert_eq!(numbers::<usize>(of_kind(&events, "slip-end", "tick")), changes(false));
    assert!(changes(true).len() >= 2, "it does not slip both ways");
}

#[test]
fn each_bounce_of_a_dropped_cube_changes_its_momentum_by_the_told_impulse() {
    for response in ["", "contact_response = { kind = \"impulse\", restitution = 0.5 }\n"] {
        let (_place, rows, events) =
            ran(&format!("{response}{DROP}"), "t,f0_x,f0_y,f0_z\n0,0.5,0.5,0\n", "1.5");
        assert!(of_kind(&events, "pair-begin", "entity").iter().all(|name| *name == "cube"));
        let begins: Vec<usize> = numbers(of_kind(&events, "pair-begin", "tick"));
        let lasted_s: Vec<f64> = numbers(of_kind(&events, "pair-end", "lasted_s"));
        let impulses = impulses(&events, "pair-end");
        assert!(!begins.is_empty(), "it never lands");
        assert!(begins.len() <= lasted_s.len() + 1 && begins.len() < 20, "it chatters: {begins:?}");
        assert!(response.is_empty() || impulses.len() >= 2, "it does not bounce: {begins:?}");
        let cube = rows.body("cube");
        for ((begin, lasted_s), impulse) in begins.into_iter().zip(lasted_s).zip(impulses) {
            let ticks = (lasted_s * 1e3).round();
            let change = cube[begin + ticks as usize].velocity.y - cube[begin].velocity.y;
            let expected_n_s = 0.1 * (change + 9.81 * 1e-3 * ticks);
            // Semi-implicit: what differs is rounding, of numbers near 0.1 in up to 1500 ticks.
            assert!((impulse.y - expected_n_s).abs() < 1e-9, "{impulse} in {begin}, not {expected_n_s}");
        }
    }
}

#[test]
fn a_cube_that_is_lifted_is_grasped_once_and_released_once() {
    let scene = LIFT_SCENE.replace("../hands/lift.csv", "hand.csv");
    let seconds = LIFT_HAND.trim().lines().last().and_then(|line| line.split(',').next()).expect("a time");
    let (place, rows, events) = ran(&scene, LIFT_HAND, seconds);
    let (grasps, releases) = (of_kind(&events, "grasp", "tick"), of_kind(&events, "release", "tick"));
    assert_eq!((grasps.len(), releases.len()), (1, 1), "{grasps:?} {releases:?}");
    assert_eq!(of_kind(&events, "grasp", "entity"), ["cube"]);
    assert_eq!(of_kind(&events, "grasp", "fingers"), ["f0+f1"]);
    let grasped: usize = grasps[0].parse().expect("a tick");
    let samples = ["f0", "f1"].map(|finger| rows.finger(finger));
    let held = |tick: usize| samples.iter().all(|of_finger| of_finger[tick].entity == "cube");
    assert!(held(grasped) && !held(grasped - 1));
    let released: usize = releases[0].parse().expect("a tick");
    assert!((released - 4..=released).all(|tick| !held(tick)) && held(released - 5));
    // As JSON: a line for each, and the same words.
    let text = std::fs::read_to_string(place.path("events.jsonl")).expect("events");
    assert_eq!(text.lines().count(), events.len());
    for (line, kind) in text.lines().zip(events.texts("kind")) {
        let told: serde_json::Value = serde_json::from_str(line).expect("JSON");
        assert_eq!(told["kind"], kind);
    }
}

#[test]
fn two_virtual_runs_tell_the_same_bytes() {
    let runs = [(); 2].map(|()| {
        let (place, ..) = ran(&LIFT_SCENE.replace("../hands/lift.csv", "hand.csv"), LIFT_HAND, "2");
        std::fs::read(place.path("events.jsonl")).expect("events")
    });
    assert!(runs[0] == runs[1] && !runs[0].is_empty());
}

/// They meet the table in one tick, and leave it in one.
#[test]
fn on_a_clock_that_waits_no_event_is_lost_however_many_there_are_in_a_tick() {
    const SIDE: usize = 46;
    let mut scene = String::from(
        "gravity_m_s2 = [0, -9.81, 0]\n[[finger]]\nstart_m = [5, 5, 5]\n[[entity]]\nname = \"table\"\n\
         shape = { kind = \"plane\", normal = [0, 1, 0], offset_m = 0 }\nrestitution = 0.9\n",
    );
    for ball in 0..SIDE * SIDE {
        let [x, z] = [ball / SIDE, ball % SIDE].map(|cell| cell as f64 * 0.05);
        scene += &format!(
            "[[entity]]\nname = \"ball{ball}\"\nshape = {{ kind = \"sphere\", radius_m = 0.01 }}\n\
             position_m = [{x}, 0.015, {z}]\nmass_kg = 0.03\nrestitution = 0.9\n"
        );
    }
    for fast_bodies in [0, SIDE * SIDE] {
        let scene = format!("lists = {{ fast_bodies = {fast_bodies} }}\n{scene}");
        let (_place, _rows, events) = ran(&scene, "t,f0_x,f0_y,f0_z\n0,5,5,5\n", "0.06");
        let ticks: Vec<u32> = numbers(of_kind(&events, "pair-begin", "tick"));
        assert_eq!(ticks.len(), SIDE * SIDE, "{ticks:?}");
        assert_eq!(of_kind(&events, "pair-end", "tick").len(), SIDE * SIDE);
        assert!(of_kind(&events, "events-lost", "number").is_empty());
    }
}
