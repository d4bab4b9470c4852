//! Records of an MCAP file, borrowed from its bytes.
//!
//! Problem: a record holds lengths of texts, maps and files inside it. The `mcap` crate's own parser asks for the memory
//! of a length before it looks whether so many bytes are there, 4 GiB of them in a damaged file, and panics at an
//! attachment that is too short for its check sum.
//! Model: every part is a slice of what is there; a length beyond it makes the record none. Only the parts that a replay
//! needs are taken. Reference: the MCAP specification, "Records".
//! Cost: nothing is copied but metadata.

use rt_core::plain_text::beginning;
use std::collections::BTreeMap;
use thiserror::Error;

/// A record's content, as far as it is used here.
#[derive(Debug, PartialEq)]
pub(super) enum McapRecord<'a> {
    /// Where messages of one topic go.
    Channel { id: u16, topic: &'a str },
    /// A message of a channel.
    Message { channel: u16, data: &'a [u8] },
    /// Many records, perhaps compressed.
    Chunk(Chunk<'a>),
    /// A file.
    Attachment { name: &'a str, data: &'a [u8] },
    /// Words under a name.
    Metadata { name: &'a str, facts: BTreeMap<String, String> },
    /// Anything else.
    Other,
}

/// A chunk as it stands in the file.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Chunk<'a> {
    /// How many bytes its records have.
    pub(super) uncompressed_bytes: u64,
    /// Their check sum, 0: none.
    pub(super) crc: u32,
    /// `lz4`, or nothing.
    pub(super) compression: &'a str,
    pub(super) records: &'a [u8],
}

const HEADER: u8 = 0x01;
const FOOTER: u8 = 0x02;
const CHANNEL: u8 = 0x04;
const MESSAGE: u8 = 0x05;
const CHUNK: u8 = 0x06;
const MESSAGE_INDEX: u8 = 0x07;
const CHUNK_INDEX: u8 = 0x08;
const ATTACHMENT: u8 = 0x09;
const ATTACHMENT_INDEX: u8 = 0x0a;
const METADATA: u8 = 0x0c;
const DATA_END: u8 = 0x0f;

/// Why a record is none.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub(super) enum RecordError {
    #[error("a record is shorter than it says")]
    Short,
    #[error("a text in a record is not UTF-8")]
    NoText,
    #[error("the attached file {} does not have its check sum", beginning(.name))]
    CheckSum { name: String },
}

/// Reads a record.
pub(super) fn parse(opcode: u8, body: &[u8]) -> Result<McapRecord<'_>, RecordError> {
    let mut fields = Fields(body);
    Ok(match opcode {
        CHANNEL => {
            let id = fields.u16()?;
            let _schema = fields.u16()?;
            McapRecord::Channel { id, topic: fields.text()? }
        }
        MESSAGE => {
            let channel = fields.u16()?;
            let _sequence_and_times = fields.take(4 + 8 + 8)?;
            McapRecord::Message { channel, data: fields.0 }
        }
        CHUNK => McapRecord::Chunk(chunk(&mut fields)?),
        ATTACHMENT => attachment(body)?,
        METADATA => McapRecord::Metadata { name: fields.text()?, facts: fields.map()? },
        _ => McapRecord::Other,
    })
}

/// What such a record is, if it may not stand in a chunk: there, the format has schemas, channels and messages. Opcodes
/// that are not known are nobody's concern.
pub(super) fn refused_in_chunks(opcode: u8) -> Option<&'static str> {
    match opcode {
        CHUNK => Some("a chunk"),
        ATTACHMENT => Some("an attachment"),
        METADATA => Some("metadata"),
        HEADER | FOOTER | MESSAGE_INDEX..=CHUNK_INDEX | ATTACHMENT_INDEX..=DATA_END => {
            Some("a part of the file's frame")
        }
        _ => None,
    }
}

/// A record's opcode and its content.
pub(super) type RawRecord<'a> = (u8, &'a [u8]);

/// The first record in the content of a chunk, and what is behind it.
pub(super) fn split_record(bytes: &[u8]) -> Result<(RawRecord<'_>, &[u8]), RecordError> {
    let mut fields = Fields(bytes);
    let [opcode] = fields.array()?;
    let body = fields.long_bytes()?;
    Ok(((opcode, body), fields.0))
}

fn chunk<'a>(fields: &mut Fields<'a>) -> Result<Chunk<'a>, RecordError> {
    let _times = fields.take(8 + 8)?;
    Ok(Chunk {
        uncompressed_bytes: fields.u64()?,
        crc: fields.u32()?,
        compression: fields.text()?,
        records: fields.long_bytes()?,
    })
}

fn attachment(body: &[u8]) -> Result<McapRecord<'_>, RecordError> {
    let mut fields = Fields(body);
    let _times = fields.take(8 + 8)?;
    let name = fields.text()?;
    let _media_type = fields.text()?;
    let data = fields.long_bytes()?;
    let summed = &body[..body.len() - fields.0.len()];
    let crc = fields.u32()?;
    if crc == 0 || crc == crc32fast::hash(summed) {
        Ok(McapRecord::Attachment { name, data })
    } else {
        Err(RecordError::CheckSum { name: name.to_owned() })
    }
}

/// What has not been taken of some bytes.
struct Fields<'a>(&'a [u8]);

