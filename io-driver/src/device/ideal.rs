//! The ideal device: the scripted hand's position goes straight through, and any force is rendered.
//!
//! Problem: to see an algorithm's own behaviour, nothing may stand between the hand and it: no dynamics,
//! no quantisation, no speed or thermal limit. The guard's slew limit does, unless the configuration takes it away.
//!
//! Model: the tip is where the hand script, which is written in the world frame W, has the finger at the
//! time since full authority; before that it rests at the script's start. Without a script it rests at a
//! fixed point. Its velocity is the plain difference of two ticks, to the last bit. X_WD says where the base stands, as
//! it would for a real device. What the script says of the fingertip's orientation and of buttons goes through as well.

use super::{Device, Effort, Extras, Reading, TickTime, Written};
use crate::live_hand::LiveFinger;
use crate::safety::Restrained;
use crate::sim::script::HandPlayer;
use crate::velocity::VelocityEstimator;
use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use shm_abi::FaultReason;
use shm_abi::segment::DeviceInfo;

/// Who holds the ideal device's tip.
#[derive(Debug)]
pub enum Hand {
    /// A script, and the finger in it that this device is.
    Scripted(HandPlayer, usize),
    /// Whoever moves this finger live.
    Live(LiveFinger),
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
        let time_s = time.run_time_s();
        let (in_world, turned, buttons) = match &mut self.hand {
            // `open` makes sure that the finger is in the script.
            Hand::Scripted(player, finger) => (
                player.position(*finger, time_s).ok_or(FaultReason::DeviceRead)?,
                player.orientation(*finger, time_s),
                player.buttons(*finger, time_s).unwrap_or(0),
            ),
            Hand::Live(finger) => {
                let wish = finger.wish();
                (wish.place, Some(wish.orientation), wish.buttons)
            }
            Hand::Resting(at) => (*at, None, 0),
        };
        let in_base = match &self.world_to_base {
            Some(transform) => (transform * Point3::from(in_world)).coords,
            None => in_world,
        };
        let velocity_m_per_s = self.velocity.observe(time, in_base.into()).into();
        let mut reading = Reading { velocity_m_per_s, ..Reading::at(in_base) };
        reading.buttons = u64::from(buttons);
        if let Some(turn) = turned {
            reading.is_orientation_measured = true;
            reading.orientation_wxyz = wxyz(&match &self.world_to_base {
                Some(transform) => transform.rotation * turn,
                None => turn,
            });
        }
        Ok(reading)
    }

    fn attainable(&self, effort: Effort) -> Restrained {
        Restrained::whole(effort.force_on_user_n)
    }

    fn write(&mut self, effort: Effort) -> Result<Written, FaultReason> {
        Ok(Written { force_on_user_n: effort.force_on_user_n, ..Written::default() })
    }

    fn release(&mut self) {}

    fn rearm(&mut self) {
        self.velocity.forget();
    }

    fn extras(&self) -> Extras {
        match &self.hand {
            Hand::Scripted(player, finger) => {
                let script = player.script();
                Extras { orientation: script.has_orientation(*finger), buttons: script.has_buttons(*finger) }
            }
            Hand::Live(_) => Extras { orientation: true, buttons: true },
            Hand::Resting(_) => Extras::default(),
        }
    }
}

fn wxyz(turn: &UnitQuaternion<f64>) -> [f64; 4] {
    [turn.w, turn.i, turn.j, turn.k]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::script::HandScript;
    use nalgebra::Translation3;
    use std::f64::consts::FRAC_PI_2;
    use std::path::Path;

    const SCRIPT: &str = "t,a_x,a_y,a_z,a_qw,a_qx,a_qy,a_qz,a_buttons,b_x,b_y,b_z\n\
         0,1,2,3,0.8,0,0.6,0,5,0,0,0\n0.001,1,2,3,0.8,0,0.6,0,2,0,0,0\n";

    fn read(base: Isometry3<f64>, finger: usize, run_tick: i64) -> Reading {
        let script = HandScript::parse(SCRIPT, Path::new("hand.csv"), &["a", "b"]).unwrap();
        let info = DeviceInfo {
            name: "a".into(),
            kind: "ideal".into(),
            peak_force_n: f64::INFINITY,
            continuous_force_n: f64::INFINITY,
            workspace_min_m: [f64::NEG_INFINITY; 3],
            workspace_max_m: [f64::INFINITY; 3],
            slew_n_per_s: f64::INFINITY,
            speed_limit_m_per_s: f64::INFINITY,
        };
        let mut device = IdealDevice::new(info, base, Hand::Scripted(HandPlayer::new(script), finger));
        device.read(TickTime::counted(9, 1_000_000, run_tick)).unwrap()
    }

    #[test]
    fn orientation_and_buttons_of_the_script_go_through_bit_for_bit() {
        let expected = Reading {
            orientation_wxyz: [0.8, 0.0, 0.6, 0.0],
            is_orientation_measured: true,
            buttons: 5,
            ..Reading::at(Vector3::new(1.0, 2.0, 3.0))
        };
        assert_eq!(read(Isometry3::identity(), 0, 0), expected);
        assert_eq!(read(Isometry3::identity(), 0, 1).buttons, 2);
    }

    #[test]
    fn a_turned_base_sees_the_orientation_turned_back() {
        let turn = UnitQuaternion::from_scaled_axis(Vector3::y() * FRAC_PI_2);
        let base = Isometry3::from_parts(Translation3::new(1.0, 2.0, 3.0), turn);
        let [w, x, y, z] = read(base, 0, 0).orientation_wxyz;
        // 0.8, 0.6 is a turn by 2 atan2(0.6, 0.8) around y; a base that is turned by 90 degrees sees that much less.
        let half = 0.6_f64.atan2(0.8) - 0.25 * std::f64::consts::PI;
        // Some products of numbers of size one.
        assert!((w - half.cos()).abs() < 1e-15 && (y - half.sin()).abs() < 1e-15 && x == 0.0 && z == 0.0);
    }

    #[test]
    fn a_script_without_these_columns_reads_as_it_always_did() {
        let turned = Isometry3::rotation(Vector3::y());
        for base in [Isometry3::identity(), turned] {
            assert_eq!(read(base, 1, 0), Reading::at(Vector3::zeros()));
        }
    }
}
