//! What all contact points do at the end of the tick, together.
//!
//! Problem: with springs as stiff as fingers want them and bodies as light as a gram, forces that belong to the beginning
//! of a tick throw the body farther than the springs are long; the next tick throws it back (explicit integration fails
//! from `k dt^2 / m` = 4 on).
//!
//! Model: each [`Row`]'s force is that of the end of the tick, `project(rest - (k dt + b) u)`, where `u` is the velocity
//! that all forces of the tick leave its point with. Solved row by row in turns (projected Gauss-Seidel in blocks of
//! three); at haptic stiffness and rate the springs' own give, `1 / (k dt^2)`, outweighs that of all but the lightest
//! bodies, and few turns are enough. Warm: each turn begins with the forces of the last tick.
//!
//! Invariant: velocities and forces belong together to rounding, however many turns were made: what the bodies got is the
//! sum of the rows' forces. Where stiction breaks, that row slides for the rest of the tick.
//! Cost: rows times turns, at most [`MAX_SWEEPS`].

use nalgebra::{Matrix3, Vector3};

use crate::row::{Held, Row};

/// The most turns over all rows in a tick.
pub const MAX_SWEEPS: usize = 120;

/// Forces that change by less than this share of the largest are found.
const SETTLED: f64 = 1e-10;

/// How a body moves and what moves it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion {
    /// Of its centre of mass \[m/s\].
    pub velocity_W: Vector3<f64>,
    /// \[rad/s\]
    pub angular_velocity_W: Vector3<f64>,
    /// \[1/kg\]
    pub inverse_mass: f64,
    /// \[1/(kg m^2)\]; zero where it never turns.
    pub inverse_inertia_W: Matrix3<f64>,
}

impl Motion {
    /// Velocity of its point at this arm \[m/s\].
    #[inline]
    pub fn at(&self, arm_W: &Vector3<f64>) -> Vector3<f64> {
        self.velocity_W + self.angular_velocity_W.cross(arm_W)
    }

    #[inline]
    fn push(&mut self, impulse_W: &Vector3<f64>, arm_W: &Vector3<f64>) {
        self.velocity_W += impulse_W * self.inverse_mass;
        self.angular_velocity_W += self.inverse_inertia_W * arm_W.cross(impulse_W);
    }

    #[inline]
    fn turn(&mut self, angular_impulse_W: &Vector3<f64>) {
        self.angular_velocity_W += self.inverse_inertia_W * angular_impulse_W;
    }

    /// What velocity an impulse at this arm gives to the point there \[1/kg\].
    #[inline]
    fn mobility_W(&self, arm_W: &Vector3<f64>) -> Matrix3<f64> {
        let r = arm_W.cross_matrix();
        Matrix3::from_diagonal_element(self.inverse_mass) - r * self.inverse_inertia_W * r
    }
}

/// Room for what is worked out once per tick.
#[derive(Debug, Clone, Default)]
pub struct Solver {
    blocks: Vec<Block>,
}

/// Of a row.
#[derive(Debug, Clone, Copy)]
struct Block {
    /// Velocity of the row's point per force on it, over the tick \[m/s/N\].
    give_W: Matrix3<f64>,
    /// `(1 + falls give)^-1`: the row's own answer while it sticks.
    own_W: Matrix3<f64>,
}

impl Solver {
    /// Room for so many rows.
    pub fn with_capacity(rows: usize) -> Self {
        Self { blocks: Vec::with_capacity(rows) }
    }

