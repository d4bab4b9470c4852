//! Every frame of a driver's ring, read from outside.
//!
//! Model: polled well within the ring's length. Tick by tick from the last one seen to the newest: a frame that
//! is there is measured; a slot that still holds an older frame was skipped by the driver; one that is overwritten
//! or torn is lost to this observer, counted and told. What only the driver's histograms know
//! (wake error, its own work) comes as the differences between two polls.
//! Invariants: read-only; nothing here makes the driver do anything. Every tick between the first and the last
//! is exactly one of seen, skipped, lost.
//! Worst case: the ring's 4096 frames a poll, some milliseconds.

use crate::jitter::bank::{Bank, Sample};
use crate::jitter::circumstances::{Circumstances, Subject, Watch};
use crate::jitter::metric::{Metric, Style};
use bytemuck::Zeroable;
use io_driver::meter;
use io_driver::status::CounterStatus;
use rt_core::histogram::{BUCKETS, Histogram, bucket_upper};
use shm_abi::layout::RING_FRAMES;
use shm_abi::segment::FrameUnavailable;
use shm_abi::{DriverView, Frame, Outcome, ReplyKind};

/// A torn frame is read again so often: the driver was just writing it.
const TRIES: usize = 4;
/// Commands older than so many ticks drive no motor.
const REMEMBERED: usize = 128;

/// An observer in the middle of a slice.
#[derive(Debug)]
pub struct Observer {
    view: DriverView,
    period_ns: u64,
    next: u64,
    previous: Option<Seen>,
    /// When the encoders of the last ticks were read, by tick modulo its length.
    reads: Box<[Seen; REMEMBERED]>,
    counters: CounterStatus,
    wake: Histogram,
    cycle: Histogram,
    watches: Watches,
}

/// The threads whose misfortunes explain an event.
#[derive(Debug)]
pub struct Watches {
    driver: Watch,
    fast: Option<Watch>,
}

#[derive(Debug, Clone, Copy, Default)]
struct Seen {
    tick: u64,
    read_ns: u64,
}

impl Observer {
    /// Begins with the next frame.
    pub fn new(view: DriverView, driver: Subject, fast: Option<Subject>) -> Self {
        let period_ns = view.info().period_ns;
        let next = view.latest_tick().map_or(0, |tick| tick + 1);
        let (wake, cycle) = (meter::read(&view.wake_error_ns), meter::read(&view.cycle_ns));
        let counters = CounterStatus::of(&view);
        let watches = Watches { driver: Watch::new(driver), fast: fast.map(Watch::new) };
        let reads = Box::new([Seen::default(); REMEMBERED]);
        Self { view, period_ns, next, previous: None, reads, counters, wake, cycle, watches }
    }

    /// The driver's memory.
    pub fn view(&self) -> &DriverView {
        &self.view
    }

    /// Measures all that has come since the last call.
    pub fn poll(&mut self, bank: &mut Bank) {
        let latest = self.view.latest_tick();
        self.watches.look();
        if let Some(latest) = latest {
            self.read_up_to(latest, bank);
        }
        self.read_histograms(bank);
        self.read_counters(bank);
    }

    fn read_up_to(&mut self, latest: u64, bank: &mut Bank) {
        let oldest = (latest + 1).saturating_sub(RING_FRAMES as u64);
        if self.next < oldest {
            self.lose(oldest - self.next, bank);
            self.next = oldest;
        }
        let mut frame = Frame::zeroed();
        while self.next <= latest {
            match self.read(self.next, &mut frame) {
                Ok(()) => self.measure(&frame, bank),
                // The newest tick is there, so this one will not come any more.
                Err(FrameUnavailable::NotYet(_)) => bank.count(Style::Driver, "ticks_skipped", 1),
                Err(FrameUnavailable::Overwritten(_) | FrameUnavailable::Torn(_)) => self.lose(1, bank),
            }
            self.next += 1;
        }
    }

    fn read(&self, tick: u64, frame: &mut Frame) -> Result<(), FrameUnavailable> {
        let mut found = self.view.read_frame(tick, frame);
        for _ in 1..TRIES {
            if !matches!(found, Err(FrameUnavailable::Torn(_))) {
                break;
            }
            found = self.view.read_frame(tick, frame);
        }
        found
    }

    fn lose(&mut self, frames: u64, bank: &mut Bank) {
        bank.count(Style::Driver, "frames_lost", frames);
        self.previous = None;
    }

    fn measure(&mut self, frame: &Frame, bank: &mut Bank) {
        bank.count(Style::Driver, "frames_seen", 1);
        // Deadlines that passed unserved before this frame delay it as well.
        let skipped = self.previous.map_or(0, |previous| frame.tick.saturating_sub(previous.tick + 1));
        let due_ns = frame.deadline_ns.saturating_sub(skipped.saturating_mul(self.period_ns));
        let late_ns = frame.read_ns.saturating_sub(due_ns);
        self.put(Metric::DeadlineToRead, frame.tick, due_ns, late_ns, bank);
        if let Some(previous) = self.previous {
            self.measure_outcome(previous, &frame.previous, bank);
        }
        let seen = Seen { tick: frame.tick, read_ns: frame.read_ns };
        self.reads[frame.tick as usize % REMEMBERED] = seen;
        self.previous = Some(seen);
    }

