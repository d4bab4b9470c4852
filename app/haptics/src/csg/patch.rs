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

use nalgebra::Vector3;

use super::crossings::Crossings;
use super::curved::Curved;

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

/// What a patch shows of a point.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Look {
    /// Distance to first order, exact in sign and zero (m).
    pub(crate) height_m: f64,
    /// Unit normal.
    pub(crate) normal_B: Vector3<f64>,
}

impl Patch {
    pub(crate) fn is_plane(&self) -> bool {
        matches!(self, Self::Plane { .. })
    }

    /// True if all between two points inside of it is inside: of all but rings.
    pub(crate) fn is_convex(&self) -> bool {
        match self {
            Self::Plane { .. } => true,
            Self::Curved(curved) => curved.is_convex(),
        }
    }

    /// Whether one of its points is nearest to a point inside of it and all others lead there downhill: it is not scaled
    /// by different factors.
    pub(crate) fn is_round(&self) -> bool {
        match self {
            Self::Plane { .. } => true,
            Self::Curved(curved) => curved.is_round(),
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
                self.is_round() && other.is_round() && a.is_ball() && b.is_ball()
            }
        }
    }

    /// Whether heights are distances, everywhere: it is not scaled.
    #[inline(always)]
    pub(crate) fn is_distance(&self) -> bool {
        match self {
            Self::Plane { .. } => true,
            Self::Curved(curved) => curved.is_distance(),
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

    /// The tip of a cone, if the way between two points leads across its axis.
    pub(crate) fn tip_between(&self, from_B: &Vector3<f64>, to_B: &Vector3<f64>) -> Option<Vector3<f64>> {
        match self {
            Self::Plane { .. } => None,
            Self::Curved(curved) => curved.tip_between(from_B, to_B),
        }
    }

    /// True of a point in the tip of a cone, seen from inside of it, that is the nearest of all its side to the HIP: no normal tells.
    /// Points nearer to the axis than `near_m` are in the tip.
    #[inline(always)]
    pub(super) fn holds_in_tip(&self, point_B: &Vector3<f64>, hip_B: &Vector3<f64>, near_m: f64) -> bool {
        matches!(self, Self::Curved(curved) if curved.holds_in_tip(point_B, hip_B, near_m))
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

#[cfg(test)]
mod tests {
    use super::super::kind::MARCH;
    use super::super::{Csg, CsgPart, CsgTree};
    use super::*;
    use crate::capsule::Capsule;
    use crate::cone::Cone;
    use crate::cylinder::Cylinder;
    use crate::sphere::Sphere;
    use crate::torus::Torus;

    /// A curved patch of each kind, as it is, turned, and scaled.
    fn patches() -> Vec<Patch> {
        let pose = nalgebra::Isometry3::new(Vector3::new(0.01, -0.02, 0.005), Vector3::new(0.4, 0.8, -0.3));
        let parts = [
            CsgPart::new(Sphere::new(0.03).unwrap(), pose),
            CsgPart::new(Cylinder::new(0.03, 0.1).unwrap(), pose),
            CsgPart::new(Cone::new(0.04, 0.01, 0.05).unwrap(), pose),
            CsgPart::new(Capsule::new(0.02, 0.04).unwrap(), pose),
            CsgPart::new(Torus::new(0.04, 0.015).unwrap(), pose),
        ];
        let scaled = parts.clone().map(|part| part.scaled([1.2, 0.7, 0.9]));
        let curved = |part| {
            let csg = Csg::build(&CsgTree::union([part])).unwrap();
            *csg.patches.iter().find(|patch| !patch.is_plane()).unwrap()
        };
        parts.into_iter().chain(scaled).map(curved).collect()
    }

    fn spread(i: u32) -> Vector3<f64> {
        let along = |step: f64| 2.0 * (f64::from(i) * step).fract() - 1.0;
        Vector3::new(along(0.618_034), along(0.414_214), along(0.732_051))
    }

    #[test]
    fn a_patch_bends_as_much_as_its_normal_turns() {
        for (kind, patch) in patches().iter().enumerate() {
            let mut looked = 0;
            for i in 0..200 {
                let (point, from) = (spread(i) * 0.06, Vector3::zeros());
                let mut foot = point;
                for _ in 0..50 {
                    let look = patch.look(&foot, &from);
                    foot -= look.normal_B * look.height_m;
                }
                let normal = patch.look(&foot, &from).normal_B;
                let [along, towards] =
                    [spread(2 * i + 1), spread(2 * i + 2)].map(|v| (v - normal * normal.dot(&v)).normalize());
                let step = 1e-6;
                let turned = patch.look(&(foot + along * step), &from).normal_B
                    - patch.look(&(foot - along * step), &from).normal_B;
                let expected = turned.dot(&towards) / (2.0 * step);
                let bending = patch.mixed_bending(&foot, &along, &towards);
                if expected.abs() < 200.0 {
                    looked += 1;
                    // Of central differences the error is the step's square over the cube of a radius of 5 mm, and
                    // rounding over the step.
                    assert!(
                        (bending - expected).abs() < 1e-4 + 1e-5 * expected.abs(),
                        "{kind} {i} {bending} {expected}"
                    );
                }
            }
            assert!(looked > 100, "{kind}: {looked}");
        }
    }

    /// The level's zeros beside what a path's crossings say.
    #[test]
    fn crossings_are_where_the_level_changes_its_sign() {
        for (kind, patch) in patches().iter().enumerate() {
            let mut found = [0; 5];
            for i in 0..2000 {
                let (from, to) = (spread(i) * 0.08, spread(5 * i + 3) * 0.08);
                let inside = [&from, &to].map(|p| patch.level(p) <= 0.0);
                let crossings = patch.crossings(&from, &to, inside);
                let shares = crossings.shares();
                found[shares.len()] += 1;
                assert_eq!(shares.len() % 2 == 1, inside[0] != inside[1], "{kind} {i} {shares:?}");
                for &share in shares {
                    let level = patch.level(&(from + (to - from) * share));
                    assert!(level.abs() < 1e-14, "{kind} {i} {level}");
                }
                let along = (0..=400).map(|k| patch.level(&(from + (to - from) * (f64::from(k) / 400.0))));
                let changes =
                    along.clone().zip(along.clone().skip(1)).filter(|(a, b)| (*a <= 0.0) != (*b <= 0.0));
                // A path past a ring may miss what is thinner than its smallest step.
                let is_thin = along.fold(f64::INFINITY, f64::min) > -MARCH * (to - from).norm();
                assert!(is_thin || shares.len() >= changes.count(), "{kind} {i} {shares:?}");
            }
            assert!(found[1] > 30 && found[2] > 50, "{kind}: {found:?}");
        }
    }
}
