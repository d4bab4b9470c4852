//! For tests: a block of atomic words in a file, so that a parent can read what a dead child wrote.

use std::fs::File;
use std::os::fd::AsRawFd;
use std::sync::atomic::{AtomicU32, AtomicU64};

/// Maps the file's first 256 bytes shared and writable, for the rest of the process.
pub(crate) fn map(file: &File) -> &'static [AtomicU64; 32] {
    let (size, access) = (size_of::<[AtomicU64; 32]>(), libc::PROT_READ | libc::PROT_WRITE);
    // SAFETY: the kernel chooses a free address; nothing of ours is replaced.
    let address =
        unsafe { libc::mmap(std::ptr::null_mut(), size, access, libc::MAP_SHARED, file.as_raw_fd(), 0) };
    assert_ne!(address, libc::MAP_FAILED, "mmap: {}", std::io::Error::last_os_error());
    // SAFETY: page-aligned, 256 bytes long, never unmapped, and only ever used as atomic words.
    unsafe { &*address.cast() }
}

/// The low half of a word, as a register.
pub(crate) fn low_half(word: &AtomicU64) -> &AtomicU32 {
    // SAFETY: aligned, inside the word, and atomic; little-endian machines have the low half first.
    unsafe { &*std::ptr::from_ref(word).cast() }
}

/// Makes the CPU raise SIGILL.
pub(crate) fn execute_illegal_instruction() {
    #[cfg(any(target_arch = "x86_64", target_arch = "x86"))]
    // SAFETY: defined to fault and to do nothing else.
    unsafe {
        std::arch::asm!("ud2");
    }
    #[cfg(target_arch = "aarch64")]
    // SAFETY: as above.
    unsafe {
        std::arch::asm!("udf #0");
    }
}
