//! The rotation and translation that fit best.
//!
//! Model: Kabsch and Umeyama. Both clouds are centred; the rotation is the one nearest to their cross-covariance,
//! reflections excluded; the translation takes one centre to the other. Unlike the thesis' unconstrained fit this
//! cannot take noise for scale and shear.

use nalgebra::{Matrix3, Vector3};

use crate::pairs::Pair;
use crate::transform::{Transform, nearest_rotation, singular_bases};

/// Centres of both clouds, and `sum (p_F - c_F) (p_N - c_N)^T`.
struct Covariance {
    centre_F: Vector3<f64>,
    centre_N: Vector3<f64>,
    cross: Matrix3<f64>,
}

/// The best rotation and translation.
pub(crate) fn fit(pairs: &[Pair]) -> Transform {
    let clouds = Covariance::of(pairs);
    clouds.about_centres(nearest_rotation(&clouds.cross))
}

/// The best reflection: what a left-handed device looks like. For a diagnosis only.
pub(crate) fn fit_mirrored(pairs: &[Pair]) -> Transform {
    let clouds = Covariance::of(pairs);
    let (u, v_t) = singular_bases(&clouds.cross);
    let handedness = -(u * v_t).determinant().signum();
    clouds.about_centres(u * Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, handedness)) * v_t)
}

/// The factor by which the fiducial's cloud is larger than the other's, after turning (Umeyama eq. 42). For a
/// diagnosis: a rigid fit leaves it out.
pub(crate) fn scale(pairs: &[Pair], rotation: &Matrix3<f64>) -> f64 {
    let clouds = Covariance::of(pairs);
    let extent: f64 = pairs.iter().map(|pair| (pair.other - clouds.centre_N).norm_squared()).sum();
    (rotation.transpose() * clouds.cross).trace() / extent
}

impl Covariance {
    fn of(pairs: &[Pair]) -> Self {
        let count = pairs.len().max(1) as f64;
        let centre_F = pairs.iter().map(|pair| pair.fiducial).sum::<Vector3<f64>>() / count;
        let centre_N = pairs.iter().map(|pair| pair.other).sum::<Vector3<f64>>() / count;
        let outer = |pair: &Pair| (pair.fiducial - centre_F) * (pair.other - centre_N).transpose();
        Self { centre_F, centre_N, cross: pairs.iter().map(outer).sum() }
    }

    fn about_centres(&self, matrix: Matrix3<f64>) -> Transform {
        Transform { matrix, position: self.centre_F - matrix * self.centre_N }
    }
}
