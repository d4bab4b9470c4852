//! Entities without a mass that orders have moved, as the slow side has to know them.
//!
//! Model: rows tell of bodies, which move by themselves. What else is moved is told beside them, with the row of the tick that
//! began with it there; what was told once stays there until it is told again, or another scene goes on.
//! Invariant: no allocation after `new`.

use haptics::Entity;
use nalgebra::Isometry3;

/// Entities and where they stand.
pub type Placed = (u32, Isometry3<f64>);

/// Who was moved, and what of it has not been sent yet.
#[derive(Debug, Default)]
pub struct Displaced {
    /// To be sent, each entity once.
    pending: Vec<Placed>,
    /// All that were moved since the scene began, in ascending order.
    moved: Vec<u32>,
}

impl Displaced {
    /// For so many entities, none of which has been moved.
    pub fn new(entities: usize) -> Self {
        Self { pending: Vec::with_capacity(entities), moved: Vec::with_capacity(entities) }
    }

    /// These stand there as a tick begins.
    pub fn note(&mut self, placed: &[Placed]) {
        for &(entity, pose) in placed {
            if let Err(at) = self.moved.binary_search(&entity) {
                self.moved.insert(at, entity);
            }
            match self.pending.iter_mut().find(|(waiting, _)| *waiting == entity) {
                Some(waiting) => waiting.1 = pose,
                None => self.pending.push((entity, pose)),
            }
        }
    }

    /// The scene begins anew: all are where they were.
    pub fn begin_anew(&mut self, entities: &[Entity]) {
        self.pending.clear();
        let back =
            self.moved.drain(..).filter_map(|entity| Some((entity, entities.get(entity as usize)?.X_WB)));
        self.pending.extend(back);
    }

    /// What is to be sent; who sends it takes it out.
    pub fn pending(&mut self) -> &mut Vec<Placed> {
        &mut self.pending
    }
}
