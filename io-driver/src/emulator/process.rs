//! `io-driver emulate`: plays a card until a signal ends it, then says what it saw.

use super::amplifier::{Amplifier, AmplifierSpec, Tally, Value};
use super::card::{Card, QUEUE, Record, STATUS_TRIPPED};
use super::motion::{Motion, Pose};
use crate::device_file::PremiumFile;
use crate::kinematics::Kinematics;
use rt_core::clock::{monotonic_ns, sleep_until_ns};
use rt_core::signals::StopSignals;
use std::sync::atomic::Ordering;

/// What to play.
#[derive(Debug, Clone, Copy)]
pub struct Play {
    /// Longest force that passes (N).
    pub peak_n: f64,
    /// How much a force may grow from one value to the next (N).
    pub step_n: f64,
    /// Silence that trips the amplifiers (ns).
    pub watchdog_ns: u64,
    /// How often the registers are looked at (ns).
    pub poll_ns: u64,
}

/// A card being played.
#[derive(Debug)]
pub struct Emulator {
    card: &'static Card,
    premium: PremiumFile,
    amplifier: Amplifier,
    motion: Motion,
    pose: Pose,
    began_ns: u64,
    passed_ns: u64,
    checked: u64,
    arm: u32,
}

impl Emulator {
    /// A card at home that nobody has written to.
    pub fn new(card: &'static Card, premium: PremiumFile, motion: Motion, play: Play) -> Self {
        let amplifier = Amplifier::new(AmplifierSpec {
            motors: premium.motors,
            kinematics: Kinematics::Premium(premium.mechanism),
            peak_n: play.peak_n,
            step_n: play.step_n,
            watchdog_ns: play.watchdog_ns,
        });
        let now = monotonic_ns();
        let mut motion = motion;
        let pose = motion.pass(0.0, 0.0, [0.0; 3], &premium.encoders);
        let mut emulator = Self {
            card,
            premium,
            amplifier,
            motion,
            pose,
            began_ns: now,
            passed_ns: now,
            checked: card.outputs.written.load(Ordering::Acquire),
            arm: card.outputs.arm.load(Ordering::Relaxed),
        };
        emulator.tell();
        emulator
    }

    /// Plays until a signal asks it to end.
    pub fn run(mut self, poll_ns: u64, signals: &StopSignals) -> Tally {
        while signals.requested().is_none() {
            self.turn(monotonic_ns());
            sleep_until_ns(monotonic_ns() + poll_ns);
        }
        self.turn(monotonic_ns());
        self.amplifier.tally()
    }

    /// Takes what was written, lets time pass to `now_ns`, tells.
    pub fn turn(&mut self, now_ns: u64) {
        let arm = self.card.outputs.arm.load(Ordering::Acquire);
        if arm != self.arm {
            self.arm = arm;
            self.amplifier.arm();
        }
        let taken = self.take_values();
        // A register that is off by itself, not because a value that says so is still on its way.
        let is_on = self.card.outputs.enable.load(Ordering::Acquire) == 1;
        self.amplifier.pass(now_ns, is_on || taken > 0);
        let seconds = |ns: u64| ns as f64 / 1e9;
        let (time_s, dt_s) =
            (seconds(now_ns - self.began_ns), seconds(now_ns.saturating_sub(self.passed_ns)));
        self.passed_ns = now_ns;
        let torque = self.amplifier.joint_torque();
        self.pose = self.motion.pass(time_s, dt_s, torque, &self.premium.encoders);
        self.tell();
    }

    /// Returns how many there were.
    fn take_values(&mut self) -> u64 {
        let before = self.checked;
        let written = self.card.outputs.written.load(Ordering::Acquire);
        let oldest = written.saturating_sub(QUEUE as u64);
        if self.checked < oldest {
            self.amplifier.lose(oldest - self.checked);
            self.checked = oldest;
        }
        while self.checked < written {
            self.checked += 1;
            match self.card.record(self.checked) {
                Some(record) => self.amplifier.take(self.value_of(record), self.pose.joints),
                None => self.amplifier.lose(1),
            }
        }
        self.checked - before
    }

    fn value_of(&self, record: &Record) -> Value {
        let codes = record.codes.load(Ordering::Relaxed);
        Value {
            time_ns: record.time_ns.load(Ordering::Relaxed),
            codes: self.premium.motors.channel.map(|channel| (codes >> (16 * u32::from(channel % 4))) as u16),
            enable: record.flags.load(Ordering::Relaxed) & 1 == 1,
        }
    }

    fn tell(&mut self) {
        let inputs = &self.card.inputs;
        for (channel, counter) in self.premium.encoders.channel.iter().zip(self.pose.counters) {
            inputs.counters[usize::from(*channel)].store(counter, Ordering::Relaxed);
        }
        let status = if self.amplifier.is_tripped() { STATUS_TRIPPED } else { 0 };
        inputs.status.store(status, Ordering::Relaxed);
        for (word, count) in self.card.tally.words.iter().zip(self.amplifier.tally().to_words()) {
            word.store(count, Ordering::Relaxed);
        }
        inputs.heartbeat.fetch_add(1, Ordering::Release);
    }
}

/// What the amplifiers of a card have seen so far.
pub fn tally_of(card: &Card) -> Tally {
    Tally::from_words(std::array::from_fn(|i| card.tally.words[i].load(Ordering::Relaxed)))
}
