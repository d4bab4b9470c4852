//! The same input gives the same recording: twice, on every clock, and tomorrow.

use nalgebra::Vector3;
use rustix::fs::inotify::{self, CreateFlags, ReadFlags, WatchFlags};
use std::collections::HashMap;
use std::fmt::Write as _;
use std::mem::MaybeUninit;
use std::path::Path;
use system_tests::driver::Driver;
use system_tests::recording::{Sample, Table};
use system_tests::workplace::{Said, Workplace};

const SCENE: &str = include_str!("../../../config/scenes/default.toml");
const HAND: &str = include_str!("../../../config/hands/default.csv");

/// The default scene in a workplace, its hand beside it.
fn workplace() -> Workplace {
    let place = Workplace::new();
    place.write("scene.toml", SCENE.replace("../hands/", ""));
    place.write("default.csv", HAND);
    place
}

fn record(place: &Workplace, clock: &str, seconds: &str, name: &str) -> Said {
    let said = place.run([
        "run",
        "scene.toml",
        "--clock",
        clock,
        "--headless",
        "--seconds",
        seconds,
        "--record",
        name,
    ]);
    assert_eq!(said.status, Some(0), "{}", said.err);
    said
}

fn bytes(place: &Workplace, name: &str) -> Vec<u8> {
    std::fs::read(place.path(name)).expect("a recording")
}

#[test]
fn two_virtual_runs_write_the_same_bytes() {
    let place = workplace();
    record(&place, "virtual", "10", "a.csv");
    record(&place, "virtual", "10", "b.csv");
    assert!(bytes(&place, "a.csv") == bytes(&place, "b.csv"));
}

#[test]
fn a_seed_changes_nothing_where_nothing_is_random() {
    let place = workplace();
    for (seed, name) in [("0", "a.csv"), ("18446744073709551615", "b.csv")] {
        let said = place.run(["run", "scene.toml", "--clock", "virtual", "--seed", seed, "--record", name]);
        assert_eq!(said.status, Some(0), "{}", said.err);
    }
    assert!(bytes(&place, "a.csv") == bytes(&place, "b.csv"));
}

#[test]
fn two_processes_in_lockstep_write_what_one_process_writes() {
    let place = workplace();
    record(&place, "virtual", "10", "virtual.csv");
    record(&place, "lockstep", "10", "lockstep.csv");
    assert!(bytes(&place, "virtual.csv") == bytes(&place, "lockstep.csv"));
}

/// A finger that slides on a table without friction: nothing of the past is in a row, so a tick that real
/// time lost leaves no trace in later ones.
const WITHOUT_HISTORY: &str = "[[finger]]\n[[entity]]\nname = \"table\"\n\
    shape = { kind = \"plane\", normal = [0.0, 1.0, 0.0], offset_m = 0.0 }\n";
const OVER_THE_TABLE: &str =
    "t,f0_x,f0_y,f0_z\n0,0,0.01,0\n0.7,0.1,-0.004,0.03\n1.3,0,-0.001,0.05\n2,0.2,0.01,0\n";

#[test]
fn real_time_records_what_virtual_time_records_in_every_tick_that_it_kept() {
    let place = Workplace::new();
    let ideal = place.play(WITHOUT_HISTORY, OVER_THE_TABLE, &[]).finger("f0");
    let said = place.run(["run", "scene.toml", "--hand", "hand.csv", "--headless", "--record", "real.csv"]);
    assert_eq!(said.status, Some(0), "{}", said.err);
    let real = Table::read(&place.path("real.csv")).finger("f0");
    let at: HashMap<u64, &Sample> = ideal.iter().map(|s| (s.t.to_bits(), s)).collect();
    for s in &real {
        let same = Sample { applied: s.applied, ..at[&s.t.to_bits()].clone() };
        assert_eq!(*s, same, "what the motors did may be late in real time, the rest may not differ");
    }
    assert!(real.windows(2).all(|pair| pair[0].t < pair[1].t), "rows are in order");
    // Most of a run lost to a loaded machine would still be a test; all of it would not.
    assert!(real.len() > ideal.len() / 10, "{} of {} rows\n{}", real.len(), ideal.len(), said.out);
    let late = real.iter().filter(|s| s.applied != s.force).count();
    if said.out.contains(" 0 missed, 0 torn") {
        assert_eq!(late, 0, "every reply came in time, so every force was rendered\n{}", said.out);
    }
}

