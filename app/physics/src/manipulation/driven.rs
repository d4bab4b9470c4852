//! Entities that somebody moves: plates that carry, walls that push, bodies that are held.
//!
//! Model: for the tick a driven entity is a body of infinite mass with the velocity that takes it to where it is to be. So
//! contacts are damped by how the two move against each other, friction drags along what lies on it, and what it lifts is paid
//! for. Whoever rests near it wakes.
//! Invariants: a tick after the last move it stands still, and its last pose is its pose; no allocation.

use haptics::Entity;
use nalgebra::{Isometry3, Matrix3, UnitQuaternion, Vector3};

use super::Manipulation;
use super::ordered::at_rest;
use crate::body::Body;
use crate::collide::bounding_ball;
use crate::mass::MassProperties;
use crate::pair::fastest_point_m_s;
use crate::roster::Standing;
use crate::solver::Motion;

/// So many entities may be driven at once.
pub const MAX_DRIVEN: usize = 16;

/// An entity on its way.
#[derive(Debug, Clone, Copy)]
pub(super) struct Driven {
    pub(super) entity: usize,
    to_W: Isometry3<f64>,
}

impl Manipulation {
    /// In the next tick this entity goes to this pose; says whether it will: bodies move by themselves unless they are
    /// [held](Self::take_hold), and no more than [`MAX_DRIVEN`] can be driven at once.
    pub fn drive(&mut self, entity: usize, to_W: Isometry3<f64>) -> bool {
        let driven = Driven { entity, to_W };
        if let Some(known) = self.driven.iter_mut().find(|known| known.entity == entity) {
            *known = driven;
            return true;
        }
        let is_free = self.body_of(entity).is_none_or(|body| self.standing(body) == Standing::Elsewhere);
        let goes = is_free && self.driven.len() < MAX_DRIVEN;
        if goes {
            self.driven.push(driven);
        }
        goes
    }

    /// The entities that go somewhere, or came there in the last tick.
    pub fn driven(&self) -> impl Iterator<Item = usize> {
        self.driven.iter().map(|driven| driven.entity)
    }

    /// A tick in which nothing else moves.
    pub fn step_driven(&mut self, entities: &mut [Entity]) {
        self.advance_driven(entities);
    }

    /// Share of its speed with which this entity may be driven on now, 0 to 1: less than 1 where a body near it waits
    /// for its turn in [`Self::step_at_most`], which then comes sooner. Whoever drives several entities that belong together goes by
    /// the least of them.
    pub fn pace_of_driven(&mut self, entity: usize) -> f64 {
        let pace = |body: usize| {
            let waits = self.standing(body) == Standing::Held;
            if waits { self.turns.pace_near(body) } else { 1.0 }
        };
        let mut least = 1.0_f64;
        match self.broad_phase.around(entity) {
            Some(around) => self.broad_phase.near(around, |near| {
                least = least.min(self.body_of(near).map_or(1.0, pace));
            }),
            // Without an end it is near everything.
            None => least = (0..self.roster.bodies.len()).map(pace).fold(least, f64::min),
        }
        self.turns.hurry |= least < 1.0;
        least
    }

    /// Before a tick: wakes who sleeps and could be carried or pushed. Who waits for its turn goes on waiting.
    pub(super) fn wake_near_driven(&mut self, entities: &[Entity]) {
        for at in 0..self.driven.len() {
            let entity = self.driven[at].entity;
            self.neighbours.clear();
            let (neighbours, numbers) = (&mut self.neighbours, &self.roster.numbers);
            match self.broad_phase.around(entity) {
                Some(around) => self.broad_phase.near(around, |near| neighbours.extend(numbers[near])),
                // Without an end it is near everything.
                None => neighbours.extend(0..self.roster.bodies.len() as u32),
            }
            for at in 0..self.neighbours.len() {
                let body = self.neighbours[at] as usize;
                if self.standing(body) != Standing::Held {
                    self.wake(body, entities);
                }
            }
        }
    }

    /// Puts the driven entities behind the bodies that are awake.
    pub(super) fn line_up_driven(&mut self, entities: &[Entity], dt_s: f64) {
        for &Driven { entity, to_W } in &self.driven {
            let (body, motion) = carrier(&entities[entity].X_WB, &to_W, dt_s);
            let speed_m_s = fastest_point_m_s(&entities[entity], &body, &motion);
            self.speeds_m_s.push(speed_m_s);
            self.struck.speeds_m_s.push(speed_m_s);
            self.bodies.push(body);
            self.entities.push(entity);
            self.motions.push(motion);
            self.changes.push(Motion::NONE);
        }
    }

    /// The place of a driven entity in the tick's arrays.
    pub(super) fn place_of_driven(&self, entity: usize) -> Option<usize> {
        let at = self.driven.iter().position(|driven| driven.entity == entity)?;
        Some(self.roster.awake().len() + at)
    }

    /// Takes them to the end of the tick; who moved in it is driven on to where it is, and so comes to rest.
    pub(super) fn advance_driven(&mut self, entities: &mut [Entity]) {
        let mut longest_m = 0.0_f64;
        for at in 0..self.driven.len() {
            let Driven { entity, to_W } = self.driven[at];
            let from_W = entities[entity].X_WB;
            let way_W = to_W.translation.vector - from_W.translation.vector;
            let arm_m = bounding_ball(&entities[entity].shape)
                .map_or(1.0, |(middle, radius_m)| middle.norm() + radius_m);
            longest_m = longest_m.max(way_W.norm() + arm_m * from_W.rotation.angle_to(&to_W.rotation));
            entities[entity].move_to(to_W);
            self.turns.was_driven(entity);
            if let Some(body) = self.body_of(entity) {
                self.roster.bodies[body] = at_rest(&self.roster.bodies[body], &to_W);
                self.note_change(body);
            }
            if self.broad_phase.moved(entity, &entities[entity], &way_W)
                && let Some(around) = self.broad_phase.around(entity).copied()
            {
                self.greet(&around, entities, false);
            }
        }
        self.turns.driven_went(longest_m);
        self.driven.retain(|driven| {
            let entity = &entities[driven.entity];
            entity.previous_X_WB != entity.X_WB
        });
    }
}

/// A body that nothing can move, on the way between two poses.
fn carrier(from_W: &Isometry3<f64>, to_W: &Isometry3<f64>, dt_s: f64) -> (Body, Motion) {
    let turn_W: UnitQuaternion<f64> = to_W.rotation * from_W.rotation.inverse();
    let velocity_W = (to_W.translation.vector - from_W.translation.vector) / dt_s;
    let angular_velocity_W = turn_W.scaled_axis() / dt_s;
    let of_no_matter = MassProperties {
        mass_kg: 1.0,
        centre_B: Vector3::zeros(),
        principal_kg_m2: Vector3::repeat(1.0),
        axes_BP: UnitQuaternion::identity(),
    };
    let body = Body::at_rest(of_no_matter, from_W).moving(velocity_W, angular_velocity_W);
    let inverse_inertia_W = Matrix3::zeros();
    (body, Motion { velocity_W, angular_velocity_W, inverse_mass: 0.0, inverse_inertia_W })
}
