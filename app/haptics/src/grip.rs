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
    /// Where the HIP and the god-object were when the last tick began.
    last: Option<(Vector3<f64>, Vector3<f64>)>,
}

/// How the HIP has moved along the tangent plane since the last tick, and the god-object in it.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Pull {
    moved_B: Vector3<f64>,
    pub(crate) travel_m: f64,
    god_travel_m: f64,
}

impl Grip {
    #[inline]
    pub(crate) fn begin_tick(&mut self, view: &TangentView, input: &ConeInput) -> Pull {
        let now = (input.hip_B, view.surface_point_B + view.lag_B);
        let last = self.last.replace(now).unwrap_or(now);
        let moved_B = tangential(&(now.0 - last.0), &view.normal_B);
        let god_travel_m = (now.1 - last.1).norm();
        // Taken back from the lag, a god-object at rest moves by rounding.
        let god_travel_m = if god_travel_m > view.rest_m { god_travel_m } else { 0.0 };
        Pull { moved_B, travel_m: moved_B.norm(), god_travel_m }
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
        let beside_B = self.drag(friction, &view.lag_B, view, pull, input) - damper(view, input);
        Some(cut_to(view.lag_B + beside_B, friction.held_limit_m(&query, &self.memory)))
    }

    /// What the law renders beside the spring along the tangent.
    pub(crate) fn drag<L: FrictionLaw + ?Sized>(
        &self,
        friction: &L,
        spring_B: &Vector3<f64>,
        view: &TangentView,
        pull: &Pull,
        input: &ConeInput,
    ) -> Vector3<f64> {
        if !friction.drags() || pull.travel_m <= 0.0 {
            return Vector3::zeros();
        }
        let query = FrictionQuery {
            // Of the spring that is rendered, which after a slide that met its bound is not the lag.
            gap_along_hip_m: -spring_B.dot(&pull.moved_B) / pull.travel_m,
            ..query(self.state, spring_B.norm(), 0.0, view, pull, input)
        };
        let drag_m = friction.drag_m(&query, &self.memory);
        if drag_m == 0.0 {
            return Vector3::zeros();
        }
        // Along the plane that the god-object has reached: it must not press or pull.
        tangential(&(pull.moved_B * (-drag_m / pull.travel_m)), &view.normal_B)
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
    let along_m = -view.lag_B.dot(&pull.moved_B) / pull.travel_m;
    FrictionQuery {
        state,
        gap_m,
        load_m: view.load_m,
        travel_m,
        dt_s: input.dt_s,
        hip_travel_m: pull.travel_m,
        gap_along_hip_m: if pull.travel_m > 0.0 { along_m } else { 0.0 },
        last_travel_m: pull.god_travel_m,
        stiffness_n_per_m: input.stiffness_n_per_m,
    }
}

/// What the damper of the contact takes from a held spring (m).
#[inline]
fn damper(view: &TangentView, input: &ConeInput) -> Vector3<f64> {
    if input.damping_n_s_per_m == 0.0 {
        return Vector3::zeros();
    }
    tangential(&input.hip_velocity_B, &view.normal_B) * input.damping_s()
}

/// `v`, shortened to `limit` if it is longer.
pub(crate) fn cut_to(v: Vector3<f64>, limit: f64) -> Vector3<f64> {
    let length = v.norm();
    if length > limit { v * (limit / length) } else { v }
}
