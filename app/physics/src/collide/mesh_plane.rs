//! A mesh over a plane: the vertices that it stands on.
//!
//! Cost: about eight queries of the mesh's hierarchy, each begun with the vertex of the last tick; see
//! [`mesh_span`](super::mesh_span).

use haptics::mesh::{Linear, Mesh};
use nalgebra::Vector3;

use super::PairMemory;
use super::mesh::{About, Contact, Told};
use super::mesh_span::{Chosen, Standing};

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
        height: Linear { along_B: *normal_M, base: -offset_m },
        limits: &[],
        reach_m,
        travel_m: (reach_m - crate::pair::REACH_M).max(0.0),
    };
    let mut chosen = remembered(memory, mesh.vertices().len());
    standing.choose(&mut chosen);
    remember(&chosen, memory);
    for vertex in chosen.into_iter().flatten() {
        let gap_m = standing.height_m(vertex);
        if gap_m <= reach_m {
            let on_mesh_M = mesh.vertices()[vertex as usize];
            told.tell(&Contact { id: About::Vertex(vertex).id(), on_mesh_M, normal_M: -normal_M, gap_m });
        }
    }
}

/// The vertices of the last tick.
pub(super) fn remembered(memory: &PairMemory, vertices: usize) -> Chosen {
    // 0 is none; whatever else may stand there is no vertex.
    memory.words.map(|word| (word >= 1.0 && word <= vertices as f64).then(|| word as u32 - 1))
}

pub(super) fn remember(chosen: &Chosen, memory: &mut PairMemory) {
    memory.words = chosen.map(|vertex| vertex.map_or(0.0, |vertex| f64::from(vertex) + 1.0));
}
