//! The terminal, borrowed and given back.
//!
//! Model: raw mode and the alternate screen. What has to be undone is kept in one place, [`BORROWED`], and whoever takes
//! it out undoes it: the screen when it is dropped, or the panic hook before it says why.

use crate::monitor::keys::{self, Key};
use crate::monitor::state::Monitor;
use ratatui_core::backend::Backend;
use ratatui_core::layout::{Rect, Size};
use ratatui_core::terminal::{Terminal, TerminalOptions, Viewport};
use ratatui_termion::TermionBackend;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::Errno;
use rustix::termios::{OptionalActions, Termios, tcgetattr, tcsetattr};
use std::io::{self, Stdout, Write, stdin, stdout};
use std::mem::ManuallyDrop;
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

/// A full screen and its keyboard.
pub(super) struct Screen {
    /// Never dropped: that would show the cursor once more, and panic where the terminal is gone.
    terminal: ManuallyDrop<Terminal<TermionBackend<Stdout>>>,
    /// What the terminal had when it was drawn last.
    size: Size,
}

/// What came from the keyboard.
#[derive(Debug)]
pub(super) enum Heard {
    Keys(Vec<Key>),
    /// There is no keyboard any more.
    End,
}

/// The terminal's settings from before.
static BORROWED: Mutex<Option<Termios>> = Mutex::new(None);

/// The largest part of a terminal that is drawn, from its upper left corner: a terminal can say that it has four billion
/// cells, and each takes memory.
const MOST: Size = Size { width: 800, height: 300 };

const ENTER: &str = "\x1b[?1049h\x1b[2J\x1b[?25l";
const LEAVE: &str = "\x1b[0m\x1b[?25h\x1b[?1049l";

impl Screen {
    pub(super) fn open() -> io::Result<Self> {
        let before = tcgetattr(stdin())?;
        let mut raw = before.clone();
        raw.make_raw();
        *BORROWED.lock().unwrap_or_else(PoisonError::into_inner) = Some(before);
        restore_before_a_panic_speaks();
        let opened = (|| {
            tcsetattr(stdin(), OptionalActions::Now, &raw)?;
            stdout().write_all(ENTER.as_bytes())?;
            stdout().flush()?;
            let backend = TermionBackend::new(stdout());
            let size = backend.size()?;
            let viewport = Viewport::Fixed(drawn(size));
            Ok((Terminal::with_options(backend, TerminalOptions { viewport })?, size))
        })();
        let (terminal, size) = opened.inspect_err(|_: &io::Error| restore())?;
        Ok(Self { terminal: ManuallyDrop::new(terminal), size })
    }

    /// Draws, in the size that the terminal has now.
    pub(super) fn draw(&mut self, monitor: &Monitor) -> io::Result<()> {
        self.fit()?;
        self.terminal.draw(|frame| monitor.draw(frame.area(), frame.buffer_mut())).map(|_| ())
    }

    fn fit(&mut self) -> io::Result<()> {
        let size = self.terminal.size()?;
        if size != self.size {
            self.terminal.resize(drawn(size))?;
            self.size = size;
        }
        Ok(())
    }

    /// Waits for keys, this long.
    pub(super) fn listen(&self, patience: Duration) -> io::Result<Heard> {
        let keyboard = stdin();
        let mut ready = [PollFd::new(&keyboard, PollFlags::IN)];
        let patience = Timespec { tv_sec: 0, tv_nsec: i64::from(patience.subsec_nanos()) };
        match poll(&mut ready, Some(&patience)) {
            Ok(0) | Err(Errno::INTR) => return Ok(Heard::Keys(Vec::new())),
            Ok(_) => {}
            Err(errno) => return Err(errno.into()),
        }
        let mut bytes = [0; 64];
        // Not through the standard library's buffer: what it held back `poll` would not tell.
        match rustix::io::read(&keyboard, &mut bytes) {
            Ok(0) | Err(Errno::IO) => Ok(Heard::End),
            Ok(count) => Ok(Heard::Keys(keys::read(&bytes[..count]))),
            Err(Errno::INTR | Errno::AGAIN) => Ok(Heard::Keys(Vec::new())),
            Err(errno) => Err(errno.into()),
        }
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        restore();
    }
}

/// What is drawn of a terminal of this size.
fn drawn(size: Size) -> Rect {
    Rect::new(0, 0, size.width.min(MOST.width), size.height.min(MOST.height))
}