    /// `outcome` is that of the frame before, which was `seen`.
    fn measure_outcome(&self, seen: Seen, outcome: &Outcome, bank: &mut Bank) {
        let Some(reply) = ReplyKind::from_word(outcome.reply).filter(|reply| *reply != ReplyKind::NoLease)
        else {
            return bank.count(Style::Driver, "frames_without_lease", 1);
        };
        let reply_name = match reply {
            ReplyKind::NoLease | ReplyKind::Fresh => "frames_answered",
            ReplyKind::Held => "frames_held",
            ReplyKind::Expired => "frames_expired",
        };
        bank.count(Style::Driver, reply_name, 1);
        if reply == ReplyKind::Fresh && outcome.round_trip_ns > 0 {
            self.put(Metric::RoundTrip, seen.tick, seen.read_ns, outcome.round_trip_ns, bank);
        }
        let taken_ns = outcome.written_ns.saturating_sub(seen.read_ns);
        self.put(Metric::EndToEnd, seen.tick, seen.read_ns, taken_ns, bank);
        let source = self.reads[outcome.command_tick as usize % REMEMBERED];
        if outcome.authority > 0.0 && source.tick == outcome.command_tick && source.read_ns > 0 {
            let age_ns = outcome.written_ns.saturating_sub(source.read_ns);
            self.put(Metric::ForceAge, seen.tick, source.read_ns, age_ns, bank);
        }
    }

    fn put(&self, metric: Metric, tick: u64, from_ns: u64, value_ns: u64, bank: &mut Bank) {
        let sample = Sample { tick, from_ns, value_ns };
        bank.record(metric, sample, || self.watches.around(from_ns, from_ns.saturating_add(value_ns)));
    }

    fn read_histograms(&mut self, bank: &mut Bank) {
        let now = rt_core::clock::monotonic_ns();
        let (wake, cycle) = (meter::read(&self.view.wake_error_ns), meter::read(&self.view.cycle_ns));
        bank.merge(Metric::DriverWake, now, &since(&self.wake, &wake));
        bank.merge(Metric::Cycle, now, &since(&self.cycle, &cycle));
        (self.wake, self.cycle) = (wake, cycle);
    }

    fn read_counters(&mut self, bank: &mut Bank) {
        let now = CounterStatus::of(&self.view);
        let more = now.since(&self.counters);
        self.counters = now;
        let named = [
            ("ticks", more.ticks),
            ("overruns", more.overruns),
            ("replies_fresh", more.replies_fresh),
            ("replies_missed", more.replies_missed),
            ("commands_torn", more.commands_torn),
            ("commands_refused", more.commands_refused),
            ("faults", more.faults),
        ];
        named.into_iter().for_each(|(name, more)| bank.count(Style::Driver, name, more));
    }
}

impl Watches {
    fn look(&mut self) {
        self.driver.look();
        self.fast.iter_mut().for_each(Watch::look);
    }

    /// The driver's loop's circumstances, with the fast thread's as a remark.
    fn around(&self, from_ns: u64, to_ns: u64) -> Circumstances {
        let mut found = self.driver.around(from_ns, to_ns);
        if let Some(fast) = &self.fast {
            let theirs = fast.around(from_ns, to_ns);
            let cpu = theirs.cpu.map_or_else(String::new, |cpu| format!(" on CPU {cpu}"));
            found.remarks.push(format!("fast thread{cpu}: {}", theirs.what_stands_out()));
        }
        found
    }
}

