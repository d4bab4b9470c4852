//! Runs whose output nobody reads: each waits for 30 s, or 3 s from a signal on, gives up and says so.
//!
//! All begin before the first one is waited for, and the module's name comes first, so that they wait beside other tests.

use patience::prelude::*;
use rustix::process::{Pid, Signal, kill_process};
use std::fs::File;
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};
use system_tests::workplace::{Running, Workplace};

/// A pipe with a reader who never reads.
pub(crate) fn unread_pipe(path: &Path) -> File {
    let mode = rustix::fs::Mode::RUSR | rustix::fs::Mode::WUSR;
    rustix::fs::mknodat(rustix::fs::CWD, path, rustix::fs::FileType::Fifo, mode, 0).expect("a pipe");
    let flags = rustix::fs::OFlags::RDWR | rustix::fs::OFlags::NONBLOCK;
    rustix::fs::open(path, flags, rustix::fs::Mode::empty()).expect("our own pipe").into()
}

/// The same, and no room.
fn full_pipe(path: &Path) -> File {
    let pipe = unread_pipe(path);
    while rustix::io::write(&pipe, &[0; 4096]).is_ok() {}
    pipe
}

/// A run, and the pipe that it writes into.
struct Abandoned {
    name: &'static str,
    place: Workplace,
    running: Running,
    pipe: File,
}

/// With as many fingers as there may be, so that a pipe fills up fast.
const FINGERS: usize = 8;

/// On the virtual clock, into a pipe that it fills itself: by name, or as its standard output.
fn begin_to_fill(name: &'static str, script: &str) -> Abandoned {
    let place = Workplace::new();
    place.write("scene.toml", "[[finger]]\n".repeat(FINGERS));
    let pipe = unread_pipe(&place.path("pipe.csv"));
    let mut shell = place.prepare(Command::new("sh"));
    let run = ["run", "scene.toml", "--clock", "virtual", "--seconds", "40000", "--record"];
    shell.arg("-c").arg(script).arg(place.phantom3().get_program()).args(run);
    Abandoned { name, running: Running::start(shell), place, pipe }
}

/// In real time, into a pipe that is full from the start.
fn begin_with_a_full_pipe(name: &'static str, option: &str, more: [&str; 2]) -> Abandoned {
    let place = Workplace::new();
    let scene = include_str!("../../../config/scenes/default.toml");
    place.write("scene.toml", scene.replace("../hands/default.csv", "hand.csv"));
    place.write("hand.csv", include_str!("../../../config/hands/default.csv"));
    let pipe = full_pipe(&place.path(name));
    let mut program = place.phantom3();
    program.args(["run", "scene.toml", "--headless", option, name]).args(more);
    Abandoned { name, running: Running::start(program), place, pipe }
}

impl Abandoned {
    /// The pipe makes the run wait.
    fn wait_until_it_is_full(&self) {
        let waiting = || rustix::io::ioctl_fionread(&self.pipe).expect("our own pipe");
        patience::until("a pipe that takes no more", || {
            let before = waiting();
            std::thread::sleep(Duration::from_millis(500));
            before > 4096 && waiting() == before
        });
    }

    fn signal(&self) {
        kill_process(Pid::from_child(&self.running.child), Signal::TERM).expect("our child");
    }

    /// The recorder has so long to get on.
    fn check_that_it_ends_with_words(mut self, patience_s: u32) -> (Workplace, String) {
        self.running.child.wait_within(Duration::from_secs(120));
        let said = self.running.wait();
        assert_eq!(said.status, Some(3), "{}: {}", self.name, said.err);
        let words = format!("nothing was written for {patience_s} s");
        assert!(said.err.contains(&words), "{}: {}", self.name, said.err);
        assert_eq!(self.place.processes(), Vec::<u32>::new());
        (self.place, said.err)
    }
}

#[test]
fn a_signal_ends_every_run_whose_output_nobody_reads() {
    let by_itself = begin_with_a_full_pipe("short.csv", "--record", ["--seconds=1", "--record=whole.csv"]);
    let full = [
        begin_with_a_full_pipe("out.csv", "--record", LONG),
        begin_with_a_full_pipe("out.mcap", "--record", LONG),
        begin_with_a_full_pipe("events.csv", "--events", LONG),
    ];
    let filling = [
        begin_to_fill("a recording", "exec \"$0\" \"$@\" pipe.csv > /dev/null"),
        begin_to_fill("the standard output", "exec \"$0\" \"$@\" - > pipe.csv"),
    ];
    filling.iter().for_each(Abandoned::wait_until_it_is_full);
    // The others have begun when they answer a signal; before, they would end at once.
    std::thread::sleep(Duration::from_secs(5));
    let begun = Instant::now();
    full.iter().chain(&filling).for_each(Abandoned::signal);
    for abandoned in full.into_iter().chain(filling) {
        abandoned.check_that_it_ends_with_words(3);
    }
    assert!(begun.elapsed() < Duration::from_secs(25), "3 s are waited for, not 30: {:?}", begun.elapsed());
    let (place, said) = by_itself.check_that_it_ends_with_words(30);
    let last_row = place.path("whole.csv").metadata().and_then(|file| file.modified());
    let before = last_row.expect("a table").elapsed().expect("the past");
    assert!(before > Duration::from_secs(20), "one recording waited for the other: {before:?}");
    assert!(said.contains("finishing the recording short.csv (nothing written for "), "{said}");
}

/// Longer than anybody waits, and nothing else.
const LONG: [&str; 2] = ["--seconds", "40000"];

/// A ball in front of a camera.
const PICTURE: &str = "\
[[finger]]
[[entity]]
name = \"ball\"
shape = { kind = \"sphere\", radius_m = 0.02 }
position_m = [0.05, 0.1, 0.0]
[[camera]]
name = \"front\"
position_m = [0.0, 0.0, 0.5]
";

#[test]
fn a_run_whose_picture_nobody_reads_ends_with_words() {
    let place = Workplace::new();
    place.write("scene.toml", PICTURE);
    let _pipe = full_pipe(&place.path("a.png"));
    let run = ["run", "scene.toml", "--clock", "virtual", "--seconds", "1", "--headless"];
    let film = ["--snapshot", "0.01:a.png", "--frames", "film", "--picture-size", "32x32"];
    let said = place.run(run.into_iter().chain(film));
    if crate::pictures::are_missing(&said) {
        return;
    }
    assert_eq!(said.status, Some(3), "{said:?}");
    assert!(said.err.contains("no picture was written for 30 s"), "{said:?}");
}
