//! Watch over the thread that serves the socket, kept by the loop.
//!
//! Problem: a service that is stuck hears nobody any more: no request, no end of a lease. A loop that goes on pushing
//! then pushes with nobody who could end it but by a datagram or a signal.
//! Model: the service counts its turns; the loop adds up the time over which the count stands still, and says so once
//! when that exceeds a limit. Only time in which the loop itself had its turns counts: a process that was stopped, or a
//! machine that stood still, has a silent service and a silent loop, and neither is to blame.
//! Cost: a load and an addition a tick.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// The service's end.
#[derive(Debug, Clone, Default)]
pub struct Heartbeat(Arc<AtomicU64>);

impl Heartbeat {
    /// Another turn.
    pub fn beat(&self) {
        self.0.fetch_add(1, Ordering::Relaxed);
    }

    fn count(&self) -> u64 {
        self.0.load(Ordering::Relaxed)
    }
}

/// The loop's end.
#[derive(Debug)]
pub(crate) struct Watch {
    heartbeat: Heartbeat,
    limit_ns: u64,
    /// The longest time between two looks that counts (ns).
    longest_look_ns: u64,
    seen: u64,
    looked_ns: Option<u64>,
    silent_ns: u64,
}

impl Watch {
    /// A loop with this period looks at least once in each.
    pub(crate) fn new(heartbeat: Heartbeat, limit_ns: u64, period_ns: u64) -> Self {
        let longest_look_ns = period_ns.max(LONGEST_LOOK_NS);
        Self { heartbeat, limit_ns, longest_look_ns, seen: 0, looked_ns: None, silent_ns: 0 }
    }

    /// Whether the service has just been silent for longer than the limit; told once for each silence.
    pub(crate) fn looks_silent(&mut self, now_ns: u64) -> bool {
        let count = self.heartbeat.count();
        let since = self.looked_ns.replace(now_ns).map_or(0, |looked| now_ns.saturating_sub(looked));
        if count != self.seen {
            self.seen = count;
            self.silent_ns = 0;
            return false;
        }
        let was_silent = self.silent_ns > self.limit_ns;
        self.silent_ns += since.min(self.longest_look_ns);
        !was_silent && self.silent_ns > self.limit_ns
    }
}

/// Many ticks of a loop that runs, and little of any limit.
const LONGEST_LOOK_NS: u64 = 20_000_000;

#[cfg(test)]
mod tests {
    use super::*;

    const MS: u64 = 1_000_000;

    fn watch(heartbeat: &Heartbeat) -> Watch {
        Watch::new(heartbeat.clone(), 100 * MS, MS)
    }

    #[test]
    fn a_service_that_is_silent_for_longer_than_the_limit_is_told_once() {
        let heartbeat = Heartbeat::default();
        let mut watch = watch(&heartbeat);
        let told: Vec<u64> = (0..500).filter(|ms| watch.looks_silent(ms * MS)).collect();
        assert_eq!(told, [101]);
        heartbeat.beat();
        let told: Vec<u64> = (500..1000).filter(|ms| watch.looks_silent(ms * MS)).collect();
        assert_eq!(told, [601]);
    }

    #[test]
    fn a_service_that_beats_now_and_then_is_not_silent() {
        let heartbeat = Heartbeat::default();
        let mut watch = watch(&heartbeat);
        for ms in 0..1000 {
            if ms % 100 == 0 {
                heartbeat.beat();
            }
            assert!(!watch.looks_silent(ms * MS), "{ms}");
        }
    }

    #[test]
    fn time_in_which_the_loop_stood_still_as_well_does_not_count() {
        let heartbeat = Heartbeat::default();
        let mut watch = watch(&heartbeat);
        assert!(!watch.looks_silent(0));
        // Four stops of an hour; 20 ms of each count.
        assert!((1..=4).all(|hour| !watch.looks_silent(hour * 3_600_000 * MS)));
        assert!((1..=21).any(|ms| watch.looks_silent((4 * 3_600_000 + ms) * MS)));
    }
}
