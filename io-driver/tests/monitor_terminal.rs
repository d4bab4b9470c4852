//! `io-driver status --watch` on a terminal, over a real driver: what it shows, and that the terminal is as before
//! however it ends. The terminal is a pseudo-terminal of the test's own.

use patience::prelude::*;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::process::{Pid, Signal, kill_process};
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{Termios, Winsize, tcgetattr, tcsetwinsize};
use shm_abi::client;
use std::fs::{File, OpenOptions};
use std::io::Write;
use std::os::fd::OwnedFd;
use std::os::unix::fs::OpenOptionsExt;
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// Long enough for the most loaded machine; only a hang takes longer.
const HANG: Duration = Duration::from_secs(60);
/// What gives the screen back: colours, cursor, screen.
const LEAVE: &str = "\x1b[0m\x1b[?25h\x1b[?1049l";

/// A program that is killed when dropped.
struct Running(Child);

impl Running {
    fn id(&self) -> String {
        self.0.id().to_string()
    }

    fn signal(&self, signal: Signal) {
        kill_process(Pid::from_child(&self.0), signal).expect("it runs");
    }

    fn end(&mut self) -> ExitStatus {
        let begun = Instant::now();
        loop {
            if let Some(status) = self.0.try_wait().expect("our child") {
                return status;
            }
            assert!(begun.elapsed() < HANG, "it hangs");
            std::thread::sleep(Duration::from_millis(5));
        }
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        self.0.end();
    }
}

fn io_driver() -> Command {
    Command::new(env!("CARGO_BIN_EXE_io-driver"))
}

/// A directory for the socket.
fn place() -> (TempDir, PathBuf) {
    let place = tempfile::tempdir().unwrap();
    let socket = place.path().join("driver.sock");
    (place, socket)
}

fn driver(socket: &Path) -> Running {
    let mut command = io_driver();
    command.args(["run", "--config", "-", "--quiet", "--socket"]).arg(socket).stdin(Stdio::piped());
    let mut child = command.spawn().unwrap();
    let device = |name| format!("[[device]]\nname = \"{name}\"\nbackend = \"ideal\"\npeak_force_n = 8.5\n");
    let real_time = "[real_time]\npriority = 0\nlock_memory = false\n";
    let config = format!("{real_time}{}{}", device("thumb"), device("index"));
    child.stdin.take().unwrap().write_all(config.as_bytes()).unwrap();
    let driver = Running(child);
    let begun = Instant::now();
    while client::observe(socket, "test").is_err() {
        assert!(begun.elapsed() < HANG, "it does not listen");
        std::thread::sleep(Duration::from_millis(5));
    }
    driver
}

/// A terminal as the person before it has it.
struct Terminal {
    person: OwnedFd,
    /// The other side, held open so that it can be asked after.
    program: File,
    before: Termios,
    heard: Vec<u8>,
}

impl Terminal {
    fn new(rows: u16, columns: u16) -> Self {
        let person = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC).unwrap();
        grantpt(&person).unwrap();
        unlockpt(&person).unwrap();
        let name = ptsname(&person, Vec::new()).unwrap();
        // Not the test's own: whoever has a terminal is killed with it.
        let mut options = OpenOptions::new();
        options.read(true).write(true).custom_flags(OpenptFlags::NOCTTY.bits() as i32);
        let program = options.open(name.to_str().unwrap()).unwrap();
        let before = tcgetattr(&program).unwrap();
        let terminal = Self { person, program, before, heard: Vec::new() };
        terminal.resize(rows, columns);
        terminal
    }

    fn resize(&self, ws_row: u16, ws_col: u16) {
        tcsetwinsize(&self.person, Winsize { ws_row, ws_col, ws_xpixel: 0, ws_ypixel: 0 }).unwrap();
    }

    fn watch(&self, socket: &Path) -> Running {
        let mut command = io_driver();
        command.args(["status", "--watch", "--socket"]).arg(socket).env("TERM", "xterm");
        let side = || self.program.try_clone().unwrap();
        Running(command.stdin(side()).stdout(side()).stderr(side()).spawn().unwrap())
    }

    fn press(&self, keys: &[u8]) {
        assert_eq!(rustix::io::write(&self.person, keys), Ok(keys.len()));
    }

    /// Takes in what was written within a tenth of a second.
    fn hear(&mut self) {
        let mut ready = [PollFd::new(&self.person, PollFlags::IN)];
        let patience = Timespec { tv_sec: 0, tv_nsec: 100_000_000 };
        if poll(&mut ready, Some(&patience)).unwrap() > 0 {
            let mut bytes = [0; 4096];
            let read = rustix::io::read(&self.person, &mut bytes).unwrap();
            self.heard.extend_from_slice(&bytes[..read]);
        }
    }

    /// Waits until the screen shows all of this.
    fn see(&mut self, words: &[&str]) {
        let begun = Instant::now();
        loop {
            let screen = screen(&self.heard);
            if words.iter().all(|word| screen.contains(word)) {
                return;
            }
            assert!(begun.elapsed() < HANG, "{words:?} not all in\n{screen}");
            self.hear();
        }
    }

    /// Everything that a program took from the terminal it has given back.
    fn assert_is_as_before(&mut self) {
        let begun = Instant::now();
        while !self.heard.ends_with(LEAVE.as_bytes()) {
            assert!(begun.elapsed() < HANG, "it ends with {:?}", String::from_utf8_lossy(&self.heard));
            self.hear();
        }
        let text = |termios: &Termios| format!("{termios:?}");
        assert_eq!(text(&tcgetattr(&self.program).unwrap()), text(&self.before));
    }
}