/// What the contract promises of the default scene's recording, in figures and as a hash.
///
/// The hash covers the columns named here, in this order, so that columns added later do not change it. The
/// numbers come from sums, products, quotients and square roots of f64 alone, which IEEE 754 rounds the same
/// everywhere, and neither Rust nor nalgebra contracts them: x86_64 and aarch64 give the same bytes.
fn summary(table: &Table) -> String {
    let mut text = String::new();
    for finger in ["f0", "f1"] {
        let samples = table.finger(finger);
        let count = |friction: &str| samples.iter().filter(|s| s.friction == friction).count();
        let peak = samples.iter().map(|s| s.force.norm()).fold(0.0, f64::max);
        let impulse = samples.iter().map(|s| s.force).sum::<Vector3<f64>>() * 1e-3;
        let _ = writeln!(
            text,
            "{finger}: {} free, {} stick, {} slip rows; peak {peak:.6} N; impulse {:.6} {:.6} {:.6} N s",
            count("free"),
            count("stick"),
            count("slip"),
            impulse.x,
            impulse.y,
            impulse.z
        );
    }
    let _ = writeln!(text, "rows: {}; hash of the contract's columns: {:016x}", table.len(), hash(table));
    text
}

/// FNV-1a over the cells of the contract's columns, each ended by a comma.
fn hash(table: &Table) -> u64 {
    let mut columns = vec!["t".to_owned()];
    for finger in ["f0", "f1"] {
        for quantity in ["hip", "god", "force", "applied"] {
            columns.extend(["x", "y", "z"].map(|axis| format!("{finger}_{quantity}_{axis}")));
        }
        columns.extend(["entity", "feature", "friction"].map(|quantity| format!("{finger}_{quantity}")));
    }
    let cells: Vec<Vec<&str>> = columns.iter().map(|column| table.texts(column)).collect();
    let bytes = (0..table.len())
        .flat_map(|row| cells.iter().flat_map(move |column| column[row].bytes().chain([b','])));
    bytes.fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
}

/// After a change of behaviour that is meant: `PHANTOM3_BLESS=1 cargo test -p system-tests --test contract
/// repeatable`, and say in the commit why the numbers moved.
#[test]
fn default_scene_is_felt_as_it_was_when_it_was_last_blessed() {
    let place = workplace();
    record(&place, "virtual", "10", "out.csv");
    let found = summary(&Table::read(&place.path("out.csv")));
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("golden/default_scene.txt");
    if std::env::var_os("PHANTOM3_BLESS").is_some() {
        std::fs::create_dir_all(file.parent().expect("a directory")).expect("the directory");
        std::fs::write(&file, &found).expect("the golden file");
    }
    let blessed = std::fs::read_to_string(&file).expect("the golden file");
    assert_eq!(found, blessed, "the default scene feels different; bless it if that is meant (see the test)");
}

/// Times that a file is opened while something is done.
fn openings(file: &Path, during: impl FnOnce()) -> usize {
    let watch = inotify::init(CreateFlags::NONBLOCK).expect("a watch");
    // Equal events in a row are told as one.
    inotify::add_watch(&watch, file, WatchFlags::OPEN | WatchFlags::CLOSE_NOWRITE).expect("a file");
    during();
    let mut room = [MaybeUninit::uninit(); 4096];
    let mut events = inotify::Reader::new(watch, &mut room);
    std::iter::from_fn(|| events.next().ok().map(|event| event.events()))
        .filter(|event| event.contains(ReadFlags::OPEN))
        .count()
}

/// A run plays the hand that was checked and recorded, whoever changes the file meanwhile.
#[test]
fn a_hand_file_is_read_once_whatever_clock_and_however_many_devices_follow_it() {
    let place = workplace();
    for clock in ["virtual", "lockstep"] {
        for mode in ["kinematic", "impedance"] {
            let run = ["run", "scene.toml", "--clock", clock, "--hand-mode", mode, "--seconds", "0.05"];
            let opened = openings(&place.path("default.csv"), || {
                let said = place.run(run);
                assert_eq!(said.status, Some(0), "{}", said.err);
            });
            assert_eq!(opened, 1, "{clock}, {mode}");
        }
    }
    let device = |finger: &str| {
        let file = place.path("default.csv");
        format!("[[device]]\nbackend = \"ideal\"\nname = \"{finger}\"\nhand = \"{}\"\n", file.display())
    };
    let config = format!("clock = \"lockstep\"\n{}{}", device("f0"), device("f1"));
    let opened = openings(&place.path("default.csv"), || drop(Driver::start(&config)));
    assert_eq!(opened, 1);
}
