//! The driver as a process: sets itself up, starts the loop in a thread of its own, serves the socket.
//!
//! Model: everything that can fail or allocate happens before the loop's first tick or in this thread.
//! The order is: open the devices, set up the loop's thread and look at what was obtained, make the
//! memory, give up all rights, listen, start the threads that stop and that log, shut the sandbox, go. Whatever ends the
//! process, the loop writes zero first.

use crate::bell_thread::BellThread;
use crate::config::{DriverConfig, ReplyMode};
use crate::cycle::{Cycle, Freshness, Protection};
use crate::device::Device;
use crate::heartbeat::Heartbeat;
use crate::log_thread;
use crate::loop_thread;
use crate::mail::mail;
use crate::open::{OpenError, open_devices};
use crate::real_loop::{RealLoop, Shared, Waiting};
use crate::safety::{Ramps, Safety};
use crate::sandbox;
use crate::say::hold;
use crate::service::{Service, remove_directory_of, say};
use crate::stop_thread;
use crate::supervisor::Supervisor;
use rt_core::epitaph::{install_fatal_handlers, install_panic_hook};
use rt_core::privileges::{User, UserError};
use rt_core::setup::SetupReport;
use rt_core::signals::StopSignals;
use shm_abi::DriverMemory;
use shm_abi::doorbell::WaitMode;
use shm_abi::segment::{ClockMode, DriverInfo, SegmentError};
use shm_abi::server::{BindError, Server};
use shm_abi::stop_socket::StopSocket;
use std::io;
use std::os::fd::AsFd;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicU64;
use thiserror::Error;

/// Records that may wait for the log's slow side.
const LOG_CAPACITY: usize = 1024;

/// It is no real-time guarantee, so `--strict` does not mind.
const STARTED_AS_ROOT: &str = "warning: started as root and stays root, though without any capability; name an \
     ordinary user with `user = \"NAME\"` in [process], or start as one";

/// What a run is to do besides its configuration.
#[derive(Debug, Clone, Default)]
pub struct RunOptions {
    /// What to put between the driver and each of its devices, such as a recorder or a fault.
    pub fit: Option<Fit>,
    /// Refuse to start when a real-time guarantee is missing.
    pub strict: bool,
    /// Say nothing but errors.
    pub quiet: bool,
    /// End when this process, the parent, ends.
    pub parent: Option<u32>,
    /// Listen here, whatever the configuration says.
    pub socket: Option<PathBuf>,
}

/// Puts something of one's own in the place of a device, usually around it.
pub type Fit = fn(Box<dyn Device>) -> Box<dyn Device>;

