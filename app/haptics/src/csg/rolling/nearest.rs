//! The nearest point of a patch, of the curve in which two meet, and of where three do.
//!
//! Model: Newton's method on the patches' levels, and along what is left free on the condition that the way to the target
//! is across it. On patches that are not scaled the first step is exact. Where the distance bends the wrong way, near a
//! maximum of it, a step goes downhill instead, by no more than the patches are bent.
//!
//! Cost: one look at each patch if they are planes, two if they are bent alike; bounded by [`MOST_STEPS`].

use nalgebra::{Matrix3, Vector3};

use super::on::On;
use crate::csg::Csg;
use crate::csg::patch::Patch;
use crate::surface::direction_or_up;
use crate::tangent_view::tangential;

/// The point nearest to `target_B` that the way downhill from `start_B` leads to.
pub(super) fn nearest_on(
    csg: &Csg,
    on: &On,
    start_B: &Vector3<f64>,
    target_B: &Vector3<f64>,
) -> Option<Vector3<f64>> {
    let patch = |number: &u16| csg.patches.get(usize::from(*number));
    let point_B = match on.numbers() {
        [a] => on_patch(patch(a)?, start_B, target_B),
        [a, b] => on_curve([patch(a)?, patch(b)?], start_B, target_B)?,
        [a, b, c] => at_corner([patch(a)?, patch(b)?, patch(c)?], start_B)?,
        _ => return None,
    };
    point_B.iter().all(|x| x.is_finite()).then_some(point_B)
}

#[inline]
fn on_patch(patch: &Patch, start_B: &Vector3<f64>, target_B: &Vector3<f64>) -> Vector3<f64> {
    let from_target = patch.look(target_B, start_B);
    let foot_B = target_B - from_target.normal_B * from_target.height_m;
    if patch.is_plane() {
        return foot_B;
    }
    if from_target.height_m > 0.0
        && let Some(tip_B) = patch.tip_between(target_B, &foot_B)
    {
        return tip_B;
    }
    let there = patch.look(&foot_B, start_B);
    let way_B = target_B - foot_B;
    let resolution_m = resolution_m(&foot_B, target_B);
    if tangential(&way_B, &there.normal_B).amax() <= ALONG_THE_NORMAL * way_B.amax() + resolution_m {
        return foot_B - there.normal_B * there.height_m;
    }
    on_scaled_patch(patch, start_B, target_B)
}

#[inline(never)]
fn on_scaled_patch(patch: &Patch, start_B: &Vector3<f64>, target_B: &Vector3<f64>) -> Vector3<f64> {
    let mut p_B = *start_B;
    for _ in 0..MOST_STEPS {
        let look = patch.look(&p_B, target_B);
        let normal_B = look.normal_B;
        p_B -= normal_B * look.height_m;
        let way_B = target_B - p_B;
        let height_m = normal_B.dot(&way_B);
        let lag_B = tangential(&way_B, &normal_B);
        let lag_m = lag_B.norm();
        let resolution_m = resolution_m(&p_B, target_B);
        // Where there is no way left to go, it may yet be a maximum.
        let is_there = lag_m <= resolution_m;
        let along_B = if is_there { direction_or_up(&across_any(&normal_B)) } else { lag_B / lag_m };
        let beside_B = normal_B.cross(&along_B);
        // How much of the lag a step takes away: convex as seen from the target more, hollow less than its length.
        let gain = |u: &Vector3<f64>, v: &Vector3<f64>| height_m * patch.mixed_bending(&p_B, u, v);
        let (m11, m12, m22) =
            (1.0 + gain(&along_B, &along_B), gain(&along_B, &beside_B), 1.0 + gain(&beside_B, &beside_B));
        let determinant = m11 * m22 - m12 * m12;
        let is_minimum = m11 > -FLAT && determinant > -FLAT;
        if is_there && is_minimum {
            if look.height_m.abs() <= resolution_m {
                break;
            }
            continue;
        }
        let step_B = match m11 > 0.0 && determinant > 0.0 {
            true => (along_B * m22 - beside_B * m12) * (lag_m / determinant),
            false if is_there && m22 < m11 => beside_B * f64::MAX.sqrt(),
            false => along_B * f64::MAX.sqrt(),
        };
        p_B += cut(step_B, BEND * patch.smallest_radius_m(&p_B).min(way_B.norm()));
    }
    p_B
}

