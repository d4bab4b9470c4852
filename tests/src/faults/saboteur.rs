//! Something that goes wrong inside the driver's loop, on a plan that the environment tells.
//!
//! Model: `io-driver-under-test` puts a [`Saboteur`] around each device. `PHANTOM3_SABOTAGE` lists what it does
//! and when, such as `panic@500,hang:300@button20`: in tick 500, or as soon as button 20 of the card is pressed,
//! which a test presses by a word of the shared file. Each is done once, and by the first device alone.

use io_driver::device::{Device, Effort, Extras, Reading, TickTime, Written};
use io_driver::safety::Restrained;
use io_driver::zeroing::ZeroState;
use nalgebra::Vector3;
use shm_abi::FaultReason;
use shm_abi::segment::DeviceInfo;
use std::hint::black_box;
use std::str::FromStr;
use std::time::Duration;

/// Names the plan.
pub const SABOTAGE_VARIABLE: &str = "PHANTOM3_SABOTAGE";

/// What goes wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Act {
    /// Reading is a programming mistake.
    Panic,
    /// Writing is one, before anything was written.
    PanicBeforeWrite,
    /// Writing is one, after a force was written.
    PanicAfterWrite,
    /// The loop's stack overflows: a fault that the CPU raises, on the loop's own thread.
    Overflow,
    /// A SIGSEGV, raised by the loop's own thread.
    Segv,
    /// A system call that a driver has no use for: it could send any process a signal.
    ForbiddenCall,
    /// `abort`, on the loop's own thread.
    Abort,
    /// The process exits without a word.
    Exit,
    /// The position is not a number.
    Nan,
    /// The position is half a metre off.
    Leap,
    /// The device cannot be read.
    Unreadable,
    /// The device cannot be written.
    Unwritable,
    /// The loop stands still.
    Hang(Duration),
}

/// When.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum When {
    /// In this tick.
    Tick(u64),
    /// When this button is pressed.
    Button(u32),
}

/// One line of the plan.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sabotage {
    /// What.
    pub act: Act,
    /// When.
    pub when: When,
}

impl Sabotage {
    /// A plan as the environment tells it.
    ///
    /// # Errors
    /// What cannot be understood.
    pub fn plan(text: &str) -> Result<Vec<Self>, String> {
        text.split(',').filter(|item| !item.is_empty()).map(str::parse).collect()
    }
}

impl FromStr for Sabotage {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parse = || {
            let (act, when) = text.split_once('@')?;
            let (name, ms) = act.split_once(':').unwrap_or((act, "0"));
            let act = Act::named(name, Duration::from_millis(ms.parse().ok()?))?;
            let when = match when.strip_prefix("button") {
                Some(button) => When::Button(button.parse().ok()?),
                None => When::Tick(when.parse().ok()?),
            };
            Some(Self { act, when })
        };
        parse().ok_or_else(|| format!("{SABOTAGE_VARIABLE}: {text} is no ACT[:MS]@TICK or ACT[:MS]@buttonN"))
    }
}

impl Act {
    fn named(name: &str, time: Duration) -> Option<Self> {
        Some(match name {
            "panic" => Self::Panic,
            "panic-before-write" => Self::PanicBeforeWrite,
            "panic-after-write" => Self::PanicAfterWrite,
            "overflow" => Self::Overflow,
            "segv" => Self::Segv,
            "forbidden-call" => Self::ForbiddenCall,
            "abort" => Self::Abort,
            "exit" => Self::Exit,
            "nan" => Self::Nan,
            "leap" => Self::Leap,
            "unreadable" => Self::Unreadable,
            "unwritable" => Self::Unwritable,
            "hang" => Self::Hang(time),
            _ => return None,
        })
    }
}

/// A device with a plan.
pub struct Saboteur {
    inner: Box<dyn Device>,
    plan: Vec<Sabotage>,
    /// What is to be done when this tick's force is written.
    at_write: Option<Act>,
}

