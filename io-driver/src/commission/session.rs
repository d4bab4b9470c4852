//! The commander that commissions one device of a running driver.
//!
//! Model: it attaches like any application, answers every frame with zero force, and while motors are tried with
//! the force that makes one joint's torque, `F = J^-T tau`, for the one device. Whatever goes wrong (a fault, a
//! driver that ends, a request to stop) ends with the lease, and that with the force.

use super::hand_check::{HandCheck, HandVerdict};
use super::motor_check::{MotorCheck, MotorCheckSpec, MotorVerdict};
use crate::kinematics::{Kinematics, Mechanism};
use nalgebra::Vector3;
use rt_core::signals::StopSignals;
use shm_abi::client::{Attachment, Connection};
use shm_abi::frame::DEVICE_POSITION_VALID;
use shm_abi::{Command, CommanderMemory, DriverState, DriverView, FaultReason, Frame, FrameUnavailable};
use std::time::{Duration, Instant};
use thiserror::Error;

/// Why it came to no verdict.
#[derive(Debug, Error)]
pub enum SessionError {
    /// The driver has full force.
    #[error(
        "the driver is not in commissioning mode; start it with `io-driver run --commissioning` (or `commissioning = true` under [safety])"
    )]
    FullForce,
    /// The driver went into its fault state.
    #[error("the driver stopped the motors: {0}; find the cause, then `io-driver clear-fault`")]
    Fault(&'static str),
    /// The driver ended.
    #[error("the driver has ended")]
    DriverGone,
    /// The driver is there and tells nothing.
    #[error("the driver has told nothing for {0} s; it may be stopped (see `ps`)")]
    Silent(u64),
    /// The position is not known.
    #[error("the device does not know where it is; put it into its zeroing pose and see `io-driver status`")]
    NotZeroed,
    /// A signal or a person ended it.
    #[error("interrupted; the motors are off")]
    Interrupted,
    /// Nobody moved the tip.
    #[error("the tip was not moved by 30 mm within {0} s")]
    NotMoved(u64),
    /// No force came through.
    #[error(
        "no force was let through within {0} s; if there is a dead-man's switch, hold it (`io-driver status` tells)"
    )]
    NoAuthority(u64),
    /// It moves while no motor pushes it.
    #[error(
        "the arm did not rest for half a second within {0} s; hold its tip loosely and still, with the forearm on a table"
    )]
    Restless(u64),
    /// The arm is where forces cannot be told.
    #[error("the arm is too near to a singular pose; move it to its home position and try again")]
    Singular,
}

/// A lease on a driver in commissioning mode.
#[derive(Debug)]
pub struct Session<'a> {
    driver: DriverView,
    commander: CommanderMemory,
    connection: Connection,
    signals: &'a StopSignals,
    device: usize,
    seen: Option<u64>,
    frame: Frame,
}

/// How long a person may take.
const PATIENCE: Duration = Duration::from_secs(60);
/// How long the ramp of a new lease may take, a dead-man's switch being looked for included.
const UNTIL_AUTHORITY: Duration = Duration::from_secs(20);
/// A driver tells a frame in each tick.
const SILENCE: Duration = Duration::from_secs(5);
const NAP: Duration = Duration::from_millis(20);

impl<'a> Session<'a> {
    /// Takes the lease that was attached to, for one device.
    ///
    /// # Errors
    /// If the driver has full force.
    pub fn new(
        attachment: Attachment,
        device: usize,
        signals: &'a StopSignals,
    ) -> Result<Self, SessionError> {
        let Attachment { driver, commander, connection, .. } = attachment;
        if !driver.info().is_commissioning {
            return Err(SessionError::FullForce);
        }
        let commander = commander.ok_or(SessionError::DriverGone)?;
        let frame = bytemuck::Zeroable::zeroed();
        Ok(Self { driver, commander, connection, signals, device, seen: None, frame })
    }

    /// Waits until the tip has been moved along the positive `axis`.
    ///
    /// # Errors
    /// If nobody does, and whatever ends the session.
    pub fn check_by_hand(&mut self, axis: usize) -> Result<HandVerdict, SessionError> {
        let check = HandCheck::new(axis, self.next_position()?);
        let begun = Instant::now();
        while begun.elapsed() < PATIENCE {
            let position = self.next_position()?;
            if let Some(verdict) = check.observe(position) {
                return Ok(verdict);
            }
        }
        Err(SessionError::NotMoved(PATIENCE.as_secs()))
    }

