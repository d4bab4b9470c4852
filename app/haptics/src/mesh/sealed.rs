//! Rims that lie on other faces, where nothing gets in.
//!
//! Problem: rooms that share a wall, and walls between skins, end where three and more faces meet, or amid others. They
//! are open parts, but no finger comes in by such a rim.
//!
//! Model: an edge of one face is sealed if other faces lie along all of it. Each covers the piece of the edge that is within its
//! triangle and its plane; a face that ends there itself and lies upon the edge's own covers nothing, as both are open
//! there together. A part is sealed if all its rims are. In doubt it is not. Where faces lie along any rim, points
//! [roll](Mesh::point_radius_m): a walk over neighbours would pass below what ends there.
//!
//! Of a rim that ends a little before another part the gap is measured: the largest of some places' distances from that part.
//!
//! Cost: two looks at what is near for each rim, bounded for all together.

use nalgebra::Vector3;

use super::bvh::closest_on;
use super::winding::Parts;
use super::{Face, Mesh, MeshReport, Sides};
use crate::surface::direction_or_up;

/// A rim.
struct Edge {
    face: usize,
    from: Vector3<f64>,
    way: Vector3<f64>,
    /// Into its face, of unit length.
    inward: Vector3<f64>,
}

/// Extent of a rim along which other faces lie.
enum Along {
    All,
    Some,
    None,
}

/// Shares of a rim along which faces lie, and faces that may still be looked at.
struct Found {
    covered: Vec<[f64; 2]>,
    looks: usize,
}

impl Mesh {
    /// Notes rims and parts that are sealed, parts that are not, and those that have no rim; says whether faces lie along any rim.
    pub(super) fn note_sealed(&self, parts: &Parts, report: &mut MeshReport) -> bool {
        let [mut has_rim, mut is_open] = [false; 2].map(|no| vec![no; parts.len()]);
        let (mut do_meet, mut looks) = (false, MOST_LOOKS);
        let mut looks_beside = if parts.len() > 1 { MOST_LOOKS_BESIDE } else { 0 };
        for (number, face) in self.faces.iter().enumerate() {
            for side in (0..3).filter(|&side| face.links[side].is_boundary()) {
                let [from, to] =
                    [side, (side + 1) % 3].map(|corner| self.vertices[face.vertices[corner] as usize]);
                let way = to - from;
                let inward = direction_or_up(&face.normal_B.cross(&way));
                has_rim[parts.of(number)] = true;
                let edge = Edge { face: number, from, way, inward };
                match self.along(&edge, &mut looks) {
                    Along::All => report.sealed_edges += 1,
                    found => {
                        if let Some(gap_m) = self.gap_m(&edge, parts, &mut looks_beside) {
                            report.short_rims.note(gap_m, from + 0.5 * way);
                        }
                        is_open[parts.of(number)] = true;
                        do_meet |= matches!(found, Along::Some);
                        continue;
                    }
                }
                do_meet = true;
            }
        }
        let mut is_sheet = vec![false; parts.len()];
        for (face, record) in self.faces.iter().enumerate() {
            is_sheet[parts.of(face)] |= record.sides == Sides::Sheet;
        }
        for part in (0..parts.len()).filter(|&part| is_sheet[part]) {
            let finding = match (has_rim[part], is_open[part]) {
                (false, _) => &mut report.rimless_parts,
                (true, false) => &mut report.sealed_parts,
                (true, true) => &mut report.open_parts,
            };
            finding.note(parts.first_of_input(part));
        }
        do_meet
    }

    /// Nearer to a face is on it.
    fn on_m(&self) -> f64 {
        (ON * self.extent_m).min(NARROW * self.least_ball_m())
    }

    /// How far an edge is from other parts, if that is little and more than nothing.
    fn gap_m(&self, edge: &Edge, parts: &Parts, looks: &mut usize) -> Option<f64> {
        let near_m = BESIDE * self.extent_m;
        let (middle_B, half) = (edge.from + 0.5 * edge.way, 0.5 * edge.way.abs().add_scalar(2.0 * near_m));
        let places_B = [0.0, 0.25, 0.5, 0.75, 1.0].map(|share| edge.from + share * edge.way);
        let most = *looks;
        let mut found = ([near_m * near_m; 5], most);
        let key = |_: &([f64; 5], usize), at_B: &Vector3<f64>, size: &Vector3<f64>| {
            let is_near = (0..3).all(|axis| (at_B[axis] - middle_B[axis]).abs() <= size[axis] + half[axis]);
            is_near.then_some(0.0)
        };
        let visit = |(least_m2, looks): &mut ([f64; 5], usize), number: u32| {
            *looks = looks.saturating_sub(1);
            if parts.of(number as usize) != parts.of(edge.face) {
                let face = &self.faces[number as usize];
                let corners = self.triangles().corners(face);
                for (place_B, least_m2) in places_B.iter().zip(least_m2) {
                    let closest = closest_on(face, &corners, place_B, *least_m2);
                    *least_m2 = closest.map_or(*least_m2, |closest| least_m2.min(closest.squared_distance));
                }
            }
            *looks > 0
        };
        let is_done = self.bvh.for_each_face_in_boxes(&mut found, key, visit, most);
        *looks = found.1;
        let gap_m = found.0.into_iter().fold(0.0, f64::max).sqrt();
        (is_done && gap_m > self.on_m() && gap_m < near_m).then_some(gap_m)
    }

