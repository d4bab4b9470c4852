//! A curved surface in its place: the equation of its kind, seen from the solid's frame.
//!
//! Model: where the map into the surface's own frame only turns and shifts, the equation serves in B; else points are taken
//! there, and levels divided by how much the map stretches at the most.
//!
//! Frames and signs: as in [`patch`](super::patch).

use nalgebra::{Matrix3, Vector3};

use super::crossings::Crossings;
use super::kind::{Axes, Kind};
use super::patch::Look;

/// A curved surface: its equation, and the way from B to its frame L.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Curved {
    kind: Kind,
    /// `p_L = turn * p_B + shift`; it may scale, too.
    turn_LB: Matrix3<f64>,
    shift_L: Vector3<f64>,
    /// How much the map stretches at the most: levels of B are those of L divided by it.
    stretch: f64,
    /// Radii of L times this are no larger than those of B.
    least_radius: f64,
    /// If the map only turns and shifts, the equation serves in B.
    place: Option<Place>,
}

/// A surface's origin and axes in B.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Place {
    centre_B: Vector3<f64>,
    axes: Axes,
}

impl Curved {
    /// `stretch` is the largest length that the turn gives a vector of length one.
    pub(super) fn new(kind: Kind, turn_LB: Matrix3<f64>, shift_L: Vector3<f64>, stretch: f64) -> Self {
        let is_rigid = (turn_LB.tr_mul(&turn_LB) - Matrix3::identity()).amax() < RIGID;
        let axis = |row: usize| turn_LB.row(row).transpose();
        let place = is_rigid
            .then(|| Place { centre_B: -turn_LB.tr_mul(&shift_L), axes: Axes { y: axis(1), x: axis(0) } });
        // A map that stretches makes sharper at most by its square, over its least stretch; here that of the rigid or
        // evenly scaled patch, and of others a lower bound.
        let least_radius = least_stretch(&turn_LB) / (stretch * stretch);
        Self { kind, turn_LB, shift_L, stretch, least_radius, place }
    }

    pub(super) fn kind(&self) -> Kind {
        self.kind
    }

    /// Turn and shift from B to L.
    pub(super) fn map(&self) -> (Matrix3<f64>, Vector3<f64>) {
        (self.turn_LB, self.shift_L)
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

    /// As [`Patch::is_round`](super::patch::Patch::is_round).
    pub(super) fn is_round(&self) -> bool {
        let scale_m = self.turn_LB.column(0).norm_squared();
        let skew = self.turn_LB.tr_mul(&self.turn_LB) - Matrix3::identity() * scale_m;
        skew.amax() <= SKEW * scale_m
    }

    pub(super) fn is_convex(&self) -> bool {
        !matches!(self.kind, Kind::Ring { .. })
    }

    pub(super) fn is_ball(&self) -> bool {
        matches!(self.kind, Kind::Ball { .. })
    }

    /// Whether heights are distances: it is not scaled.
    #[inline(always)]
    pub(super) fn is_distance(&self) -> bool {
        self.place.is_some()
    }

    #[inline(always)]
    fn axes(&self) -> &Axes {
        self.place.as_ref().map_or(&Axes::UPRIGHT, |place| &place.axes)
    }

    #[inline(always)]
    pub(super) fn level(&self, point_B: &Vector3<f64>) -> f64 {
        match &self.place {
            Some(place) => self.kind.level(&(point_B - place.centre_B), &place.axes),
            None => self.kind.level(&self.seen(point_B), &Axes::UPRIGHT) / self.stretch,
        }
    }

    #[inline(always)]
    pub(super) fn look(&self, point_B: &Vector3<f64>, seen_from_B: &Vector3<f64>) -> Look {
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
    pub(super) fn bending(
        &self,
        at_B: &Vector3<f64>,
        along_B: &Vector3<f64>,
        towards_B: &Vector3<f64>,
    ) -> f64 {
        if let Some(Place { centre_B, axes }) = &self.place {
            return self.kind.bending(&(at_B - centre_B), axes, along_B, towards_B);
        }
        let at_L = self.local(at_B);
        let (along_L, towards_L) = (self.turn_LB * along_B, self.turn_LB * towards_B);
        let (_, gradient_B) = self.mapped(at_B, at_B);
        self.kind.bending(&at_L, &Axes::UPRIGHT, &along_L, &towards_L) / gradient_B.norm()
    }

    pub(super) fn smallest_radius_m(&self, at_B: &Vector3<f64>) -> f64 {
        self.kind.smallest_radius(&self.seen(at_B), self.axes()) * self.least_radius
    }

    pub(super) fn is_cut_in_one_circle(&self, normal_B: &Vector3<f64>) -> bool {
        match self.kind {
            Kind::Ball { .. } => true,
            Kind::Ring { .. } => false,
            Kind::Tube { .. } | Kind::Nappe { .. } | Kind::Pill { .. } => {
                let normal_L = self.turn_LB * normal_B;
                normal_L.x.hypot(normal_L.z) <= SKEW * normal_L.norm()
            }
        }
    }

    pub(super) fn tip_between(&self, from_B: &Vector3<f64>, to_B: &Vector3<f64>) -> Option<Vector3<f64>> {
        let Kind::Nappe { normal_y, offset_m, .. } = self.kind else { return None };
        if normal_y == 0.0 {
            return None;
        }
        let (from_L, to_L) = (self.local(from_B), self.local(to_B));
        if from_L.x * to_L.x + from_L.z * to_L.z > 0.0 {
            return None;
        }
        let tip_L = Vector3::y() * (offset_m / normal_y) - self.shift_L;
        self.turn_LB.try_inverse().map(|turn_BL| turn_BL * tip_L)
    }

    /// True of a point in the tip of a cone, seen from inside of it, that is the nearest of all its side to the HIP.
    pub(super) fn holds_in_tip(&self, point_B: &Vector3<f64>, hip_B: &Vector3<f64>, near_m: f64) -> bool {
        let Kind::Nappe { normal_rho, normal_y, .. } = self.kind else { return false };
        let at_L = self.local(point_B);
        if at_L.x.hypot(at_L.z) > near_m * self.stretch {
            return false;
        }
        // Along a line of the side, `n_y` out and `n_rho` down in L, the way to the HIP falls by its product with this.
        self.turn_LB.try_inverse().is_some_and(|turn_BL| {
            let pull_L = turn_BL.tr_mul(&(hip_B - point_B));
            normal_y.abs() * pull_L.x.hypot(pull_L.z) <= normal_rho * normal_y.signum() * pull_L.y
        })
    }

    pub(super) fn cross(
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

/// The least length that a map gives a vector of length one.
fn least_stretch(map: &Matrix3<f64>) -> f64 {
    // The columns of a map that scales first and turns then, or the other way round, are at least as long.
    let columns = map.column_iter().map(|column| column.norm());
    let rows = map.row_iter().map(|row| row.norm());
    columns.fold(f64::INFINITY, f64::min).min(rows.fold(f64::INFINITY, f64::min))
}

/// A map that changes lengths by less is a turn.
pub(super) const RIGID: f64 = 1e-14;

/// Of maps: what rounding may make different of equal factors.
const SKEW: f64 = 1e-9;
