//! Sockets in the file system: made with the right mode, owned by one driver, removed by nobody else.

use rustix::fs::{FlockOperation, OFlags};
use rustix::io::Errno;
use rustix::net::{AddressFamily, SocketAddrUnix, SocketFlags, SocketType};
use std::fs::{File, Metadata, Permissions};
use std::io;
use std::os::unix::fs::{FileTypeExt, MetadataExt, OpenOptionsExt, PermissionsExt};
use std::path::{Path, PathBuf};
use thiserror::Error;

/// Owner and group may use the socket.
const SOCKET_MODE: u32 = 0o660;

/// Why the driver cannot listen.
#[derive(Debug, Error)]
pub enum BindError {
    /// Another driver does.
    #[error("another driver is running at {socket}; stop it with `io-driver stop`, or use another socket")]
    AlreadyRunning {
        /// Where.
        socket: PathBuf,
    },
    /// The file system refused.
    #[error("cannot {what} {path}: {source}; {}", remedy(source))]
    System {
        /// What was tried.
        what: &'static str,
        /// On what.
        path: PathBuf,
        /// What the kernel said.
        source: io::Error,
    },
    /// There can be no thread for what may take long.
    #[error("cannot start a thread: {0}; raise the limit of processes (`ulimit -u`, TasksMax=)")]
    NoThread(io::Error),
}

impl BindError {
    pub(crate) fn system(what: &'static str, path: &Path, source: io::Error) -> Self {
        Self::System { what, path: path.to_path_buf(), source }
    }
}

fn remedy(source: &io::Error) -> String {
    match Errno::from_io_error(source) {
        Some(Errno::MFILE) => "raise the limit of open files (`ulimit -n`, LimitNOFILE=)".to_owned(),
        _ => format!("choose another place with --socket or {}", crate::endpoint::SOCKET_VARIABLE),
    }
}

/// A socket's name, removed with this value as long as it still names our socket.
#[derive(Debug)]
pub struct SocketFile {
    path: PathBuf,
    identity: Option<Identity>,
}

impl SocketFile {
    /// Makes a socket and gives it its name last: there is no moment at which it is too open or not ready. A socket that
    /// lies at the path is replaced; anything else is left alone.
    pub(crate) fn make<S>(
        path: &Path,
        bind: impl FnOnce(&Path) -> io::Result<S>,
        prepare: impl FnOnce(&S) -> io::Result<()>,
    ) -> Result<(S, Self), BindError> {
        refuse_other_files(path)?;
        let unnamed = suffixed(path, &format!(".{}", std::process::id()));
        let _ = std::fs::remove_file(&unnamed);
        let socket =
            bind(&in_full(&unnamed)).map_err(|source| BindError::system("listen at", &unnamed, source))?;
        let ready = std::fs::set_permissions(&unnamed, Permissions::from_mode(SOCKET_MODE))
            .and_then(|()| prepare(&socket))
            .and_then(|()| std::fs::rename(&unnamed, path));
        if let Err(source) = ready {
            let _ = std::fs::remove_file(&unnamed);
            return Err(BindError::system("listen at", path, source));
        }
        let identity = std::fs::symlink_metadata(path).ok().map(|meta| identity_of(&meta));
        Ok((socket, Self { path: path.to_path_buf(), identity }))
    }

    /// Where it lies.
    pub fn path(&self) -> &Path {
        &self.path
    }
}

impl Drop for SocketFile {
    fn drop(&mut self) {
        remove_if(&self.path, self.identity);
    }
}

/// Says that a driver lives at a path; the kernel lets go of it however the driver dies.
#[derive(Debug)]
pub(crate) struct Lock {
    file: File,
    path: PathBuf,
}

