//! What all contact points do at the end of the tick, together.
//!
//! Problem: with springs as stiff as fingers want them and bodies as light as a gram, forces that belong to the beginning
//! of a tick throw the body farther than the springs are long; the next tick throws it back (explicit integration fails
//! from `k dt^2 / m` = 4 on).
//!
//! Model: each [`Row`]'s force is that of the end of the tick, `project(rest - (k dt + b) u)`, where `u` is the velocity
//! that all forces of the tick leave its point with. A body that only fingers and fixed things press has six unknowns,
//! whatever the number of its contact points, and they are found by Newton's method ([`newton`]). Bodies that press each
//! other are found row by row in turns ([`gauss_seidel`]). Warm: both begin with the forces of the last tick.
//!
//! Invariant: velocities and forces belong together to rounding, however many turns were made: what the bodies got is the
//! sum of the rows' forces. Where stiction breaks, that row slides for the rest of the tick. Rows that are not made of
//! numbers press nothing.
//! Cost: rows times turns, at most [`MAX_SWEEPS`]; 2 to 5 in the common case.

mod gauss_seidel;
mod motion;
mod newton;

use nalgebra::Vector3;

use crate::row::{Held, Row};
use gauss_seidel::Block;
pub use motion::Motion;

/// The most turns over all rows in a tick.
pub const MAX_SWEEPS: usize = 120;

/// Room for what is worked out once per tick.
#[derive(Debug, Clone, Default)]
pub struct Solver {
    room: [usize; 2],
    /// Numbers of rows: those of each body that presses no other body, then those of all others, then the unsound ones.
    order: Vec<usize>,
    /// Where the rows of each body begin in `order`.
    starts: Vec<usize>,
    /// Of each body, whether another one that moves presses it.
    is_coupled: Vec<bool>,
    blocks: Vec<Block>,
}

impl Solver {
    /// Room for so many rows and bodies.
    pub fn with_capacity(rows: usize, bodies: usize) -> Self {
        Self {
            room: [rows, bodies],
            order: Vec::with_capacity(rows),
            starts: Vec::with_capacity(bodies + 3),
            is_coupled: Vec::with_capacity(bodies),
            blocks: Vec::with_capacity(rows),
        }
    }

    /// Changes the rows' forces to those of the end of the tick, and the motions to what these leave. Returns the turns made:
    /// of the body that took most.
    ///
    /// `motions` come in as they were without any row, `force_W` of the rows as a guess. Rows beyond the room are left out:
    /// their force is zero.
    pub fn solve(&mut self, rows: &mut [Row], motions: &mut [Motion], dt_s: f64) -> usize {
        let (rows, beyond) = rows.split_at_mut(self.room[0].min(rows.len()));
        let bodies = self.room[1].min(motions.len());
        let motions = &mut motions[..bodies];
        beyond.iter_mut().for_each(silence);
        self.sort(rows, motions);
        let mut most = 0;
        for (body, motion) in motions.iter_mut().enumerate() {
            let of_body = &self.order[self.starts[body]..self.starts[body + 1]];
            if !of_body.is_empty() {
                most = most.max(newton::solve(rows, of_body, motion, dt_s));
            }
        }
        let (coupled, unsound) =
            self.order[self.starts[bodies]..].split_at(self.starts[bodies + 1] - self.starts[bodies]);
        unsound.iter().for_each(|&at| silence(&mut rows[at]));
        most.max(gauss_seidel::solve(&mut self.blocks, coupled, rows, motions, dt_s))
    }

    /// Which rows are to be solved together.
    fn sort(&mut self, rows: &[Row], motions: &[Motion]) {
        let bodies = motions.len();
        self.is_coupled.clear();
        self.is_coupled.resize(bodies, false);
        for row in rows {
            if let Some(other) =
                row.other.filter(|&other| is_sound(row, motions) && !motions[other].is_fixed())
            {
                self.is_coupled[row.body] = true;
                self.is_coupled[other] = true;
            }
        }
        let place = |row: &Row| match row {
            row if !is_sound(row, motions) => bodies + 1,
            row if self.is_coupled[row.body] => bodies,
            row => row.body,
        };
        // Sorted by counting: stable, and without a heap.
        self.starts.clear();
        self.starts.resize(bodies + 3, 0);
        rows.iter().for_each(|row| self.starts[place(row) + 1] += 1);
        (1..bodies + 3).for_each(|at| self.starts[at] += self.starts[at - 1]);
        self.order.clear();
        self.order.resize(rows.len(), 0);
        for (at, row) in rows.iter().enumerate() {
            let next = &mut self.starts[place(row)];
            self.order[*next] = at;
            *next += 1;
        }
        // Each has moved to where the next one began.
        self.starts.rotate_right(1);
        self.starts[0] = 0;
    }
}

/// Whether bodies and numbers of a row exist.
fn is_sound(row: &Row, motions: &[Motion]) -> bool {
    let exists = |body: usize| motions.get(body).is_some_and(Motion::is_finite);
    exists(row.body) && row.other.is_none_or(|other| other != row.body && exists(other)) && row.is_finite()
}

fn silence(row: &mut Row) {
    row.force_W = Vector3::zeros();
    row.torsion.torque_nm = 0.0;
}

/// Where stiction is at its limit it breaks; says whether sliding takes another force than holding did.
fn lets_slip(row: &mut Row) -> bool {
    let breaks = row.held == Held::Stick && is_at_the_rim(row, row.mu_hold);
    if breaks {
        row.held = Held::Slip;
    }
    breaks && (row.mu_slide < row.mu_hold || row.damping[1] > 0.0)
}

/// Whether the tangential force is all that this ratio allows.
fn is_at_the_rim(row: &Row, mu: f64) -> bool {
    let normal_n = row.normal_W.dot(&row.force_W);
    let across_n = (row.force_W - row.normal_W * normal_n).norm();
    normal_n > 0.0 && across_n >= mu * normal_n * (1.0 - RIM)
}

/// Roundings of a force.
const RIM: f64 = 1e-9;
