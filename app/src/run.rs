//! A scripted run from start to report.

use crate::attachment_totals::AttachmentTotals;
use crate::book::Book;
use crate::child::DriverChild;
use crate::control::carriage::Carriage;
use crate::control::desk::{Desk, Means, OrderSource};
use crate::fast_loop::{FastLoop, Tally, WhenFull};
use crate::live::LiveHandFile;
use crate::loading::while_reading;
use crate::moments::Moments;
use crate::not_zeroed;
use crate::on_request::OnRequest;
use crate::outcome::{RunFailure, Stop, no_thread};
use crate::outputs::{self, Output};
use crate::premises::Premises;
use crate::progress::Progress;
use crate::record::destination::RunFormat;
use crate::record::{About, Backpressure, Files, Recorded, View, shows_scene};
use crate::report::{Report, recording_line};
use crate::rig::{HandMode, Rig, RigError};
use crate::row_queue::{row_queue, untouched_row_queue};
use crate::shown::Shown;
use crate::slow::{SlowEnd, SlowSide};
use crate::snapshots::{Snapshots, Wanted};
use crate::spectator::Spectator;
use crate::two_processes::{self, Source, TwoProcessEnd};
use crate::virtual_clock::VirtualDriver;
use io_driver::device::Extras;
use io_driver::log_thread;
use io_driver::open::open_devices_with;
use io_driver::say::say;
use io_driver::status::Percentiles;
use physics::Reason;
use rt_core::signals::StopSignals;
use rt_core::time_namespace;
use shm_abi::client;
use shm_abi::segment::{ClockMode, DriverInfo};
use shm_abi::{CommanderMemory, DriverView, Frame};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{self, Receiver};
use std::time::Duration;
use view::{NoWindow, OpenWindow, Reins, Stage, WindowSpec};
use world::Settings;
use world::events::{Hub, event_queue, growing_event_queue};
use world::lists::SlowList;

/// Events that may wait between fast and slow side.
pub const EVENT_QUEUE: usize = 8192;

/// What a run is to do with its rig.
#[derive(Debug, Clone)]
pub struct RunPlan {
    /// Which clock moves the ticks; `None`: the running driver's own, real for a child.
    pub clock: Option<ClockMode>,
    /// How long; `None`: as the rig says.
    pub seconds: Option<f64>,
    /// Where to record; the ending says in which format.
    pub record: Vec<PathBuf>,
    /// Where to write what happens, a line each; the ending says in which format.
    pub events: Vec<PathBuf>,
    /// Pictures to be drawn, if any.
    pub pictures: Option<Wanted>,
    /// The window, if there is to be one.
    pub window: Option<WindowSpec>,
    /// What it reads, which nothing is written into.
    pub inputs: Vec<PathBuf>,
    /// Seed of everything random, to be told in recordings.
    pub seed: u64,
    /// What is to change while it runs.
    pub orders: Option<OrderSource>,
    /// Where other scenes are looked for, if orders name any.
    pub settings: Settings,
    /// Use the driver that listens here, and its devices, instead of a child with the rig's.
    pub attach: Option<Attach>,
}

impl RunPlan {
    /// Refuses outputs that would take the place of one of these files or of one another, or whose names say no format.
    ///
    /// # Errors
    /// The first that is wrong, and what to do.
    pub fn check_outputs(&self, inputs: &[PathBuf]) -> Result<(), RunFailure> {
        let ticks = self.record.iter().map(|file| Output::ticks(file));
        let events = self.events.iter().map(|file| Output::events(file));
        let pictures = self.pictures.iter().flat_map(|wanted| &wanted.shots);
        let pictures = pictures.map(|shot| Output::picture(&shot.file));
        let film = self.pictures.iter().filter_map(|wanted| wanted.film.as_ref());
        let film = film.map(|film| Output::film(&film.directory));
        let outputs: Vec<_> = ticks.chain(events).chain(pictures).chain(film).collect();
        outputs::check(&outputs, &inputs.iter().collect::<Vec<_>>())
    }
}

/// A driver that runs already.
#[derive(Debug, Clone)]
pub struct Attach {
    /// Its socket.
    pub socket: PathBuf,
    /// How long to wait for its return, should it end.
    pub grace: Duration,
}

