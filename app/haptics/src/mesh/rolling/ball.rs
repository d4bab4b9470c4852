//! A ball that touches a mesh: what it rests on, how it moves along that, and where something else stops it.
//!
//! Model: its centre C stays where no face is nearer than the radius r: on the mesh grown by r. Over a face that is a
//! plane, round an edge a cylinder, round a vertex a sphere; where the mesh is concave, C lies where two or three of
//! them meet. Moved along the tangent planes of what it rests on, C is brought back onto them by Newton's method, the
//! feet on the mesh walking along. Then the hierarchy of boxes is asked whether anything else is nearer than r; if
//! so, the move ends where that is first touched.
//!
//! Invariants: a move begins and ends where nothing is nearer than r; it is no longer than half of r, so that C, with
//! room of r around it, cannot come to the other side of anything.
//! Cost: a walk of each foot and one bounded query; at something new some ten walks more.

use std::cell::Cell;

use nalgebra::Vector3;

use super::foot::Foot;
use super::press::{MOST, Plane, onto, press};
use super::vicinity::Vicinity;
use crate::friction_cone::ConeInput;
use crate::mesh::bvh::TooMany;
use crate::mesh::{Mesh, Nearest};
use crate::surface::{Feature, direction_or_up};
use crate::tangent_view::{TangentView, tangential};

/// A ball and what it touches.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ball {
    pub(super) centre_B: Vector3<f64>,
    pub(super) radius_m: f64,
    rests: [Rest; MOST],
    count: usize,
    /// The move came to a feature that stands in its way: the centre is where it was to go, nearer than it may be.
    pub(super) is_blocked: bool,
}

/// A feature that it touches.
#[derive(Debug, Clone, Copy)]
pub(super) struct Rest {
    pub(super) foot: Foot,
    pub(super) normal_B: Vector3<f64>,
    /// `normal . x` of the centre when it touches \[m\].
    offset_m: f64,
    /// What presses on it, as a spring \[m\].
    pub(super) load_m: f64,
}

/// What it sees of the HIP.
#[derive(Debug, Clone, Copy)]
pub(super) struct Look {
    pub(super) view: TangentView,
    /// The sum of all loads along their normals \[m\].
    pub(super) normal_spring_B: Vector3<f64>,
    /// The HIP is clear of all that it touches.
    pub(super) is_free: bool,
}

/// What was done in a tick already, in places that were looked at.
#[derive(Debug, Default)]
pub(super) struct Work(Cell<u32>);

impl Work {
    fn look(&self) {
        self.0.set(self.0.get().saturating_add(1));
    }

    /// Whether the rest has to wait for the next tick.
    pub(super) fn is_enough(&self) -> bool {
        self.0.get() >= MOST_WORK
    }
}

/// How much of a flight is done in a tick; the rest in the next ones.
#[derive(Debug, Clone, Copy)]
pub(super) struct Flight {
    most_leaps: usize,
    /// How long a leap is looked ahead for, in radii: farther costs more.
    farthest: f64,
}

impl Flight {
    /// One that was met in free space went all the way already.
    pub(super) const TO_THE_END: Self = Self { most_leaps: 64, farthest: f64::INFINITY };
    pub(super) const OF_A_BALL_THAT_TOUCHES: Self = Self { most_leaps: 20, farthest: 2.0 };
}

impl Ball {
    pub(super) fn in_free_space(centre_B: Vector3<f64>, radius_m: f64) -> Self {
        let foot =
            Foot { face: 0, feature: Feature::None, corner: 0, point_B: centre_B, squared_m2: f64::INFINITY };
        let rest = Rest { foot, normal_B: Vector3::y(), offset_m: 0.0, load_m: 0.0 };
        Self { centre_B, radius_m, rests: [rest; MOST], count: 0, is_blocked: false }
    }

    pub(super) fn rests(&self) -> &[Rest] {
        self.rests.get(..self.count).unwrap_or_default()
    }

    fn rests_mut(&mut self) -> &mut [Rest] {
        self.rests.get_mut(..self.count).unwrap_or_default()
    }

