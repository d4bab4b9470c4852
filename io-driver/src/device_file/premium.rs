//! The file of a PHANToM Premium: names of the keys, and what their values may be.
//!
//! Model: serde reads the tables below, each `check` turns one of them into values. Ranges are
//! wide enough for any desktop device; they catch millimetres for metres and degrees for radians.

use std::f64::consts::{FRAC_PI_2, TAU};

use serde::Deserialize;
use toml::Spanned;

use super::{ArmFile, DeviceFileError, Workspace, gimbal};
use crate::encoders::EncoderSpec;
use crate::heat::HeatSpec;
use crate::kinematics::gravity::{Bodies, Gravity};
use crate::kinematics::{Interval, JointLimits, Kinematics, Mechanism, Premium};
use crate::motors::MotorSpec;
use crate::toml_report::{Allowed, SpannedList, TomlReport, TomlText};

type Whole = Spanned<i64>;
type WholeList = Spanned<Vec<Whole>>;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Raw {
    #[serde(rename = "kind")]
    _kind: String,
    name: String,
    peak_force_n: Spanned<f64>,
    continuous_force_n: Spanned<f64>,
    slew_n_per_s: Spanned<f64>,
    speed_limit_m_per_s: Spanned<f64>,
    workspace_m: SpannedList,
    workspace_centre_m: SpannedList,
    linkage: Linkage,
    encoders: Encoders,
    motors: Motors,
    bodies: Option<RawBodies>,
    gimbal: Option<gimbal::RawGimbal>,
    buttons: Option<Whole>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Linkage {
    link_lengths_m: SpannedList,
    cable_reduction: SpannedList,
    home_joint_angles_rad: SpannedList,
    joint_limits_rad: Spanned<Vec<SpannedList>>,
    elbow_limits_rad: SpannedList,
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

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawBodies {
    mass_a_kg: Spanned<f64>,
    mass_c_kg: Spanned<f64>,
    mass_be_kg: Spanned<f64>,
    mass_df_kg: Spanned<f64>,
    l3_m: Spanned<f64>,
    l5_m: Spanned<f64>,
    l6_m: Spanned<f64>,
}

pub(super) fn read(toml: &TomlText<'_>) -> Result<ArmFile, DeviceFileError> {
    let raw: Raw = toml.read().map_err(DeviceFileError::Malformed)?;
    check(toml, raw).map_err(DeviceFileError::Value)
}

fn check(toml: &TomlText<'_>, raw: Raw) -> Result<ArmFile, TomlReport> {
    let peak_force_n = toml.number(&raw.peak_force_n, FORCE)?;
    let continuous_force_n = up_to(toml, &raw.continuous_force_n, FORCE, "peak_force_n", peak_force_n)?;
    let mechanism = linkage(toml, &raw.linkage)?;
    let reduction = toml.numbers(&raw.linkage.cable_reduction, REDUCTION)?;
    let home = home(toml, &raw.linkage, &mechanism)?;
    let encoders = encoders(toml, &raw.encoders, reduction, home)?;
    Ok(ArmFile {
        kind: "premium",
        name: raw.name,
        peak_force_n,
        continuous_force_n,
        workspace: workspace(toml, &raw.workspace_m, &raw.workspace_centre_m, &mechanism, home)?,
        mechanism: Kinematics::Premium(mechanism),
        gimbal: raw.gimbal.as_ref().map(|raw| gimbal::check(toml, raw, &encoders)).transpose()?,
        buttons: gimbal::buttons(toml, raw.buttons.as_ref())?,
        encoders,
        motors: motors(toml, &raw.motors, reduction)?,
        heat: heat(toml, &raw.motors)?,
        slew_n_per_s: toml.number(&raw.slew_n_per_s, SLEW)?,
        speed_limit_m_per_s: toml.number(&raw.speed_limit_m_per_s, SPEED)?,
        gravity: match &raw.bodies {
            Some(bodies) => Some(Gravity::new(mechanism.link_lengths_m(), &weigh(toml, bodies)?)),
            None => None,
        },
    })
}

/// The closed workspace has to hold the pose in which the device is switched on.
fn workspace(
    toml: &TomlText<'_>,
    size: &SpannedList,
    centre: &SpannedList,
    mechanism: &Premium,
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

fn linkage(toml: &TomlText<'_>, raw: &Linkage) -> Result<Premium, TomlReport> {
    let [turret, upper_arm, forearm]: &[SpannedList; 3] = toml.exactly(&raw.joint_limits_rad)?;
    let joints = [
        interval(toml, turret, QUARTER_TURNS)?,
        interval(toml, upper_arm, ANGLE)?,
        interval(toml, forearm, ANGLE)?,
    ];
    let elbow = interval(toml, &raw.elbow_limits_rad, QUARTER_TURNS)?;
    let link_lengths_m = toml.numbers(&raw.link_lengths_m, LENGTH)?;
    Ok(Premium::new(link_lengths_m, JointLimits { joints, elbow }))
}

fn home(toml: &TomlText<'_>, raw: &Linkage, mechanism: &Premium) -> Result<[f64; 3], TomlReport> {
    let home = toml.numbers(&raw.home_joint_angles_rad, ANGLE)?;
    if mechanism.joint_limits().contains(home) {
        return Ok(home);
    }
    let allowed =
        "angles within `joint_limits_rad`, their third minus their second within `elbow_limits_rad`";
    Err(toml.refuse(raw.home_joint_angles_rad.span(), format_args!("{home:?}"), allowed))
}

fn encoders(
    toml: &TomlText<'_>,
    raw: &Encoders,
    reduction: [f64; 3],
    home_joint_angles_rad: [f64; 3],
) -> Result<EncoderSpec, TomlReport> {
    Ok(EncoderSpec {
        channel: channels(toml, &raw.channel)?,
        counts_per_rev: toml.integer(&raw.counts_per_rev, 4..=10_000_000)? as u32,
        count_bits: toml.integer(&raw.count_bits, 8..=32)? as u32,
        sign: signs(toml, &raw.sign)?,
        reduction,
        home_joint_angles_rad,
    })
}

fn motors(toml: &TomlText<'_>, raw: &Motors, reduction: [f64; 3]) -> Result<MotorSpec, TomlReport> {
    Ok(MotorSpec {
        channel: channels(toml, &raw.channel)?,
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

fn weigh(toml: &TomlText<'_>, raw: &RawBodies) -> Result<Bodies, TomlReport> {
    Ok(Bodies {
        mass_a_kg: toml.number(&raw.mass_a_kg, MASS)?,
        mass_c_kg: toml.number(&raw.mass_c_kg, MASS)?,
        mass_be_kg: toml.number(&raw.mass_be_kg, MASS)?,
        mass_df_kg: toml.number(&raw.mass_df_kg, MASS)?,
        l3_m: toml.number(&raw.l3_m, LEVER)?,
        l5_m: toml.number(&raw.l5_m, LEVER)?,
        l6_m: toml.number(&raw.l6_m, LEVER)?,
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

fn signs(toml: &TomlText<'_>, list: &WholeList) -> Result<[i8; 3], TomlReport> {
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

/// Three different channels: one motor answering for two joints would be a runaway.
fn channels(toml: &TomlText<'_>, list: &WholeList) -> Result<[u8; 3], TomlReport> {
    let items: &[Whole; 3] = toml.exactly(list)?;
    let mut channels = [0; 3];
    for (index, item) in items.iter().enumerate() {
        let channel = toml.integer(item, 0..=MAX_CHANNEL)? as u8;
        if channels[..index].contains(&channel) {
            let found = format_args!("{channel} twice").to_string();
            return Err(toml.refuse(item.span(), found, "a channel of its own for each joint"));
        }
        channels[index] = channel;
    }
    Ok(channels)
}

/// A card has eight registers each way.
const MAX_CHANNEL: i64 = 7;

const FORCE: Allowed = Allowed { min: 1e-3, max: 100.0, unit: "N" };
const LENGTH: Allowed = Allowed { min: 0.01, max: 2.0, unit: "m" };
const POSITION: Allowed = Allowed { min: -2.0, max: 2.0, unit: "m" };
const REDUCTION: Allowed = Allowed { min: 0.1, max: 1000.0, unit: "motor turns per joint turn" };
const ANGLE: Allowed = Allowed { min: -TAU, max: TAU, unit: "rad" };
const CURRENT: Allowed = Allowed { min: 1e-3, max: 100.0, unit: "A" };
const TORQUE_CONSTANT: Allowed = Allowed { min: 1e-4, max: 10.0, unit: "N m/A" };
const SLEW: Allowed = Allowed { min: 10.0, max: 1e6, unit: "N/s" };
const SPEED: Allowed = Allowed { min: 0.01, max: 20.0, unit: "m/s" };
const SHARE: Allowed = Allowed { min: 0.0, max: 1.0, unit: "of the thermal resistance" };
const MASS: Allowed = Allowed { min: 0.0, max: 10.0, unit: "kg" };
const LEVER: Allowed = Allowed { min: -1.0, max: 1.0, unit: "m" };
const TIME_CONSTANT: Allowed = Allowed { min: 0.1, max: 10_000.0, unit: "s" };

/// Beyond a quarter turn of turret or elbow a position of the tip has two poses, and the inverse
/// could pick the wrong one.
const QUARTER_TURNS: Allowed = Allowed {
    min: -FRAC_PI_2,
    max: FRAC_PI_2,
    unit: "rad (a quarter turn each way, beyond which two poses share a position)",
};
