//! Bodies that press each other and are too many to be solved for at once: body by body in turns, each by Newton's method.
//!
//! Model: while a body is solved for, the others go on as they do; a point that it shares with another one is as soft as
//! that one gives way: with `g` what velocity forces of the tick give to the other's point (as many as they share) and `b` what the row's trial
//! force falls by, the row's force is sought as `project((trial + b g f) / (1 + b g))`, `f` being the force that it has. Where
//! nothing changes any more that is the row's own law. The other body gets at once what the force has changed by.
//! Points with what is fixed, of which a box has up to eight that are as hard as can be, are solved exactly in every turn;
//! point by point they would throw a light box about.
//!
//! Invariant: velocities and forces belong together to rounding, however many turns were made.
//! Cost: turns over all rows, at most [`MAX_VISITS`] of them in all, times Newton's.

use nalgebra::Vector3;

use super::newton::Newton;
use super::{Motion, Solved};
use crate::row::Row;

/// The most turns over all bodies in a tick, and the most rows that are come to in them.
const MAX_TURNS: usize = 200;
const MAX_VISITS: usize = 20_000;

/// Forces that change by less than this share of the largest are found.
const SETTLED: f64 = 1e-9;

/// Room for the rows of a body as they were, and their numbers.
#[derive(Debug, Clone, Default)]
pub(super) struct Room {
    by_body: Vec<usize>,
    were: Vec<Was>,
}

/// All of a row that solving for a body changes, and of what it is.
#[derive(Debug, Clone, Copy)]
struct Was {
    other: Option<usize>,
    force_W: Vector3<f64>,
    torque_W: Vector3<f64>,
    rest_W: Vector3<f64>,
    stiffness: [f64; 2],
    damping: [f64; 2],
}

impl Was {
    fn of(row: &Row) -> Self {
        let &Row { other, force_W, rest_W, stiffness, damping, .. } = row;
        Self { other, force_W, torque_W: row.torque_W(), rest_W, stiffness, damping }
    }
}

impl Room {
    pub(super) fn with_capacity(rows: usize) -> Self {
        Self { by_body: Vec::with_capacity(rows), were: Vec::with_capacity(rows) }
    }
}

/// The forces of these rows of all bodies, and the motions that they leave.
pub(super) fn solve(
    room: &mut Room,
    newton: &mut Newton,
    which: &[usize],
    rows: &mut [Row],
    motions: &mut [Motion],
    dt_s: f64,
) -> Solved {
    let Room { by_body, were } = room;
    by_body.clear();
    by_body.extend_from_slice(which);
    by_body.sort_unstable_by_key(|&at| (rows[at].body, at));
    for &at in by_body.iter() {
        let row = &mut rows[at];
        row.force_W = row.project(&row.force_W);
        (row.torsion.torque_nm, row.rolling.torque_W) = (0.0, Vector3::zeros());
        push(row, motions, &(row.force_W * dt_s));
    }
    let most_turns = (MAX_VISITS / by_body.len().max(1)).clamp(1, MAX_TURNS);
    let mut solved = Solved { unsolved: 1, ..Solved::default() };
    while solved.sweeps < most_turns && solved.unsolved > 0 {
        solved.sweeps += 1;
        let (mut changed, mut most) = (0.0_f64, 0.0_f64);
        let mut first = 0;
        while first < by_body.len() {
            let is_same = |&&at: &&usize| rows[at].body == rows[by_body[first]].body;
            let end = first + by_body[first..].iter().take_while(is_same).count();
            let [change, largest] = solve_body(were, newton, &by_body[first..end], rows, motions, dt_s);
            (changed, most) = (changed.max(change), most.max(largest));
            first = end;
        }
        solved.residual = if most > 0.0 { (changed / most).sqrt() } else { 0.0 };
        solved.unsolved = usize::from(solved.residual > SETTLED);
    }
    solved
}

/// The forces of one body's rows; returns the squares of their largest change and of the largest of them.
fn solve_body(
    were: &mut Vec<Was>,
    newton: &mut Newton,
    which: &[usize],
    rows: &mut [Row],
    motions: &mut [Motion],
    dt_s: f64,
) -> [f64; 2] {
    let body = rows[which[0]].body;
    were.clear();
    were.extend(which.iter().map(|&at| Was::of(&rows[at])));
    for &at in which {
        let row = &mut rows[at];
        motions[body].push(&(row.force_W * -dt_s), &row.arms_W[0]);
        motions[body].turn(&(row.torque_W() * -dt_s));
        if let Some(other) = row.other {
            // What all points give to the other together is at most so many times what one does.
            let sharing = were.iter().filter(|was| was.other == Some(other)).count();
            soften(row, &motions[other], sharing as f64, dt_s);
        }
    }
    newton.solve_alone(rows, which, &mut motions[body], dt_s);
    let (mut change, mut most) = (0.0_f64, 0.0_f64);
    for (&at, was) in which.iter().zip(were.iter()) {
        let row = &mut rows[at];
        (row.rest_W, row.stiffness, row.damping) = (was.rest_W, was.stiffness, was.damping);
        let (changed_W, turned_W) = (row.force_W - was.force_W, row.torque_W() - was.torque_W);
        if let Some(other) = row.other {
            motions[other].push(&(changed_W * -dt_s), &row.arms_W[1]);
            motions[other].turn(&(turned_W * -dt_s));
        }
        change = change.max(changed_W.norm_squared());
        most = most.max(row.force_W.norm_squared());
    }
    [change, most]
}

/// The row as its own body sees it, if the other moves like that with the force that the row has.
fn soften(row: &mut Row, other: &Motion, sharing: f64, dt_s: f64) {
    let arm_W = row.arms_W[1];
    let give_W = other.mobility_W(&arm_W) * (sharing * dt_s);
    let (n, velocity_W) = (row.normal_W, other.at(&arm_W));
    let gives = [n.dot(&(give_W * n)), give_W.diagonal().max()];
    let falls = row.falls(dt_s);
    let split = |v: &Vector3<f64>| {
        let along = n * n.dot(v);
        [along, v - along]
    };
    let (rests, moves, has) = (split(&row.rest_W), split(&velocity_W), split(&row.force_W));
    row.rest_W = Vector3::zeros();
    for part in 0..2 {
        let soft = 1.0 + falls[part] * gives[part];
        row.rest_W += (rests[part] + (moves[part] + has[part] * gives[part]) * falls[part]) / soft;
        row.stiffness[part] = falls[part] / soft / dt_s;
        row.damping[part] = 0.0;
    }
}

fn push(row: &Row, motions: &mut [Motion], impulse_W: &Vector3<f64>) {
    motions[row.body].push(impulse_W, &row.arms_W[0]);
    if let Some(other) = row.other {
        motions[other].push(&-impulse_W, &row.arms_W[1]);
    }
}
