//! Trial steps of a blocked god-object where tangent planes do not tell which patch holds it.
//!
//! Problem: the active set follows from tangent planes. Where patches touch (a cylinder and its round cap have one tangent
//! plane on their whole seam) these say nothing, and where patches bend away within a step too little. The walk then goes
//! along a patch that ends right there, and the god-object is trapped.
//!
//! Model: all patches within [`Csg::tight_m`] of the god-object count as meeting there. Along each of them, and along the
//! curve of each two, a step towards the HIP is made and brought back onto the patches. It is possible if it ends on the
//! boundary, nearer to the HIP, and if a free path leads there: straight or over the tangent plane, a little above the
//! boundary, so that ledges lower than this are stepped over. None leads from elsewhere into the tip of a gap between walls that
//! are all but parallel: where two patches touch behind an edge, the gap that rounding leaves of it would hold the god-object.
//! The step that ends nearest to the HIP is taken; longer ones are tried first. If none is possible, the god-object is a local
//! minimum of the distance.
//!
//! Frames: object frame B. Invariants: no path leads through material, however thin; no step makes the spring longer.
//! Cost: for each of [`SHARES`], the patches here and their pairs (36 at most), each a settlement and up to nine paths; on
//! common seams two or three patches. No allocation.

use nalgebra::Vector3;

use super::Csg;
use super::advance::is_grazing;
use super::god::{God, places};
use super::hit::{Events, first_hit};
use super::near::{MAX_NEAR, Neighbourhood, Sides};
use super::settle::{Pair, settle};
use crate::surface::direction_or_up;

/// Where a god-object that is barred can go on.
pub(super) enum Detour {
    /// Along other patches.
    Along(God),
    /// Off the boundary: nothing is between it and the HIP.
    Free,
    /// Nowhere: it is at its place.
    None,
}

/// Whether more patches than those that hold the god-object are where it is, or all but there, or two of these are all but
/// parallel.
pub(super) fn is_tight(csg: &Csg, god: &God, hip_B: &Vector3<f64>) -> bool {
    here(csg, god).count_ones() > god.active.count_ones()
        || god.held_by().any(|index| is_grazing(csg, god, index, hip_B))
}

/// The best step of no more than `at_most_m` from where a god-object stands.
#[inline(never)]
pub(super) fn detour(csg: &Csg, god: &God, hip_B: &Vector3<f64>, at_most_m: f64) -> Detour {
    let mut god = *god;
    god.look_around(csg, at_most_m);
    let trial = Trial::new(csg, &god, hip_B);
    let longest_m = at_most_m.min(0.5 * god.near.room_m(&god.point_B));
    let mut best: Option<Landing> = None;
    for share in SHARES {
        let step_m = longest_m * share;
        if step_m < trial.lift_m {
            break;
        }
        if let Some(found) = trial.straight(step_m) {
            return found;
        }
        best = trial.best_along(step_m, best);
        if best.as_ref().is_some_and(|landing| landing.god.active.count_ones() == 1) {
            break;
        }
    }
    best.map_or(Detour::None, |landing| Detour::Along(landing.god))
}

/// Where a step may end.
struct Landing {
    /// From the HIP.
    distance_m: f64,
    god: God,
}

/// The patches that meet where a god-object is.
fn here(csg: &Csg, god: &God) -> Sides {
    let levels_m = god.near.levels_m(csg, &god.point_B);
    let tight_m = csg.tight_m();
    (0..god.near.count()).filter(|&i| levels_m[i].abs() <= tight_m).fold(god.active, |here, i| here | 1 << i)
}

struct Trial<'t> {
    csg: &'t Csg,
    god: &'t God,
    hip_B: &'t Vector3<f64>,
    here: Sides,
    lift_m: f64,
    /// True if the god-object is in the tip of a gap already.
    is_in_gap: bool,
    /// Above the god-object, in the open: away from the HIP, and away from what holds it; and where it is.
    starts: [Start; 3],
}

/// Where ways begin.
#[derive(Clone, Copy)]
struct Start {
    point_B: Vector3<f64>,
    sides: Sides,
}

