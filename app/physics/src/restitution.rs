//! Velocities that are reflected where entities meet.
//!
//! Problem: a body that meets what is fixed leaves with a share of the velocity it came with (Melder eq. 6.1). Among bodies that
//! meet each other it matters who meets whom first: in a row of balls the last one leaves, not all at once.
//!
//! Model: a body that only fingers and fixed things press is reflected at all its points together with everything else that presses it
//! ([`Bounce`]). Bodies that press each other meet in pairs, one pair after the other, as they approach ([`Cascade`]), until nobody
//! approaches; then all forces of the tick are found together, in which nobody bounces any more. What meets is told by
//! [`Meeting`].
//! Invariant: forces and velocities belong together, and forces on users are those that bodies got: an impulse is a force of its
//! row for the tick. So momentum is that of the forces, and no impulse adds energy.
//! Cost: nothing where nothing meets but a look at each row that may bounce.

mod bounce;
mod cascade;
mod meeting;

use nalgebra::Vector3;

use crate::row::Row;
use crate::solver::{Motion, Solved, Solver};
use bounce::{Bounce, Impulses};
use cascade::Cascade;
pub(crate) use meeting::{Meeting, Stop};

/// Room for the impulses of a tick.
#[derive(Debug, Clone, Default)]
pub(crate) struct Restitution {
    /// Rows whose answer is an impulse.
    pub(crate) meetings: Vec<Meeting>,
    impacts: Vec<usize>,
    stops: Vec<usize>,
    bounce: Bounce,
    cascade: Cascade,
}

impl Restitution {
    pub(crate) fn with_capacity(rows: usize, bodies: usize) -> Self {
        Self {
            meetings: Vec::with_capacity(rows),
            impacts: Vec::with_capacity(rows),
            stops: Vec::with_capacity(rows),
            bounce: Bounce::with_capacity(rows, bodies),
            cascade: Cascade::with_capacity(rows),
        }
    }

    /// Whether two bodies met at this row in the last tick.
    pub(crate) fn has_met(&self, row: usize) -> bool {
        self.cascade.has_met(row)
    }

    /// Solves for all rows' forces such that impacts give no energy.
    pub(crate) fn solve(
        &mut self,
        solver: &mut Solver,
        rows: &mut [Row],
        motions: &mut [Motion],
        (gravity_W, dt_s): (&Vector3<f64>, f64),
    ) -> Solved {
        let Self { meetings, impacts, stops, bounce, cascade } = self;
        solver.expect(&(gravity_W * dt_s));
        cascade.begin();
        impacts.clear();
        stops.clear();
        if meetings.is_empty() {
            return solver.solve(rows, motions, dt_s);
        }
        let islands = solver.find_islands(rows, motions);
        for meeting in meetings.iter_mut() {
            let row = &mut rows[meeting.row];
            meeting.is_among_many =
                [Some(row.body), row.other].iter().flatten().any(|&body| islands.are_many(body));
            match meeting.leaves_m_s(dt_s).filter(|_| !meeting.is_among_many) {
                Some(leaves_m_s) => {
                    meeting.reflect(row, leaves_m_s, dt_s);
                    // What bounces does not roll: a torque as large as the impulse would drive it.
                    (row.torsion, row.rolling) = Default::default();
                    impacts.push(meeting.row);
                }
                None => {
                    let in_order = meeting.is_among_many && meeting.bounces();
                    let is_stopped = !in_order && meeting.meets(dt_s);
                    if is_stopped {
                        meeting.stop(row, dt_s);
                    }
                    // Else its spring presses.
                    if is_stopped || meeting.stop.is_always {
                        stops.push(meeting.row);
                    }
                }
            }
        }
        cascade.run(meetings, rows, motions, dt_s);
        let solved =
            bounce.solve(solver, rows, Impulses { impacts, stops }, motions, (&(gravity_W * dt_s), dt_s));
        cascade.add_to(rows, dt_s);
        solved
    }
}

/// Angular velocity of the body relative to the other.
pub(crate) fn spin_W(row: &Row, motions: &[Motion]) -> Vector3<f64> {
    let own_W = motions[row.body].angular_velocity_W;
    row.other.map_or(own_W, |other| own_W - motions[other].angular_velocity_W)
}

/// Velocity of the body's point relative to the other's.
pub(crate) fn velocity(row: &Row, motions: &[Motion]) -> Vector3<f64> {
    let own_W = motions[row.body].at(&row.arms_W[0]);
    row.other.map_or(own_W, |other| own_W - motions[other].at(&row.arms_W[1]))
}
