//! Newton's method for what all contact points give to bodies that press each other, or to one alone.
//!
//! Model: forces are linear in velocities while nothing changes between lying off, holding and sliding, and bend with the
//! direction of sliding; so Newton's method for the [equations](super::equations) (semi-smooth: the derivative is that
//! of where it stands) ends after few rounds. A solution exists always: springs and dampers take energy from a body
//! that moves fast, whatever it does. Bodies that press each other are as one body of more unknowns, whose
//! linear equations are mostly zeros ([`Blocks`]): a chain is solved, not passed on from body to body.
//! A step that does not bring it nearer is halved. Where none does (a light body between points with much friction, one
//! scene in thousands), bodies that press each other make a few that lead farther away: many points change at once behind them. If
//! that does not help, friction is [held](super::hold) to what the points were pressed with; then the points take some cautious
//! turns one by one. Should all that find nothing (contact points many times farther from the centre than the mass itself
//! is), what such turns leave stands, and is said to be unsolved.
//! Cost: at most [`MAX_SWEEPS`] rounds of all ways together, of large islands as many as [`MOST_PRODUCTS`] leave.

use nalgebra::Vector3;

use super::blocks::{self, Blocks};
use super::equations::{Equations, Trial};
use super::hold::{Begin, Hold};
use super::link::Link;
use super::six::{Vector6, joined};
use super::{MAX_SWEEPS, Motion, Solved, relax};
use crate::row::Row;

/// What is left of the equations, in shares of all forces, when they count as solved.
const SOLVED: f64 = 1e-13;
/// When nothing brings it nearer any more, this is solved too.
const NEARLY_SOLVED: f64 = 1e-9;
/// How often a step is halved.
const HALVINGS: usize = 6;
/// How often a step is made that does not bring it nearer.
const MOST_LEAPS: usize = 8;
/// Rounds with friction that holds what it held.
const MOST_HELD: usize = 64;
/// Rounds of Newton's steps at once.
const MOST_ROUNDS: usize = 20;
/// Of all rounds together, products of blocks: some milliseconds.
const MOST_PRODUCTS: usize = 131_072;
/// Turns of the points one by one: at first, and the most at once; each time twice as many.
const FIRST_TURNS: usize = 8;
const MOST_TURNS: usize = 512;
/// The most points that are come to in so many turns.
const MOST_VISITS: usize = 12_288;

/// Room for the equations of as many bodies as are solved for at once.
#[derive(Debug, Clone, Default)]
pub(super) struct Newton {
    links: Vec<Link>,
    starts: Vec<Motion>,
    now: Trial,
    next: Trial,
    best: Trial,
    change: Vec<Vector6>,
    blocks: Blocks,
    holds_n: Vec<f64>,
    /// Velocity that gravity has given to all bodies in the tick \[m/s\].
    pub(super) fall_W: Vector3<f64>,
}

impl Newton {
    /// For rows of no more than so many bodies.
    pub(super) fn with_capacity(rows: usize, bodies: usize) -> Self {
        let bodies = bodies.min(blocks::MAX_BODIES);
        Self {
            links: Vec::with_capacity(rows),
            starts: Vec::with_capacity(bodies),
            now: Trial::with_capacity(bodies),
            next: Trial::with_capacity(bodies),
            best: Trial::with_capacity(bodies),
            change: Vec::with_capacity(bodies),
            blocks: Blocks::with_capacity(bodies),
            holds_n: Vec::with_capacity(rows),
            fall_W: Vector3::zeros(),
        }
    }

    /// The forces of these rows, all of this body and the others standing still, and the motion that they leave.
    pub(super) fn solve_alone(
        &mut self,
        rows: &mut [Row],
        which: &[usize],
        motion: &mut Motion,
        dt_s: f64,
    ) -> Solved {
        self.links.clear();
        self.links.extend(which.iter().map(|&at| Link::alone(at, &rows[at], motion)));
        self.starts.clear();
        self.starts.push(*motion);
        self.blocks.plan(1, std::iter::empty());
        let solved = self.solve(rows, dt_s);
        *motion = self.now.moving[0];
        solved
    }

    /// The forces of these rows, all between these bodies or with others that go on as they do, and the motions that they
    /// leave. `places` says of each of all bodies where among these it is. `None`: they are too many, nothing has changed.
    pub(super) fn solve_together(
        &mut self,
        rows: &mut [Row],
        which: &[usize],
        (bodies, places): (&[usize], impl Fn(usize) -> Option<usize>),
        motions: &mut [Motion],
        dt_s: f64,
    ) -> Option<Solved> {
        if bodies.len() > self.starts.capacity() {
            return None;
        }
        self.links.clear();
        self.links.extend(which.iter().map(|&at| {
            let row = &rows[at];
            let sides = [places(row.body), row.other.and_then(&places)];
            Link::between(at, row, sides, motions)
        }));
        let pairs = self.links.iter().filter_map(|link| Some([link.sides[0]?, link.sides[1]?]));
        if !self.blocks.plan(bodies.len(), pairs) {
            return None;
        }
        self.starts.clear();
        self.starts.extend(bodies.iter().map(|&body| motions[body]));
        let solved = self.solve(rows, dt_s);
        bodies.iter().zip(&self.now.moving).for_each(|(&body, motion)| motions[body] = *motion);
        Some(solved)
    }