impl<'t> Trial<'t> {
    fn new(csg: &'t Csg, god: &'t God, hip_B: &'t Vector3<f64>) -> Self {
        let lift_m = LIFT * csg.tight_m();
        let outward_B = |index: usize| {
            let normal_B = god.near.patch(csg, index).look(&god.point_B, hip_B).normal_B;
            if god.sides >> index & 1 == 1 { -normal_B } else { normal_B }
        };
        let away_B =
            direction_or_up(&god.held_by().fold(Vector3::zeros(), |sum, index| sum + outward_B(index)));
        let as_it_is = Start { point_B: god.point_B, sides: god.sides };
        let [up, away] = [up(&god.point_B, hip_B), away_B].map(|direction_B| {
            let point_B = god.point_B + direction_B * lift_m;
            let sides = god.near.sides(csg, &point_B);
            // In a gap that is narrower than that it stays where it is.
            if god.near.is_solid(sides) { as_it_is } else { Start { point_B, sides } }
        });
        let starts = [up, away, as_it_is];
        let is_in_gap = is_in_gap(csg, &god.near, &god.point_B, god.sides, hip_B);
        Self { csg, god, hip_B, here: here(csg, god), lift_m, is_in_gap, starts }
    }

    fn near(&self) -> &Neighbourhood {
        &self.god.near
    }

    /// Towards the HIP, as far as the way is open.
    fn straight(&self, step_m: f64) -> Option<Detour> {
        let [start, ..] = self.starts;
        let to_hip_B = self.hip_B - start.point_B;
        let end_B = start.point_B + to_hip_B * (step_m / to_hip_B.norm()).min(1.0);
        let sides = self.free_sides_after(start.sides, &start.point_B, &end_B)?;
        let hit = first_hit(self.csg, self.near(), sides, &end_B, self.hip_B);
        Some(hit.map_or(Detour::Free, |hit| Detour::Along(God::hit(&hit))))
    }

    /// Along a patch, or the curve of two, whichever leads nearest to the HIP.
    fn best_along(&self, step_m: f64, mut best: Option<Landing>) -> Option<Landing> {
        let here_m = (self.god.point_B - self.hip_B).norm();
        for i in places(self.here) {
            for k in places(self.here).take_while(|&k| k <= i) {
                let Some(point_B) = self.step(1 << i | 1 << k, step_m) else { continue };
                let distance_m = (point_B - self.hip_B).norm();
                let least_m = best.as_ref().map_or(here_m - self.csg.tolerance_m(), |best| best.distance_m);
                if distance_m >= least_m || !self.near().holds(&point_B, self.lift_m) {
                    continue;
                }
                if let Some(god) = self.landed(&point_B, 1 << i | 1 << k) {
                    best = Some(Landing { distance_m, god });
                }
            }
        }
        best
    }

    /// Where a step towards the HIP ends that keeps to these one or two patches.
    fn step(&self, active: Sides, step_m: f64) -> Option<Vector3<f64>> {
        let at_B = &self.god.point_B;
        let to_hip_B = self.hip_B - at_B;
        let look = |index: usize| self.near().patch(self.csg, index).look(at_B, self.hip_B);
        let mut held = places(active);
        let first = look(held.next()?);
        let way_B = match held.next().map(look) {
            None => to_hip_B - first.normal_B * first.normal_B.dot(&to_hip_B),
            Some(second) => {
                let Pair { along_B, sine2, .. } = Pair::of(&[first, second]);
                along_B * (along_B.dot(&to_hip_B) / sine2.max(f64::MIN_POSITIVE))
            }
        };
        let length_m = way_B.norm();
        if length_m.is_nan() || length_m <= self.csg.tolerance_m() {
            return None;
        }
        let aim_B = at_B + way_B * (step_m / length_m).min(1.0);
        let point_B = settle(self.csg, self.god, active, &aim_B, self.hip_B);
        // Patches that hardly meet have no curve.
        ((point_B - aim_B).norm() <= step_m).then_some(point_B)
    }

    /// A god-object on these patches, if they are boundary there, and a way leads there.
    fn landed(&self, point_B: &Vector3<f64>, active: Sides) -> Option<God> {
        let sides = self.free_sides_at(point_B, active)?;
        if !self.is_in_gap && is_in_gap(self.csg, self.near(), point_B, sides, self.hip_B) {
            return None;
        }
        let end_B = point_B + up(point_B, self.hip_B) * self.lift_m;
        if self.near().is_solid(self.near().sides(self.csg, &end_B)) || !self.is_open_way(&end_B) {
            return None;
        }
        Some(God::new(*point_B, *self.near(), sides, active))
    }

