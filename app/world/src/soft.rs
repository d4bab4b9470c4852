//! A finger's pad: `soft = true`, or a table with what differs from the usual.

use crate::error::SceneError;
use crate::reader::{Bound, Table};
use crate::vocabulary::Vocabulary;

/// What a scene says of it; `None`: the usual number.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SoftSpec {
    /// Which model; its own numbers with it.
    pub model: SoftModelSpec,
    /// What a pad that holds gives before it turns (N m/rad).
    pub stiffness_n_m_per_rad: Option<f64>,
    /// Of what holds (N m s/rad).
    pub damping_n_m_s_per_rad: Option<f64>,
    /// Ratio to the normal force where there is no friction circle.
    pub normal_share: Option<f64>,
    /// From which area of the friction circle on a gimbal turns what its finger holds (m^2).
    pub gimbal_area_m2: Option<f64>,
}

/// How a pad resists turning.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SoftModelSpec {
    /// Not at all.
    None,
    /// By dry friction of the pad.
    Coulomb {
        /// Of the pressed pad (m).
        pad_radius_m: Option<f64>,
        /// True if it bears friction and torsion in full at once, as the thesis has it.
        is_uncoupled: bool,
    },
    /// As Melder's eq. 5.16 has it.
    Viscous {
        /// A_crit (m^2).
        critical_area_m2: Option<f64>,
        /// N m s/rad
        viscous_damping_n_m_s_per_rad: Option<f64>,
    },
    /// The same with two areas.
    StickSlip {
        /// A_crit of what does not turn (m^2).
        critical_area_at_rest_m2: Option<f64>,
        /// A_crit of what turns (m^2).
        critical_area_turning_m2: Option<f64>,
        /// N m s/rad
        viscous_damping_n_m_s_per_rad: Option<f64>,
    },
}

impl Default for SoftModelSpec {
    fn default() -> Self {
        Self::Coulomb { pad_radius_m: None, is_uncoupled: false }
    }
}

impl SoftSpec {
    /// Of a finger; `None`: it is a point.
    pub(crate) fn read(finger: &Table<'_>) -> Result<Option<Self>, SceneError> {
        let Some(value) = finger.get("soft") else { return Ok(None) };
        if let Some(truth) = value.truth_if_any() {
            return Ok(truth.then(Self::default));
        }
        let table = value.table(ALLOWED)?;
        let model = match table.get("model") {
            Some(model) => model.choose("soft finger", &MODELS)?,
            None => "coulomb",
        };
        let keys = match model {
            "viscous" => &OF_VISCOUS,
            "stick-slip" => &OF_STICK_SLIP,
            "none" => &OF_NONE,
            _ => &OF_COULOMB,
        };
        table.check_keys(keys)?;
        let number = |key: &str, bound| table.get(key).map(|value| value.number(bound)).transpose();
        let damping = "viscous_damping_n_m_s_per_rad";
        let model = match model {
            "none" => SoftModelSpec::None,
            "viscous" => SoftModelSpec::Viscous {
                critical_area_m2: number("critical_area_m2", Bound::Positive)?,
                viscous_damping_n_m_s_per_rad: number(damping, Bound::NotNegative)?,
            },
            "stick-slip" => SoftModelSpec::StickSlip {
                critical_area_at_rest_m2: number("critical_area_at_rest_m2", Bound::Positive)?,
                critical_area_turning_m2: number("critical_area_turning_m2", Bound::Positive)?,
                viscous_damping_n_m_s_per_rad: number(damping, Bound::NotNegative)?,
            },
            _ => {
                let pad_radius_m = number("pad_radius_m", Bound::Positive)?;
                let surface =
                    table.get("limit_surface").map(|value| value.choose("limit surface", &LIMIT_SURFACES));
                let is_uncoupled = surface.transpose()? == Some("uncoupled");
                SoftModelSpec::Coulomb { pad_radius_m, is_uncoupled }
            }
        };
        Ok(Some(Self {
            model,
            stiffness_n_m_per_rad: number("stiffness_n_m_per_rad", Bound::Positive)?,
            damping_n_m_s_per_rad: number("damping_n_m_s_per_rad", Bound::NotNegative)?,
            normal_share: number("normal_share", Bound::NotNegative)?,
            gimbal_area_m2: number("gimbal_area_m2", Bound::NotNegative)?,
        }))
    }
}

const ALLOWED: &str = "true, false, or a table such as { model = \"coulomb\", pad_radius_m = 0.006 }";
const MODELS: Vocabulary =
    Vocabulary { available: &["coulomb", "viscous", "stick-slip", "none"], later: &[] };
const OF_NONE: Vocabulary = Vocabulary { available: &["model"], later: &[] };
const LIMIT_SURFACES: Vocabulary = Vocabulary { available: &["ellipse", "uncoupled"], later: &[] };
const OF_COULOMB: Vocabulary = Vocabulary {
    available: &[
        "model",
        "pad_radius_m",
        "limit_surface",
        "stiffness_n_m_per_rad",
        "damping_n_m_s_per_rad",
        "normal_share",
        "gimbal_area_m2",
    ],
    later: &[],
};
const OF_VISCOUS: Vocabulary = Vocabulary {
    available: &[
        "model",
        "critical_area_m2",
        "viscous_damping_n_m_s_per_rad",
        "stiffness_n_m_per_rad",
        "damping_n_m_s_per_rad",
        "normal_share",
        "gimbal_area_m2",
    ],
    later: &[],
};
const OF_STICK_SLIP: Vocabulary = Vocabulary {
    available: &[
        "model",
        "critical_area_at_rest_m2",
        "critical_area_turning_m2",
        "viscous_damping_n_m_s_per_rad",
        "stiffness_n_m_per_rad",
        "damping_n_m_s_per_rad",
        "normal_share",
        "gimbal_area_m2",
    ],
    later: &[],
};
