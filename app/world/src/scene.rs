//! The scene: everything a run starts with.

use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use nalgebra::Vector3;

use crate::MAX_DEVICES;
use crate::camera::SceneCamera;
use crate::document::Document;
use crate::dynamics::DynamicsSpec;
use crate::entity::SceneEntity;
use crate::environment::SceneEnvironment;
use crate::error::SceneError;
use crate::field::FieldSpec;
use crate::finger::SceneFinger;
use crate::guide::GuideSpec;
use crate::light::SceneLight;
use crate::problems::Problems;
use crate::reader::{Table, Value};
use crate::source::read_text;
use crate::sources::Sources;
use crate::templates::SceneTemplate;
use crate::things::Things;
use crate::vocabulary::Vocabulary;

/// A validated scene. Plain data; the order of the lists is that of the file, and then of those that it includes.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    /// Shown to people; default the file's name without its ending.
    pub name: String,
    /// World frame; default [`Scene::DEFAULT_GRAVITY_M_S2`].
    pub gravity_m_s2: Vector3<f64>,
    /// How what moves is computed.
    pub dynamics: DynamicsSpec,
    /// The hand file that drives the fingers, made relative to where the scene file is.
    pub hand: Option<PathBuf>,
    /// 1 to [`MAX_DEVICES`](crate::MAX_DEVICES) of them.
    pub fingers: Vec<SceneFinger>,
    /// May be empty.
    pub entities: Vec<SceneEntity>,
    /// Force fields; may be empty.
    pub fields: Vec<FieldSpec>,
    /// Guides; may be empty.
    pub guides: Vec<GuideSpec>,
    /// What it takes place in; their parts are among the entities. May be empty.
    pub environments: Vec<SceneEnvironment>,
    /// For the window; may be empty.
    pub lights: Vec<SceneLight>,
    /// For the window; may be empty.
    pub cameras: Vec<SceneCamera>,
    /// What entities are made from, in order of their names.
    pub templates: Vec<SceneTemplate>,
    /// The files that it includes, in the order in which they were read.
    pub included: Vec<PathBuf>,
    /// Text of its own file.
    pub text: SceneText,
}

/// The text of a scene's file, as the scene was made of it. It says nothing that the scene does not: all are equal.
#[derive(Clone, Default)]
pub struct SceneText(Arc<str>);

impl SceneText {
    /// The text.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl PartialEq for SceneText {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

impl fmt::Debug for SceneText {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} bytes", self.0.len())
    }
}

impl Scene {
    /// Gravity of a scene that gives none: y is up.
    pub const DEFAULT_GRAVITY_M_S2: [f64; 3] = [0.0, -9.81, 0.0];

    /// Reads the scene file `path` and those that it includes.
    ///
    /// # Errors
    /// A file cannot be read, is too large or not UTF-8, or [`Scene::parse`] refuses its text.
    pub fn load(path: impl AsRef<Path>) -> Result<Self, SceneError> {
        let path = path.as_ref();
        Self::parse(&read_text(path)?, path)
    }

    /// Reads a scene from `text`. `file` is named in errors and is what other files are relative to; it is not opened
    /// itself, and no other but those that the text includes.
    ///
    /// # Errors
    /// The first thing found to be wrong, with its place and what is allowed there.
    pub fn parse(text: &str, file: &Path) -> Result<Self, SceneError> {
        let none = || SceneError::NoFinger { file: file.into(), limit: MAX_DEVICES };
        Self::examine(text, file).map_err(|problems| problems.into_iter().next().unwrap_or_else(none))
    }

    /// As [`Scene::load`], but tells all that is wrong, up to a hundred things.
    ///
    /// # Errors
    /// In the order in which they were found, at least one.
    pub fn load_whole(path: impl AsRef<Path>) -> Result<Self, Vec<SceneError>> {
        let path = path.as_ref();
        let text = read_text(path).map_err(|problem| vec![problem])?;
        Self::examine(&text, path)
    }

    /// As [`Scene::parse`], but tells all that is wrong, up to a hundred things.
    ///
    /// # Errors
    /// In the order in which they were found, at least one.
    pub fn examine(text: &str, file: &Path) -> Result<Self, Vec<SceneError>> {
        let mut problems = Problems::default();
        let sources = Sources::gather(text, file, &mut problems);
        let documents: Vec<Document<'_>> = sources.documents().collect();
        let roots: Vec<_> = documents.iter().filter_map(|document| problems.keep(document.parse())).collect();
        let mut scene = None;
        if roots.len() == documents.len() {
            let tables = documents.iter().zip(&roots).map(|(document, root)| Table::root(*document, root));
            let tables: Vec<Table<'_>> = tables.collect();
            scene = Self::read(&tables, &mut problems);
        }
        let problems = problems.all();
        match scene {
            Some(scene) if problems.is_empty() => {
                Ok(Self { included: sources.included(), text: SceneText(text.into()), ..scene })
            }
            _ => Err(problems),
        }
    }

