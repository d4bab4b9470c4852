//! One finger in contact with a tree of shapes, or near it.

use super::Csg;
use crate::algorithm::{Touch, TouchInput};
use crate::mesh::Beginning;

/// State of one finger towards one tree.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct CsgCone {}

impl CsgCone {
    /// One tick; `None` while the finger is free.
    pub(crate) fn update(&mut self, _csg: &Csg, _input: &TouchInput<'_>) -> Option<(Touch, Beginning)> {
        None
    }

    /// Ends the contact.
    pub(crate) fn let_go(&mut self) {
        *self = Self::default();
    }
}
