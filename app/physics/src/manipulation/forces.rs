//! The middle of a tick: what all contact points do, and what each body gets (Melder ch. 5).

use haptics::Entity;
use nalgebra::Vector3;

use super::Manipulation;
use crate::body::Body;
use crate::integrator::explicit;
use crate::integrator::{Gets, Integrator};
use crate::pair::{End, Response};
use crate::solver::{Motion, Solved};

impl Manipulation {
    /// What all contact points do in the tick; says how well they were found.
    pub(super) fn find_forces(&mut self, dt_s: f64) -> Solved {
        self.gets.clear();
        self.gets.resize(self.bodies.len(), Gets { gravity_W: self.settings.gravity_W, ..Gets::default() });
        self.gets[self.roster.awake().len()..].iter_mut().for_each(|gets| gets.is_fixed = true);
        // Impulses are always solved for.
        let springs = match self.settings.response {
            Response::Force | Response::Bounce { .. } => self.room.rows.len(),
            Response::Impulse { .. } => self.touching,
        };
        match self.settings.integrator {
            Integrator::Implicit => {}
            Integrator::Rk4 => {
                self.room.stages.run(
                    &self.bodies,
                    &self.room.rows,
                    self.touching,
                    springs,
                    &mut self.gets,
                    dt_s,
                );
                for at in 0..springs {
                    let (force_W, torque_nm) = self.room.stages.means(at);
                    explicit::fix(&mut self.room.rows, at, &force_W, torque_nm, &mut self.room.fixed);
                }
            }
            Integrator::ThesisEuler | Integrator::ThesisEulerGyroscopic | Integrator::ThesisEulerPrinted => {
                for at in 0..springs {
                    let (force_W, torque_nm) =
                        explicit::at_start(&self.room.rows[at], &self.bodies, at < self.touching, dt_s);
                    explicit::fix(&mut self.room.rows, at, &force_W, torque_nm, &mut self.room.fixed);
                }
            }
        }
        let solved = self.room.restitution.solve(
            &mut self.room.solver,
            &mut self.room.rows,
            (&mut self.motions, &self.changes),
            (&self.settings.gravity_W, dt_s),
        );
        explicit::release(&mut self.room.rows, &mut self.room.fixed);
        solved
    }

    /// Tells the pairs how the tick ended, and what its being finite took from the bodies; what it gave them they owe.
    pub(super) fn settle_pairs(&mut self, entities: &[Entity], dt_s: f64) {
        let states = self.bodies.iter().zip(&self.motions).zip(&self.gets);
        self.spare_j.clear();
        self.spare_j.extend(states.map(|((body, motion), gets)| taken_j(body, motion, gets, dt_s)));
        for (spare_j, &body) in self.spare_j.iter_mut().zip(self.roster.awake()) {
            *spare_j -= self.roster.owed_j[body];
        }
        let end = End { rows: &self.room.rows, motions: &self.motions, entities, dt_s };
        let islands = self.room.solver.islands();
        self.impulses_j.clear();
        self.impulses_j.resize(islands.iter().len(), 0.0);
        for (body, put_in_j) in self.pairs.iter_awake().filter_map(|(_, pair)| pair.impulses_j(&end)) {
            if let Some(island) = islands.island_of(body) {
                self.impulses_j[island] += put_in_j;
            }
        }
        for (bodies, &put_in_j) in islands.iter().zip(&self.impulses_j) {
            share_out(put_in_j, bodies, &mut self.spare_j);
        }
        for at in 0..self.pairs.awake_count() {
            let has_met = |row| self.room.restitution.has_met(row);
            self.pairs.awake_at(at).1.settle(&end, has_met, &mut self.spare_j);
        }
        for place in 0..self.roster.awake().len() {
            let body = self.roster.awake()[place];
            self.roster.owed_j[body] = (-self.spare_j[place]).max(0.0);
        }
    }

    /// What each body gets: the Residual Force and Torque Algorithms.
    pub(super) fn sum_up(&mut self) {
        self.gets.iter_mut().for_each(|gets| gets.is_free = true);
        for row in &self.room.rows {
            let torque_W = row.torque_W();
            let sides = [(Some(row.body), 1.0), (row.other, -1.0)];
            for ((body, sign), arm_W) in sides.into_iter().zip(&row.arms_W) {
                let Some(body) = body else { continue };
                let gets = &mut self.gets[body];
                gets.wrench.add(&(row.force_W * sign), arm_W);
                gets.wrench.torque_W += torque_W * sign;
                gets.is_free &= row.force_W == Vector3::zeros() && torque_W == Vector3::zeros();
            }
        }
    }
}

/// Takes what the impulses of an island put in from what the tick took from its bodies (J): that the tick has not taken. What is
/// more is owed: an impulse has pushed a body into the spring of another pair. What they took pays what is owed.
fn share_out(put_in_j: f64, bodies: &[usize], spare_j: &mut [f64]) {
    let mut left_j = put_in_j;
    for &body in bodies {
        let of_body_j = &mut spare_j[body];
        let part_j =
            if left_j > 0.0 { left_j.min(of_body_j.max(0.0)) } else { left_j.max(of_body_j.min(0.0)) };
        *of_body_j -= part_j;
        left_j -= part_j;
    }
    if let Some(&body) = bodies.first() {
        spare_j[body] -= left_j.max(0.0);
    }
}

/// What a tick took from a body (J), negative: what it gave: the work on it as the rows see it, with the velocities that they were
/// solved for, less what its energy grew by.
fn taken_j(body: &Body, motion: &Motion, gets: &Gets, dt_s: f64) -> f64 {
    // What flies freely falls exactly.
    if gets.is_fixed || gets.is_free {
        return 0.0;
    }
    let along_j = 0.5 * body.mass.mass_kg * (motion.velocity_W - body.velocity_W).norm_squared();
    let turned_W = gets.wrench.torque_W * dt_s;
    // Momentum grows at once, under axes that stand still.
    let mean_W = motion.inverse_inertia_W * (body.angular_momentum_W + turned_W * 0.5);
    let taken_j = along_j + turned_W.dot(&(motion.angular_velocity_W - mean_W));
    if taken_j.is_finite() { taken_j } else { 0.0 }
}
