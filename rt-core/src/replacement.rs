//! File that takes the place of another once it is whole.
//!
//! Problem: a command that is interrupted while it writes its result leaves half a file, and what was there before is
//! gone.
//! Model: the result goes into a draft beside the place, which is renamed at the end. Where the directory takes no other
//! file, the draft lies among the temporary files, and its content is copied over the former one at the end, once there
//! is room for all of it. File systems that copy what is written over (btrfs) promise no room: there it is tried behind the
//! former content, and a copy of that is made first, among the temporary files, and put back if anything is refused. Pipes and
//! devices are written directly, and so is a file without content whose directory takes no other. A link goes on leading to
//! its file, which keeps its rights, owner and group; where they cannot be given to another file, or it has other names, access
//! lists or other attributes, its content is written over, too. What lies at the place by then and did not in the beginning is claimed before it is replaced:
//! a run may record into it. A process that catches signals calls [`abandon_all`] before it ends.
//! Invariant: at the place there is the former file or the whole new one, whatever ends the process, unless that is
//! killed while it copies; of an end that nobody catches a draft is left, whose name begins with a dot and ends in `.part`.
//! Limit: a file that others put in the place of another one between the claim and the renaming is lost. Where there is none the
//! renaming itself refuses it, if the file system can (renameat2(2) with `RENAME_NOREPLACE`).

use crate::{limits, output_file};
use nix::errno::Errno;
use nix::fcntl::{AT_FDCWD, FallocateFlags, RenameFlags, fallocate, renameat2};
use std::fs::{File, Metadata, OpenOptions};
use std::io::{self, Read, Seek, Write};
use std::os::fd::AsRawFd;
use std::os::unix::fs::{MetadataExt, OpenOptionsExt, fchown};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Files that have not taken their places.
static UNFINISHED: Mutex<Vec<Unfinished>> = Mutex::new(Vec::new());
/// A link that leads to so many others leads nowhere.
const MOST_LINKS: u32 = 40;
/// So often another file may come between a look at the place and the renaming.
const MOST_NEWCOMERS: u32 = 100;
/// At least as much as what a file system takes for a byte.
const BLOCK_BYTES: u64 = 1 << 17;

struct Unfinished {
    /// `None`: it is written where it is to be.
    draft: Option<PathBuf>,
    place: PathBuf,
}

/// Outcome of a file that was not finished.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Abandoned {
    /// The place that it was to take.
    pub place: PathBuf,
    /// Nothing is left of it, and its place is as it was.
    pub is_gone: bool,
}

/// While this is held no file takes its place.
pub struct Held {
    _all: MutexGuard<'static, Vec<Unfinished>>,
}

/// A file being written.
#[derive(Debug)]
pub struct Replacement {
    file: File,
    /// `None`: it is written where it is to be.
    draft: Option<PathBuf>,
    /// The draft lies among the temporary files, perhaps on another disk.
    is_far: bool,
    /// The end of a chain of links.
    place: PathBuf,
    /// Claimed until the other one has its place.
    former: Option<File>,
}

impl Replacement {
    /// Begins a file that is to be here.
    ///
    /// # Errors
    /// If it could not take its place: what is there cannot be written or its kind not be told, somebody holds a lock on it,
    /// a pipe without a reader; or there is no place for a draft of what would cost a former content.
    pub fn begin(path: &Path) -> io::Result<Self> {
        let (place, former) = match path.metadata() {
            Ok(found) if found.is_file() && !is_descriptor(path) => {
                let former = output_file::open(path, OpenOptions::new().write(true))?;
                output_file::claim(&former)?;
                (path.canonicalize()?, Some((former, found)))
            }
            Err(error) if error.kind() == io::ErrorKind::NotFound => (end_of_links(path)?, None),
            // It may be a file with content.
            Err(error) => return Err(error),
            Ok(_) => return Self::directly(path),
        };
        let (former, found) = former.unzip();
        match (create_beside(&place, former.as_ref().zip(found.as_ref())), &former) {
            (Ok((file, draft)), _) => Ok(Self::drafted(file, draft, false, place, former)),
            (Err(error), Some(content)) if content.metadata()?.len() > 0 => {
                let (file, draft) = create_among_temporary_files(&place, &error)?;
                Ok(Self::drafted(file, draft, true, place, former))
            }
            (Err(_), Some(_)) => {
                // The next one makes the same claim.
                drop(former);
                Self::directly(&place)
            }
            (Err(error), None) => Err(error),
        }
    }

