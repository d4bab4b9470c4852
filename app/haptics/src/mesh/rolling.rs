//! A ball in contact with a mesh, or near it (Melder ch. 6.3.1).

use super::{Beginning, Mesh};
use crate::algorithm::{Touch, TouchInput};

/// State of one spherical finger towards one mesh.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct RollingCone {}

impl RollingCone {
    /// One tick; `None` while the finger is free.
    pub(crate) fn update(&mut self, _mesh: &Mesh, _input: &TouchInput<'_>) -> Option<(Touch, Beginning)> {
        None
    }

    /// Ends the contact.
    pub(crate) fn let_go(&mut self) {
        *self = Self::default();
    }
}
