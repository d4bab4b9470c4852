//! One trial: a hand pushes against a wall, and either it settles or it buzzes.
//!
//! Model: an arm in its home pose, held by a hand whose tremor is left out, in front of a wall through the tip. The hand
//! wants to be some millimetres behind the surface, or above it; half a second after full authority it wants to be
//! deeper by its push. What counts is what the counters say from two seconds after the push on, for a quarter of a second: it has
//! settled if no joint's counter moves by two counts or more.
//! The whole system runs: driver cycle with all its limits, shared memory, fast step; only the waiting is left out.

use super::case::{Axis, Case};
use super::plant::Plant;
use crate::fast_loop::{FastLoop, Turn, WhenFull};
use crate::fast_step::{DeviceFinger, FastStep};
use crate::mount::Mount;
use crate::outcome::RunFailure;
use crate::simulated::SimulatedDevices;
use crate::slow::row_queue;
use crate::virtual_clock::VirtualDriver;
use bytemuck::Zeroable;
use haptics::{Entity, Finger, Plane};
use io_driver::config::{
    DeviceConfig, DriverConfig, ProcessConfig, RealTime, ReplyConfig, SafetyConfig, Wish, Zeroing, period_of,
};
use io_driver::open::ROUND_TRIP_NS;
use io_driver::sim::hand::HandModel;
use nalgebra::{Isometry3, Vector3};
use shm_abi::segment::ClockMode;
use shm_abi::{DriverState, Frame};
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// From the reading to the motors where they are written in the same tick (s).
pub const ROUND_TRIP_S: f64 = ROUND_TRIP_NS as f64 / 1e9;
/// When the push comes, after full authority (s).
const PUSH_S: f64 = 0.5;
/// How long it has to settle (s).
const SETTLE_S: f64 = 2.0;
/// How long it is looked at then (s).
const LOOK_S: f64 = 0.25;
/// What a settled counter moves by less than.
const COUNTS: i64 = 2;
/// What a quiet counter changes at most meanwhile: eight times a second, as a hand that gives way makes it.
const CHANGES: u32 = 2;

/// What all trials share.
#[derive(Debug)]
pub struct Bench {
    /// The arm.
    pub plant: Plant,
    /// The wall's normal.
    pub axis: Axis,
    description: PathBuf,
    script: PathBuf,
    _directory: TempDir,
}

/// A trial that is ready to run.
pub struct Trial {
    driver: VirtualDriver,
    fast: FastLoop,
    ticks: u64,
    look_from: i64,
}

/// What came of a trial.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Outcome {
    /// By how much the counter of the worst joint moved while it was looked at.
    pub ripple_counts: i64,
    /// How often it changed.
    pub changes: u32,
    /// The driver ended in its fault state: the arm was too fast.
    pub is_fault: bool,
}

impl Outcome {
    /// Whether nothing buzzes either: a counter may creep over a count, but not flicker.
    pub fn is_quiet(&self) -> bool {
        self.settles() && self.changes <= CHANGES
    }

    /// Whether what moves is less than two counts.
    pub fn settles(&self) -> bool {
        !self.is_fault && self.ripple_counts < COUNTS
    }
}

impl Bench {
    /// Trials of this arm against walls of this normal, with a hand that wants to be this deep and then this much deeper
    /// (m).
    ///
    /// # Errors
    /// If the arm cannot be simulated, or there is no room for a temporary file.
    pub fn new(device: &Path, axis: Axis, push_m: [f64; 2]) -> Result<Self, RunFailure> {
        let simulated = SimulatedDevices { description: device.into(), ..SimulatedDevices::default() };
        let arm = simulated.arm().map_err(|error| RunFailure::Start(error.to_string()))?;
        let plant = Plant::of(&arm, axis).ok_or_else(|| {
            RunFailure::Start(format!(
                "{} has no table [simulation], so it cannot be simulated; add it, see the built-in premium-1.5",
                device.display()
            ))
        })?;
        let no_room = |error: std::io::Error| {
            RunFailure::Start(format!(
                "cannot write the hand's script: {error}; set TMPDIR to a directory that can be written"
            ))
        };
        let directory = tempfile::Builder::new().prefix("phantom3-study-").tempdir().map_err(no_room)?;
        let script = directory.path().join("push.csv");
        std::fs::write(&script, push_script(&plant, axis, push_m)).map_err(no_room)?;
        Ok(Self { plant, axis, description: simulated.description, script, _directory: directory })
    }

    /// A trial at this stiffness (N/m).
    ///
    /// # Errors
    /// If the devices or the memory cannot be had.
    pub fn open(&self, case: &Case, stiffness_n_per_m: f64) -> Result<Trial, RunFailure> {
        let config = self.config(case);
        let period_ns = config.period_ns;
        let wall = self.wall(stiffness_n_per_m, case.damping_n_s_per_m)?;
        let finger = Finger::new(0.0, 1).map_err(|error| RunFailure::Start(error.to_string()))?;
        let finger = DeviceFinger { finger, device: 0, mount: Mount::new(Isometry3::identity()) };
        let step = FastStep::new(vec![finger], vec![wall], period_ns);
        // Nobody reads the rows.
        let (rows, _) = row_queue();
        let ticks = |s: f64| (s * 1e9 / period_ns as f64).round();
        Ok(Trial {
            driver: VirtualDriver::open(&config)?,
            fast: FastLoop::new(step, rows, WhenFull::Drop, u64::MAX, period_ns),
            ticks: config.safety.ramp_in_ticks + ticks(PUSH_S + SETTLE_S + LOOK_S) as u64,
            look_from: ticks(PUSH_S + SETTLE_S) as i64,
        })
    }