    fn drafted(file: File, draft: PathBuf, is_far: bool, place: PathBuf, former: Option<File>) -> Self {
        unfinished().push(Unfinished { draft: Some(draft.clone()), place: place.clone() });
        Self { file, draft: Some(draft), is_far, place, former }
    }

    fn directly(place: &Path) -> io::Result<Self> {
        let file = output_file::open(place, OpenOptions::new().write(true))?;
        if file.metadata()?.is_file() {
            output_file::claim(&file)?;
            unfinished().push(Unfinished { draft: None, place: place.into() });
        }
        Ok(Self { file, draft: None, is_far: false, place: place.into(), former: None })
    }

    /// The file to write to.
    ///
    /// # Errors
    /// The errors of dup(2).
    pub fn file(&self) -> io::Result<File> {
        self.file.try_clone()
    }

    /// The place stays as it was until the end.
    pub fn is_drafted(&self) -> bool {
        self.draft.is_some()
    }

    /// It takes the place in one step, so that nobody ever reads half of it.
    pub fn is_beside(&self) -> bool {
        self.is_drafted() && !self.is_far
    }

    /// Takes the place.
    ///
    /// # Errors
    /// If that fails, which leaves the place as it was, but for [`is_torn`]; another process holds a lock on what is there now; or
    /// others have removed what was written, or put another file in its place.
    pub fn keep(mut self) -> io::Result<()> {
        let Some(draft) = self.draft.take() else {
            return if self.file.metadata()?.is_file() {
                refuse_if_displaced(&self.file, &self.place)
            } else {
                Ok(())
            };
        };
        let mut all = unfinished();
        let moved = match &self.former {
            Some(former) if self.is_far => copy_over(former, &self.file, &draft, &self.place),
            _ => self.rename(&draft),
        };
        let is_of_use = moved.as_ref().is_err_and(is_torn);
        if (moved.is_err() || self.is_far) && !is_of_use {
            // Should it be gone already, so much the better.
            let _ = std::fs::remove_file(&draft);
        }
        all.retain(|other| other.draft.as_deref() != Some(&draft));
        moved
    }

    /// Renames the draft to the place, over the former file, over another one that nobody has claimed, or where there is none.
    fn rename(&self, draft: &Path) -> io::Result<()> {
        // What others have put there is not what was written.
        refuse_if_displaced(&self.file, draft)?;
        for _ in 0..MOST_NEWCOMERS {
            if self.former.as_ref().is_some_and(|former| refuse_if_displaced(former, &self.place).is_ok()) {
                return std::fs::rename(draft, &self.place);
            }
            if let Some(claimed) = self.claim_newcomer()? {
                if refuse_if_displaced(&claimed, &self.place).is_err() {
                    continue;
                }
                return std::fs::rename(draft, &self.place);
            }
            match rename_to_nothing(draft, &self.place) {
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
                renamed => return renamed,
            }
        }
        Err(io::Error::other("others put files in its place again and again"))
    }

    /// Claims what is there now and was not before: a run may record into it. `None`: nothing is there.
    ///
    /// # Errors
    /// It cannot be written, or another process has claimed it.
    fn claim_newcomer(&self) -> io::Result<Option<File>> {
        match output_file::open(&self.place, OpenOptions::new().write(true)) {
            Ok(newcomer) => output_file::claim(&newcomer).map(|()| Some(newcomer)),
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
            Err(error) => Err(error),
        }
    }
}

impl Drop for Replacement {
    fn drop(&mut self) {
        let Self { draft, place, .. } = &*self;
        let mut all = unfinished();
        if let Some(draft) = draft {
            // Should it be gone already, so much the better.
            let _ = std::fs::remove_file(draft);
        }
        all.retain(|other| &other.draft != draft || &other.place != place);
    }
}

