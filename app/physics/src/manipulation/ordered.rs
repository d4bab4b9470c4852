//! What somebody outside of physics orders: bodies that are put elsewhere by hand, other friction.
//!
//! Model: a body that is held is as if somebody else stepped it: whoever is awake leans on it, and it goes where it is
//! [driven](Manipulation::drive). Let go, it is at rest where it is, whatever it was before: asleep, or parked for good.
//! Invariant: no allocation.

use haptics::Entity;
use nalgebra::Isometry3;

use super::{Manipulation, who};
use crate::body::Body;
use crate::roster::Standing;

impl Manipulation {
    /// Takes a body that is stepped here, or that is parked, out of the play of forces; `false`: somebody else has it.
    pub fn take_hold(&mut self, body: usize, entities: &mut [Entity]) -> bool {
        if self.standing(body).is_away() {
            return false;
        }
        self.give_away(body, entities);
        let entity = self.entity_of(body);
        self.stand_still(body, &mut entities[entity]);
        true
    }

    /// Puts a body that is held somewhere at once.
    pub fn put(&mut self, entity: usize, at_W: &Isometry3<f64>, entities: &mut [Entity]) {
        let Some(body) = self.body_of(entity).filter(|body| self.standing(*body) == Standing::Elsewhere)
        else {
            return;
        };
        let moved = &mut entities[entity];
        moved.move_to(*at_W);
        self.stand_still(body, moved);
        self.was_moved(entity, entities);
    }

    /// Gives a body that was held back to the play of forces, at rest.
    pub fn let_go(&mut self, body: usize, entities: &mut [Entity]) {
        if self.standing(body) != Standing::Elsewhere {
            return;
        }
        let entity = self.entity_of(body);
        self.driven.retain(|driven| driven.entity != entity);
        self.stand_still(body, &mut entities[entity]);
        self.roster.set(body, Standing::Awake);
        self.parked.retain(|parked| parked.entity != entity);
        let who = who(&self.roster, entities, self.contacts);
        self.pairs.follow(body, &who, &self.broad_phase, true);
    }

    /// Takes note that the friction of an entity is another one: who lies on it, or it itself, wakes.
    pub fn has_other_friction(&mut self, entity: usize, entities: &[Entity]) {
        let who = who(&self.roster, entities, self.contacts);
        self.pairs.resurface(entity, &who);
        self.neighbours.clear();
        for (key, _) in self.pairs.iter().filter(|(_, pair)| pair.entities.contains(&entity)) {
            if self.neighbours.len() < self.neighbours.capacity() {
                self.neighbours.push(key.body);
            }
        }
        for at in 0..self.neighbours.len() {
            self.wake(self.neighbours[at] as usize, entities);
        }
    }

    /// All come to rest as far as who touches them is concerned, and go on later as they were.
    pub fn pause(&self, entities: &mut [Entity]) {
        for &body in self.roster.awake() {
            let entity = &mut entities[self.entity_of(body)];
            entity.move_to(entity.X_WB);
        }
    }

    /// At rest where the entity is.
    fn stand_still(&mut self, body: usize, entity: &mut Entity) {
        entity.move_to(entity.X_WB);
        self.roster.bodies[body] = at_rest(&self.roster.bodies[body], &entity.X_WB);
        self.note_change(body);
    }
}

/// The same body, at rest here.
pub(super) fn at_rest(body: &Body, X_WB: &Isometry3<f64>) -> Body {
    let resting = Body::at_rest(body.mass, X_WB);
    if body.rotation_locked { resting.with_rotation_locked() } else { resting }
}
