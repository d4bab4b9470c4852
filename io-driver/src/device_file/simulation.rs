//! The table `[simulation]`: what a simulated arm needs beyond what a driver does.
//!
//! Invariant: springs and dampers are so soft against the inertias that they act on that steps of [`STEP_S`](crate::sim::arm::STEP_S) follow
//! them; nothing has no inertia. Numbers that are each allowed by themselves would else make a motion without end.

mod swiftness;

use serde::Deserialize;
use toml::Spanned;

use crate::encoders::EncoderSpec;
use crate::sim::dynamics::Dynamics;
use crate::sim::spec::{CableSpec, MotorPlantSpec, NoiseSpec, SimulationSpec};
use crate::toml_report::{Allowed, SpannedList, TomlReport, TomlText};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawSimulation {
    coulomb_friction_nm: SpannedList,
    viscous_friction_nm_s: SpannedList,
    stop_stiffness_nm_per_rad: Spanned<f64>,
    stop_damping_nm_s: Spanned<f64>,
    motor: Motor,
    cable: Option<Cable>,
    noise: Option<Noise>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Motor {
    rotor_inertia_kg_m2: Spanned<f64>,
    resistance_ohm: Spanned<f64>,
    inductance_h: Spanned<f64>,
    supply_v: Spanned<f64>,
    amplifier_bandwidth_hz: Spanned<f64>,
    resistance_per_k: Spanned<f64>,
    rated_rise_k: Spanned<f64>,
    watchdog_s: Spanned<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Cable {
    stiffness_nm_per_rad: SpannedList,
    damping_nm_s: SpannedList,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Noise {
    encoder_counts_rms: Spanned<f64>,
    current_a_rms: Spanned<f64>,
}

/// Nothing can be simulated that has no inertia, so `dynamics` has to be there. `encoders` have the arm's reductions and
/// the pose in which its inertia is looked at.
pub(super) fn check(
    toml: &TomlText<'_>,
    table: &Spanned<RawSimulation>,
    dynamics: Option<Dynamics>,
    encoders: &EncoderSpec,
) -> Result<SimulationSpec, TomlReport> {
    let Some(dynamics) = dynamics else {
        let allowed = "only together with a table [bodies] that gives `inertia_a_kg_m2` and its four \
                       fellows, as in the built-in premium-1.5";
        return Err(toml.refuse(
            table.span(),
            "a table [simulation] of an arm without moments of inertia",
            allowed,
        ));
    };
    let raw = table.get_ref();
    let spec = read(toml, raw, dynamics)?;
    swiftness::check(toml, table, &spec, encoders)?;
    Ok(spec)
}

fn read(toml: &TomlText<'_>, raw: &RawSimulation, dynamics: Dynamics) -> Result<SimulationSpec, TomlReport> {
    Ok(SimulationSpec {
        dynamics,
        coulomb_nm: toml.numbers(&raw.coulomb_friction_nm, COULOMB)?,
        viscous_nm_s: toml.numbers(&raw.viscous_friction_nm_s, DAMPING)?,
        stop_stiffness_nm_per_rad: toml.number(&raw.stop_stiffness_nm_per_rad, STIFFNESS)?,
        stop_damping_nm_s: toml.number(&raw.stop_damping_nm_s, DAMPING)?,
        motor: motor(toml, &raw.motor)?,
        cable: raw.cable.as_ref().map(|table| cable(toml, table)).transpose()?,
        noise: raw.noise.as_ref().map(|table| noise(toml, table)).transpose()?.unwrap_or_default(),
    })
}

fn motor(toml: &TomlText<'_>, raw: &Motor) -> Result<MotorPlantSpec, TomlReport> {
    Ok(MotorPlantSpec {
        rotor_inertia_kg_m2: toml.number(&raw.rotor_inertia_kg_m2, ROTOR)?,
        resistance_ohm: toml.number(&raw.resistance_ohm, RESISTANCE)?,
        inductance_h: toml.number(&raw.inductance_h, INDUCTANCE)?,
        supply_v: toml.number(&raw.supply_v, SUPPLY)?,
        amplifier_bandwidth_hz: toml.number(&raw.amplifier_bandwidth_hz, BANDWIDTH)?,
        resistance_per_k: toml.number(&raw.resistance_per_k, PER_KELVIN)?,
        rated_rise_k: toml.number(&raw.rated_rise_k, RISE)?,
        watchdog_s: toml.number(&raw.watchdog_s, WATCHDOG)?,
    })
}

fn cable(toml: &TomlText<'_>, raw: &Cable) -> Result<CableSpec, TomlReport> {
    Ok(CableSpec {
        stiffness_nm_per_rad: toml.numbers(&raw.stiffness_nm_per_rad, STIFFNESS)?,
        damping_nm_s: toml.numbers(&raw.damping_nm_s, DAMPING)?,
    })
}

fn noise(toml: &TomlText<'_>, raw: &Noise) -> Result<NoiseSpec, TomlReport> {
    Ok(NoiseSpec {
        encoder_counts_rms: toml.number(&raw.encoder_counts_rms, COUNTS)?,
        current_a_rms: toml.number(&raw.current_a_rms, NOISE_CURRENT)?,
    })
}

const COULOMB: Allowed = Allowed { min: 0.0, max: 10.0, unit: "N m" };
const DAMPING: Allowed = Allowed { min: 0.0, max: 100.0, unit: "N m s/rad" };
/// Softer ones are none; stiffer ones ring faster than any step of a simulation.
const STIFFNESS: Allowed = Allowed { min: 0.1, max: 1e5, unit: "N m/rad" };
/// Catches g cm^2.
const ROTOR: Allowed = Allowed { min: 0.0, max: 1e-2, unit: "kg m^2" };
const RESISTANCE: Allowed = Allowed { min: 1e-3, max: 1000.0, unit: "ohm" };
/// Catches millihenries.
const INDUCTANCE: Allowed = Allowed { min: 0.0, max: 0.1, unit: "H" };
const SUPPLY: Allowed = Allowed { min: 0.1, max: 500.0, unit: "V" };
const BANDWIDTH: Allowed = Allowed { min: 1.0, max: 1e6, unit: "Hz" };
const PER_KELVIN: Allowed = Allowed { min: 0.0, max: 0.02, unit: "1/K" };
const RISE: Allowed = Allowed { min: 0.0, max: 300.0, unit: "K" };
/// Catches milliseconds.
const WATCHDOG: Allowed = Allowed { min: 1e-4, max: 10.0, unit: "s" };
const COUNTS: Allowed = Allowed { min: 0.0, max: 100.0, unit: "counts" };
const NOISE_CURRENT: Allowed = Allowed { min: 0.0, max: 1.0, unit: "A" };
