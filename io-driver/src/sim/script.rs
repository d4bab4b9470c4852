//! Plays a hand file: where each finger wants to be at each time.
//!
//! Problem: experiments have to be repeatable, so the hand is a table, written by a script or
//! recorded from a person.
//! Model: `t,f0_x,f0_y,f0_z[,f1_x,...]`; linear between rows, held after the last row and before
//! the first. A finger without columns has no script and rests where it starts; columns of an
//! unknown finger are a mistake. Beside its position a finger may have an orientation, `f0_qw,f0_qx,
//! f0_qy,f0_qz`, and buttons, `f0_buttons`: a whole number whose bit `i` is button `i`, held until the
//! next row. Between rows orientations take the shorter way along the straight line between the two
//! quaternions, made unit again: of rows up to 90 degrees apart it is within 1 degree of an even turn, and,
//! other than that, needs no function that differs between platforms.
//! Frames: world frame W, metres and seconds; an orientation is `R_WF` of the fingertip's frame F.
//! Invariants: at the time of a row the position is that row's, bit for bit, and so are orientations of
//! length one, but for the sign of the whole quaternion. Positions are always finite, orientations always
//! unit; a time that is not a number counts as before the first row.
//! Cost: [`HandPlayer::position`] and its like constant while time runs on, logarithmic after a jump; no
//! allocation.

use std::path::Path;

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use thiserror::Error;

use crate::table::{Place, TableError, TableReader, TimeCursor, TimeTable};

mod columns;

use columns::FingerColumns;

/// What all scripted fingers do over time.
#[derive(Debug, Clone, PartialEq)]
pub struct HandScript {
    times_s: Vec<f64>,
    /// Which of the `scripted` columns of `points` belongs to a finger.
    slots: Vec<Option<usize>>,
    scripted: usize,
    /// Row after row, one point per scripted finger.
    points: Vec<Vector3<f64>>,
    /// Per scripted finger, if it has any: one per row, each at most 90 degrees from the last on the quaternions' sphere.
    orientations: Vec<Option<Vec<UnitQuaternion<f64>>>>,
    /// Per scripted finger, if it has any: one per row.
    buttons: Vec<Option<Vec<u32>>>,
}

/// A script and the place at which it is being read.
#[derive(Debug, Clone, PartialEq)]
pub struct HandPlayer {
    script: HandScript,
    cursor: TimeCursor,
}

/// Why a text is not a hand file.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum HandError {
    /// Not a table of numbers over time.
    #[error(transparent)]
    Table(#[from] TableError),
    /// A column that belongs to none of the scene's fingers.
    #[error(
        "{at}: found a column that is no finger's, allowed: `_x`, `_y`, `_z`, `_qw`, `_qx`, `_qy`, `_qz` or `_buttons` after one of {known}"
    )]
    UnknownColumn {
        /// Where.
        at: Place,
        /// The scene's fingers.
        known: String,
    },
    /// A finger with one or two coordinates.
    #[error("{at}: found no such column, allowed: all three coordinates of finger {finger}, or none")]
    MissingCoordinate {
        /// Where, with the missing column.
        at: Place,
        /// The finger.
        finger: String,
    },
    /// A finger with a part of an orientation.
    #[error(
        "{at}: found no such column, allowed: all four numbers of finger {finger}'s orientation, or none"
    )]
    MissingQuaternionPart {
        /// Where, with the missing column.
        at: Place,
        /// The finger.
        finger: String,
    },
    /// A finger that is nowhere.
    #[error(
        "{at}: found no such column, allowed: orientation and buttons of finger {finger} together with its three coordinates"
    )]
    NoPosition {
        /// Where, with the missing column.
        at: Place,
        /// The finger.
        finger: String,
    },
    /// An orientation that is none.
    #[error(
        "{at}: found an orientation of length {length}, allowed: {} to {}, which is then made 1",
        LENGTHS.start(), LENGTHS.end()
    )]
    NoRotation {
        /// Where, with the quaternion's first column.
        at: Place,
        /// Its length.
        length: String,
    },
    /// Nothing but the time.
    #[error("{at}: found no columns beside the time, allowed: those of at least one of {known}")]
    NoFinger {
        /// Where.
        at: Place,
        /// The scene's fingers.
        known: String,
    },
}

/// Lengths of a quaternion that is meant as an orientation: one, written with one digit at the least.
const LENGTHS: std::ops::RangeInclusive<f64> = 0.9..=1.1;

impl HandScript {
    /// Reads a hand file for the scene's `fingers`; `file` is only named in errors, never opened.
    ///
    /// # Errors
    /// [`HandError`] names file, line and column of the first mistake.
    pub fn parse(text: &str, file: &Path, fingers: &[&str]) -> Result<Self, HandError> {
        let reader = TableReader::open(text, file)?;
        columns::refuse_unknown(&reader, fingers)?;
        let columns: Vec<Option<FingerColumns>> =
            fingers.iter().map(|finger| columns::of(&reader, finger)).collect::<Result<_, _>>()?;
        let table = reader.rows_of(|column| columns::allowed(column, fingers))?;
        Self::from_table(table, &columns, &reader)
    }

    /// Time of the last row, from which on every finger rests; zero if that is negative.
    pub fn duration_s(&self) -> f64 {
        self.times_s.last().map_or(0.0, |last| last.max(0.0))
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.times_s.len()
    }

