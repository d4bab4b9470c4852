//! Bodies that go from one [`Manipulation`] to another one of the same world, which another thread steps.
//!
//! Model: both know all entities and bodies; each steps those that are not [`Standing::Elsewhere`] for it. What crosses is
//! sent by value, in parcels: each body's state, and what every pair of it remembers of where it touches. So friction holds
//! where it held, and an island that rests goes on resting. Only whole islands may go: whoever stays is not touched by them.
//! A body that is elsewhere stands where was said last: whoever is awake leans on it as if it were fixed.
//! Invariant: no allocation; nothing is lost whatever is refused: [`Manipulation::release`] is all or nothing.

use haptics::Entity;
use nalgebra::{Isometry3, Vector3};

use super::{Manipulation, who};
use crate::body::Body;
use crate::broad_phase::Aabb;
use crate::collide::bounding_ball;
use crate::pair::{Pair, REACH_M};
use crate::pairs::Key;
use crate::roster::Standing;

/// A part of an island on its way.
#[derive(Debug, Clone)]
pub struct Parcel(Content);

#[derive(Debug, Clone)]
#[allow(clippy::large_enum_variant)] // By value through a queue of fixed size: nothing may be on the heap.
enum Content {
    /// A body of this number.
    Body { number: u32, state: Body, previous_X_WB: Isometry3<f64>, is_asleep: bool, rested_s: f64 },
    /// What two entities remember of each other.
    Pair { key: Key, pair: Pair },
    /// The island is complete.
    End,
}

impl Parcel {
    /// Which body this is, if it is one.
    pub fn body(&self) -> Option<usize> {
        match &self.0 {
            Content::Body { number, .. } => Some(*number as usize),
            _ => None,
        }
    }

    /// Whether it is the last one of its island.
    pub fn is_last(&self) -> bool {
        matches!(self.0, Content::End)
    }
}

impl Manipulation {
    /// Makes a body one that somebody else steps, before the first tick.
    pub fn give_away(&mut self, body: usize, entities: &[Entity]) {
        self.wake(body, entities);
        self.roster.set(body, Standing::Elsewhere);
        self.leave_pairs(body, entities);
    }

    /// As [`Self::give_away`], all of them.
    pub fn give_all_away(&mut self) {
        self.roster.set_all_elsewhere();
        self.pairs.clear();
    }

    /// Visits the bodies that somebody else steps and that who is awake here could meet within this time (s).
    pub fn for_each_met_elsewhere(&self, entities: &[Entity], ahead_s: f64, met: &mut impl FnMut(usize)) {
        for (key, _) in self.pairs.iter_awake() {
            let Some(bodies) = self.bodies_of(&key) else { continue };
            let elsewhere = |body: &usize| self.roster.standing(*body) == Standing::Elsewhere;
            if let Some(body) = bodies.into_iter().find(elsewhere)
                && self.could_meet(bodies, entities, ahead_s)
            {
                met(body);
            }
        }
    }

    /// Whether a finger touched a body in the last tick, or holds it by a tie.
    pub fn is_held(&self, body: usize) -> bool {
        let place = self.roster.place(body);
        let touched =
            place.is_some_and(|place| self.rows[..self.touching].iter().any(|row| row.body == place));
        touched || self.hand.is_tied_to(body)
    }

