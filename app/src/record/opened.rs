//! Output file in two steps: opened with what it has, and emptied once nothing can refuse the start any more.
//!
//! Problem: a run that cannot start, because another of its files cannot be made, or there is no thread or no memory for
//! it, must not cost an earlier recording; nor may one process empty what another one writes.
//! Model: a regular file is claimed when it is opened, until it is closed. The standard output is not: who opened it lets
//! whom they want write there. A file with content keeps it until its first piece with a row is written, for which room
//! is reserved then ([`Opened::start`]); that its beginning alone will fit is found out before the run
//! ([`Opened::reserve`]). The piece is written over the content, in whose room and the reserved one it lies: also on a disk
//! that others fill meanwhile. File systems that copy what is written over (btrfs) reserve no room for that, and may refuse the
//! piece itself: there it is tried beside the file first. The rest of the content is cut off behind the piece and not before;
//! what was written over is put back if anything is refused. Until then the first byte is [`HALF_REPLACED`], so that nobody
//! takes what a killed process leaves for one recording. Any other file begins at once.
//! Invariant: what was opened and not started is as it was: a file that was made here is removed again.

use super::destination::{is_standard_output, shown};
use crate::recording::RecordingError;
use rt_core::{limits, output_file};
use rustix::fs::{FallocateFlags, Mode, OFlags, fallocate};
use rustix::io::Errno;
use rustix::termios::isatty;
use std::cell::Cell;
use std::fs::{File, Metadata, OpenOptions};
use std::io::{self, Read, Seek, Write};
use std::os::fd::{AsFd, AsRawFd};
use std::os::unix::fs::{FileExt, FileTypeExt, MetadataExt};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// First byte of a file with a part of its earlier content behind a first piece: that of no recording.
pub(super) const HALF_REPLACED: u8 = 0;

/// So often a file that is being opened may be removed by others who made it for nothing.
const MOST_REMOVED: u32 = 100;

/// A file that can be written, with its earlier content until it is started.
#[derive(Debug)]
pub struct Opened {
    file: File,
    path: PathBuf,
    before: Before,
    /// Last change of the content before room was reserved behind it, if some was.
    changed: Cell<Option<SystemTime>>,
}

/// Former state of a file, which it has again with this value.
#[derive(Debug, Clone, PartialEq, Eq)]
enum Before {
    /// A stream; or it was started, and stays.
    Stays,
    /// It was not there.
    Absent(PathBuf),
    Empty,
    /// It has it still.
    Content,
}

/// What is lost if a file is emptied for nothing, the least first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum AtStake {
    Nothing,
    Place,
    Content,
}

impl Drop for Opened {
    fn drop(&mut self) {
        // Should it be gone already, so much the better.
        let _ = match &self.before {
            Before::Absent(path) => std::fs::remove_file(path),
            Before::Empty => self.file.set_len(0),
            Before::Content => self.changed.take().map_or(Ok(()), |changed| self.give_room_back(changed)),
            Before::Stays => Ok(()),
        };
    }
}

impl Opened {
    /// Opens the file, or makes it; or gives the standard output another descriptor.
    ///
    /// # Errors
    /// If the system refuses, it is a pipe that nobody reads, another process writes it, or there is no standard output.
    pub fn open(path: &Path) -> io::Result<Self> {
        if is_standard_output(path) {
            if output_file::standard_output_was_closed() {
                return Err(io::Error::other("it was closed when this program started"));
            }
            let file = io::stdout().as_fd().try_clone_to_owned().map(File::from)?;
            return Ok(Self::with(file, path, Before::Stays));
        }
        for _ in 0..MOST_REMOVED {
            let (file, made) = open_or_make(path)?;
            // Whoever claimed it first writes it: it is not removed, whoever made it.
            output_file::claim(&file)?;
            if is_at(&file, path) {
                let before = made.map_or_else(|| Before::of(&file), Before::Absent);
                return Ok(Self::with(file, path, before));
            }
        }
        Err(io::Error::other("others remove it again and again"))
    }

    /// A file that is open already, of which people are told under this name.
    pub fn of(file: File, path: &Path) -> Self {
        let before = Before::of(&file);
        Self::with(file, path, before)
    }

