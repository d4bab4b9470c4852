//! Where a god-object is drawn to from where it stands: to the surface point, or only to the rim of the friction circle.

use nalgebra::Vector3;
use std::cell::Cell;

use crate::friction_cone::ConeInput;
use crate::friction_law::{FrictionLaw, FrictionMemory, FrictionQuery, FrictionState};
use crate::grip::{Pull, cut_to, query};
use crate::tangent_view::TangentView;

/// What draws a god-object.
pub(crate) trait Draw {
    /// From a god-object that sees this, and that has left where the tick began by `-back_B`.
    fn drawn(&self, view: &TangentView, back_B: &Vector3<f64>) -> Drawn;
}

/// Where it is drawn to.
pub(crate) struct Drawn {
    pub(crate) target_B: Vector3<f64>,
    /// As near to the target as positions can tell, or inside the friction circle.
    pub(crate) is_at_rest: bool,
    /// Tangential force over stiffness, on the user \[m\]: where it stands at rest, else at the target. A bound that
    /// ends a walk early must not leave the friction cone.
    pub(crate) tangential_B: Vector3<f64>,
}

/// The spring alone.
pub(crate) struct Frictionless;

impl Draw for Frictionless {
    #[inline(always)]
    fn drawn(&self, view: &TangentView, _back_B: &Vector3<f64>) -> Drawn {
        Drawn {
            target_B: view.surface_point_B,
            is_at_rest: view.lag_B.norm_squared() <= view.rest_m * view.rest_m,
            tangential_B: Vector3::zeros(),
        }
    }
}

/// The spring, as far as a friction law lets it.
pub(crate) struct Against<'l, L: ?Sized> {
    pub(crate) friction: &'l L,
    pub(crate) memory: &'l FrictionMemory,
    pub(crate) pull: &'l Pull,
    pub(crate) input: &'l ConeInput,
    /// Force ratio with which it already slides in this tick. A curve that falls with speed may hold what rests, but
    /// not what slides: a god-object that comes to an edge halfway must not be caught there.
    pub(crate) slides_with: Cell<Option<f64>>,
}

impl<L: FrictionLaw + ?Sized> Draw for Against<'_, L> {
    #[inline(always)]
    fn drawn(&self, view: &TangentView, back_B: &Vector3<f64>) -> Drawn {
        let (direction_B, gap_m) = view.signed_gap(&Vector3::zeros());
        // The chord, since that is what two recorded positions over dt show as speed.
        let travel_m = back_B.norm().copysign(back_B.dot(&direction_B));
        let query = self.query(view, gap_m, travel_m);
        let asked_m = match (self.friction.slide(&query, self.memory), self.slides_with.get()) {
            (asked_m, Some(ratio)) if asked_m <= 0.0 => gap_m - ratio * view.load_m,
            (asked_m, _) => asked_m,
        };
        // To the rim, and not beyond the surface point.
        let radius_m = gap_m - asked_m.min(gap_m);
        let is_inside = asked_m.is_nan() || asked_m <= 0.0;
        if !is_inside && view.load_m > 0.0 {
            self.slides_with.set(Some(radius_m / view.load_m));
        }
        Drawn {
            target_B: view.surface_point_B + direction_B * radius_m,
            is_at_rest: is_inside || asked_m <= view.rest_m,
            tangential_B: if is_inside {
                // What slides may bear more than what is held: friction that grows with speed.
                let slides_m = self.slides_with.get().map_or(0.0, |ratio| ratio * view.load_m);
                cut_to(view.lag_B, self.friction.held_limit_m(&query, self.memory).max(slides_m))
            } else {
                direction_B * radius_m
            },
        }
    }
}

impl<L: ?Sized> Against<'_, L> {
    #[inline(always)]
    fn query(&self, view: &TangentView, gap_m: f64, travel_m: f64) -> FrictionQuery {
        query(FrictionState::Slip, gap_m, travel_m, view, self.pull, self.input)
    }
}
