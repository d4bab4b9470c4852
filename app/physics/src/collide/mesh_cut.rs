//! Crossings of two edges: an edge of one solid is cut off by a mesh.
//!
//! Problem: a cube that lies half over the end of a table has two corners on it, and two more points where its lower edges
//! cross that of the table; without these it would fall off while its middle is still over the table.
//! Model: the edge enters the mesh through its side; from there the way along the contact's normal leads out through the
//! face that is pressed. Its normal is the contact's, the length of the way the depth. Or it dips through a
//! [ridge](super::mesh_ridge), whichever way is the shorter one.
//! Cost: six queries for an edge that meets nothing, two to seven more for each end where it does.

use haptics::mesh::{Face, Hit, Mesh, Sides};
use nalgebra::Vector3;

use super::mesh_ridge::{LOOKS, Part};

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
    /// Seen from either end, and where it dips through ridges there. Where it is not cut off yet, but will dip through one when
    /// it has come nearer: there.
    pub(super) fn cuts(&self, mesh: &Mesh, way: &WayOut<'_>) -> [Option<Cut>; MOST_CUTS] {
        let [a, b] = self.ends;
        let ways = [(&a, &b), (&b, &a)];
        let hits = ways.map(|(from, to)| mesh.first_hit(from, to));
        let parts = self.parts(mesh, &hits);
        let dips = [0, 1].map(|at| parts[at].as_ref().and_then(|part| part.dips(mesh, way)));
        if let ([None, None], [None, None]) = (&hits, dips) {
            let will_dip = if way.ahead_m > 0.0 { self.will_dip(mesh, way) } else { [None; 2] };
            return [None, None, will_dip[0], will_dip[1]];
        }
        let cuts = [0, 1].map(|at| {
            // Not by a side of the ridge, and the way out is the shorter one.
            let dip = if parts[1].is_some() { dips[at] } else { dips[0] };
            let Some(dip) = dip else { return cut(mesh, hits[at].as_ref()?, ways[at].1, way, ASIDE) };
            let cut = cut(mesh, hits[at].as_ref()?, ways[at].1, way, LOOKS)?;
            (cut.gap_m > dip.gap_m).then_some(cut)
        });
        [cuts[0], cuts[1], dips[0], dips[1]]
    }

    /// As if it were so much nearer.
    fn will_dip(&self, mesh: &Mesh, way: &WayOut<'_>) -> [Option<Cut>; 2] {
        let nearer_M = way.along * -way.ahead_m;
        let nearer = Self { ends: self.ends.map(|end| end + nearer_M) };
        let [a, b] = nearer.ends;
        let hits = [(&a, &b), (&b, &a)].map(|(from, to)| mesh.first_hit(from, to));
        if hits.iter().any(Option::is_none) {
            return [None; 2];
        }
        let way = WayOut { most_m: way.most_m.max(2.0 * way.ahead_m), ..*way };
        nearer.parts(mesh, &hits).map(|part| {
            let cut = part?.dips_from_outside(mesh, &way)?;
            let (on_edge, gap_m) = (cut.on_edge - nearer_M, cut.gap_m - cut.out.dot(&nearer_M));
            (gap_m > 0.0).then_some(Cut { on_edge, on_mesh: on_edge - cut.out * gap_m, gap_m, ..cut })
        })
    }

    /// The part of it in the mesh, or, where it goes in and out several times, the first and the last one.
    fn parts(&self, mesh: &Mesh, hits: &[Option<Hit>; 2]) -> [Option<Part>; 2] {
        let whole = Some(Part { ends: self.ends, hits: *hits });
        if mesh.sides() == Sides::Sheet || hits.iter().all(Option::is_none) {
            return [whole, None];
        }
        let inside_m = INSIDE * mesh.extent_m();
        // Where it comes in, seen from this end, if that is outside; and where it leaves again.
        let passes = |at: usize| {
            let [from, to] = [self.ends[at], self.ends[1 - at]];
            let first = mesh.first_crossing(&from, &to)?;
            if !first.is_front {
                return Some((None, first));
            }
            let farther = first.point_B + (to - from).try_normalize(0.0)? * inside_m;
            Some((Some(first), mesh.first_crossing(&farther, &to)?))
        };
        let [Some((entered, left)), Some((last_entered, last_left))] = [0, 1].map(passes) else {
            return [whole, None];
        };
        if last_entered.is_some_and(|last| (last.point_B - left.point_B).norm() < 2.0 * inside_m) {
            return [whole, None];
        }
        let part = |hits| Some(Part { ends: self.ends, hits });
        [part([entered, Some(left)]), part([Some(last_left), last_entered])]
    }
}

fn cut(mesh: &Mesh, hit: &Hit, to: &Vector3<f64>, way: &WayOut<'_>, side: f64) -> Option<Cut> {
    // Through the pressed face itself it goes without depth, through its back not at all.
    if mesh.faces()[hit.face as usize].normal_B.dot(&way.along).abs() > side {
        return None;
    }
    let along_edge = (to - hit.point_B).try_normalize(0.0)?;
    let on_edge = hit.point_B + along_edge * (INSIDE * mesh.extent_m());
    // The way out may lean over the side that was entered: then it is looked for from farther inside.
    let farther = hit.point_B + along_edge * (0.5 * way.most_m).min(0.25 * (to - hit.point_B).norm());
    let lift = (way.lift)(&on_edge);
    let from = [on_edge, farther, on_edge + lift, farther + lift];
    let tried = if lift == Vector3::zeros() { 2 } else { 4 };
    let face = from[..tried].iter().find_map(|point| pressed(mesh, point, way, AGREES))?;
    let gap_m = face.normal_B.dot(&on_edge) - face.offset_m;
    let on_mesh = on_edge - face.normal_B * gap_m;
    (gap_m < 0.0).then_some(Cut { on_edge, on_mesh, out: face.normal_B, gap_m })
}

/// The face through which the way out leads.
pub(super) fn pressed<'m>(
    mesh: &'m Mesh,
    point: &Vector3<f64>,
    way: &WayOut<'_>,
    agrees: f64,
) -> Option<&'m Face> {
    let out = mesh.first_hit(&(point + way.along * way.most_m), point)?;
    let face = &mesh.faces()[out.face as usize];
    (face.normal_B.dot(&way.along) > agrees).then_some(face)
}

/// From both ends, and through a ridge at each.
pub(super) const MOST_CUTS: usize = 4;
/// Cosine between the pressed face and a side.
const ASIDE: f64 = 0.7;
const AGREES: f64 = 0.7;
/// So far inside a side, in extents, a point is surely inside.
pub(super) const INSIDE: f64 = 1e-7;
