//! Plausibility of a driver's frames, from one to the next.
//!
//! Problem: what the driver writes is an allegation. A driver that is broken, or is none, must not make a run wait for
//! ever or count wrongly: ticks that go back or jump ahead, deadlines in the future, a time of the run that does not go
//! with the ticks, or never begins, frames that are never meant for us, positions that are no places.
//!
//! Model: ticks go up, and not faster than the clock allows, with room for a ring of them; within one lease t = 0 comes
//! when this program's answers have brought full authority, so not before its first frame and not after authority is
//! full; from there on the time of the run goes with the ticks; a frame is due when it is published; what is measured is
//! finite. Everything else that is rare, such as missed frames, overruns and stalls of the machine, keeps to these.
//!
//! Cost: a dozen comparisons a frame; no allocation, no system call.

use io_driver::table::MAX_MAGNITUDE;
use shm_abi::frame::{DEVICE_ORIENTATION_MEASURED, DEVICE_POSITION_VALID};
use shm_abi::{DeviceFrame, Frame, RING_FRAMES};
use thiserror::Error;

/// What no sound driver tells.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
pub enum Implausible {
    /// The number of the newest frame became smaller.
    #[error("its ticks go back: found tick {found} after {before}, expected more")]
    Backwards {
        /// The tick found.
        found: u64,
        /// The tick before.
        before: u64,
    },
    /// It became larger than time allows.
    #[error(
        "its ticks jump: found tick {found} after {before}, expected {most} at most after so short a time"
    )]
    Jump {
        /// The tick found.
        found: u64,
        /// The tick before.
        before: u64,
        /// The largest that can be.
        most: u64,
    },
    /// The frame tells another tick than its place.
    #[error("its frame of tick {expected} says that it is of tick {found}")]
    WrongTick {
        /// The tick in the frame.
        found: u64,
        /// The tick that was announced.
        expected: u64,
    },
    /// The frame is due later than now.
    #[error(
        "its frame of tick {tick} comes from the future: it is due in {ahead_ms} ms, expected {most_ms} ms at most"
    )]
    Future {
        /// The tick.
        tick: u64,
        /// How far ahead.
        ahead_ms: u64,
        /// The most that is believed.
        most_ms: u64,
    },
    /// The time of the run does not go with the ticks.
    #[error(
        "its time of the run does not go with its ticks: found {found} in tick {tick}, expected {expected}"
    )]
    RunTick {
        /// The tick.
        tick: u64,
        /// The run's tick found.
        found: i64,
        /// The run's tick that follows from the frames before.
        expected: i64,
    },
    /// The run is older than this program's first answer.
    #[error(
        "its time of the run began before this program's first answer: found {found} in tick {tick}, expected {most} at most"
    )]
    RunTooOld {
        /// The tick.
        tick: u64,
        /// The run's tick found.
        found: i64,
        /// The largest that can be.
        most: i64,
    },
    /// The whole force is let through, and t = 0 has not come.
    #[error(
        "its time of the run does not begin: found {found} in tick {tick} at full authority, expected 0 or more"
    )]
    NotBegun {
        /// The tick.
        tick: u64,
        /// The run's tick found.
        found: i64,
    },
    /// A value that is said to be measured is none.
    #[error(
        "its {value} of device {device} is said to be valid in tick {tick} and is none: found {found}, expected finite \
         numbers up to 1e15 in size"
    )]
    NoMeasurement {
        /// The tick.
        tick: u64,
        /// Which device, from 0.
        device: usize,
        /// Which of its values.
        value: &'static str,
        /// The first component that is wrong.
        found: f64,
    },
    /// Frames come, and none can be answered.
    #[error("it has told no frame under this program's lease for {seconds} s though its ticks go on")]
    NoneForUs {
        /// For how long.
        seconds: u64,
    },
}

/// How far in the future a frame may be due, beyond one tick: clocks of one machine do not differ.
const FUTURE_NS: u64 = 1_000_000_000;
/// A lease is in force within a fraction of this, the former one's ramp included.
const NONE_FOR_US_NS: u64 = 10_000_000_000;

