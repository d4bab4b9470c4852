//! `io-driver emulate`: plays a card until a signal ends it, then says what it saw.

use super::amplifier::{Amplifier, AmplifierSpec, Tally, Value};
use super::card::{ARM_SHIFT, Card, QUEUE, Record, STATUS_TRIPPED};
use super::motion::{Given, Motion, Pose};
use crate::device_file::ArmFile;
use crate::encoders::{EncoderSpec, wrapped};
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
    /// What the counters show more than they would if they had been zero at home.
    pub counter_offset: i64,
}

/// A card being played.
#[derive(Debug)]
pub struct Emulator {
    card: &'static Card,
    arm_file: ArmFile,
    amplifier: Amplifier,
    motion: Motion,
    pose: Pose,
    began_ns: u64,
    passed_ns: u64,
    checked: u64,
    arm: u32,
    counter_offset: i64,
    longest_stall_ns: u64,
}

/// An emulator that stalls for longer than this (ns), and than two of its rounds, finds the world as it was after it:
/// made up at once, what it missed would be a jump of the counters, and to a driver far too fast.
const LONGEST_STALL_NS: u64 = 2_000_000;

impl Emulator {
    /// A card at home that nobody has written to.
    pub fn new(card: &'static Card, arm_file: ArmFile, motion: Motion, play: Play) -> Self {
        let amplifier = Amplifier::new(AmplifierSpec {
            motors: arm_file.motors,
            kinematics: arm_file.mechanism,
            peak_n: play.peak_n,
            step_n: play.step_n,
            watchdog_ns: play.watchdog_ns,
        });
        let now = monotonic_ns();
        let mut motion = motion;
        let pose = motion.pass(0.0, 0.0, Given::default(), [0; 3], &arm_file.encoders);
        let mut emulator = Self {
            card,
            arm_file,
            amplifier,
            motion,
            pose,
            began_ns: now,
            passed_ns: now,
            checked: card.outputs.written.load(Ordering::Acquire),
            arm: card.outputs.arm.load(Ordering::Relaxed),
            counter_offset: play.counter_offset,
            longest_stall_ns: LONGEST_STALL_NS.max(2 * play.poll_ns),
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
        self.passed_ns = self.passed_ns.max(now_ns.saturating_sub(self.longest_stall_ns));
        let taken = self.take_values(now_ns);
        self.take_arming();
        // A register that is off by itself, not because a value that says so is still on its way.
        let is_on = self.card.outputs.enable.load(Ordering::Acquire) == 1;
        self.amplifier.pass(now_ns, is_on || taken > 0);
        self.live_until(now_ns);
        self.tell();
    }

    /// Lets the arm move with what its amplifiers give now.
    fn live_until(&mut self, until_ns: u64) {
        let until_ns = until_ns.max(self.passed_ns);
        let seconds = |ns: u64| ns as f64 / 1e9;
        let (time_s, dt_s) = (seconds(until_ns - self.began_ns), seconds(until_ns - self.passed_ns));
        self.passed_ns = until_ns;
        let given = Given { torque_nm: self.amplifier.joint_torque(), codes: self.amplifier.codes() };
        let hand = self.turned_by_hand(self.arm_file.encoders.channel);
        self.pose = self.motion.pass(time_s, dt_s, given, hand, &self.arm_file.encoders);
    }

    /// Returns how many there were.
    fn take_values(&mut self, now_ns: u64) -> u64 {
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
                Some(record) => {
                    // Before this value and after all others, however late it is looked at.
                    let value = self.value_of(record);
                    self.live_until(value.time_ns.min(now_ns));
                    self.arm_if_newer((record.flags.load(Ordering::Relaxed) >> ARM_SHIFT) as u32);
                    self.amplifier.take(value, self.pose.joints);
                }
                None => self.amplifier.lose(1),
            }
        }
        self.checked - before
    }

    /// Armed with no value after it yet. If one has come meanwhile, that one tells whether it is before or after.
    fn take_arming(&mut self) {
        let arm = self.card.outputs.arm.load(Ordering::Acquire);
        if self.card.outputs.written.load(Ordering::Acquire) == self.checked {
            self.arm_if_newer(arm);
        }
    }

    fn arm_if_newer(&mut self, arm: u32) {
        if arm.wrapping_sub(self.arm).cast_signed() > 0 {
            self.arm = arm;
            self.amplifier.arm();
        }
    }

    fn value_of(&self, record: &Record) -> Value {
        let codes = record.codes.load(Ordering::Relaxed);
        Value {
            time_ns: record.time_ns.load(Ordering::Relaxed),
            codes: self
                .arm_file
                .motors
                .channel
                .map(|channel| (codes >> (16 * u32::from(channel % 4))) as u16),
            enable: record.flags.load(Ordering::Relaxed) & 1 == 1,
        }
    }

    fn turned_by_hand(&self, channels: [u8; 3]) -> [i64; 3] {
        let hand = &self.card.hand.counts;
        channels.map(|channel| i64::from(hand[usize::from(channel)].load(Ordering::Relaxed)))
    }

    fn tell(&mut self) {
        let handle = self.motion.handle();
        self.tell_counters(&self.arm_file.encoders, self.pose.counters.map(i64::from));
        if let Some(gimbal) = &self.arm_file.gimbal {
            let turned = self.turned_by_hand(gimbal.channel);
            let own = handle.gimbal_counters.unwrap_or_default();
            self.tell_counters(gimbal, std::array::from_fn(|axis| own[axis] + turned[axis]));
        }
        let inputs = &self.card.inputs;
        if let Some(buttons) = handle.buttons {
            inputs.buttons.store(buttons, Ordering::Relaxed);
        }
        let status = if self.amplifier.is_tripped() { STATUS_TRIPPED } else { 0 };
        inputs.status.store(status, Ordering::Relaxed);
        for (word, count) in self.card.tally.words.iter().zip(self.amplifier.tally().to_words()) {
            word.store(count, Ordering::Relaxed);
        }
        inputs.heartbeat.fetch_add(1, Ordering::Release);
    }

    fn tell_counters(&self, encoders: &EncoderSpec, counts: [i64; 3]) {
        for (channel, count) in encoders.channel.iter().zip(counts) {
            let counter = wrapped(count.wrapping_add(self.counter_offset), encoders.count_bits) as u32;
            self.card.inputs.counters[usize::from(*channel)].store(counter, Ordering::Relaxed);
        }
    }
}

