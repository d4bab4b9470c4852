//! Every version of the contract that was published is told in CHANGELOG.md and can still be compiled against.

use crate::common::c_header::{CHeader, current_version, directory_of};
use crate::common::golden::STRUCTURES;
use shm_abi::LAYOUT_HASH;
use std::path::Path;

/// FNV-1a of the frozen headers. A header that differs is not the one that programs were built with.
const FROZEN: [(&str, &str, u64); 6] = [
    ("1.0", "phantom3_shm.h", 0x7fb6_3a4f_44fd_7728),
    ("1.0", "phantom3_client.h", 0x675e_36bc_1463_20f2),
    ("1.1", "phantom3_shm.h", 0x5af1_89fc_0cd6_e58f),
    ("1.1", "phantom3_client.h", 0x0f3f_2557_5fc7_8a8b),
    ("1.2", "phantom3_shm.h", 0xf28d_cf99_aaec_9e33),
    ("1.2", "phantom3_client.h", 0x0f3f_2557_5fc7_8a8b),
];

/// A row of the table: version, layout hash, what it added.
struct Row {
    version: String,
    major: u32,
    minor: u32,
    hash: String,
    added: String,
}

/// The rows of the table under the heading "Shared-memory contract", the oldest first.
fn rows() -> Vec<Row> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../CHANGELOG.md");
    let text = std::fs::read_to_string(path).unwrap();
    let (_, rest) = text.split_once("\n## Shared-memory contract\n").expect("the heading is there");
    let section = rest.split("\n## ").next().unwrap();
    let cells = |line: &str| -> Vec<String> {
        line.trim_matches('|').splitn(3, '|').map(|cell| cell.trim().to_string()).collect()
    };
    let table = section.lines().filter(|line| line.starts_with('|')).map(cells);
    table
        .filter_map(|row| {
            let [version, hash, added] = <[String; 3]>::try_from(row).ok()?;
            let (major, minor) = version.split_once('.')?;
            let (major, minor) = (major.parse().ok()?, minor.parse().ok()?);
            Some(Row { version, major, minor, hash, added })
        })
        .collect()
}

#[test]
fn the_version_and_the_layout_hash_in_force_are_the_last_that_are_listed() {
    let rows = rows();
    let last = rows.last().expect("a version is listed");
    assert_eq!(last.version, current_version());
    assert_eq!(last.hash, format!("0x{LAYOUT_HASH:016x}"));
}

#[test]
fn the_listed_versions_are_consecutive_and_a_minor_one_keeps_the_layout_hash() {
    let rows = rows();
    assert_eq!((rows[0].major, rows[0].minor), (1, 0), "the first");
    for pair in rows.windows(2) {
        let (before, after) = (&pair[0], &pair[1]);
        if after.major == before.major {
            assert_eq!(after.minor, before.minor + 1, "after {}", before.version);
            assert_eq!(after.hash, before.hash, "{} is a minor version", after.version);
        } else {
            assert_eq!((after.major, after.minor), (before.major + 1, 0), "after {}", before.version);
            assert_ne!(after.hash, before.hash, "{} is a major version", after.version);
        }
    }
}

#[test]
fn whatever_a_minor_version_added_is_named_in_its_row() {
    for pair in rows().windows(2).filter(|pair| pair[0].major == pair[1].major) {
        let (old, new) = (CHeader::of(&pair[0].version), CHeader::of(&pair[1].version));
        let named = |name: &str| {
            let short = name.trim_start_matches("PHANTOM_");
            assert!(pair[1].added.contains(short), "{}: {short} is not told", pair[1].version);
        };
        for structure in STRUCTURES {
            let known = old.leaves(structure);
            for leaf in new.leaves(structure).iter().filter(|leaf| !known.contains(leaf)) {
                named(leaf.path.rsplit('.').next().unwrap().split('[').next().unwrap());
            }
        }
        let known = old.constants();
        let is_new = |name: &str| !known.iter().any(|(old, _)| old == name);
        new.constants().iter().filter(|(name, _)| is_new(name)).for_each(|(name, _)| named(name));
    }
}

#[test]
fn a_frozen_header_never_changes() {
    for (version, file, expected) in FROZEN {
        let bytes = std::fs::read(directory_of(version).join(file)).unwrap();
        let hash = bytes.iter().fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| {
            (hash ^ u64::from(*byte)).wrapping_mul(0x0000_0100_0000_01b3)
        });
        assert!(
            hash == expected,
            "{file} of {version} has hash 0x{hash:016x}, recorded is 0x{expected:016x}: \
             programs were built with it, restore it"
        );
    }
}

#[test]
fn the_headers_of_every_older_version_are_frozen() {
    let rows = rows();
    for row in rows.iter().filter(|row| row.version != current_version()) {
        for file in ["phantom3_shm.h", "phantom3_client.h"] {
            let is_frozen = FROZEN.iter().any(|(version, name, _)| *version == row.version && *name == file);
            assert!(is_frozen, "copy {file} of {} to tests/frozen and record its hash", row.version);
        }
        let major = rows.last().unwrap().major;
        if row.major == major {
            assert_eq!(CHeader::of(&row.version).number("PHANTOM_LAYOUT_HASH"), LAYOUT_HASH);
        }
    }
}