/// What a terminal shows that understands "go to" and "clear", and takes colours for nothing.
fn screen(heard: &[u8]) -> String {
    let text = String::from_utf8_lossy(heard);
    let (mut rows, mut row, mut column) = (vec![vec![' '; 200]; 60], 0, 0);
    let mut letters = text.chars();
    while let Some(letter) = letters.next() {
        if letter != '\u{1b}' {
            rows[row][column] = letter;
            column += 1;
            continue;
        }
        let sequence: String = letters.by_ref().skip(1).take_while_inclusive(|l| !l.is_ascii_alphabetic());
        if let Some(place) = sequence.strip_suffix('H') {
            let mut numbers = place.split(';').map(|n| n.parse::<usize>().unwrap() - 1);
            (row, column) = (numbers.next().unwrap(), numbers.next().unwrap());
        } else if sequence == "2J" {
            rows = vec![vec![' '; 200]; 60];
        }
    }
    rows.iter().map(|row| row.iter().collect::<String>().trim_end().to_owned() + "\n").collect()
}

trait TakeWhileInclusive: Iterator<Item = char> + Sized {
    /// Up to the first for which it is false, that one included.
    fn take_while_inclusive(self, goes_on: impl Fn(char) -> bool) -> String {
        let mut taken = String::new();
        for letter in self {
            taken.push(letter);
            if !goes_on(letter) {
                break;
            }
        }
        taken
    }
}

impl<I: Iterator<Item = char>> TakeWhileInclusive for I {}

#[test]
fn it_shows_a_driver_and_its_commander_and_every_key_that_leaves_restores_the_terminal() {
    let (_place, socket) = place();
    let driver = driver(&socket);
    let mut commands = Some(client::command(&socket, "test").unwrap());
    for key in [&b"q"[..], b"\x1b", b"\x03"] {
        let mut terminal = Terminal::new(24, 80);
        let mut watch = terminal.watch(&socket);
        let commander = match &commands {
            Some(_) => format!("commanded by process {}", std::process::id()),
            None => "nobody commands".into(),
        };
        terminal.see(&[
            &format!("driver {}", driver.id()),
            &commander,
            "thumb",
            "index",
            " N of 8.5",
            "wake error",
        ]);
        terminal.press(b"p");
        terminal.see(&["PAUSED"]);
        terminal.press(key);
        assert_eq!(watch.end().code(), Some(0), "{key:?}");
        terminal.assert_is_as_before();
        commands = None;
    }
}

#[test]
fn signals_end_it_and_restore_the_terminal() {
    let (_place, socket) = place();
    let _driver = driver(&socket);
    for signal in [Signal::TERM, Signal::INT, Signal::HUP] {
        let mut terminal = Terminal::new(24, 80);
        let mut watch = terminal.watch(&socket);
        terminal.see(&["IDLE", "thumb"]);
        watch.signal(signal);
        assert_eq!(watch.end().code(), Some(128 + signal.as_raw()));
        terminal.assert_is_as_before();
    }
}

#[test]
fn it_waits_for_a_driver_that_has_ended_to_return() {
    let (_place, socket) = place();
    let mut first = driver(&socket);
    let mut terminal = Terminal::new(24, 120);
    let mut watch = terminal.watch(&socket);
    terminal.see(&["IDLE"]);
    first.signal(Signal::TERM);
    assert_eq!(first.end().code(), Some(0));
    terminal.see(&["DRIVER GONE", "The driver has ended: stopped in tick", "Waiting for its return"]);
    let second = driver(&socket);
    terminal.see(&[&format!("driver {}", second.id())]);
    assert!(!screen(&terminal.heard).contains("GONE"));
    terminal.press(b"q");
    assert_eq!(watch.end().code(), Some(0));
    terminal.assert_is_as_before();
}

#[test]
fn it_follows_the_size_of_the_terminal() {
    let (_place, socket) = place();
    let _driver = driver(&socket);
    let mut terminal = Terminal::new(24, 80);
    let _watch = terminal.watch(&socket);
    terminal.see(&["wake error", "index"]);
    terminal.resize(8, 40);
    terminal.see(&["thumb", "1 more in a taller window"]);
    assert!(!screen(&terminal.heard).contains("wake error"));
    // As one that has just been made has it.
    terminal.resize(0, 0);
    std::thread::sleep(Duration::from_millis(200));
    terminal.resize(24, 80);
    terminal.see(&["wake error", "index"]);
}

#[test]
fn it_ends_with_its_terminal() {
    let (_place, socket) = place();
    let _driver = driver(&socket);
    let mut terminal = Terminal::new(24, 80);
    let mut watch = terminal.watch(&socket);
    terminal.see(&["IDLE"]);
    // Nobody sends a signal: it is not the session's terminal.
    drop(terminal);
    let status = watch.end();
    assert_eq!((status.signal(), status.code().is_some_and(|code| code != 0)), (None, true), "{status:?}");
}
