//! How a finger is kept passive: `passivity = true`, or a table with what differs from the usual.

use crate::error::SceneError;
use crate::reader::{Bound, Table};
use crate::vocabulary::Vocabulary;

/// What a scene says of it; `None`: the usual number for the rate of the run.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PassivitySpec {
    /// What may be fed into the hand beyond what it put in (J), > 0.
    pub bound_j: Option<f64>,
    /// A debt is paid at this rate (W).
    pub recovery_w: Option<f64>,
    /// What the device's own friction takes (N).
    pub device_friction_n: Option<f64>,
    /// The largest acceleration of the tip (m/s^2).
    pub acceleration_m_per_s2: Option<f64>,
    /// Steps of a position along each axis (m).
    pub resolution_m: Option<f64>,
}

impl PassivitySpec {
    /// Of a finger; `None`: it is not kept passive.
    pub(crate) fn read(finger: &Table<'_>) -> Result<Option<Self>, SceneError> {
        let Some(value) = finger.get("passivity") else { return Ok(None) };
        if let Some(truth) = value.truth_if_any() {
            return Ok(truth.then(Self::default));
        }
        let table = value.table(ALLOWED)?;
        table.check_keys(&KEYS)?;
        let number = |key: &str, bound| table.get(key).map(|value| value.number(bound)).transpose();
        Ok(Some(Self {
            bound_j: number("bound_j", Bound::Positive)?,
            recovery_w: number("recovery_w", Bound::NotNegative)?,
            device_friction_n: number("device_friction_n", Bound::NotNegative)?,
            acceleration_m_per_s2: number("acceleration_m_per_s2", Bound::NotNegative)?,
            resolution_m: number("resolution_m", Bound::NotNegative)?,
        }))
    }
}

const ALLOWED: &str = "true, false, or a table such as { bound_j = 0.002 }";
const KEYS: Vocabulary = Vocabulary {
    available: &["bound_j", "recovery_w", "device_friction_n", "acceleration_m_per_s2", "resolution_m"],
    later: &[],
};
