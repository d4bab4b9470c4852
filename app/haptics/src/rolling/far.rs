//! Long ways of balls that stand for points.
//!
//! Problem: in halves of a radius of ten micrometres a finger that slides at 1 m/s is not followed.
//!
//! Model: on flat faces and along straight edges the centre goes straight, as long as what it presses on stays the same planes. If
//! its way goes through nothing, and nothing is nearer than the radius where it ends, it is on the same side of everything: what its
//! surface would have met on the way, by less than a radius, no finger feels. The same holds in flight.
//!
//! Cost: some walks of its feet to find where a face ends, and two questions to the ground.

use nalgebra::Vector3;

use super::ball::{Ball, Rest, tolerance_m};
use super::flight::Work;
use super::ground::{Foot, Ground};

impl<F: Foot> Ball<F> {
    /// A long way along the flat faces and straight edges that it rests on, if it stands for a point: its centre goes straight, and
    /// through nothing; and where it comes to nothing is nearer than the radius.
    #[inline(never)]
    pub(super) fn slid_far<G: Ground<Foot = F>>(
        &self,
        ground: &G,
        way_B: &Vector3<f64>,
        way_m: f64,
        work: &Work,
    ) -> Option<Self> {
        if !self.is_as_a_point::<G>() || self.held() == 0 {
            return None;
        }
        let near_m = tolerance_m(ground, self.radius_m);
        let slid = |share: f64| {
            let target_B = self.centre_B + way_B * share;
            let ball = self.rolled_to(ground, &target_B);
            // Where a face ends it is brought back by any length, onto the same planes.
            let is_there = (ball.centre_B - target_B).norm() <= SAME_WAY * share * way_m;
            let is_same = |(rest, before): (&Rest<F>, &Rest<F>)| {
                rest.normal_B.cross(&before.normal_B).norm_squared() < SAME_PLANE * SAME_PLANE
                    && (rest.offset_m - before.offset_m).abs() <= near_m
            };
            // What presses nothing may be left behind.
            let [after, before] =
                [&ball, self].map(|ball| ball.rests().iter().filter(|rest| rest.load_m > 0.0));
            let slides = is_there
                && !ball.is_blocked
                && ball.held().count_ones() == self.held().count_ones()
                && after.zip(before).all(is_same);
            slides.then_some(ball)
        };
        let least = 0.5 * self.radius_m / way_m;
        // Most often it can not, or as far as it is asked to.
        if 2.0 * least < 1.0 && slid(2.0 * least).is_none() {
            return None;
        }
        let mut far = 1.0;
        if slid(far).is_none() {
            work.look();
            let mut beyond = far;
            far = 2.0 * least;
            for _ in 0..MOST_HALVINGS {
                if beyond - far <= least {
                    break;
                }
                let middle = 0.5 * (far + beyond);
                if slid(middle).is_some() { far = middle } else { beyond = middle }
            }
        }
        for _ in 0..MOST_SHORTENED {
            if far <= least {
                return None;
            }
            let ball = slid(far)?;
            work.look();
            let met = ground.crossed_at([&self.centre_B, &ball.centre_B]);
            if met.is_none() && matches!(ball.obstacle(ground), Ok(None)) {
                return Some(ball);
            }
            // Twice the radius before what it meets; where that is beside its way, some radii back.
            far = far * met.unwrap_or(1.0) - 4.0 * least;
        }
        None
    }

    /// A long way through free space, to its end or to the surface that its centre would go through.
    pub(super) fn flown_far<G: Ground<Foot = F>>(
        &self,
        ground: &G,
        way_B: &Vector3<f64>,
        way_m: f64,
    ) -> Option<Self> {
        if !self.is_as_a_point::<G>() {
            return None;
        }
        let target_B = self.centre_B + way_B;
        let far_m = ground
            .crossed_at([&self.centre_B, &target_B])
            .map_or(way_m, |share| share * way_m - 0.5 * self.radius_m);
        if far_m <= LONG * self.radius_m {
            return None;
        }
        let (from_B, leap_B) = (self.centre_B, way_B * (far_m / way_m));
        let ball = self.first_touch(ground, &Work::default(), |share| {
            Self::in_free_space(from_B + leap_B * share, self.radius_m)
        })?;
        (ball.count > 0 || far_m >= way_m).then_some(ball)
    }

    /// True if it stands for a point: by what comes nearer on its way than its radius nobody is stopped, but by what its centre
    /// would go through.
    fn is_as_a_point<G: Ground>(&self) -> bool {
        !G::IS_BENT && self.radius_m <= AS_A_POINT_M
    }
}

/// Radius of balls that stand for points, at most \[m\].
const AS_A_POINT_M: f64 = 1.5e-5;
/// In radii: shorter flights are no long ones.
const LONG: f64 = 4.0;
/// The most times that a way along flat faces is shortened.
const MOST_SHORTENED: u32 = 3;
/// The most times that it is halved to find where such a face ends.
const MOST_HALVINGS: u32 = 12;
/// Of a way, what bringing a ball back onto its planes may take away.
const SAME_WAY: f64 = 1e-3;
/// Sine of the angle below which planes are the same one.
const SAME_PLANE: f64 = 1e-10;
