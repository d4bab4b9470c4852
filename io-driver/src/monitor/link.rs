//! The monitor's hold on a driver, and on the next one after that has ended.

use crate::monitor::commander::CommanderWatch;
use crate::monitor::look::Look;
use crate::monitor::state::Monitor;
use shm_abi::client::{self, AttachError, Attachment};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::Duration;

/// Attached to a driver, or waiting for one.
pub(super) struct Link {
    socket: PathBuf,
    hold: Hold,
    commander: CommanderWatch,
}

enum Hold {
    Attached(Box<Attachment>),
    Searching(Receiver<Result<Box<Attachment>, String>>),
}

/// Between two looks for a driver.
const PAUSE: Duration = Duration::from_millis(500);
const NAME: &str = "io-driver status";

impl Link {
    pub(super) fn attach(socket: &Path) -> Result<Self, AttachError> {
        let hold = Hold::Attached(Box::new(client::observe(socket, NAME)?));
        Ok(Self { socket: socket.into(), hold, commander: CommanderWatch::default() })
    }

    /// Tells the monitor what is to be seen at this moment of its clock.
    pub(super) fn observe(&mut self, monitor: &mut Monitor, now: Duration) {
        match &self.hold {
            Hold::Attached(attachment) => {
                // Asked before looking: what a driver wrote before it ended is seen.
                let is_open = attachment.connection.is_open();
                let look = Look::at(&attachment.driver, attachment.driver_pid, now);
                let commander = self.commander.at(now, &look.status);
                let last_words = look.status.epitaph.clone();
                monitor.see(look, commander);
                if !is_open {
                    monitor.lose(last_words);
                    self.hold = Hold::Searching(search(self.socket.clone()));
                }
            }
            Hold::Searching(found) => match found.try_iter().last() {
                Some(Ok(attachment)) => self.hold = Hold::Attached(attachment),
                Some(Err(why)) => monitor.hear_why_not(why),
                None => {}
            },
        }
    }
}

/// In a thread of its own: a driver that hangs is waited for, and keys are answered meanwhile.
fn search(socket: PathBuf) -> Receiver<Result<Box<Attachment>, String>> {
    let (tell, told) = channel();
    std::thread::spawn(move || while try_to_attach(&socket, &tell) {});
    told
}

/// Whether it should be tried again.
fn try_to_attach(socket: &Path, tell: &Sender<Result<Box<Attachment>, String>>) -> bool {
    std::thread::sleep(PAUSE);
    match client::observe(socket, NAME) {
        Ok(attachment) => {
            let _ = tell.send(Ok(Box::new(attachment)));
            false
        }
        Err(error) => tell.send(Err(error.to_string())).is_ok(),
    }
}
