//! A hull that is smaller than the room inside of it, as a user sees it: scene, rows, events, recordings.

use nalgebra::Vector3;
use system_tests::recording::{Sample, Table};
use system_tests::workplace::{Workplace, hand};

const CONFIG: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../config");

/// The committed scene, moved by another hand.
fn played(path: &str) -> (Workplace, Table, Table) {
    let place = Workplace::new();
    let scene = format!("{CONFIG}/scenes/kinds/tardis.toml");
    let mut run = vec!["run", &scene, "--clock", "virtual", "--headless", "--record", "out.csv"];
    run.extend(["--events", "events.csv", "--record", "out.mcap"]);
    if !path.is_empty() {
        place.write("hand.csv", path);
        run.extend(["--hand", "hand.csv"]);
    }
    let said = place.run(run);
    assert_eq!((said.status, said.err.as_str()), (Some(0), ""));
    let (rows, events) = (Table::read(&place.path("out.csv")), Table::read(&place.path("events.csv")));
    (place, rows, events)
}

fn largest_jump(samples: &[Sample]) -> f64 {
    samples.windows(2).map(|pair| (pair[1].force - pair[0].force).norm()).fold(0.0, f64::max)
}

/// The ticks in which a finger's space changed, and what it was then.
fn changes(table: &Table) -> Vec<(usize, String)> {
    let spaces = table.texts("f0_space");
    let ticks = 1..spaces.len();
    ticks.filter(|&at| spaces[at] != spaces[at - 1]).map(|at| (at, spaces[at].to_owned())).collect()
}

#[test]
fn a_finger_goes_into_the_tardis_touches_a_far_wall_and_comes_out() {
    let (place, rows, events) = played("");
    let samples = rows.finger("f0");
    let spaces = rows.texts("f0_space");
    let changes = changes(&rows);
    assert_eq!(changes.iter().map(|(_, space)| space.as_str()).collect::<Vec<_>>(), ["inside", ""]);
    // What each tick touches is in the space that it says.
    let mut touched: Vec<&str> = rows.texts("f0_entity");
    for (entity, space) in touched.iter().zip(&spaces) {
        let is_there = entity.is_empty() || (*entity == "hull") == space.is_empty();
        assert!(is_there, "{entity} felt in {space:?}");
    }
    touched.dedup();
    assert_eq!(touched, ["", "inside_right", "", "hull", ""]);
    let furthest = samples.iter().map(|sample| sample.god.x).fold(0.0, f64::max);
    // The hull ends at 0.05.
    assert!((furthest - 0.2).abs() < 1e-12, "{furthest}");
    // Through the door, free: not a newton in either direction.
    for (at, _) in &changes {
        assert!(samples[at - 50..at + 50].iter().all(|sample| sample.force == Vector3::zeros()), "at {at}");
        assert!((samples[*at].hip.z - 0.05).abs() < 1e-3, "within a tick of the door");
    }
    // A wall met in one tick of 0.17 mm: twice that on steel.
    let stiffest = 2000.0;
    assert!(largest_jump(&samples) < stiffest * 4e-4, "{}", largest_jump(&samples));
    // The same as events.
    let doors = |column: &str| -> Vec<String> {
        let kinds = events.texts("kind").into_iter().zip(events.texts(column));
        kinds.filter(|(kind, _)| *kind == "door").map(|(_, cell)| cell.to_owned()).collect()
    };
    assert_eq!([doors("from"), doors("to")], [["", "inside"], ["inside", ""]]);
    let ticks: Vec<String> = changes.iter().map(|(at, _)| at.to_string()).collect();
    assert_eq!((doors("tick"), doors("finger")), (ticks, vec!["f0".to_owned(); 2]));
    // And from the recording: the table byte for byte, played again to the bit.
    assert_eq!(place.run(["export", "out.mcap", "--csv", "again.csv"]).status, Some(0));
    let read = |name: &str| std::fs::read(place.path(name)).expect("a table");
    assert!(read("again.csv") == read("out.csv"));
    let said = place.run(["export", "out.csv", "--parquet", "out.parquet"]);
    assert_eq!((said.status, said.err.as_str()), (Some(0), ""), "{}", said.out);
    let said = place.run(["replay", "out.mcap", "--expect-same"]);
    assert_eq!(said.status, Some(0), "{}{}", said.out, said.err);
}

