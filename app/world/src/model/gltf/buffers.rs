//! The bytes that a glTF file is about: within it, in data URIs, or in files beside it.

use super::document::Document;
use super::{missing, wrong};
use crate::model::{MAX_MODEL_BYTES, ModelError, read_file, shown};
use std::borrow::Cow;
use std::path::{Component, Path, PathBuf};

pub(super) struct Buffers<'b> {
    all: Vec<Cow<'b, [u8]>>,
    /// The directory of the files beside it.
    beside: Option<&'b Path>,
    bytes_beside: usize,
}

/// The text of a file, and the bytes behind it in a GLB.
pub(super) fn parts(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), ModelError> {
    if !bytes.starts_with(b"glTF") {
        return Ok((bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes), None));
    }
    let word = |at: usize| -> Result<usize, ModelError> {
        let word =
            bytes.get(at..at + 4).ok_or_else(|| byte(bytes.len(), CUT.into(), "a header of 12 bytes"))?;
        Ok(u32::from_le_bytes([word[0], word[1], word[2], word[3]]) as usize)
    };
    let (version, length) = (word(4)?, word(8)?);
    if version != 2 {
        return Err(byte(4, format!("version {version}"), "version 2; export the model as glTF 2.0"));
    }
    let Some(bytes) = bytes.get(..length) else {
        let found = format!("a length of {length} bytes, of which {} are there", bytes.len());
        return Err(byte(8, found, "the file's length; it may be cut short"));
    };
    let chunk = |at: usize| {
        let head = bytes.get(at..at + 8)?;
        let (length, kind) = head.split_at(4);
        let length = u32::from_le_bytes([length[0], length[1], length[2], length[3]]) as usize;
        Some((kind, bytes.get(at + 8..)?.get(..length)?, at + 8 + length))
    };
    let Some((b"JSON", text, end)) = chunk(12) else {
        return Err(byte(
            12,
            "no whole chunk JSON".into(),
            "a GLB begins with one; the file may be cut short",
        ));
    };
    let rest = bytes.len() - end;
    match chunk(end) {
        Some((b"BIN\0", binary, _)) => Ok((text, Some(binary))),
        None if rest > 3 => Err(byte(
            end,
            "a chunk that is longer than the file".into(),
            "one that ends in it; it may be cut short",
        )),
        _ => Ok((text, None)),
    }
}

impl<'b> Buffers<'b> {
    pub(super) fn load(
        document: &'b Document,
        binary: Option<&'b [u8]>,
        beside: Option<&'b Path>,
    ) -> Result<Self, ModelError> {
        let mut buffers = Self { all: Vec::new(), beside, bytes_beside: 0 };
        for (index, buffer) in document.buffers.iter().enumerate() {
            let place = format!("buffers[{index}]");
            let bytes = match (&buffer.uri, binary) {
                (None, Some(binary)) if index == 0 => Cow::Borrowed(binary),
                // Another program's, in place of compressed data.
                (None, _) => Cow::Borrowed(&[][..]),
                (Some(uri), _) => Cow::Owned(buffers.of_uri(uri, &place)?),
            };
            if bytes.len() < buffer.byte_length && !(bytes.is_empty() && buffer.uri.is_none()) {
                let found = format!("{} bytes", bytes.len());
                return Err(wrong(
                    place,
                    found,
                    &format!("{}, as its byteLength says; it may be cut short", buffer.byte_length),
                ));
            }
            buffers.all.push(bytes);
        }
        Ok(buffers)
    }

    pub(super) fn get(&self, index: usize) -> Option<&[u8]> {
        self.all.get(index).map(|bytes| &**bytes)
    }

    pub(super) fn len(&self) -> usize {
        self.all.len()
    }

    /// The bytes that a data URI is, or that are in a file beside it.
    pub(super) fn of_uri(&mut self, uri: &str, place: &str) -> Result<Vec<u8>, ModelError> {
        match uri.strip_prefix("data:") {
            Some(data) => decoded(data, place),
            None => self.read(uri, place),
        }
    }

