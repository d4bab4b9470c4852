//! Where a slide over bent patches will end, guessed before it is walked.
//!
//! Problem: around the rim of a bore each round of a walk overshoots the bend, and a round looks at what holds the HIP back. Of
//! five to nine of them the patches that hold the god-object would have been enough.
//!
//! Model: on one patch, without friction, the slide ends at the HIP's foot. Along the curve of two patches it follows the
//! circle that the curve bends along (from the patches' own curvatures), on which the place where friction is content
//! solves a quadratic equation, and in the same step comes back onto the patches; where it is all but straight, Newton's
//! method. What friction leaves of the way is taken to grow with the depth, as Coulomb's does.
//!
//! Frames: object frame B. Invariant: a guess decides nothing: whoever walks there meets what is on the way, and goes on
//! from there until friction is content.
//! Cost: at most [`MAX_STEPS`] looks at one or two patches; on a circular rim two.

use nalgebra::Vector3;

use super::Csg;
use super::advance::Target;
use super::god::God;
use super::patch::{Look, Patch};
use super::settle::{Pair, is_on, looks_at, settle_on};
use crate::slide::Round;

/// A place on the bent patches that hold a god-object, from which little is left to slide; `None` where the way there
/// bends too much to tell.
#[inline(always)]
pub(super) fn foresee(
    csg: &Csg,
    god: &God,
    round: &Round,
    looks: Option<[Look; 2]>,
    hip_B: &Vector3<f64>,
) -> Option<Target> {
    let left = (round.gap_m - round.asked_m) / round.view.depth_m;
    let tells = round.asked_m > round.view.rest_m && (0.0..f64::INFINITY).contains(&left);
    if !tells {
        return None;
    }
    let rest_m = round.view.rest_m;
    // A patch has a whole rim of places where friction is content: which of them is a matter of the way.
    match (god.only_patch(csg), god.both_patches(csg)) {
        (Some(patch), _) if left == 0.0 && !patch.is_plane() => {
            foot(patch, god, hip_B, rest_m).map(|point_B| Target { point_B, looks: None })
        }
        (_, Some(patches)) if !god.is_on_planes(csg) => {
            let looks = looks.unwrap_or_else(|| looks_at(&patches, &god.point_B, hip_B));
            on_rim(patches, looks, &god.point_B, hip_B, left, rest_m)
        }
        _ => None,
    }
}

/// The nearest place of one bent patch.
fn foot(patch: &Patch, god: &God, hip_B: &Vector3<f64>, rest_m: f64) -> Option<Vector3<f64>> {
    let first = patch.look(&god.point_B, hip_B);
    // Of all but scaled patches this is the place.
    let (mut point_B, [mut look]) = settle_on([patch], hip_B, hip_B);
    for _ in 0..MAX_STEPS {
        if first.normal_B.dot(&look.normal_B) < BENT {
            return None;
        }
        let to_hip_B = hip_B - point_B;
        let lag_B = to_hip_B - look.normal_B * look.normal_B.dot(&to_hip_B);
        let lag_m = lag_B.norm();
        if lag_m <= rest_m {
            break;
        }
        let bend_per_m = patch.bending(&point_B, &(lag_B / lag_m));
        // How much faster the foot moves than the HIP.
        let gain = 1.0 / (1.0 + bend_per_m * look.normal_B.dot(&to_hip_B));
        if gain.is_nan() || gain <= 0.0 || gain > MAX_GAIN {
            return None;
        }
        (point_B, [look]) = settle_on([patch], &(point_B + lag_B * gain), hip_B);
    }
    Some(point_B)
}

/// Where on the curve of two patches friction is content, or the nearest place of it if nothing is left to friction.
fn on_rim(
    patches: [&Patch; 2],
    mut looks: [Look; 2],
    from_B: &Vector3<f64>,
    hip_B: &Vector3<f64>,
    left: f64,
    rest_m: f64,
) -> Option<Target> {
    let mut point_B = *from_B;
    let first = looks;
    let mut direction_before_B = None;
    for _ in 0..MAX_STEPS {
        let planes = Pair::of(&looks);
        let to_hip_B = hip_B - point_B;
        let is_ahead = planes.along_B.dot(&direction_before_B.unwrap_or(to_hip_B)) >= 0.0;
        let length = planes.sine2.sqrt();
        let along_B = planes.along_B * (1.0 / if is_ahead { length } else { -length });
        let lag_m = along_B.dot(&to_hip_B);
        let depth_m = (to_hip_B - along_B * lag_m).norm();
        let asked_m = lag_m - left * depth_m;
        if asked_m.abs() <= rest_m {
            break;
        }
        // What leads away from both tangent planes as fast as the patches do.
        let bend_B = planes.down_B(patches.map(|patch| patch.bending(&point_B, &along_B)));
        let arc = Arc { along_B, bend_B, lag_m, depth_m, to_hip_B };
        point_B += arc.way_B(asked_m, left)? + planes.down_B([looks[0].height_m, looks[1].height_m]);
        looks = looks_at(&patches, &point_B, hip_B);
        let bends = |(first, look): (&Look, &Look)| first.normal_B.dot(&look.normal_B) < BENT;
        if first.iter().zip(&looks).any(bends) {
            return None;
        }
        if direction_before_B.is_none() && is_on(&looks, &point_B) {
            // At once only a circle leads back onto the patches, and on a circle the place is known at once.
            break;
        }
        direction_before_B = Some(along_B);
    }
    Some(Target { point_B, looks: Some(looks) })
}

