//! Lines of a text file, counted once they are in it.
//!
//! Model: lines are gathered and written together. Into what may wait for a reader (a pipe, a terminal) even the first is
//! written with the others, by the thread that can wait; into a file with earlier content, which it has until then, with
//! the first that count, once they are sure to fit; into anything else at once.
//! Invariants: whatever goes wrong, a file ends with a complete line: a write that failed half way (a full disk) is cut
//! back to the last line that fits. Only lines that are in the file count. Into a file that somebody else has cut or written
//! nothing more is written.

use super::content::ContentState;
use super::opened::Opened;
use std::fs::File;
use std::io::{self, Seek, SeekFrom, Write};
use std::sync::Arc;

/// Written at once when this much has come together.
const CHUNK_BYTES: usize = 256 * 1024;

/// A text file being written.
#[derive(Debug)]
pub(crate) struct WholeLines {
    file: Opened,
    has_name: bool,
    /// It is a result, whatever becomes of it.
    is_started: bool,
    /// Whole lines that are not in the file yet.
    buffer: String,
    /// End of each of these in the buffer but the header's, and its tick.
    ends: Vec<(usize, u64)>,
    written_bytes: u64,
    rows: u64,
    last_tick: u64,
}

impl WholeLines {
    /// Begins the file with this line, which does not count; without one if it is empty.
    ///
    /// # Errors
    /// If the line cannot be written.
    pub(crate) fn begin(file: Opened, header: &str) -> io::Result<Self> {
        let (may_wait, has_name, has_content) = (file.may_wait(), file.has_name(), file.has_content());
        // Behind what others have written to a standard output that is a file.
        let written_bytes = if has_content { 0 } else { file.file().metadata()?.len() };
        let mut buffer = String::with_capacity(2 * CHUNK_BYTES);
        if !header.is_empty() {
            buffer.push_str(header);
            buffer.push('\n');
        }
        file.reserve(buffer.len() as u64)?;
        let (ends, rows, last_tick) = (Vec::new(), 0, 0);
        let mut lines =
            Self { file, has_name, is_started: false, buffer, ends, written_bytes, rows, last_tick };
        if !may_wait && !has_content {
            lines.flush()?;
        }
        Ok(lines)
    }

    /// From now on the file is a result; what it had before goes with the next [`Self::flush`].
    pub(crate) fn start(&mut self) {
        self.is_started = true;
    }

    /// Appends the line that `write` makes of this tick.
    ///
    /// # Errors
    /// If it or lines before it cannot be written.
    pub(crate) fn append(&mut self, tick: u64, write: impl FnOnce(&mut String)) -> io::Result<()> {
        self.start();
        write(&mut self.buffer);
        self.buffer.push('\n');
        self.ends.push((self.buffer.len(), tick));
        if self.buffer.len() >= CHUNK_BYTES { self.flush() } else { Ok(()) }
    }

    /// Lines in the file.
    pub(crate) fn rows(&self) -> u64 {
        self.rows
    }

    /// The tick of the last of them.
    pub(crate) fn last_tick(&self) -> u64 {
        self.last_tick
    }

