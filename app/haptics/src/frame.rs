//! Changes of frame that are exact where the pose is trivial.
//!
//! Problem: most entities stand still at the origin or are only shifted. Rotating by the identity
//! costs roundings and flips the sign of zeros in general code; here the trivial parts of a pose are
//! skipped, so an identity pose returns its argument bit for bit and a shift is one subtraction.

use nalgebra::{Isometry3, UnitQuaternion, Vector3};

/// p_B of a point p_W.
#[inline]
pub(crate) fn point_into_body(X_WB: &Isometry3<f64>, p_W: &Vector3<f64>) -> Vector3<f64> {
    let shift_W = &X_WB.translation.vector;
    let from_origin_W = if *shift_W == Vector3::zeros() { *p_W } else { p_W - shift_W };
    if is_identity(&X_WB.rotation) {
        return from_origin_W;
    }
    X_WB.rotation.inverse_transform_vector(&from_origin_W)
}

/// p_W of a point p_B.
#[inline]
pub(crate) fn point_into_world(X_WB: &Isometry3<f64>, p_B: &Vector3<f64>) -> Vector3<f64> {
    let shift_W = &X_WB.translation.vector;
    let from_origin_W = vector_into_world(X_WB, p_B);
    if *shift_W == Vector3::zeros() { from_origin_W } else { from_origin_W + shift_W }
}

/// v_W of a free vector v_B.
#[inline]
pub(crate) fn vector_into_world(X_WB: &Isometry3<f64>, v_B: &Vector3<f64>) -> Vector3<f64> {
    if is_identity(&X_WB.rotation) { *v_B } else { X_WB.rotation * v_B }
}

/// v_B of a free vector v_W.
#[inline]
pub(crate) fn vector_into_body(X_WB: &Isometry3<f64>, v_W: &Vector3<f64>) -> Vector3<f64> {
    if is_identity(&X_WB.rotation) { *v_W } else { X_WB.rotation.inverse_transform_vector(v_W) }
}

#[inline]
fn is_identity(q: &UnitQuaternion<f64>) -> bool {
    q.i == 0.0 && q.j == 0.0 && q.k == 0.0
}

/// No component is infinite or not a number.
#[inline]
pub(crate) fn is_finite(v: &Vector3<f64>) -> bool {
    v.iter().all(|x| x.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bits(v: &Vector3<f64>) -> [u64; 3] {
        [v.x.to_bits(), v.y.to_bits(), v.z.to_bits()]
    }

    #[test]
    fn the_identity_pose_keeps_every_bit() {
        let X_WB = Isometry3::identity();
        for p in [Vector3::new(0.1, -0.0, 0.3), Vector3::new(-1e300, 5e-324, 1.0 / 3.0)] {
            assert_eq!(bits(&point_into_body(&X_WB, &p)), bits(&p));
            assert_eq!(bits(&point_into_world(&X_WB, &p)), bits(&p));
        }
    }

    #[test]
    fn a_shift_is_one_subtraction() {
        let X_WB = Isometry3::translation(0.1, 0.2, 0.3);
        let p_W = Vector3::new(1.0 / 3.0, 1.0 / 7.0, -0.0);
        let expected = Vector3::new(1.0 / 3.0 - 0.1, 1.0 / 7.0 - 0.2, -0.3);
        assert_eq!(bits(&point_into_body(&X_WB, &p_W)), bits(&expected));
    }

    #[test]
    fn there_and_back_is_the_same_point() {
        let X_WB = Isometry3::new(Vector3::new(0.1, 0.2, 0.3), Vector3::new(1.0, -2.0, 0.5));
        let p_W = Vector3::new(0.4, -0.5, 0.6);
        // Two rotations and two sums of numbers below one.
        assert!((point_into_world(&X_WB, &point_into_body(&X_WB, &p_W)) - p_W).norm() < 2e-15);
    }
}
