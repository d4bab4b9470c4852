//! The application's settings: which files hold, what the command line adds, and where data is looked for.
//!
//! Model: the system's file lies under the user's; a file that is named, by `--settings` or `$PHANTOM3_SETTINGS`, stands
//! for both. `--set` lies over all, and an option of a command over that.

use crate::outcome::RunFailure;
use crate::outputs::tell;
use clap::Args;
use std::borrow::Cow;
use std::io;
use std::path::{Path, PathBuf};
use world::{MeshSpec, Scene, SceneError, Settings, ShapeSpec};

/// Where settings come from, said at any command.
#[derive(Debug, Clone, Default, Args)]
pub struct SettingsArgs {
    /// Settings of this workplace (TOML), instead of the user's and the system's [env: PHANTOM3_SETTINGS]
    #[arg(long, global = true, value_name = "FILE")]
    settings: Option<PathBuf>,
    /// One setting, such as window.fullscreen=true; may be repeated
    #[arg(long, global = true, value_name = "KEY=VALUE")]
    set: Vec<String>,
}

const SYSTEM_FILE: &str = "/etc/phantom3/settings.toml";
const VARIABLE: &str = "PHANTOM3_SETTINGS";

impl SettingsArgs {
    /// Something is said on the command line.
    pub fn is_said(&self) -> bool {
        self.settings.is_some() || !self.set.is_empty()
    }

    /// The settings that hold.
    ///
    /// # Errors
    /// A file that is named and not there, or one that is wrong.
    pub fn load(&self) -> Result<Settings, RunFailure> {
        let wrong = |error: SceneError| RunFailure::Start(error.to_string());
        let variable = |name: &str| std::env::var_os(name).map(PathBuf::from);
        let mut settings = Settings::default();
        for (file, must_exist) in files(self.settings.as_deref(), variable) {
            settings = match settings.clone().with_file(&file) {
                Err(error) if !must_exist && is_absent(&error) => settings,
                with_file => with_file.map_err(wrong)?,
            };
        }
        self.set.iter().try_fold(settings, |settings, set| {
            settings.overlaid(&with_quotes(set), Path::new("--set")).map_err(wrong)
        })
    }
}

/// The setting with quotes around a text, which a shell has taken away.
fn with_quotes(set: &str) -> Cow<'_, str> {
    let Some((key, value)) = set.split_once('=') else { return set.into() };
    let text = value.trim();
    let begins_as_text = text.starts_with(|c: char| c.is_alphabetic() || matches!(c, '/' | '.' | '~'));
    let is_plain = !text.contains(['"', '\'', '\\', '#']) && !text.contains(char::is_control);
    let is_word = ["true", "false", "yes", "no", "on", "off"].contains(&text.to_lowercase().as_str());
    if !begins_as_text || !is_plain || is_word || text.parse::<f64>().is_ok() {
        return set.into();
    }
    // No shell does this behind an equals sign.
    let home = std::env::var("HOME").ok().filter(|home| !home.contains(['"', '\\']));
    let text = match (text.strip_prefix("~/"), home) {
        (Some(rest), Some(home)) => format!("{home}/{rest}"),
        _ => text.to_owned(),
    };
    format!("{key}=\"{text}\"").into()
}

/// Whether there is no such file, as far as may be seen; a part of its path may be none either.
fn is_absent(error: &SceneError) -> bool {
    match error {
        SceneError::NotFound { .. } => true,
        SceneError::Unreadable { cause, .. } => {
            matches!(cause.kind(), io::ErrorKind::NotADirectory | io::ErrorKind::PermissionDenied)
        }
        _ => false,
    }
}

/// The files, the lowest first, and whether they have to be there.
fn files(named: Option<&Path>, variable: impl Fn(&str) -> Option<PathBuf>) -> Vec<(PathBuf, bool)> {
    let is_said = |path: &PathBuf| !path.as_os_str().is_empty();
    if let Some(file) = named.map(Path::to_path_buf).or_else(|| variable(VARIABLE).filter(is_said)) {
        return vec![(file, true)];
    }
    // The XDG Base Directory Specification has relative paths ignored.
    let absolute = |name: &str| variable(name).filter(|path| path.is_absolute());
    let config = absolute("XDG_CONFIG_HOME").or_else(|| Some(absolute("HOME")?.join(".config")));
    let users = config.map(|config| (config.join("phantom3/settings.toml"), false));
    [(SYSTEM_FILE.into(), false)].into_iter().chain(users).collect()
}