    /// Writes the lines that are not in the file yet.
    ///
    /// # Errors
    /// If that fails; lines that did reach the file are complete. If the first do not fit into a file with earlier
    /// content, that stays.
    pub(crate) fn flush(&mut self) -> io::Result<()> {
        if self.is_started {
            self.file.start(self.buffer.len() as u64)?;
        } else if self.file.has_content() {
            return Ok(());
        }
        if !self.file.has_content() {
            self.file.check_lately(self.written_bytes)?;
        }
        let mut done = 0;
        let bytes = self.buffer.as_bytes();
        let written = loop {
            if self.file.has_content() {
                let replaced = self.file.replace_content(bytes);
                done = if replaced.is_ok() { bytes.len() } else { 0 };
                break replaced;
            }
            if done == bytes.len() {
                break Ok(());
            }
            match self.file.file().write(&bytes[done..]) {
                Ok(0) => break Err(io::ErrorKind::WriteZero.into()),
                Ok(more) => done += more,
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) => break Err(error),
            }
        };
        self.keep_whole_lines(done);
        self.buffer.clear();
        self.ends.clear();
        written
    }

    /// Its content, to be looked at from another thread.
    pub(crate) fn content(&self) -> Arc<ContentState> {
        self.file.content()
    }

    /// It has what it had before, and nothing of what is gathered.
    pub(crate) fn has_content(&self) -> bool {
        self.file.has_content()
    }

    /// Neither a line nor anything else has made a result of it, and it has what it had before.
    pub(crate) fn is_as_before(&self) -> bool {
        self.has_content() && !self.is_started
    }

    /// At an end in order a file without lines stays, unless that would cost its earlier content.
    ///
    /// # Errors
    /// As [`Self::flush`].
    pub(crate) fn keep(&mut self) -> io::Result<()> {
        if !self.is_as_before() {
            self.start();
        }
        self.flush()?;
        self.check_all()
    }

    /// Another handle of the file ([`Opened::second_handle`]).
    ///
    /// # Errors
    /// As there.
    pub(crate) fn second_handle(&self) -> io::Result<Option<File>> {
        self.file.second_handle()
    }

    /// Finds out whether the file has what was written, and nothing else.
    fn check_all(&self) -> io::Result<()> {
        if self.file.has_content() { Ok(()) } else { self.file.check_all(self.written_bytes) }
    }

    /// Writes everything out to the disk itself.
    ///
    /// # Errors
    /// If that fails.
    pub(crate) fn sync(&mut self) -> io::Result<()> {
        self.flush()?;
        match self.file.file().sync_data() {
            // A pipe or a character device has no disk to reach.
            Err(error) if error.kind() == io::ErrorKind::InvalidInput => Ok(()),
            synced => synced.and_then(|()| self.check_all()),
        }
    }

    /// The name that led to the file in the beginning does so no more.
    pub(crate) fn is_removed(&self) -> bool {
        self.has_name && self.is_started && self.file.has_lost_name()
    }

    /// Counts what reached the file and cuts a line that did so only in part.
    fn keep_whole_lines(&mut self, done: usize) {
        let whole = self.ends.iter().take_while(|(end, _)| *end <= done).count();
        let mut kept = if done == self.buffer.len() { done } else { 0 };
        if whole > 0 {
            let (end, tick) = self.ends[whole - 1];
            self.rows += whole as u64;
            self.last_tick = tick;
            kept = kept.max(end);
        }
        self.file.wrote(self.written_bytes, &self.buffer.as_bytes()[..kept]);
        self.written_bytes += kept as u64;
        if kept < done {
            // If even this fails, the message still says how many lines are good.
            let _ = self.file.cut(self.written_bytes);
            let _ = self.file.file().seek(SeekFrom::Start(self.written_bytes));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::opened::OtherContent;
    use super::*;

    #[test]
    fn a_line_that_reached_the_file_only_in_part_is_cut_off_and_not_counted() {
        let directory = tempfile::tempdir().expect("a directory");
        let path = directory.path().join("lines");
        let mut lines = Opened::open(&path).and_then(|file| WholeLines::begin(file, "head")).expect("begun");
        for (tick, text) in [(3, "one"), (4, "two")] {
            lines.append(tick, |line| line.push_str(text)).expect("gathered");
        }
        assert_eq!((lines.rows(), lines.last_tick()), (0, 0), "nothing is in the file");
        let bytes = lines.buffer.clone().into_bytes();
        let half = lines.ends[0].0 + 2;
        lines.file.file().write_all(&bytes[..half]).expect("written");
        lines.keep_whole_lines(half);
        assert_eq!(std::fs::read_to_string(&path).expect("readable"), "head\none\n");
        assert_eq!((lines.rows(), lines.last_tick()), (1, 3));
    }

    #[test]
    fn a_file_has_its_earlier_content_until_the_first_line_counts_and_is_as_it_was_without_one() {
        let directory = tempfile::tempdir().expect("a directory");
        let [content, empty, new] = ["content", "empty", "new"].map(|name| directory.path().join(name));
        std::fs::write(&content, "earlier").expect("room");
        std::fs::write(&empty, "").expect("room");
        let begin = |path: &std::path::PathBuf| {
            Opened::open(path).and_then(|file| WholeLines::begin(file, "head")).expect("begun")
        };
        let all = [&content, &empty, &new];
        for mut lines in all.map(begin) {
            lines.sync().expect("nothing to write");
        }
        assert_eq!(std::fs::read(&content).expect("there"), b"earlier");
        assert_eq!(std::fs::read(&empty).expect("there"), b"");
        assert!(!new.exists());
        for path in [&content, &new] {
            begin(path).keep().expect("room");
        }
        assert_eq!(std::fs::read(&content).expect("there"), b"earlier");
        assert_eq!(std::fs::read(&new).expect("there"), b"head\n");
        for path in all {
            let mut lines = begin(path);
            lines.append(3, |line| line.push_str("one")).and_then(|()| lines.sync()).expect("room");
            assert!(!lines.is_removed());
            drop(lines);
            assert_eq!(std::fs::read_to_string(path).expect("there"), "head\none\n");
        }
    }

    #[test]
    fn a_file_that_somebody_else_cut_or_wrote_takes_no_more_and_is_not_called_whole() {
        let directory = tempfile::tempdir().expect("a directory");
        let path = directory.path().join("lines");
        let line = |lines: &mut WholeLines, tick| lines.append(tick, |line| line.push_str("one"));
        for content in ["", "head", "head\none\nand more"] {
            let mut lines =
                Opened::open(&path).and_then(|file| WholeLines::begin(file, "head")).expect("begun");
            line(&mut lines, 3).and_then(|()| lines.flush()).expect("room");
            std::fs::write(&path, content).expect("room");
            let refused = line(&mut lines, 4).and_then(|()| lines.flush()).expect_err("another length");
            let told = format!("it has {} bytes where 9 were written", content.len());
            assert_eq!(OtherContent::of(&refused).expect("another length").to_string(), told);
            assert!([lines.sync(), lines.keep()].iter().all(Result::is_err));
            drop(lines);
            assert_eq!(std::fs::read_to_string(&path).expect("there"), content);
            std::fs::remove_file(&path).expect("our own");
        }
    }

    #[test]
    fn a_file_that_somebody_else_cut_and_made_as_long_again_takes_no_more_and_is_not_called_whole() {
        let directory = tempfile::tempdir().expect("a directory");
        let path = directory.path().join("lines");
        let line = |lines: &mut WholeLines, tick| lines.append(tick, |line| line.push_str("one"));
        for content in ["", "head\n"] {
            for is_at_the_end in [true, false] {
                let begun = Opened::open(&path).and_then(|file| WholeLines::begin(file, "head"));
                let mut lines = begun.expect("begun");
                line(&mut lines, 3).and_then(|()| lines.flush()).expect("room");
                std::fs::write(&path, content).expect("room");
                std::fs::OpenOptions::new()
                    .write(true)
                    .open(&path)
                    .and_then(|file| file.set_len(9))
                    .expect("room");
                let refused = if is_at_the_end {
                    lines.keep()
                } else {
                    line(&mut lines, 4).and_then(|()| lines.flush())
                };
                let found = OtherContent::of(&refused.expect_err("other bytes")).expect("others' doing");
                assert_eq!(found, OtherContent::Bytes { at: content.len() as u64 });
                drop(lines);
                assert_eq!(path.metadata().expect("there").len(), 9);
                std::fs::remove_file(&path).expect("our own");
            }
        }
    }

    #[test]
    fn a_device_that_takes_nothing_refuses_the_header_and_counts_no_line() {
        let full = || Opened::open(std::path::Path::new("/dev/full")).expect("a device");
        let refused = WholeLines::begin(full(), "head").expect_err("full");
        assert_eq!(refused.kind(), io::ErrorKind::StorageFull);
        let mut lines = WholeLines::begin(full(), "").expect("nothing to write yet");
        lines.append(7, |line| line.push_str("one")).expect("gathered");
        assert!(lines.flush().is_err());
        assert_eq!((lines.rows(), lines.last_tick()), (0, 0));
    }
}
