//! A cylinder with caps, its axis along y (Melder ch. 7.4.3).
//!
//! Frames, pieces and fixed directions: see `frustum.rs`, which does the work.

use nalgebra::Vector3;

use crate::error::{ParameterError, above_zero};
use crate::frustum::{Frustum, is_a_frustum};
use crate::surface::{Surface, SurfacePoint};

/// A cylinder around the y axis of its frame, centred, with caps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cylinder(Frustum);

is_a_frustum!(Cylinder);

impl Cylinder {
    /// Errors: a radius or length that is not finite or not positive.
    pub fn new(radius_m: f64, length_m: f64) -> Result<Self, ParameterError> {
        above_zero("radius_m", radius_m)?;
        Ok(Self(Frustum::new(radius_m, radius_m, length_m)?))
    }

    /// Radius \[m\].
    pub fn radius_m(&self) -> f64 {
        self.0.radius_top_m
    }

    /// Length along y \[m\].
    pub fn length_m(&self) -> f64 {
        2.0 * self.0.half_length_m
    }
}
