//! Onset of a contact, and its bound: no force that finger and entity have not moved for.
//!
//! Problem: a finger that is found inside (first tick, an entity put over it, a part of a mesh that another part let it into)
//! has a god-object somewhere on the surface. All of that spring at once throws a hand; and where a shape is narrow, or its
//! surface passes through itself, the way to that place may be longer than the finger is deep. And should a god-object ever
//! leap, for a reason that nobody thought of, its spring must not.
//!
//! Model: the force of a contact that begins inside ramps in, and the spring is no longer than the overlap, with what the HIP
//! has moved since, in the entity's frame. The overlap is a lower bound of the way out that every shape knows. As soon as
//! the spring and the way to the god-object are within this bound, the bound is dropped. From there on the god-object only
//! follows: it is never farther from the HIP than a tick ago, but for what the HIP has moved. A tick in which it is brings the
//! bound back, and is told.
//!
//! Somebody may have a contact go on with a shorter spring ([`Onset::shorten`]): what it was longer by is forgotten until the finger
//! is out, as of what gave way for good.
//!
//! A god-object that did not come to rest within its tick's work, or that flies from one part to the next, bears less than
//! its spring. Where it comes to rest all of the spring would be back at once, after a tick without any: the force grows by
//! no more than the hand's way, the damper and the ramp.
//!
//! Cost: of a contact that came from outside three roots a tick; where it begins inside one signed distance, of a ball that
//! overlaps a mesh or joined solids its nearest foot.

use crate::algorithm::{Touch, TouchInput};

/// How much of a contact's force is rendered.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Onset {
    /// Of the ramp, 0 to 1.
    strength: f64,
    longest: Longest,
    /// What the last tick's force was multiplied by.
    share: f64,
    /// How far the god-object was from the HIP in the last tick (m).
    lag_m: f64,
    /// The part of that which it bore, before the ramp (m).
    spring_m: f64,
    /// The same without any bound (m).
    whole_m: f64,
    /// Whether it is farther away than it can have been left behind.
    leapt: bool,
    /// What was cut for it (N).
    missing_n: f64,
    /// How much of the force came on in the last tick with a ramp (N).
    came_on_n: f64,
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
    /// In metres; grows with the ramp until it is all that there is.
    Growing(f64),
    /// All but this, which is forgotten (m).
    Without(f64),
}

impl Onset {
    /// All of the force, at once.
    pub(crate) const AT_ONCE: Self = Self {
        strength: 1.0,
        longest: Longest::Any,
        share: 1.0,
        lag_m: 0.0,
        spring_m: 0.0,
        whole_m: 0.0,
        leapt: false,
        missing_n: 0.0,
        came_on_n: 0.0,
    };
    /// A ramp, from the overlap on.
    pub(crate) const INSIDE: Self =
        Self { strength: 0.0, longest: Longest::Overlap, share: 0.0, ..Self::AT_ONCE };

    /// All of the force from the next tick on, whatever there was of it.
    pub(crate) fn end(&mut self) {
        *self = Self { lag_m: self.lag_m, spring_m: self.spring_m, ..Self::AT_ONCE };
    }

    /// The spring goes on from this length (m), if it was longer: what it was longer by is forgotten, and gives nothing back as the
    /// finger comes out.
    pub(crate) fn shorten(&mut self, spring_m: f64) {
        if spring_m < self.whole_m * self.share && self.strength > 0.0 {
            self.longest = Longest::Without((self.whole_m - spring_m / self.strength).max(0.0));
        }
    }

    /// What the last tick's force was multiplied by, 0 to 1.
    pub(crate) fn share(&self) -> f64 {
        self.share
    }

    /// Whether the god-object leapt in the last tick.
    pub(crate) fn leapt(&self) -> bool {
        self.leapt
    }

    /// What was cut in the tick in which it leapt (N).
    pub(crate) fn missing_n(&self) -> f64 {
        if self.leapt { self.missing_n } else { 0.0 }
    }

    /// How much of the force came on in the last tick because a ramp did (N).
    pub(crate) fn came_on_n(&self) -> f64 {
        self.came_on_n
    }

