//! Bodies that press each other: row by row in turns.
//!
//! Model: projected Gauss-Seidel in blocks of three. At haptic stiffness and rate the springs' own give, `1 / (k dt^2)`,
//! outweighs that of all but the lightest bodies, and few turns are enough; the lightest take tens.

use nalgebra::{Matrix3, Vector3};

use super::{MAX_SWEEPS, Motion, lets_slip};
use crate::row::Row;

/// Forces that change by less than this share of the largest are found.
const SETTLED: f64 = 1e-10;

/// Of a row.
#[derive(Debug, Clone, Copy)]
pub(super) struct Block {
    /// Velocity of the row's point per force on it, over the tick \[m/s/N\].
    give_W: Matrix3<f64>,
}

/// The forces of these rows of all bodies, and the motions that they leave; returns the turns made.
pub(super) fn solve(
    blocks: &mut Vec<Block>,
    which: &[usize],
    rows: &mut [Row],
    motions: &mut [Motion],
    dt_s: f64,
) -> usize {
    blocks.clear();
    for &at in which {
        let row = &mut rows[at];
        row.force_W = row.project(&row.force_W);
        row.torsion.torque_nm = 0.0;
        blocks.push(Block::new(row, motions, dt_s));
        push(row, motions, &(row.force_W * dt_s));
    }
    let mut sweeps = 0;
    while sweeps < MAX_SWEEPS && !which.is_empty() {
        sweeps += 1;
        if sweep(blocks, which, rows, motions, dt_s, sweeps % 2 == 0) && !let_slip(which, rows) {
            break;
        }
    }
    sweeps
}

/// One turn; says whether all forces are found.
fn sweep(
    blocks: &[Block],
    which: &[usize],
    rows: &mut [Row],
    motions: &mut [Motion],
    dt_s: f64,
    is_backward: bool,
) -> bool {
    let (mut most_change, mut most) = (0.0_f64, 0.0_f64);
    let count = which.len();
    for turn in 0..count {
        let at = if is_backward { count - 1 - turn } else { turn };
        let (row, block) = (&mut rows[which[at]], &blocks[at]);
        let velocity_W = velocity(row, motions);
        let force_W = block.answer(row, &(velocity_W - block.give_W * row.force_W), dt_s);
        let change_W = force_W - row.force_W;
        row.force_W = force_W;
        push(row, motions, &(change_W * dt_s));
        most_change = most_change.max(change_W.norm_squared());
        most = most.max(force_W.norm_squared());
        if row.torsion.most_nm > 0.0 {
            let change = twist(row, motions, dt_s);
            most_change = most_change.max(change * change / (ARM_M * ARM_M));
        }
    }
    most_change <= SETTLED * SETTLED * most
}

/// Says whether stiction broke anywhere and takes other forces now.
fn let_slip(which: &[usize], rows: &mut [Row]) -> bool {
    which.iter().fold(false, |any, &at| lets_slip(&mut rows[at]) | any)
}

impl Block {
    fn new(row: &Row, motions: &[Motion], dt_s: f64) -> Self {
        let [arm_W, other_arm_W] = row.arms_W;
        let mut mobility_W = motions[row.body].mobility_W(&arm_W);
        if let Some(other) = row.other {
            mobility_W += motions[other].mobility_W(&other_arm_W);
        }
        Self { give_W: mobility_W * dt_s }
    }

    /// The row's force if its point moved at `without_W` without it: Newton's method for that point's velocity.
    #[inline]
    fn answer(&self, row: &Row, without_W: &Vector3<f64>, dt_s: f64) -> Vector3<f64> {
        let left_W = |u: &Vector3<f64>, force_W: &Vector3<f64>| u - without_W - self.give_W * force_W;
        let mut u = without_W + self.give_W * row.force_W;
        let mut force_W = row.at_end_W(&u, dt_s);
        let mut left = left_W(&u, &force_W);
        for _ in 0..ROUNDS {
            if left.norm_squared() <= (ROUNDING * u.norm()).powi(2) {
                break;
            }
            let derivative = Matrix3::identity() + self.give_W * row.falls_at_end_W(&u, dt_s);
            let Some(change) = derivative.try_inverse().map(|inverse| inverse * left) else { break };
            let was = left.norm_squared();
            for halvings in 0..=HALVINGS {
                let next = u - change * 0.5_f64.powi(halvings);
                force_W = row.at_end_W(&next, dt_s);
                left = left_W(&next, &force_W);
                if left.norm_squared() < was || halvings == HALVINGS {
                    u = next;
                    break;
                }
            }
        }
        force_W
    }
}

/// Rounds of a row, in each turn.
const ROUNDS: usize = 8;
/// How often a step is halved.
const HALVINGS: i32 = 4;
/// A velocity is found.
const ROUNDING: f64 = 1e-15;

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
    let impulse_W = n * (change * dt_s);
    motions[row.body].turn(&impulse_W);
    if let Some(other) = row.other {
        motions[other].turn(&-impulse_W);
    }
    change
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
