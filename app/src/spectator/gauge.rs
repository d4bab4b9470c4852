//! How the driver's loop goes, as its own memory tells.
//!
//! Model: one more observer, whose view of the driver's memory is its own. Ten times a second counters and the histogram of
//! replies are read; what differs from a second before is the last second. A driver that was restarted counts from zero:
//! what was counted before it ended is kept.

use io_driver::meter;
use io_driver::status::CounterStatus;
use rt_core::histogram::Histogram;
use shm_abi::client::{self, Attachment};
use shm_abi::segment::ClockMode;
use std::collections::VecDeque;
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// Between two readings.
const READING: Duration = Duration::from_millis(100);
/// Between two attempts to find a driver that is gone.
const SEARCH: Duration = Duration::from_secs(1);
/// What is told is of so long.
const SPAN: Duration = Duration::from_secs(1);

/// Whoever reads a driver's memory.
pub(super) struct Gauge {
    socket: PathBuf,
    link: Option<Attachment>,
    looked: Option<Instant>,
    last_second: LastSecond,
}

/// What is told of the loop.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Told {
    /// Ticks per second, as they came.
    pub(super) rate_hz: f64,
    /// Deadlines skipped, and ticks not answered in time, since the beginning.
    pub(super) counts: [u64; 2],
    /// From a frame to its reply (ns): median, 99 of 100, worst; `None` on clocks that are not real.
    pub(super) latency_ns: Option<[u64; 3]>,
}

impl Gauge {
    /// Of the driver that listens here.
    pub(super) fn new(socket: PathBuf) -> Self {
        Self { socket, link: None, looked: None, last_second: LastSecond::default() }
    }

    /// The slow side's turn.
    pub(super) fn step(&mut self) {
        let pause = if self.link.is_some() { READING } else { SEARCH };
        if self.looked.is_some_and(|looked| looked.elapsed() < pause) {
            return;
        }
        let now = Instant::now();
        self.looked = Some(now);
        if self.link.as_ref().is_some_and(|link| !link.connection.is_open()) {
            self.link = None;
            self.last_second.part();
        }
        if self.link.is_none() {
            self.link = client::observe(&self.socket, "phantom3 window").ok();
        }
        let Some(Attachment { driver, .. }) = &self.link else { return };
        let counters = CounterStatus::of(driver);
        self.last_second.read(Reading {
            at: now,
            ticks: counters.ticks,
            counts: [counters.overruns, counters.replies_missed],
            round_trip: (driver.info().clock_mode == ClockMode::Real)
                .then(|| meter::read(&driver.round_trip_ns)),
        });
    }

    /// What is so now.
    pub(super) fn told(&self) -> Told {
        self.last_second.told
    }
}

/// A driver at one time.
#[derive(Debug, Clone)]
struct Reading {
    at: Instant,
    ticks: u64,
    counts: [u64; 2],
    round_trip: Option<Histogram>,
}

/// The readings of the last second.
#[derive(Debug, Default)]
struct LastSecond {
    readings: VecDeque<Reading>,
    /// Counts at the first reading of this driver.
    began: Option<[u64; 2]>,
    /// What drivers counted that are gone.
    gone: [u64; 2],
    told: Told,
}

impl LastSecond {
    fn read(&mut self, now: Reading) {
        // The youngest of those that are old enough stays.
        while self.readings.get(1).is_some_and(|second| now.at - second.at >= SPAN) {
            self.readings.pop_front();
        }
        let began = *self.began.get_or_insert(now.counts);
        let counts =
            std::array::from_fn(|which| self.gone[which] + now.counts[which].saturating_sub(began[which]));
        self.told = Told { counts, ..self.told };
        if let Some(then) = self.readings.front() {
            let ticks = now.ticks.saturating_sub(then.ticks) as f64;
            self.told.rate_hz = ticks / (now.at - then.at).as_secs_f64().max(1e-9);
            let both = then.round_trip.as_ref().zip(now.round_trip.as_ref());
            self.told.latency_ns = both.and_then(|(then, now)| of(&meter::since(then, now)));
        }
        self.readings.push_back(now);
    }

