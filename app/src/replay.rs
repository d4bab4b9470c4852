//! `phantom3 replay`: the fingers of a recording once more, in the same scene or another.
//!
//! Problem: what would these very movements have felt with other friction, another shape, another version of this
//! program? And is what is published still what the program computes?
//! Model: devices that are where the recording has the fingers (`feed`), on the virtual clock, through the same driver
//! and fast loop as every run. What comes out is compared with the recording tick by tick (`difference`).
//! Invariant: with the same scene and program a recording of scripted or of free fingers comes out the same to the bit;
//! what a contact remembers from before t = 0 is not in a recording.

mod difference;
mod edit;
mod feed;
mod ordered;
mod stage;

use crate::book::Book;
use crate::export::{tell_end, wrong};
use crate::fast_loop::{FastLoop, Turn, WhenFull};
use crate::outcome::{RunFailure, Stop};
use crate::outputs::{self, Output};
use crate::progress::StatusLine;
use crate::record::destination::{is_standard_output, shown};
use crate::record::read::{self, ReadError, RecordedRun};
use crate::record::{self, About, Backpressure, Recorder, View};
use crate::rig::Rig;
use crate::row_queue::{RowReceiver, row_queue};
use crate::run::EVENT_QUEUE;
use crate::settings;
use crate::slow;
use crate::virtual_clock::VirtualDriver;
use clap::Args;
use difference::Difference;
use edit::Edit;
use feed::{Feed, ReplayedDevice, SharedFeed};
use io_driver::device::{Device, run_time_s};
use nalgebra::Vector3;
use ordered::Orders;
use rt_core::plain_text::Plain;
use rt_core::signals::StopSignals;
use shm_abi::segment::ClockMode;
use stage::Stage;
use std::fmt::Display;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use world::Settings;
use world::events::{Hub, growing_event_queue};

/// Of `--expect-same`, when something differs.
const EXIT_DIFFERENT: u8 = 1;

/// What is played, and to what.
#[derive(Debug, Args)]
pub struct ReplayArgs {
    /// The recording (MCAP or CSV)
    recording: PathBuf,
    /// The scene to play it to [default: the recording's own, which only MCAP has]
    #[arg(long, value_name = "TOML")]
    scene: Option<PathBuf>,
    /// Change the friction of an entity, as in table=stiction,mu_s=0.7,mu_d=0.3; may be given several times
    #[arg(long, value_name = "NAME=MODEL,..", value_parser = Edit::friction)]
    friction: Vec<Edit>,
    /// Change any key of the scene, as in entity.table.stiffness_n_per_m=500; may be given several times
    #[arg(long, value_name = "KEY=VALUE", value_parser = Edit::set)]
    change: Vec<Edit>,
    /// Write what comes out here, as `run` does: FILE.csv, FILE.mcap, or - for CSV on the standard output; may be given
    /// several times
    #[arg(long, value_name = "FILE")]
    record: Vec<PathBuf>,
    /// End with status 1 if anything differs, be it the last bit, or the recording is cut (a table: within a row)
    #[arg(long)]
    expect_same: bool,
}

/// Plays it.
///
/// # Errors
/// A recording or a scene that cannot be read or is wrong, or a fault while it is played.
pub fn execute(
    args: &ReplayArgs,
    settings: &Settings,
    signals: &StopSignals,
) -> Result<ExitCode, RunFailure> {
    let recorded = RecordedRun::open(&args.recording).map_err(|error| wrong(&error))?;
    refuse_without_beginning(args, &recorded)?;
    let edits: Vec<Edit> = args.friction.iter().chain(&args.change).cloned().collect();
    let scene = args.scene.as_ref().map(|scene| settings::find(scene, &settings.scenes.value));
    let other = scene.as_deref().map(|scene| (scene, settings));
    let mut stage = Stage::set(&args.recording, &recorded, other, &edits)?;
    check_outputs(args, &stage.rig)?;
    let played_from = args.recording.file_name().unwrap_or_default().to_string_lossy();
    stage.about.tell("replay_of", played_from.into_owned());
    let feed = Feed::new(recorded).map_err(|error| wrong(&error))?;
    if feed.is_empty() {
        return Err(wrong(&format_args!("{} has no rows", args.recording.display())));
    }
    refuse_late_beginning(args, &feed, &stage)?;
    let orders = read::orders(&args.recording);
    let mut play = Play::new(&stage, Arc::new(Mutex::new(feed)), orders, &args.record, signals)?;
    let ended = play.run(signals);
    play.conclude(args, &stage, ended)
}

/// What was where, and what contacts remembered, is not in it.
fn refuse_without_beginning(args: &ReplayArgs, recorded: &RecordedRun) -> Result<(), RunFailure> {
    let Some(begins) = recorded.about().and_then(About::begins_tick).filter(|begins| *begins > 0) else {
        return Ok(());
    };
    let t_s = run_time_s(begins.cast_signed(), recorded.period_ns());
    Err(wrong(&format_args!(
        "{} begins at t = {t_s} s of its run, and a replay needs the run from its beginning; record it with \
         `run --record FILE`",
        args.recording.display()
    )))
}

