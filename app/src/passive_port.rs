//! A finger's port to its hand: what the passivity controller has to know of a tick, and what it changes.
//!
//! Model: what is observed is the force that the driver says the motors were made to render in the last tick, after
//! ramps, limits and converters; where the driver writes forces a tick late, that is the older one, and the controller
//! is told so. What the materials that a finger touches can have stored is that of springs under the present forces.
//!
//! Frames: world. Affine placements keep power, so the energy is the device's own.

#![allow(non_snake_case)] // Frames are capital letters.

use crate::fast_step::DeviceFinger;
use crate::row::FingerRow;
use haptics::Entity;
use haptics::passivity::{Passivity, Port};
use nalgebra::Vector3;
use shm_abi::frame::DEVICE_POSITION_VALID;
use shm_abi::{DeviceFrame, Frame};

/// What happens in a tick, for all fingers.
#[derive(Debug, Clone, Copy)]
pub struct Tick<'a> {
    /// The entities as they were felt.
    pub entities: &'a [Entity],
    /// Whether commands drive the motors a tick after the reading that they answer.
    pub is_late: bool,
    /// Time since the last one (s).
    pub dt_s: f64,
}

impl<'a> Tick<'a> {
    /// Of a frame.
    pub fn new(frame: &Frame, entities: &'a [Entity], dt_s: f64) -> Self {
        let previous = &frame.previous;
        let is_late = previous.authority > 0.0 && previous.command_tick.saturating_add(1) < frame.tick;
        Self { entities, is_late, dt_s }
    }
}

/// Changes the force of a row so that it keeps the bound, and notes what was done.
pub fn keep_passive(
    passivity: &mut Passivity,
    finger: &DeviceFinger,
    device: &DeviceFrame,
    carried_W: Vector3<f64>,
    tick: &Tick<'_>,
    row: &mut FingerRow,
) {
    if device.flags & DEVICE_POSITION_VALID == 0 {
        passivity.reset();
        row.energy_j = passivity.energy_j();
        return;
    }
    passivity.carry(carried_W);
    let rendered = passivity.step(&Port {
        position_W: row.hip,
        force_on_user_W: row.force_on_user,
        applied_on_user_W: Some(finger.mount.force_to_world(device.force_on_user_n_applied)),
        stored_j: stored_j(finger, tick.entities),
        is_late: tick.is_late,
        dt_s: tick.dt_s,
    });
    row.force_on_user = rendered.force_on_user_W;
    (row.energy_j, row.controlled_n) = (rendered.energy_j, rendered.changed_n);
}

/// What the springs of all contacts hold under their present forces (J).
fn stored_j(finger: &DeviceFinger, entities: &[Entity]) -> f64 {
    let contacts = finger.finger.contacts();
    let springs = contacts.filter_map(|contact| {
        let stiffness = entities.get(contact.entity)?.stiffness_n_per_m;
        Some(0.5 * contact.force_on_user_W.norm_squared() / stiffness)
    });
    springs.sum()
}
