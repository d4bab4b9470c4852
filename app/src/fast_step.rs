//! One tick of haptic rendering: from the driver's frame to the command that answers it.
//!
//! Model: each finger's HIP is taken into the world, steps against the entities, and its force goes back
//! into its device's base frame. The same step serves all three clocks.
//!
//! Frames and signs: forces are forces on the user.
//! Invariants: no allocation, clock, lock or panic; the command answers the frame's tick; a device whose
//! position is not valid gets zero force and forgets its contacts.
//! Cost: linear in fingers times entities.

use crate::mount::Mount;
use crate::row::{FingerRow, Row};
use haptics::{Entity, Finger};
use nalgebra::Vector3;
use shm_abi::frame::DEVICE_POSITION_VALID;
use shm_abi::{Command, DeviceFrame, Frame};

/// A finger and the device that is it.
#[derive(Debug, Clone)]
pub struct DeviceFinger {
    /// The finger.
    pub finger: Finger,
    /// Index of its device.
    pub device: usize,
    /// Where the device stands.
    pub mount: Mount,
}

/// The state of rendering from tick to tick.
#[derive(Debug, Clone)]
pub struct FastStep {
    fingers: Vec<DeviceFinger>,
    entities: Vec<Entity>,
    period_s: f64,
    last_tick: Option<u64>,
}

impl FastStep {
    /// Fingers that have touched nothing yet.
    pub fn new(fingers: Vec<DeviceFinger>, entities: Vec<Entity>, period_ns: u64) -> Self {
        Self { fingers, entities, period_s: period_ns as f64 / 1e9, last_tick: None }
    }

    /// Renders a frame into the command that answers it, and into a row.
    pub fn step(&mut self, frame: &Frame, command: &mut Command, row: &mut Row) {
        // Ticks that the driver skipped, or that were missed here, are time that passed all the same.
        let ticks = self.last_tick.map_or(1, |last| frame.tick.saturating_sub(last).max(1));
        self.last_tick = Some(frame.tick);
        let dt_s = ticks as f64 * self.period_s;
        row.run_tick = frame.run_tick.max(0).unsigned_abs();
        let devices = frame.present_devices();
        for (finger, row) in self.fingers.iter_mut().zip(&mut row.fingers) {
            let Some(device) = devices.get(finger.device) else { continue };
            *row = finger.step(device, &self.entities, dt_s);
            command.devices[finger.device].force_on_user_n = finger.mount.force_to_device(row.force_on_user);
        }
    }

    /// Adds what the motors were made to render to the row of the tick before `next`.
    pub fn complete(&self, row: &mut Row, next: &Frame) {
        let devices = next.present_devices();
        for (finger, row) in self.fingers.iter().zip(&mut row.fingers) {
            if let Some(device) = devices.get(finger.device) {
                row.applied_on_user = finger.mount.force_to_world(device.force_on_user_n_applied);
            }
        }
    }

    /// Forgets all contacts: the connection to the devices was lost meanwhile.
    pub fn reset(&mut self) {
        self.last_tick = None;
        for finger in &mut self.fingers {
            finger.finger.reset();
        }
    }
}

impl DeviceFinger {
    fn step(&mut self, device: &DeviceFrame, entities: &[Entity], dt_s: f64) -> FingerRow {
        let hip = self.mount.point_to_world(device.position_m_measured);
        let orientation_wxyz = self.mount.orientation_to_world(device.orientation_wxyz_measured);
        let seen = FingerRow {
            hip,
            god_object: hip,
            orientation_wxyz,
            buttons: device.buttons,
            ..FingerRow::default()
        };
        if device.flags & DEVICE_POSITION_VALID == 0 {
            self.finger.reset();
            return seen;
        }
        let output = self.finger.step(entities, &hip, dt_s);
        FingerRow {
            god_object: output.god_object_W,
            force_on_user: finite_or_zero(output.force_on_user_W),
            entity: output.entity.map(|index| index as u32),
            feature: output.feature,
            friction: output.friction,
            ..seen
        }
    }
}

/// The driver refuses a command that is not finite as a whole; zero for one finger is milder.
fn finite_or_zero(force: Vector3<f64>) -> Vector3<f64> {
    if force.iter().all(|component| component.is_finite()) { force } else { Vector3::zeros() }
}
