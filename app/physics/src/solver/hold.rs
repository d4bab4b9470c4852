//! Friction that holds what the points were pressed with before: slow, and near the answer from anywhere.
//!
//! Problem: friction grows with what presses, so forces are not the slope of any function, and a step of Newton's that leads
//! nearer need not exist. Where it was known what friction may hold, they would be: that of a convex function, of which the
//! least is the answer, and which every step of Newton's lessens if it is as long as it should be (Haslinger's iteration;
//! Tresca's friction).
//! Model: at first friction holds what is pressed where the search stands, or nothing. Then in turns that problem is solved, and
//! friction holds what its points are pressed with there. Along a step the slope falls, and a step ends where it is next to none: no kink, however hard the
//! point, leads astray.
//! Cost: a derivative for each round and an evaluation for each try of its length, at most [`MOST_TRIES`].

use super::blocks::Blocks;
use super::equations::{Equations, Trial};
use super::six::Vector6;
use crate::row::Row;

/// Room, as [`Newton`](super::newton::Newton) has it.
pub(super) struct Hold<'a> {
    pub(super) now: &'a mut Trial,
    pub(super) next: &'a mut Trial,
    pub(super) change: &'a mut Vec<Vector6>,
    pub(super) blocks: &'a mut Blocks,
}

/// Place where holding begins.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Begin {
    /// The place where the search stands; it ends soon, near enough for Newton's steps.
    Here,
    /// No force at all; slower, and surer.
    FromNothing,
}

impl Hold<'_> {
    /// Leads `now` to near the answer; says how many rounds that took, at most so many. `holds_n` has
    /// room for what presses each point as far as friction knows.
    pub(super) fn run(
        &mut self,
        equations: &Equations<'_>,
        rows: &[Row],
        begin: Begin,
        holds_n: &mut Vec<f64>,
        most_rounds: usize,
    ) -> usize {
        holds_n.clear();
        holds_n.resize(equations.links.len(), 0.0);
        let settled = match begin {
            Begin::Here => {
                equations.evaluate(rows, self.now);
                self.hold(equations, rows, holds_n);
                NEARLY_SETTLED
            }
            Begin::FromNothing => {
                self.now.p.fill(Vector6::zeros());
                SETTLED
            }
        };
        let mut rounds = 0;
        for _ in 0..MOST_TURNS {
            let held = Equations { holds_n: Some(holds_n), ..*equations };
            rounds += self.least(&held, rows, most_rounds - rounds);
            if self.hold(equations, rows, holds_n) < settled || rounds >= most_rounds {
                break;
            }
        }
        rounds
    }

    /// Friction holds what its points are pressed with; says by which share of the most that has changed.
    fn hold(&self, equations: &Equations<'_>, rows: &[Row], all_n: &mut [f64]) -> f64 {
        let (mut changed_n, mut most_n) = (0.0_f64, 0.0_f64);
        for (link, holds_n) in equations.links.iter().zip(all_n) {
            let row = &rows[link.row];
            let trial_W = row.trial_at_end_W(&link.velocity_W(row, &self.now.moving), equations.dt_s);
            let now_n = row.presses_n(&trial_W);
            changed_n = changed_n.max((now_n - *holds_n).abs());
            most_n = most_n.max(now_n);
            *holds_n = now_n;
        }
        if changed_n > 0.0 { changed_n / most_n } else { 0.0 }
    }

    /// Where the function is least; says how many rounds that took.
    fn least(&mut self, equations: &Equations<'_>, rows: &[Row], most_rounds: usize) -> usize {
        equations.evaluate(rows, self.now);
        for round in 0..most_rounds {
            if self.now.is_within(FOUND) {
                return round;
            }
            equations.derive(rows, &self.now.moving, false, self.blocks);
            self.change.clear();
            self.change.extend_from_slice(&self.now.left);
            if !self.blocks.solve(self.change) {
                return round;
            }
            self.go(equations, rows);
        }
        most_rounds
    }

    /// Goes along the change until there is next to no slope.
    fn go(&mut self, equations: &Equations<'_>, rows: &[Row]) {
        let slope = equations.energy_between(&self.now.left, self.change);
        // Where it still falls, and where it has begun to rise.
        let (mut falls, mut rises) = ([0.0, slope], None);
        let mut share = 1.0;
        for _ in 0..MOST_TRIES {
            self.next.p.clear();
            self.next.p.extend(self.now.p.iter().zip(&*self.change).map(|(p, way)| p - way * share));
            equations.evaluate(rows, self.next);
            let there = equations.energy_between(&self.next.left, self.change);
            if there.abs() <= LEVEL * slope || there > 0.0 && rises.is_none() {
                break;
            }
            match there > 0.0 {
                true => falls = [share, there],
                false => rises = Some([share, there]),
            }
            let Some([end, rise]) = rises else { break };
            // A kink may be anywhere: never too near to either end.
            let crossing = (falls[1] / (falls[1] - rise)).clamp(INSIDE, 1.0 - INSIDE);
            share = falls[0] + (end - falls[0]) * crossing;
        }
        std::mem::swap(self.now, self.next);
    }
}

/// What is left of the equations, in shares of all forces, where friction holds what it held: near the roundings of the hardest.
const FOUND: f64 = 1e-9;
/// What friction holds has settled when it changes by less than this share.
const SETTLED: f64 = 1e-6;
const NEARLY_SETTLED: f64 = 1e-2;
/// Turns of holding.
const MOST_TURNS: usize = 32;
/// Lengths of a step that are tried.
const MOST_TRIES: usize = 24;
/// A slope of this share of the first is none.
const LEVEL: f64 = 0.25;
const INSIDE: f64 = 0.1;
