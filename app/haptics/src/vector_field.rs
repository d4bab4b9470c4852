//! A baseline without memory: the finger is pushed out of the material by the shortest way (Melder ch. 3.1.2.1).
//!
//! Model: while the HIP is inside, `force = k depth n` with n the normal of the nearest surface point. Nothing is known
//! of where the finger came in. What the thesis says of such methods therefore holds: the force jumps where another
//! piece of the surface becomes the nearest (its figure 3.2), and whoever presses through the middle of a thin part is
//! pushed out at the far side ("push through").
//!
//! It is here to be compared with, not to be felt. Open meshes, which have no inside, cannot be rendered so at all.
//!
//! Cost: one question for inside, one for the nearest point.

use crate::algorithm::{ContactAlgorithm, ContactMemory, Touch, TouchInput};

/// The vector field method.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct VectorField;

impl ContactAlgorithm for VectorField {
    fn touch(&self, input: &TouchInput<'_>, _memory: &mut ContactMemory) -> Option<Touch> {
        if !input.is_inside() {
            return None;
        }
        let at = input.nearest()?;
        let depth_m = at.normal_B.dot(&(at.point_B - input.cone.hip_B));
        Some(Touch::frictionless(at, depth_m, &input.cone))
    }
}
