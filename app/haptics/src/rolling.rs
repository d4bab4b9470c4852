//! A ball in contact with a ground, or near it (Melder ch. 6.3.1 and 9.2).
//!
//! Problem: a finger with volume rolls over edges instead of falling off them, touches several features of a concave
//! surface at once, and slips through no crack; at a thousand ticks a second on a million triangles.
//!
//! Model: the ball's centre C is a god-object on the mesh grown by the radius r ([`ball`]). The spring from the HIP to C
//! is shared among the touched features: its normal part is the sum of loads `l_i >= 0` along their normals
//! ([`press`]), its tangential part is bounded by friction. So two walls of a groove hold a ball better than a plane does
//! (the wedge effect), while the two faces of a nearly flat fold share one load: nothing is counted twice.
//!
//! A friction cone per contact: each touch has its own load `l_i`, and of the tangential force the part `l_i / sum l` as
//! its own, inside its own circle `mu l_i` and tangent to its own plane. That this is what separate cones do follows from
//! two things. What the walls leave of the spring is normal to every wall that carries a load (Moreau), so that it lies
//! in all those planes at once; and all contacts of one centre slide with its speed, so that each opposes it with all of
//! `mu(v) l_i`. These add up to one circle on the sum of the loads, for laws whose friction grows as the load does; a force
//! that does not (a fixed cone) is the entity's, shared out in the same way. `tests/ball/several_cones.rs` goes contact by contact
//! instead and comes to the same, tick by tick, to rounding.
//!
//! The loads are those of the contacts without friction. Were friction free to raise them, the walls of any groove whose half angle is
//! below atan mu would hold the ball against any pull by squeezing it, with nobody pressing: no finger could leave.
//!
//! Stick and slip are the centre's: a wall that is met while C slides is slid on from the beginning, with the sliding
//! coefficient; one that is met by a ball from free space begins by sticking, as a point does. Of C's way in that tick the
//! part up to a face is gone on the old walls alone.
//!
//! Limits: of more walls through one place than hold it (four around a pit, the floor of a trough that just fits) the loads are not
//! unique, and those of the first few are taken; what is felt in all is the same, but where it can slide along all of them its
//! friction circle depends on the choice. A fifth is not known until it is in the way. Two walls that are parallel but for
//! an angle `a` (rad) miss `2e-9 k r / a` of the force, and on other walls nothing.
//!
//! The ball is free when nothing that it touches is pressed and it can fly straight to the HIP. Friction must not hold a
//! finger that is round the corner: where the HIP lies with room for the ball around it, a frictionless ball seeks it
//! from the god-object on, and if it gets there, so does the finger.
//!
//! Frames: the mesh's own, B. Both sides of every face are felt, but a solid's ball is always outside: unlike a point it
//! sees all parts of a ground, also those that pass through each other.
//! Invariants: nothing is nearer to C than r; C never changes sides. A bound that is reached leaves the ball where it
//! is, touching; it goes on in the next tick.
//! Cost: a few walks of the feet and one query of the hierarchy that is pruned at r; bounded.

mod ball;
mod depenetration;
mod far;
mod flight;
mod ground;
mod pace;
mod press;
mod roll;
mod seek;
mod touching;

use nalgebra::Vector3;

pub(crate) use self::ground::{Foot, Ground};
pub(crate) use self::press::Plane;

use self::ball::Ball;
use self::depenetration::{grown, pushed_out};
use self::flight::Flight;
use self::touching::{Room, Touching};
use crate::algorithm::{Touch, TouchInput};
use crate::mesh::Beginning;
use crate::surface::SurfacePoint;

/// State of one spherical finger towards one ground.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RollingCone<F, V> {
    /// Which ground, and which radius, the rest is about.
    about: Option<(u64, f64)>,
    touching: Option<Touching<F>>,
    last_hip_B: Option<Vector3<f64>>,
    /// No face comes as near as this.
    clear: Room,
    vicinity: V,
}

/// One of the features that a ball touches, and what it does to the user.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Share {
    /// On the ground, not where the ball's centre is.
    pub(crate) at: SurfacePoint,
    pub(crate) force_on_user_B: Vector3<f64>,
    /// Of all loads, 0 to 1.
    pub(crate) part: f64,
}

impl<F, V: Default> Default for RollingCone<F, V> {
    fn default() -> Self {
        Self { about: None, touching: None, last_hip_B: None, clear: Room::default(), vicinity: V::default() }
    }
}

