//! The driver as a process: sets itself up, starts the loop in a thread of its own, serves the socket.
//!
//! Model: everything that can fail or allocate happens before the loop's first tick or in this thread.
//! The order is: open the devices, set up the loop's thread and look at what was obtained, make the
//! memory, give up all rights, listen, shut the sandbox, go. Whatever ends the process, the loop writes zero first.

use crate::config::{DriverConfig, ReplyMode, SpinMargin};
use crate::cycle::{Cycle, Freshness, Protection};
use crate::device::Device;
use crate::mail::{Letter, Sender, mail};
use crate::meter::bump;
use crate::open::{OpenError, open_devices};
use crate::real_loop::{Ended, RealLoop, Shared, Waiting};
use crate::safety::{Ramps, Safety};
use crate::sandbox;
use crate::say;
use crate::supervisor::Supervisor;
use rt_core::calibrate;
use rt_core::epitaph::{EpitaphKind, EpitaphRef, install_fatal_handlers, install_panic_hook};
use rt_core::histogram::Histogram;
use rt_core::log::{LogLevel, LogLine, RtLogDrain};
use rt_core::privileges::{Keep, User, UserError, reduce_thread};
use rt_core::setup::{Guarantee, SetupGuards, SetupReport, SetupRequest};
use rt_core::signals::StopSignals;
use shm_abi::DriverMemory;
use shm_abi::doorbell::WaitMode;
use shm_abi::segment::{ClockMode, DriverInfo, SegmentError};
use shm_abi::server::{BindError, Server, ServerEvent};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc;
use std::thread::JoinHandle;
use std::time::Duration;
use thiserror::Error;

/// How often the socket's thread looks at signals and at the log when nothing else happens.
const POLL: Duration = Duration::from_millis(20);
/// Records that may wait for the log's slow side.
const LOG_CAPACITY: usize = 1024;
/// Touched in advance, so that no call chain of the loop is the first to need a page of stack.
const STACK_BYTES: usize = 256 * 1024;

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
    /// `--strict`, and something is missing.
    #[error("--strict: not every real-time guarantee was obtained, so nothing was started:\n{}", .0.to_string().trim_end())]
    Strict(SetupReport),
    /// The system refused something.
    #[error("cannot {what}: {source}")]
    System {
        /// What was tried.
        what: &'static str,
        /// What it said.
        source: io::Error,
    },
    /// The parent had ended before its child was ready.
    #[error("{0}")]
    Orphaned(String),
    /// The loop panicked.
    #[error("the driver's loop panicked; the motors were written zero: {0}")]
    Panicked(String),
}

impl RunError {
    /// Whether something failed during the run, rather than before it.
    pub fn is_fault(&self) -> bool {
        matches!(self, Self::Panicked(_))
    }
}

/// The driver's tick, where signal handlers and panic hooks find it.
static TICK: AtomicU64 = AtomicU64::new(0);

/// Runs a driver until a signal, a request over the socket or a panic ends it.
///
/// # Errors
/// Whatever kept it from starting, and a panic of its loop.
pub fn run(config: &DriverConfig, options: &RunOptions) -> Result<(), RunError> {
    let signals =
        StopSignals::install().map_err(|source| RunError::System { what: "catch signals", source })?;
    let user = sandbox::user_to_become(&config.process)?;
    die_with_parent(options)?;
    // Its socket is made here, while sockets may be made.
    let supervisor = Supervisor::from_environment(config.clock, options.parent.is_some());
    let devices = open_devices(config)?;
    let devices = match options.fit {
        Some(fit) => devices.into_iter().map(fit).collect(),
        None => devices,
    };
    let shared = Shared::default();
    let (mut report, spin_margin_ns, starter) = spawn_loop(config, &shared)?;
    refuse_if_strict(&report, options)?;
    let wait_mode = choose_wait_mode(config, &report);
    let waiting = Waiting { reply: wait_mode, spin_margin_ns };
    let memory = Arc::new(DriverMemory::create(&describe(config, &devices, wait_mode))?);
    if config.process.sandbox {
        sandbox::say_panics_plainly();
    }
    install_last_words(&memory)?;
    let (sender, inbox) = mail();
    let (log, drain) = rt_core::log::channel(LOG_CAPACITY);
    let cycle = make_cycle(config, Arc::clone(&memory), devices);
    let real_loop = RealLoop::new(config, waiting, cycle, inbox, log, shared.clone(), &TICK);
    // From here on nothing new that the loop touches: it would not be locked.
    let path = options.socket.clone().or_else(|| config.socket.clone());
    let path = path.unwrap_or_else(shm_abi::endpoint::for_driver);
    give_up_rights(user.as_ref(), &path, &mut report, &starter)?;
    if user.is_some() {
        // The kernel forgets the request when the user changes.
        die_with_parent(options)?;
    }
    refuse_if_strict(&report, options)?;
    if rustix::process::geteuid().is_root() {
        say(options, format_args!("{STARTED_AS_ROOT}"));
    }
    let server = Server::bind(&path)?;
    report.guarantees.push(sandbox::shut(&config.process));
    memory.tell_setup_report(&report.to_string());
    refuse_if_strict(&report, options)?;
    say(options, format_args!("real-time guarantees:\n{}", report.to_string().trim_end()));
    say(options, format_args!("listening at {}", server.path().display()));
    let thread = starter.start(real_loop);
    supervisor.ready(&format!("listening at {}", server.path().display()));
    let mut service = Service { server, sender, drain, memory, signals, shared, options, supervisor };
    let served = service.serve();
    service.finish(thread, served)
}