/// Runs. What is recorded before a failure is complete on disk; a recording that fails does not end the run.
///
/// # Errors
/// Whatever kept the run from starting or from going on.
pub fn run(rig: &Rig, plan: &RunPlan, signals: &StopSignals) -> Result<(Report, Stop), RunFailure> {
    // A terminal held by Ctrl-S holds no run, and no lease.
    let thread = log_thread::start("phantom3");
    thread.map_err(|error| no_thread("the log", &error))?;
    // Before anything is made that a signal would leave.
    let stage = stage(rig, plan, signals)?;
    match plan.clock {
        Some(ClockMode::Virtual) => run_virtual(rig, plan, stage, signals),
        _ => run_two_processes(rig, plan, stage, signals),
    }
}

/// Stage of pictures and of the window, if there are any.
fn stage(rig: &Rig, plan: &RunPlan, signals: &StopSignals) -> Result<Option<Stage>, RunFailure> {
    let has_window = plan.window.is_some() && plan.clock != Some(ClockMode::Virtual);
    if plan.pictures.is_none() && !has_window {
        return Ok(None);
    }
    let step = rig.fast_step().map_err(|error| RunFailure::Start(error.to_string()))?;
    let make = || Stage::new(&rig.scene, step.entities());
    Ok(Some(while_reading(&rig.scene_file, signals, make)))
}

/// The parts that every clock needs.
struct Parts {
    fast: FastLoop,
    slow: SlowSide,
    progress: Progress,
    /// In real time, the slow lists of worlds that orders bring.
    slow_lists: Option<Receiver<SlowList>>,
}

impl Parts {
    fn new(
        rig: &Rig,
        plan: &RunPlan,
        clock: ClockMode,
        period_ns: u64,
        devices: &[Extras],
        about: &About,
        (stage, reins, signals): (Option<Stage>, Option<Box<dyn Reins>>, &StopSignals),
    ) -> Result<Self, RunFailure> {
        let seconds = plan.seconds.unwrap_or_else(|| rig.default_seconds());
        let total_ticks = (seconds * 1e9 / period_ns as f64).round() as u64;
        if total_ticks == 0 {
            return Err(RunFailure::Start(format!(
                "--seconds {seconds} is less than half a tick; allowed: at least one tick, {} s",
                period_ns as f64 / 1e9
            )));
        }
        let when_full = if clock == ClockMode::Real { WhenFull::Drop } else { WhenFull::Wait };
        let step = rig.fast_step().map_err(|error| RunFailure::Start(error.to_string()))?;
        let book = Book::default();
        let (sender, slow_lists) = mpsc::channel();
        let window = plan.window.as_ref().filter(|_| clock != ClockMode::Virtual);
        // A window's button begins an MCAP at any time.
        let is_recorded_as_seen = window.is_some() || shows_scene(&plan.record);
        let means = Means {
            is_shown: window.is_some() || plan.pictures.is_some(),
            is_recorded_as_seen,
            settings: plan.settings.clone(),
            extras: devices.to_vec(),
            book: book.clone(),
            slow_lists: (clock == ClockMode::Real).then_some(sender),
        };
        let shown = stage.map(|stage| Shown::on(stage, rig, step.entities()));
        let (events, event_ends) = match when_full {
            WhenFull::Wait => growing_event_queue(EVENT_QUEUE),
            WhenFull::Drop => event_queue(EVENT_QUEUE),
        };
        let mut hub = Hub::new(vec![event_ends]);
        let opened = match window.zip(shown.clone()) {
            Some((spec, shown)) => {
                let carries_devices = rig.goes_with_the_camera();
                for line in &shown.stage.not_drawn {
                    say(format_args!("phantom3: not in the window as it should be: {line}"));
                }
                open_window(&WindowSpec { carries_devices, ..spec.clone() }, shown, reins)?
            }
            None if reins.is_some() => return Err(NoWindow::NoDisplay.into()),
            None => None,
        };
        let spectator =
            opened.map(|(window, moments)| Spectator::new(window, moments, &mut hub, book.clone()));
        let spectator = spectator.map(|spectator| spectator.in_real_time(clock == ClockMode::Real));
        let view = View::new(&rig.scene, step.entities(), is_recorded_as_seen);
        let directory = plan.settings.recording_directory.value.clone();
        let on_request = spectator.is_some().then(|| OnRequest::new(directory, rig.clone(), view.clone()));
        let (desk, orders) = match &plan.orders {
            Some(source) => Some(Desk::open(rig, source, means)),
            None if spectator.is_some() => Some(Desk::silent(rig, means)),
            None => None,
        }
        .transpose()
        .map_err(RunFailure::Start)?
        .unzip();
        let others = desk.as_ref().map(Desk::scenes_to_come).unwrap_or_default();
        plan.check_outputs(&others)?;
        let make = if clock == ClockMode::Real { row_queue } else { untouched_row_queue };
        let (producer, consumer) = make(step.bodies().len());
        let pictures = plan.pictures.iter().flat_map(|wanted| &wanted.shots).map(|shot| &shot.file);
        let files = Files {
            record: plan.record.clone(),
            events: plan.events.clone(),
            extras: devices.to_vec(),
            period_ns,
            backpressure: Backpressure::new(when_full, signals),
            book,
            about: about.clone(),
            taken: plan.inputs.iter().chain(&others).chain(pictures).cloned().collect(),
        };
        let snapshots =
            plan.pictures.as_ref().zip(shown).map(|(wanted, shown)| {
                Snapshots::start(wanted, shown, period_ns, when_full == WhenFull::Wait)
            });
        let snapshots = snapshots.transpose().map_err(RunFailure::Start)?;
        // The last: it makes files. Those with content are emptied by their first rows, once all threads are there.
        let recorders = files.first(rig, &view)?;
        let fast = FastLoop::new(step, producer, when_full, total_ticks, period_ns).with_events(events);
        Ok(Self {
            slow_lists: (clock == ClockMode::Real && orders.is_some()).then_some(slow_lists),
            fast: match orders {
                Some(orders) => fast.with_control(orders).with_carriage(Carriage::new(rig.layout.clone())),
                None => fast,
            },
            slow: SlowSide::new(consumer, hub, recorders)
                .with_desk(desk, files)
                .with_snapshots(snapshots)
                .with_spectator(spectator)
                .with_requests(on_request),
            progress: Progress::new(total_ticks, period_ns),
        })
    }
}

