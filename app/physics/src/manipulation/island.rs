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
    /// Cost: some walks through the keys of all pairs, at most one more than bodies; a chain takes two.
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
        let is_whole =
            !self.is_here(body) || (self.mark(body, island, &may_be) && self.mark_all_near(island, &may_be));
        self.unmark(island);
        island.sort_unstable();
        is_whole
    }

    fn mark_all_near(&mut self, island: &mut Vec<usize>, may_be: &impl Fn(&Self, usize) -> bool) -> bool {
        let mut seen = 0;
        while seen < island.len() {
            let new = std::mem::replace(&mut seen, island.len());
            let fits = self.mark_rings(new, island, may_be)
                && self.mark_near(island, false, may_be)
                && self.mark_near(island, true, may_be);
            if !fits {
                return false;
            }
        }
        true
    }

    /// Who sleeps wakes with all others of its ring.
    fn mark_rings(
        &mut self,
        new: usize,
        island: &mut Vec<usize>,
        may_be: &impl Fn(&Self, usize) -> bool,
    ) -> bool {
        let mut at = new;
        while let Some(&one) = island.get(at) {
            at += 1;
            let next = self.roster.next(one);
            if self.roster.standing(one) == Standing::Asleep && !self.mark(next, island, may_be) {
                return false;
            }
        }
        true
    }

    /// One walk through all pairs, in order or against it: so that a chain of any length is found by one of both.
    fn mark_near(
        &mut self,
        island: &mut Vec<usize>,
        backwards: bool,
        may_be: &impl Fn(&Self, usize) -> bool,
    ) -> bool {
        let count = self.pairs.key_count();
        for at in 0..count {
            let key = *self.pairs.key_at(if backwards { count - 1 - at } else { at });
            if key.is_near
                && let Some([one, other]) = self.bodies_of(&key)
                && self.is_marked[one] != self.is_marked[other]
                && !self.mark(if self.is_marked[one] { other } else { one }, island, may_be)
            {
                return false;
            }
        }
        true
    }

    /// Takes a body that is here into the island; says whether there was room, and it may be there.
    fn mark(&mut self, body: usize, island: &mut Vec<usize>, may_be: &impl Fn(&Self, usize) -> bool) -> bool {
        if self.is_marked[body] || !self.is_here(body) {
            return true;
        }
        let has_room = island.len() < island.capacity() && may_be(self, body);
        if has_room {
            self.is_marked[body] = true;
            island.push(body);
        }
        has_room
    }

    pub(super) fn unmark(&mut self, island: &[usize]) {
        island.iter().for_each(|&body| self.is_marked[body] = false);
    }

    /// Whether the island and something else that is stepped here could meet within this time (s).
    pub fn is_met(&self, island: &[usize], entities: &[Entity], ahead_s: f64) -> bool {
        let is_in = |body: usize| island.binary_search(&body).is_ok();
        self.pairs.keys().filter_map(|key| self.bodies_of(key)).any(|[one, other]| {
            is_in(one) != is_in(other)
                && ![one, other].map(|body| self.roster.standing(body)).contains(&Standing::Elsewhere)
                && self.could_meet([one, other], entities, ahead_s)
        })
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