    /// The bytes of a part of a buffer.
    pub(super) fn of_view(&self, document: &Document, view: usize) -> Result<&[u8], ModelError> {
        let views = &document.buffer_views;
        let place = format!("bufferViews[{view}]");
        let view = views.get(view).ok_or_else(|| missing(&place, views.len()))?;
        let buffer = self
            .get(view.buffer)
            .ok_or_else(|| missing(&format!("{place}.buffer = {}", view.buffer), self.len()))?;
        buffer.get(view.byte_offset..).and_then(|rest| rest.get(..view.byte_length)).ok_or_else(|| {
            let found = format!("{} bytes from byte {}", view.byte_length, view.byte_offset);
            wrong(place, found, &format!("a part of a buffer of {} bytes", buffer.len()))
        })
    }

    /// Of all files beside it.
    pub(super) fn bytes_beside(&self) -> usize {
        self.bytes_beside
    }

    fn read(&mut self, uri: &str, place: &str) -> Result<Vec<u8>, ModelError> {
        let (Some(beside), Some(file)) = (self.beside, below(uri)) else {
            let allowed =
                "a file beside this one or in a directory there, or a data URI; or export it as GLB";
            return Err(wrong(format!("{place}.uri"), shown(uri.as_bytes()), allowed));
        };
        let bytes = read_file(&beside.join(&file)).map_err(|error| {
            wrong(
                format!("{place}.uri"),
                shown(uri.as_bytes()),
                &format!("a file that can be read ({error})"),
            )
        })?;
        self.bytes_beside += bytes.len();
        if self.bytes_beside as u64 > MAX_MODEL_BYTES {
            return Err(ModelError::TooLarge { limit_bytes: MAX_MODEL_BYTES });
        }
        Ok(bytes)
    }
}

/// The path that a URI is from a model's directory, if it leads nowhere else.
pub(super) fn below(uri: &str) -> Option<PathBuf> {
    let path = unescaped(uri);
    let is_below =
        !path.is_empty() && Path::new(&path).components().all(|part| matches!(part, Component::Normal(_)));
    is_below.then(|| path.into())
}

/// Of a data URI without its beginning.
fn decoded(data: &str, place: &str) -> Result<Vec<u8>, ModelError> {
    let refused = |found: String| wrong(format!("{place}.uri"), found, "a data URI in base64");
    let Some((kind, text)) = data.split_once(',').filter(|(kind, _)| kind.ends_with(";base64")) else {
        return Err(refused(shown(data.as_bytes())));
    };
    let text = text.trim_end_matches('=').as_bytes();
    let mut bytes = Vec::with_capacity(text.len() / 4 * 3 + 2);
    for (number, quad) in text.chunks(4).enumerate() {
        let mut bits = 0_u32;
        for (i, &digit) in quad.iter().enumerate() {
            let Some(value) = value(digit) else {
                let at = 4 * number + i + kind.len();
                return Err(refused(format!("{} as digit {at}", shown(&[digit]))));
            };
            bits |= value << (18 - 6 * i);
        }
        // Two digits make one byte, three make two.
        bytes.extend_from_slice(&bits.to_be_bytes()[1..][..quad.len() - 1]);
    }
    Ok(bytes)
}

fn value(digit: u8) -> Option<u32> {
    Some(u32::from(match digit {
        b'A'..=b'Z' => digit - b'A',
        b'a'..=b'z' => digit - b'a' + 26,
        b'0'..=b'9' => digit - b'0' + 52,
        b'+' | b'-' => 62,
        b'/' | b'_' => 63,
        _ => return None,
    }))
}

/// With `%20` as a space.
fn unescaped(uri: &str) -> String {
    let mut bytes = Vec::with_capacity(uri.len());
    let mut rest = uri.as_bytes();
    while let [first, tail @ ..] = rest {
        let hex = |digits: &[u8]| u8::from_str_radix(std::str::from_utf8(digits).ok()?, 16).ok();
        match (first, tail.get(..2).filter(|digits| digits.iter().all(u8::is_ascii_hexdigit)).and_then(hex)) {
            (b'%', Some(byte)) => {
                bytes.push(byte);
                rest = &tail[2..];
            }
            _ => {
                bytes.push(*first);
                rest = tail;
            }
        }
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

fn byte(offset: usize, found: String, allowed: &str) -> ModelError {
    ModelError::Byte { offset, found, allowed: allowed.into() }
}

const CUT: &str = "the end of the file; it may be cut short";