/// `None`: it could not be opened, which is told. Who is to move the fingers there needs it.
fn open_window(
    spec: &WindowSpec,
    Shown { stage, moments }: Shown,
    reins: Option<Box<dyn Reins>>,
) -> Result<Option<(OpenWindow, Moments)>, RunFailure> {
    let is_needed = reins.is_some();
    match OpenWindow::open(spec.clone(), stage, reins) {
        Ok(window) => Ok(Some((window, moments))),
        Err(error) if is_needed => Err(error.into()),
        Err(error) => {
            say(format_args!("phantom3: {error}; the run goes on without"));
            Ok(None)
        }
    }
}

fn run_virtual(
    rig: &Rig,
    plan: &RunPlan,
    stage: Option<Stage>,
    signals: &StopSignals,
) -> Result<(Report, Stop), RunFailure> {
    let config = rig.driver_config(ClockMode::Virtual);
    let devices = open_devices_with(&config, rig.hand_files())?;
    let mut driver = VirtualDriver::with_devices(&config, devices)?;
    let about = About::of_run(rig, ClockMode::Virtual, rig.period_ns, plan.seed);
    let Parts { mut fast, mut slow, mut progress, .. } = Parts::new(
        rig,
        plan,
        ClockMode::Virtual,
        rig.period_ns,
        &driver.extras(),
        &about,
        (stage, None, signals),
    )?;
    let stop = driver.run(&mut fast, &mut slow, &mut progress, signals);
    progress.end();
    let stop = stop.of_run(&fast.tally);
    fast.end_events();
    let SlowEnd { recordings, events, pictures } = slow.finish();
    let stop = stop.inspect_err(|_| tell_kept(&recordings))?;
    let report = Report {
        clock: ClockMode::Virtual.name(),
        period_ns: rig.period_ns,
        drivers: vec!["in this process".into()],
        tally: fast.tally,
        counters: io_driver::status::CounterStatus::of(driver.view()),
        timing: None,
        step: Percentiles::of(&fast.step_ns),
        guarantees: None,
        parked: parked(&fast.tally, rig),
        events,
        orders: plan.orders.as_ref().map(|_| fast.orders()),
        lists: fast.step_mut().end_lists(None),
        left_out: left_out(plan, &about),
        recordings,
        pictures,
    };
    Ok((report, stop))
}

