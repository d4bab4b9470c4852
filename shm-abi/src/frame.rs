//! What the driver tells: one [`Frame`] per tick, holding all devices, so that nobody mixes ticks.
//!
//! Units and frames: SI; positions and forces in the device's base frame D. Every field is eight bytes,
//! so that a frame is an array of words without padding.

use crate::enumeration::from_word;
use crate::layout::{MAX_DEVICES, assert_layout};
use bytemuck::{Pod, Zeroable};
use std::borrow::Cow;

/// One tick of the driver, all devices.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct Frame {
    /// Number of the tick, counted from the driver's start; skipped deadlines are counted too.
    pub tick: u64,
    /// When the tick was due, CLOCK_MONOTONIC (ns).
    pub deadline_ns: u64,
    /// When the driver had read the devices, CLOCK_MONOTONIC (ns).
    pub read_ns: u64,
    /// A [`DriverState`].
    pub state: u64,
    /// A [`FaultReason`].
    pub fault: u64,
    /// Number of the lease that commands this tick; 0: nobody.
    pub lease: u64,
    /// Share of the commanded force that reaches the motors if the reply is in time, 0 to 1.
    pub authority: f64,
    /// Ticks since the lease first had full authority; negative before. The scripted hand's clock.
    pub run_tick: i64,
    /// How many of `devices` exist.
    pub device_count: u64,
    /// What became of the tick before this one.
    pub previous: Outcome,
    /// Since 1.1. Bits of `INPUT_...`: what the switches say that guard the motors.
    pub inputs: u64,
    /// The devices; those beyond `device_count` are zero.
    pub devices: [DeviceFrame; MAX_DEVICES],
}

assert_layout!(Frame: 2680, 8 {
    tick: u64 = 0,
    deadline_ns: u64 = 8,
    read_ns: u64 = 16,
    state: u64 = 24,
    fault: u64 = 32,
    lease: u64 = 40,
    authority: f64 = 48,
    run_tick: i64 = 56,
    device_count: u64 = 64,
    previous: Outcome = 72,
    reserved: u64 = 112 => { inputs: u64 = 112, },
    devices: [DeviceFrame; MAX_DEVICES] = 120,
});

/// How the tick before this frame's ended.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct Outcome {
    /// A [`ReplyKind`].
    pub reply: u64,
    /// The tick whose command drove the motors; meaningless while `authority` is 0.
    pub command_tick: u64,
    /// The share of the commanded force that was let through.
    pub authority: f64,
    /// From the frame's doorbell to the accepted reply (ns); 0 where there was none.
    pub round_trip_ns: u64,
    /// When the motors were written, CLOCK_MONOTONIC (ns).
    pub written_ns: u64,
}

assert_layout!(Outcome: 40, 8 {
    reply: u64 = 0,
    command_tick: u64 = 8,
    authority: f64 = 16,
    round_trip_ns: u64 = 24,
    written_ns: u64 = 32,
});

/// One device in a [`Frame`].
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct DeviceFrame {
    /// Bits of `DEVICE_...`: bit 0, the position is valid; since 1.2 bit 1, the orientation is measured,
    /// bit 2, it has to be zeroed, bit 3, it has buttons.
    pub flags: u64,
    /// Bit `i`: button `i` is pressed.
    pub buttons: u64,
    /// Encoder counts, extended beyond the counter's width: three joints, three gimbal axes.
    pub encoder_counts: [i64; 6],
    /// Joint angles (rad), in the same order.
    pub joint_angle_rad: [f64; 6],
    /// The tip in the base frame D (m).
    pub position_m_measured: [f64; 3],
    /// Orientation of the gimbal's last link in D, w x y z; identity where there is no instrumented gimbal.
    pub orientation_wxyz_measured: [f64; 4],
    /// The force on the user asked for in the tick before, in D (N).
    pub force_on_user_n_commanded: [f64; 3],
    /// The force on the user that the motors were made to render in the tick before, in D (N).
    pub force_on_user_n_applied: [f64; 3],
    /// The motor values written in the tick before, as the hardware got them.
    pub motor_codes: [i64; 3],
    /// Since 1.1. How fast the tip moves, in D (m/s), estimated from the positions; since 1.2 from the counts.
    pub velocity_m_per_s_estimated: [f64; 3],
    /// Since 1.1. Bits of `LIMIT_...`: what came between commanded and applied force in the tick before.
    pub limits: u64,
    /// Since 1.1. Warmth of the warmest motor: 1 is what its continuous current would reach.
    pub motor_heat: f64,
    /// Since 1.2. How fast each actuated joint turns (rad/s), estimated from its counts; m/s where the device has
    /// metres for joint angles.
    pub joint_velocity_rad_per_s_estimated: [f64; 3],
    /// Room for later minor versions; zero.
    pub reserved: [u64; 2],
}

