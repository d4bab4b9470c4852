//! Text in words of shared memory: cut to the room, padded with zeros, control characters shown by their code.

use super::{get, put};
use crate::handshake;
use std::sync::atomic::AtomicU64;

/// Cuts at a character and pads with zeros.
pub(super) fn put_text(words: &[AtomicU64], text: &str) {
    let room = words.len() * 8;
    let mut length = text.len().min(room);
    while !text.is_char_boundary(length) {
        length -= 1;
    }
    let bytes = &text.as_bytes()[..length];
    for (index, word) in words.iter().enumerate() {
        let mut eight = [0; 8];
        let rest = bytes.get(index * 8..).unwrap_or_default();
        let filled = rest.len().min(8);
        eight[..filled].copy_from_slice(&rest[..filled]);
        put(word, u64::from_le_bytes(eight));
    }
}

pub(super) fn text_of(words: &[AtomicU64]) -> String {
    handshake::printable(&bytes_of(words))
}

/// As [`text_of`], keeping the ends of lines.
pub(super) fn lines_of(words: &[AtomicU64]) -> String {
    let lines: Vec<String> = bytes_of(words).split(|byte| *byte == b'\n').map(handshake::printable).collect();
    lines.join("\n")
}

pub(super) fn bytes_of(words: &[AtomicU64]) -> Vec<u8> {
    words.iter().flat_map(|word| get(word).to_le_bytes()).take_while(|byte| *byte != 0).collect()
}
