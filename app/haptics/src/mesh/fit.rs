//! Walls of parts that coincide, moved so that the parts overlap.
//!
//! Problem: parts are meant to fit, a pin in a bore of its own size. Where their walls coincide but for rounding, or leave a
//! crack that is none to a finger, each question to the mesh answers by rounding whether the pin's top reaches the bore's wall,
//! and a point that slides there may get between the two.
//!
//! Model: an interference fit. The walls of the smaller part are moved outward by [`FIT`] of [`widest_m`]: a vertex to where the
//! planes of its fitting faces are that much farther out and those of its other faces where they were (least squares where
//! there are too many). What meets there is then an ordinary crossing ([`crossed`](super::crossed)), by far more than rounding.
//!
//! Invariants: no vertex moves by more than [`MOST_FIT`] of that width; no face turns by more than 25 degrees, for that its
//! corners stay where they were.
//! Frames: object frame B.
//! Limit: what is moved is felt, too, where it is not hidden: a bore is narrower by twice 12 um if its ring is smaller than the
//! pin.
//! Cost: linear in the faces; nothing where none fit.

use nalgebra::{Matrix3, Vector3};

use super::beside::widest_m;
use super::build::plane_of;
use super::report::NarrowGaps;
use super::winding::Parts;
use super::{Bvh, Mesh};

impl Mesh {
    /// Of two faces of different parts that are nearer than a crack, the one that is to be moved, if they fit.
    pub(super) fn fitting(&self, pair: [u32; 2], parts: &Parts, sizes: &[f64]) -> Option<u32> {
        let [a, b] = pair.map(|face| sizes[parts.of(face as usize)]);
        let [normal_B, other_B] = pair.map(|face| self.faces[face as usize].normal_B);
        let do_fit = normal_B.dot(&other_B) < -PARALLEL && !self.do_overlap(pair);
        do_fit.then_some(if b < a { pair[1] } else { pair[0] })
    }

    /// Moves the walls that fit.
    pub(super) fn fit(&mut self, is_fitting: &[bool], gaps: &mut NarrowGaps) {
        if !is_fitting.contains(&true) {
            return;
        }
        let by_B = self.moves(is_fitting);
        gaps.moved = by_B.iter().filter(|by_B| **by_B != Vector3::zeros()).count();
        gaps.moved_by_m = FIT * gaps.widest_m;
        if gaps.moved == 0 {
            return;
        }
        for (vertex, by_B) in self.vertices.iter_mut().zip(&by_B) {
            *vertex += by_B;
        }
        for face in &mut self.faces {
            if face.vertices.iter().any(|vertex| by_B[*vertex as usize] != Vector3::zeros()) {
                let corners = face.vertices.map(|vertex| self.vertices[vertex as usize]);
                (face.normal_B, face.offset_m) = plane_of(&corners);
            }
        }
        self.bvh = Bvh::build(&self.faces, &self.vertices);
    }

    /// Diagonals of the parts' boxes \[m\].
    pub(super) fn sizes(&self, parts: &Parts) -> Vec<f64> {
        let mut boxes =
            vec![[Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY)]; parts.len()];
        for (i, face) in self.faces.iter().enumerate() {
            let [low, high] = &mut boxes[parts.of(i)];
            for vertex in face.vertices {
                let corner = &self.vertices[vertex as usize];
                (*low, *high) = (low.inf(corner), high.sup(corner));
            }
        }
        boxes.iter().map(|[low, high]| (high - low).norm()).collect()
    }

    /// Walls that are as far in each other as they would be moved at least.
    fn do_overlap(&self, pair: [u32; 2]) -> bool {
        let least_m = (FIT - 1.0) * 0.5 * widest_m(self.extent_m);
        let [one, other] = pair.map(|face| &self.faces[face as usize]);
        let is_behind =
            |vertex: &u32| one.offset_m - one.normal_B.dot(&self.vertices[*vertex as usize]) > least_m;
        other.vertices.iter().all(is_behind)
    }

    /// How far each vertex is to be moved \[m\].
    fn moves(&self, is_fitting: &[bool]) -> Vec<Vector3<f64>> {
        let mut moves = vec![Vector3::zeros(); self.vertices.len()];
        let mut around = vec![Vec::new(); self.vertices.len()];
        for face in
            self.faces.iter().zip(is_fitting).filter(|(_, is_fitting)| **is_fitting).map(|(face, _)| face)
        {
            face.vertices.iter().for_each(|vertex| around[*vertex as usize].push((face.normal_B, true)));
        }
        for (face, _) in self.faces.iter().zip(is_fitting).filter(|(_, is_fitting)| !**is_fitting) {
            for vertex in face.vertices {
                let around = &mut around[vertex as usize];
                // What goes on as a wall that fits does not hold it back.
                let goes_on =
                    around.iter().any(|(normal_B, fits)| *fits && normal_B.dot(&face.normal_B) > GOES_ON);
                if !around.is_empty() && !goes_on {
                    around.push((face.normal_B, false));
                }
            }
        }
        let widest_m = widest_m(self.extent_m);
        for (by_B, around) in moves.iter_mut().zip(&around).filter(|(_, around)| !around.is_empty()) {
            *by_B = moved(around) * (FIT * widest_m);
            let most_m = MOST_FIT * widest_m;
            if by_B.norm() > most_m {
                by_B.normalize_mut();
                *by_B *= most_m;
            }
        }
        // What a face that would turn gives back may turn another one.
        for _ in 0..MOST_ROUNDS {
            let mut is_done = true;
            for face in &self.faces {
                let is_moved = face.vertices.iter().any(|vertex| moves[*vertex as usize] != Vector3::zeros());
                let corners =
                    || face.vertices.map(|vertex| self.vertices[vertex as usize] + moves[vertex as usize]);
                // No number, if it would have no area.
                let looks_on = || plane_of(&corners()).0.dot(&face.normal_B) > TURNED;
                if is_moved && !looks_on() {
                    face.vertices.iter().for_each(|vertex| moves[*vertex as usize] = Vector3::zeros());
                    is_done = false;
                }
            }
            if is_done {
                return moves;
            }
        }
        vec![Vector3::zeros(); self.vertices.len()]
    }
}

/// Way of a vertex to one unit in front of the planes that fit, and none off the others: the shortest of those that are nearest
/// to it.
fn moved(around: &[(Vector3<f64>, bool)]) -> Vector3<f64> {
    let (mut squares, mut sum) = (Matrix3::identity() * SLACK, Vector3::zeros());
    for (normal_B, fits) in around {
        squares += normal_B * normal_B.transpose();
        sum += if *fits { *normal_B } else { Vector3::zeros() };
    }
    squares.cholesky().map_or_else(Vector3::zeros, |squares| squares.solve(&sum))
}

/// Move of a wall, in widths of the widest crack: across that, and on by more than any rounding.
const FIT: f64 = 1.2;
/// Bound on the move of a vertex, in the same.
const MOST_FIT: f64 = 3.0;
/// Cosine of the angle up to which walls coincide: 2 degrees. Others cross.
const PARALLEL: f64 = 0.9994;
/// Cosine of the angle up to which a wall goes on in another face: 20 degrees.
const GOES_ON: f64 = 0.94;
/// Cosine of the angle by which a face may turn.
const TURNED: f64 = 0.9;
/// Regularisation of least squares, to one face.
const SLACK: f64 = 1e-9;
const MOST_ROUNDS: usize = 8;
