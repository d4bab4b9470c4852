//! Number of the things that move for which a tick has time, by how long ticks take.
//!
//! Problem: what a heap costs hangs on its shapes, on how it lies and on the machine. A finger in one that takes longer than a
//! tick gets no answers.
//! Model: where two ticks in a row took more than a third of the time between two, fewer are stepped
//! ([`physics::Manipulation::step_at_most`]), as many as would have kept to it by the shorter one of them, or an eighth; where of many nearly all took less
//! than half of that while some waited, more are. One that was held up by something else changes nothing.

/// The number, and what has been seen.
#[derive(Debug, Clone, Copy)]
pub struct Pace {
    most_ns: u64,
    bodies: usize,
    /// Time that the last tick took, if that was too much (ns); twice in a row is counted anew.
    was_over_ns: Option<u64>,
    /// Ticks of this window, and those of them that were not calm.
    ticks: [u32; 2],
}

impl Pace {
    /// Time that a tick may take of so much between two (ns).
    pub const fn most_ns(period_ns: u64) -> u64 {
        period_ns / SHARE
    }

    /// For ticks that are so far apart (ns).
    pub fn new(period_ns: u64) -> Self {
        Self { most_ns: Self::most_ns(period_ns), bodies: FIRST, was_over_ns: None, ticks: [0; 2] }
    }

    /// The most bodies in a tick.
    pub fn bodies(&self) -> usize {
        self.bodies
    }

    /// After a tick that took so long (ns) with so many bodies, while others waited or did not.
    pub fn take(&mut self, took_ns: u64, stepped: usize, others_wait: bool) {
        let is_over = took_ns > self.most_ns;
        let was_over_ns = self.was_over_ns.take().filter(|_| is_over);
        if let Some(was_ns) = was_over_ns {
            // One of the two somebody else may have held up, and the other one perhaps, too.
            let fitting = (stepped as u64).saturating_mul(self.most_ns) / took_ns.min(was_ns);
            self.bodies =
                (fitting as usize).clamp(stepped.min(self.bodies) / MOST_LESS, self.bodies).max(LEAST);
        }
        let is_calm = took_ns < self.most_ns / 2 && others_wait;
        self.ticks = [self.ticks[0] + 1, self.ticks[1] + u32::from(!is_calm)];
        if self.ticks[0] == WINDOW {
            if self.ticks[1] <= WINDOW / 8 {
                self.bodies += (self.bodies / 8).max(1);
            }
            self.ticks = [0; 2];
        }
        if is_over && was_over_ns.is_none() {
            self.was_over_ns = Some(took_ns);
        }
    }
}

/// A tick may take one in so many of the time between two: answers are due after half of it.
const SHARE: u64 = 3;
/// Bodies before anything was seen.
const FIRST: usize = 64;
const LEAST: usize = 4;
/// Two ticks leave one in so many at least.
const MOST_LESS: usize = 8;
/// Ticks of which seven in eight have to be calm.
const WINDOW: u32 = 32;

#[cfg(test)]
mod tests {
    use super::*;

    const MS: u64 = 1_000_000;

    #[test]
    fn what_takes_too_long_becomes_fewer_until_it_fits_and_more_when_it_is_calm() {
        let mut pace = Pace::new(MS);
        // A hundred that take 20 us each.
        for _ in 0..100 {
            let stepped = pace.bodies().min(100);
            pace.take(20_000 * stepped as u64, stepped, stepped < 100);
        }
        assert!((LEAST..=16).contains(&pace.bodies()), "{}", pace.bodies());
        // They have become cheaper.
        for _ in 0..5000 {
            let stepped = pace.bodies().min(100);
            pace.take(2000 * stepped as u64, stepped, stepped < 100);
        }
        assert!((60..100).contains(&pace.bodies()), "{}", pace.bodies());
    }

    #[test]
    fn a_tick_that_was_held_up_alone_changes_nothing_nor_does_calm_without_who_waits() {
        let mut pace = Pace::new(MS);
        for tick in 0..10_000 {
            pace.take(if tick % 3 == 0 { 50 * MS } else { 1000 }, 30, false);
        }
        assert_eq!(pace.bodies(), FIRST);
    }

    #[test]
    fn some_are_always_stepped() {
        let mut pace = Pace::new(MS);
        (0..1000).for_each(|_| pace.take(u64::MAX, pace.bodies(), true));
        assert_eq!(pace.bodies(), LEAST);
    }
}