fn run_two_processes(
    rig: &Rig,
    plan: &RunPlan,
    stage: Option<Stage>,
    signals: &StopSignals,
) -> Result<(Report, Stop), RunFailure> {
    let rig = &seen_from_the_window(rig, plan, stage.as_ref())?;
    let live = rig.is_live().then(LiveHandFile::make).transpose()?;
    let (mut source, attachment) = connect(rig, plan, live.as_ref())?;
    let info = attachment.driver.info();
    check_devices(rig, &info)?;
    check_zeroed(&source, &attachment.driver)?;
    check_clock(plan, &info)?;
    // Other scenes may use all of them.
    let may_change = plan.orders.is_some() || plan.window.is_some();
    let used = if may_change { info.devices.len() } else { rig.device_count() };
    let premises = Premises::of(&attachment.driver, used);
    let extras = extras_of(&attachment.driver);
    let driver_name = two_processes::describe(&source, &attachment);
    let mut totals = AttachmentTotals::begin(&attachment.driver, driver_name.clone());
    let step_rig = rig.clone().at_period(info.period_ns);
    let mut about = About::of_run(rig, info.clock_mode, info.period_ns, plan.seed);
    about.tell("driver", driver_name);
    about.tell("driver_setup", info.setup_report.clone());
    about.tell("lease", attachment.commander.as_ref().map_or(0, CommanderMemory::lease).to_string());
    let reins = live.map(|live| live.into_reins(rig)).transpose()?;
    let reins = reins.map(|reins| Box::new(reins) as Box<dyn Reins>);
    let Parts { fast, mut slow, mut progress, slow_lists } = Parts::new(
        &step_rig,
        plan,
        info.clock_mode,
        info.period_ns,
        &extras,
        &about,
        (stage, reins, signals),
    )?;
    slow.watch_driver(source.socket());
    let watched = (&mut slow, &mut progress, signals);
    let known = (&premises, &mut totals);
    let result = two_processes::run(&mut source, attachment, (fast, slow_lists), known, watched);
    progress.end();
    if slow.newest.is_none()
        && let Err(failure @ RunFailure::Start(_)) = result
    {
        slow.take_back();
        return Err(failure);
    }
    let ended = result.and_then(|end| {
        let TwoProcessEnd { stop, tally, .. } = end;
        Ok(TwoProcessEnd { stop: stop.of_run(&tally)?, ..end })
    });
    let SlowEnd { recordings, events, pictures } = slow.finish();
    let end = ended.inspect_err(|_| tell_kept(&recordings))?;
    let is_real = info.clock_mode == ClockMode::Real;
    let report = Report {
        clock: info.clock_mode.name(),
        period_ns: info.period_ns,
        tally: end.tally,
        counters: totals.counters,
        timing: is_real.then(|| totals.timing()),
        step: totals.step(),
        drivers: totals.drivers,
        guarantees: is_real.then(|| (end.driver.info().setup_report, end.fast_report)),
        parked: parked(&end.tally, rig),
        events,
        orders: plan.orders.as_ref().map(|_| end.orders),
        lists: end.lists,
        left_out: left_out(plan, &about),
        recordings,
        pictures,
    };
    Ok((report, end.stop))
}

/// Inputs of the run that a recording which is to have all of them lacks.
fn left_out(plan: &RunPlan, about: &About) -> Vec<String> {
    if !plan.record.iter().any(|file| RunFormat::of(file) == Ok(RunFormat::Mcap)) {
        return Vec::new();
    }
    about.left_out().map(|(input, why)| format!("{input}: {why}")).collect()
}

/// There is no report of a run that failed before its first tick, but what it was to record is named.
fn tell_kept(recordings: &[Recorded]) {
    for recorded in recordings {
        say(format_args!("{}", recording_line(recorded)));
    }
}

/// At a window the camera that devices go with is the window's, from the beginning.
fn seen_from_the_window(rig: &Rig, plan: &RunPlan, stage: Option<&Stage>) -> Result<Rig, RunFailure> {
    match stage.filter(|_| plan.window.is_some() && rig.goes_with_the_camera()) {
        Some(stage) => {
            let seen = rig.clone().seen_from(stage.cameras[0].pose);
            seen.map_err(|error: RigError| RunFailure::Start(error.to_string()))
        }
        None => Ok(rig.clone()),
    }
}

