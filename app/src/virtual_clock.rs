//! Driver, fast thread and slow thread in one process, as fast as the machine allows.
//!
//! Model: the same driver cycle, the same fast loop and the same two shared-memory segments as with two
//! processes; only the waiting is left out. Ticks are numbers, so that two runs with the same input write
//! the same recording byte for byte.

use crate::fast_loop::{FastLoop, Turn};
use crate::outcome::{RunFailure, Stop};
use crate::progress::Progress;
use crate::slow::SlowSide;
use io_driver::config::{DriverConfig, ReplyMode};
use io_driver::cycle::Cycle;
use io_driver::device::{Device, Extras};
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

/// Both sides of the shared memory, in one process.
pub struct VirtualDriver {
    cycle: Cycle,
    driver: DriverView,
    commander: CommanderMemory,
    period_ns: u64,
    mode: ReplyMode,
}

impl VirtualDriver {
    /// Opens the devices and makes the memory.
    ///
    /// # Errors
    /// If either cannot be had.
    pub fn open(config: &DriverConfig) -> Result<Self, RunFailure> {
        Self::with_devices(config, open_devices(config)?)
    }

    /// Makes the memory for devices that are open.
    ///
    /// # Errors
    /// If it cannot be had.
    pub fn with_devices(config: &DriverConfig, devices: Vec<Box<dyn Device>>) -> Result<Self, RunFailure> {
        let info = describe(config, &devices, WaitMode::Spin);
        let memory = Arc::new(DriverMemory::create(&info)?);
        let driver = DriverView::map(memory.fd())?;
        let (view, fd) = CommanderView::create(LEASE)?;
        let commander = CommanderMemory::map(fd.as_fd())?;
        let mut cycle = make_cycle(config, memory, devices);
        cycle.grant(view);
        cycle.change_lease();
        Ok(Self { cycle, driver, commander, period_ns: config.period_ns, mode: config.reply.mode })
    }

    /// The driver's memory, as an application sees it.
    pub fn view(&self) -> &DriverView {
        &self.driver
    }

    /// What the devices tell besides their positions.
    pub fn extras(&self) -> Vec<Extras> {
        self.cycle.extras()
    }

    /// Runs to the end.
    pub fn run(
        &mut self,
        fast: &mut FastLoop,
        slow: &mut SlowSide,
        progress: &mut Progress,
        signals: &StopSignals,
    ) -> Stop {
        for tick in 1.. {
            let turn = self.tick(tick, fast);
            // The same thread fills the queue and empties it: of many things few rows fit in.
            // What a script brings is made there, too.
            if !fast.has_room() || fast.wants_world() {
                slow.step();
            }
            if tick % SLOW_EVERY == 0 {
                slow.step();
                progress.show(fast.run_ticks());
                if slow.wants_end() {
                    return Stop::Closed;
                }
            }
            match turn {
                Turn::Finished => break,
                Turn::Fault(reason) => return Stop::Failed(RunFailure::driver_fault(reason)),
                Turn::Answered | Turn::Skipped | Turn::Unread => {}
            }
            if let Some(signal) = signals.requested() {
                return Stop::Signal(signal);
            }
        }
        Stop::Finished
    }

    /// The driver reads and tells, the application answers, the driver writes; or, where replies are for the next
    /// tick, it writes what the application answered to the tick before.
    pub fn tick(&mut self, tick: u64, fast: &mut FastLoop) -> Turn {
        self.tick_with(tick, |tick, driver, commander| fast.turn(tick, driver, commander))
    }

    /// The same with somebody's own turn of the application, which need not answer.
    pub fn tick_with(
        &mut self,
        tick: u64,
        turn: impl FnOnce(u64, &DriverView, &CommanderMemory) -> Turn,
    ) -> Turn {
        let deadline_ns = tick * self.period_ns;
        if self.mode == ReplyMode::NextTick {
            self.cycle.take_reply();
            self.cycle.sense(tick, deadline_ns);
            self.cycle.actuate();
            return turn(tick, &self.driver, &self.commander);
        }
        self.cycle.sense(tick, deadline_ns);
        let turn = turn(tick, &self.driver, &self.commander);
        self.cycle.take_reply();
        self.cycle.actuate();
        turn
    }
}
