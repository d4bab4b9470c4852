//! A driver that lies: the true socket and memory, and frames that a test makes up.

use bytemuck::Zeroable;
use patience::BoundedThread;
use rt_core::clock::monotonic_ns;
use shm_abi::doorbell::WaitMode;
use shm_abi::frame::DEVICE_POSITION_VALID;
use shm_abi::layout::DriverHeader;
use shm_abi::segment::{ClockMode, DeviceInfo, DriverInfo};
use shm_abi::server::{Server, ServerEvent};
use shm_abi::{CommanderView, DriverMemory, DriverState, Frame};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// Ticks of the run before the first lie.
const TRUE_TICKS: i64 = 200;
/// A tick.
const PERIOD: Duration = Duration::from_millis(1);

/// The driver, in a thread of the test.
pub struct Liar {
    socket: PathBuf,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
    _directory: TempDir,
}

impl Liar {
    /// One whose header lies from the beginning.
    pub fn about_itself(lie: fn(&DriverHeader)) -> Self {
        Self::start(lie, (0, |_| ()))
    }

    /// One whose frames lie after a while.
    pub fn about_frames(lie: fn(&mut Frame)) -> Self {
        Self::start(|_| (), (TRUE_TICKS, lie))
    }

    /// One whose frames lie from t = 0 on.
    pub fn about_all_frames(lie: fn(&mut Frame)) -> Self {
        Self::start(|_| (), (0, lie))
    }

    /// Where it listens.
    pub fn socket(&self) -> &Path {
        &self.socket
    }

    fn start(about_itself: fn(&DriverHeader), about_frames: (i64, fn(&mut Frame))) -> Self {
        let directory = tempfile::tempdir().expect("a directory");
        let socket = directory.path().join("driver.sock");
        let memory = DriverMemory::create(&info()).expect("memory");
        about_itself(&memory.header);
        let server = Server::bind(&socket).expect("a socket");
        let stop = Arc::<AtomicBool>::default();
        let ending = Arc::clone(&stop);
        let thread = std::thread::spawn(move || serve(&memory, server, about_frames, &ending));
        Self { socket, stop, thread: Some(thread), _directory: directory }
    }
}

impl Drop for Liar {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        let _ = self.thread.take().map(BoundedThread::bounded_join);
    }
}

fn serve(
    memory: &DriverMemory,
    mut server: Server,
    (true_ticks, lie): (i64, fn(&mut Frame)),
    stop: &AtomicBool,
) {
    let mut events = Vec::new();
    // And the tick of the first answer.
    let mut commander: Option<(CommanderView, Option<u64>)> = None;
    let (begun, mut tick) = (Instant::now(), 0);
    while !stop.load(Ordering::Relaxed) {
        server.poll(memory, PERIOD, &mut events).expect("the socket works");
        for event in events.drain(..) {
            match event {
                ServerEvent::LeaseGranted { view, .. } => commander = Some((view, None)),
                ServerEvent::LeaseEnded { .. } => commander = None,
                _ => {}
            }
        }
        if let Some((view, began @ None)) = &mut commander {
            *began = view.latest_tick().map(|_| tick);
        }
        let view = commander.as_ref().map(|(view, _)| view);
        let mut frame = frame(tick, commander.as_ref().map(|(view, began)| (view.lease(), *began)));
        if frame.run_tick >= true_ticks {
            lie(&mut frame);
        }
        memory.write_frame(&frame);
        memory.ring(frame.tick, view);
        // As a sound driver's, its ticks go with the clock on a busy machine, too.
        let passed = begun.elapsed().as_nanos() / PERIOD.as_nanos();
        tick = (tick + 1).max(u64::try_from(passed).expect("a test's time"));
    }
}

/// The truth; under a lease, t = 0 is in the tick that follows the first answer.
fn frame(tick: u64, lease: Option<(u64, Option<u64>)>) -> Frame {
    let mut frame =
        Frame { tick, deadline_ns: monotonic_ns(), device_count: 1, run_tick: -1, ..Frame::zeroed() };
    frame.state = DriverState::Idle as u64;
    frame.devices[0].flags = DEVICE_POSITION_VALID;
    if let Some((lease, began)) = lease {
        (frame.lease, frame.state) = (lease, DriverState::Active as u64);
        if let Some(began) = began {
            (frame.authority, frame.run_tick) = (1.0, (tick - began).cast_signed());
        }
    }
    frame
}

fn info() -> DriverInfo {
    let device = DeviceInfo {
        name: "pen".into(),
        kind: "ideal".into(),
        peak_force_n: 8.5,
        continuous_force_n: 8.5,
        workspace_min_m: [-1.0; 3],
        workspace_max_m: [1.0; 3],
        slew_n_per_s: f64::INFINITY,
        speed_limit_m_per_s: f64::INFINITY,
    };
    DriverInfo {
        period_ns: u64::try_from(PERIOD.as_nanos()).expect("a millisecond"),
        reply_budget_ns: 500_000,
        max_command_age_ticks: 5,
        ramp_in_ticks: 10,
        ramp_out_ticks: 10,
        is_commissioning: false,
        clock_mode: ClockMode::Real,
        wait_mode: WaitMode::Futex,
        cpu: None,
        devices: vec![device],
        setup_report: String::new(),
    }
}
