//! Presses harder when what is held begins to slip, as people do.
//!
//! Problem: a hand that follows a script drops whatever is heavier or more slippery than the script's author thought.
//! Model, after Johansson and Westling (1984). The hand feels the force on its fingertip; along the line to the
//! fingers that hold against it that is the grip N, across it the load T.
//! - *Coordination*: grip follows load without delay, N = (1 + margin) T / mu + spare, with the friction mu that the
//!   hand believes in; it only ever adds to what the script presses, quickly up, slowly down.
//! - *Slip*: T / N stands still although the tip moved on across the grip, or although N changed: load no longer is
//!   what the hand or the object make it, but what friction lets through. A ratio that the hand itself keeps by
//!   coordination is no such sign.
//! - *Reaction*: a latency later the hand believes in the ratio at which it slipped. Coordination then presses until
//!   the load no longer grows with the grip, that is until it holds.
//!
//! What the hand adds is a shift of the intended point along the grip, of the size that the hand's springs make that
//! force of. A copy of the intention's low-pass predicts how much of it has arrived; what is asked for is corrected by
//! that, so that the loop does not wind up while the hand is still moving.
//! Frames: vectors in D. Forces in N, `T / N` dimensionless.
//! Invariants: adds between zero and the hardest grip; belief only falls, down to [`LEAST_FRICTION`]; without
//! partners or contact the addition runs out.
//! Limits: something that is carried along by a script that presses enough looks like slip until the hand has tried
//! once, which leaves it pressing harder by the margin. Friction that falls by more than the margin while something is
//! held goes unnoticed after a slip was felt. Sliding along a fixed thing with a partner behind it ends at the
//! hardest grip.
//! Cost: some 20 ns a tick; no allocation.
//! Reference: Johansson, Westling, "Roles of glabrous skin receptors and sensorimotor memory in automatic control of
//! precision grip when lifting rougher or more slippery objects", Exp. Brain Res. 56, 1984.
#![allow(non_snake_case)] // a frame's letter ends the name of a quantity in it

use nalgebra::Vector3;

use super::impedance::without_dregs;
use super::intention::IntentionSpec;
use super::transition::Transition;

/// How a person minds what is held.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GripSpec {
    /// Friction that is believed in before anything was felt.
    pub believed_friction: f64,
    /// Share by which the grip exceeds the smallest that holds.
    pub margin: f64,
    /// What it exceeds it by besides (N).
    pub spare_n: f64,
    /// From a slip to the answer (s).
    pub latency_s: f64,
    /// How fast the grip grows (N/s).
    pub rise_n_per_s: f64,
    /// How fast it eases off (N/s).
    pub ease_n_per_s: f64,
    /// The hardest grip (N).
    pub max_force_n: f64,
}

/// What a finger feels in a tick, besides its own motion.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Felt {
    /// The force on the user of the last tick (N), in D.
    pub force_on_user_D: Vector3<f64>,
    /// Centre of the tips of the fingers that hold together with this one (m), in D; `None`: there are none.
    pub partners_centroid_D: Option<Vector3<f64>>,
}

/// The closed loop of one finger.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Grip {
    spec: GripSpec,
    intention: IntentionSpec,
    /// Of the hand at the tip (N/m).
    stiffness: Vector3<f64>,
    /// Towards the partners; kept while they are too near to tell.
    axis_D: Vector3<f64>,
    pressed: Pressed,
    believed_friction: f64,
    /// Whether something slipped since contact was made.
    has_slipped: bool,
    plateau: Plateau,
    /// Time until a slip that was felt is answered (s).
    answer_in_s: Option<f64>,
    /// What is added to the script's grip (N), and what of it, and how fast, has arrived.
    added_n: f64,
    arrived: [f64; 2],
    transition: Transition,
    /// What the transition is for (s).
    step_s: f64,
}

/// Grip and load as felt (N), smoothed.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Pressed {
    grip: f64,
    load: f64,
}

/// Since when the ratio of load and grip stands still: ratio, grip and place of its begin.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Plateau {
    ratio: f64,
    grip: f64,
    across: Vector3<f64>,
}

/// Partners nearer than this give no direction (m).
const NEAREST_PARTNER_M: f64 = 2e-3;
/// Less than this is no contact (N): the skin's threshold is some hundredths.
const CONTACT_N: f64 = 0.05;
/// Less than this is no load that could slip, twice as much certainly is one (N): a trembling finger makes half of it
/// at the first touch.
const LEAST_LOAD_N: f64 = 0.06;
/// Nothing is held at a lower ratio of load and grip.
const LEAST_FRICTION: f64 = 0.1;
/// How slowly the skin's signals become a feeling (s): steps of a simulated contact pass it smoothed.
const SKIN_S: f64 = 0.008;
/// How slowly the grip settles (s). A hand on its springs swings at 7 Hz and answers later than the prediction, which
/// knows the low-pass only; at a third of this the grip would never come to rest.
const SETTLE_S: f64 = 0.08;
/// A ratio stands still while it stays within this share of where it began.
const STANDSTILL: f64 = 0.05;
/// The share by which a grip has to change, and the way a tip has to go (m), for a standing ratio to mean slip.
const GRIP_CHANGE: f64 = 0.1;
const SLIP_WAY_M: f64 = 2e-3;

impl Grip {
    /// Of a hand with this stiffness at the tip (N/m) and this low-pass before it.
    pub(super) fn new(spec: GripSpec, stiffness: Vector3<f64>, intention: IntentionSpec) -> Self {
        Self {
            spec,
            intention,
            stiffness,
            axis_D: Vector3::zeros(),
            pressed: Pressed::default(),
            believed_friction: spec.believed_friction,
            has_slipped: false,
            plateau: Plateau { ratio: f64::INFINITY, grip: 0.0, across: Vector3::zeros() },
            answer_in_s: None,
            added_n: 0.0,
            arrived: [0.0; 2],
            transition: intention.transition(USUAL_TICK_S),
            step_s: USUAL_TICK_S,
        }
    }

