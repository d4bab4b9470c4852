//! Forces that are known before the tick's end is: for integrators that do not ask for it.
//!
//! Model: a row whose force is known is a row without stiffness and damping; so impulses, which have to be
//! solved for, and friction that breaks go the same way as ever.

use nalgebra::Vector3;

use crate::body::Body;
use crate::row::{Row, Torsion};

/// What a row was before its force was fixed.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Kept {
    row: usize,
    rest_W: Vector3<f64>,
    stiffness: [f64; 2],
    damping: [f64; 2],
    torsion: Torsion,
}

/// The row's force (N) and torque (N m) when the tick begins. A finger's spring is described from where its end would be
/// at the tick's end if it went on with the body's point.
pub(crate) fn at_start(row: &Row, bodies: &[Body], is_touch: bool, dt_s: f64) -> (Vector3<f64>, f64) {
    let at = |body: usize, arm_W: &Vector3<f64>| {
        bodies[body].velocity_W + bodies[body].angular_velocity_W().cross(arm_W)
    };
    let spin = |body: usize| row.normal_W.dot(&bodies[body].angular_velocity_W());
    let other_W = row.other.map_or(Vector3::zeros(), |other| at(other, &row.arms_W[1]));
    let velocity_W = at(row.body, &row.arms_W[0]) - other_W;
    let ahead_W = if is_touch { velocity_W * dt_s } else { Vector3::zeros() };
    let spin_rad_s = spin(row.body) - row.other.map_or(0.0, spin);
    (row.project(&row.trial_W(&ahead_W, &velocity_W)), row.torsion.after_nm(0.0, spin_rad_s))
}

/// Fixes the row's force and torque for this tick.
pub(crate) fn fix(rows: &mut [Row], at: usize, force_W: &Vector3<f64>, torque_nm: f64, kept: &mut Vec<Kept>) {
    let row = &mut rows[at];
    if kept.len() == kept.capacity() {
        return;
    }
    let Row { rest_W, stiffness, damping, torsion, .. } = *row;
    kept.push(Kept { row: at, rest_W, stiffness, damping, torsion });
    (row.rest_W, row.force_W) = (*force_W, *force_W);
    (row.stiffness, row.damping) = ([0.0; 2], [0.0; 2]);
    row.torsion =
        Torsion { rest_nm: torque_nm, stiffness_nm_per_rad: 0.0, damping_nm_s_per_rad: 0.0, ..row.torsion };
}

/// Makes the rows what they were, but for what they did.
pub(crate) fn release(rows: &mut [Row], kept: &mut Vec<Kept>) {
    for was in kept.drain(..) {
        let row = &mut rows[was.row];
        (row.rest_W, row.stiffness, row.damping) = (was.rest_W, was.stiffness, was.damping);
        row.torsion = Torsion { torque_nm: row.torsion.torque_nm, ..was.torsion };
    }
}
