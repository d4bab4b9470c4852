//! Results that two processes, a signal, a full disk or a reader who does not read must not cost.

use crate::abandoned::unread_pipe;
use patience::prelude::*;
use rustix::process::{Pid, Signal, kill_process};
use std::io::Read;
use std::path::Path;
use std::process::{Command, Stdio};
use system_tests::recording::Table;
use system_tests::workplace::{Running, Said, Workplace};

/// The default scene with its hand, and a recording of so many seconds of it.
fn workplace(seconds: &str) -> Workplace {
    let place = Workplace::new();
    let scene = include_str!("../../../config/scenes/default.toml");
    place.write("scene.toml", scene.replace("../hands/default.csv", "hand.csv"));
    place.write("hand.csv", include_str!("../../../config/hands/default.csv"));
    if seconds != "0" {
        let files = ["--record", "r.mcap", "--record", "r.csv"];
        let said =
            place.run(["run", "scene.toml", "--clock", "virtual", "--seconds", seconds].iter().chain(&files));
        assert_eq!(said.status, Some(0), "{}", said.err);
    }
    place
}

fn signal(running: &Running, signal: Signal) {
    kill_process(Pid::from_child(&running.child), signal).expect("our child");
}

fn hidden(place: &Workplace) -> Vec<String> {
    let entries = std::fs::read_dir(place.path("")).expect("a directory").flatten();
    let names = entries.map(|entry| entry.file_name().to_string_lossy().into_owned());
    names.filter(|name| name.starts_with('.')).collect()
}

/// A disk of a size can be mounted here that only some processes see.
fn has_small_disks(place: &Workplace) -> bool {
    let mut possible = place.prepare(Command::new("unshare"));
    let tried = "mkdir -p tried && mount -t tmpfs none tried";
    possible.args(["--user", "--map-root-user", "--mount", "sh", "-c", tried]).stderr(Stdio::null());
    let is_possible = possible.bounded_status().is_ok_and(|status| status.success());
    if !is_possible {
        eprintln!(
            "skipped: no small disk can be mounted here; the tests of the modules cover the same writes"
        );
    }
    is_possible
}

