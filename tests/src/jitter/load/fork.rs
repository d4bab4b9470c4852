//! Starts processes that end at once: page tables, TLB shootdowns, the scheduler.

use super::Pace;
use crate::jitter::roles::Role;

const PER_SECOND: u32 = 100;

pub(super) fn work() -> std::io::Error {
    let mut pace = Pace::per_second(PER_SECOND);
    loop {
        let ended = Role::Nothing.command().and_then(|mut command| command.status());
        if let Err(error) = ended {
            return error;
        }
        pace.wait();
    }
}
