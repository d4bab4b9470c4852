//! A run against a driver in a process of its own, in real time or in lockstep.
//!
//! Model: the fast thread answers frames; this thread is the slow one: it feeds the recorders, shows the
//! progress and watches the connection, which is how the end of the driver is noticed. A driver that was
//! there before us may be restarted: the run goes on with it if it is back within the grace time, and is the same in all
//! that the run is built on ([`Premises`]). A driver that hangs up and goes on has ended our lease on somebody's request,
//! and so the run; also one that stands still meanwhile, and is there again as the same.

use crate::attachment_totals::AttachmentTotals;
use crate::child::DriverChild;
use crate::control::OrderTally;
use crate::fast_loop::{FastLoop, Tally};
use crate::fast_thread::{self, FastEnd, FastRemains, FastShared};
use crate::lists_end::ListsEnd;
use crate::not_zeroed;
use crate::outcome::{RunFailure, Stop, no_thread};
use crate::premises::{OtherDriver, Premises};
use crate::progress::Progress;
use crate::room_supply::RoomSupply;
use crate::slow::SlowSide;
use crate::slow_thread::SlowThread;
use io_driver::say::say;
use rt_core::setup::SetupReport;
use rt_core::signals::StopSignals;
use shm_abi::DriverView;
use shm_abi::client::{self, Attachment, Connection};
use shm_abi::segment::ClockMode;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{self, Receiver};
use std::time::{Duration, Instant};
use world::lists::SlowList;

/// The slow thread's own period.
const SLOW_PERIOD: Duration = Duration::from_millis(10);
/// A driver that has not taken note of a lease's end by then has other troubles.
const LEASE_END: Duration = Duration::from_millis(100);

/// Where the driver comes from.
pub enum Source {
    /// Our own child, which nobody restarts.
    Child(DriverChild),
    /// One that was there before us.
    Running {
        /// Its socket.
        socket: PathBuf,
        /// How long to wait for its return.
        grace: Duration,
    },
}

impl Source {
    /// Where it listens.
    pub fn socket(&self) -> &Path {
        match self {
            Self::Child(child) => child.socket(),
            Self::Running { socket, .. } => socket,
        }
    }

    /// The fault behind a word of its frame.
    fn fault(&self, word: u64) -> RunFailure {
        match self {
            Self::Child(_) => RunFailure::driver_fault(word),
            Self::Running { socket, .. } => RunFailure::driver_fault_at(word, socket),
        }
    }
}

/// What is known after the run.
pub struct TwoProcessEnd {
    /// Counts.
    pub tally: Tally,
    /// Why it stopped.
    pub stop: Stop,
    /// The memory of the last driver.
    pub driver: DriverView,
    /// What the fast thread obtained with it.
    pub fast_report: SetupReport,
    /// What became of the orders.
    pub orders: OrderTally,
    /// What became of the fast and the slow list, if there are two.
    pub lists: Option<ListsEnd>,
}

/// A driver in words: whose it is, where it runs, what it drives.
pub fn describe(source: &Source, attachment: &Attachment) -> String {
    let info = attachment.driver.info();
    let pid = attachment.driver_pid;
    let kinds: Vec<&str> = info.devices.iter().map(|device| device.kind.as_str()).collect();
    let whose = match source {
        Source::Child(_) => "our own child",
        Source::Running { .. } => "was running",
    };
    let cpu = info.cpu.map_or_else(|| "any CPU".into(), |cpu| format!("CPU {cpu}"));
    format!("process {pid}, {whose}, {cpu}, {} wait, devices: {}", info.wait_mode.name(), kinds.join(", "))
}

