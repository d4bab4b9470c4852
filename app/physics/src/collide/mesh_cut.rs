//! Where an edge of one solid is cut off by the side of a mesh: the crossing of two edges.
//!
//! Problem: a cube that lies half over the end of a table has two corners on it, and two more points where its lower edges
//! cross that of the table; without these it would fall off while its middle is still over the table.
//! Model: the edge enters the mesh through its side; from there the way along the contact's normal leads out through the
//! face that is pressed. Its normal is the contact's, the length of the way the depth.
//! Cost: two queries for an edge that meets nothing, one to four more for each end where it does.

use haptics::mesh::{Face, Mesh};
use nalgebra::Vector3;

/// An edge in the mesh's frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct Edge {
    pub(super) ends: [Vector3<f64>; 2],
}

/// The way out of a mesh through the face that is pressed.
pub(super) struct WayOut<'w> {
    pub(super) along: Vector3<f64>,
    /// It is no longer \[m\].
    pub(super) most_m: f64,
    /// From a point to where nothing else is pressed \[m\].
    pub(super) lift: &'w dyn Fn(&Vector3<f64>) -> Vector3<f64>,
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
    /// Seen from either end.
    pub(super) fn cuts(&self, mesh: &Mesh, way: &WayOut<'_>) -> [Option<Cut>; 2] {
        let [a, b] = self.ends;
        [(a, b), (b, a)].map(|(from, to)| cut(mesh, &from, &to, way))
    }
}

fn cut(mesh: &Mesh, from: &Vector3<f64>, to: &Vector3<f64>, way: &WayOut<'_>) -> Option<Cut> {
    let hit = mesh.first_hit(from, to)?;
    // Through the pressed face itself it goes without depth, through its back not at all.
    if mesh.faces()[hit.face as usize].normal_B.dot(&way.along).abs() > ASIDE {
        return None;
    }
    let along_edge = (to - from).try_normalize(0.0)?;
    let on_edge = hit.point_B + along_edge * (INSIDE * mesh.extent_m());
    // The way out may lean over the side that was entered: then it is looked for from farther inside.
    let farther = hit.point_B + along_edge * (0.5 * way.most_m).min(0.25 * (to - hit.point_B).norm());
    let lift = (way.lift)(&on_edge);
    let from = [on_edge, farther, on_edge + lift, farther + lift];
    let tried = if lift == Vector3::zeros() { 2 } else { 4 };
    let face = from[..tried].iter().find_map(|point| pressed(mesh, point, way))?;
    let gap_m = face.normal_B.dot(&on_edge) - face.offset_m;
    let on_mesh = on_edge - face.normal_B * gap_m;
    (gap_m < 0.0).then_some(Cut { on_edge, on_mesh, out: face.normal_B, gap_m })
}

/// The face through which the way out leads.
fn pressed<'m>(mesh: &'m Mesh, point: &Vector3<f64>, way: &WayOut<'_>) -> Option<&'m Face> {
    let out = mesh.first_hit(&(point + way.along * way.most_m), point)?;
    let face = &mesh.faces()[out.face as usize];
    (face.normal_B.dot(&way.along) > AGREES).then_some(face)
}

/// Cosine between the pressed face and a side.
const ASIDE: f64 = 0.7;
const AGREES: f64 = 0.7;
/// So far inside a side, in extents, a point is surely inside.
const INSIDE: f64 = 1e-7;
