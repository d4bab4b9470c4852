//! What the kernel says about the rights of every thread of this process.
//!
//! Capabilities, the ban on new ones and system call filters belong to threads, so one thread's word is not
//! enough. The files are opened first and read afterwards: a filter may forbid opening.

use std::fs::File;
use std::io;
use std::os::unix::fs::FileExt;

/// The status files of all threads there are now.
#[derive(Debug)]
pub(crate) struct ThreadFiles(Vec<File>);

/// The rights of one thread, as `/proc/PID/task/TID/status` tells them.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct ThreadStatus {
    pub(crate) name: String,
    /// Real, effective, saved and file system user.
    pub(crate) uids: Vec<u32>,
    /// The same of the group.
    pub(crate) gids: Vec<u32>,
    /// Supplementary ones.
    pub(crate) groups: Vec<u32>,
    /// Inheritable, permitted, effective and ambient set together.
    pub(crate) capabilities: u64,
    pub(crate) bounding: u64,
    pub(crate) no_new_privileges: bool,
    /// 0 no filter, 2 a filter.
    pub(crate) seccomp: u64,
}

impl ThreadFiles {
    pub(crate) fn open() -> io::Result<Self> {
        let tasks = std::fs::read_dir("/proc/self/task")?;
        tasks.map(|task| File::open(task?.path().join("status"))).collect::<io::Result<_>>().map(Self)
    }

    /// Every thread's rights now.
    pub(crate) fn read(&self) -> io::Result<Vec<ThreadStatus>> {
        self.0.iter().map(|file| Ok(ThreadStatus::parse(&read_at_once(file)?))).collect()
    }
}

/// With one `pread`: a status is far shorter than this.
fn read_at_once(file: &File) -> io::Result<String> {
    let mut bytes = vec![0; 16 << 10];
    let length = file.read_at(&mut bytes, 0)?;
    Ok(String::from_utf8_lossy(&bytes[..length]).into_owned())
}

impl ThreadStatus {
    /// What is missing or unreadable counts as the worst.
    fn parse(text: &str) -> Self {
        let field = |key: &str| text.lines().find_map(|line| line.strip_prefix(key)).map_or("", str::trim);
        let set = |key: &str| u64::from_str_radix(field(key), 16).unwrap_or(u64::MAX);
        let ids = |key: &str| field(key).split_whitespace().filter_map(|id| id.parse().ok()).collect();
        Self {
            name: field("Name:").to_owned(),
            uids: ids("Uid:"),
            gids: ids("Gid:"),
            groups: ids("Groups:"),
            capabilities: ["CapInh:", "CapPrm:", "CapEff:", "CapAmb:"]
                .map(set)
                .iter()
                .fold(0, |all, s| all | s),
            bounding: set("CapBnd:"),
            no_new_privileges: field("NoNewPrivs:") == "1",
            seccomp: field("Seccomp:").parse().unwrap_or(0),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use patience::prelude::*;

    #[test]
    fn a_status_is_read_as_the_kernel_writes_it() {
        let text = "Name:\tdriver-loop\nUid:\t1\t2\t3\t4\nGid:\t5\t5\t5\t5\nGroups:\t7 8 \nCapInh:\t01\nCapPrm:\t02\n\
                    CapEff:\t04\nCapBnd:\t1ff\nCapAmb:\t08\nNoNewPrivs:\t1\nSeccomp:\t2\nSeccomp_filters:\t3\n";
        let status = ThreadStatus::parse(text);
        assert_eq!((status.name.as_str(), status.capabilities, status.bounding), ("driver-loop", 0xf, 0x1ff));
        assert_eq!((status.uids, status.gids, status.groups), (vec![1, 2, 3, 4], vec![5; 4], vec![7, 8]));
        assert_eq!((status.no_new_privileges, status.seccomp), (true, 2));
    }

    #[test]
    fn what_cannot_be_read_counts_as_the_worst() {
        let status = ThreadStatus::parse("");
        assert_eq!((status.capabilities, status.no_new_privileges, status.seccomp), (u64::MAX, false, 0));
    }

    #[test]
    fn every_thread_of_this_process_is_seen() {
        let (started, wait) = std::sync::mpsc::channel();
        let (end, ended) = std::sync::mpsc::channel::<()>();
        let thread = std::thread::Builder::new().name("seen".into()).spawn(move || {
            started.send(()).unwrap();
            let _ = ended.bounded_recv();
        });
        wait.bounded_recv().unwrap();
        // Threads of other tests end meanwhile.
        let seen = patience::until_some("all threads", || ThreadFiles::open().ok()?.read().ok());
        assert!(seen.iter().any(|status| status.name == "seen"), "{seen:?}");
        drop(end);
        thread.unwrap().bounded_join().unwrap();
    }
}
