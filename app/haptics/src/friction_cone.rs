//! The Friction Cone Algorithm: one god-object on one surface.
//!
//! Problem: render friction without drift, chatter or a velocity estimate. The god-object stays
//! where it is while the HIP's friction cone, of half-angle atan(mu), contains it; otherwise it is
//! drawn to the cone's rim (Melder ch. 4.1).
//!
//! Model: the law is asked first whether the god-object holds; if not, it slides in the same tick
//! with the sliding coefficient (ch. 4.1.1). The force is `k (load n + (G - S))`, which is the
//! corrected eq. 4.7 written so that its normal part is exactly `k d`: `k (G - H)` would carry the
//! rounding of G and, on a curved surface, whatever the last projection left.
//!
//! Frames and signs: object frame B. `force_on_user` is what the device renders and points out of
//! the material; `force_on_object` is its negative, the one printed as eq. 4.7.
//!
//! Damping: `N = max(0, k d + b v)` with v the speed of approach along the normal; the friction
//! circle has the radius `mu N / k`. While the contact sticks, `-b` times the tangential velocity
//! is added, and the sum cut to the cone; in slip it is left out, so that sliding ratios are exact.
//!
//! Invariants: contacts never pull; the tangential force stays within the cone of the law.
//! Cost: one look while it sticks, see [`crate::MAX_SLIDE_ROUNDS`] while it slides.

use nalgebra::Vector3;

use crate::friction::Friction;
use crate::friction_law::{FrictionLaw, FrictionMemory, FrictionState};
use crate::grip::{Grip, Pull};
use crate::slide::slide;
use crate::surface::{Surface, SurfacePoint};
use crate::tangent_view::TangentView;

/// State of one contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrictionCone {
    god_object: SurfacePoint,
    grip: Grip,
}

/// What a contact is told in one tick, in the object's frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ConeInput {
    /// HIP \[m\], inside the surface or pressed right through it.
    pub hip_B: Vector3<f64>,
    /// Velocity of the HIP relative to the object \[m/s\]; used by damping only.
    pub hip_velocity_B: Vector3<f64>,
    /// k \[N/m\], > 0.
    pub stiffness_n_per_m: f64,
    /// b \[N s/m\], >= 0.
    pub damping_n_s_per_m: f64,
    /// Length of the tick \[s\]; used by speed-dependent friction only.
    pub dt_s: f64,
}

impl ConeInput {
    /// Damping over stiffness \[s\].
    pub(crate) fn damping_s(&self) -> f64 {
        self.damping_n_s_per_m / self.stiffness_n_per_m
    }
}

/// What a contact answers, in the object's frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ConeForce {
    /// Force the device renders \[N\]; points out of the material.
    pub force_on_user_B: Vector3<f64>,
    /// Its normal part N \[N\], >= 0.
    pub normal_force_n: f64,
    /// Depth of the HIP below the god-object's tangent plane \[m\].
    pub depth_m: f64,
    /// Moves of the god-object in this tick: 0 at rest, at most [`crate::MAX_SLIDE_ROUNDS`].
    pub rounds: u32,
}

impl ConeForce {
    /// Force of the user on the object \[N\] (Melder eq. 4.7).
    pub fn force_on_object_B(&self) -> Vector3<f64> {
        -self.force_on_user_B
    }
}

impl FrictionCone {
    /// A contact that begins at a surface point, and holds there if its law lets it.
    pub fn new(entry: SurfacePoint) -> Self {
        Self { god_object: entry, grip: Grip::default() }
    }

    /// Where the god-object is, with the outward normal there.
    pub fn god_object(&self) -> &SurfacePoint {
        &self.god_object
    }

    /// Turns a god-object that rests where the surface has no normal of its own: it presses against where the HIP is now.
    pub(crate) fn stand_at(&mut self, at: SurfacePoint) {
        self.god_object = at;
    }

    /// Whether it holds or slides.
    pub fn state(&self) -> FrictionState {
        self.grip.state
    }

    /// One tick with the HIP held back by the surface; the caller ends the contact when it is free.
    pub fn update<S: Surface + ?Sized, L: FrictionLaw + ?Sized>(
        &mut self,
        surface: &S,
        friction: &L,
        input: &ConeInput,
    ) -> ConeForce {
        let view = TangentView::of(surface, &self.god_object, input);
        let pull = self.grip.begin_tick(&view, input);
        if let Some(tangential_B) = self.grip.hold(friction, &view, &pull, input) {
            return answer(&view, &tangential_B, 0, input);
        }
        let slid = slide(surface, friction, &mut self.god_object, view, &self.grip.memory, &pull, input);
        let drag_B = self.grip.drag(friction, &slid.tangential_B, &slid.view, &pull, input);
        answer(&slid.view, &(slid.tangential_B + drag_B), slid.rounds, input)
    }

    /// Whether a HIP outside the material is still held back, because it was pressed right through.
    ///
    /// The frictionless god-object decides, since it is the nearest that a finger could come to the
    /// HIP: friction must not hold a finger that is round the corner.
    pub fn is_held_back<S: Surface + ?Sized>(&self, surface: &S, input: &ConeInput) -> bool {
        let (at, depth_m) = slide_without_friction(surface, self.god_object, input);
        depth_m > 0.0 && surface.holds_outside(&at, depth_m)
    }
}

/// Where a frictionless god-object that begins at `at` comes to rest, and how deep the HIP lies below it.
pub(crate) fn slide_without_friction<S: Surface + ?Sized>(
    surface: &S,
    mut at: SurfacePoint,
    input: &ConeInput,
) -> (SurfacePoint, f64) {
    let view = TangentView::of(surface, &at, input);
    let (memory, pull) = (FrictionMemory::default(), Pull::default());
    let slid = slide(surface, &Friction::None, &mut at, view, &memory, &pull, input);
    (at, slid.view.depth_m)
}

#[inline]
pub(crate) fn answer(
    view: &TangentView,
    tangential_B: &Vector3<f64>,
    rounds: u32,
    input: &ConeInput,
) -> ConeForce {
    let k = input.stiffness_n_per_m;
    if view.load_m <= 0.0 {
        // Touching without pressing is without force, whatever a law makes of it.
        let force_on_user_B = Vector3::zeros();
        return ConeForce { force_on_user_B, normal_force_n: 0.0, depth_m: view.depth_m, rounds };
    }
    // Corrected: of the user on the object the printed sign is right, the device renders this.
    //= melder#4.7
    let force_on_user_B = (view.normal_B * view.load_m + tangential_B) * k;
    ConeForce { force_on_user_B, normal_force_n: k * view.load_m, depth_m: view.depth_m, rounds }
}
