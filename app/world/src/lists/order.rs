//! What people order, as the slow side has to know it.

use super::link::Claim;
use super::slow::SlowList;
use haptics::Friction;
use nalgebra::Isometry3;

/// For the slow side, in the order of its queue.
#[derive(Debug)]
pub enum SlowOrder {
    /// Its world is the one that runs now.
    Begin,
    /// Nothing moves by itself until it is told to go on.
    Pause(bool),
    /// An entity that is no body stands here now.
    Move {
        /// Its number.
        entity: u32,
        /// `X_WB`.
        to_W: Isometry3<f64>,
    },
    /// An entity has this friction now.
    Friction {
        /// Its number.
        entity: u32,
        /// Which.
        friction: Friction,
    },
    /// This body is to be handed over, whatever it is doing.
    Fetch(Claim),
}

/// So many may wait: of each entity that is moved those of some ticks.
pub(super) const MOST_ORDERS: usize = 256;

impl SlowList {
    /// Whether its world runs. One that [waits](Self::waiting) does not until it is told to.
    pub fn has_begun(&self) -> bool {
        self.has_begun
    }

    /// Whether its world is no more: nobody is left to hand anything to.
    pub fn is_over(&self) -> bool {
        self.end.claims.is_abandoned()
    }

    /// One whose world does not run yet.
    #[must_use]
    pub fn waiting(mut self) -> Self {
        self.has_begun = false;
        self
    }

    pub(super) fn take_orders(&mut self) {
        while let Ok(order) = self.end.orders.pop() {
            match order {
                SlowOrder::Begin => self.has_begun = true,
                SlowOrder::Pause(is_paused) => self.is_paused = is_paused,
                SlowOrder::Move { entity, to_W } => {
                    let moved = &mut self.entities[entity as usize];
                    (moved.X_WB, moved.previous_X_WB) = (to_W, to_W);
                    self.manipulation.was_moved(entity as usize, &self.entities);
                }
                SlowOrder::Friction { entity, friction } => {
                    self.entities[entity as usize].friction = friction;
                    self.manipulation.has_other_friction(entity as usize, &self.entities);
                }
                SlowOrder::Fetch(claim) => self.fetch(claim),
            }
        }
    }
}
