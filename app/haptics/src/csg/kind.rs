//! The equations of curved surfaces about their axis.
//!
//! Model: each has a level, negative inside, whose gradient is of unit length: the distance, but for the tip of a cone. All but the
//! ring's are convex. Points are seen from the surface's origin; which way its axis points may be said in any frame.
//!
//! Cost: a square root and a division or two.

use nalgebra::Vector3;

use super::crossings::Crossings;
use crate::convex::direction_or;
use crate::surface::SMALLEST_LENGTH_M;

/// A curved surface around the y axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Kind {
    Ball {
        radius_m: f64,
    },
    /// The side of a cylinder without end around y.
    Tube {
        radius_m: f64,
    },
    /// The side of a cone without end around y: `normal_rho * rho + normal_y * y <= offset`.
    Nappe {
        normal_rho: f64,
        normal_y: f64,
        offset_m: f64,
    },
    Ring {
        ring_radius_m: f64,
        tube_radius_m: f64,
    },
    /// All within a radius of a piece of the y axis.
    Pill {
        radius_m: f64,
        half_length_m: f64,
    },
}

/// Where the y axis of a surface points, and a direction across it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Axes {
    pub(super) y: Vector3<f64>,
    pub(super) x: Vector3<f64>,
}

impl Axes {
    /// Its own.
    pub(super) const UPRIGHT: Self = Self { y: Vector3::new(0.0, 1.0, 0.0), x: Vector3::new(1.0, 0.0, 0.0) };

    /// The part across the axis.
    #[inline(always)]
    fn across(&self, p: &Vector3<f64>) -> Vector3<f64> {
        p - self.y * self.y.dot(p)
    }

    /// From the nearest point of a piece of the axis.
    #[inline(always)]
    fn beyond(&self, p: &Vector3<f64>, half_length_m: f64) -> Vector3<f64> {
        p - self.y * self.y.dot(p).clamp(-half_length_m, half_length_m)
    }
}

impl Kind {
    #[inline(always)]
    pub(super) fn level(&self, p: &Vector3<f64>, axes: &Axes) -> f64 {
        match *self {
            Self::Ball { radius_m } => p.norm() - radius_m,
            Self::Tube { radius_m } => axes.across(p).norm() - radius_m,
            Self::Nappe { normal_rho, normal_y, offset_m } => {
                normal_rho * axes.across(p).norm() + normal_y * axes.y.dot(p) - offset_m
            }
            Self::Ring { ring_radius_m, tube_radius_m } => {
                let (beside, y) = (axes.across(p).norm() - ring_radius_m, axes.y.dot(p));
                (beside * beside + y * y).sqrt() - tube_radius_m
            }
            Self::Pill { radius_m, half_length_m } => axes.beyond(p, half_length_m).norm() - radius_m,
        }
    }

    /// Level and its gradient, which is of unit length. Where many are as good, that towards `seen_from` is taken.
    #[inline(always)]
    pub(super) fn look(
        &self,
        p: &Vector3<f64>,
        axes: &Axes,
        seen_from: impl Fn() -> Vector3<f64>,
    ) -> (f64, Vector3<f64>) {
        // Of a point on the axis.
        let aside = || direction_or(&axes.across(&seen_from()), axes.x);
        match *self {
            Self::Ball { radius_m } => {
                let (out, distance_m) = direction(p, || direction_or(&seen_from(), axes.y));
                (distance_m - radius_m, out)
            }
            Self::Tube { radius_m } => {
                let (out, rho) = direction(&axes.across(p), aside);
                (rho - radius_m, out)
            }
            Self::Nappe { normal_rho, normal_y, offset_m } => {
                let (out, rho) = direction(&axes.across(p), aside);
                let level = normal_rho * rho + normal_y * axes.y.dot(p) - offset_m;
                (level, out * normal_rho + axes.y * normal_y)
            }
            Self::Ring { ring_radius_m, tube_radius_m } => {
                let (out, _) = direction(&axes.across(p), aside);
                let (out, distance_m) = direction(&(p - out * ring_radius_m), || axes.y);
                (distance_m - tube_radius_m, out)
            }
            Self::Pill { radius_m, half_length_m } => {
                let sideways = || direction(&axes.across(p), aside).0;
                let (out, distance_m) = direction(&axes.beyond(p, half_length_m), sideways);
                (distance_m - radius_m, out)
            }
        }
    }

    /// `u' H v` with the level's second derivatives H at a point.
    #[inline(always)]
    pub(super) fn bending(&self, p: &Vector3<f64>, axes: &Axes, u: &Vector3<f64>, v: &Vector3<f64>) -> f64 {
        let round = |p: &Vector3<f64>| {
            let distance2 = p.norm_squared();
            (u.dot(v) - p.dot(u) * p.dot(v) / distance2) / distance2.sqrt()
        };
        let rho = axes.across(p).norm();
        let around = || {
            let across = axes.y.cross(p);
            across.dot(u) * across.dot(v) / (rho * rho)
        };
        match *self {
            Self::Ball { .. } => round(p),
            Self::Tube { .. } => around() / rho,
            Self::Nappe { normal_rho, .. } => around() * normal_rho / rho,
            Self::Ring { ring_radius_m, .. } => {
                let from_core = p - axes.across(p) * (ring_radius_m / rho);
                let distance2 = from_core.norm_squared();
                let around = around();
                let rest = u.dot(v) - around - from_core.dot(u) * from_core.dot(v) / distance2;
                (rest + around * (rho - ring_radius_m) / rho) / distance2.sqrt()
            }
            Self::Pill { half_length_m, .. } if axes.y.dot(p).abs() <= half_length_m => around() / rho,
            Self::Pill { half_length_m, .. } => round(&axes.beyond(p, half_length_m)),
        }
    }

