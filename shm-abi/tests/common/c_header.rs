//! What a C header of the contract says: its structures, asserted offsets and constants.
//!
//! For the old versions this is the only definition there is: nothing here looks at the Rust types.

use std::path::{Path, PathBuf};

/// A header, as text.
pub(crate) struct CHeader(String);

/// One number in a structure, however deep.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Leaf {
    /// As C names it: `devices[1].flags`.
    pub(crate) path: String,
    /// From the structure's start (bytes).
    pub(crate) offset: usize,
    /// The C type.
    pub(crate) c_type: String,
}

impl CHeader {
    /// The one in `include`, or of an older version in `tests/frozen`.
    pub(crate) fn of(version: &str) -> Self {
        Self(std::fs::read_to_string(directory_of(version).join("phantom3_shm.h")).unwrap())
    }

    /// Every constant and enumerator with its value, in the header's order.
    pub(crate) fn constants(&self) -> Vec<(String, String)> {
        let define = |line: &str| {
            let (name, value) = line.strip_prefix("#define ")?.split_once(' ')?;
            (!name.contains('(')).then(|| (name.to_string(), value.to_string()))
        };
        let enumerator = |line: &str| {
            let (name, value) = line.strip_prefix("  PHANTOM_")?.strip_suffix(',')?.split_once(" = ")?;
            Some((format!("PHANTOM_{name}"), value.to_string()))
        };
        self.0.lines().filter_map(|line| define(line).or_else(|| enumerator(line))).collect()
    }

    /// The number behind a constant.
    pub(crate) fn number(&self, name: &str) -> u64 {
        let (_, value) = self.constants().into_iter().find(|(known, _)| known == name).unwrap();
        let digits = value.trim_start_matches("UINT64_C(").trim_end_matches(')');
        match digits.strip_prefix("0x") {
            Some(hex) => u64::from_str_radix(hex, 16).unwrap(),
            None => digits.parse().unwrap(),
        }
    }

    /// Bytes of a structure.
    pub(crate) fn size_of(&self, structure: &str) -> usize {
        self.asserted(&format!("sizeof({structure})"))
    }

    /// Where a field lies in a structure (bytes).
    pub(crate) fn offset_of(&self, structure: &str, field: &str) -> usize {
        self.asserted(&format!("offsetof({structure}, {field})"))
    }

    /// Every number in a structure, but for the words that mean nothing yet.
    pub(crate) fn leaves(&self, structure: &str) -> Vec<Leaf> {
        let mut leaves = Vec::new();
        for (c_type, field, count) in self.fields(structure) {
            if matches!(field.as_str(), "reserved" | "padding") {
                continue;
            }
            let start = self.offset_of(structure, &field);
            for index in 0..count.unwrap_or(1) {
                let path = if count.is_some() { format!("{field}[{index}]") } else { field.clone() };
                match elementary_size(&c_type) {
                    Some(size) => {
                        leaves.push(Leaf { path, offset: start + index * size, c_type: c_type.clone() });
                    }
                    None => {
                        let base = start + index * self.size_of(&c_type);
                        leaves.extend(self.leaves(&c_type).into_iter().map(|leaf| Leaf {
                            path: format!("{path}.{}", leaf.path),
                            offset: base + leaf.offset,
                            ..leaf
                        }));
                    }
                }
            }
        }
        leaves
    }

    /// Type, name and number of elements of each field.
    fn fields(&self, structure: &str) -> Vec<(String, String, Option<usize>)> {
        let (before, _) = self.0.split_once(&format!("\n}} {structure};")).unwrap();
        let (_, body) = before.rsplit_once(&format!(" {structure} {{\n")).unwrap();
        let declarations = body.lines().map(str::trim).filter(|line| !line.starts_with("//"));
        declarations
            .map(|line| {
                let line = line.trim_start_matches("struct ").trim_end_matches(';');
                let (c_type, declared) = line.split_once(' ').unwrap();
                match declared.split_once('[') {
                    Some((name, count)) => {
                        let count = count.trim_end_matches(']');
                        let count = count.parse().unwrap_or_else(|_| self.number(count) as usize);
                        (c_type.into(), name.into(), Some(count))
                    }
                    None => (c_type.into(), declared.into(), None),
                }
            })
            .collect()
    }

    fn asserted(&self, what: &str) -> usize {
        let start = format!("PHANTOM_ASSERT({what} == ");
        let line =
            self.0.lines().find_map(|line| line.strip_prefix(&start)).unwrap_or_else(|| panic!("{what}"));
        line.trim_end_matches(");").parse().unwrap()
    }
}

/// The version of the headers in `include`.
pub(crate) fn current_version() -> String {
    shm_abi::handshake::own_version_text()
}

/// Where a version's headers lie.
pub(crate) fn directory_of(version: &str) -> PathBuf {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    if version == current_version() { root.join("include") } else { root.join("tests/frozen").join(version) }
}

fn elementary_size(c_type: &str) -> Option<usize> {
    match c_type {
        "uint8_t" => Some(1),
        "uint32_t" => Some(4),
        "uint64_t" | "int64_t" | "double" => Some(8),
        _ => None,
    }
}
