//! Velocities that are reflected where entities meet.
//!
//! Problem: a body that meets what is fixed leaves with a share of the velocity it came with (Melder eq. 6.1). Among bodies that
//! meet each other it matters who meets whom first: in a row of balls the last one leaves, not all at once.
//!
//! Model: a body and what is fixed, or two bodies, meet one after the other, as they approach ([`Cascade`]): the points that meet
//! at once are reflected together ([`Bounce`]), which may drive others down, until nobody approaches; then all forces of the
//! tick are found together, in which nobody bounces any more. What meets is told by [`Meeting`].
//! Invariant: forces and velocities belong together, and forces on users are those that bodies got: an impulse is a force of its
//! row for the tick. So momentum is that of the forces, and no impulse adds energy.
//! Cost: nothing where nothing meets but a look at each row that may bounce.

mod bounce;
mod cascade;
mod meeting;

use nalgebra::Vector3;

use crate::row::Row;
use crate::solver::{Motion, Solved, Solver};
use cascade::Cascade;
pub(crate) use meeting::{Meeting, Stop};

/// Room for the impulses of a tick.
#[derive(Debug, Clone, Default)]
pub(crate) struct Restitution {
    /// Rows whose answer is an impulse.
    pub(crate) meetings: Vec<Meeting>,
    cascade: Cascade,
}

impl Restitution {
    pub(crate) fn with_capacity(rows: usize, bodies: usize) -> Self {
        Self { meetings: Vec::with_capacity(rows), cascade: Cascade::with_capacity(rows, bodies) }
    }

    /// Whether two bodies met at this row in the last tick.
    pub(crate) fn has_met(&self, row: usize) -> bool {
        self.cascade.has_met(row)
    }

    /// Solves for all rows' forces such that impacts give no energy. `motions` come in as they are without contacts, after
    /// `changes` by gravity and by turning on.
    pub(crate) fn solve(
        &mut self,
        solver: &mut Solver,
        rows: &mut [Row],
        (motions, changes): (&mut [Motion], &[Motion]),
        (gravity_W, dt_s): (&Vector3<f64>, f64),
    ) -> Solved {
        let Self { meetings, cascade } = self;
        solver.expect(&(gravity_W * dt_s));
        cascade.begin();
        if meetings.is_empty() {
            return solver.solve(rows, motions, dt_s);
        }
        let islands = solver.find_islands(rows, motions);
        for meeting in meetings.iter_mut() {
            let row = &rows[meeting.row];
            meeting.is_among_many =
                [Some(row.body), row.other].iter().flatten().any(|&body| islands.are_many(body));
        }
        cascade.run(meetings, rows, (motions, changes), dt_s);
        let solved = solver.solve(rows, motions, dt_s);
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
