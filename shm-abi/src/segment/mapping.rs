//! Sealed memory files and their mappings.
//!
//! Invariant of the `unsafe` here: a mapping lives as long as the value that hands out references into it,
//! is as long as the segment type, page-aligned, and the type is made of atomic words only, for which
//! every bit pattern and every concurrent change is valid.

use super::SegmentError;
use crate::layout::{CommanderSegment, DriverSegment};
use memmap2::{MmapOptions, MmapRaw};
use rustix::fs::{FallocateFlags, MemfdFlags, Mode, SealFlags};
use rustix::io::Errno;
use rustix::pipe::{PipeFlags, SpliceFlags};
use std::fs::File;
use std::io;
use std::marker::PhantomData;
use std::ops::Deref;
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};

pub(super) fn create_memfd(name: &std::ffi::CStr, bytes: usize) -> Result<OwnedFd, SegmentError> {
    let flags = MemfdFlags::CLOEXEC | MemfdFlags::ALLOW_SEALING;
    let fd = rustix::fs::memfd_create(name, flags | MemfdFlags::NOEXEC_SEAL)
        .or_else(|errno| match errno {
            // Linux before 6.3 does not know the flag; a hardened one later on insists on it.
            Errno::INVAL => rustix::fs::memfd_create(name, flags),
            other => Err(other),
        })
        .map_err(|errno| SegmentError::System { what: "create", source: errno.into() })?;
    // Not only sized: a page that does not exist yet costs a page fault inside a tick, and SIGBUS if there
    // is no memory left by then.
    rustix::fs::fallocate(&fd, FallocateFlags::empty(), 0, bytes as u64)
        .map_err(|errno| SegmentError::System { what: "reserve the memory of", source: errno.into() })?;
    Ok(fd)
}

/// Lets nobody else open the file again by its name in proc(5): whoever is handed a descriptor could fill memory with attributes
/// of the file, which nobody accounts for.
pub(super) fn close_to_others(fd: &OwnedFd) -> Result<(), SegmentError> {
    rustix::fs::fchmod(fd, Mode::RUSR | Mode::WUSR)
        .map_err(|errno| SegmentError::System { what: "close to others", source: errno.into() })
}

pub(super) fn seal(fd: &OwnedFd, seals: SealFlags) -> Result<(), SegmentError> {
    rustix::fs::fcntl_add_seals(fd, seals)
        .map_err(|errno| SegmentError::System { what: "seal", source: errno.into() })
}

/// Keeps the kernel from merging the pages of a segment into a huge one for as long as the descriptor is open, whoever
/// asks for it (`MADV_COLLAPSE`): meanwhile whoever touches them would wait for milliseconds. What is merged must be
/// referred to by mappings alone, and here a pipe refers to a page of each part that could be merged.
pub(super) fn keep_apart(fd: &OwnedFd, bytes: usize) -> Result<OwnedFd, SegmentError> {
    let refused = |errno: Errno| SegmentError::Pipe { source: errno.into() };
    let (held, into) = rustix::pipe::pipe_with(PipeFlags::CLOEXEC).map_err(refused)?;
    for part in (0..bytes as u64).step_by(SMALLEST_HUGE_PAGE) {
        // A pipe that is too small is an error, and no wait.
        rustix::pipe::splice(fd, Some(&mut { part }), &into, None, 1, SpliceFlags::NONBLOCK)
            .map_err(refused)?;
    }
    Ok(held)
}

/// In bytes; where huge pages are larger (64 KiB pages of Arm), several of ours lie in each.
const SMALLEST_HUGE_PAGE: usize = 2 << 20;

pub(super) fn check(fd: BorrowedFd<'_>, bytes: usize, needed: SealFlags) -> Result<(), SegmentError> {
    let seals = rustix::fs::fcntl_get_seals(fd)
        .map_err(|errno| SegmentError::System { what: "read the seals of", source: errno.into() })?;
    if !seals.contains(needed) {
        return Err(SegmentError::NotSealed { found: seals.bits(), expected: needed.bits() });
    }
    let found = rustix::fs::fstat(fd)
        .map_err(|errno| SegmentError::System { what: "measure", source: errno.into() })?
        .st_size as u64;
    if found != bytes as u64 {
        return Err(SegmentError::WrongSize { found, expected: bytes as u64 });
    }
    Ok(())
}

/// A segment type: `repr(C)`, atomic words only, alignment at most a page.
pub(super) trait Segment {}
impl Segment for DriverSegment {}
impl Segment for CommanderSegment {}

/// A shared mapping seen as a segment.
#[derive(Debug)]
pub(super) struct Mapping<T> {
    map: MmapRaw,
    segment: PhantomData<T>,
}

impl<T: Segment> Mapping<T> {
    pub(super) fn writable(fd: &impl AsFd) -> Result<Self, SegmentError> {
        Self::new(fd, |options, file| options.map_raw(file))
    }

    pub(super) fn read_only(fd: &impl AsFd) -> Result<Self, SegmentError> {
        Self::new(fd, |options, file| options.map_raw_read_only(file))
    }

    fn new(
        fd: &impl AsFd,
        map: impl Fn(&MmapOptions, &File) -> io::Result<MmapRaw>,
    ) -> Result<Self, SegmentError> {
        let system = |source| SegmentError::System { what: "map", source };
        let file = File::from(fd.as_fd().try_clone_to_owned().map_err(system)?);
        // Populated at once: a first touch inside a tick would be a page fault.
        let map = map(MmapOptions::new().len(size_of::<T>()).populate(), &file).map_err(system)?;
        Ok(Self { map, segment: PhantomData })
    }
}

impl<T: Segment> Deref for Mapping<T> {
    type Target = T;
    #[allow(unsafe_code)]
    fn deref(&self) -> &T {
        // SAFETY: the invariant in this file's head: length, alignment and lifetime are this value's, and a
        // `Segment` is atomic words, valid for every bit pattern under every concurrent change.
        unsafe { &*self.map.as_ptr().cast::<T>() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::os::unix::fs::MetadataExt;

    #[test]
    fn every_page_of_a_segment_exists_before_it_is_mapped() {
        /// What stat(2) counts in, whatever the file system's block is.
        const STAT_BLOCK: u64 = 512;
        for bytes in [size_of::<DriverSegment>(), size_of::<CommanderSegment>()] {
            let meta = File::from(create_memfd(c"test", bytes).unwrap()).metadata().unwrap();
            assert_eq!(meta.size(), bytes as u64);
            assert!(meta.blocks() * STAT_BLOCK >= meta.size(), "{} blocks", meta.blocks());
        }
    }
}