/// Makes the file here, or replaces what is there, with this content.
///
/// # Errors
/// As [`Replacement::begin`], and whatever keeps the content from being written; what was there is as it was then.
pub fn write(path: &Path, content: impl AsRef<[u8]>) -> io::Result<()> {
    let replacement = Replacement::begin(path)?;
    if !replacement.is_drafted() && replacement.file.metadata()?.is_file() {
        replacement.file.set_len(0)?;
    }
    (&replacement.file).write_all(content.as_ref())?;
    replacement.keep()
}

/// Removes the files that have not taken their places, and tells of each. None takes its place any more while the answer
/// is held.
pub fn abandon_all() -> (Vec<Abandoned>, Held) {
    let mut all = unfinished();
    let abandon = |file: Unfinished| {
        let is_gone = file.draft.is_some_and(|draft| std::fs::remove_file(draft).is_ok());
        Abandoned { place: file.place, is_gone }
    };
    (all.drain(..).map(abandon).collect(), Held { _all: all })
}

fn unfinished() -> MutexGuard<'static, Vec<Unfinished>> {
    UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The path names a file that the process has open already.
fn is_descriptor(path: &Path) -> bool {
    ["/proc", "/dev/fd", "/dev/stdout", "/dev/stderr"].iter().any(|names| path.starts_with(names))
}

/// The end of a chain of links at which there may be nothing yet.
///
/// # Errors
/// They lead to one another.
pub fn end_of_links(path: &Path) -> io::Result<PathBuf> {
    let mut place = path.to_path_buf();
    for _ in 0..MOST_LINKS {
        match std::fs::read_link(&place) {
            Ok(target) => place = place.parent().unwrap_or(Path::new("")).join(target),
            Err(_) => return Ok(place),
        }
    }
    Err(io::Error::other("too many links lead to one another"))
}

/// Renames the file to a name that nothing has.
///
/// # Errors
/// Something has it; and the errors of rename(2).
fn rename_to_nothing(from: &Path, to: &Path) -> io::Result<()> {
    match renameat2(AT_FDCWD, from, AT_FDCWD, to, RenameFlags::RENAME_NOREPLACE) {
        // Of a file system that can only replace. A link that leads to nothing is replaced, too.
        Err(Errno::EINVAL | Errno::ENOSYS) => std::fs::rename(from, to),
        Err(Errno::EEXIST) if to.symlink_metadata().is_ok_and(|found| found.is_symlink()) && !to.exists() => {
            std::fs::rename(from, to)
        }
        renamed => Ok(renamed?),
    }
}

/// With the rights, the owner and the group of the file whose place it is to take. Until it has them, nobody else may open it.
fn create_beside(place: &Path, former: Option<(&File, &Metadata)>) -> io::Result<(File, PathBuf)> {
    if let Some((former, found)) = former {
        refuse_if_more_than_rights(former, found)?;
    }
    let mode = if former.is_some() { 0o600 } else { 0o666 };
    let (file, draft) = create_draft(place, place.parent().unwrap_or(Path::new("")), mode)?;
    match former.map_or(Ok(()), |(_, found)| give_as(&file, found)) {
        Ok(()) => Ok((file, draft)),
        Err(error) => {
            // It cannot take the place of the other one, and nobody else would remove it.
            let _ = std::fs::remove_file(&draft);
            Err(error)
        }
    }
}

/// A file is refused that has other names, or attributes that another one would not get: access lists, xattr(7). Labels of
/// security modules are given by the directory.
fn refuse_if_more_than_rights(former: &File, found: &Metadata) -> io::Result<()> {
    let bytes = rustix::fs::flistxattr_query(former).unwrap_or(0);
    let mut names = vec![0; bytes];
    let bytes = if bytes > 0 { rustix::fs::flistxattr(former, &mut names[..])? } else { 0 };
    let mut names = names[..bytes].split(|byte| *byte == 0);
    if found.nlink() > 1 || names.any(|name| !name.is_empty() && !name.starts_with(b"security.")) {
        return Err(io::Error::other("what is there has other names, or attributes"));
    }
    Ok(())
}

