//! Kernel settings that root has set, read back and published for those who cannot read them.
//!
//! Problem: the share of the fair server stands in debugfs, which root alone may enter. A driver that runs as an
//! ordinary user could never tell that it is off.
//! Model: `phantom3-machine` writes a line for each setting, `set PATH VALUE`, or `kept PATH VALUE` for what the
//! kernel refused to change. The last line about a path counts. Where a program can read the setting itself, what it
//! reads counts, and not this.
//! Invariant: believed only if root owns the file and its directory and nobody else may write either. Below `/run`
//! it does not outlive the boot it was made in.

use crate::installed::READ_BACK;
use std::fs::{self, File};
use std::io::Read;
use std::os::unix::fs::{MetadataExt, OpenOptionsExt};
use std::path::Path;

/// Who could have written a file or directory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Writers {
    /// User id of the owner.
    pub uid: u32,
    /// Permission bits.
    pub mode: u32,
}

impl Writers {
    fn is_root_alone(self) -> bool {
        self.uid == 0 && self.mode & 0o022 == 0
    }
}

impl From<&fs::Metadata> for Writers {
    fn from(meta: &fs::Metadata) -> Self {
        Self { uid: meta.uid(), mode: meta.mode() & 0o7777 }
    }
}

/// What root has published.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ReadBack {
    text: String,
}

impl ReadBack {
    /// This machine's; none if nothing was published, or nothing that may be believed.
    #[must_use]
    pub fn of_this_machine() -> Option<Self> {
        Self::at(Path::new(READ_BACK))
    }

    fn at(path: &Path) -> Option<Self> {
        let directory = fs::symlink_metadata(path.parent()?).ok().filter(fs::Metadata::is_dir)?;
        // The file that was looked at is the one that is read.
        let flags = libc::O_NOFOLLOW | libc::O_NONBLOCK;
        let file = File::options().read(true).custom_flags(flags).open(path).ok()?;
        let meta = file.metadata().ok().filter(fs::Metadata::is_file)?;
        let mut text = String::new();
        file.take(MOST_BYTES).read_to_string(&mut text).ok()?;
        Self::believed((&directory).into(), (&meta).into(), text)
    }

    /// The published text, if nobody but root can have written it.
    #[must_use]
    pub fn believed(directory: Writers, file: Writers, text: String) -> Option<Self> {
        (directory.is_root_alone() && file.is_root_alone()).then_some(Self { text })
    }

    /// The value that a file of the kernel had when root looked.
    #[must_use]
    pub fn value(&self, path: &str) -> Option<&str> {
        self.line(path).map(|(_, value)| value)
    }

    /// Whether the kernel refused root's change of a file.
    #[must_use]
    pub fn was_refused(&self, path: &str) -> bool {
        self.line(path).is_some_and(|(word, _)| word == "kept")
    }

    fn line(&self, path: &str) -> Option<(&str, &str)> {
        self.text.lines().rev().find_map(|line| {
            let mut words = line.splitn(3, ' ');
            let (word, found, value) = (words.next()?, words.next()?, words.next()?);
            (found == path && matches!(word, "set" | "kept")).then(|| (word, value.trim()))
        })
    }
}

/// Some hundred lines of a hundred bytes, and room.
const MOST_BYTES: u64 = 1 << 20;

#[cfg(test)]
mod tests {
    use super::*;

    const SERVER: &str = "/sys/kernel/debug/sched/fair_server/cpu3/runtime";
    const ROOT: Writers = Writers { uid: 0, mode: 0o755 };

    fn believed(directory: Writers, file: Writers) -> Option<ReadBack> {
        let text = format!("set {SERVER} 50000000\nkept /proc/irq/40/smp_affinity 8\nset {SERVER} 0\n");
        ReadBack::believed(directory, file, text)
    }

    #[test]
    fn the_last_line_about_a_setting_counts() {
        let read_back = believed(ROOT, Writers { mode: 0o644, ..ROOT }).unwrap();
        assert_eq!(read_back.value(SERVER), Some("0"));
        assert!(!read_back.was_refused(SERVER));
        assert!(read_back.was_refused("/proc/irq/40/smp_affinity"));
        assert_eq!(read_back.value("/proc/irq/40/smp_affinity"), Some("8"));
        assert_eq!(read_back.value("/proc/irq/4"), None, "a path is not its beginning");
    }

    #[test]
    fn what_anybody_but_root_could_have_written_is_not_believed() {
        let file = Writers { mode: 0o644, ..ROOT };
        assert!(believed(ROOT, file).is_some());
        for (uid, mode) in [(1000, 0o644), (0, 0o664), (0, 0o646), (0, 0o777)] {
            assert_eq!(believed(ROOT, Writers { uid, mode }), None, "file of {uid}, {mode:o}");
        }
        for (uid, mode) in [(1000, 0o755), (0, 0o775), (0, 0o1777)] {
            assert_eq!(believed(Writers { uid, mode }, file), None, "directory of {uid}, {mode:o}");
        }
    }

    #[test]
    fn damaged_lines_say_nothing() {
        for text in ["", "set", "set ", &format!("set {SERVER}"), &format!("was {SERVER} 0"), "\n\n \n"] {
            let read_back = ReadBack { text: text.to_owned() };
            assert_eq!(read_back.value(SERVER), None, "{text:?}");
        }
    }

    #[test]
    fn a_link_in_the_files_place_is_not_followed() {
        let directory = tempfile::tempdir().unwrap();
        let (file, link) = (directory.path().join("file"), directory.path().join("read-back"));
        fs::write(&file, format!("set {SERVER} 0\n")).unwrap();
        std::os::unix::fs::symlink(&file, &link).unwrap();
        assert_eq!(ReadBack::at(&link), None);
        // The same without a link: believed where these tests run as root, and only there.
        let as_root = fs::metadata(&file).unwrap().uid() == 0;
        assert_eq!(ReadBack::at(&file).is_some(), as_root);
        assert_eq!(ReadBack::at(&directory.path().join("absent")), None);
    }
}
