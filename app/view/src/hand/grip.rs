//! How fingers stand around the hand's place: open, or closed on what is between them.
//!
//! Model: two fingers oppose each other along an axis that lies level; of three the first is the thumb and the others stand
//! side by side against it. Closing brings their wishes nearer to each other than what is in between: it keeps the fingers
//! away, and their hand's stiffness times what is left of the way is the force. They close quickly until something is felt
//! between them, then slowly until it is felt enough: what a Premium's motors stand for ever (1.4 N), and what holds 150 g at
//! a friction of 0.8. Fingers that take no part are folded above the hand.
//! Frames: world, y up; metres.

use nalgebra::{UnitQuaternion, Vector3};
use std::f64::consts::PI;

/// From thumb to fingers (m).
const OPEN_M: f64 = 0.075;
const CLOSED_M: f64 = 0.014;
/// How fast that changes, and how fast when something is held (m/s).
const PACE_M_PER_S: f64 = 0.08;
const SQUEEZE_M_PER_S: f64 = 0.02;
/// What is felt, and what is enough (N).
const FELT_N: f64 = 0.05;
const ENOUGH_N: f64 = 1.1;
/// Between the two that oppose the thumb (m).
const BESIDE_M: f64 = 0.024;
/// How high folded fingers are above the hand (m), and how far from each other.
const FOLDED_M: f64 = 0.06;

/// A grip.
#[derive(Debug, Clone, PartialEq)]
pub struct Grip {
    /// That the hand has.
    all: usize,
    /// That take part.
    fingers: usize,
    is_closing: bool,
    /// What the finger that presses hardest presses what is held with (N).
    pressing_n: f64,
    /// From thumb to fingers (m).
    opening_m: f64,
    /// Of the axis about y, from x: as who looks stands, and by how much it was turned besides (rad).
    facing_rad: f64,
    turned_rad: f64,
}

impl Default for Grip {
    fn default() -> Self {
        Self::new(0)
    }
}

impl Grip {
    /// As many fingers close on something at most.
    pub const MOST: usize = 3;

    /// Open, of a hand with so many fingers, along x.
    pub fn new(all: usize) -> Self {
        let fingers = all.min(Self::MOST);
        Self {
            all,
            fingers,
            is_closing: false,
            pressing_n: 0.0,
            opening_m: OPEN_M,
            facing_rad: 0.0,
            turned_rad: 0.0,
        }
    }

    /// The fingers draw near to each other from now on.
    pub fn close(&mut self) {
        self.is_closing = true;
    }

    /// They part.
    pub fn open(&mut self) {
        self.is_closing = false;
    }

    /// Whether they close, or are closed.
    pub fn is_closing(&self) -> bool {
        self.is_closing
    }

    /// Whether nobody has closed it, turned it, or said how many fingers take part.
    pub fn is_as_it_began(&self) -> bool {
        let all_take_part = self.fingers == self.all.min(Self::MOST);
        !self.is_closing && self.opening_m >= OPEN_M && self.turned_rad == 0.0 && all_take_part
    }

    /// So many take part, as far as there are so many.
    pub fn set_fingers(&mut self, fingers: usize) {
        self.fingers = fingers.clamp(1.min(self.all), self.all.min(Self::MOST));
    }

    /// As many take part.
    pub fn fingers(&self) -> usize {
        self.fingers
    }

    /// Turns the axis about the vertical, to the left seen from above (rad).
    pub fn turn(&mut self, by_rad: f64) {
        self.turned_rad = (self.turned_rad + by_rad) % (2.0 * PI);
    }

    /// The axis goes with whoever looks, whose right this is, as long as nothing can be held.
    pub fn face(&mut self, right: &Vector3<f64>) {
        if !self.is_closing && self.opening_m >= OPEN_M && right.x.hypot(right.z) > 1e-3 {
            self.facing_rad = (-right.z).atan2(right.x);
        }
    }

    /// What is held is pressed so hard (N).
    pub fn feel(&mut self, pressing_n: f64) {
        self.pressing_n = pressing_n;
    }

    /// Time goes by (s).
    pub fn pass(&mut self, dt_s: f64) {
        if !self.is_closing {
            self.opening_m = (self.opening_m + PACE_M_PER_S * dt_s).min(OPEN_M);
            return;
        }
        let pace = match self.pressing_n {
            n if n < FELT_N => PACE_M_PER_S,
            n if n < ENOUGH_N => SQUEEZE_M_PER_S,
            _ => 0.0,
        };
        self.opening_m = (self.opening_m - pace * dt_s).max(CLOSED_M);
    }

    /// From thumb to fingers (m).
    pub fn opening_m(&self) -> f64 {
        self.opening_m
    }

    /// From x to the axis.
    pub fn orientation(&self) -> UnitQuaternion<f64> {
        UnitQuaternion::from_axis_angle(&Vector3::y_axis(), self.facing_rad + self.turned_rad)
    }

    /// From the hand's place to that of a finger (m).
    pub fn stand(&self, finger: usize) -> Vector3<f64> {
        let half_m = 0.5 * self.opening_m;
        let stand = match (finger, self.fingers) {
            (0, 1) => Vector3::zeros(),
            (0, 2..) => Vector3::new(-half_m, 0.0, 0.0),
            (1, 2) => Vector3::new(half_m, 0.0, 0.0),
            (1, 3) => Vector3::new(half_m, 0.0, -0.5 * BESIDE_M),
            (2, 3) => Vector3::new(half_m, 0.0, 0.5 * BESIDE_M),
            // In a row, so that they keep out of each other's way.
            (folded, _) => Vector3::new(BESIDE_M * folded as f64 - BESIDE_M, FOLDED_M, 0.0),
        };
        self.orientation() * stand
    }
}
