//! A body that only fingers and fixed things press: Newton's method for what all its contact points give it together.
//!
//! Model: with `p` the impulse and angular impulse of the tick, the body leaves it at `u = u_0 + W p` (W: inverse mass and
//! inertia), and each contact point's force is a function of `u`. What is sought is where `p - dt sum J^T f(u_0 + W p)`
//! is zero: six equations, whatever the number of points. The forces are linear in `u` while nothing changes between
//! lying off, holding and sliding, and bend with the direction of sliding; so Newton's method (semi-smooth: the derivative is that
//! of where it stands) ends after few rounds. A solution exists always: springs and dampers take energy from a body
//! that moves fast, whatever it does.
//! A step that does not bring it nearer is halved. Where none does (a light body between points with much friction, one
//! scene in thousands), the forces are let grow from next to nothing; then the points take some cautious turns one by one. Should
//! all that find nothing (contact points many times farther from the centre than the mass itself is), what such turns leave
//! stands.
//!
//! Measure of what is left: the kinetic energy of the impulse that is too much or too little, over that of all forces.

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

use super::{MAX_SWEEPS, Motion, lets_slip};
use crate::row::Row;

type Matrix6 = SMatrix<f64, 6, 6>;
type Vector6 = SVector<f64, 6>;

/// What is left of the equations, in shares of all forces, when they count as solved.
const SOLVED: f64 = 1e-13;
/// When nothing brings it nearer any more, this is solved too.
const NEARLY_SOLVED: f64 = 1e-9;
/// Of velocities; points that are very hard make much of it.
const ROUNDING: f64 = 1e-14;
/// How often a step is halved.
const HALVINGS: usize = 6;
/// Shares of the tick for which forces last, on the way to all of it.
const LOADS: [f64; 8] = [1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 0.1, 0.3, 0.6];
/// Turns of the points one by one: at first, and the most at once; each time twice as many.
const FIRST_TURNS: usize = 8;
const MOST_TURNS: usize = 512;

/// What all points do at some `p`.
#[derive(Clone, Copy)]
struct Sum {
    /// `p` less that.
    left: Vector6,
    /// Twice the kinetic energy of what is left \[J\].
    left_j: f64,
    /// The like of all forces, each by itself \[J\].
    all_j: f64,
    /// The like of the roundings of these forces \[J\].
    noise_j: f64,
}

/// The forces of these rows, all of this body, and the motion that they leave; returns the rounds made.
pub(super) fn solve(rows: &mut [Row], which: &[usize], motion: &mut Motion, dt_s: f64) -> usize {
    let problem = Problem { start: *motion, dt_s };
    for &at in which {
        let row = &mut rows[at];
        row.force_W = row.project(&row.force_W);
        row.torsion.torque_nm = 0.0;
    }
    let mut p = problem.impulse(rows, which);
    let mut stuck_at = None;
    let (mut rounds, mut turns) = (0, FIRST_TURNS);
    let is_found = loop {
        let is_solved = problem.approach(rows, which, &mut p, 1.0, &mut rounds);
        if is_solved && !problem.let_slip(rows, which, &p) {
            break true;
        }
        if is_solved {
            continue;
        }
        if rounds >= MAX_SWEEPS || turns > MOST_TURNS {
            break false;
        }
        if stuck_at.is_none() {
            stuck_at = Some(p);
            p = problem.load(rows, which, &mut rounds);
        } else {
            problem.settle(rows, which, &if turns == FIRST_TURNS { stuck_at.unwrap_or(p) } else { p });
            p = problem.relax(rows, which, turns);
            turns *= 2;
        }
    };
    problem.settle(rows, which, &p);
    if !is_found {
        // Not what was sought, but forces that contacts can have.
        problem.let_slip(rows, which, &p);
        which.iter().for_each(|&at| rows[at].force_W = Vector3::zeros());
        problem.relax(rows, which, MOST_TURNS);
    }
    *motion = problem.moving(&problem.impulse(rows, which));
    rounds
}

impl Sum {
    fn is_within(&self, share: f64) -> bool {
        self.left_j <= share * share * self.all_j + self.noise_j
    }
}

/// The body as the tick found it.
struct Problem {
    start: Motion,
    dt_s: f64,
}

