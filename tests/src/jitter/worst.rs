//! The worst events, kept with their circumstances.
//!
//! Problem: "one spike in five days" must be explainable when somebody finally looks.
//! Model: of each series the N greatest values with what the kernel counted around them.
//! Invariant: what is kept are the N greatest of all values offered; of equals the earlier ones.
//! Cost: one comparison for a value that is not kept.

use crate::jitter::circumstances::Circumstances;
use serde::{Deserialize, Serialize};

/// One value worth remembering.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Event {
    /// How long it was (ns).
    pub value_ns: u64,
    /// The tick, as its loop counts; `None` where only a whole slice is known.
    pub tick: Option<u64>,
    /// When it began: UTC.
    pub utc: String,
    /// The same since the start of the measurement (s).
    pub at_s: f64,
    /// In which run, from 1.
    pub run: usize,
    /// What went on around it.
    pub circumstances: Circumstances,
}

/// The worst so far.
#[derive(Debug, Clone)]
pub struct WorstKeeper {
    most: usize,
    /// Descending.
    events: Vec<Event>,
}

impl WorstKeeper {
    /// Keeps so many.
    pub fn new(most: usize) -> Self {
        Self { most, events: Vec::with_capacity(most + 1) }
    }

    /// Whether a value would be kept.
    pub fn wants(&self, value_ns: u64) -> bool {
        self.most > 0
            && (self.events.len() < self.most
                || self.events.last().is_some_and(|least| value_ns > least.value_ns))
    }

    /// Keeps it, if it is among the worst.
    pub fn offer(&mut self, event: Event) {
        if self.wants(event.value_ns) {
            let place = self.events.partition_point(|kept| kept.value_ns >= event.value_ns);
            self.events.insert(place, event);
            self.events.truncate(self.most);
        }
    }

    /// The worst first.
    pub fn events(&self) -> &[Event] {
        &self.events
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn event(value_ns: u64, tick: u64) -> Event {
        Event {
            value_ns,
            tick: Some(tick),
            utc: String::new(),
            at_s: 0.0,
            run: 1,
            circumstances: Circumstances::default(),
        }
    }

    proptest! {
        #[test]
        fn the_greatest_are_kept_and_of_equals_the_earlier(
            values in prop::collection::vec(0..50_u64, 0..200),
            most in 0..20_usize,
        ) {
            let mut keeper = WorstKeeper::new(most);
            for (tick, value) in values.iter().enumerate() {
                keeper.offer(event(*value, tick as u64));
            }
            // The slow and obvious way.
            let mut expected: Vec<(u64, u64)> = values.iter().copied().zip(0..).collect();
            expected.sort_by_key(|(value, tick)| (std::cmp::Reverse(*value), *tick));
            expected.truncate(most);
            let kept: Vec<_> = keeper.events().iter().map(|e| (e.value_ns, e.tick.unwrap())).collect();
            prop_assert_eq!(kept, expected);
        }
    }
}
