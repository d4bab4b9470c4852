//! Numbers of a PLY file, one after the other.

use super::header::{Encoding, Header, Kind, Number};
use crate::model::words::Words;
use crate::model::{ModelError, shown};

pub(super) enum Source<'b> {
    Text {
        words: Words<'b>,
        /// There is a line for each instance.
        is_by_line: bool,
    },
    Binary {
        bytes: &'b [u8],
        /// Behind the last number.
        at: usize,
        /// Beginning of the last number.
        last: usize,
        is_big_endian: bool,
    },
}

impl<'b> Source<'b> {
    pub(super) fn new(header: &Header, bytes: &'b [u8]) -> Self {
        match header.encoding {
            Encoding::Text => {
                let rest = &bytes[header.end..];
                let lines = rest.split(|byte| *byte == b'\n').filter(|line| !line.trim_ascii().is_empty());
                let is_by_line = header.instances() == Some(lines.count() as u64);
                Self::Text { words: Words::from_line(rest, header.lines + 1), is_by_line }
            }
            encoding => Self::Binary {
                bytes,
                at: header.end,
                last: header.end,
                is_big_endian: encoding == Encoding::BigEndian,
            },
        }
    }

    /// It may be no number, or infinite.
    pub(super) fn number(&mut self, number: Number) -> Result<f64, ModelError> {
        match self {
            Self::Text { words, .. } => {
                let word = words.next();
                let value = word.and_then(|word| std::str::from_utf8(word).ok()?.parse().ok());
                value.ok_or_else(|| words.wrong(word, "a number"))
            }
            Self::Binary { is_big_endian, .. } => {
                let is_big_endian = *is_big_endian;
                let mut bytes = [0; 8];
                let bytes = &mut bytes[..number.bytes()];
                bytes.copy_from_slice(self.take(number.bytes())?);
                if is_big_endian {
                    bytes.reverse();
                }
                Ok(value(number, bytes))
            }
        }
    }

    /// Length of a list.
    pub(super) fn count(&mut self, number: Number) -> Result<u64, ModelError> {
        let count = self.number(number)?;
        if count.fract() == 0.0 && (0.0..=f64::from(u32::MAX)).contains(&count) {
            return Ok(count as u64);
        }
        Err(self.wrong(&format!("a list of {count} numbers"), "a whole number, 0 or more"))
    }

    pub(super) fn skip(&mut self, kind: Kind) -> Result<(), ModelError> {
        let (count, item) = match kind {
            Kind::One(number) => (1, number),
            Kind::List { count, item } => (self.count(count)?, item),
        };
        match self {
            Self::Binary { .. } => self.take(count as usize * item.bytes()).map(drop),
            Self::Text { words, .. } => {
                for _ in 0..count {
                    words.next().ok_or_else(|| words.wrong(None, "as many numbers as the header says"))?;
                }
                Ok(())
            }
        }
    }

    /// Passes over what a line has behind the last property that the header names: MeshLab writes colours of corners there.
    pub(super) fn end_instance(&mut self) {
        if let Self::Text { words, is_by_line: true } = self {
            words.skip_line();
        }
    }

    /// Nothing may follow.
    pub(super) fn end(&mut self) -> Result<(), ModelError> {
        let found = match self {
            Self::Text { words, .. } => words.next().map(shown),
            Self::Binary { bytes, at, last, .. } => {
                *last = *at;
                let rest = bytes[*at..].trim_ascii_end();
                (!rest.is_empty()).then(|| format!("{} bytes behind what the header promises", rest.len()))
            }
        };
        found.map_or(Ok(()), |found| {
            Err(self.wrong(&found, "the end of the file, or larger numbers in the header"))
        })
    }

    /// Of the last number.
    pub(super) fn wrong(&self, found: &str, allowed: &str) -> ModelError {
        let (found, allowed) = (found.into(), allowed.into());
        match self {
            Self::Text { words, .. } => ModelError::Line { line: words.line(), found, allowed },
            Self::Binary { last, .. } => ModelError::Byte { offset: *last, found, allowed },
        }
    }

    fn take(&mut self, length: usize) -> Result<&'b [u8], ModelError> {
        let Self::Binary { bytes, at, last, .. } = self else { return Ok(&[]) };
        *last = *at;
        let Some(taken) = bytes[*at..].get(..length) else {
            let (offset, allowed) = (bytes.len(), "as many numbers as the header says".into());
            return Err(ModelError::Byte {
                offset,
                found: "the end of the file; it may be cut short".into(),
                allowed,
            });
        };
        *at += length;
        Ok(taken)
    }
}

/// From as many bytes as the number has, the lowest first.
fn value(number: Number, bytes: &[u8]) -> f64 {
    let mut all = [0; 8];
    all[..bytes.len()].copy_from_slice(bytes);
    let bits = u64::from_le_bytes(all);
    match number {
        Number::I8 => f64::from(bits as u8 as i8),
        Number::U8 => f64::from(bits as u8),
        Number::I16 => f64::from(bits as u16 as i16),
        Number::U16 => f64::from(bits as u16),
        Number::I32 => f64::from(bits as u32 as i32),
        Number::U32 => f64::from(bits as u32),
        Number::F32 => f64::from(f32::from_bits(bits as u32)),
        Number::F64 => f64::from_bits(bits),
    }
}
