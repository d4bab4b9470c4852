//! Reading scene files from a disk that holds more than scene files.

use std::fs;
use std::path::Path;

use world::{Layout, MAX_FILE_BYTES, Scene, SceneError};

/// A file in a directory of its own; what it holds is `bytes`.
fn refused(bytes: &[u8]) -> String {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let file = dir.path().join("s.toml");
    fs::write(&file, bytes).expect("write");
    let message = Scene::load(&file).expect_err("the file is wrong").to_string();
    message.replace(&dir.path().display().to_string(), "dir")
}

#[test]
fn a_scene_file_on_disk_is_read_and_its_hand_stands_beside_it() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let file = dir.path().join("s.toml");
    // With the mark some editors put in front, and their line ends.
    fs::write(&file, "\u{feff}hand = \"h.csv\"\r\n[[finger]]\r\n").expect("write");
    let scene = Scene::load(&file).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(scene.hand, Some(dir.path().join("h.csv")));
}

#[test]
fn a_file_that_is_not_there_is_named() {
    let error = Scene::load("no/such.toml").expect_err("it is not there");
    assert_eq!(error.to_string(), "no/such.toml: no such file; name an existing TOML file");
    assert!(matches!(Layout::load("no/such.toml"), Err(SceneError::NotFound { .. })));
}

#[test]
fn a_directory_is_refused_with_what_the_system_says() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let error = Scene::load(dir.path()).expect_err("a directory is no scene");
    assert!(matches!(error, SceneError::Unreadable { .. }), "{error}");
}

#[test]
fn bytes_that_are_not_utf8_are_refused_with_their_line() {
    let message = refused(b"name = \"a\"\nhand = \"\xff.csv\"\n");
    assert_eq!(message, "dir/s.toml:2: byte 19 is not UTF-8 text; save the file as UTF-8");
    let message = refused(b"\x89PNG\r\n\x1a\n");
    assert_eq!(message, "dir/s.toml: cannot be read: it is a picture; name the file itself");
    let message = refused(b"\xff\xfen\0a\0");
    assert_eq!(message, "dir/s.toml: cannot be read: it is UTF-16 text; save the file as UTF-8");
}

#[test]
fn a_file_beyond_the_limit_is_refused_and_one_at_it_is_read() {
    let mut bytes = b"[[finger]]\n# A long comment".to_vec();
    bytes.resize(MAX_FILE_BYTES as usize, b'.');
    let at_limit = String::from_utf8(bytes.clone()).expect("ASCII");
    assert!(Scene::parse(&at_limit, Path::new("s.toml")).is_ok());
    bytes.push(b'.');
    let message = "dir/s.toml: larger than 16777216 bytes, which is the most this file may have";
    assert_eq!(refused(&bytes), message);
}

#[test]
fn lines_are_counted_right_after_a_byte_order_mark_and_windows_line_ends() {
    let message = refused("\u{feff}name = \"a\"\r\n[[finger]]\r\nradius = 1\r\n".as_bytes());
    assert_eq!(
        message,
        "dir/s.toml:3: finger[0].radius: unknown key (did you mean `radius_m`?); allowed: name, \
         radius_m, start_m, device, passivity, soft, attach, within"
    );
}

#[test]
fn ten_thousand_entities_are_read() {
    let entity = "[[entity]]\nshape = { kind = \"sphere\", radius_m = 0.01 }\n";
    let text = format!("[[finger]]\n{}", entity.repeat(10_000));
    let scene = Scene::parse(&text, Path::new("shelf.toml")).expect("nothing is wrong");
    assert_eq!(scene.entities.last().map(|entity| entity.name.as_str()), Some("e9999"));
}

