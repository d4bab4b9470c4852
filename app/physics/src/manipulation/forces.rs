//! The middle of a tick: what all contact points do, and what each body gets (Melder ch. 5).

use haptics::Entity;
use nalgebra::Vector3;

use super::Manipulation;
use crate::integrator::explicit;
use crate::integrator::{Gets, Integrator};
use crate::pair::{End, Response};
use crate::solver::Solved;

impl Manipulation {
    /// What all contact points do in the tick; says how well they were found.
    pub(super) fn find_forces(&mut self, dt_s: f64) -> Solved {
        self.gets.clear();
        self.gets.resize(self.bodies.len(), Gets { gravity_W: self.settings.gravity_W, ..Gets::default() });
        self.gets[self.roster.awake().len()..].iter_mut().for_each(|gets| gets.is_fixed = true);
        // Impulses are always solved for.
        let springs = match self.settings.response {
            Response::Force => self.rows.len(),
            Response::Impulse { .. } => self.touching,
        };
        match self.settings.integrator {
            Integrator::Implicit => {}
            Integrator::Rk4 => {
                self.stages.run(&self.bodies, &self.rows, self.touching, springs, &mut self.gets, dt_s);
                for at in 0..springs {
                    let (force_W, torque_nm) = self.stages.means(at);
                    explicit::fix(&mut self.rows, at, &force_W, torque_nm, &mut self.fixed);
                }
            }
            Integrator::ThesisEuler | Integrator::ThesisEulerGyroscopic => {
                for at in 0..springs {
                    let (force_W, torque_nm) =
                        explicit::at_start(&self.rows[at], &self.bodies, at < self.touching, dt_s);
                    explicit::fix(&mut self.rows, at, &force_W, torque_nm, &mut self.fixed);
                }
            }
        }
        let solved = self.restitution.solve(
            &mut self.solver,
            &mut self.rows,
            &mut self.motions,
            (&self.settings.gravity_W, dt_s),
        );
        explicit::release(&mut self.rows, &mut self.fixed);
        solved
    }

    /// Tells the pairs how the tick ended, and what its being finite took from the bodies: with the velocity of its end for all of
    /// it, half of the mass times the velocity's change squared.
    pub(super) fn settle_pairs(&mut self, entities: &[Entity], dt_s: f64) {
        self.spare_j.clear();
        self.spare_j.extend(self.bodies.iter().zip(&self.motions).map(|(body, motion)| {
            0.5 * body.mass.mass_kg * (motion.velocity_W - body.velocity_W).norm_squared()
        }));
        let end = End { rows: &self.rows, motions: &self.motions, entities, dt_s };
        for at in 0..self.pairs.awake_count() {
            let has_met = |row| self.restitution.has_met(row);
            self.pairs.awake_at(at).1.settle(&end, has_met, &mut self.spare_j);
        }
    }

    /// What each body gets: the Residual Force and Torque Algorithms.
    pub(super) fn sum_up(&mut self) {
        self.gets.iter_mut().for_each(|gets| gets.is_free = true);
        for row in &self.rows {
            let torque_W = row.normal_W * row.torsion.torque_nm;
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
