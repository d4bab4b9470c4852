//! Tells the C library's allocator to keep the pages it once got.

/// Why heap pages may go back to the kernel all the same.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct NotTuned;

/// Forbids giving freed memory back (`M_TRIM_THRESHOLD`) and serving large blocks by fresh mappings
/// (`M_MMAP_MAX`), which would fault in every page again. For the whole process, for good.
#[cfg(target_env = "gnu")]
pub(crate) fn keep_freed_pages() -> Result<(), NotTuned> {
    /// -1 switches trimming off altogether, mallopt(3).
    const NEVER: libc::c_int = -1;
    // SAFETY: takes two numbers and locks the arena itself.
    let no_trim = unsafe { libc::mallopt(libc::M_TRIM_THRESHOLD, NEVER) };
    // SAFETY: as above.
    let no_mmap = unsafe { libc::mallopt(libc::M_MMAP_MAX, 0) };
    if no_trim == 1 && no_mmap == 1 { Ok(()) } else { Err(NotTuned) }
}

/// Other C libraries offer no such switch.
#[cfg(not(target_env = "gnu"))]
pub(crate) fn keep_freed_pages() -> Result<(), NotTuned> {
    Err(NotTuned)
}
