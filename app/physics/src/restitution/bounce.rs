//! Bounces that would give energy give less.
//!
//! Problem: reflecting normal velocities (Melder eq. 6.1) takes energy from a ball. At several points at once, or beside
//! friction that takes spin along, the same rule can give energy: a box that lands on two corners of which one rises already
//! leaves faster than it came (T. Kane's paradox).
//!
//! Model: beside the forces with the full bounce those without any are found, which only take. Forces in between are in every
//! cone too, and the velocities that they leave are as much in between; so the largest share of the bounce whose impulses do not
//! work on the body is the root of a quadratic equation. The work of an impulse P is that with the mean of the velocities
//! before and after it. Gravity changes both within the tick, while the body goes on with the velocity of the tick's end: of
//! kinetic energy and height together, `P (v_0 - g dt + v_1) / 2 - m (g dt)^2 / 2` is what contacts put in.
//! Invariant: forces and velocities still belong together, and forces on users are still those that bodies got.
//! Cost: a second solution, in ticks with an impact that gives energy only.

use nalgebra::Vector3;

use super::velocity;
use crate::row::Row;
use crate::solver::{Motion, Solver};

/// Room for both solutions.
#[derive(Debug, Clone, Default)]
pub(super) struct Bounce {
    freely: Vec<Motion>,
    bouncing: Vec<Motion>,
    /// Of each row, with the full bounce.
    forces_W: Vec<Vector3<f64>>,
    /// Of each body, how much of the bounce it gets.
    shares: Vec<f64>,
}

impl Bounce {
    pub(super) fn with_capacity(rows: usize, bodies: usize) -> Self {
        Self {
            freely: Vec::with_capacity(bodies),
            bouncing: Vec::with_capacity(bodies),
            forces_W: Vec::with_capacity(rows),
            shares: Vec::with_capacity(bodies),
        }
    }

    /// Solves for the forces of rows that are all reflected, such that they give no energy.
    pub(super) fn solve(
        &mut self,
        solver: &mut Solver,
        rows: &mut [Row],
        motions: &mut [Motion],
        (changes, dt_s): (&[Motion], f64),
    ) {
        self.freely.clear();
        self.freely.extend_from_slice(motions);
        solver.solve(rows, motions, dt_s);
        if !self.gives_energy(rows, motions, (changes, dt_s)) {
            return;
        }
        self.bouncing.clear();
        self.bouncing.extend_from_slice(motions);
        self.forces_W.clear();
        self.forces_W.extend(rows.iter().map(|row| row.force_W));
        motions.copy_from_slice(&self.freely);
        for row in rows.iter_mut() {
            let rest_n = row.normal_W.dot(&row.rest_W);
            row.rest_W -= row.normal_W * rest_n.max(0.0);
        }
        solver.solve(rows, motions, dt_s);
        self.find_shares(rows, motions, (changes, dt_s));
        self.mix(rows, motions);
    }

    /// Whether the impulses of any body work on it.
    fn gives_energy(&mut self, rows: &[Row], motions: &[Motion], (changes, dt_s): (&[Motion], f64)) -> bool {
        self.shares.clear();
        self.shares.resize(motions.len(), 0.0);
        for row in rows {
            let work = row.force_W.dot(&(self.before_W(row, changes) + velocity(row, motions)));
            self.shares[row.body] += work;
            if let Some(other) = row.other {
                self.shares[other] += work;
            }
        }
        let mut all = self.shares.iter().zip(motions.iter().zip(changes));
        all.any(|(work, (motion, change))| *work > free_w(motion, change, dt_s))
    }

    /// How fast the contact point would have to move before the tick for the work to be that of both ends' mean.
    fn before_W(&self, row: &Row, changes: &[Motion]) -> Vector3<f64> {
        velocity(row, &self.freely) - velocity(row, changes) * 2.0
    }

    /// With `s` of the bounce, forces `f_0 + s f` and velocities `u_0 + s u` work `a + b s + c s^2`.
    fn find_shares(&mut self, rows: &[Row], motions: &[Motion], (changes, dt_s): (&[Motion], f64)) {
        let mut least_coupled = 1.0_f64;
        for body in 0..motions.len() {
            let (mut a, mut b, mut c) = (-free_w(&motions[body], &changes[body], dt_s), 0.0, 0.0);
            let own = rows.iter().zip(&self.forces_W);
            for (row, force_W) in own.filter(|(row, _)| row.body == body || row.other == Some(body)) {
                let f_0 = row.force_W;
                let f = force_W - f_0;
                let u_0 = self.before_W(row, changes) + velocity(row, motions);
                let u = velocity(row, &self.bouncing) - velocity(row, motions);
                a += f_0.dot(&u_0);
                b += f_0.dot(&u) + f.dot(&u_0);
                c += f.dot(&u);
            }
            // What was too deep and is let out works without any bounce.
            let share = largest_share(a.min(0.0), b, c);
            self.shares[body] = share;
            if rows.iter().any(|row| row.other.is_some() && (row.body == body || row.other == Some(body))) {
                least_coupled = least_coupled.min(share);
            }
        }
        // Bodies that press each other have one share.
        for row in rows {
            if let Some(other) = row.other {
                self.shares[row.body] = least_coupled;
                self.shares[other] = least_coupled;
            }
        }
    }

    fn mix(&self, rows: &mut [Row], motions: &mut [Motion]) {
        for (row, force_W) in rows.iter_mut().zip(&self.forces_W) {
            row.force_W += (force_W - row.force_W) * self.shares[row.body];
        }
        for ((motion, bouncing), share) in motions.iter_mut().zip(&self.bouncing).zip(&self.shares) {
            motion.velocity_W += (bouncing.velocity_W - motion.velocity_W) * *share;
            motion.angular_velocity_W += (bouncing.angular_velocity_W - motion.angular_velocity_W) * *share;
        }
    }
}

/// Power that impulses may seem to put into a body, twice, for what gravity takes from it.
fn free_w(motion: &Motion, change: &Motion, dt_s: f64) -> f64 {
    if motion.inverse_mass > 0.0 {
        change.velocity_W.norm_squared() / (motion.inverse_mass * dt_s)
    } else {
        0.0
    }
}

/// The largest `s` up to 1 for which `a + b s + c s^2 <= 0`, where `a <= 0`.
fn largest_share(a: f64, b: f64, c: f64) -> f64 {
    if a + b + c <= 0.0 {
        return 1.0;
    }
    let root = (b * b - 4.0 * a * c).max(0.0).sqrt();
    // Of both roots the one above zero, without taking nearly equal numbers from each other.
    let share = if b > 0.0 { -2.0 * a / (b + root) } else { (root - b) / (2.0 * c) };
    if share.is_finite() { share.clamp(0.0, 1.0) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_share_is_where_the_work_is_none() {
        for (a, b, c) in
            [(-1.0, 0.5, 3.0), (-1.0, -0.5, 3.0), (-0.1, 2.0, 0.0), (-1.0, 3.0, -0.5), (-2.0, 0.0, 2.5)]
        {
            let s = largest_share(a, b, c);
            // Roundings of numbers near 1.
            assert!((0.0..=1.0).contains(&s) && (a + b * s + c * s * s).abs() < 1e-14, "{s}");
        }
        assert_eq!(largest_share(-1.0, 0.5, 0.1), 1.0);
        assert_eq!(largest_share(0.0, 1.0, 1.0), 0.0);
        assert_eq!(largest_share(f64::NAN, 1.0, 1.0), 0.0);
    }
}
