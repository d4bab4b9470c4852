//! Keeps what is rendered to one finger from feeding energy into the hand: a passivity observer and controller.
//!
//! Problem: a spring that is looked at in steps of time and place gives back more than it took: pressed and released
//! evenly at a speed v to a depth d it has fed `k v T d` into the hand, half of `k v^2 T^2` a tick. A stiff wall
//! feeds more than hand and arm can take, and buzzes; a force that comes late, one that turns in a circle or an
//! effect of somebody's own feeds without end. What the source is made of is not known here.
//!
//! Model: time-domain passivity (Hannaford and Ryu, IEEE Trans. Robotics and Automation 18(1), 2002), for a force of
//! three components that is held between ticks. In the interval that ends at tick k the port feeds exactly
//!
//! ```text
//! dE_k = F_(k-1) . (x_k - x_(k-1))        F: the force on the user that was held; x: the HIP
//! ```
//!
//! whatever the path between. The *balance* u sums that up. Two things keep it a fair one:
//!
//! - Reference energy: what the hand put in may come back, but not more than a spring under the present force can have
//!   stored, `u >= -stored_j`. Pressing in and coming out is free; what friction took is gone at once, and with the
//!   last contact all credit is: there is nothing to reset in free space.
//! - Debts are paid, not forgotten: while `u > 0` it falls by `recovery_w` and, over whatever way the finger goes, by
//!   the device's own friction `device_friction_n`, which takes that much before the hand gets anything.
//!
//! The controller lets the force pass, to the bit, if `F . d <= bound_j - u` for every way d that the finger can go
//! while the force is held; else the nearest force that fulfils this is rendered ([`limit`](self)). The way is not
//! known when the force is chosen. It is known to be near the last one: a tip whose acceleration is at most a, read
//! with a count of q, moves between two ticks by p + e, with p the way of the interval before and
//!
//! ```text
//! |e| <= r = a T^2 + 2 sqrt(3) q          (2 a T^2 + ... where the force acts a tick later)
//! ```
//!
//! What presses along the normals of surfaces has a second balance of its own ([`Pressing`]), by the same rules: else what
//! friction takes from a stroke pays for a wall that buzzes across it. It counts changes of depth, so that a god-object that
//! follows a bend or lags behind on it is no source; the device's own friction pays on ways along the normal, on others
//! only for walls that every hand keeps quiet, all of it up to `k T = 2 b` and none from twice that on (b = 1.5 N s/m). If it is
//! overdrawn all of the surfaces' force, friction included, is rendered in a smaller share; then the whole is looked at.
//!
//! Guarantee, for every source of force and between any two ticks i < j: as long as the acceleration keeps to its
//! bound,
//!
//! ```text
//! energy fed from i to j  <=  bound_j + stored_j(i) + recovery_w (t_j - t_i) + device_friction_n * way
//! ```
//!
//! since u grows by what is fed less what is paid, is at least -stored_j(i) in i, and at most bound_j in j: by choice
//! of F, `u_j = u_(j-1) + F . d <= bound_j`. Where forces come a tick late the larger of stored_j(i) and stored_j(i-1)
//! counts, and each force is chosen within what the one before it leaves. Should the finger be faster than that, the surprise `s`, by which a way is
//! longer than p + r, adds at most |F| s, and is forgiven: a finger is not left without its wall for a jolt. After
//! `reset`, and at the very first tick, the finger is taken to have been at rest. A tick that is missed is one of which
//! nothing was foreseen; what it fed is seen, in the next.
//!
//! What is not seen: the energy is that of the positions as read. Of a force that goes from zero to F and back,
//! rounding to counts of q hides at most F q along its direction. A force that the motors hold for another time than
//! from reading to reading (a fixed phase within the tick, a slow amplifier) feeds up to its own change times the way
//! meanwhile more: it is exact for replies in the same tick and, told that it is late, in the next. Limits on the way to
//! the motors that hold a force longer than it was asked for (a slew rate) can do that too. Entities that move by
//! themselves do work on the hand, and count as active. So does what gives back later than a spring would: credit is
//! forgotten as soon as no spring can hold it.
//!
//! Frames and signs: world, SI; forces are forces on the user; energy is positive when it was fed into the hand.
//! Invariants: the force is never larger than the one wanted, and never has a component against it (so a wall
//! without friction never pulls); it is a continuous function of the wanted force, the last way and the balance, so
//! at rest nothing chatters; no input makes it not finite. No allocation.
//! Cost: some ten nanoseconds while nothing is changed, about a microsecond while something is.

