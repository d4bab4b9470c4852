//! Changes of the driver's state, as its log tells them.
//!
//! Problem: where replies come late again and again the state changes hundreds of times a second, and the log of a service
//! fills the disk.
//! Model: a fault is told whenever it begins. Of the other changes the first few of a second are told; the rest are counted,
//! and told with the state that stands when the second is over.
//! Cost: a comparison a tick.

use rt_core::log::{LogLevel, RtLog};
use shm_abi::{DriverState, FaultReason};

/// Changes that are told in a second.
const MOST_A_SECOND: u64 = 4;

#[derive(Debug)]
pub(crate) struct StateLog {
    ticks_a_second: u64,
    state: Option<DriverState>,
    /// The second that counts.
    begun_tick: u64,
    told: u64,
    untold: u64,
}

impl StateLog {
    pub(crate) fn new(period_ns: u64) -> Self {
        let ticks_a_second = 1_000_000_000 / period_ns.max(1);
        Self { ticks_a_second, state: None, begun_tick: 0, told: 0, untold: 0 }
    }

    /// For each tick.
    pub(crate) fn tell(&mut self, state: DriverState, fault: FaultReason, tick: u64, log: &mut RtLog) {
        if tick.saturating_sub(self.begun_tick) >= self.ticks_a_second {
            self.begin_second(tick, log);
        }
        if self.state.replace(state) == Some(state) {
            return;
        }
        if state == DriverState::Fault {
            log.push(LogLevel::Error, tick, fault.sentence(), &[]);
        } else if self.told < MOST_A_SECOND {
            self.told += 1;
            log.push(LogLevel::Info, tick, state.name(), &[]);
        } else {
            self.untold += 1;
        }
    }

    fn begin_second(&mut self, tick: u64, log: &mut RtLog) {
        self.begun_tick = tick;
        self.told = 0;
        let untold = std::mem::take(&mut self.untold);
        if let Some(state) = self.state.filter(|_| untold > 0) {
            log.push(LogLevel::Info, tick, "{} more changes of state in a second; now:", &[untold as f64]);
            log.push(LogLevel::Info, tick, state.name(), &[]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: u64 = 1_000_000;

    /// Lines that are told of a state for each tick.
    fn told(states: impl IntoIterator<Item = DriverState>) -> Vec<String> {
        let (mut log, mut drain) = rt_core::log::channel(1024);
        let mut changes = StateLog::new(MS);
        for (tick, state) in (0..).zip(states) {
            changes.tell(state, FaultReason::EmergencyStop, tick, &mut log);
        }
        let mut lines = Vec::new();
        drain.drain(|line| lines.push(format!("{} {}", line.tick, line.text)));
        lines
    }

    fn flicker(tick: u64) -> DriverState {
        if tick.is_multiple_of(2) { DriverState::Idle } else { DriverState::Active }
    }

    #[test]
    fn changes_now_and_then_are_all_told_and_a_state_that_stays_is_not() {
        let states = (0..10_000).map(|tick| flicker(tick / 400));
        assert_eq!(told(states).len(), 25);
        assert_eq!(told((0..10_000).map(|_| DriverState::Idle)), ["0 idle"]);
    }

    #[test]
    fn of_a_state_that_flickers_a_few_lines_a_second_are_told_and_how_many_are_not() {
        let lines = told((0..3000).map(flicker).chain([DriverState::Active; 1500]));
        assert_eq!(lines[..4], ["0 idle", "1 active", "2 idle", "3 active"]);
        assert_eq!(lines[4], "1000 996 more changes of state in a second; now:");
        assert!(lines.len() <= 4 * 6, "{lines:?}");
        assert_eq!(lines.last().map(String::as_str), Some("3000 active"), "what stands at last is told");
    }

    #[test]
    fn a_fault_is_told_however_much_was_told_before() {
        let lines = told((0..500).map(flicker).chain([DriverState::Fault]));
        let expected = format!("500 {}", FaultReason::EmergencyStop.sentence());
        assert_eq!(lines.last(), Some(&expected));
    }
}
