//! Recordings as MCAP: what they hold, what is left of them when disk or process fail, and that they play again.

use patience::prelude::*;
use std::io::Read;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};
use system_tests::recording::Table;
use system_tests::workplace::{Running, Said, Workplace};

const DEFAULT_SCENE: &str = include_str!("../../../config/scenes/default.toml");
const DEFAULT_HAND: &str = include_str!("../../../config/hands/default.csv");
const LIFT_SCENE: &str = include_str!("../../../config/scenes/lift.toml");
const LIFT_HAND: &str = include_str!("../../../config/hands/lift.csv");

/// A ball, a passive point, a finger that turns and ties; an object whose grasp is told; friction and damping.
const EVERYTHING: &str = r#"
    grasp_quality = true
    [[finger]]
    name = "ball-point"
    radius_m = 0.005
    start_m = [0.0, 0.03, 0.0]
    [[finger]]
    passivity = true
    attach = { button = 0 }
    [[entity]]
    name = "table"
    shape = { kind = "plane", normal = [0, 1, 0], offset_m = 0 }
    damping_n_s_per_m = 3
    friction = { model = "lugre", mu_s = 0.7, mu_d = 0.3 }
    [[entity]]
    name = "cube-1"
    shape = { kind = "mesh", file = "models/cube.obj", scale = 0.02 }
    position_m = [0.1, 0.0095, 0]
    mass_kg = 0.1
    friction = { model = "stiction", mu_s = 0.7, mu_d = 0.3 }
"#;
const EVERYTHING_HAND: &str = "t,ball-point_x,ball-point_y,ball-point_z,f1_x,f1_y,f1_z,f1_qw,f1_qx,f1_qy,f1_qz,f1_buttons\n\
    0,0,0.03,0,0.1,0.03,0,1,0,0,0,0\n0.5,0,0.002,0,0.1,0.018,0,1,0,0,0,1\n1,0.05,0.002,0.01,0.1,0.03,0.02,0.96,0,0.28,0,1\n\
    1.5,0.1,0.03,0,0.12,0.02,0,1,0,0,0,0\n";
/// A cube of two metres.
const CUBE: &str = "v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1\n\
    f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 4 8 7 3\nf 1 5 8 4\nf 2 3 7 6\n";

/// A scene, its hand, and how long it is played.
fn workplace(name: &str) -> (Workplace, &'static str) {
    let place = Workplace::new();
    let (scene, hand, seconds) = match name {
        "default" => (DEFAULT_SCENE.replace("../hands/default.csv", "hand.csv"), DEFAULT_HAND, "3"),
        "lift" => (LIFT_SCENE.replace("../hands/lift.csv", "hand.csv"), LIFT_HAND, "2"),
        _ => (format!("hand = \"hand.csv\"\n{EVERYTHING}"), EVERYTHING_HAND, "1.6"),
    };
    place.write("scene.toml", scene);
    place.write("hand.csv", hand);
    std::fs::create_dir(place.path("models")).expect("a directory");
    place.write("models/cube.obj", CUBE);
    (place, seconds)
}

fn ran(place: &Workplace, arguments: &[&str]) -> Said {
    let said = place.run(arguments);
    assert_eq!(said.status, Some(0), "{arguments:?}\n{}{}", said.out, said.err);
    said
}

fn bytes(place: &Workplace, name: &str) -> Vec<u8> {
    std::fs::read(place.path(name)).expect("a file")
}

