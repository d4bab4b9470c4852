//! What an entity's surface does beside being touched: magnetism and vibration.

use crate::error::SceneError;
use crate::reader::{Bound, Table};
use crate::vocabulary::Vocabulary;

/// A surface that attracts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MagnetismSpec {
    /// The strongest pull (N); 0 or more.
    pub force_n: f64,
    /// How far it reaches (m); above 0.
    pub distance_m: f64,
}

/// A surface that hums while it is touched.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VibrationSpec {
    /// Above 0.
    pub frequency_hz: f64,
    /// In full strength (N); 0 or more.
    pub amplitude_n: f64,
    /// The normal force at which that is reached (N); above 0.
    pub full_load_n: f64,
}

impl MagnetismSpec {
    /// Reads the `magnetism` of an entity.
    pub(crate) fn read(entity: &Table<'_>) -> Result<Option<Self>, SceneError> {
        let Some(value) = entity.get("magnetism") else { return Ok(None) };
        let table = value.table("a table such as { force_n = 1.0, distance_m = 0.01 }")?;
        table.check_keys(&Vocabulary { available: &["force_n", "distance_m"], later: &[] })?;
        let force_n = table.number("force_n", Bound::NotNegative)?;
        Ok(Some(Self { force_n, distance_m: table.number("distance_m", Bound::Positive)? }))
    }
}

impl VibrationSpec {
    /// The load of full strength if none is given (N), unless the amplitude is larger: then that.
    pub const DEFAULT_FULL_LOAD_N: f64 = 1.0;

    /// Reads the `vibration` of an entity.
    pub(crate) fn read(entity: &Table<'_>) -> Result<Option<Self>, SceneError> {
        let Some(value) = entity.get("vibration") else { return Ok(None) };
        let table = value.table("a table such as { frequency_hz = 150.0, amplitude_n = 0.3 }")?;
        let keys = &["frequency_hz", "amplitude_n", "full_load_n"];
        table.check_keys(&Vocabulary { available: keys, later: &[] })?;
        let frequency_hz = table.number("frequency_hz", Bound::Positive)?;
        let amplitude_n = table.number("amplitude_n", Bound::NotNegative)?;
        let default = amplitude_n.max(Self::DEFAULT_FULL_LOAD_N);
        let full_load_n = table.number_or("full_load_n", Bound::Positive, default)?;
        Ok(Some(Self { frequency_hz, amplitude_n, full_load_n }))
    }
}
