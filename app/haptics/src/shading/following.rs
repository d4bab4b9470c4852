//! A shaded force that is continuous in the HIP: it changes no faster than the finger goes.
//!
//! Problem: where the god-object comes to the next face, what its force is turned from leaps. Over a convex edge the
//! god-object itself leaps, since below it the HIP has long been under the next face, and the shaded normal with it, by the
//! more the deeper the finger is. Held or slowed by friction it goes over the edge step by step; its force then stays, and
//! is turned as the next face's all of a sudden.
//!
//! Model: of a tick's change of the shaded force, one part is what the same force would have become by being turned at
//! another place. Where that part is most of the change, the force goes towards what shading makes of the god-object by no
//! more than `RATE` times the stiffness per way of the finger. What an edge that stays sharp does to the force is none of
//! it: there the force is turned alike on both sides, if at all.
//!
//! Frames: object frame B.
//! Invariant: in ticks without such a change the force is that of [`Shading::turn`](super::Shading::turn), to the bit.

use nalgebra::Vector3;

use super::form::Turn;
use crate::algorithm::Touch;

/// Memory of a shaded contact: the force of the last tick, as the facets have it and as it was felt (N).
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Following {
    last: Option<[Vector3<f64>; 2]>,
}

impl Following {
    /// Lets a force that was shaded go on from that of the last tick, in a tick in which the spring's end moved by so much
    /// force (N).
    pub(crate) fn follow(&mut self, plain_B: Vector3<f64>, touch: &mut Touch, spring_n: f64) {
        let shaded_B = touch.force_on_user_B;
        let felt_B = match self.last {
            Some(last) => limited(last, [plain_B, shaded_B], RATE * spring_n),
            None => shaded_B,
        };
        self.last = Some([plain_B, felt_B]);
        if felt_B != shaded_B {
            touch.normal_force_n *= felt_B.norm() / shaded_B.norm();
            touch.force_on_user_B = felt_B;
        }
    }

    /// Nothing is known of the last tick.
    pub(crate) fn reset(&mut self) {
        *self = Self::default();
    }
}

/// The shaded force; where it leaps because it is turned in another way, as near to it as `most_n` from the last allows.
fn limited(
    [last_plain_B, last_felt_B]: [Vector3<f64>; 2],
    [plain_B, shaded_B]: [Vector3<f64>; 2],
    most_n: f64,
) -> Vector3<f64> {
    let change_B = shaded_B - last_felt_B;
    let change_n = change_B.norm();
    let (size_n, last_n) = (shaded_B.norm(), last_felt_B.norm());
    if change_n <= most_n + SLACK * size_n || size_n.max(last_n) > MOST_SIZE * size_n.min(last_n) {
        return shaded_B;
    }
    let turn = Turn { from_B: plain_B / size_n, to_B: shaded_B };
    let turned_n = (turn.rotated(&last_plain_B) - last_felt_B).norm();
    if turned_n < MOSTLY * change_n {
        return shaded_B;
    }
    last_felt_B + change_B * (most_n / change_n)
}

/// How fast the force goes towards the shaded one, in springs of the finger's way: twice what either the spring or the
/// turn makes of it on a surface as round as the finger is deep.
const RATE: f64 = 2.0;
/// Roundings of a force are no leap.
const SLACK: f64 = 1e-12;
/// Part of a change from which on the turn has made it.
const MOSTLY: f64 = 0.5;
/// A leap that changes the size of the force by more is no shaded edge's.
const MOST_SIZE: f64 = 1.25;