impl<'a> Fields<'a> {
    fn take(&mut self, count: usize) -> Result<&'a [u8], RecordError> {
        let (taken, rest) = self.0.split_at_checked(count).ok_or(RecordError::Short)?;
        self.0 = rest;
        Ok(taken)
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N], RecordError> {
        let (taken, rest) = self.0.split_first_chunk().ok_or(RecordError::Short)?;
        self.0 = rest;
        Ok(*taken)
    }

    fn u16(&mut self) -> Result<u16, RecordError> {
        self.array().map(u16::from_le_bytes)
    }

    fn u32(&mut self) -> Result<u32, RecordError> {
        self.array().map(u32::from_le_bytes)
    }

    fn u64(&mut self) -> Result<u64, RecordError> {
        self.array().map(u64::from_le_bytes)
    }

    /// Bytes behind their length in 8 bytes.
    fn long_bytes(&mut self) -> Result<&'a [u8], RecordError> {
        let length = usize::try_from(self.u64()?).map_err(|_| RecordError::Short)?;
        self.take(length)
    }

    /// Bytes behind their length in 4 bytes.
    fn short_bytes(&mut self) -> Result<&'a [u8], RecordError> {
        let length = usize::try_from(self.u32()?).map_err(|_| RecordError::Short)?;
        self.take(length)
    }

    fn text(&mut self) -> Result<&'a str, RecordError> {
        std::str::from_utf8(self.short_bytes()?).map_err(|_| RecordError::NoText)
    }

    fn map(&mut self) -> Result<BTreeMap<String, String>, RecordError> {
        let mut pairs = Fields(self.short_bytes()?);
        let mut map = BTreeMap::new();
        while !pairs.0.is_empty() {
            map.insert(pairs.text()?.to_owned(), pairs.text()?.to_owned());
        }
        Ok(map)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn text(words: &str) -> Vec<u8> {
        [&(words.len() as u32).to_le_bytes(), words.as_bytes()].concat()
    }

    /// One record of each kind, in the library's own bytes where it writes them.
    fn records() -> Vec<(u8, Vec<u8>)> {
        let map = [text("a"), text("1")].concat();
        let attached =
            [vec![0; 16], text("scene:x"), text(""), 3u64.to_le_bytes().into(), b"abc".into()].concat();
        let crc = crc32fast::hash(&attached).to_le_bytes();
        vec![
            (CHANNEL, [vec![7, 0, 1, 0], text("/tick"), text("protobuf"), text("")].concat()),
            (MESSAGE, [vec![7, 0], vec![0; 20], b"data".into()].concat()),
            (
                CHUNK,
                [vec![0; 16], vec![9; 8], vec![1; 4], text("lz4"), 2u64.to_le_bytes().into(), vec![5, 6]]
                    .concat(),
            ),
            (ATTACHMENT, [attached, crc.into()].concat()),
            (METADATA, [text("n"), (map.len() as u32).to_le_bytes().into(), map].concat()),
        ]
    }

    #[test]
    fn the_parts_of_records_are_where_the_specification_has_them() {
        let records = records();
        let parsed: Vec<_> =
            records.iter().map(|(opcode, body)| parse(*opcode, body).expect("whole")).collect();
        assert_eq!(parsed[0], McapRecord::Channel { id: 7, topic: "/tick" });
        assert_eq!(parsed[1], McapRecord::Message { channel: 7, data: b"data" });
        let McapRecord::Chunk(chunk) = &parsed[2] else { panic!("a chunk") };
        assert_eq!((chunk.uncompressed_bytes, chunk.crc), (0x0909_0909_0909_0909, 0x0101_0101));
        assert_eq!((chunk.compression, chunk.records), ("lz4", &[5, 6][..]));
        assert_eq!(parsed[3], McapRecord::Attachment { name: "scene:x", data: b"abc" });
        let facts = [("a".to_owned(), "1".to_owned())].into();
        assert_eq!(parsed[4], McapRecord::Metadata { name: "n", facts });
    }

    #[test]
    fn a_text_that_is_none_and_a_file_without_its_check_sum_are_told() {
        let records = records();
        let spoilt = |record: usize, at: usize| {
            let (opcode, mut body) = records[record].clone();
            body[at] = 0xff;
            parse(opcode, &body).expect_err("spoilt")
        };
        assert_eq!(spoilt(0, 8), RecordError::NoText);
        assert_eq!(spoilt(4, 4), RecordError::NoText);
        let name = "scene:x".to_owned();
        let data = 16 + 4 + name.len() + 4 + 8;
        assert_eq!(spoilt(3, data), RecordError::CheckSum { name });
    }

    #[test]
    fn a_record_that_is_cut_anywhere_or_says_it_is_longer_is_none() {
        for (opcode, body) in records() {
            let least = if opcode == MESSAGE { 22 } else { body.len() };
            // Behind a channel's topic nothing is needed.
            let least = if opcode == CHANNEL { 4 + 4 + 5 } else { least };
            for length in 0..least {
                let cut = parse(opcode, &body[..length]);
                assert_eq!(cut, Err(RecordError::Short), "{opcode:#x} cut to {length}");
            }
            for at in 0..body.len() {
                let mut larger = body.clone();
                larger[at] = 0xff;
                let _ = parse(opcode, &larger);
            }
        }
        let long = [&[MESSAGE][..], &u64::MAX.to_le_bytes()].concat();
        assert_eq!(split_record(&long), Err(RecordError::Short));
    }
}
