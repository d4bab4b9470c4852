//! A finger's port to its hand: what the passivity controller has to know of a tick, and what it changes.
//!
//! Model: what is observed is the force that the driver says the motors were made to render in the last tick, after
//! ramps, limits and converters; where the driver writes forces a tick late, that is the older one, and the controller
//! is told so. What the materials that a finger touches can have stored is that of springs under the present forces; guides
//! and magnets say what they hold. What surfaces press with along their normals is told apart.
//!
//! Frames: world. Affine placements keep power, so the energy is the device's own.

#![allow(non_snake_case)] // Frames are capital letters.

use crate::fast_step::DeviceFinger;
use crate::row::FingerRow;
use haptics::FingerEffects;
use haptics::passivity::{Passivity, Port, Springs};
use nalgebra::Vector3;
use shm_abi::frame::DEVICE_POSITION_VALID;
use shm_abi::{DeviceFrame, Frame};

/// What happens in a tick, for all fingers.
#[derive(Debug, Clone, Copy)]
pub struct Tick {
    /// Whether commands drive the motors a tick after the reading that they answer.
    pub is_late: bool,
    /// Time since the last one (s).
    pub dt_s: f64,
}

impl Tick {
    /// Of a frame.
    pub fn new(frame: &Frame, dt_s: f64) -> Self {
        let previous = &frame.previous;
        let is_late = previous.authority > 0.0 && previous.command_tick.saturating_add(1) < frame.tick;
        Self { is_late, dt_s }
    }
}

/// A finger's controller, and what it has to remember of contacts.
#[derive(Debug)]
pub struct PassivePort {
    controller: Passivity,
    springs: Springs,
}

/// Sources of a finger's force in a tick.
pub struct Rendering<'a> {
    /// The finger, with its contacts.
    pub finger: &'a DeviceFinger,
    /// Effects that it feels beside contacts.
    pub felt: &'a FingerEffects,
    /// Factor of the contacts' forces.
    pub strength: f64,
}

impl PassivePort {
    /// For a finger that touches so many entities at most.
    pub fn new(controller: Passivity, contacts: usize) -> Self {
        Self { controller, springs: Springs::new(contacts) }
    }

    /// Forgets where the finger was; debts stay.
    pub fn reset(&mut self) {
        self.controller.reset();
        self.springs.reset();
    }

    /// Changes the force of a row so that it keeps the bound, and notes what was done.
    pub fn keep(
        &mut self,
        of: &Rendering<'_>,
        device: &DeviceFrame,
        carried_W: Vector3<f64>,
        tick: &Tick,
        row: &mut FingerRow,
    ) {
        if device.flags & DEVICE_POSITION_VALID == 0 {
            self.reset();
            row.energy_j = self.controller.energy_j();
            return;
        }
        self.controller.carry(carried_W);
        let (springs_j, pressing) = self.springs.of(&of.finger.finger, of.strength, &row.hip);
        let rendered = self.controller.step(&Port {
            position_W: row.hip,
            force_on_user_W: row.force_on_user,
            applied_on_user_W: Some(of.finger.mount.force_to_world(device.force_on_user_n_applied)),
            stored_j: springs_j + of.felt.stored_j(),
            is_late: tick.is_late,
            dt_s: tick.dt_s,
            pressing,
        });
        row.force_on_user = rendered.force_on_user_W;
        (row.energy_j, row.controlled_n) = (rendered.energy_j, rendered.changed_n);
    }
}
