//! Samples of what was written to a file, by which it is known again.
//!
//! Problem: who cuts a recording and extends it to the same length, or writes over it, leaves its length as it was.
//! Model: of each piece the last bytes are kept, and of the first one the first bytes, too; of old pieces fewer and fewer, in even
//! steps. They are compared with what is read back through a descriptor of its own: the first ones and those of the last two
//! pieces before each piece, all of them at the end. Two, since a cut between a comparison and the next piece shows in the piece
//! before that alone.
//! Cost: at most [`MOST`] + 3 samples of [`SAMPLE_BYTES`] are kept, and read at the end; three before each piece.
//! Limits: what others write between two samples is not seen, nor is a change to the same bytes. Of a file that may be written and
//! not read there are no samples.

use std::fs::File;
use std::io;
use std::os::fd::AsRawFd;
use std::os::unix::fs::FileExt;

/// So much of a piece is kept.
const SAMPLE_BYTES: usize = 64;
/// So many pieces are known at most, besides the last two; an even number.
const MOST: usize = 64;

/// Samples of a file's content.
#[derive(Debug)]
pub(super) struct Marks {
    /// `None`: it cannot be read, or nothing was written yet.
    file: Option<File>,
    first: Option<Mark>,
    /// Of every so many pieces one.
    spread: Vec<Mark>,
    every: u64,
    last: [Option<Mark>; 2],
    pieces: u64,
    end: u64,
}

/// Bytes of a file.
#[derive(Debug, Clone)]
struct Mark {
    at: u64,
    bytes: Vec<u8>,
}

impl Marks {
    pub(super) fn new() -> Self {
        Self { file: None, first: None, spread: Vec::new(), every: 1, last: [None, None], pieces: 0, end: 0 }
    }

    /// Notes a piece that was written to this regular file, at this place.
    pub(super) fn note(&mut self, file: &File, at: u64, piece: &[u8]) {
        if piece.is_empty() {
            return;
        }
        if self.pieces == 0 {
            // It was opened for writing alone.
            self.file = File::open(format!("/proc/self/fd/{}", file.as_raw_fd())).ok();
            self.first = Some(Mark { at, bytes: piece[..piece.len().min(SAMPLE_BYTES)].into() });
        }
        let bytes = &piece[piece.len().saturating_sub(SAMPLE_BYTES)..];
        self.end = at + piece.len() as u64;
        let mark = Mark { at: self.end - bytes.len() as u64, bytes: bytes.into() };
        self.spread(&mark);
        self.last = [self.last[1].take(), Some(mark)];
        self.pieces += 1;
    }

    fn spread(&mut self, mark: &Mark) {
        if !self.pieces.is_multiple_of(self.every) {
            return;
        }
        if self.spread.len() == MOST {
            let mut number = 0;
            self.spread.retain(|_| {
                number += 1;
                number % 2 == 1
            });
            self.every *= 2;
        }
        if self.pieces.is_multiple_of(self.every) {
            self.spread.push(mark.clone());
        }
    }

    /// End of the last piece.
    pub(super) fn end(&self) -> u64 {
        self.end
    }

    /// The place of the first sample, of the first piece and the last two, that is not in the file any more.
    ///
    /// # Errors
    /// It cannot be read back.
    pub(super) fn changed_lately(&self) -> io::Result<Option<u64>> {
        self.changed_of(self.first.iter().chain(self.last.iter().flatten()))
    }

    /// The same of all samples.
    ///
    /// # Errors
    /// As there.
    pub(super) fn changed(&self) -> io::Result<Option<u64>> {
        self.changed_of(self.first.iter().chain(&self.spread).chain(self.last.iter().flatten()))
    }

    fn changed_of<'a>(&self, mut marks: impl Iterator<Item = &'a Mark>) -> io::Result<Option<u64>> {
        let Some(file) = &self.file else { return Ok(None) };
        marks.try_fold(None, |found: Option<u64>, mark| {
            Ok(found.or(if mark.is_in(file)? { None } else { Some(mark.at) }))
        })
    }
}

impl Mark {
    fn is_in(&self, file: &File) -> io::Result<bool> {
        let mut found = [0; SAMPLE_BYTES];
        let found = &mut found[..self.bytes.len()];
        match file.read_exact_at(found, self.at) {
            Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => Ok(false),
            read => read.map(|()| *found == self.bytes),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    /// A file of so many pieces of 100 bytes, each of its own number, and what is known of it.
    fn written(pieces: u64) -> (tempfile::NamedTempFile, Marks) {
        let (file, mut marks) = (tempfile::NamedTempFile::new().expect("room"), Marks::new());
        for number in 0..pieces {
            let piece = [number as u8 + 1; 100];
            file.as_file().write_all(&piece).expect("room");
            marks.note(file.as_file(), 100 * number, &piece);
        }
        (file, marks)
    }

    #[test]
    fn a_file_is_known_again_and_few_of_many_pieces_are_kept() {
        for pieces in [0, 1, 2, 64, 65, 200] {
            let (_file, marks) = written(pieces);
            assert_eq!(marks.end(), 100 * pieces);
            assert_eq!(
                [marks.changed_lately(), marks.changed()].map(|found| found.expect("readable")),
                [None; 2]
            );
            assert!(marks.spread.len() <= MOST && marks.spread.len() as u64 >= pieces.min(32));
            let places = marks.spread.iter().map(|mark| mark.at).collect::<Vec<_>>();
            assert!(places.windows(3).all(|three| three[1] - three[0] == three[2] - three[1]), "{places:?}");
        }
    }

    #[test]
    fn a_file_that_was_cut_and_extended_again_is_not_taken_for_the_one_that_was_written() {
        for (cut, first_changed) in [(0, 0), (1, 0), (150, 136), (250, 236)] {
            let (file, marks) = written(3);
            file.as_file().set_len(cut).and_then(|()| file.as_file().set_len(300)).expect("our own");
            assert_eq!(marks.changed().expect("readable"), Some(first_changed), "{cut}");
            assert!(marks.changed_lately().expect("readable").is_some(), "{cut}");
        }
    }

    #[test]
    fn a_cut_between_a_comparison_and_the_next_piece_shows_after_that() {
        let (file, mut marks) = written(3);
        file.as_file().set_len(250).and_then(|()| file.as_file().set_len(300)).expect("our own");
        file.as_file().write_all(&[9; 100]).expect("room");
        marks.note(file.as_file(), 300, &[9; 100]);
        assert_eq!(marks.changed_lately().expect("readable"), Some(236));
    }

    #[test]
    fn what_is_written_over_the_middle_shows_at_the_end() {
        let (file, marks) = written(100);
        file.as_file().write_all_at(&[0; 400], 5000).expect("room");
        assert_eq!(marks.changed_lately().expect("readable"), None);
        assert!(marks.changed().expect("readable").is_some());
    }
}
