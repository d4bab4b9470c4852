//! Plausibility of a driver's frames, from one to the next.
//!
//! Problem: what the driver writes is an allegation. A driver that is broken, or is none, must not make a run wait for
//! ever or count wrongly: ticks that go back, jump ahead or hardly go on, deadlines in the future, a time of the run that
//! does not go with the ticks, or never begins, frames that are never meant for us, devices that are missing, positions
//! that are no places, forces that are none.
//!
//! Model: ticks go up, and not faster than the clock allows, with room for a ring of them; in real time not slower either:
//! a driver that is late, or was stopped, skips what it missed, so that its next number is that of the clock again. Within
//! one lease t = 0 comes when this program's answers have brought full authority, so not before its first frame and not
//! after authority is full; from there on the time of the run goes with the ticks; a frame is due when it is published;
//! what is measured is finite, and no velocity larger than a leap from one end of all places to the other. Everything else
//! that is rare, such as missed frames, overruns and stalls of the machine, keeps to these.
//!
//! Cost: a dozen comparisons a frame; no allocation, no system call.

use io_driver::table::MAX_MAGNITUDE;
use shm_abi::frame::{DEVICE_ORIENTATION_MEASURED, DEVICE_POSITION_VALID};
use shm_abi::segment::ClockMode;
use shm_abi::{DeviceFrame, DriverState, Frame, RING_FRAMES};
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
    /// It stays behind what time asks for.
    #[error(
        "its ticks fall behind the clock: found {found} ticks in {seconds} s, expected {expected}, less those of {most_s} s \
         at most"
    )]
    Slow {
        /// Ticks that there were.
        found: u64,
        /// In so many seconds.
        seconds: u64,
        /// Ticks of that time.
        expected: u64,
        /// By how much it may be behind.
        most_s: u64,
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
        "its frame of tick {tick} comes from the future: it is due in {ahead_ms} ms, expected {most_ms} ms at most \
         (across time namespaces, `unshare -T`, clocks differ)"
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
        "its {value} of device {device} is said to be valid in tick {tick} and is none: found {found:?}, expected finite \
         numbers up to {most:e} in size"
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
        /// The largest that can be.
        most: f64,
    },
    /// Devices that the run uses are not in the frame.
    #[error("it tells of too few devices, expected {used} at least: found {found} in tick {tick}")]
    TooFew {
        /// The tick.
        tick: u64,
        /// Devices in the frame.
        found: u64,
        /// Devices that are used.
        used: usize,
    },
    /// A part of the force that is none.
    #[error("its authority is none: found {found:?} in tick {tick}, expected 0 to 1")]
    NoAuthority {
        /// The tick.
        tick: u64,
        /// What was found.
        found: f64,
    },
    /// A state that nobody knows.
    #[error("its state is none that there is: found {found} in tick {tick}, expected 0 to {most}")]
    NoState {
        /// The tick.
        tick: u64,
        /// The word found.
        found: u64,
        /// The last that is known.
        most: u64,
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

/// Lag of ticks behind the clock that is allowed (ns): twice the silence after which a run ends, and so twice the lateness
/// that a single frame of a driver that is stopped again and again, or halts at a breakpoint in each tick, can have.
const BEHIND_NS: u64 = 10_000_000_000;
/// And a hundredth of the time that has passed: deadlines that step aside ([`rt_core::phase_keeper`]) stay behind by 0.382
/// of a period in 256 at most, 0.15 %.
const BEHIND_SHARE: u64 = 100;
/// For so long, and in so many frames on end. A stall of driver and application together, of any length, makes one frame
/// late, and as many more as the driver is set to catch up, which come in one go.
const BEHIND_FOR_NS: u64 = 1_000_000_000;
const BEHIND_FRAMES: u64 = 3;

/// What the frames so far were like.
#[derive(Debug, Clone, Copy)]
pub struct Plausibility {
    period_ns: u64,
    /// The tick seen first: no answer of ours is older.
    first: Option<u64>,
    /// The tick seen last, and when.
    last: Option<(u64, u64)>,
    /// Ticks go with the clock.
    is_real: bool,
    /// The tick that came soonest for its number, and its time.
    soonest: Option<(u64, u64)>,
    /// Since when ticks are too far behind, and in how many frames.
    behind: Option<(u64, u64)>,
    /// In which tick our lease's t = 0 was.
    run_began: Option<i64>,
    /// When a frame was answered last.
    answered_ns: Option<u64>,
}

impl Plausibility {
    /// Of a driver with this period and clock, which has told nothing yet.
    pub fn new(period_ns: u64, clock: ClockMode) -> Self {
        Self {
            period_ns: period_ns.max(1),
            first: None,
            last: None,
            is_real: clock == ClockMode::Real,
            soonest: None,
            behind: None,
            run_began: None,
            answered_ns: None,
        }
    }

    /// Judges the number of the newest frame, before that is read.
    ///
    /// # Errors
    /// If it goes back, jumps ahead of the clock or stays behind it.
    pub fn judge_tick(&mut self, tick: u64, now_ns: u64) -> Result<(), Implausible> {
        if let Some((before, seen_ns)) = self.last {
            let passed = now_ns.saturating_sub(seen_ns) / self.period_ns;
            // A loop that catches up makes several ticks in the time of one.
            let most = before.saturating_add(passed.saturating_mul(2)).max(self.of_the_clock(now_ns));
            let most = most.saturating_add(RING_FRAMES as u64);
            if tick < before {
                return Err(Implausible::Backwards { found: tick, before });
            }
            if tick > most {
                return Err(Implausible::Jump { found: tick, before, most });
            }
        }
        self.first.get_or_insert(tick);
        self.last = Some((tick, now_ns));
        if self.is_real { self.judge_pace(tick, now_ns) } else { Ok(()) }
    }

    /// The tick of now in real time, else none: a loop that was stopped in the middle of one tick is there with the next.
    fn of_the_clock(&self, now_ns: u64) -> u64 {
        self.soonest
            .map_or(0, |(tick, seen_ns)| tick.saturating_add(now_ns.saturating_sub(seen_ns) / self.period_ns))
    }

    /// Ticks are late, each by another time; the one that was late least shows how clock and numbers go together.
    fn judge_pace(&mut self, tick: u64, now_ns: u64) -> Result<(), Implausible> {
        let (soonest, seen_ns) = *self.soonest.get_or_insert((tick, now_ns));
        let passed_ns = now_ns.saturating_sub(seen_ns);
        let ticks_ns = (tick - soonest).saturating_mul(self.period_ns);
        if ticks_ns >= passed_ns {
            self.soonest = Some((tick, now_ns));
        }
        let most_ns = BEHIND_NS + passed_ns / BEHIND_SHARE;
        if passed_ns.saturating_sub(ticks_ns) <= most_ns {
            self.behind = None;
            return Ok(());
        }
        let (since_ns, frames) = self.behind.map_or((now_ns, 1), |(since_ns, frames)| (since_ns, frames + 1));
        self.behind = Some((since_ns, frames));
        if frames < BEHIND_FRAMES || now_ns.saturating_sub(since_ns) < BEHIND_FOR_NS {
            return Ok(());
        }
        Err(Implausible::Slow {
            found: tick - soonest,
            seconds: passed_ns / 1_000_000_000,
            expected: passed_ns / self.period_ns,
            most_s: most_ns / 1_000_000_000,
        })
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
        judge_state(frame)?;
        self.judge_run(tick, frame, is_for_us)?;
        judge_forces(frame)?;
        if is_for_us {
            self.judge_measurements(frame)?;
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

    /// Of the devices that say that they know where they are.
    fn judge_measurements(&self, frame: &Frame) -> Result<(), Implausible> {
        let knows_its_place = |(_, told): &(usize, &DeviceFrame)| told.flags & DEVICE_POSITION_VALID != 0;
        // A hand may leap from any place to any other within a tick: twice the largest number along each axis, which a
        // base that is turned makes the square root of three times as much.
        let leap_m_per_s = 4.0 * MAX_MAGNITUDE / (self.period_ns as f64 * 1e-9);
        for (device, told) in frame.present_devices().iter().enumerate().filter(knows_its_place) {
            let of = |value| (frame.tick, device, value);
            judge_value(of("position"), MAX_MAGNITUDE, &told.position_m_measured)?;
            judge_value(of("velocity"), leap_m_per_s, &told.velocity_m_per_s_estimated)?;
            if told.flags & DEVICE_ORIENTATION_MEASURED != 0 {
                judge_value(of("orientation"), MAX_MAGNITUDE, &told.orientation_wxyz_measured)?;
            }
        }
        Ok(())
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

/// Refuses a frame that does not tell of all devices that are used.
///
/// # Errors
/// If not.
pub fn judge_devices(frame: &Frame, used: usize) -> Result<(), Implausible> {
    match frame.device_count {
        found if found >= used as u64 => Ok(()),
        found => Err(Implausible::TooFew { tick: frame.tick, found, used }),
    }
}

fn judge_state(frame: &Frame) -> Result<(), Implausible> {
    let (tick, state) = (frame.tick, frame.state);
    if DriverState::from_word(state).is_none() {
        return Err(Implausible::NoState { tick, found: state, most: DriverState::Fault as u64 });
    }
    if !(0.0..=1.0).contains(&frame.authority) {
        return Err(Implausible::NoAuthority { tick, found: frame.authority });
    }
    Ok(())
}

/// Of all devices: recordings and reports tell what was applied, whoever commands.
fn judge_forces(frame: &Frame) -> Result<(), Implausible> {
    let mut told = frame.present_devices().iter().enumerate();
    told.try_for_each(|(device, told)| {
        judge_value((frame.tick, device, "applied force"), f64::MAX, &told.force_on_user_n_applied)
    })
}

fn judge_value(
    (tick, device, value): (u64, usize, &'static str),
    most: f64,
    components: &[f64],
) -> Result<(), Implausible> {
    let is_none = |component: &&f64| component.is_nan() || component.abs() > most;
    let lie = |&found| Err(Implausible::NoMeasurement { tick, device, value, found, most });
    components.iter().find(is_none).map_or(Ok(()), lie)
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
        let mut sound = Plausibility::new(PERIOD_NS, ClockMode::Real);
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

    const S: u64 = 1_000_000_000;

    /// When a driver whose ticks come `apart_ns` apart, and have the numbers of `number`, is told.
    fn told_after(
        clock: ClockMode,
        apart_ns: u64,
        number: impl Fn(u64) -> u64,
    ) -> Option<(u64, Implausible)> {
        let mut judge = Plausibility::new(PERIOD_NS, clock);
        let mut frames = (0..1000 * S).step_by(apart_ns as usize).zip(0..100_000);
        frames.find_map(|(later_ns, frame)| {
            Some((later_ns, judge.judge_tick(number(frame), START_NS + later_ns).err()?))
        })
    }

    #[test]
    fn ticks_that_stay_behind_the_clock_are_told() {
        // 1 ms is told, and each takes 4.5 s: the third that is 10 s late.
        let (when_ns, told) = told_after(ClockMode::Real, 4_500_000_000, |frame| frame).expect("a lie");
        assert_eq!(when_ns, 5 * 4_500_000_000);
        assert_eq!(told, Implausible::Slow { found: 5, seconds: 22, expected: 22_500, most_s: 10 });
        assert!(
            told.to_string()
                .starts_with("its ticks fall behind the clock: found 5 ticks in 22 s, expected 22500")
        );
        // Half as fast as told: 10 s and a hundredth behind after 20.4 s, and a second more.
        let (when_ns, _) = told_after(ClockMode::Real, 2 * PERIOD_NS, |frame| frame).expect("a lie");
        assert!((21 * S..22 * S).contains(&when_ns), "{when_ns}");
        // Nobody's clock moves them there.
        assert_eq!(told_after(ClockMode::Lockstep, 4_500_000_000, |frame| frame), None);
    }

    #[test]
    fn ticks_that_are_late_and_go_with_the_clock_again_are_plausible() {
        // Each frame 4 s late, as at a breakpoint; its number is that of its deadline.
        assert_eq!(told_after(ClockMode::Real, 4 * S, |frame| (4000 * frame).saturating_sub(4000)), None);
        // Deadlines that step aside as often as they may: 0.382 of 256.
        assert_eq!(told_after(ClockMode::Real, 1_001_492, |frame| frame), None);
        // Driver and application are stopped for an hour, ten times; then come the tick that was under way, the last
        // thousand of the clock, made up for within half a second, and those that follow.
        let mut sound = Plausibility::new(PERIOD_NS, ClockMode::Real);
        let (mut tick, mut now_ns) = (0, START_NS);
        assert_eq!(sound.judge_tick(tick, now_ns), Ok(()));
        for _ in 0..10 {
            now_ns += 3600 * S;
            assert_eq!(sound.judge_tick(tick + 1, now_ns), Ok(()));
            tick = (now_ns - START_NS) / PERIOD_NS;
            for made_up in 0..1000 {
                let number = tick + made_up - 999;
                assert_eq!(sound.judge_tick(number, now_ns + made_up * 500_000), Ok(()), "{number}");
            }
            for later in 500..5000 {
                assert_eq!(sound.judge_tick(tick + later, now_ns + later * PERIOD_NS), Ok(()));
            }
            (tick, now_ns) = (tick + 4999, now_ns + 4999 * PERIOD_NS);
        }
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
            let mut liar = Plausibility::new(PERIOD_NS, ClockMode::Real);
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
            Plausibility::new(PERIOD_NS, ClockMode::Real).judge_frame(100, &told, is_for_us, now_ns)
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
        // From one end to the other within a millisecond, and beyond.
        assert_eq!(judge(both, |device| device.velocity_m_per_s_estimated[0] = -2e18), Ok(()));
        let told = judge(both, |device| device.velocity_m_per_s_estimated[0] = 1e300).unwrap_err();
        assert!(told.ends_with("found 1e300, expected finite numbers up to 4e18 in size"), "{told}");
        assert!(judge(0, |device| device.force_on_user_n_applied[1] = f64::INFINITY).is_err());
        assert_eq!(judge(0, |device| device.position_m_measured[2] = f64::NAN), Ok(()));
        assert_eq!(judge(1, |device| device.orientation_wxyz_measured[2] = f64::NAN), Ok(()));
        assert_eq!(judge(both, |device| device.position_m_measured[2] = 1e15), Ok(()));
    }

    #[test]
    fn a_state_an_authority_or_a_number_of_devices_that_cannot_be_is_told() {
        let (sound, now_ns) = settled();
        let judge = |lie: fn(&mut Frame)| {
            let mut told = frame(100, 90);
            lie(&mut told);
            sound.clone().judge_frame(100, &told, true, now_ns)
        };
        assert_eq!(judge(|frame| (frame.state, frame.authority) = (4, 1.0)), Ok(()));
        let state = judge(|frame| frame.state = 5);
        assert_eq!(state, Err(Implausible::NoState { tick: 100, found: 5, most: 4 }));
        for authority in [f64::NAN, -0.01, 1.01, f64::INFINITY] {
            let mut told = frame(100, 90);
            told.authority = authority;
            let lie = sound.clone().judge_frame(100, &told, true, now_ns);
            assert!(matches!(lie, Err(Implausible::NoAuthority { tick: 100, .. })), "{authority}: {lie:?}");
        }
        let two = Frame { device_count: 2, ..frame(100, 90) };
        assert_eq!([judge_devices(&two, 0), judge_devices(&two, 2)], [Ok(()), Ok(())]);
        assert_eq!(judge_devices(&two, 3), Err(Implausible::TooFew { tick: 100, found: 2, used: 3 }));
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
