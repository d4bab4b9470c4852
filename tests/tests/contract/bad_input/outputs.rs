//! Output files beside one that is refused, fails, or is read no further: nothing of theirs is lost.

use super::{BALL, PRECIOUS, SCENE, assert_says, refused, with_recordings, workplace};
use std::fs;
use system_tests::workplace::Workplace;

/// A recording and its table, of more than a megabyte.
fn with_long_recording() -> (Workplace, Vec<u8>) {
    let place = workplace();
    let arguments =
        ["--clock", "virtual", "--seconds", "20", "--record", "long.mcap", "--record", "long.csv"];
    let said = place.run(["run", "scene.toml"].iter().chain(&arguments));
    assert_eq!(said.status, Some(0), "{}", said.err);
    let table = fs::read(place.path("long.csv")).expect("a table");
    (place, table)
}

fn is_whole_parquet(place: &Workplace, name: &str) -> bool {
    let bytes = fs::read(place.path(name)).unwrap_or_default();
    bytes.len() > 1000 && bytes.starts_with(b"PAR1") && bytes.ends_with(b"PAR1")
}

#[test]
fn a_reader_who_has_seen_enough_of_an_export_costs_the_other_tables_nothing() {
    let (place, table) = with_long_recording();
    let script = "{ \"$0\" export long.mcap all.csv all.parquet -; echo \"status $?\" >&2; } | head -n 1";
    let said = place.shell(script, &[]);
    assert_says(&said.err, &["status 0\n", "all.csv (20000 rows)", "all.parquet (20000 rows)"]);
    assert!(!said.err.contains("standard output ("), "a table that was not read is not told: {}", said.err);
    assert_eq!(said.out.lines().count(), 1);
    assert!(fs::read(place.path("all.csv")).expect("a table") == table);
    assert!(is_whole_parquet(&place, "all.parquet"));
}

#[test]
fn a_table_of_an_export_that_cannot_be_written_costs_the_others_nothing() {
    let (place, table) = with_long_recording();
    // The disk of the first is full; no file of the second may have a megabyte.
    for bad in ["/dev/full", "bad.csv"] {
        let script = "trap '' XFSZ; [ \"$1\" = /dev/full ] || ulimit -f 1000; \
            exec \"$0\" export long.mcap \"$4\" all.parquet";
        let said = place.shell(script, &["", bad]);
        let begins = bad == "bad.csv";
        assert_eq!(said.status, Some(if begins { 3 } else { 2 }), "{bad}: {}", said.err);
        assert_says(&said.err, &[bad]);
        assert_eq!(is_whole_parquet(&place, "all.parquet"), begins, "{bad}: {}", said.err);
        assert_eq!(said.out.contains("all.parquet (20000 rows)"), begins, "{}", said.out);
    }
    assert!(table.len() > 1 << 20, "longer than the limit: {}", table.len());
}

#[test]
fn a_table_of_an_export_that_cannot_be_made_leaves_the_others_as_they_were() {
    let place = workplace();
    with_recordings(&place);
    for bad in ["none/x.csv", "none/x.parquet", "/dev/full"] {
        let said = refused(&place, &["export", "good.mcap", "out.csv", "new.csv", bad]);
        assert_says(&said, &[bad]);
    }
    assert_eq!(fs::read_to_string(place.path("out.csv")).expect("a file"), PRECIOUS);
}

#[test]
fn recordings_of_later_scenes_never_take_the_name_of_another_output_or_of_an_input() {
    let place = workplace();
    place.write("next.toml", SCENE.replace("table", "ground"));
    place.write("orders.txt", "at 0.1 swap next.toml\nat 0.3 swap next.toml\n");
    // An input that is called as the second scene of `v.csv` would be.
    let hand = "t,f0_x,f0_y,f0_z\n0,0,0,0\n1,0,0,0\n";
    place.write("v.2.csv", hand);
    let said = place.run([
        "run",
        "scene.toml",
        "--clock",
        "virtual",
        "--seconds",
        "0.5",
        "--orders",
        "orders.txt",
        "--hand",
        "v.2.csv",
        "--record",
        "w.csv",
        "--record",
        "w.2.csv",
        "--record",
        "v.csv",
        "--record",
        "x.csv",
        "--events",
        "x.2.csv",
    ]);
    assert_eq!(said.status, Some(0), "{}", said.err);
    assert_eq!(fs::read_to_string(place.path("v.2.csv")).expect("the hand"), hand);
    let read =
        |name: &str| fs::read_to_string(place.path(name)).unwrap_or_else(|_| panic!("{name} is there"));
    assert!(
        read("w.2.csv").starts_with("t,") && read("w.2.csv") == read("w.csv"),
        "both are of the first scene"
    );
    assert!(read("x.2.csv").lines().any(|line| line.contains("scene")), "{}", read("x.2.csv"));
    // Of three scenes each recording has three files, and each file is told.
    let scenes = [
        ["w.csv", "w.3.csv", "w.4.csv"],
        ["w.2.csv", "w.2.2.csv", "w.2.3.csv"],
        ["v.csv", "v.3.csv", "v.4.csv"],
        ["x.csv", "x.3.csv", "x.4.csv"],
    ];
    for files in scenes {
        let rows = files.map(|file| read(file).lines().count() - 1);
        assert!(
            rows.iter().sum::<usize>() == 500 && rows.iter().all(|rows| *rows > 50),
            "{files:?}: {rows:?}"
        );
        assert_eq!(files.map(&read), scenes[0].map(&read), "the same three scenes");
        assert_says(&said.out, &files);
    }
}

/// A list of one ball, and the ball.
fn with_list(place: &Workplace) {
    place.write("objects.ini", "GameObject ball\n");
    place.write("ball.ini", BALL);
}

#[test]
fn a_scene_is_not_converted_onto_one_of_its_own_files() {
    let place = workplace();
    with_list(&place);
    for out in ["objects.ini", "ball.ini"] {
        let said = refused(&place, &["convert", "objects.ini", "--out", out]);
        assert_says(&said, &["--out", "would overwrite the input", out]);
    }
}