    /// Sides of a point on patches such that it is free and each of them a wall. Of others that it is on, either will do.
    fn free_sides_at(&self, point_B: &Vector3<f64>, active: Sides) -> Option<Sides> {
        let near = self.near();
        let levels_m = near.levels_m(self.csg, point_B);
        let (mut sides, mut either) = (0, 0);
        for (index, level_m) in levels_m.iter().enumerate().take(near.count()) {
            sides |= usize::from(*level_m <= 0.0) << index;
            either |= usize::from(level_m.abs() <= self.csg.tolerance_m()) << index;
        }
        // Patches that pass each other by have no curve, however little is between them.
        if active & !either != 0 {
            return None;
        }
        let is_held = |sides: Sides| {
            !near.is_solid(sides) && places(active).all(|index| near.is_solid(sides ^ 1 << index))
        };
        (0..1_usize << MAX_NEAR)
            .filter(|turned| turned & !either == 0)
            .map(|turned| sides ^ turned)
            .find(|&s| is_held(s))
    }

    /// Whether the open leads to a point: straight, or over the tangent plane.
    fn is_open_way(&self, end_B: &Vector3<f64>) -> bool {
        let up_B = up(&self.god.point_B, self.hip_B);
        self.starts.iter().any(|Start { point_B, sides }| {
            if self.free_sides_after(*sides, point_B, end_B).is_some() {
                return true;
            }
            let over_B = end_B + up_B * up_B.dot(&(point_B - end_B));
            let over = self.free_sides_after(*sides, point_B, &over_B);
            over.is_some_and(|sides| self.free_sides_after(sides, &over_B, end_B).is_some())
        })
    }

    /// The sides at the end of a straight way that never enters the material.
    fn free_sides_after(&self, sides: Sides, from_B: &Vector3<f64>, to_B: &Vector3<f64>) -> Option<Sides> {
        let near = self.near();
        if near.is_solid(sides) || !near.holds(to_B, 0.0) {
            return None;
        }
        let mut sides = sides;
        for (_, index) in Events::along(self.csg, near, sides, 0, from_B, to_B).iter() {
            sides ^= 1 << index;
            if near.is_solid(sides) {
                return None;
            }
        }
        Some(sides)
    }
}

/// True of a place in the tip of a gap: on two walls that face each other and are all but parallel.
fn is_in_gap(
    csg: &Csg,
    near: &Neighbourhood,
    point_B: &Vector3<f64>,
    sides: Sides,
    hip_B: &Vector3<f64>,
) -> bool {
    let levels_m = near.levels_m(csg, point_B);
    let is_wall = |i: usize| levels_m[i].abs() <= csg.tolerance_m() && near.is_solid(sides ^ 1 << i);
    let walls = (0..near.count()).filter(|&i| is_wall(i)).fold(0, |walls, i| walls | 1 << i);
    let outward_B = |i: usize| {
        let normal_B = near.patch(csg, i).look(point_B, hip_B).normal_B;
        if sides >> i & 1 == 1 { -normal_B } else { normal_B }
    };
    !near.is_solid(sides)
        && places(walls)
            .any(|i| places(walls).take_while(|&k| k < i).any(|k| outward_B(i).dot(&outward_B(k)) < FACING))
}

/// Away from the HIP.
fn up(point_B: &Vector3<f64>, hip_B: &Vector3<f64>) -> Vector3<f64> {
    let up_B = point_B - hip_B;
    let length_m = up_B.norm();
    if length_m > 0.0 { up_B / length_m } else { up_B }
}

/// How far above the boundary ways lead, in terms of what counts as one place: over all that is in it.
const LIFT: f64 = 2.0;
/// Cosine between walls that face each other under less than a thousandth (rad).
const FACING: f64 = -1.0 + 5e-7;
/// Of the step that is asked for.
const SHARES: [f64; 6] = [1.0, 0.125, 0.015_625, 2e-3, 2.5e-4, 3e-5];
