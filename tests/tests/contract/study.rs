//! `phantom3 study stiffness` as somebody meets it who has a question about the system.

use rustix::process::{Pid, Signal, kill_process};
use std::time::Duration;
use system_tests::workplace::{Running, Workplace};

const SMALL: [&str; 10] = [
    "study",
    "stiffness",
    "--rates",
    "1000",
    "--modes",
    "same-tick,next-tick",
    "--dampings",
    "0",
    "--hands",
    "pen-grip:light",
];

#[test]
fn a_study_writes_table_csv_and_pictures_that_are_the_same_every_time() {
    let place = Workplace::new();
    let first = place.run([&SMALL[..], &["--out", "a", "--jobs", "2"]].concat());
    assert_eq!(first.status, Some(0), "{}", first.err);
    for word in ["settled", "quiet", "linear", "passive", "friction", "Why they differ", "a/stiffness.csv"] {
        assert!(first.out.contains(word), "no `{word}` in:\n{}", first.out);
    }
    assert_eq!(place.run([&SMALL[..], &["--out", "b", "--jobs", "1"]].concat()).status, Some(0));
    let read = |name: &str| std::fs::read(place.path(name)).expect(name);
    for name in ["stiffness.csv", "stiffness.svg", "stiffness.png"] {
        assert_eq!(read(&format!("a/{name}")), read(&format!("b/{name}")), "{name}");
    }
    let csv = String::from_utf8(read("a/stiffness.csv")).expect("text");
    let mut lines = csv.lines();
    let head: Vec<&str> = lines.next().expect("a header").split(',').collect();
    let rows: Vec<Vec<&str>> = lines.map(|line| line.split(',').collect()).collect();
    assert_eq!(rows.len(), 2, "{csv}");
    let number = |row: &[&str], name: &str| -> f64 {
        row[head.iter().position(|column| *column == name).expect(name)].parse().expect("a number")
    };
    let settled: Vec<f64> = rows.iter().map(|row| number(row, "settled_n_per_m")).collect();
    assert!(settled[0] > 1.5 * settled[1], "a tick of delay costs stiffness: {csv}");
    assert!(rows.iter().all(|row| number(row, "linear_n_per_m") > number(row, "passive_n_per_m")), "{csv}");
}

#[test]
fn a_finger_that_is_kept_passive_settles_in_front_of_stiffer_walls_and_feels_ordinary_ones_as_they_are() {
    let place = Workplace::new();
    let said = place.run([&SMALL[..], &["--out", "a", "--passivity"]].concat());
    assert_eq!(said.status, Some(0), "{}", said.err);
    assert!(said.out.contains("kept fed") && said.out.contains("Why they differ"), "{}", said.out);
    let csv = std::fs::read_to_string(place.path("a/stiffness.csv")).expect("a table");
    let mut lines = csv.lines();
    let head: Vec<&str> = lines.next().expect("a header").split(',').collect();
    for line in lines {
        let cells: Vec<&str> = line.split(',').collect();
        assert_eq!(cells.len(), head.len(), "{line}");
        let number = |name: &str| -> f64 {
            cells[head.iter().position(|column| *column == name).expect(name)].parse().expect("a number")
        };
        assert!(number("kept_n_per_m") > 3.0 * number("settled_n_per_m"), "{line}");
        assert_eq!((number("half_changed_rms_n"), number("half_changed_most_n")), (0.0, 0.0), "{line}");
        assert!(number("twice_changed_most_n") > 0.1, "{line}");
        assert!(number("twice_kept_fed_j") < number("twice_fed_j"), "{line}");
    }
}

