//! The pictures of a scene: each file is read once for all entities that it lies on.

use super::entities::is_only_seen;
use super::{Problems, RigError};
use haptics::{HeightGrid, HeightMap, HeightMapError, Shape};
use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;
use std::sync::Arc;
use world::picture::load_png;
use world::{HeightMapSpec, Scene, SceneEntity};

/// Heights that are ready to be felt.
#[derive(Debug, Clone, Default)]
pub(super) struct Pictures {
    grids: BTreeMap<PathBuf, Arc<HeightGrid>>,
}

impl Pictures {
    /// Loads every picture of the scene's height maps; those that cannot be had are noted.
    pub(super) fn load(scene: &Scene, problems: &mut Problems) -> Self {
        let mut pictures = Self::default();
        let mut refused = BTreeSet::new();
        let felt = scene.entities.iter().filter(|entity| !is_only_seen(scene, entity));
        for spec in felt.filter_map(|entity| entity.height_map.as_ref()) {
            if pictures.grids.contains_key(&spec.file) || refused.contains(&spec.file) {
                continue;
            }
            match problems.keep(load(spec)) {
                Some(grid) => pictures.grids.insert(spec.file.clone(), Arc::new(grid)).is_none(),
                None => refused.insert(spec.file.clone()),
            };
        }
        pictures
    }

    /// Whether the picture of an entity is there, if it has one.
    pub(super) fn has(&self, entity: &SceneEntity) -> bool {
        entity.height_map.as_ref().is_none_or(|spec| self.grids.contains_key(&spec.file))
    }

    /// A picture that was loaded, on this shape.
    pub(super) fn height_map(&self, spec: &HeightMapSpec, shape: &Shape) -> Result<Arc<HeightMap>, RigError> {
        let grid = match self.grids.get(&spec.file) {
            Some(grid) => Arc::clone(grid),
            None => Arc::new(load(spec)?),
        };
        let refused = |source| RigError::HeightMap { at: Box::new(spec.at.clone()), source };
        let height_map = made(spec, grid).map_err(refused)?;
        height_map.check_fit(shape).map_err(refused)?;
        Ok(Arc::new(height_map))
    }
}

fn made(spec: &HeightMapSpec, grid: Arc<HeightGrid>) -> Result<HeightMap, HeightMapError> {
    let height_map = HeightMap::new(grid, spec.amplitude_m, spec.scale)?
        .with_form(spec.form)
        .with_border(spec.border)
        .with_zero_level(spec.zero_level)?;
    Ok(if spec.invert { height_map.inverted() } else { height_map })
}

fn load(spec: &HeightMapSpec) -> Result<HeightGrid, RigError> {
    load_png(&spec.file).map_err(|source| RigError::Picture {
        at: Box::new(spec.file_at.clone()),
        file: spec.file.clone(),
        source,
    })
}