/// Every tick before the first row would be played.
fn refuse_late_beginning(args: &ReplayArgs, feed: &Feed, stage: &Stage) -> Result<(), RunFailure> {
    let t_s = run_time_s(feed.first_tick().cast_signed(), feed.recorded.period_ns());
    if stage.follows || t_s <= read::LONGEST_GAP_S {
        return Ok(());
    }
    Err(wrong(&format_args!(
        "{}: its first row is at t = {t_s:?}; allowed: at most {} s, since a replay begins at t = 0",
        args.recording.display(),
        read::LONGEST_GAP_S
    )))
}

fn check_outputs(args: &ReplayArgs, rig: &Rig) -> Result<(), RunFailure> {
    // The recording's own scene is in it, and what is called so here is not read.
    let of_scene = if args.scene.is_some() { rig.input_files() } else { Vec::new() };
    let inputs: Vec<&PathBuf> =
        [&args.recording].into_iter().chain(&of_scene).chain(rig.model_files()).collect();
    outputs::check(&args.record.iter().map(|file| Output::ticks(file)).collect::<Vec<_>>(), &inputs)
}

/// A replay under way.
struct Play {
    driver: VirtualDriver,
    fast: FastLoop,
    orders: Option<Orders>,
    /// The tick in which the recording begins, where that is where another scene ended.
    begins: Option<u64>,
    rows: RowReceiver,
    recorders: Vec<Recorder>,
    events: Hub,
    feed: SharedFeed,
    /// Which finger of the recording each finger of the scene is.
    fingers: Vec<Option<usize>>,
    names: crate::columns::Names,
    difference: Difference,
    period_ns: u64,
    missing: u64,
    rows_read: u64,
}

impl Play {
    fn new(
        stage: &Stage,
        feed: SharedFeed,
        orders: Vec<(u64, String)>,
        records: &[PathBuf],
        signals: &StopSignals,
    ) -> Result<Self, RunFailure> {
        let rig = &stage.rig;
        let (recorded_names, period_ns) = {
            let held = lock(&feed);
            (held.recorded.names().clone(), held.recorded.period_ns())
        };
        let fingers: Vec<Option<usize>> = rig
            .scene
            .fingers
            .iter()
            .enumerate()
            .map(|(place, finger)| which(&recorded_names.fingers, &finger.name, place))
            .collect();
        let driver = VirtualDriver::with_devices(
            &rig.driver_config(ClockMode::Virtual),
            devices(rig, &feed, &fingers),
        )?;
        let names = rig.names(&driver.extras());
        let step = rig.fast_step().map_err(|error| wrong(&error))?;
        let bodies = step.bodies().len();
        let view = View::new(&rig.scene, step.entities(), record::shows_scene(records));
        let book = Book::default();
        let (events, event_ends) = growing_event_queue(EVENT_QUEUE);
        let mut hub = Hub::new(vec![event_ends]);
        let (sender, rows) = row_queue(bodies);
        // It ends with the recording.
        let mut fast = FastLoop::new(step, sender, WhenFull::Wait, u64::MAX, period_ns).with_events(events);
        let begins = stage.follows.then(|| lock(&feed).first_tick());
        let orders = Orders::new(stage, orders, begins, &driver.extras(), &book);
        let orders = orders.map_err(|error| wrong(&error))?;
        let (orders, taken) = orders.unzip();
        if let Some(taken) = taken {
            fast = fast.with_control(taken);
        }
        // The last: it makes files. Those with content are emptied by their first rows.
        let create =
            |_, file| record::create(file, names.clone(), period_ns, &stage.about, &view, (&book, 0));
        let begun = record::begin_all(&records.iter().collect::<Vec<_>>(), create)?;
        let backpressure = Backpressure::new(WhenFull::Wait, signals);
        let start = |path: &Path, file| Recorder::start(path, file, bodies, period_ns, backpressure.clone());
        let mut recorders = Recorder::start_all(records.iter().zip(begun), start)?;
        slow::subscribe(&mut recorders, &mut hub);
        Ok(Self {
            driver,
            fast,
            orders,
            begins,
            rows,
            recorders,
            events: hub,
            difference: Difference::new(&fingers, &recorded_names, &names, period_ns),
            feed,
            fingers,
            names,
            period_ns,
            missing: 0,
            rows_read: 0,
        })
    }

    fn run(&mut self, signals: &StopSignals) -> Result<Stop, RunFailure> {
        let mut line = StatusLine::told_just_now();
        for tick in 1.. {
            if let Some(orders) = &mut self.orders {
                orders.give(self.fast.run_ticks());
            }
            let (feed, fast, missing, follows) =
                (&self.feed, &mut self.fast, &mut self.missing, self.begins.is_some());
            let turn = self.driver.tick_with(tick, |tick, driver, commander| {
                let held = lock(feed);
                if held.is_missing() && !(follows && held.is_before_first()) {
                    *missing += 1;
                    return Turn::Skipped;
                }
                drop(held);
                fast.turn(tick, driver, commander)
            });
            self.compare();
            if let Turn::Fault(reason) = turn {
                return Err(RunFailure::driver_fault(reason));
            }
            let held = lock(&self.feed);
            if held.is_over() && held.reached.is_empty() {
                break;
            }
            drop(held);
            if let Some(signal) = signals.requested() {
                return Ok(Stop::Signal(signal));
            }
            let t_s = run_time_s(self.fast.run_ticks().cast_signed(), self.period_ns);
            line.show(|| format!("{t_s:7.2} s"));
        }
        Ok(Stop::Finished)
    }

