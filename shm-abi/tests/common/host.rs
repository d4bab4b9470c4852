//! A server that polls in the background, so that the blocking client can talk to it from the test.

use super::info;
use patience::BoundedThread;
use patience::limit;
use shm_abi::DriverMemory;
use shm_abi::segment::DriverInfo;
use shm_abi::server::{Server, ServerEvent};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, channel};
use std::thread::JoinHandle;
use std::time::Duration;

pub(crate) struct Host {
    pub(crate) memory: Arc<DriverMemory>,
    pub(crate) events: Receiver<ServerEvent>,
    pub(crate) socket: PathBuf,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Host {
    pub(crate) fn start(directory: &Path) -> Self {
        Self::start_with(directory, &info())
    }

    pub(crate) fn start_with(directory: &Path, info: &DriverInfo) -> Self {
        let socket = directory.join("driver.sock");
        let memory = Arc::new(DriverMemory::create(info).unwrap());
        let mut server = Server::bind(&socket).unwrap();
        let stop = Arc::new(AtomicBool::new(false));
        let (sender, events) = channel();
        let thread = {
            let (memory, stop) = (memory.clone(), stop.clone());
            std::thread::spawn(move || {
                let mut events = Vec::new();
                while !stop.load(Ordering::Relaxed) {
                    server.poll(&memory, Duration::from_millis(5), &mut events).unwrap();
                    events.drain(..).for_each(|event| drop(sender.send(event)));
                }
            })
        };
        Self { memory, events, socket, stop, thread: Some(thread) }
    }

    pub(crate) fn event(&self) -> ServerEvent {
        self.events.recv_timeout(limit()).expect("the server reports what happened")
    }
}

impl Drop for Host {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        let _ = self.thread.take().map(BoundedThread::bounded_join);
    }
}