fn give_as(file: &File, former: &Metadata) -> io::Result<()> {
    let own = file.metadata()?;
    if (own.uid(), own.gid()) != (former.uid(), former.gid()) {
        fchown(file, Some(former.uid()), Some(former.gid()))?;
    }
    // Last, for a change of owner takes some away.
    file.set_permissions(former.permissions())
}

/// A draft that nobody else may read, whoever may read the place.
fn create_among_temporary_files(place: &Path, beside: &io::Error) -> io::Result<(File, PathBuf)> {
    create_draft(place, &std::env::temp_dir(), 0o600).map_err(|error| {
        io::Error::other(format!(
            "what is there is kept until the new file is whole, for which there is no place: beside it ({beside}), or among \
             the temporary files ({error}); set TMPDIR to a directory that can be written"
        ))
    })
}

/// Puts the content of the draft, whatever lies under its name by now, in the place of the former one, once there is room
/// for all of it.
fn copy_over(former: &File, content: &File, draft: &Path, place: &Path) -> io::Result<()> {
    refuse_if_displaced(former, place)?;
    let bytes = content.metadata()?.len();
    if limits::largest_file().is_some_and(|most| bytes > most) {
        return Err(Errno::EFBIG.into());
    }
    let spare = if output_file::keeps_reserved_room(former) {
        reserve(former, 0, bytes)?;
        None
    } else {
        try_room(former, bytes)?;
        spared(former, bytes, place)?
    };
    let torn = |source| io::Error::other(Torn { source, draft: draft.into() });
    match write_over(former, content, spare.as_ref()) {
        Ok(()) => refuse_if_displaced(former, place).map_err(torn),
        Err(NotWritten { why, is_as_before: true }) => Err(why),
        Err(NotWritten { why, is_as_before: false }) => Err(torn(why)),
    }
}

/// Reserves room for so many bytes from there on.
fn reserve(file: &File, from: u64, bytes: u64) -> io::Result<()> {
    let [from, bytes] = [from, bytes].map(|count| i64::try_from(count).unwrap_or(i64::MAX));
    match fallocate(file, FallocateFlags::FALLOC_FL_KEEP_SIZE, from, bytes) {
        Err(full @ (Errno::ENOSPC | Errno::EDQUOT | Errno::EFBIG)) => Err(full.into()),
        // Of a file system that cannot answer, and of nothing that is to be copied.
        _ => Ok(()),
    }
}

/// Finds out whether so many bytes can be written over the former content, and that back, where writing over takes room: there
/// must be as much behind its end, where nobody sees it, and it is given back.
fn try_room(former: &File, bytes: u64) -> io::Result<()> {
    let found = former.metadata()?;
    let tried = reserve(former, found.len(), bytes + bytes.min(found.len()) + BLOCK_BYTES);
    let given_back = former.set_len(found.len());
    if tried.is_err() {
        // It has changed nothing that people see; of another user's file the time stays.
        let _ = found.modified().and_then(|modified| former.set_modified(modified));
    }
    tried.and(given_back)
}

/// Copy, without a name, of as much of the former content as so many bytes are written over; `None` of a file that this process
/// may not read.
fn spared(former: &File, bytes: u64, place: &Path) -> io::Result<Option<File>> {
    // It was opened for writing alone.
    let Ok(readable) = File::open(format!("/proc/self/fd/{}", former.as_raw_fd())) else { return Ok(None) };
    let copied = create_draft(place, &std::env::temp_dir(), 0o600).and_then(|(mut spare, name)| {
        std::fs::remove_file(name)?;
        copy(&mut readable.take(bytes), &mut spare)?;
        Ok(spare)
    });
    copied.map(Some).map_err(|error| {
        let words = format!(
            "a copy of what is there is kept among the temporary files until the new file is whole: {error}; set TMPDIR to a \
             directory that has room for both"
        );
        io::Error::new(error.kind(), words)
    })
}

