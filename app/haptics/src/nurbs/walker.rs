//! A set of patches as a [`Surface`]: what the Friction Cone Algorithm asks, answered from where it asked last.
//!
//! Model: the temporary tangent plane of Melder ch. 4.2.2, with the descent instead of the printed ray: a ray from the HIP
//! towards the new place on the plane may miss the surface, the way down never does. [`SurfacePoint`] cannot say where
//! in which patch it lies, so the last two feet are kept here: the one that a slide stands on, and the one it tries.
//! A spherical finger rolls on the surface `layer_m` above: at creases and rims around the edge, at feet along the normal.
//!
//! Invariants: where a convex crease is crossed, the answer lies on it with the normal beyond; on a concave one, where
//! both sides hold, the normal is the one that the HIP presses against.

use nalgebra::Vector3;
use std::cell::Cell;

use super::Nurbs;
use super::descend::{Crossing, Rest};
use super::foot::Foot;
use super::seams::{Border, running};
use crate::mesh::Sides;
use crate::surface::{Feature, Surface, SurfacePoint, direction_or_up};

/// The surface in one tick of one finger.
#[derive(Debug)]
pub(crate) struct Walker<'n> {
    nurbs: &'n Nurbs,
    /// Against which a concave crease presses back.
    hip_B: Vector3<f64>,
    layer_m: f64,
    feet: [Cell<Option<Foot>>; 2],
    /// The points that were answered for them.
    answers_B: [Cell<Vector3<f64>>; 2],
    newest: Cell<usize>,
}

/// Where a finger is held, and whether it is held at all.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stand {
    pub(super) at: SurfacePoint,
    pub(super) foot: Foot,
    pub(super) is_free: bool,
    /// From the surface that the finger's centre must stay above (m); negative inside.
    pub(super) height_m: f64,
}

/// A sharp edge between two patches.
struct Crease {
    /// Of the patch here.
    edge: u8,
    /// The same place in the other patch.
    beyond: Foot,
    into_beyond: Vector3<f64>,
    is_convex: bool,
}

impl<'n> Walker<'n> {
    pub(crate) fn new(nurbs: &'n Nurbs, hip_B: Vector3<f64>, layer_m: f64) -> Self {
        let answers_B = [Cell::new(Vector3::zeros()), Cell::new(Vector3::zeros())];
        Self { nurbs, hip_B, layer_m, feet: [const { Cell::new(None) }; 2], answers_B, newest: Cell::new(0) }
    }

    pub(super) fn is_of_a_point(&self) -> bool {
        self.layer_m == 0.0
    }

    pub(super) fn layer_m(&self) -> f64 {
        self.layer_m
    }

    /// Where a point finger that has just come to the surface stands.
    pub(super) fn at_foot(&self, foot: Foot) -> Stand {
        let at = self.on(&foot);
        Stand { at, foot, is_free: false, height_m: 0.0 }
    }

    /// Makes known where a point of the surface is.
    pub(super) fn know(&self, at: &SurfacePoint, foot: &Foot) {
        let slot = 1 - self.newest.get();
        self.feet[slot].set(Some(*foot));
        self.answers_B[slot].set(at.point_B);
        self.newest.set(slot);
    }

    /// The foot of a point that was answered lately.
    pub(super) fn foot_of(&self, at: &SurfacePoint) -> Option<Foot> {
        let newest = self.newest.get();
        let known =
            [newest, 1 - newest].into_iter().find(|&slot| self.answers_B[slot].get() == at.point_B)?;
        self.feet[known].get()
    }

