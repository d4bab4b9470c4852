//! Output file in two steps: opened with what it has, and emptied once nothing can refuse the start any more.
//!
//! Problem: a run that cannot start, because another of its files cannot be made, or there is no thread or no memory for
//! it, must not cost an earlier recording; nor may one process empty what another one writes.
//! Model: a regular file is claimed when it is opened, until it is closed. The standard output is not: who opened it lets
//! whom they want write there. A file with content keeps it until its first piece with a row is written, for which room
//! is reserved then ([`Opened::start`]); that its beginning alone will fit is found out before the run
//! ([`Opened::reserve`]). The piece is written over the content, in whose room and the reserved one it lies: also on a disk
//! that others fill meanwhile. File systems that copy what is written over (btrfs) or that reserve nothing may refuse the piece
//! itself: there the room for it, and for the content once more, is tried in a file without a name beside it first, or, where
//! there can be none, in noise behind the content, which is cut off again. The rest of the content is cut off behind the piece
//! and not before; what was written over is put back if anything is refused. Until then the first byte is [`HALF_REPLACED`], so
//! that nobody takes what a killed process leaves for one recording. Any other file begins at once.
//! Invariant: what was opened and not started is as it was: a file that was made here is removed again, and one that was empty
//! is emptied, unless it has another content than was written here. A content that others have renamed or changed since it was
//! opened is not replaced. Noise that could not be cut off is told, and cut off with this
//! value if that is possible by then. A file whose kind cannot be told is refused.
//! Limit: what others write between a look at the file and the call that undoes the start (some microseconds) is lost; and what
//! they write over an earlier content in the same tick of the system's clock (4 ms at most), or while room is reserved, to the
//! same length, in the latter case with the same beginning and end. A content of others is known by its length and by samples (`marks.rs`), which has limits of its own.

use super::content::{Content, ContentState};
use super::destination::{is_standard_output, shown};
use super::marks::Marks;
use crate::recording::RecordingError;
use rt_core::replacement::end_of_links;
use rt_core::{limits, output_file};
use rustix::fs::{FallocateFlags, Mode, OFlags, fallocate};
use rustix::io::Errno;
use rustix::termios::isatty;
use std::cell::Cell;
use std::fs::{File, Metadata, OpenOptions};
use std::io::{self, Read, Seek, Write};
use std::os::fd::{AsFd, AsRawFd, OwnedFd};
use std::os::unix::fs::{FileExt, FileTypeExt, MetadataExt};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
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
    /// Room that was asked for behind the content.
    reserved: Cell<Option<Reserved>>,
    /// Length and last change of the earlier content as it was opened, or as was done to it here.
    left: Cell<Option<(u64, SystemTime)>>,
    /// Its name led to it then.
    was_named: bool,
    /// Length of the content, and with noise behind it that could not be cut off.
    noisy: Cell<Option<[u64; 2]>>,
    content: Arc<ContentState>,
    /// Samples of the writing; `None`: to a stream, or to somebody else's file.
    marks: Option<Marks>,
}

/// Room that a file was given behind its content.
#[derive(Debug, Clone, Copy)]
struct Reserved {
    /// Last change of the content before, and that by the reserving.
    changed: [SystemTime; 2],
    /// There was not enough already.
    is_more: bool,
}

/// Held while the content of a file is replaced.
static ALONE: Mutex<()> = Mutex::new(());
/// Bytes at either end of a content by which it is known again.
const END_BYTES: usize = 1 << 12;
/// At least as large as what a file system takes for a byte.
const BLOCK_BYTES: usize = 1 << 17;

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
            // Somebody may have put another one there, or something into it.
            Before::Absent(path) if is_itself(&self.file, path) && self.is_as_left() => {
                std::fs::remove_file(path)
            }
            Before::Empty if self.has_own() && self.is_as_left() => self.file.set_len(0),
            Before::Content => self
                .cut_noise()
                .and_then(|()| self.reserved.take().map_or(Ok(()), |reserved| self.give_room_back(reserved))),
            Before::Absent(_) | Before::Empty | Before::Stays => Ok(()),
        };
    }
}

