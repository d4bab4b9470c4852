//! An object tied to a finger while a button is held: `attach = { button = 0 }`.

use crate::error::SceneError;
use crate::reader::{Bound, Table};
use crate::vocabulary::Vocabulary;

/// What a scene says of it; `None`: the usual number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AttachSpec {
    /// Which button of the finger's device, 0 to 63.
    pub button: u32,
    /// How the object turns.
    pub orientation: AttachedOrientation,
    /// N/m
    pub stiffness_n_per_m: Option<f64>,
    /// N s/m
    pub damping_n_s_per_m: Option<f64>,
    /// N
    pub most_force_n: Option<f64>,
    /// N m/rad
    pub stiffness_n_m_per_rad: Option<f64>,
    /// N m s/rad
    pub damping_n_m_s_per_rad: Option<f64>,
    /// N m
    pub most_torque_n_m: Option<f64>,
    /// In which the force is gone when the button is let go (s).
    pub fade_s: Option<f64>,
}

/// How an attached object turns.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum AttachedOrientation {
    /// As it likes.
    #[default]
    Free,
    /// Not at all.
    Locked,
    /// Along with the finger's gimbal.
    Gimbal,
}

impl AttachSpec {
    /// Of a finger; `None`: no button ties.
    pub(crate) fn read(finger: &Table<'_>) -> Result<Option<Self>, SceneError> {
        let Some(value) = finger.get("attach") else { return Ok(None) };
        let table = value.table("a table such as { button = 0, orientation = \"locked\" }")?;
        table.check_keys(&KEYS)?;
        let number = |key: &str, bound| table.get(key).map(|value| value.number(bound)).transpose();
        let orientation = match table.get("orientation") {
            None => AttachedOrientation::default(),
            Some(value) => match value.choose("orientation", &ORIENTATIONS)? {
                "locked" => AttachedOrientation::Locked,
                "gimbal" => AttachedOrientation::Gimbal,
                _ => AttachedOrientation::Free,
            },
        };
        Ok(Some(Self {
            button: table.whole_or("button", 0..=63, 0)? as u32,
            orientation,
            stiffness_n_per_m: number("stiffness_n_per_m", Bound::Positive)?,
            damping_n_s_per_m: number("damping_n_s_per_m", Bound::NotNegative)?,
            most_force_n: number("most_force_n", Bound::Positive)?,
            stiffness_n_m_per_rad: number("stiffness_n_m_per_rad", Bound::Positive)?,
            damping_n_m_s_per_rad: number("damping_n_m_s_per_rad", Bound::NotNegative)?,
            most_torque_n_m: number("most_torque_n_m", Bound::Positive)?,
            fade_s: number("fade_s", Bound::NotNegative)?,
        }))
    }
}

const ORIENTATIONS: Vocabulary = Vocabulary { available: &["free", "locked", "gimbal"], later: &[] };
const KEYS: Vocabulary = Vocabulary {
    available: &[
        "button",
        "orientation",
        "stiffness_n_per_m",
        "damping_n_s_per_m",
        "most_force_n",
        "stiffness_n_m_per_rad",
        "damping_n_m_s_per_rad",
        "most_torque_n_m",
        "fade_s",
    ],
    later: &[],
};