mod balance;
mod limit;
mod port;
mod springs;

use balance::{Balance, Interval};
pub use port::{Port, Pressing, Rendered};
pub use springs::Springs;

use nalgebra::Vector3;

use crate::error::{ParameterError, above_zero, at_least_zero};
use crate::frame::is_finite;

/// The numbers of a controller.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PassivitySpec {
    /// What may be fed beyond what the hand put in \[J\], > 0.
    pub bound_j: f64,
    /// A debt is paid at this rate \[W\], >= 0.
    pub recovery_w: f64,
    /// What the device's own friction takes from every motion before the hand gets anything \[N\], >= 0.
    pub device_friction_n: f64,
    /// The largest acceleration of the tip \[m/s^2\], >= 0.
    pub acceleration_m_per_s2: f64,
    /// Steps of a position along each axis \[m\], >= 0.
    pub resolution_m: f64,
}

/// The observer and controller of one finger.
#[derive(Debug, Clone)]
pub struct Passivity {
    spec: PassivitySpec,
    period_s: f64,
    /// All that was fed since the beginning (J).
    energy_j: f64,
    /// Of the whole force, and of what of it presses along normals.
    whole: Balance,
    pressing: Balance,
    position_W: Option<Vector3<f64>>,
    /// Follow the position when it is a count away, all around and along the normal: what friction acts on.
    dragged_W: Vector3<f64>,
    dragged_along_W: Vector3<f64>,
    /// Share of the device's friction across the normal that pays for pressing, 0 to 1.
    sliding_share: f64,
    /// The force that acts until the next tick, and the one after it where forces come late.
    acting: Held,
    pending: Held,
}

/// A force that is held between ticks (N), and what of it presses along normals.
#[derive(Debug, Clone, Copy)]
struct Held {
    force_W: Vector3<f64>,
    normal_W: Vector3<f64>,
    /// Share of the wanted normal force.
    normal_share: f64,
}

impl Held {
    const NOTHING: Self = Self {
        force_W: Vector3::new(0.0, 0.0, 0.0),
        normal_W: Vector3::new(0.0, 0.0, 0.0),
        normal_share: 0.0,
    };

    /// The same where motors made another force of it: the normal force has the same share.
    fn applied(&self, applied_W: Option<Vector3<f64>>) -> Self {
        let Some(force_W) = applied_W.filter(is_finite) else { return *self };
        let share = force_W.dot(&self.force_W) / self.force_W.norm_squared();
        let share = if share.is_nan() { 0.0 } else { share.clamp(0.0, 1.0) };
        Self { force_W, normal_W: self.normal_W * share, normal_share: self.normal_share * share }
    }
}

impl PassivitySpec {
    /// The usual numbers at this length of a tick \[s\]: those of a Premium (8.5 N, counts of 0.03 mm, 0.04 N of
    /// friction).
    ///
    /// The bound is what the strongest force can feed in one tick that nobody foresaw, `F r`: with less, a finger that
    /// rests without credit would not get its whole force. It does not go by the stiffness: a spring's own rounding,
    /// `k q^2 / 2`, is a microjoule, and would be used up by any touch.
    pub fn usual(period_s: f64) -> Self {
        Self::for_motion(period_s, ACCELERATION_M_PER_S2, RESOLUTION_M)
    }

    /// The same for a tip of this largest acceleration \[m/s^2\], whose positions come in steps of this size \[m\].
    pub fn for_motion(period_s: f64, acceleration_m_per_s2: f64, resolution_m: f64) -> Self {
        let unbound = Self {
            bound_j: 0.0,
            recovery_w: 0.0,
            device_friction_n: DEVICE_FRICTION_N,
            acceleration_m_per_s2,
            resolution_m,
        };
        unbound.with_bound(FULL_FORCE_N * unbound.surprise_m(period_s, 1.0))
    }

    /// With this bound \[J\], all of which is paid in ten seconds.
    pub fn with_bound(self, bound_j: f64) -> Self {
        Self { bound_j, recovery_w: bound_j / RECOVERY_S, ..self }
    }

    /// The same, if each number is in range.
    ///
    /// Errors: the first that is not.
    pub fn validated(self) -> Result<Self, ParameterError> {
        above_zero("bound_j", self.bound_j)?;
        at_least_zero("recovery_w", self.recovery_w)?;
        at_least_zero("device_friction_n", self.device_friction_n)?;
        at_least_zero("acceleration_m_per_s2", self.acceleration_m_per_s2)?;
        at_least_zero("resolution_m", self.resolution_m)?;
        Ok(self)
    }

