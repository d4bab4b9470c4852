//! What a controller is told in a tick, and what it says.

use nalgebra::Vector3;

use crate::frame::is_finite;

/// One tick at the port between rendering and hand; world frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Port {
    /// Where the finger is \[m\].
    pub position_W: Vector3<f64>,
    /// The force that rendering wants from now on \[N\].
    pub force_on_user_W: Vector3<f64>,
    /// The force that was held in the interval that ends now \[N\]; `None`: the one chosen for it.
    pub applied_on_user_W: Option<Vector3<f64>>,
    /// The most that what renders the wanted force can have stored \[J\]: |F|^2 / 2 k of a spring.
    pub stored_j: f64,
    /// Whether the force chosen now acts from the next tick on, and the one of the last tick until then.
    pub is_late: bool,
    /// Time since the last tick \[s\].
    pub dt_s: f64,
    /// Part of the wanted force that comes of surfaces.
    pub pressing: Pressing,
}

/// The part of a force that comes of surfaces, and of it what presses along their normals; world frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pressing {
    /// All of it, friction included \[N\].
    pub force_on_user_W: Vector3<f64>,
    /// The sum of the contacts' normal forces \[N\].
    pub normal_on_user_W: Vector3<f64>,
    /// The most that what renders the normal forces can have stored \[J\].
    pub stored_j: f64,
    /// What of `F_n . d`, d being the way of the finger since the last tick, is no change of depth, as the god-object g has
    /// followed and its normal has turned: the sum of `F_n ((g - x) . (n - n_before) + (g - g_before) . n_before)` over
    /// contacts, with the normal forces of the last tick \[J\].
    pub followed_j: f64,
}

impl Pressing {
    /// Nothing is touched.
    pub const NOTHING: Self = Self {
        force_on_user_W: Vector3::new(0.0, 0.0, 0.0),
        normal_on_user_W: Vector3::new(0.0, 0.0, 0.0),
        stored_j: 0.0,
        followed_j: 0.0,
    };

    /// Nothing, where a number is none.
    pub(super) fn if_finite(&self) -> Self {
        let is_told = is_finite(&self.force_on_user_W)
            && is_finite(&self.normal_on_user_W)
            && self.stored_j.is_finite()
            && self.followed_j.is_finite();
        if is_told { Self { stored_j: self.stored_j.max(0.0), ..*self } } else { Self::NOTHING }
    }
}

/// What comes out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rendered {
    /// The force to render \[N\].
    pub force_on_user_W: Vector3<f64>,
    /// By how much it was changed \[N\].
    pub changed_n: f64,
    /// All that was fed into the hand up to now \[J\].
    pub energy_j: f64,
}

impl Port {
    /// A finger here \[m\] that is to feel this force \[N\] at once, of a source that stores nothing.
    pub fn new(position_W: Vector3<f64>, force_on_user_W: Vector3<f64>, dt_s: f64) -> Self {
        Self {
            position_W,
            force_on_user_W,
            applied_on_user_W: None,
            stored_j: 0.0,
            is_late: false,
            dt_s,
            pressing: Pressing::NOTHING,
        }
    }

    /// From a source that can have stored so much \[J\].
    pub fn storing(self, stored_j: f64) -> Self {
        Self { stored_j, ..self }
    }

    /// What may come back; zero where nobody knows.
    pub(super) fn stored_j(&self) -> f64 {
        let is_known = self.stored_j.is_finite() && self.stored_j > 0.0 && is_finite(&self.force_on_user_W);
        if is_known { self.stored_j } else { 0.0 }
    }

    /// Length of the interval in ticks; one where time makes no sense.
    pub(super) fn ticks(&self, period_s: f64) -> f64 {
        let ticks = self.dt_s / period_s;
        if ticks.is_finite() { ticks.clamp(1.0, MOST_TICKS) } else { 1.0 }
    }
}

/// After a longer gap everything is new anyway.
const MOST_TICKS: f64 = 1e6;