/// What the amplifiers of a card have seen so far.
pub fn tally_of(card: &Card) -> Tally {
    Tally::from_words(std::array::from_fn(|i| card.tally.words[i].load(Ordering::Relaxed)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device_file::{DeviceFile, builtin};
    use crate::emulator::card::ARM_SHIFT;
    use std::path::Path;

    const MS: u64 = 1_000_000;

    fn emulator(card: &'static Card) -> Emulator {
        let text = builtin("premium-1.5").unwrap();
        let Ok(DeviceFile::Arm(arm_file)) = DeviceFile::parse(text, Path::new("premium-1.5")) else {
            panic!("it is built in");
        };
        // A step of a tenth of a newton a value.
        let play = Play { peak_n: 8.5, step_n: 0.1, watchdog_ns: 1000 * MS, poll_ns: MS, counter_offset: 0 };
        Emulator::new(card, *arm_file, Motion::Rest, play)
    }

    /// As a driver writes it, at most twelve converter steps, about a tenth of a newton, above the last.
    fn write(card: &Card, code: u64, enable: bool) {
        let number = card.outputs.written.load(Ordering::Relaxed) + 1;
        let record = &card.queue[(number % QUEUE as u64) as usize];
        let arm = u64::from(card.outputs.arm.load(Ordering::Relaxed));
        record.time_ns.store(monotonic_ns(), Ordering::Relaxed);
        record.codes.store(2048 | code << 16 | 2048 << 32, Ordering::Relaxed);
        record.flags.store(arm << ARM_SHIFT | u64::from(enable), Ordering::Relaxed);
        record.number.store(number, Ordering::Relaxed);
        card.outputs.enable.store(u32::from(enable), Ordering::Relaxed);
        card.outputs.written.store(number, Ordering::Release);
    }

    fn ramp(card: &Card) {
        for step in 0..20 {
            write(card, 2048 + 10 * step, true);
        }
    }

    /// An emulator that was kept from running finds a force, its end, an arming and another force at once.
    #[test]
    fn an_arming_falls_between_the_values_that_it_came_between_however_late_it_is_seen() {
        let directory = tempfile::tempdir().unwrap();
        let card = Card::create(&directory.path().join("card")).unwrap();
        let mut emulator = emulator(card);
        ramp(card);
        emulator.turn(monotonic_ns());
        // These go on where the ramp ended; those after the arming begin at nothing.
        write(card, 2048 + 200, true);
        write(card, 2048, false);
        card.outputs.arm.fetch_add(1, Ordering::AcqRel);
        ramp(card);
        emulator.turn(monotonic_ns());
        let tally = tally_of(card);
        assert_eq!((tally.checked, tally.wrong(), tally.switched_off), (42, 0, 0), "{tally:?}");
    }

    #[test]
    fn an_arming_without_a_value_after_it_counts_too() {
        let directory = tempfile::tempdir().unwrap();
        let card = Card::create(&directory.path().join("card")).unwrap();
        let mut emulator = emulator(card);
        write(card, 0, true);
        emulator.turn(monotonic_ns());
        assert_eq!(card.inputs.status.load(Ordering::Relaxed), STATUS_TRIPPED, "no converter has that code");
        card.outputs.arm.fetch_add(1, Ordering::AcqRel);
        emulator.turn(monotonic_ns());
        assert_eq!(card.inputs.status.load(Ordering::Relaxed), 0);
    }
}