/// What was counted between two readings. The greatest is exact if it is a new one, else its bucket's upper end.
fn since(before: &Histogram, after: &Histogram) -> Histogram {
    let mut counts = Box::new([0; BUCKETS]);
    for (count, (new, old)) in counts.iter_mut().zip(after.counts().iter().zip(before.counts())) {
        *count = new.saturating_sub(*old);
    }
    let highest = counts.iter().rposition(|count| *count > 0);
    let max = match highest {
        None => 0,
        Some(_) if after.max() > before.max() => after.max(),
        Some(bucket) => bucket_upper(bucket).min(after.max()),
    };
    Histogram::from_counts(&counts, max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::jitter::origin::Origin;
    use shm_abi::DriverMemory;
    use shm_abi::doorbell::WaitMode;
    use shm_abi::segment::{ClockMode, DriverInfo};
    use std::os::fd::AsFd;

    const MS: u64 = 1_000_000;

    fn info() -> DriverInfo {
        DriverInfo {
            period_ns: MS,
            reply_budget_ns: MS / 2,
            max_command_age_ticks: 5,
            ramp_in_ticks: 1,
            ramp_out_ticks: 1,
            clock_mode: ClockMode::Real,
            wait_mode: WaitMode::Futex,
            is_commissioning: false,
            cpu: None,
            devices: Vec::new(),
            setup_report: String::new(),
        }
    }

    /// A driver that this test plays, and what looks at it.
    struct Stage {
        memory: DriverMemory,
        observer: Observer,
        bank: Bank,
    }

    impl Stage {
        fn new() -> Self {
            let memory = DriverMemory::create(&info()).unwrap();
            let view = DriverView::map(memory.fd().as_fd()).unwrap();
            let subject = Subject { pid: std::process::id(), tid: std::process::id(), cpu: None };
            Self { memory, observer: Observer::new(view, subject, None), bank: Bank::new(Origin::now(), 3) }
        }

        /// Tick `tick` read 7 us after its deadline; the one before written 40 us after its reading.
        fn tick(&self, tick: u64, before: u64, reply: ReplyKind, command_tick: u64) {
            let mut frame = Frame::zeroed();
            (frame.tick, frame.deadline_ns, frame.read_ns) = (tick, tick * MS, tick * MS + 7_000);
            frame.previous = Outcome {
                reply: reply as u64,
                command_tick,
                authority: 1.0,
                round_trip_ns: if reply == ReplyKind::Fresh { 5_000 } else { 0 },
                written_ns: before * MS + 47_000,
            };
            self.memory.write_frame(&frame);
            self.memory.ring(tick, None);
        }

        fn count(&self, name: &str) -> u64 {
            self.bank.counters()[&Style::Driver].get(name).copied().unwrap_or(0)
        }

        fn max(&self, metric: Metric) -> (u64, u64) {
            self.bank
                .series()
                .get(&metric)
                .map_or((0, 0), |series| (series.total.count(), series.total.max()))
        }
    }

    #[test]
    fn every_frame_is_measured_against_the_one_before() {
        let mut stage = Stage::new();
        (1..=10).for_each(|tick| stage.tick(tick, tick - 1, ReplyKind::Fresh, tick - 1));
        stage.observer.poll(&mut stage.bank);
        assert_eq!(stage.count("frames_seen"), 10);
        // The slot of tick 0 was never written.
        assert_eq!((stage.count("ticks_skipped"), stage.count("frames_lost")), (1, 0));
        assert_eq!(stage.max(Metric::DeadlineToRead), (10, 7_000));
        assert_eq!(stage.max(Metric::EndToEnd), (9, 40_000));
        assert_eq!(stage.max(Metric::RoundTrip), (9, 5_000));
        assert_eq!(stage.max(Metric::ForceAge), (9, 40_000));
    }

    #[test]
    fn a_skipped_deadline_counts_as_lateness_and_a_held_command_as_age() {
        let mut stage = Stage::new();
        stage.tick(1, 0, ReplyKind::NoLease, 0);
        stage.tick(2, 1, ReplyKind::Fresh, 1);
        // Tick 2 used the command for tick 1; ticks 3 and 4 were slept through.
        stage.tick(5, 2, ReplyKind::Held, 1);
        stage.observer.poll(&mut stage.bank);
        assert_eq!(stage.max(Metric::DeadlineToRead).1, 2 * MS + 7_000);
        assert_eq!(stage.count("ticks_skipped"), 3, "0, 3 and 4");
        assert_eq!(stage.max(Metric::RoundTrip), (1, 5_000), "a held command is no reply");
        assert_eq!(stage.max(Metric::ForceAge), (2, MS + 40_000));
        let worst = &stage.bank.series()[&Metric::DeadlineToRead].worst;
        assert_eq!(worst.events()[0].tick, Some(5));
    }

    #[test]
    fn frames_that_the_ring_has_overwritten_are_counted_as_lost() {
        let mut stage = Stage::new();
        let last = RING_FRAMES as u64 + 100;
        (1..=last).for_each(|tick| stage.tick(tick, tick - 1, ReplyKind::Fresh, tick - 1));
        stage.observer.poll(&mut stage.bank);
        assert_eq!(stage.count("frames_seen"), RING_FRAMES as u64);
        assert_eq!(stage.count("frames_lost"), 101, "0 to 100");
        // The oldest frame's outcome belongs to one that was lost.
        assert_eq!(stage.max(Metric::EndToEnd).0, RING_FRAMES as u64 - 1);
        let sum: u64 =
            ["frames_seen", "frames_lost", "ticks_skipped"].map(|name| stage.count(name)).iter().sum();
        assert_eq!(sum, last + 1);
    }

    #[test]
    fn the_greatest_of_an_interval_is_not_that_of_the_past() {
        let mut before = Histogram::new();
        before.record(1_000_000);
        let mut after = before.clone();
        after.record(100);
        let found = since(&before, &after);
        assert_eq!((found.count(), found.max()), (1, 101), "the bucket of 100 ends at 101");
        after.record(2_000_001);
        assert_eq!(since(&before, &after).max(), 2_000_001);
        assert_eq!(since(&after, &after).max(), 0);
    }
}
