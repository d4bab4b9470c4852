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
use haptics::passivity::{Passivity, Port, Pressing};
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
    /// Entities that were touched in the last tick, in ascending order, and the normals there; and room for those of the
    /// next.
    normals: Vec<(usize, Vector3<f64>)>,
    next: Vec<(usize, Vector3<f64>)>,
}

/// What a finger's force is made of in a tick.
pub struct Rendering<'a> {
    /// The finger, with its contacts.
    pub finger: &'a DeviceFinger,
    /// What it feels beside contacts.
    pub felt: &'a FingerEffects,
    /// What contacts' forces were multiplied by.
    pub strength: f64,
}

impl PassivePort {
    /// For a finger that touches so many entities at most.
    pub fn new(controller: Passivity, contacts: usize) -> Self {
        let room = || Vec::with_capacity(contacts);
        Self { controller, normals: room(), next: room() }
    }

    /// Forgets where the finger was; debts stay.
    pub fn reset(&mut self) {
        self.controller.reset();
        self.normals.clear();
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
        let (springs_j, pressing) = self.springs(of, &row.hip);
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

    /// What the springs of all contacts hold under their present forces (J), and what of it presses along normals.
    fn springs(&mut self, of: &Rendering<'_>, hip_W: &Vector3<f64>) -> (f64, Pressing) {
        let (mut springs_j, mut all) = (0.0, Pressing::NOTHING);
        self.next.clear();
        for contact in of.finger.finger.contacts().take(self.next.capacity()) {
            let spring_j = |force_squared: f64| 0.5 * force_squared / contact.stiffness_n_per_m;
            springs_j += spring_j(contact.force_on_user_W.norm_squared());
            let normal_n = contact.normal_force_n * of.strength;
            all.force_on_user_W += contact.force_on_user_W * of.strength;
            all.normal_on_user_W += contact.normal_W * normal_n;
            all.stored_j += spring_j(contact.normal_force_n * contact.normal_force_n);
            if let Ok(at) = self.normals.binary_search_by_key(&contact.entity, |(entity, _)| *entity) {
                let turn_W = contact.normal_W - self.normals[at].1;
                all.turned_j += normal_n * (contact.god_object_W - hip_W).dot(&turn_W);
            }
            self.next.push((contact.entity, contact.normal_W));
        }
        std::mem::swap(&mut self.normals, &mut self.next);
        (springs_j, all)
    }
}