impl Lock {
    /// Takes the lock of a socket. The lock file may be removed and remade by a driver that is just ending, so that
    /// the name is compared again after the lock was taken.
    pub(crate) fn take(socket: &Path) -> Result<Self, BindError> {
        let path = suffixed(socket, LOCK_SUFFIX);
        let failed = |source| BindError::system("lock", &path, source);
        const TRIES: usize = 16;
        for _ in 0..TRIES {
            // The owner's alone: whoever could open it could hold the lock and keep every driver from starting.
            let mut options = File::options();
            // Whatever else lies there is not followed, and not waited for.
            options.custom_flags((OFlags::NOFOLLOW | OFlags::NONBLOCK).bits().cast_signed());
            let file =
                options.create(true).truncate(false).write(true).mode(0o600).open(&path).map_err(failed)?;
            if !file.metadata().map_err(failed)?.is_file() {
                return Err(failed(io::Error::new(
                    io::ErrorKind::AlreadyExists,
                    "no file of a lock lies there",
                )));
            }
            match rustix::fs::flock(&file, FlockOperation::NonBlockingLockExclusive) {
                Ok(()) => {}
                Err(Errno::WOULDBLOCK) => return Err(already_running(socket)),
                Err(errno) => return Err(failed(errno.into())),
            }
            let held = identity_of(&file.metadata().map_err(failed)?);
            if std::fs::symlink_metadata(&path).is_ok_and(|named| identity_of(&named) == held) {
                return Ok(Self { file, path });
            }
        }
        Err(already_running(socket))
    }
}

impl Drop for Lock {
    fn drop(&mut self) {
        let identity = self.file.metadata().ok().map(|meta| identity_of(&meta));
        remove_if(&self.path, identity);
    }
}

const LOCK_SUFFIX: &str = ".lock";

/// The lock keeps our own kind apart; this also spares whatever else lies at the path: a file that somebody
/// named by mistake, and a living socket whose lock file was swept away.
pub(crate) fn make_sure_nobody_listens(path: &Path) -> Result<(), BindError> {
    if !refuse_other_files(path)? {
        return Ok(());
    }
    match probe(path) {
        Err(Errno::CONNREFUSED | Errno::NOENT) => Ok(()),
        // A full queue belongs to somebody who lives but does not look.
        Ok(()) | Err(Errno::AGAIN) => Err(already_running(path)),
        Err(errno) => Err(BindError::system("listen at", path, errno.into())),
    }
}

/// A socket lies there at which nobody listens.
pub(crate) fn is_left_over(path: &Path) -> bool {
    let is_socket = std::fs::metadata(path).is_ok_and(|meta| meta.file_type().is_socket());
    is_socket && probe(path) == Err(Errno::CONNREFUSED)
}

/// Connects and hangs up; never waits.
fn probe(path: &Path) -> Result<(), Errno> {
    let address = SocketAddrUnix::new(path)?;
    let flags = SocketFlags::CLOEXEC | SocketFlags::NONBLOCK;
    let probe = rustix::net::socket_with(AddressFamily::UNIX, SocketType::STREAM, flags, None)?;
    rustix::net::connect(&probe, &address)
}

/// Whether a socket lies there; an error if something else does.
fn refuse_other_files(path: &Path) -> Result<bool, BindError> {
    let error = match std::fs::symlink_metadata(path) {
        Ok(meta) if meta.file_type().is_socket() => return Ok(true),
        Ok(_) => {
            let found = "something that is not a socket lies there, and it is left alone";
            io::Error::new(io::ErrorKind::AlreadyExists, found)
        }
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(false),
        Err(error) => error,
    };
    Err(BindError::system("listen at", path, error))
}

fn already_running(socket: &Path) -> BindError {
    BindError::AlreadyRunning { socket: socket.to_path_buf() }
}

/// Device and inode: the same file, whatever its name.
type Identity = (u64, u64);

fn identity_of(meta: &Metadata) -> Identity {
    (meta.dev(), meta.ino())
}

/// Removes a name only while it still names our file: another driver may have taken the place since.
fn remove_if(path: &Path, ours: Option<Identity>) {
    if std::fs::symlink_metadata(path).is_ok_and(|meta| Some(identity_of(&meta)) == ours) {
        let _ = std::fs::remove_file(path);
    }
}

/// The name under which the kernel keeps a socket, and tells whoever looks for one whose file is gone: the directory
/// in full, if a socket's address has room for that.
fn in_full(path: &Path) -> PathBuf {
    let full = whole_path(path);
    if SocketAddrUnix::new(&full).is_ok() { full } else { path.to_path_buf() }
}

