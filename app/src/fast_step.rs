//! One tick of haptic rendering: from the driver's frame to the command that answers it.
//!
//! Model: each finger's HIP is taken into the world, steps against the entities, and its force goes back
//! into its device's base frame. Damping goes by the driver's estimate of the HIP's velocity; a driver of before
//! 1.1 gives none, and then by the difference of its positions. The same step serves all three clocks.
//!
//! Frames and signs: forces are forces on the user.
//! Invariants: no allocation, clock, lock or panic; the command answers the frame's tick; a device whose
//! position is not valid gets zero force and forgets its contacts.
//! Cost: linear in fingers times entities.

use crate::mount::Mount;
use crate::row::{FingerRow, Row};
use haptics::{Entity, Finger, Hip};
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
    driver_estimates: bool,
}

/// The first minor version of the shared-memory contract whose frames tell velocities.
const MINOR_WITH_VELOCITIES: u32 = 1;

impl FastStep {
    /// Fingers that have touched nothing yet.
    pub fn new(fingers: Vec<DeviceFinger>, entities: Vec<Entity>, period_ns: u64) -> Self {
        Self { fingers, entities, period_s: period_ns as f64 / 1e9, last_tick: None, driver_estimates: false }
    }

    /// Which minor version of the contract the driver speaks: until that is told, nothing is expected of it that
    /// 1.0 did not have.
    pub fn meet_driver(&mut self, abi_minor: u32) {
        self.driver_estimates = abi_minor >= MINOR_WITH_VELOCITIES;
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
            *row = finger.step(device, &self.entities, dt_s, self.driver_estimates);
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
    fn step(
        &mut self,
        device: &DeviceFrame,
        entities: &[Entity],
        dt_s: f64,
        driver_estimates: bool,
    ) -> FingerRow {
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
        let velocity =
            driver_estimates.then(|| self.mount.velocity_to_world(device.velocity_m_per_s_estimated));
        let output = self.finger.step(entities, Hip { position_W: hip, velocity_W: velocity }, dt_s);
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

#[cfg(test)]
mod tests {
    use super::*;
    use bytemuck::Zeroable;
    use haptics::Plane;
    use nalgebra::{Isometry3, UnitQuaternion};

    const PERIOD_NS: u64 = 1_000_000;
    const K: f64 = 1000.0;
    const B: f64 = 5.0;

    /// A finger over a damped floor, its device upside down.
    fn step() -> FastStep {
        let floor = Entity::new(Plane::new(Vector3::y(), 0.0).unwrap(), Isometry3::identity(), K);
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), std::f64::consts::PI);
        let finger = DeviceFinger {
            finger: Finger::new(0.0, 1).unwrap(),
            device: 0,
            mount: Mount::new(Isometry3::from_parts(Vector3::zeros().into(), turn)),
        };
        FastStep::new(vec![finger], vec![floor.unwrap().with_damping(B).unwrap()], PERIOD_NS)
    }

    /// The force upwards (N) at this height (m), told to rise at this speed (m/s) in the world.
    fn force(step: &mut FastStep, tick: u64, height: f64, rising: f64) -> f64 {
        let mut frame = Frame::zeroed();
        (frame.tick, frame.device_count) = (tick, 1);
        frame.devices[0].flags = DEVICE_POSITION_VALID;
        // The device stands on its head.
        frame.devices[0].position_m_measured[1] = -height;
        frame.devices[0].velocity_m_per_s_estimated[1] = -rising;
        let mut command = Command::zero(tick, 1, 1);
        step.step(&frame, &mut command, &mut Row::empty());
        -command.devices[0].force_on_user_n[1]
    }

    #[test]
    fn damping_goes_by_what_the_driver_estimates_however_many_ticks_were_missed() {
        let mut step = step();
        step.meet_driver(2);
        force(&mut step, 1, -1e-3, 0.0);
        for tick in [2, 3, 10] {
            // A sum of numbers near 1; the turn by pi leaves 1e-16 of each axis in the others.
            assert!((force(&mut step, tick, -1e-3, -0.1) - (K * 1e-3 + B * 0.1)).abs() < 1e-12);
        }
    }

    #[test]
    fn a_driver_that_tells_no_velocities_is_not_taken_for_one_at_rest() {
        let mut step = step();
        step.meet_driver(0);
        force(&mut step, 1, -1.0e-3, 0.0);
        assert!((force(&mut step, 2, -1.1e-3, 0.0) - (K * 1.1e-3 + B * 0.1)).abs() < 1e-12);
        let after_a_gap = force(&mut step, 12, -2.1e-3, 0.0);
        assert!((after_a_gap - (K * 2.1e-3 + B * 0.1)).abs() < 1e-12, "1 mm in ten ticks");
        step.meet_driver(1);
        assert!((force(&mut step, 13, -2.2e-3, 0.0) - K * 2.2e-3).abs() < 1e-12, "1.1 tells");
    }
}