#[test]
fn a_table_out_of_a_recording_is_byte_for_byte_the_one_that_would_have_been_recorded() {
    for name in ["default", "lift", "everything"] {
        for clock in ["virtual", "lockstep"] {
            let (place, seconds) = workplace(name);
            let run = ["run", "scene.toml", "--clock", clock, "--seconds", seconds];
            ran(&place, &[&run[..], &["--record", "both.csv", "--record", "both.mcap"]].concat());
            let said = ran(&place, &["export", "both.mcap", "--csv", "exported.csv"]);
            assert_eq!(said.err, "");
            assert!(
                bytes(&place, "exported.csv") == bytes(&place, "both.csv"),
                "{name} on the {clock} clock"
            );
            ran(&place, &["export", "both.mcap", "ending.csv", "ending.parquet"]);
            assert!(bytes(&place, "ending.csv") == bytes(&place, "both.csv"));
            assert_eq!(bytes(&place, "ending.parquet")[..4], *b"PAR1");
            let said = ran(&place, &["export", "both.mcap", "-"]);
            assert!(said.out.as_bytes() == bytes(&place, "both.csv"), "on the standard output");
            assert!(said.err.contains("the standard output (") && !place.path("-").exists(), "{}", said.err);
            // And a table is read as it was written.
            ran(&place, &["export", "both.csv", "--csv", "again.csv"]);
            assert!(bytes(&place, "again.csv") == bytes(&place, "both.csv"), "{name} on the {clock} clock");
        }
    }
}

#[test]
fn two_virtual_runs_write_the_same_bytes() {
    let (place, seconds) = workplace("everything");
    for record in ["a.mcap", "b.mcap"] {
        ran(&place, &["run", "scene.toml", "--clock", "virtual", "--seconds", seconds, "--record", record]);
    }
    assert!(bytes(&place, "a.mcap") == bytes(&place, "b.mcap"));
}

/// Alone in another directory: nothing that the run read is there any more.
fn elsewhere(place: &Workplace, recording: &str) -> Workplace {
    let other = Workplace::new();
    other.write(recording, bytes(place, recording));
    other
}

#[test]
fn a_recording_replays_by_itself_and_is_the_same_to_the_bit() {
    for name in ["default", "lift", "everything"] {
        let (place, seconds) = workplace(name);
        let run = ["run", "scene.toml", "--clock", "virtual", "--seconds", seconds];
        ran(&place, &[&run[..], &["--record", "r.mcap", "--record", "r.csv"]].concat());
        let alone = elsewhere(&place, "r.mcap");
        let said = ran(&alone, &["replay", "r.mcap", "--expect-same", "--record", "again.csv"]);
        assert!(said.out.contains("identical: every number is the same to the bit"), "{name}: {}", said.out);
        assert!(bytes(&alone, "again.csv") == bytes(&place, "r.csv"), "{name}");
        // A table needs to be told the scene, and has no velocities: they are those of its positions.
        let said = ran(&place, &["replay", "r.csv", "--scene", "scene.toml", "--expect-same"]);
        assert!(said.out.contains("identical"), "{name}: {}", said.out);
    }
}

#[test]
fn a_replay_s_own_recording_replays_as_well_with_what_was_changed() {
    let (place, seconds) = workplace("everything");
    ran(&place, &["run", "scene.toml", "--clock", "virtual", "--seconds", seconds, "--record", "r.mcap"]);
    let alone = elsewhere(&place, "r.mcap");
    let change = ["--friction", "table=coulomb,mu=0.1", "--change", "entity.cube-1.stiffness_n_per_m=700"];
    ran(&alone, &[&["replay", "r.mcap", "--record", "changed.mcap"][..], &change].concat());
    let last = elsewhere(&alone, "changed.mcap");
    let said = ran(&last, &["replay", "changed.mcap", "--expect-same"]);
    assert!(said.out.contains("identical"), "{}", said.out);
}

#[test]
fn what_a_simulated_hand_did_replays_to_the_bit_while_it_began_in_free_space() {
    let (place, _) = workplace("default");
    let run = ["run", "scene.toml", "--clock", "virtual", "--seconds", "3", "--hand-mode", "impedance"];
    ran(&place, &[&run[..], &["--seed", "7", "--record", "r.mcap"]].concat());
    let said = ran(&elsewhere(&place, "r.mcap"), &["replay", "r.mcap", "--expect-same"]);
    assert!(said.out.contains("identical"), "{}", said.out);
}

