//! A recording read back.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use std::path::Path;

/// Columns by name.
#[derive(Debug)]
pub struct Table {
    columns: Vec<String>,
    rows: Vec<Vec<String>>,
}

impl Table {
    /// Reads a file; every row must have the header's number of cells.
    pub fn read(path: &Path) -> Self {
        let text = std::fs::read_to_string(path).expect("a recording");
        assert!(text.ends_with('\n'), "{} ends in the middle of a row", path.display());
        let mut lines = text.lines().map(|line| line.split(',').map(str::to_owned).collect::<Vec<_>>());
        let columns = lines.next().expect("a header");
        let rows: Vec<_> = lines.collect();
        for (index, row) in rows.iter().enumerate() {
            assert_eq!(row.len(), columns.len(), "row {index} of {}", path.display());
        }
        Self { columns, rows }
    }

    /// How many rows there are.
    pub fn len(&self) -> usize {
        self.rows.len()
    }

    /// Whether there is nothing but the header.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// A column of texts.
    pub fn texts(&self, column: &str) -> Vec<&str> {
        let index = self.columns.iter().position(|name| name == column);
        let index = index.unwrap_or_else(|| panic!("no column {column} among {:?}", self.columns));
        self.rows.iter().map(|row| row[index].as_str()).collect()
    }

    /// A column of numbers.
    pub fn numbers(&self, column: &str) -> Vec<f64> {
        self.texts(column).into_iter().map(|text| text.parse().expect("a number")).collect()
    }

    /// Three columns `{name}_x|y|z`.
    pub fn vectors(&self, name: &str) -> Vec<Vector3<f64>> {
        let [x, y, z] = ["x", "y", "z"].map(|axis| self.numbers(&format!("{name}_{axis}")));
        (0..self.len()).map(|row| Vector3::new(x[row], y[row], z[row])).collect()
    }

    /// The names of all columns.
    pub fn columns(&self) -> &[String] {
        &self.columns
    }

    /// The rows as they are written, cell by cell.
    pub fn rows(&self) -> &[Vec<String>] {
        &self.rows
    }

    /// All columns of a finger.
    pub fn finger(&self, name: &str) -> Vec<Sample> {
        let t = self.numbers("t");
        let vectors = ["hip", "god", "force", "applied"].map(|what| self.vectors(&format!("{name}_{what}")));
        let texts = ["entity", "feature", "friction"].map(|what| self.texts(&format!("{name}_{what}")));
        let sample = |row: usize| {
            let [hip, god, force, applied] = vectors.each_ref().map(|column| column[row]);
            let [entity, feature, friction] = texts.each_ref().map(|column| column[row].to_owned());
            Sample { t: t[row], hip, god, force, applied, entity, feature, friction }
        };
        (0..self.len()).map(sample).collect()
    }
}

impl Table {
    /// All columns of an entity that moves.
    pub fn body(&self, name: &str) -> Vec<BodySample> {
        let column = |what: &str| self.numbers(&format!("{name}_{what}"));
        let three = |names: [&str; 3]| {
            let [x, y, z] = names.map(column);
            (0..self.len()).map(|row| Vector3::new(x[row], y[row], z[row])).collect::<Vec<_>>()
        };
        let [w, i, j, k] = ["qw", "qx", "qy", "qz"].map(column);
        let (position, velocity) = (three(["x", "y", "z"]), three(["vx", "vy", "vz"]));
        let spin = three(["wx", "wy", "wz"]);
        let sample = |row: usize| BodySample {
            position: position[row],
            orientation: UnitQuaternion::new_normalize(Quaternion::new(w[row], i[row], j[row], k[row])),
            velocity: velocity[row],
            angular_velocity: spin[row],
        };
        (0..self.len()).map(sample).collect()
    }
}

/// One entity that moves in one row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BodySample {
    /// m
    pub position: Vector3<f64>,
    /// In the world.
    pub orientation: UnitQuaternion<f64>,
    /// m/s
    pub velocity: Vector3<f64>,
    /// rad/s, in the world.
    pub angular_velocity: Vector3<f64>,
}

/// One finger in one row.
#[derive(Debug, Clone, PartialEq)]
pub struct Sample {
    /// Time of the row (s).
    pub t: f64,
    /// Haptic interaction point (m).
    pub hip: Vector3<f64>,
    /// God-object (m).
    pub god: Vector3<f64>,
    /// What rendering computed, on the user (N).
    pub force: Vector3<f64>,
    /// What the device rendered, on the user (N).
    pub applied: Vector3<f64>,
    /// The touched entity's name, or nothing.
    pub entity: String,
    /// What of it is touched.
    pub feature: String,
    /// `free`, `stick` or `slip`.
    pub friction: String,
}

impl Sample {
    /// What holds in every row of an ideal device at full authority: a free finger's god-object is its HIP
    /// bit for bit and nothing is felt; a touching one says what it touches; what is computed is rendered.
    pub fn check(&self) {
        let texts = (self.entity.as_str(), self.feature.as_str(), self.friction.as_str());
        if self.friction == "free" {
            assert_eq!(texts, ("", "none", "free"), "{self:?}");
            assert_eq!((self.god, self.force), (self.hip, Vector3::zeros()), "{self:?}");
        } else {
            let is_feature = ["surface", "face", "edge", "vertex"].contains(&self.feature.as_str());
            assert!(!self.entity.is_empty() && is_feature, "{self:?}");
            assert!(["stick", "slip"].contains(&self.friction.as_str()), "{self:?}");
        }
        assert_eq!(self.applied, self.force, "{self:?}");
    }

    /// The force's part along the unit vector `normal`, and the rest of it.
    pub fn split(&self, normal: &Vector3<f64>) -> (f64, Vector3<f64>) {
        let along = self.force.dot(normal);
        (along, self.force - normal * along)
    }

    /// Whether it touches anything.
    pub fn touches(&self) -> bool {
        self.friction != "free"
    }
}
