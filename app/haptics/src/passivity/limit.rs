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
//! with the multiplier m >= 0 found by Newton's method from m = 0, for g falls as m grows, less and less steeply:
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
    let mut multiplier = 0.0;
    for _ in 0..MOST_ROUNDS {
        let braked = Braked::by(multiplier, &force_W, &way_W, surprise_m);
        let excess_j = braked.most_j - budget_j;
        // Also where the slope is none, or what it leads to no number.
        if !(excess_j > CLOSE * most && braked.slope < 0.0) {
            break;
        }
        multiplier -= excess_j / braked.slope;
    }
    let found = Braked::by(multiplier * (1.0 + MARGIN), &force_W, &way_W, surprise_m);
    within(found.force_W, &force_W, most_j(&found.force_W, &way_W, surprise_m), budget_j)
}

/// The largest share, 0 to 1, of this force (N) that cannot feed more than `budget_j`.
pub(super) fn share(force_W: &Vector3<f64>, way_W: &Vector3<f64>, surprise_m: f64, budget_j: f64) -> f64 {
    let most = most_j(force_W, way_W, surprise_m);
    if most <= budget_j {
        1.0
    } else if most.is_finite() && budget_j > 0.0 {
        budget_j / most
    } else {
        0.0
    }
}

/// A force (N) without this part of it: not longer than with it, and not against it.
pub(super) fn without(force_W: Vector3<f64>, part_W: Vector3<f64>) -> Vector3<f64> {
    if part_W == Vector3::zeros() {
        return force_W;
    }
    let left_W = force_W - part_W;
    if left_W.iter().all(|x| x.is_finite()) { within(left_W, &force_W, 0.0, 0.0) } else { Vector3::zeros() }
}

/// What a multiplier makes of a force.
struct Braked {
    force_W: Vector3<f64>,
    /// The most that it can feed (J), and the change of that with the multiplier.
    most_j: f64,
    slope: f64,
}

impl Braked {
    /// With c = n . p / |n|: g = (|n| - m r) (c + r), dg/dm = -(c + r)^2 - (1 - m r / |n|) (p^2 - c^2).
    #[inline]
    fn by(multiplier: f64, force_W: &Vector3<f64>, way_W: &Vector3<f64>, surprise_m: f64) -> Self {
        let braked_W = force_W - way_W * multiplier;
        let norm = braked_W.norm();
        let share = 1.0 - multiplier * surprise_m / norm;
        if share.is_nan() || share <= 0.0 {
            return Self { force_W: Vector3::zeros(), most_j: 0.0, slope: 0.0 };
        }
        let along_m = braked_W.dot(way_W) / norm;
        let both_m = along_m + surprise_m;
        let across_m2 = (way_W.norm_squared() - along_m * along_m).max(0.0);
        Self {
            force_W: braked_W * share,
            most_j: norm * share * both_m,
            slope: -both_m * both_m - share * across_m2,
        }
    }
}

/// Whatever rounding did: not more than the budget, not longer than what was wanted, and not against it.
fn within(found_W: Vector3<f64>, wanted_W: &Vector3<f64>, most: f64, budget_j: f64) -> Vector3<f64> {
    let is_against = found_W.dot(wanted_W) < 0.0;
    if is_against || !most.is_finite() {
        return Vector3::zeros();
    }
    let by_budget = if most > budget_j { budget_j.max(0.0) / most } else { 1.0 };
    let by_length = wanted_W.norm() / found_W.norm();
    if by_length < 1.0 || by_budget < 1.0 { found_W * by_budget.min(by_length) } else { found_W }
}

/// Newton's method takes about five.
const MOST_ROUNDS: usize = 32;
/// What part of its energy is a rounding.
const CLOSE: f64 = 1e-14;
/// Beyond the found multiplier by this, so that rounding is on the safe side; nobody feels it.
const MARGIN: f64 = 1e-9;

#[cfg(test)]
mod tests {
    use super::*;

    /// The margin of forces of up to 10 N (N).
    const NEAR: f64 = 10.0 * MARGIN;

    fn v(x: f64, y: f64, z: f64) -> Vector3<f64> {
        Vector3::new(x, y, z)
    }

    #[test]
    fn without_surprises_it_is_a_damper_along_the_way() {
        let way = v(0.0, 2e-3, 0.0);
        let found = nearest(v(3.0, 5.0, 0.0), way, 0.0, 4e-3);
        // 5 N over 2 mm are 10 mJ; 2 N over 2 mm are the 4 mJ that may be.
        assert!((found - v(3.0, 2.0, 0.0)).norm() < NEAR, "{found}");
        assert_eq!(nearest(v(3.0, -5.0, 0.0), way, 0.0, 0.0), v(3.0, -5.0, 0.0), "pressing in is free");
    }

    #[test]
    fn at_rest_it_keeps_the_direction() {
        let found = nearest(v(3.0, 4.0, 0.0), Vector3::zeros(), 1e-3, 1e-3);
        assert!((found - v(0.6, 0.8, 0.0)).norm() < NEAR, "{found}");
    }

    #[test]
    fn along_the_way_both_add_up() {
        // F (p + r) = A: 1 mJ over 0.4 mm.
        let found = nearest(v(0.0, 9.0, 0.0), v(0.0, 3e-4, 0.0), 1e-4, 1e-3);
        assert!((found - v(0.0, 2.5, 0.0)).norm() < NEAR, "{found}");
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
                    assert!(!is_allowed || (other - force).norm() >= distance - NEAR, "{other} {found}");
                }
            }
        }
    }

    /// What makes a point of a convex set the nearest one: all that is taken away is along the set's own normal there.
    #[test]
    fn what_is_taken_away_is_along_the_gradient_of_what_it_can_feed() {
        let mut state = 7u64;
        let mut uniform = move || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 11) as f64 / (1u64 << 53) as f64
        };
        let mut changed = 0;
        for _ in 0..20_000 {
            let mut vector = |size: f64| v(uniform() - 0.5, uniform() - 0.5, uniform() - 0.5) * size;
            let (force, way) = (vector(20.0), vector(2e-3));
            let surprise = 10f64.powf(-5.0 + 3.0 * uniform());
            let most = most_j(&force, &way, surprise);
            let budget = most * 10f64.powf(-6.0 * uniform());
            if most <= 0.0 {
                continue;
            }
            let found = nearest(force, way, surprise, budget);
            let fed = most_j(&found, &way, surprise);
            // The margin is a part of the multiplier, and the slope is bounded by what all of the force could feed.
            let scale = force.norm() * (way.norm() + surprise);
            assert!(fed <= budget * (1.0 + 1e-12) && fed >= budget - 1e-7 * scale, "{fed} {budget}");
            let (taken, normal) = (force - found, way + found.normalize() * surprise);
            let across = taken.cross(&normal).norm() / normal.norm();
            assert!(across < 1e-6 * force.norm() && taken.dot(&normal) >= 0.0, "{across} {found}");
            changed += 1;
        }
        assert!(changed > 10_000, "{changed}");
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