#[test]
fn another_friction_is_told_with_sizes_and_the_first_tick_that_differs() {
    let (place, seconds) = workplace("default");
    ran(&place, &["run", "scene.toml", "--clock", "virtual", "--seconds", seconds, "--record", "r.mcap"]);
    let without = ["replay", "r.mcap", "--friction", "table=none"];
    let said = ran(&place, &without);
    assert!(said.out.contains("different:") && said.out.contains("entity.table.friction"), "{}", said.out);
    let said = place.run([&without[..], &["--expect-same"]].concat());
    assert_eq!(said.status, Some(1), "{}", said.out);
    for (wrong, words) in [
        (&["replay", "r.mcap", "--friction", "tabel=none"][..], "no entity \"tabel\""),
        (&["replay", "scene.toml"], "is no recording"),
        (&["run", "r.mcap"], "r.mcap is a recording; `phantom3 replay r.mcap` plays it again"),
        (&["replay", "none.mcap"], "cannot read the recording none.mcap"),
        (&["replay", "r.mcap", "--record", "r.mcap"], "would overwrite the input"),
        (&["export", "r.mcap", "--csv", "r.mcap"], "would overwrite the input"),
        (&["export", "r.mcap"], "<OUT>"),
        (&["export", "r.mcap", "r.xyz"], "r.xyz has the ending .xyz; allowed: .csv, .parquet"),
        (&["export", "r.mcap", "t.csv", "./t.csv"], "is given twice"),
        (&["replay", "r.mcap", "--record", "r.xyz"], "--record r.xyz has the ending .xyz; allowed: .csv"),
        (
            &["replay", "r.mcap", "--change", "entity.table.stiffness_n_per_m=-1"],
            "(a line of the scene as changed: entity.table.stiffness_n_per_m = -1)",
        ),
    ] {
        let said = place.run(wrong);
        assert_eq!(said.status, Some(2), "{wrong:?}: {}", said.err);
        assert!(said.err.contains(words), "{wrong:?}: {}", said.err);
    }
}

/// Rows that are missing, as when the machine was busy, are missed again: time goes on without an answer.
#[test]
fn a_recording_with_gaps_is_played_with_the_same_gaps() {
    let (place, _) = workplace("default");
    ran(&place, &["run", "scene.toml", "--clock", "virtual", "--seconds", "1", "--record", "r.csv"]);
    let text = String::from_utf8(bytes(&place, "r.csv")).expect("text");
    let is_kept = |line: usize| line % 97 != 50 && !(300..340).contains(&line);
    let kept: Vec<&str> =
        text.lines().enumerate().filter(|(line, _)| is_kept(*line)).map(|(_, row)| row).collect();
    let missing = text.lines().count() - kept.len();
    place.write("gaps.csv", kept.join("\n") + "\n");
    let said = ran(&place, &["replay", "gaps.csv", "--scene", "scene.toml", "--record", "again.csv"]);
    let told = format!("({} ticks compared, {missing} missing in it)", kept.len() - 1);
    assert!(said.out.contains(&told), "{}", said.out);
    let times = |name: &str| Table::read(&place.path(name)).texts("t").join(" ");
    assert_eq!(times("again.csv"), times("gaps.csv"));
}

/// Exports what is left and checks that it is the beginning of a run: every row, in order, from 0 on. Returns its length.
fn rows_left(place: &Workplace, recording: &str) -> usize {
    let said = ran(place, &["export", recording, "--csv", "left.csv"]);
    assert!(
        said.err.contains("it ends in the middle") && said.err.contains("what is whole is used"),
        "{}",
        said.err
    );
    let times = Table::read(&place.path("left.csv")).numbers("t");
    assert!(times.windows(2).all(|pair| pair[0] < pair[1]));
    times.len()
}

