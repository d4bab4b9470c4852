//! The friction of an entity's surface.

use crate::error::SceneError;
use crate::reader::{Bound, Table};
use crate::vocabulary::Vocabulary;

/// A friction model with its coefficients, as the scene file gives it. Coefficients are ratios of tangential to normal
/// force and 0 or more; `mu_v_s_per_m` is such a ratio per sliding speed, in s/m.
#[derive(Debug, Clone, PartialEq, Default)]
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
        /// Per speed.
        mu_v_s_per_m: f64,
    },
    /// The sum of both.
    CoulombViscous {
        /// Dimensionless.
        mu: f64,
        /// Per speed.
        mu_v_s_per_m: f64,
    },
    /// From the static to the dynamic coefficient as the speed grows: `mu_d + (mu_s - mu_d) exp(-(v / v_s)^2)`, and
    /// viscous friction.
    Stribeck {
        /// At rest; at least `mu_d`.
        mu_s: f64,
        /// At speeds far above `v_s_m_s`.
        mu_d: f64,
        /// Speed at which the difference has fallen to 1/e (m/s); above 0.
        v_s_m_s: f64,
        /// Per speed.
        mu_v_s_per_m: f64,
    },
    /// Stiction that holds again below a speed instead of a force.
    Karnopp {
        /// While sticking; at least `mu_d`.
        mu_s: f64,
        /// While slipping.
        mu_d: f64,
        /// Slower than this is at rest (m/s); above 0.
        v_min_m_s: f64,
        /// Per speed.
        mu_v_s_per_m: f64,
    },
    /// Coulomb friction behind a spring that yields from the start.
    Dahl {
        /// Dimensionless.
        mu: f64,
    },
    /// Bristles that bend and slip, with the Stribeck effect.
    LuGre {
        /// At rest; at least `mu_d`.
        mu_s: f64,
        /// At speeds far above `v_s_m_s`.
        mu_d: f64,
        /// The Stribeck speed (m/s); above 0.
        v_s_m_s: f64,
        /// Per speed.
        mu_v_s_per_m: f64,
    },
    /// Friction against speed, drawn by hand: linear between points, constant beyond.
    Curve {
        /// Where the points are (m/s): 0 or more, rising.
        speed_m_s: Vec<f64>,
        /// The coefficient at each.
        mu: Vec<f64>,
        /// While sticking; at least the first of `mu`.
        mu_s: f64,
    },
}
impl FrictionSpec {
    /// Karnopp's speed of rest, if none is given: well above what encoder steps of 0.03 mm look like at rest.
    pub const DEFAULT_V_MIN_M_S: f64 = 0.005;
    /// The Stribeck speed of LuGre friction, if none is given.
    pub const DEFAULT_V_S_M_S: f64 = 0.01;

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
        "stribeck" => (&["model", "mu_s", "mu_d", "v_s_m_s", "mu_v_s_per_m"], read_stribeck),
        "karnopp" => (&["model", "mu_s", "mu_d", "v_min_m_s", "mu_v_s_per_m"], read_karnopp),
        "dahl" => (&["model", "mu"], |table| Ok(FrictionSpec::Dahl { mu: coefficient(table, "mu")? })),
        "lugre" => (&["model", "mu_s", "mu_d", "v_s_m_s", "mu_v_s_per_m"], read_lugre),
        "curve" => (&["model", "speed_m_s", "mu", "mu_s"], read_curve),
        _ => (&["model"], |_| Ok(FrictionSpec::None)),
    }
}

fn read_stiction(table: &Table<'_>) -> Result<FrictionSpec, SceneError> {
    let [mu_s, mu_d] = static_and_dynamic(table)?;
    Ok(FrictionSpec::Stiction { mu_s, mu_d })
}

fn read_stribeck(table: &Table<'_>) -> Result<FrictionSpec, SceneError> {
    let ([mu_s, mu_d], v_s_m_s) = (static_and_dynamic(table)?, table.number("v_s_m_s", Bound::Positive)?);
    Ok(FrictionSpec::Stribeck { mu_s, mu_d, v_s_m_s, mu_v_s_per_m: viscous_or_none(table)? })
}

fn read_karnopp(table: &Table<'_>) -> Result<FrictionSpec, SceneError> {
    let [mu_s, mu_d] = static_and_dynamic(table)?;
    let v_min_m_s = table.number_or("v_min_m_s", Bound::Positive, FrictionSpec::DEFAULT_V_MIN_M_S)?;
    Ok(FrictionSpec::Karnopp { mu_s, mu_d, v_min_m_s, mu_v_s_per_m: viscous_or_none(table)? })
}

fn read_lugre(table: &Table<'_>) -> Result<FrictionSpec, SceneError> {
    let [mu_s, mu_d] = static_and_dynamic(table)?;
    let v_s_m_s = table.number_or("v_s_m_s", Bound::Positive, FrictionSpec::DEFAULT_V_S_M_S)?;
    Ok(FrictionSpec::LuGre { mu_s, mu_d, v_s_m_s, mu_v_s_per_m: viscous_or_none(table)? })
}

fn read_curve(table: &Table<'_>) -> Result<FrictionSpec, SceneError> {
    let speeds = table.require("speed_m_s", "an array of rising numbers, 0 or more")?;
    let speed_m_s = speeds.list(Bound::NotNegative)?;
    if !speed_m_s.is_sorted_by(|a, b| a < b) {
        return Err(speeds.out_of_range("numbers, each larger than the one before"));
    }
    let coefficients = table.require("mu", "an array with a coefficient for each speed")?;
    let mu = coefficients.list(Bound::NotNegative)?;
    if mu.len() != speed_m_s.len() {
        let allowed = format!("an array of {} numbers, one for each of speed_m_s", speed_m_s.len());
        return Err(coefficients.out_of_range(allowed));
    }
    let mu_s = table.number_or("mu_s", Bound::NotNegative, mu[0])?;
    if mu_s < mu[0] {
        let allowed = format!("a number from the first of mu, {}, up", mu[0]);
        return Err(table.require("mu_s", "")?.out_of_range(allowed));
    }
    Ok(FrictionSpec::Curve { speed_m_s, mu, mu_s })
}

/// A dynamic coefficient above the static one would throw the contact back to sticking as soon
/// as it breaks loose, so it is refused.
fn static_and_dynamic(table: &Table<'_>) -> Result<[f64; 2], SceneError> {
    let (mu_s, mu_d) = (coefficient(table, "mu_s")?, coefficient(table, "mu_d")?);
    if mu_d > mu_s {
        let allowed = format!("a number from 0 to mu_s = {mu_s}");
        return Err(table.require("mu_d", "")?.out_of_range(allowed));
    }
    Ok([mu_s, mu_d])
}

fn viscous_or_none(table: &Table<'_>) -> Result<f64, SceneError> {
    table.number_or("mu_v_s_per_m", Bound::NotNegative, 0.0)
}

fn coefficient(table: &Table<'_>, key: &str) -> Result<f64, SceneError> {
    table.number(key, Bound::NotNegative)
}

const MODELS: Vocabulary = Vocabulary {
    available: &[
        "none",
        "coulomb",
        "stiction",
        "viscous",
        "coulomb-viscous",
        "stribeck",
        "karnopp",
        "dahl",
        "lugre",
        "curve",
    ],
    later: &[],
};
const EXAMPLE: &str = "a table such as { model = \"coulomb\", mu = 0.5 }";