    /// Finds the island of a body: all that could touch, one by one. `island` is filled as far as its capacity goes; says
    /// whether that was far enough.
    pub fn island(&self, body: usize, island: &mut Vec<usize>) -> bool {
        island.clear();
        if !self.is_here(body) || island.capacity() == 0 {
            return self.is_here(body);
        }
        island.push(body);
        let mut at = 0;
        while let Some(&one) = island.get(at) {
            at += 1;
            for (key, pair) in self.pairs.iter().filter(|(_, pair)| pair.is_near) {
                let other = self.roster.numbers[key.entity as usize].map(|other| other as usize);
                let bodies = [Some(key.body as usize), other];
                if !bodies.contains(&Some(one)) {
                    continue;
                }
                let _ = pair;
                for other in bodies.into_iter().flatten().filter(|&other| self.is_here(other)) {
                    if island.contains(&other) {
                        continue;
                    }
                    if island.len() == island.capacity() {
                        return false;
                    }
                    island.push(other);
                }
            }
            // Who sleeps wakes with all others of its ring.
            let mut next = one;
            while self.roster.standing(one) == Standing::Asleep {
                next = self.roster.next(next);
                if next == one {
                    break;
                }
                if !island.contains(&next) {
                    if island.len() == island.capacity() {
                        return false;
                    }
                    island.push(next);
                }
            }
        }
        island.sort_unstable();
        true
    }

    /// Whether the island and something else that is stepped here could meet within this time (s).
    pub fn is_met(&self, island: &[usize], entities: &[Entity], ahead_s: f64) -> bool {
        let is_in = |body: usize| island.binary_search(&body).is_ok();
        self.pairs.iter().filter_map(|(key, _)| self.bodies_of(&key)).any(|[one, other]| {
            is_in(one) != is_in(other)
                && self.is_here(one)
                && self.is_here(other)
                && self.could_meet([one, other], entities, ahead_s)
        })
    }

    /// Both bodies of a pair, if it is one of two.
    fn bodies_of(&self, key: &Key) -> Option<[usize; 2]> {
        Some([key.body as usize, self.roster.numbers[key.entity as usize]? as usize])
    }

    /// Whether two bodies that go on as they do could come to touch within this time (s).
    fn could_meet(&self, bodies: [usize; 2], entities: &[Entity], ahead_s: f64) -> bool {
        let soon = bodies.map(|body| {
            let (entity, state) = (&entities[self.roster.entities[body]], &self.roster.bodies[body]);
            let turned_rad = (state.angular_velocity_W().norm() * ahead_s).min(std::f64::consts::PI);
            let (_, radius_m) = bounding_ball(&entity.shape)?;
            let around = Aabb::of_entity(entity)?.swept(&(state.velocity_W * ahead_s));
            Some(around.grown(REACH_M + radius_m * turned_rad))
        });
        !matches!(soon, [Some(one), Some(other)] if !one.overlaps(&other))
    }

    /// How many parcels an island makes.
    pub fn parcels(&self, island: &[usize]) -> usize {
        let goes = |(key, _): &(Key, &Pair)| self.goes_along(key, island);
        island.len() + self.pairs.iter().filter(goes).count() + 1
    }

    /// Gives a whole [island](Self::island) away, parcel by parcel.
    pub fn release(&mut self, island: &[usize], entities: &[Entity], mut give: impl FnMut(Parcel)) {
        for &body in island {
            give(Parcel(Content::Body {
                number: body as u32,
                state: self.roster.bodies[body],
                previous_X_WB: entities[self.roster.entities[body]].previous_X_WB,
                is_asleep: self.roster.standing(body) == Standing::Asleep,
                rested_s: self.roster.rested_s[body],
            }));
        }
        for (key, pair) in self.pairs.iter().filter(|(key, _)| self.goes_along(key, island)) {
            give(Parcel(Content::Pair { key, pair: pair.clone() }));
        }
        give(Parcel(Content::End));
        for &body in island {
            self.roster.set(body, Standing::Elsewhere);
            self.note_change(body);
        }
        for &body in island {
            self.leave_pairs(body, entities);
        }
    }

