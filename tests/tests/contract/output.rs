//! What happens to a recording when its disk fails, and to a run when nobody reads what it says.

use patience::prelude::*;
use std::path::PathBuf;
use std::process::{Command, Stdio};
use system_tests::recording::Table;
use system_tests::workplace::{Running, Said, Workplace};

/// With as many fingers as there may be, so that a disk fills up fast.
fn workplace() -> Workplace {
    let place = Workplace::new();
    place.write("scene.toml", "[[finger]]\n".repeat(8));
    place
}

#[test]
fn a_recording_that_cannot_even_begin_stops_the_run_before_it_starts() {
    for clock in ["virtual", "lockstep", "real"] {
        let place = workplace();
        let said = place.run(["run", "scene.toml", "--clock", clock, "--record", "/dev/full"]);
        // The header did not fit: nothing ran, so it is bad input, not a fault during the run.
        assert_eq!((said.status, said.out.as_str()), (Some(2), ""), "{}", said.err);
        assert!(
            said.err.contains("cannot create the recording /dev/full: No space left on device"),
            "{}",
            said.err
        );
        assert_eq!(said.err.lines().count(), 1, "{}", said.err);
        assert_eq!(place.processes(), Vec::<u32>::new());
    }
}

/// The run goes on to its end; status 3, one message that says how far the recording goes, and a file that goes exactly
/// so far.
fn assert_recorded_up_to_the_fault(place: &Workplace, said: &Said, cause: &str) {
    assert_eq!(said.status, Some(3), "{}", said.err);
    assert!(said.out.contains(" NOT COMPLETE: see the message above"), "the report is made: {}", said.out);
    // A slow machine shows progress before.
    let messages: Vec<&str> = said.err.lines().filter(|line| !line.ends_with('%')).collect();
    let [message] = messages[..] else { panic!("not one message:\n{}", said.err) };
    assert!(
        message.starts_with("phantom3: cannot write the recording ") && message.contains(cause),
        "{message}"
    );
    let (_, promise) = message.split_once("it is complete up to t = ").expect("how far it goes");
    let (until, rows) = promise.split_once(" s (").expect("the time and the rows");
    let table = Table::read(&place.path("out.csv"));
    assert!(table.len() > 100, "it got going: {} rows", table.len());
    assert_eq!(table.texts("t").last(), Some(&until), "{message}");
    assert_eq!(format!("{} rows)", table.len()), rows, "{message}");
    let times = table.numbers("t");
    assert!(times.windows(2).all(|pair| pair[0] < pair[1]) && times[0] == 0.0, "rows are in order from 0 on");
    assert_eq!(place.processes(), Vec::<u32>::new());
}

#[test]
fn a_file_that_may_not_grow_any_more_ends_with_a_complete_row_and_status_3() {
    // The shared memory of a driver counts as a file too, some 10 MB, so the limit leaves room for that:
    // 20 MB or 40 MB, as the shell's blocks have 512 or 1024 bytes.
    let script = "trap '' XFSZ; ulimit -f 40000; exec \"$0\" \"$@\"";
    for clock in ["virtual", "lockstep"] {
        let place = workplace();
        let said = place.shell(script, &["--clock", clock, "--seconds", "120", "--record", "out.csv"]);
        assert_recorded_up_to_the_fault(&place, &said, "File too large");
    }
}

