//! The smooth surfaces that solids are made of: planes, and quadrics and rings in any pose and scale.
//!
//! Problem: the edges of a box and the edges between two boxes are the same thing to a finger. Leaves are therefore
//! taken apart into surfaces without edges (Melder ch. 9.3: "cubes and prisms as planes"), each a half-space bent or
//! not, and every edge is one between two of them.
//!
//! Model: a patch has a level, negative inside, whose slope never exceeds one. A patch whose level is farther from zero
//! than a path is long is not crossed by that path. All levels but the ring's are convex: a path enters such a patch
//! once and leaves it once, and Newton's method from either end finds where without passing it (see `convex.rs`). Of
//! scaled patches the path is taken into the unscaled frame, where it is straight, too.
//!
//! Frames and signs: object frame B, L that of the unscaled and unturned patch; normals leave the patch.
//! Cost: a few products, a square root or two.

use nalgebra::{Matrix3, Vector3};

use crate::convex::{around_y, direction_or};
use crate::surface::SMALLEST_LENGTH_M;

/// A smooth surface with an inside.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Patch {
    /// Inside is `normal . x <= offset`.
    Plane {
        normal_B: Vector3<f64>,
        offset_m: f64,
    },
    Curved(Curved),
}

/// A curved surface: its equation in L, and the way from B to there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Curved {
    pub(crate) kind: Kind,
    /// `p_L = turn * p_B + shift`; it may scale, too.
    pub(crate) turn_LB: Matrix3<f64>,
    pub(crate) shift_L: Vector3<f64>,
    /// How much the map stretches at the most: levels of B are those of L divided by it.
    pub(crate) stretch: f64,
}

/// A curved surface in its own frame.
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

/// What a patch shows of a point.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Look {
    /// Distance to first order, exact in sign and zero (m).
    pub(crate) height_m: f64,
    /// Unit normal.
    pub(crate) normal_B: Vector3<f64>,
}

/// Where a path crosses a patch, in shares of the path, in order.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Crossings {
    shares: [f64; MAX_CROSSINGS],
    count: usize,
}

/// A line meets a ring four times at the most.
const MAX_CROSSINGS: usize = 4;

impl Patch {
    pub(crate) fn is_plane(&self) -> bool {
        matches!(self, Self::Plane { .. })
    }

    /// Negative inside, zero on the surface; no steeper than one.
    #[inline(always)]
    pub(crate) fn level(&self, point_B: &Vector3<f64>) -> f64 {
        match self {
            Self::Plane { normal_B, offset_m } => normal_B.dot(point_B) - offset_m,
            Self::Curved(curved) => curved.level(point_B),
        }
    }

    /// Height and normal at a point. Where many normals are as good, that towards `seen_from_B` is taken.
    #[inline(always)]
    pub(crate) fn look(&self, point_B: &Vector3<f64>, seen_from_B: &Vector3<f64>) -> Look {
        match self {
            Self::Plane { normal_B, offset_m } => {
                Look { height_m: normal_B.dot(point_B) - offset_m, normal_B: *normal_B }
            }
            Self::Curved(curved) => curved.look(point_B, seen_from_B),
        }
    }

    /// Curvature along a unit tangent (1/m), positive where the surface bends to its inside; not finite where it has none.
    #[inline(always)]
    pub(crate) fn bend_per_m(&self, at_B: &Vector3<f64>, along_B: &Vector3<f64>) -> f64 {
        match self {
            Self::Plane { .. } => 0.0,
            Self::Curved(curved) => curved.bend_per_m(at_B, along_B),
        }
    }

    /// The smallest radius that the surface is bent with, seen from outside, at a point (m); infinite where it is flat.
    pub(crate) fn smallest_radius_m(&self, at_B: &Vector3<f64>) -> f64 {
        match self {
            Self::Plane { .. } => f64::INFINITY,
            Self::Curved(curved) => curved.smallest_radius_m(at_B),
        }
    }

    /// All crossings of a path; `is_inside` tells its ends, which decide about a first and last one.
    pub(crate) fn crossings(
        &self,
        from_B: &Vector3<f64>,
        to_B: &Vector3<f64>,
        is_inside: [bool; 2],
    ) -> Crossings {
        let mut crossings = Crossings::default();
        match self {
            Self::Plane { .. } => {
                if is_inside[0] != is_inside[1] {
                    let [before, after] = [self.level(from_B).abs(), self.level(to_B).abs()];
                    let share = before / (before + after);
                    crossings.push(if share.is_nan() { 0.0 } else { share });
                }
            }
            Self::Curved(curved) => curved.cross(from_B, to_B, is_inside, &mut crossings),
        }
        crossings
    }
}

