//! Torsional and rolling friction: what keeps a contact at a point from turning for ever.
//!
//! Problem: a ball touches in a point, which resists neither spinning nor rolling. Real contacts have an area.
//! Model: torques about the normal and across it, each up to a length times the normal force (Coulomb's law, as along the
//! surface). Within its limit each is that of a spring with the critical damper of what spins: the body is held at the rim of a patch of
//! [`PATCH_M`] by springs as stiff as the contact's own. So what is held rests, and does not creep. On the limit the angle slides
//! along. The normal force is that of the same tick, as along the surface: with that of the last one,
//! points that press in every other tick turned each other while they did not touch, and light bodies
//! between heavy ones hopped on for ever.
//! Three points and more of two entities resist turning by friction and springs, and this is left to them; but not rolling where
//! a mesh presses softly with what is round, be it by a hundred vertices: those behind let go as others come down.
//! Limits: of integrators that take forces of the beginning of a tick there is none.
//! Frames: an angle, times [`PATCH_M`], is kept in the other's frame ([`Anchor`]).
//! Invariant: what the springs hold is in the pair's account ([`super::ledger`]).

use nalgebra::{Isometry3, Vector3};

use super::{Start, Surfacing};
use crate::anchor::Anchor;
use crate::collide::ContactPoint;
use crate::row::{Rolling, Row, Torsion, within_ball};

/// Points of two entities, of which each resists turning; more do so together.
const MOST_POINTS: usize = 2;
/// Radius of the patch \[m\]: of a fingertip's size, below that of what is held.
const PATCH_M: f64 = 3e-3;

/// Lengths of the torsional and rolling friction that a point has, one of so many that are pressed \[m\].
pub(super) fn lengths_m(
    surfacing: &Surfacing,
    point: &ContactPoint,
    pressed: usize,
    is_soft: bool,
) -> [f64; 2] {
    let [torsional_m, rolling_m] = surfacing.turning_m;
    match pressed {
        1..=MOST_POINTS => [torsional_m, rolling_m],
        _ if is_soft => [0.0, rolling_m * point.rolls],
        _ => [0.0; 2],
    }
}

/// Gives a row these lengths of resistance to turning (m); `turned_W` is how far the body has been turned at the rim (m).
pub(super) fn resist(
    row: &mut Row,
    turning_m: [f64; 2],
    stiffness_n_per_m: f64,
    turned_W: &Vector3<f64>,
    start: &Start<'_>,
) {
    if turning_m == [0.0; 2] || !start.is_implicit {
        return;
    }
    // In the mean of all axes.
    let turns = |body: usize| start.motions[body].inverse_inertia_W.trace() / 3.0;
    let turns_per_kg_m2 = turns(row.body) + row.other.map_or(0.0, turns);
    if turns_per_kg_m2 <= 0.0 {
        return;
    }
    let stiffness_nm_per_rad = stiffness_n_per_m * PATCH_M * PATCH_M;
    let damping_nm_s_per_rad = 2.0 * (stiffness_nm_per_rad / turns_per_kg_m2).sqrt();
    let rest_W = turned_W * (-stiffness_nm_per_rad / PATCH_M);
    let rest_nm = row.normal_W.dot(&rest_W);
    row.turning_m = turning_m;
    row.torsion =
        Torsion { rest_nm, stiffness_nm_per_rad, damping_nm_s_per_rad, most_nm: 0.0, torque_nm: rest_nm };
    let rest_W = rest_W - row.normal_W * rest_nm;
    row.rolling =
        Rolling { rest_W, stiffness_nm_per_rad, damping_nm_s_per_rad, most_nm: 0.0, torque_W: rest_W };
}

/// Remembers how the tick ended: `turns_W` is how far the body has turned in it relative to the other (rad).
pub(super) fn settle(row: &Row, anchor: &mut Anchor, turns_W: &Vector3<f64>, X_WB: &Isometry3<f64>) {
    let stiffness_nm_per_rad = row.rolling.stiffness_nm_per_rad;
    if stiffness_nm_per_rad <= 0.0 {
        return anchor.turn_back(0.0);
    }
    // No spring is turned by more than the limit turns it. What the damper adds to the torque is not the spring's.
    let limits_nm = row.most_turning_nm(row.presses_n(&row.force_W));
    let [about_most_m, across_most_m] = limits_nm.map(|most_nm| most_nm * PATCH_M / stiffness_nm_per_rad);
    let turned_W = anchor.turned_W(X_WB) + turns_W * PATCH_M;
    let about_m = row.normal_W.dot(&turned_W);
    let across_W = within_ball(&(turned_W - row.normal_W * about_m), across_most_m);
    anchor.turn(&(across_W + row.normal_W * about_m.clamp(-about_most_m, about_most_m)), X_WB);
}