#[test]
fn there_is_no_other_way_in_or_out() {
    // Onto the hull beside the door and through its side and back; then in, and against the front wall beside the door.
    let (_place, rows, _) = played(&hand([
        (0.0, [0.035, 0.06, 0.1]),
        (0.3, [0.035, 0.06, 0.045]),
        (0.5, [0.035, 0.06, 0.1]),
        (0.8, [0.0, 0.06, 0.1]),
        (1.1, [0.0, 0.06, 0.0]),
        (1.4, [0.035, 0.06, 0.0]),
        (1.7, [0.035, 0.06, 0.055]),
        (2.0, [0.035, 0.06, 0.0]),
    ]));
    let (samples, spaces) = (rows.finger("f0"), rows.texts("f0_space"));
    for (tick, entity, space, sign) in [(300, "hull", "", 1.0), (1700, "inside_front", "inside", -1.0)] {
        let sample = &samples[tick];
        assert_eq!((sample.entity.as_str(), spaces[tick]), (entity, space));
        assert!((sample.god.z - 0.05).abs() < 1e-9 && sample.force.z * sign > 1.0, "{tick}: {sample:?}");
    }
    assert_eq!(changes(&rows).len(), 1, "in by the door, and nowhere out");
}

const HOUSE: &str = "[[finger]]\nstart_m = [0, 0.02, 0.2]\n\
    [[entity]]\nname = \"ground\"\nshape = { kind = \"plane\", normal = [0, 1, 0], offset_m = 0 }\n\
    friction = { model = \"coulomb\", mu = 0.2 }\n\
    [[entity]]\nname = \"hull\"\nposition_m = [0, 0.05, 0]\nshape = { kind = \"box\", size_m = [0.1, 0.1, 0.1] }\n\
    [[environment]]\nname = \"inside\"\nkind = \"room\"\nsize_m = [0.4, 0.4, 0.4]\nposition_m = [0, 0.1, -0.15]\n\
    door = { of = \"hull\", position_m = [0, 0, 0.05], size_m = [0.08, 0.1] }\n\
    [[entity]]\nname = \"cube\"\nshape = { kind = \"box\", size_m = [0.04, 0.04, 0.04] }\nmass_kg = 0.05\n";

#[test]
fn an_object_that_is_pushed_to_the_door_stays_outside_and_so_does_who_pushes_it() {
    let place = Workplace::new();
    let path = hand([(0.0, [0.0, 0.02, 0.2]), (1.0, [0.0, 0.02, 0.1]), (2.0, [0.0, 0.02, 0.07])]);
    let rows = place.play(&format!("{HOUSE}position_m = [0, 0.0201, 0.12]\n"), &path, &[]);
    let cube = rows.body("cube").pop().expect("the last row");
    // The finger's spring of 1000 N/m pushes with 20 N: four corners of 5e4 N/m each at the hull give way by 100 um,
    // half a micrometre less or more where the ground holds it.
    assert!((cube.position.z - (0.07 - 1e-4)).abs() < 1.5e-6, "its face is at the door: {cube:?}");
    let last = rows.finger("f0").pop().expect("the last row");
    assert_eq!((last.entity.as_str(), rows.texts("f0_space").pop()), ("cube", Some("")));
    assert!(last.force.z > 1.0, "{last:?}");
}

