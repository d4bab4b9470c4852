//! Where something stands in a ball's way: on its way over a shape, and through free space.
//!
//! Model: after a move the shape is asked whether anything is nearer than the radius r; if so, the move ends where that
//! is first touched, found by the false position. Through free space it leaps as far as nothing is near.
//!
//! Invariants: a move begins and ends where nothing is nearer than r; over a surface it is no longer than half of r, so
//! that the centre, with room of r around it, cannot come to the other side of anything, or as [`far`](super::far) as it goes through
//! nothing.
//! Cost: one bounded query; at something new some ten walks of a foot more.

use std::cell::Cell;

use nalgebra::Vector3;

use super::ball::{Ball, Rest, tolerance_m};
use super::ground::{Foot, Ground};
use super::roll::Leg;
use crate::mesh::TooMany;

/// What was done in a tick already, in places that were looked at.
#[derive(Debug, Default)]
pub(super) struct Work(Cell<u32>);

impl Work {
    pub(super) fn look(&self) {
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

impl<F: Foot> Ball<F> {
    /// What is nearer than it should be.
    #[inline(always)]
    pub(super) fn obstacle(&self, ground: &impl Ground<Foot = F>) -> Result<Option<F>, TooMany> {
        let near_m = self.radius_m - tolerance_m(ground, self.radius_m);
        match self.rests() {
            [] => Ok(ground.nearest_within(&self.centre_B, near_m)?.map(|(foot, _)| foot)),
            [rest, ..] => {
                // Below the plane through the lowest point of that smaller ball nothing reaches into it.
                let offset_m = rest.normal_B.dot(&self.centre_B) - near_m;
                ground.nearest_above(&self.centre_B, near_m, (&rest.normal_B, offset_m))
            }
        }
    }

    /// As [`Self::obstacle`]; `start_B` is where it was when the tick began.
    #[inline(always)]
    pub(super) fn obstacle_near<G: Ground<Foot = F>>(
        &self,
        ground: &G,
        vicinity: &mut G::Vicinity,
        start_B: &Vector3<f64>,
    ) -> Result<Option<F>, TooMany> {
        let near_m = self.radius_m - tolerance_m(ground, self.radius_m);
        let moved_m = (self.centre_B - start_B).norm();
        let is_clear = self
            .rests()
            .first()
            .is_some_and(|rest| ground.is_clear(vicinity, &self.centre_B, &rest.normal_B, near_m, moved_m));
        if is_clear { Ok(None) } else { self.obstacle(ground) }
    }

    /// As [`Self::rolled_to`], as far as nothing else is in the way: by half of its radius at the most, or as far as it can see on the
    /// flat faces that it rests on.
    pub(super) fn rolled_until<G: Ground<Foot = F>>(
        &self,
        ground: &G,
        target_B: &Vector3<f64>,
        work: &Work,
    ) -> Self {
        let way_B = target_B - self.centre_B;
        let way_m = way_B.norm();
        let longest_m = 0.5 * self.radius_m;
        if let Some(ball) = self.slid_far(ground, &way_B, way_m, work) {
            return ball;
        }
        let way_B = if way_m > longest_m { way_B * (longest_m / way_m) } else { way_B };
        let path = |from: &Self| {
            let touched = from
                .first_touch(ground, work, |share| from.rolled_to(ground, &(from.centre_B + way_B * share)));
            touched.unwrap_or(*from)
        };
        let has_moved = |ball: &Self| {
            let moved_m = (ball.centre_B - self.centre_B).amax();
            moved_m > tolerance_m(ground, self.radius_m) || ball.count != self.count
        };
        let touched = path(self);
        if G::IS_BENT || has_moved(&touched) {
            return touched;
        }
        if let Some(touched) = self.on_what_goes_on(ground, &way_B).map(|ball| path(&ball)).filter(has_moved)
        {
            return touched;
        }
        // At the foot of a fold so flat that what lies beyond is no other foot from here.
        let way = Leg { from_B: self.centre_B, is_frictionless: true };
        let beyond = self.in_the_fold(ground, &(self.centre_B + way_B), &way);
        let is_there = beyond.is_within_half_a_radius_of(self) && matches!(beyond.obstacle(ground), Ok(None));
        if is_there { beyond } else { *self }
    }

    /// The same ball on what it comes to if it goes on, where it rests on the end of something that lies on that, at the same foot.
    fn on_what_goes_on(&self, ground: &impl Ground<Foot = F>, way_B: &Vector3<f64>) -> Option<Self> {
        let ahead = self.rolled_to(ground, &(self.centre_B + way_B));
        let mut ball = *self;
        let mut other = Self::in_free_space(self.centre_B, self.radius_m).rests[0];
        other.foot = ahead.obstacle(ground).ok()??;
        other.walk(ground, &self.centre_B, self.radius_m, true);
        let near_m = tolerance_m(ground, self.radius_m);
        let is_there = |rest: &&mut Rest<F>| (rest.foot.point_B() - other.foot.point_B()).amax() <= near_m;
        let rest = ball.rests_mut().iter_mut().find(is_there)?;
        (rest.foot, rest.normal_B, rest.offset_m) = (other.foot, other.normal_B, other.offset_m);
        Some(ball)
    }

    /// Straight to `target_B` through free space: it is there, or where it first touches something.
    ///
    /// `None` where it began with something nearer than it may be.
    #[inline(never)]
    pub(super) fn flown_to<G: Ground<Foot = F>>(
        &self,
        ground: &G,
        target_B: &Vector3<f64>,
        flight: Flight,
    ) -> Option<Self> {
        let radius_m = self.radius_m;
        let mut ball = Self::in_free_space(self.centre_B, radius_m);
        for _ in 0..flight.most_leaps {
            let way_B = target_B - ball.centre_B;
            let left_m = way_B.norm();
            let ahead_m = left_m.min((flight.farthest * radius_m).max(LEAST_AHEAD_M));
            let safe_m = ground.room_m(&ball.centre_B, radius_m, ahead_m)?;
            if safe_m >= left_m {
                return Some(Self::in_free_space(*target_B, radius_m));
            }
            if safe_m < -2.0 * tolerance_m(ground, radius_m) {
                return None;
            }
            if let Some(flown) = ball.flown_far(ground, &way_B, left_m) {
                return Some(flown);
            }
            // Along a surface nothing is safe: some way, and a look back.
            let leap_m = safe_m.max(SHORTEST_LEAP * radius_m).min(left_m);
            let leap_B = way_B * (leap_m / left_m);
            let from_B = ball.centre_B;
            ball = ball.first_touch(ground, &Work::default(), |share| {
                Self::in_free_space(from_B + leap_B * share, radius_m)
            })?;
            if ball.count > 0 || leap_m >= left_m {
                return Some(ball);
            }
        }
        Some(ball)
    }

    /// The end of a path, or where on it something new is first touched; `None` if that cannot be told.
    pub(super) fn first_touch(
        &self,
        ground: &impl Ground<Foot = F>,
        work: &Work,
        path: impl Fn(f64) -> Self,
    ) -> Option<Self> {
        let mut ball = path(1.0);
        let mut end = 1.0;
        for _ in 0..MOST_OBSTACLES {
            work.look();
            let Some(obstacle) = ball.obstacle(ground).ok()? else { return Some(ball) };
            (end, ball) = touching(ground, work, &path, (&obstacle, self.is_alone_with(&obstacle)), end);
            ball.add(ground, &obstacle);
        }
        matches!(ball.obstacle(ground), Ok(None)).then_some(ball)
    }
}

/// Where on a path, before the share `end` of it, a feature is first as near as the radius.
///
/// Regula falsi after Illinois; what is left of the radius at the end is far below what an obstacle has to be.
fn touching<F: Foot>(
    ground: &impl Ground<Foot = F>,
    work: &Work,
    path: impl Fn(f64) -> Ball<F>,
    (foot, is_alone): (&F, bool),
    end: f64,
) -> (f64, Ball<F>) {
    let gap = |ball: &Ball<F>| {
        let there = ground.followed(foot, &ball.centre_B);
        // A walk from it might end at what the ball rests on: then of this feature alone.
        let distance_m = match ball.is_at(&there) {
            true => ground.distance_m(foot, &ball.centre_B, is_alone),
            false => (there.point_B() - ball.centre_B).norm(),
        };
        distance_m - ball.radius_m
    };
    let start = path(0.0);
    let (mut low, mut high) = ((0.0, gap(&start)), (end, gap(&path(end))));
    if low.1.is_nan() || low.1 <= 0.0 || high.1.is_nan() || high.1 >= 0.0 {
        return (0.0, start);
    }
    let mut best = (0.0, start);
    let enough_m = 0.1 * tolerance_m(ground, start.radius_m);
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

/// As far is looked ahead at least \[m\]: of a small ball that costs no more.
const LEAST_AHEAD_M: f64 = 1e-3;
const SHORTEST_LEAP: f64 = 0.375;
const MOST_OBSTACLES: usize = 6;
/// Enough for a finger to roll on over plain faces for as many halves of its radius as there are rounds.
const MOST_WORK: u32 = 64;
const MOST_LOOKS: usize = 40;
