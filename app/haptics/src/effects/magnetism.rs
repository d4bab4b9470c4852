//! A surface that attracts.
//!
//! Model: a potential of the distance d to the nearest point of the surface, within the reach D:
//! `F = 27/4 F0 x (1 - x)^2` towards the surface, `x = d / D`. It is 0 at the surface, where the contact's spring is 0
//! as well; largest, F0, at a third of the reach; and 0 with slope 0 at its end. So it has no step anywhere, a finger
//! comes to rest at the surface neither sunk in nor off it, and it takes `27/48 F0 D` to pull it free: exactly what the
//! surface gave when it came. Where two points of the surface are equally near the force changes sides, but the
//! potential has no step there either. Inside there is none: contact is on its own. A surface that a height map raises
//! attracts from where it is highest, since there a finger may be in contact: below, it hovers without a pull.
//!
//! Signs: forces on the user. Cost: one nearest point of the shape while no contact; a mesh is first asked whether
//! it is near at all.

use nalgebra::Vector3;

use super::limits::not_above;
use super::{Limits, Pull, Reaction};
use crate::entity::Entity;
use crate::error::{ParameterError, above_zero, at_least_zero};
use crate::frame::{is_finite, point_into_body, point_into_world, vector_into_world};
use crate::shape::Shape;
use crate::surface::Surface;

/// How strongly and how far a surface attracts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Magnetism {
    force_n: f64,
    distance_m: f64,
}

impl Magnetism {
    /// Up to `force_n` (F0), within `distance_m` (D).
    ///
    /// Errors: a value out of range, or a force that rises from the surface more steeply, `27/4 F0 / D`, than the
    /// stiffness that is stable.
    pub fn new(force_n: f64, distance_m: f64, limits: &Limits) -> Result<Self, ParameterError> {
        let force_n = at_least_zero("force_n", force_n)?;
        let distance_m = above_zero("distance_m", distance_m)?;
        let most_n = limits.stiffness_n_per_m() * distance_m / STEEPEST;
        not_above("force_n", force_n, most_n, OF_FORCE)?;
        Ok(Self { force_n, distance_m })
    }

    /// F0 \[N\].
    pub fn force_n(&self) -> f64 {
        self.force_n
    }

    /// D \[m\].
    pub fn distance_m(&self) -> f64 {
        self.distance_m
    }

    /// Pull towards the surface from this distance \[N\].
    pub fn pull_n(&self, distance_m: f64) -> f64 {
        let x = distance_m / self.distance_m;
        if x > 0.0 && x < 1.0 { STEEPEST * self.force_n * x * (1.0 - x) * (1.0 - x) } else { 0.0 }
    }

    /// By how much the pull falls on the way to the surface, per way \[N/m\]; 0 where it grows or there is none.
    pub fn stiffness_n_per_m(&self, distance_m: f64) -> f64 {
        let x = distance_m / self.distance_m;
        let slope = STEEPEST * self.force_n / self.distance_m * (1.0 - x) * (1.0 - 3.0 * x);
        if x > 0.0 && x < 1.0 { slope.max(0.0) } else { 0.0 }
    }

    /// Energy of a finger at this distance \[J\]: 0 out of reach, least at the surface.
    pub fn potential_j(&self, distance_m: f64) -> f64 {
        let rest = 1.0 - (distance_m / self.distance_m).clamp(0.0, 1.0);
        -STEEPEST * self.force_n * self.distance_m * rest * rest * rest * (1.0 / 3.0 - 0.25 * rest)
    }

    /// Whether distances to this shape are known from outside.
    pub fn suits(shape: &Shape) -> bool {
        matches!(shape, Shape::Form(_) | Shape::Mesh(_) | Shape::Own(_))
    }

    /// On a finger of this radius that does not touch the entity, which has this index; `None`: it is out of reach.
    pub(super) fn pull(
        &self,
        (index, entity): (usize, &Entity),
        hip_W: &Vector3<f64>,
        last_hip_W: &Vector3<f64>,
        finger_radius_m: f64,
    ) -> Option<(Pull, Reaction)> {
        let hip_B = point_into_body(&entity.X_WB, hip_W);
        let lift_m = entity.height_map.as_ref().map_or(0.0, |map| map.lift_m(&entity.shape, finger_radius_m));
        let touched_m = finger_radius_m + lift_m;
        let reach_m = self.distance_m + touched_m;
        let nearest_B = nearest(&entity.shape, &hip_B, reach_m)?;
        let way_B = nearest_B - hip_B;
        let distance_m = way_B.norm();
        let pull_n = self.pull_n(distance_m - touched_m);
        let force_B = way_B * (pull_n / distance_m);
        if pull_n <= 0.0 || !is_finite(&force_B) {
            return None;
        }
        let force_on_user_W = vector_into_world(&entity.X_WB, &force_B);
        let stored_j = self.potential_j(distance_m - touched_m) - self.potential_j(0.0);
        let reaction = Reaction {
            entity: index,
            point_W: point_into_world(&entity.X_WB, &nearest_B),
            force_on_user_W,
            stiffness_n_per_m: self.stiffness_n_per_m(distance_m - touched_m),
        };
        // Seen from the entity, which may move.
        let way_m = (hip_B - point_into_body(&entity.previous_X_WB, last_hip_W)).norm();
        // Along the way, and across it, where the pull turns.
        let explained_n = 2.0 * STEEPEST * self.force_n / self.distance_m * way_m;
        Some((Pull { force_on_user_W, stored_j, explained_n }, reaction))
    }
}

/// The surface's point nearest to one outside, unless it is surely further than `within_m`.
fn nearest(shape: &Shape, point_B: &Vector3<f64>, within_m: f64) -> Option<Vector3<f64>> {
    if !is_finite(point_B) {
        return None;
    }
    match shape {
        // Of both measures of distance only this sign is exact.
        Shape::Form(form) => (form.signed_distance(point_B) > 0.0).then(|| form.nearest(point_B).point_B),
        Shape::Mesh(mesh) => {
            (mesh.clearance(point_B, within_m) < within_m).then(|| mesh.nearest(point_B).point_B)
        }
        Shape::Own(surface) => {
            (surface.signed_distance(point_B) > 0.0).then(|| surface.nearest(point_B).point_B)
        }
        _ => None,
    }
}

/// Slope of the pull at the surface, in F0 / D; makes 1 of the largest value of x (1 - x)^2.
const STEEPEST: f64 = 27.0 / 4.0;

const OF_FORCE: &str = "4/27 of distance_m times the stability limit of a stiffness, 3 N s/m / (3 ticks)";
