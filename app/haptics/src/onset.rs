//! Onset of a contact: at once where the HIP came from outside, gently where it is found inside.
//!
//! Problem: a finger that is found inside (first tick, an entity put over it, a part of a mesh that another part let it into)
//! has a god-object somewhere on the surface. All of that spring at once throws a hand; and where a shape is narrow, or its
//! surface passes through itself, the way to that place may be longer than the finger is deep.
//!
//! Model: the force ramps in; and the spring is no longer than the overlap, with what the HIP has moved since, in the
//! entity's frame. The overlap is a lower bound of the way out that every shape knows. As soon as the spring is within
//! this bound, the bound is dropped: from there on the god-object only follows.
//!
//! Cost: nothing for a contact that came from outside; one signed distance where it begins inside.

use crate::algorithm::{Touch, TouchInput};

/// How much of a contact's force is rendered.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Onset {
    /// Of the ramp, 0 to 1.
    strength: f64,
    longest: Longest,
    /// What the last tick's force was multiplied by.
    share: f64,
}

/// The longest spring.
#[derive(Debug, Clone, Copy, Default)]
enum Longest {
    #[default]
    Any,
    /// Not known yet.
    Overlap,
    /// In metres.
    Bound(f64),
}

impl Onset {
    /// All of the force, at once.
    pub(crate) const AT_ONCE: Self = Self { strength: 1.0, longest: Longest::Any, share: 1.0 };
    /// A ramp, from the overlap on.
    pub(crate) const INSIDE: Self = Self { strength: 0.0, longest: Longest::Overlap, share: 0.0 };

    /// What the last tick's force was multiplied by, 0 to 1.
    pub(crate) fn share(&self) -> f64 {
        self.share
    }

    /// Whether all of the force is rendered.
    #[inline(always)]
    pub(crate) fn is_over(&self) -> bool {
        self.strength >= 1.0 && matches!(self.longest, Longest::Any)
    }

    /// One tick: what to multiply the force of `touch` by, which is the shape's own, before heights.
    #[inline(never)]
    pub(crate) fn share_of(
        &mut self,
        touch: &Touch,
        input: &TouchInput<'_>,
        [dt_s, ramp_in_s]: [f64; 2],
    ) -> f64 {
        let step = dt_s / ramp_in_s;
        // Where time is unknown or no ramp wanted, there is none.
        self.strength = if step > 0.0 { (self.strength + step).min(1.0) } else { 1.0 };
        self.share = self.strength * self.bounded(touch, input);
        self.share
    }

    /// The part of the force that a spring of the allowed length has.
    fn bounded(&mut self, touch: &Touch, input: &TouchInput<'_>) -> f64 {
        let bound_m = match self.longest {
            Longest::Any => return 1.0,
            Longest::Overlap => input.overlap_m(),
            Longest::Bound(bound_m) => {
                let way_B = input.previous_hip_B.map(|previous_B| input.cone.hip_B - previous_B);
                bound_m + way_B.map_or(0.0, |way_B| way_B.norm())
            }
        };
        // In this order no force overflows.
        let spring_m = (touch.force_on_user_B / input.cone.stiffness_n_per_m).norm();
        if spring_m <= bound_m * (1.0 + ROUNDING) {
            self.longest = Longest::Any;
            return 1.0;
        }
        self.longest = Longest::Bound(bound_m);
        bound_m / spring_m
    }
}

const ROUNDING: f64 = 1e-9;
