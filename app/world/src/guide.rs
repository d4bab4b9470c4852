//! A guide of a scene: what it leads along, and how firmly.

use nalgebra::{Unit, Vector3};

use crate::error::SceneError;
use crate::pose::read_direction;
use crate::reader::{Bound, Table};
use crate::vocabulary::Vocabulary;

/// The most guides of a scene.
pub const MAX_GUIDES: usize = 64;

/// One `[[guide]]`; world frame.
#[derive(Debug, Clone, PartialEq)]
pub struct GuideSpec {
    /// Where its `[[guide]]` stands in the file, for messages; counted from 1.
    pub line: usize,
    /// What it leads along.
    pub track: TrackSpec,
    /// Above 0.
    pub stiffness_n_per_m: f64,
    /// 0 or more.
    pub damping_n_s_per_m: f64,
    /// Within this distance nothing is felt (m); 0 or more.
    pub deadband_m: f64,
    /// Within this distance it captures (m); above 0. `None`: from everywhere, or as its break-away force has it.
    pub capture_m: Option<f64>,
    /// Above this force it lets go (N); above 0. `None`: never.
    pub break_away_n: Option<f64>,
    /// It pulls this much at most (N); above 0.
    pub force_limit_n: f64,
    /// Mass of the device at its tip (kg), for the limits; above 0.
    pub device_mass_kg: f64,
}

/// What a guide leads along.
#[derive(Debug, Clone, PartialEq)]
pub enum TrackSpec {
    /// A plane.
    Plane {
        /// One of its points (m).
        point_m: Vector3<f64>,
        /// Of either side.
        normal: Unit<Vector3<f64>>,
    },
    /// A line without ends.
    Line {
        /// One of its points (m).
        point_m: Vector3<f64>,
        /// Either way.
        direction: Unit<Vector3<f64>>,
    },
    /// Straight from point to point (m): at least two.
    Path(Vec<Vector3<f64>>),
}

impl GuideSpec {
    /// Reads all `[[guide]]`s of a scene.
    pub(crate) fn read_all(scene: &Table<'_>) -> Result<Vec<Self>, SceneError> {
        scene.tables_up_to(MAX_GUIDES, "guide")?.iter().map(Self::read).collect()
    }

    fn read(table: &Table<'_>) -> Result<Self, SceneError> {
        use haptics::{Guide, Limits};
        let positive_or = |key, default| table.number_or(key, Bound::Positive, default);
        let positive = |key| table.get(key).map(|value| value.number(Bound::Positive)).transpose();
        let damping = Guide::DEFAULT_DAMPING_N_S_PER_M;
        Ok(Self {
            line: table.document().line(table.offset()),
            track: TrackSpec::read(table)?,
            stiffness_n_per_m: positive_or("stiffness_n_per_m", Guide::DEFAULT_STIFFNESS_N_PER_M)?,
            damping_n_s_per_m: table.number_or("damping_n_s_per_m", Bound::NotNegative, damping)?,
            deadband_m: table.number_or("deadband_m", Bound::NotNegative, 0.0)?,
            capture_m: positive("capture_m")?,
            break_away_n: positive("break_away_n")?,
            force_limit_n: positive_or("force_limit_n", Guide::DEFAULT_FORCE_LIMIT_N)?,
            device_mass_kg: positive_or("device_mass_kg", Limits::DEFAULT_DEVICE_MASS_KG)?,
        })
    }
}

impl TrackSpec {
    fn read(table: &Table<'_>) -> Result<Self, SceneError> {
        let kind = table.require("kind", KINDS.list())?.choose("guide kind", &KINDS)?;
        let (keys, read): (_, Read) = match kind {
            "line" => (LINE_KEYS, read_line),
            "plane" => (PLANE_KEYS, read_plane),
            "segment" => (SEGMENT_KEYS, read_segment),
            _ => (PATH_KEYS, read_path),
        };
        table.check_keys(&keys)?;
        read(table)
    }
}

type Read = fn(&Table<'_>) -> Result<TrackSpec, SceneError>;

fn read_line(table: &Table<'_>) -> Result<TrackSpec, SceneError> {
    let (direction, _) = read_direction(&table.require("direction", THREE)?)?;
    Ok(TrackSpec::Line { point_m: point(table, "point_m")?, direction })
}

fn read_plane(table: &Table<'_>) -> Result<TrackSpec, SceneError> {
    let (normal, _) = read_direction(&table.require("normal", THREE)?)?;
    Ok(TrackSpec::Plane { point_m: point(table, "point_m")?, normal })
}

fn read_segment(table: &Table<'_>) -> Result<TrackSpec, SceneError> {
    let (from, to) = (point(table, "from_m")?, point(table, "to_m")?);
    if from == to {
        return Err(table.require("to_m", "")?.out_of_range("another point than from_m"));
    }
    Ok(TrackSpec::Path(vec![from, to]))
}

fn read_path(table: &Table<'_>) -> Result<TrackSpec, SceneError> {
    let allowed =
        format!("an array of 2 to {} points of 3 numbers, no two in a row equal", haptics::MAX_PATH_POINTS);
    let value = table.require("points_m", &allowed)?;
    let points: Vec<Vector3<f64>> = value.points(&allowed)?.into_iter().map(Vector3::from).collect();
    let is_path = (2..=haptics::MAX_PATH_POINTS).contains(&points.len());
    if !is_path || points.windows(2).any(|pair| pair[0] == pair[1]) {
        return Err(value.out_of_range(allowed));
    }
    Ok(TrackSpec::Path(points))
}

fn point(table: &Table<'_>, key: &str) -> Result<Vector3<f64>, SceneError> {
    Ok(table.require(key, THREE)?.numbers::<3>()?.into())
}

const THREE: &str = "an array of 3 numbers";
const KINDS: Vocabulary = Vocabulary { available: &["line", "plane", "segment", "path"], later: &[] };

/// The keys of a kind, and those of every guide.
macro_rules! keys {
    ($($key:literal),*) => {
        Vocabulary {
            available: &[
                "kind",
                $($key,)*
                "stiffness_n_per_m",
                "damping_n_s_per_m",
                "deadband_m",
                "capture_m",
                "break_away_n",
                "force_limit_n",
                "device_mass_kg",
            ],
            later: &[],
        }
    };
}
const LINE_KEYS: Vocabulary = keys!("point_m", "direction");
const PLANE_KEYS: Vocabulary = keys!("point_m", "normal");
const SEGMENT_KEYS: Vocabulary = keys!("from_m", "to_m");
const PATH_KEYS: Vocabulary = keys!("points_m");