/// What is told of entities that were parked.
fn parked(tally: &Tally, rig: &Rig) -> Vec<String> {
    let mut lines: Vec<String> = tally
        .parked_first
        .iter()
        .flatten()
        .map(|(parked, tick)| {
            let name = rig.scene.entities.get(parked.entity).map_or("?", |entity| entity.name.as_str());
            let why = match parked.why {
                Reason::LeftTheWorld => "left the world",
                Reason::NotANumber => "was lost to a number that is none",
            };
            let t_s = *tick as f64 * rig.period_ns as f64 / 1e9;
            format!("{name} {why} at t = {t_s} s and stands still since")
        })
        .collect();
    let untold = tally.parked.saturating_sub(lines.len() as u64);
    if untold > 0 {
        lines.push(format!("and {untold} more"));
    }
    lines
}

fn connect(
    rig: &Rig,
    plan: &RunPlan,
    live: Option<&LiveHandFile>,
) -> Result<(Source, client::Attachment), RunFailure> {
    match &plan.attach {
        Some(Attach { socket, grace }) => {
            let attachment = client::command(socket, "phantom3")?;
            refuse_other_clock(socket, attachment.driver_pid)?;
            Ok((Source::Running { socket: socket.clone(), grace: *grace }, attachment))
        }
        None => {
            refuse_unwritable_name(rig)?;
            let mut config = rig.driver_config(plan.clock.unwrap_or(ClockMode::Real));
            live.into_iter().for_each(|live| live.lead(&mut config));
            let mut child = DriverChild::start(config, rig.hand.as_ref())?;
            let attachment = child.attach("phantom3")?;
            Ok((Source::Child(child), attachment))
        }
    }
}

/// Deadlines mean nothing across time namespaces.
fn refuse_other_clock(socket: &Path, driver_pid: u64) -> Result<(), RunFailure> {
    if time_namespace::is_clock_shared_with(driver_pid) != Some(false) {
        return Ok(());
    }
    Err(RunFailure::Start(format!(
        "the driver at {} (process {driver_pid}) lives in another time namespace, and its clock differs from this program's; \
         start both in one (without `unshare -T` and the like)",
        socket.display()
    )))
}

/// The child's configuration is TOML, which is UTF-8.
fn refuse_unwritable_name(rig: &Rig) -> Result<(), RunFailure> {
    let simulated = match &rig.hand_mode {
        HandMode::Impedance(simulated) => Some(simulated),
        HandMode::Kinematic => None,
    };
    let files = [
        ("hand file", rig.hand.as_ref().map(|hand| &hand.path)),
        ("hand's model", simulated.map(|simulated| &simulated.hand_model)),
        ("device's description", simulated.map(|simulated| &simulated.description)),
    ];
    let unwritable = files.into_iter().find(|(_, file)| file.is_some_and(|file| file.to_str().is_none()));
    let Some((what, Some(file))) = unwritable else { return Ok(()) };
    Err(RunFailure::Start(format!(
        "the path of the {what} {} is not UTF-8, and the driver's configuration cannot hold it; \
         rename it, or use --clock virtual",
        file.display()
    )))
}

fn check_devices(rig: &Rig, info: &DriverInfo) -> Result<(), RunFailure> {
    let (needed, found) = (rig.device_count(), info.devices.len());
    if needed <= found {
        return Ok(());
    }
    Err(RunFailure::Start(format!(
        "{}: the scene's fingers need {needed} devices, the driver has {found}; \
         take fingers out of the scene, or add devices to the driver's configuration",
        rig.scene_file.display()
    )))
}

/// What the devices of a driver tell besides positions; in every frame the same.
fn extras_of(driver: &DriverView) -> Vec<Extras> {
    let frame = not_zeroed::first_frame(driver);
    let flags = frame.iter().flat_map(Frame::present_devices).map(|device| device.flags);
    flags.map(Extras::of).collect()
}

/// Nobody would be told why nothing can be felt.
fn check_zeroed(source: &Source, driver: &DriverView) -> Result<(), RunFailure> {
    let Source::Running { socket, .. } = source else { return Ok(()) };
    match not_zeroed::words(driver, socket) {
        Some(words) => Err(RunFailure::Start(words)),
        None => Ok(()),
    }
}

fn check_clock(plan: &RunPlan, info: &DriverInfo) -> Result<(), RunFailure> {
    match plan.clock {
        Some(wanted) if wanted != info.clock_mode => Err(RunFailure::Start(format!(
            "the driver's clock is {}, --clock says {}; leave --clock out, or start the driver with `clock = \"{}\"`",
            info.clock_mode.name(),
            wanted.name(),
            wanted.name()
        ))),
        _ => Ok(()),
    }
}
