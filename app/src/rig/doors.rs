//! From what a scene says of doors to spaces.
//!
//! Space 0 is the world, space `i + 1` is behind the door of the environment `i`.

use haptics::{Door, WORLD};
use world::DoorSpec;

use super::{Rig, RigError};

impl Rig {
    /// Which space something is in that is within this environment.
    pub(crate) fn space(&self, within: Option<&String>) -> u32 {
        let environments = &self.scene.environments;
        let at = within.and_then(|within| environments.iter().position(|own| own.name == *within));
        at.map_or(WORLD, |at| at as u32 + 1)
    }

    /// All doors of the scene.
    pub(crate) fn doors(&self) -> impl Iterator<Item = Result<Door, RigError>> {
        let doors = self.scene.environments.iter().zip(1..);
        doors.filter_map(|(environment, behind)| {
            let door = environment.door.as_ref()?;
            let walls = |name: &String| self.numbered(name);
            Some(self.door(door, behind, environment.parts.iter().filter_map(walls)))
        })
    }

    fn door(&self, door: &DoorSpec, behind: u32, walls: impl Iterator<Item = u32>) -> Result<Door, RigError> {
        // That it is there was checked when the scene was read.
        let hull = self.numbered(&door.of).unwrap_or_default();
        let front =
            self.scene.entities.get(hull as usize).map_or(WORLD, |hull| self.space(hull.within.as_ref()));
        Door::new(hull as usize, door.pose, door.size_m, [front, behind], walls)
            .map_err(|source| self.refused(None, format!("door of {}", door.of), source))
    }

    fn numbered(&self, name: &str) -> Option<u32> {
        self.scene.entities.iter().position(|entity| entity.name == name).map(|number| number as u32)
    }

    /// What the spaces behind doors are called; `None`: there are no doors.
    pub(super) fn space_names(&self) -> Option<Vec<String>> {
        let environments = &self.scene.environments;
        let has_doors = environments.iter().any(|environment| environment.door.is_some());
        has_doors.then(|| environments.iter().map(|environment| environment.name.clone()).collect())
    }
}