impl Problem {
    /// `u_0 + W p`.
    fn moving(&self, p: &Vector6) -> Motion {
        let mut motion = self.start;
        let (along, about) = halves(p);
        motion.velocity_W += along * motion.inverse_mass;
        motion.angular_velocity_W += motion.inverse_inertia_W * about;
        motion
    }

    /// `dt sum J^T f` of the forces as they stand.
    fn impulse(&self, rows: &[Row], which: &[usize]) -> Vector6 {
        let (mut force_W, mut torque_W) = (Vector3::zeros(), Vector3::zeros());
        for &at in which {
            let row = &rows[at];
            force_W += row.force_W;
            torque_W += row.arms_W[0].cross(&row.force_W) + row.normal_W * row.torsion.torque_nm;
        }
        joined(&(force_W * self.dt_s), &(torque_W * self.dt_s))
    }

    /// Newton's steps until it is solved, when that is said, or nothing brings it nearer.
    fn approach(
        &self,
        rows: &[Row],
        which: &[usize],
        p: &mut Vector6,
        load: f64,
        rounds: &mut usize,
    ) -> bool {
        let mut now = self.sum(rows, which, p, load);
        while *rounds < MAX_SWEEPS {
            *rounds += 1;
            let Some((next_p, next)) = self.step(rows, which, p, &now, load) else {
                return now.is_within(NEARLY_SOLVED);
            };
            // Where roundings are all that is left, a step wins little.
            let stalls = next.left_j > 0.25 * now.left_j;
            (*p, now) = (next_p, next);
            if now.is_within(SOLVED) || (stalls && now.is_within(NEARLY_SOLVED)) {
                return true;
            }
        }
        false
    }

    /// The way from forces that do next to nothing to all of them.
    fn load(&self, rows: &[Row], which: &[usize], rounds: &mut usize) -> Vector6 {
        let mut p = Vector6::zeros();
        for load in LOADS {
            self.approach(rows, which, &mut p, load, rounds);
        }
        p
    }

    /// What the points do at `p`.
    fn sum(&self, rows: &[Row], which: &[usize], p: &Vector6, load: f64) -> Sum {
        let motion = self.moving(p);
        let (mut force_W, mut torque_W) = (Vector3::zeros(), Vector3::zeros());
        let (mut all, mut noise) = (0.0, 0.0);
        let turns = self.start.inverse_inertia_W.trace();
        let (speed, spin) = (motion.velocity_W.norm(), motion.angular_velocity_W.norm());
        for &at in which {
            let row = &rows[at];
            let arm_W = &row.arms_W[0];
            let on_body_W = row.at_end_W(&motion.at(arm_W), self.dt_s);
            let twist_nm = row.torsion.at_end_nm(row.normal_W.dot(&motion.angular_velocity_W), self.dt_s);
            force_W += on_body_W;
            torque_W += arm_W.cross(&on_body_W) + row.normal_W * twist_nm;
            let arm_m = arm_W.norm();
            let gives = self.start.inverse_mass + arm_m * arm_m * turns;
            let [along, across] = row.falls(self.dt_s);
            let rounding_n = ROUNDING * along.max(across) * (speed + spin * arm_m);
            all += on_body_W.norm_squared() * gives + twist_nm * twist_nm * turns;
            noise += rounding_n * rounding_n * gives;
        }
        let acts_s = self.dt_s * load;
        let left = p - joined(&(force_W * acts_s), &(torque_W * acts_s));
        Sum {
            left,
            left_j: self.energy(&left),
            all_j: all * acts_s * acts_s,
            noise_j: noise * acts_s * acts_s,
        }
    }

    /// `p W p`.
    fn energy(&self, p: &Vector6) -> f64 {
        let (along, about) = halves(p);
        along.norm_squared() * self.start.inverse_mass + about.dot(&(self.start.inverse_inertia_W * about))
    }

