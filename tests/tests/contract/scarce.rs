//! Commands for which threads, memory, descriptors or the length of files do not suffice: what was there before is as it
//! was, and the words name the limit.

use crate::bad_input::run_in_little_memory;
use patience::prelude::*;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};
use system_tests::c_program::library;
use system_tests::faults::scarcity::limited;
use system_tests::workplace::{Running, Said, Workplace};

const SCENE: &str = "[[finger]]\n[[entity]]\nname = \"table\"\n\
    shape = { kind = \"plane\", normal = [0.0, 1.0, 0.0], offset_m = 0.0 }\n";
const RUN: [&str; 6] = ["run", "scene.toml", "--headless", "--clock", "virtual", "--seconds"];
/// More than any machine has addresses: a thread with such a stack cannot be started.
const NO_THREAD: (&str, &str) = ("RUST_MIN_STACK", "140000000000000");

fn workplace() -> Workplace {
    let place = Workplace::new();
    place.write("scene.toml", SCENE);
    place
}

fn recorded(place: &Workplace, seconds: &str, files: &[&str]) {
    let records = files.iter().flat_map(|file| ["--record", file]);
    let said = place.run(RUN.into_iter().chain([seconds]).chain(records));
    assert_eq!(said.status, Some(0), "{}", said.err);
}

fn bytes(place: &Workplace, name: &str) -> Vec<u8> {
    std::fs::read(place.path(name)).expect("a file")
}

fn run_limited(place: &Workplace, limits: &str, arguments: &[&str]) -> Said {
    let mut program = place.phantom3();
    program.args(arguments);
    Running::start(limited(&program, limits)).wait()
}

/// `None`, which is told: this machine does not let the test be another user, for whom processes are counted.
fn with_processes(place: &Workplace, most: u32, arguments: &[&str]) -> Option<Said> {
    let mode = std::fs::Permissions::from_mode(0o777);
    std::fs::set_permissions(place.path(""), mode).expect("our own");
    let program = place.phantom3();
    let as_nobody = |what: &[&str]| {
        let mut command = place.prepare(Command::new("prlimit"));
        command.arg(format!("--nproc={most}")).args(["setpriv", "--reuid=64321", "--clear-groups"]);
        command.arg(program.get_program()).args(what);
        command
    };
    let tried = Running::start(as_nobody(&["--version"])).wait();
    if tried.status != Some(0) {
        eprintln!(
            "skipped: no other user here ({}); stacks that are too large cover the same path",
            tried.err
        );
        return None;
    }
    Some(Running::start(as_nobody(arguments)).wait())
}

#[test]
fn a_run_that_gets_no_thread_for_its_recording_leaves_the_earlier_ones_and_makes_none() {
    let place = workplace();
    recorded(&place, "0.1", &["r.mcap", "o.csv"]);
    for name in ["o.mcap", "e.jsonl"] {
        place.write(name, "earlier");
    }
    let before = place.snapshot();
    let outputs = ["--record", "o.csv", "--record", "o.mcap", "--record", "new.csv", "--record", "new.mcap"];
    let run = [&RUN[..], &["0.1", "--events", "e.jsonl"], &outputs].concat();
    let replay = [&["replay", "r.mcap"], &outputs[..]].concat();
    for arguments in [run, replay] {
        let mut program = place.phantom3();
        program.args(&arguments).env(NO_THREAD.0, NO_THREAD.1);
        let said = Running::start(program).wait();
        assert_eq!((said.status, said.out.as_str()), (Some(2), ""), "{}", said.err);
        assert!(said.err.contains("no thread could be started"), "{}", said.err);
        assert!(!said.err.contains("name a file in a directory"), "{}", said.err);
        assert!(place.snapshot() == before, "files have changed: {arguments:?}");
    }
}

#[test]
fn a_start_that_any_count_of_processes_refuses_is_told_with_its_limit_and_costs_no_recording() {
    let place = workplace();
    recorded(&place, "0.1", &["o.csv"]);
    std::fs::set_permissions(place.path("o.csv"), std::fs::Permissions::from_mode(0o666)).expect("our own");
    let before = bytes(&place, "o.csv");
    for most in [1, 2] {
        let arguments = [&RUN[..], &["0.2", "--record", "o.csv"]].concat();
        let Some(said) = with_processes(&place, most, &arguments) else { return };
        assert_eq!(said.status, Some(2), "{most}: {}", said.err);
        let limit = format!("raise the limit of processes (`ulimit -u`, now {most};");
        assert!(said.err.contains(&limit), "{most}: {}", said.err);
        assert!(bytes(&place, "o.csv") == before, "{most}");
    }
}

