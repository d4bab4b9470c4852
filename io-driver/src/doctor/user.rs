//! The user who asks, for judging what files are open to it.

use rt_core::doctor::machine::{FileStatus, Machine, Obstacle};

/// Who asks: ids as `/proc/self/status` tells them.
pub(super) struct User {
    /// Effective user id.
    pub(super) uid: u32,
    groups: Vec<u32>,
}

impl User {
    pub(super) fn of(machine: &Machine<'_>) -> Result<Self, Obstacle> {
        const STATUS: &str = "/proc/self/status";
        let status = machine.text(STATUS)?;
        // The second number is the effective one.
        let ids = |key: &str| -> Option<Vec<u32>> {
            let line = status.lines().find_map(|line| line.strip_prefix(key))?;
            line.split_whitespace().map(|id| id.parse().ok()).collect()
        };
        let effective = |key: &str| ids(key)?.get(1).copied();
        let user = effective("Uid:").zip(effective("Gid:"));
        let (uid, gid) = user.ok_or_else(|| Obstacle::garbled(STATUS, &status))?;
        let mut groups = ids("Groups:").unwrap_or_default();
        groups.push(gid);
        Ok(Self { uid, groups })
    }

    /// Whether it may read and write a file, or make files in a directory.
    pub(super) fn may_write(&self, file: &FileStatus) -> bool {
        let needed = match self.uid {
            0 => return true,
            uid if uid == file.uid => 0o600,
            _ if self.groups.contains(&file.gid) => 0o060,
            _ => 0o006,
        };
        file.mode & needed == needed
    }
}
