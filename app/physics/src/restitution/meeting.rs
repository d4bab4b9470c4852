//! A contact point that answers by an impulse, and whether it meets what it touches within the tick.
//!
//! Model: the velocity that it leaves with is the reflected one of the beginning of the tick, less what gravity takes from it in
//! the whole tick: so a ball that does not lose anything else loses `(g dt)^2 / 2` of energy per mass in each bounce, and never
//! gains. What approaches no faster than gravity makes it in a tick rests, and a bounce that gravity would end
//! within the tick is none. Nor is one that anything else ended so: a contact that closes in a tick in which it did not
//! approach was pushed back before it got off, and rests. Of two bodies that both fall, gravity takes nothing from how they approach;
//! yet they rest as well when they are as slow.

use nalgebra::Vector3;

use super::velocity;
use crate::anchor::Anchor;
use crate::pair::Start;
use crate::row::Row;
use crate::solver::Motion;

/// A row of the impulse response, whose damping along the normal stops what it presses.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Meeting {
    pub(crate) row: usize,
    /// Whether other bodies are pressed beside its own: they meet one after the other.
    pub(super) is_among_many: bool,
    /// Until they touch \[m\]; below zero: how deep they are.
    pub(super) gap_m: f64,
    restitution: f64,
    /// How fast it came nearer when it was looked at last \[m/s\].
    pub(super) approaches_m_s: f64,
    /// By how much its normal velocity grows in the tick without any contact \[m/s\].
    grows_m_s: f64,
    /// What approaches no faster rests \[m/s\].
    calm_m_s: f64,
    /// It was pushed back before it got off.
    is_held: bool,
}

impl Meeting {
    /// Of the row that will have this number; remembers whether it approaches.
    pub(crate) fn of(
        (number, row): (usize, &Row),
        gap_m: f64,
        restitution: f64,
        anchor: &mut Anchor,
        start: &Start<'_>,
    ) -> Self {
        let along = |velocity_W: &Vector3<f64>| row.normal_W.dot(velocity_W);
        let (now_m_s, freely_m_s) = (along(&at_start(row, start)), along(&velocity(row, start.motions)));
        let grows_m_s = freely_m_s - now_m_s;
        let calm_m_s = row.other.map_or((-grows_m_s).max(0.0), |other| {
            let fall = |body: usize| (start.motions[body].velocity_W - start.bodies[body].velocity_W).norm();
            fall(row.body).max(fall(other)).max(CALM_M_S)
        });
        let approaches = now_m_s < -calm_m_s;
        let is_held = anchor.is_pressed() && !anchor.approached && approaches;
        anchor.approached = approaches;
        Self {
            row: number,
            is_among_many: false,
            gap_m,
            restitution,
            approaches_m_s: -now_m_s,
            grows_m_s,
            calm_m_s,
            is_held,
        }
    }

    pub(super) fn bounces(&self) -> bool {
        self.restitution > 0.0
    }

    /// Takes note of how fast it approaches with these motions at the end of the tick.
    pub(super) fn look(&mut self, row: &Row, motions: &[Motion]) {
        self.approaches_m_s = self.grows_m_s - row.normal_W.dot(&velocity(row, motions));
    }

    /// Whether it meets what it touches within a tick, so fast that it does not rest.
    pub(super) fn meets(&self, dt_s: f64) -> bool {
        let closes_m_s = self.approaches_m_s - self.grows_m_s;
        !self.is_held && self.approaches_m_s > self.calm_m_s && self.gap_m < closes_m_s * dt_s
    }

    /// With which normal velocity it leaves the tick if it meets what it touches; 0 and below: it stays.
    pub(super) fn leaves_m_s(&self, dt_s: f64) -> Option<f64> {
        //= melder#6.1
        self.meets(dt_s).then(|| self.restitution * self.approaches_m_s + self.grows_m_s.min(0.0))
    }

    /// Makes the row leave with this velocity (m/s), or stay.
    pub(super) fn reflect(&self, row: &mut Row, leaves_m_s: f64, dt_s: f64) {
        let n = row.normal_W;
        let stop_n_s_per_m = row.damping[0];
        // What an impulse gives across the normal lasts no longer than the impulse.
        row.stiffness[1] = stop_n_s_per_m / dt_s;
        let rest_n = if leaves_m_s > 0.0 { stop_n_s_per_m * leaves_m_s } else { n.dot(&row.rest_W) };
        row.rest_W = n * rest_n;
    }
}

/// Velocity of the body's point relative to the other's when the tick begins.
fn at_start(row: &Row, start: &Start<'_>) -> Vector3<f64> {
    let at = |body: usize, arm_W: &Vector3<f64>| {
        let body = &start.bodies[body];
        body.velocity_W + body.angular_velocity_W().cross(arm_W)
    };
    at(row.body, &row.arms_W[0]) - row.other.map_or(Vector3::zeros(), |other| at(other, &row.arms_W[1]))
}

/// What two bodies approach no faster with rests even without gravity \[m/s\]: what is stopped a million times harder than it
/// moves has such a velocity left of 1 m/s.
const CALM_M_S: f64 = 1e-6;
