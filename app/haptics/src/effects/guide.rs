//! A spring and damper towards a track, and nothing along it.
//!
//! Model: at a distance r from the track the pull is `k max(0, r - deadband)` towards it, and the part of the velocity
//! that leaves the track is damped by b; within the deadband there is neither, and from there to twice the deadband the
//! damper fades in. A guide with a `capture_m` pulls only once the finger was that near; one with a `break_away_n` lets
//! go when its spring would pull more, and captures anew as any other. Capturing comes on within 50 ms and letting go
//! fades within 20 ms. It lets go further out than it captures (`HYSTERESIS_M` at least): in a round the user spends more
//! than he is given.
//! On a path the track's point is remembered ([`Footing`]): it moves along the path and slides over where it would jump, so
//! that the pull has no step inside of corners either.
//! Frames: world. Signs: forces on the user.

use nalgebra::Vector3;

use super::footing::Footing;
use super::limits::not_above;
use super::track::{Foot, Kind};
use super::{Limits, MOST_FORCE_N, Motion, Pull, Track, bounded, smooth_step};
use crate::error::{ParameterError, above_zero, at_least_zero};

/// A guide.
#[derive(Debug, Clone, PartialEq)]
pub struct Guide {
    track: Track,
    stiffness_n_per_m: f64,
    damping_n_s_per_m: f64,
    deadband_m: f64,
    capture_m: Option<f64>,
    break_away_n: Option<f64>,
    force_limit_n: f64,
}

/// How much further out a guide lets go than it captures, at least \[m\]: some steps of an encoder.
pub const HYSTERESIS_M: f64 = 0.2e-3;

impl Guide {
    /// Stiffness if nothing is said \[N/m\].
    pub const DEFAULT_STIFFNESS_N_PER_M: f64 = 500.0;
    /// Damping if nothing is said \[N s/m\].
    pub const DEFAULT_DAMPING_N_S_PER_M: f64 = 2.0;
    /// The most it pulls if nothing is said \[N\].
    pub const DEFAULT_FORCE_LIMIT_N: f64 = 5.0;
    /// Speed at which the foot on a path slides over to where its way goes on \[m/s\].
    pub const SLIDE_M_PER_S: f64 = 0.1;
    /// By how much another part of a path has to be nearer for a finger to change over to it \[m\].
    pub const CHANGE_M: f64 = 1e-3;

    /// A guide to this track, everywhere and never letting go.
    ///
    /// Errors: a stiffness that is not positive or a damping that is negative, not finite or above the limit.
    pub fn new(
        track: Track,
        stiffness_n_per_m: f64,
        damping_n_s_per_m: f64,
        limits: &Limits,
    ) -> Result<Self, ParameterError> {
        above_zero("stiffness_n_per_m", stiffness_n_per_m)?;
        Ok(Self {
            track,
            stiffness_n_per_m: limits.check_stiffness("stiffness_n_per_m", stiffness_n_per_m)?,
            damping_n_s_per_m: limits.check_damping(damping_n_s_per_m)?,
            deadband_m: 0.0,
            capture_m: None,
            break_away_n: None,
            force_limit_n: Self::DEFAULT_FORCE_LIMIT_N,
        })
    }

    /// Felt only beyond this distance of the track. Set before capture and break-away.
    ///
    /// Errors: a distance not finite or negative.
    pub fn with_deadband(self, deadband_m: f64) -> Result<Self, ParameterError> {
        Ok(Self { deadband_m: at_least_zero("deadband_m", deadband_m)?, ..self })
    }

    /// Pulls this much at most. Set before break-away.
    ///
    /// Errors: a force that is not positive, not finite, or above [`MOST_FORCE_N`].
    pub fn with_force_limit(self, force_limit_n: f64) -> Result<Self, ParameterError> {
        let value = above_zero("force_limit_n", force_limit_n)?;
        let force_limit_n = not_above("force_limit_n", value, MOST_FORCE_N, "the most that any guide pulls")?;
        Ok(Self { force_limit_n, ..self })
    }

    /// Pulls only once a finger came within this distance of the track.
    ///
    /// Errors: a distance not finite or not positive.
    pub fn with_capture(self, capture_m: f64) -> Result<Self, ParameterError> {
        Ok(Self { capture_m: Some(above_zero("capture_m", capture_m)?), ..self })
    }

    /// Lets go when its spring would pull more than this. Without a capture distance it captures at half the
    /// stretch at which it lets go. Set after deadband, force limit and capture.
    ///
    /// Errors: a force that is not positive, not finite, or above the force limit; a capture distance from which
    /// it would let go at once.
    pub fn with_break_away(self, break_away_n: f64) -> Result<Self, ParameterError> {
        let value = above_zero("break_away_n", break_away_n)?;
        not_above("break_away_n", value, self.force_limit_n, "force_limit_n")?;
        let stretch_m = value / self.stiffness_n_per_m;
        let capture_m = self.capture_m.unwrap_or(self.deadband_m + 0.5 * stretch_m);
        let most_m = self.deadband_m + stretch_m - HYSTERESIS_M;
        not_above("capture_m", capture_m, most_m, OF_CAPTURE)?;
        Ok(Self { break_away_n: Some(value), capture_m: Some(capture_m), ..self })
    }

    /// What it leads along.
    pub fn track(&self) -> &Track {
        &self.track
    }

