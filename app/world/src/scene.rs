//! The scene: everything a run starts with.

use std::path::{Path, PathBuf};

use nalgebra::Vector3;

use crate::document::{Document, LineEnds};
use crate::dynamics::{DynamicsSpec, ResponseSpec};
use crate::entity::SceneEntity;
use crate::error::SceneError;
use crate::field::FieldSpec;
use crate::finger::SceneFinger;
use crate::guide::GuideSpec;
use crate::names::Names;
use crate::reader::Table;
use crate::source::read_text;
use crate::vocabulary::Vocabulary;

/// A validated scene. Plain data; the order of the lists is that of the file.
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
}

impl Scene {
    /// Gravity of a scene that gives none: y is up.
    pub const DEFAULT_GRAVITY_M_S2: [f64; 3] = [0.0, -9.81, 0.0];

    /// Reads the scene file `path`.
    ///
    /// # Errors
    /// The file cannot be read, is too large or not UTF-8, or [`Scene::parse`] refuses its text.
    pub fn load(path: impl AsRef<Path>) -> Result<Self, SceneError> {
        let path = path.as_ref();
        Self::parse(&read_text(path)?, path)
    }

    /// Reads a scene from `text`. `file` is named in errors and is what `hand` is relative to;
    /// it is not opened.
    ///
    /// # Errors
    /// The first thing found to be wrong, with its place and what is allowed there.
    pub fn parse(text: &str, file: &Path) -> Result<Self, SceneError> {
        let lines = LineEnds::of(text);
        let document = Document::new(text, &lines, file);
        let root = document.parse()?;
        let table = Table::root(document, &root);
        table.check_keys(&KEYS)?;
        let dynamics = DynamicsSpec::read(&table)?;
        Ok(Self {
            name: read_name(&table, file)?,
            gravity_m_s2: table.numbers_or("gravity_m_s2", Self::DEFAULT_GRAVITY_M_S2)?.into(),
            dynamics,
            hand: read_hand(&table, file)?,
            fingers: SceneFinger::read_all(&table)?,
            entities: read_entities(&table, dynamics.response)?,
            fields: FieldSpec::read_all(&table)?,
            guides: GuideSpec::read_all(&table)?,
        })
    }
}

fn read_name(table: &Table<'_>, file: &Path) -> Result<String, SceneError> {
    match table.get("name") {
        Some(value) => value.text("a string that is not empty").map(str::to_owned),
        None => Ok(file.file_stem().unwrap_or_default().to_string_lossy().into_owned()),
    }
}

fn read_hand(table: &Table<'_>, file: &Path) -> Result<Option<PathBuf>, SceneError> {
    let Some(value) = table.get("hand") else { return Ok(None) };
    let hand = value.path("the path of a CSV file, relative to this file")?;
    Ok(Some(file.parent().unwrap_or(Path::new("")).join(hand)))
}

fn read_entities(table: &Table<'_>, response: ResponseSpec) -> Result<Vec<SceneEntity>, SceneError> {
    let mut names = Names::default();
    let tables = table.tables("entity")?;
    tables.iter().enumerate().map(|(i, table)| SceneEntity::read(table, i, &mut names, response)).collect()
}

const KEYS: Vocabulary = Vocabulary {
    available: &[
        "name",
        "gravity_m_s2",
        "integrator",
        "contact_response",
        "grasp_quality",
        "hand",
        "finger",
        "entity",
        "field",
        "guide",
    ],
    later: &[],
};
