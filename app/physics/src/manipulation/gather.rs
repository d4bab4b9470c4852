//! The beginning of a tick: how bodies would move by themselves, and all contact points.

use haptics::Entity;
use nalgebra::Vector3;

use super::{MAX_TOUCHES, Manipulation, moving};
use crate::body::Body;
use crate::hand::{FingerTick, HandStart};
use crate::integrator::mean_angular_velocity_W;
use crate::pair::{Gathered, Start, fastest_point_m_s};
use crate::pairs::Key;
use crate::pull::{MAX_PULLS, Pull};
use crate::roster::Standing;
use crate::solver::Motion;
use crate::touch::Touch;

/// As many contact points as come; with others it can be added to.
const WHAT_COMES: usize = usize::MAX / 2;

impl Manipulation {
    /// How the bodies that are awake would move without anything that touches them; behind them those that others
    /// may lean on.
    pub(super) fn line_up(&mut self, entities: &[Entity], dt_s: f64) {
        self.bodies.clear();
        self.entities.clear();
        self.motions.clear();
        self.changes.clear();
        self.speeds_m_s.clear();
        let fall_W = self.settings.gravity_W * dt_s;
        for &number in self.roster.awake() {
            let (body, entity) = (self.roster.bodies[number], self.roster.entities[number]);
            let mut motion = moving(&body);
            let mut change = Motion { velocity_W: fall_W, ..Motion::NONE };
            motion.velocity_W += fall_W;
            if self.settings.integrator.is_implicit() {
                let mean_W = mean_angular_velocity_W(&body, dt_s);
                change.angular_velocity_W = mean_W - motion.angular_velocity_W;
                motion.angular_velocity_W = mean_W;
            }
            self.changes.push(change);
            self.speeds_m_s.push(fastest_point_m_s(&entities[entity], &body, &motion));
            self.bodies.push(body);
            self.entities.push(entity);
            self.motions.push(motion);
        }
        self.line_up_struck();
    }

    /// All contact points of the tick; says which rows are whose touch and pull.
    pub(super) fn gather(
        &mut self,
        entities: &[Entity],
        touches: &[Touch],
        pulls: &[Pull],
        fingers: &[FingerTick],
        dt_s: f64,
    ) -> ([Option<usize>; MAX_TOUCHES], [Option<usize>; MAX_PULLS]) {
        self.move_in();
        self.room.rows.clear();
        let mut touch_rows = [None; MAX_TOUCHES];
        // Fingers first: they are never left out.
        for (touch, row) in touches.iter().zip(&mut touch_rows) {
            let Some(place) = self.roster.place_of_entity(touch.entity) else { continue };
            let (state, motion) = (&self.bodies[place], moving(&self.bodies[place]));
            *row = Some(self.room.rows.len());
            self.room.rows.push(touch.row(place, &state.centre_W, &motion, &entities[touch.entity], dt_s));
        }
        self.hand.gather(
            &HandStart {
                touches,
                touch_rows: &touch_rows,
                entities,
                roster: &self.roster,
                bodies: &self.bodies,
                gravity_W: self.settings.gravity_W,
                dt_s,
            },
            fingers,
            &mut self.room.rows,
        );
        self.pressing = self.room.rows.len();
        let pull_rows = self.gather_pulls(pulls, dt_s);
        self.touching = self.room.rows.len();
        self.room.restitution.meetings.clear();
        let mut left_out = 0;
        let grows = self.pairs.grow();
        let room = if grows { WHAT_COMES } else { self.room.rows.capacity() - self.room.rows.len() };
        let [most_rows, of_bodies] = [room, room - room / 4].map(|room| self.room.rows.len() + room);
        for at in 0..self.pairs.awake_count() {
            let (key, _) = self.pairs.awake_at(at);
            let other = self.roster.place_of_entity(key.entity as usize);
            let other = other.or_else(|| self.place_of_driven(key.entity as usize));
            if self.ignores_elsewhere && self.is_elsewhere(&key) {
                self.pairs.awake_at(at).1.pass_by();
                self.pairs.set_near(at, false);
                continue;
            }
            // Of two of which only the second is awake the first is what it leans on.
            let first = match self.roster.place(key.body as usize) {
                Some(place) => place,
                None => self.lean_on(key.body as usize),
            };
            let (_, pair) = self.pairs.awake_at(at);
            for place in [Some(first), other].into_iter().flatten() {
                if let Some(&body) = self.roster.awake().get(place) {
                    self.roster.owed_j[body] = pair.pay(self.roster.owed_j[body]);
                }
            }
            let start = Start {
                entities,
                bodies: &self.bodies,
                motions: &self.motions,
                changes: &self.changes,
                speeds_m_s: &self.speeds_m_s,
                struck_m_s: &self.struck.speeds_m_s,
                dt_s,
                is_implicit: self.settings.integrator.is_implicit(),
            };
            pair.bodies = (first, other);
            let is_with_body = self.roster.numbers[key.entity as usize].is_some();
            let is_near = pair.gather(
                &start,
                &mut Gathered {
                    rows: &mut self.room.rows,
                    most_rows: if is_with_body { of_bodies } else { most_rows },
                    left_out: &mut left_out,
                    meetings: &mut self.room.restitution.meetings,
                    last: &mut self.last_anchors,
                },
            );
            self.pairs.set_near(at, is_near);
        }
        if grows {
            self.room.solver.make_room_for(self.room.rows.len());
        }
        self.pairs.left_out += left_out + std::mem::take(&mut self.pairs.missing);
        (touch_rows, pull_rows)
    }

    /// The rows of pulls; says which are whose.
    fn gather_pulls(&mut self, pulls: &[Pull], dt_s: f64) -> [Option<usize>; MAX_PULLS] {
        let mut pull_rows = [None; MAX_PULLS];
        for (pull, place) in pulls.iter().zip(&mut pull_rows) {
            let Some(body) = self.roster.place_of_entity(pull.entity) else { continue };
            let (state, motion) = (&self.bodies[body], moving(&self.bodies[body]));
            if let Some(row) = pull.row(body, &state.centre_W, &motion, dt_s) {
                *place = Some(self.room.rows.len());
                self.room.rows.push(row);
            }
        }
        pull_rows
    }

    /// Whether one of a pair is stepped by somebody else.
    fn is_elsewhere(&self, key: &Key) -> bool {
        let other = self.roster.numbers[key.entity as usize].map(|other| other as usize);
        [Some(key.body as usize), other]
            .into_iter()
            .flatten()
            .any(|body| self.roster.standing(body) == Standing::Elsewhere)
    }

    /// The place of a body that others may lean on: as if it were fixed.
    fn lean_on(&mut self, number: usize) -> usize {
        let (awake, entity) = (self.roster.awake().len(), self.roster.entities[number]);
        if let Some(known) = self.entities[awake..].iter().position(|known| *known == entity) {
            return awake + known;
        }
        let zero = Vector3::zeros();
        let still = Body { velocity_W: zero, angular_momentum_W: zero, ..self.roster.bodies[number] };
        let inverse_inertia_W = nalgebra::Matrix3::zeros();
        self.motions.push(Motion { inverse_mass: 0.0, inverse_inertia_W, ..moving(&still) });
        self.changes.push(Motion::NONE);
        self.bodies.push(still);
        self.entities.push(entity);
        self.speeds_m_s.push(0.0);
        self.struck.speeds_m_s.push(0.0);
        self.entities.len() - 1
    }
}