    fn with(file: File, path: &Path, before: Before) -> Self {
        Self { file, path: path.into(), before, changed: Cell::default() }
    }

    /// As [`Self::open`], for a recording.
    ///
    /// # Errors
    /// As there.
    pub fn recording(path: &Path) -> Result<Self, RecordingError> {
        Self::open(path).map_err(|source| match source {
            source if output_file::is_claimed(&source) => RecordingError::Claimed { file: shown(path) },
            source => RecordingError::Create { file: shown(path), source },
        })
    }

    /// Its name.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Writing to it may wait for a reader: it is a pipe, a socket or a terminal.
    pub fn may_wait(&self) -> bool {
        let Ok(kind) = self.file.metadata().map(|found| found.file_type()) else { return true };
        kind.is_fifo() || kind.is_socket() || kind.is_char_device() && isatty(&self.file)
    }

    /// People will look for it by its name. The standard output is somebody else's, who may keep it open.
    pub(super) fn has_name(&self) -> bool {
        !is_standard_output(&self.path) && !output_file::has_no_name(&self.file)
    }

    /// Loss from beginning it in vain: nothing of a stream, its place of a file that is empty, else its content.
    fn at_stake(&self) -> AtStake {
        match &self.before {
            Before::Stays => AtStake::Nothing,
            Before::Absent(_) | Before::Empty => AtStake::Place,
            Before::Content => AtStake::Content,
        }
    }

    /// It has its earlier content, and nothing may be written to it before it is started.
    pub(super) fn has_content(&self) -> bool {
        self.before == Before::Content
    }

    /// Finds out whether so many bytes will fit once it is emptied.
    ///
    /// # Errors
    /// If they will not.
    pub(super) fn reserve(&self, bytes: u64) -> io::Result<()> {
        if bytes == 0 || !self.has_content() {
            return Ok(());
        }
        if limits::largest_file().is_some_and(|most| bytes > most) {
            return Err(Errno::FBIG.into());
        }
        if self.changed.get().is_none() {
            self.changed.set(Some(self.file.metadata()?.modified()?));
        }
        match fallocate(&self.file, FallocateFlags::KEEP_SIZE, 0, bytes) {
            Err(full @ (Errno::NOSPC | Errno::DQUOT | Errno::FBIG)) => Err(full.into()),
            // Of a file system that cannot answer.
            _ => Ok(()),
        }
    }

    /// What was reserved behind the content, which was changed then, belongs to others again.
    fn give_room_back(&self, changed: SystemTime) -> io::Result<()> {
        self.file.set_len(self.file.metadata()?.len())?;
        self.file.set_modified(changed)
    }

    /// Makes ready for a first piece of so many bytes, which is to be written at once, over the content if there is some.
    ///
    /// # Errors
    /// If the piece will not fit, or the system refuses: the file is as it was.
    pub(super) fn start(&mut self, first_bytes: u64) -> io::Result<()> {
        self.reserve(first_bytes)?;
        if !self.has_content() {
            self.before = Before::Stays;
        }
        Ok(())
    }

    /// Writes a first piece over the content, and gives up the rest of that; the file stays from now on, whatever becomes of it.
    ///
    /// # Errors
    /// Refusal by the system: the file has its content as before, or if even that is refused, nothing.
    pub(super) fn replace_content(&mut self, piece: &[u8]) -> io::Result<()> {
        self.replace_and_cut(piece, || self.cut(piece.len() as u64))
            .map(|()| self.before = Before::Stays)
            .or_else(|NotReplaced { why, is_as_before }| {
                if !is_as_before {
                    self.before = Before::Stays;
                    self.cut(0)?;
                }
                Err(why)
            })
    }

