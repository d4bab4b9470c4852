//! Walks a god-object over patches, along edges and into corners, towards where friction lets it rest.
//!
//! Problem: the god-object is drawn to the rim of the friction circle, and the way there may lead over edges. Melder
//! (ch. 9.3.2) finds it stuck on each edge for a tick, and repeats the transitions until nothing changes any more.
//!
//! Model: each round looks at what holds the HIP back here ([`stand`]: regenerate transitions, see [`super::corner`]),
//! goes straight along that patch's tangent plane, or along the edge's tangent, and back onto all patches that hold it
//! ([`settle`]: curved edges are iterated onto both). If on the way there a patch is crossed such that the way is barred or
//! what it goes along is no boundary any longer, it stops there: the degenerate transitions, from patch to edge to
//! corner. On curved patches the rim is sought by secants, as on single shapes (`slide.rs`). A HIP in front of all
//! lifts the god-object off; it flies straight to the HIP, and touches again where that way meets the solid.
//!
//! Frames and signs: object frame B; forces are springs on the user (m). Normals point to the free side.
//! Invariants: the god-object is on the boundary. Cost: one to four rounds in common ticks; bounded by
//! [`MAX_ROUNDS`], at which the god-object waits where it is and goes on in the next tick.

use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};

use super::Csg;
use super::corner::Corner;
use super::hit::{Events, Hit, first_hit};
use super::near::{Neighbourhood, Sides};
use super::patch::Look;
use super::way_out::way_out;
use crate::friction_cone::ConeInput;
use crate::friction_law::{FrictionLaw, FrictionMemory, FrictionState};
use crate::grip::{Pull, cut_to, query};
use crate::slide::{Round, Secant};
use crate::surface::{Feature, direction_or_up};
use crate::tangent_view::TangentView;

/// Bound on the rounds of one walk.
pub(super) const MAX_ROUNDS: u32 = 64;
/// Bound on the flights of a god-object within one tick.
const MAX_FLIGHTS: u32 = 8;
/// Stops one after the other without getting anywhere, after which a walk is at its end.
const MAX_STALLS: u32 = 3;

/// Where a god-object is.
#[derive(Debug, Clone, Copy)]
pub(super) struct God {
    pub(super) point_B: Vector3<f64>,
    pub(super) near: Neighbourhood,
    /// Its side of each patch nearby; of those that it is on, the free one.
    pub(super) sides: Sides,
    /// The patches that hold it: one on a patch, two on an edge, more in a corner.
    pub(super) active: Sides,
}

/// Where a walk ended.
#[derive(Debug, Clone, Copy)]
pub(super) struct Walked {
    pub(super) view: TangentView,
    /// Tangential force over stiffness, on the user (m).
    pub(super) tangential_B: Vector3<f64>,
    pub(super) rounds: u32,
}

impl God {
    pub(super) fn hit(hit: &Hit) -> Self {
        Self { point_B: hit.point_B, near: hit.near, sides: hit.sides, active: hit.patch }
    }

    /// What it rests on: curved patches are surfaces, planes faces.
    pub(super) fn feature(&self, csg: &Csg) -> Feature {
        match self.active.count_ones() {
            0 | 1 if self.is_on_planes(csg) => Feature::Face,
            0 | 1 => Feature::Surface,
            2 => Feature::Edge,
            _ => Feature::Vertex,
        }
    }

    /// The number of a patch that it rests on.
    pub(super) fn piece(&self) -> u32 {
        u32::from(self.near.number(self.active.trailing_zeros() as usize % super::near::MAX_NEAR))
    }

    fn is_on_planes(&self, csg: &Csg) -> bool {
        self.held_by().all(|index| self.near.patch(csg, index).is_plane())
    }

    fn held_by(&self) -> impl Iterator<Item = usize> + use<> {
        let active = self.active;
        (0..super::near::MAX_NEAR).filter(move |index| active >> index & 1 == 1)
    }

    /// Whether it rests on one curved patch, inside of it.
    fn is_in_hollow(&self, csg: &Csg) -> bool {
        self.active.count_ones() == 1 && self.active & self.sides != 0 && !self.is_on_planes(csg)
    }

