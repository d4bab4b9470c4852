//! Content of a recording's file while it takes the place of an earlier one, as the run sees it from its own thread.
//!
//! Model: the recorder's thread announces each change before it makes it ([`ContentState::begin`]); whoever has waited for it in
//! vain leaves it behind ([`ContentState::leave_behind`]). Both are steps of one atomic.
//! Invariant: a thread that was left behind begins no change: an earlier content that is told as kept is kept.

use std::io;
use std::sync::atomic::{AtomicU8, AtomicU64, Ordering};

/// Content of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Content {
    /// The earlier one.
    Earlier,
    /// The earlier one, and behind it bytes by which room was tried.
    Noisy,
    /// Some of the earlier one, perhaps.
    BeingReplaced,
    /// Its own.
    Replaced,
    /// None.
    Lost,
}

/// [`Content`], as several threads see it.
#[derive(Debug)]
pub(crate) struct ContentState {
    /// With [`LEFT_BEHIND`].
    now: AtomicU8,
    noise_bytes: AtomicU64,
}

/// Bit of a state whose thread nobody waits for any more.
const LEFT_BEHIND: u8 = 1 << 7;

impl ContentState {
    const ALL: [Content; 5] =
        [Content::Earlier, Content::Noisy, Content::BeingReplaced, Content::Replaced, Content::Lost];

    pub(super) fn new(content: Content) -> Self {
        Self { now: AtomicU8::new(content as u8), noise_bytes: AtomicU64::new(0) }
    }

    /// Announces a change.
    ///
    /// # Errors
    /// The thread was left behind: nothing may be changed.
    pub(super) fn begin(&self, change: Content) -> io::Result<()> {
        let step = |now: u8| (now & LEFT_BEHIND == 0).then_some(change as u8);
        let begun = self.now.fetch_update(Ordering::Relaxed, Ordering::Relaxed, step);
        begun.map(drop).map_err(|_| io::Error::other("it was given up, since nothing was written for long"))
    }

    /// Tells the outcome of a change.
    pub(super) fn store(&self, content: Content) {
        let step = |now: u8| Some(now & LEFT_BEHIND | content as u8);
        let _ = self.now.fetch_update(Ordering::Relaxed, Ordering::Relaxed, step);
    }

    /// Leaves the thread behind; an earlier content that is found then stays.
    pub(super) fn leave_behind(&self) -> Content {
        Self::content_of(self.now.fetch_or(LEFT_BEHIND, Ordering::Relaxed))
    }

    /// Nobody waits for the thread any more.
    pub(super) fn is_left_behind(&self) -> bool {
        self.now.load(Ordering::Relaxed) & LEFT_BEHIND != 0
    }

    /// As it is now.
    pub(crate) fn load(&self) -> Content {
        Self::content_of(self.now.load(Ordering::Relaxed))
    }

    fn content_of(now: u8) -> Content {
        Self::ALL[usize::from(now & !LEFT_BEHIND) % Self::ALL.len()]
    }

    /// Bytes behind the earlier content that could not be cut off.
    pub(crate) fn noise_bytes(&self) -> u64 {
        self.noise_bytes.load(Ordering::Relaxed)
    }

    pub(super) fn store_noise(&self, bytes: u64) {
        self.noise_bytes.store(bytes, Ordering::Relaxed);
    }
}