impl Crossings {
    fn push(&mut self, share: f64) {
        if let Some(place) = self.shares.get_mut(self.count) {
            *place = share.clamp(0.0, 1.0);
            self.count += 1;
        }
    }

    pub(crate) fn shares(&self) -> &[f64] {
        &self.shares[..self.count]
    }
}

impl Curved {
    fn local(&self, point_B: &Vector3<f64>) -> Vector3<f64> {
        self.turn_LB * point_B + self.shift_L
    }

    #[inline(always)]
    fn level(&self, point_B: &Vector3<f64>) -> f64 {
        self.kind.level(&self.local(point_B)) / self.stretch
    }

    #[inline(always)]
    fn look(&self, point_B: &Vector3<f64>, seen_from_B: &Vector3<f64>) -> Look {
        let (height, gradient_L) = self.kind.look(&self.local(point_B), || self.local(seen_from_B));
        let gradient_B = self.turn_LB.tr_mul(&gradient_L);
        let slope = gradient_B.norm();
        Look { height_m: height / slope, normal_B: gradient_B / slope }
    }

    #[inline(always)]
    fn bend_per_m(&self, at_B: &Vector3<f64>, along_B: &Vector3<f64>) -> f64 {
        let (point_L, along_L) = (self.local(at_B), self.turn_LB * along_B);
        let (_, gradient_L) = self.kind.look(&point_L, Vector3::y);
        self.kind.second(&point_L, &gradient_L, &along_L) / self.turn_LB.tr_mul(&gradient_L).norm()
    }

    fn smallest_radius_m(&self, at_B: &Vector3<f64>) -> f64 {
        // A map that stretches makes sharper at most by its square, over its least stretch; here that of the rigid or
        // evenly scaled patch, and of others a lower bound.
        self.kind.smallest_radius(&self.local(at_B)) * self.least_stretch() / (self.stretch * self.stretch)
    }

    fn least_stretch(&self) -> f64 {
        // The columns of a map that scales first and turns then, or the other way round, are at least as long.
        let columns = self.turn_LB.column_iter().map(|column| column.norm());
        let rows = self.turn_LB.row_iter().map(|row| row.norm());
        columns.fold(f64::INFINITY, f64::min).min(rows.fold(f64::INFINITY, f64::min))
    }

    fn cross(
        &self,
        from_B: &Vector3<f64>,
        to_B: &Vector3<f64>,
        is_inside: [bool; 2],
        crossings: &mut Crossings,
    ) {
        let (from_L, to_L) = (self.local(from_B), self.local(to_B));
        if matches!(self.kind, Kind::Ring { .. }) {
            self.kind.march(&from_L, &to_L, is_inside, crossings);
            return;
        }
        let [starts_inside, ends_inside] = is_inside;
        let entry = match is_inside {
            [false, true] => Some(self.kind.entry(&from_L, &to_L).unwrap_or(1.0)),
            [false, false] => self.kind.entry(&from_L, &to_L),
            _ => None,
        };
        // Leaving is entering on the way back.
        let exit = (!ends_inside && (starts_inside || entry.is_some()))
            .then(|| 1.0 - self.kind.entry(&to_L, &from_L).unwrap_or(1.0));
        if let (false, Some(entry), Some(exit)) = (starts_inside, entry, exit)
            && exit <= entry
        {
            return;
        }
        entry.into_iter().chain(exit).for_each(|share| crossings.push(share));
    }
}

impl Kind {
    #[inline(always)]
    fn level(&self, p: &Vector3<f64>) -> f64 {
        match *self {
            Self::Ball { radius_m } => p.norm() - radius_m,
            Self::Tube { radius_m } => rho(p) - radius_m,
            Self::Nappe { normal_rho, normal_y, offset_m } => normal_rho * rho(p) + normal_y * p.y - offset_m,
            Self::Ring { ring_radius_m, tube_radius_m } => {
                let across = rho(p) - ring_radius_m;
                (across * across + p.y * p.y).sqrt() - tube_radius_m
            }
            Self::Pill { radius_m, half_length_m } => (p - core(p, half_length_m)).norm() - radius_m,
        }
    }

