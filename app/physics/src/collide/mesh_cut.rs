//! Crossings of two edges: an edge of one solid is cut off by a mesh.
//!
//! Problem: a cube that lies half over the end of a table has two corners on it, and two more points where its lower edges
//! cross that of the table; without these it would fall off while its middle is still over the table.
//! Model: the edge enters the mesh through its side; from there the way along the contact's normal leads out through the
//! face that is pressed. Its normal is the contact's, the length of the way the depth. Or it dips through a ridge, in by one
//! pressed face and out by another, as through the back of a round bar: then the way out is across both edges, from where
//! it is as far behind the one face as behind the other.
//! Cost: four queries for an edge that meets nothing, one to four more for each end where it does.

use haptics::mesh::{Face, Hit, Mesh};
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
    /// So much nearer the two may be that do not touch yet \[m\].
    pub(super) ahead_m: f64,
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
    /// Negative where it is cut off already \[m\].
    pub(super) gap_m: f64,
}

impl Edge {
    /// Seen from either end. Where it is not cut off yet, but will dip through a ridge when it has come nearer: there.
    pub(super) fn cuts(&self, mesh: &Mesh, way: &WayOut<'_>) -> [Option<Cut>; 2] {
        let [a, b] = self.ends;
        let ways = [(&a, &b), (&b, &a)];
        let hits = ways.map(|(from, to)| mesh.first_hit(from, to));
        if let [None, None] = hits {
            let will_dip = if way.ahead_m > 0.0 { self.will_dip(mesh, way) } else { None };
            return [will_dip, None];
        }
        if let Some(hits) = pressed_twice(mesh, &hits, way) {
            return [self.dips(mesh, hits, way), None];
        }
        [0, 1].map(|at| cut(mesh, hits[at].as_ref()?, ways[at].1, way))
    }

    /// As if it were so much nearer.
    fn will_dip(&self, mesh: &Mesh, way: &WayOut<'_>) -> Option<Cut> {
        let nearer_M = way.along * -way.ahead_m;
        let [a, b] = self.ends.map(|end| end + nearer_M);
        let hits = [mesh.first_hit(&a, &b)?, mesh.first_hit(&b, &a)?].map(Some);
        let way = WayOut { most_m: way.most_m.max(2.0 * way.ahead_m), ..*way };
        let cut = Self { ends: [a, b] }.dips(mesh, pressed_twice(mesh, &hits, &way)?, &way)?;
        let (on_edge, gap_m) = (cut.on_edge - nearer_M, cut.gap_m - cut.out.dot(&nearer_M));
        (gap_m > 0.0).then_some(Cut { on_edge, on_mesh: on_edge - cut.out * gap_m, gap_m, ..cut })
    }

    /// The place at which it dips deepest through a ridge.
    fn dips(&self, mesh: &Mesh, hits: [&Hit; 2], way: &WayOut<'_>) -> Option<Cut> {
        let faces = hits.map(|hit| &mesh.faces()[hit.face as usize]);
        let [from, to] = hits.map(|hit| hit.point_B);
        let along_edge = (to - from).try_normalize(0.0)?;
        let ridge = faces[0].normal_B.cross(&faces[1].normal_B);
        let out = along_edge.cross(&ridge).try_normalize(FLAT)?;
        let out = if out.dot(&way.along) < 0.0 { -out } else { out };
        if out.dot(&way.along) < AGREES {
            return None;
        }
        // As deep behind the one as behind the other: both grow from their ends.
        let falls = faces.map(|face| face.normal_B.dot(&along_edge).abs());
        let on_edge = from + (to - from) * (falls[1] / (falls[0] + falls[1]));
        let left = mesh.first_hit(&(on_edge + out * way.most_m), &on_edge)?;
        let gap_m = -(left.point_B - on_edge).norm();
        Some(Cut { on_edge, on_mesh: left.point_B, out, gap_m })
    }
}

/// Both hits, if the edge goes in through pressed faces from either end.
fn pressed_twice<'h>(mesh: &Mesh, hits: &'h [Option<Hit>; 2], way: &WayOut<'_>) -> Option<[&'h Hit; 2]> {
    let [Some(first), Some(last)] = hits else { return None };
    let is_pressed = |hit: &Hit| mesh.faces()[hit.face as usize].normal_B.dot(&way.along) > ASIDE;
    (is_pressed(first) && is_pressed(last)).then_some([first, last])
}

fn cut(mesh: &Mesh, hit: &Hit, to: &Vector3<f64>, way: &WayOut<'_>) -> Option<Cut> {
    // Through the pressed face itself it goes without depth, through its back not at all.
    if mesh.faces()[hit.face as usize].normal_B.dot(&way.along).abs() > ASIDE {
        return None;
    }
    let along_edge = (to - hit.point_B).try_normalize(0.0)?;
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

/// Sine between two directions that are one.
const FLAT: f64 = 1e-6;
/// Cosine between the pressed face and a side.
const ASIDE: f64 = 0.7;
const AGREES: f64 = 0.7;
/// So far inside a side, in extents, a point is surely inside.
const INSIDE: f64 = 1e-7;
