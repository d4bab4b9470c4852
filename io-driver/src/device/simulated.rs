//! An arm that is simulated in this process, held by a simulated hand.
//!
//! Model: the same path as a real device, from raw counters and to converter codes; behind them moves
//! [`SimulatedArm`], pulled by a hand that wants to be where its script, or somebody live, says. Between two readings the time of the
//! ticks passes, with the former codes until the new ones took effect: as long after the reading as the clock
//! that is driven says, or on a virtual clock as the way of replying says ([`Latency`]).
//! Frames: the script is in W, everything else in the device's base frame D.
//! Cost: that of the arm, some microseconds a millisecond; no allocation.

#![allow(non_snake_case)] // Frames are capital letters: a point p_W is in the world.

use super::arm::Arm;
use super::{Device, Effort, Extras, Reading, TickTime, Written};
use crate::live_hand::{LiveFinger, LiveWish};
use crate::safety::Restrained;
use crate::sim::arm::{NobodyHolds, SimulatedArm, Truth};
use crate::sim::hand::{Felt, ImpedanceHand};
use crate::sim::script::HandPlayer;
use crate::sim::tip_board::TipBoard;
use crate::zeroing::ZeroState;
use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use rt_core::clock::monotonic_ns;
use shm_abi::FaultReason;
use shm_abi::segment::DeviceInfo;
use std::sync::Arc;

/// A driver that stalls for longer than this finds the world where it was after it (ns): nobody ran it meanwhile. Short
/// against the amplifiers' watchdogs, which have to watch the driver's work and not this machine's.
const LONGEST_STALL_NS: u64 = 5_000_000;

/// When after the reading of a tick its motor values take effect.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Latency {
    /// When they are really written.
    Measured,
    /// So long after (ns), whatever this process takes.
    Nominal(u64),
}

/// Who holds the arm.
#[derive(Debug)]
pub enum Holder {
    /// Nobody: the arm falls, or its motors hold it.
    Nobody,
    /// A hand.
    Hand(Box<HeldBy>),
}

/// A hand and what it wants.
#[derive(Debug)]
pub struct HeldBy {
    /// How it pulls.
    pub hand: ImpedanceHand,
    /// Where it wants to be.
    pub wish: Wish,
    /// Where its partners are.
    pub board: Arc<TipBoard>,
    /// Which place on the board is its own.
    pub place: usize,
}

/// Where a hand wants to be.
#[derive(Debug)]
pub enum Wish {
    /// Where a script, written in W, has this finger.
    Scripted(HandPlayer, usize),
    /// Where somebody wants this finger by now.
    Live(LiveFinger),
    /// Here, in W (m).
    Resting(Vector3<f64>),
}

/// How the hand turns the handle, and what it presses.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Handle {
    pub(crate) orientation_W: UnitQuaternion<f64>,
    pub(crate) buttons: u64,
}

impl Wish {
    /// Where the tip is wanted, in W (m), and the handle.
    pub(crate) fn at(&mut self, time_s: f64) -> (Vector3<f64>, Handle) {
        match self {
            Self::Resting(at) => (*at, Handle::default()),
            Self::Live(live) => {
                let LiveWish { place, orientation, buttons } = live.wish();
                (place, Handle { orientation_W: orientation, buttons: u64::from(buttons) })
            }
            Self::Scripted(player, finger) => {
                // `open` makes sure that the finger is in the script.
                let at = player.position(*finger, time_s).unwrap_or_default();
                let orientation_W = player.orientation(*finger, time_s).unwrap_or_default();
                let buttons = player.buttons(*finger, time_s).map_or(0, u64::from);
                (at, Handle { orientation_W, buttons })
            }
        }
    }

    pub(crate) fn has_buttons(&self) -> bool {
        match self {
            Self::Scripted(player, finger) => player.script().has_buttons(*finger),
            Self::Live(_) => true,
            Self::Resting(_) => false,
        }
    }
}

/// The device.
#[derive(Debug)]
pub struct SimulatedDevice {
    info: DeviceInfo,
    arm: Arm,
    plant: SimulatedArm,
    holder: Holder,
    /// X_WD.
    base_in_world: Isometry3<f64>,
    latency: Latency,
    last_ns: Option<u64>,
    read_at_ns: u64,
    /// What the amplifiers get, and how long after the last reading (ns).
    pending: Option<(u64, Drive)>,
    /// Its world stands still until some force is let through.
    is_waiting: bool,
    /// What the counters say meanwhile, those of the gimbal too.
    waiting_counters: Option<([i64; 3], Option<[i64; 3]>)>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Drive {
    Codes([u16; 3]),
    Off,
}

impl SimulatedDevice {
    /// A device whose base stands at X_WD.
    pub fn new(
        info: DeviceInfo,
        arm: Arm,
        plant: SimulatedArm,
        holder: Holder,
        base_in_world: Isometry3<f64>,
        latency: Latency,
    ) -> Self {
        Self {
            info,
            arm,
            plant,
            holder,
            base_in_world,
            latency,
            last_ns: None,
            read_at_ns: 0,
            pending: None,
            is_waiting: false,
            waiting_counters: None,
        }
    }

