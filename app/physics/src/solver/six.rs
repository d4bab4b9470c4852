//! Force and torque, impulse and angular impulse: six numbers of a body.

use nalgebra::{SMatrix, SVector, Vector3};

pub(super) type Matrix6 = SMatrix<f64, 6, 6>;
pub(super) type Vector6 = SVector<f64, 6>;

pub(super) fn joined(along: &Vector3<f64>, about: &Vector3<f64>) -> Vector6 {
    Vector6::from_row_slice(&[along.x, along.y, along.z, about.x, about.y, about.z])
}

pub(super) fn halves(p: &Vector6) -> (Vector3<f64>, Vector3<f64>) {
    (Vector3::new(p[0], p[1], p[2]), Vector3::new(p[3], p[4], p[5]))
}
