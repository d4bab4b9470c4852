//! Names of fingers and entities: they become columns and cells of a recording.
//!
//! Only letters, digits, `_` and `-` are allowed, so that no reader of the CSV needs quoting,
//! and each name is used once, so that no two columns are the same.

use std::collections::BTreeMap;

use crate::error::SceneError;
use crate::reader::{Table, Value, quoted};

/// The longest name, in characters (all are ASCII).
pub const MAX_NAME_BYTES: usize = 64;

/// The names given so far in one list, each with the byte offset where it was given.
#[derive(Debug, Default)]
pub(crate) struct Names {
    offset_of: BTreeMap<String, usize>,
}

impl Names {
    /// The name of `table`, or `default` if it has none.
    pub(crate) fn claim(&mut self, table: &Table<'_>, default: String) -> Result<String, SceneError> {
        let (name, offset, note) = match table.get("name") {
            Some(value) => (valid(&value)?, value.offset(), ""),
            None => (default, table.offset(), " (the default name)"),
        };
        match self.offset_of.insert(name.clone(), offset) {
            None => Ok(name),
            Some(first) => {
                let first_line = table.document().line(first);
                let found = format!("{}{note}", quoted(&name));
                Err(SceneError::Duplicate { at: table.at("name"), found, first_line })
            }
        }
    }
}

fn valid(value: &Value<'_>) -> Result<String, SceneError> {
    let name = value.text(&format!("1 to {MAX_NAME_BYTES} of the characters A-Z a-z 0-9 _ -"))?;
    let is_plain = |byte: u8| byte.is_ascii_alphanumeric() || byte == b'_' || byte == b'-';
    if name.len() <= MAX_NAME_BYTES && name.bytes().all(is_plain) {
        return Ok(name.into());
    }
    Err(SceneError::BadName { at: value.at(), found: quoted(name), limit_bytes: MAX_NAME_BYTES })
}