impl Saboteur {
    /// Around a device, if the environment has a plan and it is the first one asked for.
    ///
    /// # Panics
    /// If the plan cannot be understood: the test that made it is wrong.
    pub fn fit(inner: Box<dyn Device>) -> Box<dyn Device> {
        use std::sync::atomic::{AtomicBool, Ordering};
        static ENGAGED: AtomicBool = AtomicBool::new(false);
        match std::env::var(SABOTAGE_VARIABLE) {
            Ok(text) if !ENGAGED.swap(true, Ordering::Relaxed) => {
                let plan = Sabotage::plan(&text).expect("a plan");
                Box::new(Self { inner, plan, at_write: None })
            }
            _ => inner,
        }
    }

    fn due(&mut self, tick: u64, buttons: u64) -> Option<Act> {
        let is_due = |item: &Sabotage| match item.when {
            When::Tick(at) => tick >= at,
            When::Button(button) => buttons >> button & 1 == 1,
        };
        let index = self.plan.iter().position(is_due)?;
        Some(self.plan.remove(index).act)
    }

    fn spoil(&mut self, act: Act, reading: Reading) -> Result<Reading, FaultReason> {
        match act {
            Act::Panic => panic!("sabotage: reading"),
            Act::Overflow => {
                black_box(overflow(0));
            }
            Act::Segv => {
                let _ = signal_hook::low_level::raise(rustix::process::Signal::SEGV.as_raw());
            }
            Act::ForbiddenCall => {
                let own = rustix::process::getpid();
                let _ = rustix::process::kill_process(own, rustix::process::Signal::SEGV);
            }
            Act::Abort => std::process::abort(),
            Act::Exit => std::process::exit(0),
            Act::Nan => {
                return Ok(Reading { position_m: Vector3::new(0.0, f64::NAN, 0.0), ..reading });
            }
            Act::Leap => {
                return Ok(Reading { position_m: reading.position_m.add_scalar(0.5), ..reading });
            }
            Act::Unreadable => return Err(FaultReason::DeviceRead),
            Act::Hang(time) => std::thread::sleep(time),
            Act::PanicBeforeWrite | Act::PanicAfterWrite | Act::Unwritable => self.at_write = Some(act),
        }
        Ok(reading)
    }
}

impl Device for Saboteur {
    fn info(&self) -> &DeviceInfo {
        self.inner.info()
    }

    fn extras(&self) -> Extras {
        self.inner.extras()
    }

    fn zero_state(&self) -> ZeroState {
        self.inner.zero_state()
    }

    fn zero(&mut self) {
        self.inner.zero();
    }

    fn lose_zero(&mut self) {
        self.inner.lose_zero();
    }

    fn read(&mut self, time: TickTime) -> Result<Reading, FaultReason> {
        let reading = self.inner.read(time)?;
        match self.due(time.tick, reading.buttons) {
            Some(act) => self.spoil(act, reading),
            None => Ok(reading),
        }
    }

    fn attainable(&self, effort: Effort) -> Restrained {
        self.inner.attainable(effort)
    }

    fn write(&mut self, effort: Effort) -> Result<Written, FaultReason> {
        let act = self.at_write.take();
        match act {
            Some(Act::PanicBeforeWrite) => panic!("sabotage: before writing"),
            Some(Act::Unwritable) => return Err(FaultReason::DeviceWrite),
            _ => {}
        }
        let written = self.inner.write(effort);
        assert!(act != Some(Act::PanicAfterWrite), "sabotage: after writing");
        written
    }

    fn release(&mut self) {
        self.inner.release();
    }

    fn rearm(&mut self) {
        self.inner.rearm();
    }
}

/// Never returns: each call needs a page more of a stack that ends.
#[expect(unconditional_recursion, reason = "that is the sabotage")]
fn overflow(depth: u64) -> u64 {
    let page = black_box([depth; 512]);
    overflow(depth + 1) + page[(depth % 512) as usize]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plan_is_read_as_it_is_written() {
        let plan = Sabotage::plan("panic@500,hang:300@button20").expect("a plan");
        let hang = Act::Hang(Duration::from_millis(300));
        assert_eq!(plan[0], Sabotage { act: Act::Panic, when: When::Tick(500) });
        assert_eq!(plan[1], Sabotage { act: hang, when: When::Button(20) });
        assert_eq!(Sabotage::plan("").expect("no plan"), []);
        assert!(Sabotage::plan("dance@3").is_err() && Sabotage::plan("panic").is_err());
    }
}
