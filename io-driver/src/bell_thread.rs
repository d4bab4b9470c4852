//! The thread that wakes a commander that sleeps, so that the loop need not.
//!
//! Problem: the futexes of all processes share the buckets of one hash table, and whoever wakes one walks its bucket, which holds
//! a lock that on ordinary kernels is a spinning one. Anybody can queue millions of sleepers there: a loop that woke a
//! commander stood still for hundreds of milliseconds, force on.
//!
//! Model: the loop writes into an eventfd that nobody else has, where one thread waits at most. That thread wakes the commander.
//! It runs on any CPU but the loop's, where there is another, at the next lower real-time priority; below the thread that takes
//! stops, however long a wake takes it, and after a long one it rests for longer.
//!
//! Cost: to the loop a system call in ticks in which a commander sleeps.

use rt_core::privileges::{Keep, reduce_thread};
use rt_core::setup::promote_beside;
use rustix::event::{EventfdFlags, eventfd};
use rustix::time::ClockId;
use shm_abi::DriverMemory;
use shm_abi::segment::Sleeper;
use std::io;
use std::os::fd::OwnedFd;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// A wake that takes more of a CPU walks past more sleepers than there are in earnest.
const LONG_NS: u64 = 200_000;
/// Rest after one, as a multiple of what it took.
const REST: u32 = 9;
/// A read, a lock and a wake.
const STACK_BYTES: usize = 64 * 1024;

/// The loop's end of it.
#[derive(Debug)]
pub struct BellRope {
    event: OwnedFd,
    /// Whom to wake. Neither side of it has deadlines.
    sleeper: Mutex<Option<Sleeper>>,
}

impl BellRope {
    /// Has the commander woken, soon. For the loop.
    pub fn pull(&self) {
        // Refused only with 2^64 pulls that nobody took.
        let _ = rustix::io::write(&self.event, &1_u64.to_ne_bytes());
    }

    /// From now on this is who is woken.
    pub(crate) fn wakes(&self, sleeper: Sleeper) {
        *self.sleeper.lock().unwrap_or_else(PoisonError::into_inner) = Some(sleeper);
    }

    /// Waits until somebody pulls.
    fn wait(&self) -> io::Result<()> {
        rustix::io::retry_on_intr(|| rustix::io::read(&self.event, &mut [0; 8]))?;
        Ok(())
    }
}

/// The thread, which begins when this is dropped.
pub(crate) struct BellThread {
    pub(crate) rope: Arc<BellRope>,
    keep: SyncSender<Keep>,
    reduced: Receiver<()>,
}

impl BellThread {
    /// Starts it, for a loop of this priority on this CPU.
    ///
    /// # Errors
    /// Refusal of another thread or of a descriptor by the system.
    pub(crate) fn spawn(
        memory: Arc<DriverMemory>,
        loop_priority: Option<u8>,
        loop_cpu: Option<usize>,
    ) -> io::Result<Self> {
        let event = eventfd(0, EventfdFlags::CLOEXEC)?;
        let rope = Arc::new(BellRope { event, sleeper: Mutex::new(None) });
        let (keep, given_up) = sync_channel::<Keep>(1);
        let (tell_reduced, reduced) = sync_channel(1);
        let pulled = Arc::clone(&rope);
        let thread = std::thread::Builder::new().name("bell".into()).stack_size(STACK_BYTES);
        thread.spawn(move || {
            if let Some(cpu) = loop_cpu {
                rt_core::cpu::leave(cpu);
            }
            if let Some(priority) = loop_priority {
                // Without it a commander is woken later.
                let _ = promote_beside("bell", priority.saturating_sub(1).max(1));
            }
            for keep in given_up {
                reduce_thread(keep);
                let _ = tell_reduced.send(());
            }
            ring_when_pulled(&pulled, &memory);
        })?;
        Ok(Self { rope, keep, reduced })
    }

    pub(crate) fn give_up_rights(&self, keep: Keep) {
        // Both fail only if the thread is gone.
        let _ = self.keep.send(keep);
        let _ = self.reduced.recv();
    }
}

/// Time of a CPU that this thread has had: one that waits for a CPU walks past nobody.
fn spent_ns() -> u64 {
    let now = rustix::time::clock_gettime(ClockId::ThreadCPUTime);
    let seconds = u64::try_from(now.tv_sec).unwrap_or(0);
    seconds.saturating_mul(1_000_000_000).saturating_add(u64::try_from(now.tv_nsec).unwrap_or(0))
}

fn ring_when_pulled(rope: &BellRope, memory: &DriverMemory) {
    while rope.wait().is_ok() {
        let sleeper = rope.sleeper.lock().unwrap_or_else(PoisonError::into_inner).clone();
        let Some(sleeper) = sleeper else { continue };
        let begun_ns = spent_ns();
        sleeper.wake(memory);
        let took_ns = spent_ns().saturating_sub(begun_ns);
        if took_ns > LONG_NS {
            std::thread::sleep(Duration::from_nanos(took_ns) * REST);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::told;
    use bytemuck::Zeroable;
    use patience::prelude::*;
    use shm_abi::Frame;
    use shm_abi::segment::{CommanderMemory, CommanderView, DriverView};
    use std::os::fd::AsFd;
    use std::sync::atomic::Ordering;

    #[test]
    fn a_commander_that_sleeps_is_woken_by_the_thread_that_the_loop_asks() {
        let memory = Arc::new(told::memory());
        let bell = BellThread::spawn(Arc::clone(&memory), None, Some(0)).unwrap();
        let rope = Arc::clone(&bell.rope);
        drop(bell);
        let (view, fd) = CommanderView::create(1).unwrap();
        rope.wakes(view.sleeper());
        let commander = Arc::new(CommanderMemory::map(fd.as_fd()).unwrap());
        let driver = DriverView::map(memory.fd()).unwrap();
        let sleeping = Arc::clone(&commander);
        let asleep = std::thread::spawn(move || {
            driver.sleep_for_frame(None, &sleeping, patience::limit() * 2);
            driver.latest_tick()
        });
        patience::until("it sleeps", || commander.bell.owner_sleeps.load(Ordering::Relaxed) != 0);
        std::thread::sleep(Duration::from_millis(20));
        memory.write_frame(&Frame { tick: 3, ..Frame::zeroed() });
        assert!(memory.tell_frame(3, Some(&view)), "it sleeps, and somebody has to wake it");
        std::thread::sleep(Duration::from_millis(20));
        assert!(!asleep.is_finished(), "what the loop does itself wakes nobody");
        rope.pull();
        assert_eq!(asleep.bounded_join().unwrap(), Some(3));
    }
}
