//! Things that rest, and things that no finger is near, through scene file, report and recording alone.

use system_tests::recording::Table;
use system_tests::workplace::Workplace;

/// A floor and ten cubes on it, 0.1 m from each other.
fn ten_cubes(top: &str) -> String {
    format!(
        "{top}\n[[finger]]\n[[entity]]\nname = \"floor\"\ndamping_n_s_per_m = 5\n\
         shape = {{ kind = \"plane\", normal = [0, 1, 0], offset_m = 0 }}\n\
         friction = {{ model = \"coulomb\", mu = 0.4 }}\n\
         [[entity]]\nname = \"cube\"\nshape = {{ kind = \"box\", size_m = [0.04, 0.04, 0.04] }}\n\
         position_m = [0, 0.02, 0]\nmass_kg = 0.1\nstiffness_n_per_m = 500\ndamping_n_s_per_m = 5\n\
         friction = {{ model = \"coulomb\", mu = 0.4 }}\n\
         grid = {{ count = [10, 1, 1], spacing_m = [0.1, 1, 1] }}\n"
    )
}

/// Rests, then comes down beside the third cube, shoves it by 20 mm and leaves.
const HAND: &str = "t,f0_x,f0_y,f0_z\n0,-0.2,0.2,0\n2,0.15,0.2,0\n3,0.15,0.02,0\n4,0.2,0.02,0\n4.5,0.15,0.02,0\n\
                    5,0.15,0.2,0\n";

fn run(place: &Workplace, clock: &str, out: &str) -> String {
    let arguments =
        ["run", "scene.toml", "--hand", "hand.csv", "--headless", "--clock", clock, "--record", out];
    let said = place.run(arguments);
    assert_eq!(said.status, Some(0), "{}", said.err);
    said.out
}

/// The report's line of this name.
fn line<'s>(report: &'s str, name: &str) -> &'s str {
    report.lines().find(|line| line.starts_with(name)).unwrap_or_else(|| panic!("no {name}: {report}"))
}

#[test]
fn ten_cubes_at_rest_are_not_computed_unless_the_scene_forbids_sleep() {
    let place = Workplace::new();
    place.write("hand.csv", "t,f0_x,f0_y,f0_z\n0,1,1,1\n3,1,1,1\n");
    for (top, awake) in [("", 0), ("sleep = false", 10)] {
        place.write("scene.toml", ten_cubes(top));
        let report = run(&place, "virtual", "out.csv");
        let expected = format!("objects      10, {awake} of them awake in the last tick");
        assert_eq!(line(&report, "objects"), expected);
        assert!(!report.contains("\nlists"), "all fit into one list: {report}");
    }
}

#[test]
fn with_two_lists_a_run_is_felt_as_with_one_and_recorded_alike_by_one_process_and_two() {
    let place = Workplace::new();
    place.write("hand.csv", HAND);
    place.write("scene.toml", ten_cubes(""));
    run(&place, "virtual", "one.csv");
    place.write("scene.toml", ten_cubes("lists = { fast_bodies = 2 }"));
    let report = run(&place, "virtual", "two.csv");
    let lists = line(&report, "lists");
    assert!(lists.contains("came") && !lists.contains("0 came"), "{lists}");
    run(&place, "virtual", "two.mcap");
    let said = place.run(["export", "two.mcap", "exported.csv"]);
    assert_eq!(said.status, Some(0), "{}", said.err);
    let [two, exported] =
        ["two.csv", "exported.csv"].map(|file| std::fs::read_to_string(place.path(file)).unwrap());
    let differs = two.lines().zip(exported.lines()).position(|(one, other)| one != other);
    assert!(two.lines().count() == exported.lines().count() && differs.is_none(), "line {differs:?}");
    run(&place, "lockstep", "lockstep.csv");
    let [two, lockstep] = ["two.csv", "lockstep.csv"].map(|file| std::fs::read(place.path(file)).unwrap());
    assert!(two == lockstep);
    let [one, two] = ["one.csv", "two.csv"].map(|file| Table::read(&place.path(file)));
    let pushed = one.numbers("f0_force_x").iter().filter(|force| **force < -0.1).count();
    // Of the second from 0.15 to 0.2 m the finger is in the cube's side, at 0.18 m, for the last 400 ms.
    assert!(pushed > 300, "{pushed}");
    for (one, two) in one.numbers("f0_force_x").into_iter().zip(two.numbers("f0_force_x")) {
        // They rest 1e-10 m apart at most when they fall asleep, in other ticks.
        assert!((one - two).abs() < 1e-6, "{one} {two}");
    }
}

/// Whatever the machine does meanwhile, nobody is lost: the report counts them.
#[test]
fn in_real_time_the_slow_list_has_a_thread_and_every_body_is_in_one_list_at_the_end() {
    let place = Workplace::new();
    place.write("hand.csv", HAND);
    place.write("scene.toml", ten_cubes("lists = { fast_bodies = 2 }"));
    let report = run(&place, "real", "real.csv");
    let lists = line(&report, "lists");
    let counts: Vec<usize> = lists.split_whitespace().filter_map(|word| word.parse().ok()).collect();
    assert_eq!(counts[0] + counts[1], 10, "{lists}");
}
