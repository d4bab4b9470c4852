//! Slides a god-object along a surface until friction holds it.
//!
//! Problem: on a plane the rim of the friction circle is one step away (Melder eq. 4.6). On a
//! curved surface the step leaves the surface; brought back (eq. 4.12-4.14), the god-object has
//! another normal, another depth and another circle. One projection per tick, as printed, leaves a
//! drag on frictionless spheres and sliding ratios off by 1e-3 at ordinary speeds.
//!
//! Model: repeat tangent plane, slide, settle until the law asks for no further slide. With H at
//! distance rho from the centre of a sphere of radius r, the error shrinks per round by
//! `1 - (rho / r)(cos phi - mu sin phi)` only, which deep inside is hardly at all. The slide asked
//! for is therefore used as a residual of a secant search along the path: the first step is the
//! plain one, later steps are divided by the slope seen in the last. Signed residuals take
//! overshoots back within the tick.
//!
//! Invariants: the god-object ends on the surface, and no farther from the HIP than it began (unless the law asks for
//! that): friction gives no energy to the spring. Deep inside, beyond the centre of curvature, a step could lead round
//! the solid to a farther side; it is halved then, and a step back is left out. The tangential force is that of the rim asked
//! for, even when the bound ends the search early; then the god-object goes on next tick.
//!
//! Cost: at most [`MAX_SLIDE_ROUNDS`] rounds; one move on a plane, three to five at 5 mm depth in a
//! ball of 0.1 m; 4 million random slides down to rho = 1e-4 r took at most 34.

use nalgebra::Vector3;

use crate::friction_cone::ConeInput;
use crate::friction_law::{FrictionLaw, FrictionMemory, FrictionQuery, FrictionState};
use crate::grip::{Pull, cut_to, query};
use crate::surface::{Surface, SurfacePoint};
use crate::tangent_view::TangentView;

/// Bound on the moves of one slide in one tick.
pub const MAX_SLIDE_ROUNDS: u32 = 64;

/// Where a slide ended.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Slid {
    pub(crate) view: TangentView,
    /// Tangential force over stiffness, on the user \[m\].
    pub(crate) tangential_B: Vector3<f64>,
    pub(crate) rounds: u32,
}

/// What all rounds of one slide have in common.
pub(crate) struct Slider<'s, L: ?Sized> {
    pub(crate) friction: &'s L,
    pub(crate) memory: &'s FrictionMemory,
    pub(crate) pull: &'s Pull,
    pub(crate) input: &'s ConeInput,
    /// Where the god-object was when the tick began.
    pub(crate) start_B: Vector3<f64>,
}

impl<L: FrictionLaw + ?Sized> Slider<'_, L> {
    /// What the law asks of a god-object at `point_B`.
    #[inline(always)]
    pub(crate) fn look(
        &self,
        view: TangentView,
        direction_before_B: &Vector3<f64>,
        point_B: &Vector3<f64>,
    ) -> Round {
        let asked = |query: &_| self.friction.slide(query, self.memory);
        Round::new(view, direction_before_B, asked, &(self.start_B - point_B), self.pull, self.input)
    }

    /// Inside its circle.
    #[inline]
    pub(crate) fn rested(&self, round: &Round, rounds: u32) -> Slid {
        let query = query(FrictionState::Slip, round.view.gap_m, 0.0, &round.view, self.pull, self.input);
        let held_m = self.friction.held_limit_m(&query, self.memory);
        // Where friction grows with speed, the circle that it rests in is larger than the one that holds.
        let limit_m = held_m.max(round.gap_m - round.asked_m);
        Slid { view: round.view, tangential_B: cut_to(round.view.lag_B, limit_m), rounds }
    }

    /// Beyond the rim: inside its circle its own spring is felt, or none if it is past S.
    #[inline]
    pub(crate) fn went_too_far(&self, round: &Round, rounds: u32) -> Slid {
        let slid = self.rested(round, rounds);
        if round.gap_m > 0.0 { slid } else { Slid { tangential_B: Vector3::zeros(), ..slid } }
    }

    /// Square of how long the spring is from a point.
    #[inline]
    pub(crate) fn stretch(&self, point_B: &Vector3<f64>) -> f64 {
        (point_B - self.input.hip_B).norm_squared()
    }

    /// How long the spring may become during a slide that begins at `from_B`, squared.
    #[inline]
    pub(crate) fn longest(&self, round: &Round, from_B: &Vector3<f64>) -> f64 {
        // Bonds bent the other way may ask for a place beyond S.
        let asked_for = self.stretch(&round.target_B(round.asked_m));
        asked_for.max(self.stretch(from_B)) * (1.0 + STRETCH_TOLERANCE)
    }
}

