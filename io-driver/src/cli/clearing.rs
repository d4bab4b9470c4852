//! `io-driver clear-fault`.
//!
//! Model: asked, then believed only when a new frame shows that the fault state was left: what caused it may still be
//! there, a pressed switch or a card without power, and then the next tick is a fault again. Which fault was left is what
//! the frame before the request tells.

use super::{EXIT_FAULT, fail_to_ask};
use crate::print::print_line;
use crate::say::say;
use rt_core::clock::monotonic_ns;
use shm_abi::client;
use shm_abi::{DriverState, DriverView, FaultReason, Frame};
use std::path::Path;
use std::process::ExitCode;
use std::time::{Duration, Instant};

/// Time for the loop to do what it was asked, beyond a few ticks.
pub(super) const PROMPT: Duration = Duration::from_millis(100);
/// Cards have taken power by then, or have told that they do not.
const ARMED: Duration = Duration::from_millis(250);
/// Between two looks at the frames.
pub(super) const LOOK: Duration = Duration::from_millis(1);
const NAME: &str = "io-driver";

/// Asks, and says what became of it.
pub(super) fn clear_fault(socket: &Path) -> ExitCode {
    // Whoever asks knows of no stop that comes while a place to look from is waited for.
    let asked_ns = monotonic_ns();
    let observer = client::observe(socket, NAME);
    let before = observer.as_ref().ok().and_then(|observer| observer.driver.read_latest());
    if let Err(error) = client::clear_fault_as_of(asked_ns, socket, NAME) {
        return fail_to_ask(&error);
    }
    let failed = |why: std::fmt::Arguments<'_>| {
        say(format_args!("io-driver: {why}"));
        ExitCode::from(EXIT_FAULT)
    };
    match observer.map(|observer| seen_after(&observer.driver)) {
        Ok(Some(Seen::NoFault)) => {
            print_line(&cleared(before.as_ref()));
            ExitCode::SUCCESS
        }
        Ok(Some(Seen::Fault(reason))) => {
            let sentence = FaultReason::sentence_for(reason);
            let advice = advice(reason);
            failed(format_args!("the driver is in its fault state all the same: {sentence}{advice}"))
        }
        Ok(None) => failed(format_args!("it was asked, and no new frame shows what became of it")),
        Err(error) => failed(format_args!("it was asked, and cannot be watched: {error}")),
    }
}

fn cleared(before: Option<&Frame>) -> String {
    match before.filter(|frame| frame.state == DriverState::Fault as u64) {
        Some(frame) => format!("fault cleared: {}", FaultReason::sentence_for(frame.fault)),
        None => "there was no fault, and there is none".into(),
    }
}

/// Advice for a fault that comes again, if there is any.
fn advice(reason: u64) -> &'static str {
    match FaultReason::from_word(reason) {
        // A driver opens its devices once, when it starts.
        Some(FaultReason::DeviceRead | FaultReason::DeviceWrite) => {
            "; a device that was itself started or connected anew since then is not found again by this driver: start the \
             driver anew (`io-driver stop`, then `io-driver run`)"
        }
        _ => "",
    }
}

enum Seen {
    NoFault,
    Fault(u64),
}

/// What stands once the loop had time to leave the fault, and for the fault to come again at once; `None`: the loop has
/// told nothing since.
fn seen_after(driver: &DriverView) -> Option<Seen> {
    // It collects the request with the next tick but one at the latest, and its cause shows in that one or the next.
    let settled = driver.latest_tick().unwrap_or(0) + 4;
    let few_ticks = Duration::from_nanos(driver.info().period_ns) * 5;
    let until = Instant::now() + PROMPT + few_ticks;
    loop {
        let frame = driver.read_latest().filter(|frame| frame.tick >= settled);
        let is_fault = frame.is_some_and(|frame| frame.state == DriverState::Fault as u64);
        match frame {
            Some(_) if !is_fault => return Some(comes_again(driver).map_or(Seen::NoFault, Seen::Fault)),
            frame if Instant::now() >= until => return frame.map(|frame| Seen::Fault(frame.fault)),
            _ => std::thread::sleep(LOOK),
        }
    }
}

