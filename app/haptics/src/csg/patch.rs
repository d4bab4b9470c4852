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

use super::kind::{Axes, Kind};

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

/// A curved surface: its equation, and the way from B to its frame L.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Curved {
    kind: Kind,
    /// `p_L = turn * p_B + shift`; it may scale, too.
    turn_LB: Matrix3<f64>,
    shift_L: Vector3<f64>,
    /// How much the map stretches at the most: levels of B are those of L divided by it.
    stretch: f64,
    /// If the map only turns and shifts, the equation serves in B.
    place: Option<Place>,
}

/// A surface's origin and axes in B.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Place {
    centre_B: Vector3<f64>,
    axes: Axes,
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

    /// Whether heights are distances, everywhere: it is not scaled.
    #[inline(always)]
    pub(crate) fn is_distance(&self) -> bool {
        match self {
            Self::Plane { .. } => true,
            Self::Curved(curved) => curved.place.is_some(),
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

    /// How much the surface is bent in a direction along it, at a point of it: the normal turns by as much per length
    /// (1/m). Positive where it is convex; not finite where it has no normal.
    #[inline(always)]
    pub(crate) fn bending(&self, at_B: &Vector3<f64>, along_B: &Vector3<f64>) -> f64 {
        self.mixed_bending(at_B, along_B, along_B)
    }

    /// As [`Self::bending`], of two directions: how much the normal turns towards one on the way along the other (1/m).
    #[inline(always)]
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
    pub(super) fn push(&mut self, share: f64) {
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
    /// `stretch` is the largest length that the turn gives a vector of length one.
    pub(super) fn new(kind: Kind, turn_LB: Matrix3<f64>, shift_L: Vector3<f64>, stretch: f64) -> Self {
        let is_rigid = (turn_LB.tr_mul(&turn_LB) - Matrix3::identity()).amax() < RIGID;
        let axis = |row: usize| turn_LB.row(row).transpose();
        let place = is_rigid
            .then(|| Place { centre_B: -turn_LB.tr_mul(&shift_L), axes: Axes { y: axis(1), x: axis(0) } });
        Self { kind, turn_LB, shift_L, stretch, place }
    }

    /// A point as seen from the surface's origin, along B if that will do.
    #[inline(always)]
    fn seen(&self, point_B: &Vector3<f64>) -> Vector3<f64> {
        match &self.place {
            Some(place) => point_B - place.centre_B,
            None => self.local(point_B),
        }
    }

    fn local(&self, point_B: &Vector3<f64>) -> Vector3<f64> {
        self.turn_LB * point_B + self.shift_L
    }

    #[inline(always)]
    fn axes(&self) -> &Axes {
        self.place.as_ref().map_or(&Axes::UPRIGHT, |place| &place.axes)
    }

    #[inline(always)]
    fn level(&self, point_B: &Vector3<f64>) -> f64 {
        match &self.place {
            Some(place) => self.kind.level(&(point_B - place.centre_B), &place.axes),
            None => self.kind.level(&self.seen(point_B), &Axes::UPRIGHT) / self.stretch,
        }
    }

    #[inline(always)]
    fn look(&self, point_B: &Vector3<f64>, seen_from_B: &Vector3<f64>) -> Look {
        if let Some(Place { centre_B, axes }) = &self.place {
            let (height_m, normal_B) = self.kind.look(&(point_B - centre_B), axes, || seen_from_B - centre_B);
            return Look { height_m, normal_B };
        }
        let (height, gradient_B) = self.mapped(point_B, seen_from_B);
        let slope = gradient_B.norm();
        Look { height_m: height / slope, normal_B: gradient_B / slope }
    }

    /// Level in L, and its gradient along B.
    #[inline(never)]
    fn mapped(&self, point_B: &Vector3<f64>, seen_from_B: &Vector3<f64>) -> (f64, Vector3<f64>) {
        let seen_from = || self.seen(seen_from_B);
        let (height, gradient_L) = self.kind.look(&self.seen(point_B), &Axes::UPRIGHT, seen_from);
        (height, self.turn_LB.tr_mul(&gradient_L))
    }

    #[inline(always)]
    fn bending(&self, at_B: &Vector3<f64>, along_B: &Vector3<f64>, towards_B: &Vector3<f64>) -> f64 {
        if let Some(Place { centre_B, axes }) = &self.place {
            return self.kind.bending(&(at_B - centre_B), axes, along_B, towards_B);
        }
        let at_L = self.local(at_B);
        let (along_L, towards_L) = (self.turn_LB * along_B, self.turn_LB * towards_B);
        let (_, gradient_B) = self.mapped(at_B, at_B);
        self.kind.bending(&at_L, &Axes::UPRIGHT, &along_L, &towards_L) / gradient_B.norm()
    }

    fn smallest_radius_m(&self, at_B: &Vector3<f64>) -> f64 {
        // A map that stretches makes sharper at most by its square, over its least stretch; here that of the rigid or
        // evenly scaled patch, and of others a lower bound.
        self.kind.smallest_radius(&self.seen(at_B), self.axes()) * self.least_stretch()
            / (self.stretch * self.stretch)
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
        let (from_L, to_L, axes) = (self.seen(from_B), self.seen(to_B), self.axes());
        if matches!(self.kind, Kind::Ring { .. }) {
            self.kind.march(axes, &from_L, &to_L, is_inside, crossings);
            return;
        }
        let [starts_inside, ends_inside] = is_inside;
        let entry = match is_inside {
            [false, true] => Some(self.kind.entry(axes, &from_L, &to_L).unwrap_or(1.0)),
            [false, false] => self.kind.entry(axes, &from_L, &to_L),
            _ => None,
        };
        // Leaving is entering on the way back.
        let exit = (!ends_inside && (starts_inside || entry.is_some()))
            .then(|| 1.0 - self.kind.entry(axes, &to_L, &from_L).unwrap_or(1.0));
        if let (false, Some(entry), Some(exit)) = (starts_inside, entry, exit)
            && exit <= entry
        {
            return;
        }
        entry.into_iter().chain(exit).for_each(|share| crossings.push(share));
    }
}

/// A map that changes lengths by less is a turn.
pub(super) const RIGID: f64 = 1e-14;