    /// Where somebody at `p_B` is held whose way down ended at `foot`.
    pub(super) fn stand(&self, foot: Foot, rest: Rest, p_B: &Vector3<f64>) -> Stand {
        let away_B = p_B - foot.point_B();
        let at = |normal_B: Vector3<f64>, feature| SurfacePoint {
            point_B: foot.point_B() + normal_B * self.layer_m,
            normal_B,
            feature,
            piece: self.nurbs.patches[foot.patch as usize].group,
        };
        let mean_B = match rest {
            Rest::Smooth => {
                let height_m = foot.normal_B.dot(&away_B) - self.layer_m;
                let is_free = height_m > 0.0;
                return Stand { at: at(foot.normal_B, Feature::Surface), foot, is_free, height_m };
            }
            Rest::Rim => return self.stand_on_rim(foot, &away_B, at),
            Rest::Crease(edge) => {
                foot.normal_B + self.beyond(&foot, edge).map_or(foot.normal_B, |(beyond, _)| beyond.normal_B)
            }
            Rest::Tip(pole) => self.nurbs.poles[pole as usize].normal_B * foot.side,
        };
        let feature = if matches!(rest, Rest::Tip(_)) { Feature::Vertex } else { Feature::Edge };
        let distance_m = away_B.norm();
        let sign = if away_B.dot(&mean_B) > 0.0 { 1.0 } else { -1.0 };
        let normal_B = if distance_m > 1e-12 * self.nurbs.extent_m {
            away_B * (sign / distance_m)
        } else {
            direction_or_up(&mean_B)
        };
        let height_m = sign * distance_m - self.layer_m;
        Stand { at: at(normal_B, feature), foot, is_free: height_m > 0.0, height_m }
    }

    /// Beyond its rim a sheet holds nobody but a ball that leans over it, from whichever side.
    fn stand_on_rim(
        &self,
        foot: Foot,
        away_B: &Vector3<f64>,
        at: impl Fn(Vector3<f64>, Feature) -> SurfacePoint,
    ) -> Stand {
        let distance_m = away_B.norm();
        if self.layer_m == 0.0 {
            return Stand { at: at(foot.normal_B, Feature::Edge), foot, is_free: true, height_m: distance_m };
        }
        let is_above = away_B.dot(&foot.normal_B) >= 0.0;
        let foot = if is_above { foot } else { Foot { side: -foot.side, normal_B: -foot.normal_B, ..foot } };
        let normal_B = if distance_m > 0.0 { away_B / distance_m } else { foot.normal_B };
        let height_m = distance_m - self.layer_m;
        Stand { at: at(normal_B, Feature::Edge), foot, is_free: height_m > 0.0, height_m }
    }

    /// The same place on the other side of a crease, and which edge of the patch there it is on.
    fn beyond(&self, foot: &Foot, edge: u8) -> Option<(Foot, u8)> {
        match self.nurbs.beyond(foot, usize::from(edge), &Vector3::zeros()) {
            Border::Patch { foot, edge, is_smooth: false, .. } => Some((foot, edge)),
            _ => None,
        }
    }

    fn on(&self, foot: &Foot) -> SurfacePoint {
        SurfacePoint {
            point_B: foot.point_B(),
            normal_B: foot.normal_B,
            feature: Feature::Surface,
            piece: self.nurbs.patches[foot.patch as usize].group,
        }
    }

    /// The crease along an edge of the foot's patch.
    fn crease(&self, foot: &Foot, edge: u8) -> Option<Crease> {
        let (beyond, edge_beyond) = self.beyond(foot, edge)?;
        let into_beyond = self.nurbs.inward(&beyond, edge_beyond);
        let is_convex = into_beyond.dot(&foot.normal_B) < 0.0;
        Some(Crease { edge, beyond, into_beyond, is_convex })
    }

    /// Stand of a point finger that came to a crease.
    fn on_crease(&self, foot: &Foot, crease: &Crease) -> (SurfacePoint, Foot) {
        let Crease { edge, beyond, into_beyond, is_convex } = crease;
        let off_B = self.hip_B - foot.point_B();
        if *is_convex || off_B.dot(into_beyond) > 0.0 {
            return (self.on(beyond), *beyond);
        }
        if off_B.dot(&self.nurbs.inward(foot, *edge)) > 0.0 {
            return (self.on(foot), *foot);
        }
        let along = if running(*edge) == 0 { foot.local.du } else { foot.local.dv };
        let along = direction_or_up(&along);
        let press_B = along * off_B.dot(&along) - off_B;
        let mean_B = foot.normal_B + beyond.normal_B;
        let is_far = press_B.norm() > 1e-12 * self.nurbs.extent_m;
        let normal_B = direction_or_up(if is_far { &press_B } else { &mean_B });
        (SurfacePoint { normal_B, feature: Feature::Edge, piece: ON_CREASE, ..self.on(foot) }, *foot)
    }