#[test]
fn a_disk_that_fills_up_leaves_a_recording_that_ends_with_a_complete_row() {
    let mount = "mkdir small && mount -t tmpfs -o size=900k tmpfs small";
    let is_possible = |place: &Workplace| {
        let mut unshare = place.prepare(Command::new("unshare"));
        unshare.args(["--user", "--map-root-user", "--mount", "sh", "-c", mount]);
        unshare.stderr(Stdio::null()).bounded_status().is_ok_and(|status| status.success())
    };
    if !is_possible(&workplace()) {
        eprintln!(
            "skipped: no small disk can be mounted here; the test with a limited file covers the same path"
        );
        return;
    }
    // A disk of its own, which only these processes see; what is on it is copied out at the end.
    let inside = format!("{mount} && \"$0\" \"$@\"; end=$?; cp small/out.csv out.csv; exit $end");
    for clock in ["virtual", "lockstep"] {
        let place = workplace();
        let script = format!("exec unshare --user --map-root-user --mount sh -c '{inside}' \"$0\" \"$@\"");
        let said = place.shell(&script, &["--clock", clock, "--seconds", "20", "--record", "small/out.csv"]);
        assert_recorded_up_to_the_fault(&place, &said, "No space left on device");
    }
}

#[test]
fn a_reader_who_has_gone_changes_neither_the_run_nor_its_status() {
    let good = ["--seconds", "0.5", "--record", "out.csv", "--clock"];
    let bad = ["--hand", "none.csv", "--clock"];
    for redirection in ["2>/dev/full", "2>&-", ">&-", ">&- 2>&- <&-"] {
        let script = format!("exec \"$0\" \"$@\" {redirection}");
        for clock in ["virtual", "lockstep", "real"] {
            let place = workplace();
            let said = place.shell(&script, &[&good[..], &[clock]].concat());
            assert_eq!(said.status, Some(0), "{redirection} on the {clock} clock: {}", said.err);
            assert!(!Table::read(&place.path("out.csv")).is_empty(), "{redirection} on the {clock} clock");
            let said = place.shell(&script, &[&bad[..], &[clock]].concat());
            assert_eq!(said.status, Some(2), "{redirection} on the {clock} clock: {}", said.err);
            assert_eq!(place.processes(), Vec::<u32>::new());
        }
    }
}

#[test]
fn a_result_that_cannot_be_printed_is_told_and_is_a_fault() {
    let place = workplace();
    let recorded = ["--clock", "virtual", "--seconds", "0.1", "--record", "out.mcap"];
    assert_eq!(place.shell("\"$0\" \"$@\"", &recorded).status, Some(0));
    for command in [
        "run scene.toml --clock virtual --seconds 0.1",
        "check scene.toml",
        "check scene.toml --json",
        "materials",
        "settings",
        "replay out.mcap",
        "export out.mcap --csv out.csv",
        "plot out.mcap --svg-only",
    ] {
        let said = place.shell(&format!("\"$0\" {command} > /dev/full"), &[]);
        assert_eq!(said.status, Some(3), "{command}: {}", said.err);
        let words = "phantom3: cannot write the standard output: No space left on device (os error 28)";
        assert_eq!(said.err.matches(words).count(), 1, "{command}: {}", said.err);
    }
}

#[test]
fn closed_pipes_change_neither_the_run_nor_its_status() {
    for (hand, status) in [("hand.csv", 0), ("none.csv", 2)] {
        let place = workplace();
        place.write("hand.csv", "t,f0_x,f0_y,f0_z\n0,0,0,0\n");
        let mut program = place.phantom3();
        program.args(["run", "scene.toml", "--seconds", "0.5", "--hand", hand]);
        let mut child = program.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("it starts");
        // Whoever read has seen enough, as in `| head -0`.
        drop((child.stdout.take(), child.stderr.take()));
        assert_eq!(child.bounded_wait().code(), Some(status));
    }
}

#[test]
fn a_place_for_temporary_files_that_is_missing_or_too_long_for_a_socket_does_not_matter() {
    let long = "d".repeat(120);
    for name in ["missing", &long] {
        let place = workplace();
        if name == long {
            std::fs::create_dir(place.path(name)).expect("a directory");
        }
        let mut program = place.phantom3();
        program.env("TMPDIR", place.path(name)).args([
            "run",
            "scene.toml",
            "--clock",
            "lockstep",
            "--seconds",
            "0.1",
        ]);
        let said = Running::start(program).wait();
        assert_eq!((said.status, said.err.as_str()), (Some(0), ""));
    }
}

