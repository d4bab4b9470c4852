//! Bodies that meet each other: pair by pair, as they approach.
//!
//! Problem: reflected all at once, the velocities of balls in a row are none that balls have: of Newton's cradle, all five would
//! move. Pairs that meet one after the other, and pass on what they got, move as real ones.
//!
//! Model: of all points that approach and close within the tick, the one that closes first (of several at once, the fastest)
//! tells which two meet; until then all gaps have become what they are by that time. All points of the two are reflected together
//! ([`Bounce`]), with friction and without a gain of energy, while everybody else goes on; then the next two meet, until nobody approaches. Impulses in a row that lose energy each time
//! need not end; what still approaches after [`MAX_MEETINGS`] is stopped with all other forces of the tick. Without
//! any bounce (e = 0) nothing has to be in order, and all of it is left to them.
//! Invariant: what one gets the other gives, at the same point: momentum and angular momentum of the two are kept.
//! Cost: a solution for two bodies in each meeting, and a look at all points.

use nalgebra::Vector3;

use super::{Bounce, Impulses, Meeting, velocity};
use crate::pair::HARD;
use crate::row::Row;
use crate::solver::{Motion, Solver};

/// The most pairs that meet in a tick.
const MAX_MEETINGS: usize = 128;
/// The most points of two that meet.
const MAX_POINTS: usize = 32;
/// Roundings of where bodies are \[m\]: what closes at once closes at the same time.
const ROUNDING_M: f64 = 1e-12;

/// What met in a tick.
#[derive(Debug, Clone, Default)]
pub(super) struct Cascade {
    /// Of each row, as far as any has met \[N s\].
    impulses_W: Vec<Vector3<f64>>,
    /// Of the two that meet now: points, which of them are reflected, and motions.
    rows: Vec<Row>,
    impacts: Vec<usize>,
    stops: Vec<usize>,
    motions: Vec<Motion>,
    solver: Solver,
    bounce: Bounce,
}

impl Cascade {
    pub(super) fn with_capacity(rows: usize) -> Self {
        Self {
            impulses_W: Vec::with_capacity(rows),
            rows: Vec::with_capacity(MAX_POINTS),
            impacts: Vec::with_capacity(MAX_POINTS),
            stops: Vec::with_capacity(MAX_POINTS),
            motions: Vec::with_capacity(2),
            solver: Solver::with_capacity(MAX_POINTS, 2),
            bounce: Bounce::with_capacity(MAX_POINTS, 2),
        }
    }

    /// Forgets the last tick.
    pub(super) fn begin(&mut self) {
        self.impulses_W.clear();
    }

    pub(super) fn has_met(&self, row: usize) -> bool {
        self.impulses_W.get(row).is_some_and(|impulse_W| *impulse_W != Vector3::zeros())
    }

    /// Lets all meet that do, and moves them on; rows that have met go on with an impulse's friction.
    pub(super) fn run(
        &mut self,
        meetings: &mut [Meeting],
        rows: &mut [Row],
        motions: &mut [Motion],
        dt_s: f64,
    ) {
        meetings.iter_mut().for_each(|meeting| meeting.gap_m = open(meeting.gap_m));
        for _ in 0..MAX_MEETINGS {
            let Some(two) = next(meetings, rows, motions, dt_s) else { break };
            if self.impulses_W.is_empty() {
                self.impulses_W.resize(rows.len(), Vector3::zeros());
            }
            self.meet(two, meetings, rows, motions, dt_s);
        }
        for meeting in meetings.iter().filter(|meeting| self.has_met(meeting.row)) {
            meeting.stop(&mut rows[meeting.row], dt_s);
        }
    }

    /// Reflects all points of two bodies, or of one and what is fixed.
    fn meet(
        &mut self,
        (body, other): (usize, Option<usize>),
        meetings: &[Meeting],
        rows: &[Row],
        motions: &mut [Motion],
        dt_s: f64,
    ) {
        self.gather((body, other), meetings, rows, motions, dt_s);
        self.bounce.solve(
            &mut self.solver,
            &mut self.rows,
            Impulses { impacts: &self.impacts, stops: &self.stops },
            &mut self.motions,
            (&Vector3::zeros(), dt_s),
        );
        let solved = meetings.iter().filter(|meeting| is_of(&rows[meeting.row], body, other));
        for (meeting, row) in solved.zip(&self.rows) {
            self.impulses_W[meeting.row] += row.force_W * dt_s;
        }
        let moved = [Some(body), other.filter(|&other| motions[other].is_movable())];
        for (body, motion) in moved.into_iter().flatten().zip(&self.motions) {
            motions[body] = *motion;
        }
    }

    /// Takes both bodies and their points: those that meet are reflected, the others held back where they are.
    fn gather(
        &mut self,
        (body, other): (usize, Option<usize>),
        meetings: &[Meeting],
        rows: &[Row],
        motions: &[Motion],
        dt_s: f64,
    ) {
        self.motions.clear();
        self.motions.push(motions[body]);
        self.motions.extend(other.map(|other| motions[other]));
        self.rows.clear();
        self.impacts.clear();
        self.stops.clear();
        for meeting in
            meetings.iter().filter(|meeting| is_of(&rows[meeting.row], body, other)).take(MAX_POINTS)
        {
            let was = &rows[meeting.row];
            let n = was.normal_W;
            let mut row = Row { body: 0, other: other.map(|_| 1), force_W: Vector3::zeros(), ..*was };
            (row.torsion, row.rolling) = Default::default();
            let leaves_m_s = meeting.leaves_m_s(dt_s);
            // What is stopped gives way by a part in so many: that much more is asked for.
            let freely_m_s = n.dot(&velocity(was, motions));
            let more = |m_s: f64| m_s + (m_s - freely_m_s) / HARD;
            meeting.reflect(&mut row, leaves_m_s.map_or(-meeting.gap_m / dt_s, more), dt_s);
            let kind = if leaves_m_s.is_some() { &mut self.impacts } else { &mut self.stops };
            kind.push(self.rows.len());
            self.rows.push(row);
        }
    }

    /// Adds what was given to the forces of the tick.
    pub(super) fn add_to(&self, rows: &mut [Row], dt_s: f64) {
        rows.iter_mut().zip(&self.impulses_W).for_each(|(row, impulse_W)| row.force_W += impulse_W / dt_s);
    }
}

/// Which two meet next: a body, and another one or what is fixed. Lets the time pass until then.
fn next(
    meetings: &mut [Meeting],
    rows: &[Row],
    motions: &[Motion],
    dt_s: f64,
) -> Option<(usize, Option<usize>)> {
    let mut first: Option<([f64; 2], &Row)> = None;
    for meeting in meetings.iter_mut().filter(|meeting| meeting.is_among_many && meeting.bounces()) {
        let row = &rows[meeting.row];
        meeting.look(row, motions);
        if meeting.meets(dt_s) {
            let order = [meeting.gap_m / meeting.approaches_m_s, -meeting.approaches_m_s];
            first = first.filter(|(least, _)| *least <= order).or(Some((order, row)));
        }
    }
    let ([after_s, _], row) = first?;
    for meeting in meetings {
        meeting.gap_m = open(meeting.gap_m - meeting.approaches_m_s * after_s);
    }
    Some((row.body, row.other))
}

/// A gap, or none where it is of roundings (m).
fn open(gap_m: f64) -> f64 {
    if gap_m > ROUNDING_M { gap_m } else { 0.0 }
}

fn is_of(row: &Row, body: usize, other: Option<usize>) -> bool {
    row.body == body && row.other == other
}
