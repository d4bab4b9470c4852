//! Height maps: small features over a surface from a picture (Melder ch. 4.2.7).

use crate::algorithm::Touch;
use crate::shape::Shape;

/// Heights over a surface.
#[derive(Debug, Clone, PartialEq)]
pub struct HeightMap {}

impl HeightMap {
    /// Adds what the heights make of a contact's force.
    pub(crate) fn raise(&self, _shape: &Shape, _stiffness_n_per_m: f64, _touch: &mut Touch) {}
}