#[test]
fn a_killed_process_leaves_all_but_the_last_half_second() {
    for clock in ["real", "lockstep"] {
        let (place, _) = workplace("default");
        let mut program = place.phantom3();
        program.args(["run", "scene.toml", "--clock", clock, "--seconds", "80000", "--record", "r.mcap"]);
        let mut running = Running::start(program);
        let length = || place.path("r.mcap").metadata().map_or(0, |file| file.len());
        let begun = Instant::now();
        while length() < 300_000 {
            assert!(begun.elapsed() < Duration::from_secs(120), "{}", running.said_so_far());
            std::thread::sleep(Duration::from_millis(20));
        }
        running.child.kill().expect("our child");
        running.wait();
        // Chunks of half a second of 200 to 300 bytes a tick: some of them are there.
        let rows = rows_left(&place, "r.mcap");
        assert!(rows >= 500, "{rows} rows");
        // Real time may have missed frames, and only a whole recording is the same to the bit.
        let said = ran(&place, &["replay", "r.mcap"]);
        if clock == "lockstep" {
            assert!(said.out.contains("identical"), "{}", said.out);
        }
    }
}

/// The file without one of its chunks, and without the check sum of all, as tools that filter leave it.
fn without_chunk(whole: &[u8], which: usize) -> Vec<u8> {
    const MAGIC: usize = 8;
    let (mut left, mut at, mut chunks) = (whole[..MAGIC].to_vec(), MAGIC, 0);
    loop {
        let length = u64::from_le_bytes(whole[at + 1..at + 9].try_into().expect("eight bytes")) as usize;
        let record = &whole[at..at + 9 + length];
        at += record.len();
        match record[0] {
            0x06 => {
                if chunks != which {
                    left.extend(record);
                }
                chunks += 1;
            }
            // The end of the data; behind it a footer without a summary.
            0x0f => {
                left.extend([&record[..9], &[0; 4]].concat());
                left.extend([&[0x02, 20, 0, 0, 0, 0, 0, 0, 0][..], &[0; 20], &whole[..MAGIC]].concat());
                assert!(chunks > which, "{chunks} chunks");
                return left;
            }
            _ => left.extend(record),
        }
    }
}

#[test]
fn a_recording_without_one_of_its_chunks_is_not_whole() {
    let (place, _) = workplace("default");
    ran(&place, &["run", "scene.toml", "--clock", "virtual", "--seconds", "3", "--record", "r.mcap"]);
    let whole = bytes(&place, "r.mcap");
    for which in [3, 5] {
        place.write("less.mcap", without_chunk(&whole, which));
        let said = place.run(["export", "less.mcap", "--csv", "left.csv"]);
        assert!(said.err.contains("its end tells of 3000 rows, of which"), "{}", said.err);
        let said = place.run(["replay", "less.mcap", "--expect-same"]);
        assert_ne!(said.status, Some(0), "{}{}", said.out, said.err);
    }
}

#[test]
fn a_recording_that_was_cut_anywhere_is_read_up_to_there() {
    let (place, _) = workplace("default");
    ran(&place, &["run", "scene.toml", "--clock", "virtual", "--seconds", "3", "--record", "r.mcap"]);
    ran(&place, &["export", "r.mcap", "--csv", "whole.csv"]);
    let whole = bytes(&place, "r.mcap");
    let mut rows = Vec::new();
    for part in [3, 5, 7, 9] {
        place.write("cut.mcap", &whole[..whole.len() * part / 10]);
        rows.push(rows_left(&place, "cut.mcap"));
        assert!(bytes(&place, "whole.csv").starts_with(&bytes(&place, "left.csv")));
    }
    assert!(rows.is_sorted() && rows[0] < rows[3], "{rows:?}");
    // Nothing of a run is known before its metadata; a byte that flipped is damage and told as such.
    place.write("cut.mcap", &whole[..20]);
    let said = place.run(["export", "cut.mcap", "--csv", "left.csv"]);
    assert_eq!(said.status, Some(2), "{}", said.err);
    let mut flipped = whole.clone();
    flipped[whole.len() / 2] ^= 0x10;
    place.write("flipped.mcap", &flipped);
    let said = place.run(["export", "flipped.mcap", "--csv", "left.csv"]);
    assert_eq!(said.status, Some(3), "{}", said.err);
    assert!(said.err.contains("flipped.mcap: damaged behind"), "{}", said.err);
    assert!(bytes(&place, "whole.csv").starts_with(&bytes(&place, "left.csv")));
}

