//! The two segments as memory: created, sealed, mapped.
//!
//! Model: the driver creates both memfds and maps them. Sealing forbids shrinking and growing, so nobody can cause
//! SIGBUS; every further writable mapping, and with it every hole, is forbidden for the driver's segment from the
//! beginning, for the commander's once the commander has mapped it ([`LeaseOffer`]). A pipe holds a page of the driver's
//! segment, so that no reader can have its pages merged, and another the commander's page. Whoever receives a descriptor checks seals and size before
//! touching a byte. The driver writes one word of the commander's segment, the one that the commander sleeps on.

mod bounds;
mod commander;
mod description;
mod driver;
mod mapping;
mod offer;
mod text;

pub use bounds::SHORTEST_PERIOD_NS;
pub use commander::{CommanderMemory, CommanderView, Sleeper};
pub use description::{ClockMode, DeviceInfo, DriverInfo};
pub use driver::{DriverMemory, DriverView, FrameUnavailable};
pub use offer::{LeaseOffer, MAPPED_WITHIN, TAKEN_WITHIN};

use crate::handshake;
use crate::layout::{ABI_VERSION, MAX_DEVICES};
use rustix::io::Errno;
use std::io;
use std::sync::atomic::{AtomicU64, Ordering};
use thiserror::Error;

/// A descriptor is not a segment of this contract.
#[derive(Debug, Error)]
pub enum SegmentError {
    /// The kernel refused.
    #[error("cannot {what} a shared segment: {source}{}", remedy(.source))]
    System {
        /// What was tried.
        what: &'static str,
        /// What the kernel said.
        source: io::Error,
    },
    /// There is no pipe to hold its pages, or it is too small.
    #[error(
        "cannot hold the pages of a shared segment in a pipe: {source}; raise the limit of open files (`ulimit -n`, \
         LimitNOFILE=), or close what has many pipes open (fs.pipe-user-pages-soft)"
    )]
    Pipe {
        /// What the kernel said.
        source: io::Error,
    },
    /// It can still change its size.
    #[error(
        "the segment handed over is not sealed (found {found}, expected at least {expected}); do not trust this driver"
    )]
    NotSealed {
        /// The seals found.
        found: u32,
        /// The seals needed.
        expected: u32,
    },
    /// It is shorter or longer than the contract says.
    #[error(
        "the segment handed over has {found} bytes, expected {expected}; rebuild both sides from one version"
    )]
    WrongSize {
        /// Bytes found.
        found: u64,
        /// Bytes expected.
        expected: u64,
    },
    /// Its first words are wrong.
    #[error(
        "the segment's {what} is 0x{found:x}, expected 0x{expected:x}; rebuild both sides from one version"
    )]
    WrongHeader {
        /// Which word.
        what: &'static str,
        /// The word found.
        found: u64,
        /// The word expected.
        expected: u64,
    },
    /// The driver says of itself what cannot be.
    #[error(
        "the driver says of itself: {what}: {found}, expected {least} to {most}; do not trust this driver, start the one \
         that belongs to this program"
    )]
    Impossible {
        /// Which word.
        what: &'static str,
        /// The word found.
        found: u64,
        /// The least that can be.
        least: u64,
        /// The most.
        most: u64,
    },
    /// The driver has more devices than a frame has room for.
    #[error("there are {found} devices, and a driver can have {MAX_DEVICES} at most; start a second driver")]
    TooManyDevices {
        /// Devices that were listed.
        found: usize,
    },
}

/// Remedy where a limit of this process is the cause; else nothing.
pub(crate) fn remedy(error: &io::Error) -> &'static str {
    match error.raw_os_error().map(Errno::from_raw_os_error) {
        Some(Errno::FBIG) => "; raise the limit of the size of files (`ulimit -f`, LimitFSIZE=)",
        Some(Errno::MFILE) => "; raise the limit of open files (`ulimit -n`, LimitNOFILE=)",
        Some(Errno::NFILE) => "; close other programs, or raise fs.file-max",
        Some(Errno::NOMEM) => "; raise the limit of memory (`ulimit -v`, LimitAS=), or end other programs",
        Some(Errno::AGAIN) => "; raise the limit of locked memory (`ulimit -l`, LimitMEMLOCK=)",
        _ => "",
    }
}

fn slot_of(tick: u64, slots: usize) -> usize {
    // Both rings are powers of two, so the cut of the cast does not matter.
    tick as usize & (slots - 1)
}

fn words_of<P: bytemuck::Pod>(payload: &P) -> &[u64] {
    bytemuck::cast_slice(std::slice::from_ref(payload))
}

fn words_of_mut<P: bytemuck::Pod>(payload: &mut P) -> &mut [u64] {
    bytemuck::cast_slice_mut(std::slice::from_mut(payload))
}

fn get(word: &AtomicU64) -> u64 {
    word.load(Ordering::Acquire)
}

fn put(word: &AtomicU64, value: u64) {
    word.store(value, Ordering::Relaxed);
}

fn expect(what: &'static str, word: &AtomicU64, expected: u64) -> Result<(), SegmentError> {
    match get(word) {
        found if found == expected => Ok(()),
        found => Err(SegmentError::WrongHeader { what, found, expected }),
    }
}

/// A minor version only adds what an older reader may ignore.
fn expect_compatible(version: &AtomicU64) -> Result<(), SegmentError> {
    match get(version) {
        found if handshake::is_compatible(found) => Ok(()),
        found => Err(SegmentError::WrongHeader { what: "ABI version", found, expected: ABI_VERSION }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_limit_of_this_process_is_told_with_what_raises_it() {
        for (errno, word) in [
            (Errno::FBIG, "`ulimit -f`"),
            (Errno::MFILE, "`ulimit -n`"),
            (Errno::NFILE, "fs.file-max"),
            (Errno::NOMEM, "`ulimit -v`"),
            (Errno::AGAIN, "`ulimit -l`"),
        ] {
            assert!(remedy(&errno.into()).contains(word), "{errno}");
        }
        assert_eq!(remedy(&Errno::IO.into()), "");
    }
}
