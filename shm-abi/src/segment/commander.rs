//! The commander's segment: written by the commander, read by the driver.

use super::mapping::{Mapping, check, create_memfd, keep_apart, seal};
use super::{
    DriverMemory, DriverView, SegmentError, expect, expect_compatible, get, put, slot_of, words_of,
    words_of_mut,
};
use crate::command::Command;
use crate::doorbell::{self, Place};
use crate::layout::{ABI_VERSION, CommanderSegment, LAYOUT_HASH, MAGIC, RING_COMMANDS};
use crate::seqlock::{self, Torn};
use rustix::fs::SealFlags;
use std::ops::Deref;
use std::os::fd::{BorrowedFd, OwnedFd};
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

/// The commander's segment, in the application that holds the lease.
#[derive(Debug)]
pub struct CommanderMemory {
    pub(super) map: Mapping<CommanderSegment>,
    lease: u64,
}

impl CommanderMemory {
    /// Maps a descriptor that was handed over, after checking seals, size and header.
    pub fn map(fd: BorrowedFd<'_>) -> Result<Self, SegmentError> {
        check(fd, size_of::<CommanderSegment>(), SealFlags::SHRINK | SealFlags::GROW)?;
        let map = Mapping::<CommanderSegment>::writable(&fd)?;
        expect("magic", &map.header.magic, MAGIC)?;
        expect_compatible(&map.header.abi_version)?;
        expect("layout hash", &map.header.layout_hash, LAYOUT_HASH)?;
        let lease = get(&map.header.lease);
        // From here on the driver may forbid further mappings.
        map.header.mapped.store(1, Ordering::Release);
        Ok(Self { map, lease })
    }

    /// The number to put into every command.
    pub fn lease(&self) -> u64 {
        self.lease
    }

    /// Answers a tick and wakes the driver if it sleeps.
    #[inline]
    pub fn publish(&self, command: &Command, driver: &DriverView) {
        let slot = &self.map.commands[slot_of(command.tick, RING_COMMANDS)];
        seqlock::write(&slot.sequence, &slot.words, words_of(command), command.tick);
        doorbell::ring(&self.map.bell, command.tick, &driver.map.bell.owner_sleeps);
    }
}

impl Deref for CommanderMemory {
    type Target = CommanderSegment;
    fn deref(&self) -> &CommanderSegment {
        &self.map
    }
}

/// A commander that may sleep, for whoever wakes it instead of the loop.
#[derive(Debug, Clone)]
pub struct Sleeper {
    map: Arc<Mapping<CommanderSegment>>,
}

impl Sleeper {
    /// Wakes it if it sleeps, on its own word or on this driver's bell. Takes as long as the kernel's bucket is full.
    pub fn wake(&self, driver: &DriverMemory) {
        wake(&self.map, driver);
    }
}

pub(super) fn wake(commander: &CommanderSegment, driver: &DriverMemory) -> usize {
    doorbell::wake_sleeper(&driver.map.bell, &commander.bell.owner_sleeps, &commander.header.frame_doorbell)
}

/// The commander's segment, in the driver, which writes nothing into it but the word to sleep on.
#[derive(Debug)]
pub struct CommanderView {
    pub(super) map: Arc<Mapping<CommanderSegment>>,
    lease: u64,
    /// Keeps its page from being merged, once the commander can no longer take it away.
    pages: Option<OwnedFd>,
}

impl CommanderView {
    /// Creates the segment for one lease. Returns the driver's view and the descriptor to hand over. This alone is for
    /// a commander in the same process; what another process may get is a [`LeaseOffer`](super::LeaseOffer).
    pub fn create(lease: u64) -> Result<(Self, OwnedFd), SegmentError> {
        let fd = create_memfd(c"phantom3-commander", size_of::<CommanderSegment>())?;
        let map = Mapping::<CommanderSegment>::writable(&fd)?;
        let header = &map.header;
        put(&header.magic, MAGIC);
        put(&header.abi_version, ABI_VERSION);
        put(&header.layout_hash, LAYOUT_HASH);
        put(&header.segment_bytes, size_of::<CommanderSegment>() as u64);
        put(&header.lease, lease);
        seal(&fd, SealFlags::SHRINK | SealFlags::GROW)?;
        Ok((Self { map: Arc::new(map), lease, pages: None }, fd))
    }

    /// Number of the lease; the driver's own knowledge, not read from the segment.
    pub fn lease(&self) -> u64 {
        self.lease
    }

    /// The tick that the commander says it answered last.
    #[inline]
    pub fn latest_tick(&self) -> Option<u64> {
        doorbell::latest(&self.map.bell)
    }

    /// Reads whatever stands in the slot of `tick`; an allegation.
    #[inline]
    pub fn read_command(&self, tick: u64, command: &mut Command) -> Result<(), Torn> {
        let slot = &self.map.commands[slot_of(tick, RING_COMMANDS)];
        seqlock::read(&slot.sequence, &slot.words, words_of_mut(command)).map(|_| ())
    }

    /// The commander as somebody else wakes it.
    pub fn sleeper(&self) -> Sleeper {
        Sleeper { map: Arc::clone(&self.map) }
    }

    /// Sleeps until the commander rings, `timeout` passes or a signal comes. For whoever has no deadlines.
    pub fn sleep_for_command(&self, seen: Option<u64>, own: &DriverMemory, timeout: Duration) {
        let bell = &self.map.bell;
        doorbell::sleep(Place::bell(bell), bell, seen, &own.map.bell.owner_sleeps, timeout);
    }

    /// Touches every page and has it stay where it is, for as long as this lives.
    pub(super) fn hold_pages(&mut self, fd: &OwnedFd) -> Result<(), SegmentError> {
        // First: a page that is not there could not be held.
        self.prefault();
        self.pages = Some(keep_apart(fd, size_of::<CommanderSegment>())?);
        Ok(())
    }

    /// Touches every page, so that the loop's first look at one is no page fault.
    fn prefault(&self) {
        for slot in &self.map.commands {
            // A read of a page that is not there would map it for reading only; and an addition of zero is no access
            // at all to the optimiser. The first slot lies on the header's page.
            let _ = slot.padding[0].compare_exchange(0, 0, Ordering::Relaxed, Ordering::Relaxed);
        }
    }
}
