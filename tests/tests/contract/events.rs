//! What `run --events` tells, against what the same run's rows say.

use nalgebra::Vector3;
use std::collections::HashSet;
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

/// Beginnings and ends alternate, and nothing is open when a world ends, nor at the end of the run. Says how many ended then.
fn check_ends(events: &Table) -> Vec<usize> {
    let columns = ["kind", "finger", "entity", "other", "tick"].map(|column| events.texts(column));
    let (mut open, mut ends, mut ended_with) = (HashSet::new(), Vec::new(), 0);
    let last = columns[4].last().copied().unwrap_or_default();
    for event in 0..events.len() {
        let [kind, finger, entity, other, tick] = columns.each_ref().map(|column| column[event]);
        let what = match kind {
            "grasp" | "release" => "grasp",
            "tied" | "untied" => "tie",
            kind => kind.split_once('-').map_or(kind, |(what, _)| what),
        };
        let key = (what, finger, entity, other);
        match kind {
            "contact-begin" | "slip-begin" | "pair-begin" | "grasp" | "tied" => {
                assert!(open.insert(key), "{kind} twice in tick {tick}: {key:?}");
            }
            "contact-end" | "slip-end" | "pair-end" | "release" | "untied" => {
                assert!(open.remove(&key), "{kind} without a beginning in tick {tick}: {key:?}");
                assert!(kind != "contact-end" || !open.contains(&("slip", finger, entity, other)), "{key:?}");
                ended_with += 1;
            }
            "reset" | "scene" => {
                assert!(open.is_empty(), "{kind} in tick {tick}: {open:?}");
                ends.push(std::mem::take(&mut ended_with));
            }
            _ => ended_with = 0,
        }
        assert!(kind != "events-lost", "in tick {tick}");
    }
    assert!(open.is_empty(), "at the end in tick {last}: {open:?}");
    ends
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
    // Who does not touch does not slip.
    let slips: Vec<bool> = slips.into_iter().zip(touches).map(|(slips, touches)| slips && touches).collect();
    let changes = |to: bool| {
        let both = 1..slips.len();
        both.filter(|&tick| slips[tick] == to && slips[tick - 1] != to).collect::<Vec<_>>()
    };
    assert_eq!(numbers::<usize>(of_kind(&events, "slip-begin", "tick")), changes(true));
    assert_eq!(numbers::<usize>(of_kind(&events, "slip-end", "tick")), changes(false));
    assert!(changes(true).len() >= 2, "it does not slip both ways");
    check_ends(&events);
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
        assert!(begins.len() == lasted_s.len() && begins.len() < 20, "it chatters: {begins:?}");
        assert!(response.is_empty() || impulses.len() >= 2, "it does not bounce: {begins:?}");
        let cube = rows.body("cube");
        for ((begin, lasted_s), impulse) in begins.into_iter().zip(lasted_s).zip(impulses) {
            let ticks = (lasted_s * 1e3).round();
            if begin + ticks as usize == cube.len() {
                // It lies there when the run ends, and no row tells of what came after.
                continue;
            }
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

/// Balls that lie on a table, most of them in the slow list, and a finger that is dragged over it.
#[test]
fn before_a_reset_before_another_scene_and_at_the_end_of_a_run_all_that_began_has_ended() {
    let table = TABLE.replace("hand = \"hand.csv\"\n", "");
    let scene = |balls: usize| {
        let mut scene = format!("gravity_m_s2 = [0, -9.81, 0]\nlists = {{ fast_bodies = 8 }}\n{table}");
        scene += "friction = { model = \"coulomb\", mu = 0.3 }\n";
        for ball in 0..balls {
            let [x, z] = [ball % 20, ball / 20].map(|cell| cell as f64 * 0.025 - 0.2);
            scene += &format!(
                "[[entity]]\nname = \"ball{ball}\"\nshape = {{ kind = \"sphere\", radius_m = 0.01 }}\n\
                 position_m = [{x}, 0.01, {z}]\nmass_kg = 0.03\n"
            );
        }
        scene
    };
    let place = Workplace::new();
    place.write("hand.csv", "t,f0_x,f0_y,f0_z\n0,-0.3,0.02,0\n0.1,-0.3,-0.002,0\n1.6,0.3,-0.002,0\n");
    place.write("orders.txt", "at 0.3 reset\nat 0.7 swap other.toml\nat 1.1 reset\n");
    // In real time a tick tells 256 events: of each ball may be told that it touches, and that it changes lists.
    for (clock, balls) in [("virtual", 300), ("real", 100)] {
        place.write("scene.toml", scene(balls));
        place.write("other.toml", scene(balls - 20));
        let run = ["run", "scene.toml", "--hand", "hand.csv", "--clock", clock, "--seconds", "1.5"];
        let said = place.run([&run[..], &["--orders", "orders.txt", "--events", "events.csv"]].concat());
        assert_eq!(said.status, Some(0), "{}{}", said.out, said.err);
        let events = Table::read(&place.path("events.csv"));
        let ends = check_ends(&events);
        assert_eq!(ends.len(), 3);
        // In real time the slow list may not have had its turn yet.
        if clock == "virtual" {
            let is_told = |kind| !of_kind(&events, kind, "tick").is_empty();
            assert!(
                ends.iter().all(|ends| *ends > 270) && is_told("slip-end") && is_told("list-change"),
                "{ends:?}"
            );
        }
    }
}

/// Each falls by 3 mm, lies there asleep, and is lifted off by the finger or not.
#[test]
fn who_sleeps_is_held_up_meanwhile() {
    let scene = "gravity_m_s2 = [0, -9.81, 0]\n[[finger]]\nstart_m = [0.5, 0.5, 0]\n\
        [[entity]]\nname = \"table\"\nshape = { kind = \"plane\", normal = [0, 1, 0], offset_m = 0 }\n\
        [[entity]]\nname = \"low\"\nshape = { kind = \"box\", size_m = [0.05, 0.05, 0.05] }\n\
        position_m = [0, 0.028, 0]\nmass_kg = 0.1\n\
        [[entity]]\nname = \"high\"\nshape = { kind = \"box\", size_m = [0.05, 0.05, 0.05] }\n\
        position_m = [0, 0.081, 0]\nmass_kg = 0.2\n";
    for lists in ["", "lists = { fast_bodies = 0 }\n"] {
        let (_place, rows, events) = ran(&format!("{lists}{scene}"), "t,f0_x,f0_y,f0_z\n0,0.5,0.5,0\n", "4");
        let last = rows.body("high").len() - 1;
        let names =
            of_kind(&events, "pair-end", "entity").into_iter().zip(of_kind(&events, "pair-end", "other"));
        let mut got_n_s = [0.0; 2];
        for ((entity, other), impulse) in names.zip(impulses(&events, "pair-end")) {
            for (body, got_n_s) in ["low", "high"].into_iter().zip(&mut got_n_s) {
                let sign = f64::from(u8::from(entity == body)) - f64::from(u8::from(other == body));
                *got_n_s += sign * impulse.y;
            }
        }
        for ((body, mass_kg), got_n_s) in [("low", 0.1), ("high", 0.2)].into_iter().zip(got_n_s) {
            assert_eq!(rows.body(body)[last].velocity, Vector3::zeros(), "{body} does not sleep");
            let weight_n_s = mass_kg * 9.81 * 1e-3 * (last + 1) as f64;
            // What is left of the speed when it falls asleep is taken from it; the slow list goes on in turns of ten ticks.
            let most_n_s = 1e-3 * weight_n_s + if lists.is_empty() { 0.0 } else { mass_kg * 9.81 * 0.02 };
            assert!(
                (got_n_s - weight_n_s).abs() < most_n_s,
                "{lists}{body}: {got_n_s}, not {weight_n_s} N s"
            );
        }
    }
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
