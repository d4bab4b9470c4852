//! The unconstrained linear map and translation that fit best.
//!
//! Model: Melder equation 5.4 without its correction's two outer transforms, which are what the layout knows
//! already: `[A t] = P_F P_N^+` with the w column of ones. Solved by orthogonal decomposition of the centred cloud;
//! the formula's own `P_F P_N^T (P_N P_N^T)^-1` squares the condition and is kept as the tests' oracle.
//! Bias: noise of the *other* device is taken for the fiducial's, which shrinks A by about `(noise / extent)^2`:
//! a millionth for 0.1 mm in 100 mm.

use nalgebra::{DMatrix, Matrix3, Vector3};

use crate::pairs::Pair;
use crate::transform::Transform;

/// The best linear map and translation; `None` if the points of N lie in a plane to the last digit.
//= melder#5.4
pub(crate) fn fit(pairs: &[Pair]) -> Option<Transform> {
    let count = pairs.len() as f64;
    let centre_F = pairs.iter().map(|pair| pair.fiducial).sum::<Vector3<f64>>() / count;
    let centre_N = pairs.iter().map(|pair| pair.other).sum::<Vector3<f64>>() / count;
    let cloud_N = DMatrix::from_fn(pairs.len(), 3, |i, j| pairs[i].other[j] - centre_N[j]);
    let cloud_F = DMatrix::from_fn(pairs.len(), 3, |i, j| pairs[i].fiducial[j] - centre_F[j]);
    let qr = cloud_N.qr();
    let r: Matrix3<f64> = qr.r().fixed_view::<3, 3>(0, 0).into_owned();
    let projected: Matrix3<f64> = (qr.q().transpose() * cloud_F).fixed_view::<3, 3>(0, 0).into_owned();
    // Rows of points: cloud_F = cloud_N A^T.
    let matrix = r.solve_upper_triangular(&projected)?.transpose();
    Some(Transform { matrix, position: centre_F - matrix * centre_N })
}
