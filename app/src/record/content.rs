//! Content of a recording's file while it takes the place of an earlier one, as the run sees it from its own thread.

use std::sync::atomic::{AtomicU8, Ordering};

/// Content of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Content {
    /// The earlier one.
    Earlier,
    /// Some of the earlier one, perhaps.
    BeingReplaced,
    /// Its own.
    Replaced,
    /// None.
    Lost,
}

/// [`Content`], as several threads see it.
#[derive(Debug)]
pub(crate) struct ContentState(AtomicU8);

impl ContentState {
    const ALL: [Content; 4] = [Content::Earlier, Content::BeingReplaced, Content::Replaced, Content::Lost];

    pub(super) fn new(content: Content) -> Self {
        Self(AtomicU8::new(content as u8))
    }

    pub(super) fn store(&self, content: Content) {
        self.0.store(content as u8, Ordering::Relaxed);
    }

    /// As it is now.
    pub(crate) fn load(&self) -> Content {
        Self::ALL[usize::from(self.0.load(Ordering::Relaxed)) % Self::ALL.len()]
    }
}
