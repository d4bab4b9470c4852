//! A terminal that somebody looks at, or holds by Ctrl-S.

use rustix::fs::{Mode, OFlags};
use rustix::io::ioctl_fionbio;
use rustix::pty::{OpenptFlags, grantpt, openpt, unlockpt};
use rustix::termios::{Action, tcflow};
use std::os::fd::OwnedFd;
use std::path::PathBuf;
use std::process::Stdio;

/// It takes nothing once it is held.
#[derive(Debug)]
pub struct Terminal {
    master: OwnedFd,
    slave: OwnedFd,
}

impl Terminal {
    /// One that takes what is written, until it is held.
    pub fn open() -> Self {
        let master = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).expect("a terminal");
        ioctl_fionbio(&master, true).expect("our own");
        grantpt(&master).and_then(|()| unlockpt(&master)).expect("our own");
        let name = rustix::pty::ptsname(&master, Vec::new()).expect("it has a name");
        let name = PathBuf::from(name.into_string().expect("plain"));
        // Nobody's controlling terminal: where the tests lead a session, its end would be theirs.
        let flags = OFlags::RDWR | OFlags::NOCTTY | OFlags::CLOEXEC;
        let slave = rustix::fs::open(name, flags, Mode::empty()).expect("our own");
        Self { master, slave }
    }

    /// For a program's standard error.
    pub fn end(&self) -> Stdio {
        self.slave.try_clone().expect("another").into()
    }

    /// Reads what is written until these words are.
    pub fn wait_for(&self, words: &str) {
        let mut said = String::new();
        patience::until(words, || {
            let mut bytes = [0; 4096];
            while let Ok(length @ 1..) = rustix::io::read(&self.master, &mut bytes) {
                said.push_str(&String::from_utf8_lossy(&bytes[..length]));
            }
            said.contains(words)
        });
    }

    /// Ctrl-S.
    pub fn hold(&self) {
        tcflow(&self.slave, Action::OOff).expect("our own");
    }
}
