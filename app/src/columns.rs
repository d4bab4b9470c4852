//! The columns of a recording: their names, and a row's cells in their order.
//!
//! Model: one description serves every table that is written (CSV, Parquet) and the one that is read back, so that they
//! cannot differ. Columns that a device, finger or scene has nothing to tell in are not there.
//! Units: SI; world frame; forces are forces on the user.

use crate::row::{BodyRow, FingerRow, Row};
use haptics::{ContactState, Feature};
use io_driver::device::{Extras, run_time_s};
use physics::GraspQuality;

/// The names that a recording's columns and cells are made of.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Names {
    /// The fingers.
    pub fingers: Vec<String>,
    /// What their devices tell besides positions; fingers beyond the list: nothing.
    pub extras: Vec<Extras>,
    /// Which are kept passive; those beyond the list are not.
    pub passive: Vec<bool>,
    /// Whether their torques are told; fingers beyond the list: no.
    pub torques: Vec<bool>,
    /// The entities.
    pub entities: Vec<String>,
    /// Those of them that move, in the order of a row's bodies.
    pub bodies: Vec<String>,
    /// Which fingers tie objects to themselves; those beyond the list do not.
    pub ties: Vec<bool>,
    /// Whether it is told how the bodies are grasped.
    pub grasp_quality: bool,
    /// The spaces but for the world, space 1 first; `None`: there are no doors, and it is not told which one a finger is in.
    pub spaces: Option<Vec<String>>,
    /// Whether it is told in which list the bodies are: where there are two.
    pub lists: bool,
    /// True if it is told as of when bodies stand where they do.
    pub as_of: bool,
}

impl Names {
    /// Every name.
    pub fn all(&self) -> impl Iterator<Item = &str> {
        let spaces = self.spaces.iter().flatten();
        self.fingers.iter().chain(&self.entities).chain(&self.bodies).chain(spaces).map(String::as_str)
    }

    /// Whether a finger's torque is told.
    pub fn has_torque(&self, finger: usize) -> bool {
        self.torques.get(finger).copied().unwrap_or_default()
    }

    /// Whether a finger ties objects to itself.
    pub fn ties(&self, finger: usize) -> bool {
        self.ties.get(finger).copied().unwrap_or_default()
    }

    /// What a finger's device tells besides positions.
    pub fn extras_of(&self, finger: usize) -> Extras {
        self.extras.get(finger).copied().unwrap_or_default()
    }

    /// Whether a finger is kept passive.
    pub fn is_passive(&self, finger: usize) -> bool {
        self.passive.get(finger).copied().unwrap_or_default()
    }

    /// The name of a space; empty for the world.
    pub fn space(&self, space: u32) -> &str {
        let at = (space as usize).checked_sub(1);
        at.and_then(|at| self.spaces.as_ref()?.get(at)).map_or("", String::as_str)
    }

    /// The name of an entity; empty for none.
    pub fn entity(&self, index: Option<u32>) -> &str {
        index.and_then(|index| self.entities.get(index as usize)).map_or("", String::as_str)
    }
}

/// What kind of cells a column has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CellKind {
    /// A number.
    Number,
    /// A whole number, 0 or more.
    Whole,
    /// A name or a word.
    Text,
}

/// A column of a recording.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Column {
    /// In the header.
    pub name: String,
    /// Of all its cells.
    pub kind: CellKind,
}

/// A cell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Cell<'a> {
    /// Of a column of numbers.
    Number(f64),
    /// Of a column of whole numbers.
    Whole(u64),
    /// Of a column of words.
    Text(&'a str),
}

const AXES: [&str; 3] = ["x", "y", "z"];
const QUATERNION: [&str; 4] = ["qw", "qx", "qy", "qz"];

/// All columns, `t` first.
pub fn columns(names: &Names) -> Vec<Column> {
    let mut list = ColumnList(Vec::new());
    list.push("t".into(), CellKind::Number);
    for (index, finger) in names.fingers.iter().enumerate() {
        list.push_finger(finger, index, names);
    }
    for body in &names.bodies {
        list.push_numbers(body, &AXES);
        list.push_numbers(body, &QUATERNION);
        list.push_numbers(body, &["vx", "vy", "vz", "wx", "wy", "wz"]);
        if names.grasp_quality {
            for (quantity, kind) in [
                ("contacts", CellKind::Whole),
                ("rank", CellKind::Whole),
                ("residual", CellKind::Number),
                ("closure", CellKind::Whole),
            ] {
                list.push(format!("{body}_{quantity}"), kind);
            }
        }
        if names.lists {
            list.push(format!("{body}_list"), CellKind::Whole);
        }
        if names.as_of {
            list.push(format!("{body}_as_of"), CellKind::Number);
        }
    }
    list.0
}

struct ColumnList(Vec<Column>);

impl ColumnList {
    fn push(&mut self, name: String, kind: CellKind) {
        self.0.push(Column { name, kind });
    }

    fn push_numbers(&mut self, of: &str, quantities: &[&str]) {
        for quantity in quantities {
            self.push(format!("{of}_{quantity}"), CellKind::Number);
        }
    }

