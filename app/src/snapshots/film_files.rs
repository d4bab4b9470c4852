//! Files of a film: numbered pictures in a directory that one run has for itself.
//!
//! Problem: pictures that are left out, or cannot be written, would leave those of an earlier film among the new ones.
//! Model: the directory is claimed (flock(2)) while the run goes on. Numbers are settled in their order: one without a picture
//! loses the earlier film's when the next one is written, those behind the last one at the end ([`FilmFiles::settle`]).
//! A directory that is renamed meanwhile gets no more pictures, nor does the one in its place, which nobody has claimed.
//! Invariants: of a film without a single picture nothing is removed; what is removed is called as a picture of the film to the
//! letter, and is a file or a link, which is not followed.

use super::Film;
use rustix::fs::{Mode, OFlags};
use std::ffi::OsStr;
use std::fs::{File, TryLockError};
use std::io;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// Directory of a film, while it has it.
#[derive(Debug)]
pub(super) struct Claim {
    /// Whatever its name leads to later.
    directory: File,
    /// One that may not be read, or of a file system without such locks, has none.
    _lock: Option<File>,
}

/// Claims the directory of a film, which is made if it is not there.
///
/// # Errors
/// If it cannot be made, or somebody holds a lock on it, in words.
pub(super) fn claim(directory: &Path) -> Result<Claim, String> {
    let place = directory.display();
    let wrong = |error: io::Error| format!("--frames {place}: {error}");
    std::fs::create_dir_all(directory).map_err(wrong)?;
    let as_place = OFlags::PATH | OFlags::DIRECTORY | OFlags::CLOEXEC;
    let itself = rustix::fs::open(directory, as_place, Mode::empty()).map_err(|errno| wrong(errno.into()))?;
    let lock = File::open(directory).ok();
    if matches!(lock.as_ref().map(File::try_lock), Some(Err(TryLockError::WouldBlock))) {
        return Err(format!(
            "--frames {place}: somebody holds a lock on it, as a run does that makes a film there; name another directory, \
             or wait until it is released"
        ));
    }
    Ok(Claim { directory: itself.into(), _lock: lock })
}

/// The names of one film.
#[derive(Debug, Clone)]
pub(super) struct FilmFiles {
    directory: PathBuf,
    claim: Arc<Claim>,
    /// The number behind the last picture that was written; 0: there is none.
    settled: Arc<AtomicU64>,
    /// Pictures of another film that cannot be removed.
    stuck: Arc<AtomicU64>,
}

impl FilmFiles {
    /// In the film's directory, claimed by this.
    pub(super) fn of(film: &Film, claim: Claim) -> Self {
        let (directory, claim) = (film.directory.clone(), Arc::new(claim));
        Self { directory, claim, settled: Arc::default(), stuck: Arc::default() }
    }

    /// Readies the place of the picture of this number. A link there, or one of several names of a file, is that no more: a film
    /// has files of its own, and what it led to may be what is drawn.
    ///
    /// # Errors
    /// If the directory's name leads to another one by now, or to none.
    pub(super) fn ready(&self, number: u64) -> io::Result<()> {
        self.check_directory()?;
        let file = self.name(number);
        if let Ok(found) = std::fs::symlink_metadata(&file)
            && (found.is_symlink() || found.is_file() && found.nlink() > 1)
        {
            // Whoever may not do that is told when the picture cannot be written.
            let _ = std::fs::remove_file(&file);
        }
        Ok(())
    }

    fn check_directory(&self) -> io::Result<()> {
        let [claimed, found] = [self.claim.directory.metadata()?, self.directory.metadata()?];
        if (claimed.dev(), claimed.ino()) == (found.dev(), found.ino()) {
            return Ok(());
        }
        Err(io::Error::other("the directory's name leads to another one by now"))
    }

    /// The picture of this number is written.
    ///
    /// # Errors
    /// As [`Self::ready`]: it is in another directory.
    pub(super) fn written(&self, number: u64) -> io::Result<()> {
        self.check_directory()?;
        self.remove_before(number);
        self.settled.store(number + 1, Ordering::Relaxed);
        Ok(())
    }

    /// The film is over: so many pictures were due.
    pub(super) fn settle(&self, due: u64) {
        if self.settled.load(Ordering::Relaxed) > 0 && self.check_directory().is_ok() {
            self.remove_before(due);
            self.settled.fetch_max(due, Ordering::Relaxed);
        }
    }