    pub(super) fn smallest_radius(&self, p: &Vector3<f64>, axes: &Axes) -> f64 {
        match *self {
            Self::Ball { radius_m } | Self::Tube { radius_m } | Self::Pill { radius_m, .. } => radius_m,
            Self::Nappe { normal_rho, .. } => axes.across(p).norm() / normal_rho,
            Self::Ring { ring_radius_m, tube_radius_m } => tube_radius_m.min(ring_radius_m + tube_radius_m),
        }
    }

    /// The share of the path at which it enters the convex patch, which it begins outside of or on.
    pub(super) fn entry(&self, axes: &Axes, from: &Vector3<f64>, to: &Vector3<f64>) -> Option<f64> {
        let path = to - from;
        let resolution_m = 2.0 * f64::EPSILON * from.amax().max(to.amax());
        let mut share = self.entry_guess(axes, from, &path);
        for _ in 0..MAX_ENTRY_ROUNDS {
            let point = from + path * share;
            let (height_m, gradient) = self.look(&point, axes, || point);
            let descent = -gradient.dot(&path);
            if descent.is_nan() || descent <= 0.0 {
                return None;
            }
            if height_m <= resolution_m {
                return Some(share);
            }
            share += height_m / descent;
            if share > 1.0 {
                return None;
            }
        }
        Some(share)
    }

    /// Where round patches are entered: what rounding leaves of it is up to the search. Zero if that cannot be told.
    fn entry_guess(&self, axes: &Axes, from: &Vector3<f64>, path: &Vector3<f64>) -> f64 {
        let (from, path, radius_m) = match *self {
            Self::Ball { radius_m } => (*from, *path, radius_m),
            Self::Tube { radius_m } => (axes.across(from), axes.across(path), radius_m),
            _ => return 0.0,
        };
        let (approach, outside) = (-from.dot(&path), from.norm_squared() - radius_m * radius_m);
        let share = outside / (approach + (approach * approach - path.norm_squared() * outside).sqrt());
        // Also what is not a number.
        if approach > 0.0 && outside > 0.0 && share <= 1.0 { share } else { 0.0 }
    }

    /// Goes along the path by no more than the level allows, and by no less than a small part of it: what is missed is
    /// thinner than nobody can feel, and left on the side where it was met.
    pub(super) fn march(
        &self,
        axes: &Axes,
        from: &Vector3<f64>,
        to: &Vector3<f64>,
        is_inside: [bool; 2],
        crossings: &mut Crossings,
    ) {
        let path = to - from;
        let length_m = path.norm();
        if length_m < SMALLEST_LENGTH_M {
            if is_inside[0] != is_inside[1] {
                crossings.push(0.0);
            }
            return;
        }
        let at = |share: f64| self.level(&(from + path * share), axes);
        let (mut share, mut height_m, mut was_inside) = (0.0, at(0.0), is_inside[0]);
        while share < 1.0 {
            let next = (share + (height_m.abs() / length_m).max(MARCH)).min(1.0);
            let next_m = at(next);
            let inside = if next == 1.0 { is_inside[1] } else { next_m <= 0.0 };
            if inside != was_inside {
                crossings.push(root(&at, [share, next], [height_m, next_m]));
            }
            (share, height_m, was_inside) = (next, next_m, inside);
        }
    }
}

/// Where a function changes its sign between two shares: the false position, kept from creeping (Illinois).
fn root(at: &impl Fn(f64) -> f64, mut shares: [f64; 2], mut heights: [f64; 2]) -> f64 {
    if heights[0] * heights[1] >= 0.0 {
        // Rounding at an end of the path.
        return if heights[0].abs() < heights[1].abs() { shares[0] } else { shares[1] };
    }
    let mut share = shares[1];
    for _ in 0..MAX_ENTRY_ROUNDS {
        share = (shares[0] * heights[1] - shares[1] * heights[0]) / (heights[1] - heights[0]);
        let height = at(share);
        if height == 0.0 || (shares[1] - shares[0]).abs() <= f64::EPSILON {
            break;
        }
        if height * heights[1] < 0.0 {
            (shares[0], heights[0]) = (shares[1], heights[1]);
        } else {
            heights[0] *= 0.5;
        }
        (shares[1], heights[1]) = (share, height);
    }
    share
}

/// `v` at unit length, or another direction where it has none, and how long it is.
#[inline(always)]
fn direction(v: &Vector3<f64>, otherwise: impl FnOnce() -> Vector3<f64>) -> (Vector3<f64>, f64) {
    let length = v.norm();
    let has_one = length > SMALLEST_LENGTH_M && length.is_finite();
    (if has_one { v / length } else { otherwise() }, length)
}

/// Bound on the search for a crossing; paths that touch in one point halve their distance each round.
const MAX_ENTRY_ROUNDS: u32 = 64;
/// The smallest step over a path past a ring.
pub(super) const MARCH: f64 = 1.0 / 64.0;