    /// Takes a parcel in.
    pub fn accept(&mut self, parcel: &Parcel, entities: &mut [Entity]) {
        match &parcel.0 {
            Content::Body { number, state, previous_X_WB, is_asleep, rested_s } => {
                let body = *number as usize;
                self.stand(body, state, entities, 0.0);
                // What moved in the last tick drags friction along in this one.
                entities[self.roster.entities[body]].previous_X_WB = *previous_X_WB;
                self.roster.set(body, if *is_asleep { Standing::Asleep } else { Standing::Awake });
                self.roster.rested_s[body] = *rested_s;
                match self.arriving.filter(|_| *is_asleep) {
                    Some(first) => self.roster.join(first, body),
                    None => self.arriving = Some(body).filter(|_| *is_asleep),
                }
                if !is_asleep {
                    let who = who(&self.roster, entities, self.settings.response);
                    self.pairs.follow(body, &who, &self.broad_phase);
                }
            }
            Content::Pair { key, pair } => {
                let who = who(&self.roster, entities, self.settings.response);
                let is_awake = |body: usize| self.roster.standing(body) == Standing::Awake;
                self.pairs.put(*key, pair, is_awake, &who);
            }
            Content::End => self.arriving = None,
        }
    }

    /// Says where a body is that somebody else steps, and how it moves. Nothing happens to one that is stepped here.
    pub fn stands_elsewhere(&mut self, body: usize, state: &Body, entities: &mut [Entity], ahead_s: f64) {
        if self.roster.standing(body) != Standing::Elsewhere {
            return;
        }
        self.stand(body, state, entities, ahead_s);
        let Some(around) = self.broad_phase.around(self.roster.entities[body]).copied() else { return };
        self.greet(&around, entities);
    }

    /// Takes note that an entity which is no body was moved by somebody: who rests on it wakes.
    pub fn was_moved(&mut self, entity: usize, entities: &[Entity]) {
        self.broad_phase.moved(entity, &entities[entity], &Vector3::zeros());
        let Some(around) = self.broad_phase.around(entity).copied() else { return };
        self.neighbours.clear();
        let (neighbours, numbers) = (&mut self.neighbours, &self.roster.numbers);
        self.broad_phase.near(&around, |near| neighbours.extend(numbers[near]));
        for at in 0..self.neighbours.len() {
            self.wake(self.neighbours[at] as usize, entities);
        }
        self.greet(&around, entities);
    }

    fn stand(&mut self, body: usize, state: &Body, entities: &mut [Entity], ahead_s: f64) {
        let entity = self.roster.entities[body];
        self.roster.bodies[body] = *state;
        self.note_change(body);
        entities[entity].move_to(state.pose());
        self.broad_phase.moved(entity, &entities[entity], &(state.velocity_W * ahead_s));
    }

    /// Whoever is awake near a box looks for pairs.
    pub(super) fn greet(&mut self, around: &Aabb, entities: &[Entity]) {
        self.neighbours.clear();
        let (neighbours, numbers) = (&mut self.neighbours, &self.roster.numbers);
        self.broad_phase.near(around, |near| neighbours.extend(numbers[near]));
        for at in 0..self.neighbours.len() {
            let body = self.neighbours[at] as usize;
            if self.roster.standing(body) == Standing::Awake {
                let who = who(&self.roster, entities, self.settings.response);
                self.pairs.follow(body, &who, &self.broad_phase);
            }
        }
    }

    /// Ends the pairs of a body that is gone, but for those with who is awake here.
    fn leave_pairs(&mut self, body: usize, entities: &[Entity]) {
        let who = who(&self.roster, entities, self.settings.response);
        self.pairs.leave(body, &who);
        if let Some(around) = self.broad_phase.around(who.entities[body]).copied() {
            self.greet(&around, entities);
        }
    }

    fn is_here(&self, body: usize) -> bool {
        matches!(self.roster.standing(body), Standing::Awake | Standing::Asleep)
    }

    /// Whether a pair goes along with an island: all but those with bodies that stay.
    fn goes_along(&self, key: &Key, island: &[usize]) -> bool {
        let is_in = |body: usize| island.binary_search(&body).is_ok();
        match self.roster.numbers[key.entity as usize] {
            Some(other) => is_in(key.body as usize) && is_in(other as usize),
            None => is_in(key.body as usize),
        }
    }
}
