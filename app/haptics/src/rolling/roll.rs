//! How a ball moves along what it rests on.
//!
//! Model: its centre C lies on the shape grown by the radius r: over a face a plane, round an edge a cylinder, round a
//! vertex a sphere; where the shape is concave, where two or three of them meet. Moved along the tangent planes of what
//! it rests on, C is brought back onto them by Newton's method, the feet walking along.
//!
//! Invariant: of other features nothing is known here; whoever moves a ball asks afterwards ([`super::flight`]).
//! Cost: a walk of each foot for each correction; bounded.

use nalgebra::Vector3;

use super::ball::{Ball, Rest, SAME_FOOT, distance, tolerance_m};
use super::ground::{Foot, Ground};
use super::press::{MOST, Plane, onto, press};
use crate::mesh::TooMany;
use crate::tangent_view::tangential;

/// How it came to where it met something.
pub(super) struct Leg {
    pub(super) from_B: Vector3<f64>,
    pub(super) is_frictionless: bool,
}

impl Leg {
    /// Where on the way to `to_B` it first touched one of these planes. Friction may hold it there; without friction it comes to
    /// rest at the same place from wherever it is.
    fn until(&self, to_B: &Vector3<f64>, planes: impl Iterator<Item = Plane>) -> Vector3<f64> {
        if self.is_frictionless {
            return *to_B;
        }
        let share_at = |plane: Plane| {
            let (before_m, after_m) = (distance(&plane, &self.from_B), distance(&plane, to_B));
            if before_m > 0.0 && after_m < 0.0 { before_m / (before_m - after_m) } else { 1.0 }
        };
        let share = planes.map(share_at).fold(1.0, f64::min);
        self.from_B + (to_B - self.from_B) * share
    }
}

impl<F: Foot> Ball<F> {
    /// Where it is if its centre moves straight to `target_B` and is brought back onto what it presses on.
    ///
    /// Nothing is said of other features that may be in the way.
    #[inline(always)]
    pub(super) fn rolled_to(&self, ground: &impl Ground<Foot = F>, target_B: &Vector3<f64>) -> Self {
        let mut ball = *self;
        ball.centre_B = *target_B;
        let near_m = tolerance_m(ground, self.radius_m);
        if let [rest] = ball.rests_mut() {
            let before = rest.foot;
            rest.walk(ground, target_B, self.radius_m, true);
            let missing_m = rest.offset_m - rest.normal_B.dot(target_B);
            // Pushed out it would come farther from the HIP, and over the fold in which it belongs.
            let is_blocked = missing_m > near_m && !rest.foot.is_beside(&before);
            if !is_blocked {
                ball.centre_B = target_B + rest.normal_B * missing_m;
            }
            ball.is_blocked = is_blocked;
            return ball;
        }
        ball.is_blocked = ball.is_led_into_a_fold(ground);
        if !ball.is_blocked {
            ball.settle(ground);
        }
        ball
    }

    #[inline(never)]
    fn is_led_into_a_fold(&self, ground: &impl Ground<Foot = F>) -> bool {
        let near_m = tolerance_m(ground, self.radius_m);
        self.rests().iter().filter(|rest| rest.load_m > 0.0).any(|rest| {
            let mut there = *rest;
            there.walk(ground, &self.centre_B, self.radius_m, self.is_alone_with(&rest.foot));
            let height_m = distance(&(there.normal_B, there.offset_m), &self.centre_B);
            height_m < -near_m && !there.foot.is_beside(&rest.foot)
        })
    }