/// With the run's files, a recording begins with more than files may have here.
#[test]
fn a_recording_whose_beginning_does_not_fit_leaves_the_earlier_one() {
    let place = workplace();
    let cube = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
    place.write("cube.obj", cube.to_owned() + &"# a comment of twenty\n".repeat(1_500_000));
    place.write("scene.toml", "[[finger]]\n[[entity]]\nshape = { kind = \"mesh\", file = \"cube.obj\" }\n");
    place.write("o.mcap", "earlier");
    place.write("o.csv", "earlier");
    let before = place.snapshot();
    let arguments = [&RUN[..], &["0.1", "--record", "o.csv", "--record", "o.mcap"]].concat();
    // Room for the segments, which are files, too.
    let said = run_limited(&place, "-f 40000", &arguments);
    assert_eq!(said.status, Some(2), "{}", said.err);
    assert!(said.err.contains("o.mcap: File too large") && said.err.contains("ulimit -f"), "{}", said.err);
    assert!(place.snapshot() == before, "{}", said.err);
}

/// `None`, which is told: nothing here makes system calls fail.
fn with_failing(place: &Workplace, calls: &str, arguments: &[&str]) -> Option<Said> {
    let inject = format!("inject={calls}");
    let of = |what: &[&str]| {
        let mut command = place.prepare(Command::new("strace"));
        command.args(["-f", "-o", "calls.txt", "-e", &inject]).args(what);
        command
    };
    if !of(&["true"]).stderr(Stdio::null()).bounded_status().is_ok_and(|status| status.success()) {
        eprintln!("skipped: there is no strace that may trace here");
        return None;
    }
    let program = place.phantom3();
    let program = program.get_program().to_str().expect("a path in letters");
    Some(Running::start(of(&[&[program], arguments].concat())).wait())
}

#[test]
fn an_earlier_recording_that_cannot_be_emptied_is_as_it_was() {
    let place = workplace();
    for name in ["o.mcap", "o.csv"] {
        recorded(&place, "2", &[name]);
        let before = bytes(&place, name);
        let arguments = [&RUN[..], &["0.2", "--record", name]].concat();
        let Some(said) = with_failing(&place, "ftruncate:error=ENOSPC:when=1", &arguments) else { return };
        // The first may be that of a segment.
        assert_ne!(said.status, Some(0), "{}", said.err);
        assert!(bytes(&place, name) == before, "{name}: {}", said.err);
    }
}

#[test]
fn a_table_that_cannot_have_the_rights_of_the_earlier_one_leaves_nothing_beside_it() {
    let place = workplace();
    recorded(&place, "0.1", &["r.mcap", "r.csv"]);
    place.write("o.csv", "earlier");
    let arguments = ["export", "r.mcap", "o.csv"];
    let Some(said) = with_failing(&place, "fchmod:error=EPERM", &arguments) else { return };
    assert_eq!(said.status, Some(0), "{}", said.err);
    assert!(bytes(&place, "o.csv") == bytes(&place, "r.csv"), "{}", said.err);
    let names =
        std::fs::read_dir(place.path("")).expect("ours").map(|entry| entry.expect("ours").file_name());
    let left: Vec<_> = names.filter(|name| name.to_string_lossy().ends_with(".part")).collect();
    assert!(left.is_empty(), "{left:?}");
}

/// A directory that takes no other file, and a table that comes to no end.
#[test]
fn an_earlier_table_beside_which_there_is_no_place_stays_until_the_new_one_is_whole() {
    let place = workplace();
    recorded(&place, "20", &["r.mcap"]);
    for name in ["o.parquet", "o.csv"] {
        place.write(name, "earlier");
        let before = place.snapshot();
        let arguments = ["export", "r.mcap", name];
        let export = |limits: &str| {
            let mut program = place.prepare(Command::new("strace"));
            program.args(["-f", "-o", "/dev/null", "-e", "trace=fchmod", "-e", "inject=fchmod:error=EPERM"]);
            program.arg(place.phantom3().get_program()).args(arguments);
            Running::start(limited(&program, limits)).wait()
        };
        if with_failing(&place, "fchmod:error=EPERM", &["--version"]).is_none() {
            return;
        }
        std::fs::remove_file(place.path("calls.txt")).expect("of strace");
        let said = export("-f 100");
        assert_eq!(said.status, Some(3), "{name}: {}", said.err);
        assert!(said.err.contains("what was there is as it was"), "{name}: {}", said.err);
        assert!(place.snapshot() == before, "{name}: {}", said.err);
        let said = export("-f unlimited");
        assert_eq!(said.status, Some(0), "{name}: {}", said.err);
        assert!(bytes(&place, name).len() > 100_000, "{name}");
        let names: Vec<_> = place.snapshot().into_keys().collect();
        assert!(names == before.into_keys().collect::<Vec<_>>(), "{names:?}");
    }
}