    /// What is pressed most.
    pub(super) fn primary(&self) -> Option<&Rest> {
        let mut best = self.rests().first()?;
        for rest in self.rests() {
            if rest.load_m > best.load_m {
                best = rest;
            }
        }
        Some(best)
    }

    /// Finds out what the HIP presses on, and how the rest of the spring lies to it.
    #[inline(always)]
    pub(super) fn look(&mut self, mesh: &Mesh, input: &ConeInput) -> Look {
        let centre_B = self.centre_B;
        if let [rest] = self.rests_mut() {
            let view = TangentView::new(&centre_B, rest.normal_B, rest.offset_m, input);
            rest.load_m = view.load_m;
            let is_free = view.depth_m < -tolerance_m(mesh, self.radius_m);
            return Look { normal_spring_B: view.normal_B * view.load_m, view, is_free };
        }
        self.look_at_many(mesh, input)
    }

    #[inline(never)]
    fn look_at_many(&mut self, mesh: &Mesh, input: &ConeInput) -> Look {
        let (planes, count) = self.planes();
        let planes = &planes[..count];
        let pressed = press(planes, &input.hip_B);
        for (rest, load_m) in self.rests_mut().iter_mut().zip(pressed.loads_m) {
            rest.load_m = load_m;
        }
        let nearest = planes.iter().map(|plane| distance(plane, &input.hip_B)).enumerate();
        let deepest = nearest.min_by(|(_, a), (_, b)| a.total_cmp(b));
        let set = self.held();
        if set.count_ones() <= 1 {
            // Zero counts as contact.
            let (index, height_m) = deepest.unwrap_or((0, f64::INFINITY));
            let index = if set == 0 { index } else { set.trailing_zeros() as usize };
            let (normal_B, offset_m) =
                planes.get(index).copied().unwrap_or((Vector3::y(), f64::NEG_INFINITY));
            let view = TangentView::new(&self.centre_B, normal_B, offset_m, input);
            if let Some(rest) = self.rests_mut().get_mut(index) {
                rest.load_m = view.load_m;
            }
            let is_near = height_m <= tolerance_m(mesh, self.radius_m);
            let is_free = set == 0 && !is_near;
            return Look { normal_spring_B: normal_B * view.load_m, view, is_free };
        }
        let out_B = pressed.point_B - input.hip_B;
        let normal_B = direction_or_up(&out_B);
        let mut view =
            TangentView::new(&self.centre_B, normal_B, normal_B.dot(&input.hip_B) + out_B.norm(), input);
        view.lag_B = self.free_part(&(self.centre_B - pressed.point_B));
        view.gap_m = view.lag_B.norm();
        let mut normal_spring_B = Vector3::zeros();
        view.load_m = 0.0;
        for rest in self.rests_mut() {
            if rest.load_m > 0.0 {
                let approach_m_s = -rest.normal_B.dot(&input.hip_velocity_B);
                rest.load_m = (rest.load_m + input.damping_s() * approach_m_s).max(0.0);
                normal_spring_B += rest.normal_B * rest.load_m;
                // Each contact has its own friction cone: in a groove their loads add, not their forces.
                view.load_m += rest.load_m;
            } else {
                rest.load_m = 0.0;
            }
        }
        Look { view, normal_spring_B, is_free: false }
    }

    /// The part of a vector along which it can move and stay on all that it presses on.
    pub(super) fn free_part(&self, v: &Vector3<f64>) -> Vector3<f64> {
        let mut held = self.rests().iter().filter(|rest| rest.load_m > 0.0).map(|rest| rest.normal_B);
        match (held.next(), held.next(), held.next()) {
            (Some(a), None, _) => tangential(v, &a),
            (Some(a), Some(b), None) => {
                let along = direction_or_up(&a.cross(&b));
                along * along.dot(v)
            }
            (Some(_), Some(_), Some(_)) => Vector3::zeros(),
            (None, ..) => *v,
        }
    }

