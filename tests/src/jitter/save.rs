//! Results on disk while the measurement goes on.
//!
//! Model: the whole JSON file is written beside the former one, brought to disk, and then takes its place: a crash
//! after four days leaves the state of a minute ago. A disk that is full or gone is told once, and
//! again when it changes its mind; the measurement goes on in memory.

use crate::jitter::document::Document;
use crate::jitter::error::JitterError;
use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Where results go.
#[derive(Debug)]
pub struct Saver {
    directory: PathBuf,
    every: Duration,
    last: Instant,
    /// What went wrong the last time.
    trouble: Option<String>,
}

impl Saver {
    /// Makes the directory.
    ///
    /// # Errors
    /// If it cannot be made, or holds results already.
    pub fn new(directory: &Path, every: Duration) -> Result<Self, JitterError> {
        let refuse = |detail: String| JitterError::Usage(format!("--out {}: {detail}", directory.display()));
        std::fs::create_dir_all(directory).map_err(|error| refuse(error.to_string()))?;
        if directory.join(RESULT).exists() {
            return Err(refuse("it holds results already; name another directory".into()));
        }
        Ok(Self { directory: directory.into(), every, last: Instant::now(), trouble: None })
    }

    /// The directory.
    pub fn directory(&self) -> &Path {
        &self.directory
    }

    /// Whether it is time.
    pub fn is_due(&self) -> bool {
        self.last.elapsed() >= self.every
    }

    /// Writes; returns what is to be told, if that has changed.
    pub fn save(&mut self, document: &Document) -> Option<String> {
        self.last = Instant::now();
        let trouble = write_atomically(&self.directory.join(RESULT), document.to_json().as_bytes()).err();
        let trouble = trouble.map(|error| error.to_string());
        if trouble == self.trouble {
            return None;
        }
        let message = match &trouble {
            Some(error) => format!(
                "results cannot be written to {}: {error}; the measurement goes on in memory and tries again",
                self.directory.display()
            ),
            None => "results are written again".into(),
        };
        self.trouble = trouble;
        Some(message)
    }
}

/// Name of the file with everything.
pub const RESULT: &str = "result.json";

/// Writes a file that is either the former or the new one, whole.
///
/// # Errors
/// What the system said; the former file is untouched then.
pub fn write_atomically(file: &Path, bytes: &[u8]) -> std::io::Result<()> {
    let mut name = file.as_os_str().to_owned();
    name.push(".part");
    let part = PathBuf::from(name);
    let write = || {
        let mut out = File::create(&part)?;
        out.write_all(bytes)?;
        out.sync_all()?;
        std::fs::rename(&part, file)
    };
    write().inspect_err(|_| {
        let _ = std::fs::remove_file(&part);
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::jitter::document::tests::document;

    #[test]
    fn a_directory_that_vanishes_is_told_once_and_its_return_too() {
        let parent = tempfile::tempdir().unwrap();
        let directory = parent.path().join("out");
        let mut saver = Saver::new(&directory, Duration::from_secs(1)).unwrap();
        assert_eq!(saver.save(&document(&[])), None);
        std::fs::remove_dir_all(&directory).unwrap();
        assert!(saver.save(&document(&[])).unwrap().contains("goes on in memory"));
        assert_eq!(saver.save(&document(&[])), None, "said already");
        std::fs::create_dir(&directory).unwrap();
        assert!(saver.save(&document(&[])).unwrap().contains("written again"));
        assert!(Document::load(&directory.join(RESULT)).is_ok());
    }

    #[test]
    fn a_full_disk_leaves_the_former_file_whole() {
        // Writes to /dev/full fail for lack of space; the rename that would follow must not happen.
        let directory = tempfile::tempdir().unwrap();
        let file = directory.path().join("result.json");
        write_atomically(&file, b"former").unwrap();
        std::os::unix::fs::symlink("/dev/full", directory.path().join("result.json.part")).unwrap();
        let error = write_atomically(&file, b"new").unwrap_err();
        assert_eq!(error.kind(), std::io::ErrorKind::StorageFull);
        assert_eq!(std::fs::read(&file).unwrap(), b"former");
    }

    #[test]
    fn former_results_are_not_overwritten() {
        let directory = tempfile::tempdir().unwrap();
        std::fs::write(directory.path().join(RESULT), "x").unwrap();
        let error = Saver::new(directory.path(), Duration::from_secs(1)).unwrap_err();
        assert!(error.to_string().contains("holds results already"), "{error}");
    }
}