#[test]
fn a_recording_for_which_there_is_too_little_memory_ends_with_words_and_not_with_a_panic() {
    let place = workplace();
    // Where the compressor is what finds none depends on the program's size.
    for kilobytes in (98_000..128_000).step_by(500) {
        let arguments = [&RUN[..], &["2", "--record", "o.mcap"]].concat();
        let said = run_limited(&place, &format!("-v {kilobytes}"), &arguments);
        // The standard library's own, where a thread finds no room for its signals' stack.
        let is_of_a_thread = said.err.contains("failed to allocate an alternative stack");
        assert!(is_of_a_thread || !said.err.contains("panicked"), "{kilobytes}: {}", said.err);
    }
}

#[test]
fn a_sound_recording_for_which_there_is_too_little_memory_is_not_called_damaged_and_half_a_table_is_none() {
    let place = workplace();
    recorded(&place, "5", &["r.mcap", "r.csv"]);
    let whole = bytes(&place, "r.csv");
    let mut refused = 0;
    for (limit, kilobytes) in [("v", 20_000..100_000), ("d", 1_000..40_000)] {
        for kilobytes in kilobytes.step_by(2_000) {
            let _ = std::fs::remove_file(place.path("o.csv"));
            let said = run_limited(&place, &format!("-{limit} {kilobytes}"), &["export", "r.mcap", "o.csv"]);
            let asked = format!("-{limit} {kilobytes}");
            assert!(!said.err.contains("damaged"), "{asked}: {}", said.err);
            match said.status {
                Some(0) => assert!(bytes(&place, "o.csv") == whole, "{asked}"),
                _ => assert!(!place.path("o.csv").exists(), "{asked}: {}", said.err),
            }
            refused += u32::from(said.err.contains("there is not enough memory to read r.mcap"));
        }
    }
    println!("{refused} limits refused in words");
}