    /// The patches that hold it, by number.
    #[inline]
    fn held_patches(&self) -> [u16; 3] {
        let mut numbers = [u16::MAX; 3];
        for (place, index) in numbers.iter_mut().zip(self.held_by()) {
            *place = self.near.number(index);
        }
        if numbers[1] != u16::MAX {
            numbers.sort_unstable();
        }
        numbers
    }

    fn look_around(&mut self, csg: &Csg, wish_m: f64) {
        let near = Neighbourhood::around(csg, &self.point_B, wish_m.max(COMMON * csg.extent_m));
        let active = self.held_by().filter_map(|index| near.position(self.near.number(index)));
        self.active = active.fold(0, |active, place| active | 1 << place);
        self.sides = near.sides_after(csg, &self.point_B, &self.near, self.sides);
        self.near = near;
    }

    /// What of the boundary is where the god-object is: its sides of what it is not on, and the patches it is on.
    fn corner(&mut self, csg: &Csg, hip_B: &Vector3<f64>) -> Corner {
        let mut corner = Corner::new();
        for index in 0..self.near.count() {
            let patch = self.near.patch(csg, index);
            let level = patch.level(&self.point_B);
            if level.abs() <= csg.tolerance_m() {
                corner.add(index, &patch.look(&self.point_B, hip_B));
            } else {
                let is_inside = usize::from(level <= 0.0);
                self.sides = self.sides & !(1 << index) | is_inside << index;
            }
        }
        corner
    }
}

/// What holds the HIP back where the god-object stands; `None` if it is free and gone.
#[inline]
pub(super) fn stand(csg: &Csg, god: &mut God, input: &ConeInput) -> Option<TangentView> {
    for _ in 0..MAX_FLIGHTS {
        if !god.near.holds(&god.point_B, 0.0) {
            god.look_around(csg, 0.0);
        }
        let corner = god.corner(csg, &input.hip_B);
        match held(csg, god, &corner, input) {
            Held::By(view) => return Some(view),
            Held::Nothing => {
                let hit = first_hit(csg, &god.near, god.sides, &god.point_B, &input.hip_B)?;
                *god = God::hit(&hit);
            }
            Held::Lost => *god = way_out(csg, &god.point_B)?,
        }
    }
    None
}

enum Held {
    By(TangentView),
    /// The HIP is in front of all that is here.
    Nothing,
    /// The god-object is in the material.
    Lost,
}

#[inline]
fn held(csg: &Csg, god: &mut God, corner: &Corner, input: &ConeInput) -> Held {
    let to_hip_B = input.hip_B - god.point_B;
    let release_m = RELEASE * csg.extent_m;
    if corner.count <= 1 {
        let index = corner.indices[0];
        let flipped = god.sides ^ 1 << index;
        let is_solid = [god.sides, flipped].map(|sides| god.near.is_solid(sides));
        if corner.count == 0 || is_solid[0] == is_solid[1] {
            return if is_solid[0] { Held::Lost } else { Held::Nothing };
        }
        if is_solid[0] {
            god.sides = flipped;
        }
        god.active = 1 << index;
        let view = view_of_patch(csg, god, index, &corner.normals_B[0], input);
        return if view.depth_m < -release_m { Held::Nothing } else { Held::By(view) };
    }
    let Some(facing) = corner.facing(&god.near, god.sides, &to_hip_B, release_m) else { return Held::Lost };
    (god.sides, god.active) = (facing.sides, facing.active);
    let place = |index: usize| corner.indices.iter().position(|&i| i == index).unwrap_or(0);
    match facing.active.count_ones() {
        0 => Held::Nothing,
        1 => {
            let index = facing.active.trailing_zeros() as usize;
            Held::By(view_of_patch(csg, god, index, &corner.normals_B[place(index)], input))
        }
        _ => {
            let out_B = facing.way_B - to_hip_B;
            let depth_m = out_B.norm();
            let outward = |sum, index: usize| {
                let normal_B = corner.normals_B[place(index)];
                sum + if facing.sides >> index & 1 == 1 { -normal_B } else { normal_B }
            };
            let between_B = || direction_or_up(&god.held_by().fold(Vector3::zeros(), outward));
            let normal_B = if depth_m > 0.0 { direction_or_up(&out_B) } else { between_B() };
            let offset_m = normal_B.dot(&input.hip_B) + depth_m;
            Held::By(TangentView::new(&god.point_B, normal_B, offset_m, input))
        }
    }
}

