//! What could touch, one by one: islands, which change sides as a whole.

use haptics::Entity;

use super::Manipulation;
use crate::broad_phase::Aabb;
use crate::collide::bounding_ball;
use crate::pair::REACH_M;
use crate::pairs::Key;
use crate::roster::Standing;

impl Manipulation {
    /// Whether a finger touched a body in the last tick, or holds it by a tie.
    pub fn is_held(&self, body: usize) -> bool {
        let place = self.roster.place(body);
        let touched =
            place.is_some_and(|place| self.room.rows[..self.touching].iter().any(|row| row.body == place));
        touched || self.hand.is_tied_to(body)
    }

    /// Finds the island of a body: all that could touch, one by one. `island` is filled as far as its capacity goes; says
    /// whether that was far enough.
    ///
    /// Cost: a walk through the keys of all pairs and two through all bodies.
    pub fn island(&mut self, body: usize, island: &mut Vec<usize>) -> bool {
        self.island_if(body, island, |_, _| true)
    }

    /// As [`Self::island`], as long as all of it may be in there; `false`: it is not whole.
    pub fn island_if(
        &mut self,
        body: usize,
        island: &mut Vec<usize>,
        may_be: impl Fn(&Self, usize) -> bool,
    ) -> bool {
        island.clear();
        if !self.is_here(body) {
            return true;
        }
        self.join_what_could_touch();
        let first = self.sets.first(body);
        for other in 0..self.roster.bodies.len() {
            if self.is_here(other) && self.sets.first(other) == first {
                if island.len() == island.capacity() || !may_be(self, other) {
                    return false;
                }
                island.push(other);
            }
        }
        true
    }

    /// Makes sets of those that are here and could touch, one by one.
    fn join_what_could_touch(&mut self) {
        self.sets.begin(self.roster.bodies.len());
        for at in 0..self.pairs.key_count() {
            let key = *self.pairs.key_at(at);
            if key.is_near
                && let Some([one, other]) = self.bodies_of(&key)
                && self.is_here(one)
                && self.is_here(other)
            {
                self.sets.join(one, other);
            }
        }
        // Who sleeps wakes with all others of its ring.
        for body in 0..self.roster.bodies.len() {
            if self.roster.standing(body) == Standing::Asleep {
                self.sets.join(body, self.roster.next(body));
            }
        }
    }

    /// Whether the island and something else that is stepped here could meet within this time (s).
    pub fn is_met(&mut self, island: &[usize], entities: &[Entity], ahead_s: f64) -> bool {
        island.iter().for_each(|&body| self.is_marked[body] = true);
        let is_met = self.pairs.keys().filter_map(|key| self.bodies_of(key)).any(|[one, other]| {
            self.is_marked[one] != self.is_marked[other]
                && ![one, other].map(|body| self.roster.standing(body)).contains(&Standing::Elsewhere)
                && self.could_meet([one, other], entities, ahead_s)
        });
        self.unmark(island);
        is_met
    }

    pub(super) fn unmark(&mut self, island: &[usize]) {
        island.iter().for_each(|&body| self.is_marked[body] = false);
    }

    /// Both bodies of a pair, if it is one of two.
    pub(super) fn bodies_of(&self, key: &Key) -> Option<[usize; 2]> {
        Some([key.body as usize, self.roster.numbers[key.entity as usize]? as usize])
    }

    /// Whether two bodies that go on as they do could come to touch within this time (s).
    pub(super) fn could_meet(&self, bodies: [usize; 2], entities: &[Entity], ahead_s: f64) -> bool {
        let soon = bodies.map(|body| {
            let (entity, state) = (&entities[self.roster.entities[body]], &self.roster.bodies[body]);
            let turned_rad = (state.angular_velocity_W().norm() * ahead_s).min(std::f64::consts::PI);
            let (_, radius_m) = bounding_ball(&entity.shape)?;
            let around = Aabb::of_entity(entity)?.swept(&(state.velocity_W * ahead_s));
            Some(around.grown(REACH_M + radius_m * turned_rad))
        });
        !matches!(soon, [Some(one), Some(other)] if !one.overlaps(&other))
    }

    fn is_here(&self, body: usize) -> bool {
        matches!(self.roster.standing(body), Standing::Awake | Standing::Asleep | Standing::Held)
    }
}
