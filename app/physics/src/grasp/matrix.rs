//! The grasp matrix and its rank.

use nalgebra::Vector6;

use super::{Grasp, MAX_CONTACTS, tangents};

/// The most columns: four of each contact.
pub(super) const MAX_COLUMNS: usize = 4 * MAX_CONTACTS;

/// G: what a unit of each force or torque that a contact can give does to the body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GraspMatrix {
    columns: [Vector6<f64>; MAX_COLUMNS],
    count: usize,
}

impl GraspMatrix {
    pub(super) fn of(grasp: &Grasp) -> Self {
        let mut matrix = Self { columns: [Vector6::zeros(); MAX_COLUMNS], count: 0 };
        for contact in grasp.contacts() {
            matrix.push(grasp.wrench(contact, &contact.normal_W, 0.0));
            if contact.mu > 0.0 {
                for tangent_W in tangents(&contact.normal_W) {
                    matrix.push(grasp.wrench(contact, &tangent_W, 0.0));
                }
            }
            if contact.torsion_m > 0.0 {
                matrix.push(grasp.wrench(contact, &nalgebra::Vector3::zeros(), grasp.length_m()));
            }
        }
        matrix
    }

    fn push(&mut self, column: Vector6<f64>) {
        if let Some(place) = self.columns.get_mut(self.count) {
            *place = column;
            self.count += 1;
        }
    }

    /// Its columns: force, then torque about the centre of mass over the largest distance of a contact from it.
    pub fn columns(&self) -> &[Vector6<f64>] {
        &self.columns[..self.count]
    }

    /// In how many directions wrenches can be given: Gram-Schmidt with the largest column that is left first.
    pub fn rank(mut self) -> usize {
        let columns = &mut self.columns[..self.count];
        let longest = |columns: &[Vector6<f64>]| columns.iter().map(Vector6::norm).fold(0.0, f64::max);
        let least = NOTHING * longest(columns);
        for rank in 0..6 {
            let largest = columns.iter().max_by(|a, b| a.norm_squared().total_cmp(&b.norm_squared()));
            let Some(pivot) = largest.filter(|pivot| pivot.norm() > least) else { return rank };
            let unit = pivot.normalize();
            for column in columns.iter_mut() {
                // Twice is enough.
                for _ in 0..2 {
                    *column -= unit * unit.dot(column);
                }
            }
        }
        6
    }
}

/// Shorter than this share of the longest column is rounding.
const NOTHING: f64 = 1e-9;