    /// Takes the rows that came out and puts each beside the one that was recorded.
    fn compare(&mut self) {
        while let Some((row, _)) = self.rows.receive() {
            let (bodies, changed, placed) = (self.rows.bodies(), self.rows.changed(), self.rows.placed());
            let mut feed = lock(&self.feed);
            while feed.reached.front().is_some_and(|(before, _)| before.run_tick <= row.run_tick) {
                let Some((before, bodies_before)) = feed.reached.pop_front() else { break };
                self.rows_read += 1;
                if before.run_tick == row.run_tick {
                    let recorded = (&before, &bodies_before[..], feed.recorded.names());
                    self.difference.add(recorded, (&row, bodies, &self.names), &self.fingers);
                }
            }
            drop(feed);
            self.events.deliver(row.run_tick);
            if self.begins.is_some_and(|begins| row.run_tick < begins) {
                continue;
            }
            for recorder in &mut self.recorders {
                recorder.send(&row, (bodies, changed), placed);
            }
        }
    }

    fn conclude(
        mut self,
        args: &ReplayArgs,
        stage: &Stage,
        ended: Result<Stop, RunFailure>,
    ) -> Result<ExitCode, RunFailure> {
        self.fast.end_events();
        let Self { feed, mut difference, recorders, mut events, period_ns, missing, rows_read, .. } = self;
        events.deliver(u64::MAX);
        let recordings: Vec<_> = recorders.into_iter().map(Recorder::finish).collect();
        let mut feed = lock(&feed);
        let failure: Result<(), ReadError> = feed.failure.take().map_or(Ok(()), Err);
        let until_s = run_time_s(self.fast.run_ticks().saturating_sub(1).cast_signed(), period_ns);
        let is_cut = feed.recorded.cut().is_some();
        let whole = tell_end(&args.recording, failure, feed.recorded.cut(), rows_read, until_s);
        let whole = if rows_read == 0 { whole.map(|()| Ok(()))? } else { whole };
        let stop = ended?;
        if let Stop::Signal(_) = stop {
            difference.end_before(feed.count_with(rows_read));
        }
        let takes_output = recordings.iter().any(|recorded| is_standard_output(&recorded.path));
        let program = feed.recorded.about().and_then(|about| about.facts.get("program"));
        let tell = |words: &dyn Display| outputs::tell(words, takes_output);
        tell(&format_args!(
            "recording    {} ({} ticks compared, {missing} missing in it), by {}",
            Plain(args.recording.display()),
            difference.ticks(),
            Plain(program.map_or("an unknown version", String::as_str))
        ));
        tell(&format_args!("scene        {}", Plain(&stage.name)));
        for recorded in &recordings {
            let place = shown(&recorded.path);
            tell(&format_args!("written      {} ({} rows)", Plain(place.display()), recorded.rows));
        }
        tell(&difference);
        // What is whole before the damage was told.
        whole?;
        // The recorder has told why.
        if recordings.iter().any(|recorded| recorded.failure.is_some()) {
            return Ok(ExitCode::from(3));
        }
        if let Stop::Signal(_) = stop {
            return Ok(stop.conclude());
        }
        let is_unexpected = args.expect_same && (is_cut || !difference.is_none());
        Ok(if is_unexpected { ExitCode::from(EXIT_DIFFERENT) } else { ExitCode::SUCCESS })
    }
}

/// The finger of that name, else, if no other has its place, the one there.
fn which(recorded: &[String], name: &str, place: usize) -> Option<usize> {
    recorded.iter().position(|other| other == name).or_else(|| (place < recorded.len()).then_some(place))
}

fn devices(rig: &Rig, feed: &SharedFeed, fingers: &[Option<usize>]) -> Vec<Box<dyn Device>> {
    let device = |index: usize| {
        let place = rig.scene.fingers.iter().position(|finger| finger.device == index);
        let finger = place.map(|place| &rig.scene.fingers[place]);
        let name = finger.map_or("(unused)", |finger| finger.name.as_str());
        let start = finger.map_or_else(Vector3::zeros, |finger| finger.start_m.coords);
        let played = place.and_then(|place| fingers[place]);
        Box::new(ReplayedDevice::new(name, feed, played, start)) as Box<dyn Device>
    };
    (0..rig.device_count()).map(device).collect()
}

fn lock(feed: &SharedFeed) -> MutexGuard<'_, Feed> {
    feed.lock().unwrap_or_else(PoisonError::into_inner)
}
