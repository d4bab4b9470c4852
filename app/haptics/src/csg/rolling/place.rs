//! Whether the distance from a point outside is least at a point of the boundary, or where it is less.
//!
//! Model: as in [corners](crate::csg::corner) the tangent planes of the patches that meet cut space into cells, which the tree's
//! table calls free or solid. The distance is least here if in no solid cell a point is nearer to the way towards the
//! ball's centre than this one; else the nearest such point tells along which patches to go on.
//!
//! Cost: one patch, two looks into the table; m of them, `2^m` cells.

use nalgebra::Vector3;

use super::on::On;
use crate::csg::Csg;
use crate::csg::corner::Corner;
use crate::csg::near::Neighbourhood;

/// What a point is to a ball's centre.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Place {
    /// The nearest one around.
    Foot,
    /// There are nearer ones along these patches.
    Along(On),
    /// No boundary, or none that is seen from there.
    Nothing,
}

/// What `point_B` is to `centre_B`.
pub(super) fn place(
    csg: &Csg,
    near: &Neighbourhood,
    point_B: &Vector3<f64>,
    centre_B: &Vector3<f64>,
) -> Place {
    let (corner, others) = meeting(csg, near, point_B, centre_B);
    match corner.count {
        0 => Place::Nothing,
        1 => {
            let is_boundary = near.is_solid(others) != near.is_solid(others | 1 << corner.indices[0]);
            if is_boundary { Place::Foot } else { Place::Nothing }
        }
        _ => in_corner(near, &corner, others, &(centre_B - point_B)),
    }
}

/// Whether some of what meets at a point is solid, and some is free.
pub(super) fn is_boundary(csg: &Csg, near: &Neighbourhood, point_B: &Vector3<f64>) -> bool {
    let (corner, others) = meeting(csg, near, point_B, point_B);
    let is_solid = |cell: usize| near.is_solid(others | corner.spread(cell));
    (1..1_usize << corner.count).any(|cell| is_solid(cell) != is_solid(0))
}

/// The patches at a point, and the sides of the others.
#[inline]
fn meeting(
    csg: &Csg,
    near: &Neighbourhood,
    point_B: &Vector3<f64>,
    centre_B: &Vector3<f64>,
) -> (Corner, usize) {
    let mut corner = Corner::new();
    let mut others = 0;
    for index in 0..near.count() {
        let patch = near.patch(csg, index);
        let level = patch.level(point_B);
        if level.abs() <= csg.tolerance_m() {
            corner.add(index, &patch.look(point_B, centre_B));
        } else {
            others |= usize::from(level <= 0.0) << index;
        }
    }
    (corner, others)
}

#[inline(never)]
fn in_corner(near: &Neighbourhood, corner: &Corner, others: usize, way_B: &Vector3<f64>) -> Place {
    let cells = || 0..1_usize << corner.count;
    let is_solid = |cell: usize| near.is_solid(others | corner.spread(cell));
    if cells().all(is_solid) {
        return Place::Nothing;
    }
    let mut best: Option<(f64, Vector3<f64>, usize, usize)> = None;
    for cell in cells().filter(|&cell| is_solid(cell)) {
        let (towards_B, mask) = corner.nearest(cell, way_B);
        let distance_m2 = (towards_B - way_B).norm_squared();
        if best.is_none_or(|(least, ..)| distance_m2 < least) {
            best = Some((distance_m2, towards_B, mask, cell));
        }
    }
    let Some((_, towards_B, mask, cell)) = best else { return Place::Nothing };
    if towards_B.norm_squared() <= SAME * SAME * way_B.norm_squared() {
        return Place::Foot;
    }
    if mask != 0 {
        return Place::Along(On::of(places(corner, mask).map(|i| near.number(corner.indices[i]))));
    }
    // Inside of the material: over its nearest wall.
    let walls = places(corner, usize::MAX).filter(|&i| !is_solid(cell ^ 1 << i));
    let depth = |i: usize| corner.outward(i, cell >> i).dot(way_B);
    walls
        .min_by(|&i, &j| depth(i).total_cmp(&depth(j)))
        .map_or(Place::Nothing, |i| Place::Along(On::of([near.number(corner.indices[i])])))
}

fn places(corner: &Corner, mask: usize) -> impl Iterator<Item = usize> + use<> {
    (0..corner.count).filter(move |i| mask >> i & 1 == 1)
}

/// Out of a patch at a point of it: 1 along its normal, -1 against it; `None` where it is no boundary.
pub(super) fn free_side(csg: &Csg, near: &Neighbourhood, number: u16, point_B: &Vector3<f64>) -> Option<f64> {
    let index = near.position(number)?;
    let sides = near.sides(csg, point_B);
    let [outside, inside] = [sides & !(1 << index), sides | 1 << index].map(|sides| near.is_solid(sides));
    match (outside, inside) {
        (false, true) => Some(1.0),
        (true, false) => Some(-1.0),
        _ => None,
    }
}

/// A point that is nearer by less, as a share of the way, is the same.
const SAME: f64 = 1e-9;