    fn wall(&self, stiffness: f64, damping: f64) -> Result<Entity, RunFailure> {
        let normal = self.axis.normal();
        let offset = self.plant.tip_m.dot(&normal);
        Plane::new(normal.into_inner(), offset)
            .and_then(|plane| Entity::new(plane, Isometry3::identity(), stiffness))
            .and_then(|entity| entity.with_damping(damping))
            .map_err(|error| RunFailure::Start(error.to_string()))
    }

    /// The hand of a case; `None`: nobody.
    ///
    /// # Errors
    /// If its model cannot be had.
    pub fn hand_model(&self, case: &Case) -> Result<Option<HandModel>, RunFailure> {
        self.simulated(case).hand().map_err(|error| RunFailure::Start(error.to_string()))
    }

    fn simulated(&self, case: &Case) -> SimulatedDevices {
        SimulatedDevices {
            description: self.description.clone(),
            hand_model: case.hand.model.clone(),
            firmness: case.hand.firmness,
            trembles: false,
            seed: 0,
        }
    }

    fn config(&self, case: &Case) -> DriverConfig {
        let period_ns = period_of(case.rate_hz);
        let reply = ReplyConfig { mode: case.mode.reply_mode(), budget_ns: period_ns / 2 };
        let wish = Wish {
            hand: Some((self.script.clone(), "f0".into())),
            start_m: self.plant.tip_m,
            base_in_world: Isometry3::identity(),
        };
        DriverConfig {
            period_ns,
            clock: ClockMode::Virtual,
            socket: None,
            real_time: RealTime::usual(period_ns, reply.budget_ns),
            reply,
            safety: SafetyConfig::usual(period_ns),
            process: ProcessConfig::default(),
            devices: vec![DeviceConfig {
                name: "f0".into(),
                backend: self.simulated(case).backend(wish),
                peak_force_n: None,
                compensates_gravity: true,
                zeroing: Zeroing::Known,
            }],
        }
    }
}

impl Trial {
    /// Runs it.
    ///
    /// # Errors
    /// None for what a wall does to an arm; that is an outcome.
    pub fn run(mut self) -> Result<Outcome, RunFailure> {
        let mut frame = Frame::zeroed();
        let mut seen: Option<[Counter; 3]> = None;
        for tick in 1..=self.ticks {
            let turn = self.driver.tick(tick, &mut self.fast);
            if matches!(turn, Turn::Fault(_)) {
                return Ok(Outcome { ripple_counts: i64::MAX, changes: u32::MAX, is_fault: true });
            }
            let is_read = self.driver.view().read_frame(tick, &mut frame).is_ok();
            if is_read && frame.state == DriverState::Active as u64 && frame.run_tick >= self.look_from {
                let counts = &frame.devices[0].encoder_counts;
                let counters = seen.get_or_insert_with(|| std::array::from_fn(|j| Counter::at(counts[j])));
                counters.iter_mut().zip(counts).for_each(|(counter, count)| counter.take(*count));
            }
        }
        // Full authority that never came is no quiet wall.
        let Some(counters) = seen else {
            return Ok(Outcome { ripple_counts: i64::MAX, changes: u32::MAX, is_fault: true });
        };
        Ok(Outcome {
            ripple_counts: counters.iter().map(|counter| counter.most - counter.least).max().unwrap_or(0),
            changes: counters.iter().map(|counter| counter.changes).max().unwrap_or(0),
            is_fault: false,
        })
    }
}

/// What a counter did.
#[derive(Debug, Clone, Copy)]
struct Counter {
    last: i64,
    least: i64,
    most: i64,
    changes: u32,
}

impl Counter {
    fn at(count: i64) -> Self {
        Self { last: count, least: count, most: count, changes: 0 }
    }

    fn take(&mut self, count: i64) {
        self.changes += u32::from(count != self.last);
        *self = Self { last: count, least: self.least.min(count), most: self.most.max(count), ..*self };
    }
}

/// The hand presses, and then a little more.
fn push_script(plant: &Plant, axis: Axis, [press_m, push_m]: [f64; 2]) -> String {
    let normal: Vector3<f64> = axis.normal().into_inner();
    let row = |t_s: f64, depth_m: f64| {
        let [x, y, z]: [f64; 3] = (plant.tip_m - normal * depth_m).into();
        format!("{t_s},{x},{y},{z}\n")
    };
    let pushed = press_m + push_m;
    format!("t,f0_x,f0_y,f0_z\n{}{}{}", row(0.0, press_m), row(PUSH_S, press_m), row(PUSH_S + 1e-3, pushed))
}
