//! The driver's loop and socket in the test's own process, with devices that the test makes up.
//!
//! Model: what the driver's process does, but for signals and set-up: the loop in a thread, the socket in
//! another, the mail between them.

use io_driver::config::DriverConfig;
use io_driver::device::Device;
use io_driver::driver::{describe, make_cycle};
use io_driver::mail::{Letter, Sender, mail};
use io_driver::real_loop::{Ended, RealLoop, Shared, Waiting};
use io_driver::zeroing::DeviceSet;
use patience::BoundedThread;
use rt_core::log::RtLogDrain;
use shm_abi::DriverMemory;
use shm_abi::doorbell::WaitMode;
use shm_abi::server::{Server, ServerEvent};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;
use tempfile::TempDir;

/// How often the socket's thread looks whether the loop has ended.
const POLL: Duration = Duration::from_millis(5);

/// A driver that runs; it stops when dropped.
#[derive(Debug)]
pub struct Hosted {
    /// Its memory.
    pub memory: Arc<DriverMemory>,
    socket: PathBuf,
    shared: Shared,
    loop_thread: Option<JoinHandle<Ended>>,
    socket_thread: Option<JoinHandle<()>>,
    _directory: TempDir,
}

impl Hosted {
    /// Starts one. The configuration's own devices are not opened.
    pub fn start(config: &str, devices: Vec<Box<dyn Device>>) -> Self {
        let config = DriverConfig::parse(config, Path::new("<test>")).expect("a configuration");
        let info = describe(&config, &devices, WaitMode::Futex);
        let memory = Arc::new(DriverMemory::create(&info).expect("memory"));
        let directory = tempfile::tempdir().expect("a directory");
        let socket = directory.path().join("driver.sock");
        let server = Server::bind(&socket).expect("a socket");
        let (sender, inbox) = mail();
        let (log, drain) = rt_core::log::channel(16);
        let shared = Shared::default();
        let tick: &'static AtomicU64 = Box::leak(Box::default());
        let cycle = make_cycle(&config, Arc::clone(&memory), devices);
        let waiting = Waiting { reply: WaitMode::Futex, spin_margin_ns: 0 };
        let real_loop = RealLoop::new(&config, waiting, cycle, inbox, log, shared.clone(), tick);
        let desk =
            Desk { server, sender, _drain: drain, memory: Arc::clone(&memory), shared: shared.clone() };
        Self {
            memory,
            socket,
            shared,
            loop_thread: Some(std::thread::spawn(|| real_loop.run())),
            socket_thread: Some(std::thread::spawn(|| desk.serve())),
            _directory: directory,
        }
    }

    /// Where it listens.
    pub fn socket(&self) -> &Path {
        &self.socket
    }

    /// Stops it if it runs, and says how its loop ended.
    pub fn stop(mut self) -> Ended {
        self.shared.stop.store(true, Ordering::Relaxed);
        self.join().expect("it is stopped once").expect("the loop catches its own panics")
    }

    /// Waits for its loop to end by itself.
    pub fn end(mut self) -> Ended {
        self.join().expect("it ends once").expect("the loop catches its own panics")
    }

    fn join(&mut self) -> Option<std::thread::Result<Ended>> {
        let ended = self.loop_thread.take().map(BoundedThread::bounded_join);
        if let Some(thread) = self.socket_thread.take() {
            let _ = thread.bounded_join();
        }
        ended
    }
}

impl Drop for Hosted {
    fn drop(&mut self) {
        self.shared.stop.store(true, Ordering::Relaxed);
        self.join();
    }
}

/// The socket's thread.
struct Desk {
    server: Server,
    sender: Sender,
    _drain: RtLogDrain,
    memory: Arc<DriverMemory>,
    shared: Shared,
}

impl Desk {
    fn serve(mut self) {
        let mut events = Vec::new();
        while !self.shared.ended.load(Ordering::Acquire) {
            self.server.poll(&self.memory, POLL, &mut events).expect("the socket works");
            for event in events.drain(..) {
                pass_on(event, &mut self.sender);
            }
            self.sender.clear_waste();
        }
    }
}

fn pass_on(event: ServerEvent, sender: &mut Sender) {
    let letter = match event {
        ServerEvent::LeaseGranted { view, .. } => Letter::Grant(view),
        ServerEvent::ZeroRequested { devices, .. } => Letter::Zero(DeviceSet(devices)),
        ServerEvent::LeaseEnded { lease } => return sender.urgent.end_lease(lease),
        ServerEvent::EmergencyStopRequested { user, asked_ns, .. } => {
            sender.urgent.stop(user, asked_ns);
            return;
        }
        ServerEvent::ClearFaultRequested { asked_ns, .. } => {
            let _ = sender.urgent.clear_fault(asked_ns, |_| true);
            return;
        }
        ServerEvent::LeaseRefused | ServerEvent::StopRequested { .. } | ServerEvent::Trouble { .. } => return,
    };
    sender.post(letter).expect("the loop collects its mail");
}
