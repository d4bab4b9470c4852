//! The scene list, `objects.ini` (Melder figure 7.2).

use super::ThesisError;
use rt_core::plain_text::quoted;
use std::path::Path;

/// A line of the list.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ListEntry {
    /// Counted from 1.
    pub line: usize,
    /// The first field.
    pub kind: ObjectKind,
    /// The second field: an object file, without the directory.
    pub object: String,
}

/// The kinds of entities that the thesis has (Melder figure 7.6).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ObjectKind {
    /// What moves, and what fingers touch.
    GameObject,
    /// What does not move: `Environment`, `EnvironmentMesh`, `EnvironmentEntity`.
    Environment,
    /// Several of these.
    EnvironmentMixed,
    /// A light.
    Light,
    /// A camera.
    Camera,
    /// A haptic device: `Phantom`, `RealPhantom`, `HapticDevice`, and for trials without one `PhantomPhantom`.
    Phantom,
}

impl ObjectKind {
    fn named(word: &str) -> Option<Self> {
        Some(match word {
            "GameObject" | "Object" => Self::GameObject,
            "Environment" | "EnvironmentMesh" | "EnvironmentEntity" => Self::Environment,
            "EnvironmentMixed" => Self::EnvironmentMixed,
            "Light" => Self::Light,
            "Camera" => Self::Camera,
            "Phantom" | "RealPhantom" | "PhantomPhantom" | "HapticDevice" => Self::Phantom,
            _ => return None,
        })
    }
}

/// Reads a scene list; `file` is named in errors and not opened.
///
/// # Errors
/// The first line that is none: a kind, a file, and perhaps a comment.
pub fn read_list(text: &str, file: &Path) -> Result<Vec<ListEntry>, ThesisError> {
    let lines = text.lines().enumerate().map(|(index, line)| (index + 1, without_comment(line)));
    lines.filter(|(_, words)| !words.is_empty()).map(|(line, words)| entry(line, words, file)).collect()
}

fn entry(line: usize, words: &str, file: &Path) -> Result<ListEntry, ThesisError> {
    let wrong = |found: String, allowed: &str| ThesisError::Line {
        file: file.into(),
        line,
        found,
        allowed: allowed.into(),
    };
    let mut fields = words.split_whitespace();
    let (Some(kind), Some(object), None) = (fields.next(), fields.next(), fields.next()) else {
        return Err(wrong(quoted(words), "a kind and an object file, such as `GameObject Mesh_01`"));
    };
    let kind = ObjectKind::named(kind).ok_or_else(|| wrong(quoted(kind), KINDS))?;
    if object.contains(char::is_control) {
        return Err(wrong(quoted(object), "the name of a file, without control characters"));
    }
    Ok(ListEntry { line, kind, object: object.into() })
}

/// What stands before `//`.
pub(super) fn without_comment(line: &str) -> &str {
    // Some editors put a mark in front of the first line.
    let line = line.trim_start_matches('\u{feff}');
    line.split_once("//").map_or(line, |(before, _)| before).trim()
}

const KINDS: &str =
    "Camera, Environment, EnvironmentMesh, EnvironmentMixed, EnvironmentEntity, Light, GameObject, Phantom";