/// The fault that comes while what drives the motors gets ready, if one does: amplifiers that do not take power tell only then.
fn comes_again(driver: &DriverView) -> Option<u64> {
    let until = Instant::now() + ARMED;
    while Instant::now() < until {
        let frame = driver.read_latest().filter(|frame| frame.state == DriverState::Fault as u64);
        if let Some(frame) = frame {
            return Some(frame.fault);
        }
        std::thread::sleep(LOOK);
    }
    None
}

#[cfg(test)]
mod tests {
    use super::super::told::memory;
    use super::*;
    use bytemuck::Zeroable;
    use patience::prelude::*;
    use shm_abi::DriverMemory;

    fn tell(memory: &DriverMemory, tick: u64, state: DriverState) {
        let fault = if state == DriverState::Fault { FaultReason::EmergencyStop } else { FaultReason::None };
        memory.write_frame(&Frame { tick, state: state as u64, fault: fault as u64, ..Frame::zeroed() });
        memory.ring(tick, None);
    }

    /// The loop hangs, or the machine keeps it from running: what stands there is from before.
    #[test]
    fn an_old_frame_without_a_fault_is_not_believed() {
        let memory = memory();
        let driver = DriverView::map(memory.fd()).expect("our own");
        assert!(seen_after(&driver).is_none(), "there is no frame at all");
        tell(&memory, 7, DriverState::Idle);
        assert!(seen_after(&driver).is_none());
    }

    #[test]
    fn a_fault_that_comes_again_while_cards_take_power_is_told() {
        let memory = memory();
        let driver = DriverView::map(memory.fd()).expect("our own");
        tell(&memory, 7, DriverState::Fault);
        std::thread::scope(|scope| {
            let seen = scope.spawn(|| seen_after(&driver));
            std::thread::sleep(Duration::from_millis(20));
            (8..20).for_each(|tick| tell(&memory, tick, DriverState::Idle));
            std::thread::sleep(ARMED / 2);
            tell(&memory, 20, DriverState::Fault);
            match seen.bounded_join().expect("no panic") {
                Some(Seen::Fault(reason)) => assert_eq!(reason, FaultReason::EmergencyStop as u64),
                Some(Seen::NoFault) => println!("the machine was too slow to tell"),
                None => println!("the machine was too slow to look"),
            }
        });
    }

    #[test]
    fn a_fault_that_stands_or_comes_again_is_told_and_one_that_was_left_is_not() {
        for (states, is_left) in [
            ([DriverState::Fault; 8], false),
            ([DriverState::Idle; 8], true),
            (
                [0, 1, 2, 3, 4, 5, 6, 7].map(|n| [DriverState::Idle, DriverState::Fault][usize::from(n > 2)]),
                false,
            ),
        ] {
            let memory = memory();
            let driver = DriverView::map(memory.fd()).expect("our own");
            tell(&memory, 7, DriverState::Fault);
            std::thread::scope(|scope| {
                let seen = scope.spawn(|| seen_after(&driver));
                // It has looked at tick 7 by then, or sees less: a later tick makes it wait for one that never comes.
                std::thread::sleep(Duration::from_millis(20));
                for (tick, state) in (8..).zip(states) {
                    tell(&memory, tick, state);
                }
                match seen.bounded_join().expect("no panic") {
                    Some(Seen::NoFault) => assert!(is_left, "{states:?}"),
                    Some(Seen::Fault(reason)) => {
                        assert!(!is_left && reason == FaultReason::EmergencyStop as u64, "{states:?}");
                    }
                    None => println!("the machine was too slow to tell"),
                }
            });
        }
    }
}