impl<F: Foot, V: Copy + Default> RollingCone<F, V> {
    /// One tick; `None` while the finger is free.
    #[inline(never)]
    pub(crate) fn update<G: Ground<Foot = F, Vicinity = V>>(
        &mut self,
        ground: &G,
        input: &TouchInput<'_>,
    ) -> Option<(Touch, Beginning)> {
        let radius_m = input.finger_radius_m;
        let about = Some((ground.identity(), radius_m));
        if self.about != about {
            *self = Self { about, ..Self::default() };
        }
        let last_hip_B = self.last_hip_B.replace(input.cone.hip_B);
        let mut beginning = Beginning::Came;
        if self.touching.is_none() {
            let (ball, how) = self.meet(ground, input, last_hip_B)?;
            beginning = how;
            self.touching = Some(Touching::new(ball));
        }
        let touching = self.touching.as_mut()?;
        if touching.ball.radius_m < radius_m
            && let Some(last_hip_B) = last_hip_B
        {
            let hip_B = &input.cone.hip_B;
            let at_most_m = (touching.ball.centre_B - last_hip_B).norm() + (hip_B - last_hip_B).norm();
            touching.ball = grown(ground, &touching.ball, hip_B, at_most_m, radius_m);
        }
        let felt = touching.update(ground, input.friction, &mut self.vicinity, &input.cone);
        let felt = felt.or_else(|| touching.with_less_room(ground, radius_m, &input.cone));
        if felt.is_none() {
            self.touching = None;
        }
        felt.map(|touch| (touch, beginning))
    }

    /// Where the ball's centre is, in contact.
    pub(crate) fn centre_B(&self) -> Option<Vector3<f64>> {
        self.touching.as_ref().map(|touching| touching.ball.centre_B)
    }

    /// Whether a contact lives.
    pub(crate) fn is_touching(&self) -> bool {
        self.touching.is_some()
    }

    /// The features that it presses on, in this tick; friction is shared out as the loads are.
    pub(crate) fn shares(&self) -> impl Iterator<Item = Share> {
        let touching = self.touching.as_ref();
        let (tangential_B, load_m, k) = touching.map_or_else(Default::default, |touching| touching.answered);
        let rests = touching.map_or(&[][..], |touching| touching.ball.rests());
        rests.iter().filter(|rest| rest.load_m > 0.0).map(move |rest| {
            let part = rest.load_m / load_m;
            let spring_B = rest.normal_B * rest.load_m + tangential_B * part;
            let foot = &rest.foot;
            let at = SurfacePoint {
                point_B: foot.point_B(),
                normal_B: rest.normal_B,
                feature: foot.feature(),
                piece: foot.piece(),
            };
            Share { at, force_on_user_B: spring_B * k, part }
        })
    }

    /// Friction is another one from now on, to which what the last one remembered means nothing.
    pub(crate) fn forget_friction(&mut self) {
        if let Some(touching) = &mut self.touching {
            touching.forget_friction();
        }
    }

    /// Ends the contact.
    pub(crate) fn let_go(&mut self) {
        if self.touching.is_some() {
            *self = Self::default();
        }
    }

    #[inline(never)]
    fn meet(
        &mut self,
        ground: &impl Ground<Foot = F>,
        input: &TouchInput<'_>,
        last_hip_B: Option<Vector3<f64>>,
    ) -> Option<(Ball<F>, Beginning)> {
        let (hip_B, radius_m) = (input.cone.hip_B, input.finger_radius_m);
        // A mesh that was placed elsewhere was not met on the way there.
        let is_elsewhere = |from_B: &Vector3<f64>| {
            last_hip_B.is_none_or(|last_B| (from_B - last_B).amax() > SAME_PLACE * ground.extent_m())
        };
        if let Some(from_B) = input.previous_hip_B.filter(|from_B| !is_elsewhere(from_B)) {
            if self.clear.has(&from_B, radius_m) && self.clear.has(&hip_B, radius_m) {
                return None;
            }
            if let Some(ball) =
                Ball::in_free_space(from_B, radius_m).flown_to(ground, &hip_B, Flight::TO_THE_END)
            {
                if ball.rests().is_empty() && ball.centre_B == hip_B {
                    self.clear = Room {
                        centre_B: hip_B,
                        radius_m: ground.clearance_m(&hip_B, ground.extent_m() + radius_m),
                    };
                    return None;
                }
                return Some((ball, Beginning::Came));
            }
        }
        self.clear = Room::default();
        pushed_out(ground, &hip_B, radius_m).map(|ball| (ball, Beginning::WasInside))
    }
}

/// Positions that differ by less than this share of the mesh are the same, seen through two equal poses.
const SAME_PLACE: f64 = 1e-9;