/// A curve as it is near one of its points: a piece of a circle.
struct Arc {
    along_B: Vector3<f64>,
    /// To the circle's centre, over the square of the radius.
    bend_B: Vector3<f64>,
    /// To the HIP, along the curve.
    lag_m: f64,
    depth_m: f64,
    to_hip_B: Vector3<f64>,
}

impl Arc {
    /// From here to where what friction leaves is `left` of the depth; `None` if that cannot be told.
    #[inline(always)]
    fn way_B(&self, asked_m: f64, left: f64) -> Option<Vector3<f64>> {
        let bend_per_m = self.bend_B.norm();
        if bend_per_m * asked_m.abs() < STRAIGHT {
            return self.straight_B(asked_m, left);
        }
        let (radius_m, inward_B) = (1.0 / bend_per_m, self.bend_B / bend_per_m);
        // The HIP as seen from the centre: outwards, along, and beside the circle's plane.
        let out_m = radius_m - inward_B.dot(&self.to_hip_B);
        let reach_m = (out_m * out_m + self.lag_m * self.lag_m).sqrt();
        let (cos_left, sin_left) =
            if left == 0.0 { (1.0, 0.0) } else { self.left_over(left, radius_m, out_m) };
        let cos = (out_m * cos_left + self.lag_m * sin_left) / reach_m;
        let sin = (self.lag_m * cos_left - out_m * sin_left) / reach_m;
        if cos.is_nan() || cos <= BENT {
            return None;
        }
        Some((self.along_B + inward_B * (sin / (1.0 + cos))) * (radius_m * sin))
    }

    /// Cosine and sine of the angle about the centre that friction leaves between the place and the HIP.
    #[inline(always)]
    fn left_over(&self, left: f64, radius_m: f64, out_m: f64) -> (f64, f64) {
        let reach_m2 = out_m * out_m + self.lag_m * self.lag_m;
        let beside_m2 =
            (self.to_hip_B.norm_squared() - (radius_m - out_m).powi(2) - self.lag_m.powi(2)).max(0.0);
        // `reach sin a = left sqrt((radius - reach cos a)^2 + beside^2)`, solved for the cosine.
        let l2 = left * left;
        let (a, b) = (reach_m2 * (1.0 + l2), l2 * radius_m * reach_m2.sqrt());
        let c = l2 * (radius_m * radius_m + beside_m2) - reach_m2;
        let cos = (b + (b * b - a * c).sqrt()) / a;
        (cos, (1.0 - cos * cos).max(0.0).sqrt())
    }

    /// Newton's method.
    fn straight_B(&self, asked_m: f64, left: f64) -> Option<Vector3<f64>> {
        let lag_slope = self.bend_B.dot(&self.to_hip_B) - 1.0;
        let depth_slope = -self.lag_m * (1.0 + lag_slope) / self.depth_m;
        let gain = -1.0 / (lag_slope - if left > 0.0 { left * depth_slope } else { 0.0 });
        (gain > 0.0 && gain < MAX_GAIN).then(|| self.along_B * (asked_m * gain))
    }
}

/// Bound on the steps; circles take one, other curves two or three.
const MAX_STEPS: u32 = 6;
/// Cosine between the first normal and the last: about 35 degrees, less than leads to another side of anything.
const BENT: f64 = 0.8;
/// Steps larger than what is asked for by more than this come from slopes that say nothing.
const MAX_GAIN: f64 = 8.0;
/// A step of less than this share of the radius is straight enough for Newton's method, and too short for the circle's centre
/// to be known well.
const STRAIGHT: f64 = 1e-5;

#[cfg(test)]
mod tests {
    use nalgebra::Isometry3;