#[test]
fn a_recording_may_go_into_a_pipe() {
    let place = workplace();
    let said = place
        .shell("\"$0\" \"$@\" | cat", &["--clock", "virtual", "--seconds", "0.2", "--record", "/dev/stdout"]);
    assert_eq!((said.status, said.err.as_str()), (Some(0), ""));
    let rows = said.out.lines().filter(|line| line.starts_with("0.")).count();
    assert_eq!(rows, 200, "{}", said.out);
}

#[test]
fn a_name_that_says_no_format_is_refused_before_anything_runs() {
    let cases: &[(&[&str], &[&str])] = &[
        (&["--record", "out.xyz"], &["--record out.xyz has the ending .xyz", ".csv", ".mcap", "- (CSV"]),
        (&["--record", "out"], &["--record out has no ending that names a format", ".csv", ".mcap"]),
        (&["--record", "out.parquet"], &["record out.mcap, and then `phantom3 export out.mcap out.parquet`"]),
        (&["--events", "out.mcap"], &["--events out.mcap has the ending .mcap", ".jsonl", ".csv"]),
        (
            &["--record", "-", "--events", "-"],
            &["--record - and --events - would both write to the standard output"],
        ),
        (&["--record", "-", "--record", "-"], &["--record - is given twice"]),
    ];
    let place = workplace();
    let before = place.snapshot();
    for clock in ["virtual", "real"] {
        for (arguments, words) in cases {
            let said = place.run([&["run", "scene.toml", "--clock", clock], *arguments].concat());
            assert_eq!((said.status, said.out.as_str()), (Some(2), ""), "{arguments:?}: {}", said.err);
            for word in *words {
                assert!(said.err.contains(word), "{arguments:?} does not say `{word}`: {}", said.err);
            }
        }
    }
    assert!(place.snapshot() == before, "files have changed");
}

#[test]
fn a_table_on_the_standard_output_is_that_of_the_file_and_the_report_goes_to_standard_error() {
    for clock in ["virtual", "lockstep"] {
        let place = workplace();
        let said = place.run([
            "run",
            "scene.toml",
            "--clock",
            clock,
            "--seconds",
            "0.2",
            "--record",
            "-",
            "--record",
            "out.csv",
        ]);
        assert_eq!(said.status, Some(0), "{}", said.err);
        assert!(said.out == std::fs::read_to_string(place.path("out.csv")).expect("a table"), "{clock}");
        assert!(said.err.contains("recording    the standard output (200 rows)"), "{}", said.err);
        assert!(!place.path("-").exists(), "no file of that name");
    }
    let place = workplace();
    let said = place.run(["run", "scene.toml", "--clock", "virtual", "--seconds", "0.2", "--events", "-"]);
    assert_eq!((said.status, said.out.as_str()), (Some(0), ""), "nothing happens: {}", said.err);
    assert!(said.err.contains("recording    the standard output (0 events)"), "{}", said.err);
}

#[test]
fn a_reader_who_has_seen_enough_ends_the_run_quietly_where_nothing_else_is_recorded() {
    let script = "{ \"$0\" \"$@\"; echo \"status $?\" >&2; } | head -n 2";
    for clock in ["virtual", "real"] {
        // Some hours: they are not waited for.
        let place = workplace();
        let said = place.shell(script, &["--clock", clock, "--seconds", "40000", "--record", "-"]);
        assert_eq!(said.out.lines().count(), 2, "{}", said.out);
        assert!(said.err.contains("status 0\n"), "{clock}: {}", said.err);
        for word in ["cannot", "pipe", "NOT COMPLETE"] {
            assert!(!said.err.contains(word), "{clock}: {}", said.err);
        }
        assert_eq!(place.processes(), Vec::<u32>::new());
    }
    let place = workplace();
    let both = ["--clock", "virtual", "--seconds", "20", "--record", "-", "--record", "out.csv"];
    let said = place.shell(script, &both);
    assert!(said.err.contains("recording    out.csv (20000 rows)"), "{}", said.err);
}

