//! A contact point that answers by an impulse, and whether it meets what it touches within the tick.
//!
//! Model: within a tick a body goes on with one velocity, so that it cannot come down to where they touch and leave from there.
//! It leaves from where it is, with the velocity at which it has what restitution leaves of the energy that it would meet
//! with: of a bounce under gravity, `v_1^2 / 2 + g (h + v_1 dt) = e^2 (v_0^2 / 2 + g h)`, h above the ground. So bounces keep `e^2`
//! of their energy at any rate. What bounces no higher than it is has to come down first: it stops where they touch, and
//! leaves in the next tick as fast as it would have met.
//!
//! A point that approaches no faster than gravity makes it in a tick rests, and a bounce that gravity would end within the
//! tick is none. Nor is one that anything else ended so: a contact that closes in a tick in which it did not approach was pushed back
//! before it got off, and rests. Of two bodies that both fall, gravity takes nothing from how they approach; yet they rest as
//! well when they are as slow. Where springs hold what rests, what does not bounce is stopped before they are pressed.

use nalgebra::Vector3;

use super::velocity;
use crate::anchor::Anchor;
use crate::pair::{Start, let_out_m_s};
use crate::row::Row;
use crate::solver::Motion;

/// Stop of a contact point, without a spring.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Stop {
    /// Damping along the normal that stops what it presses.
    pub(crate) n_s_per_m: f64,
    /// True if it holds what rests, too; else a spring does.
    pub(crate) is_always: bool,
}

/// A row that may answer by an impulse.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Meeting {
    pub(crate) row: usize,
    pub(super) stop: Stop,
    /// Whether other bodies are pressed beside its own: they meet one after the other.
    pub(super) is_among_many: bool,
    /// Until they touch \[m\]; below zero: how deep they are.
    pub(super) gap_m: f64,
    restitution: f64,
    /// How fast it came nearer when it was looked at last \[m/s\].
    pub(super) approaches_m_s: f64,
    /// By how much its normal velocity grows in the tick without any contact \[m/s\].
    grows_m_s: f64,
    /// Part of that which is gravity's, against the normal \[m/s\].
    falls_m_s: f64,
    /// What approaches no faster rests \[m/s\].
    calm_m_s: f64,
    /// It was pushed back before it got off.
    is_held: bool,
    /// With which normal velocity it stops where they touch \[m/s\].
    stops_m_s: f64,
    /// Speed at which they met in the last tick, in which there was no room to leave \[m/s\]; 0: they did not.
    owed_m_s: f64,
}

impl Meeting {
    /// Of the row that will have this number; remembers whether it approaches.
    pub(crate) fn of(
        (number, row): (usize, &Row),
        stop: Stop,
        restitution: f64,
        anchor: &mut Anchor,
        start: &Start<'_>,
    ) -> Self {
        let gap_m = -anchor.pressed_m;
        let along = |velocity_W: &Vector3<f64>| row.normal_W.dot(velocity_W);
        let (freely_m_s, grows_m_s) =
            (along(&velocity(row, start.motions)), along(&velocity(row, start.changes)));
        let now_m_s = freely_m_s - grows_m_s;
        let fall_W = |body: usize| start.changes[body].velocity_W;
        let falls_m_s = -along(&(fall_W(row.body) - row.other.map_or(Vector3::zeros(), fall_W)));
        let calm_m_s = row.other.map_or(falls_m_s.max(0.0), |other| {
            fall_W(row.body).norm().max(fall_W(other).norm()).max(CALM_M_S)
        });
        // So slowly a spring takes it without a bounce that anybody sees; beside a wall gravity calms nothing.
        let calm_m_s = if stop.is_always { calm_m_s } else { calm_m_s.max(SLOW_M_S) };
        let approaches = now_m_s < -calm_m_s;
        let is_held = anchor.is_pressed() && !anchor.approached && approaches;
        // A spring that is pressed is pressed on, however fast.
        anchor.approached = approaches && (stop.is_always || !is_held);
        let stops_m_s = match gap_m {
            gap_m if gap_m > 0.0 => -gap_m / start.dt_s,
            _ if stop.is_always => let_out_m_s(-gap_m, start.dt_s),
            _ => 0.0,
        };
        let meeting = Self {
            row: number,
            stop,
            is_among_many: false,
            gap_m,
            restitution,
            approaches_m_s: -now_m_s,
            grows_m_s,
            falls_m_s,
            calm_m_s,
            is_held,
            stops_m_s,
            // What something else has held up meanwhile meets anew.
            owed_m_s: Some(std::mem::take(&mut anchor.owed_m_s)).filter(|_| gap_m < TOUCHES_M).unwrap_or(0.0),
        };
        if meeting.meets(start.dt_s) && meeting.leaves(start.dt_s) == Leaves::Later {
            anchor.owed_m_s = meeting.meets_at_m_s(start.dt_s);
        }
        meeting
    }

