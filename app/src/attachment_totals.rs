//! Totals of a run over its attachments: every driver counts from its own start.
//!
//! Model: what a driver had counted when we attached to it is subtracted from what it has counted when that attachment
//! ends; the differences of all attachments are added up. A driver that died leaves its memory, from which its last counts are
//! read.

use io_driver::meter;
use io_driver::status::{CounterStatus, Percentiles};
use rt_core::histogram::Histogram;
use shm_abi::DriverView;

/// What a driver had counted when an attachment began.
struct Baseline {
    counters: CounterStatus,
    wake_error: Histogram,
    cycle: Histogram,
    round_trip: Histogram,
}

/// What all drivers of a run counted while we were attached to them.
pub struct AttachmentTotals {
    /// Who drove the devices, in the order of their attachments.
    pub drivers: Vec<String>,
    /// Their counters.
    pub counters: CounterStatus,
    wake_error: Histogram,
    cycle: Histogram,
    round_trip: Histogram,
    step: Histogram,
    /// Of the attachment that goes on.
    baseline: Baseline,
}

/// Durations of a run.
pub struct Timing {
    /// How late the driver's loop woke.
    pub wake_error: Percentiles,
    /// The driver's own work in a tick.
    pub cycle: Percentiles,
    /// From frame to reply, seen by the driver.
    pub round_trip: Percentiles,
}

impl Baseline {
    fn of(driver: &DriverView) -> Self {
        Self {
            counters: CounterStatus::of(driver),
            wake_error: meter::read(&driver.wake_error_ns),
            cycle: meter::read(&driver.cycle_ns),
            round_trip: meter::read(&driver.round_trip_ns),
        }
    }
}

impl AttachmentTotals {
    /// Begins with the first attachment, to the driver that is described so.
    pub fn begin(driver: &DriverView, described: String) -> Self {
        Self {
            drivers: vec![described],
            counters: CounterStatus::default(),
            wake_error: Histogram::new(),
            cycle: Histogram::new(),
            round_trip: Histogram::new(),
            step: Histogram::new(),
            baseline: Baseline::of(driver),
        }
    }

    /// Another attachment begins; the one before has ended.
    pub fn go_on(&mut self, driver: &DriverView, described: String) {
        self.baseline = Baseline::of(driver);
        self.drivers.push(described);
    }

    /// The attachment ends: its driver's counts and our own step's durations are added.
    pub fn end(&mut self, driver: &DriverView, step_ns: &Histogram) {
        let (before, now) = (&self.baseline, Baseline::of(driver));
        self.counters = self.counters.plus(&now.counters.since(&before.counters));
        self.wake_error.merge(&meter::since(&before.wake_error, &now.wake_error));
        self.cycle.merge(&meter::since(&before.cycle, &now.cycle));
        self.round_trip.merge(&meter::since(&before.round_trip, &now.round_trip));
        self.step.merge(step_ns);
    }

    /// The durations.
    pub fn timing(&self) -> Timing {
        Timing {
            wake_error: Percentiles::of(&self.wake_error),
            cycle: Percentiles::of(&self.cycle),
            round_trip: Percentiles::of(&self.round_trip),
        }
    }

    /// Those of our own steps.
    pub fn step(&self) -> Percentiles {
        Percentiles::of(&self.step)
    }
}
