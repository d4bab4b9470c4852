//! The layout of this laboratory: where `calibrate --write` puts it and a run with `--attach` finds it.

use std::io;
use std::path::PathBuf;
use thiserror::Error;
use world::{Layout, SceneError};

/// There is no home to keep a layout in.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("no place for the layout: neither $XDG_CONFIG_HOME nor $HOME is an absolute path; name a file")]
pub struct DefaultLayoutError;

/// `$XDG_CONFIG_HOME/phantom3/layout.toml`, or the same below `~/.config`.
///
/// # Errors
/// Neither variable holds an absolute path.
pub fn path() -> Result<PathBuf, DefaultLayoutError> {
    path_from(|name| std::env::var_os(name).map(PathBuf::from))
}

/// The layout there, and where that is; `None`: there is none.
///
/// # Errors
/// It is there, and cannot be read or is wrong.
pub fn load() -> Result<Option<(PathBuf, Layout)>, SceneError> {
    let Ok(path) = path() else { return Ok(None) };
    match Layout::load(&path) {
        Ok(layout) => Ok(Some((path, layout))),
        Err(SceneError::NotFound { .. }) => Ok(None),
        Err(SceneError::Unreadable { cause, .. }) if cause.kind() == io::ErrorKind::NotADirectory => Ok(None),
        Err(error) => Err(error),
    }
}

/// The XDG Base Directory Specification has relative paths ignored.
fn path_from(variable: impl Fn(&str) -> Option<PathBuf>) -> Result<PathBuf, DefaultLayoutError> {
    let absolute = |name: &str| variable(name).filter(|path| path.is_absolute());
    let config = absolute("XDG_CONFIG_HOME").or_else(|| Some(absolute("HOME")?.join(".config")));
    Ok(config.ok_or(DefaultLayoutError)?.join("phantom3/layout.toml"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn with(variables: &[(&str, &str)]) -> Result<PathBuf, DefaultLayoutError> {
        path_from(|name| variables.iter().find(|(n, _)| *n == name).map(|(_, value)| PathBuf::from(value)))
    }

    #[test]
    fn the_layout_lies_in_the_users_configuration() {
        let both = [("XDG_CONFIG_HOME", "/c"), ("HOME", "/h")];
        assert_eq!(with(&both), Ok("/c/phantom3/layout.toml".into()));
        assert_eq!(with(&both[1..]), Ok("/h/.config/phantom3/layout.toml".into()));
        assert_eq!(with(&[("XDG_CONFIG_HOME", "c"), both[1]]), Ok("/h/.config/phantom3/layout.toml".into()));
        assert_eq!(with(&[("HOME", "")]), Err(DefaultLayoutError));
    }
}
