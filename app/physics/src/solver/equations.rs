//! What has to be zero: what bodies get in a tick, less what all their contact points give them when they move so.
//!
//! Model: with `p` the impulse and angular impulse of each body, it leaves the tick at `u = u_0 + W p` (W: inverse mass and
//! inertia), and each contact point's force is a function of the `u` of its two sides. What is left is
//! `p - dt sum J^T f(u_0 + W p)`: six equations a body, whatever the number of points.
//!
//! Measure of what is left: the kinetic energy of the impulses that are too much or too little, over that of all forces.

use nalgebra::{Matrix3, Vector3};

use super::blocks::Blocks;
use super::link::{Link, SIGNS};
use super::six::{Vector6, halves, joined};
use super::{Motion, lets_slip};
use crate::row::Row;

/// Of velocities; points that are very hard make much of it.
const ROUNDING: f64 = 1e-14;

/// Bodies as the tick found them, and what joins them.
#[derive(Clone, Copy)]
pub(super) struct Equations<'a> {
    pub(super) links: &'a [Link],
    pub(super) starts: &'a [Motion],
    pub(super) dt_s: f64,
    /// Of each link, what presses as far as friction knows \[N\], if that is not what does.
    pub(super) holds_n: Option<&'a [f64]>,
}

/// Impulses, and what is left of the equations with them.
#[derive(Debug, Clone, Default)]
pub(super) struct Trial {
    pub(super) p: Vec<Vector6>,
    /// `u_0 + W p`.
    pub(super) moving: Vec<Motion>,
    /// Speed \[m/s\] and spin \[rad/s\] of each.
    speeds: Vec<[f64; 2]>,
    pub(super) left: Vec<Vector6>,
    /// Twice the kinetic energy of what is left \[J\].
    pub(super) left_j: f64,
    /// The like of all forces, each by itself \[J\].
    all_j: f64,
    /// The like of the roundings of these forces \[J\].
    noise_j: f64,
}

impl Trial {
    pub(super) fn with_capacity(bodies: usize) -> Self {
        let room = || Vec::with_capacity(bodies);
        let (moving, speeds) = (Vec::with_capacity(bodies), Vec::with_capacity(bodies));
        Self { p: room(), left: room(), moving, speeds, ..Self::default() }
    }

    pub(super) fn is_within(&self, share: f64) -> bool {
        self.left_j <= share * share * self.all_j + self.noise_j
    }

    /// How much of all forces is left; 0 where it is within their roundings.
    pub(super) fn share_left(&self) -> f64 {
        let left_j = (self.left_j - self.noise_j).max(0.0);
        if left_j > 0.0 { (left_j / self.all_j).sqrt() } else { 0.0 }
    }
}