/// The rows went into a file that nobody finds any more.
#[test]
fn a_recording_that_was_removed_meanwhile_is_not_told_as_if_it_were_there() {
    let place = workplace();
    let outputs = ["--record", "out.csv", "--record", "out.mcap", "--events", "out.jsonl"];
    let mut program = place.phantom3();
    program.args(["run", "scene.toml", "--clock", "real", "--seconds", "40000"]).args(outputs);
    let running = Running::start(program);
    let files = ["out.csv", "out.mcap", "out.jsonl"].map(|name| place.path(name));
    patience::until("rows in the table", || {
        files.iter().all(|file| file.exists()) && files[0].metadata().is_ok_and(|file| file.len() > 4096)
    });
    std::fs::remove_file(&files[0]).expect("it is there");
    std::fs::remove_file(&files[1]).expect("it is there");
    let pid = rustix::process::Pid::from_child(&running.child);
    rustix::process::kill_process(pid, rustix::process::Signal::TERM).expect("our own child");
    let said = running.wait();
    assert_eq!(said.status, Some(3), "{}", said.err);
    for name in ["out.csv", "out.mcap"] {
        let told = format!("phantom3: the recording {name} was removed or renamed during the run");
        assert!(said.err.contains(&told), "{}", said.err);
        assert!(said.out.contains(&format!("recording    {name} (0 rows) NOT COMPLETE")), "{}", said.out);
    }
    assert!(said.out.contains("recording    out.jsonl (0 events)\n"), "that one is there: {}", said.out);
}

/// Renamed, replaced by another file, and removed while it has another name.
#[test]
fn a_recording_whose_name_leads_elsewhere_in_the_end_is_not_told_as_if_it_were_there() {
    let place = workplace();
    let names = ["renamed.csv", "replaced.mcap", "linked.csv", "kept.csv"];
    let mut program = place.phantom3();
    program.args(["run", "scene.toml", "--clock", "real", "--seconds", "40000"]);
    program.args(names.iter().flat_map(|name| ["--record", name]));
    let running = Running::start(program);
    let files = names.map(|name| place.path(name));
    let has_rows = |file: &PathBuf| file.metadata().is_ok_and(|file| file.len() > 4096);
    patience::until("rows", || files.iter().all(has_rows));
    for (number, file) in files[..2].iter().enumerate() {
        std::fs::rename(file, place.path(format!("elsewhere-{number}"))).expect("it is there");
    }
    std::fs::write(&files[1], "another's").expect("room");
    std::fs::hard_link(&files[2], place.path("elsewhere-2")).expect("room");
    std::fs::remove_file(&files[2]).expect("it is there");
    let pid = rustix::process::Pid::from_child(&running.child);
    rustix::process::kill_process(pid, rustix::process::Signal::TERM).expect("our own child");
    let said = running.wait();
    assert_eq!(said.status, Some(3), "{}", said.err);
    for name in &names[..3] {
        let told = format!("phantom3: the recording {name} was removed or renamed during the run");
        assert!(said.err.contains(&told), "{}", said.err);
        assert!(said.out.contains(&format!("recording    {name} (0 rows) NOT COMPLETE")), "{}", said.out);
    }
    assert_eq!(std::fs::read(&files[1]).expect("it is there"), b"another's");
    let kept = said.out.lines().find(|line| line.contains("kept.csv")).expect("a line");
    assert!(!kept.contains("NOT"), "{kept}");
}

