//! MCAP recordings whose records contradict one another, or would fill the memory: told as damaged, behind so many good
//! rows.

use super::mcap_bytes::{
    CHANNEL, CHUNK, DATA_END, MESSAGE, METADATA, attachment, file, plain_chunk, record, records, text,
};
use super::{assert_says, run_in_little_memory, with_recordings, workplace};
use std::fs;
use system_tests::workplace::{Said, Workplace};

/// The records of a recording of ours with eight fingers, in several chunks.
fn with_chunks() -> (Workplace, Vec<u8>) {
    let place = workplace();
    place.write("fingers.toml", "[[finger]]\n".repeat(8));
    let arguments = ["--clock", "virtual", "--seconds", "6", "--record", "chunks.mcap"];
    assert_eq!(place.run(["run", "fingers.toml"].iter().chain(&arguments)).status, Some(0));
    let good = fs::read(place.path("chunks.mcap")).expect("a recording");
    (place, good)
}

/// The recording with more records behind its second chunk: the first one has the scene, the second one rows. Without the check sum of all data, which they would change.
fn with_behind_the_first_rows(good: &[u8], more: &[u8]) -> Vec<u8> {
    let mut chunks = 0;
    let changed: Vec<Vec<u8>> = records(good)
        .into_iter()
        .map(|(opcode, body)| match opcode {
            CHUNK => {
                chunks += 1;
                [&record(opcode, body)[..], if chunks == 2 { more } else { &[] }].concat()
            }
            DATA_END => record(opcode, &[0; 4]),
            _ => record(opcode, body),
        })
        .collect();
    assert!(chunks > 3, "there are more rows: {chunks} chunks");
    file(changed)
}

/// The metadata of this name, with another value for a key that it has.
fn changed_metadata(good: &[u8], name: &str, from: &str, to: &str) -> Vec<u8> {
    let all = records(good);
    let is_it = |body: &[u8]| body.starts_with(&text(name));
    let (_, body) = all.iter().find(|(opcode, body)| *opcode == METADATA && is_it(body)).expect("metadata");
    let at = body.windows(from.len()).rposition(|part| part == from.as_bytes()).expect("its value");
    assert_eq!(from.len(), to.len(), "lengths stand before texts");
    let mut body = body.to_vec();
    body[at..at + to.len()].copy_from_slice(to.as_bytes());
    record(METADATA, &body)
}

/// Exports and replays it; both have to say this.
fn assert_damaged(place: &Workplace, bad: &[u8], says: &[&str]) {
    place.write("bad.mcap", bad);
    for command in [
        &["export", "bad.mcap", "t.csv", "t.parquet"][..],
        &["replay", "bad.mcap"],
        &["plot", "bad.mcap", "--svg-only"],
    ] {
        let Said { status, out, err } = run_in_little_memory(place, 2000, command);
        assert!(matches!(status, Some(2 | 3)), "{says:?} {command:?}: {status:?} {out}{err}");
        assert_says(&err, &["bad.mcap: damaged behind "]);
        assert_says(&err, says);
    }
}

#[test]
fn what_a_recording_tells_of_its_run_does_not_change_behind_its_first_row() {
    let (place, good) = with_chunks();
    for (name, from, to) in [
        ("phantom3.columns", "\"f7\"", "\"g7\""),
        ("phantom3.columns", "[false,false,false,", "[false,false,true ,"),
        ("phantom3.run", "1000000", "2000000"),
    ] {
        let more = changed_metadata(&good, name, from, to);
        assert_damaged(
            &place,
            &with_behind_the_first_rows(&good, &more),
            &[&format!("its {name} changes behind the first row")],
        );
    }
    // Told again, as tools that join files do, it says nothing new.
    let same = changed_metadata(&good, "phantom3.run", "1000000", "1000000");
    place.write("same.mcap", with_behind_the_first_rows(&good, &same));
    let said = place.run(["export", "same.mcap", "same.csv"]);
    assert_eq!(said.status, Some(0), "{}", said.err);
}

#[test]
fn names_with_control_characters_are_damage() {
    let (place, good) = with_chunks();
    // As JSON has it; the name is as long.
    let columns = changed_metadata(
        &good,
        "phantom3.columns",
        "[\"f0\",\"f1\",\"f2\",\"f3\"",
        "[\"\\u001b[2J\"   ,\"f3\"",
    );
    let bad = records(&good).into_iter().map(|(opcode, body)| match opcode {
        METADATA if body.starts_with(&text("phantom3.columns")) => columns.clone(),
        DATA_END => record(opcode, &[0; 4]),
        _ => record(opcode, body),
    });
    assert_damaged(&place, &file(bad), &["its names: found \"\\u{1b}[2J\"", "no control characters"]);
}

#[test]
fn a_chunk_with_records_that_stand_in_none_is_damaged() {
    let (place, good) = with_chunks();
    let inner = plain_chunk(&record(MESSAGE, &[0; 22]));
    for (records, what) in [
        (inner, "a chunk"),
        (attachment("model:huge.obj", b"v 0 0 0"), "an attachment"),
        (record(METADATA, &[text("x"), text("")].concat()), "metadata"),
    ] {
        let bad = with_behind_the_first_rows(&good, &plain_chunk(&records));
        assert_damaged(
            &place,
            &bad,
            &[&format!("a chunk holds {what}; allowed: schemas, channels and messages")],
        );
    }
}

#[test]
fn orders_and_files_in_a_recording_take_no_more_memory_than_a_run_can_have_given_it() {
    let place = workplace();
    with_recordings(&place);
    let good = fs::read(place.path("good.mcap")).expect("a recording");
    let channel =
        record(CHANNEL, &[&[0x77, 0x77, 0, 0][..], &text("/orders"), &text("protobuf"), &[0; 4]].concat());
    let order = record(MESSAGE, &[&[0x77, 0x77][..], &[0; 20]].concat());
    let orders = plain_chunk(&[channel, order.repeat(1 << 20)].concat());
    let with_orders = |orders: &[u8]| {
        let mut all: Vec<Vec<u8>> =
            records(&good).into_iter().map(|(opcode, body)| record(opcode, body)).collect();
        let first = records(&good).iter().position(|(opcode, _)| *opcode == CHUNK).expect("a chunk");
        all.insert(first + 1, orders.to_vec());
        file(all)
    };
    assert_damaged(&place, &with_orders(&orders), &["its orders take more than 16 MiB"]);
}
