//! Which process commands a driver, found without asking the driver.
//!
//! Problem: the driver tells a lease's holder only to somebody who wants the lease, and an observer wants nothing.
//! Model: each lease has a commander's segment of its own, which nobody maps but the driver and its holder. So the
//! other process with a mapping of the same inode is it. Processes of other users, and a driver that was
//! started with more rights than ours, do not show their mappings: then nobody is found.
//! Cost: reads `/proc/*/maps`, some milliseconds, hence once a lease and a few times more if that finds nobody.

use crate::status::Status;
use std::fs;
use std::time::Duration;

/// A process that commands.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Commander {
    pub(super) pid: u64,
    pub(super) name: String,
}

/// Remembers who was found for which lease.
#[derive(Debug, Default)]
pub(super) struct CommanderWatch {
    driver_pid: u64,
    lease: u64,
    found: Option<Commander>,
    tries_left: u32,
    next: Duration,
}

/// A lease counts from the next tick on, its segment is there before: one try is nearly always enough.
const TRIES: u32 = 3;
const PAUSE: Duration = Duration::from_secs(1);

impl CommanderWatch {
    /// Who commands at this moment of the monitor's clock, as far as that can be seen.
    pub(super) fn at(&mut self, now: Duration, status: &Status) -> Option<Commander> {
        if (self.driver_pid, self.lease) != (status.driver_pid, status.lease) {
            let tries_left = if status.lease == 0 { 0 } else { TRIES };
            *self =
                Self { driver_pid: status.driver_pid, lease: status.lease, tries_left, ..Self::default() };
        }
        if self.found.is_none() && self.tries_left > 0 && now >= self.next {
            self.found = find(status.driver_pid);
            self.tries_left -= 1;
            self.next = now + PAUSE;
        }
        self.found.clone()
    }
}

fn find(driver_pid: u64) -> Option<Commander> {
    let mut inodes = commander_segments(driver_pid);
    inodes.dedup();
    // Two: a lease ends just now.
    let [inode] = &inodes[..] else { return None };
    let processes = fs::read_dir("/proc").ok()?.flatten();
    let pids = processes.filter_map(|entry| entry.file_name().to_str()?.parse().ok());
    // A process that it forked has the mapping too, and came later.
    let others = pids.filter(|pid| *pid != driver_pid);
    let pid = others.filter(|pid| commander_segments(*pid).contains(inode)).min()?;
    let name = fs::read_to_string(format!("/proc/{pid}/comm")).unwrap_or_default();
    Some(Commander { pid, name: name.trim_end().into() })
}

/// Inodes of the commander's segments that a process has mapped.
fn commander_segments(pid: u64) -> Vec<String> {
    let maps = fs::read_to_string(format!("/proc/{pid}/maps")).unwrap_or_default();
    // Addresses, rights, offset, device, inode, name.
    let inode = |line: &str| {
        let words: Vec<&str> = line.split_ascii_whitespace().collect();
        (words.get(5) == Some(&"/memfd:phantom3-commander")).then(|| words[4].to_owned())
    };
    maps.lines().filter_map(inode).collect()
}