assert_layout!(DeviceFrame: 320, 8 {
    flags: u64 = 0,
    buttons: u64 = 8,
    encoder_counts: [i64; 6] = 16,
    joint_angle_rad: [f64; 6] = 64,
    position_m_measured: [f64; 3] = 112,
    orientation_wxyz_measured: [f64; 4] = 136,
    force_on_user_n_commanded: [f64; 3] = 168,
    force_on_user_n_applied: [f64; 3] = 192,
    motor_codes: [i64; 3] = 216,
    reserved: [u64; 10] = 240 => {
        velocity_m_per_s_estimated: [f64; 3] = 240,
        limits: u64 = 264,
        motor_heat: f64 = 272,
        joint_velocity_rad_per_s_estimated: [f64; 3] = 280,
        reserved: [u64; 2] = 304,
    },
});

/// [`DeviceFrame::flags`]: the position is valid.
pub const DEVICE_POSITION_VALID: u64 = 1;
/// [`DeviceFrame::flags`]: since 1.2. An instrumented gimbal measures the orientation.
pub const DEVICE_ORIENTATION_MEASURED: u64 = 2;
/// [`DeviceFrame::flags`]: since 1.2. It does not know where it is until somebody asks to zero it
/// ([`client::zero`](crate::client::zero)).
pub const DEVICE_NOT_ZEROED: u64 = 4;
/// [`DeviceFrame::flags`]: since 1.2. Its `buttons` mean something.
pub const DEVICE_HAS_BUTTONS: u64 = 8;

/// [`Frame::inputs`]: an emergency stop is pressed.
pub const INPUT_EMERGENCY_STOP: u64 = 1;
/// [`Frame::inputs`]: there is a dead-man's switch.
pub const INPUT_DEAD_MAN_PRESENT: u64 = 2;
/// [`Frame::inputs`]: and somebody holds it.
pub const INPUT_DEAD_MAN_HELD: u64 = 4;

/// [`DeviceFrame::limits`]: the force was not finite or beyond the device's peak.
pub const LIMIT_PEAK: u64 = 1;
/// [`DeviceFrame::limits`]: the tip was outside the workspace.
pub const LIMIT_WORKSPACE: u64 = 2;
/// [`DeviceFrame::limits`]: the force grew faster than it may.
pub const LIMIT_SLEW: u64 = 4;
/// [`DeviceFrame::limits`]: a motor was warm.
pub const LIMIT_HEAT: u64 = 8;
/// [`DeviceFrame::limits`]: a motor was asked for more than its converter or amplifier gives.
pub const LIMIT_SATURATION: u64 = 16;

/// The driver's state machine.
#[repr(u64)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DriverState {
    /// Devices are being opened.
    Starting = 0,
    /// Devices run but do not know where they are yet.
    Zeroing = 1,
    /// Positions are valid, motors are off.
    Idle = 2,
    /// A lease gives fresh commands.
    Active = 3,
    /// Motors are off until somebody asks for them again; see [`FaultReason`].
    Fault = 4,
}

from_word!(DriverState { Starting, Zeroing, Idle, Active, Fault });

impl DriverState {
    /// The name a person reads.
    pub fn name(self) -> &'static str {
        match self {
            Self::Starting => "starting",
            Self::Zeroing => "zeroing",
            Self::Idle => "idle",
            Self::Active => "active",
            Self::Fault => "fault",
        }
    }
}

/// Why the driver is in [`DriverState::Fault`]. Minor versions add reasons: a reader that meets a number which
/// it does not know takes it for a fault all the same, and tells the number.
#[repr(u64)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FaultReason {
    /// It is not.
    None = 0,
    /// A device could not be read.
    DeviceRead = 1,
    /// A device could not be written.
    DeviceWrite = 2,
    /// A device reported a position that is not finite.
    PositionNotFinite = 3,
    /// A motor value came out not finite.
    MotorNotFinite = 4,
    /// The loop panicked.
    Panic = 5,
    /// Since 1.1. A device moved faster than it may.
    Overspeed = 6,
    /// Since 1.1. A position jumped farther in a tick than anything can move.
    PositionJump = 7,
    /// Since 1.1. An emergency stop was pressed, or asked for over the socket.
    EmergencyStop = 8,
    /// Since 1.1. An amplifier switched itself off: its watchdog was not served, or it refused a value.
    AmplifierTripped = 9,
    /// Since 1.1. More deadlines in a row were missed than the configuration allows.
    Overrun = 10,
    /// Since 1.3. The driver's thread that hears requests stood still while a force might be let through.
    ServiceSilent = 11,
}

