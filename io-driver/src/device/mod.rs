//! What moves under a finger: one module per way of reaching it, behind one small trait.
//!
//! A device is read once and written once a tick, by the loop, so neither may allocate, lock or wait. It
//! gets a force on the user that is already limited and finite, in its own base frame D, and tells what
//! its motors were really made to render.

pub mod arm;
pub mod emulated;
pub mod encoder_trace;
pub mod ideal;
pub mod replay;
pub mod simulated;

use crate::safety::Restrained;
use crate::zeroing::ZeroState;
use nalgebra::{UnitQuaternion, Vector3};
use shm_abi::frame::{DEVICE_HAS_BUTTONS, DEVICE_ORIENTATION_MEASURED, DEVICE_POSITION_VALID};
use shm_abi::segment::DeviceInfo;
use shm_abi::{DeviceFrame, FaultReason};

/// The tick in which a device is read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TickTime {
    /// Number of the tick.
    pub tick: u64,
    /// Length of a tick (ns).
    pub period_ns: u64,
    /// When it is (ns), from any origin: the time that has passed, also where ticks were late, skipped or made up for.
    pub time_ns: u64,
    /// Ticks since a lease first had full authority; negative before. The clock of scripted hands.
    pub run_tick: i64,
    /// A lease begins with it.
    pub begins_lease: bool,
}

impl TickTime {
    /// Under a clock that counts ticks, each of which takes a period.
    pub fn counted(tick: u64, period_ns: u64, run_tick: i64) -> Self {
        Self { tick, period_ns, time_ns: tick.saturating_mul(period_ns), run_tick, begins_lease: false }
    }

    /// Time since full authority (s); zero before.
    pub fn run_time_s(&self) -> f64 {
        run_time_s(self.run_tick, self.period_ns)
    }
}

/// Time of a run's tick (s): the correctly rounded quotient, so that tick 3 at 1 kHz is 0.003.
pub fn run_time_s(run_tick: i64, period_ns: u64) -> f64 {
    let ns = u128::from(run_tick.max(0).unsigned_abs()) * u128::from(period_ns);
    ns as f64 / 1e9
}

/// What a device says of one tick. All in the base frame D, SI.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reading {
    /// Whether the position can be trusted; false until the device has been zeroed.
    pub is_valid: bool,
    /// The tip (m).
    pub position_m: Vector3<f64>,
    /// How fast the tip moves (m/s), estimated.
    pub velocity_m_per_s: Vector3<f64>,
    /// The gimbal's last link, w x y z; identity where there is none.
    pub orientation_wxyz: [f64; 4],
    /// Whether a gimbal measures it.
    pub is_orientation_measured: bool,
    /// Encoder counts, extended: three joints, three gimbal axes.
    pub encoder_counts: [i64; 6],
    /// Joint angles in the same order (rad).
    pub joint_angle_rad: [f64; 6],
    /// How fast the three joints turn (rad/s), estimated; zero where there are none.
    pub joint_velocity_rad_per_s: [f64; 3],
    /// Bit `i`: button `i` is pressed.
    pub buttons: u64,
}

impl Reading {
    /// A valid reading of a position at rest and nothing else.
    pub fn at(position_m: Vector3<f64>) -> Self {
        Self {
            is_valid: true,
            position_m,
            velocity_m_per_s: Vector3::zeros(),
            orientation_wxyz: [1.0, 0.0, 0.0, 0.0],
            is_orientation_measured: false,
            encoder_counts: [0; 6],
            joint_angle_rad: [0.0; 6],
            joint_velocity_rad_per_s: [0.0; 3],
            buttons: 0,
        }
    }

    /// The same with an orientation that was measured.
    pub fn with_orientation(self, orientation: UnitQuaternion<f64>) -> Self {
        let [x, y, z, w] = orientation.coords.into();
        Self { orientation_wxyz: [w, x, y, z], is_orientation_measured: true, ..self }
    }