/// Runs to the end.
///
/// # Errors
/// If there can be no fast thread, or it panicked.
pub fn run(
    source: &mut Source,
    attachment: Attachment,
    (fast, later): (FastLoop, Option<Receiver<SlowList>>),
    (premises, totals): (&Premises, &mut AttachmentTotals),
    (slow, progress, signals): (&mut SlowSide, &mut Progress, &StopSignals),
) -> Result<TwoProcessEnd, RunFailure> {
    let mut attachment = attachment;
    let mut fast = fast;
    let run_ticks = Arc::<AtomicU64>::default();
    let slow_list = start_slow_list(&mut fast, later, &attachment.driver, &run_ticks)?;
    if attachment.driver.info().clock_mode == ClockMode::Real {
        let supply = RoomSupply::start().map_err(|error| no_thread("room for contacts", &error))?;
        fast = fast.with_supply(supply).with_deadlines();
    }
    loop {
        // In lockstep ticks wait for replies instead.
        let is_real = attachment.driver.info().clock_mode == ClockMode::Real;
        let shared = FastShared {
            run_ticks: Arc::clone(&run_ticks),
            outlasts: if is_real { LEASE_END } else { Duration::ZERO },
            signals: signals.clone(),
            ..FastShared::default()
        };
        let (report, connection, watched) =
            run_attached(attachment, (fast, shared), slow, progress, signals)?;
        let remains = watched.remains;
        totals.end(&remains.driver, &remains.step_ns);
        let tally = remains.fast.tally;
        let stop = match watched.end {
            WatchEnd::Fast(FastEnd::Finished) => Stop::Finished,
            WatchEnd::Signal(signal) | WatchEnd::Fast(FastEnd::Signal(signal)) => Stop::Signal(signal),
            WatchEnd::Closed => Stop::Closed,
            WatchEnd::Fast(FastEnd::Fault(reason)) => Stop::Failed(source.fault(reason)),
            WatchEnd::Fast(FastEnd::Implausible(lie)) => Stop::Failed(RunFailure::DriverImplausible(lie)),
            WatchEnd::Fast(FastEnd::Silent) => Stop::Failed(RunFailure::DriverSilent { seconds: 5.0 }),
            WatchEnd::DriverGone | WatchEnd::Fast(FastEnd::Stopped) if goes_on(&remains.driver) => {
                Stop::Failed(RunFailure::LeaseEnded)
            }
            WatchEnd::DriverGone | WatchEnd::Fast(FastEnd::Stopped) => {
                let words = last_words(&remains.driver);
                drop(connection);
                progress.end();
                match reattach(source, (premises, &remains.driver), &words, signals) {
                    Ok(again) => {
                        totals.go_on(&again.driver, describe(source, &again));
                        attachment = again;
                        fast = remains.fast;
                        fast.reset();
                        continue;
                    }
                    Err(failure) => Stop::Failed(failure),
                }
            }
        };
        let FastRemains { driver, mut fast, .. } = remains;
        let lists = fast.step_mut().end_lists(slow_list.and_then(SlowThread::end));
        // So that there is room for what comes last.
        slow.step();
        fast.end_events();
        let orders = fast.orders();
        return Ok(TwoProcessEnd { tally, stop, driver, fast_report: report, orders, lists });
    }
}

/// Where time waits for nobody the slow list has a thread of its own; else its turns are part of ticks.
fn start_slow_list(
    fast: &mut FastLoop,
    later: Option<Receiver<SlowList>>,
    driver: &DriverView,
    run_ticks: &Arc<AtomicU64>,
) -> Result<Option<SlowThread>, RunFailure> {
    let info = driver.info();
    if info.clock_mode != ClockMode::Real {
        return Ok(None);
    }
    let first = fast.step_mut().take_slow();
    if first.is_none() && later.is_none() {
        return Ok(None);
    }
    let later = later.unwrap_or_else(|| mpsc::channel().1);
    let started = SlowThread::start_with(first, later, Arc::clone(run_ticks), info.period_ns);
    started.map(Some).map_err(|error| no_thread("the slow list", &error))
}

/// Why watching ended.
enum WatchEnd {
    Fast(FastEnd),
    Signal(i32),
    /// By people, at the window.
    Closed,
    DriverGone,
}

struct Watched {
    end: WatchEnd,
    remains: FastRemains,
}

fn run_attached(
    attachment: Attachment,
    (fast, shared): (FastLoop, FastShared),
    slow: &mut SlowSide,
    progress: &mut Progress,
    signals: &StopSignals,
) -> Result<(SetupReport, Option<Connection>, Watched), RunFailure> {
    let Attachment { driver, commander, connection, .. } = attachment;
    let commander = commander.ok_or_else(|| RunFailure::Start("the driver gave no lease".into()))?;
    if let Some(warning) = fast_thread::shares_a_spinning_cpu(&driver.info()) {
        say(format_args!("phantom3: {warning}"));
    }
    let (report, thread) = fast_thread::start(fast, driver, commander, shared.clone())
        .map_err(|error| no_thread("the fast loop", &error))?;
    let end = loop {
        slow.step_a_while();
        if thread.is_finished() || shared.is_over.load(Ordering::Acquire) {
            break None;
        }
        if let Some(signal) = signals.requested() {
            break Some(WatchEnd::Signal(signal));
        }
        if slow.wants_end() {
            break Some(WatchEnd::Closed);
        }
        if !connection.is_open() {
            break Some(WatchEnd::DriverGone);
        }
        progress.show(shared.run_ticks.load(Ordering::Relaxed));
        std::thread::sleep(SLOW_PERIOD);
    };
    let mut connection = Some(connection);
    if end.is_none() {
        // The lease ends while replies still come; the fast thread sees it end.
        connection = None;
        let ended = Instant::now();
        while !thread.is_finished() && ended.elapsed() < LEASE_END {
            std::thread::sleep(LEASE_END / 100);
        }
    }
    shared.stop.store(true, Ordering::Relaxed);
    let remains = thread.join().map_err(|_| RunFailure::DriverGone("the fast thread panicked".into()))?;
    let end = end.unwrap_or(WatchEnd::Fast(remains.end));
    Ok((report, connection, Watched { end, remains }))
}

