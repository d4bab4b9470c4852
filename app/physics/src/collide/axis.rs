//! Along which direction two convex forms touch, and how deep.
//!
//! Model: the direction n (from B to A) in which the gap between the cores is locally largest, `s(n) = min n.a - max n.b`.
//! Apart, that is the direction of their distance, and there is only one. Deep in each other there are several, as there
//! are several ways out of a wall; the one that continues the direction of the last tick is the one they came by. It is
//! found with the cores moved apart along the last direction until there is a little room between them: their nearest
//! points are then a better direction, and a direction that is found again is the one sought. On flat pieces that takes
//! one turn, on curved ones each turn leaves a share of `depth / radius of curvature` of the error.
//! Invariants: n has unit length; continuous where the pose is, as long as the depth is less than the inner radius of
//! either.
//! Cost: that of [`follow`] if the direction of the last tick can be followed; otherwise bounded by [`MAX_TURNS`]
//! searches, mostly one or two; where a mesh is deeper than [`DEEP`] allows, some hundred farthest points besides.

use haptics::mesh::Mesh;
use nalgebra::Vector3;

use super::convex::{Convex, Core, farthest_corner};
use super::follow::follow;
use super::gjk::Gap;

/// Where two cores touch.
#[derive(Debug, Clone, Copy)]
pub(super) struct Axis {
    /// n, unit, from B to A.
    pub(super) normal: Vector3<f64>,
    /// s between the cores, negative if they overlap \[m\].
    pub(super) gap_m: f64,
    /// A core's point of A at which they touch.
    pub(super) on_a: Vector3<f64>,
}

const MAX_TURNS: usize = 4;
/// Turns that change the direction by less end the search.
const FOUND: f64 = 1e-5;
/// The room between the cores, of the smaller one's inner radius.
const ROOM: f64 = 0.05;
/// Less deep than this share of the smaller inner radius, a direction that could be followed is right.
const SHALLOW: f64 = 0.25;
/// Gaps that differ by this share of it are the same: rounding.
const SAME: f64 = 1e-12;
/// What a search leaves open is less.
const NEAR: f64 = 1e-3;
/// As deep as this share of the smaller inner radius, other ways out are looked at.
const DEEP: f64 = 0.75;
/// Of so few faces of a mesh each is looked at.
const FEW_FACES: usize = 48;
/// Another way out must be shorter by this.
const SHORTER: f64 = 0.5;

/// `last`: the direction in the last tick, if there was one.
pub(super) fn find(a: &Convex<'_>, b: &Convex<'_>, last: Option<Vector3<f64>>) -> Axis {
    let inner_m = a.inner_m().min(b.inner_m());
    let radii_m = a.radius_m + b.radius_m;
    let room_m = ROOM * inner_m;
    if let Some((normal, on_a)) = last.and_then(|last| follow(a, b, &last)) {
        let axis = Axis { on_a, ..Axis::along(a, b, normal) };
        // Not so deep that it might have come out on another side, and no way down.
        let is_better = last.is_some_and(|last| axis.gap_m >= separation(a, b, &last) - SAME * inner_m);
        if is_better && radii_m - axis.gap_m < SHALLOW * inner_m {
            return axis;
        }
    }
    let start = match last {
        Some(last) if separation(a, b, &last) >= 0.0 => last,
        last => apart(a, b, room_m).unwrap_or_else(|| last.unwrap_or_else(|| shortest_way_out(a, b))),
    };
    let axis = ascend(a, b, start, room_m);
    let depth_m = radii_m - axis.gap_m;
    if depth_m > DEEP * inner_m {
        let other = ascend(a, b, shortest_way_out(a, b), room_m);
        if radii_m - other.gap_m < SHORTER * depth_m {
            return other;
        }
    }
    axis
}

impl Axis {
    fn along(a: &Convex<'_>, b: &Convex<'_>, normal: Vector3<f64>) -> Self {
        let on_a = a.support(&-normal);
        Self { normal, gap_m: normal.dot(&(on_a - b.support(&normal))), on_a }
    }
}

