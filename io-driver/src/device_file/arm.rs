//! The file of an arm: what every kind with joints, counters and motors has in common.
//!
//! Model: serde reads the tables below, each function turns one of them into values. A kind brings its own
//! table `[linkage]`. Ranges are wide enough for any desktop device; they catch millimetres for metres and
//! degrees for radians.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use serde::Deserialize;
use serde::de::DeserializeOwned;
use toml::Spanned;

use super::bodies::{self, RawBodies};
use super::gimbal::{self, RawGimbal};
use super::simulation::{self, RawSimulation};
use super::{ArmFile, DeviceFileError, Workspace};
use crate::encoders::EncoderSpec;
use crate::heat::HeatSpec;
use crate::kinematics::{Interval, JointConvention, JointLimits, Kinematics, Mechanism};
use crate::motors::MotorSpec;
use crate::toml_report::{Allowed, SpannedList, TomlReport, TomlText};

type Whole = Spanned<i64>;
type WholeList = Spanned<Vec<Whole>>;

/// The table `[linkage]` of a kind of arm.
pub(super) trait LinkageTable: DeserializeOwned {
    /// The kind's word in the file.
    const KIND: &'static str;
    /// How the kind names its joints.
    const CONVENTION: JointConvention;

    /// What all kinds have in common.
    fn joints(&self) -> JointTable<'_>;