#[inline]
fn view_of_patch(
    csg: &Csg,
    god: &God,
    index: usize,
    normal_B: &Vector3<f64>,
    input: &ConeInput,
) -> TangentView {
    let is_turned = god.sides >> index & 1 == 1;
    let normal_B = if is_turned { -normal_B } else { *normal_B };
    let offset_m = match god.near.patch(csg, index) {
        super::patch::Patch::Plane { offset_m, .. } if is_turned => -offset_m,
        super::patch::Patch::Plane { offset_m, .. } => *offset_m,
        super::patch::Patch::Curved(_) => normal_B.dot(&god.point_B),
    };
    TangentView::new(&god.point_B, normal_B, offset_m, input)
}

/// Goes on from where the god-object stands until nothing draws it any further; `None` if it is free and gone.
#[inline]
pub(super) fn walk<L: FrictionLaw + ?Sized>(
    csg: &Csg,
    god: &mut God,
    mut view: TangentView,
    friction: &L,
    (memory, pull): (&FrictionMemory, &Pull),
    input: &ConeInput,
) -> Option<Walked> {
    let start_B = god.point_B;
    let look = |view, direction_before_B: &Vector3<f64>, point_B: &Vector3<f64>| {
        let asked = |query: &_| friction.slide(query, memory);
        Round::new(view, direction_before_B, asked, &(start_B - point_B), pull, input)
    };
    let limit_m = |view: &TangentView| {
        friction.held_limit_m(&query(FrictionState::Slip, view.gap_m, 0.0, view, pull, input), memory)
    };
    let rested = |round: &Round, rounds| {
        // Where friction grows with speed, the circle that it rests in is larger than the one that holds.
        let limit_m = limit_m(&round.view).max(round.gap_m - round.asked_m);
        Walked { view: round.view, tangential_B: cut_to(round.view.lag_B, limit_m), rounds }
    };
    // A god-object that went too far is inside its circle, and its own spring is felt, or none if it is past S.
    let went_too_far = |round: &Round, rounds| {
        let walked = rested(round, rounds);
        if round.gap_m > 0.0 { walked } else { Walked { tangential_B: Vector3::zeros(), ..walked } }
    };
    let arrived = |round: &Round, rounds| Walked { view: round.view, tangential_B: round.rim_B(), rounds };
    let stretch_at = |point_B: &Vector3<f64>| (point_B - input.hip_B).norm_squared();
    let mut round = look(view, &Vector3::zeros(), &god.point_B);
    let (mut secant, mut shortened, mut stalls) = (Secant::default(), 1.0, 0);
    let mut longest = f64::NAN;
    // Force ratio with which it already slides: a curve that falls with speed may hold what rests, but not what slides.
    let mut slides_with = None;
    for rounds in 0..MAX_ROUNDS {
        if round.asked_m > 0.0 && round.view.load_m > 0.0 {
            slides_with = Some((round.gap_m - round.asked_m) / round.view.load_m);
        }
        // Of a secant search even an overshoot is asked back.
        let is_first = longest.is_nan();
        if is_first && round.is_inside_the_circle() {
            return Some(rested(&round, rounds));
        }
        if round.asked_m.is_nan() || round.asked_m.abs() <= round.view.rest_m {
            return Some(arrived(&round, rounds));
        }
        if is_first {
            longest = stretch_at(&round.target_B(round.asked_m)).max(stretch_at(&god.point_B));
            longest *= 1.0 + STRETCH_TOLERANCE;
        }
        let step_m = shortened * secant.step(round.asked_m, round.view.depth_m);
        let (before_B, held_before) = (god.point_B, god.held_patches());
        // From within a bore, the HIP far behind its wall, tangents overshoot; the wall's nearest place is known.
        let foot_B = || settle(csg, god, god.active, &input.hip_B, &input.hip_B);
        let is_foot = is_first && round.asked_m == round.gap_m && god.is_in_hollow(csg);
        let target_B = if is_foot { foot_B() } else { round.target_B(step_m) };
        let moved = advance(csg, god, &target_B, longest, &input.hip_B);
        if moved == Moved::TooFar {
            if round.asked_m < 0.0 && round.gap_m > 0.0 {
                return Some(went_too_far(&round, rounds));
            }
            shortened *= 0.5;
            continue;
        }
        shortened = 1.0;
        if !is_foot {
            secant.made(round.asked_m, step_m);
        }
        view = stand(csg, god, input)?;
        let is_same = moved == Moved::There && god.held_patches() == held_before;
        if is_same {
            round = look(view, &round.direction_B, &god.point_B);
            continue;
        }
        let is_stalled = (god.point_B - before_B).amax() <= csg.tolerance_m();
        stalls = if is_stalled { stalls + 1 } else { 0 };
        round = look(view, &Vector3::zeros(), &god.point_B);
        if stalls >= MAX_STALLS {
            return Some(if round.is_inside_the_circle() {
                rested(&round, rounds)
            } else {
                arrived(&round, rounds)
            });
        }
        if let (Some(ratio), true) = (slides_with, round.asked_m <= 0.0) {
            round.asked_m = round.gap_m - ratio * round.view.load_m;
        }
        (secant, longest) = (Secant::default(), f64::NAN);
    }
    Some(if round.asked_m < 0.0 { went_too_far(&round, MAX_ROUNDS) } else { arrived(&round, MAX_ROUNDS) })
}