    use super::super::{CsgPart, CsgTree};
    use super::*;
    use crate::cuboid::Cuboid;
    use crate::cylinder::Cylinder;
    use crate::sphere::Sphere;

    /// The top of a plate, and what is taken out of it.
    fn top_and(taken: CsgPart) -> [Patch; 2] {
        let plate = CsgPart::from(Cuboid::new([0.1, 0.02, 0.1]).unwrap());
        let csg = Csg::build(&CsgTree::difference([plate, taken])).unwrap();
        let top = csg.patches.iter().find(|patch| patch.level(&(Vector3::y() * 0.01)).abs() < 1e-12).unwrap();
        [*top, *csg.patches.iter().find(|patch| !patch.is_plane()).unwrap()]
    }

    fn bore(tilt: f64) -> CsgPart {
        CsgPart::new(Cylinder::new(0.01, 0.2).unwrap(), Isometry3::rotation(Vector3::x() * tilt))
    }

    /// On a rim, a rim's tangent and what friction leaves: how far from content, as a share of the depth.
    fn left_over([a, b]: &[Patch; 2], at: &Vector3<f64>, hip: &Vector3<f64>, left: f64) -> f64 {
        let along = a.look(at, hip).normal_B.cross(&b.look(at, hip).normal_B).normalize();
        let lag = along.dot(&(hip - at)).abs();
        let depth = (hip - at - along * along.dot(&(hip - at))).norm();
        assert!(a.level(at).abs() < 1e-15 && b.level(at).abs() < 1e-15, "{at:?}");
        (lag - left * depth).abs() / depth
    }

    #[test]
    fn friction_is_content_where_a_slide_around_a_rim_was_foreseen_to_end() {
        let dimple = CsgPart::at(Sphere::new(0.012).unwrap(), Vector3::y() * 0.012);
        let oval = CsgPart::from(Cylinder::new(0.01, 0.2).unwrap()).scaled([1.3, 1.0, 0.8]);
        for (name, taken) in
            [("bore", bore(0.0)), ("tilted bore", bore(0.6)), ("dimple", dimple), ("oval bore", oval)]
        {
            let patches = top_and(taken);
            let [top, wall] = &patches;
            let mut foreseen = 0;
            for left in [0.0, 0.1, 0.3] {
                for i in 0..40 {
                    let angle = f64::from(i) * 0.157;
                    let out = |angle: f64| Vector3::new(angle.cos(), 0.0, angle.sin());
                    let from = Vector3::y() * 0.01 + out(angle) * 0.011;
                    let (from, looks) = settle_on([top, wall], &from, &from);
                    // Ahead by a fifth of a radian, below the top and in the wall.
                    let hip =
                        from.norm() * 0.7 * out(angle + 0.2).component_mul(&Vector3::new(1.0, 0.0, 1.0))
                            + Vector3::y() * 0.008;
                    let rest_m = 1e-15;
                    // Around the sharp ends of a tilted bore nothing is foreseen.
                    let Some(target) = on_rim([top, wall], looks, &from, &hip, left, rest_m) else {
                        continue;
                    };
                    foreseen += 1;
                    let lag_before = left_over(&patches, &from, &hip, left);
                    let lag_after = left_over(&patches, &target.point_B, &hip, left);
                    assert!(lag_after < 1e-11, "{name} {left} {i}: {lag_before} {lag_after}");
                }
            }
            assert!(foreseen > 90, "{name}: {foreseen} of 120");
        }
    }

    /// Circles take one step, and the next one sees that.
    #[test]
    fn around_a_circle_one_step_is_enough() {
        let [top, wall] = top_and(bore(0.0));
        let from = Vector3::new(0.01, 0.01, 0.0);
        let looks = looks_at(&[&top, &wall], &from, &from);
        let hip = Vector3::new(0.011, 0.007, 0.004);
        let along_B = Vector3::z();
        let to_hip_B = hip - from;
        let depth_m = (to_hip_B - along_B * to_hip_B.z).norm();
        let bendings = [&top, &wall].map(|patch| patch.bending(&from, &along_B));
        let bend_B = Pair::of(&looks).down_B(bendings);
        assert!((bend_B + Vector3::x() * 100.0).norm() < 1e-12, "{bend_B:?}");
        let arc = Arc { along_B, bend_B, lag_m: to_hip_B.z, depth_m, to_hip_B };
        for left in [0.0, 0.2] {
            let end = from + arc.way_B(to_hip_B.z - left * depth_m, left).unwrap();
            let content = left_over(&[top, wall], &end, &hip, left);
            assert!(content < 1e-14, "{left}: {content}");
        }
    }
}