    /// A tick of `dt_s` > 0 with the own tip at `tip_D`: by how much the intended point is shifted (m).
    pub(super) fn step(&mut self, tip_D: Vector3<f64>, felt: Felt, dt_s: f64) -> Vector3<f64> {
        let is_opposed = self.face(tip_D, felt.partners_centroid_D);
        self.feel(felt.force_on_user_D, dt_s);
        if is_opposed && self.pressed.grip > CONTACT_N {
            let wanted_n = self.wanted_grip();
            self.mind_slip(tip_D, wanted_n, dt_s);
            self.add(wanted_n - (self.pressed.grip - self.arrived[0]), dt_s);
        } else {
            self.let_go(dt_s);
        }
        self.arrive(dt_s);
        let along = self.axis_D.dot(&self.stiffness.component_mul(&self.axis_D));
        if along > 0.0 { self.axis_D * (self.added_n / along) } else { Vector3::zeros() }
    }

    /// Turns to the partners; whether there are any.
    fn face(&mut self, tip_D: Vector3<f64>, partners_D: Option<Vector3<f64>>) -> bool {
        let Some(partners_D) = partners_D else { return false };
        if let Some(axis_D) = (partners_D - tip_D).try_normalize(NEAREST_PARTNER_M) {
            self.axis_D = axis_D;
        }
        self.axis_D != Vector3::zeros()
    }

    fn feel(&mut self, force_on_user_D: Vector3<f64>, dt_s: f64) {
        let along = force_on_user_D.dot(&self.axis_D);
        let share = dt_s / (SKIN_S + dt_s);
        // What is squeezed pushes the finger back, against the axis.
        self.pressed.grip += share * ((-along).max(0.0) - self.pressed.grip);
        self.pressed.load += share * ((force_on_user_D - self.axis_D * along).norm() - self.pressed.load);
    }

    /// The grip that the load asks for (N).
    fn wanted_grip(&self) -> f64 {
        let smallest = self.pressed.load / self.believed_friction;
        let is_load = (self.pressed.load / LEAST_LOAD_N - 1.0).clamp(0.0, 1.0);
        (is_load * ((1.0 + self.spec.margin) * smallest + self.spec.spare_n)).min(self.spec.max_force_n)
    }

    fn mind_slip(&mut self, tip_D: Vector3<f64>, wanted_n: f64, dt_s: f64) {
        self.answer_in_s = match self.answer_in_s {
            Some(left_s) if left_s > dt_s => Some(left_s - dt_s),
            Some(_) => {
                self.believe(self.pressed.ratio());
                None
            }
            None => self.slips(tip_D, wanted_n).then_some(self.spec.latency_s),
        };
    }

    fn believe(&mut self, ratio: f64) {
        self.has_slipped = true;
        self.believed_friction = ratio.max(LEAST_FRICTION).min(self.believed_friction);
    }

    /// Whether the ratio has been standing still through something that should have changed it.
    fn slips(&mut self, tip_D: Vector3<f64>, wanted_n: f64) -> bool {
        let (ratio, grip) = (self.pressed.ratio(), self.pressed.grip);
        let across = tip_D - self.axis_D * tip_D.dot(&self.axis_D);
        let keeps_it_itself = self.added_n > 0.0 && (grip / wanted_n - 1.0).abs() < STANDSTILL;
        let stands = (ratio / self.plateau.ratio - 1.0).abs() < STANDSTILL;
        if !stands || keeps_it_itself {
            self.plateau = Plateau { ratio, grip, across };
            return false;
        }
        let is_news = !self.has_slipped && ratio > LEAST_FRICTION && self.pressed.load > LEAST_LOAD_N;
        let went_on = (across - self.plateau.across).norm() > SLIP_WAY_M;
        let changed = (grip / self.plateau.grip - 1.0).abs() > GRIP_CHANGE;
        is_news && (went_on || changed)
    }

    /// Asks for an addition of `wanted_n`, as fast as a hand does.
    fn add(&mut self, wanted_n: f64, dt_s: f64) {
        let (fall, rise) = (self.spec.ease_n_per_s * dt_s, self.spec.rise_n_per_s * dt_s);
        let step = ((wanted_n - self.added_n) * (dt_s / SETTLE_S).min(1.0)).clamp(-fall, rise);
        self.added_n = (self.added_n + step).clamp(0.0, self.spec.max_force_n);
    }

    /// Nothing is held: what was added runs out, and the next thing may be another.
    fn let_go(&mut self, dt_s: f64) {
        self.added_n = (self.added_n - self.spec.rise_n_per_s * dt_s).max(0.0);
        self.has_slipped = false;
        self.answer_in_s = None;
        self.plateau.ratio = f64::INFINITY;
    }

    fn arrive(&mut self, dt_s: f64) {
        if dt_s != self.step_s {
            (self.transition, self.step_s) = (self.intention.transition(dt_s), dt_s);
        }
        let (missing, speed) = self.transition.apply(self.arrived[0] - self.added_n, self.arrived[1]);
        self.arrived = [self.added_n + missing, without_dregs(speed)];
    }
}

impl Pressed {
    /// Load by grip.
    fn ratio(&self) -> f64 {
        self.load / self.grip
    }
}

const USUAL_TICK_S: f64 = 1e-3;

#[cfg(test)]
mod tests;