    fn along(&self, edge: &Edge, looks: &mut usize) -> Along {
        let on_m = self.on_m();
        let (middle_B, half) = (edge.from + 0.5 * edge.way, 0.5 * edge.way.abs().add_scalar(2.0 * on_m));
        let most = *looks;
        let mut found = Found { covered: Vec::new(), looks: most };
        let key = |_: &Found, at_B: &Vector3<f64>, size: &Vector3<f64>| {
            let is_near = (0..3).all(|axis| (at_B[axis] - middle_B[axis]).abs() <= size[axis] + half[axis]);
            is_near.then_some(0.0)
        };
        let visit = |found: &mut Found, face: u32| {
            found.looks = found.looks.saturating_sub(1);
            if face as usize != edge.face {
                found.covered.extend(self.covered(edge, &self.faces[face as usize], on_m));
            }
            found.looks > 0
        };
        let is_done = self.bvh.for_each_face_in_boxes(&mut found, key, visit, most);
        *looks = found.looks;
        let mut covered = found.covered;
        covered.sort_by(|a, b| a[0].total_cmp(&b[0]));
        let on = on_m / edge.way.norm();
        let long = (LONG * on).min(HALF);
        let end = covered
            .iter()
            .fold(0.0, |end: f64, [from, to]| if *from <= end + on { end.max(*to) } else { end });
        match (is_done && end >= 1.0 - on, covered.iter().any(|[from, to]| to - from > long)) {
            (true, _) => Along::All,
            (false, true) => Along::Some,
            (false, false) => Along::None,
        }
    }

    /// Shares of an edge between which a face lies along it.
    fn covered(&self, edge: &Edge, face: &Face, on_m: f64) -> Option<[f64; 2]> {
        let corners = self.triangles().corners(face);
        let mut piece = [0.0, 1.0];
        let height = |place: Vector3<f64>| face.normal_B.dot(&(place - corners[0]));
        let to = edge.from + edge.way;
        // Between its plane's two sides, and on this side of all its edges.
        let heights = [height(edge.from), height(to)];
        clip(&mut piece, heights, on_m)?;
        clip(&mut piece, heights.map(|height| -height), on_m)?;
        for side in 0..3 {
            let [a, b] = [corners[side], corners[(side + 1) % 3]];
            let outward = (b - a).cross(&face.normal_B).try_normalize(0.0)?;
            let beyond = [edge.from, to].map(|place| outward.dot(&(place - a)));
            clip(&mut piece, beyond, on_m)?;
            let is_along = |share: f64| (beyond[0] + (beyond[1] - beyond[0]) * share).abs() <= on_m;
            let ends_there = face.links[side].is_boundary() && piece.iter().all(|share| is_along(*share));
            if ends_there && (edge.inward + outward).norm() < UPON {
                return None;
            }
        }
        Some(piece)
    }
}

/// Takes away of a piece what is above a level that is linear along the way; `None`: that is all of it.
fn clip(piece: &mut [f64; 2], levels: [f64; 2], most: f64) -> Option<()> {
    let [from, to] = levels;
    let share = (most - from) / (to - from);
    match (from <= most, to <= most) {
        (true, true) => {}
        (false, false) => return None,
        (true, false) => piece[1] = piece[1].min(share),
        (false, true) => piece[0] = piece[0].max(share),
    }
    (piece[0] < piece[1]).then_some(())
}

/// Of the extent: nearer to a face is on it. Three times what coordinates of 24 bits are rounded by.
const ON: f64 = 2e-7;
/// Of the radius with which points roll then, which fits through no such gap.
const NARROW: f64 = 0.1;
/// Of that distance: what lies along less of a rim has only a point in common with it; and of the rim, if that is shorter.
const LONG: f64 = 500.0;
const HALF: f64 = 0.5;
/// Sine of the angle below which two faces that end at one edge lie upon each other.
const UPON: f64 = 1e-3;
/// Boxes and faces that are looked at, for all rims.
const MOST_LOOKS: usize = 20_000_000;
/// Of the extent: a rim that is farther from other parts has nothing to do with them.
const BESIDE: f64 = 1e-2;
/// Faces that are looked at for how far rims are from other parts: about a second.
const MOST_LOOKS_BESIDE: usize = 5_000_000;
