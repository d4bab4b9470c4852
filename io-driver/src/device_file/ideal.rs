//! The file of an ideal device: a name, and a force limit if one is wanted.

use serde::Deserialize;
use toml::Spanned;

use super::{DeviceFileError, IdealFile};
use crate::toml_report::{Allowed, TomlText};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Raw {
    #[serde(rename = "kind")]
    _kind: String,
    name: String,
    peak_force_n: Option<Spanned<f64>>,
}

/// Nothing moves, so any force is possible; zero would be a device that is switched off.
const FORCE: Allowed = Allowed { min: 1e-3, max: 1e6, unit: "N" };

pub(super) fn read(toml: &TomlText<'_>) -> Result<IdealFile, DeviceFileError> {
    let raw: Raw = toml.read().map_err(DeviceFileError::Malformed)?;
    let peak_force_n = raw.peak_force_n.map(|force| toml.number(&force, FORCE)).transpose();
    Ok(IdealFile { name: raw.name, peak_force_n: peak_force_n.map_err(DeviceFileError::Value)? })
}
