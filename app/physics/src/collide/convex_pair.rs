//! Contact points of two convex forms.
//!
//! Model: along the direction in which they touch ([`axis`](super::axis)), lines cross ([`lines`](super::lines)) or there is
//! a single point, and flat pieces carry what stands on them ([`overlay`](super::overlay)): that alone where one looks
//! exactly along it. Places that are found twice count once ([`spots`](super::spots)).
//! Frames: that of the second form, B.
//! Memory: words 0 to 2 the direction, 3 whether there is one, 4 and 5 where the points of the rims of A and B begin.

use haptics::Form;
use nalgebra::{Isometry3, Vector3};

use super::PairMemory;
use super::axis;
use super::convex::{Convex, Core};
use super::facet::{Facet, Plate};
use super::lines::Alongside;
use super::overlay::{Overlay, Side};
use super::rim;
use super::spots::{Spot, Spots};

/// A face looks along the contact if it is turned from it by less \[1 - cosine\].
const LOOKS_ALONG: f64 = 5e-9;
const SINGLE_ID: u32 = 1100;

/// nothing if either is no convex form.
pub(super) fn contact(
    a: &Form,
    X_BA: &Isometry3<f64>,
    b: &Form,
    reach_m: f64,
    memory: &mut PairMemory,
) -> Spots {
    let placed = (Convex::of(a, X_BA), Convex::of(b, &Isometry3::identity()));
    let (Some(a), Some(b)) = placed else { return Spots::default() };
    let mut spots = Spots::within(reach_m, a.inner_m().min(b.inner_m()));
    let [x, y, z, is_known, ..] = memory.words;
    let last = (is_known == 1.0).then(|| Vector3::new(x, y, z));
    let found = axis::find(&a, &b, last);
    let n = found.normal;
    memory.words[..4].copy_from_slice(&[n.x, n.y, n.z, 1.0]);
    let gap_m = found.gap_m - a.radius_m - b.radius_m;
    if gap_m > reach_m {
        return spots;
    }
    let facets = [Facet::of(&a, &-n), Facet::of(&b, &n)];
    let looks_along = |facet: &Facet| match facet {
        Facet::Plate(plate) => Some(plate.normal).filter(|normal| normal.dot(&n).abs() > 1.0 - LOOKS_ALONG),
        _ => None,
    };
    let exact = looks_along(&facets[1]).or_else(|| looks_along(&facets[0]).map(|normal| -normal));
    let on_a = found.on_a - n * a.radius_m;
    if exact.is_none() {
        match [Facet::edge_of(&a, &-n), Facet::edge_of(&b, &n)] {
            [Facet::Line(line_a), Facet::Line(line_b)] => {
                let radii_m = [a.radius_m, b.radius_m];
                Alongside { lines: [line_a, line_b], radii_m, normal: n, gap_m, on_a }.find(&mut spots);
            }
            _ => spots.push(Spot { id: SINGLE_ID, on_a, normal: n, gap_m }),
        }
    }
    // Where faces nearly look along it, their corners are hardly less deep than the edges that touch.
    let sides = [(0, a.radius_m), (1, b.radius_m)];
    let sides = sides.map(|(of, radius_m)| Side { facet: facets[of], radius_m });
    let normal = exact.unwrap_or(n);
    Overlay { sides, normal, angles: &mut memory.words[4..6], spots: &mut spots }.find();
    if spots.is_empty() {
        spots.push(Spot { id: SINGLE_ID, on_a, normal: n, gap_m });
    }
    spots
}

/// On a half-space, whose frame is B; nothing if A is no convex form.
pub(super) fn on_plane(
    a: &Form,
    X_BA: &Isometry3<f64>,
    plane: &haptics::Plane,
    reach_m: f64,
    memory: &mut PairMemory,
) -> Spots {
    let Some(a) = Convex::of(a, X_BA) else { return Spots::default() };
    let mut spots = Spots::within(reach_m, a.inner_m());
    let normal = plane.normal_B();
    let ground = Plate::endless(normal * plane.offset_m(), normal);
    if let Core::Box { half_m } = a.core {
        for number in 0..8_u32 {
            let corner =
                half_m.map_with_location(|axis, _, half| if number >> axis & 1 == 1 { half } else { -half });
            let on_a = a.placed_point(&corner);
            spots.push(Spot { id: number, on_a, normal, gap_m: normal.dot(&on_a) - plane.offset_m() });
        }
        return spots;
    }
    if let Core::Frustum { .. } = a.core {
        rim::on_plane(&a, plane, &mut memory.words[4], &mut spots);
        return spots;
    }
    let sides = [
        Side { facet: Facet::of(&a, &-normal), radius_m: a.radius_m },
        Side { facet: Facet::Plate(ground), radius_m: 0.0 },
    ];
    Overlay { sides, normal, angles: &mut memory.words[4..6], spots: &mut spots }.find();
    spots
}
