//! The table `[bodies]`: masses and their centres for the compensation of gravity, and moments of inertia if the arm
//! is to be simulated.

use serde::Deserialize;
use toml::Spanned;

use crate::kinematics::JointConvention;
use crate::kinematics::gravity::{Bodies, Gravity};
use crate::sim::dynamics::{Dynamics, Inertias};
use crate::toml_report::{Allowed, SpannedList, TomlReport, TomlText};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawBodies {
    mass_a_kg: Spanned<f64>,
    mass_c_kg: Spanned<f64>,
    mass_be_kg: Spanned<f64>,
    mass_df_kg: Spanned<f64>,
    l3_m: Spanned<f64>,
    l5_m: Spanned<f64>,
    l6_m: Spanned<f64>,
    inertia_a_kg_m2: Option<SpannedList>,
    inertia_c_kg_m2: Option<SpannedList>,
    inertia_be_kg_m2: Option<SpannedList>,
    inertia_df_kg_m2: Option<SpannedList>,
    inertia_base_yy_kg_m2: Option<Spanned<f64>>,
}

/// What the bodies amount to.
#[derive(Clone, Copy)]
pub(super) struct Weights {
    pub(super) gravity: Gravity,
    /// If the moments of inertia are there.
    pub(super) dynamics: Option<Dynamics>,
}

/// Of an arm with these links (upper arm, forearm; m).
pub(super) fn check(
    toml: &TomlText<'_>,
    table: Option<&Spanned<RawBodies>>,
    links_m: [f64; 2],
    convention: JointConvention,
) -> Result<Option<Weights>, TomlReport> {
    let Some(table) = table else { return Ok(None) };
    let bodies = weigh(toml, table.get_ref())?;
    let dynamics =
        inertias(toml, table)?.map(|inertias| Dynamics::new(links_m, &bodies, &inertias, convention));
    Ok(Some(Weights { gravity: Gravity::new(links_m, &bodies, convention), dynamics }))
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

/// All of them or none.
fn inertias(toml: &TomlText<'_>, table: &Spanned<RawBodies>) -> Result<Option<Inertias>, TomlReport> {
    let raw = table.get_ref();
    let (Some(a), Some(c), Some(be), Some(df), Some(base_yy)) = (
        &raw.inertia_a_kg_m2,
        &raw.inertia_c_kg_m2,
        &raw.inertia_be_kg_m2,
        &raw.inertia_df_kg_m2,
        &raw.inertia_base_yy_kg_m2,
    ) else {
        return none_of_them(toml, table);
    };
    Ok(Some(Inertias {
        a_kg_m2: toml.numbers(a, INERTIA)?,
        c_kg_m2: toml.numbers(c, INERTIA)?,
        be_kg_m2: toml.numbers(be, INERTIA)?,
        df_kg_m2: toml.numbers(df, INERTIA)?,
        base_yy_kg_m2: toml.number(base_yy, INERTIA)?,
    }))
}

/// Refuses a table that has some of the moments.
fn none_of_them(toml: &TomlText<'_>, table: &Spanned<RawBodies>) -> Result<Option<Inertias>, TomlReport> {
    let raw = table.get_ref();
    let keys = [
        ("inertia_a_kg_m2", raw.inertia_a_kg_m2.is_some()),
        ("inertia_c_kg_m2", raw.inertia_c_kg_m2.is_some()),
        ("inertia_be_kg_m2", raw.inertia_be_kg_m2.is_some()),
        ("inertia_df_kg_m2", raw.inertia_df_kg_m2.is_some()),
        ("inertia_base_yy_kg_m2", raw.inertia_base_yy_kg_m2.is_some()),
    ];
    if keys.iter().all(|(_, is_there)| !is_there) {
        return Ok(None);
    }
    let missing: Vec<&str> = keys.into_iter().filter(|(_, is_there)| !is_there).map(|(key, _)| key).collect();
    let found = format_args!("moments of inertia without `{}`", missing.join("`, `")).to_string();
    Err(toml.refuse(table.span(), found, "all five, or none in a device that is not simulated"))
}

const MASS: Allowed = Allowed { min: 0.0, max: 10.0, unit: "kg" };
const LEVER: Allowed = Allowed { min: -1.0, max: 1.0, unit: "m" };
/// Catches g cm^2; a kilogram at a metre is the end.
const INERTIA: Allowed = Allowed { min: 0.0, max: 1.0, unit: "kg m^2" };
