//! Describes a device in a TOML file: every number that differs between two laboratories.
//!
//! Problem: individual devices differ by up to a fifth, wiring is not public, and a changed cable
//! must not need a compiler.
//! Model: `kind` says which tables the file has. An arm (`premium`, `wooden-haptics`) has `[linkage]`, `[encoders]`,
//! `[motors]`, if gravity is to be compensated `[bodies]`, and with an instrumented gimbal `[gimbal]`; if it is to be
//! simulated, moments of inertia in `[bodies]` and a table `[simulation]`. An `ideal` device has nothing.
//! Units: each key carries its own.
//! Invariants: a value of type [`DeviceFile`] has been checked: all numbers are finite and in
//! their range, limits are ordered, the home pose is within them, and the inverse kinematics is
//! unique. Unknown keys are refused. Files are not opened here.
//! Cost: start-up only.

use std::path::Path;

use nalgebra::UnitQuaternion;
use serde::Deserialize;
use thiserror::Error;
use toml::Spanned;

use crate::encoders::{EncoderSpec, JointMap};
use crate::heat::HeatSpec;
use crate::kinematics::gravity::Gravity;
use crate::kinematics::{Ideal, Kinematics};
use crate::motors::{MotorMap, MotorSpec};
use crate::sim::spec::SimulationSpec;
use crate::toml_report::{TomlReport, TomlText};

mod arm;
mod bodies;
mod gimbal;
mod ideal;
mod premium;
mod simulation;
mod wooden_haptics;
use arm::LinkageTable;
pub(crate) use arm::SLEW;

/// Names of the files that come with the program, see [`builtin`].
pub const BUILTIN_NAMES: [&str; 3] = ["premium-1.5", "wooden-haptics", "ideal"];

/// A checked device description.
#[derive(Debug, Clone, PartialEq)]
pub enum DeviceFile {
    /// Every kind that has joints, counters and motors.
    Arm(Box<ArmFile>),
    /// `kind = "ideal"`.
    Ideal(IdealFile),
}

/// An arm with three actuated joints.
#[derive(Debug, Clone, PartialEq)]
pub struct ArmFile {
    /// The word in the file, for programs.
    pub kind: &'static str,
    /// For people.
    pub name: String,
    /// Largest force on the user, for an instant.
    pub peak_force_n: f64,
    /// Largest force on the user, for ever.
    pub continuous_force_n: f64,
    /// Where the tip is meant to be.
    pub workspace: Workspace,
    /// Links and stops.
    pub mechanism: Kinematics,
    /// From raw counters to joint angles.
    pub encoders: EncoderSpec,
    /// From raw counters to the angles of an instrumented gimbal, if there is one.
    pub gimbal: Option<EncoderSpec>,
    /// How many buttons its handle has.
    pub buttons: u32,
    /// From joint torques to converter codes.
    pub motors: MotorSpec,
    /// What the motors stand.
    pub heat: HeatSpec,
    /// How fast a force may grow (N/s).
    pub slew_n_per_s: f64,
    /// The tip's speed that is a fault (m/s).
    pub speed_limit_m_per_s: f64,
    /// What holds the arm's own weight, if its bodies are described.
    pub gravity: Option<Gravity>,
    /// What a simulation needs beyond the above, if it is described.
    pub simulation: Option<SimulationSpec>,
}

/// A device without mechanism, counters and motors.
#[derive(Debug, Clone, PartialEq)]
pub struct IdealFile {
    /// For people.
    pub name: String,
    /// Largest force on the user, if there is to be one.
    pub peak_force_n: Option<f64>,
}

/// A box in the base frame D.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Workspace {
    /// Full edge lengths, metres.
    pub size_m: [f64; 3],
    /// Centre, metres.
    pub centre_m: [f64; 3],
}

/// Why a text is not a device description.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum DeviceFileError {
    /// Not TOML, a key missing or unknown, or a value of the wrong type.
    #[error(transparent)]
    Malformed(TomlReport),
    /// A kind of device this driver does not know.
    #[error(transparent)]
    UnknownKind(TomlReport),
    /// A value that no device has, or that contradicts another one.
    #[error(transparent)]
    Value(TomlReport),
}

/// The first look at a file; `kind` decides about everything else.
#[derive(Deserialize)]
struct Kind {
    kind: Spanned<String>,
}

