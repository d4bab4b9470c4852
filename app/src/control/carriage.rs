//! Devices that go where the camera goes.
//!
//! Problem: a camera may be anywhere in the next tick, a hand is on the device, and where the device's base goes the
//! fingertip goes.
//! Model: what devices go by follows the camera. A leading pose goes straight to where the camera is, so fast that no
//! fingertip is carried faster than [`MOST_SPEED_M_S`]; the carriage itself follows that by a low-pass with the time
//! `FOLLOWING_S`, so that its speed changes by no more than [`MOST_ACCELERATION_M_S2`]. A finger that touches feels k times
//! the way of a tick more in each tick, at most.
//! Invariant: no allocation after `new`.

#![allow(non_snake_case)] // Names carry their frames: X_WC is the camera's pose in the world.

use super::path::{MOST_ACCELERATION_M_S2, MOST_SPEED_M_S, between};
use crate::fast_step::FastStep;
use nalgebra::Isometry3;
use world::Layout;

/// A full reversal at full speed is as sharp as allowed (s).
const FOLLOWING_S: f64 = 2.0 * MOST_SPEED_M_S / MOST_ACCELERATION_M_S2;
/// So near it is there (m).
const THERE_M: f64 = 1e-6;

/// What devices stand on that go with a camera.
#[derive(Debug, Clone, Default)]
pub struct Carriage {
    layout: Layout,
    /// Where the camera is.
    to_WC: Isometry3<f64>,
    leading_WC: Isometry3<f64>,
    /// Where devices have it.
    X_WC: Isometry3<f64>,
    goes: bool,
    /// Distance of a fingertip from the camera (m), at most, as last known: in the first tick of a world no tip is.
    lever_m: f64,
}

impl Carriage {
    /// For devices that stand so; without an attached master nothing is carried.
    pub fn new(layout: Option<Layout>) -> Self {
        let layout = layout.unwrap_or_default();
        let X_WC = layout.camera().unwrap_or_else(Isometry3::identity);
        Self { layout, to_WC: X_WC, leading_WC: X_WC, X_WC, goes: false, lever_m: 0.0 }
    }

    /// The camera is there.
    pub(super) fn go_to(&mut self, X_WC: &Isometry3<f64>) {
        self.to_WC = *X_WC;
        self.goes = self.layout.camera().is_some();
    }

    /// A tick of this length (s).
    pub(super) fn advance(&mut self, step: &mut FastStep, dt_s: f64) {
        if !self.goes {
            return;
        }
        self.lever_m = step.farthest_m(&self.X_WC.translation.vector).unwrap_or(self.lever_m);
        let lever_m = self.lever_m;
        let most_m = MOST_SPEED_M_S * dt_s;
        let left_m = way_m(&self.leading_WC, &self.to_WC, lever_m);
        self.leading_WC = if left_m <= most_m {
            self.to_WC
        } else {
            between(&self.leading_WC, &self.to_WC, most_m / left_m)
        };
        let behind_m = way_m(&self.X_WC, &self.leading_WC, lever_m);
        let next_WC =
            between(&self.X_WC, &self.leading_WC, (dt_s / FOLLOWING_S).min(most_m / behind_m.max(most_m)));
        let is_there = self.leading_WC == self.to_WC && behind_m < THERE_M;
        self.carry(if is_there { self.to_WC } else { next_WC }, step);
        self.goes = !is_there;
    }

    /// The devices of another world, in which nobody touches anything yet, stand where those of the one before do.
    pub(super) fn hand_over(&mut self, step: &mut FastStep) {
        if self.layout.camera().is_some() {
            self.carry(self.X_WC, step);
        }
    }

    fn carry(&mut self, X_WC: Isometry3<f64>, step: &mut FastStep) {
        self.layout = std::mem::take(&mut self.layout).with_camera(X_WC);
        // Nobody is carried as fast as what is refused, but who was lost and is found elsewhere; the next tick tries again.
        if step.set_layout(&self.layout) {
            self.X_WC = X_WC;
        }
    }
}

/// How far a camera takes a point that is so far from it (m), at most.
fn way_m(from: &Isometry3<f64>, to: &Isometry3<f64>, lever_m: f64) -> f64 {
    (to.translation.vector - from.translation.vector).norm() + lever_m * from.rotation.angle_to(&to.rotation)
}