#[test]
fn whatever_is_wrong_is_told_before_the_first_trial() {
    let place = Workplace::new();
    place.write("a-file", "");
    place.write("ideal.toml", "kind = \"ideal\"\nname = \"x\"\n");
    let cases: [(&[&str], &[&str]); 9] = [
        (&["--hands", "fist"], &["fist", "pen-grip", "fingertip"]),
        (&["--hands", "pen-grip:hard"], &["hard", "light, usual, firm"]),
        (&["--device", "omni"], &["omni", "premium-1.5", "wooden-haptics"]),
        (&["--device", "ideal.toml"], &["ideal.toml", "nothing to simulate", "premium-1.5"]),
        (&["--rates", "1"], &["found 1, allowed: 100 to 20000 Hz"]),
        (&["--dampings", "nan"], &["found nan", "0 to 100 N s/m"]),
        (&["--modes", "never"], &["never", "same-tick", "fixed-phase", "next-tick"]),
        (&["--push-mm", "0"], &["found 0, allowed: 0.01 to 20 mm"]),
        (&["--out", "a-file"], &["cannot make the directory a-file"]),
    ];
    for (arguments, words) in cases {
        let said = place.run([&SMALL[..2], arguments].concat());
        assert_eq!(said.status, Some(2), "{arguments:?}: {}", said.err);
        for word in words {
            assert!(said.err.contains(word), "{arguments:?} does not say `{word}`: {}", said.err);
        }
        assert!(!place.path("study-stiffness").exists(), "{arguments:?}");
    }
}

#[test]
fn the_study_of_integrators_writes_tables_and_pictures_and_says_what_is_wrong_with_its_arguments() {
    let place = Workplace::new();
    let small = ["study", "integrators", "--spins", "100", "--seconds", "2", "--masses", "0.001,0.1"];
    let said = place.run([&small[..], &["--out", "a"]].concat());
    assert_eq!(said.status, Some(0), "{}", said.err);
    let words = ["implicit", "rk4", "thesis-euler-gyroscopic", "beyond", "a/integrators-spin.csv"];
    for word in words.into_iter().chain(["runs away (ch. 8.2.6)", "no number any more after 0.00"]) {
        assert!(said.out.contains(word), "no `{word}` in:\n{}", said.out);
    }
    for name in ["integrators.svg", "integrators.png"] {
        assert!(place.path(format!("a/{name}")).exists(), "{name}");
    }
    let read = |name: &str| std::fs::read_to_string(place.path(format!("a/{name}"))).expect(name);
    assert_eq!(read("integrators-spin.csv").lines().count(), 1 + 5);
    // The printed equation throws a leaning disc over by the factor of its closed form, and ends; ours does neither.
    let leans = read("integrators-lean.csv");
    let growths = |integrator: &str| -> Vec<f64> {
        let row = leans.lines().find_map(|line| line.strip_prefix(&format!("{integrator},100,")));
        row.expect("a row").split(',').map(|cell| cell.parse().expect("a number")).collect()
    };
    let (printed, ours) = (growths("thesis-euler-printed"), growths("implicit"));
    assert!(printed[1] > 400.0 && (printed[0] / printed[1] - 1.0).abs() < 1e-5, "{printed:?}");
    // 0.1 rad a tick, the middle of which is off by its square over 24 of a lean of a billionth.
    assert!((ours[0] - 1.0).abs() < 1e-5 && ours[1] == 1.0, "{ours:?}");
    let stays = read("integrators-stiffness.csv");
    // The default has no limit where Euler's method ends near 2 m / dt^2.
    assert!(stays.contains("implicit,0.001,100000,1"), "{stays}");
    let of_gram = stays.lines().find_map(|line| line.strip_prefix("thesis-euler,0.001,")).expect("a row");
    let limit: f64 = of_gram.split(',').next().and_then(|cell| cell.parse().ok()).expect("a number");
    assert!((1500.0..2050.0).contains(&limit), "{limit}");
    for (arguments, word) in [(["--integrators", "euler"], "thesis-euler"), (["--masses", "0"], "kg")] {
        let said = place.run([&small[..2], &arguments[..]].concat());
        assert_eq!(said.status, Some(2), "{}", said.err);
        assert!(said.err.contains(word), "{}", said.err);
    }
}

#[test]
fn ctrl_c_ends_a_study() {
    let place = Workplace::new();
    let mut program = place.phantom3();
    program.args(["study", "stiffness"]);
    let running = Running::start(program);
    // By then it searches, or it is about to: either way it ends.
    std::thread::sleep(Duration::from_millis(500));
    kill_process(Pid::from_child(&running.child), Signal::INT).expect("it runs");
    let said = running.wait();
    assert_eq!(said.status, Some(130), "{}", said.err);
    assert!(said.err.contains("ended by signal 2"), "{}", said.err);
}