    /// Writes the piece over the content, has the rest cut off, and puts the first byte.
    fn replace_and_cut(&self, piece: &[u8], cut: impl FnOnce() -> io::Result<()>) -> Result<(), NotReplaced> {
        let as_before = |why| NotReplaced { why, is_as_before: true };
        let length = self.file.metadata().map_err(as_before)?.len();
        self.try_beside(piece).map_err(as_before)?;
        let replaced = self.contents_first(piece.len());
        let Some((first, rest)) = piece.split_first() else { return cut().map_err(as_before) };
        let written = (&self.file).write_all(&[HALF_REPLACED]).and_then(|()| (&self.file).write_all(rest));
        written.and_then(|()| cut()).map_err(|why| {
            let back = replaced.and_then(|replaced| self.put_back(&replaced, length));
            NotReplaced { why, is_as_before: back.is_ok() }
        })?;
        let whole = self.file.write_all_at(&[*first], 0);
        whole.map_err(|why| NotReplaced { why, is_as_before: false })
    }

    /// Writes of what was replaced as much as was written over, and cuts off what is behind the earlier content.
    fn put_back(&self, replaced: &[u8], length: u64) -> io::Result<()> {
        let reached = (&self.file).stream_position()?;
        // What nobody has written over is not written again: that might be refused where this is not.
        let reached = replaced.len().min(usize::try_from(reached).unwrap_or(usize::MAX));
        (&self.file).rewind()?;
        (&self.file).write_all(&replaced[..reached])?;
        (&self.file).rewind()?;
        self.cut(length)
    }

    /// Writes a piece into a file without a name beside this one, and gives it up again, on file systems that copy what is written
    /// over: it takes the same room there as the piece over the content will, and its first byte once more, and costs nothing if
    /// there is none.
    fn try_beside(&self, piece: &[u8]) -> io::Result<()> {
        const BTRFS: i64 = 0x9123_683e;
        const BCACHEFS: i64 = 0xca45_1a4e;
        const ZFS: i64 = 0x2fc1_2fc1;
        /// At least as large as what a file system takes for a byte.
        const BLOCK_BYTES: usize = 1 << 17;
        // A file system that does not say what it is is taken for a common one.
        let kind = rustix::fs::fstatfs(&self.file).map_or(0, |found| found.f_type);
        if ![BTRFS, BCACHEFS, ZFS].contains(&kind) {
            return Ok(());
        }
        let own = std::fs::read_link(format!("/proc/self/fd/{}", self.file.as_raw_fd()))?;
        let Some(directory) = own.parent() else { return Ok(()) };
        let nameless = rustix::fs::open(directory, OFlags::TMPFILE | OFlags::WRONLY, Mode::RUSR | Mode::WUSR);
        // Where nobody may make a file the piece over the content tells.
        let Ok(trial) = nameless else { return Ok(()) };
        let mut trial = File::from(trial);
        trial.write_all(piece)?;
        trial.write_all(&[0; BLOCK_BYTES])
    }

    /// So many bytes of the content, or all of it if that is less.
    fn contents_first(&self, bytes: usize) -> io::Result<Vec<u8>> {
        // It was opened for writing alone.
        let file = File::open(format!("/proc/self/fd/{}", self.file.as_raw_fd()))?;
        let mut first = Vec::new();
        file.take(bytes as u64).read_to_end(&mut first)?;
        Ok(first)
    }

    fn cut(&self, bytes: u64) -> io::Result<()> {
        if self.file.metadata()?.len() > bytes { self.file.set_len(bytes) } else { Ok(()) }
    }

    /// The file, emptied, which is kept whatever becomes of it. The standard output goes on behind what is there.
    ///
    /// # Errors
    /// If the system refuses.
    pub fn empty(mut self) -> io::Result<File> {
        self.start(0)?;
        self.before = Before::Stays;
        self.cut(0)?;
        self.file.try_clone()
    }

    /// Handle that it is written by.
    pub(super) fn file(&self) -> &File {
        &self.file
    }
}

/// Refusal of a piece over a file's content.
#[derive(Debug)]
struct NotReplaced {
    why: io::Error,
    /// The content is there, to the byte.
    is_as_before: bool,
}

impl Before {
    /// Streams and devices have nothing to be cut off.
    fn of(file: &File) -> Self {
        match file.metadata() {
            Ok(found) if found.is_file() && found.len() > 0 => Self::Content,
            Ok(found) if found.is_file() => Self::Empty,
            _ => Self::Stays,
        }
    }
}