    /// The driver is gone.
    fn part(&mut self) {
        self.readings.clear();
        self.began = None;
        self.gone = self.told.counts;
        self.told = Told { counts: self.gone, ..Told::default() };
    }
}

/// Median, 99 of 100, and what none is above; `None` without values.
fn of(histogram: &Histogram) -> Option<[u64; 3]> {
    let [median, most, worst] = [0.5, 0.99, 1.0].map(|share| histogram.percentile(share));
    Some([median?, most?, worst?])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ten a second, each with a hundred ticks more, whose replies took so long (ns).
    struct Driver {
        begun: Instant,
        readings: u64,
        histogram: Histogram,
        counts: [u64; 2],
    }

    impl Driver {
        fn new() -> Self {
            Self { begun: Instant::now(), readings: 0, histogram: Histogram::new(), counts: [0; 2] }
        }

        fn reading(&mut self, ns: u64) -> Reading {
            self.readings += 1;
            (0..100).for_each(|_| self.histogram.record(ns));
            Reading {
                at: self.begun + READING * self.readings as u32,
                ticks: 5_000 + 100 * self.readings,
                counts: self.counts,
                round_trip: Some(self.histogram.clone()),
            }
        }
    }

    #[test]
    fn a_rate_is_that_of_the_last_second() {
        let (mut driver, mut last) = (Driver::new(), LastSecond::default());
        for _ in 0..30 {
            let reading = driver.reading(1000);
            last.read(reading);
        }
        assert!((last.told.rate_hz - 1000.0).abs() < 1e-6, "{:?}", last.told);
        // Half a second without a tick.
        let mut stands = driver.reading(1000);
        stands.ticks -= 100;
        stands.at += Duration::from_millis(400);
        last.read(stands);
        assert!((500.0..700.0).contains(&last.told.rate_hz), "{:?}", last.told);
    }

    #[test]
    fn what_took_long_is_forgotten_after_a_second() {
        let (mut driver, mut last) = (Driver::new(), LastSecond::default());
        // What was before the first reading is of no last second.
        driver.reading(50_000_000);
        for _ in 0..5 {
            let reading = driver.reading(1000);
            last.read(reading);
        }
        let late = driver.reading(9_000_000);
        last.read(late);
        let [median, _, worst] = last.told.latency_ns.expect("told");
        assert!(median < 1100 && (8_000_000..10_000_000).contains(&worst), "{:?}", last.told);
        for _ in 0..12 {
            let reading = driver.reading(1000);
            last.read(reading);
        }
        assert!(last.told.latency_ns.expect("told").iter().all(|ns| *ns < 1100), "{:?}", last.told);
    }

    #[test]
    fn counts_begin_with_the_run_and_go_on_with_another_driver() {
        let (mut driver, mut last) = (Driver::new(), LastSecond::default());
        driver.counts = [7, 70];
        let first = driver.reading(1000);
        last.read(first);
        assert_eq!(last.told.counts, [0, 0], "they were before");
        driver.counts = [9, 75];
        let second = driver.reading(1000);
        last.read(second);
        assert_eq!(last.told.counts, [2, 5]);
        last.part();
        assert_eq!(last.told, Told { counts: [2, 5], ..Told::default() });
        let mut other = Driver::new();
        let first = other.reading(1000);
        last.read(first);
        other.counts = [1, 1];
        let second = other.reading(1000);
        last.read(second);
        assert_eq!(last.told.counts, [3, 6]);
    }

    #[test]
    fn nothing_is_told_of_latencies_where_time_is_not_real() {
        let (mut driver, mut last) = (Driver::new(), LastSecond::default());
        for _ in 0..3 {
            let reading = Reading { round_trip: None, ..driver.reading(1000) };
            last.read(reading);
        }
        assert_eq!(last.told.latency_ns, None);
    }
}