    /// One tick: what to multiply the force of `touch` by, which is the shape's own, before heights.
    #[inline(always)]
    pub(crate) fn share_of(&mut self, touch: &Touch, input: &TouchInput<'_>, times: [f64; 2]) -> f64 {
        let lag_m = (touch.god_object.point_B - input.cone.hip_B).norm();
        // In this order no force overflows.
        let spring_m = (touch.force_on_user_B / input.cone.stiffness_n_per_m).norm();
        let moved_m = input.way_m();
        let was_over = self.strength >= 1.0 && matches!(self.longest, Longest::Any);
        self.leapt = was_over && lag_m > self.lag_m + moved_m + SLACK_M;
        if self.leapt {
            self.longest = Longest::Bound(self.lag_m);
        } else if spring_m > self.spring_m + moved_m + SLACK_M && matches!(self.longest, Longest::Any) {
            self.grow_if_it_fell_behind(spring_m, moved_m, input);
        }
        if let Longest::Without(forgotten_m) = &mut self.longest {
            *forgotten_m += (spring_m - self.whole_m - moved_m - SLACK_M).max(0.0);
        }
        (self.lag_m, self.spring_m, self.whole_m) = (lag_m, spring_m, spring_m);
        self.came_on_n = 0.0;
        if self.strength >= 1.0 && matches!(self.longest, Longest::Any) {
            1.0
        } else {
            self.less_than_all(spring_m, input, times)
        }
    }

    /// Bounds a spring that grew by more than the way, if in the last tick it was not all of what the god-object was behind.
    #[cold]
    fn grow_if_it_fell_behind(&mut self, spring_m: f64, moved_m: f64, input: &TouchInput<'_>) {
        let damper_m = input.cone.damping_s() * input.cone.hip_velocity_B.norm();
        let fell_behind = self.lag_m > self.spring_m + damper_m + SLACK_M;
        if fell_behind && spring_m > self.spring_m + moved_m + damper_m + SLACK_M {
            self.longest = Longest::Growing(self.spring_m + damper_m);
        }
    }

    #[inline(never)]
    fn less_than_all(&mut self, spring_m: f64, input: &TouchInput<'_>, [dt_s, ramp_in_s]: [f64; 2]) -> f64 {
        let (step, before) = (dt_s / ramp_in_s, self.strength);
        let grows = matches!(self.longest, Longest::Growing(_));
        // Where time is unknown or no ramp wanted, there is none.
        self.strength = if step > 0.0 { (self.strength + step).min(1.0) } else { 1.0 };
        self.share = self.strength * self.bounded(spring_m, input, step);
        let force_n = spring_m * input.cone.stiffness_n_per_m;
        // Without a ramp none explains what comes at once.
        let growing = if grows && step.is_finite() { step } else { 0.0 };
        self.came_on_n = force_n * (self.strength - before + growing);
        self.missing_n = force_n * (1.0 - self.share);
        self.share
    }

    /// The part of the force that a spring of the allowed length has; `step` is the ramp's in this tick.
    fn bounded(&mut self, spring_m: f64, input: &TouchInput<'_>, step: f64) -> f64 {
        let bound_m = match self.longest {
            Longest::Any => return 1.0,
            Longest::Without(forgotten_m) => return self.without(forgotten_m, spring_m),
            Longest::Overlap => input.overlap_m(),
            Longest::Bound(bound_m) => bound_m + input.way_m(),
            Longest::Growing(bound_m) if step > 0.0 => bound_m + input.way_m() + step * spring_m,
            Longest::Growing(_) => f64::INFINITY,
        };
        // One in flight bears nothing, until it comes to rest far away.
        let is_near = matches!(self.longest, Longest::Growing(_)) || self.lag_m <= bound_m + SLACK_M;
        if is_near && spring_m <= bound_m * (1.0 + ROUNDING) {
            self.longest = Longest::Any;
            return 1.0;
        }
        self.longest = match self.longest {
            Longest::Growing(_) => Longest::Growing(bound_m),
            _ => Longest::Bound(bound_m),
        };
        self.spring_m = spring_m.min(bound_m);
        (bound_m / spring_m).min(1.0)
    }

    /// The part of the force that is left without what is forgotten; that is never more than there is.
    fn without(&mut self, forgotten_m: f64, spring_m: f64) -> f64 {
        let forgotten_m = forgotten_m.min(spring_m);
        self.longest = if forgotten_m > 0.0 { Longest::Without(forgotten_m) } else { Longest::Any };
        self.spring_m = spring_m - forgotten_m;
        if forgotten_m > 0.0 { self.spring_m / spring_m } else { 1.0 }
    }
}

const ROUNDING: f64 = 1e-9;
/// Shorter than what walks over a surface of a metre resolve is longer than this; of a stiff wall it is 10 mN.
const SLACK_M: f64 = 1e-6;
