//! Devices that are where a recording has the fingers.
//!
//! Model: in each tick of the run a device tells what the recording's row of that tick tells: HIP, velocity, orientation
//! and buttons, in the world frame, its base being the world's origin; so every number passes bit for bit. Before t = 0
//! it rests where the first row has it. A table has no velocities: they are the differences of positions then, as an
//! ideal device has them. Whatever force is asked for is rendered.
//! Rows that were missing when it was recorded are missed again ([`Feed::is_missing`]): time goes on without an answer.
//! Damage is the end: what is whole before it is played, to its last row.

use crate::record::read::{ReadError, RecordedRun};
use crate::row::{BodyRow, FingerRow, Row};
use io_driver::device::{Device, Effort, Extras, Reading, TickTime, Written};
use io_driver::safety::Restrained;
use io_driver::velocity::VelocityEstimator;
use nalgebra::Vector3;
use shm_abi::FaultReason;
use shm_abi::segment::DeviceInfo;
use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Whoever has interrupted a replay waits no longer for the number of its rows.
const LONGEST_COUNT: Duration = Duration::from_secs(2);

/// A recording at the tick that is being played.
pub(super) struct Feed {
    pub(super) recorded: RecordedRun,
    /// The newest row that is not later than the tick; before t = 0 the first.
    current: Row,
    next: Option<(Row, Vec<BodyRow>)>,
    /// Rows that were reached, for comparing.
    pub(super) reached: VecDeque<(Row, Vec<BodyRow>)>,
    run_tick: i64,
    /// What ended the reading.
    pub(super) failure: Option<ReadError>,
}

/// Shared by all devices.
pub(super) type SharedFeed = Arc<Mutex<Feed>>;

impl Feed {
    /// At the beginning.
    ///
    /// # Errors
    /// If the first row cannot be read.
    pub(super) fn new(mut recorded: RecordedRun) -> Result<Self, ReadError> {
        let next = recorded.next_row()?;
        let current = next.as_ref().map_or_else(Row::empty, |(row, _)| *row);
        Ok(Self { recorded, current, next, reached: VecDeque::new(), run_tick: -1, failure: None })
    }

    /// Whether it has a row at all.
    pub(super) fn is_empty(&self) -> bool {
        self.next.is_none() && self.run_tick < 0
    }

    /// Whether the last row was reached.
    pub(super) fn is_over(&self) -> bool {
        self.next.is_none()
    }

    /// Of the row that is reached, which at the beginning is the first.
    pub(super) fn first_tick(&self) -> u64 {
        self.current.run_tick
    }

    /// Whether the first row is still to come.
    pub(super) fn is_before_first(&self) -> bool {
        self.next.as_ref().is_some_and(|(row, _)| *row == self.current)
    }

    /// Whether a row of the tick that was gone to last is missing between others.
    pub(super) fn is_missing(&self) -> bool {
        self.run_tick >= 0 && self.next.is_some() && self.current.run_tick.cast_signed() != self.run_tick
    }

    fn go_to(&mut self, run_tick: i64) {
        self.run_tick = run_tick;
        while let Some((row, bodies)) = self.next.take_if(|(row, _)| row.run_tick.cast_signed() <= run_tick) {
            self.current = row;
            self.reached.push_back((row, bodies));
            match self.recorded.next_row() {
                Ok(next) => self.next = next,
                Err(error) => self.failure = Some(error),
            }
        }
    }

    /// Number of rows that were not compared yet, in words, with those that were. A large recording is not read to its end for
    /// that.
    pub(super) fn count_with(&mut self, compared: u64) -> String {
        let mut rows = compared + self.reached.len() as u64 + u64::from(self.next.is_some());
        let begun = Instant::now();
        while self.failure.is_none() && matches!(self.recorded.next_row(), Ok(Some(_))) {
            rows += 1;
            if begun.elapsed() > LONGEST_COUNT {
                return format!("more than {rows}");
            }
        }
        rows.to_string()
    }
}

/// A device that plays one finger.
pub(super) struct ReplayedDevice {
    info: DeviceInfo,
    feed: SharedFeed,
    /// The finger in the recording; `None`: it is in none, and rests.
    finger: Option<usize>,
    resting_at: Vector3<f64>,
    extras: Extras,
    /// Where the recording has no velocities.
    velocity: Option<VelocityEstimator>,
}

impl ReplayedDevice {
    /// A device that plays a finger of the recording, or rests.
    pub(super) fn new(
        name: &str,
        feed: &SharedFeed,
        finger: Option<usize>,
        resting_at: Vector3<f64>,
    ) -> Self {
        let held = feed.lock().unwrap_or_else(PoisonError::into_inner);
        let extras = finger.map(|finger| held.recorded.names().extras_of(finger)).unwrap_or_default();
        let velocity = (!held.recorded.has_velocities()).then(VelocityEstimator::of_exact_places);
        let info = DeviceInfo {
            name: name.into(),
            kind: "recorded".into(),
            peak_force_n: f64::INFINITY,
            continuous_force_n: f64::INFINITY,
            workspace_min_m: [f64::NEG_INFINITY; 3],
            workspace_max_m: [f64::INFINITY; 3],
            slew_n_per_s: f64::INFINITY,
            speed_limit_m_per_s: f64::INFINITY,
        };
        Self { info, feed: feed.clone(), finger, resting_at, extras, velocity }
    }
}

impl Device for ReplayedDevice {
    fn info(&self) -> &DeviceInfo {
        &self.info
    }

    fn read(&mut self, time: TickTime) -> Result<Reading, FaultReason> {
        let row = {
            let mut feed = self.feed.lock().unwrap_or_else(PoisonError::into_inner);
            feed.go_to(time.run_tick);
            let resting = FingerRow { hip: self.resting_at, ..FingerRow::default() };
            self.finger.map_or(resting, |finger| feed.current.fingers[finger])
        };
        let velocity_m_per_s = match &mut self.velocity {
            Some(estimator) => estimator.observe(time, row.hip.into()).into(),
            None if time.run_tick < 0 => Vector3::zeros(),
            None => row.velocity,
        };
        let mut reading = Reading { velocity_m_per_s, buttons: row.buttons, ..Reading::at(row.hip) };
        if self.extras.orientation {
            (reading.orientation_wxyz, reading.is_orientation_measured) = (row.orientation_wxyz, true);
        }
        Ok(reading)
    }

    fn attainable(&self, effort: Effort) -> Restrained {
        Restrained::whole(effort.force_on_user_n)
    }

    fn write(&mut self, effort: Effort) -> Result<Written, FaultReason> {
        Ok(Written { force_on_user_n: effort.force_on_user_n, ..Written::default() })
    }

    fn release(&mut self) {}

    fn extras(&self) -> Extras {
        self.extras
    }
}