    /// Tries the motors one by one, with at most the force `force_n`, telling which is tried.
    ///
    /// # Errors
    /// Whatever ends the session.
    pub fn check_motors(
        &mut self,
        kinematics: &Kinematics,
        rad_per_count: [f64; 3],
        mut tell: impl FnMut(usize),
    ) -> Result<[MotorVerdict; 3], SessionError> {
        self.wait_for_authority()?;
        let info = self.driver.info();
        let ticks = |seconds: f64| ((seconds * 1e9) as u64 / info.period_ns).max(1);
        let force_n = info.devices[self.device].peak_force_n;
        let mut check = MotorCheck::new(MotorCheckSpec {
            torque_nm: self.unit_torques(kinematics)?.map(|torque| 0.9 * force_n * torque),
            turned_rad: rad_per_count.map(|rad| TURNED_COUNTS * rad.abs()),
            ramp_ticks: ticks(3.0),
            rest_ticks: ticks(0.5),
            rest_share: REST_SHARE,
        });
        let mut told = None;
        loop {
            self.next_frame()?;
            let joints = self.joints();
            let torque = check.step(joints);
            if check.restless_ticks() > ticks(UNTIL_REST_S) {
                return Err(SessionError::Restless(UNTIL_REST_S as u64));
            }
            self.answer(force_for(kinematics, joints, torque)?);
            if let Some((joint, _)) = check.trying().filter(|(joint, _)| told != Some(*joint)) {
                told = Some(joint);
                tell(joint);
            }
            if let Some(verdicts) = check.verdicts() {
                return Ok(verdicts);
            }
        }
    }

    /// The torque of each joint alone (N m) that amounts to one newton at the tip.
    fn unit_torques(&mut self, kinematics: &Kinematics) -> Result<[f64; 3], SessionError> {
        let joints = self.joints();
        let mut torques = [0.0; 3];
        for (joint, torque) in torques.iter_mut().enumerate() {
            let mut unit = [0.0; 3];
            unit[joint] = 1.0;
            *torque = 1.0 / force_for(kinematics, joints, unit)?.norm();
        }
        Ok(torques)
    }

    fn wait_for_authority(&mut self) -> Result<(), SessionError> {
        let begun = Instant::now();
        while begun.elapsed() < UNTIL_AUTHORITY {
            self.next_frame()?;
            self.answer(Vector3::zeros());
            if self.frame.authority >= 1.0 {
                return Ok(());
            }
        }
        Err(SessionError::NoAuthority(UNTIL_AUTHORITY.as_secs()))
    }

    fn next_position(&mut self) -> Result<Vector3<f64>, SessionError> {
        self.next_frame()?;
        self.answer(Vector3::zeros());
        Ok(Vector3::from(self.frame.devices[self.device].position_m_measured))
    }

    fn joints(&self) -> [f64; 3] {
        let [a, b, c, ..] = self.frame.devices[self.device].joint_angle_rad;
        [a, b, c]
    }

    /// Waits for the next frame, and looks whether anything ended the session.
    fn next_frame(&mut self) -> Result<(), SessionError> {
        let begun = Instant::now();
        loop {
            if self.signals.requested().is_some() {
                return Err(SessionError::Interrupted);
            }
            self.driver.sleep_for_frame(self.seen, &self.commander, NAP);
            let latest = self.driver.latest_tick();
            if latest == self.seen {
                if !self.connection.is_open() {
                    return Err(SessionError::DriverGone);
                }
                if begun.elapsed() > SILENCE {
                    return Err(SessionError::Silent(SILENCE.as_secs()));
                }
                continue;
            }
            self.seen = latest;
            let read = latest.map(|tick| self.driver.read_frame(tick, &mut self.frame));
            match read {
                Some(Ok(())) => break,
                Some(Err(FrameUnavailable::NotYet(_) | FrameUnavailable::Torn(_))) | None => {}
                // A stalled reader; the next one is there already.
                Some(Err(FrameUnavailable::Overwritten(_))) => {}
            }
        }
        match DriverState::from_word(self.frame.state) {
            Some(DriverState::Fault) => {
                let reason = FaultReason::from_word(self.frame.fault);
                Err(SessionError::Fault(reason.map_or("for a reason of its own", FaultReason::sentence)))
            }
            _ if self.frame.devices[self.device].flags & DEVICE_POSITION_VALID == 0 => {
                Err(SessionError::NotZeroed)
            }
            _ => Ok(()),
        }
    }

    fn answer(&self, force: Vector3<f64>) {
        let mut command = Command::zero(self.frame.tick, self.commander.lease(), self.frame.device_count);
        command.devices[self.device].force_on_user_n = force.into();
        self.commander.publish(&command, &self.driver);
    }
}

/// So far a joint has to turn: well above the flicker of a counter, a millimetre at the tip.
const TURNED_COUNTS: f64 = 30.0;

/// What a hand trembles, and a joint creeps, while it rests: a third of a millimetre at the tip.
const REST_SHARE: f64 = 0.35;
/// How long an arm may take to come to rest (s).
const UNTIL_REST_S: f64 = 20.0;

/// The force on the user that makes these joint torques.
fn force_for(
    kinematics: &Kinematics,
    joints: [f64; 3],
    torque: [f64; 3],
) -> Result<Vector3<f64>, SessionError> {
    if kinematics.singularity(joints).inverse_condition() < 0.1 {
        return Err(SessionError::Singular);
    }
    let inverse = kinematics.jacobian(joints).transpose().try_inverse().ok_or(SessionError::Singular)?;
    Ok(inverse * Vector3::from(torque))
}
