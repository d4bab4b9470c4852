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

    /// Whether one of its points is nearest to a point inside of it and all others lead there downhill: it is not scaled
    /// by different factors.
    pub(crate) fn is_round(&self) -> bool {
        match self {
            Self::Plane { .. } => true,
            Self::Curved(curved) => {
                let scale_m = curved.turn_LB.column(0).norm_squared();
                let skew = curved.turn_LB.tr_mul(&curved.turn_LB) - Matrix3::identity() * scale_m;
                skew.amax() <= SKEW * scale_m
            }
        }
    }

    /// Whether it meets another patch in one circle or line, of which one point is nearest wherever one starts: planes and
    /// balls each other, planes what they cut straight across.
    pub(crate) fn meets_in_one_circle(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Plane { .. }, Self::Plane { .. }) => true,
            (Self::Plane { normal_B, .. }, Self::Curved(curved))
            | (Self::Curved(curved), Self::Plane { normal_B, .. }) => {
                other.is_round() && self.is_round() && curved.is_cut_in_one_circle(normal_B)
            }
            (Self::Curved(a), Self::Curved(b)) => {
                let is_ball = |curved: &Curved| matches!(curved.kind, Kind::Ball { .. });
                self.is_round() && other.is_round() && is_ball(a) && is_ball(b)
            }
        }
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

    /// The smallest radius that the surface is bent with, seen from outside, at a point (m); infinite where it is flat.
    pub(crate) fn smallest_radius_m(&self, at_B: &Vector3<f64>) -> f64 {
        match self {
            Self::Plane { .. } => f64::INFINITY,
            Self::Curved(curved) => curved.smallest_radius_m(at_B),
        }
    }

    /// How much the surface is bent in a direction along it, at a point of it: the normal turns by as much per length
    /// (1/m). Positive where it is convex.
    pub(crate) fn bending(&self, at_B: &Vector3<f64>, along_B: &Vector3<f64>) -> f64 {
        self.mixed_bending(at_B, along_B, along_B)
    }

    /// As [`Self::bending`], of two directions: how much the normal turns towards one on the way along the other (1/m).
    pub(crate) fn mixed_bending(
        &self,
        at_B: &Vector3<f64>,
        along_B: &Vector3<f64>,
        towards_B: &Vector3<f64>,
    ) -> f64 {
        match self {
            Self::Plane { .. } => 0.0,
            Self::Curved(curved) => curved.bending(at_B, along_B, towards_B),
        }
    }

    /// The tip of a cone, if the way between two points leads across its axis.
    pub(crate) fn tip_between(&self, from_B: &Vector3<f64>, to_B: &Vector3<f64>) -> Option<Vector3<f64>> {
        match self {
            Self::Curved(curved) if matches!(curved.kind, Kind::Nappe { .. }) => {
                curved.tip_between(from_B, to_B)
            }
            _ => None,
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
        let point_L = self.local(point_B);
        let height = self.kind.level(&point_L);
        let gradient_L = self.kind.gradient(&point_L, &self.local(seen_from_B));
        let gradient_B = self.turn_LB.tr_mul(&gradient_L);
        let slope = gradient_B.norm();
        Look { height_m: height / slope, normal_B: gradient_B / slope }
    }

    fn smallest_radius_m(&self, at_B: &Vector3<f64>) -> f64 {
        // A map that stretches makes sharper at most by its square, over its least stretch; here that of the rigid or
        // evenly scaled patch, and of others a lower bound.
        self.kind.smallest_radius(&self.local(at_B)) * self.least_stretch() / (self.stretch * self.stretch)
    }

    fn bending(&self, at_B: &Vector3<f64>, along_B: &Vector3<f64>, towards_B: &Vector3<f64>) -> f64 {
        let at_L = self.local(at_B);
        let (along_L, towards_L) = (self.turn_LB * along_B, self.turn_LB * towards_B);
        let slope = self.turn_LB.tr_mul(&self.kind.gradient(&at_L, &at_L)).norm();
        self.kind.bending(&at_L, &along_L, &towards_L) / slope
    }

    fn is_cut_in_one_circle(&self, normal_B: &Vector3<f64>) -> bool {
        match self.kind {
            Kind::Ball { .. } => true,
            Kind::Ring { .. } => false,
            Kind::Tube { .. } | Kind::Nappe { .. } | Kind::Pill { .. } => {
                let normal_L = self.turn_LB * normal_B;
                normal_L.x.hypot(normal_L.z) <= SKEW * normal_L.norm()
            }
        }
    }

    fn tip_between(&self, from_B: &Vector3<f64>, to_B: &Vector3<f64>) -> Option<Vector3<f64>> {
        let Kind::Nappe { normal_y, offset_m, .. } = self.kind else { return None };
        let (from_L, to_L) = (self.local(from_B), self.local(to_B));
        if from_L.x * to_L.x + from_L.z * to_L.z > 0.0 {
            return None;
        }
        let tip_L = Vector3::y() * (offset_m / normal_y) - self.shift_L;
        self.turn_LB.try_inverse().map(|turn_BL| turn_BL * tip_L)
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

    /// Of unit length.
    #[inline(always)]
    fn gradient(&self, p: &Vector3<f64>, seen_from: &Vector3<f64>) -> Vector3<f64> {
        match *self {
            Self::Ball { .. } => direction_or(p, direction_or(seen_from, Vector3::y())),
            Self::Tube { .. } => outward(p, seen_from),
            Self::Nappe { normal_rho, normal_y, .. } => {
                outward(p, seen_from) * normal_rho + Vector3::y() * normal_y
            }
            Self::Ring { ring_radius_m, .. } => {
                direction_or(&(p - outward(p, seen_from) * ring_radius_m), Vector3::y())
            }
            Self::Pill { half_length_m, .. } => {
                direction_or(&(p - core(p, half_length_m)), outward(p, seen_from))
            }
        }
    }

    /// `u' H v` with the level's second derivatives H at a point.
    fn bending(&self, p: &Vector3<f64>, u: &Vector3<f64>, v: &Vector3<f64>) -> f64 {
        let round = |p: &Vector3<f64>| {
            let distance = p.norm();
            (u.dot(v) - p.dot(u) * p.dot(v) / (distance * distance)) / distance
        };
        let around = || {
            let across = Vector3::new(p.z, 0.0, -p.x);
            let rho = rho(p);
            across.dot(u) * across.dot(v) / (rho * rho)
        };
        match *self {
            Self::Ball { .. } => round(p),
            Self::Tube { .. } => around() / rho(p),
            Self::Nappe { normal_rho, .. } => around() * normal_rho / rho(p),
            Self::Ring { ring_radius_m, .. } => {
                let from_core = p - outward(p, p) * ring_radius_m;
                let distance = from_core.norm();
                let across = (rho(p) - ring_radius_m) / distance;
                let around = around();
                let rest = u.dot(v) - around - from_core.dot(u) * from_core.dot(v) / (distance * distance);
                rest / distance + around * across / rho(p)
            }
            Self::Pill { half_length_m, .. } => {
                if p.y.abs() > half_length_m {
                    round(&(p - core(p, half_length_m)))
                } else {
                    around() / rho(p)
                }
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
            let height_m = self.level(&point);
            let descent = -self.gradient(&point, &point).dot(&path);
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

fn outward(p: &Vector3<f64>, seen_from: &Vector3<f64>) -> Vector3<f64> {
    let across = Vector3::new(p.x, 0.0, p.z);
    direction_or(&across, around_y(seen_from).1)
}

fn core(p: &Vector3<f64>, half_length_m: f64) -> Vector3<f64> {
    Vector3::y() * p.y.clamp(-half_length_m, half_length_m)
}

/// Bound on the search for a crossing; paths that touch in one point halve their distance each round.
const MAX_ENTRY_ROUNDS: u32 = 64;
/// The smallest step over a path past a ring.
const MARCH: f64 = 1.0 / 64.0;
/// Of maps: what rounding may make different of equal factors.
const SKEW: f64 = 1e-9;