/// Refusal of a content over a former one.
#[derive(Debug)]
struct NotWritten {
    why: io::Error,
    /// The former content is there, to the byte.
    is_as_before: bool,
}

/// Writes the content over the former one, and gives up the rest of that; puts back what the spare has if anything is refused.
fn write_over(mut former: &File, mut content: &File, spare: Option<&File>) -> Result<(), NotWritten> {
    let at_all = |why| NotWritten { why, is_as_before: true };
    content.rewind().map_err(at_all)?;
    let length = former.metadata().map_err(at_all)?.len();
    let written = copy(&mut content, &mut former).and_then(|bytes| former.set_len(bytes));
    written.map_err(|why| {
        let is_untouched = former.stream_position().is_ok_and(|reached| reached == 0)
            && former.metadata().is_ok_and(|found| found.len() == length);
        let is_put_back = || spare.is_some_and(|spare| put_back(former, spare, length).is_ok());
        NotWritten { why, is_as_before: is_untouched || is_put_back() }
    })
}

/// Puts back what was written over, and cuts off what is behind the former length.
fn put_back(mut former: &File, mut spare: &File, length: u64) -> io::Result<()> {
    let reached = former.stream_position()?;
    former.rewind()?;
    spare.rewind()?;
    copy(&mut spare.take(reached), &mut former)?;
    if former.metadata()?.len() > length { former.set_len(length) } else { Ok(()) }
}

/// As [`io::copy`], which panics where copy_file_range(2) fails with EPERM in the middle of a file.
fn copy(from: &mut dyn Read, to: &mut dyn Write) -> io::Result<u64> {
    io::copy(from, to)
}

/// Nobody finds what is written to a file that has lost its name.
fn refuse_if_displaced(file: &File, place: &Path) -> io::Result<()> {
    let identity = |found: Metadata| (found.dev(), found.ino());
    let is_there = place
        .metadata()
        .is_ok_and(|found| file.metadata().is_ok_and(|open| identity(open) == identity(found)));
    if is_there {
        return Ok(());
    }
    Err(io::Error::other("it was removed meanwhile, or another file put in its place"))
}

/// Why a place has half of the new file.
#[derive(Debug, thiserror::Error)]
#[error("{source}; only a part of it is there, and the whole is in {}", draft.display())]
struct Torn {
    source: io::Error,
    draft: PathBuf,
}

/// The error is that of a place that has neither the former file nor the whole new one.
pub fn is_torn(error: &io::Error) -> bool {
    error.get_ref().and_then(|inner| inner.downcast_ref::<Torn>()).is_some()
}

/// A new file in this directory, called after the place that it is for.
fn create_draft(place: &Path, directory: &Path, mode: u32) -> io::Result<(File, PathBuf)> {
    static COUNT: AtomicU64 = AtomicU64::new(0);
    let name = place.file_name().ok_or_else(|| io::Error::from(io::ErrorKind::InvalidInput))?;
    loop {
        let count = COUNT.fetch_add(1, Ordering::Relaxed);
        let mut hidden = std::ffi::OsString::from(".");
        // A name may have 255 bytes.
        hidden.push(if name.len() < 200 { name } else { "result".as_ref() });
        hidden.push(format!(".{}-{count}.part", std::process::id()));
        let draft = directory.join(hidden);
        match OpenOptions::new().read(true).write(true).create_new(true).mode(mode).open(&draft) {
            // Left by another process of this number.
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
            made => return made.map(|file| (file, draft)),
        }
    }
}

#[cfg(test)]
mod tests {
    use patience::prelude::*;

    use super::*;
    use std::fs::Permissions;
    use std::os::unix::fs::PermissionsExt;

