//! Driver, fast thread and slow thread in one process, as fast as the machine allows.
//!
//! Model: the same driver cycle, the same fast loop and the same two shared-memory segments as with two
//! processes; only the waiting is left out. Ticks are numbers, so that two runs with the same input write
//! the same recording byte for byte.

use crate::fast_loop::{FastLoop, Tally, Turn};
use crate::outcome::{RunFailure, Stop};
use crate::progress::Progress;
use crate::slow::SlowSide;
use io_driver::config::DriverConfig;
use io_driver::driver::{describe, make_cycle};
use io_driver::open::open_devices;
use rt_core::signals::StopSignals;
use shm_abi::doorbell::WaitMode;
use shm_abi::{CommanderMemory, CommanderView, DriverMemory, DriverView};
use std::os::fd::AsFd;
use std::sync::Arc;

/// Ticks between two turns of the slow side: 25 a second at 1 kHz.
const SLOW_EVERY: u64 = 40;

/// The only lease there is.
const LEASE: u64 = 1;

/// Runs to the end.
///
/// # Errors
/// A fault, or a recording that cannot be written.
pub fn run(
    config: &DriverConfig,
    fast: &mut FastLoop,
    slow: &mut SlowSide,
    progress: &mut Progress,
    signals: &StopSignals,
) -> Result<(Tally, Stop, DriverView), RunFailure> {
    let devices = open_devices(config)?;
    let info = describe(config, &devices, WaitMode::Spin);
    let memory = Arc::new(DriverMemory::create(&info)?);
    let driver = DriverView::map(memory.fd())?;
    let (view, fd) = CommanderView::create(LEASE)?;
    let commander = CommanderMemory::map(fd.as_fd())?;
    let mut cycle = make_cycle(config, memory, devices);
    cycle.grant(view);
    cycle.change_lease();
    for tick in 1.. {
        cycle.sense(tick, tick * config.period_ns);
        let turn = fast.turn(tick, &driver, &commander);
        cycle.take_reply();
        cycle.actuate();
        if tick % SLOW_EVERY == 0 {
            slow.step()?;
            progress.show(fast.run_ticks());
        }
        match turn {
            Turn::Finished => return Ok((fast.tally, Stop::Finished, driver)),
            Turn::Fault(reason) => return Err(RunFailure::driver_fault(reason)),
            Turn::Answered | Turn::Skipped => {}
        }
        if let Some(signal) = signals.requested() {
            return Ok((fast.tally, Stop::Signal(signal), driver));
        }
    }
    unreachable!("ticks do not run out")
}