    /// Changes the rows' forces to those of the end of the tick, and the motions to what these leave. Returns the turns made.
    ///
    /// `motions` come in as they were without any row, `force_W` of the rows as a guess. Rows beyond the room are left out:
    /// their force is zero.
    pub fn solve(&mut self, rows: &mut [Row], motions: &mut [Motion], dt_s: f64) -> usize {
        let room = self.blocks.capacity().min(rows.len());
        let (rows, beyond) = rows.split_at_mut(room);
        for row in beyond {
            (row.force_W, row.torsion.torque_nm) = (Vector3::zeros(), 0.0);
        }
        self.blocks.clear();
        for row in rows.iter_mut() {
            row.force_W = row.project(&row.force_W);
            self.blocks.push(Block::new(row, motions, dt_s));
            push(row, motions, &(row.force_W * dt_s));
            let most_nm = row.torsion.most_nm.max(0.0);
            // A guess that is no number is none.
            let guess_nm = row.torsion.torque_nm;
            row.torsion.torque_nm =
                if guess_nm.is_finite() && guess_nm.abs() <= most_nm { guess_nm } else { 0.0 };
            twirl(row, motions, row.torsion.torque_nm * dt_s);
        }
        let mut sweeps = 0;
        while sweeps < MAX_SWEEPS {
            sweeps += 1;
            if self.sweep(rows, motions, dt_s, sweeps % 2 == 0) && !self.let_slip(rows, motions, dt_s) {
                break;
            }
        }
        sweeps
    }

    /// One turn; says whether all forces are found.
    fn sweep(&self, rows: &mut [Row], motions: &mut [Motion], dt_s: f64, is_backward: bool) -> bool {
        let (mut most_change, mut most) = (0.0_f64, 0.0_f64);
        let count = rows.len();
        for turn in 0..count {
            let at = if is_backward { count - 1 - turn } else { turn };
            let (row, block) = (&mut rows[at], &self.blocks[at]);
            let velocity_W = velocity(row, motions);
            let force_W = block.answer(row, &(velocity_W - block.give_W * row.force_W), dt_s);
            let change_W = force_W - row.force_W;
            row.force_W = force_W;
            push(row, motions, &(change_W * dt_s));
            most_change = most_change.max(change_W.norm_squared());
            most = most.max(force_W.norm_squared());
            if row.torsion.most_nm > 0.0 {
                let change = twist(row, motions, dt_s);
                let per_arm = (ARM_M * ARM_M).recip();
                most_change = most_change.max(change * change * per_arm);
                most = most.max(row.torsion.torque_nm.powi(2) * per_arm);
            }
        }
        most_change <= SETTLED * SETTLED * most
    }

    /// Where stiction is at its limit it breaks, if sliding takes less; says whether any did.
    fn let_slip(&mut self, rows: &mut [Row], motions: &[Motion], dt_s: f64) -> bool {
        let mut any = false;
        for (row, block) in rows.iter_mut().zip(&mut self.blocks) {
            if row.held == Held::Stick && is_at_the_rim(row, row.mu_hold) {
                row.held = Held::Slip;
                *block = Block::new(row, motions, dt_s);
                any |= row.mu_slide < row.mu_hold || row.damping[1] > 0.0;
            }
        }
        any
    }
}

/// Whether the tangential force is all that this ratio allows.
pub(crate) fn is_at_the_rim(row: &Row, mu: f64) -> bool {
    let normal_n = row.normal_W.dot(&row.force_W);
    let across_n = (row.force_W - row.normal_W * normal_n).norm();
    normal_n > 0.0 && across_n >= mu * normal_n * (1.0 - RIM)
}

/// Roundings of a force.
const RIM: f64 = 1e-9;

impl Block {
    fn new(row: &Row, motions: &[Motion], dt_s: f64) -> Self {
        let [arm_W, other_arm_W] = row.arms_W;
        let mut mobility_W = motions[row.body].mobility_W(&arm_W);
        if let Some(other) = row.other {
            mobility_W += motions[other].mobility_W(&other_arm_W);
        }
        let give_W = mobility_W * dt_s;
        let own = Matrix3::identity() + row.falls_W(dt_s) * give_W;
        Self { give_W, own_W: own.try_inverse().unwrap_or_else(Matrix3::zeros) }
    }

