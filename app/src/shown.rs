//! What of a scene is shown while it runs: in pictures, in a window.

use crate::moments::Moments;
use crate::rig::Rig;
use haptics::Entity;
use view::Stage;

/// A scene to be looked at.
#[derive(Debug, Clone)]
pub struct Shown {
    /// What can be seen of it.
    pub stage: Stage,
    /// Where everything is.
    pub moments: Moments,
}

impl Shown {
    /// Of a rig whose entities, as they are felt, are these.
    pub fn new(rig: &Rig, entities: &[Entity]) -> Self {
        let poses = entities.iter().map(|entity| entity.X_WB).collect();
        let bodies = rig.moving().map(|(index, ..)| index).collect();
        Self {
            stage: Stage::new(&rig.scene, entities),
            moments: Moments::new(rig.scene.fingers.len(), poses, bodies, rig.period_ns),
        }
    }
}
