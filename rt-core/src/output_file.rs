//! Files to be written, wherever a user says that they go.
//!
//! Problem: opening a FIFO for writing waits for a reader, for ever if nobody reads it.
//! Model: opening never waits (`O_NONBLOCK`, which regular files ignore): a pipe that nobody reads is refused, with what
//! to do, and so is a socket, which no name opens. Writing does wait, as everybody expects of a pipe. Who fills a regular file for long claims it ([`claim`]), so
//! that two processes do not write over one another.

use crate::sys::inherited;
use nix::errno::Errno;
use nix::fcntl::{FallocateFlags, FcntlArg, OFlag, fallocate, fcntl};
use nix::sys::statfs::{EXT4_SUPER_MAGIC, TMPFS_MAGIC, XFS_SUPER_MAGIC, fstatfs};
use std::fs::{File, OpenOptions, TryLockError};
use std::io;
use std::os::unix::fs::{FileTypeExt, OpenOptionsExt};
use std::path::Path;

/// Makes the file, or empties it.
///
/// # Errors
/// What the system says; a pipe without a reader.
pub fn create(path: &Path) -> io::Result<File> {
    open(path, OpenOptions::new().write(true).create(true).truncate(true))
}

/// Opens the file with these options, among which is writing.
///
/// # Errors
/// What the system says; a pipe without a reader.
pub fn open(path: &Path, options: &OpenOptions) -> io::Result<File> {
    let flags = (OFlag::O_NONBLOCK | OFlag::O_NOCTTY).bits();
    let file = options.clone().custom_flags(flags).open(path).map_err(|error| in_words(error, path))?;
    let flags = OFlag::from_bits_retain(fcntl(&file, FcntlArg::F_GETFL)?);
    fcntl(&file, FcntlArg::F_SETFL(flags - OFlag::O_NONBLOCK))?;
    Ok(file)
}

/// Claims a regular file for whoever has it open, until they close it: flock(2), which ends with the process, too. Pipes
/// and devices are left alone, and so are files of file systems without such locks.
///
/// # Errors
/// Another process holds such a lock on it, whether it writes the file or reads it ([`is_claimed`]).
pub fn claim(file: &File) -> io::Result<()> {
    if !file.metadata()?.is_file() {
        return Ok(());
    }
    match file.try_lock() {
        Err(TryLockError::WouldBlock) => {
            Err(io::Error::new(io::ErrorKind::ResourceBusy, "somebody holds a lock on it"))
        }
        Ok(()) | Err(TryLockError::Error(_)) => Ok(()),
    }
}

/// The error is that of a file on which another process holds a lock.
pub fn is_claimed(error: &io::Error) -> bool {
    error.kind() == io::ErrorKind::ResourceBusy && error.raw_os_error().is_none()
}

/// Room that was reserved for this file (fallocate(2)) is there, and writing over its content needs none: its file system neither
/// copies what is written over nor promises what it does not have.
#[must_use]
pub fn keeps_reserved_room(file: &File) -> bool {
    let known = [EXT4_SUPER_MAGIC, XFS_SUPER_MAGIC, TMPFS_MAGIC];
    let is_known = fstatfs(file).is_ok_and(|found| known.contains(&found.filesystem_type()));
    // A byte that is there: none is reserved, but it tells whether any could be.
    is_known && fallocate(file, FallocateFlags::FALLOC_FL_KEEP_SIZE, 0, 1).is_ok()
}

/// This process began without a standard output, as `>&-` of a shell has it; all that is written there since is lost.
#[must_use]
pub fn standard_output_was_closed() -> bool {
    inherited::output_was_closed()
}

fn in_words(error: io::Error, path: &Path) -> io::Error {
    if error.raw_os_error() != Some(Errno::ENXIO as i32) {
        return error;
    }
    if path.metadata().is_ok_and(|found| found.file_type().is_socket()) {
        return io::Error::other(
            "it is a socket, which cannot be written by its name; name a file or a pipe",
        );
    }
    io::Error::other("nobody reads this pipe (start its reader first), or its device is gone")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pipe_without_a_reader_is_refused_at_once_and_one_with_a_reader_blocks_when_it_is_full() {
        let pipe = std::env::temp_dir().join(format!("output-file-{}", std::process::id()));
        nix::unistd::mkfifo(&pipe, nix::sys::stat::Mode::S_IRWXU).expect("a pipe in TMPDIR");
        let refused = create(&pipe).map(drop).map_err(|error| error.to_string());
        let flags = OFlag::O_NONBLOCK.bits();
        let reader = OpenOptions::new().read(true).custom_flags(flags).open(&pipe);
        let file = create(&pipe);
        std::fs::remove_file(&pipe).expect("our own");
        assert!(refused.is_err_and(|words| words.starts_with("nobody reads this pipe")));
        let (_reader, file) = (reader.expect("a reader"), file.expect("somebody reads it"));
        let flags = fcntl(&file, FcntlArg::F_GETFL).expect("flags");
        assert!(!OFlag::from_bits_retain(flags).contains(OFlag::O_NONBLOCK));
    }

    #[test]
    fn a_socket_is_called_so_whether_or_not_somebody_listens() {
        let path = std::env::temp_dir().join(format!("output-file-socket-{}", std::process::id()));
        let listener = std::os::unix::net::UnixListener::bind(&path).expect("a socket in TMPDIR");
        let heard = create(&path).map(drop).map_err(|error| error.to_string());
        drop(listener);
        let unheard = create(&path).map(drop).map_err(|error| error.to_string());
        std::fs::remove_file(&path).expect("our own");
        for refused in [heard, unheard] {
            assert!(refused.is_err_and(|words| words.starts_with("it is a socket")));
        }
    }

    #[test]
    fn a_file_is_claimed_once_until_it_is_closed_and_a_device_by_everybody() {
        let path = std::env::temp_dir().join(format!("output-file-claimed-{}", std::process::id()));
        let [first, second] = [(); 2].map(|()| create(&path).expect("a file in TMPDIR"));
        let claimed = (claim(&first), claim(&second));
        drop(first);
        let again = claim(&second);
        std::fs::remove_file(&path).expect("our own");
        assert!(claimed.0.is_ok() && again.is_ok());
        let refused = claimed.1.expect_err("claimed by the first");
        assert!(is_claimed(&refused));
        let [first, second] = [(); 2].map(|()| create(Path::new("/dev/null")).expect("a device"));
        assert!(claim(&first).is_ok() && claim(&second).is_ok());
    }

    #[test]
    fn a_file_that_a_reader_has_locked_is_not_said_to_be_written() {
        let directory = tempfile::tempdir().expect("a directory");
        let path = directory.path().join("read");
        let file = create(&path).expect("room");
        let reader = File::open(&path).expect("it is there");
        reader.lock_shared().expect("nobody else");
        let refused = claim(&file).expect_err("it is locked");
        assert!(is_claimed(&refused) && refused.to_string() == "somebody holds a lock on it", "{refused}");
    }
}