/// Moves `god_object` until `friction` asks for no more, starting from what `view` shows.
pub(crate) fn slide<S: Surface + ?Sized, L: FrictionLaw + ?Sized>(
    surface: &S,
    friction: &L,
    god_object: &mut SurfacePoint,
    view: TangentView,
    memory: &FrictionMemory,
    pull: &Pull,
    input: &ConeInput,
) -> Slid {
    let slider = Slider { friction, memory, pull, input, start_B: god_object.point_B };
    let mut round = slider.look(view, &Vector3::zeros(), &god_object.point_B);
    if round.is_inside_the_circle() {
        return slider.rested(&round, 0);
    }
    let mut secant = Secant::default();
    let longest = slider.longest(&round, &god_object.point_B);
    let mut shortened = 1.0;
    for rounds in 1..=MAX_SLIDE_ROUNDS {
        let step_m = shortened * secant.step(round.asked_m, round.view.depth_m);
        let moved = surface.settle(god_object, &round.target_B(step_m));
        if slider.stretch(&moved.point_B) > longest {
            // Flung round the solid, to a farther side of it: a slide must not load the spring.
            if round.asked_m < 0.0 && round.gap_m > 0.0 {
                return slider.went_too_far(&round, rounds);
            }
            shortened *= 0.5;
            continue;
        }
        shortened = 1.0;
        secant.made(round.asked_m, step_m);
        let piece_before = god_object.piece;
        *god_object = moved;
        let view = TangentView::of(surface, god_object, input);
        if god_object.piece != piece_before {
            // Over an edge: nothing seen on the piece before says anything about this one.
            if view.depth_m <= 0.0 {
                // Beyond the edge nothing holds the finger back: at a sharp edge the god-object would change sides
                // until the bound, and the side it ended on would decide whether there is contact.
                return Slid { view, tangential_B: Vector3::zeros(), rounds };
            }
            secant = Secant::default();
            round = slider.look(view, &Vector3::zeros(), &god_object.point_B);
            if round.is_inside_the_circle() {
                return slider.rested(&round, rounds);
            }
            continue;
        }
        round = slider.look(view, &round.direction_B, &god_object.point_B);
        if round.asked_m.is_nan() || round.asked_m.abs() <= view.rest_m {
            return round.arrived(rounds);
        }
    }
    if round.asked_m < 0.0 {
        slider.went_too_far(&round, MAX_SLIDE_ROUNDS)
    } else {
        round.arrived(MAX_SLIDE_ROUNDS)
    }
}

/// One look at the contact during a slide.
pub(crate) struct Round {
    pub(crate) view: TangentView,
    /// Against the motion, in the tangent plane.
    pub(crate) direction_B: Vector3<f64>,
    pub(crate) gap_m: f64,
    /// What the law still asks for, signed.
    pub(crate) asked_m: f64,
}

impl Round {
    /// `back_B` leads from the god-object to where it was when the tick began.
    #[inline(always)]
    fn new(
        view: TangentView,
        direction_before_B: &Vector3<f64>,
        asked: impl Fn(&FrictionQuery) -> f64,
        back_B: &Vector3<f64>,
        pull: &Pull,
        input: &ConeInput,
    ) -> Self {
        let (direction_B, gap_m) = view.signed_gap(direction_before_B);
        // The chord, since that is what two recorded positions over dt show as speed.
        let travel_m = back_B.norm().copysign(back_B.dot(&direction_B));
        let query = query(FrictionState::Slip, gap_m, travel_m, &view, pull, input);
        Self { view, direction_B, gap_m, asked_m: asked(&query) }
    }

    /// In slip, but nothing to slide: it stays, and stays in slip until the law catches it.
    ///
    /// A gap of zero does move: onto S, which is where the frictionless god-object belongs even
    /// if the HIP only went deeper.
    pub(crate) fn is_inside_the_circle(&self) -> bool {
        self.asked_m < 0.0 || (self.asked_m == 0.0 && self.gap_m > 0.0) || self.asked_m.is_nan()
    }

    /// The point of the tangent plane `step_m` closer to S.
    pub(crate) fn target_B(&self, step_m: f64) -> Vector3<f64> {
        let radius_m = self.gap_m - step_m;
        if radius_m == 0.0 {
            return self.view.surface_point_B;
        }
        //= melder#4.6
        self.view.surface_point_B + self.direction_B * radius_m
    }

    /// The force belongs to the rim that the law asks for; what is left to slide is rounding, or the debt of a search
    /// that met its bound, and must not leave the friction cone, nor pull along with the motion.
    fn rim_B(&self) -> Vector3<f64> {
        self.direction_B * (self.gap_m - self.asked_m).max(0.0)
    }

    #[inline]
    pub(crate) fn arrived(&self, rounds: u32) -> Slid {
        Slid { view: self.view, tangential_B: self.rim_B(), rounds }
    }
}

/// Divides each asked-for slide by the slope that the last step showed.
///
/// After a change of sign this interpolates, so the step stays within the last one. Where the
/// residual grew although the step was right (past the steepest point of a sphere, seen from deep
/// inside) the steps double instead.
pub(crate) struct Secant {
    /// Slide asked for and step made, one round ago.
    last: Option<(f64, f64)>,
    gain: f64,
}

impl Default for Secant {
    fn default() -> Self {
        Self { last: None, gain: 1.0 }
    }
}

impl Secant {
    /// Next step. It exceeds both the slide asked for and the depth, which stands for the size of
    /// the surroundings, never: a slope taken from noise must not fling the god-object away.
    pub(crate) fn step(&mut self, asked_m: f64, depth_m: f64) -> f64 {
        if let Some((asked_before_m, step_m)) = self.last.take() {
            let slope = (asked_before_m - asked_m) / step_m;
            self.gain = if slope > f64::MIN_POSITIVE { 1.0 / slope } else { 2.0 * self.gain };
        }
        let longest_m = asked_m.abs().max(depth_m);
        (asked_m * self.gain).max(-longest_m).min(longest_m)
    }

    /// The step that was really made; before it, `step` answers the same again.
    pub(crate) fn made(&mut self, asked_m: f64, step_m: f64) {
        self.last = Some((asked_m, step_m));
    }
}

/// A square of a length that counts as no longer than another: far above rounding, far below what is felt.
const STRETCH_TOLERANCE: f64 = 1e-9;