/// The length alone is as it was.
#[test]
fn a_recording_that_was_cut_and_extended_again_is_not_called_complete() {
    let place = workplace();
    let outputs = ["--record", "out.csv", "--record", "out.mcap", "--record", "whole.csv"];
    let mut program = place.phantom3();
    program.args(["run", "scene.toml", "--clock", "real", "--seconds", "40000"]).args(outputs);
    let running = Running::start(program);
    let files = ["out.csv", "out.mcap"].map(|name| place.path(name));
    let has_rows = |file: &PathBuf| file.metadata().is_ok_and(|file| file.len() > 4096);
    patience::until("rows", || files.iter().all(has_rows));
    for file in &files {
        let open = std::fs::OpenOptions::new().write(true).open(file).expect("it is there");
        let length = open.metadata().expect("it is there").len();
        open.set_len(0).and_then(|()| open.set_len(length)).expect("our own");
    }
    let pid = rustix::process::Pid::from_child(&running.child);
    rustix::process::kill_process(pid, rustix::process::Signal::TERM).expect("our own child");
    let said = running.wait();
    assert_eq!(said.status, Some(3), "{}", said.err);
    for name in ["out.csv", "out.mcap"] {
        let told =
            format!("phantom3: another process cut the recording {name} during the run, or wrote to it: ");
        assert!(said.err.contains(&told), "{}", said.err);
        assert!(said.out.contains(&format!("recording    {name} (0 rows) NOT COMPLETE")), "{}", said.out);
    }
    let whole = said.out.lines().find(|line| line.contains("whole.csv")).expect("a line");
    assert!(!whole.contains("NOT"), "{whole}");
}

/// As `> out.csv` of a shell in the middle of the run.
#[test]
fn a_recording_that_was_emptied_meanwhile_is_not_filled_behind_a_hole_or_called_complete() {
    let place = workplace();
    let outputs = ["--record", "out.csv", "--record", "out.mcap", "--record", "whole.csv"];
    let mut program = place.phantom3();
    program.args(["run", "scene.toml", "--clock", "real", "--seconds", "40000"]).args(outputs);
    let running = Running::start(program);
    let files = ["out.csv", "out.mcap"].map(|name| place.path(name));
    let has_rows = |file: &PathBuf| file.metadata().is_ok_and(|file| file.len() > 4096);
    patience::until("rows in the table", || files.iter().all(has_rows));
    for file in &files {
        std::fs::write(file, "").expect("it is there");
    }
    let rows_before = place.path("whole.csv").metadata().expect("it is there").len();
    let has_more =
        || place.path("whole.csv").metadata().is_ok_and(|file| file.len() > 2 * rows_before + 4096);
    patience::until("rows that follow", has_more);
    let pid = rustix::process::Pid::from_child(&running.child);
    rustix::process::kill_process(pid, rustix::process::Signal::TERM).expect("our own child");
    let said = running.wait();
    assert_eq!(said.status, Some(3), "{}", said.err);
    for (name, file) in ["out.csv", "out.mcap"].iter().zip(&files) {
        let told = format!(
            "phantom3: another process cut the recording {name} during the run, or wrote to it: it has 0"
        );
        assert!(said.err.contains(&told), "{}", said.err);
        assert!(said.out.contains(&format!("recording    {name} (0 rows) NOT COMPLETE")), "{}", said.out);
        assert_eq!(file.metadata().expect("it is there").len(), 0);
    }
    let whole = said.out.lines().find(|line| line.contains("whole.csv")).expect("a line");
    assert!(!whole.contains("NOT"), "{whole}");
}

#[test]
fn a_recording_on_a_closed_standard_output_is_refused_before_anything_runs() {
    for (output, name) in [("--record", "recording"), ("--events", "file of events")] {
        for clock in ["virtual", "real"] {
            let place = workplace();
            let arguments = ["--clock", clock, "--seconds", "0.2", output, "-"];
            let said = place.shell("exec \"$0\" \"$@\" >&-", &arguments);
            assert_eq!(said.status, Some(2), "{}", said.err);
            let told = format!("cannot create the {name} the standard output: it was closed when");
            assert!(said.err.contains(&told), "{}", said.err);
            assert_eq!(place.processes(), Vec::<u32>::new());
        }
    }
}
