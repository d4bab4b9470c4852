//! A device that does what a test says, and remembers what it was made to do.

use io_driver::device::{Device, Effort, Reading, TickTime, Written};
use io_driver::safety::Restrained;
use nalgebra::Vector3;
use shm_abi::FaultReason;
use shm_abi::segment::DeviceInfo;
use std::sync::{Arc, Mutex, MutexGuard};

/// What was asked of a device, in order.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Call {
    /// Its position, in this tick.
    Read(u64),
    /// A force on the user (N).
    Write(Vector3<f64>),
    /// Motors off.
    Release,
}

/// How it behaves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Mood {
    /// As it should.
    #[default]
    Good,
    /// It cannot be read.
    Unreadable,
    /// Its position is not a number.
    Astray,
    /// It cannot be written.
    Unwritable,
    /// Reading it is a programming mistake.
    PanicsWhenRead,
    /// Writing it is one.
    PanicsWhenWritten,
}

/// The test's end of the strings.
#[derive(Debug, Clone, Default)]
pub struct Strings(Arc<Mutex<State>>);

#[derive(Debug)]
struct State {
    mood: Mood,
    position_m: Vector3<f64>,
    calls: Vec<Call>,
}

impl Default for State {
    fn default() -> Self {
        Self { mood: Mood::default(), position_m: Vector3::new(0.1, 0.2, 0.3), calls: Vec::new() }
    }
}

impl Strings {
    /// A device on these strings.
    pub fn device(&self, name: &str, peak_force_n: f64) -> Box<dyn Device> {
        let info = DeviceInfo {
            name: name.into(),
            kind: "puppet".into(),
            peak_force_n,
            continuous_force_n: peak_force_n,
            workspace_min_m: [-1.0; 3],
            workspace_max_m: [1.0; 3],
            slew_n_per_s: f64::INFINITY,
            speed_limit_m_per_s: f64::INFINITY,
        };
        Box::new(Puppet { info, strings: self.clone() })
    }

    /// How it behaves from now on.
    pub fn set(&self, mood: Mood) {
        self.state().mood = mood;
    }

    /// Where its tip is from now on (m).
    pub fn move_to(&self, position_m: Vector3<f64>) {
        self.state().position_m = position_m;
    }

    /// Everything that was asked of it so far.
    pub fn calls(&self) -> Vec<Call> {
        self.state().calls.clone()
    }

    /// What was asked of it last.
    pub fn last_call(&self) -> Option<Call> {
        self.state().calls.last().copied()
    }

    /// A panic while it was held is part of the play.
    fn state(&self) -> MutexGuard<'_, State> {
        self.0.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
    }
}

struct Puppet {
    info: DeviceInfo,
    strings: Strings,
}

impl Device for Puppet {
    fn info(&self) -> &DeviceInfo {
        &self.info
    }

    fn read(&mut self, time: TickTime) -> Result<Reading, FaultReason> {
        let mut state = self.strings.state();
        state.calls.push(Call::Read(time.tick));
        match state.mood {
            Mood::Unreadable => Err(FaultReason::DeviceRead),
            Mood::Astray => Ok(Reading::at(Vector3::new(0.0, f64::NAN, 0.0))),
            Mood::PanicsWhenRead => panic!("a puppet that panics when it is read"),
            _ => Ok(Reading::at(state.position_m)),
        }
    }

    fn attainable(&self, effort: Effort) -> Restrained {
        Restrained::whole(effort.force_on_user_n)
    }

    fn write(&mut self, effort: Effort) -> Result<Written, FaultReason> {
        let mut state = self.strings.state();
        state.calls.push(Call::Write(effort.force_on_user_n));
        match state.mood {
            Mood::Unwritable => Err(FaultReason::DeviceWrite),
            Mood::PanicsWhenWritten => panic!("a puppet that panics when it is written"),
            _ => Ok(Written { force_on_user_n: effort.force_on_user_n, ..Written::default() }),
        }
    }

    fn release(&mut self) {
        self.strings.state().calls.push(Call::Release);
    }
}