    fn solve(&mut self, rows: &mut [Row], dt_s: f64) -> Solved {
        let Self { links, starts, now, next, best, change, blocks, holds_n, fall_W } = self;
        let equations = Equations { links, starts, dt_s, holds_n: None };
        let most_rounds = (MOST_PRODUCTS / blocks.products().max(1)).clamp(1, MAX_SWEEPS);
        let mut search =
            Search { equations, now, next, best, change, blocks, holds_n, rounds: 0, most_rounds };
        search.run(rows, fall_W)
    }
}

/// A search for the impulses at which nothing is left.
struct Search<'a> {
    equations: Equations<'a>,
    now: &'a mut Trial,
    next: &'a mut Trial,
    best: &'a mut Trial,
    change: &'a mut Vec<Vector6>,
    blocks: &'a mut Blocks,
    holds_n: &'a mut Vec<f64>,
    rounds: usize,
    most_rounds: usize,
}

impl Search<'_> {
    fn run(&mut self, rows: &mut [Row], fall_W: &Vector3<f64>) -> Solved {
        for link in self.equations.links {
            let row = &mut rows[link.row];
            row.force_W = row.project(&row.force_W);
            row.begin_torque();
        }
        self.equations.impulses(rows, self.now);
        self.equations.evaluate(rows, self.now);
        self.go_on(rows, fall_W);
        let is_found = self.find(rows);
        if !is_found {
            self.make_do(rows);
        }
        let solved =
            Solved { sweeps: self.rounds, residual: self.now.share_left(), unsolved: usize::from(!is_found) };
        self.equations.impulses(rows, self.now);
        self.equations.moving(self.now);
        solved
    }

    /// Begins with the velocities of the last tick if less is left with them than with its forces:
    /// hard points make much of a small error of these.
    fn go_on(&mut self, rows: &[Row], fall_W: &Vector3<f64>) {
        if *fall_W == Vector3::zeros() {
            return;
        }
        if self.now.is_within(SOLVED) {
            return;
        }
        let back = |start: &Motion| {
            let mass_kg = if start.inverse_mass > 0.0 { start.inverse_mass.recip() } else { 0.0 };
            joined(&(fall_W * -mass_kg), &Vector3::zeros())
        };
        self.next.p.clear();
        self.next.p.extend(self.equations.starts.iter().map(back));
        self.equations.evaluate(rows, self.next);
        if self.next.left_j < self.now.left_j {
            std::mem::swap(self.now, self.next);
        }
    }

    /// Says whether there is an answer, at `now`, and then in the rows.
    fn find(&mut self, rows: &mut [Row]) -> bool {
        let mut turns = 0;
        loop {
            let is_solved =
                self.approach(rows) || self.hold(rows, Begin::Here) || self.hold(rows, Begin::FromNothing);
            if is_solved && !self.equations.let_slip(rows, &self.now.moving) {
                return true;
            }
            if is_solved {
                self.equations.evaluate(rows, self.now);
                continue;
            }
            if self.rounds >= self.most_rounds || turns > self.most_turns() {
                return false;
            }
            turns = (2 * turns).max(FIRST_TURNS);
            self.equations.settle(rows, &self.now.moving);
            self.relax(rows, turns);
            self.equations.evaluate(rows, self.now);
        }
    }

    /// The way over friction that holds what was pressed before; says whether it leads to the answer.
    fn hold(&mut self, rows: &[Row], begin: Begin) -> bool {
        let rounds = MOST_HELD.min(self.most_rounds.saturating_sub(self.rounds));
        let Self { equations, now, next, change, blocks, holds_n, .. } = self;
        self.rounds += Hold { now, next, change, blocks }.run(equations, rows, begin, holds_n, rounds);
        self.equations.evaluate(rows, self.now);
        self.approach(rows)
    }

    /// Not what was sought, but forces that contacts can have.
    fn make_do(&mut self, rows: &mut [Row]) {
        self.equations.let_slip(rows, &self.now.moving);
        for link in self.equations.links {
            rows[link.row].silence();
        }
        self.relax(rows, self.most_turns());
        self.equations.evaluate(rows, self.now);
    }

    /// As many turns at once as there is time for.
    fn most_turns(&self) -> usize {
        (MOST_VISITS / self.equations.links.len().max(1)).clamp(FIRST_TURNS, MOST_TURNS)
    }

    /// Newton's steps from `now`, as it was evaluated, until it is solved, when that is said, or nothing brings it nearer.
    fn approach(&mut self, rows: &[Row]) -> bool {
        if self.now.is_within(SOLVED) {
            // What rests does as in the last tick.
            return true;
        }
        // One body alone finds its way without, and sooner.
        let most_leaps = if self.now.p.len() > 1 { MOST_LEAPS } else { 0 };
        let mut leaps = 0;
        let most_rounds = self.most_rounds.min(self.rounds + MOST_ROUNDS);
        while self.rounds < most_rounds {
            self.rounds += 1;
            let was_j = self.now.left_j;
            if !self.step(rows) {
                if self.now.is_within(NEARLY_SOLVED) {
                    return true;
                }
                if leaps == most_leaps || !self.leap(rows, leaps) {
                    break;
                }
                leaps += 1;
                continue;
            }
            // Where roundings are all that is left, a step wins little.
            let stalls = self.now.left_j > 0.25 * was_j;
            if self.now.is_within(SOLVED) || (stalls && self.now.is_within(NEARLY_SOLVED)) {
                return true;
            }
        }
        if leaps > 0 && (self.now.left_j.is_nan() || self.now.left_j > self.best.left_j) {
            std::mem::swap(self.now, self.best);
        }
        false
    }

    /// Goes all of the step though that leads farther away: behind where many points change at once it may be near. Remembers
    /// the best place so far. Says whether there is such a step.
    fn leap(&mut self, rows: &[Row], leaps: usize) -> bool {
        if !self.direction(rows, false) {
            return false;
        }
        self.next.p.clear();
        self.next.p.extend(self.now.p.iter().zip(&*self.change).map(|(p, change)| p - change));
        self.equations.evaluate(rows, self.next);
        if leaps == 0 || self.now.left_j < self.best.left_j {
            std::mem::swap(self.best, self.now);
        }
        std::mem::swap(self.now, self.next);
        self.now.left_j.is_finite()
    }

    /// So many turns of the points one by one.
    fn relax(&mut self, rows: &mut [Row], turns: usize) {
        self.equations.impulses(rows, self.now);
        self.equations.moving(self.now);
        relax::turns(&self.equations, rows, &mut self.now.moving, turns);
        self.equations.impulses(rows, self.now);
    }

    /// A step of Newton's that brings it nearer; says whether there is one.
    fn step(&mut self, rows: &[Row]) -> bool {
        if !self.direction(rows, false) {
            return false;
        }
        let mut share = 1.0;
        for halvings in 0..=HALVINGS {
            if halvings == 1 && self.is_at_limit(rows) {
                if self.direction(rows, true) && self.goes(rows, 1.0, 1e-3) {
                    return true;
                }
                if !self.direction(rows, false) {
                    return false;
                }
            }
            if self.goes(rows, share, 1e-3 * share) {
                return true;
            }
            share *= 0.5;
        }
        false
    }

    /// Goes by this share of the change, if that lessens what is left by so much of it; says whether.
    fn goes(&mut self, rows: &[Row], share: f64, lessens: f64) -> bool {
        self.next.p.clear();
        self.next.p.extend(self.now.p.iter().zip(&*self.change).map(|(p, change)| p - change * share));
        self.equations.evaluate(rows, self.next);
        let is_nearer = self.next.left_j < (1.0 - lessens) * self.now.left_j || self.next.left_j == 0.0;
        if is_nearer {
            std::mem::swap(self.now, self.next);
        }
        is_nearer
    }

    /// Where to, by the derivative where it stands; says whether that is anywhere.
    fn direction(&mut self, rows: &[Row], chords: bool) -> bool {
        self.equations.derive(rows, &self.now.moving, chords, self.blocks);
        self.change.clear();
        self.change.extend_from_slice(&self.now.left);
        self.blocks.solve(self.change)
    }

    /// Whether a whole step may lead too far because torques at their limit do not change on the way, until they turn over:
    /// the slopes of their chords lead back to where they do.
    fn is_at_limit(&self, rows: &[Row]) -> bool {
        let dt_s = self.equations.dt_s;
        self.equations.links.iter().enumerate().any(|(at, link)| {
            let row = &rows[link.row];
            row.has_torque() && {
                let velocity_W = link.velocity_W(row, &self.now.moving);
                let presses_n = self.equations.presses_n(at, row, &velocity_W);
                let spin_rad_s = row.normal_W.dot(&link.spin_W(&self.now.moving));
                let [most_nm, _] = row.most_turning_nm(presses_n);
                most_nm > 0.0 && row.torsion.falls_at_end(spin_rad_s, dt_s, most_nm) == 0.0
            }
        })
    }
}
