//! A scene's file and those that it includes.
//!
//! ```toml
//! include = ["room.toml", "things/cups.toml"]     # relative to the file that says so
//! ```
//! An included file adds templates, entities, environments, lights and cameras. Each file comes once: what is meant to
//! stand in a scene twice is a template.

use std::path::{Path, PathBuf};

use toml::Spanned;
use toml::de::DeTable;

use crate::document::{Document, LineEnds};
use crate::error::{Location, SceneError};
use crate::problems::Problems;
use crate::reader::{Table, Value};
use crate::source::{MAX_FILE_BYTES, read_text};

/// How many files may include each other in turn.
pub const MAX_INCLUDE_DEPTH: usize = 8;
/// Of how many files a scene may consist.
pub const MAX_FILES: usize = 256;
/// The most that the files of a scene may have together, as many as four of the largest.
pub const MAX_SCENE_BYTES: u64 = 4 * MAX_FILE_BYTES;

/// The files' texts; the scene's own comes first, then what it includes, each followed by what that includes.
#[derive(Debug)]
pub(crate) struct Sources(Vec<Source>);

/// A file and its text.
#[derive(Debug)]
struct Source {
    file: PathBuf,
    text: String,
    lines: LineEnds,
    /// Where it is included; `None`: the scene itself.
    included_at: Option<Box<Location>>,
}

impl Source {
    fn document(&self) -> Document<'_> {
        Document::new(&self.text, &self.lines, &self.file)
    }
}

impl Sources {
    /// The scene's text and all that it includes; an included file that cannot be had is noted.
    pub(crate) fn gather(text: &str, file: &Path, problems: &mut Problems) -> Self {
        let mut sources = Self(Vec::new());
        sources.add(text.to_owned(), file.to_owned(), None, 0, problems);
        sources
    }

    /// The texts as documents.
    pub(crate) fn documents(&self) -> impl Iterator<Item = Document<'_>> {
        self.0.iter().map(Source::document)
    }

    /// The names of the included files.
    pub(crate) fn included(&self) -> Vec<PathBuf> {
        self.0.iter().skip(1).map(|source| source.file.clone()).collect()
    }

    fn add(
        &mut self,
        text: String,
        file: PathBuf,
        included_at: Option<Box<Location>>,
        depth: usize,
        problems: &mut Problems,
    ) {
        let lines = LineEnds::of(&text);
        let source = Source { file, text, lines, included_at };
        let wanted = includes_of(&source, problems);
        self.0.push(source);
        for (at, file) in wanted {
            if let Some(text) = problems.keep(self.open(&at, &file, depth)) {
                self.add(text, file, Some(at), depth + 1, problems);
            }
        }
    }

    /// The text of a file that is not there yet.
    fn open(&self, at: &Location, file: &Path, depth: usize) -> Result<String, SceneError> {
        let at = || Box::new(at.clone());
        if depth >= MAX_INCLUDE_DEPTH {
            return Err(SceneError::IncludedTooDeep { at: at(), limit: MAX_INCLUDE_DEPTH });
        }
        if self.0.len() >= MAX_FILES {
            return Err(SceneError::TooMany { at: at(), found: self.0.len() + 1, limit: MAX_FILES });
        }
        if let Some(first) = self.0.iter().find(|source| is_same(&source.file, file)) {
            let first = match &first.included_at {
                None => "the scene itself".to_owned(),
                Some(at) => format!("included by {}:{} already", at.file.display(), at.line),
            };
            return Err(SceneError::IncludedTwice { at: at(), file: file.into(), first });
        }
        let text =
            read_text(file).map_err(|source| SceneError::Included { at: at(), source: Box::new(source) })?;
        let before: usize = self.0.iter().map(|source| source.text.len()).sum();
        if (before + text.len()) as u64 > MAX_SCENE_BYTES {
            return Err(SceneError::IncludedTooLarge { at: at(), limit_bytes: MAX_SCENE_BYTES });
        }
        Ok(text)
    }
}

/// What a file includes. What else is wrong with it is found when it is read.
fn includes_of(source: &Source, problems: &mut Problems) -> Vec<(Box<Location>, PathBuf)> {
    // Most files include nothing, and are taken apart once.
    if !source.text.contains("include") {
        return Vec::new();
    }
    let document = source.document();
    let Ok(root) = document.parse() else { return Vec::new() };
    problems.keep(read_includes(&document, &root)).unwrap_or_default()
}

fn read_includes<'d>(
    document: &Document<'d>,
    root: &'d Spanned<DeTable<'d>>,
) -> Result<Vec<(Box<Location>, PathBuf)>, SceneError> {
    let Some(list) = Table::root(*document, root).get("include") else { return Ok(Vec::new()) };
    let place = |value: &Value<'_>| Ok((value.at(), value.file(ALLOWED)?));
    list.items(ALLOWED)?.iter().map(place).collect()
}

/// Whether two names lead to one file.
fn is_same(a: &Path, b: &Path) -> bool {
    a == b || matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b)
}

const ALLOWED: &str = "an array of paths of TOML files, relative to this file";