/// The run goes on to its end; one message; status 3; what was written is readable and is what was told.
fn check_full_disk(place: &Workplace, said: &Said, cause: &str, ticks: &str) {
    assert_eq!(said.status, Some(3), "{}{}", said.out, said.err);
    let messages: Vec<&str> = said.err.lines().filter(|line| !line.ends_with('%')).collect();
    let [message] = messages[..] else { panic!("not one message:\n{}", said.err) };
    assert!(message.contains("cannot write the recording") && message.contains(cause), "{message}");
    assert!(message.contains("the run goes on without it; it is complete up to t = "), "{message}");
    let (_, rows) = message.rsplit_once('(').expect("how many rows");
    let rows = rows.trim_end_matches(" rows)").parse::<usize>().expect("a number");
    assert!(said.out.contains(ticks) && said.out.contains("NOT COMPLETE"), "{}", said.out);
    assert_eq!(rows_left(place, "out.mcap"), rows);
    assert!(rows >= 500, "{rows} rows");
    assert!(ran(place, &["replay", "out.mcap"]).out.contains("identical"));
}

#[test]
fn a_file_that_may_not_grow_any_more_does_not_end_the_run() {
    // The shared memory of a driver counts as a file too, some 10 MB, so the limit leaves room for that: 20 MB or 40 MB,
    // as the shell's blocks have 512 or 1024 bytes. Eight fingers that never rest fill it.
    let script = "trap '' XFSZ; ulimit -f 40000; exec \"$0\" \"$@\"";
    let place = Workplace::new();
    place.write("scene.toml", format!("hand = \"hand.csv\"\n{}", "[[finger]]\n".repeat(8)));
    let columns = |finger: usize| format!("f{finger}_x,f{finger}_y,f{finger}_z");
    let header: Vec<String> = (0..8).map(columns).collect();
    let row = |number: usize| (0..24).map(move |cell| format!("{:?}", (number * (cell + 7)) as f64 / 997.0));
    let rows = (0..2).map(|number| {
        format!("{}{}", 200 * number, row(number).map(|n| format!(",{n}")).collect::<String>())
    });
    let rows: Vec<String> = rows.collect();
    place.write("hand.csv", format!("t,{}\n{}\n", header.join(","), rows.join("\n")));
    let said = place.shell(script, &["--clock", "virtual", "--seconds", "200", "--record", "out.mcap"]);
    check_full_disk(&place, &said, "File too large", "200201 answered");
}

/// True if these processes can have a disk of their own, which only they see; that they cannot is told.
fn can_mount(place: &Workplace) -> bool {
    let mut possible = place.prepare(Command::new("unshare"));
    possible.args([
        "--user",
        "--map-root-user",
        "--mount",
        "sh",
        "-c",
        "mkdir tried && mount -t tmpfs none tried",
    ]);
    if !possible.stderr(Stdio::null()).bounded_status().is_ok_and(|status| status.success()) {
        eprintln!(
            "skipped: no small disk can be mounted here; the test with a limited file covers the same path"
        );
        return false;
    }
    true
}