    fn remove_before(&self, number: u64) {
        for missing in self.settled.load(Ordering::Relaxed)..number {
            let file = self.name(missing);
            let is_picture =
                std::fs::symlink_metadata(&file).is_ok_and(|found| found.is_file() || found.is_symlink());
            if is_picture && std::fs::remove_file(&file).is_err() {
                self.stuck.fetch_add(1, Ordering::Relaxed);
            }
        }
    }

    /// Pictures of another film in the places of this one's.
    pub(super) fn stuck(&self) -> u64 {
        self.stuck.load(Ordering::Relaxed)
    }

    /// Pictures of another film that lie behind those of this one.
    pub(super) fn older(&self) -> usize {
        if self.check_directory().is_err() {
            return 0;
        }
        let Ok(entries) = std::fs::read_dir(&self.directory) else { return 0 };
        let settled = self.settled.load(Ordering::Relaxed);
        let is_older = |name: &OsStr| {
            let number = name
                .to_str()
                .and_then(|name| name.strip_prefix("frame-")?.strip_suffix(".png")?.parse().ok());
            number.is_some_and(|number| number >= settled && self.name(number).file_name() == Some(name))
        };
        entries.flatten().filter(|entry| is_older(&entry.file_name())).count()
    }

    /// Place of the picture of this number.
    pub(super) fn name(&self, number: u64) -> PathBuf {
        self.directory.join(format!("frame-{number:06}.png"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_film_leaves_nothing_of_an_earlier_one_among_its_pictures() {
        let place = tempfile::tempdir().expect("a directory");
        let directory = place.path().join("film");
        let film = Film { directory: directory.clone(), fps: 10.0 };
        let claimed = claim(&directory).expect("nobody has it");
        let name = |number: u64| directory.join(format!("frame-{number:06}.png"));
        let mine = place.path().join("mine");
        std::fs::write(&mine, "mine").expect("room");
        for number in 0..9 {
            match number {
                2 => std::os::unix::fs::symlink(&mine, name(number)).expect("a link"),
                4 => std::fs::create_dir(name(number)).expect("room"),
                _ => std::fs::write(name(number), "old").expect("room"),
            }
        }
        std::fs::write(directory.join("frame-2.png"), "another's").expect("room");

        let files = FilmFiles::of(&film, claimed);
        files.settle(3);
        assert_eq!((files.older(), name(0).exists()), (9, true), "a film without a picture replaces none");
        for number in [1, 3] {
            files.ready(number).expect("it is there");
            std::fs::write(name(number), "new").expect("room");
            files.written(number).expect("it is there");
        }
        assert!(name(5).exists(), "its picture may still come");
        files.settle(7);
        let left: Vec<u64> = (0..9).filter(|number| name(*number).symlink_metadata().is_ok()).collect();
        assert_eq!(left, [1, 3, 4, 7, 8], "two new ones, no picture, and what lies behind");
        assert_eq!((files.older(), files.stuck()), (2, 0));
        assert_eq!(std::fs::read_to_string(&mine).expect("there"), "mine");
        assert!(directory.join("frame-2.png").exists(), "it is not called as a picture of the film");
    }

    #[test]
    fn a_directory_that_is_renamed_or_replaced_gets_no_more_pictures() {
        let place = tempfile::tempdir().expect("a directory");
        let [directory, other] = ["film", "moved"].map(|name| place.path().join(name));
        let film = Film { directory: directory.clone(), fps: 10.0 };
        let files = FilmFiles::of(&film, claim(&directory).expect("nobody has it"));
        files.ready(0).expect("it is there");
        files.written(0).expect("it is there");
        std::fs::write(files.name(7), "older").expect("room");
        assert_eq!(files.older(), 1);
        std::fs::rename(&directory, &other).expect("our own");
        assert_eq!(files.ready(1).expect_err("gone").kind(), io::ErrorKind::NotFound);
        std::fs::create_dir(&directory).expect("room");
        std::fs::write(files.name(1), "another's").expect("room");
        files.ready(1).expect_err("another one");
        files.written(1).expect_err("it is in another one");
        assert_eq!(files.older(), 0, "nothing of this film's");
        files.settle(2);
        assert!(files.name(1).exists(), "it is another's");
        std::fs::remove_dir_all(&directory)
            .and_then(|()| std::fs::rename(&other, &directory))
            .expect("our own");
        files.ready(1).expect("it is back");
    }

    #[test]
    fn a_directory_has_one_film_at_a_time() {
        let place = tempfile::tempdir().expect("a directory");
        let directory = place.path().join("film");
        let first = claim(&directory).expect("nobody has it");
        let refused = claim(&directory).expect_err("the first one has it");
        assert!(refused.contains("film: somebody holds a lock on it"), "{refused}");
        drop(first);
        assert!(claim(&directory).is_ok());
    }
}
