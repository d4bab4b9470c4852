//! Finds what is near a point.
//!
//! Model: the patches of the [cell](super::cells) there within a radius are listed, and its tree becomes a [table](super::table)
//! over their sides. A leaf that one of its farther patches leaves out is nothing, whatever its others say: they need no
//! place in the list.
//! Cost: a level per patch of the cell.

use nalgebra::Vector3;

use super::cells::Part;
use super::crowd::Crowd;
use super::near::Neighbourhood;
use super::table::{EVERYTHING, NOTHING, Table, cut, evaluate};
use super::{Csg, Item};

/// The patches within a radius, or from which distance on there would be too many.
pub(super) fn gather(
    csg: &Csg,
    anchor_B: &Vector3<f64>,
    radius_m: f64,
    keep_eight: bool,
) -> Result<Neighbourhood, f64> {
    gather_from(csg, &csg.cells.part(anchor_B, radius_m, u32::MAX), anchor_B, radius_m, keep_eight)
}

/// The same from a part of the tree that is true within the radius.
#[inline]
pub(super) fn gather_from(
    csg: &Csg,
    part: &Part<'_>,
    anchor_B: &Vector3<f64>,
    radius_m: f64,
    keep_eight: bool,
) -> Result<Neighbourhood, f64> {
    let mut here = Neighbourhood::nowhere(anchor_B);
    here.radius_m = radius_m;
    let mut crowd = Crowd::new();
    let table = evaluate(part.steps, |first, count| {
        leaf(csg, &mut here, &mut crowd, part.items(first, count), keep_eight)
    });
    if crowd.is_too_large() && !keep_eight {
        return Err(crowd.ninth_m());
    }
    here.table = table;
    Ok(here)
}

/// Whether a leaf is inside, for every combination of sides.
#[inline]
fn leaf(csg: &Csg, here: &mut Neighbourhood, crowd: &mut Crowd, items: &[Item], keep_eight: bool) -> Table {
    let mut heights_m = [f64::INFINITY; MAX_ITEMS];
    for (item, height_m) in items.iter().zip(&mut heights_m) {
        let level = csg.patches[usize::from(item.patch)].level(&here.anchor_B);
        let is_inside = (level <= 0.0) != item.is_flipped;
        *height_m = level.abs();
        if *height_m > here.radius_m && !is_inside {
            return NOTHING;
        }
    }
    let mut inside = EVERYTHING;
    for (item, &height_m) in items.iter().zip(&heights_m) {
        if height_m > here.radius_m {
            continue;
        }
        let listed = here.position(item.patch).or_else(|| here.list(item.patch, height_m, crowd));
        match listed {
            Some(index) => inside = cut(&inside, index, item.is_flipped),
            // Nowhere to list it. If it cannot be helped, the leaf is as if it went on there.
            None if keep_eight => {}
            // It will have to be smaller: whatever is farther need not be looked at any more.
            None => here.radius_m = here.radius_m.min(crowd.ninth_m()),
        }
    }
    inside
}

/// The most patches of a leaf: a box has as many.
const MAX_ITEMS: usize = 6;
