//! Lines of a text file, counted once they are in it.
//!
//! Model: lines are gathered and written together. Into what may wait for a reader (a pipe, a terminal) even the first is
//! written with the others, by the thread that can wait; into anything else at once.
//! Invariants: whatever goes wrong, a file ends with a complete line: a write that failed half way (a full disk) is cut
//! back to the last line that fits. Only lines that are in the file count.

use super::opened::Opened;
use rt_core::output_file;
use std::fs::File;
use std::io::{self, Seek, SeekFrom, Write};

/// Written at once when this much has come together.
const CHUNK_BYTES: usize = 256 * 1024;

/// A text file being written.
#[derive(Debug)]
pub(crate) struct WholeLines {
    file: File,
    has_name: bool,
    /// Whole lines that are not in the file yet.
    buffer: String,
    /// End of each of these in the buffer but the header's, and its tick.
    ends: Vec<(usize, u64)>,
    written_bytes: u64,
    rows: u64,
    last_tick: u64,
}

impl WholeLines {
    /// Empties the file and begins it with this line, which does not count; without one if it is empty.
    ///
    /// # Errors
    /// If it cannot be emptied, or the line not be written.
    pub(crate) fn begin(file: Opened, header: &str) -> io::Result<Self> {
        let (may_wait, has_name) = (file.may_wait(), file.has_name());
        let file = file.empty()?;
        // Behind what others have written to a standard output that is a file.
        let written_bytes = file.metadata()?.len();
        let mut buffer = String::with_capacity(2 * CHUNK_BYTES);
        if !header.is_empty() {
            buffer.push_str(header);
            buffer.push('\n');
        }
        let mut lines =
            Self { file, has_name, buffer, ends: Vec::new(), written_bytes, rows: 0, last_tick: 0 };
        if !may_wait {
            lines.flush()?;
        }
        Ok(lines)
    }

    /// Appends the line that `write` makes of this tick.
    ///
    /// # Errors
    /// If it or lines before it cannot be written.
    pub(crate) fn append(&mut self, tick: u64, write: impl FnOnce(&mut String)) -> io::Result<()> {
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
    /// If that fails; lines that did reach the file are complete.
    pub(crate) fn flush(&mut self) -> io::Result<()> {
        let mut done = 0;
        let bytes = self.buffer.as_bytes();
        let written = loop {
            if done == bytes.len() {
                break Ok(());
            }
            match self.file.write(&bytes[done..]) {
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

    /// Writes everything out to the disk itself.
    ///
    /// # Errors
    /// If that fails.
    pub(crate) fn sync(&mut self) -> io::Result<()> {
        self.flush()?;
        match self.file.sync_data() {
            // A pipe or a character device has no disk to reach.
            Err(error) if error.kind() == io::ErrorKind::InvalidInput => Ok(()),
            synced => synced,
        }
    }

    /// The name is gone that the file had in the beginning.
    pub(crate) fn is_removed(&self) -> bool {
        self.has_name && output_file::has_no_name(&self.file)
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
        self.written_bytes += kept as u64;
        if kept < done {
            // If even this fails, the message still says how many lines are good.
            let _ = self.file.set_len(self.written_bytes);
            let _ = self.file.seek(SeekFrom::Start(self.written_bytes));
        }
    }
}

#[cfg(test)]
mod tests {
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
        lines.file.write_all(&bytes[..half]).expect("written");
        lines.keep_whole_lines(half);
        assert_eq!(std::fs::read_to_string(&path).expect("readable"), "head\none\n");
        assert_eq!((lines.rows(), lines.last_tick()), (1, 3));
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
