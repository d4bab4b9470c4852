//! Force shading: a faceted surface that feels smooth (Melder ch. 4.2.6).

use crate::algorithm::Touch;
use crate::shape::Shape;

/// How the force of a contact is turned to make facets feel like a smooth surface.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum Shading {
    /// As the facets are.
    #[default]
    None,
}

impl Shading {
    /// Turns the force of a contact, keeping its size.
    #[inline]
    pub(crate) fn turn(&self, _shape: &Shape, _touch: &mut Touch) {
        match self {
            Self::None => {}
        }
    }
}
