//! Seams between pieces of two patches, of which each was cut at places of its own.
//!
//! Model: two patches meet in a curve, and the pieces of either follow it by chords. Each chord gets the other patch's corners
//! that are beside it, so that both follow the same corners and nothing shows through between them. Of two planes all are on one
//! line, and nothing is to be done.
//! Cost: corners of a seam are sorted; each chord looks at those beside it.

use std::collections::BTreeMap;

use nalgebra::Vector3;

use super::cut::{Piece, is_seam};
use super::polygon::{Corner, UNCUT};

/// Corners on the seam of two patches, on pieces of the first.
type Seams = BTreeMap<[u16; 2], Vec<Vector3<f64>>>;

/// Gives pieces the corners of those beside them, where `is_bent` says that chords leave something open.
pub(super) fn sew(pieces: &mut [Piece], is_bent: impl Fn([u16; 2]) -> bool) {
    let mut seams = Seams::new();
    for piece in pieces.iter() {
        let corners = &piece.polygon.corners;
        for (k, corner) in corners.iter().enumerate() {
            let seam = [piece.patch, corner.cut];
            if is_seam(corner.cut) && is_bent(seam) {
                let ends = [corner.place, corners[(k + 1) % corners.len()].place];
                seams.entry(seam).or_default().extend(ends);
            }
        }
    }
    for places in seams.values_mut() {
        places.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)).then(a.z.total_cmp(&b.z)));
        places.dedup();
    }
    for piece in pieces {
        let corners = std::mem::take(&mut piece.polygon.corners);
        for (k, &corner) in corners.iter().enumerate() {
            piece.polygon.corners.push(corner);
            let others = if is_seam(corner.cut) { seams.get(&[corner.cut, piece.patch]) } else { None };
            let next = corners[(k + 1) % corners.len()].place;
            let beside = beside(others.map_or(&[][..], |others| others), &corner.place, &next);
            piece.polygon.corners.extend(beside.into_iter().map(|place| Corner { place, cut: UNCUT }));
        }
    }
}

/// Those of some places that are beside a chord, in their order along it.
fn beside(places: &[Vector3<f64>], from: &Vector3<f64>, to: &Vector3<f64>) -> Vec<Vector3<f64>> {
    let way = to - from;
    let (length, aside_m) = (way.norm(), ASIDE * way.norm());
    let (least, most) = (from.x.min(to.x) - aside_m, from.x.max(to.x) + aside_m);
    let first = places.partition_point(|place| place.x < least);
    let near = places[first..].iter().take_while(|place| place.x <= most).filter_map(|place| {
        let along = (place - from).dot(&way) / (length * length);
        let is_between = along > SAME && along < 1.0 - SAME;
        (is_between && (place - from - way * along).norm() <= aside_m).then_some((along, *place))
    });
    let mut near: Vec<(f64, Vector3<f64>)> = near.collect();
    near.sort_by(|a, b| a.0.total_cmp(&b.0));
    near.into_iter().map(|(_, place)| place).collect()
}

/// Of a chord: farther places are of another bend.
const ASIDE: f64 = 0.15;
/// Of a chord: nearer places are its ends.
const SAME: f64 = 1e-6;
