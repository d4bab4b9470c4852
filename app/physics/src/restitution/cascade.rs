//! Bodies that meet each other: pair by pair, as they approach.
//!
//! Problem: reflected all at once, the velocities of balls in a row are none that balls have: of Newton's cradle, all five would
//! move. Pairs that meet one after the other, and pass on what they got, move as real ones.
//!
//! Model: of all points that approach and close within the tick, the one that closes first (of several at once, the fastest)
//! tells which two meet; until then all gaps have become what they are by that time. All points of the two are reflected together
//! ([`Bounce`]) that meet, with friction and without a gain of energy, while everybody else goes on; then the next two meet, until
//! nobody approaches. So of a box that lands on an edge one corner comes after the other, as often as it takes, and nothing is
//! lost. Impulses in a row that lose energy each time need not end; what still approaches after [`MAX_MEETINGS`] is stopped
//! with all other forces of the tick, as is what does not bounce. Without any bounce (e = 0) nothing has to be in order, and
//! all of it is left to them.
//! A body alone leaves as [`Meeting`] has it, from where it is; among many the time passes that they take.
//! Invariant: what one gets the other gives, at the same point: momentum and angular momentum of the two are kept.
//! Cost: a solution for two bodies in each meeting, and a look at all points.

use nalgebra::Vector3;

use super::bounce::Bounce;
use super::{Meeting, velocity};
use crate::pair::HARD;
use crate::row::Row;
use crate::solver::{Motion, Solver};

/// The most pairs that meet in a tick, among many.
const MAX_MEETINGS: usize = 128;
/// The most meetings of a body alone with what is fixed in a tick.
const MAX_OF_ONE: usize = 64;
/// The most points of two that meet.
const MAX_POINTS: usize = 32;
/// Roundings of where bodies are \[m\]: what closes at once closes at the same time.
const ROUNDING_M: f64 = 1e-12;

/// What met in a tick.
#[derive(Debug, Clone, Default)]
pub(super) struct Cascade {
    /// Of each row, as far as any has met \[N s\].
    impulses_W: Vec<Vector3<f64>>,
    /// Meetings by the bodies of their rows, and where those of each begin.
    order: Vec<usize>,
    starts: Vec<usize>,
    /// Of the two that meet now: their meetings, points and motions.
    meet: Vec<usize>,
    rows: Vec<Row>,
    motions: Vec<Motion>,
    changes: Vec<Motion>,
    solver: Solver,
    bounce: Bounce,
}