/// Why a driver did not run, or not to its end.
#[derive(Debug, Error)]
pub enum RunError {
    /// A device cannot be had.
    #[error(transparent)]
    Open(#[from] OpenError),
    /// There is no shared memory.
    #[error(transparent)]
    Segment(#[from] SegmentError),
    /// It cannot listen.
    #[error(transparent)]
    Bind(#[from] BindError),
    /// There is no such user, or it cannot become that user.
    #[error("`user` in [process]: {0}")]
    User(#[from] UserError),
    /// There is no such group.
    #[error("[access]: {0}")]
    Access(#[source] UserError),
    /// `--strict`, and something is missing.
    #[error("--strict: not every real-time guarantee was obtained, so nothing was started:\n{}", .0.to_string().trim_end())]
    Strict(SetupReport),
    /// A thread is missing.
    #[error("cannot {what}: {}", rt_core::limits::no_thread(.source))]
    NoThread {
        /// Task of the thread.
        what: &'static str,
        /// The system's error.
        source: io::Error,
    },
    /// The system refused something.
    #[error("cannot {what}: {}", rt_core::limits::with_remedy(.source))]
    System {
        /// What was tried.
        what: &'static str,
        /// What it said.
        source: io::Error,
    },
    /// The parent had ended before its child was ready.
    #[error("{0}")]
    Orphaned(String),
    /// The loop did not end when it was asked to.
    #[error(
        "the driver's loop hangs in tick {0} and did not end within 2 s; the motors were switched off behind its back"
    )]
    Hung(u64),
    /// The loop panicked.
    #[error("the driver's loop panicked; the motors were written zero: {0}")]
    Panicked(String),
    /// The thread that serves the socket cannot go on.
    #[error("the driver's service failed; the loop was ended and the motors were written zero: {0}")]
    ServiceFailed(String),
}

impl RunError {
    /// Whether something failed during the run, rather than before it.
    pub fn is_fault(&self) -> bool {
        matches!(self, Self::Panicked(_) | Self::Hung(_) | Self::ServiceFailed(_))
    }
}

/// The driver's tick, where signal handlers and panic hooks find it.
pub(crate) static TICK: AtomicU64 = AtomicU64::new(0);

/// Runs a driver until a signal, a request over the socket or a panic ends it.
///
/// # Errors
/// Whatever kept it from starting, and a panic of its loop.
pub fn run(config: &DriverConfig, options: &RunOptions) -> Result<(), RunError> {
    // A child hears of its parent's end so, and must not outlive it: that a terminal's end is ignored changes nothing there.
    let install =
        if options.parent.is_some() { StopSignals::install_with_hangup } else { StopSignals::install };
    let signals = install().map_err(|source| RunError::System { what: "catch signals", source })?;
    // Whoever holds the other end of standard error would hold up what they ask for.
    hold();
    let user = sandbox::user_to_become(&config.process)?;
    die_with_parent(options)?;
    // Its socket is made here, while sockets may be made.
    let supervisor = Supervisor::from_environment(config.clock, options.parent.is_some());
    let devices = open_devices(config)?;
    let devices = match options.fit {
        Some(fit) => devices.into_iter().map(fit).collect(),
        None => devices,
    };
    let heartbeat = Heartbeat::default();
    let shared =
        Shared { signals: Some(signals.clone()), heartbeat: Some(heartbeat.clone()), ..Shared::default() };
    let (mut report, spin_margin_ns, starter) = loop_thread::spawn(config, &shared)?;
    let no_thread = |what| move |source| RunError::NoThread { what, source };
    let stops =
        stop_thread::Starter::spawn(loop_thread::priority(config)).map_err(no_thread("listen for stops"))?;
    // Where the loop has no real time that is told once.
    let has_real_time = report.find("scheduling").is_some_and(|item| item.obtained);
    report.guarantees.extend(stops.guarantee.clone().filter(|_| has_real_time));
    refuse_if_strict(&report, options)?;
    let wait_mode = loop_thread::choose_wait_mode(config, &report);
    let waiting = Waiting { reply: wait_mode, spin_margin_ns };
    let memory = Arc::new(DriverMemory::create(&describe(config, &devices, wait_mode))?);
    sandbox::say_panics_plainly();
    install_last_words(&memory)?;
    let (sender, inbox) = mail();
    let (log, drain) = rt_core::log::channel(LOG_CAPACITY);
    // In lockstep nobody has deadlines.
    let bell = (config.clock == ClockMode::Real)
        .then(|| {
            let priority = loop_thread::priority(config).filter(|_| has_real_time);
            BellThread::spawn(Arc::clone(&memory), priority, loop_thread::loop_cpu(config))
        })
        .transpose()
        .map_err(no_thread("wake commanders"))?;
    let rope = bell.as_ref().map(|bell| Arc::clone(&bell.rope));
    let cycle = make_cycle(config, Arc::clone(&memory), devices)
        .telling_of_faults(sender.urgent.clone())
        .with_bell(rope.clone());
    let real_loop = RealLoop::new(config, waiting, cycle, inbox, log, shared.clone(), &TICK);
    // From here on nothing new that the loop touches: it would not be locked.
    let named = options.socket.clone().or_else(|| config.socket.clone()).or_else(shm_abi::endpoint::named);
    // The usual places may be made without a word; a name that is mistyped is told by what it makes.
    let missing = named.as_deref().and_then(missing_directory);
    let path = named.unwrap_or_else(shm_abi::endpoint::for_driver);
    give_up_rights(user.as_ref(), &path, &mut report, (&starter, &stops, bell.as_ref()))?;
    drop(bell);
    if user.is_some() {
        // The kernel forgets the request when the user changes.
        die_with_parent(options)?;
    }
    refuse_if_strict(&report, options)?;
    if rustix::process::geteuid().is_root() {
        say(options, format_args!("{STARTED_AS_ROOT}"));
    }
    let rights = config.access.resolve().map_err(RunError::Access)?;
    let server = Server::bind_for(&path, rights)?;
    if let Some(directory) = missing {
        say(options, format_args!("made the directory {} for the socket", directory.display()));
    }
    // The last threads: the sandbox lets none be started.
    let (stop_socket, stop_file) = StopSocket::bind(server.path())?;
    stops.start(stop_socket, sender.urgent.clone(), options.quiet).map_err(no_thread("listen for stops"))?;
    let lost = drain.lost_count();
    log_thread::start_for_driver(drain, options.quiet).map_err(no_thread("start the log"))?;
    refuse_without_descriptors()?;
    report.guarantees.push(sandbox::shut(&config.process));
    memory.tell_setup_report(&report.to_string());
    refuse_if_strict(&report, options)?;
    say(options, format_args!("real-time guarantees:\n{}", report.to_string().trim_end()));
    say(options, format_args!("listening at {}", server.path().display()));
    let thread = starter.start(real_loop);
    supervisor.ready(&format!("listening at {}", server.path().display()));
    let service = Service {
        server,
        stop_file,
        sender,
        rope,
        lost,
        memory,
        signals,
        heartbeat,
        shared,
        options,
        supervisor,
    };
    service.run(thread)
}

/// The directory of a socket, if it is not there.
fn missing_directory(socket: &Path) -> Option<PathBuf> {
    let directory = socket.parent().filter(|directory| !directory.as_os_str().is_empty())?;
    directory.symlink_metadata().is_err().then(|| directory.to_path_buf())
}

/// Makes this process end with its parent, if it is to.
fn die_with_parent(options: &RunOptions) -> Result<(), RunError> {
    if let Some(parent) = options.parent {
        // Not SIGTERM, which ends the process at once when it comes again later: a parent of several threads can die
        // twice to the kernel, first the thread that started this process, then the one that inherited it.
        rt_core::process::die_with_parent(parent, rustix::process::Signal::HUP.as_raw()).map_err(
            |error| {
                options.socket.as_deref().map(remove_directory_of);
                RunError::Orphaned(error.to_string())
            },
        )?;
    }
    Ok(())
}

/// The state machine and devices of a configuration over a memory; what every clock runs.
pub fn make_cycle(config: &DriverConfig, memory: Arc<DriverMemory>, devices: Vec<Box<dyn Device>>) -> Cycle {
    let safety = Safety::new(Ramps {
        in_ns: config.safety.ramp_in_ns,
        out_ns: config.safety.ramp_out_ns,
        max_command_age_ns: config.safety.max_command_age_ns,
    });
    let freshness = match config.reply.mode {
        ReplyMode::OnArrival | ReplyMode::FixedPhase => Freshness(0),
        ReplyMode::NextTick => Freshness(1),
    };
    let protection = Protection {
        safety,
        switches: config.safety.switches,
        workspace_margin_m: config.safety.workspace_margin_m,
    };
    Cycle::new(memory, devices, protection, config.period_ns, freshness)
}

/// What the header of the driver's segment says, but for the set-up report.
pub fn describe(config: &DriverConfig, devices: &[Box<dyn Device>], wait_mode: WaitMode) -> DriverInfo {
    DriverInfo {
        period_ns: config.period_ns,
        reply_budget_ns: match config.clock {
            ClockMode::Real => config.reply.budget_ns,
            ClockMode::Lockstep | ClockMode::Virtual => u64::MAX,
        },
        // A period is rounded to a nanosecond, which is no tick.
        max_command_age_ticks: (config.safety.max_command_age_ns + config.period_ns / 1000)
            / config.period_ns,
        ramp_in_ticks: config.safety.ramp_in_ns.div_ceil(config.period_ns),
        ramp_out_ticks: config.safety.ramp_out_ns.div_ceil(config.period_ns),
        clock_mode: config.clock,
        wait_mode,
        is_commissioning: config.safety.commissioning.is_some(),
        cpu: loop_thread::loop_cpu(config),
        devices: devices.iter().map(|device| device.info().clone()).collect(),
        setup_report: String::new(),
    }
}

fn give_up_rights(
    user: Option<&User>,
    socket: &Path,
    report: &mut SetupReport,
    (starter, stops, bell): (&loop_thread::Starter, &stop_thread::Starter, Option<&BellThread>),
) -> Result<(), RunError> {
    if let Some(user) = user {
        sandbox::make_directory_for(user, socket);
    }
    let others = |keep| {
        starter.give_up_rights(keep);
        stops.give_up_rights(keep);
        if let Some(bell) = bell {
            bell.give_up_rights(keep);
        }
    };
    Ok(sandbox::give_up_rights(user, report, others)?)
}

/// An application that finds none left would wait for an answer, and not be told why.
fn refuse_without_descriptors() -> Result<(), RunError> {
    let any = io::stderr();
    let spare =
        (0..SPARE_DESCRIPTORS).map(|_| any.as_fd().try_clone_to_owned()).collect::<io::Result<Vec<_>>>();
    let what = "keep descriptors for an application";
    spare.map(drop).map_err(|source| RunError::System { what, source })
}

/// Its connection and its process, its segment, two for the pipe that holds the segment's pages, one to map it by; and two
/// for somebody who looks on meanwhile.
const SPARE_DESCRIPTORS: usize = 8;

fn refuse_if_strict(report: &SetupReport, options: &RunOptions) -> Result<(), RunError> {
    if options.strict && !report.all_obtained() {
        return Err(RunError::Strict(report.clone()));
    }
    Ok(())
}

/// Signal handlers and the panic hook write into the segment for as long as the process lives, so its
/// memory is kept that long.
fn install_last_words(memory: &Arc<DriverMemory>) -> Result<(), RunError> {
    let kept: &'static Arc<DriverMemory> = Box::leak(Box::new(Arc::clone(memory)));
    install_panic_hook(&kept.epitaph, &TICK);
    install_fatal_handlers(&kept.epitaph, &TICK)
        .map_err(|source| RunError::System { what: "catch fatal signals", source })
}
