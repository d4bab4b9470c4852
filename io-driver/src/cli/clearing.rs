//! `io-driver clear-fault`.
//!
//! Model: asked, then believed only when a frame shows that the fault state was left: what caused it may still be there,
//! a pressed switch or a card without power, and then the next tick is a fault again.

use super::{EXIT_FAULT, EXIT_USAGE, fail, print_line};
use crate::say::say;
use shm_abi::client;
use shm_abi::{DriverState, DriverView, FaultReason};
use std::path::Path;
use std::process::ExitCode;
use std::time::{Duration, Instant};

/// How long leaving the fault state may take, beyond a few ticks.
const PROMPT: Duration = Duration::from_millis(100);
/// Between two looks at the frames.
const LOOK: Duration = Duration::from_millis(1);
const NAME: &str = "io-driver";

/// Asks, and says what became of it.
pub(super) fn clear_fault(socket: &Path) -> ExitCode {
    let observer = client::observe(socket, NAME);
    if let Err(error) = client::clear_fault(socket, NAME) {
        return fail(&error, EXIT_USAGE);
    }
    match observer.map(|observer| fault_after(&observer.driver)) {
        Ok(None) => {
            let _ = print_line("the driver is in no fault state");
            ExitCode::SUCCESS
        }
        Ok(Some(reason)) => {
            let sentence = FaultReason::sentence_for(reason);
            say(format_args!("io-driver: the driver is in its fault state all the same: {sentence}"));
            ExitCode::from(EXIT_FAULT)
        }
        Err(error) => {
            say(format_args!("io-driver: it was asked, and cannot be watched: {error}"));
            ExitCode::from(EXIT_FAULT)
        }
    }
}

/// The fault that stands once the loop had time to leave it, or that came again at once.
fn fault_after(driver: &DriverView) -> Option<u64> {
    let few_ticks = Duration::from_nanos(driver.info().period_ns) * 3;
    let until = Instant::now() + PROMPT + few_ticks;
    while fault(driver).is_some() && Instant::now() < until {
        std::thread::sleep(LOOK);
    }
    std::thread::sleep(few_ticks);
    fault(driver)
}

fn fault(driver: &DriverView) -> Option<u64> {
    let frame = driver.read_latest()?;
    (frame.state == DriverState::Fault as u64).then_some(frame.fault)
}
