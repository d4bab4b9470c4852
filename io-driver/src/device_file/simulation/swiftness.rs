//! Whether the steps of a simulation can follow what a description says.
//!
//! Model: on a body of inertia `m` a spring `k` needs steps `h` with `h^2 k / m < 4`, a damper `b` such with
//! `h b / m < 2`; beyond, the motion grows without end. A sixteenth and a quarter of that are allowed, which leaves room
//! for what acts together and for poses with less inertia than the one of zeroing, in which it is looked at.
//! Cost: start-up only.

use std::ops::Range;

use nalgebra::{Matrix3, Vector3};
use toml::Spanned;

use super::RawSimulation;
use crate::encoders::EncoderSpec;
use crate::sim::arm::STEP_S;
use crate::sim::spec::SimulationSpec;
use crate::toml_report::{TomlReport, TomlText};

/// How much of what a step could bear.
const SPRING_SHARE: f64 = 0.25;
const DAMPER_SHARE: f64 = 0.5;

/// Refuses what steps of [`STEP_S`] could not follow.
pub(super) fn check(
    toml: &TomlText<'_>,
    table: &Spanned<RawSimulation>,
    spec: &SimulationSpec,
    encoders: &EncoderSpec,
) -> Result<(), TomlReport> {
    let raw = table.get_ref();
    let rotors = Vector3::from(encoders.reduction).map(|n| n * n * spec.motor.rotor_inertia_kg_m2);
    let links = spec.dynamics.mass_matrix(encoders.home_joint_angles_rad);
    let of_links = if spec.cable.is_some() { links } else { links + Matrix3::from_diagonal(&rotors) };
    let Some(lightness) = lightness(&of_links) else {
        let allowed =
            "moments of inertia, and masses with levers, in [bodies] that leave none of its joints without";
        return Err(toml.refuse(table.span(), "an arm that has no inertia in its zeroing pose", allowed));
    };
    let stops = Bearing { toml, lightness: lightness.max() };
    stops.spring(raw.stop_stiffness_nm_per_rad.span(), spec.stop_stiffness_nm_per_rad)?;
    stops.damper(raw.stop_damping_nm_s.span(), spec.stop_damping_nm_s)?;
    let Some((cable, raw_cable)) = spec.cable.zip(raw.cable.as_ref()) else {
        return each(raw.viscous_friction_nm_s.get_ref(), |joint, span| {
            Bearing { toml, lightness: lightness[joint] }.damper(span, spec.viscous_nm_s[joint])
        });
    };
    if spec.motor.rotor_inertia_kg_m2 == 0.0 {
        let allowed = "more than 0 kg m^2 in an arm with a table [simulation.cable]";
        return Err(toml.refuse(raw.motor.rotor_inertia_kg_m2.span(), 0, allowed));
    }
    // A cable pulls at both of its ends.
    let ends = |joint: usize| Bearing { toml, lightness: lightness[joint] + 1.0 / rotors[joint] };
    each(raw.viscous_friction_nm_s.get_ref(), |joint, span| {
        ends(joint).damper(span, spec.viscous_nm_s[joint])
    })?;
    each(raw_cable.stiffness_nm_per_rad.get_ref(), |joint, span| {
        ends(joint).spring(span, cable.stiffness_nm_per_rad[joint])
    })?;
    each(raw_cable.damping_nm_s.get_ref(), |joint, span| ends(joint).damper(span, cable.damping_nm_s[joint]))
}

/// The inverse of the inertia that a torque on each joint meets, and the elbow's stop in the last two (1/(kg m^2)), at
/// most; `None`: there is none.
fn lightness(mass: &Matrix3<f64>) -> Option<Vector3<f64>> {
    let inverse = mass.try_inverse()?;
    let of_joints = inverse.diagonal();
    let of_elbow = inverse[(1, 1)] + inverse[(2, 2)] + 2.0 * inverse[(1, 2)].abs();
    let all = Vector3::new(of_joints[0], of_elbow, of_elbow);
    (of_joints.min() > 0.0 && all.max().is_finite()).then_some(all)
}

fn each(
    list: &[Spanned<f64>],
    check: impl Fn(usize, Range<usize>) -> Result<(), TomlReport>,
) -> Result<(), TomlReport> {
    list.iter().enumerate().try_for_each(|(joint, item)| check(joint, item.span()))
}

/// What a body of so little inertia bears.
struct Bearing<'a, 'text> {
    toml: &'a TomlText<'text>,
    lightness: f64,
}

impl Bearing<'_, '_> {
    fn spring(&self, span: Range<usize>, stiffness: f64) -> Result<(), TomlReport> {
        self.at_most(span, stiffness, SPRING_SHARE / (STEP_S * STEP_S * self.lightness), "N m/rad")
    }

    fn damper(&self, span: Range<usize>, damping: f64) -> Result<(), TomlReport> {
        self.at_most(span, damping, DAMPER_SHARE / (STEP_S * self.lightness), "N m s/rad")
    }

    fn at_most(&self, span: Range<usize>, value: f64, most: f64, unit: &str) -> Result<(), TomlReport> {
        if value <= most {
            return Ok(());
        }
        let step_us = STEP_S * 1e6;
        let allowed = format!(
            "at most {most:.3} {unit}, which steps of {step_us} us can follow with the inertia that it acts on"
        );
        Err(self.toml.refuse(span, value, allowed))
    }
}
