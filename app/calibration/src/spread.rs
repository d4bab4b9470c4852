//! How far a cloud of points reaches, and in which directions: what decides how well a transform is determined.
//!
//! Model: singular value decomposition of the centred cloud itself. (The Gram matrix would square the ratio of its
//! extents and lose half of the digits.)

use nalgebra::{DMatrix, Matrix3, Vector3};

/// Extent of a cloud of points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spread {
    /// Middle of the points (m).
    pub centre: Vector3<f64>,
    /// Singular values of the centred cloud (m), largest first.
    pub singular_values_m: [f64; 3],
    /// RMS extent along each direction (m): singular value over the square root of the number of points.
    pub rms_m: [f64; 3],
    /// The directions, unit vectors in columns, in the same order.
    pub directions: Matrix3<f64>,
}

impl Spread {
    /// Of these points; needs three at least for three directions.
    pub(crate) fn of(points: &[Vector3<f64>]) -> Self {
        let count = points.len().max(1) as f64;
        let centre = points.iter().sum::<Vector3<f64>>() / count;
        // At least three rows, or there would be fewer than three singular values.
        let rows = points.len().max(3);
        let cloud = DMatrix::from_fn(rows, 3, |i, j| points.get(i).map_or(0.0, |p| p[j] - centre[j]));
        // The small factor of QR has the cloud's own singular values and directions. Of dynamic size, since the fixed
        // one takes the way through the Gram matrix.
        let svd = cloud.qr().r().svd(false, true);
        let rows: Option<DMatrix<f64>> = svd.v_t;
        let directions = rows.map_or_else(Matrix3::identity, |v_t| Matrix3::from_fn(|i, k| v_t[(k, i)]));
        let singular_values_m = [0, 1, 2].map(|k| svd.singular_values[k]);
        let rms_m = singular_values_m.map(|value| value / count.sqrt());
        Self { centre, singular_values_m, rms_m, directions }
    }

    /// Largest over smallest singular value; infinite for points in a plane.
    pub fn condition(&self) -> f64 {
        let [largest, _, smallest] = self.singular_values_m;
        largest / smallest
    }
}