/// The path with its directory in full, without symbolic links and detours; as well as can be told where that is gone.
/// The last name is left as it is: it need not exist.
pub fn whole_path(path: &Path) -> PathBuf {
    let directory = path.parent().filter(|directory| !directory.as_os_str().is_empty());
    let directory = std::fs::canonicalize(directory.unwrap_or(Path::new(".")));
    match (directory, path.file_name()) {
        (Ok(directory), Some(name)) => directory.join(name),
        _ => std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf()),
    }
}

/// A name beside another.
pub(crate) fn suffixed(path: &Path, suffix: &str) -> PathBuf {
    let mut name = without_end(path).as_os_str().to_os_string();
    name.push(suffix);
    PathBuf::from(name)
}

/// The path without slashes behind its last name, which shells add to what they take for a directory.
pub(crate) fn without_end(path: &Path) -> &Path {
    path.components().as_path()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[cfg_attr(miri, ignore = "sockets and directories are the system's")]
    fn a_path_is_told_in_full_as_far_as_it_exists() {
        let directory = tempfile::tempdir().expect("a directory");
        let real = std::fs::canonicalize(directory.path()).expect("its name").join("real");
        std::fs::create_dir(&real).expect("a directory");
        let link = directory.path().join("link");
        std::os::unix::fs::symlink(&real, &link).expect("a link");
        assert_eq!(whole_path(&link.join("../link/driver.sock")), real.join("driver.sock"));
        let absent = directory.path().join("absent/driver.sock");
        assert_eq!(whole_path(&absent), absent);
        let here = std::env::current_dir().expect("a directory");
        assert_eq!(whole_path(Path::new("driver.sock")), here.join("driver.sock"));
    }

    #[test]
    fn another_place_is_no_remedy_where_files_are_too_many() {
        assert!(remedy(&Errno::MFILE.into()).contains("`ulimit -n`"));
        assert!(remedy(&Errno::ACCESS.into()).contains("--socket"));
    }

    /// A pipe would be waited for, and what a link leads to made, both before any signal is heeded.
    #[test]
    #[cfg_attr(miri, ignore = "sockets and directories are the system's")]
    fn what_lies_in_a_locks_place_is_neither_waited_for_nor_followed() {
        let directory = tempfile::tempdir().expect("a directory");
        let socket = directory.path().join("driver.sock");
        let (path, elsewhere) = (suffixed(&socket, LOCK_SUFFIX), directory.path().join("elsewhere"));
        let refused = || {
            let socket = socket.clone();
            let taken = patience::watched(patience::limit(), "a lock", move || Lock::take(&socket));
            assert!(matches!(taken, Err(BindError::System { what: "lock", .. })), "{taken:?}");
        };
        std::os::unix::fs::symlink(&elsewhere, &path).expect("a link");
        refused();
        assert!(!elsewhere.exists());
        std::fs::remove_file(&path).expect("gone");
        nix::unistd::mkfifo(&path, nix::sys::stat::Mode::S_IRWXU).expect("a pipe");
        refused();
        let _reader = File::options().read(true).write(true).open(&path).expect("both its ends");
        refused();
    }

    /// Whoever lives and takes nobody is not waited for, and not taken for dead.
    #[test]
    #[cfg_attr(miri, ignore = "sockets and directories are the system's")]
    fn a_probe_of_a_full_queue_returns_at_once() {
        let directory = tempfile::tempdir().expect("a directory");
        let path = directory.path().join("crowded.sock");
        let listener = std::os::unix::net::UnixListener::bind(&path).expect("a socket");
        rustix::net::listen(&listener, 0).expect("a short queue");
        let mut waiting = Vec::new();
        patience::watched(patience::limit(), "a full queue", || {
            while probe(&path) == Ok(()) {
                let (address, kind) = (SocketAddrUnix::new(&path).expect("an address"), SocketType::STREAM);
                let one = rustix::net::socket_with(AddressFamily::UNIX, kind, SocketFlags::NONBLOCK, None);
                let one = one.expect("a socket");
                let _ = rustix::net::connect(&one, &address);
                waiting.push(one);
            }
        });
        assert_eq!(probe(&path), Err(Errno::AGAIN));
        let refused = make_sure_nobody_listens(&path).expect_err("somebody does");
        assert!(matches!(refused, BindError::AlreadyRunning { .. }), "{refused:?}");
        assert!(!is_left_over(&path));
    }
}
