//! How far the transform found may be from the truth, by the noise that the residuals show and the geometry.
//!
//! Model: each pair's gap has independent noise of standard deviation sigma per coordinate, estimated from the
//! residuals with the degrees of freedom that the fit used up. To first order a rigid fit's rotation about
//! direction a of the spread has the variance `sigma^2 / (s_b^2 + s_c^2)`, its translation at the middle of the
//! points `sigma^2 / n`, independent of each other; elsewhere the lever arm adds. An affine fit's column along
//! direction k has `sigma^2 / s_k^2` in each row.
//! Limits: what repeats is not averaged out (play of the tool, wrong link lengths, bending under force), and
//! neighbouring samples share it. Such errors show as residuals that depend on the place; the standard error then
//! is a lower bound.

use nalgebra::{Matrix3, Vector3};

use crate::fit::Model;
use crate::spread::Spread;
use crate::transform::Transform;

/// Standard errors of a transform: two times as much is exceeded in 5 of 100 calibrations.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Accuracy {
    /// Noise of a pair per coordinate (m).
    pub noise_m: f64,
    /// Of a mapped point in the middle of the pairs, per axis (m).
    pub middle_m: f64,
    /// Of the position t, where N's origin is, along F's axes (m).
    pub position_m: [f64; 3],
    /// Of the rotation about each direction of the spread (rad).
    pub rotation_rad: [f64; 3],
    /// Of the stretch along each direction of the spread (1); `None` for a rigid fit, which has none.
    pub stretch: Option<[f64; 3]>,
}

impl Accuracy {
    /// Of a fit to `count` pairs with this sum of squared distances; `None` if every pair was needed for the fit.
    pub(crate) fn of(
        model: Model,
        transform: &Transform,
        spread_N: &Spread,
        square_sum: f64,
        count: usize,
    ) -> Option<Self> {
        let freedom = (3 * count).checked_sub(model.parameters()).filter(|freedom| *freedom > 0)?;
        let noise_m = (square_sum / freedom as f64).sqrt();
        let s = spread_N.singular_values_m;
        let others = |f: fn(f64, f64) -> f64| [f(s[1], s[2]), f(s[2], s[0]), f(s[0], s[1])];
        let rotation_rad = match model {
            Model::Rigid => others(|b, c| 1.0 / b.hypot(c)).map(|error| noise_m * error),
            // The turning part of two independent columns.
            Model::Affine => others(|b, c| 0.5 * (1.0 / b).hypot(1.0 / c)).map(|error| noise_m * error),
        };
        let stretch = (model == Model::Affine).then(|| s.map(|s| noise_m / s));
        let middle_m = noise_m / (count as f64).sqrt();
        let lever_m = match model {
            Model::Rigid => rigid_lever(transform, spread_N, rotation_rad),
            Model::Affine => affine_lever(spread_N, noise_m),
        };
        let position_m = lever_m.map(|lever| middle_m.hypot(lever)).into();
        Some(Self { noise_m, middle_m, position_m, rotation_rad, stretch })
    }
}

/// Turning about the middle of the points moves the origin sideways.
fn rigid_lever(transform: &Transform, spread_N: &Spread, rotation_rad: [f64; 3]) -> Vector3<f64> {
    let arm_F = transform.matrix * spread_N.centre;
    let directions_F = transform.matrix * spread_N.directions;
    let moved = Matrix3::from_fn(|i, k| directions_F.column(k).cross(&arm_F)[i] * rotation_rad[k]);
    Vector3::from_fn(|i, _| moved.row(i).norm())
}

fn affine_lever(spread_N: &Spread, noise_m: f64) -> Vector3<f64> {
    let along = spread_N.directions.transpose() * spread_N.centre;
    let lever = Vector3::from_fn(|k, _| noise_m * along[k] / spread_N.singular_values_m[k]).norm();
    Vector3::repeat(lever)
}