#[test]
fn a_file_that_a_run_records_into_is_refused_to_everybody_else_and_comes_out_whole() {
    let place = workplace("1");
    let mut program = place.phantom3();
    program.args(["run", "scene.toml", "--headless", "--seconds", "600", "--events", "e.jsonl"]);
    program.args(["--record", "out.csv", "--record", "out.mcap", "--record", "phantom3-demo.csv"]);
    let running = Running::start(program);
    patience::until("a recording", || {
        std::fs::metadata(place.path("out.csv")).is_ok_and(|file| file.len() > 9000)
    });
    let run = ["run", "scene.toml", "--clock", "virtual", "--seconds", "0.1"];
    let lent = |more: &[&'static str]| [&run[..], more].concat();
    for second in [
        lent(&["--record", "out.csv"]),
        lent(&["--record", "new.csv", "--record", "out.mcap"]),
        lent(&["--events", "e.jsonl"]),
        vec!["replay", "r.mcap", "--record", "out.mcap"],
        vec!["export", "r.mcap", "out.csv"],
        vec!["--headless"],
    ] {
        let said = place.run(&second);
        assert_eq!((said.status, said.out.as_str()), (Some(2), ""), "{second:?}: {}", said.err);
        assert!(said.err.contains("somebody holds a lock on it"), "{second:?}: {}", said.err);
        assert!(!place.path("new.csv").exists());
    }
    signal(&running, Signal::INT);
    let said = running.wait();
    assert_eq!(said.status, Some(130), "{}", said.err);
    for name in ["out.csv", "phantom3-demo.csv"] {
        let table = Table::read(&place.path(name));
        assert!(said.out.contains(&format!("{name} ({} rows", table.len())), "{name}: {}", said.out);
    }
    let said = place.run(["export", "out.mcap", "again.csv"]);
    assert_eq!((said.status, said.err.as_str()), (Some(0), ""));
    let bytes = |name: &str| std::fs::read(place.path(name)).expect("a file");
    assert!(bytes("again.csv") == bytes("out.csv"));
    // Whoever comes after it has the file.
    let said = place.run(lent(&["--record", "out.csv"]));
    assert_eq!(said.status, Some(0), "{}", said.err);
    // What everybody may write is nobody's.
    let null = |seconds: &str| {
        let mut program = place.phantom3();
        program.args(["run", "scene.toml", "--headless", "--seconds", seconds, "--record", "/dev/null"]);
        Running::start(program)
    };
    let both = [null("0.5"), null("0.5")].map(Running::wait);
    assert!(both.iter().all(|said| said.status == Some(0)), "{both:?}");
}

#[test]
fn an_export_that_a_signal_ends_leaves_the_earlier_tables_and_nothing_else() {
    let place = workplace("4");
    for (name, number, status) in [("csv", Signal::INT, 130), ("parquet", Signal::TERM, 143)] {
        let out = place.write(format!("out.{name}"), "earlier");
        let pipe = unread_pipe(&place.path(format!("pipe-{name}")));
        let mut program = place.phantom3();
        program.arg("export").arg("r.mcap").args([&out, &place.path(format!("pipe-{name}"))]);
        let running = Running::start(program);
        // Beside the earlier one, or in its place.
        let is_begun =
            || !hidden(&place).is_empty() || std::fs::read(&out).is_ok_and(|text| text != b"earlier");
        patience::until("a beginning", is_begun);
        signal(&running, number);
        let said = running.wait();
        assert_eq!(said.status, Some(status), "{}", said.err);
        let words = format!("out.{name} is not written; what was there is as it was");
        assert!(said.err.contains(&words), "{}", said.err);
        assert_eq!(std::fs::read(&out).expect("the earlier one"), b"earlier");
        assert_eq!(hidden(&place), Vec::<String>::new());
        drop(pipe);
    }
    let said = place.run(["export", "r.mcap", "out.csv", "new.csv"]);
    assert_eq!((said.status, said.err.as_str()), (Some(0), ""));
    let whole = std::fs::read(place.path("r.csv")).expect("a table");
    assert!(["out.csv", "new.csv"].iter().all(|name| std::fs::read(place.path(name)).unwrap() == whole));
    assert_eq!(hidden(&place), Vec::<String>::new());
}

const RECORDS: [&str; 9] =
    ["run", "scene.toml", "--clock", "virtual", "--headless", "--seconds", "0.1", "--record", "out.csv"];

/// `phantom3` below strace, which writes what it sees into the file `trace`; `None`: there is no strace.
fn traced(place: &Workplace, options: &[&str], arguments: &[&str]) -> Option<Command> {
    if !Command::new("strace").arg("-V").stdout(Stdio::null()).bounded_status().is_ok_and(|end| end.success())
    {
        eprintln!("skipped: there is no strace");
        return None;
    }
    let mut strace = place.prepare(Command::new("strace"));
    strace.args(["-f", "-qq", "-o", "trace"]).args(options);
    strace.arg(place.phantom3().get_program()).args(arguments);
    Some(strace)
}

/// strace makes one look of the run at its file after the other fail, as a file system over a network does.
#[test]
fn a_file_whose_kind_the_system_does_not_tell_keeps_its_earlier_recording() {
    let place = workplace("0");
    let earlier = place.write("out.csv", "earlier");
    let mut kept = 0;
    for number in 1..12 {
        std::fs::write(&earlier, "earlier").expect("room");
        let inject = format!("inject=statx:error=EIO:when={number}");
        let Some(strace) = traced(&place, &["-e", "trace=statx", "-e", &inject, "-P", "out.csv"], &RECORDS)
        else {
            return;
        };
        let said = Running::start(strace).wait();
        if std::fs::read(&earlier).expect("there") == b"earlier" {
            kept += 1;
            assert_ne!(said.status, Some(0), "{number}");
        } else {
            assert!(!Table::read(&earlier).is_empty(), "{number}: {}", said.err);
        }
    }
    assert!(kept > 0, "no look at the file was refused");
}

/// strace makes the reserving of room take long, as on a busy disk; somebody copies another file over the recording meanwhile.
#[test]
fn what_others_write_while_room_is_reserved_is_kept() {
    let place = workplace("0");
    let earlier = place.write("out.csv", "earlier");
    let blocks = || std::os::unix::fs::MetadataExt::blocks(&earlier.metadata().expect("there"));
    for others in ["others' and longer", "others'"] {
        std::fs::write(&earlier, "earlier").expect("room");
        let before = blocks();
        let inject = "inject=fallocate:delay_exit=1500000";
        let Some(strace) =
            traced(&place, &["-e", "trace=fallocate", "-e", inject, "-P", "out.csv"], &RECORDS)
        else {
            return;
        };
        let run = Running::start(strace);
        patience::until("room", || blocks() > before);
        std::fs::write(&earlier, others).expect("room");
        let said = run.wait();
        assert_ne!(said.status, Some(0), "{}", said.err);
        assert!(said.err.contains("others have written to it"), "{}", said.err);
        assert_eq!(std::fs::read_to_string(&earlier).expect("there"), others);
    }
}

/// Two and a half seconds of it into each kind of file.
const RECORDS_ALL: [&str; 13] = [
    "run",
    "scene.toml",
    "--clock",
    "real",
    "--headless",
    "--seconds",
    "2.5",
    "--record",
    "out.csv",
    "--record",
    "out.mcap",
    "--events",
    "out.jsonl",
];

/// A power failure is not at hand: asked is whether the disk was, again and again, and what becomes of its refusal. A disk that takes
/// half a minute for an answer keeps nobody waiting before the end.
#[test]
fn what_is_recorded_is_brought_to_the_disk_while_the_run_goes_on() {
    let files = ["out.csv", "out.mcap", "out.jsonl"];
    let calls = |place: &Workplace, file: &str| {
        let trace = std::fs::read_to_string(place.path("trace")).expect("a trace");
        trace.lines().filter(|line| line.contains("fdatasync(") && line.contains(file)).count()
    };
    let run = |options: &[&str]| {
        let place = workplace("0");
        let options: Vec<&str> = ["-y", "-e", "trace=fdatasync"].iter().chain(options).copied().collect();
        let strace = traced(&place, &options, &RECORDS_ALL)?;
        let said = Running::start(strace).wait();
        Some((place, said))
    };
    let Some((place, said)) = run(&[]) else { return };
    assert_eq!(said.status, Some(0), "{}", said.err);
    for file in files {
        // Of five times half a second, on a busy machine, and one in the end.
        assert!(calls(&place, file) >= 3, "{file}: {}", calls(&place, file));
    }

    let (place, said) = run(&["-e", "inject=fdatasync:error=EIO:when=2"]).expect("strace was there");
    assert_eq!(said.status, Some(3), "{}", said.err);
    place.run(["export", "out.mcap", "--csv", "exported.csv"]);
    for (file, table) in [("out.csv", "out.csv"), ("out.mcap", "exported.csv")] {
        let told = format!("cannot write the recording {file}: Input/output error");
        let told = said.err.lines().find(|line| line.contains(&told)).expect("told");
        let rows = Table::read(&place.path(table)).numbers("t").len();
        assert!(told.ends_with(&format!("({rows} rows)")), "{told}: {rows} rows");
    }

    let (place, said) =
        run(&["-e", "inject=fdatasync:delay_enter=1500000:when=1"]).expect("strace was there");
    assert_eq!(said.status, Some(0), "{}", said.err);
    assert!(Table::read(&place.path("out.csv")).numbers("t").len() > 2000);
    assert!(!(said.out + &said.err).contains("LOST"), "somebody waited for the disk");
}

/// The calls that make a file of a name with this in it.
fn makings(place: &Workplace, name: &str) -> Vec<String> {
    let trace = std::fs::read_to_string(place.path("trace")).expect("a trace");
    let is_one = |line: &&str| line.contains(name) && line.contains("O_CREAT");
    trace.lines().filter(is_one).map(str::to_owned).collect()
}

/// Whoever opens it before it has the rights of the earlier table reads what is written later.
#[test]
fn the_draft_of_a_table_that_is_replaced_is_its_owners_alone_from_the_start() {
    let place = workplace("4");
    place.write("out.csv", "earlier");
    let Some(strace) = traced(&place, &["-e", "trace=openat"], &["export", "r.mcap", "out.csv"]) else {
        return;
    };
    assert_eq!(Running::start(strace).wait().status, Some(0));
    let made = makings(&place, ".part");
    assert!(made.len() == 1 && made[0].contains(", 0600)"), "{made:?}");
}

/// In a directory of all the system does not follow a link of others, which we would.
#[test]
fn a_link_that_leads_to_no_file_is_followed_by_the_system_alone() {
    let place = workplace("0");
    std::os::unix::fs::symlink("elsewhere.csv", place.path("out.csv")).expect("a link");
    let Some(strace) = traced(&place, &["-e", "trace=openat"], &RECORDS) else { return };
    let said = Running::start(strace).wait();
    assert_eq!(said.status, Some(0), "{}", said.err);
    assert!(!Table::read(&place.path("elsewhere.csv")).is_empty());
    let (through, around) = (makings(&place, "out.csv"), makings(&place, "elsewhere.csv"));
    assert!(!through.is_empty() && around.is_empty(), "{through:?} {around:?}");
}

/// The pipe holds the export up until a run records into a new file of the name.
#[test]
fn an_export_does_not_replace_what_a_run_records_into_whether_or_not_a_table_was_there_before() {
    let place = workplace("4");
    for (pipe, earlier) in [("p1", None), ("p2", Some("earlier"))] {
        let out = place.path("out.csv");
        let _ = std::fs::remove_file(&out);
        earlier.map_or(Ok(()), |text| std::fs::write(&out, text)).expect("room");
        let mut reader = unread_pipe(&place.path(pipe));
        let mut program = place.phantom3();
        program.args(["export", "r.mcap", "out.csv"]).arg(place.path(pipe));
        let export = Running::start(program);
        patience::until("a draft", || !hidden(&place).is_empty());
        if earlier.is_some() {
            std::fs::remove_file(&out).expect("it is there");
        }
        let mut program = place.phantom3();
        program.args(["run", "scene.toml", "--clock", "real", "--headless", "--seconds", "40000"]);
        program.args(["--record", "out.csv"]);
        let run = Running::start(program);
        patience::until("a recording", || out.metadata().is_ok_and(|file| file.len() > 9000));
        rustix::fs::fcntl_setfl(&reader, rustix::fs::OFlags::RDWR).expect("our own pipe");
        let read = std::thread::spawn(move || {
            let mut bytes = vec![0; 1 << 16];
            // It is never at its end, as this one could write to it.
            while reader.read(&mut bytes).is_ok_and(|count| !bytes[..count].ends_with(b"the end")) {}
        });
        let said = export.wait();
        std::fs::write(place.path(pipe), "the end").expect("somebody reads it");
        read.bounded_join().expect("the reader");
        assert_eq!(said.status, Some(3), "{earlier:?}: {}", said.err);
        assert!(said.err.contains("cannot write out.csv: somebody"), "{earlier:?}: {}", said.err);
        signal(&run, Signal::INT);
        let said = run.wait();
        assert_eq!((said.status, said.err.contains("removed")), (Some(130), false), "{}", said.err);
        let told = format!("out.csv ({} rows)", Table::read(&out).len());
        assert!(said.out.contains(&told), "{earlier:?}: {}", said.out);
        assert_eq!(hidden(&place), Vec::<String>::new());
    }
}

#[test]
fn an_export_for_which_a_disk_has_no_room_leaves_the_earlier_table() {
    let place = workplace("2");
    place.write("out.csv", "earlier");
    // 50 or 100 kB, as the shell's blocks have 512 or 1024 bytes.
    let said = place.shell("ulimit -f 100; exec \"$0\" export r.mcap out.csv", &[]);
    assert_eq!(said.status, Some(3), "{}", said.err);
    assert!(said.err.contains("nothing is left of it, and what was there is as it was"), "{}", said.err);
    assert_eq!(std::fs::read(place.path("out.csv")).expect("the earlier one"), b"earlier");
    assert_eq!(hidden(&place), Vec::<String>::new());
}

#[test]
fn a_chart_for_which_a_disk_has_no_room_leaves_the_earlier_one() {
    let place = workplace("4");
    let earlier = "<svg>\n<!-- drawn by phantom3 -->";
    place.write("chart.svg", earlier);
    // 1 or 2 kB, as the shell's blocks have 512 or 1024 bytes.
    let said = place.shell("ulimit -f 2; exec \"$0\" plot r.csv --svg-only --out chart", &[]);
    assert_eq!(said.status, Some(3), "{}", said.err);
    assert!(said.err.contains("cannot write chart.svg: File too large"), "{}", said.err);
    assert_eq!(std::fs::read_to_string(place.path("chart.svg")).expect("the earlier one"), earlier);
    assert_eq!(hidden(&place), Vec::<String>::new());
}

#[test]
fn a_table_is_written_where_it_is_if_its_directory_takes_no_other_file() {
    let place = workplace("1");
    if !has_small_disks(&place) {
        return;
    }
    // The directory itself and two files.
    let mount = "mkdir small && mount -t tmpfs -o nr_inodes=3 tmpfs small && echo earlier | tee small/out.csv > small/o";
    let inside =
        format!("{mount} && \"$0\" export r.mcap small/out.csv; end=$?; cp small/out.csv out.csv; exit $end");
    let script = format!("exec unshare --user --map-root-user --mount sh -c '{inside}' \"$0\"");
    let said = place.shell(&script, &[]);
    assert_eq!((said.status, said.err.as_str()), (Some(0), ""), "{}", said.out);
    let bytes = |name: &str| std::fs::read(place.path(name)).expect("a file");
    assert!(bytes("out.csv") == bytes("r.csv"));
}

#[test]
fn a_replay_that_a_signal_ends_calls_identical_only_what_was_compared() {
    let place = workplace("60");
    // With the header of its table, when nothing may have been compared yet, and with half a second of rows.
    for least_bytes in [1, 10_000] {
        let mut program = place.phantom3();
        program.args(["replay", "r.mcap", "--record", "again.csv"]);
        let _ = std::fs::remove_file(place.path("again.csv"));
        let running = Running::start(program);
        let length = || std::fs::metadata(place.path("again.csv")).map_or(0, |file| file.len());
        patience::until("a beginning", || length() >= least_bytes);
        signal(&running, Signal::INT);
        let said = running.wait();
        assert_eq!(said.status, Some(130), "{}", said.err);
        let end = said.out.lines().last().unwrap_or_default();
        let (_, ticks) = said.out.split_once("r.mcap (").expect("how many ticks");
        let (ticks, _) = ticks.split_once(" ticks compared").expect("how many ticks");
        if ticks == "0" && least_bytes == 1 {
            assert_eq!(end, "nothing was compared");
            continue;
        }
        let begin = format!("identical so far ({ticks} of ");
        let end = end.strip_prefix(&begin).unwrap_or_else(|| panic!("{}", said.out));
        assert!(end.starts_with("60000 rows)") || end.starts_with("more than "), "{}", said.out);
    }
}

/// Number of good rows that a command has told, and the time of the last.
fn whole_before(said: &Said) -> String {
    assert_eq!(said.status, Some(3), "{}", said.err);
    let (_, told) = said.err.split_once("what is whole before it is used: ").expect("how much is whole");
    told.trim_end().to_owned()
}

#[test]
fn export_and_replay_count_the_same_good_rows_of_a_damaged_recording() {
    let place = workplace("3");
    let mut bytes = std::fs::read(place.path("r.mcap")).expect("a recording");
    let middle = bytes.len() / 2;
    bytes[middle] ^= 0x10;
    place.write("bad.mcap", bytes);
    let text = std::fs::read_to_string(place.path("r.csv")).expect("a table");
    let mut lines: Vec<&str> = text.lines().collect();
    lines[499] = "no row";
    place.write("bad.csv", lines.join("\n") + "\n");
    for recording in ["bad.mcap", "bad.csv"] {
        let told = whole_before(&place.run(["export", recording, "out.csv"]));
        let replayed = ["replay", recording, "--scene", "scene.toml", "--record", "again.csv"];
        let said = place.run(replayed);
        assert_eq!(whole_before(&said), told, "{recording}");
        assert!(said.out.contains("ticks compared") && said.out.contains("identical"), "{}", said.out);
        let rows = Table::read(&place.path("out.csv")).len();
        assert!(told.starts_with(&format!("{rows} rows, ")), "{recording}: {told}");
        assert_eq!(Table::read(&place.path("again.csv")).len(), rows, "{recording}");
    }
    let told = whole_before(&place.run(["export", "bad.csv", "out.csv"]));
    assert_eq!(told, "498 rows, up to t = 0.497 s");
}

#[test]
fn a_disk_that_is_full_anywhere_leaves_a_recording_without_a_false_end() {
    let place = workplace("0");
    if !has_small_disks(&place) {
        return;
    }
    let mount = "mkdir -p small && mount -t tmpfs -o size=$SIZE tmpfs small";
    let inside = format!("{mount} && \"$0\" \"$@\"; end=$?; cp small/out.mcap out.mcap; exit $end");
    for kilobytes in [200, 260, 332, 408, 500] {
        let script = format!(
            "SIZE={kilobytes}k exec unshare --user --map-root-user --mount sh -c '{inside}' \"$0\" \"$@\""
        );
        let said =
            place.shell(&script, &["--clock", "virtual", "--seconds", "10", "--record", "small/out.mcap"]);
        assert_eq!(said.status, Some(3), "{kilobytes}: {}{}", said.out, said.err);
        let (_, told) = said.err.split_once("it is complete up to t = ").expect("how far it goes");
        let (_, rows) = told.lines().next().and_then(|line| line.split_once(" s (")).expect("how many rows");
        let said = place.run(["export", "out.mcap", "left.csv"]);
        assert_eq!(said.status, Some(0), "{kilobytes}: {}", said.err);
        assert!(said.err.contains("it ends in the middle, as when a disk is full"), "{}", said.err);
        let left = Table::read(&place.path("left.csv")).len();
        assert_eq!(format!("{left} rows)"), rows, "{kilobytes}");
        assert!(left > 0 && left.is_multiple_of(500), "{kilobytes}: {left} rows are no whole half seconds");
    }
}

#[test]
fn events_that_did_not_reach_their_file_are_not_counted() {
    let place = workplace("0");
    let said =
        place.run(["run", "scene.toml", "--clock", "virtual", "--seconds", "3", "--events", "/dev/full"]);
    assert_eq!(said.status, Some(3), "{}", said.err);
    assert!(said.err.contains("it is complete up to t = 0 s (0 rows)"), "{}", said.err);
}

#[test]
fn the_demonstration_records_where_it_was_told_to_or_refuses_and_follows_no_link_of_others() {
    let place = workplace("0");
    let said = place.run(["--headless", "--set", "recording.directory=\"missing\""]);
    assert_eq!((said.status, said.out.as_str()), (Some(2), ""), "{}", said.err);
    assert!(said.err.contains("recording.directory"), "{}", said.err);
    // Nobody may write into /proc, not even root. Somebody has prepared the name that was used of old.
    let temporary = place.path("temporary");
    std::fs::create_dir(&temporary).expect("a directory");
    let victim = place.write("victim", "precious");
    std::os::unix::fs::symlink(&victim, temporary.join("phantom3-demo.csv")).expect("a link");
    let mut program = place.phantom3();
    program.arg("--headless").current_dir("/proc").env("TMPDIR", &temporary);
    let running = Running::start(program);
    patience::until("words", || running.said_so_far().contains("the recording goes to "));
    let said = running.wait();
    assert_eq!(said.status, Some(0), "{}", said.err);
    let (_, rest) = said.err.split_once("the recording goes to ").expect("where it went");
    let recording = Path::new(rest.lines().next().expect("a line"));
    assert!(said.out.contains(&format!("recording    {}", recording.display())), "{}", said.out);
    assert!(!Table::read(recording).is_empty());
    assert!(recording.starts_with(&temporary) && recording.parent() != Some(&temporary), "{recording:?}");
    let rights = std::fs::metadata(recording.parent().expect("its own")).expect("a directory");
    assert_eq!(std::os::unix::fs::PermissionsExt::mode(&rights.permissions()) & 0o777, 0o700);
    assert_eq!(std::fs::read(&victim).expect("there"), b"precious");
}
