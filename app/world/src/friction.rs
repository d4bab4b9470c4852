//! The friction of an entity's surface.

use std::path::Path;

use haptics::Material;

use crate::document::{Document, LineEnds};
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
        /// Of the bristles' own motion (N s/m).
        damping_n_s_per_m: f64,
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
    /// Single bonds that stretch, snap and form anew.
    Bristle {
        /// In the mean over time.
        mu: f64,
        /// How many there are: 1 to [`FrictionSpec::MAX_BRISTLES`].
        bonds: usize,
        /// Of their random places.
        seed: u64,
    },
    /// The bristles' force without the bristles.
    ResetIntegrator {
        /// While sticking; at least `mu_d`.
        mu_s: f64,
        /// While slipping.
        mu_d: f64,
        /// Of the strain while it sticks (N s/m).
        damping_n_s_per_m: f64,
    },
    /// Dahl's model without its drift, by Hayward and Armstrong.
    Hayward {
        /// Dimensionless.
        mu: f64,
        /// The part of `mu` that is borne without any slide: 0 or more, below 1.
        stick_fraction: f64,
    },
    /// A friction force that does not depend on the normal force.
    FixedCone {
        /// While slipping (N).
        friction_n: f64,
        /// While sticking (N); at least `friction_n`.
        static_n: f64,
    },
}
impl FrictionSpec {
    /// Karnopp's speed of rest, if none is given: well above what encoder steps of 0.03 mm look like at rest.
    pub const DEFAULT_V_MIN_M_S: f64 = 0.005;
    /// The Stribeck speed of LuGre friction, if none is given.
    pub const DEFAULT_V_S_M_S: f64 = 0.01;
    /// What Hayward's friction bears without any slide, if nothing is said: half of what it bears at all.
    pub const DEFAULT_STICK_FRACTION: f64 = 0.5;
    /// The most bristles of a contact, and how many there are if nothing is said.
    pub const MAX_BRISTLES: usize = haptics::MAX_BRISTLES;
    /// The most points of a curve; one more is kept for the speed 0.
    pub const MAX_CURVE_POINTS: usize = haptics::MAX_CURVE_POINTS - 1;

    /// As an entity of a scene has it, such as `{ model = "coulomb", mu = 0.5 }`.
    ///
    /// # Errors
    /// What is wrong with it, and what is allowed.
    pub fn parse(text: &str) -> Result<Self, SceneError> {
        let text = format!("friction = {text}");
        let lines = LineEnds::of(&text);
        let document = Document::new(&text, &lines, Path::new("friction"));
        let root = document.parse()?;
        Self::read(&Table::root(document, &root), None)
    }

    /// Reads the `friction` of an entity; without such a key its material's, without a material none.
    pub(crate) fn read(entity: &Table<'_>, material: Option<&Material>) -> Result<Self, SceneError> {
        let Some(value) = entity.get("friction") else {
            let of = |material: &Material| Self::Stiction { mu_s: material.mu_s, mu_d: material.mu_d };
            return Ok(material.map_or(Self::None, of));
        };
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
        "lugre" => (&["model", "mu_s", "mu_d", "v_s_m_s", "mu_v_s_per_m", "damping_n_s_per_m"], read_lugre),
        "curve" => (&["model", "speed_m_s", "mu", "mu_s"], read_curve),
        "bristle" => (&["model", "mu", "bonds", "seed"], read_bristle),
        "reset-integrator" => (&["model", "mu_s", "mu_d", "damping_n_s_per_m"], read_reset_integrator),
        "hayward" => (&["model", "mu", "stick_fraction"], read_hayward),
        "fixed-cone" => (&["model", "friction_n", "static_n"], read_fixed_cone),
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
    let (mu_v_s_per_m, damping_n_s_per_m) = (viscous_or_none(table)?, damping_or_none(table)?);
    Ok(FrictionSpec::LuGre { mu_s, mu_d, v_s_m_s, mu_v_s_per_m, damping_n_s_per_m })
}

fn read_bristle(table: &Table<'_>) -> Result<FrictionSpec, SceneError> {
    let most = FrictionSpec::MAX_BRISTLES;
    let bonds = table.whole_or("bonds", 1..=most as u64, most as u64)? as usize;
    let seed = table.whole_or("seed", 0..=i64::MAX as u64, 0)?;
    Ok(FrictionSpec::Bristle { mu: coefficient(table, "mu")?, bonds, seed })
}

fn read_reset_integrator(table: &Table<'_>) -> Result<FrictionSpec, SceneError> {
    let [mu_s, mu_d] = static_and_dynamic(table)?;
    Ok(FrictionSpec::ResetIntegrator { mu_s, mu_d, damping_n_s_per_m: damping_or_none(table)? })
}

fn read_hayward(table: &Table<'_>) -> Result<FrictionSpec, SceneError> {
    let mu = coefficient(table, "mu")?;
    let default = FrictionSpec::DEFAULT_STICK_FRACTION;
    let stick_fraction = table.number_or("stick_fraction", Bound::NotNegative, default)?;
    if stick_fraction >= 1.0 {
        return Err(table.require("stick_fraction", "")?.out_of_range("a number from 0 up, below 1"));
    }
    Ok(FrictionSpec::Hayward { mu, stick_fraction })
}

fn read_fixed_cone(table: &Table<'_>) -> Result<FrictionSpec, SceneError> {
    let friction_n = coefficient(table, "friction_n")?;
    let static_n = table.number_or("static_n", Bound::NotNegative, friction_n)?;
    if static_n < friction_n {
        let allowed = format!("a number from friction_n = {friction_n} up");
        return Err(table.require("static_n", "")?.out_of_range(allowed));
    }
    Ok(FrictionSpec::FixedCone { friction_n, static_n })
}

fn read_curve(table: &Table<'_>) -> Result<FrictionSpec, SceneError> {
    let speeds = table.require("speed_m_s", "an array of rising numbers, 0 or more")?;
    let speed_m_s = speeds.list(Bound::NotNegative)?;
    if speed_m_s.len() > FrictionSpec::MAX_CURVE_POINTS {
        return Err(speeds.out_of_range(format!("at most {} numbers", FrictionSpec::MAX_CURVE_POINTS)));
    }
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

fn damping_or_none(table: &Table<'_>) -> Result<f64, SceneError> {
    table.number_or("damping_n_s_per_m", Bound::NotNegative, 0.0)
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
        "bristle",
        "reset-integrator",
        "hayward",
        "fixed-cone",
    ],
    later: &[],
};
const EXAMPLE: &str = "a table such as { model = \"coulomb\", mu = 0.5 }";
