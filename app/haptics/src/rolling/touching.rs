//! A ball in contact: held by friction, drawn on by the HIP, or round the corner and let go.
//!
//! Cost: a look while it is held, else a search for rest ([`super::seek`]).

use std::cell::Cell;

use nalgebra::Vector3;

use super::ball::{Ball, tolerance_m};
use super::ground::{Foot, Ground};
use super::seek::{Rested, seek};
use crate::algorithm::Touch;
use crate::friction::Friction;
use crate::friction_cone::ConeInput;
use crate::friction_law::{FrictionMemory, FrictionState};
use crate::grip::Grip;
use crate::mesh::draw::{Against, Frictionless};
use crate::surface::{Feature, SurfacePoint, direction_or_up};

/// A contact.
#[derive(Debug, Clone, Copy)]
pub(super) struct Touching<F> {
    pub(super) ball: Ball<F>,
    grip: Grip,
    /// The frictionless ball on its way to a HIP that is outside.
    scout: Option<Ball<F>>,
    /// Here the HIP is where no ball can be.
    tight: Room,
    /// There, it is deeper inside than the radius.
    is_inside: bool,
    /// What was answered last: tangential spring \[m\], sum of the loads \[m\] and stiffness \[N/m\].
    pub(super) answered: (Vector3<f64>, f64, f64),
}

/// A ball of which something is known.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Room {
    pub(super) centre_B: Vector3<f64>,
    pub(super) radius_m: f64,
}

impl Room {
    pub(super) fn has(&self, point_B: &Vector3<f64>, at_least_m: f64) -> bool {
        let reach_m = self.radius_m - at_least_m;
        reach_m > 0.0 && (point_B - self.centre_B).norm_squared() < reach_m * reach_m
    }
}

impl<F: Foot> Touching<F> {
    pub(super) fn new(ball: Ball<F>) -> Self {
        Self {
            ball,
            grip: Grip::default(),
            scout: None,
            tight: Room::default(),
            is_inside: false,
            answered: Default::default(),
        }
    }

    /// Friction is another one from now on.
    pub(super) fn forget_friction(&mut self) {
        self.grip.memory = FrictionMemory::default();
    }

    pub(super) fn update<G: Ground<Foot = F>>(
        &mut self,
        ground: &G,
        friction: &Friction,
        vicinity: &mut G::Vicinity,
        input: &ConeInput,
    ) -> Option<Touch> {
        if matches!(friction, Friction::None) {
            self.grip.state = FrictionState::Slip;
            let rested = seek(ground, &self.ball, || Frictionless, true, vicinity, input)?;
            return Some(self.settle(ground, &rested, input));
        }
        if self.is_out(ground, vicinity, input) {
            return None;
        }
        let look = self.ball.look(ground, input);
        if look.is_free {
            let rested = seek(ground, &self.ball, || Frictionless, true, vicinity, input)?;
            return Some(self.settle(ground, &rested, input));
        }
        let pull = self.grip.begin_tick(&look.view, input);
        if let Some(tangential_B) = self.grip.hold(friction, &look.view, &pull, input) {
            return Some(self.answer(ground, &Rested { ball: self.ball, look, tangential_B }, input));
        }
        let memory = &self.grip.memory;
        let against = || Against { friction, memory, pull: &pull, input, slides_with: Cell::new(None) };
        let mut rested = seek(ground, &self.ball, against, false, vicinity, input)?;
        rested.tangential_B +=
            self.grip.drag(friction, &rested.tangential_B, &rested.look.view, &pull, input);
        Some(self.settle(ground, &rested, input))
    }

    /// A ball smaller than the finger's radius that is free, where the finger itself has no room yet: as large as it may be
    /// with its centre at the HIP, without a force.
    pub(super) fn with_less_room(
        &mut self,
        ground: &impl Ground<Foot = F>,
        radius_m: f64,
        input: &ConeInput,
    ) -> Option<Touch> {
        if self.ball.radius_m >= radius_m {
            return None;
        }
        let (foot, distance_m) = ground.nearest_within(&input.hip_B, radius_m).ok()??;
        let mut ball = Ball::in_free_space(input.hip_B, distance_m);
        ball.add(ground, &foot);
        let look = ball.look(ground, input);
        Some(self.answer(ground, &Rested { ball, look, tangential_B: Vector3::zeros() }, input))
    }

