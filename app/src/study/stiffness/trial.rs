//! One trial: a hand pushes against a wall, and either it settles or it buzzes.
//!
//! Model: an arm in its home pose, held by a hand whose tremor is left out, in front of a wall through the tip. The hand
//! wants to be some millimetres behind the surface, or above it; half a second after full authority it wants to be
//! deeper by its push. What counts is what the counters say from two seconds after the push on, for a quarter of a second: it has
//! settled if no joint's counter moves by two counts or more.
//! On the way it is summed up what energy the force that the motors rendered fed into the hand, apart from any
//! controller's own account, and by how much a passivity controller changed the force, if there is one.
//! The whole system runs: driver cycle with all its limits, shared memory, fast step; only the waiting is left out.

use super::case::{Axis, Case};
use super::plant::Plant;
use crate::fast_loop::{FastLoop, Turn, WhenFull};
use crate::fast_step::{DeviceFinger, FastStep};
use crate::mount::Mount;
use crate::outcome::RunFailure;
use crate::row::Row;
use crate::row_queue::{RowReceiver, row_queue};
use crate::simulated::SimulatedDevices;
use crate::virtual_clock::VirtualDriver;
use bytemuck::Zeroable;
use haptics::passivity::{Passivity, PassivitySpec};
use haptics::{Entity, Finger, Plane};
use io_driver::config::{
    AccessConfig, DeviceConfig, DriverConfig, HandSource, ProcessConfig, RealTime, ReplyConfig, SafetyConfig,
    Wish, Zeroing, period_of,
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
    rows: RowReceiver,
    ticks: u64,
    look_from: i64,
}

/// What came of a trial.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outcome {
    /// By how much the counter of the worst joint moved while it was looked at.
    pub ripple_counts: i64,
    /// How often it changed.
    pub changes: u32,
    /// The driver ended in its fault state: the arm was too fast.
    pub is_fault: bool,
    /// The most that the rendered force had fed into the hand at any time since full authority (J).
    pub fed_most_j: f64,
    /// By how much a controller changed the force, in the mean square and at most (N).
    pub changed_rms_n: f64,
    /// At most (N).
    pub changed_most_n: f64,
}

impl Outcome {
    /// The driver stopped it.
    fn fault(felt: &Felt) -> Self {
        felt.outcome(i64::MAX, u32::MAX, true)
    }

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
        self.open_with(case, stiffness_n_per_m, None)
    }

    /// The same with a finger that is kept passive, by the numbers of this arm.
    ///
    /// # Errors
    /// As [`Self::open`].
    pub fn open_kept(&self, case: &Case, stiffness_n_per_m: f64) -> Result<Trial, RunFailure> {
        let period_s = self.config(case).period_ns as f64 / 1e9;
        let usual = PassivitySpec::usual(period_s);
        let of_arm = PassivitySpec::for_motion(period_s, usual.acceleration_m_per_s2, self.plant.count_m);
        let spec = PassivitySpec { device_friction_n: self.plant.coulomb_n, ..of_arm };
        let passivity =
            Passivity::new(spec, period_s).map_err(|error| RunFailure::Start(error.to_string()))?;
        self.open_with(case, stiffness_n_per_m, Some(passivity))
    }

    fn open_with(
        &self,
        case: &Case,
        stiffness_n_per_m: f64,
        passivity: Option<Passivity>,
    ) -> Result<Trial, RunFailure> {
        let config = self.config(case);
        let period_ns = config.period_ns;
        let wall = self.wall(stiffness_n_per_m, case.damping_n_s_per_m)?;
        let finger = Finger::new(0.0, 1).map_err(|error| RunFailure::Start(error.to_string()))?;
        let finger = DeviceFinger { finger, device: 0, mount: Mount::new(Isometry3::identity()) };
        let step = FastStep::new(vec![finger], vec![wall], period_ns).with_passivities([passivity]);
        let (producer, rows) = row_queue(0);
        let ticks = |s: f64| (s * 1e9 / period_ns as f64).round();
        Ok(Trial {
            driver: VirtualDriver::open(&config)?,
            fast: FastLoop::new(step, producer, WhenFull::Drop, u64::MAX, period_ns),
            rows,
            ticks: config.safety.ramp_in_ns / config.period_ns + ticks(PUSH_S + SETTLE_S + LOOK_S) as u64,
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
            is_live: false,
            seed: 0,
        }
    }

    fn config(&self, case: &Case) -> DriverConfig {
        let period_ns = period_of(case.rate_hz);
        let reply = ReplyConfig { mode: case.mode.reply_mode(), budget_ns: period_ns / 2 };
        let wish = Wish {
            hand: HandSource::Script { file: self.script.clone(), finger: "f0".into() },
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
            access: AccessConfig::default(),
            devices: vec![DeviceConfig {
                name: "f0".into(),
                backend: self.simulated(case).backend(wish),
                peak_force_n: None,
                slew_n_per_s: None,
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
        let mut felt = Felt::default();
        for tick in 1..=self.ticks {
            let turn = self.driver.tick(tick, &mut self.fast);
            while let Some((row, _)) = self.rows.receive() {
                felt.take(&row);
            }
            if matches!(turn, Turn::Fault(_)) {
                return Ok(Outcome::fault(&felt));
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
            return Ok(Outcome::fault(&felt));
        };
        let ripple_counts = counters.iter().map(|counter| counter.most - counter.least).max().unwrap_or(0);
        let changes = counters.iter().map(|counter| counter.changes).max().unwrap_or(0);
        Ok(felt.outcome(ripple_counts, changes, false))
    }
}

/// What the finger felt since full authority.
#[derive(Debug, Clone, Copy, Default)]
struct Felt {
    /// Where it was and what the motors held then.
    last: Option<(Vector3<f64>, Vector3<f64>)>,
    fed_j: f64,
    fed_most_j: f64,
    changed_squared: f64,
    changed_most_n: f64,
    rows: f64,
}

impl Felt {
    fn take(&mut self, row: &Row) {
        let finger = &row.fingers[0];
        if let Some((hip, held)) = self.last.replace((finger.hip, finger.applied_on_user)) {
            self.fed_j += held.dot(&(finger.hip - hip));
        }
        self.fed_most_j = self.fed_most_j.max(self.fed_j);
        self.changed_squared += finger.controlled_n * finger.controlled_n;
        self.changed_most_n = self.changed_most_n.max(finger.controlled_n);
        self.rows += 1.0;
    }

    fn outcome(&self, ripple_counts: i64, changes: u32, is_fault: bool) -> Outcome {
        Outcome {
            ripple_counts,
            changes,
            is_fault,
            fed_most_j: self.fed_most_j,
            changed_rms_n: (self.changed_squared / self.rows.max(1.0)).sqrt(),
            changed_most_n: self.changed_most_n,
        }
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