#[test]
fn every_command_outlives_a_file_that_may_not_grow() {
    let place = workplace();
    place.write("cube.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
    let commands: [&[&str]; 7] = [
        &["check", "scene.toml"],
        &["check", "cube.obj", "--repair", "out.obj"],
        &["settings"],
        &["materials"],
        &["calibrate", "--pairs", "none.csv"],
        &["driver", "doctor"],
        &["driver", "status"],
    ];
    for arguments in commands {
        // What it says goes into files, too, here.
        let said = run_limited(&place, "-f 0", arguments);
        assert!(said.status.is_some(), "{arguments:?} is killed by a signal");
        assert_ne!(said.status, Some(0), "{arguments:?}");
    }
}

#[test]
fn a_driver_that_an_application_cannot_start_is_told_with_the_limit_that_is_the_cause() {
    let place = workplace();
    let run = ["run", "scene.toml", "--headless", "--clock", "lockstep", "--seconds", "0.1"];
    let mut worked = 0;
    for descriptors in 7..24 {
        let said = run_limited(&place, &format!("-n {descriptors}"), &run);
        worked += u32::from(said.status == Some(0));
        let is_told = said.status == Some(0) || said.err.contains("ulimit -n") || said.status == Some(127);
        assert!(is_told, "{descriptors}: {}", said.err);
        assert!(!said.err.contains("does not answer"), "{descriptors}: {}", said.err);
    }
    assert!(worked > 0);
    for processes in 1..10 {
        let Some(said) = with_processes(&place, processes, &run) else { return };
        let is_told = said.status == Some(0) || said.err.contains("ulimit -u");
        assert!(is_told, "{processes}: {}", said.err);
        assert!(!said.err.contains("is not a driver's socket"), "{processes}: {}", said.err);
    }
}

#[test]
fn a_segment_for_which_files_may_not_be_long_enough_is_told_with_the_limit() {
    let place = workplace();
    let mut command = Command::new("sh");
    let script = "(ulimit -f 100; exec \"$0\" run scene.toml --clock virtual --seconds 0.1) 2>&1 | cat";
    command.args(["-c", script]).arg(place.phantom3().get_program());
    let said = Running::start(place.prepare(command)).wait();
    assert!(said.out.contains("a shared segment: File too large"), "{}", said.out);
    assert!(said.out.contains("raise the limit of the size of files (`ulimit -f`"), "{}", said.out);
}

#[test]
fn pictures_for_which_there_is_too_little_memory_or_are_too_few_threads_are_a_fault_with_its_limit() {
    let place = workplace();
    let frames = [&RUN[..], &["0.1", "--frames", "film", "--picture-size", "64x48"]].concat();
    if place.run(&frames).err.contains("no pictures: ") {
        eprintln!("skipped: this machine cannot draw");
        return;
    }
    for megabytes in [130, 160, 200] {
        let said = run_in_little_memory(&place, megabytes, &frames);
        assert!(!said.err.contains("apt install"), "{megabytes}: {}", said.err);
        assert_ne!(said.status, Some(0), "{megabytes}: {}", said.err);
    }
    // It was made by another user than the one who comes now.
    std::fs::remove_dir_all(place.path("film")).expect("our own");
    for processes in 3..6 {
        let begun = Instant::now();
        let Some(said) = with_processes(&place, processes, &frames) else { return };
        let is_told = said.status == Some(0) || said.err.contains("ulimit -u");
        assert!(is_told, "{processes}: {}", said.err);
        // It had waited for half a minute.
        assert!(begun.elapsed() < Duration::from_secs(25), "{processes}: {:?}", begun.elapsed());
    }
}

/// The library waits for ever for threads that it did not get, and tells nobody.
#[test]
fn a_graphics_library_that_lacks_a_single_thread_holds_no_run() {
    let place = workplace();
    let Some(few) = library("few_threads", &place.path("")) else { return };
    let mut program = place.phantom3();
    program.args(RUN).args(["0.1", "--frames", "film", "--picture-size", "64x48", "--record", "o.csv"]);
    program.env("LD_PRELOAD", few);
    let begun = Instant::now();
    let said = Running::start(program).wait();
    if said.status == Some(0) || !said.err.contains("drew nothing within") && said.err.contains("no pictures")
    {
        eprintln!("skipped: this machine does not draw with Mesa's threads: {}", said.err);
        return;
    }
    assert_eq!(said.status, Some(3), "{}{}", said.out, said.err);
    assert!(said.err.contains("lacks one of its threads"), "{}", said.err);
    assert!(begun.elapsed() < Duration::from_secs(20), "{:?}", begun.elapsed());
    assert!(said.out.contains("MISSING NOT COMPLETE"), "{}", said.out);
    assert!(said.out.contains("o.csv (100 rows)"), "{}", said.out);
}

#[test]
fn pictures_without_a_graphics_library_are_a_fault_and_the_run_goes_to_its_end() {
    let place = workplace();
    // No library, though it is called so.
    for name in ["libEGL.so", "libEGL.so.1"] {
        place.write(name, "");
    }
    let mut program = place.phantom3();
    program.args(RUN).args(["0.1", "--snapshot", "0.05:p.png", "--record", "o.csv"]);
    program.env("LD_LIBRARY_PATH", place.path(""));
    let said = Running::start(program).wait();
    assert_eq!(said.status, Some(3), "{}{}", said.out, said.err);
    assert!(said.err.contains("no pictures: ") && said.err.contains("apt install libegl1"), "{}", said.err);
    assert!(said.out.contains("pictures     0, 1 MISSING NOT COMPLETE"), "{}", said.out);
    assert!(said.out.contains("o.csv (100 rows)"), "{}", said.out);
}

#[test]
fn pictures_for_which_too_few_files_may_be_open_are_told_with_the_limit() {
    let place = workplace();
    let picture = [&RUN[..], &["0.1", "--snapshot", "0.05:p.png"]].concat();
    if place.run(&picture).err.contains("no pictures: ") {
        eprintln!("skipped: this machine cannot draw");
        return;
    }
    let files = ["--record", "1.mcap", "--record", "2.csv", "--record", "3.csv"];
    for descriptors in 7..20 {
        let limit = format!("-n {descriptors}");
        let said = run_limited(&place, &limit, &[&picture[..], &files].concat());
        assert!(!said.err.contains("apt install"), "{descriptors}: {}", said.err);
        let is_told = said.status == Some(0) || said.err.contains("ulimit -n") || said.status == Some(127);
        assert!(is_told, "{descriptors}: {}", said.err);
    }
}

/// A full disk takes the layout and not the figure.
#[test]
fn a_calibration_whose_figure_does_not_fit_says_that_the_layout_is_written() {
    let place = workplace();
    let mut pairs = String::new();
    for i in 0..60 {
        let t = f64::from(i) * 0.1;
        let (x, y, z) = (0.06 * (5.0 * t).sin(), 0.06 * (3.1 * t).sin(), 0.06 * (4.3 * t + 1.0).sin());
        pairs += &format!("{x:?},{y:?},{z:?},{:?},{y:?},{z:?}\n", x + 0.1);
    }
    place.write("pairs.csv", pairs);
    let arguments = ["calibrate", "--pairs", "pairs.csv", "--write", "l.toml", "--plot", "p.svg"];
    // 2 or 4 kB.
    let script = "(ulimit -f 4; \"$0\" \"$@\"; echo \"status $?\") 2>&1 | cat";
    let mut command = Command::new("sh");
    command.args(["-c", script]).arg(place.phantom3().get_program()).args(arguments);
    let said = Running::start(place.prepare(command)).wait();
    assert!(said.out.contains("status 3"), "{}", said.out);
    assert!(said.out.contains("p.svg: cannot be written: File too large"), "{}", said.out);
    assert!(said.out.contains("the layout is written to l.toml: only the figure is missing"), "{}", said.out);
    assert!(place.path("l.toml").exists() && !place.path("p.svg").exists());
}

#[test]
fn a_live_calibration_that_cannot_begin_leaves_earlier_pairs() {
    let place = workplace();
    place.write("pairs.csv", "earlier");
    let said = place.run(["calibrate", "--live", "none.sock", "--save-pairs", "pairs.csv"]);
    assert_eq!(said.status, Some(2), "{}", said.err);
    assert_eq!(bytes(&place, "pairs.csv"), b"earlier");
    let said = place.run(["calibrate", "--live", "none.sock", "--save-pairs", "none/pairs.csv"]);
    assert!(said.status == Some(2) && said.err.contains("none/pairs.csv"), "{}", said.err);
}

/// Longest wait of a user, with a machine that does something else besides.
const SOON: Duration = Duration::from_secs(20);

#[test]
fn pairs_from_a_pipe_that_nobody_writes_are_refused_at_once_and_others_are_read() {
    let place = workplace();
    let (mode, kind) = (rustix::fs::Mode::RUSR | rustix::fs::Mode::WUSR, rustix::fs::FileType::Fifo);
    rustix::fs::mknodat(rustix::fs::CWD, place.path("pipe"), kind, mode, 0).expect("a pipe");
    let mut program = place.phantom3();
    program.args(["calibrate", "--pairs", "pipe"]);
    let mut running = Running::start(program);
    assert_eq!(running.child.wait_within(SOON).code(), Some(2));
    assert!(running.said_so_far().contains("nobody writes this pipe"), "{}", running.said_so_far());
    let script = "{ sleep 0.3; echo 1 2 3; } | \"$0\" calibrate --pairs /dev/stdin";
    let said = place.shell(script, &[]);
    assert!(said.err.contains("/dev/stdin") && said.err.contains('3'), "a row of three: {}", said.err);
    assert!(!said.err.contains("nobody writes"), "{}", said.err);
}

#[test]
fn a_layout_written_through_a_link_that_leads_to_nothing_yet_is_made_where_the_link_leads() {
    let place = workplace();
    place.write("pairs.csv", "0 0 0 0.1 0 0\n0.1 0 0 0.2 0 0\n0 0.1 0 0.1 0.1 0\n0 0 0.1 0.1 0 0.1\n");
    std::os::unix::fs::symlink("there.toml", place.path("link.toml")).expect("a link");
    let said = place.run(["calibrate", "--pairs", "pairs.csv", "--write", "link.toml"]);
    assert_eq!(said.status, Some(0), "{}", said.err);
    assert!(place.path("link.toml").symlink_metadata().expect("there").is_symlink());
    assert!(std::fs::read_to_string(place.path("there.toml")).expect("made").contains("[[device]]"));
    assert!(Path::new(&place.path("link.toml")).exists());
}