    fn held(&self) -> u8 {
        self.rests().iter().enumerate().fold(0, |set, (i, rest)| set | u8::from(rest.load_m > 0.0) << i)
    }

    fn planes(&self) -> ([Plane; MOST], usize) {
        (self.rests.map(|rest| (rest.normal_B, rest.offset_m)), self.count)
    }

    /// Where it is if its centre moves straight to `target_B` and is brought back onto what it presses on.
    ///
    /// Nothing is said of other features that may be in the way.
    #[inline(always)]
    pub(super) fn rolled_to(&self, mesh: &Mesh, target_B: &Vector3<f64>) -> Self {
        let mut ball = *self;
        ball.centre_B = *target_B;
        let near_m = tolerance_m(mesh, self.radius_m);
        if let [rest] = ball.rests_mut() {
            let face = rest.foot.face;
            rest.walk(mesh, target_B, self.radius_m);
            let missing_m = rest.offset_m - rest.normal_B.dot(target_B);
            // Pushed out it would come farther from the HIP, and over the fold in which it belongs.
            let is_blocked = missing_m > near_m && rest.foot.face != face;
            if !is_blocked {
                ball.centre_B = target_B + rest.normal_B * missing_m;
            }
            ball.is_blocked = is_blocked;
            return ball;
        }
        ball.is_blocked = ball.is_led_into_a_fold(mesh);
        if !ball.is_blocked {
            ball.settle(mesh);
        }
        ball
    }

    #[inline(never)]
    fn is_led_into_a_fold(&self, mesh: &Mesh) -> bool {
        let near_m = tolerance_m(mesh, self.radius_m);
        self.rests().iter().filter(|rest| rest.load_m > 0.0).any(|rest| {
            let mut there = *rest;
            there.walk(mesh, &self.centre_B, self.radius_m);
            let height_m = distance(&(there.normal_B, there.offset_m), &self.centre_B);
            height_m < -near_m && there.foot.face != rest.foot.face
        })
    }

    #[inline(never)]
    fn settle(&mut self, mesh: &Mesh) {
        let near_m = tolerance_m(mesh, self.radius_m);
        let mut set_of_old = self.held();
        for _ in 0..MOST_CORRECTIONS {
            set_of_old = self.walk_all(mesh, set_of_old);
            let (planes, count) = self.planes();
            let planes = &planes[..count];
            // What it leaves must not be in the way either.
            for (i, plane) in planes.iter().enumerate() {
                set_of_old |= u8::from(distance(plane, &self.centre_B) < -near_m) << i;
            }
            let most_of_three = if set_of_old.count_ones() > 3 { 0b0111 } else { set_of_old };
            let Some(settled_B) = onto(planes, most_of_three, &self.centre_B) else { break };
            let moved_m = (settled_B - self.centre_B).amax();
            self.centre_B = settled_B;
            if moved_m <= 0.1 * near_m {
                break;
            }
        }
        self.drop_what_is_left(mesh, set_of_old);
    }

    /// Takes all feet along; of two that meet one is enough. Returns the set with its members' new numbers.
    fn walk_all(&mut self, mesh: &Mesh, set: u8) -> u8 {
        let (mut kept, mut kept_set) = (0, 0);
        for i in 0..self.count {
            let mut rest = self.rests[i];
            rest.walk(mesh, &self.centre_B, self.radius_m);
            let is_held = set >> i & 1;
            let near_m = SAME_FOOT * self.radius_m;
            let same = (0..kept).find(|&j| (self.rests[j].foot.point_B - rest.foot.point_B).amax() <= near_m);
            let place = same.unwrap_or(kept);
            if same.is_none() {
                self.rests[kept] = rest;
                kept += 1;
            }
            kept_set |= is_held << place;
        }
        self.count = kept;
        kept_set
    }

    fn drop_what_is_left(&mut self, mesh: &Mesh, held: u8) {
        let far_m = BAND * self.radius_m + tolerance_m(mesh, self.radius_m);
        let mut kept = 0;
        for i in 0..self.count {
            let rest = self.rests[i];
            let is_touched = distance(&(rest.normal_B, rest.offset_m), &self.centre_B) <= far_m;
            if is_touched || held >> i & 1 == 1 {
                self.rests[kept] = rest;
                kept += 1;
            }
        }
        self.count = kept;
    }