/// Room for what stands before the first tick, and not for the first half second.
#[test]
fn a_disk_without_room_for_the_first_rows_leaves_the_earlier_recordings() {
    let (place, _) = workplace("lift");
    if !can_mount(&place) {
        return;
    }
    // A recording of one tick has room for what stands before it, and none for half a second.
    ran(&place, &["run", "scene.toml", "--clock", "virtual", "--seconds", "0.001", "--record", "one.mcap"]);
    let room = bytes(&place, "one.mcap").len();
    let mount = format!("mkdir small && mount -t tmpfs -o size={room} tmpfs small");
    for name in ["out.mcap", "out.csv"] {
        let (begin, end) = (format!("printf earlier >small/{name}"), format!("cp small/{name} {name}"));
        let inside = format!("{mount} && {begin} && \"$0\" \"$@\"; end=$?; {end}; exit $end");
        let script = format!("exec unshare --user --map-root-user --mount sh -c '{inside}' \"$0\" \"$@\"");
        let record = format!("small/{name}");
        let said = place.shell(&script, &["--clock", "virtual", "--seconds", "2", "--record", &record]);
        assert_eq!(said.status, Some(3), "{}{}", said.out, said.err);
        let told = format!("cannot write the recording small/{name}: No space left on device");
        assert!(said.err.contains(&told) && said.err.contains("is as it was"), "{}", said.err);
        assert!(said.out.contains("(0 rows) NOT WRITTEN"), "{}", said.out);
        assert_eq!(bytes(&place, name), b"earlier", "{name}: {}", said.err);
        std::fs::remove_dir(place.path("small")).expect("ours");
    }
}

#[test]
fn a_disk_that_fills_up_does_not_end_the_run() {
    let mount = "mkdir small && mount -t tmpfs -o size=900k tmpfs small";
    let (place, _) = workplace("default");
    if !can_mount(&place) {
        return;
    }
    // What is on it is copied out at the end.
    let inside = format!("{mount} && \"$0\" \"$@\"; end=$?; cp small/out.mcap out.mcap; exit $end");
    let script = format!("exec unshare --user --map-root-user --mount sh -c '{inside}' \"$0\" \"$@\"");
    for clock in ["virtual", "lockstep"] {
        let arguments = ["--clock", clock, "--seconds", "20", "--record", "small/out.mcap"];
        let said = place.shell(&script, &arguments);
        check_full_disk(&place, &said, "No space left on device", "answered");
        std::fs::remove_dir(place.path("small")).expect("ours");
    }
}

#[test]
fn a_recording_that_cannot_even_begin_stops_the_run_before_it_starts() {
    let (place, _) = workplace("default");
    std::os::unix::fs::symlink("/dev/full", place.path("full.mcap")).expect("a link");
    let said = place.run(["run", "scene.toml", "--clock", "virtual", "--record", "full.mcap"]);
    assert_eq!((said.status, said.out.as_str()), (Some(2), ""), "{}", said.err);
    assert!(
        said.err.contains("cannot create the recording full.mcap: No space left on device"),
        "{}",
        said.err
    );
    let said = place.run(["run", "scene.toml", "--record", "a.mcap", "--record", "./a.mcap"]);
    assert_eq!(said.status, Some(2), "{}", said.err);
    assert!(said.err.contains("--record ./a.mcap is given twice"), "{}", said.err);
}

