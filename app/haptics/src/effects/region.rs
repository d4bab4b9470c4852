//! Where a field acts: everywhere, or within a closed form, with a rim over which it fades.
//!
//! Model: the weight is 0 outside and at the surface and 1 from the rim's width on inwards, between by
//! `3 x^2 - 2 x^3` of the depth over the rim's width, so that neither the force nor its slope has a step. What is
//! thinner than two rims never has the whole force. Of `scaled` shapes and ellipsoids the depth is the form's own
//! measure, which is not quite the distance.

use nalgebra::{Isometry3, Vector3};

use super::smooth_step;
use crate::error::{ParameterError, above_zero};
use crate::frame::{point_into_body, vector_into_body, vector_into_world};
use crate::shape::Form;
use crate::surface::Surface;

/// A part of the world.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Region {
    form: Option<Form>,
    X_WB: Isometry3<f64>,
    rim_m: f64,
}

impl Region {
    /// Width of the rim if nothing is said \[m\].
    pub const DEFAULT_RIM_M: f64 = 0.005;

    /// All of the world, its axes those of W.
    pub fn everywhere() -> Self {
        Self::everywhere_turned(Isometry3::identity())
    }

    /// All of the world, its axes those of B: they matter for what differs by direction.
    pub fn everywhere_turned(X_WB: Isometry3<f64>) -> Self {
        Self { form: None, X_WB, rim_m: Self::DEFAULT_RIM_M }
    }

    /// What is inside a form at this pose; within `rim_m` of its surface it fades.
    ///
    /// Errors: a rim that is not finite or not positive.
    pub fn within(form: impl Into<Form>, X_WB: Isometry3<f64>, rim_m: f64) -> Result<Self, ParameterError> {
        Ok(Self { form: Some(form.into()), X_WB, rim_m: above_zero("rim_m", rim_m)? })
    }

    /// True if it has no end.
    pub fn is_everywhere(&self) -> bool {
        self.form.is_none()
    }

    /// How much of the field a point feels, 0 to 1.
    pub fn weight(&self, point_W: &Vector3<f64>) -> f64 {
        let Some(form) = &self.form else { return 1.0 };
        let depth_m = -form.signed_distance(&point_into_body(&self.X_WB, point_W));
        smooth_step(depth_m / self.rim_m)
    }

    /// Its form, that one's pose and the rim; `None`: it is everywhere.
    pub(super) fn parts(&self) -> Option<(&Form, &Isometry3<f64>, f64)> {
        Some((self.form.as_ref()?, &self.X_WB, self.rim_m))
    }

    /// By how much [`Self::weight`] can change over so long a way (m).
    pub(super) fn most_change(&self, way_m: f64) -> f64 {
        if self.form.is_none() { 0.0 } else { (STEEPEST * way_m / self.rim_m).min(1.0) }
    }

    /// `v_W` with each component along the region's axes multiplied.
    pub(super) fn multiplied(&self, v_W: &Vector3<f64>, factors: &Vector3<f64>) -> Vector3<f64> {
        let v_B = vector_into_body(&self.X_WB, v_W);
        vector_into_world(&self.X_WB, &v_B.component_mul(factors))
    }
}

/// Of the weight, over the rim's width: 3/2 by the distance, and twice that where the form's own measure is none.
const STEEPEST: f64 = 3.0;