    /// What is nearer than it should be.
    #[inline(always)]
    pub(super) fn obstacle(&self, mesh: &Mesh) -> Result<Option<Nearest>, TooMany> {
        let near_m = self.radius_m - tolerance_m(mesh, self.radius_m);
        match self.rests() {
            [] => mesh.nearest_within(&self.centre_B, near_m),
            [rest, ..] => {
                // Below the plane through the lowest point of that smaller ball nothing reaches into it.
                let offset_m = rest.normal_B.dot(&self.centre_B) - near_m;
                mesh.nearest_above(&self.centre_B, near_m, (&rest.normal_B, offset_m))
            }
        }
    }

    /// As [`Self::obstacle`]; `start_B` is where it was when the tick began.
    #[inline(always)]
    pub(super) fn obstacle_near(
        &self,
        mesh: &Mesh,
        vicinity: &mut Vicinity,
        start_B: &Vector3<f64>,
    ) -> Result<Option<Nearest>, TooMany> {
        let near_m = self.radius_m - tolerance_m(mesh, self.radius_m);
        let moved_m = (self.centre_B - start_B).norm();
        let is_clear = self
            .rests()
            .first()
            .is_some_and(|rest| vicinity.is_clear(mesh, &self.centre_B, &rest.normal_B, near_m, moved_m));
        if is_clear { Ok(None) } else { self.obstacle(mesh) }
    }

    /// Where it is pushed out of a feature that it came too near to.
    #[inline(never)]
    pub(super) fn pushed_out_of(&self, mesh: &Mesh, face: u32) -> Self {
        let mut ball = *self;
        ball.add(mesh, face);
        ball.settle(mesh);
        ball
    }

    /// Where it is in a fold that it is led into on its way to `target_B`: on what it rests on now and on what its feet
    /// come to there.
    #[inline(never)]
    pub(super) fn in_the_fold(&self, mesh: &Mesh, target_B: &Vector3<f64>) -> Self {
        let near_m = tolerance_m(mesh, self.radius_m);
        let mut ball = *self;
        ball.centre_B = *target_B;
        for rest in self.rests().iter().filter(|rest| rest.load_m > 0.0) {
            let mut there = *rest;
            there.walk(mesh, target_B, self.radius_m);
            let height_m = distance(&(there.normal_B, there.offset_m), target_B);
            if height_m < -near_m && there.foot.face != rest.foot.face && ball.count < MOST {
                ball.rests[ball.count] = there;
                ball.count += 1;
            }
        }
        // Onto planes as they are: walked there, both feet would be the same.
        let (planes, count) = ball.planes();
        let pressed = press(&planes[..count], target_B);
        for (rest, load_m) in ball.rests_mut().iter_mut().zip(pressed.loads_m) {
            rest.load_m = rest.load_m.max(load_m);
        }
        ball.centre_B = pressed.point_B;
        ball.settle(mesh);
        ball
    }

    /// As [`Self::rolled_to`], as far as nothing else is in the way; by half of its radius at the most.
    pub(super) fn rolled_until(&self, mesh: &Mesh, target_B: &Vector3<f64>, work: &Work) -> Self {
        let way_B = target_B - self.centre_B;
        let way_m = way_B.norm();
        let longest_m = 0.5 * self.radius_m;
        let way_B = if way_m > longest_m { way_B * (longest_m / way_m) } else { way_B };
        self.first_touch(mesh, work, |share| self.rolled_to(mesh, &(self.centre_B + way_B * share)))
            .unwrap_or(*self)
    }

