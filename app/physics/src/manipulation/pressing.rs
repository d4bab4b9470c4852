//! Which entities pressed each other in the last tick.

use nalgebra::Vector3;

use super::Manipulation;
use crate::roster::Standing;

impl Manipulation {
    /// The entities of which at least one was awake and which touched in the last tick, and the force on the first of the
    /// two \[N\]: in the order of bodies, the first being the body of the lower number.
    pub fn pair_forces(&self) -> impl Iterator<Item = ([usize; 2], Vector3<f64>)> {
        self.pairs.iter_awake().map(|(_, pair)| (pair.entities, pair.force_W(&self.room.rows)))
    }

    /// True if nobody steps these two at the time because at least one of them sleeps, or waits for its turn: what they did to
    /// each other, they still do.
    pub fn rest_together(&self, entities: [usize; 2]) -> bool {
        let mut standings =
            entities.into_iter().filter_map(|entity| self.body_of(entity)).map(|body| self.standing(body));
        let [first, second] = [standings.next(), standings.next()];
        let is_asleep = |standing| matches!(standing, Some(Standing::Asleep | Standing::Held));
        let is_awake = |standing| standing == Some(Standing::Awake);
        (is_asleep(first) || is_asleep(second)) && !is_awake(first) && !is_awake(second)
    }
}
