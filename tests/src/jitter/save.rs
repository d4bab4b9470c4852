//! Results on disk while the measurement goes on.
//!
//! Model: the whole JSON file is written beside the former one, brought to disk, and then takes its place: a crash
//! after four days leaves the state of a minute ago. A disk that is full or gone is told once, and
//! again when it changes its mind; the measurement goes on in memory, and does not wait for the disk.

use crate::jitter::document::Document;
use crate::jitter::error::JitterError;
use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Where results go.
#[derive(Debug)]
pub struct Saver {
    directory: PathBuf,
    every: Duration,
    last: Instant,
    /// What went wrong the last time.
    trouble: Option<String>,
    /// A write on its way.
    writer: Option<JoinHandle<Option<String>>>,
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
        Ok(Self { directory: directory.into(), every, last: Instant::now(), trouble: None, writer: None })
    }

    /// The directory.
    pub fn directory(&self) -> &Path {
        &self.directory
    }

    /// Whether it is time, and the last write is done.
    pub fn is_due(&self) -> bool {
        self.writer.is_none() && self.last.elapsed() >= self.every
    }

    /// Writes beside the measurement: a disk may take longer than the driver's ring is long.
    pub fn begin_save(&mut self, document: &Document) {
        self.last = Instant::now();
        let (file, text) = (self.directory.join(RESULT), document.to_json());
        self.writer = Some(std::thread::spawn(move || trouble(&file, &text)));
    }

    /// What is to be told of a write that has ended meanwhile.
    pub fn news(&mut self) -> Option<String> {
        let writer = self.writer.take_if(|writer| writer.is_finished())?;
        self.judge(writer.join().unwrap_or_else(|_| Some("the writing thread panicked".into())))
    }

    /// Writes now; returns what went wrong, told before or not.
    pub fn save(&mut self, document: &Document) -> Option<String> {
        if let Some(writer) = self.writer.take() {
            // What it says is out of date in a moment.
            let _ = writer.join();
        }
        trouble(&self.directory.join(RESULT), &document.to_json())
    }

    fn judge(&mut self, trouble: Option<String>) -> Option<String> {
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

fn trouble(file: &Path, text: &str) -> Option<String> {
    write_atomically(file, text.as_bytes()).err().map(|error| error.to_string())
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
        let mut save = || {
            saver.begin_save(&document(&[]));
            patience::until("the end of a write", || {
                saver.writer.as_ref().is_none_or(JoinHandle::is_finished)
            });
            saver.news()
        };
        assert_eq!(save(), None);
        std::fs::remove_dir_all(&directory).unwrap();
        assert!(save().unwrap().contains("goes on in memory"));
        assert_eq!(save(), None, "said already");
        std::fs::create_dir(&directory).unwrap();
        assert!(save().unwrap().contains("written again"));
        assert!(Document::load(&directory.join(RESULT)).is_ok());
        assert_eq!(saver.save(&document(&[])), None);
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
