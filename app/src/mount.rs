//! Where a device's base stands in the world, X_WD.
//!
//! Invariant: a device whose base is the world's origin passes every number through bit for bit, so that a
//! scripted run records exactly what its hand file says.

#![allow(non_snake_case)] // Frames are capital letters: X_WD takes D to W.

use nalgebra::{Isometry3, Point3, Quaternion, Vector3};

/// The pose of a device's base.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mount {
    /// `None` is the identity, which is skipped rather than multiplied by.
    X_WD: Option<Isometry3<f64>>,
}

impl Mount {
    /// A base at this pose.
    pub fn new(X_WD: Isometry3<f64>) -> Self {
        Self { X_WD: (X_WD != Isometry3::identity()).then_some(X_WD) }
    }

    /// A point of the base frame in the world (m).
    pub fn point_to_world(&self, p_D: [f64; 3]) -> Vector3<f64> {
        let p_D = Vector3::from(p_D);
        self.X_WD.map_or(p_D, |pose| (pose * Point3::from(p_D)).coords)
    }

    /// A velocity of a point in the base frame in the world (m/s).
    pub fn velocity_to_world(&self, v_D: [f64; 3]) -> Vector3<f64> {
        let v_D = Vector3::from(v_D);
        self.X_WD.map_or(v_D, |pose| pose.rotation * v_D)
    }

    /// A force of the base frame in the world (N).
    pub fn force_to_world(&self, f_D: [f64; 3]) -> Vector3<f64> {
        let f_D = Vector3::from(f_D);
        self.X_WD.map_or(f_D, |pose| pose.rotation * f_D)
    }

    /// An orientation told in the base frame, in the world; w x y z.
    pub fn orientation_to_world(&self, q_D: [f64; 4]) -> [f64; 4] {
        let Some(pose) = self.X_WD else { return q_D };
        let [w, x, y, z] = q_D;
        let q_W = pose.rotation.into_inner() * Quaternion::new(w, x, y, z);
        [q_W.w, q_W.i, q_W.j, q_W.k]
    }

    /// A force of the world in the base frame (N).
    pub fn force_to_device(&self, f_W: Vector3<f64>) -> [f64; 3] {
        self.X_WD.map_or(f_W, |pose| pose.rotation.inverse() * f_W).into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Translation3, UnitQuaternion};

    #[test]
    fn a_base_at_the_origin_changes_no_bit() {
        let mount = Mount::new(Isometry3::identity());
        for p in [[0.1, -0.0, 1e-300], [0.3, 0.2, 0.7]] {
            assert_eq!(mount.point_to_world(p).map(f64::to_bits), Vector3::from(p).map(f64::to_bits));
            assert_eq!(mount.velocity_to_world(p).map(f64::to_bits), Vector3::from(p).map(f64::to_bits));
            assert_eq!(mount.force_to_device(Vector3::from(p)).map(f64::to_bits), p.map(f64::to_bits));
        }
        assert_eq!(mount.orientation_to_world([0.1, 0.2, 0.3, 0.4]), [0.1, 0.2, 0.3, 0.4]);
    }

    #[test]
    fn a_turned_base_turns_an_orientation_from_the_left() {
        let turn = |axis, angle| UnitQuaternion::from_axis_angle(&axis, angle);
        let (base, gimbal) = (turn(Vector3::y_axis(), 0.7), turn(Vector3::x_axis(), -0.4));
        let mount = Mount::new(Isometry3::from_parts(Translation3::identity(), base));
        let q = gimbal.quaternion();
        let [w, x, y, z] = mount.orientation_to_world([q.w, q.i, q.j, q.k]);
        let found = UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z));
        let down = -Vector3::y();
        // Rotations of a unit vector by rounded quaternions.
        assert!((found * down - base * (gimbal * down)).norm() < 1e-15);
    }

    #[test]
    fn a_turned_base_turns_points_and_forces_and_moves_points_only() {
        // A quarter turn about y: the device's x is the world's -z.
        let turn = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), std::f64::consts::FRAC_PI_2);
        let mount = Mount::new(Isometry3::from_parts(Translation3::new(0.0, 0.5, 0.0), turn));
        // A rotation by quaternion rounds a handful of times: some ulp of the largest number, 1.
        let close = |a: Vector3<f64>, b: Vector3<f64>| (a - b).norm() < 1e-15;
        assert!(close(mount.point_to_world([1.0, 0.0, 0.0]), Vector3::new(0.0, 0.5, -1.0)));
        assert!(close(mount.velocity_to_world([1.0, 0.0, 0.0]), Vector3::new(0.0, 0.0, -1.0)));
        assert!(close(mount.force_to_world([1.0, 0.0, 0.0]), Vector3::new(0.0, 0.0, -1.0)));
        assert!(close(mount.force_to_device(Vector3::new(0.0, 0.0, -1.0)).into(), Vector3::x()));
    }
}
