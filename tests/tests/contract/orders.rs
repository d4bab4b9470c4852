//! Orders through the whole program: what is told of them, what is recorded, and that it plays again.

#![allow(non_snake_case)] // Names carry their frames: is_WC is the camera's pose in the world.

use nalgebra::{Isometry3, Point3, Quaternion, UnitQuaternion, Vector3};
use system_tests::recording::Table;
use system_tests::workplace::{Said, Workplace};

/// A finger over a plate with a cube on it, and a second cube far away.
const SCENE: &str = "hand = \"hand.csv\"\n[[finger]]\nstart_m = [0, 0.06, 0]\n[[entity]]\nname = \"plate\"\n\
    shape = { kind = \"box\", size_m = [0.6, 0.02, 0.6] }\nposition_m = [0, -0.01, 0]\nstiffness_n_per_m = 2000\n\
    friction = { model = \"coulomb\", mu = 0.5 }\n[[entity]]\nname = \"cube\"\nmass_kg = 0.1\n\
    shape = { kind = \"box\", size_m = [0.04, 0.04, 0.04] }\nposition_m = [0, 0.021, 0]\nstiffness_n_per_m = 1000\n\
    damping_n_s_per_m = 2\nfriction = { model = \"coulomb\", mu = 0.5 }\n[[entity]]\nname = \"other\"\nmass_kg = 0.1\n\
    shape = { kind = \"box\", size_m = [0.04, 0.04, 0.04] }\nposition_m = [0.25, 0.1, 0.2]\n\
    friction = { model = \"coulomb\", mu = 0.5 }\n";
/// Another one: a ball in a mesh's place.
const NEXT: &str = "[[finger]]\nstart_m = [0, 0.06, 0]\n[[entity]]\nname = \"ground\"\n\
    shape = { kind = \"plane\", normal = [0, 1, 0], offset_m = 0.04 }\n[[entity]]\nname = \"block\"\nmass_kg = 0.1\n\
    shape = { kind = \"mesh\", file = \"cube.obj\", scale = 0.02 }\nposition_m = [0.2, 0.1, 0]\n";
const CUBE: &str = "v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1\n\
    f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 4 8 7 3\nf 1 5 8 4\nf 2 3 7 6\n";
/// Down onto the cube, then still.
const HAND: &str = "t,f0_x,f0_y,f0_z\n0,0,0.06,0\n0.3,0,0.037,0\n0.6,0.002,0.037,0\n3,0.002,0.037,0\n";
const ALL_SLOW: &str = "lists = { fast_bodies = 0 }\n";

fn workplace(scene: &str) -> Workplace {
    let place = Workplace::new();
    place.write("scene.toml", scene);
    place.write("next.toml", NEXT);
    place.write("hand.csv", HAND);
    std::fs::create_dir(place.path("models")).expect("a directory");
    place.write("models/cube.obj", CUBE);
    place
}

fn run(place: &Workplace, orders: &str, clock: &str, more: &[&str]) -> Said {
    place.write("orders.txt", orders);
    let usual = ["run", "scene.toml", "--clock", clock, "--seconds", "2.5", "--orders", "orders.txt"];
    let said = place.run(usual.iter().chain(&["--set", "data.meshes=[\"models\"]"]).chain(more));
    assert_eq!(said.status, Some(0), "{}{}", said.out, said.err);
    said
}

fn identical(place: &Workplace, recording: &str) {
    let said = place.run(["replay", recording, "--expect-same"]);
    assert!(
        said.status == Some(0) && said.out.contains("identical"),
        "{recording}: {}{}",
        said.out,
        said.err
    );
}

