//! Changes of a few faces of a triangle soup that unfold slivers: edge flips and edge collapses.
//!
//! Model: a change replaces faces by others between the same outer edges. It is measured by how many edges of these faces are
//! folded, and by their area: where faces are all in one plane, what the area loses is double skin without anything between.
//! New edges have exactly two faces, wound alike, and lie upon no other edge, so that a closed mesh stays closed, also in a file.
//!
//! Invariant: no vertex is made. The solid changes within a layer of the given thickness around the faces, or a corner moves by no
//! more than that, in all.
//! Cost: of a change, square in the faces around a corner of a sliver, of which there are [`MOST_AROUND`] at most.

use super::fold::{Thin, is_folded_over};
use super::order::{Curve, Triangle};
use super::repair::{area_vector, has_area};
use nalgebra::Vector3;
use std::collections::HashMap;

/// Faces that vanish, and what takes the place of some of them.
pub(super) struct Change {
    pub(super) before: Vec<u32>,
    pub(super) after: Vec<Placed>,
    /// The corner that another one moves to, and by how much in all.
    moved: Option<(u32, f64)>,
    measure: Measure,
}

/// A face and its corners.
pub(super) type Placed = (u32, [u32; 3]);

/// Quantities that a change is to make smaller.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Measure {
    folded_edges: usize,
    area_m2: f64,
}

impl Measure {
    fn is_less_than(&self, other: &Self) -> bool {
        let (area, other_area) = (self.area_m2, other.area_m2);
        match self.folded_edges.cmp(&other.folded_edges) {
            std::cmp::Ordering::Less => area <= other_area * (1.0 + ROUNDING),
            std::cmp::Ordering::Equal => area < other_area * (1.0 - ROUNDING),
            std::cmp::Ordering::Greater => false,
        }
    }
}

/// Of an area: a change that makes no more of a difference makes none.
const ROUNDING: f64 = 1e-9;

/// Faces on their way to be changed.
pub(super) struct Changing<'a> {
    vertices: &'a [Vector3<f64>],
    thin: Thin,
    corners: Vec<[u32; 3]>,
    /// For each face the one whose piece it is now, or [`GONE`].
    piece_of: Vec<u32>,
    /// Faces at each vertex, as they were: `faces[starts[v]..starts[v + 1]]`.
    starts: Vec<u32>,
    faces: Vec<u32>,
    /// Faces at vertices where something has changed.
    changed: HashMap<u32, Vec<u32>>,
    /// For each vertex that is a copy of another one that one, and the copies of a vertex.
    original: HashMap<u32, u32>,
    copies: HashMap<u32, Vec<u32>>,
    /// By how much others have moved to a vertex.
    moved_m: HashMap<u32, f64>,
}

/// A corner of more faces stays where it is.
const MOST_AROUND: usize = 64;
const GONE: u32 = u32::MAX;

impl<'a> Changing<'a> {
    /// `copies` are the last vertices, each with which vertex it is a copy of.
    pub(super) fn new(
        triangles: &[Triangle],
        vertices: &'a [Vector3<f64>],
        copies: &[u32],
        thin: Thin,
    ) -> Self {
        let corners: Vec<[u32; 3]> = triangles.iter().map(|triangle| triangle.corners).collect();
        let mut starts = vec![0_u32; vertices.len() + 1];
        corners.as_flattened().iter().for_each(|&corner| starts[corner as usize] += 1);
        let mut end = 0;
        for start in &mut starts {
            end += *start;
            *start = end;
        }
        // Each start is now the group's end, and falls to its beginning as the group fills from behind.
        let mut faces = vec![0; 3 * corners.len()];
        for (face, corners) in corners.iter().enumerate().rev() {
            for &corner in corners {
                let start = &mut starts[corner as usize];
                *start -= 1;
                faces[*start as usize] = face as u32;
            }
        }
        let piece_of = (0..triangles.len() as u32).collect();
        let first_copy = vertices.len() - copies.len();
        let original: HashMap<u32, u32> = (first_copy as u32..).zip(copies.iter().copied()).collect();
        let mut copies_of: HashMap<u32, Vec<u32>> = HashMap::new();
        for (copy, &of) in (first_copy as u32..).zip(copies) {
            copies_of.entry(of).or_default().push(copy);
        }
        let (changed, moved_m) = Default::default();
        Self {
            vertices,
            thin,
            corners,
            piece_of,
            starts,
            faces,
            changed,
            original,
            copies: copies_of,
            moved_m,
        }
    }