    pub(super) fn bounces(&self) -> bool {
        self.restitution > 0.0
    }

    /// True of one that bounces in this tick, as it was looked at last.
    pub(super) fn will_bounce(&self, dt_s: f64) -> bool {
        self.bounces() && self.leaves_m_s(dt_s).is_some()
    }

    /// It has met: what was owed to it is paid.
    pub(super) fn has_met(&mut self) {
        self.owed_m_s = 0.0;
    }

    /// Takes note of how fast it approaches with these motions at the end of the tick.
    pub(super) fn look(&mut self, row: &Row, motions: &[Motion]) {
        self.approaches_m_s = self.grows_m_s - row.normal_W.dot(&velocity(row, motions));
    }

    /// Whether it meets what it touches within a tick, so fast that it does not rest.
    pub(super) fn meets(&self, dt_s: f64) -> bool {
        let closes_m_s = self.approaches_m_s - self.grows_m_s;
        self.owed_m_s > 0.0
            || !self.is_held && self.approaches_m_s > self.calm_m_s && self.gap_m < closes_m_s * dt_s
    }

    /// True of one that came to approach by another bounce, and would bounce later.
    pub(super) fn will_come(&self) -> bool {
        self.bounces() && self.gap_m > 0.0 && self.approaches_m_s > self.calm_m_s
    }

    /// Lets it in, as far as it comes in what is left of the tick: to be stopped there would cost it its bounce.
    pub(super) fn pass_by(&self, row: &mut Row) {
        (row.stiffness, row.damping, row.rest_W) = Default::default();
    }

    /// With which normal velocity it leaves the tick if it meets what it touches; `None`: it stays.
    pub(super) fn leaves_m_s(&self, dt_s: f64) -> Option<f64> {
        match self.leaves(dt_s) {
            Leaves::With(m_s) if self.meets(dt_s) => Some(m_s),
            _ => None,
        }
    }

    /// Its speed where they touch.
    fn meets_at_m_s(&self, dt_s: f64) -> f64 {
        let falls_m_s2 = self.falls_m_s / dt_s;
        let squared = self.approaches_m_s.powi(2) + 2.0 * falls_m_s2 * self.gap_m.max(0.0);
        if self.owed_m_s > 0.0 { self.owed_m_s } else { squared.max(0.0).sqrt() }
    }

    fn leaves(&self, dt_s: f64) -> Leaves {
        //= melder#6.1
        let back_m_s = self.restitution * self.meets_at_m_s(dt_s);
        let falls_m_s = self.falls_m_s;
        if back_m_s <= falls_m_s.max(0.0) {
            return Leaves::Not;
        }
        let gap_m = if self.owed_m_s > 0.0 { self.gap_m } else { self.gap_m.max(0.0) };
        let squared = back_m_s.powi(2) - 2.0 * falls_m_s / dt_s * gap_m + falls_m_s.powi(2);
        let turns_m_s = self.grows_m_s + falls_m_s;
        if squared < 0.0 { Leaves::Later } else { Leaves::With(squared.sqrt() - falls_m_s + turns_m_s) }
    }

    /// Makes the row leave with this velocity (m/s).
    pub(super) fn reflect(&self, row: &mut Row, leaves_m_s: f64, dt_s: f64) {
        let stop_n_s_per_m = self.stop.n_s_per_m;
        // What an impulse gives across the normal lasts no longer than the impulse.
        row.stiffness = [0.0, stop_n_s_per_m / dt_s];
        row.damping[0] = stop_n_s_per_m;
        row.rest_W = row.normal_W * (stop_n_s_per_m * leaves_m_s);
    }

    /// Makes the row stop what still comes.
    pub(super) fn stop(&self, row: &mut Row, dt_s: f64) {
        self.reflect(row, self.stops_m_s, dt_s);
    }
}

/// Outcome of a meeting.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Leaves {
    /// Gravity ends the bounce within the tick.
    Not,
    /// With this normal velocity \[m/s\].
    With(f64),
    /// It bounces no higher than it is now: it has to come down first.
    Later,
}

/// Nearer has come down to where they touch \[m\]: what is stopped at 10 m/s is a part in a million of its tick's way short of it.
const TOUCHES_M: f64 = 2e-8;
/// Speed that a spring takes without more ado \[m/s\].
const SLOW_M_S: f64 = 1e-4;
/// What two bodies approach no faster with rests even without gravity \[m/s\]: what is stopped a million times harder than it
/// moves has such a velocity left of 1 m/s.
const CALM_M_S: f64 = 1e-6;
