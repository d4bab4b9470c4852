//! Where a slide over bent patches will end, guessed before it is walked.
//!
//! Problem: around the rim of a bore each round of a walk overshoots the bend, and a round looks at everything nearby:
//! corners, crossings, the solid's cells. Of five to nine of them the patches that hold the god-object would have been enough.
//!
//! Model: along the tangent by what is asked for, divided by the slope that the last step showed, and in the same step back
//! onto the patches (Newton's method). What friction leaves of the way is taken to grow with the depth, as Coulomb's does.
//!
//! Frames: object frame B. Invariant: a guess decides nothing: whoever walks there meets what is on the way, and goes on
//! from there until friction is content.
//! Cost: at most [`MAX_STEPS`] looks at one or two patches.

use nalgebra::Vector3;

use super::Csg;
use super::god::God;
use super::patch::{Look, Patch};
use super::settle::correction;
use crate::slide::Round;

/// A place on the bent patches that hold a god-object, from which little is left to slide; `None` where the way there
/// bends too much to tell.
#[inline(always)]
pub(super) fn foresee(csg: &Csg, god: &God, round: &Round, hip_B: &Vector3<f64>) -> Option<Vector3<f64>> {
    let left = (round.gap_m - round.asked_m) / round.view.depth_m;
    let tells = round.asked_m > round.view.rest_m && (0.0..f64::INFINITY).contains(&left);
    if !tells {
        return None;
    }
    let rest_m = round.view.rest_m;
    // A patch has a whole rim of places where friction is content: which of them is a matter of the way.
    match (god.only_patch(csg), god.both_patches(csg)) {
        (Some(patch), _) if left == 0.0 && !patch.is_plane() => {
            along([patch], &god.point_B, left, rest_m, hip_B)
        }
        (_, Some(patches)) if !god.is_on_planes(csg) => along(patches, &god.point_B, left, rest_m, hip_B),
        _ => None,
    }
}

#[inline(never)]
fn along<const N: usize>(
    patches: [&Patch; N],
    from_B: &Vector3<f64>,
    left: f64,
    rest_m: f64,
    hip_B: &Vector3<f64>,
) -> Option<Vector3<f64>> {
    let mut point_B = *from_B;
    let mut looks = patches.map(|patch| patch.look(&point_B, hip_B));
    let first = looks;
    // Direction, what was asked for and the step taken there.
    let mut last: Option<(Vector3<f64>, f64, f64)> = None;
    for _ in 0..MAX_STEPS {
        let bends = |(first, look): (&Look, &Look)| first.normal_B.dot(&look.normal_B) < BENT;
        if first.iter().zip(&looks).any(bends) {
            return None;
        }
        let to_hip_B = hip_B - point_B;
        let (direction_B, lag_m) = lag(&looks, &to_hip_B)?;
        let left_m = if left > 0.0 { left * (to_hip_B - direction_B * lag_m).norm() } else { 0.0 };
        let turned =
            if last.is_some_and(|(before_B, ..)| before_B.dot(&direction_B) < 0.0) { -1.0 } else { 1.0 };
        let (direction_B, asked_m) = (direction_B * turned, lag_m * turned - left_m);
        if asked_m.abs() <= rest_m {
            break;
        }
        let gain = match last {
            Some((_, asked_before_m, step_m)) => step_m / (asked_before_m - asked_m),
            None => 1.0,
        };
        // A slope of the wrong sign, or none.
        if gain.is_nan() || gain <= 0.0 || gain > MAX_GAIN {
            return None;
        }
        let step_m = gain * asked_m;
        point_B += direction_B * step_m + correction(&looks);
        last = Some((direction_B, asked_m, step_m));
        looks = patches.map(|patch| patch.look(&point_B, hip_B));
    }
    Some(point_B)
}

/// Towards the HIP along the patches, and how far it is (m).
#[inline(always)]
fn lag(looks: &[Look], to_hip_B: &Vector3<f64>) -> Option<(Vector3<f64>, f64)> {
    let lag_B = match looks {
        [a, b, ..] => {
            let along_B = a.normal_B.cross(&b.normal_B);
            along_B * (along_B.dot(to_hip_B) / along_B.norm_squared())
        }
        [a] => to_hip_B - a.normal_B * a.normal_B.dot(to_hip_B),
        [] => return None,
    };
    let lag_m = lag_B.norm();
    if lag_m > 0.0 { Some((lag_B / lag_m, lag_m)) } else { None }
}

/// Common slides need three to five.
const MAX_STEPS: u32 = 6;
/// Cosine between the first normal and the last: about 35 degrees, less than leads to another side of anything.
const BENT: f64 = 0.8;
/// Steps larger than what is asked for by more than this come from slopes that say nothing.
const MAX_GAIN: f64 = 8.0;