/// Whether a driver that has hung up tells further ticks. One that ends writes its last words before it hangs up.
fn goes_on(driver: &DriverView) -> bool {
    let patience = LEASE_END.max(Duration::from_nanos(driver.info().period_ns) * 3);
    let (seen, begun) = (driver.latest_tick(), Instant::now());
    while rt_core::epitaph::read(&driver.epitaph).is_none() && begun.elapsed() < patience {
        if driver.latest_tick() != seen {
            return true;
        }
        std::thread::sleep(LEASE_END / 100);
    }
    false
}

fn last_words(driver: &DriverView) -> String {
    rt_core::epitaph::read(&driver.epitaph).map_or_else(
        || "it hung up without last words: it was killed, crashed, or stands still".into(),
        |words| words.to_string(),
    )
}

fn reattach(
    source: &mut Source,
    before: (&Premises, &DriverView),
    words: &str,
    signals: &StopSignals,
) -> Result<Attachment, RunFailure> {
    let (socket, grace) = match source {
        Source::Child(child) => {
            let status = child.end().map_or_else(String::new, |status| format!(" ({status})"));
            return Err(RunFailure::DriverGone(format!("{words}{status}")));
        }
        Source::Running { socket, grace } => (socket, *grace),
    };
    say(format_args!("phantom3: the driver is gone: {words}; waiting up to {grace:?} for its return"));
    let mut begun = Instant::now();
    let mut told = false;
    loop {
        let error = match come_back(socket, before) {
            Ok(attachment) => {
                say(format_args!(
                    "phantom3: the driver is back (process {}); the run goes on",
                    attachment.driver_pid
                ));
                return Ok(attachment);
            }
            Err(Absence::Same) => return Err(RunFailure::LeaseEnded),
            Err(error) if error.is_for_good() => return Err(RunFailure::OtherDriver(error.to_string())),
            Err(error) => error,
        };
        if signals.requested().is_some() {
            return Err(RunFailure::DriverGone(format!("{words}; a signal ended the wait for its return")));
        }
        if !told && let Absence::NotZeroed(words) = &error {
            // A person has to walk there.
            say(format_args!("phantom3: the driver is back: {words}; waiting up to {grace:?} for that"));
            (told, begun) = (true, Instant::now());
        }
        if begun.elapsed() > grace {
            return Err(RunFailure::DriverGone(format!("{words}; after {grace:?}: {error}")));
        }
        std::thread::sleep(SLOW_PERIOD);
    }
}

/// Why a run cannot go on yet.
#[derive(Debug, thiserror::Error)]
enum Absence {
    #[error(transparent)]
    Gone(#[from] client::AttachError),
    #[error("{0}")]
    NotZeroed(String),
    #[error(transparent)]
    Other(#[from] OtherDriver),
    /// It stood still, and has not ended.
    #[error("it is the same driver")]
    Same,
}

impl Absence {
    /// A driver is there, and it is none that the run could go on with.
    fn is_for_good(&self) -> bool {
        let is_of_another_contract = |error: &client::AttachError| {
            matches!(
                error,
                client::AttachError::WrongVersion { .. } | client::AttachError::WrongLayout { .. }
            )
        };
        match self {
            Self::Other(_) => true,
            Self::Gone(error) => is_of_another_contract(error),
            Self::NotZeroed(_) | Self::Same => false,
        }
    }
}

/// The lease of the driver that the run began with, whose devices know where they are. Looked at before the lease is asked
/// for: who zeroes them should not find somebody in command. And once more after it: in between yet another one may have
/// come.
fn come_back(socket: &Path, (premises, gone): (&Premises, &DriverView)) -> Result<Attachment, Absence> {
    let observer = client::observe(socket, "phantom3")?;
    if observer.driver.is_same_driver(gone) {
        return Err(Absence::Same);
    }
    premises.judge(&observer.driver)?;
    if let Some(words) = not_zeroed::words(&observer.driver, socket) {
        return Err(Absence::NotZeroed(words));
    }
    let attachment = client::command(socket, "phantom3")?;
    premises.judge(&attachment.driver)?;
    Ok(attachment)
}