/// Prints what holds, and who said so.
pub fn print(settings: &Settings) {
    let rows = settings.rows();
    let widest = rows.iter().map(|(_, value, ..)| value.chars().count()).max().unwrap_or(0).min(40);
    for (key, value, from, is_for_window) in rows {
        let note = if is_for_window { "  (for the window)" } else { "" };
        tell(&format_args!("{key:<24} {value:<widest$}  {from}{note}"), false);
    }
}

/// A file where it is said to be, or else in one of these directories.
pub fn find(path: &Path, directories: &[PathBuf]) -> PathBuf {
    if path.is_absolute() || path.exists() {
        return path.into();
    }
    let found = directories.iter().map(|directory| directory.join(path)).find(|path| path.exists());
    found.unwrap_or_else(|| path.into())
}

/// Looks for the scene's models, pictures and hand where the settings say, if they are not where the scene says.
pub fn find_data(scene: &mut Scene, scene_file: &Path, settings: &Settings) {
    if let Some(hand) = &mut scene.hand {
        find_beside(hand, scene_file, &settings.hands.value);
    }
    let directories = &settings.meshes.value;
    if directories.is_empty() {
        return;
    }
    for entity in &mut scene.entities {
        if let ShapeSpec::Mesh(spec) | ShapeSpec::Nurbs(spec) = &mut entity.shape {
            let MeshSpec { file, at, .. } = spec;
            find_beside(file, &at.file, directories);
        }
        if let Some(map) = &mut entity.height_map {
            find_beside(&mut map.file, &map.at.file, directories);
        }
    }
}

/// What was written in a file is relative to it.
fn find_beside(path: &mut PathBuf, written_in: &Path, directories: &[PathBuf]) {
    let beside = written_in.parent().unwrap_or(Path::new(""));
    if path.exists() {
        return;
    }
    if let Ok(written) = path.strip_prefix(beside)
        && let Some(found) =
            directories.iter().map(|directory| directory.join(written)).find(|path| path.exists())
    {
        *path = found;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(named: Option<&str>, variables: &[(&str, &str)]) -> Vec<(String, bool)> {
        let variable =
            |name: &str| variables.iter().find(|(n, _)| *n == name).map(|(_, value)| PathBuf::from(value));
        let files = files(named.map(Path::new), variable);
        files.into_iter().map(|(file, must_exist)| (file.display().to_string(), must_exist)).collect()
    }

    #[test]
    fn a_file_that_is_named_stands_for_all_others() {
        let variables = [("PHANTOM3_SETTINGS", "v.toml"), ("HOME", "/h")];
        assert_eq!(found(Some("a.toml"), &variables), [("a.toml".to_owned(), true)]);
        assert_eq!(found(None, &variables), [("v.toml".to_owned(), true)]);
        let users = ("/h/.config/phantom3/settings.toml".to_owned(), false);
        let both = vec![(SYSTEM_FILE.to_owned(), false), users];
        assert_eq!(found(None, &variables[1..]), both, "the user's lies over the system's");
        assert_eq!(found(None, &[("PHANTOM3_SETTINGS", ""), variables[1]]), both);
        assert_eq!(found(None, &[("XDG_CONFIG_HOME", "c")]), both[..1]);
    }

    #[test]
    fn what_the_command_line_sets_lies_over_files() {
        let args = SettingsArgs { settings: None, set: vec!["window.shadows=false".into()] };
        let settings = args.load().expect("built in, at least");
        assert!(!settings.shadows.value);
        assert_eq!(settings.shadows.from.to_string(), "--set:1");
        // As `--set driver.socket="/run/a b.sock"` arrives from a shell.
        let args = SettingsArgs { set: vec!["driver.socket=/run/a b.sock".into()], ..args };
        let socket = args.load().expect("a text").driver_socket.value;
        assert_eq!(socket.as_deref(), Some(Path::new("/run/a b.sock")));
        let args = SettingsArgs { set: vec!["window.shadows=True".into()], ..args };
        assert!(args.load().expect_err("no TOML").to_string().ends_with("allowed: true, in small letters"));
        let args = SettingsArgs { set: vec!["window.shadow=false".into()], ..args };
        let said = args.load().expect_err("no such key").to_string();
        assert!(said.starts_with("--set:1: window.shadow: unknown key (did you mean `shadows`?)"), "{said}");
    }
}
