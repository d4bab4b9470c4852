//! The calling thread's capabilities: what it has, and giving them up.
//!
//! Capabilities belong to threads, not to processes (capabilities(7)); the C library has no wrapper.

use nix::Result;
use nix::errno::Errno;

/// Lets a thread change its user id.
pub(crate) const CAP_SETUID: u32 = 7;
/// Lets a thread change its group id and its supplementary groups.
pub(crate) const CAP_SETGID: u32 = 6;

/// The version with 64 bits in two halves, the kernel's since 2.6.26.
const VERSION_3: u32 = 0x2008_0522;

#[repr(C)]
struct Header {
    version: u32,
    /// 0 names the calling thread.
    tid: i32,
}

/// Half of the three sets.
#[repr(C)]
#[derive(Clone, Copy, Default)]
struct Half {
    effective: u32,
    permitted: u32,
    inheritable: u32,
}

/// The calling thread's permitted set, a bit for each capability.
pub(crate) fn permitted() -> Result<u64> {
    let mut header = Header { version: VERSION_3, tid: 0 };
    let mut halves = [Half::default(); 2];
    // SAFETY: both are ours, of the layout and size that version 3 asks for.
    let result = unsafe { libc::syscall(libc::SYS_capget, &raw mut header, halves.as_mut_ptr()) };
    Errno::result(result)?;
    Ok(u64::from(halves[1].permitted) << 32 | u64::from(halves[0].permitted))
}

/// Makes `sets` the calling thread's effective and permitted set, and its inheritable one empty.
pub(crate) fn keep_only(sets: u64) -> Result<()> {
    let half = |bits: u64| Half { effective: bits as u32, permitted: bits as u32, inheritable: 0 };
    let mut header = Header { version: VERSION_3, tid: 0 };
    let halves = [half(sets), half(sets >> 32)];
    // SAFETY: both are ours, of the layout and size that version 3 asks for; the kernel only reads the halves.
    let result = unsafe { libc::syscall(libc::SYS_capset, &raw mut header, halves.as_ptr()) };
    Errno::result(result).map(drop)
}

/// Takes a capability out of the calling thread's bounding set. Fails beyond the last one the kernel knows.
pub(crate) fn drop_from_bounding_set(capability: u32) -> Result<()> {
    prctl(libc::PR_CAPBSET_DROP, libc::c_ulong::from(capability))
}

/// Empties the calling thread's ambient set.
pub(crate) fn clear_ambient_set() -> Result<()> {
    prctl(libc::PR_CAP_AMBIENT, libc::PR_CAP_AMBIENT_CLEAR_ALL as libc::c_ulong)
}

fn prctl(what: libc::c_int, argument: libc::c_ulong) -> Result<()> {
    const NONE: libc::c_ulong = 0;
    // SAFETY: these requests take numbers, no pointers.
    Errno::result(unsafe { libc::prctl(what, argument, NONE, NONE, NONE) }).map(drop)
}