impl Cascade {
    pub(super) fn with_capacity(rows: usize, bodies: usize) -> Self {
        Self {
            impulses_W: Vec::with_capacity(rows),
            order: Vec::with_capacity(rows),
            starts: Vec::with_capacity(bodies + 2),
            meet: Vec::with_capacity(MAX_POINTS),
            rows: Vec::with_capacity(MAX_POINTS),
            motions: Vec::with_capacity(2),
            changes: Vec::with_capacity(2),
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

    /// Lets all meet that do, and moves them on; rows that have met, or should, go on with an impulse's friction.
    pub(super) fn run(
        &mut self,
        meetings: &mut [Meeting],
        rows: &mut [Row],
        (motions, changes): (&mut [Motion], &[Motion]),
        dt_s: f64,
    ) {
        let of_many = meetings.iter_mut().filter(|meeting| meeting.is_among_many);
        of_many.for_each(|meeting| meeting.gap_m = open(meeting.gap_m));
        if meetings.iter().any(|meeting| meeting.will_bounce(dt_s)) {
            self.impulses_W.resize(rows.len(), Vector3::zeros());
            self.sort(meetings, rows, motions.len());
            for body in 0..motions.len() {
                for _ in 0..MAX_OF_ONE {
                    let of_body = &self.order[self.starts[body]..self.starts[body + 1]];
                    let Some(two) = next(meetings, of_body, false, rows, motions, dt_s) else { break };
                    self.meet(two, meetings, rows, (motions, changes), dt_s);
                }
            }
            for _ in 0..MAX_MEETINGS {
                let Some(two) = next(meetings, &self.order, true, rows, motions, dt_s) else { break };
                self.meet(two, meetings, rows, (motions, changes), dt_s);
            }
        }
        for meeting in meetings {
            let row = &mut rows[meeting.row];
            let has_met = self.has_met(meeting.row);
            if has_met || meeting.meets(dt_s) {
                meeting.stop(row, dt_s);
            } else if meeting.is_among_many && meeting.will_come() {
                meeting.pass_by(row);
            }
            if has_met {
                // What bounces does not roll: a torque as large as the impulse would drive it.
                (row.torsion, row.rolling) = Default::default();
            }
        }
    }

    /// By counting.
    fn sort(&mut self, meetings: &[Meeting], rows: &[Row], bodies: usize) {
        self.starts.clear();
        self.starts.resize(bodies + 2, 0);
        let body = |meeting: &Meeting| rows[meeting.row].body;
        meetings.iter().for_each(|meeting| self.starts[body(meeting) + 2] += 1);
        (1..self.starts.len()).for_each(|at| self.starts[at] += self.starts[at - 1]);
        self.order.clear();
        self.order.resize(meetings.len(), 0);
        for (at, meeting) in meetings.iter().enumerate() {
            let next = &mut self.starts[body(meeting) + 1];
            self.order[*next] = at;
            *next += 1;
        }
    }

    /// Reflects all points that meet of two bodies, or of one and what is fixed.
    fn meet(
        &mut self,
        (body, other): (usize, Option<usize>),
        meetings: &mut [Meeting],
        rows: &[Row],
        (motions, changes): (&mut [Motion], &[Motion]),
        dt_s: f64,
    ) {
        let are_many = self.gather((body, other), meetings, rows, motions, dt_s);
        let both = [Some(body), other].into_iter().flatten();
        self.changes.clear();
        self.changes.extend(both.map(|body| changes[body]));
        if are_many {
            self.changes.iter_mut().for_each(|change| change.velocity_W = Vector3::zeros());
        }
        self.bounce.solve(&mut self.solver, &mut self.rows, &mut self.motions, (&self.changes, dt_s));
        for (&at, row) in self.meet.iter().zip(&self.rows) {
            self.impulses_W[meetings[at].row] += row.force_W * dt_s;
            meetings[at].has_met();
        }
        let moved = [Some(body), other.filter(|&other| motions[other].is_movable())];
        for (body, motion) in moved.into_iter().flatten().zip(&self.motions) {
            motions[body] = *motion;
        }
    }

    /// Takes both bodies and their points that meet; says whether they are among many.
    fn gather(
        &mut self,
        (body, other): (usize, Option<usize>),
        meetings: &[Meeting],
        rows: &[Row],
        motions: &[Motion],
        dt_s: f64,
    ) -> bool {
        self.motions.clear();
        self.motions.push(motions[body]);
        self.motions.extend(other.map(|other| motions[other]));
        self.rows.clear();
        self.meet.clear();
        let mut are_many = false;
        let of_body = &self.order[self.starts[body]..self.starts[body + 1]];
        for &at in of_body.iter().filter(|&&at| rows[meetings[at].row].other == other) {
            let meeting = &meetings[at];
            let Some(leaves_m_s) = meeting.leaves_m_s(dt_s).filter(|_| meeting.bounces()) else { continue };
            if self.meet.len() == MAX_POINTS {
                break;
            }
            are_many |= meeting.is_among_many;
            let was = &rows[meeting.row];
            let n = was.normal_W;
            let mut row = Row { body: 0, other: other.map(|_| 1), force_W: Vector3::zeros(), ..*was };
            (row.torsion, row.rolling) = Default::default();
            // What is stopped gives way by a part in so many: that much more is asked for, of what is passed on.
            let lacks_m_s = (leaves_m_s - n.dot(&velocity(was, motions))) / HARD;
            meeting.reflect(&mut row, leaves_m_s + if other.is_some() { lacks_m_s } else { 0.0 }, dt_s);
            self.meet.push(at);
            self.rows.push(row);
        }
        are_many
    }

    /// Adds what was given to the forces of the tick.
    pub(super) fn add_to(&self, rows: &mut [Row], dt_s: f64) {
        rows.iter_mut().zip(&self.impulses_W).for_each(|(row, impulse_W)| row.force_W += impulse_W / dt_s);
    }
}

/// The two of these that meet next: a body, and another one or what is fixed. Among many it lets the time pass until then.
fn next(
    meetings: &mut [Meeting],
    which: &[usize],
    are_many: bool,
    rows: &[Row],
    motions: &[Motion],
    dt_s: f64,
) -> Option<(usize, Option<usize>)> {
    let mut first: Option<([f64; 2], &Row)> = None;
    for &at in which {
        let meeting = &mut meetings[at];
        if meeting.is_among_many != are_many || !meeting.bounces() {
            continue;
        }
        let row = &rows[meeting.row];
        meeting.look(row, motions);
        if meeting.leaves_m_s(dt_s).is_some() {
            let order = [meeting.gap_m / meeting.approaches_m_s, -meeting.approaches_m_s];
            first = first.filter(|(least, _)| *least <= order).or(Some((order, row)));
        }
    }
    let ([after_s, _], row) = first?;
    for meeting in meetings.iter_mut().filter(|meeting| are_many && meeting.is_among_many) {
        meeting.gap_m = open(meeting.gap_m - meeting.approaches_m_s * after_s);
    }
    Some((row.body, row.other))
}

/// A gap, or none where it is of roundings (m).
fn open(gap_m: f64) -> f64 {
    if gap_m > ROUNDING_M { gap_m } else { 0.0 }
}
