//! Contact points where a mesh is on either side.

use haptics::Shape;
use haptics::mesh::Mesh;
use nalgebra::Vector3;

use super::{ContactPoints, PairMemory, Solid};

/// Whether contact points of such a mesh as A can be found.
pub(super) fn can_move(_mesh: &Mesh) -> bool {
    false
}

/// Whether those of these two can, of which one is a mesh.
pub(super) fn is_collidable(_a: &Shape, _b: &Shape) -> bool {
    false
}

pub(super) fn bounding_ball(_mesh: &Mesh) -> Option<(Vector3<f64>, f64)> {
    None
}

/// Where A and B touch, of which one is a mesh.
pub(super) fn contact_points(
    _a: Solid<'_>,
    _b: Solid<'_>,
    _reach_m: f64,
    _memory: &mut PairMemory,
    _found: &mut ContactPoints,
) {
}
