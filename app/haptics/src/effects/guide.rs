//! A spring and damper towards a track, and nothing along it.
//!
//! Model: at a distance r from the track the pull is `k max(0, r - deadband)` towards it, and the part of the velocity
//! that leaves the track is damped by b; within the deadband there is neither, and from there to twice the deadband the
//! damper fades in. A guide with a `capture_m` pulls only once the finger was that near; one with a `break_away_n` lets
//! go when its spring would pull more, and captures anew as any other. Capturing comes on within 50 ms and letting go
//! fades within 20 ms. It lets go further out than it captures (`HYSTERESIS_M` at least): in a round the user spends more
//! than he is given.
//! On the inner side of a path's corner, where two of its pieces are equally near, the pull changes sides.
//! Frames: world. Signs: forces on the user.

use nalgebra::Vector3;

use super::limits::not_above;
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
        let foot = self.track.foot(&motion.position_W);
        let off_W = motion.position_W - foot.point_W;
        let distance_m = off_W.norm();
        let stretch_m = (distance_m - self.deadband_m).max(0.0);
        let before = hold.strength;
        hold.step(self, distance_m, self.stiffness_n_per_m * stretch_m, motion.dt_s);
        let fading_n = self.force_limit_n * (hold.strength - before).abs();
        if hold.strength == 0.0 {
            return Pull { explained_n: fading_n, ..Pull::default() };
        }
        let spring_W = if stretch_m > 0.0 {
            off_W * (-self.stiffness_n_per_m * stretch_m / distance_m)
        } else {
            Vector3::zeros()
        };
        let damping = self.damping_n_s_per_m * self.damped(stretch_m);
        let damper_W = foot.across(&motion.velocity_W, &off_W) * -damping;
        Pull {
            force_on_user_W: bounded(spring_W + damper_W, self.force_limit_n) * hold.strength,
            stored_j: self.stored_j(stretch_m) * hold.strength,
            explained_n: fading_n
                + self.stiffness_n_per_m * motion.way_m
                + self.damping_n_s_per_m * motion.speeds_m_s,
        }
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

/// Whether a finger is held by a guide.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Hold {
    pub(super) is_captured: bool,
    /// How much of the force is rendered, 0 to 1.
    strength: f64,
}

impl Hold {
    fn step(&mut self, guide: &Guide, distance_m: f64, pull_n: f64, dt_s: f64) {
        self.is_captured = if self.is_captured {
            guide.break_away_n.is_none_or(|most_n| pull_n <= most_n)
        } else {
            guide.capture_m.is_none_or(|capture_m| distance_m <= capture_m)
        };
        if dt_s.is_nan() || dt_s <= 0.0 {
            return;
        }
        let change = if self.is_captured { dt_s / CAPTURE_S } else { -dt_s / LET_GO_S };
        self.strength = (self.strength + change).clamp(0.0, 1.0);
    }
}

/// How long capturing takes \[s\].
const CAPTURE_S: f64 = 0.05;
/// How long letting go takes \[s\].
const LET_GO_S: f64 = 0.02;

const OF_CAPTURE: &str = "0.2 mm below where it lets go, deadband_m + break_away_n / stiffness_n_per_m: it would be captured anew at once";
