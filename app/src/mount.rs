//! Where a device's base stands in the world, X_WD, and what that makes of points, velocities and forces.
//!
//! Model: `p_W = A p_D + t`, hence `v_W = A v_D`. Forces go the other way by the transpose, `f_D = A^T f_W`: only then
//! the power that the device delivers is the power that the world asked for, `f_D . v_D = f_W . A v_D`. For a
//! rotation the transpose is the inverse. For an affine placement any other map (such as `A^-1`) would make an
//! elastic wall of the world give or take energy in each round trip at the user's hand, by as much as A stretches.
//!
//! Invariant: a device whose base is the world's origin passes every number through bit for bit, so that a
//! scripted run records exactly what its hand file says.

#![allow(non_snake_case)] // Frames are capital letters: X_WD takes D to W.

use nalgebra::{Isometry3, Matrix3, Point3, Quaternion, UnitQuaternion, Vector3};
use world::Placement;

/// The placement of a device's base.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mount(Form);

#[derive(Debug, Clone, Copy, PartialEq)]
enum Form {
    /// Skipped rather than multiplied by.
    Identity,
    Rigid(Isometry3<f64>),
    Affine {
        matrix: Matrix3<f64>,
        /// A^-T, once for all ticks.
        inverse_transposed: Matrix3<f64>,
        position_m: Vector3<f64>,
        /// The rotation that is nearest to A, for orientations.
        rotation: UnitQuaternion<f64>,
    },
}

impl Mount {
    /// A base at this pose.
    pub fn new(X_WD: Isometry3<f64>) -> Self {
        Self(if X_WD == Isometry3::identity() { Form::Identity } else { Form::Rigid(X_WD) })
    }

    /// A base placed so.
    pub fn placed(X_WD: &Placement) -> Self {
        match X_WD {
            Placement::Rigid(pose) => Self::new(*pose),
            Placement::Affine(_) => Self(Form::Affine {
                rotation: X_WD.nearest_pose().rotation,
                matrix: X_WD.matrix(),
                inverse_transposed: X_WD.inverse().matrix().transpose(),
                position_m: X_WD.position_m(),
            }),
        }
    }

    /// A point of the base frame in the world (m).
    pub fn point_to_world(&self, p_D: [f64; 3]) -> Vector3<f64> {
        let p_D = Vector3::from(p_D);
        match self.0 {
            Form::Identity => p_D,
            Form::Rigid(pose) => (pose * Point3::from(p_D)).coords,
            Form::Affine { matrix, position_m, .. } => matrix * p_D + position_m,
        }
    }

    /// A velocity of the base frame in the world (m/s).
    pub fn velocity_to_world(&self, v_D: [f64; 3]) -> Vector3<f64> {
        let v_D = Vector3::from(v_D);
        match self.0 {
            Form::Identity => v_D,
            Form::Rigid(pose) => pose.rotation * v_D,
            Form::Affine { matrix, .. } => matrix * v_D,
        }
    }

    /// A force of the base frame in the world (N).
    pub fn force_to_world(&self, f_D: [f64; 3]) -> Vector3<f64> {
        let f_D = Vector3::from(f_D);
        match self.0 {
            Form::Identity => f_D,
            Form::Rigid(pose) => pose.rotation * f_D,
            Form::Affine { inverse_transposed, .. } => inverse_transposed * f_D,
        }
    }

    /// An orientation told in the base frame, in the world; w x y z.
    pub fn orientation_to_world(&self, q_D: [f64; 4]) -> [f64; 4] {
        let rotation = match self.0 {
            Form::Identity => return q_D,
            Form::Rigid(pose) => pose.rotation,
            Form::Affine { rotation, .. } => rotation,
        };
        let [w, x, y, z] = q_D;
        let q_W = rotation.into_inner() * Quaternion::new(w, x, y, z);
        [q_W.w, q_W.i, q_W.j, q_W.k]
    }

    /// A force of the world in the base frame (N).
    pub fn force_to_device(&self, f_W: Vector3<f64>) -> [f64; 3] {
        match self.0 {
            Form::Identity => f_W,
            Form::Rigid(pose) => pose.rotation.inverse() * f_W,
            Form::Affine { matrix, .. } => matrix.transpose() * f_W,
        }
        .into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Translation3, UnitQuaternion};

    #[test]
    fn a_base_at_the_origin_changes_no_bit() {
        let mount = Mount::placed(&Placement::identity());
        for p in [[0.1, -0.0, 1e-300], [0.3, 0.2, 0.7]] {
            let same = Vector3::from(p).map(f64::to_bits);
            assert_eq!(mount.point_to_world(p).map(f64::to_bits), same);
            assert_eq!(mount.velocity_to_world(p).map(f64::to_bits), same);
            assert_eq!(mount.force_to_world(p).map(f64::to_bits), same);
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

    fn sheared() -> (Placement, Mount) {
        let matrix = Matrix3::new(1.1, 0.2, 0.0, -0.1, 0.9, 0.05, 0.3, 0.0, 1.2);
        let placed = Placement::affine(matrix, Vector3::new(0.1, 0.2, 0.3)).expect("a mild one");
        (placed, Mount::placed(&placed))
    }

    #[test]
    fn an_affine_base_delivers_the_power_that_the_world_asked_for() {
        let (_, mount) = sheared();
        let (f_W, v_D) = (Vector3::new(1.0, -2.0, 0.5), [0.3, 0.1, -0.2]);
        let at_device = Vector3::from(mount.force_to_device(f_W)).dot(&Vector3::from(v_D));
        let in_world = f_W.dot(&mount.velocity_to_world(v_D));
        // Nine products of numbers near 1, summed in another order.
        assert!((at_device - in_world).abs() < 1e-14, "{at_device} {in_world}");
    }

    #[test]
    fn a_round_trip_in_an_elastic_field_of_the_world_does_no_work_on_the_user() {
        // The field f_W = -k p_W has a potential; a closed way of the tip in D must return all energy. Summed with the
        // force at the middle of each step the work of a field linear in place is exact: no integration error.
        let (_, mount) = sheared();
        let corners = [[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.1, 0.1, 0.05], [0.0, 0.1, 0.1], [0.0, 0.0, 0.0]];
        let work: f64 = corners
            .windows(2)
            .map(|way| {
                let (from, to) = (Vector3::from(way[0]), Vector3::from(way[1]));
                let middle = mount.point_to_world(((from + to) / 2.0).into());
                Vector3::from(mount.force_to_device(-1000.0 * middle)).dot(&(to - from))
            })
            .sum();
        // Terms of up to 50 J, rounded to 1e-16 each.
        assert!(work.abs() < 1e-13, "{work} J");
    }

    #[test]
    fn an_affine_base_moves_points_as_its_placement_does_and_forces_come_back() {
        let (placed, mount) = sheared();
        let p = [0.01, -0.02, 0.03];
        assert_eq!(mount.point_to_world(p), placed.apply(&p.into()));
        let back = mount.force_to_world(mount.force_to_device(Vector3::new(1.0, 2.0, 3.0)));
        assert!((back - Vector3::new(1.0, 2.0, 3.0)).norm() < 1e-14);
    }
}
