//! Force closure.

use std::f64::consts::TAU;

use nalgebra::{SVector, Vector6};

use super::simplex::{MAX_POINTS, farthest};
use super::{Grasp, GraspContact, MAX_CONTACTS, tangents};

/// Edges of the pyramid inside a friction cone.
const EDGES: usize = 8;
const _: () = assert!(MAX_CONTACTS * (EDGES + 2) <= MAX_POINTS);

/// Wrenches of which all others that the contacts can give are sums.
pub(super) struct Edges {
    wrenches: [Vector6<f64>; MAX_POINTS],
    count: usize,
}

impl Edges {
    /// Each with a normal force of 1 N.
    pub(super) fn of(grasp: &Grasp) -> Self {
        let mut edges = Self { wrenches: [Vector6::zeros(); MAX_POINTS], count: 0 };
        for contact in grasp.contacts() {
            let n = contact.normal_W;
            if contact.mu > 0.0 {
                let [one, other] = tangents(&n);
                for edge in 0..EDGES {
                    let (sin, cos) = (TAU * edge as f64 / EDGES as f64).sin_cos();
                    edges.push(grasp.wrench(contact, &(n + (one * cos + other * sin) * contact.mu), 0.0));
                }
            }
            if contact.torsion_m > 0.0 {
                for torsion_m in [contact.torsion_m, -contact.torsion_m] {
                    edges.push(grasp.wrench(contact, &n, torsion_m));
                }
            }
            if contact.mu == 0.0 && contact.torsion_m == 0.0 {
                edges.push(grasp.wrench(contact, &n, 0.0));
            }
        }
        edges
    }

    fn push(&mut self, wrench: Vector6<f64>) {
        if let Some(place) = self.wrenches.get_mut(self.count) {
            *place = wrench;
            self.count += 1;
        }
    }

    pub(super) fn as_slice(&self) -> &[Vector6<f64>] {
        &self.wrenches[..self.count]
    }
}

pub(super) fn has_force_closure(grasp: &Grasp) -> bool {
    match grasp.contacts() {
        [] | [_] => false,
        [one, other] => of_two(one, other),
        _ => grasp.rank() == 6 && surround_the_origin(Edges::of(grasp).as_slice()),
    }
}

/// Nguyen's theorem: both soft, and the line that joins them inside both friction cones.
fn of_two(one: &GraspContact, other: &GraspContact) -> bool {
    let between_W = other.point_W - one.point_W;
    let are_soft = one.torsion_m > 0.0 && other.torsion_m > 0.0;
    are_soft && is_inside(one, &between_W) && is_inside(other, &-between_W)
}

fn is_inside(contact: &GraspContact, line_W: &nalgebra::Vector3<f64>) -> bool {
    let along = contact.normal_W.dot(line_W);
    let across = (line_W - contact.normal_W * along).norm();
    // Not behind it, either: then the right side is not positive.
    across < contact.mu * along
}

/// Whether every point counts in some sum of all of them that is zero. Of points that span the whole space: whether their
/// hull has the origin in its inside.
fn surround_the_origin(points: &[Vector6<f64>]) -> bool {
    // The least weight that all have, as large as it can be.
    let sum: Vector6<f64> = points.iter().sum();
    let mut line = SVector::<f64, 7>::zeros();
    line.fixed_rows_mut::<6>(0).copy_from(&sum);
    line[6] = points.len() as f64;
    farthest(points, &line).is_some_and(|found| found.reach > SOME)
}

/// Less weight than that is rounding.
const SOME: f64 = 1e-9;