    /// The row's force if its point moved at `velocity_W` without it.
    #[inline]
    fn answer(&self, row: &Row, velocity_W: &Vector3<f64>, dt_s: f64) -> Vector3<f64> {
        let [along, across] = row.falls(dt_s);
        let n = row.normal_W;
        let trial_W = |u: &Vector3<f64>| row.rest_W - u * across - n * (n.dot(u) * (along - across));
        let sticks_W = self.own_W * trial_W(velocity_W);
        let inside_W = row.project(&sticks_W);
        if inside_W == sticks_W {
            return sticks_W;
        }
        if row.tie_n.is_some() {
            return self.stretched(row, velocity_W, dt_s);
        }
        // On the rim: normal and tangential part in turns.
        let give_n = n.dot(&(self.give_W * n));
        let give_t = self.give_W.diagonal().max();
        let mut force_W = if inside_W == Vector3::zeros() { row.project(&row.force_W) } else { inside_W };
        for _ in 0..RIM_ROUNDS {
            let normal_n = n.dot(&force_W);
            let across_W = force_W - n * normal_n;
            let u = velocity_W + self.give_W * across_W;
            let normal_n = ((row.rest_W.dot(&n) - along * n.dot(&u)) / (1.0 + along * give_n)).max(0.0);
            let u = u + self.give_W * n * normal_n;
            let trial_W = trial_W(&u);
            let trial_across_W = trial_W - n * n.dot(&trial_W);
            let across_W = across_W + (trial_across_W - across_W) / (1.0 + across * give_t);
            force_W = n * normal_n + row.within(&across_W, normal_n);
        }
        force_W
    }

    /// A tie's force when it is at its limit: a step towards the trial force, cut, in turns.
    fn stretched(&self, row: &Row, velocity_W: &Vector3<f64>, dt_s: f64) -> Vector3<f64> {
        let falls_W = row.falls_W(dt_s);
        let most = 1.0 + (falls_W * self.give_W).norm();
        let mut force_W = row.project(&row.force_W);
        for _ in 0..RIM_ROUNDS {
            let trial_W = row.rest_W - falls_W * (velocity_W + self.give_W * force_W);
            force_W = row.project(&(force_W + (trial_W - force_W) / most));
        }
        force_W
    }
}

/// Rounds of a row that slides, in each turn.
const RIM_ROUNDS: usize = 2;

#[inline]
fn velocity(row: &Row, motions: &[Motion]) -> Vector3<f64> {
    let own = motions[row.body].at(&row.arms_W[0]);
    row.other.map_or(own, |other| own - motions[other].at(&row.arms_W[1]))
}

/// The torque about the normal in turn; returns by how much it changed (N m).
fn twist(row: &mut Row, motions: &mut [Motion], dt_s: f64) -> f64 {
    let n = row.normal_W;
    let spin = |body: usize| n.dot(&motions[body].angular_velocity_W);
    let gives = |body: usize| n.dot(&(motions[body].inverse_inertia_W * n)) * dt_s;
    let spins = spin(row.body) - row.other.map_or(0.0, spin);
    let give = gives(row.body) + row.other.map_or(0.0, gives);
    let torsion = &mut row.torsion;
    let falls = torsion.falls(dt_s);
    let without = spins - give * torsion.torque_nm;
    let torque_nm =
        ((torsion.rest_nm - falls * without) / (1.0 + falls * give)).clamp(-torsion.most_nm, torsion.most_nm);
    let change = torque_nm - torsion.torque_nm;
    torsion.torque_nm = torque_nm;
    twirl(row, motions, change * dt_s);
    change
}

/// An angular impulse about the normal (N m s).
#[inline]
fn twirl(row: &Row, motions: &mut [Motion], impulse_nms: f64) {
    let impulse_W = row.normal_W * impulse_nms;
    motions[row.body].turn(&impulse_W);
    if let Some(other) = row.other {
        motions[other].turn(&-impulse_W);
    }
}

/// A torque counts as the force that makes it at this arm \[m\].
const ARM_M: f64 = 0.01;

#[inline]
fn push(row: &Row, motions: &mut [Motion], impulse_W: &Vector3<f64>) {
    motions[row.body].push(impulse_W, &row.arms_W[0]);
    if let Some(other) = row.other {
        motions[other].push(&-impulse_W, &row.arms_W[1]);
    }
}
