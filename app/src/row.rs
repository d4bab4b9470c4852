//! What one fast tick leaves behind for slower eyes: the recording's row.

use haptics::{ContactState, Feature};
use nalgebra::{Quaternion, Vector3};
use physics::GraspQuality;
use shm_abi::MAX_DEVICES;

/// One fast tick of a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Row {
    /// Ticks since the first one at full authority.
    pub run_tick: u64,
    /// When its frame was due, on the driver's clock (ns): in real time the system's monotonic one. Recordings do not have it.
    pub due_ns: u64,
    /// The fingers; those that do not exist are zero.
    pub fingers: [FingerRow; MAX_DEVICES],
}

/// One finger in it; world frame, SI.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct FingerRow {
    /// The haptic interaction point (m).
    pub hip: Vector3<f64>,
    /// How fast it moves as its driver estimates it (m/s); zero where nobody does. Recordings as CSV do not have it.
    pub velocity: Vector3<f64>,
    /// The god-object; the HIP in free space (m).
    pub god_object: Vector3<f64>,
    /// What rendering computed (N).
    pub force_on_user: Vector3<f64>,
    /// Torque of the same about the finger's centre (N m); recorded where the finger has a radius.
    pub torque_on_user: Vector3<f64>,
    /// What the device was made to render after ramps, limits and converters (N).
    pub applied_on_user: Vector3<f64>,
    /// How its device's last link is turned, w x y z; recorded where a gimbal measures it.
    pub orientation_wxyz: [f64; 4],
    /// Whether that is known.
    pub has_orientation: bool,
    /// Bit `i`: button `i` of its device is pressed; recorded where it has buttons.
    pub buttons: u64,
    /// Index of the touched entity.
    pub entity: Option<u32>,
    /// What of it is touched.
    pub feature: Feature,
    /// Outward from what is touched, of unit length; zero where nothing is. Recordings as CSV do not have it.
    pub normal: Vector3<f64>,
    /// Of the friction circle around the HIP's foot on the tangent plane (m); zero without friction. Recordings as CSV do not
    /// have it.
    pub friction_radius_m: f64,
    /// What the friction does.
    pub friction: ContactState,
    /// Energy fed into the hand up to this tick (J); zero where nobody keeps the finger passive.
    pub energy_j: f64,
    /// By how much that changed the force (N).
    pub controlled_n: f64,
    /// Index of the entity that is tied to it; recorded where a button ties.
    pub attached: Option<u32>,
    /// Which space it is in: 0 the world, otherwise behind a door; recorded where the scene has doors.
    pub space: u32,
}

impl Row {
    /// A row of nothing.
    pub fn empty() -> Self {
        Self { run_tick: 0, due_ns: 0, fingers: [FingerRow::default(); MAX_DEVICES] }
    }
}

/// One entity that moves, as it is when a tick begins; world frame, SI.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct BodyRow {
    /// Of the entity's frame (m).
    pub position: Vector3<f64>,
    /// Of the entity's frame.
    pub orientation: Quaternion<f64>,
    /// Of the entity's frame's origin (m/s).
    pub velocity: Vector3<f64>,
    /// rad/s.
    pub angular_velocity: Vector3<f64>,
    /// How the fingers hold it in this tick; recorded where the scene asks for it.
    pub grasp: GraspQuality,
    /// Whether it is in the slow list; recorded where the scene has two.
    pub is_slow: bool,
    /// The tick of the run as of which it stands and moves so, of what does not rest in the slow list; recorded as that is.
    pub as_of: Option<u64>,
}
