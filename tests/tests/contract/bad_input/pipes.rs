//! Pipes where a file is meant: one that nobody writes or reads is refused at once, and never waited for.

use super::{BALL, SCENE, assert_says, with_recordings, workplace};
use system_tests::workplace::Workplace;

/// What a machine says that cannot draw.
const NO_PICTURES: &str = "no pictures: ";
/// Two devices that measured the same four points, and agree.
const PAIRS: &str = "fiducial_x_m,fiducial_y_m,fiducial_z_m,other_x_m,other_y_m,other_z_m\n\
    0,0,0,0,0,0\n0.1,0,0,0.1,0,0\n0,0.1,0,0,0.1,0\n0,0,0.1,0,0,0.1\n0.1,0.1,0,0.1,0.1,0\n0,0.1,0.1,0,0.1,0.1\n";

fn make_pipes(place: &Workplace, names: &[&str]) {
    let mode = rustix::fs::Mode::RUSR | rustix::fs::Mode::WUSR;
    for name in names {
        let kind = rustix::fs::FileType::Fifo;
        rustix::fs::mknodat(rustix::fs::CWD, place.path(name), kind, mode, 0).expect("a pipe");
    }
}

#[test]
fn a_pipe_without_a_writer_holds_nobody_up() {
    let place = workplace();
    make_pipes(&place, &["pipe.toml", "pipe.csv", "pipe.mcap", "pipe.obj", "pipe.ini"]);
    place.write("includes.toml", format!("include = [\"pipe.toml\"]\n{SCENE}"));
    place.write("models.toml", "[[finger]]\n[[entity]]\nshape = { kind = \"mesh\", file = \"pipe.obj\" }\n");
    for arguments in [
        &["run", "pipe.toml"][..],
        &["run", "includes.toml"],
        &["run", "models.toml"],
        &["run", "scene.toml", "--hand", "pipe.csv"],
        &["run", "scene.toml", "--orders", "pipe.csv"],
        &["run", "scene.toml", "--layout", "pipe.toml"],
        &["run", "scene.toml", "--settings", "pipe.toml"],
        &["replay", "pipe.mcap"],
        &["replay", "pipe.csv"],
        &["export", "pipe.csv", "--csv", "out2.csv"],
        &["plot", "pipe.csv"],
        &["convert", "pipe.ini"],
    ] {
        let said = place.run(arguments);
        assert_eq!(said.status, Some(2), "{arguments:?}: {}{}", said.out, said.err);
        assert!(said.err.contains("regular file"), "{arguments:?}: {}", said.err);
    }
}

#[test]
fn a_pipe_without_a_reader_holds_nobody_up() {
    let place = workplace();
    make_pipes(&place, &["pipe.csv", "pipe.toml", "pipe.png", "pipe.svg"]);
    place.write("pairs.csv", PAIRS);
    place.write("list.ini", "GameObject ball\n");
    place.write("ball.ini", BALL);
    with_recordings(&place);
    let run = ["run", "scene.toml", "--clock", "virtual", "--seconds", "0.1"];
    for (arguments, pipe, status) in [
        (&[&run[..], &["--record", "pipe.csv"]].concat()[..], "pipe.csv", 2),
        (&[&run[..], &["--events", "pipe.csv"]].concat(), "pipe.csv", 2),
        (&[&run[..], &["--snapshot", "0.05:pipe.png"]].concat(), "pipe.png", 3),
        (&["convert", "list.ini", "--out", "pipe.toml"], "pipe.toml", 3),
        (&["export", "good.mcap", "pipe.csv"], "pipe.csv", 2),
        (&["export", "good.mcap", "--parquet", "pipe.csv"], "pipe.csv", 2),
        (&["plot", "good.mcap", "--out", "pipe"], "pipe.svg", 3),
        (&["calibrate", "--pairs", "pairs.csv", "--plot", "pipe.svg"], "pipe.svg", 3),
    ] {
        let said = place.run(arguments);
        if said.err.contains(NO_PICTURES) {
            eprintln!("skipped: this machine makes no pictures: {}", said.err);
            continue;
        }
        assert_eq!(said.status, Some(status), "{arguments:?}: {}{}", said.out, said.err);
        assert_says(&said.err, &[pipe, "nobody reads this pipe"]);
    }
}