/// Makes this process end with its parent, if it is to.
fn die_with_parent(options: &RunOptions) -> Result<(), RunError> {
    if let Some(parent) = options.parent {
        // Not SIGTERM, which ends the process at once when it comes twice: a parent of several threads can die
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
        in_ticks: config.safety.ramp_in_ticks,
        out_ticks: config.safety.ramp_out_ticks,
        max_command_age_ticks: config.safety.max_command_age_ticks,
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
        max_command_age_ticks: config.safety.max_command_age_ticks,
        ramp_in_ticks: config.safety.ramp_in_ticks,
        ramp_out_ticks: config.safety.ramp_out_ticks,
        clock_mode: config.clock,
        wait_mode,
        is_commissioning: config.safety.commissioning.is_some(),
        cpu: loop_cpu(config),
        devices: devices.iter().map(|device| device.info().clone()).collect(),
        setup_report: String::new(),
    }
}

/// The configured CPU, else the last isolated one, else the last one, where the fewest interrupts land; none on a
/// single-CPU machine, which the application needs as well.
pub(crate) fn loop_cpu(config: &DriverConfig) -> Option<usize> {
    if config.clock != ClockMode::Real {
        return config.real_time.cpu;
    }
    let cpus = rt_core::cpu::loop_cpus();
    config.real_time.cpu.or_else(|| cpus.last().copied().filter(|_| cpus.len() > 1))
}

fn setup_request(config: &DriverConfig) -> SetupRequest {
    // In lockstep nothing is on time by design, so nothing is asked for.
    if config.clock != ClockMode::Real {
        return SetupRequest::default();
    }
    SetupRequest {
        fifo_priority: config.real_time.priority,
        cpu: loop_cpu(config),
        lock_memory: config.real_time.lock_memory,
        prefault_stack_bytes: STACK_BYTES,
        prefault_heap_bytes: 0,
        timer_slack_ns: Some(1),
        dma_latency_us: Some(0),
    }
}

/// Spinning is right only with real-time rights on one CPU of several; else it starves whom it waits for. A
/// driver that is confined to a single CPU cannot know where the application is, so it does not spin unless
/// told to.
fn choose_wait_mode(config: &DriverConfig, report: &SetupReport) -> WaitMode {
    if config.clock != ClockMode::Real {
        return WaitMode::Futex;
    }
    let cpu = loop_cpu(config);
    // Not by number: an isolated CPU is not among those that the process was started on.
    let leaves_a_cpu = rt_core::cpu::online_cpus().into_iter().any(|other| Some(other) != cpu);
    let owns_cpu = cpu.is_some() && leaves_a_cpu && config.real_time.priority.is_some();
    let obtained =
        ["scheduling", "cpu"].iter().all(|name| report.find(name).is_some_and(|item| item.obtained));
    config.real_time.wait.unwrap_or(if owns_cpu && obtained { WaitMode::Spin } else { WaitMode::Futex })
}

/// The loop's thread, set up and waiting for its loop.
struct Starter {
    send: mpsc::SyncSender<Order>,
    thread: JoinHandle<Ended>,
}

/// What the loop's thread is to do next.
enum Order {
    /// Give up its rights, which only it can, and drop the sender when that is done.
    GiveUpRights(Keep, mpsc::SyncSender<()>),
    /// Run the loop to its end.
    Run(Box<RealLoop>),
}