    /// Reads the files of a scene, its own first.
    fn read<'d>(tables: &[Table<'d>], problems: &mut Problems) -> Option<Self> {
        let (table, included) = tables.split_first()?;
        let file = table.document().file();
        if let Some(other) = of_another_kind(table) {
            problems.note(other);
            return None;
        }
        problems.keys(table, &KEYS);
        included.iter().for_each(|table| refuse_what_is_the_scenes(table, problems));
        let name = problems.keep(read_name(table, file));
        let gravity = problems.keep(table.numbers_or("gravity_m_s2", Self::DEFAULT_GRAVITY_M_S2));
        let dynamics = problems.keep(DynamicsSpec::read(table));
        let hand = problems.keep(read_hand(table));
        let fingers = SceneFinger::read_all(table, problems);
        let things = Things::read(tables, &fingers, problems);
        let (fields, guides) =
            (problems.keep(FieldSpec::read_all(table)), problems.keep(GuideSpec::read_all(table)));
        Some(Self {
            name: name?,
            gravity_m_s2: gravity?.into(),
            dynamics: dynamics?,
            hand: hand?,
            fingers,
            entities: things.entities,
            fields: fields?,
            guides: guides?,
            environments: things.environments,
            lights: things.lights,
            cameras: things.cameras,
            templates: things.templates,
            included: Vec::new(),
            text: SceneText::default(),
        })
    }
}

/// What a file of these keys, none of which a scene has, is of, and what it is for.
const OTHER_KINDS: [(&str, &str, &str); 4] = [
    ("patch", "rational patches", "a scene names it: `shape = { kind = \"nurbs\", file = \"...\" }`"),
    (
        "device",
        "devices",
        "a layout belongs to `phantom3 run SCENE --layout FILE`, a driver's configuration to `io-driver run --config FILE`",
    ),
    ("window", "settings", "it belongs to `phantom3 play SCENE --settings FILE`"),
    ("keys", "keys", "the settings name it: `[input] bindings = \"FILE\"`"),
];

fn of_another_kind(table: &Table<'_>) -> Option<SceneError> {
    if table.own_keys().any(|key| KEYS.available.contains(&key)) {
        return None;
    }
    let of_another = |key: &str| OTHER_KINDS.iter().find(|(other, ..)| *other == key);
    let (key, found, advice) = table.own_keys().find_map(of_another)?;
    Some(SceneError::NotAScene { at: table.at(key), found, advice })
}

/// How a run goes is for one file to say.
fn refuse_what_is_the_scenes(table: &Table<'_>, problems: &mut Problems) {
    let is_the_scenes = |key: &&str| KEYS.available.contains(key) && !INCLUDED_KEYS.available.contains(key);
    match table.own_keys().find(is_the_scenes) {
        Some(key) => {
            problems.note(SceneError::OnlyInScene { at: table.at(key), allowed: INCLUDED_KEYS.list() });
        }
        None => problems.keys(table, &INCLUDED_KEYS),
    }
}

fn read_name(table: &Table<'_>, file: &Path) -> Result<String, SceneError> {
    match table.get("name") {
        Some(value) => value.text("a string that is not empty").map(str::to_owned),
        None => Ok(file.file_stem().unwrap_or_default().to_string_lossy().into_owned()),
    }
}

fn read_hand(table: &Table<'_>) -> Result<Option<PathBuf>, SceneError> {
    let file = |value: Value<'_>| value.file("the path of a CSV file, relative to this file");
    table.get("hand").map(file).transpose()
}

const KEYS: Vocabulary = Vocabulary {
    available: &[
        "name",
        "gravity_m_s2",
        "integrator",
        "contact_response",
        "contact_stiffness",
        "grasp_quality",
        "sleep",
        "lists",
        "hand",
        "finger",
        "entity",
        "field",
        "guide",
        "include",
        "template",
        "environment",
        "light",
        "camera",
    ],
    later: &[],
};
const INCLUDED_KEYS: Vocabulary = Vocabulary {
    available: &["include", "template", "entity", "environment", "light", "camera"],
    later: &[],
};
