//! Which entities pressed each other in the last tick.

use nalgebra::Vector3;

use super::Manipulation;
use crate::roster::Standing;

/// Stepping of two entities, by which what they do to each other can change.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PairStanding {
    /// One of them is awake, or neither ever will be.
    Stepped,
    /// One of them sleeps, and none is awake: what they did to each other, they still do.
    Asleep,
    /// One of them waits for its turn, and none is awake: time stands still for it.
    Waiting,
    /// One of them is elsewhere or on its way, and none is awake.
    Away,
}

impl Manipulation {
    /// The entities of which at least one was awake and which touched in the last tick, and the force on the first of the
    /// two \[N\]: in the order of bodies, the first being the body of the lower number.
    pub fn pair_forces(&self) -> impl Iterator<Item = ([usize; 2], Vector3<f64>)> {
        self.pairs.iter_awake().map(|(_, pair)| (pair.entities, pair.force_W(&self.room.rows)))
    }

    /// Standing of these two, of which the last tick may tell no force.
    pub fn pair_standing(&self, entities: [usize; 2]) -> PairStanding {
        let standings = entities.map(|entity| Some(self.standing(self.body_of(entity)?)));
        let is_any = |of: fn(Standing) -> bool| standings.into_iter().flatten().any(of);
        if is_any(|standing| standing == Standing::Awake) {
            PairStanding::Stepped
        } else if is_any(Standing::is_away) {
            PairStanding::Away
        } else if is_any(|standing| standing == Standing::Held) {
            PairStanding::Waiting
        } else if is_any(|standing| standing == Standing::Asleep) {
            PairStanding::Asleep
        } else {
            PairStanding::Stepped
        }
    }
}