/// Opens all files and begins each, with its number. None is begun before all are open, and those with most at stake
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

/// The name still leads to this file, which somebody may have removed before it was claimed.
fn is_at(file: &File, path: &Path) -> bool {
    let identity = |found: Metadata| (found.dev(), found.ino());
    match (file.metadata(), path.metadata()) {
        (Ok(open), Ok(found)) => !open.is_file() || identity(open) == identity(found),
        _ => false,
    }
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
    use crate::record::whole_lines::WholeLines;

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

    /// As on a full disk whose file system copies what is written over: room is promised, and then there is none.
    #[test]
    fn a_first_piece_that_does_not_fit_after_all_leaves_the_content() {
        use rustix::fs::{MemfdFlags, SealFlags, fcntl_add_seals, memfd_create};
        let flags = MemfdFlags::ALLOW_SEALING | MemfdFlags::CLOEXEC;
        let made = File::from(memfd_create("content", flags).expect("memory"));
        (&made).write_all(b"earlier rows").and_then(|()| (&made).rewind()).expect("room");
        fcntl_add_seals(&made, SealFlags::WRITE).expect("a seal");
        let read = || {
            let mut text = String::new();
            let mut file = File::open(format!("/proc/self/fd/{}", made.as_raw_fd()));
            file.as_mut().expect("open").read_to_string(&mut text).expect("text");
            text
        };
        let file = made.try_clone().expect("a descriptor");
        let mut lines = WholeLines::begin(Opened::of(file, Path::new("content")), "head").expect("begun");
        lines.append(0, |line| line.push('1')).and_then(|()| lines.flush()).expect_err("no room");
        assert!(lines.has_content());
        assert_eq!(read(), "earlier rows");
        drop(lines);
        assert_eq!(read(), "earlier rows");
    }

    /// A file of this content, opened for a recording.
    fn with_content(content: &[u8]) -> (tempfile::TempDir, PathBuf, Opened) {
        let directory = tempfile::tempdir().expect("a directory");
        let path = directory.path().join("old");
        std::fs::write(&path, content).expect("room");
        let opened = Opened::open(&path).expect("opened");
        (directory, path, opened)
    }

    #[test]
    fn a_first_piece_is_no_recording_until_nothing_of_the_content_is_behind_it() {
        for content in [&b"earlier rows, many of them"[..], b"few"] {
            let (_directory, path, mut opened) = with_content(content);
            let read = || std::fs::read(&path).expect("readable");
            let half = [&b"\0ew rows"[..], content.get(8..).unwrap_or_default()].concat();
            // Also where it has grown: what is behind the content is cut off again.
            let refused = opened.replace_and_cut(b"new rows", || {
                assert_eq!(read(), half);
                Err(Errno::IO.into())
            });
            assert!(refused.expect_err("refused").is_as_before);
            assert_eq!(read(), content);
            opened.replace_content(b"new rows").expect("room");
            drop(opened);
            assert_eq!(read(), b"new rows");
        }
    }

    #[test]
    fn room_that_was_reserved_for_nothing_is_given_back_and_the_time_of_the_last_change_stays() {
        let (_directory, path, opened) = with_content(b"earlier rows");
        let found = || {
            let found = path.metadata().expect("there");
            (found.len(), found.blocks(), found.modified().expect("a time"))
        };
        let before = found();
        opened.reserve(1 << 20).expect("room");
        assert!(found().1 >= before.1);
        drop(opened);
        assert_eq!(found(), before);
    }

    #[test]
    fn a_file_that_is_being_written_is_neither_emptied_nor_removed_by_who_comes_second() {
        let directory = tempfile::tempdir().expect("a directory");
        let path = directory.path().join("new");
        let first = Opened::open(&path).expect("opened");
        let refused = Opened::recording(&path).expect_err("it is being written");
        assert!(refused.to_string().contains("another process writes it"), "{refused}");
        assert!(path.exists());
        drop(first);
        assert!(!path.exists(), "made for nothing");
        assert!(Opened::open(&path).is_ok());
    }
}