impl Opened {
    /// Opens the file, or makes it; or gives the standard output another descriptor.
    ///
    /// # Errors
    /// If the system refuses or cannot tell what it is, it is a pipe that nobody reads, somebody holds a lock on it, or there
    /// is no standard output.
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
                let before =
                    made.map_or_else(|| Before::of(file.metadata()), |made| Ok(Before::Absent(made)))?;
                return Ok(Self::with(file, path, before));
            }
        }
        Err(io::Error::other("others remove it again and again"))
    }

    /// A file that is open already, of which people are told under this name.
    ///
    /// # Errors
    /// The system cannot tell what it is.
    pub fn of(file: File, path: &Path) -> io::Result<Self> {
        let before = Before::of(file.metadata())?;
        Ok(Self::with(file, path, before))
    }

    fn with(file: File, path: &Path, before: Before) -> Self {
        let content = if before == Before::Content { Content::Earlier } else { Content::Replaced };
        let content = Arc::new(ContentState::new(content));
        let marks = (before != Before::Stays).then(Marks::new);
        let was_named = marks.is_some() && is_at(&file, path);
        let (reserved, left, noisy) = (Cell::default(), Cell::default(), Cell::default());
        let opened =
            Self { file, path: path.into(), before, reserved, left, was_named, noisy, content, marks };
        opened.note_as_left();
        opened
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

    /// It is a file that people find by its name: that leads to it. A pipe is at work without one, the standard output is somebody
    /// else's, who may keep it open, and a draft has the name of another one.
    pub(super) fn has_name(&self) -> bool {
        self.marks.is_some() && is_at(&self.file, &self.path)
    }

    /// Nobody finds it by its name any more, which it had. A look that fails once, as over a network, is repeated.
    pub(super) fn has_lost_name(&self) -> bool {
        !(0..2).any(|_| self.has_name())
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
        let found = self.file.metadata()?;
        self.check_earlier(&found)?;
        let earlier = self.reserved.get();
        let before = earlier.map_or_else(|| found.modified(), |earlier| Ok(earlier.changed[0]))?;
        let ends = self.ends(found.len());
        let reserved = fallocate(&self.file, FallocateFlags::KEEP_SIZE, 0, bytes);
        let now = self.file.metadata()?;
        // It changes the time itself. What cannot be read, as where no more files may be open, tells nothing.
        let is_other = ends.zip(self.ends(now.len())).is_some_and(|(ends, now)| ends != now);
        if now.len() != found.len() || is_other {
            return Err(written_by_others());
        }
        let is_more = earlier.is_some_and(|earlier| earlier.is_more) || now.blocks() > found.blocks();
        self.reserved.set(Some(Reserved { changed: [before, now.modified()?], is_more }));
        self.note_as_left();
        match reserved {
            Err(full @ (Errno::NOSPC | Errno::DQUOT | Errno::FBIG)) => Err(full.into()),
            // Of a file system that cannot answer.
            _ => Ok(()),
        }
    }

    /// Finds out whether its content is the one that is to be replaced, under the name that it is replaced by: who has renamed it
    /// meanwhile, or written something else into it, keeps that.
    ///
    /// # Errors
    /// It is not.
    fn check_earlier(&self, found: &Metadata) -> io::Result<()> {
        let is_as_left = |(bytes, at)| found.len() == bytes && found.modified().is_ok_and(|now| now == at);
        if self.was_named && self.has_lost_name() {
            return Err(io::Error::other("its name leads to another file by now, or to none"));
        }
        if !self.left.get().is_none_or(is_as_left) {
            return Err(written_by_others());
        }
        Ok(())
    }

    /// First and last bytes of a content of this length; `None`: it cannot be read.
    fn ends(&self, length: u64) -> Option<[Vec<u8>; 2]> {
        let first = self.contents_first(END_BYTES).ok()?;
        let last = length.saturating_sub(END_BYTES as u64);
        Some([first, self.contents_from(last, END_BYTES).ok()?])
    }

    /// The content is as it is by what was done here.
    fn note_as_left(&self) {
        let found = self.file.metadata().ok().filter(|_| self.has_content());
        self.left.set(found.and_then(|found| Some((found.len(), found.modified().ok()?))));
    }

    /// Gives the room to others again that was reserved behind the content, and the content the time of its last change; of a file
    /// of another user the time of the reserving stays. What others have changed since is left alone.
    fn give_room_back(&self, Reserved { changed: [before, reserved], is_more }: Reserved) -> io::Result<()> {
        let found = self.file.metadata()?;
        if found.modified()? != reserved {
            return Ok(());
        }
        if is_more {
            self.file.set_len(found.len())?;
        }
        self.file.set_modified(before)
    }

    /// Something was written to it.
    fn has_own(&self) -> bool {
        self.marks.as_ref().is_some_and(|marks| marks.end() > 0)
    }

    /// It has what was written to it, and nothing else.
    fn is_as_left(&self) -> bool {
        let Some(marks) = &self.marks else { return false };
        self.found_of_others(marks.end(), marks, Marks::changed).is_ok_and(|found| found.is_none())
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
    /// Refusal by the system: the file has its content as before, perhaps with noise behind it, or if even that is refused,
    /// nothing; [`ContentState`] tells which.
    pub(super) fn replace_content(&mut self, piece: &[u8]) -> io::Result<()> {
        let replaced = self.replace_and_cut(piece, || self.cut(piece.len() as u64));
        let now = replaced.as_ref().err().map_or(Content::Replaced, |refused| refused.left);
        self.content.store(now);
        if let Content::Earlier | Content::Noisy = now {
            self.changed_itself();
        } else {
            self.before = Before::Stays;
        }
        let Err(NotReplaced { why, left }) = replaced else { return Ok(()) };
        if left != Content::Lost {
            return Err(why);
        }
        self.cut(0)?;
        Err(io::Error::new(why.kind(), format!("{why}; its earlier content is lost")))
    }

    /// The last change of the content is none by others.
    fn changed_itself(&self) {
        if let (Some(reserved), Ok(found)) = (self.reserved.get(), self.file.metadata()) {
            let changed = |now| Reserved { changed: [reserved.changed[0], now], ..reserved };
            self.reserved.set(found.modified().ok().map(changed));
        }
        self.note_as_left();
    }

    /// Another try at noise that could not be cut off, unless others have changed the file since.
    fn cut_noise(&self) -> io::Result<()> {
        let Some([length, noisy]) = self.noisy.take() else { return Ok(()) };
        if self.file.metadata()?.len() == noisy {
            self.file.set_len(length)?;
            self.changed_itself();
            self.content.store_noise(0);
            self.content.store(Content::Earlier);
        }
        Ok(())
    }

    /// Its content, to be looked at from another thread.
    pub(super) fn content(&self) -> Arc<ContentState> {
        Arc::clone(&self.content)
    }

    /// Writes the piece over the content, has the rest cut off, and puts the first byte.
    fn replace_and_cut(&self, piece: &[u8], cut: impl FnOnce() -> io::Result<()>) -> Result<(), NotReplaced> {
        let length = self.file.metadata().map_err(NotReplaced::at_all)?.len();
        let replaced = self.contents_first(piece.len());
        // Else others of this process take the room that is found.
        let lock = || ALONE.lock().unwrap_or_else(PoisonError::into_inner);
        let alone = (!output_file::keeps_reserved_room(&self.file)).then(lock);
        if alone.is_some() {
            self.try_room(piece, replaced.as_deref().unwrap_or_default())?;
        }
        self.content.begin(Content::BeingReplaced).map_err(NotReplaced::at_all)?;
        let Some((first, rest)) = piece.split_first() else { return cut().map_err(NotReplaced::at_all) };
        let written = (&self.file).write_all(&[HALF_REPLACED]).and_then(|()| (&self.file).write_all(rest));
        if let Err(why) = written.and_then(|()| cut()) {
            let back = replaced.and_then(|replaced| self.put_back(&replaced, length));
            return Err(NotReplaced::and_put_back(why, back.is_ok()));
        }
        self.file.write_all_at(&[*first], 0).map_err(|why| {
            // Of a longer one the rest is gone.
            let all = replaced.ok().filter(|replaced| replaced.len() as u64 == length);
            NotReplaced::and_put_back(
                why,
                all.is_some_and(|replaced| self.put_back(&replaced, length).is_ok()),
            )
        })
    }

    /// Writes of what was replaced as much as was written over, cuts off what is behind the earlier content, and puts the first
    /// byte: until then the file is no recording.
    fn put_back(&self, replaced: &[u8], length: u64) -> io::Result<()> {
        let reached = (&self.file).stream_position()?;
        // What nobody has written over is not written again: that might be refused where this is not.
        let reached = replaced.len().min(usize::try_from(reached).unwrap_or(usize::MAX));
        let Some((first, rest)) = replaced[..reached].split_first() else { return Ok(()) };
        self.file.write_all_at(rest, 1)?;
        self.cut(length)?;
        self.file.write_all_at(&[*first], 0)?;
        (&self.file).rewind()
    }

    /// Finds out whether a piece can be written over the content, and that back, where room that is reserved is no promise: on
    /// file systems that copy what is written over, or that reserve none.
    fn try_room(&self, piece: &[u8], replaced: &[u8]) -> Result<(), NotReplaced> {
        // What a file system takes for the first byte alone, which is written once more.
        let block = vec![HALF_REPLACED; BLOCK_BYTES];
        if let Some(mut trial) = self.nameless_beside().map_err(NotReplaced::at_all)? {
            let tried = [piece, replaced, &block].into_iter().try_for_each(|part| trial.write_all(part));
            let is_as_left = || self.check_earlier(&self.file.metadata()?);
            return tried.and_then(|()| is_as_left()).map_err(NotReplaced::at_all);
        }
        self.try_room_behind([&block, piece, replaced], |length| self.cut(length))
    }

    /// The same where nobody may make a file, or it would be elsewhere: behind the content, which it ends like a copy that broke
    /// off.
    fn try_room_behind(
        &self,
        parts: [&[u8]; 3],
        cut: impl FnOnce(u64) -> io::Result<()>,
    ) -> Result<(), NotReplaced> {
        let length = self.file.metadata().map_err(NotReplaced::at_all)?.len();
        self.content.begin(Content::Noisy).map_err(NotReplaced::at_all)?;
        let mut at = length;
        let tried = parts.into_iter().try_for_each(|part| {
            // No line of it.
            let noise: Vec<u8> = part.iter().map(|byte| byte | 0x80).collect();
            self.file.write_all_at(&noise, at)?;
            at += part.len() as u64;
            Ok(())
        });
        if let Err(uncut) = cut(length) {
            let noisy = self.file.metadata().map_or(at, |found| found.len());
            self.noisy.set(Some([length, noisy]));
            self.content.store_noise(noisy.saturating_sub(length));
            return Err(NotReplaced { why: tried.err().unwrap_or(uncut), left: Content::Noisy });
        }
        self.content.store(Content::Earlier);
        tried.map_err(NotReplaced::at_all)
    }

    /// A file without a name on the same file system, in the same directory; `None` where there can be none.
    ///
    /// # Errors
    /// No room even for an empty one.
    fn nameless_beside(&self) -> io::Result<Option<File>> {
        let own = std::fs::read_link(format!("/proc/self/fd/{}", self.file.as_raw_fd()));
        let Some(directory) = own.as_ref().ok().and_then(|own| own.parent()) else { return Ok(None) };
        let flags = OFlags::TMPFILE | OFlags::WRONLY;
        let nameless = nameless(rustix::fs::open(directory, flags, Mode::RUSR | Mode::WUSR))?;
        let device = |file: &File| Some(file.metadata().ok()?.dev());
        Ok(nameless.filter(|nameless| device(nameless) == device(&self.file)))
    }

    /// So many bytes of the content, or all of it if that is less.
    fn contents_first(&self, bytes: usize) -> io::Result<Vec<u8>> {
        self.contents_from(0, bytes)
    }

    fn contents_from(&self, at: u64, bytes: usize) -> io::Result<Vec<u8>> {
        // It was opened for writing alone.
        let mut file = File::open(format!("/proc/self/fd/{}", self.file.as_raw_fd()))?;
        file.seek(io::SeekFrom::Start(at))?;
        let mut some = Vec::new();
        file.take(bytes as u64).read_to_end(&mut some)?;
        Ok(some)
    }

    /// Notes a piece that is in the file now, at this place.
    pub(super) fn wrote(&mut self, at: u64, piece: &[u8]) {
        if let Some(marks) = &mut self.marks {
            marks.note(&self.file, at, piece);
        }
    }

    /// Finds out whether it is as long as what was written to it and has the latest pieces, if it is a file of this process alone.
    /// A hole or the bytes of others would be taken for a part of the recording.
    ///
    /// # Errors
    /// [`OtherContent`], of a file that somebody else has cut or written; it cannot be looked at.
    pub(super) fn check_lately(&self, written_bytes: u64) -> io::Result<()> {
        self.check(written_bytes, Marks::changed_lately)
    }

    /// The same with samples of all pieces.
    ///
    /// # Errors
    /// As there.
    pub(super) fn check_all(&self, written_bytes: u64) -> io::Result<()> {
        self.check(written_bytes, Marks::changed)
    }

    fn check(
        &self,
        written_bytes: u64,
        changed: impl Fn(&Marks) -> io::Result<Option<u64>>,
    ) -> io::Result<()> {
        let Some(marks) = &self.marks else { return Ok(()) };
        if self.found_of_others(written_bytes, marks, &changed)?.is_none() {
            return Ok(());
        }
        // File systems over a network may tell a length late.
        self.file.sync_data()?;
        let found = self.found_of_others(written_bytes, marks, &changed)?;
        found.map_or(Ok(()), |found| Err(io::Error::other(found)))
    }

    /// Change that others have made to it, if they have.
    fn found_of_others(
        &self,
        written_bytes: u64,
        marks: &Marks,
        changed: impl Fn(&Marks) -> io::Result<Option<u64>>,
    ) -> io::Result<Option<OtherContent>> {
        let found_bytes = self.file.metadata()?.len();
        if found_bytes != written_bytes {
            return Ok(Some(OtherContent::Length { found_bytes, written_bytes }));
        }
        Ok(changed(marks)?.map(|at| OtherContent::Bytes { at }))
    }

    /// Cuts it to so many bytes, if it has more.
    pub(super) fn cut(&self, bytes: u64) -> io::Result<()> {
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

    /// Another handle of it, to bring it to the disk; `None`: it is a stream, or somebody else's.
    ///
    /// # Errors
    /// If the system has none.
    pub(super) fn second_handle(&self) -> io::Result<Option<File>> {
        self.marks.as_ref().map(|_| self.file.try_clone()).transpose()
    }

    /// Handle that it is written by.
    pub(super) fn file(&self) -> &File {
        &self.file
    }
}

/// Content of a file that another process has cut or written while it was recorded into.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum OtherContent {
    /// It is longer or shorter.
    #[error("it has {found_bytes} bytes where {written_bytes} were written")]
    Length {
        /// Its length.
        found_bytes: u64,
        /// Length that it should have.
        written_bytes: u64,
    },
    /// It is as long, and has others.
    #[error("from byte {at} on it has others than were written")]
    Bytes {
        /// Place of the first that was looked at and is another.
        at: u64,
    },
}

impl OtherContent {
    /// The one that the error is about, if it is.
    pub(crate) fn of(error: &io::Error) -> Option<Self> {
        error.get_ref()?.downcast_ref().copied()
    }
}

/// Refusal of a piece over a file's content.
#[derive(Debug)]
struct NotReplaced {
    why: io::Error,
    /// State that the file is in now.
    left: Content,
}

impl NotReplaced {
    /// The content is there, to the byte.
    fn at_all(why: io::Error) -> Self {
        Self { why, left: Content::Earlier }
    }

    /// A part of it was written over.
    fn and_put_back(why: io::Error, is_back: bool) -> Self {
        Self { why, left: if is_back { Content::Earlier } else { Content::Lost } }
    }
}

/// A file without a name; `None` if the system makes none here.
///
/// # Errors
/// A full disk.
fn nameless(made: Result<OwnedFd, Errno>) -> io::Result<Option<File>> {
    match made {
        Err(full @ (Errno::NOSPC | Errno::DQUOT)) => Err(full.into()),
        made => Ok(made.ok().map(File::from)),
    }
}

impl Before {
    /// By what the system tells of a file. Streams and devices have nothing to be cut off.
    ///
    /// # Errors
    /// It tells nothing: there may be a content.
    fn of(found: io::Result<Metadata>) -> io::Result<Self> {
        let found = found?;
        Ok(match found.len() {
            _ if !found.is_file() => Self::Stays,
            0 => Self::Empty,
            _ => Self::Content,
        })
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

fn written_by_others() -> io::Error {
    io::Error::other("others have written to it since it was opened")
}

/// The name still leads to this file, which somebody may have removed before it was claimed.
fn is_at(file: &File, path: &Path) -> bool {
    let identity = |found: Metadata| (found.dev(), found.ino());
    match (file.metadata(), path.metadata()) {
        (Ok(open), Ok(found)) => !open.is_file() || identity(open) == identity(found),
        _ => false,
    }
}

/// The name is that of this file, and not of a link to it.
fn is_itself(file: &File, path: &Path) -> bool {
    let identity = |found: Metadata| (found.dev(), found.ino());
    let named = path.symlink_metadata().map(identity);
    named.is_ok_and(|named| file.metadata().map(identity).is_ok_and(|open| open == named))
}

/// The file, and its name if it was not there.
fn open_or_make(path: &Path) -> io::Result<(File, Option<PathBuf>)> {
    match output_file::open(path, OpenOptions::new().write(true).create_new(true)) {
        Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
        made => return made.map(|file| (file, Some(path.into()))),
    }
    // A link may lead to a file that is not there. The system follows it, or does not: in a directory of all a link of others may
    // be meant to have us make a file elsewhere.
    let is_absent = path.metadata().is_err_and(|error| error.kind() == io::ErrorKind::NotFound);
    let file = output_file::open(path, OpenOptions::new().write(true).create(true))?;
    let is_empty = || file.metadata().is_ok_and(|found| found.len() == 0);
    let made = end_of_links(path).ok().filter(|place| is_absent && is_itself(&file, place) && is_empty());
    Ok((file, made))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::whole_lines::WholeLines;

    #[test]
    fn a_content_that_others_have_renamed_or_changed_is_not_replaced() {
        type Others = fn(&Path);
        let cases: [(Others, &str); 3] = [
            (
                |path| std::fs::rename(path, path.with_extension("kept")).expect("a name"),
                "leads to another file",
            ),
            (|path| std::fs::write(path, "earlier and more").expect("room"), "others have written"),
            (
                |path| {
                    std::thread::sleep(std::time::Duration::from_millis(20));
                    std::fs::write(path, "others'").expect("room");
                },
                "others have written",
            ),
        ];
        for (others_do, told) in cases {
            let directory = tempfile::tempdir().expect("a directory");
            let path = directory.path().join("x.csv");
            std::fs::write(&path, "earlier").expect("room");
            let mut opened = Opened::open(&path).expect("a file");
            opened.reserve(3).expect("room");
            others_do(&path);
            let contents = || {
                let all = std::fs::read_dir(directory.path()).expect("a directory");
                all.map(|entry| std::fs::read(entry.expect("a file").path()).expect("a file"))
                    .collect::<Vec<_>>()
            };
            let before = contents();
            let refused = opened.start(3).expect_err("another content");
            assert!(refused.to_string().contains(told), "{refused}");
            drop(opened);
            assert_eq!(contents(), before, "{told}");
        }
    }

    #[test]
    fn what_was_made_for_nothing_through_a_link_is_removed() {
        let directory = tempfile::tempdir().expect("a directory");
        let [link, further, target] = ["link", "further", "target"].map(|name| directory.path().join(name));
        std::os::unix::fs::symlink("further", &link).expect("a link");
        std::os::unix::fs::symlink(&target, &further).expect("a link");
        let opened = Opened::open(&link).expect("a file");
        assert!(target.exists());
        drop(opened);
        assert!(!target.exists() && link.is_symlink() && further.is_symlink());
    }

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
        let mut lines = Opened::of(file, Path::new("content"))
            .and_then(|file| WholeLines::begin(file, "head"))
            .expect("begun");
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
            assert_eq!(refused.expect_err("refused").left, Content::Earlier);
            opened.content.store(Content::Earlier);
            assert_eq!(read(), content);
            opened.replace_content(b"new rows").expect("room");
            drop(opened);
            assert_eq!(read(), b"new rows");
        }
    }

    #[test]
    fn a_disk_without_room_for_an_empty_file_is_a_refusal_and_one_that_makes_none_is_not() {
        for full in [Errno::NOSPC, Errno::DQUOT] {
            assert_eq!(nameless(Err(full)).expect_err("full").raw_os_error(), Some(full.raw_os_error()));
        }
        for other in [Errno::OPNOTSUPP, Errno::ACCESS, Errno::ISDIR] {
            assert!(nameless(Err(other)).expect("not full").is_none());
        }
    }

    #[test]
    fn noise_behind_the_content_is_no_content_as_before_until_it_is_cut_off() {
        let (_directory, path, opened) = with_content(b"earlier rows");
        let content = opened.content();
        let parts = [&b"block"[..], b"new rows", b"earlier rows"];
        opened.reserve(8).expect("room");
        let tried = opened.try_room_behind(parts, |length| {
            assert_eq!((length, content.load()), (12, Content::Noisy));
            assert_eq!(path.metadata().expect("there").len(), 12 + 25);
            opened.cut(length)
        });
        tried.expect("room");
        assert_eq!((content.load(), content.noise_bytes()), (Content::Earlier, 0));
        let refused = opened.try_room_behind(parts, |_| Err(Errno::NOSPC.into())).expect_err("uncut");
        assert_eq!(refused.left, Content::Noisy);
        assert_eq!((content.load(), content.noise_bytes()), (Content::Noisy, 25));
        let found = std::fs::read(&path).expect("readable");
        assert!(found.starts_with(b"earlier rows") && found.len() == 12 + 25);
        drop(opened);
        assert_eq!(std::fs::read(&path).expect("readable"), b"earlier rows");
        assert_eq!((content.load(), content.noise_bytes()), (Content::Earlier, 0));
    }

    #[test]
    fn a_thread_that_was_left_behind_leaves_the_content_and_one_that_has_begun_does_not_count_as_such() {
        let (_directory, path, mut opened) = with_content(b"earlier rows");
        let content = opened.content();
        assert_eq!(content.leave_behind(), Content::Earlier);
        opened.replace_content(b"new").expect_err("left behind");
        opened.try_room_behind([b"1"; 3], |_| panic!("nothing was written")).expect_err("left behind");
        assert_eq!((content.load(), opened.has_content()), (Content::Earlier, true));
        drop(opened);
        assert_eq!(std::fs::read(&path).expect("readable"), b"earlier rows");
        let opened = Opened::open(&path).expect("opened");
        let content = opened.content();
        let replaced = opened.replace_and_cut(b"new", || {
            assert_eq!(content.leave_behind(), Content::BeingReplaced);
            opened.cut(3)
        });
        replaced.expect("room");
        assert_eq!(std::fs::read(&path).expect("readable"), b"new");
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
    fn a_file_whose_kind_the_system_does_not_tell_is_refused() {
        let refused = Before::of(Err(Errno::IO.into())).expect_err("it may have a content");
        assert_eq!(refused.raw_os_error(), Some(Errno::IO.raw_os_error()));
        let (_directory, path, _opened) = with_content(b"earlier rows");
        assert_eq!(Before::of(path.metadata()).expect("there"), Before::Content);
        assert_eq!(Before::of(Path::new("/dev/null").metadata()).expect("there"), Before::Stays);
    }

    #[test]
    fn what_others_have_written_into_a_file_that_is_not_started_stays() {
        let directory = tempfile::tempdir().expect("a directory");
        let path = directory.path().join("new");
        for was_there in [false, true] {
            for others in ["longer than the header", "", "HEAD!", "head\nand more", "head\n"] {
                let _ = std::fs::remove_file(&path);
                if was_there {
                    std::fs::write(&path, "").expect("room");
                }
                let lines =
                    Opened::open(&path).and_then(|file| WholeLines::begin(file, "head")).expect("begun");
                assert_eq!(std::fs::read(&path).expect("there"), b"head\n");
                std::fs::write(&path, others).expect("room");
                drop(lines);
                let left = std::fs::read_to_string(&path).ok();
                // The same bytes are no others.
                let as_before = was_there.then_some("");
                let stays = if others == "head\n" { as_before } else { Some(others) };
                assert_eq!(left.as_deref(), stays, "{was_there} {others}");
            }
        }
    }

    #[test]
    fn a_name_that_leads_elsewhere_is_none_of_the_file() {
        let directory = tempfile::tempdir().expect("a directory");
        let [path, other, link] = ["out", "other", "link"].map(|name| directory.path().join(name));
        let opened = Opened::open(&path).expect("opened");
        assert!(opened.has_name());
        std::fs::hard_link(&path, &other).and_then(|()| std::fs::remove_file(&path)).expect("room");
        assert!(!opened.has_name(), "it has another name");
        std::fs::write(&path, "another's").expect("room");
        assert!(!opened.has_name(), "the name is another's");
        std::fs::rename(&other, &path).expect("our own");
        assert!(opened.has_name());
        std::os::unix::fs::symlink(&path, &link).expect("room");
        let draft = Opened::of(File::create(&other).expect("room"), &link).expect("a file");
        assert!(!draft.has_name(), "the name is that of the file that it is to replace");
    }

    #[test]
    fn a_file_that_others_put_in_the_place_of_one_that_was_made_for_nothing_stays() {
        let directory = tempfile::tempdir().expect("a directory");
        let [new, moved, other] = ["new", "moved", "other"].map(|name| directory.path().join(name));
        for is_moved in [true, false] {
            std::fs::write(&other, "another's").expect("room");
            let opened = Opened::open(&new).expect("opened");
            if is_moved {
                std::fs::rename(&new, &moved).expect("our own");
            }
            std::fs::rename(&other, &new).expect("our own");
            drop(opened);
            assert_eq!(std::fs::read(&new).expect("there"), b"another's");
            assert_eq!(moved.exists(), is_moved);
            [&new, &moved].map(std::fs::remove_file).into_iter().filter_map(Result::err).for_each(drop);
        }
    }

    #[test]
    fn a_file_that_is_being_written_is_neither_emptied_nor_removed_by_who_comes_second() {
        let directory = tempfile::tempdir().expect("a directory");
        let path = directory.path().join("new");
        let first = Opened::open(&path).expect("opened");
        let refused = Opened::recording(&path).expect_err("it is being written");
        assert!(refused.to_string().contains("somebody holds a lock on it"), "{refused}");
        assert!(path.exists());
        drop(first);
        assert!(!path.exists(), "made for nothing");
        assert!(Opened::open(&path).is_ok());
    }
}
