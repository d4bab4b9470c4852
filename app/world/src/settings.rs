//! The application's settings (Melder 7.2.3.1): what belongs to a workplace and not to a scene.
//!
//! ```toml
//! [window]
//! size_px = [1280, 800]
//! [data]
//! meshes = ["/srv/meshes"]
//! ```
//! Model: files are laid over each other and over what is built in; of each value it is known where it came from. Paths
//! are relative to the file that they stand in. `window`, `stereo` and `input` are for the window.

use crate::document::{Document, LineEnds};
use crate::error::SceneError;
use crate::reader::{Bound, Table, Value};
use crate::source::read_text;
use crate::vocabulary::Vocabulary;
use std::fmt;
use std::path::{Path, PathBuf};

/// All settings.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// Width and height of the window (pixels).
    pub window_size_px: Set<[u32; 2]>,
    /// Where its upper left corner is (pixels); `None`: the desktop says.
    pub window_position_px: Set<Option<[i32; 2]>>,
    /// Whether it fills the screen.
    pub fullscreen: Set<bool>,
    /// Whether shadows are drawn.
    pub shadows: Set<bool>,
    /// How two eyes are served.
    pub stereo_mode: Set<StereoMode>,
    /// Between the eyes (m).
    pub eye_separation_m: Set<f64>,
    /// How far away both pictures agree (m).
    pub convergence_m: Set<f64>,
    /// The file that says which keys do what; `None`: what is built in.
    pub bindings: Set<Option<PathBuf>>,
    /// Where scenes are looked for that are not where they are said to be.
    pub scenes: Set<Vec<PathBuf>>,
    /// Where meshes, patches and pictures are.
    pub meshes: Set<Vec<PathBuf>>,
    /// Where hand files are.
    pub hands: Set<Vec<PathBuf>>,
    /// The driver's socket; `None`: the usual place.
    pub driver_socket: Set<Option<PathBuf>>,
    /// The configuration of a driver that is started for the window; `None`: as the scene needs it.
    pub driver_configuration: Set<Option<PathBuf>>,
    /// What moves time if a run does not say: real, virtual or lockstep.
    pub clock: Set<&'static str>,
    /// Where what is not named otherwise is recorded; `None`: where one is.
    pub recording_directory: Set<Option<PathBuf>>,
    /// The files that were read, the lowest first.
    pub files: Vec<PathBuf>,
}

/// A value, and who set it.
#[derive(Debug, Clone, PartialEq)]
pub struct Set<T> {
    /// The value.
    pub value: T,
    /// Who set it.
    pub from: Origin,
}

/// Who set a value.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Origin {
    /// The program.
    BuiltIn,
    /// A line of a file, or of what stands in a file's place.
    Line(PathBuf, usize),
}

impl fmt::Display for Origin {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::BuiltIn => out.write_str("built in"),
            Self::Line(file, line) => write!(out, "{}:{line}", file.display()),
        }
    }
}

/// How two eyes are served.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StereoMode {
    /// One picture for both.
    Off,
    /// Beside each other.
    SideBySide,
    /// Above each other.
    TopBottom,
    /// Red and cyan.
    Anaglyph,
    /// One after the other, for shutter glasses.
    QuadBuffer,
}

impl StereoMode {
    const ALL: [(&'static str, Self); 5] = [
        ("off", Self::Off),
        ("side-by-side", Self::SideBySide),
        ("top-bottom", Self::TopBottom),
        ("anaglyph", Self::Anaglyph),
        ("quad-buffer", Self::QuadBuffer),
    ];

    /// Its name in a file.
    pub fn name(self) -> &'static str {
        Self::ALL.iter().find(|(_, mode)| *mode == self).map_or("off", |(name, _)| name)
    }
}

impl Default for Settings {
    fn default() -> Self {
        fn set<T>(value: T) -> Set<T> {
            Set { value, from: Origin::BuiltIn }
        }
        Self {
            window_size_px: set([1280, 800]),
            window_position_px: set(None),
            fullscreen: set(false),
            shadows: set(true),
            stereo_mode: set(StereoMode::Off),
            eye_separation_m: set(0.063),
            convergence_m: set(0.6),
            bindings: set(None),
            scenes: set(Vec::new()),
            meshes: set(Vec::new()),
            hands: set(Vec::new()),
            driver_socket: set(None),
            driver_configuration: set(None),
            clock: set("real"),
            recording_directory: set(None),
            files: Vec::new(),
        }
    }
}