    /// Stand of a god-object on a concave crease, towards where the HIP is now.
    pub(super) fn turned(&self, foot: &Foot) -> Option<(SurfacePoint, Foot)> {
        (0..4)
            .filter(|&edge| foot.at[usize::from(edge > 1)] == f64::from(edge % 2))
            .filter_map(|edge| self.crease(foot, edge))
            .find(|crease| !crease.is_convex)
            .map(|crease| self.on_crease(foot, &crease))
    }

    /// The nearest of all; far away a descent from the nearest cell.
    pub(super) fn find(&self, p_B: &Vector3<f64>) -> Option<Stand> {
        self.find_within(p_B, f64::INFINITY)
    }

    pub(super) fn find_within(&self, p_B: &Vector3<f64>, at_most_m: f64) -> Option<Stand> {
        let (mut foot, rest) = self.nurbs.nearest_within(p_B, at_most_m)?;
        if self.nurbs.sides == Sides::Sheet && (p_B - foot.point_B()).dot(&foot.normal_B) < 0.0 {
            foot = Foot { side: -foot.side, normal_B: -foot.normal_B, ..foot };
        }
        Some(self.stand(foot, rest, p_B))
    }
}

impl Surface for Walker<'_> {
    fn signed_distance(&self, point_B: &Vector3<f64>) -> f64 {
        self.find(point_B).map_or(f64::NAN, |stand| stand.height_m)
    }

    fn nearest(&self, point_B: &Vector3<f64>) -> SurfacePoint {
        let nowhere = SurfacePoint {
            point_B: Vector3::zeros(),
            normal_B: Vector3::y(),
            feature: Feature::Surface,
            piece: 0,
        };
        self.find(point_B).map_or(nowhere, |stand| {
            self.know(&stand.at, &stand.foot);
            stand.at
        })
    }

    /// Of a spherical finger, where it touches at the path's end.
    fn entry(&self, from_B: &Vector3<f64>, to_B: &Vector3<f64>) -> Option<SurfacePoint> {
        let stand = self.nurbs.meet(self, from_B, to_B, None)?;
        self.know(&stand.at, &stand.foot);
        Some(stand.at)
    }

    fn settle(&self, from: &SurfacePoint, on_tangent_plane_B: &Vector3<f64>) -> SurfacePoint {
        let foot = self.foot_of(from).or_else(|| self.find(&from.point_B).map(|stand| stand.foot));
        let Some(mut foot) = foot else { return *from };
        let at = if self.layer_m > 0.0 {
            let rest = self.nurbs.descend(on_tangent_plane_B, &mut foot, Crossing::All);
            let stand = self.stand(foot, rest, on_tangent_plane_B);
            foot = stand.foot;
            stand.at
        } else {
            // What is held on a crease goes along it.
            let crossing = if from.feature == Feature::Edge { Crossing::Along } else { Crossing::Smooth };
            let rest = self.nurbs.descend(on_tangent_plane_B, &mut foot, crossing);
            let came_to = match rest {
                Rest::Crease(edge) => self.crease(&foot, edge).map(|crease| self.on_crease(&foot, &crease)),
                _ => self.turned(&foot),
            };
            let (at, there) = came_to.unwrap_or_else(|| (self.on(&foot), foot));
            foot = there;
            at
        };
        self.know(&at, &foot);
        at
    }

    /// Whether the way down from `at` ends there.
    fn holds_outside(&self, at: &SurfacePoint, depth_m: f64) -> bool {
        let Some(mut foot) = self.foot_of(at).or_else(|| self.find(&at.point_B).map(|stand| stand.foot))
        else {
            return false;
        };
        let hip_B = at.point_B - at.normal_B * depth_m;
        let rest = self.nurbs.descend(&hip_B, &mut foot, Crossing::All);
        !self.stand(foot, rest, &hip_B).is_free
    }

    fn grown(&self, radius_m: f64) -> Option<Self> {
        Some(Self::new(self.nurbs, self.hip_B, self.layer_m + radius_m))
    }
}

/// No patch is so numbered: a slide that comes to a crease begins anew.
const ON_CREASE: u32 = u32::MAX;