from_word!(FaultReason {
    None,
    DeviceRead,
    DeviceWrite,
    PositionNotFinite,
    MotorNotFinite,
    Panic,
    Overspeed,
    PositionJump,
    EmergencyStop,
    AmplifierTripped,
    Overrun,
    ServiceSilent,
});

impl FaultReason {
    /// The sentence a person reads.
    pub fn sentence(self) -> &'static str {
        match self {
            Self::None => "no fault",
            Self::DeviceRead => "a device could not be read",
            Self::DeviceWrite => "a device could not be written",
            Self::PositionNotFinite => "a device reported a position that is not finite",
            Self::MotorNotFinite => "a motor value came out not finite",
            Self::Panic => "the driver's loop panicked",
            Self::Overspeed => "a device moved faster than it may",
            Self::PositionJump => "a position jumped farther in a tick than anything can move",
            Self::EmergencyStop => "an emergency stop was pressed",
            Self::AmplifierTripped => "an amplifier switched itself off",
            Self::Overrun => "too many deadlines in a row were missed",
            Self::ServiceSilent => "the driver's thread that hears requests stood still",
        }
    }

    /// The sentence for a word of a frame, whichever version wrote it.
    pub fn sentence_for(word: u64) -> Cow<'static, str> {
        match Self::from_word(word) {
            Some(reason) => reason.sentence().into(),
            None => format!("a fault of a kind this version does not know ({word})").into(),
        }
    }
}

/// What became of a tick's reply.
#[repr(u64)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ReplyKind {
    /// Nobody holds the lease.
    NoLease = 0,
    /// A valid command arrived within the budget.
    Fresh = 1,
    /// None arrived; an earlier one, still young enough, was used again.
    Held = 2,
    /// None arrived and the last one is too old: the force ramps to zero.
    Expired = 3,
}

from_word!(ReplyKind { NoLease, Fresh, Held, Expired });

impl Frame {
    /// The devices that exist. A count beyond the array is cut to it.
    pub fn present_devices(&self) -> &[DeviceFrame] {
        let count = usize::try_from(self.device_count).unwrap_or(MAX_DEVICES).min(MAX_DEVICES);
        &self.devices[..count]
    }

    /// It is of an emergency stop that stands, and no device was given a force.
    pub fn shows_emergency_stop(&self) -> bool {
        self.state == DriverState::Fault as u64
            && self.fault == FaultReason::EmergencyStop as u64
            && self.present_devices().iter().all(|device| device.force_on_user_n_applied == [0.0; 3])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn enumerations_survive_the_way_through_a_word_and_strangers_are_refused() {
        for word in 0..5 {
            assert_eq!(DriverState::from_word(word).map(|s| s as u64), Some(word));
        }
        for word in 0..12 {
            assert_eq!(FaultReason::from_word(word).map(|r| r as u64), Some(word));
        }
        for word in 0..4 {
            assert_eq!(ReplyKind::from_word(word).map(|r| r as u64), Some(word));
        }
        assert_eq!(DriverState::from_word(5), None);
        assert_eq!(FaultReason::from_word(u64::MAX), None);
        assert_eq!(ReplyKind::from_word(4), None);
    }

    #[test]
    fn every_state_has_its_name() {
        let names: Vec<_> = (0..5).filter_map(DriverState::from_word).map(DriverState::name).collect();
        assert_eq!(names, ["starting", "zeroing", "idle", "active", "fault"]);
    }

    #[test]
    fn a_fault_of_a_later_version_is_told_by_its_number() {
        assert_eq!(FaultReason::sentence_for(8), "an emergency stop was pressed");
        assert_eq!(FaultReason::sentence_for(12), "a fault of a kind this version does not know (12)");
    }

    #[test]
    fn an_absurd_device_count_is_cut_to_the_array() {
        let mut frame = Frame::zeroed();
        frame.device_count = u64::MAX;
        assert_eq!(frame.present_devices().len(), MAX_DEVICES);
    }
}