    fn push_axes(&mut self, finger: &str, quantity: &str) {
        self.push_numbers(&format!("{finger}_{quantity}"), &AXES);
    }

    fn push_finger(&mut self, finger: &str, index: usize, names: &Names) {
        for quantity in ["hip", "god", "force"] {
            self.push_axes(finger, quantity);
        }
        for quantity in ["entity", "feature", "friction"] {
            self.push(format!("{finger}_{quantity}"), CellKind::Text);
        }
        self.push_axes(finger, "applied");
        // Only where there is something to tell: recordings of all other devices stay as they are.
        let extras = names.extras_of(index);
        if extras.orientation {
            self.push_numbers(finger, &QUATERNION);
        }
        if extras.buttons {
            self.push(format!("{finger}_buttons"), CellKind::Whole);
        }
        if names.is_passive(index) {
            self.push_numbers(finger, &["energy", "controlled"]);
        }
        if names.has_torque(index) {
            self.push_axes(finger, "torque");
        }
        if names.ties(index) {
            self.push(format!("{finger}_attached"), CellKind::Text);
        }
        if names.spaces.is_some() {
            self.push(format!("{finger}_space"), CellKind::Text);
        }
    }
}

/// Hands a row's cells to `write`, in the order of [`columns`].
pub fn each_cell(
    row: &Row,
    bodies: &[BodyRow],
    names: &Names,
    period_ns: u64,
    mut write: impl FnMut(Cell<'_>),
) {
    write(Cell::Number(run_time_s(row.run_tick.cast_signed(), period_ns)));
    for (index, (_, finger)) in names.fingers.iter().zip(&row.fingers).enumerate() {
        each_cell_of_finger(finger, index, names, &mut write);
    }
    for body in bodies {
        each_cell_of_body(body, names, &mut write);
        if names.as_of {
            let tick = body.as_of.unwrap_or(row.run_tick);
            write(Cell::Number(run_time_s(tick.cast_signed(), period_ns)));
        }
    }
}

fn each_cell_of_finger(finger: &FingerRow, index: usize, names: &Names, write: &mut impl FnMut(Cell<'_>)) {
    for vector in [&finger.hip, &finger.god_object, &finger.force_on_user] {
        each_number(vector, write);
    }
    for word in [names.entity(finger.entity), feature_name(finger.feature), friction_name(finger.friction)] {
        write(Cell::Text(word));
    }
    each_number(&finger.applied_on_user, write);
    let extras = names.extras_of(index);
    if extras.orientation {
        each_number(&finger.orientation_wxyz, write);
    }
    if extras.buttons {
        write(Cell::Whole(finger.buttons));
    }
    if names.is_passive(index) {
        each_number(&[finger.energy_j, finger.controlled_n], write);
    }
    if names.has_torque(index) {
        each_number(&finger.torque_on_user, write);
    }
    if names.ties(index) {
        write(Cell::Text(names.entity(finger.attached)));
    }
    if names.spaces.is_some() {
        write(Cell::Text(names.space(finger.space)));
    }
}

fn each_cell_of_body(body: &BodyRow, names: &Names, write: &mut impl FnMut(Cell<'_>)) {
    each_number(&body.position, write);
    let q = body.orientation;
    each_number(&[q.w, q.i, q.j, q.k], write);
    each_number(&body.velocity, write);
    each_number(&body.angular_velocity, write);
    if names.grasp_quality {
        let GraspQuality { contacts, rank, residual, has_force_closure } = body.grasp;
        write(Cell::Whole(contacts as u64));
        write(Cell::Whole(rank as u64));
        write(Cell::Number(residual));
        write(Cell::Whole(u64::from(has_force_closure)));
    }
    if names.lists {
        write(Cell::Whole(u64::from(body.is_slow)));
    }
}

fn each_number<'n>(numbers: impl IntoIterator<Item = &'n f64>, write: &mut impl FnMut(Cell<'_>)) {
    for number in numbers {
        write(Cell::Number(*number));
    }
}

const FEATURES: [(&str, Feature); 5] = [
    ("none", Feature::None),
    ("surface", Feature::Surface),
    ("face", Feature::Face),
    ("edge", Feature::Edge),
    ("vertex", Feature::Vertex),
];

const FRICTIONS: [(&str, ContactState); 3] =
    [("free", ContactState::Free), ("stick", ContactState::Stick), ("slip", ContactState::Slip)];

/// The word for a feature.
pub fn feature_name(feature: Feature) -> &'static str {
    FEATURES.iter().find(|(_, other)| *other == feature).map_or("none", |(name, _)| name)
}

/// The word for what friction does.
pub fn friction_name(friction: ContactState) -> &'static str {
    FRICTIONS.iter().find(|(_, other)| *other == friction).map_or("free", |(name, _)| name)
}

/// The feature that a word stands for.
pub fn feature_named(word: &str) -> Option<Feature> {
    FEATURES.iter().find(|(name, _)| *name == word).map(|(_, feature)| *feature)
}

/// What a word says of friction.
pub fn friction_named(word: &str) -> Option<ContactState> {
    FRICTIONS.iter().find(|(name, _)| *name == word).map(|(_, friction)| *friction)
}