    /// Straight to `target_B` through free space: it is there, or where it first touches something.
    ///
    /// `None` where it began with something nearer than it may be.
    #[inline(never)]
    pub(super) fn flown_to(&self, mesh: &Mesh, target_B: &Vector3<f64>, flight: Flight) -> Option<Self> {
        let radius_m = self.radius_m;
        let mut ball = Self::in_free_space(self.centre_B, radius_m);
        for _ in 0..flight.most_leaps {
            let way_B = target_B - ball.centre_B;
            let left_m = way_B.norm();
            let ahead_m = left_m.min(flight.farthest * radius_m);
            let near = mesh.nearest_within(&ball.centre_B, radius_m + ahead_m).ok()?;
            let safe_m = near.map_or(ahead_m, |near| near.distance_m - radius_m);
            if safe_m >= left_m {
                return Some(Self::in_free_space(*target_B, radius_m));
            }
            if safe_m < -2.0 * tolerance_m(mesh, radius_m) {
                return None;
            }
            // Along a surface nothing is safe: some way, and a look back.
            let leap_m = safe_m.max(SHORTEST_LEAP * radius_m).min(left_m);
            let leap_B = way_B * (leap_m / left_m);
            let from_B = ball.centre_B;
            ball = ball.first_touch(mesh, &Work::default(), |share| {
                Self::in_free_space(from_B + leap_B * share, radius_m)
            })?;
            if ball.count > 0 || leap_m >= left_m {
                return Some(ball);
            }
        }
        Some(ball)
    }

    /// The end of a path, or where on it something new is first touched; `None` if that cannot be told.
    fn first_touch(&self, mesh: &Mesh, work: &Work, path: impl Fn(f64) -> Self) -> Option<Self> {
        let mut ball = path(1.0);
        let mut end = 1.0;
        for _ in 0..MOST_OBSTACLES {
            work.look();
            let Some(obstacle) = ball.obstacle(mesh).ok()? else { return Some(ball) };
            (end, ball) = touching(mesh, work, &path, obstacle.face, end);
            ball.add(mesh, obstacle.face);
        }
        (ball.obstacle(mesh) == Ok(None)).then_some(ball)
    }

    /// Of a place that was guessed: whether it is as far from everything that presses on it as it may be.
    #[inline(never)]
    pub(super) fn is_on_all_that_holds_it(&self, mesh: &Mesh) -> bool {
        let near_m = tolerance_m(mesh, self.radius_m);
        let mut held = self.rests().iter().filter(|rest| rest.load_m > 0.0);
        held.all(|rest| distance(&(rest.normal_B, rest.offset_m), &self.centre_B).abs() <= near_m)
    }

    /// Whether it went so far that it might have passed something.
    #[inline(always)]
    pub(super) fn strayed(&self, start: &Self) -> bool {
        let strayed_m2 = (self.centre_B - start.centre_B).norm_squared();
        strayed_m2 > 0.25 * self.radius_m * self.radius_m || strayed_m2.is_nan()
    }

    /// Takes note of a feature that it touches.
    pub(super) fn add(&mut self, mesh: &Mesh, face: u32) {
        let mut rest = Self::in_free_space(self.centre_B, self.radius_m).rests[0];
        rest.foot.face = face;
        rest.walk(mesh, &self.centre_B, self.radius_m);
        let near_m = SAME_FOOT * self.radius_m;
        if self.rests().iter().any(|other| (other.foot.point_B - rest.foot.point_B).amax() <= near_m) {
            return;
        }
        // No more than three hold it: of four, one is not pressed.
        let idle = self.rests().iter().position(|rest| rest.load_m <= 0.0).unwrap_or(MOST - 1);
        let place = if self.count < MOST { self.count } else { idle };
        self.rests[place] = rest;
        self.count = (place + 1).max(self.count);
    }

    /// The place nearest to a HIP that is outside of the mesh, but nearer to it than the radius: straight away from the
    /// mesh's nearest point. There it rests without friction.
    pub(super) fn seat(&self, mesh: &Mesh, hip_B: &Vector3<f64>) -> Option<Self> {
        let [rest] = self.rests() else { return None };
        if rest.normal_B.dot(&(hip_B - rest.foot.point_B)) <= LEAST_HEIGHT * self.radius_m {
            return None;
        }
        let mut ball = *self;
        let there = ball.rests.first_mut()?;
        there.walk(mesh, hip_B, self.radius_m);
        let depth_m = there.offset_m - there.normal_B.dot(hip_B);
        if !(0.0..(1.0 - LEAST_HEIGHT) * self.radius_m).contains(&depth_m) {
            return None;
        }
        ball.centre_B = hip_B + there.normal_B * depth_m;
        ((ball.centre_B - self.centre_B).norm() <= 0.5 * self.radius_m).then_some(ball)
    }

