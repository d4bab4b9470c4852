//! Names of what a scene has: those of fingers and entities become columns and cells of a recording.
//!
//! Only letters, digits, `_` and `-` are allowed, so that no reader of the CSV needs quoting,
//! and each name is used once, in all files of a scene, so that no two columns are the same.

use std::collections::BTreeMap;

use crate::document::Document;
use crate::error::SceneError;
use crate::reader::{Table, Value};
use rt_core::plain_text::quoted;

/// The longest name, in characters (all are ASCII).
pub const MAX_NAME_BYTES: usize = 64;

/// The names given so far in one list, each with the place where it was given.
#[derive(Debug, Default)]
pub(crate) struct Names<'d> {
    given: BTreeMap<String, (Document<'d>, usize)>,
}

impl<'d> Names<'d> {
    /// The name of `table`, or `default` if it has none.
    pub(crate) fn claim(&mut self, table: &Table<'d>, default: String) -> Result<String, SceneError> {
        let name = name_of(table)?;
        let note = if name.is_some() { "" } else { " (the default name)" };
        self.take(table, name.unwrap_or(default), note)
    }

    /// The name of `table`, which must have one.
    pub(crate) fn claim_written(&mut self, table: &Table<'d>, allowed: &str) -> Result<String, SceneError> {
        match name_of(table)? {
            Some(name) => self.take(table, name, ""),
            None => Err(table.missing("name", allowed)),
        }
    }

    /// A name that was made from that of `table`; `note` says how.
    pub(crate) fn claim_made(
        &mut self,
        table: &Table<'d>,
        name: String,
        note: &str,
    ) -> Result<String, SceneError> {
        if name.len() > MAX_NAME_BYTES {
            let found = format!("{}{note}", quoted(&name));
            return Err(SceneError::BadName { at: table.at("name"), found, limit_bytes: MAX_NAME_BYTES });
        }
        self.take(table, name, note)
    }

    /// Whether somebody is called so.
    pub(crate) fn has(&self, name: &str) -> bool {
        self.given.contains_key(name)
    }

    /// All of them.
    pub(crate) fn all(&self) -> impl Iterator<Item = &str> {
        self.given.keys().map(String::as_str)
    }

    fn take(&mut self, table: &Table<'d>, name: String, note: &str) -> Result<String, SceneError> {
        let (document, offset) = match table.own("name") {
            Some(value) => (*value.document(), value.offset()),
            None => (*table.document(), table.offset()),
        };
        match self.given.insert(name.clone(), (document, offset)) {
            None => Ok(name),
            Some((of_first, first)) => {
                let first = document.seen_from_here(&of_first, first);
                let found = format!("{}{note}", quoted(&name));
                Err(SceneError::Duplicate { at: table.at("name"), found, first })
            }
        }
    }
}

/// The name that stands in this very table: that of a template is not its entities'.
pub(crate) fn name_of(table: &Table<'_>) -> Result<Option<String>, SceneError> {
    table.own("name").map(|value| valid(&value)).transpose()
}

/// Whether a scene may call something so.
pub fn is_name(text: &str) -> bool {
    let is_plain = |byte: u8| byte.is_ascii_alphanumeric() || byte == b'_' || byte == b'-';
    (1..=MAX_NAME_BYTES).contains(&text.len()) && text.bytes().all(is_plain)
}

fn valid(value: &Value<'_>) -> Result<String, SceneError> {
    let name = value.text(&format!("1 to {MAX_NAME_BYTES} of the characters A-Z a-z 0-9 _ -"))?;
    if is_name(name) {
        return Ok(name.into());
    }
    Err(SceneError::BadName { at: value.at(), found: quoted(name), limit_bytes: MAX_NAME_BYTES })
}