/// A scene that includes what is no file: with pipes, the test ends only if nobody waits for a writer.
#[test]
fn an_include_that_is_a_pipe_a_device_or_a_directory_is_refused_at_once() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let pipe = dir.path().join("pipe.toml");
    let mode = rustix::fs::Mode::RUSR | rustix::fs::Mode::WUSR;
    rustix::fs::mknodat(rustix::fs::CWD, &pipe, rustix::fs::FileType::Fifo, mode, 0).expect("a pipe");
    for (include, found) in
        [("pipe.toml", "a pipe"), ("/dev/zero", "a device"), ("/dev/tty", "a device"), (".", "a directory")]
    {
        let file = dir.path().join("s.toml");
        fs::write(&file, format!("include = [\"{include}\"]\n[[finger]]\n")).expect("write");
        let message = Scene::load(&file).expect_err("no file").to_string();
        assert!(message.contains("s.toml:1: include[0]:"), "{message}");
        assert!(message.contains(&format!("cannot be read: it is {found}, no regular file")), "{message}");
    }
}

#[test]
fn included_files_that_are_too_large_together_are_refused_where_the_first_too_much_is_included() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let names: Vec<String> = (0..5).map(|number| format!("{number}.toml")).collect();
    // Four of them are the bound, and the scene's own text is a part of it.
    let large = "#".repeat(MAX_FILE_BYTES as usize);
    for name in &names {
        fs::write(dir.path().join(name), &large).expect("write");
    }
    let scene = |count: usize| {
        let file = dir.path().join("s.toml");
        fs::write(&file, format!("include = {:?}\n[[finger]]\n", &names[..count])).expect("write");
        Scene::load(&file)
    };
    scene(3).expect("below the bound");
    let message = scene(4).expect_err("above it").to_string();
    let expected =
        "s.toml:1: include[3]: found files of more than 67108864 bytes together; allowed: at most that";
    assert!(message.ends_with(expected), "{message}");
}

#[test]
fn a_file_of_more_values_than_any_scene_has_is_refused_before_they_are_made() {
    // Two bytes make a value of two hundred.
    let text = format!("[[finger]]\nx = [{}]\n", "0,".repeat(1 << 20));
    let message = Scene::parse(&text, Path::new("s.toml")).expect_err("too many").to_string();
    assert_eq!(message, "s.toml: more than 1048576 values, which is the most this file may have");
}

#[test]
fn tables_that_headers_and_dotted_keys_make_are_bounded_as_well() {
    let parts = ["a"; 70].join(".");
    // A megabyte of text, of which each part of a name makes a table with room for eleven keys.
    let texts = ["[x{}.{}]\n", "x{}.{} = 0\n", "[[x{}.{}]]\n"].map(|form| {
        let line = |number: usize| form.replacen("{}", &number.to_string(), 1).replacen("{}", &parts, 1);
        (0..5000).map(line).collect::<String>()
    });
    let nested = format!("x = [{}]\n", "{a=0},".repeat(300_000));
    for text in texts.iter().chain([&nested]) {
        let message = Scene::parse(text, Path::new("s.toml")).expect_err("too many").to_string();
        assert_eq!(message, "s.toml: more than 262144 tables, which is the most this file may have");
    }
}

#[test]
fn signs_that_mean_nothing_are_bounded_as_well() {
    for sign in ["[", ".", "=", ",", "a ", "\"\" "] {
        let text = format!("[[finger]]\nx = {}\n", sign.repeat((15 << 20) / sign.len()));
        let message = Scene::parse(&text, Path::new("s.toml")).expect_err("no scene").to_string();
        assert!(message.starts_with("s.toml: more than 8388608 words and signs"), "{sign}: {message:.200}");
    }
}

#[test]
fn commas_of_comments_and_texts_are_no_values() {
    let commas = ",= ".repeat(1 << 20);
    let text = format!("# {commas}\n[[finger]]\nname = \"a\" # {commas}\n");
    Scene::parse(&text, Path::new("s.toml")).expect("a scene with one finger");
    let text = format!("[[finger]]\nname = \"{commas}\"\n");
    let message = Scene::parse(&text, Path::new("s.toml")).expect_err("no name").to_string();
    assert!(message.contains("s.toml:2: finger[0].name"), "{message:.200}");
}