/// `s(n)`.
fn separation(a: &Convex<'_>, b: &Convex<'_>, normal: &Vector3<f64>) -> f64 {
    normal.dot(&(a.support(&-normal) - b.support(normal)))
}

/// The direction of their distance; `None` if the cores overlap.
fn apart(a: &Convex<'_>, b: &Convex<'_>, room_m: f64) -> Option<Vector3<f64>> {
    let gap = Gap { a, b, shift: Vector3::zeros() };
    let start = unit(&(a.middle() - b.middle())).unwrap_or_else(Vector3::y);
    unit(&gap.nearest(&start, APART * room_m)?.away)
}

/// Nearer than this share of the room, a direction is not told from their distance.
const APART: f64 = 1e-6;

/// The nearest direction in which the gap is largest.
fn ascend(a: &Convex<'_>, b: &Convex<'_>, mut normal: Vector3<f64>, room_m: f64) -> Axis {
    let mut axis = Axis::along(a, b, normal);
    for _ in 0..MAX_TURNS {
        let shift = normal * (room_m - axis.gap_m).max(0.0);
        let Some(nearest) = (Gap { a, b, shift }).nearest(&normal, 0.0) else { break };
        let Some(next) = unit(&nearest.away) else { break };
        let turned = (next - normal).norm_squared();
        normal = next;
        axis = Axis { normal, gap_m: separation(a, b, &normal), on_a: nearest.on_a };
        if turned < FOUND * FOUND {
            break;
        }
    }
    // To the last digit, if it can be had.
    match follow(a, b, &normal) {
        Some((exact, on_a)) if (exact - normal).norm_squared() < NEAR * NEAR => {
            let exact = Axis { on_a, ..Axis::along(a, b, exact) };
            if exact.gap_m >= axis.gap_m - SAME * room_m { exact } else { axis }
        }
        _ => axis,
    }
}

/// Of the directions in which faces look, and that between the middles, the one with the largest gap.
fn shortest_way_out(a: &Convex<'_>, b: &Convex<'_>) -> Vector3<f64> {
    let between = a.middle() - b.middle();
    let mut best = unit(&between).unwrap_or_else(Vector3::y);
    let mut best_m = separation(a, b, &best);
    for (form, sign) in [(a, -1.0), (b, 1.0)] {
        if let Core::Hull(mesh) = form.core {
            for_each_way(mesh, |way| {
                let normal = form.rotation * (way * sign);
                let gap_m = separation(a, b, &normal);
                if gap_m > best_m {
                    (best, best_m) = (normal, gap_m);
                }
            });
            continue;
        }
        for axis in 0..3 {
            let along: Vector3<f64> = form.rotation.column(axis).into();
            for mut normal in [along, -along] {
                // Around an axis every direction is one: the one that leads away.
                if axis != 1 && !matches!(form.core, Core::Box { .. }) {
                    let axis_y: Vector3<f64> = form.rotation.column(1).into();
                    let across = between - axis_y * axis_y.dot(&between);
                    normal = unit(&across).unwrap_or(normal);
                }
                let gap_m = separation(a, b, &normal);
                if gap_m > best_m {
                    (best, best_m) = (normal, gap_m);
                }
            }
        }
    }
    best
}

/// Directions in which faces of a convex mesh look: of many, those around what lies farthest out on all sides, and these sides.
fn for_each_way(mesh: &Mesh, mut visit: impl FnMut(&Vector3<f64>)) {
    if mesh.faces().len() <= FEW_FACES {
        return mesh.faces().iter().for_each(|face| visit(&face.normal_B));
    }
    for side in (0..27).filter(|side| *side != 13) {
        let way = Vector3::from([side % 3, side / 3 % 3, side / 9].map(|at| f64::from(at) - 1.0)).normalize();
        visit(&way);
        farthest_corner(mesh, &way).for_each_face(mesh, |face| visit(&face.normal_B));
    }
}

pub(super) fn unit(v: &Vector3<f64>) -> Option<Vector3<f64>> {
    let length = v.norm();
    (length > 1e-140 && length.is_finite()).then(|| v / length)
}