    fn around(&self, vertex: u32) -> &[u32] {
        let range = || self.starts[vertex as usize] as usize..self.starts[vertex as usize + 1] as usize;
        self.changed.get(&vertex).map_or_else(|| &self.faces[range()], Vec::as_slice)
    }

    /// Two vertices, the one with fewer faces first.
    fn by_faces(&self, a: u32, b: u32) -> [u32; 2] {
        if self.around(a).len() <= self.around(b).len() { [a, b] } else { [b, a] }
    }

    fn at(&self, corners: &[u32; 3]) -> [Vector3<f64>; 3] {
        corners.map(|corner| self.vertices[corner as usize])
    }

    /// The only other face at an edge of a face.
    fn beyond(&self, face: u32, from: u32, to: u32) -> Option<u32> {
        let [here, there] = self.by_faces(from, to);
        let mut others =
            self.around(here).iter().filter(|&&o| o != face && self.corners[o as usize].contains(&there));
        others.next().copied().filter(|_| others.next().is_none())
    }

    /// The change at a folded sliver that leaves the least; `None` if there is none that helps, or it is not folded.
    pub(super) fn best(&self, face: u32) -> Option<Change> {
        if self.piece_of[face as usize] == GONE || !self.is_folded(face) {
            return None;
        }
        let corners = self.corners[face as usize];
        let mut best: Option<Change> = None;
        for edge in 0..3 {
            let [a, b, p] = [0, 1, 2].map(|i| corners[(edge + i) % 3]);
            for change in [self.flip(face, [a, b, p]), self.collapse(a, b), self.collapse(b, a)] {
                let Some(change) = change else { continue };
                if best.as_ref().is_none_or(|best| change.measure.is_less_than(&best.measure)) {
                    best = Some(change);
                }
            }
        }
        best
    }

    fn is_folded(&self, face: u32) -> bool {
        let (corners, piece) = (self.corners[face as usize], self.piece_of[face as usize]);
        let points = self.at(&corners);
        (0..3).any(|edge| {
            let other = self.beyond(face, corners[edge], corners[(edge + 1) % 3]);
            let others = other.map(|other| self.at(&self.corners[other as usize]));
            others.is_some_and(|others| self.thin.is_folded(piece as usize, &points, &others))
        })
    }

