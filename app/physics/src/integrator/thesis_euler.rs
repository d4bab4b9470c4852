//! Turns a body as the thesis does (Melder eq. 5.8, 5.9, 5.12-5.14), for comparison.
//!
//! Model: the angular velocity in W is what goes on from tick to tick; a rotation matrix is turned by a small angle and made
//! orthonormal again in three steps. Corrected is 5.14 (omega is in W, so that `R = dR R_old`; the thesis has `R_old dR`,
//! which is right only for an omega in the body's frame). The gyroscopic term has three forms, [`Gyroscopic`].
//!
//! A tick adds to omega a piece that is perpendicular to it, and so makes it longer. A body with an axis of symmetry u
//! (moments J3 about it, Jt across) that spins at s about u and is turned slowly goes round u in its own frame at
//! `lambda = s (J3 - Jt) / Jt`; Euler's method stretches what is across by `sqrt(1 + (lambda dt)^2)` a tick, and
//! the matrix of a small angle (5.13) stretches the axis by `sqrt(1 + (s dt)^2)`. The printed
//! term lost its J (5.15 and 8.1), and with it its unit: its rate is `lambda / J3`, some 10,000 times too fast where
//! J3 is 1e-4 kg m^2. There the angular velocity squares itself from tick to tick and is no number after some ten: the end of
//! the simulation that ch. 8.2.6 tells of. With the J put back (5.8) nothing runs away at the speed of hands, yet
//! neither form keeps the angular momentum of a body without symmetry.

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

use super::{Limits, limited};
use crate::body::Body;

/// Forms of the gyroscopic term in the thesis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Gyroscopic {
    /// In normal use (eq. 5.9).
    LeftOut,
    /// Eq. 5.8: `J^-1 (omega x J omega)`.
    Corrected,
    /// As eq. 5.15 and 8.1 print it: `(J^-1 omega) x omega`.
    Printed,
}

/// A tick of turning under a torque (N m).
pub(super) fn turn(body: &mut Body, torque_W: &Vector3<f64>, term: Gyroscopic, limits: &Limits, dt_s: f64) {
    if body.rotation_locked {
        return;
    }
    let omega_old_W = body.angular_velocity_W();
    //= melder#5.9
    let pressed_W = body.inverse_inertia_W() * torque_W;
    let accelerates_W = match term {
        Gyroscopic::LeftOut => pressed_W,
        //= melder#5.8
        Gyroscopic::Corrected => {
            pressed_W - body.inverse_inertia_W() * omega_old_W.cross(&(body.inertia_W() * omega_old_W))
        }
        //= melder#5.15
        //= melder#8.1
        Gyroscopic::Printed => pressed_W - (body.inverse_inertia_W() * omega_old_W).cross(&omega_old_W),
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
