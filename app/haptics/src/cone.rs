//! A cone, whole or cut off, with caps, its axis along y: the conic cylinder of Melder ch. 7.4.3.
//!
//! The printed radius (eq. 7.9-7.11) starts from half the *difference* of the radii and slopes the wrong way; here it
//! is the mean radius, y points up and the base is at -length/2. The printed point of intersection (7.15) is level with
//! the finger; depth and force need the slanted normal.
//! Frames, pieces and fixed directions: see `frustum.rs`, which does the work. A radius of zero makes an apex, which
//! acts as a cap without area.

use nalgebra::Vector3;

use crate::error::ParameterError;
use crate::frustum::{Frustum, is_a_frustum};
use crate::surface::{Surface, SurfacePoint};

/// A cone around the y axis of its frame, centred, with caps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cone(Frustum);

is_a_frustum!(Cone);

impl Cone {
    /// A cone whose radius goes from `radius_bottom_m` at the lower end to `radius_top_m` at the upper one.
    ///
    /// Errors: a radius not finite or negative, both zero, a length not finite or not positive.
    pub fn new(radius_bottom_m: f64, radius_top_m: f64, length_m: f64) -> Result<Self, ParameterError> {
        Ok(Self(Frustum::new(radius_bottom_m, radius_top_m, length_m)?))
    }

    /// Radius at the lower end \[m\].
    pub fn radius_bottom_m(&self) -> f64 {
        self.0.radius_bottom_m
    }

    /// Radius at the upper end \[m\].
    pub fn radius_top_m(&self) -> f64 {
        self.0.radius_top_m
    }

    /// Length along y \[m\].
    pub fn length_m(&self) -> f64 {
        2.0 * self.0.half_length_m
    }
}
