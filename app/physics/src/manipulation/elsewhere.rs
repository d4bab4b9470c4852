//! Bodies that somebody else steps, with another [`Manipulation`] of the same world.
//!
//! Model: both know all entities and bodies; each steps those that are not [`Standing::Elsewhere`] for it. A body that is
//! elsewhere stands where was said last: whoever is awake leans on it as if it were fixed, or it is not there at all
//! ([`Manipulation::without_those_elsewhere`]). Whole islands change sides ([`departure`](super::departure),
//! [`arrival`](super::arrival)).

use haptics::Entity;
use nalgebra::Vector3;

use super::{Manipulation, who};
use crate::body::Body;
use crate::broad_phase::Aabb;
use crate::roster::Standing;

impl Manipulation {
    /// Makes a body one that somebody else steps, who knows it already: what its contacts remember ends here.
    pub fn give_away(&mut self, body: usize, entities: &[Entity]) {
        self.wake(body, entities);
        self.roster.set(body, Standing::Elsewhere);
        let roster = &self.roster;
        let who = who(roster, entities, self.contacts);
        self.pairs.leave(body, |body| roster.standing(body) == Standing::Awake, &who);
    }

    /// As [`Self::give_away`], all of them.
    pub(super) fn give_all_away(&mut self) {
        self.roster.set_all_elsewhere();
        self.pairs.clear();
    }

    /// Visits the bodies that somebody else steps and that who is awake here could meet within this time (s).
    pub fn for_each_met_elsewhere(&self, entities: &[Entity], ahead_s: f64, met: &mut impl FnMut(usize)) {
        for key in self.pairs.awake_keys() {
            let Some(bodies) = self.bodies_of(key) else { continue };
            let elsewhere = |body: &usize| self.roster.standing(*body) == Standing::Elsewhere;
            if let Some(body) = bodies.into_iter().find(elsewhere)
                && self.could_meet(bodies, entities, ahead_s)
            {
                met(body);
            }
        }
    }

    /// Says where a body is that somebody else steps, and how it moves. Nothing happens to one that is stepped here.
    pub fn stands_elsewhere(&mut self, body: usize, state: &Body, entities: &mut [Entity], ahead_s: f64) {
        if self.roster.standing(body) != Standing::Elsewhere {
            return;
        }
        self.stand(body, state, entities, ahead_s);
    }

    /// Takes note that an entity which is no body was moved by somebody: who rests on it wakes. Wherever it was driven to, it is
    /// not on its way any more.
    pub fn was_moved(&mut self, entity: usize, entities: &[Entity]) {
        self.driven.retain(|driven| driven.entity != entity);
        self.broad_phase.was_put(entity, &entities[entity], &Vector3::zeros());
        self.pairs.was_put(entity);
        let Some(around) = self.broad_phase.around(entity).copied() else { return };
        self.neighbours.clear();
        let (neighbours, numbers) = (&mut self.neighbours, &self.roster.numbers);
        self.broad_phase.near(&around, |near| neighbours.extend(numbers[near]));
        for at in 0..self.neighbours.len() {
            self.wake(self.neighbours[at] as usize, entities);
        }
        self.greet(&around, entities, true);
    }

    /// Puts a body that is not stepped here; who is awake where it has come to looks for it.
    pub(super) fn stand(&mut self, body: usize, state: &Body, entities: &mut [Entity], ahead_s: f64) {
        let entity = self.roster.entities[body];
        self.roster.bodies[body] = *state;
        self.note_change(body);
        entities[entity].move_to(state.pose());
        if self.broad_phase.was_put(entity, &entities[entity], &(state.velocity_W * ahead_s))
            && let Some(around) = self.broad_phase.around(entity).copied()
        {
            self.greet(&around, entities, true);
        }
    }

    /// Whoever is awake near a box looks for pairs; whether somebody has put there what is in it.
    pub(super) fn greet(&mut self, around: &Aabb, entities: &[Entity], was_put: bool) {
        self.neighbours.clear();
        let (neighbours, numbers) = (&mut self.neighbours, &self.roster.numbers);
        self.broad_phase.near(around, |near| neighbours.extend(numbers[near]));
        for at in 0..self.neighbours.len() {
            let body = self.neighbours[at] as usize;
            if self.roster.standing(body) == Standing::Awake {
                let who = who(&self.roster, entities, self.contacts);
                self.pairs.follow(body, &who, &self.broad_phase, was_put);
            }
        }
    }
}
