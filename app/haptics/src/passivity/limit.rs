//! The nearest force that cannot feed more than a budget.
//!
//! Model: the way d of the next interval lies in a ball of radius r around p. The most that a force can feed is
//!
//! ```text
//! g(F) = max F . d = F . p + r |F|
//! ```
//!
//! and `{F: g(F) <= A}`, A >= 0, is convex and contains zero. The wanted force is projected onto it: the nearest force,
//! a continuous function of everything, never longer than the wanted one and never against it. With r = 0 that is the
//! textbook's damper along the velocity; at rest, with p = 0, it is a shorter force of the same direction. By Lagrange,
//! with the multiplier m >= 0 found by halving, for g falls as m grows:
//!
//! ```text
//! F' = n max(0, 1 - m r / |n|),   n = F - m p,   g(F') = A
//! ```

use nalgebra::Vector3;

/// The most that this force (N) can feed on ways of at most `surprise_m` from `way_W` (J).
pub(super) fn most_j(force_W: &Vector3<f64>, way_W: &Vector3<f64>, surprise_m: f64) -> f64 {
    force_W.dot(way_W) + surprise_m * force_W.norm()
}

/// The force nearest to this one (N) that cannot feed more than `budget_j`; itself if it cannot.
pub(super) fn nearest(
    force_W: Vector3<f64>,
    way_W: Vector3<f64>,
    surprise_m: f64,
    budget_j: f64,
) -> Vector3<f64> {
    let most = most_j(&force_W, &way_W, surprise_m);
    if most <= budget_j {
        return force_W;
    }
    if !most.is_finite() || budget_j.is_nan() || budget_j <= 0.0 && surprise_m >= way_W.norm() {
        return Vector3::zeros();
    }
    let at = |multiplier: f64| {
        let braked_W = force_W - way_W * multiplier;
        let norm = braked_W.norm();
        let share = 1.0 - multiplier * surprise_m / norm;
        if share > 0.0 { braked_W * share } else { Vector3::zeros() }
    };
    let feeds_too_much = |force_W: &Vector3<f64>| most_j(force_W, &way_W, surprise_m) > budget_j;
    let (low, high) = bracket(&|multiplier| feeds_too_much(&at(multiplier)), {
        // No force of the set is nearer than this, for g grows by at most so much for each newton.
        let slope = way_W.norm() + surprise_m;
        (most - budget_j) / (slope * slope)
    });
    let found = at(halved(low, high, &|multiplier| feeds_too_much(&at(multiplier))));
    within(found, &force_W, most_j(&found, &way_W, surprise_m), budget_j)
}

/// From a multiplier that is too small or right to one that is not too small.
fn bracket(is_too_small: &dyn Fn(f64) -> bool, at_least: f64) -> (f64, f64) {
    let (mut low, mut high) = (0.0, at_least);
    for _ in 0..MOST_ROUNDS {
        if !is_too_small(high) {
            break;
        }
        (low, high) = (high, 2.0 * high);
    }
    (low, high)
}

/// The upper end of what is left after halving: on the safe side.
fn halved(mut low: f64, mut high: f64, is_too_small: &dyn Fn(f64) -> bool) -> f64 {
    for _ in 0..MOST_ROUNDS {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            break;
        }
        *(if is_too_small(middle) { &mut low } else { &mut high }) = middle;
    }
    high
}

/// Whatever rounding did: not more than the budget, and not longer than what was wanted.
fn within(found_W: Vector3<f64>, wanted_W: &Vector3<f64>, most: f64, budget_j: f64) -> Vector3<f64> {
    if !most.is_finite() {
        return Vector3::zeros();
    }
    let by_budget = if most > budget_j { budget_j.max(0.0) / most } else { 1.0 };
    let by_length = wanted_W.norm() / found_W.norm();
    if by_length < 1.0 || by_budget < 1.0 { found_W * by_budget.min(by_length) } else { found_W }
}

/// Enough for every bit of a double.
const MOST_ROUNDS: usize = 64;

#[cfg(test)]
mod tests {
    use super::*;

    fn v(x: f64, y: f64, z: f64) -> Vector3<f64> {
        Vector3::new(x, y, z)
    }

    #[test]
    fn without_surprises_it_is_a_damper_along_the_way() {
        let way = v(0.0, 2e-3, 0.0);
        let found = nearest(v(3.0, 5.0, 0.0), way, 0.0, 4e-3);
        // 5 N over 2 mm are 10 mJ; 2 N over 2 mm are the 4 mJ that may be.
        assert!((found - v(3.0, 2.0, 0.0)).norm() < 1e-12, "{found}");
        assert_eq!(nearest(v(3.0, -5.0, 0.0), way, 0.0, 0.0), v(3.0, -5.0, 0.0), "pressing in is free");
    }

    #[test]
    fn at_rest_it_keeps_the_direction() {
        let found = nearest(v(3.0, 4.0, 0.0), Vector3::zeros(), 1e-3, 1e-3);
        assert!((found - v(0.6, 0.8, 0.0)).norm() < 1e-12, "{found}");
    }

    #[test]
    fn along_the_way_both_add_up() {
        // F (p + r) = A: 1 mJ over 0.4 mm.
        let found = nearest(v(0.0, 9.0, 0.0), v(0.0, 3e-4, 0.0), 1e-4, 1e-3);
        assert!((found - v(0.0, 2.5, 0.0)).norm() < 1e-12, "{found}");
    }

    /// Against an oracle: among forces on a fine grid of the plane of force and way none that may be is nearer.
    #[test]
    fn no_allowed_force_is_nearer() {
        let cases = [(0.3, 1.0, 0.2e-3), (1.2, 0.5, 0.5e-3), (2.5, 2.0, 0.1e-3), (1.5, 0.0, 0.3e-3)];
        for (angle, length, surprise) in cases {
            let (force, way) = (v(4.0, 0.0, 0.0), v(f64::cos(angle), f64::sin(angle), 0.0) * length * 1e-3);
            let budget = 0.3e-3;
            let found = nearest(force, way, surprise, budget);
            let most = most_j(&found, &way, surprise);
            assert!(most <= budget * (1.0 + 1e-12), "{most}");
            let distance = (found - force).norm();
            for i in -200..=200 {
                for j in -200..=200 {
                    let other = v(f64::from(i) * 0.025, f64::from(j) * 0.025, 0.0);
                    let is_allowed = most_j(&other, &way, surprise) <= budget;
                    assert!(!is_allowed || (other - force).norm() >= distance - 1e-12, "{other} {found}");
                }
            }
        }
    }

    #[test]
    fn nothing_makes_it_longer_turned_against_itself_or_not_finite() {
        let numbers = [0.0, -1.0, 1e-300, 3.0, 1e300, f64::INFINITY, f64::NAN];
        for force in numbers.map(|n| v(n, 1.0, 0.0)) {
            for way in numbers.map(|n| v(n * 1e-3, -1e-3, 1e-4)) {
                for surprise in [0.0, 1e-4, 1e300] {
                    for budget in [0.0, 1e-3, 1e300] {
                        let found = nearest(force, way, surprise, budget);
                        if !force.iter().chain(&way).all(|n| n.is_finite()) {
                            continue;
                        }
                        assert!(found.iter().all(|n| n.is_finite()), "{force} {way}: {found}");
                        // The lengths of forces near the largest number are infinite.
                        assert!(found.norm() <= force.norm() * (1.0 + 1e-15), "{force} {way}: {found}");
                        assert!(found.dot(&force) >= 0.0, "{force} {way}: {found}");
                    }
                }
            }
        }
    }
}
