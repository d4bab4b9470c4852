//! An arm on an emulated card: the same path as real registers, and an amplifier that checks every value.
//!
//! Model: counters, buttons and status are read, codes and enable written, as words of a mapping. Amplifiers are
//! on only while some force may be let through. A card whose emulator stands still cannot be read; one that was
//! switched off and on meanwhile counts from anywhere, and its arm has to be zeroed again.
//! Invariants: a process that dies by a signal stores zero torque and switches the amplifiers off, whichever of
//! its threads it was.

use super::arm::Arm;
use super::{Device, Effort, Extras, Reading, TickTime, Written};
use crate::emulator::card::{ARM_SHIFT, Card, DriversCard, QUEUE, STATUS_TRIPPED};
use crate::safety::Restrained;
use crate::zeroing::ZeroState;
use rt_core::clock::monotonic_ns;
use rt_core::last_act;
use shm_abi::FaultReason;
use shm_abi::segment::DeviceInfo;
use std::sync::atomic::Ordering;

/// A card that shows no life for so long is gone (ns). Stalls of a virtual machine are shorter.
const PATIENCE_NS: u64 = 200_000_000;
/// Amplifiers that were armed anew may take so long to say that they are no longer tripped (ns).
const ARMING_NS: u64 = 200_000_000;

/// The device.
#[derive(Debug)]
pub struct EmulatedDevice {
    info: DeviceInfo,
    hold: DriversCard,
    arm: Arm,
    channels: Channels,
    /// The card's, when it was opened or last looked at.
    session: u32,
    heartbeat: u64,
    alive_ns: u64,
    armed_ns: u64,
}

/// Which registers belong to the joints.
#[derive(Debug, Clone, Copy)]
pub struct Channels {
    /// Counters.
    pub encoders: [u8; 3],
    /// Counters of an instrumented gimbal.
    pub gimbal: Option<[u8; 3]>,
    /// How many buttons the handle has.
    pub buttons: u32,
    /// Converters; below 4.
    pub motors: [u8; 3],
}

impl EmulatedDevice {
    /// An arm on a card that this driver holds, switched off.
    ///
    /// # Errors
    /// If no more registers can be switched off by a dying process.
    pub fn new(
        info: DeviceInfo,
        hold: DriversCard,
        arm: Arm,
        channels: Channels,
    ) -> Result<Self, last_act::NoRoom> {
        let mut device = Self {
            info,
            hold,
            arm,
            channels,
            session: 0,
            heartbeat: 0,
            alive_ns: monotonic_ns(),
            armed_ns: 0,
        };
        device.session = device.card().inputs.session.load(Ordering::Acquire);
        last_act::guard(&device.card().outputs.enable, 0)?;
        let zero = u32::from(device.arm.release()[0]);
        for channel in channels.motors {
            last_act::guard(&device.card().outputs.codes[usize::from(channel)], zero)?;
        }
        device.release();
        device.rearm();
        Ok(device)
    }

    fn card(&self) -> &'static Card {
        self.hold.card
    }

    fn is_alive(&mut self) -> bool {
        let heartbeat = self.card().inputs.heartbeat.load(Ordering::Acquire);
        let now = monotonic_ns();
        if heartbeat != self.heartbeat {
            self.heartbeat = heartbeat;
            self.alive_ns = now;
        }
        now.saturating_sub(self.alive_ns) <= PATIENCE_NS
    }

    fn store(&self, codes: [u16; 3], enable: bool) {
        last_act::store_unless_dying(|| {
            let outputs = &self.card().outputs;
            let number = outputs.written.load(Ordering::Relaxed).wrapping_add(1);
            let record = &self.card().queue[(number % QUEUE as u64) as usize];
            let mut packed = 0;
            for (channel, code) in self.channels.motors.iter().zip(codes) {
                packed |= u64::from(code) << (16 * u32::from(*channel));
                outputs.codes[usize::from(*channel)].store(u32::from(code), Ordering::Relaxed);
            }
            record.number.store(0, Ordering::Release);
            record.time_ns.store(monotonic_ns(), Ordering::Relaxed);
            record.codes.store(packed, Ordering::Relaxed);
            let arm = u64::from(outputs.arm.load(Ordering::Relaxed));
            record.flags.store(arm << ARM_SHIFT | u64::from(enable), Ordering::Relaxed);
            record.number.store(number, Ordering::Release);
            // On before the value that says so, off after it: a register that is off while the last value says on
            // was switched off by a last act.
            if enable {
                outputs.enable.store(1, Ordering::Release);
            }
            outputs.written.store(number, Ordering::Release);
            if !enable {
                outputs.enable.store(0, Ordering::Release);
            }
        });
    }
}

impl Device for EmulatedDevice {
    fn info(&self) -> &DeviceInfo {
        &self.info
    }

    fn read(&mut self, time: TickTime) -> Result<Reading, FaultReason> {
        let inputs = &self.card().inputs;
        let session = inputs.session.load(Ordering::Acquire);
        let count = |channel: u8| i64::from(inputs.counters[usize::from(channel)].load(Ordering::Relaxed));
        let (raw, gimbal) =
            (self.channels.encoders.map(count), self.channels.gimbal.map(|own| own.map(count)));
        // Read whatever the status says: the counters go on, and nobody has to zero anew.
        let mut reading = self.arm.read_with_gimbal(raw, gimbal, time);
        reading.buttons = u64::from(inputs.buttons.load(Ordering::Relaxed));
        // Before and after the counters: a card that was switched on between the two is another one as well.
        let later = inputs.session.load(Ordering::Acquire);
        if session != self.session || later != session {
            self.session = later;
            self.arm.lose_zero();
            return Err(FaultReason::DeviceRead);
        }
        if !self.is_alive() {
            return Err(FaultReason::DeviceRead);
        }
        if inputs.status.load(Ordering::Acquire) & STATUS_TRIPPED != 0 {
            // Until they have answered, nothing is let through, and nobody has to ask twice.
            reading.is_valid = false;
            if monotonic_ns().saturating_sub(self.armed_ns) > ARMING_NS {
                return Err(FaultReason::AmplifierTripped);
            }
        }
        Ok(reading)
    }

    fn attainable(&self, effort: Effort) -> Restrained {
        self.arm.attainable(effort)
    }

    fn write(&mut self, effort: Effort) -> Result<Written, FaultReason> {
        let (codes, written) = self.arm.render(effort)?;
        if last_act::has_begun() {
            // Nothing arrives any more.
            return Err(FaultReason::DeviceWrite);
        }
        self.store(codes, effort.gravity_share > 0.0);
        Ok(written)
    }

    fn release(&mut self) {
        let zero = self.arm.release();
        self.store(zero, false);
    }

    fn rearm(&mut self) {
        self.armed_ns = monotonic_ns();
        self.arm.forget_motion();
        self.card().outputs.arm.fetch_add(1, Ordering::AcqRel);
    }

    fn extras(&self) -> Extras {
        Extras { orientation: self.channels.gimbal.is_some(), buttons: self.channels.buttons > 0 }
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
}
