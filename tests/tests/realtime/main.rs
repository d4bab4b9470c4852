//! The two programs in real time: what they call, what they miss, and how they share a machine.

mod long;
mod overruns;
mod quiet_loop;
mod reply_modes;
mod sharing;

use std::sync::{Mutex, MutexGuard, PoisonError};

/// These tests keep two CPUs busy each: they take turns.
fn in_turn() -> MutexGuard<'static, ()> {
    static TURN: Mutex<()> = Mutex::new(());
    TURN.lock().unwrap_or_else(PoisonError::into_inner)
}
