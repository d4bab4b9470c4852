//! A commander that keeps to the rules: it answers every frame at once, always with the same force.

use patience::prelude::*;
use shm_abi::client::{Attachment, Connection};
use shm_abi::{Command, CommanderMemory, DriverView};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

/// It answers until it is dropped.
#[derive(Debug)]
pub struct Commander {
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<CommanderMemory>>,
    connection: Option<Connection>,
}

impl Commander {
    /// Begins; all devices get the force (N).
    pub fn start(attachment: Attachment, force_on_user_n: [f64; 3]) -> Self {
        let Attachment { driver, commander, connection, .. } = attachment;
        let commander = commander.expect("the lease");
        let stop = Arc::new(AtomicBool::new(false));
        let stopping = Arc::clone(&stop);
        let thread = std::thread::spawn(move || {
            let mut seen = None;
            while !stopping.load(Ordering::Relaxed) {
                driver.sleep_for_frame(seen, &commander, Duration::from_millis(5));
                let latest = driver.latest_tick();
                if latest != seen {
                    seen = latest;
                    answer(&driver, &commander, commander.lease(), force_on_user_n);
                }
            }
            commander
        });
        Self { stop, thread: Some(thread), connection: Some(connection) }
    }

    /// Ends the lease, and returns the memory that was its.
    pub fn retire(mut self) -> CommanderMemory {
        drop(self.connection.take());
        self.join().expect("it is stopped once")
    }

    fn join(&mut self) -> Option<CommanderMemory> {
        self.stop.store(true, Ordering::Relaxed);
        self.thread.take().map(|thread| thread.bounded_join().expect("the thread does not panic"))
    }
}

impl Drop for Commander {
    fn drop(&mut self) {
        self.join();
    }
}

/// Answers the newest frame under this lease with the same force for all devices (N).
pub fn answer(driver: &DriverView, commander: &CommanderMemory, lease: u64, force_on_user_n: [f64; 3]) {
    let Some(tick) = driver.latest_tick() else { return };
    let devices = driver.info().devices.len();
    let mut command = Command::zero(tick, lease, devices as u64);
    command.devices[..devices].iter_mut().for_each(|device| device.force_on_user_n = force_on_user_n);
    commander.publish(&command, driver);
}
