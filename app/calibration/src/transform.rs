//! Takes points of the other device's base to the fiducial's.

use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};

/// `p_F = A p_N + t`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Transform {
    /// A; a rotation if the fit was rigid.
    pub matrix: Matrix3<f64>,
    /// t, where N's origin is in F (m).
    pub position: Vector3<f64>,
}

/// What an affine transform does beside turning and moving.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shape {
    /// How long a metre along N's x, y, z becomes (1).
    pub scale: [f64; 3],
    /// How far the right angles between N's x and y, y and z, z and x close (rad).
    pub shear_rad: [f64; 3],
    /// Volume of what was a unit cube (1).
    pub volume: f64,
}

impl Transform {
    /// A point of N in F (m).
    pub fn apply(&self, p_N: &Vector3<f64>) -> Vector3<f64> {
        self.matrix * p_N + self.position
    }

    /// The rotation nearest to A, in the sense of least squares, and t: all there is of a rigid fit.
    pub fn rigid(&self) -> Isometry3<f64> {
        let rotation = Rotation3::from_matrix_unchecked(nearest_rotation(&self.matrix));
        Isometry3::from_parts(
            Translation3::from(self.position),
            UnitQuaternion::from_rotation_matrix(&rotation),
        )
    }

    /// Scale and shear; all ones and zeros, up to rounding, if the fit was rigid.
    pub fn shape(&self) -> Shape {
        let columns = [0, 1, 2].map(|axis| self.matrix.column(axis).into_owned());
        let closed_by = |a: usize, b: usize| {
            let sine = columns[a].dot(&columns[b]) / (columns[a].norm() * columns[b].norm());
            sine.clamp(-1.0, 1.0).asin()
        };
        Shape {
            scale: columns.map(|column| column.norm()),
            shear_rad: [closed_by(0, 1), closed_by(1, 2), closed_by(2, 0)],
            volume: self.matrix.determinant(),
        }
    }
}

/// The rotation R with the largest trace of R^T M; never a reflection.
pub(crate) fn nearest_rotation(matrix: &Matrix3<f64>) -> Matrix3<f64> {
    let (u, v_t) = singular_bases(matrix);
    // The direction that the matrix knows least about is the one to turn round (Umeyama eq. 43).
    let handedness = (u * v_t).determinant().signum();
    u * Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, handedness)) * v_t
}

/// U and V^T of the singular value decomposition, largest singular value first.
pub(crate) fn singular_bases(matrix: &Matrix3<f64>) -> (Matrix3<f64>, Matrix3<f64>) {
    let svd = matrix.svd(true, true);
    match (svd.u, svd.v_t) {
        (Some(u), Some(v_t)) => (u, v_t),
        // Both were asked for.
        _ => (Matrix3::identity(), Matrix3::identity()),
    }
}
