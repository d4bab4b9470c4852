//! Lines of bounded length, whoever reads them.
//!
//! Problem: a reader of lines gathers one until its end comes; in `/dev/zero`, or in a file of holes, it never does.
//! Model: bytes pass through, and those since the last end of a line are counted.

use std::io::{self, Read};

/// Fails once a line has more bytes than this.
#[derive(Debug)]
pub(crate) struct BoundedLines<R> {
    inner: R,
    most: usize,
    /// Bytes of the line that has not ended yet.
    length: usize,
}

impl<R> BoundedLines<R> {
    /// Lines of `most` bytes at most, without their ends.
    pub(crate) fn new(inner: R, most: usize) -> Self {
        Self { inner, most, length: 0 }
    }

    /// The longest line in these bytes, the first of which goes on with the last of those before.
    fn longest(&mut self, bytes: &[u8]) -> usize {
        let mut longest = 0;
        for (number, piece) in bytes.split(|byte| *byte == b'\n').enumerate() {
            self.length = piece.len() + if number == 0 { self.length } else { 0 };
            longest = longest.max(self.length);
        }
        longest
    }
}

impl<R: Read> Read for BoundedLines<R> {
    fn read(&mut self, room: &mut [u8]) -> io::Result<usize> {
        let count = self.inner.read(room)?;
        if self.longest(&room[..count]) > self.most {
            let words = format!("a line has more than {} bytes", self.most);
            return Err(io::Error::new(io::ErrorKind::InvalidData, words));
        }
        Ok(count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::{BufRead, BufReader};

    /// In pieces of three bytes.
    fn lines(text: &str) -> io::Result<Vec<String>> {
        BufReader::with_capacity(3, BoundedLines::new(text.as_bytes(), 5)).lines().collect()
    }

    #[test]
    fn lines_of_the_most_bytes_pass_and_one_byte_more_is_told() {
        assert_eq!(
            lines("12345\n1\n\n1234\n12345").expect("short lines"),
            ["12345", "1", "", "1234", "12345"]
        );
        for long in ["123456", "1\n123456\n", "123456\n1"] {
            assert_eq!(lines(long).expect_err(long).to_string(), "a line has more than 5 bytes");
        }
    }

    #[test]
    fn a_line_without_an_end_is_told_and_not_gathered() {
        let endless = BufReader::new(BoundedLines::new(io::repeat(0), 1 << 20)).lines().next();
        assert!(endless.expect("a line").is_err());
    }
}