    /// Thickness of the layer, parallel to the largest of some faces, that all of them lie in.
    fn thickness_m(&self, faces: &[u32]) -> f64 {
        let area = |face: &u32| area_vector(&self.at(&self.corners[*face as usize]));
        let largest = faces.iter().map(area).max_by(|a, b| a.norm_squared().total_cmp(&b.norm_squared()));
        let normal = largest.unwrap_or_default().normalize();
        let heights = faces.iter().flat_map(|face| self.at(&self.corners[*face as usize]));
        let heights = heights.map(|point| normal.dot(&point));
        let (low, high) = heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), height| {
            (low.min(height), high.max(height))
        });
        high - low
    }

    fn flip(&self, face: u32, [a, b, p]: [u32; 3]) -> Option<Change> {
        let [from, to, opposite] = self.at(&[a, b, p]);
        let other = self.beyond(face, a, b)?;
        let far_m = distance_to_segment(&opposite, &from, &to).min(self.thickness_m(&[face, other]));
        if far_m > self.thin.widest_m {
            return None;
        }
        let c = apex(&self.corners[other as usize], b, a)?;
        if p == c {
            return None;
        }
        self.change(vec![face, other], vec![(face, [p, a, c]), (other, [c, b, p])], None)
    }

    /// Moves a corner to another one.
    fn collapse(&self, from: u32, to: u32) -> Option<Change> {
        let before = self.around(from).to_vec();
        if before.len() > MOST_AROUND {
            return None;
        }
        let stay = before.iter().filter(|&&face| !self.corners[face as usize].contains(&to));
        let turned = |&face: &u32| {
            (face, self.corners[face as usize].map(|corner| if corner == from { to } else { corner }))
        };
        let after: Vec<Placed> = stay.map(turned).collect();
        let far_m = (self.vertices[from as usize] - self.vertices[to as usize]).norm();
        let far_m = far_m.min(self.thickness_m(&before));
        let moved_m = far_m + self.moved_m.get(&from).copied().unwrap_or(0.0);
        if moved_m > self.thin.widest_m {
            return None;
        }
        self.change(before, after, Some((to, moved_m)))
    }

    /// A change, if it helps and leaves proper faces.
    fn change(&self, before: Vec<u32>, after: Vec<Placed>, moved: Option<(u32, f64)>) -> Option<Change> {
        if !after.iter().all(|(_, corners)| has_area(&self.at(corners))) {
            return None;
        }
        let now: Vec<Placed> = before.iter().map(|&face| (face, self.corners[face as usize])).collect();
        let (old, odd) = self.measured(&now, &before);
        let (measure, new_odd) = self.measured(&after, &before);
        let is_proper = new_odd.iter().all(|edge| odd.contains(edge)) && self.is_alone(&after, &now);
        (is_proper && measure.is_less_than(&old)).then_some(Change { before, after, moved, measure })
    }

    /// True if no new edge and no new face lies upon one of another fan, which a file could not tell from it.
    fn is_alone(&self, after: &[Placed], before: &[Placed]) -> bool {
        let original = |corner: u32| self.original.get(&corner).copied().unwrap_or(corner);
        let is_upon = |corners: &[u32], of: &[u32; 3]| {
            let of = of.map(original);
            corners.iter().all(|&corner| of.contains(&original(corner)))
        };
        let is_there = |corners: &[u32]| {
            let fewest = corners.iter().min_by_key(|corner| self.around(**corner).len());
            let Some(first) = fewest.map(|&corner| original(corner)) else { return false };
            let copies = self.copies.get(&first).map_or(&[][..], Vec::as_slice);
            let mut around = copies.iter().chain([&first]).flat_map(|&vertex| self.around(vertex));
            around.any(|face| {
                let of = &self.corners[*face as usize];
                let is_other = corners.len() == 3 || !corners.iter().all(|corner| of.contains(corner));
                is_upon(corners, of) && is_other && before.iter().all(|(other, _)| other != face)
            })
        };
        after.iter().all(|(_, corners)| {
            let edges = [0, 1, 2].map(|edge| [corners[edge], corners[(edge + 1) % 3]]);
            let is_new = |edge: &[u32; 2]| !before.iter().any(|(_, of)| edge.iter().all(|c| of.contains(c)));
            !is_there(corners) && !edges.iter().filter(|edge| is_new(edge)).any(|edge| is_there(edge))
        })
    }

    /// Measure of some faces among the others, but for those that are left out; and their edges of other than two faces that are
    /// wound alike.
    fn measured(&self, faces: &[Placed], without: &[u32]) -> (Measure, Vec<[u32; 2]>) {
        let mut measure = Measure { folded_edges: 0, area_m2: 0.0 };
        let mut odd = Vec::new();
        for &(face, corners) in faces {
            let points = self.at(&corners);
            measure.area_m2 += 0.5 * area_vector(&points).norm();
            for edge in 0..3 {
                let [a, b] = [corners[edge], corners[(edge + 1) % 3]];
                let has_edge = |(other, c): &Placed| *other != face && c.contains(&a) && c.contains(&b);
                let within = faces.iter().copied().filter(has_edge);
                let around = self.around(self.by_faces(a, b)[0]).iter();
                let around = around.map(|&other| (other, self.corners[other as usize])).filter(has_edge);
                let around = around.filter(|(other, _)| !without.contains(other));
                let mut others = within.map(|other| (other, true)).chain(around.map(|other| (other, false)));
                let other = others.next().filter(|_| others.next().is_none());
                match other.filter(|((_, c), _)| apex(c, b, a).is_some()) {
                    Some(((other, c), is_within)) => {
                        let is_first = !is_within || face < other;
                        let is_folded = is_first && is_folded_over(&points, &self.at(&c));
                        measure.folded_edges += usize::from(is_folded);
                    }
                    None => odd.push([a.min(b), a.max(b)]),
                }
            }
        }
        (measure, odd)
    }

    /// Makes a change; gives the faces that are to be looked at again.
    pub(super) fn make(&mut self, change: &Change) -> Vec<u32> {
        let Change { before, after, moved, .. } = change;
        let of_before = || before.iter().flat_map(|&face| self.corners[face as usize]);
        let mut around: Vec<u32> = of_before().collect();
        around.sort_unstable();
        around.dedup();
        for &vertex in &around {
            let mut faces: Vec<u32> = self.around(vertex).to_vec();
            faces.retain(|face| !before.contains(face));
            let of_it = after.iter().filter(|(_, corners)| corners.contains(&vertex));
            faces.extend(of_it.map(|(face, _)| face));
            faces.sort_unstable();
            self.changed.insert(vertex, faces);
        }
        // Both pieces of a flipped edge are of the larger face: the sliver is no more than its rim.
        let area = |face: &u32| area_vector(&self.at(&self.corners[*face as usize])).norm();
        if moved.is_none() {
            let larger = before.iter().copied().max_by(|a, b| area(a).total_cmp(&area(b)));
            let piece_of = larger.map_or(GONE, |face| self.piece_of[face as usize]);
            before.iter().for_each(|&face| self.piece_of[face as usize] = piece_of);
        }
        for &face in before {
            match after.iter().find(|(other, _)| *other == face) {
                Some((_, corners)) => self.corners[face as usize] = *corners,
                None => self.piece_of[face as usize] = GONE,
            }
        }
        if let Some((to, by_m)) = *moved {
            let most = self.moved_m.entry(to).or_default();
            *most = most.max(by_m);
        }
        let few = around.iter().map(|&vertex| self.around(vertex)).filter(|faces| faces.len() <= MOST_AROUND);
        let mut again: Vec<u32> = few.flatten().copied().collect();
        again.extend(after.iter().map(|(face, _)| face));
        again.sort_unstable();
        again.dedup();
        again
    }

    /// The triangles as they are now.
    pub(super) fn write(self, triangles: &mut Vec<Triangle>) {
        let curve = Curve::through(self.vertices);
        let pieces = self
            .piece_of
            .iter()
            .zip(&self.corners)
            .enumerate()
            .filter(|(_, (piece_of, _))| **piece_of != GONE);
        let now = pieces.map(|(face, (&piece_of, corners))| {
            let of = triangles[piece_of as usize];
            if piece_of as usize == face && of.corners == *corners {
                return of;
            }
            let triangle = Triangle::new(*corners, &self.at(corners), of.origin(), &curve);
            if of.is_lid() { triangle.of_lid() } else { triangle }
        });
        *triangles = now.collect();
    }
}

/// The third corner of a face that runs from one corner to another.
fn apex(corners: &[u32; 3], from: u32, to: u32) -> Option<u32> {
    let runs = |i: &usize| corners[*i] == from && corners[(i + 1) % 3] == to;
    (0..3).find(runs).map(|i| corners[(i + 2) % 3])
}

fn distance_to_segment(point: &Vector3<f64>, from: &Vector3<f64>, to: &Vector3<f64>) -> f64 {
    let along = to - from;
    let share = ((point - from).dot(&along) / along.norm_squared()).clamp(0.0, 1.0);
    (point - from - along * share).norm()
}