impl Starter {
    fn give_up_rights(&self, keep: Keep) {
        let (send_done, done) = mpsc::sync_channel(0);
        // Both fail only if the thread is gone, which joining it will tell.
        let _ = self.send.send(Order::GiveUpRights(keep, send_done));
        let _ = done.recv();
    }

    fn start(self, real_loop: RealLoop) -> JoinHandle<Ended> {
        let _ = self.send.send(Order::Run(Box::new(real_loop)));
        self.thread
    }
}

/// Starts the thread and sets it up; what is obtained must be known before the memory is described.
fn spawn_loop(config: &DriverConfig, shared: &Shared) -> Result<(SetupReport, u64, Starter), RunError> {
    let request = setup_request(config);
    let (send_report, receive_report) = mpsc::sync_channel(1);
    let (send, receive) = mpsc::sync_channel::<Order>(1);
    let ended = Arc::clone(&shared.ended);
    let margin =
        if config.clock == ClockMode::Real { config.real_time.spin_margin } else { SpinMargin::Fixed(0) };
    let body = move || {
        let (mut report, guards) = rt_core::setup::apply(&request);
        let spin_margin_ns = settle_spin_margin(margin, &mut report);
        let _ = send_report.send((report, spin_margin_ns));
        let end = run_when_told(&receive, guards);
        ended.store(true, Ordering::Release);
        end
    };
    let thread = std::thread::Builder::new()
        .name("driver-loop".into())
        .spawn(body)
        .map_err(|source| RunError::System { what: "start the loop's thread", source })?;
    let (report, spin_margin_ns) =
        receive_report.recv().map_err(|_| RunError::Panicked("during its set-up".into()))?;
    Ok((report, spin_margin_ns, Starter { send, thread }))
}

/// Measures on the thread that calls, which has to be set up as it will run.
fn settle_spin_margin(margin: SpinMargin, report: &mut SetupReport) -> u64 {
    match margin {
        SpinMargin::Fixed(ns) => ns,
        SpinMargin::Calibrated { at_most_ns } => {
            let lateness = calibrate::sleep_lateness(calibrate::SLEEPS);
            let chosen = calibrate::spin_margin_ns(&lateness, at_most_ns);
            report.guarantees.push(judge_spin_margin(&lateness, chosen));
            chosen
        }
    }
}

fn judge_spin_margin(lateness: &Histogram, chosen_ns: u64) -> Guarantee {
    let us = |ns: u64| ns as f64 / 1e3;
    let wanted_ns = calibrate::wanted_margin_ns(lateness);
    let p99 = lateness.percentile(0.99).unwrap_or(0);
    let remedy = (wanted_ns > chosen_ns).then(|| {
        "sleeps end later than spinning can make up for; `io-driver doctor` looks for the cause".to_owned()
    });
    Guarantee::circumstance(
        "spin margin",
        "what late sleeps need",
        format!("{:.0} us; 99 of 100 sleeps end within {:.0} us", us(chosen_ns), us(p99)),
        remedy,
    )
}

/// The guards are kept as long as the loop runs.
fn run_when_told(receive: &mpsc::Receiver<Order>, _guards: SetupGuards) -> Ended {
    loop {
        match receive.recv() {
            Ok(Order::GiveUpRights(keep, _done)) => reduce_thread(keep),
            Ok(Order::Run(real_loop)) => return real_loop.run(),
            // The start failed elsewhere, which was told there.
            Err(_) => return Ended::Stopped,
        }
    }
}

fn give_up_rights(
    user: Option<&User>,
    socket: &Path,
    report: &mut SetupReport,
    starter: &Starter,
) -> Result<(), RunError> {
    if let Some(user) = user {
        sandbox::make_directory_for(user, socket);
    }
    Ok(sandbox::give_up_rights(user, report, |keep| starter.give_up_rights(keep))?)
}

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

fn say(options: &RunOptions, message: std::fmt::Arguments<'_>) {
    if !options.quiet {
        say::say(format_args!("io-driver: {message}"));
    }
}

/// Removes the socket, and with it what a parent that was killed cannot remove.
fn tidy_up(server: Server, options: &RunOptions) {
    let path = server.path().to_path_buf();
    drop(server);
    if options.parent.is_some() {
        remove_directory_of(&path);
    }
}

/// The directory that a parent made for its child's socket, and nothing else.
fn remove_directory_of(socket: &Path) {
    if let Some(directory) = socket.parent() {
        // It fails, rightly, if anything lies in it.
        let _ = std::fs::remove_dir(directory);
    }
}

