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
    /// Of a rig whose entities, as they are felt, are these. Reads textures, which may take long.
    pub fn new(rig: &Rig, entities: &[Entity]) -> Self {
        Self::on(Stage::new(&rig.scene, entities), rig, entities)
    }

    /// The same on a stage that was made of the rig's scene already.
    pub fn on(stage: Stage, rig: &Rig, entities: &[Entity]) -> Self {
        let poses = entities.iter().map(|entity| entity.X_WB).collect();
        let bodies = rig.moving().map(|(index, ..)| index).collect();
        Self { stage, moments: Moments::new(rig.scene.fingers.len(), poses, bodies, rig.period_ns) }
    }
}
