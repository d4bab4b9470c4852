//! Fits one device's base to another's, from points that both measured.
//!
//! Problem: several discrete devices share one world only if each knows where its base stands. Two end points
//! held together and moved about give pairs of positions; the transform between the bases is whatever maps one
//! half of the pairs onto the other (Melder 5.2).
//!
//! Model: `p_F = A p_N + t`, fiducial F and other device N. [`Model::Rigid`] makes `A` a rotation (Kabsch,
//! Umeyama), which is what two well-made arms differ by. [`Model::Affine`] is the thesis' unconstrained least
//! squares: it also absorbs scale and shear of a device whose link lengths are not known well.
//! Frames: F the fiducial's base, N the other's. SI.
//! Invariants: a rigid transform has determinant +1; nothing returned holds a number that is not finite; data that
//! do not determine the transform are refused, not regularised.
//! Cost: linear in the pairs, some ten fits; allocates. Not for a loop.
//!
//! ```
//! use calibration::{Model, Pair, calibrate};
//! use nalgebra::Vector3;
//!
//! // The other device stands 0.3 m to the right of the fiducial.
//! let corners = [[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.0, 0.0, 0.1]].map(Vector3::from);
//! let pairs: Vec<Pair> = corners
//!     .iter()
//!     .enumerate()
//!     .map(|(i, p)| Pair { line: i + 1, fiducial: *p, other: p - Vector3::new(0.3, 0.0, 0.0) })
//!     .collect();
//! let calibration = calibrate(&pairs, Model::Rigid)?;
//! assert!((calibration.all.transform.position.x - 0.3).abs() < 1e-12);
//! # Ok::<(), calibration::CalibrationError>(())
//! ```
//!
//! References: N. Melder, *Multi-Finger Manipulation Physics for Haptic Rendering*, 5.2; S. Umeyama, Least-squares
//! estimation of transformation parameters between two point patterns, IEEE PAMI 13(4), 1991; P. J. Rousseeuw,
//! K. Van Driessen, Computing LTS regression for large data sets, Data Min. Knowl. Disc. 12, 2006.
#![allow(non_snake_case)] // Frames are capital letters: p_F is a point in F.
#![forbid(unsafe_code)]
#![deny(missing_docs)]

mod accuracy;
mod affine;
mod error;
mod fit;
mod gathering;
mod outliers;
mod pairs;
mod residuals;
mod rigid;
mod spread;
mod transform;
mod unit;

pub use accuracy::Accuracy;
pub use error::{CalibrationError, PairsError};
pub use fit::{Calibration, Fit, Model, calibrate};
pub use gathering::{Coverage, Gathering};
pub use outliers::{Outlier, Outliers};
pub use pairs::{MAX_EXTENT_M, MAX_PAIRS, MIN_EXTENT_M, Pair, parse_pairs};
pub use residuals::Residuals;
pub use spread::Spread;
pub use transform::{Shape, Transform};
pub use unit::Unit;
