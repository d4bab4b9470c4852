//! Where a curve of friction against speed is met: what the models with such a curve share.
//!
//! Problem: with D the gap before the move and L the load, the move x solves
//! `D - x = L mu(x / dt)`. Where the curve falls with speed there are several solutions.
//!
//! Model: the god-object has no mass, so at a given HIP it moves faster while the spring pulls more
//! than friction holds, and slower while it pulls less, until it meets a solution. That is the first
//! one met from the speed it had before: from rest the smallest, and while sliding the one of the
//! branch on which it slides. If there is none down to rest, it rests. So it breaks away with the
//! least jump, sticks again where sliding can no longer be sustained, and never lands on a solution
//! from which any disturbance would drive it away.
//!
//! The speed before is kept over ticks in which it did not move: an encoder that happens not to
//! count during one tick has not stopped the hand.

use crate::friction_law::{FrictionMemory, FrictionQuery, FrictionState};

/// Word of the memory that holds the speed (m/s).
const SPEED: usize = 0;

/// To be called once a tick, by `holds`.
pub(super) fn remember_speed(query: &FrictionQuery, memory: &mut FrictionMemory) {
    if query.state == FrictionState::Stick {
        memory.words[SPEED] = 0.0;
    } else if query.last_travel_m > 0.0 && knows_time(query) {
        memory.words[SPEED] = query.last_travel_m / query.dt_s;
    }
}

/// The travel from which the search begins (m): that at the speed before, or where it is once it has moved farther than that.
///
/// On a curved surface the gap changes a little with every round, and the search must not hop to another branch then. Short
/// of that travel it may be on an edge of a mesh, on its way to a branch that does not begin yet.
pub(super) fn start_m(query: &FrictionQuery, memory: &FrictionMemory) -> f64 {
    query.travel_m.max(memory.words[SPEED] * query.dt_s)
}

/// A move after which the gap is within `limit_m` to either side of S.
///
/// On a plane every model sees to that by itself. Round a needle a god-object can come to lie on the
/// other side of where it was, and what it was to keep of its strain is then on the wrong side too.
pub(super) fn within(limit_m: f64, slide_m: f64, query: &FrictionQuery) -> f64 {
    slide_m.max(query.gap_m - limit_m).min(query.gap_m + limit_m)
}

pub(super) fn knows_time(query: &FrictionQuery) -> bool {
    query.dt_s > 0.0 && query.dt_s.is_finite()
}

/// Closer to its curve than this, against the load, a slide is there: a tenth of what counts as rest.
/// Where the curve all but touches its solution, the move is far less certain than the force.
pub(super) const ON_THE_CURVE: f64 = 1e-13;
