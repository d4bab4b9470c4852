//! A finger of a scene: a haptic interaction point and the device that moves it.

use std::collections::BTreeMap;

use nalgebra::Point3;

use crate::MAX_DEVICES;
use crate::attach::AttachSpec;
use crate::entity::read_within;
use crate::error::SceneError;
use crate::names::Names;
use crate::passivity::PassivitySpec;
use crate::problems::Problems;
use crate::reader::{Bound, Table};
use crate::soft::SoftSpec;
use crate::vocabulary::Vocabulary;

/// One `[[finger]]`.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneFinger {
    /// Unique among the fingers; default f0, f1, ... by position in the list.
    pub name: String,
    /// 0 for a point, above 0 for a spherical volumetric finger; default 0.
    pub radius_m: f64,
    /// Where the finger rests without hand or device; world frame, default the origin.
    pub start_m: Point3<f64>,
    /// Whether the scene says so.
    pub has_start: bool,
    /// Index of the haptic device that moves it; unique, default its position in the list.
    pub device: usize,
    /// How its forces are kept from feeding energy into the hand; default they are not.
    pub passivity: Option<PassivitySpec>,
    /// What its pad does against turning; default it is a point.
    pub soft: Option<SoftSpec>,
    /// How it ties objects to itself; default it does not.
    pub attach: Option<AttachSpec>,
    /// The environment behind whose door it begins; default in the world outside.
    pub within: Option<String>,
    /// Where in the scene's file; counted from 1.
    pub line: usize,
}

impl SceneFinger {
    /// Reads all `[[finger]]`s of a scene.
    pub(crate) fn read_all(scene: &Table<'_>, problems: &mut Problems) -> Vec<Self> {
        let Some(tables) = problems.keep(scene.tables_up_to(MAX_DEVICES, "finger")) else {
            return Vec::new();
        };
        if tables.is_empty() {
            problems.note(SceneError::NoFinger { file: scene.document().file().into(), limit: MAX_DEVICES });
        }
        let (mut names, mut devices) = (Names::default(), BTreeMap::new());
        let read = |(i, table)| problems.keep(Self::read(table, i, &mut names, &mut devices));
        tables.iter().enumerate().filter_map(read).collect()
    }

    fn read<'d>(
        table: &Table<'d>,
        i: usize,
        names: &mut Names<'d>,
        devices: &mut BTreeMap<usize, usize>,
    ) -> Result<Self, SceneError> {
        table.check_keys(&KEYS)?;
        Ok(Self {
            name: names.claim(table, format!("f{i}"))?,
            radius_m: table.number_or("radius_m", Bound::NotNegative, 0.0)?,
            start_m: table.numbers_or("start_m", [0.0; 3])?.into(),
            has_start: table.get("start_m").is_some(),
            device: claim_device(table, i, devices)?,
            passivity: PassivitySpec::read(table)?,
            soft: SoftSpec::read(table)?,
            attach: AttachSpec::read(table)?,
            within: read_within(table)?,
            line: table.document().line(table.offset()),
        })
    }
}

/// The device of the finger at position `i`; `devices` holds the offset of each that is taken.
fn claim_device(
    table: &Table<'_>,
    i: usize,
    devices: &mut BTreeMap<usize, usize>,
) -> Result<usize, SceneError> {
    let (device, offset, note) = match table.get("device") {
        Some(value) => (value.index(MAX_DEVICES)?, value.offset(), ""),
        None => (i, table.offset(), " (the default, its position in the list)"),
    };
    match devices.insert(device, offset) {
        None => Ok(device),
        Some(first) => {
            let (found, first) =
                (format!("{device}{note}"), format!("on line {}", table.document().line(first)));
            Err(SceneError::Duplicate { at: table.at("device"), found, first })
        }
    }
}

const KEYS: Vocabulary = Vocabulary {
    available: &["name", "radius_m", "start_m", "device", "passivity", "soft", "attach", "within"],
    later: &[],
};
