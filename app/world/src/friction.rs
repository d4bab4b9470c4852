//! The friction of an entity's surface.

use crate::error::SceneError;
use crate::reader::{Bound, Table};
use crate::vocabulary::Vocabulary;

/// A friction model with its coefficients, as the scene file gives it. Coefficients are 0 or more.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[non_exhaustive]
pub enum FrictionSpec {
    /// Frictionless: the force is along the normal.
    #[default]
    None,
    /// The tangential force reaches at most `mu` times the normal force.
    Coulomb {
        /// Dimensionless.
        mu: f64,
    },
    /// More force is needed to break loose than to keep sliding.
    Stiction {
        /// While sticking; dimensionless, at least `mu_d`.
        mu_s: f64,
        /// While slipping; dimensionless.
        mu_d: f64,
    },
    /// The tangential force grows with the sliding speed.
    Viscous {
        /// Ratio of tangential to normal force per sliding speed, in s/m.
        mu_v_s_per_m: f64,
    },
    /// The sum of both.
    CoulombViscous {
        /// Dimensionless.
        mu: f64,
        /// Ratio of tangential to normal force per sliding speed, in s/m.
        mu_v_s_per_m: f64,
    },
}

impl FrictionSpec {
    /// Reads the `friction` of an entity; none if there is no such key.
    pub(crate) fn read(entity: &Table<'_>) -> Result<Self, SceneError> {
        let Some(value) = entity.get("friction") else { return Ok(Self::None) };
        let table = value.table(EXAMPLE)?;
        let model = table.require("model", MODELS.list())?.choose("friction model", &MODELS)?;
        let (keys, read) = reader_of(model);
        table.check_keys(&Vocabulary { available: keys, later: &[] })?;
        read(&table)
    }
}

type Read = fn(&Table<'_>) -> Result<FrictionSpec, SceneError>;

/// The keys of a model, and how they become one.
fn reader_of(model: &str) -> (&'static [&'static str], Read) {
    match model {
        "coulomb" => (&["model", "mu"], |table| Ok(FrictionSpec::Coulomb { mu: coefficient(table, "mu")? })),
        "stiction" => (&["model", "mu_s", "mu_d"], read_stiction),
        "viscous" => (&["model", "mu_v_s_per_m"], |table| {
            Ok(FrictionSpec::Viscous { mu_v_s_per_m: coefficient(table, "mu_v_s_per_m")? })
        }),
        "coulomb-viscous" => (&["model", "mu", "mu_v_s_per_m"], |table| {
            let (mu, mu_v_s_per_m) = (coefficient(table, "mu")?, coefficient(table, "mu_v_s_per_m")?);
            Ok(FrictionSpec::CoulombViscous { mu, mu_v_s_per_m })
        }),
        _ => (&["model"], |_| Ok(FrictionSpec::None)),
    }
}

/// A dynamic coefficient above the static one would throw the contact back to sticking as soon
/// as it breaks loose, so it is refused.
fn read_stiction(table: &Table<'_>) -> Result<FrictionSpec, SceneError> {
    let (mu_s, mu_d) = (coefficient(table, "mu_s")?, coefficient(table, "mu_d")?);
    if mu_d > mu_s {
        let allowed = format!("a number from 0 to mu_s = {mu_s}");
        return Err(table.require("mu_d", "")?.out_of_range(allowed));
    }
    Ok(FrictionSpec::Stiction { mu_s, mu_d })
}

fn coefficient(table: &Table<'_>, key: &str) -> Result<f64, SceneError> {
    table.number(key, Bound::NotNegative)
}

const MODELS: Vocabulary = Vocabulary {
    available: &["none", "coulomb", "stiction", "viscous", "coulomb-viscous"],
    later: &["stribeck", "karnopp", "dahl", "lugre", "curve"],
};
const EXAMPLE: &str = "a table such as { model = \"coulomb\", mu = 0.5 }";
