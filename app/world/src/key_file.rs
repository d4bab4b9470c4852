//! Files that say which keys do what (Melder 7.2.12): their form, not what a key is.
//!
//! ```toml
//! [keys]
//! exit = ["Escape", "Ctrl+Q"]
//! pause = "P"
//! record = []      # by no key
//! ```

use crate::document::{Document, LineEnds};
use crate::error::{Location, SceneError};
use crate::reader::{Table, Value};
use crate::source::read_text;
use crate::vocabulary::Vocabulary;
use std::path::Path;

/// What a file says of one action.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct KeyLine {
    /// The action's name.
    pub action: &'static str,
    /// Its keys, as they are written, and where.
    pub keys: Vec<(String, Location)>,
}

const ALLOWED: &str = "a key such as \"Ctrl+Q\", or an array of keys";

/// The lines of a file in which the keys of these actions may stand.
///
/// # Errors
/// The file cannot be read, or [`parse_key_lines`] refuses its text.
pub fn read_key_lines(file: &Path, actions: &'static [&'static str]) -> Result<Vec<KeyLine>, SceneError> {
    parse_key_lines(&read_text(file)?, file, actions)
}

/// The same of a text; `file` is named in errors, and not opened.
///
/// # Errors
/// The first thing found to be wrong, with its place and what is allowed there.
pub fn parse_key_lines(
    text: &str,
    file: &Path,
    actions: &'static [&'static str],
) -> Result<Vec<KeyLine>, SceneError> {
    let lines = LineEnds::of(text);
    let document = Document::new(text, &lines, file);
    let root = document.parse()?;
    let root = Table::root(document, &root);
    root.check_keys(&Vocabulary { available: &["keys"], later: &[] })?;
    let Some(keys) = root.get("keys") else { return Ok(Vec::new()) };
    let keys = keys.table("a table, [keys]")?;
    keys.check_keys(&Vocabulary { available: actions, later: &[] })?;
    let said = actions.iter().filter_map(|action| Some((*action, keys.get(action)?)));
    said.map(|(action, value)| Ok(KeyLine { action, keys: keys_of(&value)? })).collect()
}

fn keys_of(value: &Value<'_>) -> Result<Vec<(String, Location)>, SceneError> {
    let items = match (value.is_list(), value.length()) {
        (true, 0) => Vec::new(),
        (true, _) => value.items(ALLOWED)?,
        (false, _) => vec![value.clone()],
    };
    items.iter().map(|item| Ok((item.text(ALLOWED)?.to_owned(), *item.at()))).collect()
}