/// For the service manager; the rest is told by `io-driver status`.
fn status_line(memory: &DriverMemory) -> String {
    let get = |word: &AtomicU64| word.load(Ordering::Relaxed);
    let c = &memory.counters;
    let [ticks, overruns, leases, faults] = [&c.ticks, &c.overruns, &c.leases_granted, &c.faults].map(get);
    format!("{ticks} ticks, {overruns} overruns, {leases} leases granted, {faults} faults")
}

/// The socket's thread.
struct Service<'a> {
    server: Server,
    sender: Sender,
    drain: RtLogDrain,
    memory: Arc<DriverMemory>,
    signals: StopSignals,
    shared: Shared,
    options: &'a RunOptions,
    supervisor: Supervisor,
}

impl Service<'_> {
    /// Serves until something asks the driver to stop; returns what.
    fn serve(&mut self) -> Result<String, RunError> {
        let mut events = Vec::new();
        loop {
            self.server
                .poll(&self.memory, POLL, &mut events)
                .map_err(|source| RunError::System { what: "wait at the socket", source })?;
            for event in events.drain(..) {
                if let Some(reason) = self.pass_on(event) {
                    return Ok(reason);
                }
            }
            self.sender.clear_waste();
            self.write_log();
            self.supervisor.turn(TICK.load(Ordering::Relaxed), || status_line(&self.memory));
            if let Some(signal) = self.signals.requested() {
                return Ok(format!("signal {signal}"));
            }
            if self.shared.ended.load(Ordering::Acquire) {
                return Ok("the loop ended".into());
            }
        }
    }

    /// Returns why to stop, if the event says so.
    fn pass_on(&mut self, event: ServerEvent) -> Option<String> {
        match event {
            ServerEvent::LeaseGranted { view, pid, name } => {
                bump(&self.memory.counters.leases_granted);
                say(self.options, format_args!("lease {} to process {pid} ({name})", view.lease()));
                self.post(Letter::Grant(view));
            }
            ServerEvent::LeaseEnded { lease } => {
                say(self.options, format_args!("lease {lease} ended"));
                self.post(Letter::End(lease));
            }
            ServerEvent::LeaseRefused => bump(&self.memory.counters.leases_refused),
            ServerEvent::ClearFaultRequested => self.post(Letter::ClearFault),
            ServerEvent::EmergencyStopRequested { pid } => {
                say(self.options, format_args!("emergency stop, asked for by process {pid}"));
                self.post(Letter::EmergencyStop);
            }
            ServerEvent::Trouble { message } => say::say(format_args!("io-driver: {message}")),
            ServerEvent::StopRequested { pid } => return Some(format!("request of process {pid}")),
        }
        None
    }

    /// The loop collects its mail every tick; if the queue is full it has stood still for long, and waiting
    /// here is all that is left.
    fn post(&mut self, letter: Letter) {
        let mut letter = letter;
        while let Err(returned) = self.sender.post(letter) {
            if self.shared.ended.load(Ordering::Acquire) {
                return;
            }
            letter = returned;
            std::thread::sleep(POLL);
        }
    }

    fn write_log(&mut self) {
        let quiet = self.options.quiet;
        self.drain.drain(|line: LogLine| {
            if !quiet || line.level > LogLevel::Info {
                say::say(format_args!("io-driver: tick {}: {}", line.tick, line.text));
            }
        });
        self.memory.counters.log_dropped.store(self.drain.lost(), Ordering::Relaxed);
    }

    /// Ends the loop, writes the last words and says how it was.
    fn finish(mut self, thread: JoinHandle<Ended>, served: Result<String, RunError>) -> Result<(), RunError> {
        self.supervisor.stopping(served.as_deref().unwrap_or("a fault of the socket"));
        self.shared.stop.store(true, Ordering::Relaxed);
        let ended = thread.join();
        self.write_log();
        tidy_up(self.server, self.options);
        let reason = served?;
        match ended {
            Ok(Ended::Stopped) => {
                let tick = TICK.load(Ordering::Relaxed);
                EpitaphRef::new(&self.memory.epitaph).write(EpitaphKind::Stopped, tick, &reason);
                say(self.options, format_args!("stopped in tick {tick}: {reason}; motors were written zero"));
                Ok(())
            }
            Ok(Ended::Panicked) | Err(_) => {
                let words = rt_core::epitaph::read(&self.memory.epitaph);
                Err(RunError::Panicked(words.map_or_else(String::new, |words| words.to_string())))
            }
        }
    }
}
