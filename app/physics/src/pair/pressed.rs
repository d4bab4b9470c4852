//! A contact point of two entities as a row: what it presses with.
//!
//! Model: the *force response* presses with the depth (Melder eq. 6.2, with damping and without pulling); the *impulse
//! response* reflects the approaching velocity (eq. 6.1, corrected).

use nalgebra::{Isometry3, UnitQuaternion, Vector3};

use super::{Response, Start, Surfacing};
use crate::anchor::Anchor;
use crate::collide::ContactPoint;
use crate::row::{Rolling, Row, Torsion};
use crate::solver::Motion;

/// The row of a point; and the damping along its normal that stops what it presses \[N s/m\].
pub(super) fn row(
    (body, other): (usize, Option<usize>),
    surfacing: &Surfacing,
    anchor: &Anchor,
    point: &ContactPoint,
    X_WB: &Isometry3<f64>,
    start: &Start<'_>,
) -> (Row, f64) {
    let dt_s = start.dt_s;
    let arm = |body: usize, side: usize| {
        let arm_W = point.point_W - start.bodies[body].centre_W;
        // Material on an arm that turns moves along the chord: at right angles to the arm of the tick's middle. What rolls
        // touches with other material by then.
        let goes_along = anchor.is_same_material[side] && start.is_implicit;
        if goes_along { middle_W(&start.motions[body], dt_s) * arm_W } else { arm_W }
    };
    let mut arms_W = [arm(body, 0), other.map_or(Vector3::zeros(), |other| arm(other, 1))];
    if let Some(other) = other {
        // What one gives the other gets at the same place, or angular momentum would be lost between them.
        let apart_W = start.bodies[body].centre_W + arms_W[0] - start.bodies[other].centre_W - arms_W[1];
        arms_W[0] -= apart_W * 0.5;
        arms_W[1] += apart_W * 0.5;
    }
    let k = surfacing.stiffness_n_per_m;
    let gap_m = -anchor.pressed_m;
    let n = point.normal_W;
    let mut row = Row {
        body,
        other,
        arms_W,
        normal_W: n,
        rest_W: Vector3::zeros(),
        stiffness: [k * anchor.share, k],
        damping: [0.0; 2],
        mu_hold: surfacing.friction.mu_hold,
        mu_slide: surfacing.friction.mu_slide,
        held: anchor.held(),
        force_W: anchor.force_W(X_WB),
        torsion: Torsion::default(),
        rolling: Rolling::default(),
        turning_m: [0.0; 2],
        tie_n: None,
    };
    let is_asked_for = surfacing.damping.is_ratio() || surfacing.response.restitution().is_some();
    let gives_per_kg = if is_asked_for { gives_per_kg(&row, start) } else { 0.0 };
    row.damping = row.stiffness.map(|k| surfacing.damping.n_s_per_m(k, gives_per_kg));
    if !surfacing.damping.is_ratio() {
        // A point that stands for many has the dampers of all.
        row.damping[0] *= anchor.share.max(1.0);
    }
    let [b, b_across] = row.damping;
    // So large that velocities are what is wanted. Nothing can be stopped that nothing moves.
    let stop = if gives_per_kg > 0.0 { HARD / (gives_per_kg * dt_s) } else { 0.0 };
    let rest_n = match surfacing.response {
        //= melder#6.2
        Response::Force | Response::Bounce { .. } if gap_m < 0.0 => -row.stiffness[0] * gap_m,
        // Of a force that is known when the tick begins nothing is damped before they meet.
        Response::Force | Response::Bounce { .. } if !start.is_implicit => {
            row.damping[0] = 0.0;
            -row.stiffness[0] * gap_m
        }
        // Only what is left of the tick when they meet is damped.
        Response::Force | Response::Bounce { .. } => {
            (row.stiffness[0], row.damping[0]) = (row.stiffness[0] + b / dt_s, 0.0);
            -row.stiffness[0] * gap_m
        }
        Response::Impulse { .. } => {
            (row.stiffness, row.damping) = ([0.0, k], [stop, b_across]);
            stop * if gap_m < 0.0 { let_out_m_s(-gap_m, dt_s) } else { -gap_m / dt_s }
        }
    };
    row.rest_W = n * rest_n - anchor.stretch_W(X_WB) * row.stiffness[1];
    (row, stop)
}

/// How far a body turns in half a tick, if nothing touches it.
fn middle_W(motion: &Motion, dt_s: f64) -> UnitQuaternion<f64> {
    // Beyond a radian a chord is none.
    let turn_W = motion.angular_velocity_W * (0.5 * dt_s);
    UnitQuaternion::from_scaled_axis(if turn_W.norm_squared() < 0.25 { turn_W } else { Vector3::zeros() })
}

/// Velocity with which the two give way along the normal, per impulse.
fn gives_per_kg(row: &Row, start: &Start<'_>) -> f64 {
    let give = |body: usize, arm_W: &Vector3<f64>| {
        let motion = &start.motions[body];
        let turns_W = arm_W.cross(&row.normal_W);
        motion.inverse_mass + turns_W.dot(&(motion.inverse_inertia_W * turns_W))
    };
    give(row.body, &row.arms_W[0]) + row.other.map_or(0.0, |other| give(other, &row.arms_W[1]))
}

/// How fast a depth that should not be there is let out.
pub(crate) fn let_out_m_s(depth_m: f64, dt_s: f64) -> f64 {
    (depth_m / LET_OUT_S.max(dt_s)).min(LET_OUT_M_S)
}

/// A depth that should not be there falls by `e` in this time \[s\]. The body then slows down by less than gravity slows it,
/// for depths up to `g t^2`, 0.1 m: it follows, and does not hop.
const LET_OUT_S: f64 = 0.1;
/// And never faster than this \[m/s\].
pub(crate) const LET_OUT_M_S: f64 = 0.2;
/// How many times harder than what moves impulses stop: velocities are right to one part in so many, and solved for with as
/// many times the rounding.
pub(crate) const HARD: f64 = 1e6;