/// Gives the terminal back, once.
fn restore() {
    let Some(before) = BORROWED.lock().unwrap_or_else(PoisonError::into_inner).take() else { return };
    // A terminal that is gone needs nothing.
    let _ = tcsetattr(stdin(), OptionalActions::Now, &before);
    let _ = stdout().write_all(LEAVE.as_bytes()).and_then(|()| stdout().flush());
}

/// A message on the alternate screen goes with it.
fn restore_before_a_panic_speaks() {
    let speak = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        restore();
        speak(panic);
    }));
}

#[cfg(test)]
mod tests {
    use super::*;
    use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
    use rustix::termios::{Winsize, tcsetwinsize};
    use std::fs::{File, OpenOptions};
    use std::os::fd::OwnedFd;
    use std::process::{Command, ExitStatus};
    use std::time::Instant;

    /// A person's side of a terminal, and a program's.
    fn terminal() -> (OwnedFd, File) {
        let person = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC).unwrap();
        grantpt(&person).unwrap();
        unlockpt(&person).unwrap();
        let name = ptsname(&person, Vec::new()).unwrap();
        let program = OpenOptions::new().read(true).write(true).open(name.to_str().unwrap()).unwrap();
        (person, program)
    }

    /// The test of this name once more, in a process of its own that has nothing but this terminal; its end, and what it
    /// wrote there.
    fn play(test: &str, person: &OwnedFd, program: &File) -> (ExitStatus, String) {
        let side = || program.try_clone().unwrap();
        let mut child = Command::new(std::env::current_exe().unwrap());
        child.args(["--exact", test, "--nocapture"]).env(ROLE, "").env("RUST_BACKTRACE", "0");
        let mut child = child.stdin(side()).stdout(side()).stderr(side()).spawn().unwrap();
        let (begun, mut said) = (Instant::now(), Vec::new());
        loop {
            // Looked at first: what it wrote is there by then.
            let end = child.try_wait().unwrap();
            while waits(person) {
                let mut bytes = [0; 4096];
                let count = rustix::io::read(person, &mut bytes).unwrap();
                said.extend_from_slice(&bytes[..count]);
            }
            if let Some(end) = end {
                return (end, String::from_utf8_lossy(&said).into_owned());
            }
            if begun.elapsed() > Duration::from_secs(60) {
                child.kill().unwrap();
                panic!("{test} does not end");
            }
        }
    }

    /// Whether there is something to read, soon.
    fn waits(person: &OwnedFd) -> bool {
        let soon = Timespec { tv_sec: 0, tv_nsec: 20_000_000 };
        poll(&mut [PollFd::new(person, PollFlags::IN)], Some(&soon)).unwrap() > 0
    }

    #[test]
    fn a_terminal_that_says_that_it_is_huge_is_drawn_in_part() {
        const HUGE: &str = "monitor::screen::tests::a_terminal_that_says_that_it_is_huge_is_drawn_in_part";
        let resize = |terminal: &File, cells| {
            let size = Winsize { ws_row: cells, ws_col: cells, ws_xpixel: 0, ws_ypixel: 0 };
            tcsetwinsize(terminal, size).unwrap();
        };
        if std::env::var_os(ROLE).is_some() {
            let terminal = File::open("/dev/stdin").unwrap();
            let mut screen = Screen::open().unwrap();
            for (cells, expected) in [(u16::MAX, MOST), (10, Size::new(10, 10)), (u16::MAX, MOST)] {
                resize(&terminal, cells);
                screen.fit().unwrap();
                assert_eq!(screen.terminal.get_frame().area().as_size(), expected);
            }
            return;
        }
        let (person, program) = terminal();
        resize(&program, u16::MAX);
        let (end, said) = play(HUGE, &person, &program);
        assert_eq!(end.code(), Some(0), "{said:?}");
    }

    const TEST: &str = "monitor::screen::tests::a_panic_speaks_on_the_restored_terminal";
    const ROLE: &str = "PHANTOM3_TEST_SCREEN_PANICS";

    #[test]
    fn a_panic_speaks_on_the_restored_terminal() {
        if std::env::var_os(ROLE).is_some() {
            let _screen = Screen::open().unwrap();
            panic!("so be it");
        }
        let (person, program) = terminal();
        let before = tcgetattr(&program).unwrap();
        let (end, said) = play(TEST, &person, &program);
        assert_eq!(end.code(), Some(101));
        assert_eq!(format!("{:?}", tcgetattr(&program).unwrap()), format!("{before:?}"));
        let after =
            said.split_once(ENTER).and_then(|(_, after)| after.split_once(LEAVE)).map(|(_, after)| after);
        assert!(after.is_some_and(|after| after.contains("so be it") && !after.contains(LEAVE)), "{said:?}");
    }
}