    /// How far the way of an interval can be from that of the last one, `ticks` before it \[m\].
    fn surprise_m(&self, period_s: f64, ticks: f64) -> f64 {
        ticks * self.acceleration_m_per_s2 * period_s * period_s + 2.0 * f64::sqrt(3.0) * self.resolution_m
    }
}

impl Passivity {
    /// At rest, owing nothing, for ticks of this length \[s\].
    ///
    /// Errors: a number that is out of range.
    pub fn new(spec: PassivitySpec, period_s: f64) -> Result<Self, ParameterError> {
        Ok(Self {
            spec: spec.validated()?,
            period_s: above_zero("period_s", period_s)?,
            energy_j: 0.0,
            whole: Balance::default(),
            pressing: Balance::default(),
            position_W: None,
            dragged_W: Vector3::zeros(),
            dragged_along_W: Vector3::zeros(),
            sliding_share: 1.0,
            acting: Held::NOTHING,
            pending: Held::NOTHING,
        })
    }

    /// The numbers it goes by.
    pub fn spec(&self) -> &PassivitySpec {
        &self.spec
    }

    /// All that was fed into the hand since the beginning, as seen \[J\].
    pub fn energy_j(&self) -> f64 {
        self.energy_j
    }

    /// What was fed and not paid for \[J\]; negative while the hand may have something back.
    pub fn balance_j(&self) -> f64 {
        self.whole.unpaid_j()
    }

    /// One tick: sees what the last force did, and chooses the next.
    pub fn step(&mut self, port: &Port) -> Rendered {
        if !is_finite(&port.position_W) {
            self.reset();
            return self.rendered(Vector3::zeros(), port);
        }
        let pressing = port.pressing.if_finite();
        let (moved_W, ticks) = self.observe(port, &pressing);
        let bound_j = self.spec.bound_j;
        let spread = 0.5 * (ticks + 1.0);
        let surprise_m = self.spec.surprise_m(self.period_s, spread);
        let next_surprise_m =
            if port.is_late { self.spec.surprise_m(self.period_s, spread + 1.0) } else { surprise_m };
        let budget_j = |balance: &Balance, pending_W: &Vector3<f64>| {
            if port.is_late {
                balance.budget_beside_j(limit::most_j(pending_W, &moved_W, surprise_m), bound_j)
            } else {
                balance.budget_j(bound_j)
            }
        };
        let normal_j = budget_j(&self.pressing, &self.pending.normal_W);
        let share = limit::share(&pressing.normal_on_user_W, &moved_W, next_surprise_m, normal_j);
        let wanted_W = limit::without(port.force_on_user_W, pressing.force_on_user_W * (1.0 - share));
        let whole_j = budget_j(&self.whole, &self.pending.force_W);
        let force_W = limit::nearest(wanted_W, moved_W, next_surprise_m, whole_j);
        // Each step alone is never against what it began with; both together are not either.
        let is_against = force_W.dot(&port.force_on_user_W) < 0.0;
        let force_W = if is_against { Vector3::zeros() } else { force_W };
        let normal_W = pressing.normal_on_user_W * share;
        let chosen = Held { force_W: wanted_W, normal_W, normal_share: share };
        let chosen = chosen.applied(Some(force_W));
        self.acting = if port.is_late { self.pending } else { chosen };
        self.pending = chosen;
        self.rendered(force_W, port)
    }

    /// The finger was moved by this (m) without its hand: what it was attached to has moved.
    pub fn carry(&mut self, by_W: Vector3<f64>) {
        if let Some(position_W) = &mut self.position_W {
            *position_W += by_W;
            self.dragged_W += by_W;
            self.dragged_along_W += by_W;
        }
    }

    /// Forgets where the finger was, and what it had stored; debts stay.
    pub fn reset(&mut self) {
        self.position_W = None;
        (self.acting, self.pending) = (Held::NOTHING, Held::NOTHING);
        self.whole.forget();
        self.pressing.forget();
    }