    /// Moves to the place nearest to `hip_B` in front of all that it touches.
    pub(super) fn give_way(&mut self, hip_B: &Vector3<f64>) {
        let (planes, count) = self.planes();
        let pressed = press(&planes[..count], hip_B);
        for (rest, load_m) in self.rests_mut().iter_mut().zip(pressed.loads_m) {
            rest.load_m = load_m;
        }
        self.centre_B = pressed.point_B;
    }
}

impl Rest {
    #[inline(always)]
    fn walk(&mut self, mesh: &Mesh, centre_B: &Vector3<f64>, radius_m: f64) {
        self.foot = Foot::from_face(mesh, self.foot.face, centre_B);
        (self.normal_B, self.offset_m) = self.foot.plane(mesh, centre_B, radius_m);
    }
}

/// Where on a path, before the share `end` of it, a face is first as near as the radius.
///
/// Regula falsi after Illinois; what is left of the radius at the end is far below what an obstacle has to be.
fn touching(mesh: &Mesh, work: &Work, path: impl Fn(f64) -> Ball, face: u32, end: f64) -> (f64, Ball) {
    // Of this face alone: a walk from it might end at what the ball rests on.
    let gap = |ball: &Ball| Foot::on(mesh, face, &ball.centre_B).squared_m2.sqrt() - ball.radius_m;
    let start = path(0.0);
    let (mut low, mut high) = ((0.0, gap(&start)), (end, gap(&path(end))));
    if low.1.is_nan() || low.1 <= 0.0 || high.1.is_nan() || high.1 >= 0.0 {
        return (0.0, start);
    }
    let mut best = (0.0, start);
    let enough_m = 0.1 * tolerance_m(mesh, start.radius_m);
    let mut last_was_high = None;
    for _ in 0..MOST_LOOKS {
        if low.1 <= enough_m {
            break;
        }
        work.look();
        let share = (low.0 * high.1 - high.0 * low.1) / (high.1 - low.1);
        let ball = path(share);
        let here_m = gap(&ball);
        let is_high = here_m < 0.0;
        if is_high {
            high = (share, here_m);
            if last_was_high == Some(true) {
                low.1 *= 0.5;
            }
        } else {
            (low, best) = ((share, here_m), (share, ball));
            if last_was_high == Some(false) {
                high.1 *= 0.5;
            }
        }
        last_was_high = Some(is_high);
        if here_m.abs() <= enough_m {
            return (share, ball);
        }
    }
    best
}

fn distance((normal_B, offset_m): &Plane, p_B: &Vector3<f64>) -> f64 {
    normal_B.dot(p_B) - offset_m
}

/// Nearer than the radius by less than this is touching \[m\].
#[inline(always)]
pub(super) fn tolerance_m(mesh: &Mesh, radius_m: f64) -> f64 {
    1e-9 * radius_m + 1e-12 * mesh.extent_m()
}

/// What is farther than the radius by more than this share of it is not touched any longer.
const BAND: f64 = 1e-7;
/// Feet that are as near to each other as this share of the radius are one.
const SAME_FOOT: f64 = 1e-9;
/// Heights above the mesh below this share of the radius have no direction worth going by.
const LEAST_HEIGHT: f64 = 1e-3;
const SHORTEST_LEAP: f64 = 0.375;
const MOST_CORRECTIONS: usize = 6;
const MOST_OBSTACLES: usize = 6;
/// Enough for a finger to roll on over plain faces for as many halves of its radius as there are rounds.
const MOST_WORK: u32 = 64;
const MOST_LOOKS: usize = 40;
