//! Recordings that another program made or rewrote: what is said of them is true, and what can be read is read.

use super::mcap_bytes::{CHUNK, chunk, file, record, records, text};
use super::{assert_says, refused, with_recordings, workplace};
use std::fs;
use system_tests::workplace::Workplace;

/// A workplace with `good.mcap` and `good.csv`, and the text of the latter.
fn with_table() -> (Workplace, String) {
    let place = workplace();
    with_recordings(&place);
    let good = fs::read_to_string(place.path("good.csv")).expect("a recording");
    (place, good)
}

/// A sound file of somebody else, with JSON on a channel that is called as ours is.
fn of_json(in_chunk: Option<&str>) -> Vec<u8> {
    let channel = [&[7, 0, 0, 0][..], &text("/tick"), &text("json"), &[0; 4]].concat();
    let message = [&[7, 0][..], &[0; 4 + 8 + 8], br#"{"t": 0.0, "x": 1}"#].concat();
    let records = [record(0x04, &channel), record(0x05, &message)].concat();
    let data = match in_chunk {
        Some(compression) => chunk(&[0; 16], records.len() as u64, compression, &records),
        None => records,
    };
    let header = record(0x01, &[text(""), text("elsewhere")].concat());
    file([header, data, record(0x0f, &[0; 4]), record(0x02, &[0; 20])])
}

/// The same recording, its chunks said to be compressed by zstd.
fn with_zstd(ours: &[u8]) -> Vec<u8> {
    let rewritten = records(ours).into_iter().map(|(opcode, body)| match opcode {
        CHUNK => {
            let content = u64::from_le_bytes(body[16..24].try_into().expect("8 bytes"));
            chunk(&body[..16], content, "zstd", &body[28 + 4 + 3 + 8..])
        }
        _ => record(opcode, body),
    });
    file(rewritten)
}

#[test]
fn a_sound_mcap_file_of_another_program_is_none_of_ours_and_not_damaged() {
    let place = workplace();
    for in_chunk in [None, Some(""), Some("zstd")] {
        place.write("theirs.mcap", of_json(in_chunk));
        for command in [
            &["export", "theirs.mcap", "--csv", "out2.csv"][..],
            &["replay", "theirs.mcap"],
            &["plot", "theirs.mcap"],
        ] {
            let said = refused(&place, command);
            assert_says(
                &said,
                &["theirs.mcap is no recording of", "no metadata of a run", "another program"],
            );
            assert!(!said.contains("damaged"), "{in_chunk:?} {command:?}: {said}");
        }
    }
}

#[test]
fn our_own_recording_rewritten_with_zstd_is_told_with_the_command_that_rewrites_it_with_lz4() {
    let (place, _) = with_table();
    place.write("zstd.mcap", with_zstd(&fs::read(place.path("good.mcap")).expect("a recording")));
    for command in
        [&["export", "zstd.mcap", "--csv", "out2.csv"][..], &["replay", "zstd.mcap"], &["plot", "zstd.mcap"]]
    {
        let said = refused(&place, command);
        assert_says(&said, &["zstd.mcap: its chunks are compressed by zstd", "allowed: lz4, or none"]);
        assert_says(&said, &["mcap compress --compression lz4"]);
        assert!(!said.contains("damaged") && !said.contains("no recording"), "{said}");
    }
}

#[test]
fn a_table_with_windows_line_ends_and_a_byte_order_mark_is_the_same_recording() {
    let (place, good) = with_table();
    for (name, text) in [
        ("crlf.csv", good.replace('\n', "\r\n")),
        ("bom.csv", format!("\u{feff}{good}")),
        ("both.csv", format!("\u{feff}{}", good.replace('\n', "\r\n"))),
    ] {
        place.write(name, text);
        let said = place.run(["export", name, "again.csv"]);
        assert_eq!(said.status, Some(0), "{name}: {}", said.err);
        assert!(fs::read_to_string(place.path("again.csv")).expect("a table") == good, "{name}");
        let said = place.run(["replay", name, "--scene", "scene.toml"]);
        assert_eq!(said.status, Some(0), "{name}: {}", said.err);
    }
}

#[test]
fn a_table_without_the_columns_of_a_recording_is_told_with_the_first_one_that_is_not_there() {
    let (place, good) = with_table();
    let (header, _) = good.split_once('\n').expect("a header");
    let cases: [(String, &[&str]); 7] = [
        (good.replace(',', ";"), &["it has semicolons, and columns are separated by commas"]),
        (good.replace(',', "\t"), &["it has tabs, and columns are separated by commas"]),
        ("time,fx\n0,1\n".into(), &["its first line is \"time,fx\"", "f0_hip_x"]),
        (good.replacen("f0_god_y", "f0_gody", 1), &["its column 6 is \"f0_gody\", expected \"f0_god_y\""]),
        (
            "t,f0_hip_x,f0_hip_y\n0,0,0\n".into(),
            &["its first line ends behind 3 columns, expected \"f0_hip_z\""],
        ),
        (good.replacen(header, &format!("{header},note"), 1), &["is \"note\", expected no more than"]),
        (good.replacen("\n0.0,", "\n0,0,", 1), &["bad.csv:2: found", "cells, expected"]),
    ];
    for (text, parts) in cases {
        place.write("bad.csv", text);
        for command in
            [&["export", "bad.csv", "--csv", "out2.csv"][..], &["replay", "bad.csv", "--scene", "scene.toml"]]
        {
            assert_says(&refused(&place, command), parts);
        }
    }
}

#[test]
fn a_file_that_is_empty_or_of_another_kind_is_told_by_what_it_is() {
    let (place, good) = with_table();
    let utf16: Vec<u8> = [0xfeff].into_iter().chain(good.encode_utf16()).flat_map(u16::to_le_bytes).collect();
    for (name, bytes, says) in [
        ("empty.mcap", &b""[..], "it is empty"),
        ("empty.csv", b"", "it is empty"),
        ("utf16.csv", &utf16, "it is UTF-16 text; save the file as UTF-8"),
        ("good.csv.gz", b"\x1f\x8b\x08\x00", "it is compressed by gzip"),
        ("good.xlsx", b"PK\x03\x04\x14\x00", "it is a ZIP archive"),
    ] {
        place.write(name, bytes);
        for command in
            [&["export", name, "out2.csv"][..], &["replay", name, "--scene", "scene.toml"], &["plot", name]]
        {
            let said = refused(&place, command);
            assert_says(&said, &[name, says]);
        }
    }
}

#[test]
fn a_recording_that_is_damaged_is_exported_and_drawn_up_to_there_and_both_end_with_status_3() {
    let (place, good) = with_table();
    let bad: Vec<_> = good.lines().enumerate().map(|(i, l)| if i == 50 { "x,y" } else { l }).collect();
    place.write("bad.csv", bad.join("\n") + "\n");
    let said = place.run(["export", "bad.csv", "part.csv"]);
    assert_eq!(said.status, Some(3), "{}", said.err);
    assert_says(&said.err, &["bad.csv:51:", "what is whole before it is used: 49 rows, up to t = 0.048 s"]);
    assert_says(&said.out, &["part.csv (49 rows, up to the damage)"]);
    let part = fs::read_to_string(place.path("part.csv")).expect("a table");
    assert!(good.starts_with(&part) && part.lines().count() == 50, "{part}");
    // Empty lines behind the last row are none of its rows.
    place.write("empty.csv", format!("{good}\n\r\n\n"));
    let said = place.run(["export", "empty.csv", "all.csv"]);
    assert_eq!((said.status, said.err.as_str()), (Some(0), ""));
    assert_eq!(fs::read_to_string(place.path("all.csv")).expect("a table"), good);
    let said = place.run(["plot", "bad.csv"]);
    assert_eq!(said.status, Some(3), "{}", said.err);
    assert_says(&said.err, &["bad.csv", "what is whole before it is used: 49 rows, up to t = 0.048 s"]);
    assert!(place.path("bad.svg").exists() && said.out.contains("written"), "{}", said.out);
}

/// One reader: what one command calls damaged, the other does.
#[test]
fn a_table_that_export_calls_damaged_is_called_so_by_plot_in_the_same_words() {
    let (place, good) = with_table();
    let lines: Vec<&str> = good.lines().collect();
    let row = lines[50];
    let with_row = |new: String| [&lines[..50], &[&*new], &lines[51..]].concat().join("\n") + "\n";
    let (time, cells) = row.split_once(',').expect("columns");
    let state = ["stick", "slip", "free"].into_iter().find(|state| row.contains(&format!(",{state},")));
    let state = state.expect("a state");
    for (text, words) in [
        (with_row(String::new()), "bad.csv:51: found an empty line"),
        (
            with_row(row.replacen(state, "sliding", 1)),
            "bad.csv:51: f0_friction is \"sliding\", which is no word",
        ),
        (with_row(format!("\"{time},{cells}")), "bad.csv:51: t is \"\\\""),
        (with_row(format!("\t{row}")), "bad.csv:51: t is \"\\t"),
        (with_row(format!("{row},1")), "bad.csv:51: found"),
    ] {
        place.write("bad.csv", &text);
        let [exported, drawn] = [&["export", "bad.csv", "part.csv"][..], &["plot", "bad.csv", "--svg-only"]]
            .map(|command| place.run(command));
        assert_eq!((exported.status, drawn.status), (Some(3), Some(3)), "{}{}", exported.err, drawn.err);
        assert_says(&drawn.err, &[words]);
        assert_eq!(drawn.err, exported.err);
    }
    let header = lines[0].replace(',', "\t");
    for text in [header + "\n", "\u{0}\u{1}\n".into(), String::from_utf8_lossy(b"BZh91AY").into_owned()] {
        place.write("bad.csv", &text);
        let [exported, drawn] = [&["export", "bad.csv", "new.csv"][..], &["plot", "bad.csv", "--svg-only"]]
            .map(|command| refused(&place, command));
        assert!(drawn == exported || text.starts_with('\0'), "{drawn}{exported}");
    }
    place.write("bad.csv", [0x80, 0xff, b'\n']);
    assert_says(&refused(&place, &["plot", "bad.csv"]), &["bad.csv is no recording", "it is no text"]);
}

#[test]
fn a_name_that_means_another_kind_of_picture_is_refused() {
    let (place, _) = with_table();
    for name in ["-", "forces.pdf", "a/forces.JPG"] {
        let before = place.snapshot();
        let words = refused(&place, &["plot", "r.csv", "--out", name]);
        assert_says(&words, &["--out: found", "allowed: a name without ending"]);
        assert_eq!(place.snapshot(), before);
    }
}

#[test]
fn of_a_recording_without_rows_nothing_is_drawn_and_no_table_is_made() {
    let (place, good) = with_table();
    place.write("header.csv", good.lines().take(1).map(|line| format!("{line}\n")).collect::<String>());
    for command in [&["plot", "header.csv"][..], &["export", "header.csv", "out.csv", "new.parquet"]] {
        assert_says(&refused(&place, command), &["header.csv: it has no rows"]);
    }
}

#[test]
fn a_record_of_an_mcap_file_that_cannot_be_used_is_told_with_what_is_wrong_with_it() {
    let (place, _) = with_table();
    let good = fs::read(place.path("good.mcap")).expect("a recording");
    let at = |words: &[u8]| good.windows(words.len()).position(|found| found == words).expect("it is there");
    for (place_of, byte, reason) in [
        (at(b"[[finger]]"), b'(', "the attached file scene:scene.toml does not have its check sum"),
        (at(b"scene:scene.toml"), 0xff, "a text in a record is not UTF-8"),
        (at(b"phantom3.run"), 0xff, "a text in a record is not UTF-8"),
    ] {
        let mut bad = good.clone();
        bad[place_of] = byte;
        place.write("bad.mcap", bad);
        for command in [&["export", "bad.mcap", "out2.csv"][..], &["replay", "bad.mcap"]] {
            let said = place.run(command);
            assert_says(&said.err, &["bad.mcap", reason]);
            assert!(said.status == Some(2) || said.status == Some(3), "{command:?}: {:?}", said.status);
        }
    }
}