    pub(super) fn pull(&self, motion: &Motion, hold: &mut Hold) -> Pull {
        let draw = |foot: &Foot| self.draw(foot, motion);
        let drawn = match &self.track.0 {
            Kind::Path(path) => hold.footing.step(path, motion, self.stiffness_n_per_m, draw),
            _ => draw(&self.track.foot(&motion.position_W)),
        };
        let before = hold.strength;
        hold.step(self, &drawn, motion.dt_s);
        let fading_n = self.force_limit_n * (hold.strength - before).abs();
        if hold.strength == 0.0 {
            hold.footing.forget();
            return Pull { explained_n: fading_n, ..Pull::default() };
        }
        // A foot that slides over and a change to another one are as fast, each.
        let way_m = motion.way_m + 2.0 * Self::SLIDE_M_PER_S * motion.dt_s;
        Pull {
            force_on_user_W: drawn.force_W * hold.strength,
            stored_j: drawn.stored_j * hold.strength,
            explained_n: fading_n
                + self.stiffness_n_per_m * way_m
                + self.damping_n_s_per_m * motion.speeds_m_s,
        }
    }

    /// Its full force towards this foot.
    fn draw(&self, foot: &Foot, motion: &Motion) -> Draw {
        let off_W = motion.position_W - foot.point_W;
        let distance_m = off_W.norm();
        let stretch_m = (distance_m - self.deadband_m).max(0.0);
        let spring_W = if stretch_m > 0.0 {
            off_W * (-self.stiffness_n_per_m * stretch_m / distance_m)
        } else {
            Vector3::zeros()
        };
        let damping = self.damping_n_s_per_m * self.damped(stretch_m);
        let damper_W = foot.across(&motion.velocity_W, &off_W) * -damping;
        Draw {
            distance_m,
            stretch_m,
            force_W: bounded(spring_W + damper_W, self.force_limit_n),
            stored_j: self.stored_j(stretch_m),
        }
    }

    /// Stretch \[m\] and damping \[N s/m\] at this distance.
    pub(super) fn strengths(&self, distance_m: f64) -> (f64, f64) {
        let stretch_m = (distance_m - self.deadband_m).max(0.0);
        (stretch_m, self.damping_n_s_per_m * self.damped(stretch_m))
    }

    /// Whether it does so at this stretch \[m\].
    pub(super) fn lets_go_at(&self, stretch_m: f64) -> bool {
        self.break_away_n.is_some_and(|most_n| self.stiffness_n_per_m * stretch_m > most_n)
    }

    /// Distances between which it is felt in full \[m\].
    pub(super) fn felt_between(&self) -> (f64, f64) {
        let most_n = self.break_away_n.unwrap_or(self.force_limit_n);
        let far_m = self.deadband_m + INSIDE * most_n / self.stiffness_n_per_m;
        ((2.0 * self.deadband_m).min(far_m), far_m)
    }

    /// k \[N/m\].
    pub fn stiffness_n_per_m(&self) -> f64 {
        self.stiffness_n_per_m
    }

    /// The most it pulls \[N\].
    pub fn force_limit_n(&self) -> f64 {
        self.force_limit_n
    }

    /// What its spring gives back on the way to the track (J).
    fn stored_j(&self, stretch_m: f64) -> f64 {
        // From here on the force is its limit.
        let spring_m = stretch_m.min(self.force_limit_n / self.stiffness_n_per_m);
        (0.5 * self.stiffness_n_per_m * spring_m) * spring_m + self.force_limit_n * (stretch_m - spring_m)
    }

    /// How much of the damper is felt, 0 to 1.
    fn damped(&self, stretch_m: f64) -> f64 {
        if self.deadband_m > 0.0 { smooth_step(stretch_m / self.deadband_m) } else { 1.0 }
    }
}

/// Force of a guide towards a foot, once it has the finger.
#[derive(Debug, Clone, Copy)]
pub(super) struct Draw {
    distance_m: f64,
    /// Beyond the deadband (m).
    pub(super) stretch_m: f64,
    pub(super) force_W: Vector3<f64>,
    stored_j: f64,
}

impl Draw {
    /// Of two, of which the other one has this weight.
    pub(super) fn mixed(&self, other: &Self, weight: f64) -> Self {
        let mix = |one: f64, other: f64| one * (1.0 - weight) + other * weight;
        Self {
            distance_m: mix(self.distance_m, other.distance_m),
            stretch_m: mix(self.stretch_m, other.stretch_m),
            force_W: self.force_W * (1.0 - weight) + other.force_W * weight,
            stored_j: mix(self.stored_j, other.stored_j),
        }
    }
}

/// Whether a finger is held by a guide, and where.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Hold {
    pub(super) is_captured: bool,
    /// How much of the force is rendered, 0 to 1.
    strength: f64,
    footing: Footing,
}

impl Hold {
    fn step(&mut self, guide: &Guide, drawn: &Draw, dt_s: f64) {
        self.is_captured = if self.is_captured {
            !guide.lets_go_at(drawn.stretch_m)
        } else {
            guide.capture_m.is_none_or(|capture_m| drawn.distance_m <= capture_m)
        };
        if dt_s.is_nan() || dt_s <= 0.0 {
            return;
        }
        let change = if self.is_captured { dt_s / CAPTURE_S } else { -dt_s / LET_GO_S };
        self.strength = (self.strength + change).clamp(0.0, 1.0);
    }
}

/// Of the stretch at which it lets go: there it is surely felt.
const INSIDE: f64 = 0.99;
/// How long capturing takes \[s\].
const CAPTURE_S: f64 = 0.05;
/// How long letting go takes \[s\].
const LET_GO_S: f64 = 0.02;

const OF_CAPTURE: &str = "0.2 mm below where it lets go, deadband_m + break_away_n / stiffness_n_per_m: it would be captured anew at once";