/// What the frames so far were like.
#[derive(Debug, Clone, Copy)]
pub struct Plausibility {
    period_ns: u64,
    /// The tick seen first: no answer of ours is older.
    first: Option<u64>,
    /// The tick seen last, and when.
    last: Option<(u64, u64)>,
    /// In which tick our lease's t = 0 was.
    run_began: Option<i64>,
    /// When a frame was answered last.
    answered_ns: Option<u64>,
}

impl Plausibility {
    /// Of a driver with this period, which has told nothing yet.
    pub fn new(period_ns: u64) -> Self {
        Self { period_ns: period_ns.max(1), first: None, last: None, run_began: None, answered_ns: None }
    }

    /// Judges the number of the newest frame, before that is read.
    ///
    /// # Errors
    /// If it goes back, or jumps ahead of the clock.
    pub fn judge_tick(&mut self, tick: u64, now_ns: u64) -> Result<(), Implausible> {
        if let Some((before, seen_ns)) = self.last {
            let passed = now_ns.saturating_sub(seen_ns) / self.period_ns;
            // A loop that catches up makes several ticks in the time of one.
            let most = before.saturating_add(passed.saturating_mul(2)).saturating_add(RING_FRAMES as u64);
            if tick < before {
                return Err(Implausible::Backwards { found: tick, before });
            }
            if tick > most {
                return Err(Implausible::Jump { found: tick, before, most });
            }
        }
        self.first.get_or_insert(tick);
        self.last = Some((tick, now_ns));
        Ok(())
    }

    /// Judges the frame of `tick`, which was read whole; `is_for_us`: it is under our lease.
    ///
    /// # Errors
    /// If no sound driver tells it.
    pub fn judge_frame(
        &mut self,
        tick: u64,
        frame: &Frame,
        is_for_us: bool,
        now_ns: u64,
    ) -> Result<(), Implausible> {
        if frame.tick != tick {
            return Err(Implausible::WrongTick { found: frame.tick, expected: tick });
        }
        let (ahead_ns, most_ns) = (frame.deadline_ns.saturating_sub(now_ns), self.period_ns + FUTURE_NS);
        if ahead_ns > most_ns {
            let (ahead_ms, most_ms) = (ahead_ns / 1_000_000, most_ns / 1_000_000);
            return Err(Implausible::Future { tick, ahead_ms, most_ms });
        }
        self.judge_run(tick, frame, is_for_us)?;
        if is_for_us {
            judge_measurements(frame)?;
        }
        self.note_answer(is_for_us, now_ns)
    }

    /// Our lease's t = 0 comes once, and from there on its time goes with the ticks. The time of others, and of nobody
    /// while a force ramps out, is not ours to judge.
    fn judge_run(&mut self, tick: u64, frame: &Frame, is_for_us: bool) -> Result<(), Implausible> {
        match self.run_began.filter(|_| is_for_us) {
            Some(zero) => {
                let expected = tick.cast_signed().wrapping_sub(zero);
                if frame.run_tick != expected {
                    return Err(Implausible::RunTick { tick, found: frame.run_tick, expected });
                }
            }
            None if frame.run_tick > self.oldest_run(tick, is_for_us) => {
                let most = self.oldest_run(tick, is_for_us);
                return Err(Implausible::RunTooOld { tick, found: frame.run_tick, most });
            }
            None if is_for_us && frame.run_tick < 0 && frame.authority >= 1.0 => {
                return Err(Implausible::NotBegun { tick, found: frame.run_tick });
            }
            None if is_for_us && frame.run_tick >= 0 => {
                self.run_began = Some(tick.cast_signed().wrapping_sub(frame.run_tick));
            }
            None => {}
        }
        Ok(())
    }

    /// Authority of ours comes with our answers; that of others came no earlier than the driver.
    fn oldest_run(&self, tick: u64, is_for_us: bool) -> i64 {
        let first = self.first.filter(|_| is_for_us).unwrap_or(0);
        tick.saturating_sub(first).cast_signed()
    }

