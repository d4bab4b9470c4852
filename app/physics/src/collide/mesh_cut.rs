//! Where an edge of one solid is cut off by the side of a mesh: the crossing of two edges.
//!
//! Problem: a cube that lies half over the end of a table has two corners on it, and two more points where its lower edges
//! cross that of the table; without these it would fall off while its middle is still over the table.
//! Model: the edge enters the mesh through its side; from there the way along the contact's normal leads out through the
//! face that is pressed. Its normal is the contact's, the length of the way the depth.
//! Cost: two queries for an edge that meets nothing, two more where it does.

use haptics::mesh::Mesh;
use nalgebra::Vector3;

/// An edge in the mesh's frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct Edge {
    pub(super) ends: [Vector3<f64>; 2],
}

/// A place where it is cut off.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cut {
    /// On the edge \[m\].
    pub(super) on_edge: Vector3<f64>,
    /// On the mesh \[m\].
    pub(super) on_mesh: Vector3<f64>,
    /// Out of the mesh.
    pub(super) out: Vector3<f64>,
    /// Negative \[m\].
    pub(super) gap_m: f64,
}

impl Edge {
    /// Seen from either end; `along` leads out of the mesh, at most this far (m).
    pub(super) fn cuts(&self, mesh: &Mesh, along: &Vector3<f64>, most_m: f64) -> [Option<Cut>; 2] {
        let [a, b] = self.ends;
        [(a, b), (b, a)].map(|(from, to)| cut(mesh, &from, &to, along, most_m))
    }
}

fn cut(
    mesh: &Mesh,
    from: &Vector3<f64>,
    to: &Vector3<f64>,
    along: &Vector3<f64>,
    most_m: f64,
) -> Option<Cut> {
    let hit = mesh.first_hit(from, to)?;
    // Through the pressed face itself it goes without depth, through its back not at all.
    if mesh.faces()[hit.face as usize].normal_B.dot(along).abs() > ASIDE {
        return None;
    }
    let inward = (to - from).try_normalize(0.0)? * (INSIDE * mesh.extent_m());
    let on_edge = hit.point_B + inward;
    let out = mesh.first_hit(&(on_edge + along * most_m), &on_edge)?;
    let face = &mesh.faces()[out.face as usize];
    let gap_m = face.normal_B.dot(&on_edge) - face.offset_m;
    (face.normal_B.dot(along) > AGREES && gap_m < 0.0).then_some(Cut {
        on_edge,
        on_mesh: out.point_B,
        out: face.normal_B,
        gap_m,
    })
}

/// Cosine between the pressed face and a side.
const ASIDE: f64 = 0.7;
const AGREES: f64 = 0.7;
/// So far inside a side, in extents, a point is surely inside.
const INSIDE: f64 = 1e-7;