    /// Sums up the interval that ends now. Returns how far a usual tick of it went (m), and how many there were.
    fn observe(&mut self, port: &Port, pressing: &Pressing) -> (Vector3<f64>, f64) {
        let ticks = port.ticks(self.period_s);
        let from_W = self.position_W.replace(port.position_W);
        let moved_W = from_W.map(|from_W| port.position_W - from_W);
        // No hand moves like that: a sensor that was put right, say.
        let most_m = MOST_M_PER_S * ticks * self.period_s;
        let moved_W = moved_W.filter(|moved_W| moved_W.norm() <= most_m).unwrap_or_else(|| {
            (self.dragged_W, self.dragged_along_W) = (port.position_W, port.position_W);
            Vector3::zeros()
        });
        let held = self.acting.applied(port.applied_on_user_W);
        let fed_j = held.force_W.dot(&moved_W).clamp(-MOST_J, MOST_J);
        let followed_j = pressing.followed_j * held.normal_share;
        let pressed_j = (held.normal_W.dot(&moved_W) - followed_j).clamp(-MOST_J, MOST_J);
        if !fed_j.is_nan() {
            self.energy_j += fed_j;
        }
        let (way_m, way_along_m) = self.drag(port.position_W, &held.normal_W);
        let interval = |fed_j, way_m, stored_j| Interval {
            fed_j,
            paid_j: self.spec.recovery_w * (ticks * self.period_s) + self.spec.device_friction_n * way_m,
            stored_j,
            is_late: port.is_late,
        };
        let whole = interval(fed_j, way_m, port.stored_j());
        let sliding_m = (way_m - way_along_m).max(0.0) * self.sliding_share;
        let along = interval(pressed_j, way_along_m + sliding_m, pressing.stored_j);
        if pressing.stored_j > 0.0 {
            self.sliding_share = self.share_of_sliding(pressing);
        }
        self.whole.take(&whole, self.spec.bound_j);
        self.pressing.take(&along, self.spec.bound_j);
        (moved_W / ticks, ticks)
    }

    /// Share of the device's friction along a surface that pays for pressing: all on one that every hand
    /// keeps quiet, nothing on one that can buzz.
    fn share_of_sliding(&self, pressing: &Pressing) -> f64 {
        let stiffness_n_per_m = pressing.normal_on_user_W.norm_squared() / (2.0 * pressing.stored_j);
        // A spring that is looked at every T is passive beside a damper of k T / 2 (Colgate and Schenkel).
        let share = 2.0 - 0.5 * stiffness_n_per_m * self.period_s / HAND_N_S_PER_M;
        if share.is_nan() { 0.0 } else { share.clamp(0.0, 1.0) }
    }

    /// Way that the device's friction acted on (m): all of it, and that along a normal force, if there is one. A counter
    /// that flickers moves nothing.
    fn drag(&mut self, position_W: Vector3<f64>, normal_W: &Vector3<f64>) -> (f64, f64) {
        let slack_m = 2.0 * self.spec.resolution_m;
        let behind_W = position_W - self.dragged_W;
        let way_m = behind_W.norm() - slack_m;
        if way_m > 0.0 {
            self.dragged_W += behind_W * (way_m / behind_W.norm());
        }
        let way_m = way_m.max(0.0);
        let Some(n_W) = normal_W.try_normalize(0.0) else {
            self.dragged_along_W = position_W;
            return (way_m, 0.0);
        };
        let behind_m = (position_W - self.dragged_along_W).dot(&n_W);
        self.dragged_along_W = position_W - n_W * behind_m.clamp(-slack_m, slack_m);
        (way_m, (behind_m.abs() - slack_m).max(0.0))
    }

    fn rendered(&self, force_on_user_W: Vector3<f64>, port: &Port) -> Rendered {
        let changed_n = (force_on_user_W - port.force_on_user_W).norm();
        Rendered {
            force_on_user_W,
            changed_n: if changed_n.is_finite() { changed_n } else { 0.0 },
            energy_j: self.energy_j,
        }
    }
}

/// The strongest force that passes at rest without credit: a Premium's peak (N).
const FULL_FORCE_N: f64 = 8.5;
/// Its whole peak on its tip's 60 g, nobody holding it: 140 (m/s^2).
const ACCELERATION_M_PER_S2: f64 = 150.0;
/// What moves a Premium's tip: pays for counts below 2 f / q = 2.7 N/mm, where rounding leaks k q / 2 for each metre (N).
const DEVICE_FRICTION_N: f64 = 0.04;
/// Damping of the lightest grip (N s/m).
const HAND_N_S_PER_M: f64 = 1.5;
/// Counts of a Premium at its tip (m).
const RESOLUTION_M: f64 = 3e-5;
/// In this time a debt of the whole bound is paid (s): 0.2 mW, far below what keeps up a buzz that can be felt.
const RECOVERY_S: f64 = 10.0;
/// Faster than any hand (m/s).
const MOST_M_PER_S: f64 = 20.0;
/// More than anything feeds in a tick; sums of it stay finite (J).
const MOST_J: f64 = 1e9;
