//! Where a finger that is found inside is pushed out.
//!
//! Model: the nearest of all points that are feet of its perpendiculars on patches, and of the ends of six straight ways
//! out, that lie on the solid's boundary. Where an edge is nearer, the god-object slides there in the same tick.
//! Cost: a foot for each patch that is nearer than what was found, each with a small neighbourhood; six paths.

use nalgebra::Vector3;

use super::Csg;
use super::god::God;
use super::hit::Events;
use super::near::Neighbourhood;

/// The god-object of a HIP inside; `None` if there is no boundary to be found.
pub(super) fn way_out(csg: &Csg, hip_B: &Vector3<f64>) -> Option<God> {
    let mut best: Option<(f64, God)> = None;
    let shortest = |best: &Option<(f64, God)>| best.as_ref().map_or(f64::INFINITY, |(shortest, _)| *shortest);
    for patch in &csg.patches {
        if patch.level(hip_B).abs() >= shortest(&best) {
            continue;
        }
        let mut foot_B = *hip_B;
        for _ in 0..MAX_ROUNDS {
            let look = patch.look(&foot_B, hip_B);
            foot_B -= look.normal_B * look.height_m;
        }
        let distance_m = (foot_B - hip_B).norm();
        if distance_m < shortest(&best)
            && let Some(god) = on_boundary(csg, &foot_B)
        {
            best = Some((distance_m, god));
        }
    }
    for axis in 0..3 {
        for side in [1.0, -1.0] {
            let far_B = hip_B + Vector3::ith(axis, side) * shortest(&best).min(4.0 * csg.extent_m);
            if let Some((distance_m, god)) = straight_out(csg, hip_B, &far_B)
                && distance_m < shortest(&best)
            {
                best = Some((distance_m, god));
            }
        }
    }
    best.map(|(_, god)| god)
}

/// A god-object at a point, if some of the patches there are boundary.
fn on_boundary(csg: &Csg, point_B: &Vector3<f64>) -> Option<God> {
    let near = Neighbourhood::around(csg, point_B, 0.0);
    let sides = near.sides(csg, point_B);
    let is_here = |index: usize| near.patch(csg, index).level(point_B).abs() <= csg.tolerance_m();
    let index = (0..near.count())
        .filter(|&index| is_here(index))
        .find(|&index| near.is_solid(sides) != near.is_solid(sides ^ 1 << index))?;
    let free = if near.is_solid(sides) { sides ^ 1 << index } else { sides };
    Some(God::new(*point_B, near, free, 1 << index))
}

/// Where a straight way out meets the open.
fn straight_out(csg: &Csg, from_B: &Vector3<f64>, to_B: &Vector3<f64>) -> Option<(f64, God)> {
    let mut from_B = *from_B;
    let mut gone_m = 0.0;
    for _ in 0..MAX_PIECES {
        let path_B = to_B - from_B;
        let length_m = path_B.norm();
        let near = Neighbourhood::around(csg, &from_B, length_m);
        let room_m = near.radius_m * (1.0 - 1e-9);
        let is_last = length_m <= room_m;
        let end_B = if is_last { *to_B } else { from_B + path_B * (room_m / length_m) };
        let mut sides = near.sides(csg, &from_B);
        for (share, index) in Events::along(csg, &near, sides, 0, &from_B, &end_B).iter() {
            sides ^= 1 << index;
            if !near.is_solid(sides) {
                let way_B = (end_B - from_B) * share;
                let god = God::new(from_B + way_B, near, sides, 1 << index);
                return Some((gone_m + way_B.norm(), god));
            }
        }
        if is_last || length_m.is_nan() {
            return None;
        }
        gone_m += room_m;
        from_B = end_B;
    }
    None
}

/// Newton's method on one patch: most are met exactly by the first.
const MAX_ROUNDS: u32 = 4;
/// Neighbourhoods that a way out leads through.
const MAX_PIECES: u32 = 64;