#[test]
fn an_object_that_is_tied_to_a_finger_is_let_go_at_the_door() {
    let place = Workplace::new();
    let scene = HOUSE.replacen("[[finger]]\n", "[[finger]]\nattach = { button = 0 }\n", 1);
    // Onto the cube's top, tied, and with it into the door; the button stays down.
    let path = "t,f0_x,f0_y,f0_z,f0_buttons\n0,0,0.05,0.12,0\n0.3,0,0.039,0.12,0\n0.4,0,0.039,0.12,1\n\
                1.4,0,0.039,0.02,1\n1.8,0,0.039,0.02,1\n";
    let rows = place.play(&format!("{scene}position_m = [0, 0.0201, 0.12]\n"), path, &[]);
    let (spaces, tied) = (rows.texts("f0_space"), rows.texts("f0_attached"));
    let goes = spaces.iter().position(|space| *space == "inside").expect("it goes in");
    assert_eq!((tied[500], tied[goes - 1]), ("cube", "cube"));
    // `fade_s` of the tie is 20 ms.
    assert!(tied[goes + 25..].iter().all(|tied| tied.is_empty()), "it is let go");
    assert!(spaces[goes..].iter().all(|space| *space == "inside"));
    let cube = rows.body("cube").pop().expect("the last row");
    assert!(cube.position.z > 0.065, "it stays in front of the hull: {cube:?}");
    let samples = rows.finger("f0");
    assert_eq!(samples.last().map(|last| last.force), Some(Vector3::zeros()));
    // The tie's 20 N at most, over 20 ticks; what it pulls at is dropped, and swings.
    assert!(largest_jump(&samples[goes - 1..]) < 2.5, "{}", largest_jump(&samples[goes - 1..]));
}

#[test]
fn an_object_behind_a_door_lies_on_the_floor_of_its_own_space() {
    let place = Workplace::new();
    // At the same place as the hull, and above the world's ground; the room's floor is a decimetre below that.
    let rows = place.play(&format!("{HOUSE}position_m = [0, 0.05, 0]\nwithin = \"inside\"\n"), "", &[]);
    let cube = rows.body("cube").pop().expect("the last row");
    assert!((cube.position.y + 0.08).abs() < 1e-3, "{cube:?}");
}

#[test]
fn a_finger_may_begin_inside_and_the_check_tells_what_is_where() {
    let place = Workplace::new();
    let scene = HOUSE.replacen("start_m = [0, 0.02, 0.2]", "start_m = [0, 0.05, 0]\nwithin = \"inside\"", 1);
    let rows = place.play(&format!("{scene}position_m = [0.3, 0.0201, 0.3]\n"), "", &[]);
    assert_eq!(rows.texts("f0_space")[0], "inside");
    assert!(rows.finger("f0").iter().all(|sample| sample.force == Vector3::zeros()), "in the hull, and free");
    let said = place.run(["check", "scene.toml"]);
    assert_eq!(said.status, Some(0), "{}{}", said.out, said.err);
    assert!(!said.out.contains("inside of"), "{}", said.out);
    place.write(
        "bad.toml",
        scene.replacen("within = \"inside\"", "within = \"outside\"", 1) + "position_m = [1, 1, 1]\n",
    );
    let said = place.run(["check", "bad.toml"]);
    assert_eq!(said.status, Some(2));
    let wanted = "bad.toml:1: within: found \"outside\", which no [[environment]] with a door is called; allowed: inside";
    assert!(said.err.contains(wanted) || said.out.contains(wanted), "{}{}", said.out, said.err);
}

#[test]
fn a_door_that_is_walled_up_is_told() {
    let place = Workplace::new();
    let said = |room_z: &str| {
        let scene =
            HOUSE.replacen("position_m = [0, 0.1, -0.15]", &format!("position_m = [0, 0.1, {room_z}]"), 1);
        place.write("scene.toml", scene + "position_m = [0, 0.0201, 0.12]\n");
        let said = place.run(["check", "scene.toml"]);
        assert_eq!(said.status, Some(0), "{}{}", said.out, said.err);
        said.out
    };
    assert!(!said("-0.15").contains("closed"));
    assert!(
        !said("-0.145").contains("closed"),
        "a wall 5 mm in front of it is in nobody's way who is inside"
    );
    assert!(said("-0.16").contains("the door of hull is closed by inside_front"), "{}", said("-0.16"));
}
