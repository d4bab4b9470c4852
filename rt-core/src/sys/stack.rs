//! Where the calling thread's stack ends.

use nix::Result;
use nix::errno::Errno;
use std::mem::MaybeUninit;

/// The lowest address that the calling thread's stack may grow down to.
pub(crate) fn lowest_address() -> Result<usize> {
    let mut attributes = MaybeUninit::<libc::pthread_attr_t>::uninit();
    // SAFETY: takes no argument and cannot fail.
    let me = unsafe { libc::pthread_self() };
    // SAFETY: `me` is the running thread; `attributes` is ours and initialised on success.
    let error = unsafe { libc::pthread_getattr_np(me, attributes.as_mut_ptr()) };
    if error != 0 {
        return Err(Errno::from_raw(error));
    }
    let (mut lowest, mut size) = (std::ptr::null_mut(), 0);
    // SAFETY: `attributes` was initialised above, the results are ours.
    let error = unsafe { libc::pthread_attr_getstack(attributes.as_ptr(), &mut lowest, &mut size) };
    // SAFETY: initialised above, used for the last time here.
    unsafe { libc::pthread_attr_destroy(attributes.as_mut_ptr()) };
    if error == 0 { Ok(lowest.addr()) } else { Err(Errno::from_raw(error)) }
}