fn on_curve([a, b]: [&Patch; 2], start_B: &Vector3<f64>, target_B: &Vector3<f64>) -> Option<Vector3<f64>> {
    let mut p_B = *start_B;
    let (mut missed_m, mut by_bend_m) = (f64::INFINITY, 0.0);
    for step in 1..=MOST_STEPS {
        let looks = [a.look(&p_B, target_B), b.look(&p_B, target_B)];
        let [normal_a_B, normal_b_B] = looks.map(|look| look.normal_B);
        let along_B = normal_a_B.cross(&normal_b_B);
        let sine = along_B.norm();
        if sine.is_nan() || sine < LEAST_SINE {
            return None;
        }
        let along_B = along_B / sine;
        let cosine = normal_a_B.dot(&normal_b_B);
        // The vector in the plane of both normals that has these heights over both patches.
        let across = |[x, y]: [f64; 2]| {
            (normal_a_B * (x - cosine * y) + normal_b_B * (y - cosine * x)) / (sine * sine)
        };
        let back_B = across(looks.map(|look| -look.height_m));
        if step % PATIENCE == 0 {
            // Patches that do not meet are never come to.
            let before_m = std::mem::replace(&mut missed_m, back_B.amax());
            if missed_m > 0.25 * before_m && missed_m > by_bend_m + ON_BOTH * p_B.amax() {
                return None;
            }
        }
        p_B += back_B;
        let way_B = target_B - p_B;
        let lag_m = way_B.dot(&along_B);
        let resolution_m = resolution_m(&p_B, target_B);
        let bend_B = across([a, b].map(|patch| -patch.bending(&p_B, &along_B)));
        let gain = 1.0 - way_B.dot(&bend_B);
        // Where there is no way left to go, it may yet be a maximum.
        if back_B.amax() <= resolution_m / sine && lag_m.abs() <= resolution_m && gain > -FLAT {
            return Some(p_B);
        }
        let step_m = if gain > 0.0 { lag_m / gain } else { f64::INFINITY.copysign(lag_m) };
        let bent_m = a.smallest_radius_m(&p_B).min(b.smallest_radius_m(&p_B));
        let longest_m = (BEND * sine * bent_m).min(f64::MAX.sqrt());
        let step_m = step_m.clamp(-longest_m, longest_m);
        p_B += along_B * step_m;
        // A straight step along a bent curve leads that far from it.
        by_bend_m = step_m * step_m / (sine * bent_m);
    }
    let on_both = [a, b].iter().all(|patch| patch.level(&p_B).abs() <= 64.0 * resolution_m(&p_B, target_B));
    on_both.then_some(p_B)
}

fn at_corner(patches: [&Patch; 3], start_B: &Vector3<f64>) -> Option<Vector3<f64>> {
    let mut p_B = *start_B;
    for _ in 0..MOST_STEPS {
        let looks = patches.map(|patch| patch.look(&p_B, start_B));
        let rows = Matrix3::from_rows(&looks.map(|look| look.normal_B.transpose()));
        let determinant = rows.determinant();
        if determinant.is_nan() || determinant.abs() < LEAST_SINE * LEAST_SINE {
            return None;
        }
        let [a, b, c] = looks.map(|look| -look.height_m);
        let step_B = rows.try_inverse()? * Vector3::new(a, b, c);
        let bent_m = patches.iter().map(|patch| patch.smallest_radius_m(&p_B)).fold(f64::INFINITY, f64::min);
        p_B += cut(step_B, bent_m);
        if step_B.amax() <= resolution_m(&p_B, &p_B) / determinant.abs() {
            return Some(p_B);
        }
    }
    None
}

fn cut(step_B: Vector3<f64>, longest_m: f64) -> Vector3<f64> {
    let length_m = step_B.norm();
    if length_m > longest_m { step_B * (longest_m / length_m) } else { step_B }
}

fn across_any(normal_B: &Vector3<f64>) -> Vector3<f64> {
    normal_B.cross(&Vector3::ith(normal_B.iamin(), 1.0))
}

/// What rounding does to positions (m).
fn resolution_m(a_B: &Vector3<f64>, b_B: &Vector3<f64>) -> f64 {
    4.0 * f64::EPSILON * a_B.amax().max(b_B.amax())
}

const MOST_STEPS: u32 = 24;
/// Steps after which a curve must have come nearer.
const PATIENCE: u32 = 3;
/// In terms of coordinates: as near to a patch is on it.
const ON_BOTH: f64 = 1e-6;
/// A way that deviates less from the normal (rad) has a foot that one more step makes exact.
const ALONG_THE_NORMAL: f64 = 1e-12;
/// The longest step, in radii that a patch is bent with.
const BEND: f64 = 0.7;
/// A distance that bends less along the way is the same all along it.
const FLAT: f64 = 1e-9;
/// Patches that meet under less (rad) have no edge worth going by.
const LEAST_SINE: f64 = 1e-5;
