//! Depenetration of a ball that is found overlapping a ground: by the overlap at most, with a smaller ball where that is too
//! little.
//!
//! Problem: a finger with volume may begin inside a solid, between two walls, or in a crevice that has no room for it. Any
//! place with room may be decimetres away, and a god-object put there would throw the hand.
//!
//! Model: the overlap is the radius r less the HIP's distance to the surface, or r and the depth of a HIP that is inside. The
//! god-object may be that far from the HIP. Where no ball of radius r has room so near, the largest of a falling series of
//! radii that does is taken; outside, the ball that just touches the surface always has room. Such a small ball grows
//! as the hand moves ([`grown`]), so that the spring becomes no longer in a tick than the hand's way.
//!
//! Frames: the ground's own, B.
//! Invariant: the spring from the HIP to the centre is no longer than the overlap, and of a grown ball than it was and
//! what the HIP moved.
//! Cost: [`MOST_SIZES`] times [`MOST_CORRECTIONS`] bounded queries where a ball is found, [`MOST_GROWTHS`] times as many in a
//! tick that it grows in.

use nalgebra::Vector3;

use super::ball::{Ball, tolerance_m};
use super::ground::{Foot, Ground};

/// Place to which a ball that is found too near to the ground, or inside, is pushed out; `None` if it is free.
#[cold]
pub(super) fn pushed_out<F: Foot>(
    ground: &impl Ground<Foot = F>,
    hip_B: &Vector3<f64>,
    radius_m: f64,
) -> Option<Ball<F>> {
    let (foot, depth_m) = match ground.way_out(hip_B) {
        Some(way) => (way, (way.point_B() - hip_B).norm()),
        None => {
            let (near, distance_m) = ground.nearest_within(hip_B, radius_m).ok()??;
            (near, -distance_m)
        }
    };
    let overlap_m = radius_m + depth_m;
    let out_B = (foot.point_B() - hip_B) * depth_m.signum();
    let has_direction = depth_m.abs() > ON_THE_GROUND * (radius_m + ground.extent_m());
    let straight_B = out_B / depth_m.abs();
    // In a crevice that ends at the foot its walls are in the straight way.
    let leads_out = || !ground.is_inside(&(foot.point_B() + straight_B * (BEYOND * ground.extent_m())));
    let normal_B =
        if has_direction && (depth_m < 0.0 || leads_out()) { straight_B } else { ground.normal_B(&foot) };
    // Outside, the ball that ends at the ground has room.
    let smallest_m = (-depth_m).max(0.0);
    let mut share = 1.0;
    for _ in 0..MOST_SIZES {
        let ball_m = (smallest_m + (radius_m - smallest_m) * share).min(radius_m);
        let ball = Ball::in_free_space(foot.point_B() + normal_B * ball_m, ball_m);
        if let Some(ball) = with_room(ground, ball)
            && (ball.centre_B - hip_B).norm() <= overlap_m + tolerance_m(ground, radius_m)
        {
            return Some(ball);
        }
        share *= 0.5;
    }
    // Between walls that meet at the foot in an angle too sharp for any of these: as a point, which grows.
    let ball_m = smallest_m.max(POINT * ground.extent_m()).min(radius_m);
    let mut ball = Ball::in_free_space(foot.point_B() + normal_B * ball_m, ball_m);
    ball.add(ground, &foot);
    Some(ball)
}

/// A small ball in contact, as large as it may be now: with its centre no farther from the HIP than `at_most_m`, and no larger
/// than `radius_m`.
#[cold]
pub(super) fn grown<F: Foot>(
    ground: &impl Ground<Foot = F>,
    small: &Ball<F>,
    hip_B: &Vector3<f64>,
    at_most_m: f64,
    radius_m: f64,
) -> Ball<F> {
    // A centre goes at least as far as its ball grows.
    let spare_m = at_most_m - (small.centre_B - hip_B).norm();
    let mut most_m = (small.radius_m + spare_m).min(radius_m);
    for _ in 0..MOST_GROWTHS {
        if most_m <= small.radius_m {
            break;
        }
        let mut larger = *small;
        larger.radius_m = most_m;
        for i in 0..larger.count {
            let is_alone = small.is_alone_with(&small.rests[i].foot);
            larger.rests[i].walk(ground, &small.centre_B, most_m, is_alone);
        }
        larger.give_way(&{ small.centre_B });
        if let Some(mut larger) = with_room(ground, larger) {
            // Pushed out of one thing after the other it may have come too far.
            larger.press_from(hip_B);
            if !larger.touches_all_that_holds_it() {
                larger = larger.on_what_holds_it(ground);
                larger.press_from(hip_B);
            }
            // A foot that was left behind in the air would bear what is not there.
            if larger.touches_all_that_holds_it() && (larger.centre_B - hip_B).norm() <= at_most_m {
                return larger;
            }
        }
        most_m = 0.5 * (small.radius_m + most_m);
    }
    *small
}

/// The ball moved from where it is until nothing is nearer than its radius.
fn with_room<F: Foot>(ground: &impl Ground<Foot = F>, mut ball: Ball<F>) -> Option<Ball<F>> {
    for _ in 0..MOST_CORRECTIONS {
        let Some(obstacle) = ball.obstacle(ground).ok()? else {
            return (!ground.is_inside(&ball.centre_B)).then_some(ball);
        };
        ball.add(ground, &obstacle);
        ball.give_way(&{ ball.centre_B });
    }
    None
}

/// Nearer to the mesh than this share of it, the way out has no direction.
const ON_THE_GROUND: f64 = 1e-9;
/// So far beyond the foot, relative to the ground, it is asked whether that is outside: far above rounding.
const BEYOND: f64 = 1e-9;
/// The radius of a point, relative to the ground.
const POINT: f64 = 1e-9;
/// The last of them is a millionth of the first.
const MOST_SIZES: usize = 20;
const MOST_CORRECTIONS: usize = 16;
const MOST_GROWTHS: usize = 4;