impl DeviceFile {
    /// Reads and checks a description; `file` is only named in errors, never opened.
    ///
    /// # Errors
    /// [`DeviceFileError`] names file, line and key of the first mistake, what was found and what
    /// is allowed.
    pub fn parse(text: &str, file: &Path) -> Result<Self, DeviceFileError> {
        let toml = TomlText::new(text, file);
        let Kind { kind } = toml.read().map_err(DeviceFileError::Malformed)?;
        match kind.get_ref().as_str() {
            premium::Linkage::KIND => read_arm::<premium::Linkage>(&toml),
            wooden_haptics::Linkage::KIND => read_arm::<wooden_haptics::Linkage>(&toml),
            "ideal" => ideal::read(&toml).map(Self::Ideal),
            other => {
                let allowed = r#""premium", "wooden-haptics" or "ideal""#;
                let report = toml.refuse(kind.span(), format_args!("{other:?}"), allowed);
                Err(DeviceFileError::UnknownKind(report))
            }
        }
    }

    /// For people.
    pub fn name(&self) -> &str {
        match self {
            Self::Arm(arm) => &arm.name,
            Self::Ideal(ideal) => &ideal.name,
        }
    }

    /// Geometry of the device.
    pub fn kinematics(&self) -> Kinematics {
        match self {
            Self::Arm(arm) => arm.mechanism,
            Self::Ideal(_) => Kinematics::Ideal(Ideal),
        }
    }

    /// Largest force on the user, if the device has a limit.
    pub fn peak_force_n(&self) -> Option<f64> {
        match self {
            Self::Arm(arm) => Some(arm.peak_force_n),
            Self::Ideal(ideal) => ideal.peak_force_n,
        }
    }
}

fn read_arm<L: LinkageTable>(toml: &TomlText<'_>) -> Result<DeviceFile, DeviceFileError> {
    arm::read::<L>(toml).map(|arm| DeviceFile::Arm(Box::new(arm)))
}

impl ArmFile {
    /// From extended counts to joint angles, not yet zeroed.
    pub fn joint_map(&self) -> JointMap {
        JointMap::new(&self.encoders)
    }

    /// From joint torques to converter codes.
    pub fn motor_map(&self) -> MotorMap {
        MotorMap::new(&self.motors)
    }

    /// The same arm in a base that stands in the world like this (R_WD): its weight pulls along the world's -y. A
    /// description by itself is of an arm that stands upright.
    #[must_use]
    pub fn in_base(self, base_in_world: &UnitQuaternion<f64>) -> Self {
        let lean =
            |spec: SimulationSpec| SimulationSpec { dynamics: spec.dynamics.in_base(base_in_world), ..spec };
        Self {
            gravity: self.gravity.map(|gravity| gravity.in_base(base_in_world)),
            simulation: self.simulation.map(lean),
            ..self
        }
    }
}

impl Workspace {
    /// Whether a position of the tip in the base frame lies inside.
    pub fn contains(&self, tip_m: [f64; 3]) -> bool {
        (0..3).all(|i| (tip_m[i] - self.centre_m[i]).abs() <= 0.5 * self.size_m[i])
    }
}

/// The zeroing pose of a kind of device in words, unless its description's `home_joint_angles_rad` say otherwise.
pub fn home_pose(kind: &str) -> &'static str {
    match kind {
        "premium" => {
            "turret straight ahead, upper arm level, forearm hanging straight down, a gimbal straight \
             (where `home_joint_angles_rad` of its description are zero)"
        }
        "wooden-haptics" => {
            "turret straight ahead, upper arm upright, forearm level towards you \
             (where `home_joint_angles_rad` of its description are 0, 0, pi/2)"
        }
        _ => "the pose of `home_joint_angles_rad` in its description",
    }
}

/// Text of a description that comes with the program, so that an installed one finds it.
pub fn builtin(name: &str) -> Option<&'static str> {
    match name {
        "premium-1.5" => Some(include_str!("../../config/driver/devices/premium-1.5.toml")),
        "wooden-haptics" => Some(include_str!("../../config/driver/devices/wooden-haptics.toml")),
        "ideal" => Some(include_str!("../../config/driver/devices/ideal.toml")),
        _ => None,
    }
}

#[cfg(test)]
mod tests;
