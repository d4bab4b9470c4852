//! The driver's ring of frames as a witness: what the motors were made to do, tick by tick.
//!
//! Time is counted in frames that were published, never on a clock: a driver that the machine keeps from
//! running does nothing meanwhile, and its ramps go on where they stood. A deadline that it skipped is no
//! frame.

use crate::driver::HANG;
use bytemuck::Zeroable;
use shm_abi::{DriverState, DriverView, FaultReason, Frame, FrameUnavailable, RING_FRAMES, ReplyKind};
use std::time::{Duration, Instant};

/// How often waiting looks again; the ring holds far more than what is published meanwhile.
const LOOK: Duration = Duration::from_micros(500);

/// What a frame tells about the tick before it, and about itself.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Told {
    /// The frame's tick.
    pub tick: u64,
    /// The lease in it.
    pub lease: u64,
    /// Ticks of the run in it; negative before.
    pub run_tick: i64,
    /// The driver's state in it.
    pub state: DriverState,
    /// What became of the reply in the tick before.
    pub reply: ReplyKind,
    /// The tick whose command drove the motors in the tick before.
    pub command_tick: u64,
    /// The share of it that was let through.
    pub authority: f64,
    /// The largest force that any device rendered in the tick before (N).
    pub applied_n: f64,
    /// The first device's (N).
    pub first_applied_n: [f64; 3],
}

impl Told {
    /// Takes a frame in; its numbers must be numbers and its words known ones.
    pub fn by(frame: &Frame) -> Self {
        let applied_n = frame
            .present_devices()
            .iter()
            .map(|device| nalgebra::Vector3::from(device.force_on_user_n_applied).norm())
            .inspect(|force| assert!(force.is_finite(), "frame {} tells {force} N", frame.tick))
            .fold(0.0, f64::max);
        Self {
            tick: frame.tick,
            lease: frame.lease,
            run_tick: frame.run_tick,
            state: DriverState::from_word(frame.state).expect("a state"),
            reply: ReplyKind::from_word(frame.previous.reply).expect("a kind of reply"),
            command_tick: frame.previous.command_tick,
            authority: frame.previous.authority,
            applied_n,
            first_applied_n: frame.devices[0].force_on_user_n_applied,
        }
    }

    /// Whether the motors were on in the tick before.
    pub fn is_pushing(&self) -> bool {
        self.applied_n != 0.0
    }
}

/// All frames since it was begun.
#[derive(Debug)]
pub struct RingLog {
    /// What they told, in order.
    pub told: Vec<Told>,
    /// Frames that were overwritten before they were looked at.
    pub lost: u64,
    next_tick: u64,
}

impl RingLog {
    /// Begins with the next frame.
    pub fn begin(driver: &DriverView) -> Self {
        Self { told: Vec::new(), lost: 0, next_tick: driver.latest_tick().map_or(0, |tick| tick + 1) }
    }

    /// Forgets what was told so far, and looks on.
    pub fn forget(&mut self) {
        self.told.clear();
        self.lost = 0;
    }

    /// Takes in all new frames.
    pub fn catch_up(&mut self, driver: &DriverView) {
        let Some(latest) = driver.latest_tick() else { return };
        let oldest = (latest + 1).saturating_sub(RING_FRAMES as u64);
        self.lost += oldest.saturating_sub(self.next_tick);
        let mut frame = Frame::zeroed();
        for tick in self.next_tick.max(oldest)..=latest {
            match driver.read_frame(tick, &mut frame) {
                Ok(()) => self.told.push(Told::by(&frame)),
                // A deadline that the driver skipped.
                Err(FrameUnavailable::NotYet(_)) => {}
                Err(FrameUnavailable::Overwritten(_) | FrameUnavailable::Torn(_)) => self.lost += 1,
            }
        }
        self.next_tick = self.next_tick.max(latest + 1);
    }

    /// Looks on until what was told pleases.
    pub fn follow(&mut self, driver: &DriverView, what: &str, mut pleases: impl FnMut(&[Told]) -> bool) {
        let begun = Instant::now();
        loop {
            self.catch_up(driver);
            if pleases(&self.told) {
                return;
            }
            if begun.elapsed() >= HANG {
                let fault = FaultReason::sentence_for(driver.read_latest().map_or(0, |frame| frame.fault));
                panic!("{what} does not come; the driver tells {fault}; last: {:?}", self.told.last());
            }
            std::thread::sleep(LOOK);
        }
    }

    /// Looks on until so many frames more have been published.
    pub fn follow_for(&mut self, driver: &DriverView, frames: usize) {
        self.catch_up(driver);
        let from = self.told.len();
        self.follow(driver, "the next frames", |told| told.len() >= from + frames);
    }

    /// Looks on until the motors have been on since now.
    pub fn follow_to_force(&mut self, driver: &DriverView) {
        self.catch_up(driver);
        let from = self.told.len();
        self.follow(driver, "force", |told| told[from..].iter().any(Told::is_pushing));
    }

    /// The tick of the last command that moved the motors.
    pub fn last_command(&self) -> Option<u64> {
        self.told.iter().filter(|told| told.authority > 0.0).map(|told| told.command_tick).max()
    }

    /// Checks the driver's promise on everything that was told. A command drives the motors in its own tick,
    /// in the `max_command_age_ticks` after it, and in the ramp, whose last tick is at zero: so in the
    /// `max_command_age_ticks + ramp_out_ticks` th tick after it and later they are off, which the frame
    /// after that tick tells.
    pub fn check_promise(&self, driver: &DriverView) {
        let info = driver.info();
        let silent_after = info.max_command_age_ticks + info.ramp_out_ticks;
        for (index, told) in self.told.iter().enumerate() {
            if !told.is_pushing() {
                continue;
            }
            assert!(told.authority > 0.0, "{told:?}");
            assert!(told.command_tick < told.tick, "a command from the future: {told:?}");
            // The tick that is told about is the frame before this one; it and those between it and the
            // command have passed. Frames that were lost are not counted, which errs towards the driver.
            let before = self.told[..index].iter().rev();
            let passed = before.take_while(|earlier| earlier.tick > told.command_tick).count() as u64;
            assert!(passed < silent_after, "{passed} ticks after its command: {told:?}");
        }
    }

    /// Checks that nothing was rendered from `tick` on, and that there was something to see.
    pub fn check_silence_from(&self, tick: u64) {
        let later: Vec<_> = self.told.iter().filter(|told| told.tick >= tick).collect();
        assert!(!later.is_empty(), "no frame from {tick} on");
        for told in later {
            assert!(!told.is_pushing(), "{told:?}, silent from {tick}");
        }
    }
}
