//! `run --snapshot` and `--frames`: pictures of a run, where the machine has a graphics library; where it has none the run
//! says what is missing and goes on.

use system_tests::workplace::{Said, Workplace};

/// A ball that falls past a finger, before a camera that looks along -z.
const SCENE: &str = "\
[[finger]]
start_m = [0.0, 0.0, 0.0]
[[entity]]
name = \"ball\"
shape = { kind = \"sphere\", radius_m = 0.02 }
position_m = [0.05, 0.1, 0.0]
mass_kg = 0.1
visual = { colour = [0.8, 0.1, 0.1] }
[[camera]]
name = \"front\"
position_m = [0.0, 0.0, 0.5]
field_of_view_deg = 40.0
";

/// The run's own words where pictures cannot be had here.
fn are_missing(said: &Said) -> bool {
    let missing = said.err.lines().find(|line| line.contains("no pictures: "));
    if let Some(missing) = missing {
        println!("skipped: {missing}");
        assert!(missing.contains("apt install libegl1"), "it says what to install: {missing}");
    }
    missing.is_some()
}

fn place() -> Workplace {
    let place = Workplace::new();
    place.write("scene.toml", SCENE);
    place
}

/// Width and height as a PNG's header has them.
fn size(png: &[u8]) -> [u32; 2] {
    assert_eq!(png[1..4], *b"PNG");
    [16, 20].map(|at| u32::from_be_bytes(png[at..at + 4].try_into().expect("four bytes")))
}

#[test]
fn moments_are_drawn_while_the_run_is_what_it_was() {
    let place = place();
    let plain = ["run", "scene.toml", "--clock", "virtual", "--seconds", "0.2", "--record", "plain.csv"];
    assert_eq!(place.run(plain).status, Some(0));
    let said = place.run([
        "run",
        "scene.toml",
        "--clock",
        "virtual",
        "--seconds",
        "0.2",
        "--record",
        "drawn.csv",
        "--headless",
        "--snapshot",
        "0:first.png",
        "--snapshot",
        "0.15:later.png",
        "--snapshot",
        "9:never.png",
        "--picture-size",
        "320x240",
        "--camera",
        "front",
    ]);
    assert_eq!(said.status, Some(0), "{}", said.err);
    let read = |name: &str| std::fs::read(place.path(name)).expect(name);
    assert_eq!(read("plain.csv"), read("drawn.csv"), "pictures change nothing");
    if are_missing(&said) {
        return;
    }
    assert!(
        said.out.contains("pictures     2, drawn by ") && said.out.contains("1 NOT TAKEN"),
        "{}",
        said.out
    );
    let (first, later) = (read("first.png"), read("later.png"));
    assert_eq!([size(&first), size(&later)], [[320, 240]; 2]);
    assert_ne!(first, later, "it has fallen by 0.11 m");
    assert!(!place.path("never.png").exists());
}

#[test]
fn a_film_has_a_picture_for_each_of_its_moments() {
    let place = place();
    let said = place.run([
        "run",
        "scene.toml",
        "--clock",
        "virtual",
        "--seconds",
        "0.2",
        "--frames",
        "film",
        "--fps",
        "50",
        "--picture-size",
        "64x48",
    ]);
    assert_eq!(said.status, Some(0), "{}", said.err);
    if are_missing(&said) {
        return;
    }
    // At 0, 0.02, ... 0.18 s.
    let mut frames: Vec<_> = std::fs::read_dir(place.path("film"))
        .expect("a directory")
        .map(|entry| entry.expect("an entry").file_name().into_string().expect("a name"))
        .collect();
    frames.sort();
    assert_eq!(frames, (0..10).map(|frame| format!("frame-{frame:06}.png")).collect::<Vec<_>>());
}

#[test]
fn what_cannot_be_drawn_or_written_is_told() {
    let place = place();
    let run = |more: &[&str]| {
        place.run(["run", "scene.toml", "--clock", "virtual", "--seconds", "0.1"].iter().chain(more))
    };
    for (wrong, word) in [
        (["--snapshot", "early.png"], "allowed: a time in s"),
        (["--snapshot", "1:early.jpg"], "allowed: a time in s"),
        (["--picture-size", "huge"], "as in 1280x720"),
        (["--fps", "25"], "--frames"),
    ] {
        let said = run(&wrong);
        assert_eq!(said.status, Some(2), "{wrong:?}");
        assert!(said.err.contains(word), "{wrong:?}: {}", said.err);
    }
    let said = run(&["--snapshot", "0:a.png", "--camera", "side"]);
    assert!(said.status == Some(2) && said.err.contains("allowed: front"), "{}", said.err);
    let said = run(&["--snapshot", "0:scene.toml.png", "--snapshot", "0.05:scene.toml.png"]);
    assert!(said.status == Some(2) && said.err.contains("given twice"), "{}", said.err);
    let said = run(&["--snapshot", "0:no/such/place.png"]);
    if !are_missing(&said) {
        assert!(said.status == Some(3) && said.err.contains("no/such/place.png"), "{}", said.err);
        assert!(said.out.contains("pictures     0") && said.out.contains("NOT COMPLETE"), "{}", said.out);
    }
}