    /// The same of a device that does not know where it is: nobody may take its numbers for a pose or a motion.
    pub fn unknown(self) -> Self {
        let (velocity_m_per_s, joint_velocity_rad_per_s) = (Vector3::zeros(), [0.0; 3]);
        Self { is_valid: false, velocity_m_per_s, joint_velocity_rad_per_s, ..self }
    }

    /// Whether every number of it is finite.
    pub fn is_finite(&self) -> bool {
        // One after the other: a chain of them takes four times as long.
        let are_finite = |numbers: &[f64]| numbers.iter().all(|n| n.is_finite());
        are_finite(self.position_m.as_slice())
            && are_finite(&self.orientation_wxyz)
            && are_finite(&self.joint_angle_rad)
            && are_finite(self.velocity_m_per_s.as_slice())
            && are_finite(&self.joint_velocity_rad_per_s)
    }

    /// Puts it into the frame.
    pub fn write_to(&self, frame: &mut DeviceFrame) {
        let flag = |is_set: bool, bit: u64| if is_set { bit } else { 0 };
        frame.flags = flag(self.is_valid, DEVICE_POSITION_VALID)
            | flag(self.is_orientation_measured, DEVICE_ORIENTATION_MEASURED);
        frame.buttons = self.buttons;
        frame.encoder_counts = self.encoder_counts;
        frame.joint_angle_rad = self.joint_angle_rad;
        frame.position_m_measured = self.position_m.into();
        frame.velocity_m_per_s_estimated = self.velocity_m_per_s.into();
        frame.joint_velocity_rad_per_s_estimated = self.joint_velocity_rad_per_s;
        frame.orientation_wxyz_measured = self.orientation_wxyz;
    }
}

/// What a device tells besides its position.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Extras {
    /// How its last link is turned.
    pub orientation: bool,
    /// Which buttons are pressed.
    pub buttons: bool,
}

impl Extras {
    /// As the flags of a frame tell it.
    pub fn of(flags: u64) -> Self {
        Self {
            orientation: flags & DEVICE_ORIENTATION_MEASURED != 0,
            buttons: flags & DEVICE_HAS_BUTTONS != 0,
        }
    }
}

/// What a device is asked to do in a tick.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Effort {
    /// The force on the user, finite and within the device's peak, in D (N).
    pub force_on_user_n: Vector3<f64>,
    /// How much of its own weight it may hold up, 0 to 1.
    pub gravity_share: f64,
}

/// What the motors were made to do.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Written {
    /// The force on the user that this amounts to, in D (N).
    pub force_on_user_n: Vector3<f64>,
    /// The values the hardware got.
    pub motor_codes: [i64; 3],
    /// Bits of `LIMIT_...`: what the device itself had to cut.
    pub limits: u64,
    /// Warmth of the warmest motor; see [`crate::heat`].
    pub motor_heat: f64,
}

/// A haptic device as the loop sees it.
pub trait Device: Send {
    /// What it is.
    fn info(&self) -> &DeviceInfo;

    /// Reads where it is. An error is a fault: it ends in zero force on all devices.
    fn read(&mut self, time: TickTime) -> Result<Reading, FaultReason>;

    /// The part of a force, in its own direction, that its motors can give now.
    fn attainable(&self, effort: Effort) -> Restrained;

    /// Makes it render a force on the user.
    fn write(&mut self, effort: Effort) -> Result<Written, FaultReason>;

    /// Motors off, whatever state it is in; must not fail. Called on every way out.
    fn release(&mut self);

    /// Somebody asked to leave the fault state: what switched itself off may be switched on again, without
    /// force. The next `read` tells whether it could.
    fn rearm(&mut self) {}

    /// What it tells besides its position, always the same.
    fn extras(&self) -> Extras {
        Extras::default()
    }

    /// Whether it knows where it is. What has no counters always does.
    fn zero_state(&self) -> ZeroState {
        ZeroState::Innate
    }

    /// The pose that was read last is its zeroing pose.
    fn zero(&mut self) {}

    /// Its counters may have lost their place; until it is zeroed, it does not know where it is.
    fn lose_zero(&mut self) {}
}
