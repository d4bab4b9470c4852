//! Constructive solid geometry: trees of shapes (Melder ch. 9.3).

mod csg_cone;

pub(crate) use csg_cone::CsgCone;

/// A solid made of others.
#[derive(Debug, Clone, PartialEq)]
pub struct Csg {}