impl Equations<'_> {
    /// `dt sum J^T f` of the forces as they stand, to `trial`.
    pub(super) fn impulses(&self, rows: &[Row], trial: &mut Trial) {
        trial.p.clear();
        trial.p.resize(self.starts.len(), Vector6::zeros());
        for link in self.links {
            let row = &rows[link.row];
            for (side, place) in link.inside() {
                trial.p[place] += on_side(row, side, &row.force_W, &row.torque_W());
            }
        }
        trial.p.iter_mut().for_each(|p| *p *= self.dt_s);
    }

    /// `u_0 + W p`.
    pub(super) fn moving(&self, trial: &mut Trial) {
        trial.moving.clear();
        trial.moving.extend(self.starts.iter().zip(&trial.p).map(|(start, p)| {
            let mut motion = *start;
            let (along, about) = halves(p);
            motion.velocity_W += along * motion.inverse_mass;
            motion.angular_velocity_W += motion.inverse_inertia_W * about;
            motion
        }));
    }

    /// Evaluates the equations at the trial's `p`: what is left of them.
    pub(super) fn evaluate(&self, rows: &[Row], trial: &mut Trial) {
        self.moving(trial);
        let Trial { p, moving, speeds, left, .. } = trial;
        speeds.clear();
        speeds
            .extend(moving.iter().map(|motion| [motion.velocity_W.norm(), motion.angular_velocity_W.norm()]));
        left.clear();
        left.resize(p.len(), Vector6::zeros());
        let (mut all, mut noise) = (0.0, 0.0);
        for (at, link) in self.links.iter().enumerate() {
            let row = &rows[link.row];
            let velocity_W = link.velocity_W(row, moving);
            let force_W = match self.holds_n {
                None => row.at_end_W(&velocity_W, self.dt_s),
                Some(holds_n) => row.at_end_within_W(&velocity_W, self.dt_s, holds_n[at]),
            };
            let torque_W = if row.has_torque() {
                let presses_n = self.presses_n(at, row, &velocity_W);
                let (twist_nm, rolling_W) = row.turning_at_end(&link.spin_W(moving), self.dt_s, presses_n);
                row.normal_W * twist_nm + rolling_W
            } else {
                Vector3::zeros()
            };
            for (side, place) in link.inside() {
                left[place] -= on_side(row, side, &force_W, &torque_W);
            }
            let gives = link.most_give;
            let [along, across] = row.falls(self.dt_s);
            let rounding_n = ROUNDING * along.max(across) * link.speed_m_s(speeds);
            all += force_W.norm_squared() * gives;
            noise += rounding_n * rounding_n * gives;
            if row.has_torque() {
                let turns = link.most_turn;
                let falls = row.torsion.falls(self.dt_s).max(row.rolling.falls(self.dt_s));
                let rounding_nm = ROUNDING * falls * link.most_spin_rad_s(speeds);
                all += torque_W.norm_squared() * turns;
                noise += rounding_nm * rounding_nm * turns;
            }
        }
        trial.left_j = 0.0;
        for ((left, p), start) in left.iter_mut().zip(p).zip(self.starts) {
            *left = *p + *left * self.dt_s;
            trial.left_j += energy(start, left);
        }
        (trial.all_j, trial.noise_j) = (all * self.dt_s * self.dt_s, noise * self.dt_s * self.dt_s);
    }

    /// Of what is left, by `p`; of torsion the chords, if wanted.
    pub(super) fn derive(&self, rows: &[Row], moving: &[Motion], chords: bool, blocks: &mut Blocks) {
        blocks.clear();
        for (at, link) in self.links.iter().enumerate() {
            let row = &rows[link.row];
            let velocity_W = link.velocity_W(row, moving);
            let falls = match self.holds_n {
                None => row.falls_at_end_W(&velocity_W, self.dt_s),
                Some(holds_n) => row.falls_within_W(&velocity_W, self.dt_s, holds_n[at]),
            };
            let turns = row.has_torque().then(|| {
                let presses_n = self.presses_n(at, row, &velocity_W);
                let spin_W = link.spin_W(moving);
                let by_spin = row.turning_falls_W(&spin_W, self.dt_s, presses_n, chords);
                let by_velocity = match self.holds_n {
                    None => row.turning_falls_by_velocity_W(&spin_W, self.dt_s, presses_n),
                    Some(_) => Matrix3::zeros(),
                };
                [by_velocity, by_spin]
            });
            link.add_falls(row, &falls, turns.as_ref(), blocks);
        }
        blocks.for_each(|row, column, block| {
            let start = &self.starts[column];
            for (at, values) in block.iter_mut().enumerate() {
                let about = start.inverse_inertia_W * Vector3::new(values[3], values[4], values[5]);
                let along = start.inverse_mass;
                *values =
                    [values[0] * along, values[1] * along, values[2] * along, about.x, about.y, about.z];
                values.iter_mut().for_each(|value| *value *= self.dt_s);
                if row == column {
                    values[at] += 1.0;
                }
            }
        });
    }

    /// The rows' forces when bodies move so.
    pub(super) fn settle(&self, rows: &mut [Row], moving: &[Motion]) {
        for link in self.links {
            let row = &mut rows[link.row];
            row.force_W = row.at_end_W(&link.velocity_W(row, moving), self.dt_s);
            if row.has_torque() {
                let presses_n = row.presses_n(&row.force_W);
                (row.torsion.torque_nm, row.rolling.torque_W) =
                    row.turning_at_end(&link.spin_W(moving), self.dt_s, presses_n);
            }
        }
    }

    /// Force that presses at a link, as far as friction knows \[N\].
    #[inline]
    pub(super) fn presses_n(&self, link: usize, row: &Row, velocity_W: &Vector3<f64>) -> f64 {
        match self.holds_n {
            None => row.presses_n(&row.trial_at_end_W(velocity_W, self.dt_s)),
            Some(holds_n) => holds_n[link],
        }
    }

    /// Of two sets of impulses, by their kinetic energy \[J\]: `a W b`.
    pub(super) fn energy_between(&self, a: &[Vector6], b: &[Vector6]) -> f64 {
        let all = self.starts.iter().zip(a.iter().zip(b));
        all.map(|(start, (a, b))| {
            let ((along_a, about_a), (along_b, about_b)) = (halves(a), halves(b));
            along_a.dot(&along_b) * start.inverse_mass + about_a.dot(&(start.inverse_inertia_W * about_b))
        })
        .sum()
    }

    /// Says whether stiction broke anywhere and takes other forces now.
    pub(super) fn let_slip(&self, rows: &mut [Row], moving: &[Motion]) -> bool {
        self.settle(rows, moving);
        self.links.iter().fold(false, |any, link| lets_slip(&mut rows[link.row]) | any)
    }
}

/// Force and torque of a contact point (N, N m) as one of its sides gets them.
#[inline]
fn on_side(row: &Row, side: usize, force_W: &Vector3<f64>, torque_W: &Vector3<f64>) -> Vector6 {
    let sign = SIGNS[side];
    joined(&(force_W * sign), &((row.arms_W[side].cross(force_W) + torque_W) * sign))
}

/// `p W p`.
fn energy(start: &Motion, p: &Vector6) -> f64 {
    let (along, about) = halves(p);
    along.norm_squared() * start.inverse_mass + about.dot(&(start.inverse_inertia_W * about))
}
