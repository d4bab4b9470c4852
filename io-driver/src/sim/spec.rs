//! What a simulation has to know of an arm beyond what a driver does.
//!
//! Model: the table `[simulation]` of a device description, checked; what each number is for and where it comes from
//! stands there.
//! Units: joint coordinates of the mechanism, SI, radians.
//! Invariants: all numbers are finite and none is negative.

use crate::sim::dynamics::Dynamics;

/// The simulated side of an arm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SimulationSpec {
    /// Links and bodies; the rotors of the motors are not in it.
    pub dynamics: Dynamics,
    /// Dry friction of each joint (N m), motor and cable included.
    pub coulomb_nm: [f64; 3],
    /// Viscous friction of each joint (N m s/rad), motor and cable included.
    pub viscous_nm_s: [f64; 3],
    /// Stiffness of the stops, and of the elbow's (N m/rad).
    pub stop_stiffness_nm_per_rad: f64,
    /// Damping in the stops, and in the elbow's (N m s/rad).
    pub stop_damping_nm_s: f64,
    /// Motors and amplifiers.
    pub motor: MotorPlantSpec,
    /// What lies between motor and joint; rigid if absent.
    pub cable: Option<CableSpec>,
    /// What sensors and amplifiers add of their own.
    pub noise: NoiseSpec,
}

/// A motor with its amplifier; all three are alike.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotorPlantSpec {
    /// Of the rotor about its own shaft (kg m^2); the joint feels it times the square of the reduction.
    pub rotor_inertia_kg_m2: f64,
    /// Of the winding at room temperature (ohm).
    pub resistance_ohm: f64,
    /// Of the winding (H).
    pub inductance_h: f64,
    /// What the amplifier can put across the winding, either way (V).
    pub supply_v: f64,
    /// Bandwidth of the amplifier's current loop (Hz).
    pub amplifier_bandwidth_hz: f64,
    /// Growth of the resistance per kelvin, as a part of it (1/K).
    pub resistance_per_k: f64,
    /// How much warmer than the room the winding is under the continuous current (K).
    pub rated_rise_k: f64,
    /// After this time without a write the amplifier switches itself off (s).
    pub watchdog_s: f64,
}

/// Compliance of the cables, seen at the joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CableSpec {
    /// Of each joint's cable (N m/rad).
    pub stiffness_nm_per_rad: [f64; 3],
    /// Of each joint's cable (N m s/rad).
    pub damping_nm_s: [f64; 3],
}

/// Random errors, independent from tick to tick, as standard deviations.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct NoiseSpec {
    /// Before a position is rounded to counts (counts).
    pub encoder_counts_rms: f64,
    /// Of the current that the amplifier makes (A).
    pub current_a_rms: f64,
}