    /// A step of Newton's that brings it nearer, and what the points do there.
    fn step(
        &self,
        rows: &[Row],
        which: &[usize],
        p: &Vector6,
        now: &Sum,
        load: f64,
    ) -> Option<(Vector6, Sum)> {
        let change = self.derivative(rows, which, p, load).lu().solve(&now.left)?;
        let mut share = 1.0;
        for _ in 0..=HALVINGS {
            let next_p = p - change * share;
            let next = self.sum(rows, which, &next_p, load);
            if next.left_j < (1.0 - 1e-3 * share) * now.left_j || next.left_j == 0.0 {
                return Some((next_p, next));
            }
            share *= 0.5;
        }
        None
    }

    /// Of `p - dt sum J^T f(u_0 + W p)`, by `p`.
    fn derivative(&self, rows: &[Row], which: &[usize], p: &Vector6, load: f64) -> Matrix6 {
        let motion = self.moving(p);
        let mut falls = [Matrix3::zeros(); 4];
        for &at in which {
            let row = &rows[at];
            let arm_W = &row.arms_W[0];
            let D = row.falls_at_end_W(&motion.at(arm_W), self.dt_s);
            let r = arm_W.cross_matrix();
            let rD = r * D;
            falls[0] += D;
            falls[1] -= D * r;
            falls[2] += rD;
            falls[3] -= rD * r;
            let n = &row.normal_W;
            falls[3] +=
                n * n.transpose() * row.torsion.falls_at_end(n.dot(&motion.angular_velocity_W), self.dt_s);
        }
        let (inverse_mass, inverse_inertia_W) = (self.start.inverse_mass, &self.start.inverse_inertia_W);
        let mut derivative = Matrix6::identity();
        for (block, falls) in falls.iter().enumerate() {
            let (row, column) = (block / 2 * 3, block % 2 * 3);
            let by_p = if column == 0 { falls * inverse_mass } else { falls * inverse_inertia_W };
            let mut place = derivative.fixed_view_mut::<3, 3>(row, column);
            place += by_p * (self.dt_s * load);
        }
        derivative
    }

    /// Projected Gauss-Seidel: each point in turn goes as far to what its velocity asks for, along the normal and across it, as it
    /// may if that is to lessen what is left, and stays in its cone.
    fn relax(&self, rows: &mut [Row], which: &[usize], turns: usize) -> Vector6 {
        let mut motion = self.moving(&self.impulse(rows, which));
        for at in (0..turns).flat_map(|_| which.iter()) {
            let row = &mut rows[*at];
            let arm_W = row.arms_W[0];
            let most_give = motion.inverse_mass + arm_W.norm_squared() * motion.inverse_inertia_W.trace();
            let [along, across] =
                row.falls(self.dt_s).map(|falls| 1.0 / (1.0 + falls * most_give * self.dt_s));
            let missing_W = row.trial_at_end_W(&motion.at(&arm_W), self.dt_s) - row.force_W;
            let missing_n = row.normal_W.dot(&missing_W);
            let wanted_W = row.force_W + missing_W * across + row.normal_W * (missing_n * (along - across));
            let change_W = row.project(&wanted_W) - row.force_W;
            row.force_W += change_W;
            motion.push(&(change_W * self.dt_s), &arm_W);
        }
        self.impulse(rows, which)
    }

    /// The rows' forces at `p`.
    fn settle(&self, rows: &mut [Row], which: &[usize], p: &Vector6) {
        let motion = self.moving(p);
        for &at in which {
            let row = &mut rows[at];
            row.force_W = row.at_end_W(&motion.at(&row.arms_W[0]), self.dt_s);
            let spin = row.normal_W.dot(&motion.angular_velocity_W);
            row.torsion.torque_nm = row.torsion.at_end_nm(spin, self.dt_s);
        }
    }

    /// Says whether stiction broke anywhere and takes other forces now.
    fn let_slip(&self, rows: &mut [Row], which: &[usize], p: &Vector6) -> bool {
        self.settle(rows, which, p);
        which.iter().fold(false, |any, &at| lets_slip(&mut rows[at]) | any)
    }
}

fn joined(along: &Vector3<f64>, about: &Vector3<f64>) -> Vector6 {
    Vector6::from_row_slice(&[along.x, along.y, along.z, about.x, about.y, about.z])
}

fn halves(p: &Vector6) -> (Vector3<f64>, Vector3<f64>) {
    (Vector3::new(p[0], p[1], p[2]), Vector3::new(p[3], p[4], p[5]))
}
