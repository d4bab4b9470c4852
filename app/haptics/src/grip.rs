//! What friction does in a contact whatever its surface is: holds, drags, remembers.
//!
//! Model: each tick the law is asked once whether the god-object holds. Held, the spring between god-object and surface
//! point acts, with the damper beside it, both together within the law's circle. Models with memory go on in it then.
//!
//! Frames and signs: object frame B; vectors lie in the god-object's tangent plane and are springs on the user (m).

use nalgebra::Vector3;

use crate::friction_cone::ConeInput;
use crate::friction_law::{FrictionLaw, FrictionMemory, FrictionQuery, FrictionState};
use crate::tangent_view::{TangentView, tangential};

/// Friction's part of a contact.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Grip {
    pub(crate) state: FrictionState,
    pub(crate) memory: FrictionMemory,
    last_hip_B: Option<Vector3<f64>>,
}

/// How the HIP has moved along the tangent plane since the last tick.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Pull {
    moved_B: Vector3<f64>,
    pub(crate) travel_m: f64,
}

impl Grip {
    #[inline]
    pub(crate) fn begin_tick(&mut self, view: &TangentView, input: &ConeInput) -> Pull {
        let last_hip_B = self.last_hip_B.replace(input.hip_B).unwrap_or(input.hip_B);
        let moved_B = tangential(&(input.hip_B - last_hip_B), &view.normal_B);
        Pull { moved_B, travel_m: moved_B.norm() }
    }

    /// The tangential spring, if friction holds the god-object; else the contact is in slip.
    ///
    /// Breakaway and first slide share the tick: the static coefficient is never slid with.
    #[inline]
    pub(crate) fn hold<L: FrictionLaw + ?Sized>(
        &mut self,
        friction: &L,
        view: &TangentView,
        pull: &Pull,
        input: &ConeInput,
    ) -> Option<Vector3<f64>> {
        // A slide ends within `rest_m` of the rim. Asked to the last bit, a resting finger would change between stick
        // and slip with the rounding, so the question forgives as much.
        let gap_m = (view.gap_m - view.rest_m).max(0.0);
        let query = query(self.state, gap_m, 0.0, view, pull, input);
        if !friction.holds(&query, &mut self.memory) {
            self.state = FrictionState::Slip;
            return None;
        }
        self.state = FrictionState::Stick;
        let held_B = stuck_tangential(view, friction.held_limit_m(&query), input);
        Some(held_B + self.drag(friction, view, pull, input))
    }

    /// What the law renders beside the spring.
    pub(crate) fn drag<L: FrictionLaw + ?Sized>(
        &self,
        friction: &L,
        view: &TangentView,
        pull: &Pull,
        input: &ConeInput,
    ) -> Vector3<f64> {
        if pull.travel_m <= 0.0 {
            return Vector3::zeros();
        }
        let drag_m = friction.drag_m(&query(self.state, view.gap_m, 0.0, view, pull, input), &self.memory);
        if drag_m == 0.0 { Vector3::zeros() } else { pull.moved_B * (-drag_m / pull.travel_m) }
    }
}

#[inline]
pub(crate) fn query(
    state: FrictionState,
    gap_m: f64,
    travel_m: f64,
    view: &TangentView,
    pull: &Pull,
    input: &ConeInput,
) -> FrictionQuery {
    FrictionQuery {
        state,
        gap_m,
        load_m: view.load_m,
        travel_m,
        dt_s: input.dt_s,
        hip_travel_m: pull.travel_m,
        stiffness_n_per_m: input.stiffness_n_per_m,
    }
}

/// Spring and damper of a held contact, cut to the cone.
#[inline]
fn stuck_tangential(view: &TangentView, limit_m: f64, input: &ConeInput) -> Vector3<f64> {
    if input.damping_n_s_per_m == 0.0 {
        return cut_to(view.lag_B, limit_m);
    }
    let velocity_B = tangential(&input.hip_velocity_B, &view.normal_B);
    cut_to(view.lag_B - velocity_B * input.damping_s(), limit_m)
}

/// `v`, shortened to `limit` if it is longer.
fn cut_to(v: Vector3<f64>, limit: f64) -> Vector3<f64> {
    let length = v.norm();
    if length > limit { v * (limit / length) } else { v }
}
