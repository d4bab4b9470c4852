//! The committed bytes of each version: known values at the places that the version's own C header gives.
//!
//! Every word of a structure has a value that occurs nowhere else in it: `1000 + n` for the n-th word where it
//! is a count, its negative where it is signed, `n + 0.5` where it is a real number. Only what a reader would
//! not believe otherwise (magic words, counts of devices, kinds) is given by [`believable`].

use super::c_header::{CHeader, Leaf};
use shm_abi::LAYOUT_HASH;
use shm_abi::layout::MAGIC;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Everything that crosses the border by itself, by its C name.
pub(crate) const STRUCTURES: [&str; 7] = [
    "PhantomFrame",
    "PhantomCommand",
    "PhantomDriverHeader",
    "PhantomDeviceDescription",
    "PhantomCounters",
    "PhantomRequest",
    "PhantomAnswer",
];

/// The devices of a golden driver: as many as there can be.
pub(crate) const DEVICES: u64 = 8;
/// The text in every name.
pub(crate) const NAME: &str = "golden";

/// A structure of a version: its bytes, and what each number in it is, as text.
pub(crate) struct Golden {
    pub(crate) bytes: Vec<u8>,
    pub(crate) values: Vec<(String, String)>,
}

impl Golden {
    /// The committed one.
    pub(crate) fn committed(version: &str, structure: &str) -> Self {
        let path = path_of(version, structure);
        let text =
            std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        let mut lines = text.lines();
        let size = lines.next().and_then(|line| line.strip_suffix(" bytes")).unwrap().parse().unwrap();
        let mut golden = Self { bytes: vec![0; size], values: Vec::new() };
        for line in lines {
            let (place, meaning) = line.split_once("  ").unwrap();
            let (offset, hex) = place.split_once(": ").unwrap();
            let (name, value) = meaning.split_once(" = ").unwrap();
            golden.put(offset.parse().unwrap(), &bytes_of(hex));
            golden.values.push((name.into(), value.into()));
        }
        golden
    }

    /// The text to commit, made from the version's header.
    pub(crate) fn text(version: &str, structure: &str) -> String {
        let header = CHeader::of(version);
        let mut text = format!("{} bytes\n", header.size_of(structure));
        for leaf in header.leaves(structure) {
            let (bytes, value) = value_of(&header, version, structure, &leaf);
            let hex: String = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
            writeln!(text, "{}: {hex}  {} = {value}", leaf.offset, leaf.path).unwrap();
        }
        text
    }

    /// The value of a number, by its C name.
    pub(crate) fn value(&self, path: &str) -> Option<&str> {
        self.values.iter().find(|(known, _)| known == path).map(|(_, value)| value.as_str())
    }

    fn put(&mut self, offset: usize, bytes: &[u8]) {
        self.bytes[offset..offset + bytes.len()].copy_from_slice(bytes);
    }
}

/// Where the committed text lies.
pub(crate) fn path_of(version: &str, structure: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden").join(version).join(format!("{structure}.txt"))
}

/// Whether a word of this name carries the bits of a real number, though C sees a plain word.
pub(crate) fn is_real_in_disguise(structure: &str, path: &str) -> bool {
    let name = path.split('[').next().unwrap();
    structure == "PhantomDeviceDescription" && !matches!(name, "name" | "kind")
}

fn value_of(header: &CHeader, version: &str, structure: &str, leaf: &Leaf) -> (Vec<u8>, String) {
    let word = leaf.offset as u64 / 8 + 1;
    let real = word as f64 + 0.5;
    let text = |from: usize, bytes: usize| -> Vec<u8> {
        NAME.bytes().chain(std::iter::repeat(0)).skip(from).take(bytes).collect()
    };
    let (name, index) = leaf.path.split_once('[').map_or((leaf.path.as_str(), 0), |(name, rest)| {
        (name, rest.trim_end_matches(']').parse().unwrap_or(0))
    });
    if let Some(value) = believable(header, version, structure, &leaf.path) {
        return (value.to_le_bytes().to_vec(), value.to_string());
    }
    match leaf.c_type.as_str() {
        "uint8_t" => {
            let byte = text(index, 1);
            let value = byte[0].to_string();
            (byte, value)
        }
        _ if structure == "PhantomDeviceDescription" && matches!(name, "name" | "kind") => {
            let bytes = text(8 * index, 8);
            let value = u64::from_le_bytes(bytes.clone().try_into().unwrap()).to_string();
            (bytes, value)
        }
        "double" => (real.to_le_bytes().to_vec(), real.to_string()),
        _ if is_real_in_disguise(structure, &leaf.path) => (real.to_le_bytes().to_vec(), real.to_string()),
        "int64_t" => ((-1000 - word as i64).to_le_bytes().to_vec(), (-1000 - word as i64).to_string()),
        "uint64_t" => ((1000 + word).to_le_bytes().to_vec(), (1000 + word).to_string()),
        other => panic!("no value for {other} {}", leaf.path),
    }
}

/// The words that a reader examines.
fn believable(header: &CHeader, version: &str, structure: &str, path: &str) -> Option<u64> {
    let minor: u64 = version.split_once('.').unwrap().1.parse().unwrap();
    match (structure, path) {
        (_, "magic") => Some(MAGIC),
        (_, "abi_version") => Some((1 << 32) | minor),
        (_, "layout_hash") => Some(LAYOUT_HASH),
        (_, "device_count") => Some(DEVICES),
        ("PhantomDriverHeader", "segment_bytes") | (_, "driver_segment_bytes") => {
            Some(header.size_of("PhantomDriverSegment") as u64)
        }
        (_, "commander_segment_bytes") => Some(header.size_of("PhantomCommanderSegment") as u64),
        ("PhantomDriverHeader", "clock_mode" | "flags" | "ready") => Some(1),
        ("PhantomDriverHeader", "wait_mode") => Some(0),
        ("PhantomFrame", "state") => Some(header.number("PHANTOM_DRIVER_STATE_FAULT")),
        // The last one that this version knows: a stranger to the versions before.
        ("PhantomFrame", "fault") => Some(if minor == 0 { 5 } else { 10 }),
        ("PhantomRequest", "kind") => Some(header.number("PHANTOM_REQUEST_KIND_COMMAND")),
        ("PhantomAnswer", "verdict") => Some(header.number("PHANTOM_VERDICT_GRANTED")),
        _ => None,
    }
}

fn bytes_of(hex: &str) -> Vec<u8> {
    let pairs = (0..hex.len()).step_by(2).map(|at| &hex[at..at + 2]);
    pairs.map(|pair| u8::from_str_radix(pair, 16).unwrap()).collect()
}
