//! What is seen of a driver at one moment.

use crate::meter;
use crate::status::Status;
use rt_core::histogram::Histogram;
use shm_abi::DriverView;
use std::time::Duration;

/// A driver at one moment.
#[derive(Debug, Clone)]
pub(super) struct Look {
    pub(super) status: Status,
    pub(super) latencies: Latencies,
    /// When, on the monitor's clock.
    pub(super) at: Duration,
}

/// Latencies since some moment (ns).
#[derive(Debug, Clone)]
pub(super) struct Latencies {
    pub(super) wake_error: Histogram,
    pub(super) round_trip: Histogram,
    /// The loop's own work in a tick.
    pub(super) work: Histogram,
}

impl Look {
    pub(super) fn at(driver: &DriverView, driver_pid: u64, at: Duration) -> Self {
        let latencies = Latencies {
            wake_error: meter::read(&driver.wake_error_ns),
            round_trip: meter::read(&driver.round_trip_ns),
            work: meter::read(&driver.cycle_ns),
        };
        Self { status: Status::of(driver, driver_pid), latencies, at }
    }
}

impl Latencies {
    /// What was recorded after `before`.
    pub(super) fn since(&self, before: &Self) -> Self {
        Self {
            wake_error: meter::since(&before.wake_error, &self.wake_error),
            round_trip: meter::since(&before.round_trip, &self.round_trip),
            work: meter::since(&before.work, &self.work),
        }
    }
}
