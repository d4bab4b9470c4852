//! A contact point of two entities as a row: what it presses with, and whether it is an impact.
//!
//! Model: the *force response* presses with the depth (Melder eq. 6.2, with damping and without pulling); the *impulse
//! response* reflects the approaching velocity (eq. 6.1, corrected).

use nalgebra::{Isometry3, UnitQuaternion, Vector3};

use super::{Response, Start, Surfacing};
use crate::anchor::Anchor;
use crate::collide::ContactPoint;
use crate::row::{Row, Torsion};
use crate::solver::Motion;

/// The row of a point, and whether the two meet there in this tick.
pub(super) fn row(
    (body, other): (usize, Option<usize>),
    surfacing: &Surfacing,
    anchor: &mut Anchor,
    point: &ContactPoint,
    X_WB: &Isometry3<f64>,
    start: &Start<'_>,
) -> (Row, bool) {
    let dt_s = start.dt_s;
    let arm = |body: usize, side: usize| {
        let arm_W = point.point_W - start.bodies[body].centre_W;
        // Material on an arm that turns moves along the chord: at right angles to the arm of the tick's middle. What rolls
        // touches with other material by then.
        let goes_along = anchor.is_same_material[side] && start.is_implicit;
        if goes_along { middle_W(&start.motions[body], dt_s) * arm_W } else { arm_W }
    };
    let (k, b) = (surfacing.stiffness_n_per_m, surfacing.damping_n_s_per_m);
    let gap_m = -anchor.pressed_m;
    let n = point.normal_W;
    let mut row = Row {
        body,
        other,
        arms_W: [arm(body, 0), other.map_or(Vector3::zeros(), |other| arm(other, 1))],
        normal_W: n,
        rest_W: Vector3::zeros(),
        stiffness: [k * anchor.share, k],
        damping: [b; 2],
        mu_hold: surfacing.friction.mu_hold,
        mu_slide: surfacing.friction.mu_slide,
        held: anchor.held(),
        force_W: anchor.force_W(X_WB),
        torsion: Torsion::default(),
        tie_n: None,
    };
    let rest_n = match surfacing.response {
        //= melder#6.2
        Response::Force if gap_m < 0.0 => -row.stiffness[0] * gap_m,
        // Of a force that is known when the tick begins nothing is damped before they meet.
        Response::Force if !start.is_implicit => {
            row.damping[0] = 0.0;
            -row.stiffness[0] * gap_m
        }
        // Only what is left of the tick when they meet is damped.
        Response::Force => {
            (row.stiffness[0], row.damping[0]) = (row.stiffness[0] + b / dt_s, 0.0);
            -row.stiffness[0] * gap_m
        }
        Response::Impulse { restitution } => {
            let stop = stop_n_s_per_m(&row, start);
            (row.stiffness, row.damping) = ([0.0, k], [stop, b]);
            let impact = Impact::of(&row, gap_m, restitution, anchor, start);
            if impact.is_one {
                anchor.release();
                // What an impulse gives across the normal lasts no longer than the impulse.
                row.stiffness[1] = stop / dt_s;
            }
            let wanted_m_s = match gap_m {
                _ if impact.bounce_m_s > 0.0 => impact.bounce_m_s,
                gap_m if gap_m < 0.0 => let_out_m_s(-gap_m, dt_s),
                _ => -gap_m / dt_s,
            };
            if impact.is_one {
                row.rest_W = n * (stop * wanted_m_s);
                return (row, true);
            }
            stop * wanted_m_s
        }
    };
    row.rest_W = n * rest_n - anchor.stretch_W(X_WB) * row.stiffness[1];
    (row, false)
}

/// How far a body turns in half a tick, if nothing touches it.
fn middle_W(motion: &Motion, dt_s: f64) -> UnitQuaternion<f64> {
    // Beyond a radian a chord is none.
    let turn_W = motion.angular_velocity_W * (0.5 * dt_s);
    UnitQuaternion::from_scaled_axis(if turn_W.norm_squared() < 0.25 { turn_W } else { Vector3::zeros() })
}

