//! Segment of a new lease, from its creation until the loop may read it.
//!
//! Problem: whoever holds a writable descriptor of a memfd may punch holes into it (fallocate, `MADV_REMOVE`), and
//! each hole costs the loop a page fault in its next tick. `F_SEAL_FUTURE_WRITE` forbids both, and with them every
//! writable mapping that does not exist yet, the commander's own included.
//!
//! Model: the driver hands the descriptor over, the commander maps it and says so, the driver seals it and touches
//! every page of its own mapping, and only then the loop gets the [`CommanderView`]. A commander of before 1.3 says
//! so by its first command, or not at all: some wait for a frame under their lease before they publish, and are
//! given [`MAPPED_WITHIN`]. Sealing waits for whoever writes into the segment: a thread of its own does it (`server/sealer.rs`).
//!
//! Invariant: after [`LeaseOffer::seal`] no page of the segment can be taken away or merged into a huge one.

use super::mapping::seal;
use super::{CommanderView, SegmentError};
use crate::handshake;
use rustix::fs::SealFlags;
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

/// How long a commander of before 1.3 may take to map its segment: a thousand times what it needs.
pub const MAPPED_WITHIN: Duration = Duration::from_millis(200);

/// How long one of 1.3 or later may take: whoever asked and was stopped before it mapped must not keep others out.
pub const TAKEN_WITHIN: Duration = Duration::from_secs(2);

/// The first minor version whose commanders tell that they have mapped their segment.
const FIRST_THAT_TELLS: u32 = 3;

/// A lease that is handed over and not yet in force.
#[derive(Debug)]
pub struct LeaseOffer {
    view: CommanderView,
    fd: OwnedFd,
    made: Instant,
    /// Whether the commander says when it has mapped it.
    tells: bool,
}

impl LeaseOffer {
    /// Creates the segment for a commander that speaks `abi_version`.
    ///
    /// # Errors
    /// If the kernel refuses memory or a descriptor.
    pub fn create(lease: u64, abi_version: u64) -> Result<Self, SegmentError> {
        let (view, fd) = CommanderView::create(lease)?;
        let tells = handshake::minor_of(abi_version) >= FIRST_THAT_TELLS;
        Ok(Self { view, fd, made: Instant::now(), tells })
    }

    /// The descriptor to hand over.
    pub fn fd(&self) -> BorrowedFd<'_> {
        self.fd.as_fd()
    }

    /// Whether the commander needs no further mapping.
    pub fn is_mapped(&self) -> bool {
        self.view.map.header.mapped.load(Ordering::Acquire) != 0
            || self.view.latest_tick().is_some()
            || (!self.tells && self.made.elapsed() >= MAPPED_WITHIN)
    }

    /// Whether a commander that tells when it has mapped it has not done so within this time.
    pub fn is_idle(&self, within: Duration) -> bool {
        self.tells && !self.is_mapped() && self.made.elapsed() > within
    }

    /// Whether the commander had time enough to map it.
    pub fn is_overdue(&self) -> bool {
        self.tells && self.made.elapsed() > TAKEN_WITHIN
    }

    /// Forbids everybody to map the segment for writing, to punch holes into it and to change the seals, and makes
    /// every page present in this process, where nobody has it merged.
    ///
    /// # Errors
    /// If the commander has forbidden further seals itself, or the kernel refuses a descriptor.
    pub fn seal(mut self) -> Result<CommanderView, SegmentError> {
        seal(&self.fd, SealFlags::FUTURE_WRITE | SealFlags::SEAL)?;
        self.view.hold_pages(&self.fd)?;
        Ok(self.view)
    }
}
