//! Settings of how a scene's moving entities are computed: `integrator`, `contact_response`, `contact_stiffness`,
//! `grasp_quality`, `sleep` and `lists`; and an entity's `restitution`.

use crate::error::SceneError;
use crate::grid::MAX_ENTITIES;
use crate::lists::ListSettings;
use crate::reader::{Bound, Table, Value};
use crate::vocabulary::Vocabulary;

/// What holds for all entities that move.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DynamicsSpec {
    /// How forces become motion.
    pub integrator: IntegratorSpec,
    /// How contacts between entities answer.
    pub response: ResponseSpec,
    /// Stiffness of contacts between entities that do not say it themselves.
    pub stiffness: ContactStiffnessSpec,
    /// Whether it is told how good the grasp of each is.
    pub grasp_quality: bool,
    /// Whether what rests falls asleep.
    pub sleep: bool,
    /// Which of them a thread without deadlines steps.
    pub lists: ListSettings,
}

impl Default for DynamicsSpec {
    fn default() -> Self {
        Self {
            integrator: IntegratorSpec::default(),
            response: ResponseSpec::default(),
            stiffness: ContactStiffnessSpec::default(),
            grasp_quality: false,
            sleep: true,
            lists: ListSettings::default(),
        }
    }
}

/// How forces become motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum IntegratorSpec {
    /// Contact forces of the tick's end, angular momentum carried: stable for every mass.
    #[default]
    Implicit,
    /// Runge and Kutta's of the fourth order; to compare with.
    Rk4,
    /// As the thesis has it, without the gyroscopic term; to compare with.
    ThesisEuler,
    /// The same with the gyroscopic term.
    ThesisEulerGyroscopic,
    /// The same with that term as it is printed, which runs away.
    ThesisEulerPrinted,
}

/// How contacts between entities answer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ResponseSpec {
    /// By a spring and a damper; what meets is reflected before, if anybody says by how much.
    Force {
        /// Share of the approaching velocity that comes back, 0 to 1, where no entity says.
        restitution: Option<f64>,
    },
    /// By reflected velocities.
    Impulse {
        /// Share of the approaching velocity that comes back, 0 to 1, where no entity says.
        restitution: f64,
    },
}

/// Stiffness of contacts between entities that do not say it themselves; their dampers are this share of the critical one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ContactStiffnessSpec {
    /// As felt between two that both say `stiffness_n_per_m`, by mass otherwise.
    AsSaid {
        /// 1: critical.
        damping_ratio: f64,
    },
    /// As fingers feel both surfaces, with both dampers.
    AsFelt,
    /// By the mass of the heaviest thing that moves.
    ByMass {
        /// 1: critical.
        damping_ratio: f64,
    },
    /// The same for all.
    Given {
        /// Of each contact point \[N/m\].
        stiffness_n_per_m: f64,
        /// 1: critical.
        damping_ratio: f64,
    },
}

impl Default for ContactStiffnessSpec {
    fn default() -> Self {
        Self::AsSaid { damping_ratio: 1.0 }
    }
}

impl Default for ResponseSpec {
    fn default() -> Self {
        Self::Force { restitution: None }
    }
}

impl DynamicsSpec {
    pub(crate) fn read(scene: &Table<'_>) -> Result<Self, SceneError> {
        let integrator = match scene.get("integrator") {
            None => IntegratorSpec::default(),
            Some(value) => match value.choose("integrator", &INTEGRATORS)? {
                "rk4" => IntegratorSpec::Rk4,
                "thesis-euler" => IntegratorSpec::ThesisEuler,
                "thesis-euler-gyroscopic" => IntegratorSpec::ThesisEulerGyroscopic,
                "thesis-euler-printed" => IntegratorSpec::ThesisEulerPrinted,
                _ => IntegratorSpec::Implicit,
            },
        };
        let response = scene.get("contact_response").map(|value| ResponseSpec::read(&value)).transpose()?;
        let grasp_quality = scene.get("grasp_quality").map_or(Ok(false), |value| value.truth())?;
        let sleep = scene.get("sleep").map_or(Ok(true), |value| value.truth())?;
        let lists = scene.get("lists").map_or(Ok(ListSettings::default()), |value| read_lists(&value))?;
        let stiffness = scene.get("contact_stiffness").map(|value| ContactStiffnessSpec::read(&value));
        let stiffness = stiffness.transpose()?.unwrap_or_default();
        Ok(Self {
            integrator,
            response: response.unwrap_or_default(),
            stiffness,
            grasp_quality,
            sleep,
            lists,
        })
    }
}

impl ResponseSpec {
    fn read(value: &Value<'_>) -> Result<Self, SceneError> {
        let table = value.table(ALLOWED)?;
        table.check_keys(&KEYS)?;
        let kind = table.require("kind", "force, impulse")?.choose("contact response", &RESPONSES)?;
        let restitution = read_restitution(&table)?;
        Ok(match kind {
            "force" => Self::Force { restitution },
            _ => Self::Impulse { restitution: restitution.unwrap_or(0.0) },
        })
    }
}

