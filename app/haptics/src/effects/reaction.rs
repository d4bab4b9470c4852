//! What an entity does to a finger beside touching it, and so the finger to the entity.

use nalgebra::Vector3;

/// A force between a finger and an entity, in the world frame. The entity gets it with the sign turned.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reaction {
    /// Index of the entity.
    pub entity: usize,
    /// A point of the line that the force acts along: the surface's nearest, or where it is touched \[m\].
    pub point_W: Vector3<f64>,
    /// \[N\]
    pub force_on_user_W: Vector3<f64>,
    /// By how much the force falls while the entity follows it, per way \[N/m\]; 0 where it does not, or grows.
    pub stiffness_n_per_m: f64,
}

/// Reactions of a tick, in room that was made before. Nothing is lost by cloning it.
#[derive(Debug, Clone, Default)]
pub(super) struct Reactions {
    all: Box<[Reaction]>,
    count: usize,
}

impl Reactions {
    pub(super) fn with_room(most: usize) -> Self {
        let nothing = Reaction {
            entity: 0,
            point_W: Vector3::zeros(),
            force_on_user_W: Vector3::zeros(),
            stiffness_n_per_m: 0.0,
        };
        Self { all: vec![nothing; most].into(), count: 0 }
    }

    pub(super) fn clear(&mut self) {
        self.count = 0;
    }

    /// Adds one that is not zero.
    pub(super) fn add(&mut self, reaction: Reaction) {
        if reaction.force_on_user_W == Vector3::zeros() {
            return;
        }
        if let Some(place) = self.all.get_mut(self.count) {
            *place = reaction;
            self.count += 1;
        }
    }

    pub(super) fn scale(&mut self, share: f64) {
        for reaction in self.all.iter_mut().take(self.count) {
            reaction.force_on_user_W *= share;
            reaction.stiffness_n_per_m *= share;
        }
    }

    pub(super) fn as_slice(&self) -> &[Reaction] {
        self.all.get(..self.count).unwrap_or_default()
    }
}
