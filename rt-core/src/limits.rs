//! Limits of the system that an error tells of, and what to do about each.
//!
//! Problem: "Resource temporarily unavailable" says neither what is short nor who is the one to give more of it.
//! Model: an error's number names what ran out; the limit that holds for this process is read and said with its remedy.
//! Cost: a few system calls, after something has failed.

use nix::errno::Errno;
use nix::sys::resource::{RLIM_INFINITY, Resource, getrlimit};
use std::io;

/// Lack because of which no thread could be started, and its remedy. The kernel and the C library give the same error
/// for too many processes and for too little memory.
#[must_use]
pub fn no_thread(error: &io::Error) -> String {
    if let Some(remedy) = remedy(error).filter(|_| error.kind() != io::ErrorKind::OutOfMemory) {
        return format!("{error}; {remedy}");
    }
    let remedy = match memory_limit() {
        Some(memory) => format!("raise the limit {memory}; or {}", more_processes()),
        None => more_processes(),
    };
    format!("no thread could be started ({error}); {remedy}")
}

/// Remedy for an error that tells of a limit; `None`: it tells of something else.
#[must_use]
pub fn remedy(error: &io::Error) -> Option<String> {
    let raise = |what: String| Some(format!("raise the limit {what}"));
    match Errno::from_raw(error.raw_os_error()?) {
        Errno::EMFILE => {
            let most = limit(Resource::RLIMIT_NOFILE).unwrap_or_default();
            raise(format!("of open files (`ulimit -n`, now {most})"))
        }
        Errno::ENFILE => Some("close other programs, or raise fs.file-max".into()),
        Errno::EFBIG => match limit(Resource::RLIMIT_FSIZE) {
            Some(most) => raise(format!("of the size of files (`ulimit -f`, now {most} bytes)")),
            None => Some("use a file system that takes larger files".into()),
        },
        Errno::ENOMEM => match memory_limit() {
            Some(what) => raise(what),
            None => Some("end other programs, or give the machine more memory".into()),
        },
        Errno::ENOSPC => Some("make room on that disk, or name a place on another one".into()),
        Errno::EDQUOT => Some("delete files of yours on that disk, or name a place on another one".into()),
        _ => None,
    }
}

/// Words for a process that could not be started: the kernel calls too many processes by the name of a passing lack.
#[must_use]
pub fn no_process(error: &io::Error) -> String {
    match error.raw_os_error().map(Errno::from_raw) {
        Some(Errno::EAGAIN) => format!("{error}; {}", more_processes()),
        _ => with_remedy(error),
    }
}

/// Remedy for a lack of processes or threads.
#[must_use]
pub fn more_processes() -> String {
    limit(Resource::RLIMIT_NPROC).map_or_else(
        || "end other programs, or raise the limit of the control group (TasksMax=, `docker run --pids-limit`)".into(),
        |most| format!("raise the limit of processes (`ulimit -u`, now {most}; TasksMax= of a service)"),
    )
}

/// The error, and what to do about it where that is known.
#[must_use]
pub fn with_remedy(error: &io::Error) -> String {
    remedy(error).map_or_else(|| error.to_string(), |remedy| format!("{error}; {remedy}"))
}

/// The error, and what to do about it: `otherwise` where the error tells of no limit.
#[must_use]
pub fn with_remedy_or(error: &io::Error, otherwise: &str) -> String {
    format!("{error}; {}", remedy(error).as_deref().unwrap_or(otherwise))
}

/// In words; `None`: memory has no limit.
#[must_use]
pub fn memory_limit() -> Option<String> {
    let all = limit(Resource::RLIMIT_AS).map(|most| (most, "-v"));
    let data = limit(Resource::RLIMIT_DATA).map(|most| (most, "-d"));
    let (most, option) = [all, data].into_iter().flatten().min()?;
    Some(format!("of memory (`ulimit {option}`, now {most} bytes)"))
}

/// Bytes that a file may have; `None`: as many as the file system takes.
#[must_use]
pub fn largest_file() -> Option<u64> {
    limit(Resource::RLIMIT_FSIZE)
}

/// `None`: there is none.
fn limit(of: Resource) -> Option<u64> {
    getrlimit(of).ok().map(|(soft, _)| soft).filter(|soft| *soft != RLIM_INFINITY)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_that_tells_of_a_limit_is_answered_with_that_limit_and_others_with_nothing() {
        let of = |errno: Errno| remedy(&io::Error::from_raw_os_error(errno as i32));
        assert!(of(Errno::EMFILE).is_some_and(|words| words.contains("open files (`ulimit -n`")));
        assert!(of(Errno::EFBIG).is_some());
        assert!(of(Errno::ENOMEM).is_some());
        assert!(of(Errno::ENOSPC).is_some_and(|words| words.starts_with("make room")));
        assert_eq!(of(Errno::ENOENT), None);
        let full = io::Error::from_raw_os_error(Errno::ENOSPC as i32);
        assert!(
            with_remedy_or(&full, "name another")
                .ends_with("28); make room on that disk, or name a place on another one")
        );
        assert!(with_remedy_or(&io::Error::other("words"), "name another").ends_with("words; name another"));
        assert_eq!(remedy(&io::Error::other("words")), None);
        let words = no_thread(&io::Error::from_raw_os_error(Errno::EAGAIN as i32));
        assert!(words.starts_with("no thread could be started (Resource temporarily unavailable"), "{words}");
    }
}