    /// Lowest and highest corner of the box that a finger's path fills (m); `None` without a script.
    pub fn bounds(&self, finger: usize) -> Option<[Vector3<f64>; 2]> {
        let slot = self.slot(finger)?;
        let first = self.point(0, slot);
        let grown = (1..self.times_s.len()).map(|row| self.point(row, slot));
        Some(grown.fold([first, first], |[low, high], p| [low.inf(&p), high.sup(&p)]))
    }

    /// Whether a finger has a script.
    pub fn is_scripted(&self, finger: usize) -> bool {
        self.slot(finger).is_some()
    }

    /// Whether a finger's orientation is scripted.
    pub fn has_orientation(&self, finger: usize) -> bool {
        self.slot(finger).is_some_and(|slot| self.orientations[slot].is_some())
    }

    /// Whether a finger's buttons are scripted.
    pub fn has_buttons(&self, finger: usize) -> bool {
        self.slot(finger).is_some_and(|slot| self.buttons[slot].is_some())
    }

    fn from_table(
        table: TimeTable,
        columns: &[Option<FingerColumns>],
        reader: &TableReader<'_>,
    ) -> Result<Self, HandError> {
        let scripted: Vec<FingerColumns> = columns.iter().flatten().copied().collect();
        let rows = || table.cells.chunks_exact(table.columns);
        let point = |row: &[f64], [x, y, z]: [usize; 3]| Vector3::new(row[x], row[y], row[z]);
        let points = rows().flat_map(|row| scripted.iter().map(move |c| point(row, c.position))).collect();
        let turns = |c: &FingerColumns| c.orientation.map(|c| orientations(rows(), c, reader)).transpose();
        let orientations = scripted.iter().map(turns).collect::<Result<_, _>>()?;
        // Exact: the cells were read as whole numbers of 32 bits.
        let held = |c: &FingerColumns| c.buttons.map(|c| rows().map(|row| row[c] as u32).collect());
        let buttons = scripted.iter().map(held).collect();
        let mut next = 0..;
        let slots = columns.iter().map(|c| c.and_then(|_| next.next())).collect();
        Ok(Self { slots, scripted: scripted.len(), points, orientations, buttons, times_s: table.times_s })
    }

    fn slot(&self, finger: usize) -> Option<usize> {
        self.slots.get(finger).copied().flatten()
    }

    fn point(&self, row: usize, slot: usize) -> Vector3<f64> {
        self.points[row * self.scripted + slot]
    }
}

impl HandPlayer {
    /// Starts at the beginning.
    pub fn new(script: HandScript) -> Self {
        Self { script, cursor: TimeCursor::default() }
    }

    /// Where `finger` (its index in the list given to the parser) wants to be, `p_W` in metres;
    /// `None` if it has no script.
    pub fn position(&mut self, finger: usize, time_s: f64) -> Option<Vector3<f64>> {
        let slot = self.script.slot(finger)?;
        let (row, part) = self.place(time_s);
        let start = self.script.point(row, slot);
        Some(match part {
            None => start,
            Some(part) => start + (self.script.point(row + 1, slot) - start) * part,
        })
    }

    /// How `finger` wants to be turned, `R_WF`; `None` if that is not scripted.
    pub fn orientation(&mut self, finger: usize, time_s: f64) -> Option<UnitQuaternion<f64>> {
        let (row, part) = self.place(time_s);
        let turns = self.script.orientations[self.script.slot(finger)?].as_ref()?;
        Some(match part {
            None => turns[row],
            Some(part) => turns[row].nlerp(&turns[row + 1], part),
        })
    }

    /// Which buttons `finger` holds down, bit `i` for button `i`; `None` if that is not scripted.
    pub fn buttons(&mut self, finger: usize, time_s: f64) -> Option<u32> {
        let (row, _) = self.place(time_s);
        Some(self.script.buttons[self.script.slot(finger)?].as_ref()?[row])
    }

    /// The script being played.
    pub fn script(&self) -> &HandScript {
        &self.script
    }

    /// The row of a time, and how far it is to the next; `None`: exactly on the row, or held.
    fn place(&mut self, time_s: f64) -> (usize, Option<f64>) {
        let times_s = &self.script.times_s;
        let Some(row) = self.cursor.seek(times_s, time_s) else { return (0, None) };
        let start_s = times_s[row];
        // Exactly on the row the blend would still turn -0.0 into 0.0.
        let next = times_s.get(row + 1).filter(|_| time_s > start_s);
        (row, next.map(|end_s| (time_s - start_s) / (end_s - start_s)))
    }
}

/// One orientation per row; neighbours lie on the same half of the quaternions' sphere, since q and -q are one turn.
fn orientations<'a>(
    rows: impl Iterator<Item = &'a [f64]>,
    [w, x, y, z]: [usize; 4],
    reader: &TableReader<'_>,
) -> Result<Vec<UnitQuaternion<f64>>, HandError> {
    let mut turns: Vec<UnitQuaternion<f64>> = Vec::new();
    for (index, row) in rows.enumerate() {
        let written = Quaternion::new(row[w], row[x], row[y], row[z]);
        if !LENGTHS.contains(&written.norm()) {
            let at = reader.cell_place(index, reader.columns()[w]);
            return Err(HandError::NoRotation { at, length: written.norm().to_string() });
        }
        let turn = UnitQuaternion::new_normalize(written);
        let is_far = turns.last().is_some_and(|last| last.coords.dot(&turn.coords) < 0.0);
        turns.push(if is_far { UnitQuaternion::new_unchecked(-turn.into_inner()) } else { turn });
    }
    Ok(turns)
}

#[cfg(test)]
mod tests;