    /// Whether the finger is round the corner, whatever friction says.
    fn is_out<G: Ground<Foot = F>>(
        &mut self,
        ground: &G,
        vicinity: &mut G::Vicinity,
        input: &ConeInput,
    ) -> bool {
        let (hip_B, radius_m) = (input.hip_B, self.ball.radius_m);
        if self.tight.has(&hip_B, 0.0) {
            return false;
        }
        let Ok(near) = ground.nearest_within(&hip_B, radius_m) else {
            // As far as can be told.
            return false;
        };
        let tight_m = match near {
            Some((_, distance_m)) => radius_m - distance_m,
            None => self.depth_inside(ground, &hip_B),
        };
        self.is_inside = tight_m > radius_m;
        if tight_m > 0.0 {
            self.tight = Room { centre_B: hip_B, radius_m: tight_m };
            self.scout = None;
            return false;
        }
        let scout = self.scout.unwrap_or(self.ball);
        match seek(ground, &scout, || Frictionless, true, vicinity, input) {
            Some(rested) => {
                self.scout = Some(rested.ball);
                false
            }
            None => true,
        }
    }

    /// A lower bound of how far a HIP, which has room around it, would have to go to be outside; 0 if it is.
    fn depth_inside(&self, ground: &impl Ground, hip_B: &Vector3<f64>) -> f64 {
        let radius_m = self.ball.radius_m;
        // All that the hierarchy can say cheaply, and what is known.
        let clear_m = ground.clearance_m(hip_B, ground.extent_m()).max(ground.seen_m(radius_m));
        // Two balls without a face in them that overlap are on the same side.
        let was_inside =
            self.is_inside && (hip_B - self.tight.centre_B).norm() < clear_m + self.tight.radius_m;
        if was_inside || ground.is_inside(hip_B) { clear_m } else { 0.0 }
    }

    /// The force at a place of rest; a place farther from the HIP than the ball is now is none: it stays where it is.
    fn settle(&mut self, ground: &impl Ground<Foot = F>, rested: &Rested<F>, input: &ConeInput) -> Touch {
        let lag_m = |ball: &Ball<F>| (ball.centre_B - input.hip_B).norm();
        if lag_m(&rested.ball) <= lag_m(&self.ball) + tolerance_m(ground, self.ball.radius_m) {
            return self.answer(ground, rested, input);
        }
        let mut ball = self.ball;
        let look = ball.look(ground, input);
        self.answer(ground, &Rested { ball, look, tangential_B: Vector3::zeros() }, input)
    }

    fn answer<G: Ground<Foot = F>>(&mut self, ground: &G, rested: &Rested<F>, input: &ConeInput) -> Touch {
        let Rested { ball, look, tangential_B } = rested;
        self.ball = *ball;
        let mut look = *look;
        if G::IS_BENT && self.ball.is_pressed_beyond_its_place(&look, input) {
            self.ball.touch_exactly(ground);
            look = self.ball.look(ground, input);
        }
        let ball = &self.ball;
        let (feature, piece) =
            ball.primary().map_or((Feature::Face, 0), |rest| (rest.foot.feature(), rest.foot.piece()));
        let k = input.stiffness_n_per_m;
        let is_pressed = look.view.load_m > 0.0;
        let tangential_B = ball.free_part(tangential_B);
        let spring_B = look.normal_spring_B + tangential_B;
        self.answered = (tangential_B, look.view.load_m, k);
        // In flight it has no surface.
        let is_in_flight = ball.rests().is_empty();
        let normal_B =
            if is_in_flight { direction_or_up(&(ball.centre_B - input.hip_B)) } else { look.view.normal_B };
        Touch {
            god_object: SurfacePoint { point_B: ball.centre_B, normal_B, feature, piece },
            force_on_user_B: if is_pressed { spring_B * k } else { Vector3::zeros() },
            normal_force_n: if is_pressed { k * look.normal_spring_B.norm() } else { 0.0 },
            friction: self.grip.state,
        }
    }
}