    /// A frame that cannot be read is for nobody, too.
    ///
    /// # Errors
    /// If none has been answered for long.
    pub fn note_answer(&mut self, is_answered: bool, now_ns: u64) -> Result<(), Implausible> {
        let since_ns = *self.answered_ns.get_or_insert(now_ns);
        if is_answered {
            self.answered_ns = Some(now_ns);
        } else if now_ns.saturating_sub(since_ns) > NONE_FOR_US_NS {
            return Err(Implausible::NoneForUs { seconds: NONE_FOR_US_NS / 1_000_000_000 });
        }
        Ok(())
    }
}

/// Of the devices that say that they know where they are.
fn judge_measurements(frame: &Frame) -> Result<(), Implausible> {
    let knows_its_place = |(_, told): &(usize, &DeviceFrame)| told.flags & DEVICE_POSITION_VALID != 0;
    for (device, told) in frame.present_devices().iter().enumerate().filter(knows_its_place) {
        let judge = |value, most: f64, components: &[f64]| {
            let is_none = |component: &&f64| component.is_nan() || component.abs() > most;
            let lie = |&found| Err(Implausible::NoMeasurement { tick: frame.tick, device, value, found });
            components.iter().find(is_none).map_or(Ok(()), lie)
        };
        judge("position", MAX_MAGNITUDE, &told.position_m_measured)?;
        // A hand may leap from any place to any other within a tick.
        judge("velocity", f64::MAX, &told.velocity_m_per_s_estimated)?;
        if told.flags & DEVICE_ORIENTATION_MEASURED != 0 {
            judge("orientation", MAX_MAGNITUDE, &told.orientation_wxyz_measured)?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use bytemuck::Zeroable;

    const PERIOD_NS: u64 = 1_000_000;
    const START_NS: u64 = 1 << 40;

    fn frame(tick: u64, run_tick: i64) -> Frame {
        Frame { tick, run_tick, lease: 1, deadline_ns: START_NS + tick * PERIOD_NS, ..Frame::zeroed() }
    }

    /// After a hundred sound frames, t = 0 in tick 10.
    fn settled() -> (Plausibility, u64) {
        let mut sound = Plausibility::new(PERIOD_NS);
        for tick in 0..100 {
            let now_ns = START_NS + tick * PERIOD_NS;
            sound.judge_tick(tick, now_ns).unwrap();
            sound.judge_frame(tick, &frame(tick, (tick as i64 - 10).max(-1)), true, now_ns).unwrap();
        }
        (sound, START_NS + 99 * PERIOD_NS)
    }

    #[test]
    fn missed_frames_stalls_and_a_new_lease_are_plausible() {
        let (mut sound, now_ns) = settled();
        for (tick, later_ms) in [(150, 51), (99 + 4096, 60), (99 + 4096 + 20_000, 20_000)] {
            sound.judge_tick(tick, now_ns + later_ms * 1_000_000).unwrap();
        }
        // Our lease ends: while its force ramps out the run's time goes on, then there is none.
        let (mut sound, now_ns) = settled();
        for (tick, lease, run_tick) in [(100, 0, 90), (101, 0, -1), (102, 2, -1), (103, 2, 0)] {
            let other = Frame { lease, ..frame(tick, run_tick) };
            assert_eq!(sound.judge_frame(tick, &other, false, now_ns), Ok(()));
        }
    }

    #[test]
    fn ticks_that_go_back_or_jump_are_told_with_found_and_expected() {
        let (mut liar, now_ns) = settled();
        let back = liar.judge_tick(98, now_ns);
        assert_eq!(back, Err(Implausible::Backwards { found: 98, before: 99 }));
        assert_eq!(back.unwrap_err().to_string(), "its ticks go back: found tick 98 after 99, expected more");
        let most = 99 + 2 + 4096;
        let jump = liar.judge_tick(most + 1, now_ns + PERIOD_NS);
        assert_eq!(jump, Err(Implausible::Jump { found: most + 1, before: 99, most }));
        assert!(liar.judge_tick(u64::MAX, now_ns).is_err());
    }

    #[test]
    fn a_frame_that_lies_about_its_tick_its_deadline_or_the_runs_time_is_told() {
        let (mut liar, now_ns) = settled();
        let lies = |liar: &mut Plausibility, frame| liar.judge_frame(100, &frame, true, now_ns).unwrap_err();
        assert!(matches!(lies(&mut liar, frame(7, 90)), Implausible::WrongTick { found: 7, expected: 100 }));
        let future = Frame { deadline_ns: u64::MAX, ..frame(100, 90) };
        assert!(matches!(lies(&mut liar, future), Implausible::Future { most_ms: 1001, .. }));
        for run_tick in [89, 91, -1, i64::MAX, i64::MIN] {
            let expected = Implausible::RunTick { tick: 100, found: run_tick, expected: 90 };
            assert_eq!(lies(&mut liar, frame(100, run_tick)), expected);
        }
    }

    #[test]
    fn a_run_that_is_older_than_its_driver_is_told_at_its_first_frame() {
        let told = |run_tick, is_for_us| {
            let first = frame(100, run_tick);
            let mut liar = Plausibility::new(PERIOD_NS);
            liar.judge_tick(90, first.deadline_ns).unwrap();
            liar.judge_frame(100, &first, is_for_us, first.deadline_ns)
        };
        let too_old = |found, most| Err(Implausible::RunTooOld { tick: 100, found, most });
        assert_eq!(told(i64::MAX, true), too_old(i64::MAX, 10));
        // As if the run were nearly over.
        assert_eq!([told(11, true), told(10, true)], [too_old(11, 10), Ok(())]);
        // Somebody else's may be as old as the driver.
        assert_eq!([told(101, false), told(100, false)], [too_old(101, 100), Ok(())]);
    }

    #[test]
    fn full_authority_without_a_beginning_is_told() {
        let now_ns = START_NS + 100 * PERIOD_NS;
        let judge = |authority, is_for_us| {
            let told = Frame { authority, ..frame(100, -1) };
            Plausibility::new(PERIOD_NS).judge_frame(100, &told, is_for_us, now_ns)
        };
        assert_eq!([judge(0.999, true), judge(1.0, false)], [Ok(()), Ok(())]);
        assert_eq!(judge(1.0, true), Err(Implausible::NotBegun { tick: 100, found: -1 }));
    }

    #[test]
    fn measurements_that_are_no_numbers_are_told_where_they_are_said_to_be_valid() {
        let (sound, now_ns) = settled();
        let judge = |flags, lie: fn(&mut DeviceFrame)| {
            let mut told = Frame { device_count: 2, ..frame(100, 90) };
            told.devices[1].flags = flags;
            lie(&mut told.devices[1]);
            sound.clone().judge_frame(100, &told, true, now_ns).map_err(|lie| lie.to_string())
        };
        let both = DEVICE_POSITION_VALID | DEVICE_ORIENTATION_MEASURED;
        let told = judge(DEVICE_POSITION_VALID, |device| device.position_m_measured[2] = f64::NAN);
        assert!(
            told.is_err_and(|words| words.starts_with("its position of device 1") && words.contains("NaN"))
        );
        assert!(judge(both, |device| device.position_m_measured[0] = -1e300).is_err());
        assert!(judge(both, |device| device.orientation_wxyz_measured[3] = f64::INFINITY).is_err());
        assert!(judge(both, |device| device.velocity_m_per_s_estimated[0] = f64::NAN).is_err());
        assert_eq!(judge(0, |device| device.position_m_measured[2] = f64::NAN), Ok(()));
        assert_eq!(judge(1, |device| device.orientation_wxyz_measured[2] = f64::NAN), Ok(()));
        assert_eq!(judge(both, |device| device.position_m_measured[2] = 1e15), Ok(()));
    }

    #[test]
    fn frames_that_are_never_for_us_end_in_words() {
        let (mut liar, now_ns) = settled();
        let other = Frame { lease: 9, run_tick: -1, ..frame(100, 0) };
        assert_eq!(liar.judge_frame(100, &other, false, now_ns + 9_000_000_000), Ok(()));
        let late = liar.judge_frame(100, &other, false, now_ns + 10_000_000_001);
        assert_eq!(late, Err(Implausible::NoneForUs { seconds: 10 }));
    }
}