/// A pipe whose reader sleeps is the slowest disk there is: it takes 64 KiB, then nothing for a while.
#[test]
fn a_disk_that_stalls_costs_rows_which_are_counted_and_never_the_run() {
    const STALL: Duration = Duration::from_secs(4);
    let (place, _) = workplace("default");
    let made = Command::new("mkfifo").arg(place.path("slow.mcap")).bounded_status().expect("mkfifo");
    assert!(made.success());
    let path = place.path("slow.mcap");
    let reader = std::thread::spawn(move || {
        let mut pipe = std::fs::File::open(path).expect("the pipe");
        // What stands before the first tick, the hand file among it, and the first rows.
        let mut bytes = vec![0; DEFAULT_HAND.len() + 30_000];
        pipe.read_exact(&mut bytes).expect("the beginning");
        std::thread::sleep(STALL);
        pipe.read_to_end(&mut bytes).expect("the rest");
        bytes
    });
    let said = place.run([
        "run",
        "scene.toml",
        "--rate-hz",
        "8000",
        "--seconds",
        "3.5",
        "--record",
        "slow.mcap",
        "--record",
        "fast.csv",
    ]);
    let written = reader.bounded_join().expect("the reader");
    assert_eq!(said.status, Some(0), "{}", said.err);
    place.write("slow.mcap.copy.mcap", &written);
    let lines = |name: &str| said.out.lines().find(|line| line.contains(name)).unwrap_or_default().to_owned();
    let (slow, fast) = (lines("slow.mcap"), lines("fast.csv"));
    assert!(slow.contains(" LOST: its reader was too slow") && !fast.contains("LOST"), "{}", said.out);
    // The other recording has every row, so the loop gave them all.
    ran(&place, &["export", "slow.mcap.copy.mcap", "--csv", "left.csv"]);
    let (left, all) = (Table::read(&place.path("left.csv")), Table::read(&place.path("fast.csv")));
    assert!(left.len() < all.len());
    assert!(slow.contains(&format!("({} rows, {} LOST", left.len(), all.len() - left.len())), "{slow}");
    // Metadata are texts with their lengths, and not compressed.
    let lost = (all.len() - left.len()).to_string();
    let told = [b"rows_lost", &(lost.len() as u32).to_le_bytes()[..], lost.as_bytes()].concat();
    assert!(written.windows(told.len()).any(|window| window == told), "in the file itself");
}

#[test]
fn the_public_reader_reads_it_where_it_is_installed() {
    let python = std::env::var_os("PHANTOM3_MCAP_PYTHON");
    let Some(python) = python else {
        eprintln!(
            "skipped: set PHANTOM3_MCAP_PYTHON to a Python with mcap and mcap-protobuf-support; .ci/run does"
        );
        return;
    };
    let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/examples/read_recording.py");
    let (place, seconds) = workplace("everything");
    let run = ["run", "scene.toml", "--clock", "virtual", "--seconds", seconds];
    ran(&place, &[&run[..], &["--record", "r.mcap", "--record", "r.csv"]].concat());
    let read = |arguments: &[&str]| {
        let mut command = place.prepare(Command::new(&python));
        command.arg(&example).args(arguments);
        let said = Running::start(command).wait();
        assert_eq!(said.status, Some(0), "{}{}", said.out, said.err);
        said
    };
    let said = read(&["r.mcap", "--against", "r.csv"]);
    assert!(said.out.contains("1600 rows are the same in r.mcap and r.csv"), "{}", said.out);
    assert!(said.out.contains("contact-begin") && said.out.contains("complete: 1600 rows"), "{}", said.out);
    let whole = bytes(&place, "r.mcap");
    place.write("cut.mcap", &whole[..whole.len() * 7 / 10]);
    let said = read(&["cut.mcap"]);
    assert!(said.err.contains("cut short") && said.out.contains("not complete"), "{}{}", said.out, said.err);
}

#[test]
fn a_parquet_table_that_a_full_disk_cut_off_is_taken_away() {
    let (place, seconds) = workplace("lift");
    ran(&place, &["run", "scene.toml", "--clock", "virtual", "--seconds", seconds, "--record", "r.mcap"]);
    // 50 or 100 kB, as the shell's blocks have 512 or 1024 bytes.
    let said = place.shell("trap '' XFSZ; ulimit -f 100; exec \"$0\" export r.mcap out.parquet", &[]);
    assert_eq!(said.status, Some(3), "{}", said.err);
    let words =
        "File too large (os error 27); a Parquet file without its end cannot be read: nothing is left of it";
    assert!(said.err.contains(words), "{}", said.err);
    assert!(!place.path("out.parquet").exists());
}
