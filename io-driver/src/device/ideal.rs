//! The ideal device: the scripted hand's position goes straight through, and any force is rendered.
//!
//! Problem: to see an algorithm's own behaviour, nothing may stand between the hand and it: no dynamics,
//! no quantisation, no speed, thermal or slew limit.
//!
//! Model: the tip is where the hand script, which is written in the world frame W, has the finger at the
//! time since full authority; before that it rests at the script's start. Without a script it rests at a
//! fixed point. Its velocity is the plain difference of two ticks, to the last bit. X_WD says where the base stands, as it would for a real device.

use super::{Device, Effort, Reading, TickTime, Written};
use crate::sim::script::HandPlayer;
use crate::velocity::VelocityEstimator;
use nalgebra::{Isometry3, Point3, Vector3};
use shm_abi::FaultReason;
use shm_abi::segment::DeviceInfo;

/// Who holds the ideal device's tip.
#[derive(Debug)]
pub enum Hand {
    /// A script, and the finger in it that this device is.
    Scripted(HandPlayer, usize),
    /// Nobody; it rests here, in W (m).
    Resting(Vector3<f64>),
}

/// The device.
#[derive(Debug)]
pub struct IdealDevice {
    info: DeviceInfo,
    /// Takes points of W to D; `None` leaves them bit for bit as they are.
    world_to_base: Option<Isometry3<f64>>,
    hand: Hand,
    velocity: VelocityEstimator,
}

impl IdealDevice {
    /// A device whose base stands at X_WD.
    pub fn new(info: DeviceInfo, base_in_world: Isometry3<f64>, hand: Hand) -> Self {
        let world_to_base = (base_in_world != Isometry3::identity()).then(|| base_in_world.inverse());
        Self { info, world_to_base, hand, velocity: VelocityEstimator::of_exact_places() }
    }
}

impl Device for IdealDevice {
    fn info(&self) -> &DeviceInfo {
        &self.info
    }

    fn read(&mut self, time: TickTime) -> Result<Reading, FaultReason> {
        let in_world = match &mut self.hand {
            // `open` makes sure that the finger is in the script.
            Hand::Scripted(player, finger) => {
                player.position(*finger, time.run_time_s()).ok_or(FaultReason::DeviceRead)?
            }
            Hand::Resting(at) => *at,
        };
        let in_base = match &self.world_to_base {
            Some(transform) => (transform * Point3::from(in_world)).coords,
            None => in_world,
        };
        let velocity_m_per_s = self.velocity.observe(time, in_base.into()).into();
        Ok(Reading { velocity_m_per_s, ..Reading::at(in_base) })
    }

    fn write(&mut self, effort: Effort) -> Result<Written, FaultReason> {
        Ok(Written { force_on_user_n: effort.force_on_user_n, ..Written::default() })
    }

    fn release(&mut self) {}

    fn rearm(&mut self) {
        self.velocity.forget();
    }
}