    /// The arm, and its upper arm and forearm (m).
    fn mechanism(&self, toml: &TomlText<'_>) -> Result<(Kinematics, [f64; 2]), TomlReport>;
}

/// Keys of every table `[linkage]`.
pub(super) struct JointTable<'a> {
    pub(super) cable_reduction: &'a SpannedList,
    pub(super) home_joint_angles_rad: &'a SpannedList,
    pub(super) joint_limits_rad: &'a Spanned<Vec<SpannedList>>,
    pub(super) elbow_limits_rad: &'a SpannedList,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Raw<L> {
    #[serde(rename = "kind")]
    _kind: String,
    name: String,
    peak_force_n: Spanned<f64>,
    continuous_force_n: Spanned<f64>,
    slew_n_per_s: Spanned<f64>,
    speed_limit_m_per_s: Spanned<f64>,
    workspace_m: SpannedList,
    workspace_centre_m: SpannedList,
    linkage: L,
    encoders: Encoders,
    motors: Motors,
    bodies: Option<Spanned<RawBodies>>,
    simulation: Option<Spanned<RawSimulation>>,
    gimbal: Option<RawGimbal>,
    buttons: Option<Whole>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Encoders {
    counts_per_rev: Whole,
    count_bits: Whole,
    sign: WholeList,
    channel: WholeList,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Motors {
    torque_constant_nm_per_a: Spanned<f64>,
    peak_current_a: Spanned<f64>,
    continuous_current_a: Spanned<f64>,
    winding_time_constant_s: Spanned<f64>,
    housing_time_constant_s: Spanned<f64>,
    winding_share: Spanned<f64>,
    dac_bits: Whole,
    sign: WholeList,
    channel: WholeList,
}

/// The description of an arm whose table `[linkage]` is an `L`.
pub(super) fn read<L: LinkageTable>(toml: &TomlText<'_>) -> Result<ArmFile, DeviceFileError> {
    let raw: Raw<L> = toml.read().map_err(DeviceFileError::Malformed)?;
    check(toml, raw).map_err(DeviceFileError::Value)
}

fn check<L: LinkageTable>(toml: &TomlText<'_>, raw: Raw<L>) -> Result<ArmFile, TomlReport> {
    let peak_force_n = toml.number(&raw.peak_force_n, FORCE)?;
    let continuous_force_n = up_to(toml, &raw.continuous_force_n, FORCE, "peak_force_n", peak_force_n)?;
    let (mechanism, links_m) = raw.linkage.mechanism(toml)?;
    let joints = raw.linkage.joints();
    let reduction = toml.numbers(joints.cable_reduction, REDUCTION)?;
    let home = home(toml, joints.home_joint_angles_rad, &mechanism)?;
    let encoders = encoders(toml, &raw.encoders, reduction, home)?;
    let weights = bodies::check(toml, raw.bodies.as_ref(), links_m, L::CONVENTION)?;
    let dynamics = weights.and_then(|weights| weights.dynamics);
    let simulation = |table| simulation::check(toml, table, dynamics, &encoders);
    Ok(ArmFile {
        kind: L::KIND,
        name: raw.name,
        peak_force_n,
        continuous_force_n,
        workspace: workspace(toml, &raw.workspace_m, &raw.workspace_centre_m, &mechanism, home)?,
        mechanism,
        gimbal: raw.gimbal.as_ref().map(|table| gimbal::check(toml, table, &encoders)).transpose()?,
        buttons: gimbal::buttons(toml, raw.buttons.as_ref())?,
        motors: motors(toml, &raw.motors, reduction)?,
        heat: heat(toml, &raw.motors)?,
        slew_n_per_s: toml.number(&raw.slew_n_per_s, SLEW)?,
        speed_limit_m_per_s: toml.number(&raw.speed_limit_m_per_s, SPEED)?,
        gravity: weights.map(|weights| weights.gravity),
        simulation: raw.simulation.as_ref().map(simulation).transpose()?,
        encoders,
    })
}

/// The closed workspace has to hold the pose in which the device is switched on.
fn workspace(
    toml: &TomlText<'_>,
    size: &SpannedList,
    centre: &SpannedList,
    mechanism: &Kinematics,
    home: [f64; 3],
) -> Result<Workspace, TomlReport> {
    let workspace =
        Workspace { size_m: toml.numbers(size, LENGTH)?, centre_m: toml.numbers(centre, POSITION)? };
    let tip: [f64; 3] = mechanism.forward(home).into();
    if workspace.contains(tip) {
        return Ok(workspace);
    }
    let found = format_args!("a workspace without the tip's home position {tip:?} m").to_string();
    Err(toml.refuse(centre.span(), found, "a box that holds it"))
}

/// The stops; `elbow` is what the elbow's angle may be, `elbow_sign` how the upper arm counts in it.
pub(super) fn joint_limits(
    toml: &TomlText<'_>,
    raw: &JointTable<'_>,
    elbow_sign: f64,
    elbow: Allowed,
) -> Result<JointLimits, TomlReport> {
    let [turret, upper_arm, forearm]: &[SpannedList; 3] = toml.exactly(raw.joint_limits_rad)?;
    let joints = [
        interval(toml, turret, QUARTER_TURNS)?,
        interval(toml, upper_arm, ANGLE)?,
        interval(toml, forearm, ANGLE)?,
    ];
    let elbow = interval(toml, raw.elbow_limits_rad, elbow)?;
    Ok(JointLimits { joints, elbow, elbow_sign })
}

fn home(toml: &TomlText<'_>, angles: &SpannedList, mechanism: &Kinematics) -> Result<[f64; 3], TomlReport> {
    let home = toml.numbers(angles, ANGLE)?;
    let limits = mechanism.joint_limits();
    if limits.contains(home) {
        return Ok(home);
    }
    let elbow = if limits.elbow_sign < 0.0 { "third minus their second" } else { "third plus their second" };
    let allowed =
        format_args!("angles within `joint_limits_rad`, their {elbow} within `elbow_limits_rad`").to_string();
    Err(toml.refuse(angles.span(), format_args!("{home:?}"), allowed))
}

fn encoders(
    toml: &TomlText<'_>,
    raw: &Encoders,
    reduction: [f64; 3],
    home_joint_angles_rad: [f64; 3],
) -> Result<EncoderSpec, TomlReport> {
    Ok(EncoderSpec {
        channel: channels(toml, &raw.channel, &[])?,
        counts_per_rev: toml.integer(&raw.counts_per_rev, 4..=10_000_000)? as u32,
        count_bits: toml.integer(&raw.count_bits, 8..=32)? as u32,
        sign: signs(toml, &raw.sign)?,
        reduction,
        home_joint_angles_rad,
    })
}

fn motors(toml: &TomlText<'_>, raw: &Motors, reduction: [f64; 3]) -> Result<MotorSpec, TomlReport> {
    Ok(MotorSpec {
        channel: channels(toml, &raw.channel, &[])?,
        sign: signs(toml, &raw.sign)?,
        reduction,
        torque_constant_nm_per_a: toml.number(&raw.torque_constant_nm_per_a, TORQUE_CONSTANT)?,
        peak_current_a: toml.number(&raw.peak_current_a, CURRENT)?,
        dac_bits: toml.integer(&raw.dac_bits, 8..=16)? as u32,
    })
}

fn heat(toml: &TomlText<'_>, raw: &Motors) -> Result<HeatSpec, TomlReport> {
    let peak_a = toml.number(&raw.peak_current_a, CURRENT)?;
    let continuous_a = up_to(toml, &raw.continuous_current_a, CURRENT, "peak_current_a", peak_a)?;
    Ok(HeatSpec {
        continuous_current_a: continuous_a,
        winding_time_constant_s: toml.number(&raw.winding_time_constant_s, TIME_CONSTANT)?,
        housing_time_constant_s: toml.number(&raw.housing_time_constant_s, TIME_CONSTANT)?,
        winding_share: toml.number(&raw.winding_share, SHARE)?,
    })
}

/// A number that another key of the same unit limits.
fn up_to(
    toml: &TomlText<'_>,
    number: &Spanned<f64>,
    allowed: Allowed,
    limit_key: &str,
    limit: f64,
) -> Result<f64, TomlReport> {
    let value = toml.number(number, allowed)?;
    if value <= limit {
        return Ok(value);
    }
    let allowed = format_args!("at most `{limit_key}`, {limit} {}", allowed.unit).to_string();
    Err(toml.refuse(number.span(), value, allowed))
}

/// `[min, max]` with `min < max`.
fn interval(toml: &TomlText<'_>, list: &SpannedList, allowed: Allowed) -> Result<Interval, TomlReport> {
    let [min, max] = toml.numbers(list, allowed)?;
    if min < max {
        return Ok(Interval { min, max });
    }
    Err(toml.refuse(list.span(), format_args!("[{min}, {max}]"), "the smaller angle first"))
}

/// +1 or -1 for each joint.
pub(super) fn signs(toml: &TomlText<'_>, list: &WholeList) -> Result<[i8; 3], TomlReport> {
    let items: &[Whole; 3] = toml.exactly(list)?;
    let mut signs = [0; 3];
    for (sign, item) in signs.iter_mut().zip(items) {
        *sign = match *item.get_ref() {
            1 => 1,
            -1 => -1,
            other => return Err(toml.refuse(item.span(), other, "1 or -1")),
        };
    }
    Ok(signs)
}

/// Three different channels beside those that are taken: one motor answering for two joints would be a runaway.
pub(super) fn channels(toml: &TomlText<'_>, list: &WholeList, taken: &[u8]) -> Result<[u8; 3], TomlReport> {
    let items: &[Whole; 3] = toml.exactly(list)?;
    let mut channels = [0; 3];
    for (index, item) in items.iter().enumerate() {
        let channel = toml.integer(item, 0..=MAX_CHANNEL)? as u8;
        let found = match channel {
            _ if taken.contains(&channel) => format!("{channel}, which another encoder has"),
            _ if channels[..index].contains(&channel) => format!("{channel} twice"),
            _ => {
                channels[index] = channel;
                continue;
            }
        };
        return Err(toml.refuse(item.span(), found, "a channel of its own for each joint"));
    }
    Ok(channels)
}

/// A card has eight registers each way.
const MAX_CHANNEL: i64 = 7;

const FORCE: Allowed = Allowed { min: 1e-3, max: 100.0, unit: "N" };
pub(super) const LENGTH: Allowed = Allowed { min: 0.01, max: 2.0, unit: "m" };
pub(super) const POSITION: Allowed = Allowed { min: -2.0, max: 2.0, unit: "m" };
const REDUCTION: Allowed = Allowed { min: 0.1, max: 1000.0, unit: "motor turns per joint turn" };
const ANGLE: Allowed = Allowed { min: -TAU, max: TAU, unit: "rad" };
const CURRENT: Allowed = Allowed { min: 1e-3, max: 100.0, unit: "A" };
const TORQUE_CONSTANT: Allowed = Allowed { min: 1e-4, max: 10.0, unit: "N m/A" };
/// At 1 kHz 10 N a tick: a Premium's 8.5 N reverse in two ticks at the fastest.
pub(crate) const SLEW: Allowed = Allowed { min: 10.0, max: 1e4, unit: "N/s" };
const SPEED: Allowed = Allowed { min: 0.01, max: 20.0, unit: "m/s" };
const SHARE: Allowed = Allowed { min: 0.0, max: 1.0, unit: "of the thermal resistance" };
const TIME_CONSTANT: Allowed = Allowed { min: 0.1, max: 10_000.0, unit: "s" };

/// Beyond a quarter turn of turret or elbow a position of the tip has two poses, and the inverse
/// could pick the wrong one.
pub(super) const QUARTER_TURNS: Allowed = Allowed {
    min: -FRAC_PI_2,
    max: FRAC_PI_2,
    unit: "rad (a quarter turn each way, beyond which two poses share a position)",
};

/// The same of an elbow whose angle is zero where it is folded.
pub(super) const FROM_FOLDED: Allowed = Allowed {
    min: 0.0,
    max: PI,
    unit: "rad (from folded to stretched, beyond which two poses share a position)",
};
