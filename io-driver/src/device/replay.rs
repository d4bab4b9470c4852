//! A recorded encoder trace through a described mechanism.
//!
//! Model: the raw counters of the trace, by ticks since the driver's start, go the way of a real device's; the
//! converters' codes that come out nobody listens to. The trace's first row is the home pose.

use super::arm::Arm;
use super::encoder_trace::EncoderReplay;
use super::{Device, Effort, Reading, TickTime, Written};
use crate::safety::Restrained;
use crate::zeroing::ZeroState;
use shm_abi::FaultReason;
use shm_abi::segment::DeviceInfo;

/// The device.
#[derive(Debug)]
pub struct ReplayDevice {
    info: DeviceInfo,
    replay: EncoderReplay,
    arm: Arm,
    first_tick: Option<u64>,
}

impl ReplayDevice {
    /// An arm that moves as the trace does.
    pub fn new(info: DeviceInfo, replay: EncoderReplay, arm: Arm) -> Self {
        Self { info, replay, arm, first_tick: None }
    }
}

impl Device for ReplayDevice {
    fn info(&self) -> &DeviceInfo {
        &self.info
    }

    fn read(&mut self, time: TickTime) -> Result<Reading, FaultReason> {
        let first = *self.first_tick.get_or_insert(time.tick);
        let elapsed = i64::try_from(time.tick.saturating_sub(first)).unwrap_or(i64::MAX);
        let raw = self.replay.counts_at(super::run_time_s(elapsed, time.period_ns));
        Ok(self.arm.read(raw, time))
    }

    fn attainable(&self, effort: Effort) -> Restrained {
        self.arm.attainable(effort)
    }

    fn write(&mut self, effort: Effort) -> Result<Written, FaultReason> {
        self.arm.render(effort).map(|(_, written)| written)
    }

    fn release(&mut self) {
        self.arm.release();
    }

    fn zero_state(&self) -> ZeroState {
        self.arm.zero_state()
    }

    fn zero(&mut self) {
        self.arm.zero();
    }

    fn lose_zero(&mut self) {
        self.arm.lose_zero();
    }

    fn rearm(&mut self) {
        self.arm.forget_motion();
    }
}