    fn names(directory: &Path) -> Vec<String> {
        let entries = std::fs::read_dir(directory).expect("a directory");
        let mut names: Vec<_> = entries
            .map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned())
            .collect();
        names.sort();
        names
    }

    #[test]
    fn the_former_file_stays_until_the_new_one_is_whole_and_keeps_its_rights_and_links() {
        let directory = tempfile::tempdir().expect("a directory");
        let (place, link) = (directory.path().join("a"), directory.path().join("b"));
        std::fs::write(&place, "former").expect("room");
        std::fs::set_permissions(&place, Permissions::from_mode(0o640)).expect("our own");
        std::os::unix::fs::symlink("a", &link).expect("room");
        let dropped = Replacement::begin(&link).expect("begun");
        dropped.file().and_then(|mut file| file.write_all(b"half")).expect("room");
        assert_eq!(names(directory.path()).len(), 3);
        drop(dropped);
        assert_eq!(names(directory.path()), ["a", "b"]);
        assert_eq!(std::fs::read(&place).expect("there"), b"former");
        write(&link, "whole").expect("room");
        assert_eq!(names(directory.path()), ["a", "b"]);
        assert!(link.symlink_metadata().expect("there").is_symlink());
        assert_eq!(std::fs::read(&place).expect("there"), b"whole");
        assert_eq!(place.metadata().expect("there").permissions().mode() & 0o777, 0o640);
    }

    #[test]
    fn the_former_file_keeps_its_owner_and_group_which_takes_root() {
        let directory = tempfile::tempdir().expect("a directory");
        let place = directory.path().join("a");
        std::fs::write(&place, "former").expect("room");
        if std::os::unix::fs::chown(&place, Some(1), Some(2)).is_err() {
            return;
        }
        std::fs::set_permissions(&place, Permissions::from_mode(0o640)).expect("root may");
        write(&place, "whole").expect("room");
        let found = place.metadata().expect("there");
        assert_eq!((found.uid(), found.gid(), found.mode() & 0o777), (1, 2, 0o640));
    }

    #[test]
    fn a_former_file_with_other_names_or_attributes_is_written_over() {
        let directory = tempfile::tempdir().expect("a directory");
        let [place, other] = ["a", "b"].map(|name| directory.path().join(name));
        std::fs::write(&place, "former").expect("room");
        std::fs::hard_link(&place, &other).expect("another name");
        assert!(!Replacement::begin(&place).expect("begun").is_beside());
        write(&place, "whole").expect("room");
        assert_eq!(std::fs::read(&other).expect("there"), b"whole");
        std::fs::remove_file(&other).expect("our own");
        assert!(Replacement::begin(&place).expect("begun").is_beside());
        let set =
            |place: &Path| rustix::fs::setxattr(place, "user.by", b"us", rustix::fs::XattrFlags::CREATE);
        if set(&place).is_err() {
            println!("skipped: attributes, which this file system does not take");
            return;
        }
        assert!(!Replacement::begin(&place).expect("begun").is_beside());
        write(&place, "whole again").expect("room");
        assert_eq!(std::fs::read(&place).expect("there"), b"whole again");
        set(&place).expect_err("it has it still");
    }

    #[test]
    fn a_file_that_another_process_writes_is_left_alone_also_if_it_came_later() {
        let directory = tempfile::tempdir().expect("a directory");
        let place = directory.path().join("a");
        let begun = Replacement::begin(&place).expect("nothing is there");
        let other = output_file::create(&place).expect("room");
        output_file::claim(&other).expect("nobody else");
        assert!(output_file::is_claimed(&begun.keep().expect_err("another one came")));
        assert!(output_file::is_claimed(&write(&place, "x").expect_err("another one is there")));
        assert_eq!(names(directory.path()), ["a"]);
        assert_eq!(std::fs::read(&place).expect("there"), b"");
        drop(other);
        write(&place, "x").expect("free again");
    }

    #[test]
    fn a_newcomer_in_the_place_of_a_former_file_is_replaced_only_if_nobody_has_claimed_it() {
        let directory = tempfile::tempdir().expect("a directory");
        let place = directory.path().join("a");
        let begin = |newcomer: &dyn Fn() -> Option<File>| {
            std::fs::write(&place, "former").expect("room");
            let begun = Replacement::begin(&place).expect("begun");
            begun.file().and_then(|mut file| file.write_all(b"whole")).expect("room");
            std::fs::remove_file(&place).expect("our own");
            (begun, newcomer())
        };
        let make = || Some(output_file::create(&place).expect("room"));
        let (begun, newcomer) =
            begin(&|| make().inspect(|file| output_file::claim(file).expect("nobody else")));
        assert!(output_file::is_claimed(&begun.keep().expect_err("it is written")));
        assert_eq!(std::fs::read(&place).expect("there"), b"");
        assert_eq!(names(directory.path()), ["a"]);
        drop(newcomer);
        for newcomer in [&make as &dyn Fn() -> Option<File>, &|| None] {
            let (begun, newcomer) = begin(newcomer);
            begun.keep().expect("nobody claims it");
            drop(newcomer);
            assert_eq!(std::fs::read(&place).expect("there"), b"whole");
            assert_eq!(names(directory.path()), ["a"]);
        }
    }

    #[test]
    fn a_newcomer_that_cannot_be_written_stays_and_a_link_that_leads_nowhere_is_replaced() {
        let directory = tempfile::tempdir().expect("a directory");
        let place = directory.path().join("a");
        let begun = Replacement::begin(&place).expect("nothing is there");
        nix::unistd::mkfifo(&place, nix::sys::stat::Mode::S_IRWXU).expect("a pipe");
        begun.keep().expect_err("nobody reads it");
        assert_eq!(names(directory.path()), ["a"]);
        rename_to_nothing(Path::new("/dev/null"), &place).expect_err("it is there");
        std::fs::remove_file(&place).expect("our own");
        let begun = Replacement::begin(&place).expect("nothing is there");
        std::os::unix::fs::symlink("nowhere", &place).expect("room");
        begun.keep().expect("nothing is lost");
        assert!(place.symlink_metadata().expect("there").is_file());
    }

    #[test]
    fn a_file_that_others_put_in_the_place_of_the_draft_does_not_take_the_place() {
        let directory = tempfile::tempdir().expect("a directory");
        let place = directory.path().join("a");
        std::fs::write(&place, "former").expect("room");
        for is_replaced in [true, false] {
            let begun = Replacement::begin(&place).expect("begun");
            let draft = begun.draft.clone().expect("a draft");
            std::fs::remove_file(&draft).expect("our own");
            if is_replaced {
                std::fs::write(&draft, "another's").expect("room");
            }
            begun.keep().expect_err("nobody finds it");
            assert_eq!(std::fs::read(&place).expect("there"), b"former");
        }
    }

    /// A thread of another user, for whom the directory takes no file; root may write everywhere.
    #[test]
    fn a_file_whose_directory_takes_no_other_stays_until_the_new_one_is_whole() {
        let directory = tempfile::tempdir().expect("a directory");
        let place = directory.path().join("a");
        std::fs::write(&place, "former").expect("room");
        std::fs::set_permissions(&place, Permissions::from_mode(0o666)).expect("our own");
        std::fs::set_permissions(directory.path(), Permissions::from_mode(0o555)).expect("our own");
        let write_as_nobody = || {
            if nix::unistd::geteuid().is_root() {
                nix::unistd::setfsuid(nix::unistd::Uid::from_raw(65534));
            }
            let begun = Replacement::begin(&place).expect("begun");
            begun.file().and_then(|mut file| file.write_all(b"half")).expect("room");
            assert_eq!([begun.is_drafted(), begun.is_beside()], [true, false]);
            let draft = begun.draft.clone().expect("a draft");
            drop(begun);
            assert_eq!(std::fs::read(&place).expect("there"), b"former");
            assert!(!draft.exists());
            write(&place, "new").expect("room");
            assert_eq!(std::fs::read(&place).expect("there"), b"new");
            write(&place, "longer than before").expect("room");
            // Somebody takes the draft's name, and somebody the place's.
            let begun = Replacement::begin(&place).expect("begun");
            begun.file().and_then(|mut file| file.write_all(b"mine")).expect("room");
            let draft = begun.draft.clone().expect("a draft");
            std::fs::rename(&draft, draft.with_extension("taken")).expect("our own");
            std::fs::write(&draft, "another's").expect("room");
            begun.keep().expect("kept");
            assert_eq!(std::fs::read(&place).expect("there"), b"mine");
            std::fs::remove_file(draft.with_extension("taken")).expect("our own");
            Replacement::begin(&place).expect("begun")
        };
        let begun =
            std::thread::scope(|scope| scope.spawn(write_as_nobody).bounded_join()).expect("no panic");
        std::fs::set_permissions(directory.path(), Permissions::from_mode(0o755)).expect("our own");
        std::fs::rename(&place, directory.path().join("b")).expect("our own");
        for newcomer in [None, Some("another's")] {
            newcomer.map_or(Ok(()), |text| std::fs::write(&place, text)).expect("room");
            assert!(refuse_if_displaced(begun.former.as_ref().expect("it was there"), &place).is_err());
        }
        begun.keep().expect_err("it has lost its name");
        assert_eq!(std::fs::read(&place).expect("there"), b"another's");
        assert_eq!(std::fs::read(directory.path().join("b")).expect("there"), b"mine");
        assert_eq!(names(directory.path()), ["a", "b"]);
    }

    /// As on a full disk whose file system copies what is written over: room is promised, and then there is none.
    #[test]
    fn a_content_that_does_not_fit_after_all_is_taken_back_from_the_former_one() {
        use nix::fcntl::{FcntlArg, SealFlag, fcntl};
        use nix::sys::memfd::{MFdFlags, memfd_create};
        let read =
            |file: &File| std::fs::read(format!("/proc/self/fd/{}", file.as_raw_fd())).expect("memory");
        let (longer, place) = (tempfile::tempfile().expect("room"), Path::new("place"));
        (&longer).write_all(&vec![b'n'; 300_000]).expect("room");
        for is_spared in [true, false] {
            let former = File::from(memfd_create("former", MFdFlags::MFD_ALLOW_SEALING).expect("memory"));
            (&former).write_all(&vec![b'f'; 200_000]).and_then(|()| (&former).rewind()).expect("room");
            let spare = spared(&former, 300_000, place).expect("room").expect("it can be read");
            fcntl(&former, FcntlArg::F_ADD_SEALS(SealFlag::F_SEAL_GROW)).expect("a seal");
            let refused = write_over(&former, &longer, is_spared.then_some(&spare)).expect_err("no room");
            assert_eq!(refused.is_as_before, is_spared);
            assert_eq!(read(&former) == vec![b'f'; 200_000], is_spared);
            assert_eq!(read(&former).len(), 200_000);
        }
        // Where the very first write is refused, nothing is there to be put back.
        let former = File::from(memfd_create("former", MFdFlags::MFD_ALLOW_SEALING).expect("memory"));
        (&former).write_all(b"former").and_then(|()| (&former).rewind()).expect("room");
        fcntl(&former, FcntlArg::F_ADD_SEALS(SealFlag::F_SEAL_WRITE)).expect("a seal");
        assert!(write_over(&former, &longer, None).expect_err("sealed").is_as_before);
        assert_eq!(read(&former), b"former");
        // Of the room that is tried, for either content, nothing stays behind that which is there.
        let room = || longer.metadata().expect("ours").blocks() * 512;
        let room_before = room();
        try_room(&longer, 300_000).expect("room");
        assert!(read(&longer) == vec![b'n'; 300_000] && room() < room_before + 300_000);
        // A shorter one leaves nothing of it.
        let former = tempfile::tempfile().expect("room");
        (&former).write_all(&vec![b'f'; 400_000]).and_then(|()| (&former).rewind()).expect("room");
        let spare = spared(&former, 300_000, place).expect("room").expect("it can be read");
        assert_eq!(read(&spare).len(), 300_000);
        write_over(&former, &longer, Some(&spare)).expect("room");
        assert_eq!(read(&former), vec![b'n'; 300_000]);
    }

    #[test]
    fn devices_are_written_directly_and_directories_are_refused() {
        assert!(!Replacement::begin(Path::new("/dev/null")).expect("a device").is_beside());
        assert_eq!(write(Path::new("/dev/full"), "x").expect_err("full").kind(), io::ErrorKind::StorageFull);
        assert!(write(&std::env::temp_dir(), "x").is_err());
    }
}