/// What a row's point does that meets the other in a tick.
struct Impact {
    is_one: bool,
    /// With which normal velocity it leaves the tick; 0 and below: it stays.
    bounce_m_s: f64,
}

impl Impact {
    /// The velocity that it leaves with is the reflected one of the beginning of the tick, less what gravity takes from it in
    /// the whole tick: so a ball that does not lose anything else loses `(g dt)^2 / 2` of energy per mass in each bounce, and never
    /// gains. What approaches no faster than gravity makes it in a tick rests, and a bounce that gravity would end
    /// within the tick is none. Nor is one that anything else ended so: a contact that closes in a tick in which it did not
    /// approach was pushed back before it got off, and rests.
    fn of(row: &Row, gap_m: f64, restitution: f64, anchor: &mut Anchor, start: &Start<'_>) -> Self {
        let along = |velocity_W: &Vector3<f64>| row.normal_W.dot(velocity_W);
        let (now_m_s, freely_m_s) = (along(&at_start(row, start)), along(&freely(row, start)));
        let falls_m_s = (freely_m_s - now_m_s).min(0.0);
        let approaches = now_m_s < falls_m_s;
        let was_pushed_back = anchor.is_pressed() && !anchor.approached;
        anchor.approached = approaches;
        let is_one = approaches && !was_pushed_back && gap_m < -freely_m_s * start.dt_s;
        //= melder#6.1
        Self { is_one, bounce_m_s: if is_one { restitution * -now_m_s + falls_m_s } else { 0.0 } }
    }
}

/// Velocity of A's point relative to B's when the tick begins.
fn at_start(row: &Row, start: &Start<'_>) -> Vector3<f64> {
    let at = |body: usize, arm_W: &Vector3<f64>| {
        let body = &start.bodies[body];
        body.velocity_W + body.angular_velocity_W().cross(arm_W)
    };
    at(row.body, &row.arms_W[0]) - row.other.map_or(Vector3::zeros(), |other| at(other, &row.arms_W[1]))
}

/// The same at its end, if nothing touched anything.
fn freely(row: &Row, start: &Start<'_>) -> Vector3<f64> {
    let at = |body: usize, arm_W: &Vector3<f64>| start.motions[body].at(arm_W);
    at(row.body, &row.arms_W[0]) - row.other.map_or(Vector3::zeros(), |other| at(other, &row.arms_W[1]))
}

/// A damping so large that velocities are what is wanted.
fn stop_n_s_per_m(row: &Row, start: &Start<'_>) -> f64 {
    let give = |body: usize, arm_W: &Vector3<f64>| {
        let motion = &start.motions[body];
        let turns_W = arm_W.cross(&row.normal_W);
        motion.inverse_mass + turns_W.dot(&(motion.inverse_inertia_W * turns_W))
    };
    let gives = give(row.body, &row.arms_W[0]) + row.other.map_or(0.0, |other| give(other, &row.arms_W[1]));
    // Nothing can be stopped that nothing moves.
    if gives > 0.0 { HARD / (gives * start.dt_s) } else { 0.0 }
}

/// How fast a depth that should not be there is let out.
pub(super) fn let_out_m_s(depth_m: f64, dt_s: f64) -> f64 {
    (depth_m / LET_OUT_S.max(dt_s)).min(LET_OUT_M_S)
}

/// A depth that should not be there falls by `e` in this time \[s\]. The body then slows down by less than gravity slows it,
/// for depths up to `g t^2`, 0.1 m: it follows, and does not hop.
const LET_OUT_S: f64 = 0.1;
/// And never faster than this \[m/s\].
const LET_OUT_M_S: f64 = 0.2;
/// How many times harder than what moves impulses stop: velocities are right to one part in so many, and solved for with as
/// many times the rounding.
const HARD: f64 = 1e6;
