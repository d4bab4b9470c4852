//! A screen that nobody sees: Xvfb, where the machine has it.

use patience::prelude::*;
use rt_core::clock::monotonic_ns;
use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};
use std::time::Duration;
use tempfile::TempDir;

/// Width and height (pixels).
pub const SIZE: [usize; 2] = [1280, 800];

/// A screen of its own; goes when dropped.
#[derive(Debug)]
pub struct Screen {
    server: Child,
    memory: TempDir,
    display: String,
}

impl Screen {
    /// `None`: the machine has no Xvfb, which is told.
    pub fn open() -> Option<Self> {
        let memory = tempfile::tempdir().expect("a directory");
        let server = Command::new("Xvfb")
            .args(["-displayfd", "1", "-ac", "-nolisten", "tcp", "-screen", "0"])
            .arg(format!("{}x{}x24", SIZE[0], SIZE[1]))
            .arg("-fbdir")
            .arg(memory.path())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn();
        let Ok(mut server) = server else {
            println!("skipped: there is no Xvfb here");
            return None;
        };
        let mut number = String::new();
        let mut told = BufReader::new(server.stdout.take().expect("a pipe"));
        let tell = || told.read_line(&mut number).expect("its number");
        patience::watched(patience::limit(), "Xvfb tells the number of its screen", tell);
        assert!(!number.trim().is_empty(), "Xvfb does not start");
        Some(Self { server, memory, display: format!(":{}", number.trim()) })
    }

    /// What it is called.
    pub fn display(&self) -> &str {
        &self.display
    }

    /// Red, green and blue of a place, counted from the upper left corner.
    pub fn pixel(&self, column: usize, row: usize) -> [u8; 3] {
        let dump = std::fs::read(self.memory.path().join("Xvfb_screen0")).expect("the screen's memory");
        let word =
            |at: usize| u32::from_be_bytes(dump[4 * at..4 * at + 4].try_into().expect("four bytes")) as usize;
        // As /usr/include/X11/XWDFile.h has it: sizes, then colours of 12 bytes, then rows.
        let (header, bits, row_bytes, colours) = (word(0), word(11), word(12), word(19));
        assert_eq!((bits, word(7)), (32, 0), "rows of blue, green, red and nothing");
        let at = header + 12 * colours + row * row_bytes + 4 * column;
        [dump[at + 2], dump[at + 1], dump[at]]
    }

    /// Presses and releases a key in the program's window, by its name in X; `false`: the machine has no `xdotool`, which is told.
    pub fn press(&self, key: &str) -> bool {
        self.press_for(key, Duration::from_millis(200)).is_some()
    }

    /// The same for so long, or longer where the machine is busy; when the key went down and up.
    pub fn press_for(&self, key: &str, least: Duration) -> Option<Pressed> {
        // Nobody manages windows here: none has the keys until it is given them.
        self.xdotool(&["search", "--onlyvisible", "--name", "phantom3", "windowfocus", "sleep", "0.5"])?;
        let down_ns = self.timed(&["keydown", key])?;
        std::thread::sleep(least);
        let up_ns = self.timed(&["keyup", key])?;
        Some(Pressed { down_ns, up_ns })
    }

    /// Does something to the keyboard; before and after it (ns). `xdotool` hangs up when the server has done it.
    fn timed(&self, words: &[&str]) -> Option<[u64; 2]> {
        let before_ns = monotonic_ns();
        self.xdotool(words)?;
        Some([before_ns, monotonic_ns()])
    }

    fn xdotool(&self, words: &[&str]) -> Option<()> {
        let done = Command::new("xdotool").args(words).env("DISPLAY", &self.display).bounded_status();
        if done.is_err() {
            println!("skipped: there is no xdotool here");
        }
        done.is_ok_and(|status| status.success()).then_some(())
    }
}

/// A key that was pressed, on the system's monotonic clock (ns): it went down between two times, and up between two others.
#[derive(Debug, Clone, Copy)]
pub struct Pressed {
    /// Before and after it went down.
    pub down_ns: [u64; 2],
    /// Before and after it went up.
    pub up_ns: [u64; 2],
}

impl Drop for Screen {
    fn drop(&mut self) {
        self.server.end();
    }
}