impl Settings {
    /// These, with what a file says.
    ///
    /// # Errors
    /// The file cannot be read, or [`Settings::overlaid`] refuses its text.
    pub fn with_file(self, path: &Path) -> Result<Self, SceneError> {
        let mut with = self.overlaid(&read_text(path)?, path)?;
        with.files.push(path.into());
        Ok(with)
    }

    /// All files that they consist of or name, into which nothing is written.
    pub fn input_files(&self) -> impl Iterator<Item = PathBuf> {
        let named = [&self.bindings.value, &self.driver_configuration.value];
        self.files.iter().chain(named.into_iter().flatten()).cloned()
    }

    /// These, with what `text` says; `file` is named in errors and as the origin, and not opened.
    ///
    /// # Errors
    /// The first thing found to be wrong, with its place and what is allowed there.
    pub fn overlaid(mut self, text: &str, file: &Path) -> Result<Self, SceneError> {
        let lines = LineEnds::of(text);
        let document = Document::new(text, &lines, file);
        let root = document.parse()?;
        let root = Table::root(document, &root);
        root.check_keys(&TABLES)?;
        let table = |name: &str, keys: &Vocabulary| -> Result<Option<Table<'_>>, SceneError> {
            let Some(value) = root.get(name) else { return Ok(None) };
            let table = value.table(&format!("a table, [{name}]"))?;
            table.check_keys(keys)?;
            Ok(Some(table))
        };
        if let Some(window) = table("window", &WINDOW_KEYS)? {
            take(&window, "size_px", &mut self.window_size_px, read_size)?;
            take(&window, "position_px", &mut self.window_position_px, |value| {
                read_position(value).map(Some)
            })?;
            take(&window, "fullscreen", &mut self.fullscreen, read_truth)?;
            take(&window, "shadows", &mut self.shadows, read_truth)?;
        }
        if let Some(stereo) = table("stereo", &STEREO_KEYS)? {
            take(&stereo, "mode", &mut self.stereo_mode, read_mode)?;
            take(&stereo, "eye_separation_m", &mut self.eye_separation_m, |value| {
                value.number(Bound::NotNegative)
            })?;
            take(&stereo, "convergence_m", &mut self.convergence_m, |value| value.number(Bound::Positive))?;
        }
        if let Some(input) = table("input", &INPUT_KEYS)? {
            let file = |value: &Value<'_>| value.file("a file of keys (TOML)").map(Some);
            take(&input, "bindings", &mut self.bindings, file)?;
        }
        if let Some(data) = table("data", &DATA_KEYS)? {
            take(&data, "scenes", &mut self.scenes, read_directories)?;
            take(&data, "meshes", &mut self.meshes, read_directories)?;
            take(&data, "hands", &mut self.hands, read_directories)?;
        }
        if let Some(driver) = table("driver", &DRIVER_KEYS)? {
            take(&driver, "socket", &mut self.driver_socket, |value| {
                value.file("a socket's path").map(Some)
            })?;
            let configuration = |value: &Value<'_>| value.file("a driver's configuration (TOML)").map(Some);
            take(&driver, "configuration", &mut self.driver_configuration, configuration)?;
            take(&driver, "clock", &mut self.clock, |value| value.choose("clock", &CLOCKS))?;
        }
        if let Some(recording) = table("recording", &RECORDING_KEYS)? {
            let directory = |value: &Value<'_>| value.file("a directory").map(Some);
            take(&recording, "directory", &mut self.recording_directory, directory)?;
        }
        Ok(self)
    }

    /// Key, value and origin of each, in the order of the documentation, and whether it is for the window.
    pub fn rows(&self) -> Vec<(&'static str, String, &Origin, bool)> {
        fn row<'s, T>(
            key: &'static str,
            set: &'s Set<T>,
            shown: impl Fn(&T) -> String,
        ) -> (&'static str, String, &'s Origin, bool) {
            let is_for_window = ["window", "stereo", "input", "driver.configuration"]
                .iter()
                .any(|table| key.starts_with(table));
            (key, shown(&set.value), &set.from, is_for_window)
        }
        let path = |path: &Option<PathBuf>| {
            path.as_ref()
                .map_or_else(|| "(usual)".to_owned(), |path| format!("{:?}", path.display().to_string()))
        };
        let paths = |paths: &Vec<PathBuf>| {
            format!("{:?}", paths.iter().map(|path| path.display().to_string()).collect::<Vec<_>>())
        };
        vec![
            row("window.size_px", &self.window_size_px, |size| format!("{size:?}")),
            row("window.position_px", &self.window_position_px, |place| {
                place.map_or_else(|| "(usual)".into(), |place| format!("{place:?}"))
            }),
            row("window.fullscreen", &self.fullscreen, bool::to_string),
            row("window.shadows", &self.shadows, bool::to_string),
            row("stereo.mode", &self.stereo_mode, |mode| format!("{:?}", mode.name())),
            row("stereo.eye_separation_m", &self.eye_separation_m, f64::to_string),
            row("stereo.convergence_m", &self.convergence_m, f64::to_string),
            row("input.bindings", &self.bindings, path),
            row("data.scenes", &self.scenes, paths),
            row("data.meshes", &self.meshes, paths),
            row("data.hands", &self.hands, paths),
            row("driver.socket", &self.driver_socket, path),
            row("driver.configuration", &self.driver_configuration, path),
            row("driver.clock", &self.clock, |clock| format!("{clock:?}")),
            row("recording.directory", &self.recording_directory, path),
        ]
    }
}