    #[inline(never)]
    fn settle(&mut self, ground: &impl Ground<Foot = F>) {
        let near_m = tolerance_m(ground, self.radius_m);
        let mut set_of_old = self.held();
        for _ in 0..MOST_CORRECTIONS {
            set_of_old = self.walk_all(ground, set_of_old);
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
        self.drop_what_is_left(ground, set_of_old);
    }

    /// Takes all feet along; of two that meet one is enough. Returns the set with its members' new numbers.
    fn walk_all(&mut self, ground: &impl Ground<Foot = F>, set: u8) -> u8 {
        let (mut kept, mut kept_set) = (0, 0);
        let before = *self;
        for i in 0..self.count {
            let mut rest = self.rests[i];
            rest.walk(ground, &self.centre_B, self.radius_m, before.is_alone_with(&rest.foot));
            let is_held = set >> i & 1;
            let near_m = SAME_FOOT * self.radius_m;
            let same =
                (0..kept).find(|&j| (self.rests[j].foot.point_B() - rest.foot.point_B()).amax() <= near_m);
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

    fn drop_what_is_left(&mut self, ground: &impl Ground<Foot = F>, held: u8) {
        let far_m = BAND * self.radius_m + tolerance_m(ground, self.radius_m);
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

    /// Where it is pushed out of a feature that it came too near to: at the place where it first touched that.
    #[inline(never)]
    pub(super) fn pushed_out_of(&self, ground: &impl Ground<Foot = F>, foot: &F, way: &Leg) -> Self {
        let mut ball = *self;
        ball.add(ground, foot);
        let plane = ground.plane(foot, &self.centre_B, self.radius_m);
        ball.centre_B = way.until(&self.centre_B, std::iter::once(plane));
        ball.settle(ground);
        ball
    }

    /// Where it is in a fold that it is led into on its way to `target_B`: on what it rests on now and on what its feet
    /// come to there.
    #[inline(never)]
    pub(super) fn in_the_fold(
        &self,
        ground: &impl Ground<Foot = F>,
        target_B: &Vector3<f64>,
        way: &Leg,
    ) -> Self {
        let near_m = tolerance_m(ground, self.radius_m);
        let mut ball = *self;
        ball.centre_B = *target_B;
        for rest in self.rests().iter().filter(|rest| rest.load_m > 0.0) {
            let mut there = *rest;
            there.walk(ground, target_B, self.radius_m, self.is_alone_with(&rest.foot));
            let height_m = distance(&(there.normal_B, there.offset_m), target_B);
            if height_m < -near_m && !there.foot.is_beside(&rest.foot) && ball.count < MOST {
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
        ball.centre_B = if way.is_frictionless {
            pressed.point_B
        } else {
            way.until(target_B, planes.iter().skip(self.count).take(count - self.count).copied())
        };
        ball.settle(ground);
        ball
    }

    /// Where it comes to rest without friction, if the ground knows that place.
    #[inline(always)]
    pub(super) fn seat(&self, ground: &impl Ground<Foot = F>, hip_B: &Vector3<f64>) -> Option<Self> {
        let [rest] = self.rests() else { return None };
        let (foot, (normal_B, offset_m)) = ground.seat(&rest.foot, &rest.normal_B, hip_B, self.radius_m)?;
        let mut ball = *self;
        *ball.rests.first_mut()? = Rest { foot, normal_B, offset_m, load_m: rest.load_m };
        ball.centre_B = hip_B + normal_B * (offset_m - normal_B.dot(hip_B));
        Some(ball)
    }

    /// A place above what it rests on from which it comes down about where the other one is: straight there it would
    /// meet what it is to roll round.
    pub(super) fn towards(&self, other: &Self) -> Vector3<f64> {
        let way_B = other.centre_B - self.centre_B;
        let along_B = self.rests().first().map_or(way_B, |rest| tangential(&way_B, &rest.normal_B));
        let along_m = along_B.norm();
        if along_m > 0.0 { self.centre_B + along_B * (way_B.norm() / along_m) } else { other.centre_B }
    }

    /// Moves to the place nearest to `hip_B` in front of all that it touches.
    pub(super) fn give_way(&mut self, hip_B: &Vector3<f64>) {
        self.centre_B = self.press_from(hip_B);
    }

    /// Loads that a HIP there presses with on all that it knows; gives the place nearest to it in front of that.
    pub(super) fn press_from(&mut self, hip_B: &Vector3<f64>) -> Vector3<f64> {
        let (planes, count) = self.planes();
        let pressed = press(&planes[..count], hip_B);
        for (rest, load_m) in self.rests_mut().iter_mut().zip(pressed.loads_m) {
            rest.load_m = load_m;
        }
        pressed.point_B
    }

    /// Of a place that was guessed: whether it is as far from everything that presses on it as it may be.
    #[inline(never)]
    pub(super) fn is_on_all_that_holds_it(&self, ground: &impl Ground<Foot = F>) -> bool {
        let near_m = tolerance_m(ground, self.radius_m);
        let mut held = self.rests().iter().filter(|rest| rest.load_m > 0.0);
        held.all(|rest| distance(&(rest.normal_B, rest.offset_m), &self.centre_B).abs() <= near_m)
    }
}

impl<F: Foot> Ball<F> {
    /// Whether every foot that carries a load is at the radius.
    pub(super) fn touches_all_that_holds_it(&self) -> bool {
        self.rests().iter().filter(|rest| rest.load_m > 0.0).all(|rest| self.touches(rest))
    }

    /// Where rounds ended before it had settled: on what presses on it and what is in its way there, else without what it has
    /// not come to yet. A foot in the air must carry nothing.
    #[inline(never)]
    pub(super) fn on_what_holds_it(&self, ground: &impl Ground<Foot = F>) -> Self {
        let mut settled = *self;
        settled.settle(ground);
        for _ in 0..MOST_SETTLED {
            if !settled.touches_all_that_holds_it() || !settled.is_within_half_a_radius_of(self) {
                break;
            }
            match settled.obstacle(ground) {
                Ok(None) => return settled,
                Ok(Some(obstacle)) => {
                    let way = Leg { from_B: settled.centre_B, is_frictionless: true };
                    settled = settled.pushed_out_of(ground, &obstacle, &way);
                }
                Err(TooMany) => break,
            }
        }
        let mut ball = *self;
        ball.count = 0;
        for rest in self.rests().iter().filter(|rest| self.touches(rest)) {
            ball.rests[ball.count] = *rest;
            ball.count += 1;
        }
        // Of one that touches nothing the contact lives on: it comes there in the next tick.
        if ball.count > 0 { ball } else { *self }
    }

    fn touches(&self, rest: &Rest<F>) -> bool {
        let gap_m = (rest.foot.point_B() - self.centre_B).norm() - self.radius_m;
        gap_m.abs() <= BAND * self.radius_m + 1e-12 * self.centre_B.amax()
    }
}

/// What is farther than the radius by more than this share of it is not touched any longer.
const BAND: f64 = 1e-7;
const MOST_CORRECTIONS: usize = 6;
/// How often a ball that has not settled is pushed out of what is in its way.
const MOST_SETTLED: usize = 3;
