//! A mesh over a plane: the vertices that it stands on.
//!
//! Cost: that of [`mesh_span`](super::mesh_span).

use haptics::mesh::{Linear, Mesh};
use nalgebra::Vector3;

use super::PairMemory;
use super::mesh::{About, Contact, Told};
use super::mesh_span::Standing;

/// The plane is `normal . x = offset` in the mesh's frame, and what is above it is free.
pub(super) fn contact_points(
    mesh: &Mesh,
    normal_M: &Vector3<f64>,
    offset_m: f64,
    reach_m: f64,
    memory: &mut PairMemory,
    told: &mut Told<'_>,
) {
    let standing = Standing {
        mesh,
        height: Linear::new(*normal_M, -offset_m),
        limits: &[],
        reach_m,
        travel_m: (reach_m - crate::pair::REACH_M).max(0.0),
    };
    for corner in standing.choose(&mut memory.patches.all[0].stands[0]).into_iter().flatten() {
        let gap_m = standing.height_m(corner);
        if gap_m <= reach_m {
            let about = About::Vertex(corner.vertex(mesh));
            told.tell(&Contact::new(about, *corner.point_M(mesh), -normal_M, gap_m));
        }
    }
}
