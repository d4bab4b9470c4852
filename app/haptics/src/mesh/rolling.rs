//! Meshes as ground for balls: feet walk from face to face, and the hierarchy of boxes tells what else is near.

mod foot;
mod vicinity;

use nalgebra::Vector3;

pub(crate) use self::foot::Foot;
pub(crate) use self::vicinity::Vicinity;
use super::bvh::normal_at;
use super::{Mesh, Nearest, TooMany};
use crate::rolling::{Ground, Plane, RollingCone};
use crate::surface::{Feature, direction_or_up};

/// State of one spherical finger towards one mesh.
pub(crate) type BallOnMesh = RollingCone<Foot, Vicinity>;

impl Ground for Mesh {
    type Foot = Foot;
    type Vicinity = Vicinity;
    const IS_BENT: bool = false;

    fn identity(&self) -> u64 {
        self.identity
    }

    #[inline(always)]
    fn extent_m(&self) -> f64 {
        self.extent_m
    }

    fn clearance_m(&self, point_B: &Vector3<f64>, at_most_m: f64) -> f64 {
        self.clearance(point_B, at_most_m)
    }

    fn seen_m(&self, radius_m: f64) -> f64 {
        radius_m * (1.0 + f64::EPSILON)
    }

    fn is_inside(&self, point_B: &Vector3<f64>) -> bool {
        self.is_inside(point_B)
    }

    fn way_out(&self, point_B: &Vector3<f64>) -> Option<Foot> {
        self.way_out(point_B).map(|way| Foot::from(&way))
    }

    fn normal_B(&self, foot: &Foot) -> Vector3<f64> {
        let Foot { face, feature, corner, point_B, squared_m2 } = *foot;
        let at = Nearest { face, feature, corner, point_B, distance_m: squared_m2.sqrt() };
        direction_or_up(&normal_at(self.triangles(), &at))
    }

    #[inline(always)]
    fn walked(&self, foot: &Foot, centre_B: &Vector3<f64>, _radius_m: f64, _is_alone: bool) -> Foot {
        Foot::from_face(self, foot.face, centre_B)
    }

    fn distance_m(&self, foot: &Foot, centre_B: &Vector3<f64>, _is_alone: bool) -> f64 {
        Foot::on(self, foot.face, centre_B).squared_m2.sqrt()
    }

    fn followed(&self, foot: &Foot, centre_B: &Vector3<f64>) -> Foot {
        // A face ends where it does.
        Foot::on(self, foot.face, centre_B)
    }

    #[inline(always)]
    fn plane(&self, foot: &Foot, centre_B: &Vector3<f64>, radius_m: f64) -> Plane {
        foot.plane(self, centre_B, radius_m)
    }

    fn nearest_within(
        &self,
        centre_B: &Vector3<f64>,
        at_most_m: f64,
    ) -> Result<Option<(Foot, f64)>, TooMany> {
        let near = self.nearest_within(centre_B, at_most_m)?;
        Ok(near.map(|near| (Foot::from(&near), near.distance_m)))
    }

    fn nearest_above(
        &self,
        centre_B: &Vector3<f64>,
        at_most_m: f64,
        plane: (&Vector3<f64>, f64),
    ) -> Result<Option<Foot>, TooMany> {
        let near = self.nearest_above(centre_B, at_most_m, plane)?;
        Ok(near.map(|near| Foot::from(&near)))
    }

    #[inline(always)]
    fn is_clear(
        &self,
        vicinity: &mut Vicinity,
        centre_B: &Vector3<f64>,
        normal_B: &Vector3<f64>,
        near_m: f64,
        moved_m: f64,
    ) -> bool {
        vicinity.is_clear(self, centre_B, normal_B, near_m, moved_m)
    }

    fn crossed_at(&self, [from_B, to_B]: [&Vector3<f64>; 2]) -> Option<f64> {
        self.first_crossing(from_B, to_B).map(|hit| hit.fraction)
    }

    fn room_m(&self, centre_B: &Vector3<f64>, radius_m: f64, ahead_m: f64) -> Option<f64> {
        let near = self.nearest_within(centre_B, radius_m + ahead_m).ok()?;
        Some(near.map_or(ahead_m, |near| near.distance_m - radius_m))
    }

    /// Of a HIP that is outside of the mesh, but nearer to it than the radius: straight away from the nearest point.
    #[inline(always)]
    fn seat(
        &self,
        foot: &Foot,
        normal_B: &Vector3<f64>,
        hip_B: &Vector3<f64>,
        radius_m: f64,
    ) -> Option<(Foot, Plane)> {
        if normal_B.dot(&(hip_B - foot.point_B)) <= LEAST_HEIGHT * radius_m {
            return None;
        }
        let there = Foot::from_face(self, foot.face, hip_B);
        let plane = there.plane(self, hip_B, radius_m);
        let depth_m = plane.1 - plane.0.dot(hip_B);
        (0.0..(1.0 - LEAST_HEIGHT) * radius_m).contains(&depth_m).then_some((there, plane))
    }
}

impl From<&Nearest> for Foot {
    fn from(near: &Nearest) -> Self {
        let Nearest { face, feature, corner, point_B, distance_m } = *near;
        Self { face, feature, corner, point_B, squared_m2: distance_m * distance_m }
    }
}

impl crate::rolling::Foot for Foot {
    const NOWHERE: Self = Self {
        face: 0,
        feature: Feature::None,
        corner: 0,
        point_B: Vector3::new(0.0, 0.0, 0.0),
        squared_m2: f64::INFINITY,
    };

    #[inline(always)]
    fn point_B(&self) -> Vector3<f64> {
        self.point_B
    }

    fn feature(&self) -> Feature {
        self.feature
    }

    fn piece(&self) -> u32 {
        self.face
    }

    fn is_on_same_piece(&self, other: &Self) -> bool {
        self.face == other.face
    }

    #[inline(always)]
    fn is_beside(&self, other: &Self) -> bool {
        self.face == other.face
    }
}

/// Heights above the mesh below this share of the radius have no direction worth going by.
const LEAST_HEIGHT: f64 = 1e-3;