    /// Level and its gradient, which is of unit length.
    #[inline(always)]
    fn look(&self, p: &Vector3<f64>, seen_from: impl Fn() -> Vector3<f64>) -> (f64, Vector3<f64>) {
        // Where a point is so near to the axis or the centre that it has no direction.
        let aside = || around_y(&seen_from()).1;
        match *self {
            Self::Ball { radius_m } => {
                let (out, distance_m) = direction(p, || direction_or(&seen_from(), Vector3::y()));
                (distance_m - radius_m, out)
            }
            Self::Tube { radius_m } => {
                let (out, rho) = direction(&across(p), aside);
                (rho - radius_m, out)
            }
            Self::Nappe { normal_rho, normal_y, offset_m } => {
                let (out, rho) = direction(&across(p), aside);
                (normal_rho * rho + normal_y * p.y - offset_m, out * normal_rho + Vector3::y() * normal_y)
            }
            Self::Ring { ring_radius_m, tube_radius_m } => {
                let (out, _) = direction(&across(p), aside);
                let (out, distance_m) = direction(&(p - out * ring_radius_m), Vector3::y);
                (distance_m - tube_radius_m, out)
            }
            Self::Pill { radius_m, half_length_m } => {
                let sideways = || direction(&across(p), aside).0;
                let (out, distance_m) = direction(&(p - core(p, half_length_m)), sideways);
                (distance_m - radius_m, out)
            }
        }
    }

    /// The level's second derivative along `v`, where its gradient is `n`.
    #[inline(always)]
    fn second(&self, p: &Vector3<f64>, n: &Vector3<f64>, v: &Vector3<f64>) -> f64 {
        let rho = rho(p);
        let around = (v.x * p.z - v.z * p.x) / rho;
        let across_n = |v2: f64| v2 - v.dot(n) * v.dot(n);
        match *self {
            Self::Ball { .. } => across_n(v.norm_squared()) / p.norm(),
            Self::Tube { .. } => around * around / rho,
            Self::Nappe { normal_rho, .. } => normal_rho * around * around / rho,
            Self::Ring { ring_radius_m, .. } => {
                let beside = rho - ring_radius_m;
                let distance = (beside * beside + p.y * p.y).sqrt();
                let within = across_n(v.norm_squared() - around * around) / distance;
                within + beside / (distance * rho) * around * around
            }
            Self::Pill { half_length_m, .. } if p.y.abs() <= half_length_m => around * around / rho,
            Self::Pill { half_length_m, .. } => {
                across_n(v.norm_squared()) / (p - core(p, half_length_m)).norm()
            }
        }
    }

    fn smallest_radius(&self, p: &Vector3<f64>) -> f64 {
        match *self {
            Self::Ball { radius_m } | Self::Tube { radius_m } | Self::Pill { radius_m, .. } => radius_m,
            Self::Nappe { normal_rho, .. } => rho(p) / normal_rho,
            Self::Ring { ring_radius_m, tube_radius_m } => tube_radius_m.min(ring_radius_m + tube_radius_m),
        }
    }

    /// The share of the path at which it enters the convex patch, which it begins outside of or on.
    fn entry(&self, from: &Vector3<f64>, to: &Vector3<f64>) -> Option<f64> {
        let path = to - from;
        let resolution_m = 2.0 * f64::EPSILON * from.amax().max(to.amax());
        let mut share = 0.0;
        for _ in 0..MAX_ENTRY_ROUNDS {
            let point = from + path * share;
            let (height_m, gradient) = self.look(&point, || point);
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

    /// Goes along the path by no more than the level allows, and by no less than a small part of it: what is missed is
    /// thinner than nobody can feel, and left on the side where it was met.
    fn march(&self, from: &Vector3<f64>, to: &Vector3<f64>, is_inside: [bool; 2], crossings: &mut Crossings) {
        let path = to - from;
        let length_m = path.norm();
        if length_m < SMALLEST_LENGTH_M {
            if is_inside[0] != is_inside[1] {
                crossings.push(0.0);
            }
            return;
        }
        let at = |share: f64| self.level(&(from + path * share));
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

#[inline(always)]
fn rho(p: &Vector3<f64>) -> f64 {
    (p.x * p.x + p.z * p.z).sqrt()
}

#[inline(always)]
fn across(p: &Vector3<f64>) -> Vector3<f64> {
    Vector3::new(p.x, 0.0, p.z)
}

/// `v` at unit length, or another direction where it has none, and how long it is.
#[inline(always)]
fn direction(v: &Vector3<f64>, otherwise: impl FnOnce() -> Vector3<f64>) -> (Vector3<f64>, f64) {
    let length = v.norm();
    let has_one = length > SMALLEST_LENGTH_M && length.is_finite();
    (if has_one { v / length } else { otherwise() }, length)
}

fn core(p: &Vector3<f64>, half_length_m: f64) -> Vector3<f64> {
    Vector3::y() * p.y.clamp(-half_length_m, half_length_m)
}

/// Bound on the search for a crossing; paths that touch in one point halve their distance each round.
const MAX_ENTRY_ROUNDS: u32 = 64;
/// The smallest step over a path past a ring.
const MARCH: f64 = 1.0 / 64.0;
