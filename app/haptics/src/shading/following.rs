//! A shaded force that is continuous in the HIP: after a leap it follows with the finger's way.
//!
//! Problem: where the god-object comes to the next face, what its force is turned from leaps. Over a convex edge the
//! god-object itself leaps, since below it the HIP has long been under the next face, and the shaded normal with it, by the
//! more the deeper the finger is. Held or slowed by friction it goes over the edge step by step; its force then stays, and
//! is turned as the next face's all of a sudden.
//!
//! Model: between two ticks a shaded force changes in two ways: the facets' force changes, and it is turned otherwise. Of
//! the second, what the old force would have become at the new place tells how much there is. Where the god-object leaps or
//! its normal does, and the second is most of the change, the force stays what it was, and comes nearer to what
//! shading makes of the god-object as the finger goes: within half of the way that would turn the facets' spring as much,
//! which over an edge is that of the god-object's leap. What an edge that stays sharp does to the force is none of it: there
//! the force is turned alike on both sides, if at all.
//!
//! Frames: object frame B.
//! Invariants: without such a change the force is that of [`Shading::turn`](super::Shading::turn), to the bit; the size of
//! the felt force rises no faster than that of the facets'.

use nalgebra::Vector3;

use super::form::Turn;
use crate::algorithm::Touch;
use crate::surface::SurfacePoint;

/// Memory of a shaded contact.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Following {
    last: Option<Forces>,
    leap: Option<Leap>,
}

/// A tick's force.
#[derive(Debug, Clone, Copy)]
struct Forces {
    /// Place of the god-object.
    point_B: Vector3<f64>,
    /// Of the facets.
    normal_B: Vector3<f64>,
    /// As the facets have it.
    plain_B: Vector3<f64>,
    shaded_B: Vector3<f64>,
}

/// A leap that has not been made up for.
#[derive(Debug, Clone, Copy)]
struct Leap {
    /// From the shaded force to one in the direction of what is felt (N).
    off_B: Vector3<f64>,
    /// Of what is felt, in sizes of the shaded force: one or more, so that making up for it is no rise.
    size: f64,
    /// Way left until it is made up for, as a change of the spring (N).
    left_n: f64,
}

impl Following {
    /// Lets a force that was shaded go on from that of the last tick, in a tick in which the finger went so far (m), held by
    /// this stiffness (N/m).
    pub(crate) fn follow(
        &mut self,
        plain_B: Vector3<f64>,
        touch: &mut Touch,
        way_m: f64,
        stiffness_n_per_m: f64,
    ) {
        let SurfacePoint { point_B, normal_B, .. } = touch.god_object;
        let now = Forces { point_B, normal_B, plain_B, shaded_B: touch.force_on_user_B };
        let spring_n = stiffness_n_per_m * way_m;
        let Some(last) = self.last.replace(now) else { return };
        self.leap = self.leap.and_then(|leap| leap.after(MADE_UP * spring_n));
        let [size_n, last_n] = [now, last].map(|forces| forces.shaded_B.norm());
        if size_n.max(last_n) > MOST_SIZE * size_n.min(last_n) {
            self.leap = None;
            return;
        }
        let turns = (normal_B - last.normal_B).norm() * size_n > LEAP_TURN * spring_n + SLACK * size_n;
        let moves = (point_B - last.point_B).norm() > LEAP_WAY * way_m + SLACK_M;
        if turns || moves {
            let (back_B, turned_n) = (last.shaded_B - now.shaded_B, now.turned_since(&last, size_n));
            if turned_n >= MOSTLY * back_B.norm() {
                let Leap { off_B, size, left_n } = self.leap.unwrap_or(Leap::NONE);
                self.leap = Some(Leap {
                    off_B: off_B + back_B,
                    size: (size * last_n / size_n).clamp(1.0, MOST_SIZE),
                    left_n: (left_n + turned_n).min(LONGEST * size_n),
                });
            }
        }
        if let Some(Leap { off_B, size, .. }) = self.leap
            && let Some(direction_B) = (now.shaded_B + off_B).try_normalize(0.0)
        {
            touch.force_on_user_B = direction_B * (size * size_n);
            touch.normal_force_n *= size;
        }
    }

    /// Nothing is known of the last tick.
    pub(crate) fn reset(&mut self) {
        *self = Self::default();
    }
}

impl Forces {
    /// Difference between the last force as it was shaded, and as it would be where this one is (N).
    fn turned_since(&self, last: &Self, size_n: f64) -> f64 {
        let turn = Turn { from_B: self.plain_B / size_n, to_B: self.shaded_B };
        (turn.rotated(&last.plain_B) - last.shaded_B).norm()
    }
}

impl Leap {
    const NONE: Self = Self { off_B: Vector3::new(0.0, 0.0, 0.0), size: 1.0, left_n: 0.0 };

    fn after(self, made_up_n: f64) -> Option<Self> {
        let left_n = self.left_n - made_up_n;
        let share = left_n / self.left_n;
        let size = 1.0 + (self.size - 1.0) * share;
        (left_n > 0.0).then(|| Self { off_B: self.off_B * share, size, left_n })
    }
}

/// A turn of the facets that takes more than so many springs of the finger's way is a leap: about the edge of a groove it
/// takes one.
const LEAP_TURN: f64 = 2.0;
/// As often as the finger's way the god-object's is no leap: deep below a hill it is some times as far.
const LEAP_WAY: f64 = 4.0;
/// Roundings of a force, as a part of it, and of places on a surface of a metre (m), are no leap.
const SLACK: f64 = 1e-12;
const SLACK_M: f64 = 1e-9;
/// Part of a leap that is made up for in a way of the same length.
const MADE_UP: f64 = 2.0;
/// In forces: what turns all the way round is made up for in this way. Made up for more slowly, a size would rise with the
/// spring.
const LONGEST: f64 = 2.0;
/// Part of a change from which on the turn has made it.
const MOSTLY: f64 = 0.5;
/// A leap that changes the size of the force by more is no shaded edge's.
const MOST_SIZE: f64 = 1.25;
