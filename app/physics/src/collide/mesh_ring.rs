//! A mesh and a ring.
//!
//! Model: as a mesh and any other solid ([`mesh_solid`]) while the ring is next to not in it at all; from there on all of it
//! presses that is in there ([`ring_deep`](super::ring_deep)). A sheet has no inside: it is seen from the side it was met on,
//! and only where that finds nothing, though the tube goes through, all of it presses away from whatever is nearest.
//! Frames: the mesh's frame M; normals from the mesh to the ring.
//! Cost: while it is not deep, a query for clearance for each piece more than any other solid.

use haptics::Torus;
use haptics::mesh::{Mesh, Sides};
use nalgebra::Vector3;

use super::mesh::{About, Contact, Told};
use super::mesh_other::Other;
use super::mesh_patch::Patches;
use super::ring_deep::{DeepRing, Nodes};
use super::{PairMemory, mesh_solid};

pub(super) fn contact_points(
    mesh: &Mesh,
    torus: &Torus,
    other: &Other<'_>,
    reach_m: f64,
    memory: &mut PairMemory,
    told: &mut Told<'_>,
) {
    let ring = DeepRing::new(&other.X_MO, torus, DEEP);
    let is_sheet = mesh.sides() == Sides::Sheet;
    let part = if is_sheet { 0.0 } else { ring.part(deepest_m(mesh, &ring)) };
    if part < 1.0 {
        let Told { X_WM, mesh_is_a, .. } = *told;
        let mut of_places = Told { X_WM, mesh_is_a, part: 1.0 - part, found: told.found };
        mesh_solid::contact_points(mesh, other, reach_m, memory, &mut of_places);
    } else if memory.patches.all[0].is_known {
        *memory.patches = Patches::default();
    }
    let is_lost = is_sheet && !told.found.as_slice().iter().any(|point| point.gap_m < 0.0);
    let part = if is_lost { ring.part(deepest_m(mesh, &ring)) } else { part };
    if part > 0.0 {
        tell(&ring.press(part, |at_M| outside_m(mesh, at_M)), told);
    }
}

/// Negative inside.
fn outside_m(mesh: &Mesh, at_M: &Vector3<f64>) -> f64 {
    let (nearest, is_inside) = mesh.nearest_and_side(at_M);
    if is_inside { -nearest.distance_m } else { nearest.distance_m }
}

fn deepest_m(mesh: &Mesh, ring: &DeepRing<'_>) -> f64 {
    // Next to what is clear of all faces nothing is on their other side.
    let mut is_clear = false;
    ring.deepest_m(|at_M, enough_m| {
        let clear_m = mesh.clearance(at_M, FAR * enough_m);
        let is_outside = is_clear && ring.step_m < enough_m;
        is_clear = clear_m >= enough_m && (is_outside || !mesh.is_inside(at_M));
        if is_clear { clear_m } else { outside_m(mesh, at_M) }
    })
}

fn tell(nodes: &Nodes, told: &mut Told<'_>) {
    for (node, part) in nodes.iter().flatten() {
        let on_mesh_M = node.on_a - node.normal * node.gap_m;
        let contact = Contact::new(About::Other(NODE_IDS + node.id), on_mesh_M, node.normal, node.gap_m);
        told.tell(&Contact { gap_m: node.gap_m * part, share: *part, ..contact });
    }
}

/// Clearances are asked for up to so many times what matters.
const FAR: f64 = 2.0;
/// Numbers of its points begin after those that any form has.
const NODE_IDS: u32 = 16;
/// From and to which shares of the tube's radius all of the ring takes over.
const DEEP: [f64; 2] = [0.02, 0.06];
