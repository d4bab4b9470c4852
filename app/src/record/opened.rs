//! Output file in two steps: opened with what it has, and emptied once nothing can refuse the start any more.
//!
//! Problem: a run that cannot start, because another of its files cannot be made, must not cost an earlier recording.
//! Invariant: a file that was made here and not emptied is removed again.

use super::destination::{is_standard_output, shown};
use crate::recording::RecordingError;
use rt_core::output_file;
use std::fs::{File, OpenOptions};
use std::io;
use std::os::fd::AsFd;
use std::path::{Path, PathBuf};

/// A file that can be written, with its earlier content.
#[derive(Debug)]
pub struct Opened {
    file: File,
    path: PathBuf,
    made: Made,
}

/// What is lost if a file is emptied for nothing, the least first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum AtStake {
    Nothing,
    Place,
    Content,
}

/// A file that was not there before, and goes again with this value.
#[derive(Debug)]
struct Made(Option<PathBuf>);

impl Drop for Made {
    fn drop(&mut self) {
        if let Some(path) = &self.0 {
            // Should it be gone already, so much the better.
            let _ = std::fs::remove_file(path);
        }
    }
}

impl Opened {
    /// Opens the file, or makes it; or gives the standard output another descriptor.
    ///
    /// # Errors
    /// If the system refuses, or it is a pipe that nobody reads.
    pub fn open(path: &Path) -> io::Result<Self> {
        let (file, made) = if is_standard_output(path) {
            (io::stdout().as_fd().try_clone_to_owned().map(File::from)?, None)
        } else {
            open_or_make(path)?
        };
        Ok(Self { file, path: path.into(), made: Made(made) })
    }

    /// The same for a recording.
    ///
    /// # Errors
    /// As above.
    pub fn recording(path: &Path) -> Result<Self, RecordingError> {
        Self::open(path).map_err(|source| RecordingError::Create { file: shown(path), source })
    }

    /// Its name.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// What emptying it would cost: nothing for a stream, its place for a file that is empty, else its content.
    fn at_stake(&self) -> AtStake {
        match self.file.metadata() {
            _ if !self.is_emptied() => AtStake::Nothing,
            Ok(found) if found.len() == 0 => AtStake::Place,
            _ => AtStake::Content,
        }
    }

    /// Empties it, and keeps it whatever becomes of it. The standard output goes on behind what is there.
    ///
    /// # Errors
    /// If the system refuses.
    pub fn empty(self) -> io::Result<File> {
        if self.is_emptied() {
            self.file.set_len(0)?;
        }
        let Self { file, mut made, .. } = self;
        made.0 = None;
        Ok(file)
    }

    /// Streams and devices have nothing to be cut off.
    fn is_emptied(&self) -> bool {
        !is_standard_output(&self.path) && self.file.metadata().is_ok_and(|found| found.is_file())
    }
}

/// Opens all files and begins each, with its number. None is emptied before all are open, and those with most at stake
/// come last: a beginning that does not fit on a disk costs none of them.
///
/// # Errors
/// The first that cannot be opened or begun.
pub fn begin_all<T>(
    paths: &[&PathBuf],
    mut begin: impl FnMut(usize, Opened) -> Result<T, RecordingError>,
) -> Result<Vec<T>, RecordingError> {
    let opened = paths.iter().map(|path| Opened::recording(path)).collect::<Result<Vec<_>, _>>()?;
    let mut opened: Vec<_> = opened.into_iter().enumerate().collect();
    opened.sort_by_key(|(_, file)| file.at_stake());
    let begin = |(number, file)| Ok((number, begin(number, file)?));
    let mut begun = opened.into_iter().map(begin).collect::<Result<Vec<_>, RecordingError>>()?;
    begun.sort_by_key(|(number, _)| *number);
    Ok(begun.into_iter().map(|(_, file)| file).collect())
}

/// The file, and its name if it was not there.
fn open_or_make(path: &Path) -> io::Result<(File, Option<PathBuf>)> {
    let mut options = OpenOptions::new();
    options.write(true);
    match output_file::open(path, options.clone().create_new(true)) {
        Ok(file) => Ok((file, Some(path.into()))),
        // It is there; or it is a link to a file that is not.
        Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {
            Ok((output_file::open(path, options.create(true))?, None))
        }
        Err(error) => Err(error),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_keeps_its_content_until_it_is_emptied_and_one_that_was_made_for_nothing_is_removed() {
        let directory = tempfile::tempdir().expect("a directory");
        let (old, new) = (directory.path().join("old"), directory.path().join("new"));
        std::fs::write(&old, "earlier").expect("written");
        let opened = [&old, &new].map(|path| Opened::open(path).expect("opened"));
        assert_eq!(opened.each_ref().map(Opened::at_stake), [AtStake::Content, AtStake::Place]);
        assert!(new.exists());
        drop(opened);
        assert_eq!(std::fs::read(&old).expect("readable"), b"earlier");
        assert!(!new.exists());
        for path in [&old, &new] {
            Opened::open(path).and_then(Opened::empty).expect("created");
            assert_eq!(std::fs::read(path).expect("readable"), b"");
        }
    }
}
