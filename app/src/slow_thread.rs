//! The thread of the slow list: steps what no finger is near, at its own rate.
//!
//! Model: some hundreds of times a second it looks how many ticks the run has made, and goes on by as many, in steps of a tick.
//! If that takes longer than it should, what is in the slow list goes slower than the rest, and how much is counted: a turn ends
//! in time, and a tick steps no more bodies than it has time for ([`Pace`]), all in turns. For who asks for a body waits for the
//! end of a tick.
//! It has no real-time rights; nobody waits for it. Where orders bring other worlds, it has their lists, too, and steps those
//! of worlds that run.
//! Invariant: it ends with its owner, whatever ended that.

use crate::pace::Pace;
use rt_core::clock::{monotonic_ns, sleep_until_ns};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{self, Receiver};
use std::thread::JoinHandle;
use world::lists::SlowList;

/// From one turn to the next, where there is time (ns): a thing at 1 m/s goes 2 mm.
pub const EVERY_NS: u64 = 2_000_000;
/// A turn takes no longer, but for its last tick (ns).
const MOST_NS: u64 = 10_000_000;
/// A turn makes up for no more ticks.
const MOST_TICKS: u64 = 40;
/// So many bodies are stepped in a tick however busy the machine is: they take a millisecond or two.
const LEAST_BODIES: usize = 64;
/// A tick that steps all bodies takes no more than a third of this (ns).
const PACE_NS: u64 = 9_000_000;

/// The running thread.
pub struct SlowThread {
    thread: Option<JoinHandle<Option<SlowRemains>>>,
    stop: Arc<AtomicBool>,
}

/// What is left when it has ended.
pub struct SlowRemains {
    /// The list.
    pub slow: SlowList,
    /// Ticks that it did not make up for.
    pub late_ticks: u64,
}

impl SlowThread {
    /// Starts it, with the count of the run's ticks and their length.
    ///
    /// # Errors
    /// If the thread cannot be started.
    pub fn start(slow: SlowList, run_ticks: Arc<AtomicU64>, period_ns: u64) -> std::io::Result<Self> {
        Self::start_with(Some(slow), mpsc::channel().1, run_ticks, period_ns)
    }

    /// The same with the lists of worlds that will take over, or with none as yet.
    ///
    /// # Errors
    /// If the thread cannot be started.
    pub fn start_with(
        first: Option<SlowList>,
        later: Receiver<SlowList>,
        run_ticks: Arc<AtomicU64>,
        period_ns: u64,
    ) -> std::io::Result<Self> {
        let stop = Arc::new(AtomicBool::new(false));
        let stopped = Arc::clone(&stop);
        let pace = Pace::new(PACE_NS);
        let lists = SlowLists { lists: first.into_iter().collect(), later, pace };
        let thread = std::thread::Builder::new()
            .name("slow-list".into())
            .spawn(move || go_on(lists, &run_ticks, period_ns, &stopped))?;
        Ok(Self { thread: Some(thread), stop })
    }

    /// Ends it; `None` if it had panicked, or has no list of a world that runs.
    pub fn end(mut self) -> Option<SlowRemains> {
        self.stop.store(true, Ordering::Relaxed);
        self.thread.take()?.join().ok()?
    }
}

impl Drop for SlowThread {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// Those of all worlds, in the order in which these take over.
struct SlowLists {
    lists: Vec<SlowList>,
    later: Receiver<SlowList>,
    pace: Pace,
}

impl SlowLists {
    /// Says how many of the ticks were made whole, in the list where these are fewest.
    fn turn(&mut self, ticks: u32, dt_s: f64) -> u32 {
        self.lists.extend(self.later.try_iter());
        self.lists.retain(|slow| !slow.is_over());
        let (pace, begin_ns) = (&mut self.pace, monotonic_ns());
        let whole = self.lists.iter_mut().map(|slow| {
            let mut seen_ns = monotonic_ns();
            slow.turn_while(ticks, dt_s, |made| {
                let now_ns = monotonic_ns();
                let took_ns = now_ns - std::mem::replace(&mut seen_ns, now_ns);
                made.iter().for_each(|made| pace.take(took_ns, made.awake, made.held > 0));
                (now_ns - begin_ns < MOST_NS).then(|| pace.bodies().max(LEAST_BODIES))
            })
        });
        whole.min().unwrap_or(ticks)
    }

    /// That of the world which runs.
    fn last_begun(self) -> Option<SlowList> {
        self.lists.into_iter().rfind(SlowList::has_begun)
    }
}

fn go_on(
    mut lists: SlowLists,
    run_ticks: &AtomicU64,
    period_ns: u64,
    stopped: &AtomicBool,
) -> Option<SlowRemains> {
    let (mut seen, mut late_ticks, dt_s) = (0, 0, period_ns as f64 / 1e9);
    let mut due_ns = monotonic_ns();
    while !stopped.load(Ordering::Relaxed) {
        // While a driver that was restarted begins again, the count is 0 for a moment.
        let now = run_ticks.load(Ordering::Relaxed).max(seen);
        let passed = now - std::mem::replace(&mut seen, now);
        let whole = lists.turn(passed.min(MOST_TICKS) as u32, dt_s);
        late_ticks += passed - u64::from(whole);
        due_ns = (due_ns + EVERY_NS).max(monotonic_ns());
        sleep_until_ns(due_ns);
    }
    lists.last_begun().map(|slow| SlowRemains { slow, late_ticks })
}
