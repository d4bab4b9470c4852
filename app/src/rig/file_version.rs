//! Version of a file on disk: whether a file that is read for the second time is the one that was read first.
//!
//! Model: device, inode, length and the times of the last change of content and of state, which no program can set back.
//! Of a change in between nothing is missed but one within the clock of the file system, a few milliseconds.

use std::fs::Metadata;
use std::os::unix::fs::MetadataExt;
use std::path::Path;

/// Version of a file's content, as far as its metadata tell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct FileVersion {
    file: (u64, u64),
    length: u64,
    content_changed: (i64, i64),
    state_changed: (i64, i64),
}

impl FileVersion {
    /// `None`: there is no such file.
    pub(super) fn of(path: &Path) -> Option<Self> {
        path.metadata().ok().map(|found| Self::from(&found))
    }
}

impl From<&Metadata> for FileVersion {
    fn from(found: &Metadata) -> Self {
        Self {
            file: (found.dev(), found.ino()),
            length: found.len(),
            content_changed: (found.mtime(), found.mtime_nsec()),
            state_changed: (found.ctime(), found.ctime_nsec()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_another_one_of_equal_length_and_time_replaces_has_another_version() {
        let directory = tempfile::tempdir().expect("a directory");
        let [file, other] = ["file", "other"].map(|name| directory.path().join(name));
        std::fs::write(&file, "one").expect("room");
        std::fs::write(&other, "two").expect("room");
        let time = file.metadata().and_then(|found| found.modified()).expect("a time");
        std::fs::File::options()
            .write(true)
            .open(&other)
            .and_then(|other| other.set_modified(time))
            .expect("ours");
        let before = FileVersion::of(&file);
        assert!(before.is_some() && before == FileVersion::of(&file));
        std::fs::rename(&other, &file).expect("ours");
        assert_ne!(before, FileVersion::of(&file));
        std::fs::remove_file(&file).expect("ours");
        assert_eq!(FileVersion::of(&file), None);
    }
}
