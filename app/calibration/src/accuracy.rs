//! How far the transform found may be from the truth, by the noise that the residuals show and the geometry.
//!
//! Model: each pair's gap has independent noise of standard deviation sigma per coordinate, estimated from the
//! residuals with the degrees of freedom that the fit used up. To first order a rigid fit's rotation about
//! direction a of the spread has the variance `sigma^2 / (s_b^2 + s_c^2)`, its translation at the middle of the
//! points `sigma^2 / n`, independent of each other; elsewhere the lever arm adds. An affine fit's column along
//! direction k has `sigma^2 / s_k^2` in each row. Sigma itself is an estimate, so an error divided by its standard
//! error follows Student's distribution with the degrees of freedom that are left, `3 n` less what the fit chose: with
//! three pairs, 3 of them, 95 of 100 errors lie within 3.18 standard errors, not within 1.96.
//! Limits: what repeats is not averaged out (play of the tool, wrong link lengths, bending under force), and
//! neighbouring samples share it. Such errors show as residuals that depend on the place; the standard error then
//! is a lower bound.
//! References: Abramowitz and Stegun, Handbook of Mathematical Functions, 26.7.5 (quantiles of Student's distribution).

use nalgebra::{Matrix3, Vector3};

use crate::fit::Model;
use crate::spread::Spread;
use crate::transform::Transform;

/// Standard errors of a transform; [`Accuracy::factor_95`] makes intervals of them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Accuracy {
    /// Noise of a pair per coordinate (m).
    pub noise_m: f64,
    /// Degrees of freedom of that estimate: coordinates measured less numbers fitted.
    pub freedom: usize,
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
        Some(Self { noise_m, freedom, middle_m, position_m, rotation_rad, stretch })
    }

    /// So many standard errors are exceeded by 5 of 100 calibrations.
    pub fn factor_95(&self) -> f64 {
        student_quantile_975(self.freedom as f64)
    }

    /// Standard error of the estimate of the noise, as a share of it (1).
    pub fn noise_uncertainty(&self) -> f64 {
        1.0 / (2.0 * self.freedom as f64).sqrt()
    }
}

/// Two-sided 95 % quantile of Student's distribution (Abramowitz and Stegun 26.7.5): exact to 0.1 % from three degrees
/// of freedom on, the fewest that a fit with any left has.
fn student_quantile_975(freedom: f64) -> f64 {
    let z = Z_975;
    let terms = [
        (z.powi(3) + z) / 4.0,
        (5.0 * z.powi(5) + 16.0 * z.powi(3) + 3.0 * z) / 96.0,
        (3.0 * z.powi(7) + 19.0 * z.powi(5) + 17.0 * z.powi(3) - 15.0 * z) / 384.0,
        (79.0 * z.powi(9) + 776.0 * z.powi(7) + 1482.0 * z.powi(5) - 1920.0 * z.powi(3) - 945.0 * z)
            / 92_160.0,
    ];
    // Horner's scheme in 1 / freedom.
    z + terms.iter().rev().fold(0.0, |sum, term| (sum + term) / freedom)
}

/// The same of the normal distribution.
const Z_975: f64 = 1.959_964;

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

#[cfg(test)]
mod tests {
    use super::*;

    /// Against the tables of Fisher and Yates, which have three decimals.
    #[test]
    fn quantiles_are_those_of_the_tables() {
        for (freedom, quantile) in [
            (3.0, 3.182),
            (6.0, 2.447),
            (9.0, 2.262),
            (12.0, 2.179),
            (30.0, 2.042),
            (120.0, 1.980),
            (1e9, 1.960),
        ] {
            let found = student_quantile_975(freedom);
            assert!((found / quantile - 1.0).abs() < 1.2e-3, "{freedom}: {found}, table {quantile}");
        }
    }
}
