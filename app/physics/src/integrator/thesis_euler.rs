//! Turns a body as the thesis does (Melder eq. 5.8, 5.9, 5.12-5.14), for comparison.
//!
//! Model: the angular velocity in W is what goes on from tick to tick; a rotation matrix is turned by a small angle and made
//! orthonormal again in three steps. Corrected are 5.14 (omega is in W, so that `R = dR R_old`; the thesis has `R_old dR`,
//! which is right only for an omega in the body's frame) and 5.15, the same as 5.8 written out, which lost its J.
//! In normal use the thesis leaves the gyroscopic term out (eq. 5.9); with it, angular velocities that grow without end
//! shut it down (ch. 8.2.6). Both are so here: neither keeps the angular momentum of a body without symmetry.

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

use super::{Limits, limited};
use crate::body::Body;

/// A tick of turning under a torque (N m).
pub(super) fn turn(
    body: &mut Body,
    torque_W: &Vector3<f64>,
    is_gyroscopic: bool,
    limits: &Limits,
    dt_s: f64,
) {
    if body.rotation_locked {
        return;
    }
    let omega_old_W = body.angular_velocity_W();
    let accelerates_W = if is_gyroscopic {
        //= melder#5.15
        body.inverse_inertia_W() * (torque_W - omega_old_W.cross(&(body.inertia_W() * omega_old_W)))
    } else {
        //= melder#5.9
        body.inverse_inertia_W() * torque_W
    };
    //= melder#5.12
    let omega_W = limited(omega_old_W + accelerates_W * dt_s, limits.spin_rad_s);
    //= melder#5.13
    let turned = Matrix3::identity() + omega_W.cross_matrix() * dt_s;
    //= melder#5.14
    let R = orthonormal(&(turned * body.orientation.to_rotation_matrix().matrix()));
    body.orientation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(R));
    body.angular_momentum_W = body.inertia_W() * omega_W;
}

/// The three steps of ch. 5.3.1, with `R = [n o a]`.
fn orthonormal(R: &Matrix3<f64>) -> Matrix3<f64> {
    let o = R.column(1);
    let a = R.column(2).normalize();
    let n = o.cross(&a).normalize();
    let o = a.cross(&n);
    Matrix3::from_columns(&[n, o, a])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_matrix_becomes_a_rotation_that_keeps_the_direction_of_its_third_column() {
        let wrong = Matrix3::new(1.1, 0.2, -0.1, -0.1, 0.9, 0.3, 0.2, -0.2, 1.2);
        let R = orthonormal(&wrong);
        // A few roundings.
        assert!((R * R.transpose() - Matrix3::identity()).norm() < 1e-15);
        assert!((R.determinant() - 1.0).abs() < 1e-15);
        assert!(R.column(2).cross(&wrong.column(2)).norm() < 1e-15);
        let again = orthonormal(&R);
        assert!((again - R).norm() < 1e-15);
    }
}