/// Takes a value over, if the table has one.
fn take<T>(
    table: &Table<'_>,
    key: &str,
    set: &mut Set<T>,
    read: impl Fn(&Value<'_>) -> Result<T, SceneError>,
) -> Result<(), SceneError> {
    let Some(value) = table.get(key) else { return Ok(()) };
    let at = value.at();
    *set = Set { value: read(&value)?, from: Origin::Line(at.file, at.line) };
    Ok(())
}

fn read_truth(value: &Value<'_>) -> Result<bool, SceneError> {
    value.truth()
}

fn read_size(value: &Value<'_>) -> Result<[u32; 2], SceneError> {
    let allowed = "an array of 2 whole numbers from 64 to 16384, width and height";
    let size = value.numbers::<2>()?;
    let fits = |pixels: &f64| pixels.fract() == 0.0 && (64.0..=16384.0).contains(pixels);
    if size.iter().all(fits) {
        Ok(size.map(|pixels| pixels as u32))
    } else {
        Err(value.out_of_range(allowed))
    }
}

fn read_position(value: &Value<'_>) -> Result<[i32; 2], SceneError> {
    let allowed = "an array of 2 whole numbers from -32768 to 32767";
    let place = value.numbers::<2>()?;
    let fits = |pixels: &f64| pixels.fract() == 0.0 && (-32768.0..=32767.0).contains(pixels);
    if place.iter().all(fits) {
        Ok(place.map(|pixels| pixels as i32))
    } else {
        Err(value.out_of_range(allowed))
    }
}

fn read_mode(value: &Value<'_>) -> Result<StereoMode, SceneError> {
    let word = value.choose("stereo mode", &MODES)?;
    let mode = StereoMode::ALL.iter().find(|(name, _)| *name == word);
    Ok(mode.map_or(StereoMode::Off, |(_, mode)| *mode))
}

fn read_directories(value: &Value<'_>) -> Result<Vec<PathBuf>, SceneError> {
    let allowed = "an array of directories, relative to this file";
    value.items(allowed)?.iter().map(|item| item.file(allowed)).collect()
}

const fn words(available: &'static [&'static str]) -> Vocabulary {
    Vocabulary { available, later: &[] }
}

const TABLES: Vocabulary = words(&["window", "stereo", "input", "data", "driver", "recording"]);
const WINDOW_KEYS: Vocabulary = words(&["size_px", "position_px", "fullscreen", "shadows"]);
const STEREO_KEYS: Vocabulary = words(&["mode", "eye_separation_m", "convergence_m"]);
const INPUT_KEYS: Vocabulary = words(&["bindings"]);
const DATA_KEYS: Vocabulary = words(&["scenes", "meshes", "hands"]);
const DRIVER_KEYS: Vocabulary = words(&["socket", "configuration", "clock"]);
const RECORDING_KEYS: Vocabulary = words(&["directory"]);
const CLOCKS: Vocabulary = words(&["real", "virtual", "lockstep"]);
const MODES: Vocabulary = words(&["off", "side-by-side", "top-bottom", "anaglyph", "quad-buffer"]);
