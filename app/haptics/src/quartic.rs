//! The first root of a quartic in the unit interval, by isolation instead of formulas.
//!
//! Model: between two neighbouring roots of its derivative a polynomial is monotone, so that a change of sign there
//! holds exactly one root, which bisection finds. The roots of the derivative are found in the same way from those of
//! the second one, a quadratic. Closed formulas for quartics are shorter and lose the roots of grazing paths.
//!
//! Cost: at most seven bisections of [`HALVINGS`] steps.

/// Coefficients, lowest power first.
type Polynomial = [f64; 5];

/// Where a quartic that is positive at 0 first becomes zero or negative within `0..=1`.
pub(crate) fn first_fall_below_zero(quartic: &Polynomial) -> Option<f64> {
    let cubic = derivative(quartic);
    let turns = roots_between(&cubic, &quadratic_roots(&derivative(&cubic)));
    let mut low = 0.0;
    for high in turns.into_iter().flatten().chain([1.0]) {
        if value(quartic, high) <= 0.0 {
            return Some(bisect(quartic, low, high));
        }
        low = high;
    }
    None
}

fn value(p: &Polynomial, x: f64) -> f64 {
    p.iter().rev().fold(0.0, |sum, coefficient| sum * x + coefficient)
}

fn derivative(p: &Polynomial) -> Polynomial {
    [p[1], 2.0 * p[2], 3.0 * p[3], 4.0 * p[4], 0.0]
}

/// Roots of a quadratic within `0..1` in ascending order, absent ones as 0.
fn quadratic_roots(p: &Polynomial) -> [f64; 2] {
    let (c, half_b, a) = (p[0], 0.5 * p[1], p[2]);
    let discriminant = half_b * half_b - a * c;
    if discriminant.is_nan() || discriminant <= 0.0 {
        return [0.0; 2];
    }
    let q = -(half_b + discriminant.sqrt().copysign(half_b));
    let (one, other) = (inner(q / a), inner(c / q));
    [one.min(other), one.max(other)]
}

/// `x`, or 0 where it does not lie within `0..1`.
fn inner(x: f64) -> f64 {
    if x > 0.0 && x < 1.0 { x } else { 0.0 }
}

/// Roots within `0..1` of a polynomial that is monotone between the given points, in ascending order.
fn roots_between(p: &Polynomial, turns: &[f64; 2]) -> [Option<f64>; 3] {
    let ends = [0.0, turns[0], turns[1], 1.0];
    std::array::from_fn(|i| {
        let (low, high) = (ends[i], ends[i + 1]);
        let changes_sign = (value(p, low) > 0.0) != (value(p, high) > 0.0);
        (low < high && changes_sign).then(|| bisect(p, low, high))
    })
}

/// The right end of the last interval, for the sign that `high` has.
fn bisect(p: &Polynomial, mut low: f64, mut high: f64) -> f64 {
    let is_positive = value(p, high) > 0.0;
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if (value(p, middle) > 0.0) == is_positive { high = middle } else { low = middle }
    }
    high
}

/// Halvings after which an interval of length 1 has no inner numbers left, near 1.
const HALVINGS: u32 = 53;

#[cfg(test)]
mod tests {
    use super::*;

    /// `product (x - root)`, times `scale`.
    fn with_roots(roots: [f64; 4], scale: f64) -> Polynomial {
        let mut p = [scale, 0.0, 0.0, 0.0, 0.0];
        for root in roots {
            for i in (0..5).rev() {
                p[i] = if i > 0 { p[i - 1] } else { 0.0 } - root * p[i];
            }
        }
        p
    }

    #[test]
    fn the_smallest_root_within_the_interval_is_found() {
        for (roots, expected) in [
            ([0.25, 0.5, 0.75, 1.5], Some(0.25)),
            ([0.25, 0.5, 0.75, 0.875], Some(0.25)),
            ([-1.0, 0.5, 0.75, -2.0], Some(0.5)),
            ([-1.0, 0.5, 1.75, -2.0], Some(0.5)),
            ([1.25, 1.5, 1.75, 1.875], None),
            ([-1.0, -0.5, 0.125, 0.1875], Some(0.125)),
        ] {
            let p = with_roots(roots, 3.0);
            assert!(p[0] > 0.0);
            let found = first_fall_below_zero(&p);
            assert_eq!(found.is_some(), expected.is_some(), "{roots:?}");
            // Coefficients below 10 rounded to 2e-15, against slopes of 0.01 and more at these roots.
            if let (Some(found), Some(expected)) = (found, expected) {
                assert!((found - expected).abs() < 1e-12, "{roots:?}: {found}");
            }
        }
    }

    #[test]
    fn two_roots_a_millionth_apart_are_not_missed() {
        let found = first_fall_below_zero(&with_roots([0.3, 0.3 + 1e-6, -1.0, 2.0], -1.0)).unwrap();
        // The polynomial is 1e-13 deep there, a thousand times its rounding.
        assert!((found - 0.3).abs() < 1e-7, "{found}");
    }

    #[test]
    fn what_is_no_quartic_is_answered_too() {
        assert_eq!(first_fall_below_zero(&[1.0, -2.0, 0.0, 0.0, 0.0]), Some(0.5));
        assert_eq!(first_fall_below_zero(&[1.0, 0.0, 0.0, 0.0, 0.0]), None);
        assert_eq!(first_fall_below_zero(&[f64::NAN; 5]), None);
    }
}
