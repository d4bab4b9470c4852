//! Where a device's base stands, rigidly or with a linear map of its own.
//!
//! Model: `p_W = A p_D + t`. An arm whose link lengths are known well needs a rotation A and nothing else. The affine
//! calibration of Melder 5.2 also absorbs scale and shear of one whose lengths are not.
//! Invariant: A is invertible and keeps right-handed what is; [`Placement::affine`] sees to it.

#![allow(non_snake_case)] // Frames are capital letters: X_WD takes D to W.

use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};

/// The transform from one frame to another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Placement {
    /// Rotation and translation.
    Rigid(Isometry3<f64>),
    /// A linear map that is no rotation, and a translation.
    Affine(Affine),
}

/// `p_W = A p_D + t`; made by [`Placement::affine`] only.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Affine {
    matrix: Matrix3<f64>,
    position_m: Vector3<f64>,
}

impl Placement {
    /// At the origin of the other frame.
    pub fn identity() -> Self {
        Self::Rigid(Isometry3::identity())
    }

    /// With this linear map and position (m); `None` if a number is not finite, or the map mirrors or stretches by
    /// less than [`LEAST_STRETCH`] or more than [`MOST_STRETCH`] in any direction.
    pub fn affine(matrix: Matrix3<f64>, position_m: Vector3<f64>) -> Option<Self> {
        let is_finite = matrix.iter().chain(position_m.iter()).all(|number| number.is_finite());
        (is_finite && is_device_like(&matrix)).then_some(Self::Affine(Affine { matrix, position_m }))
    }

    /// Rotation and translation, if that is all.
    pub fn rigid(&self) -> Option<Isometry3<f64>> {
        match self {
            Self::Rigid(pose) => Some(*pose),
            Self::Affine(_) => None,
        }
    }

    /// The rotation nearest to A, and t.
    pub fn nearest_pose(&self) -> Isometry3<f64> {
        match self {
            Self::Rigid(pose) => *pose,
            Self::Affine(Affine { matrix, position_m }) => {
                let rotation = Rotation3::from_matrix_unchecked(polar_rotation(matrix));
                let rotation = UnitQuaternion::from_rotation_matrix(&rotation);
                Isometry3::from_parts(Translation3::from(*position_m), rotation)
            }
        }
    }

    /// A.
    pub fn matrix(&self) -> Matrix3<f64> {
        match self {
            Self::Rigid(pose) => pose.rotation.to_rotation_matrix().into_inner(),
            Self::Affine(affine) => affine.matrix,
        }
    }

    /// t, where the origin is (m).
    pub fn position_m(&self) -> Vector3<f64> {
        match self {
            Self::Rigid(pose) => pose.translation.vector,
            Self::Affine(affine) => affine.position_m,
        }
    }

    /// `X_AC = X_AB * X_BC`.
    pub fn then(&self, inner: &Self) -> Self {
        match (self, inner) {
            (Self::Rigid(outer), Self::Rigid(inner)) => Self::Rigid(outer * inner),
            _ => Self::Affine(Affine {
                matrix: self.matrix() * inner.matrix(),
                position_m: self.apply(&inner.position_m()),
            }),
        }
    }

    /// The way back.
    pub fn inverse(&self) -> Self {
        match self {
            Self::Rigid(pose) => Self::Rigid(pose.inverse()),
            Self::Affine(Affine { matrix, position_m }) => {
                // The stretches have been checked to be far from zero.
                let inverse = matrix.try_inverse().unwrap_or_else(Matrix3::identity);
                Self::Affine(Affine { matrix: inverse, position_m: -(inverse * position_m) })
            }
        }
    }

    /// A point of the inner frame in the outer (m).
    pub fn apply(&self, point: &Vector3<f64>) -> Vector3<f64> {
        match self {
            Self::Rigid(pose) => (pose * Point3::from(*point)).coords,
            Self::Affine(Affine { matrix, position_m }) => matrix * point + position_m,
        }
    }
}

/// The smallest and the largest stretch, and the volume of a unit cube.
pub(crate) fn stretches(matrix: &Matrix3<f64>) -> (f64, f64, f64) {
    // Scaled, so that no number of a file overflows on the way.
    let scale = matrix.amax();
    if scale == 0.0 {
        return (0.0, 0.0, 0.0);
    }
    let values = (matrix / scale).singular_values();
    (values.min() * scale, values.max() * scale, (matrix / scale).determinant() * scale.powi(3))
}

fn is_device_like(matrix: &Matrix3<f64>) -> bool {
    let (least, most, volume) = stretches(matrix);
    volume > 0.0 && least >= LEAST_STRETCH && most <= MOST_STRETCH
}

fn polar_rotation(matrix: &Matrix3<f64>) -> Matrix3<f64> {
    let svd = matrix.svd(true, true);
    // Both were asked for; the volume is positive, hence so is the determinant.
    svd.u.zip(svd.v_t).map_or_else(Matrix3::identity, |(u, v_t)| u * v_t)
}

/// Arms of one type differ by a few percent. A metre that becomes less than half of one is another device, another
/// unit or a misprint; forces would be stretched just as much.
pub const LEAST_STRETCH: f64 = 0.5;
/// As [`LEAST_STRETCH`], the other way. Together they keep the condition of A below 4.
pub const MOST_STRETCH: f64 = 2.0;