    /// The same, whose world stands still until some force is let through: so a run is the same however long the
    /// driver waited for its commander.
    pub fn waiting_for_a_commander(self) -> Self {
        Self { is_waiting: true, ..self }
    }

    /// What really is, which no encoder tells.
    pub fn truth(&self) -> Truth {
        self.plant.truth()
    }

    /// Lets the time since the last reading pass; what the hand does with the handle, and the counters.
    fn go_on(&mut self, time: TickTime, elapsed_ns: u64) -> (Handle, ([i64; 3], Option<[i64; 3]>)) {
        self.pass(elapsed_ns);
        let handle = self.tell_hand(time, elapsed_ns.max(time.period_ns) as f64 / 1e9);
        let turned = self.base_in_world.rotation.inverse() * handle.orientation_W;
        let gimbal = self.plant.gimbal_counters(turned);
        (handle, (self.plant.counters(), gimbal))
    }

    fn handle(&mut self, time: TickTime) -> Handle {
        match &mut self.holder {
            Holder::Nobody => Handle::default(),
            Holder::Hand(held) => held.wish.at(time.run_time_s()).1,
        }
    }

    /// Lets the time since the last reading pass.
    fn pass(&mut self, elapsed_ns: u64) {
        let seconds = |ns: u64| ns as f64 / 1e9;
        let Some((after_ns, drive)) = self.pending.take() else {
            return self.advance(seconds(elapsed_ns));
        };
        let before_ns = after_ns.min(elapsed_ns);
        self.advance(seconds(before_ns));
        match drive {
            Drive::Codes(codes) => self.plant.command(codes),
            Drive::Off => self.plant.switch_off(),
        }
        self.advance(seconds(elapsed_ns - before_ns));
    }

    fn advance(&mut self, dt_s: f64) {
        match &mut self.holder {
            Holder::Nobody => self.plant.advance(dt_s, &mut NobodyHolds),
            Holder::Hand(held) => self.plant.advance(dt_s, &mut held.hand),
        }
    }

    /// The hand learns where it should be by now, what it feels, and where its partners are.
    fn tell_hand(&mut self, time: TickTime, elapsed_s: f64) -> Handle {
        let Holder::Hand(held) = &mut self.holder else { return Handle::default() };
        let truth = self.plant.truth();
        let to_base =
            |p_W: Vector3<f64>| self.base_in_world.inverse_transform_point(&Point3::from(p_W)).coords;
        let (wanted_W, handle) = held.wish.at(time.run_time_s());
        held.board.tell(held.place, (self.base_in_world * Point3::from(truth.tip)).coords);
        let felt = Felt {
            force_on_user_D: -held.hand.force_on_tip(truth.tip, truth.tip_velocity),
            partners_centroid_D: held.board.others(held.place).map(to_base),
        };
        held.hand.intend(to_base(wanted_W), felt, elapsed_s);
        handle
    }

    fn latency_ns(&self) -> u64 {
        match self.latency {
            Latency::Measured => monotonic_ns().saturating_sub(self.read_at_ns),
            Latency::Nominal(ns) => ns,
        }
    }
}

impl Device for SimulatedDevice {
    fn info(&self) -> &DeviceInfo {
        &self.info
    }

    fn read(&mut self, time: TickTime) -> Result<Reading, FaultReason> {
        let since_ns = self.last_ns.replace(time.time_ns).map_or(0, |last| time.time_ns.saturating_sub(last));
        let elapsed_ns = since_ns.min(time.period_ns.max(LONGEST_STALL_NS));
        let (handle, counters) = match self.waiting_counters.filter(|_| self.is_waiting) {
            Some(counters) => (self.handle(time), counters),
            None => self.go_on(time, elapsed_ns),
        };
        // From here on: what the simulation took is nobody's latency.
        self.read_at_ns = monotonic_ns();
        self.waiting_counters = Some(counters);
        let mut reading = self.arm.read_with_gimbal(counters.0, counters.1, time);
        reading.buttons = handle.buttons;
        if self.plant.is_tripped() {
            return Err(FaultReason::AmplifierTripped);
        }
        Ok(reading)
    }

    fn attainable(&self, effort: Effort) -> Restrained {
        self.arm.attainable(effort)
    }

    fn write(&mut self, effort: Effort) -> Result<Written, FaultReason> {
        let (codes, written) = self.arm.render(effort)?;
        let is_on = effort.gravity_share > 0.0;
        self.is_waiting &= !is_on;
        let drive = if is_on { Drive::Codes(codes) } else { Drive::Off };
        self.pending = Some((self.latency_ns(), drive));
        Ok(written)
    }

    fn release(&mut self) {
        self.arm.release();
        self.pending = Some((self.latency_ns(), Drive::Off));
    }

    fn rearm(&mut self) {
        self.plant.rearm();
    }

    fn extras(&self) -> Extras {
        let buttons = matches!(&self.holder, Holder::Hand(held) if held.wish.has_buttons());
        Extras { orientation: self.plant.has_gimbal(), buttons }
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

#[cfg(test)]
mod tests;