/// Share of an approaching velocity that comes back, if the table says.
pub(crate) fn read_restitution(table: &Table<'_>) -> Result<Option<f64>, SceneError> {
    let Some(value) = table.get("restitution") else { return Ok(None) };
    match value.number(Bound::NotNegative)? {
        share if share > 1.0 => Err(value.out_of_range("a number from 0 to 1")),
        share => Ok(Some(share)),
    }
}

impl ContactStiffnessSpec {
    fn read(value: &Value<'_>) -> Result<Self, SceneError> {
        let table = value.table(STIFFNESS_EXAMPLE)?;
        table.check_keys(&STIFFNESS_KEYS)?;
        let kind = table.require("kind", "as-said, by-mass, as-felt, given")?;
        let kind = kind.choose("contact stiffness", &STIFFNESSES)?;
        let damping_ratio = table.number_or("damping_ratio", Bound::NotNegative, 1.0)?;
        if damping_ratio > MOST_DAMPING_RATIO {
            let value = table.require("damping_ratio", Bound::NotNegative)?;
            return Err(value.out_of_range(format!("a number from 0 to {MOST_DAMPING_RATIO}; 1 is critical")));
        }
        let unfit = |key: &str, allowed: &str| match table.get(key) {
            Some(value) => Err(value.out_of_range(allowed)),
            None => Ok(()),
        };
        match kind {
            "given" => {
                let stiffness_n_per_m =
                    table.require("stiffness_n_per_m", STIFFNESS_EXAMPLE)?.number(Bound::Positive)?;
                Ok(Self::Given { stiffness_n_per_m, damping_ratio })
            }
            "as-felt" => {
                unfit("damping_ratio", "none with kind = \"as-felt\": dampers are the entities' own")?;
                unfit("stiffness_n_per_m", "none, but with kind = \"given\"")?;
                Ok(Self::AsFelt)
            }
            kind => {
                unfit("stiffness_n_per_m", "none, but with kind = \"given\"")?;
                Ok(match kind {
                    "by-mass" => Self::ByMass { damping_ratio },
                    _ => Self::AsSaid { damping_ratio },
                })
            }
        }
    }
}

fn read_lists(value: &Value<'_>) -> Result<ListSettings, SceneError> {
    let table = value.table(LISTS_EXAMPLE)?;
    table.check_keys(&LISTS_KEYS)?;
    let usual = ListSettings::default();
    let positive =
        |key, usual| table.get(key).map_or(Ok(usual), |value: Value<'_>| value.number(Bound::Positive));
    let lists = ListSettings {
        near_m: positive("near_m", usual.near_m)?,
        far_m: positive("far_m", usual.far_m)?,
        ahead_s: positive("ahead_s", usual.ahead_s)?,
        fast_bodies: match table.get("fast_bodies") {
            Some(value) => value.whole(0..=MAX_ENTITIES as u64)? as usize,
            None => usual.fast_bodies,
        },
    };
    // Who goes at once that has just come would go to and fro.
    if lists.far_m <= lists.near_m {
        let key = if table.get("far_m").is_some() { "far_m" } else { "near_m" };
        let value = table.require(key, LISTS_EXAMPLE)?;
        return Err(value.out_of_range("far_m has to be larger than near_m; usual are 0.05 and 0.01"));
    }
    Ok(lists)
}

const LISTS_EXAMPLE: &str =
    "a table such as { near_m = 0.01, far_m = 0.05, ahead_s = 0.05, fast_bodies = 64 }";
const LISTS_KEYS: Vocabulary =
    Vocabulary { available: &["near_m", "far_m", "ahead_s", "fast_bodies"], later: &[] };
const ALLOWED: &str =
    "a table such as { kind = \"impulse\", restitution = 0.5 } or { kind = \"force\", restitution = 0.5 }";
const KEYS: Vocabulary = Vocabulary { available: &["kind", "restitution"], later: &[] };
/// A spring that is damped so much comes back in seconds; far more is beyond what a tick can solve for.
const MOST_DAMPING_RATIO: f64 = 1000.0;
const STIFFNESS_EXAMPLE: &str = "a table such as { kind = \"by-mass\", damping_ratio = 1.0 }, { kind = \"as-felt\" } or \
                                 { kind = \"given\", stiffness_n_per_m = 1e5 }";
const STIFFNESS_KEYS: Vocabulary =
    Vocabulary { available: &["kind", "stiffness_n_per_m", "damping_ratio"], later: &[] };
const STIFFNESSES: Vocabulary =
    Vocabulary { available: &["as-said", "by-mass", "as-felt", "given"], later: &[] };
const RESPONSES: Vocabulary = Vocabulary { available: &["force", "impulse"], later: &[] };
const INTEGRATORS: Vocabulary = Vocabulary {
    available: &["implicit", "rk4", "thesis-euler", "thesis-euler-gyroscopic", "thesis-euler-printed"],
    later: &[],
};