/// How far a way led.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Moved {
    /// To the target.
    There,
    /// Not all the way: only as far as the neighbourhood is known, or to where other patches matter.
    Partly,
    /// Nowhere: the target would stretch the spring.
    TooFar,
}

/// Goes to a point of the tangent plane or line, back onto the patches that hold the god-object.
#[inline]
fn advance(csg: &Csg, god: &mut God, target_B: &Vector3<f64>, longest: f64, hip_B: &Vector3<f64>) -> Moved {
    let way_B = target_B - god.point_B;
    let length_m = way_B.norm();
    if !god.near.holds(&god.point_B, length_m) {
        god.look_around(csg, LARGER * length_m);
    }
    let room_m = (god.near.radius_m - (god.point_B - god.near.anchor_B).norm()) * (1.0 - 1e-9);
    let mut share = if length_m > room_m { room_m / length_m } else { 1.0 };
    let is_flat = god.active.count_ones() == 1 && god.is_on_planes(csg);
    let mut moved_B = *target_B;
    for _ in 0..MAX_FLIGHTS {
        let aim_B = if share == 1.0 { *target_B } else { god.point_B + way_B * share };
        moved_B = if is_flat { aim_B } else { settle(csg, god, god.active, &aim_B, hip_B) };
        if god.near.holds(&moved_B, 0.0) {
            break;
        }
        share *= 0.5;
    }
    if !is_flat && (moved_B - hip_B).norm_squared() > longest {
        return Moved::TooFar;
    }
    let from_B = god.point_B;
    let mut sides = god.sides;
    for (crossed_at, index) in Events::along(csg, &god.near, sides, god.active, &from_B, &moved_B).iter() {
        let beyond = sides ^ 1 << index;
        let goes_on =
            !god.near.is_solid(beyond) && god.held_by().all(|held| god.near.is_solid(beyond ^ 1 << held));
        if !goes_on {
            let met_B = from_B + (moved_B - from_B) * crossed_at;
            let onto = god.active | 1 << index;
            let mut edge_B = settle(csg, god, onto, &met_B, hip_B);
            let off_m = (edge_B - met_B).norm();
            if off_m.is_nan() || off_m > (moved_B - from_B).norm() {
                // They hardly meet.
                edge_B = settle(csg, god, god.active, &met_B, hip_B);
            }
            (god.point_B, god.sides) = (edge_B, sides);
            return Moved::Partly;
        }
        sides = beyond;
    }
    (god.point_B, god.sides) = (moved_B, sides);
    if share == 1.0 { Moved::There } else { Moved::Partly }
}

/// The point of all these patches nearest to one that is near them, to first order: Newton's method by the shortest way.
fn settle(csg: &Csg, god: &God, patches: Sides, from_B: &Vector3<f64>, hip_B: &Vector3<f64>) -> Vector3<f64> {
    let mut point_B = *from_B;
    let mut last = f64::INFINITY;
    for _ in 0..MAX_SETTLE_ROUNDS {
        let mut looks = [None; 3];
        let held = (0..god.near.count()).filter(|index| patches >> index & 1 == 1);
        for (place, index) in looks.iter_mut().zip(held) {
            *place = Some(god.near.patch(csg, index).look(&point_B, hip_B));
        }
        let worst = looks.iter().flatten().fold(0.0, |worst: f64, look| worst.max(look.height_m.abs()));
        let resolution_m = 2.0 * f64::EPSILON * point_B.amax();
        // Rounding has the last word.
        if worst.is_nan() || worst <= 0.0 || (worst >= last && worst <= 8.0 * resolution_m) {
            break;
        }
        last = worst;
        point_B += correction(&looks);
        if worst <= resolution_m {
            break;
        }
    }
    point_B
}

