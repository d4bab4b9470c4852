//! The material of an entity, by name.

use haptics::Material;

use crate::error::SceneError;
use crate::reader::Table;
use crate::vocabulary::Vocabulary;

/// Reads the `material` of an entity.
pub(crate) fn read_material(entity: &Table<'_>) -> Result<Option<&'static Material>, SceneError> {
    let Some(value) = entity.get("material") else { return Ok(None) };
    Ok(Material::named(value.choose("material", &MATERIALS)?))
}

const MATERIALS: Vocabulary = Vocabulary { available: &Material::NAMES, later: &[] };