/// The events of a kind: their ticks, and what stands in a column.
fn told<'t>(events: &'t Table, kind: &str, column: &str) -> Vec<(&'t str, &'t str)> {
    let of_kind = |((is, tick), cell): ((&'t str, &'t str), &'t str)| (is == kind).then_some((tick, cell));
    events
        .texts("kind")
        .into_iter()
        .zip(events.texts("tick"))
        .zip(events.texts(column))
        .filter_map(of_kind)
        .collect()
}

const MANY: &str = "at 0.4 stiffness 1.5\nat 0.5 trial 3 begins\nat 0.5 key 32 down  # space\nat 0.6 friction cube coulomb mu=0.3\n\
    at 0.9 turn plate about 0 1 0 by 0.2 in 0.3\nat 1.0 pause\nat 1.3 resume\nat 1.5 move other to 0.1 0.06 0 in 0.1\n\
    at 1.9 reset\nat 2.2 trial 3 ends\n";

#[test]
fn orders_are_in_a_recording_and_are_given_again_in_their_ticks() {
    for scene in [SCENE.to_owned(), format!("{ALL_SLOW}{SCENE}")] {
        let place = workplace(&scene);
        run(&place, MANY, "virtual", &["--record", "out.mcap", "--record", "out.csv"]);
        identical(&place, "out.mcap");
        // And they did something.
        run(&place, "", "virtual", &["--record", "without.csv"]);
        let [with, without] = ["out.csv", "without.csv"].map(|file| Table::read(&place.path(file)));
        let force = |table: &Table| table.numbers("f0_force_y")[480];
        assert!((force(&with) / force(&without) - 1.5).abs() < 0.2, "{} {}", force(&with), force(&without));
        assert!(with.numbers("other_x")[1990] < 0.2 && without.numbers("other_x")[1990] > 0.2);
        assert_eq!(with.columns().contains(&"other_list".into()), scene.starts_with(ALL_SLOW));
    }
}

#[test]
fn keys_trials_orders_and_resets_are_told_in_their_ticks_and_every_contact_that_began_ends() {
    let place = workplace(SCENE);
    let said = run(&place, MANY, "virtual", &["--events", "events.csv"]);
    assert!(said.out.contains("\norders       10\n"), "{}", said.out);
    let events = Table::read(&place.path("events.csv"));
    assert_eq!(told(&events, "trial-begin", "number"), [("500", "3")]);
    assert_eq!(told(&events, "trial-end", "number"), [("2200", "3")]);
    assert_eq!(told(&events, "key-down", "number"), [("500", "32")]);
    let orders = told(&events, "order", "text");
    assert_eq!(orders.len(), 10);
    assert_eq!(orders[2], ("500", "key 32 down"));
    // A tenth of a second of fading: its hundredth tick is without force.
    assert_eq!(told(&events, "reset", "kind"), [("1999", "reset")]);
    let at_reset = |kind: &str, entity: &str| told(&events, kind, "entity").contains(&("1999", entity));
    assert!(
        at_reset("contact-end", "cube") && at_reset("contact-begin", "cube"),
        "a new contact in the new world"
    );
    for (begin, end) in [("contact-begin", "contact-end"), ("pair-begin", "pair-end"), ("grasp", "release")] {
        let (begun, ended) = (told(&events, begin, "entity").len(), told(&events, end, "entity").len());
        assert!(begun >= ended && begun <= ended + 4, "{begin}: {begun} {ended}");
    }
}

#[test]
fn another_scene_is_told_by_its_own_names_and_recorded_beside_the_first() {
    for scene in [SCENE.to_owned(), format!("{ALL_SLOW}{SCENE}")] {
        let place = workplace(&scene);
        let more = ["--record", "out.mcap", "--record", "out.csv", "--events", "events.csv"];
        let said = run(&place, "at 1 swap next.toml\nat 1.5 stiffness 2 of ground", "virtual", &more);
        assert!(
            said.out.contains("out.2.mcap") && said.err.contains("next.toml goes on"),
            "{}{}",
            said.out,
            said.err
        );
        let [first, second] = ["out.csv", "out.2.csv"].map(|file| Table::read(&place.path(file)));
        assert_eq!((first.len(), second.len()), (1099, 1401));
        assert_eq!((first.numbers("t")[1098], second.numbers("t")[0]), (1.098, 1.099));
        assert!(first.columns().contains(&"cube_x".into()) && second.columns().contains(&"block_x".into()));
        let events = Table::read(&place.path("events.csv"));
        assert_eq!(told(&events, "scene", "text"), [("1099", "next.toml")]);
        // The finger is in the ground at once, and the block falls onto it.
        assert_eq!(told(&events, "contact-begin", "entity").last(), Some(&("1099", "ground")));
        assert!(told(&events, "contact-end", "entity").contains(&("1099", "cube")));
        let fell = told(&events, "pair-begin", "entity");
        assert!(
            fell.iter()
                .any(|(tick, entity)| *entity == "block" && tick.parse::<u64>().is_ok_and(|t| t > 1100))
        );
        for recording in ["out.mcap", "out.2.mcap"] {
            identical(&place, recording);
        }
        let said = place.run(["export", "out.2.mcap", "--csv", "again.csv"]);
        assert_eq!(said.status, Some(0), "{}", said.err);
        let [second, again] =
            ["out.2.csv", "again.csv"].map(|file| std::fs::read(place.path(file)).expect("a file"));
        assert!(second == again);
    }
}

#[test]
fn in_real_time_worlds_with_two_lists_take_over_from_each_other_and_lose_nobody() {
    let place = workplace(&format!("{ALL_SLOW}{SCENE}"));
    place.write("next.toml", format!("{ALL_SLOW}{NEXT}"));
    let orders = "at 0.3 reset\nat 0.8 pause\nat 1 resume\nat 1.2 friction plate none\nat 1.4 swap next.toml\nat 1.8 reset";
    let said = run(&place, orders, "real", &["--events", "events.jsonl"]);
    let line = said.out.lines().find(|line| line.starts_with("lists")).expect("two lists");
    let counts: Vec<usize> = line.split_whitespace().filter_map(|word| word.parse().ok()).collect();
    assert_eq!(counts[0] + counts[1], 1, "{line}");
    assert!(said.out.contains("\norders       6\n"), "{}", said.out);
}

/// Ten cubes, of which a finger goes to and fro over some, and one that falls.
#[test]
fn pairs_are_told_once_whichever_list_they_are_in_and_however_often_that_changes() {
    let scene = "[[finger]]\n[[entity]]\nname = \"floor\"\ndamping_n_s_per_m = 5\n\
         shape = { kind = \"plane\", normal = [0, 1, 0], offset_m = 0 }\nfriction = { model = \"coulomb\", mu = 0.4 }\n\
         [[entity]]\nname = \"cube\"\nshape = { kind = \"box\", size_m = [0.04, 0.04, 0.04] }\n\
         position_m = [0, 0.02, 0]\nmass_kg = 0.1\nstiffness_n_per_m = 500\ndamping_n_s_per_m = 5\n\
         friction = { model = \"coulomb\", mu = 0.4 }\ngrid = { count = [9, 1, 1], spacing_m = [0.1, 1, 1] }\n\
         [[entity]]\nname = \"drop\"\nshape = { kind = \"box\", size_m = [0.04, 0.04, 0.04] }\n\
         position_m = [0.3, 0.3, 0.6]\nmass_kg = 0.1\nstiffness_n_per_m = 500\nrestitution = 0.6\n\
         friction = { model = \"coulomb\", mu = 0.4 }\n";
    let mut hand = String::from("t,f0_x,f0_y,f0_z\n");
    for step in 0..=20_u32 {
        // 15 mm above them, 0.8 m in 0.2 s.
        hand += &format!("{:?},{:?},0.055,0\n", 0.2 * f64::from(step), 0.8 * f64::from(step % 2));
    }
    let events = |lists: &str| {
        let place = Workplace::new();
        place.write("scene.toml", format!("{lists}{scene}"));
        place.write("hand.csv", &hand);
        let said = place.run([
            "run",
            "scene.toml",
            "--hand",
            "hand.csv",
            "--clock",
            "virtual",
            "--events",
            "events.csv",
        ]);
        assert_eq!(said.status, Some(0), "{}", said.err);
        Table::read(&place.path("events.csv"))
    };
    let [one, two] = ["", ALL_SLOW].map(events);
    let handed = told(&two, "list-change", "text");
    let to = |list: &str| handed.iter().filter(|(_, to)| *to == list).count();
    assert!(to("fast") > 20 && to("slow") > 20, "{} {}", to("fast"), to("slow"));
    for kind in ["pair-begin", "pair-end"] {
        let whom = |events: &Table| {
            let mut names: Vec<String> =
                told(events, kind, "entity").iter().map(|(_, name)| (*name).into()).collect();
            names.sort();
            names
        };
        assert_eq!(whom(&one), whom(&two), "{kind}");
    }
    assert_eq!(told(&two, "pair-begin", "entity").iter().filter(|(_, name)| *name != "drop").count(), 9);
    // The cubes rest until the run ends, and change lists meanwhile.
    let bounces = |events: &Table| -> Vec<f64> {
        let names = told(events, "pair-end", "entity");
        let impulses = told(events, "pair-end", "impulse_y_n_s");
        let of_drop = names.iter().zip(&impulses).filter(|((_, name), _)| *name == "drop");
        of_drop.map(|(_, (_, cell))| cell.parse().expect("a number")).collect()
    };
    let [one, two] = [&one, &two].map(bounces);
    assert!(!one.is_empty() && one.len() == two.len(), "{one:?}");
    for (one, two) in one.iter().zip(&two) {
        // The same motion, ten ticks at once or one by one.
        assert!((one - two).abs() < 1e-12, "{one} {two}");
    }
}

#[test]
fn what_leaves_the_world_is_told_from_either_list() {
    let leaving = SCENE
        .replace("position_m = [0.25, 0.1, 0.2]", "position_m = [99.5, 0.1, 0.2]\nvelocity_m_s = [1, 0, 0]");
    for scene in [leaving.clone(), format!("{ALL_SLOW}{leaving}")] {
        let place = workplace(&scene);
        run(&place, "", "virtual", &["--events", "events.csv"]);
        let events = Table::read(&place.path("events.csv"));
        let parked = told(&events, "parked", "entity");
        let [(tick, "other")] = parked[..] else { panic!("{parked:?}") };
        // It falls meanwhile by a metre, which is next to nothing of 100 m; two turns of the slow list later at most.
        let tick: u64 = tick.parse().expect("a number");
        assert!((485..=525).contains(&tick), "{tick}");
    }
}

/// A finger over a floor whose device goes with the camera; at first its base is the world's origin.
const CARRIED: &str = "hand = \"hand.csv\"\n[[finger]]\nstart_m = [0, 0.06, 0]\n[[entity]]\nname = \"floor\"\n\
    shape = { kind = \"plane\", normal = [0, 1, 0], offset_m = 0 }\nstiffness_n_per_m = 500\n\
    friction = { model = \"coulomb\", mu = 0.5 }\n";
const LAYOUT: &str = "master = 0\nattached_to = \"camera\"\n[camera]\nposition_m = [0, 0.2, 0.4]\n[[device]]\n\
    position_m = [0, -0.2, -0.4]\n";
/// A path's speed and how sharply it changes: 0.5 m/s and 5 m/s^2 in a tick, and what a turn adds at 0.45 m from the camera.
const MOST_WAY_M: f64 = 0.5e-3 + 1e-9;
const MOST_CHANGE_M: f64 = 5e-6 + 0.5 * 0.5 / 0.4 * 1e-6;

/// A run of 4.5 s whose devices go with the camera, recorded both ways.
fn carried(hand: &str, orders: &str) -> (Workplace, Table) {
    let place = workplace(CARRIED);
    place.write("hand.csv", hand);
    place.write("layout.toml", LAYOUT);
    place.write("orders.txt", orders);
    let run = ["run", "scene.toml", "--clock", "virtual", "--seconds", "4.5", "--orders", "orders.txt"];
    let more = ["--layout", "layout.toml", "--record", "run.csv", "--record", "run.mcap"];
    let said = place.run(run.iter().chain(&more));
    assert_eq!(said.status, Some(0), "{}{}", said.out, said.err);
    let table = Table::read(&place.path("run.csv"));
    (place, table)
}

#[test]
fn devices_that_are_attached_to_the_camera_go_where_an_order_has_it_and_stay_there_through_a_reset() {
    // When they are there, and on their way.
    carried_through_a_reset([0.1, 0.2, 0.45], "3.8");
    carried_through_a_reset([0.1, 0.2, 0.45], "0.5");
    carried_through_a_reset([0.0, 0.2, 0.4], "0.5");
}

fn carried_through_a_reset([x, y, z]: [f64; 3], at: &str) {
    let turned = format!("at 0.2 camera at {x} {y} {z} 0.92387953 0 0.38268343 0\nat {at} reset\n");
    let (place, table) = carried("t,f0_x,f0_y,f0_z\n0,0,0.06,0\n", &turned);
    let hips: Vec<Vector3<f64>> = table.finger("f0").iter().map(|sample| sample.hip).collect();
    let was_WC = Isometry3::translation(0.0, 0.2, 0.4);
    let turn = UnitQuaternion::new_normalize(Quaternion::new(0.92387953, 0.0, 0.38268343, 0.0));
    let is_WC = Isometry3::from_parts(Vector3::new(x, y, z).into(), turn);
    let start = Vector3::new(0.0, 0.06, 0.0);
    let end = (is_WC * was_WC.inverse() * Point3::from(start)).coords;
    assert!(hips[..200].iter().all(|hip| (hip - start).norm() < 1e-12), "before the order");
    // Eight digits of a quaternion, half a metre away.
    assert!(hips[3700..].iter().all(|hip| (hip - end).norm() < 1e-7), "{} {end}", hips[hips.len() - 1]);
    for ticks in hips.windows(3) {
        let [a, b, c] = [ticks[0], ticks[1], ticks[2]];
        assert!((b - a).norm() <= MOST_WAY_M && (c - b - (b - a)).norm() <= MOST_CHANGE_M, "{ticks:?}");
    }
    identical(&place, "run.mcap");
}

#[test]
fn a_finger_that_presses_while_the_camera_goes_feels_no_blow() {
    // 3 mm deep, then carried 5 cm aside and 1 cm down, and back up before it is there.
    let hand = "t,f0_x,f0_y,f0_z\n0,0,0.06,0\n0.3,0,-0.003,0\n5,0,-0.003,0\n";
    let orders = "at 0.5 camera at 0.05 0.19 0.4 1 0 0 0\nat 0.6 camera at 0 0.2 0.4 1 0 0 0\nat 1.2 camera at 0.05 0.19 0.4 1 0 0 0\n";
    let (place, table) = carried(hand, orders);
    let samples = table.finger("f0");
    for ticks in samples[400..].windows(2) {
        let [step, way] = [ticks[1].force - ticks[0].force, ticks[1].hip - ticks[0].hip];
        // The spring's way in a tick; what the cone lets go of sideways is as much again at most.
        assert!(
            way.norm() <= MOST_WAY_M && step.norm() <= 500.0 * 1.5 * MOST_WAY_M,
            "{} s: {step} N",
            ticks[1].t
        );
    }
    let last = &samples[samples.len() - 1];
    assert!((last.hip - Vector3::new(0.05, -0.013, 0.0)).norm() < 1e-9, "{}", last.hip);
    assert!((last.force.y - 6.5).abs() < 1e-6, "13 mm of 500 N/m: {}", last.force);
    identical(&place, "run.mcap");
}

#[test]
fn a_camera_that_carries_nobody_is_refused() {
    let place = workplace(CARRIED);
    place.write("orders.txt", "at 0.2 camera at 0 0 0 1 0 0 0\n");
    let said = place.run(["run", "scene.toml", "--clock", "virtual", "--orders", "orders.txt"]);
    assert_eq!(said.status, Some(2), "{}", said.err);
    assert!(
        said.err.contains("orders.txt:1: no device goes with the camera") && said.err.contains("attached_to"),
        "{}",
        said.err
    );
}

/// Whether these words are an example of a form: capitals stand for any word, `a|b` for one of them.
fn is_example(words: &[&str], form: &[&str]) -> bool {
    let fits = |(word, part): (&&str, &&str)| match part.chars().next() {
        Some('A'..='Z') => !word.is_empty(),
        _ => part.split('|').any(|choice| choice == *word),
    };
    words.len() == form.len() && words.iter().zip(form).all(fits)
}

#[test]
fn every_form_of_an_order_has_an_example_in_the_help_and_in_the_readme() {
    let place = workplace(SCENE);
    place.write("orders.txt", "at 1 dance\n");
    let refusal = place.run(["run", "scene.toml", "--clock", "virtual", "--orders", "orders.txt"]).err;
    let (_, known) = refusal.split_once("allowed: ").expect("what is allowed");
    let readme = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../README.md");
    let readme = std::fs::read_to_string(readme).expect("README.md");
    for (name, text) in [("help", place.run(["run", "--help"]).out), ("README.md", readme)] {
        let words: Vec<&str> =
            text.split_whitespace().map(|word| word.trim_matches(['`', ';', ','])).collect();
        for form in known.trim().split("; ") {
            // What may be left out is shown at least once.
            let form: Vec<&str> =
                form.split_whitespace().map(|part| part.trim_matches(['[', ']', '.'])).collect();
            let is_shown = words.windows(form.len()).any(|words| is_example(words, &form));
            assert!(is_shown, "{name} has no example of {}", form.join(" "));
        }
    }
}