/// The shortest step onto the tangent planes.
fn correction(looks: &[Option<Look>; 3]) -> Vector3<f64> {
    match *looks {
        [Some(a), Some(b), Some(c)] => {
            let rows = Matrix3::from_rows(&[a, b, c].map(|look| look.normal_B.transpose()));
            let heights = Vector3::new(a.height_m, b.height_m, c.height_m);
            match rows.try_inverse().filter(|_| rows.determinant().abs() > PARALLEL) {
                Some(inverse) => -(inverse * heights),
                None => correction(&[Some(a), Some(b), None]),
            }
        }
        [Some(a), Some(b), None] => {
            let cosine = a.normal_B.dot(&b.normal_B);
            let determinant = a.normal_B.cross(&b.normal_B).norm_squared();
            if determinant < PARALLEL * PARALLEL {
                return -a.normal_B * a.height_m;
            }
            let inverse = Matrix2::new(1.0, -cosine, -cosine, 1.0) / determinant;
            let shares = inverse * Vector2::new(a.height_m, b.height_m);
            -(a.normal_B * shares.x + b.normal_B * shares.y)
        }
        [Some(a), ..] => -a.normal_B * a.height_m,
        _ => Vector3::zeros(),
    }
}

/// Whether a god-object at rest is a minimum of the distance to a HIP that is outside: pressed through a flat part it
/// is, pressed through a ball it is not, and the finger is let go as from a ball alone.
pub(super) fn holds_outside(csg: &Csg, god: &God, view: &TangentView, input: &ConeInput) -> bool {
    // A hollow holds like a plane.
    if god.is_on_planes(csg) || god.active.count_ones() > 2 || god.is_in_hollow(csg) {
        return true;
    }
    let sharpest_m = god
        .held_by()
        .map(|index| god.near.patch(csg, index).smallest_radius_m(&god.point_B))
        .fold(f64::INFINITY, f64::min);
    if view.depth_m < sharpest_m || csg.is_inside(&input.hip_B) {
        return true;
    }
    let distance_m = |point_B: &Vector3<f64>| (point_B - input.hip_B).norm();
    let here_m = distance_m(&god.point_B);
    let aside_B = direction_or_up(&view.normal_B.cross(&Vector3::ith(view.normal_B.iamin(), 1.0)));
    let other_B = view.normal_B.cross(&aside_B);
    let step_m = PROBE * view.depth_m;
    let is_nearer = |direction_B: Vector3<f64>| {
        let probe_B = settle(csg, god, god.active, &(god.point_B + direction_B * step_m), &input.hip_B);
        distance_m(&probe_B) < here_m
    };
    let directions = [aside_B, other_B, aside_B + other_B, aside_B - other_B];
    // Off its place by the rest of its slide, one way is nearer to first order: both must be.
    !directions.iter().any(|&direction_B| is_nearer(direction_B) && is_nearer(-direction_B))
}

/// A HIP this far in front of a patch is free, in terms of the extent: more than a path that ends there is met before it.
pub(super) const RELEASE: f64 = 4e-12;
/// Radius of a common neighbourhood, in terms of the extent.
const COMMON: f64 = 0.02;
/// A neighbourhood is asked for this much larger than the way.
const LARGER: f64 = 4.0;
/// A square of a length that counts as no longer than another: far above rounding, far below what is felt.
const STRETCH_TOLERANCE: f64 = 1e-9;
/// Bound on Newton's method; patches that touch halve their distance each round.
const MAX_SETTLE_ROUNDS: u32 = 24;
/// Patches closer to parallel than this (rad) have no edge.
const PARALLEL: f64 = 1e-9;
/// Size of a step to the side that tells a minimum from a maximum, in terms of the depth.
const PROBE: f64 = 1e-3;
