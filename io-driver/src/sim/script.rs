//! Plays a hand file: where each finger wants to be at each time.
//!
//! Problem: experiments have to be repeatable, so the hand is a table, written by a script or
//! recorded from a person.
//! Model: `t,f0_x,f0_y,f0_z[,f1_x,...]`; linear between rows, held after the last row and before
//! the first. A finger without columns has no script and rests where it starts; columns of an
//! unknown finger are a mistake.
//! Frames: world frame W, metres and seconds.
//! Invariants: at the time of a row the position is that row's, bit for bit. Positions are always
//! finite; a time that is not a number counts as before the first row.
//! Cost: [`HandPlayer::position`] constant while time runs on, logarithmic after a jump; no
//! allocation.

use std::path::Path;

use nalgebra::Vector3;
use thiserror::Error;

use crate::table::{Cells, Place, TableError, TableReader, TimeCursor, TimeTable};

/// Positions of all scripted fingers over time.
#[derive(Debug, Clone, PartialEq)]
pub struct HandScript {
    times_s: Vec<f64>,
    /// Which of the `scripted` columns of `points` belongs to a finger.
    slots: Vec<Option<usize>>,
    scripted: usize,
    /// Row after row, one point per scripted finger.
    points: Vec<Vector3<f64>>,
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
    #[error("{at}: found a column that is no finger's, allowed: `_x`, `_y` or `_z` after one of {known}")]
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
    /// Nothing but the time.
    #[error("{at}: found no columns beside the time, allowed: those of at least one of {known}")]
    NoFinger {
        /// Where.
        at: Place,
        /// The scene's fingers.
        known: String,
    },
}

/// Indices of the x, y and z columns of a finger.
type Columns = [usize; 3];

const AXES: [&str; 3] = ["_x", "_y", "_z"];

impl HandScript {
    /// Reads a hand file for the scene's `fingers`; `file` is only named in errors, never opened.
    ///
    /// # Errors
    /// [`HandError`] names file, line and column of the first mistake.
    pub fn parse(text: &str, file: &Path, fingers: &[&str]) -> Result<Self, HandError> {
        let reader = TableReader::open(text, file)?;
        refuse_unknown_columns(&reader, fingers)?;
        let columns: Vec<Option<Columns>> =
            fingers.iter().map(|finger| columns_of(&reader, finger)).collect::<Result<_, _>>()?;
        Ok(Self::from_table(reader.rows(&Cells::Numbers)?, &columns))
    }

    /// Time of the last row, from which on every finger rests; zero if that is negative.
    pub fn duration_s(&self) -> f64 {
        self.times_s.last().map_or(0.0, |last| last.max(0.0))
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

    fn from_table(table: TimeTable, columns: &[Option<Columns>]) -> Self {
        let scripted: Vec<Columns> = columns.iter().flatten().copied().collect();
        let point = |row: &[f64], c: &Columns| Vector3::new(row[c[0]], row[c[1]], row[c[2]]);
        let rows = table.cells.chunks_exact(table.columns);
        let points = rows.flat_map(|row| scripted.iter().map(move |c| point(row, c))).collect();
        let mut next = 0..;
        let slots = columns.iter().map(|c| c.and_then(|_| next.next())).collect();
        Self { times_s: table.times_s, slots, scripted: scripted.len(), points }
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
        let script = &self.script;
        let slot = script.slot(finger)?;
        let Some(row) = self.cursor.seek(&script.times_s, time_s) else {
            return Some(script.point(0, slot));
        };
        let (start_s, start) = (script.times_s[row], script.point(row, slot));
        match script.times_s.get(row + 1) {
            // Exactly on the row the blend would still turn -0.0 into 0.0.
            Some(&end_s) if time_s > start_s => {
                let part = (time_s - start_s) / (end_s - start_s);
                Some(start + (script.point(row + 1, slot) - start) * part)
            }
            _ => Some(start),
        }
    }

    /// The script being played.
    pub fn script(&self) -> &HandScript {
        &self.script
    }
}

fn refuse_unknown_columns(reader: &TableReader<'_>, fingers: &[&str]) -> Result<(), HandError> {
    let known = || if fingers.is_empty() { "no finger at all".to_owned() } else { fingers.join(", ") };
    let belongs = |column: &str| {
        AXES.iter().any(|axis| column.strip_suffix(axis).is_some_and(|f| fingers.contains(&f)))
    };
    if reader.columns().is_empty() {
        return Err(HandError::NoFinger { at: reader.header_place(""), known: known() });
    }
    match reader.columns().iter().find(|column| !belongs(column)) {
        Some(column) => Err(HandError::UnknownColumn { at: reader.header_place(column), known: known() }),
        None => Ok(()),
    }
}

/// The columns of a finger: all three, or none.
fn columns_of(reader: &TableReader<'_>, finger: &str) -> Result<Option<Columns>, HandError> {
    let column =
        |axis: &str| reader.columns().iter().position(|name| name.strip_suffix(axis) == Some(finger));
    let found = AXES.map(column);
    if let [Some(x), Some(y), Some(z)] = found {
        return Ok(Some([x, y, z]));
    }
    match AXES.iter().zip(found).find(|(_, column)| column.is_none()) {
        Some((axis, _)) if found != [None; 3] => Err(HandError::MissingCoordinate {
            at: reader.header_place(&format!("{finger}{axis}")),
            finger: finger.to_owned(),
        }),
        _ => Ok(None),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const TWO: &str = "t,f0_x,f0_y,f0_z,f1_x,f1_y,f1_z\n0,0,0,0,1,1,1\n1,1,-2,4,1,1,1\n3,1,-2,0,2,1,1\n";

    fn parse(text: &str, fingers: &[&str]) -> Result<HandScript, HandError> {
        HandScript::parse(text, Path::new("hands/lift.csv"), fingers)
    }

    fn play(text: &str) -> HandPlayer {
        HandPlayer::new(parse(text, &["f0", "f1"]).unwrap())
    }

    fn message(text: &str) -> String {
        parse(text, &["f0", "f1"]).unwrap_err().to_string()
    }

    #[test]
    fn positions_are_linear_between_rows_and_held_outside() {
        let mut player = play(TWO);
        // All numbers are exact in binary.
        assert_eq!(player.position(0, 0.25), Some(Vector3::new(0.25, -0.5, 1.0)));
        assert_eq!(player.position(1, 2.0), Some(Vector3::new(1.5, 1.0, 1.0)));
        assert_eq!(player.position(0, -7.0), Some(Vector3::zeros()));
        assert_eq!(player.position(0, f64::NAN), Some(Vector3::zeros()));
        assert_eq!(player.position(0, 3.5), Some(Vector3::new(1.0, -2.0, 0.0)));
        assert_eq!(player.position(0, f64::INFINITY), Some(Vector3::new(1.0, -2.0, 0.0)));
        assert_eq!(player.script().duration_s(), 3.0);
    }

    #[test]
    fn a_finger_without_columns_has_no_script() {
        let mut player = play("t,f1_x,f1_y,f1_z\n0,1,2,3\n");
        assert_eq!(player.position(0, 0.0), None);
        assert_eq!(player.position(1, 0.0), Some(Vector3::new(1.0, 2.0, 3.0)));
        assert_eq!(player.position(2, 0.0), None);
        assert!(player.script().is_scripted(1) && !player.script().is_scripted(0));
    }

    #[test]
    fn columns_may_come_in_any_order_and_names_may_have_underscores() {
        let script = parse("t,my_f_z,my_f_x,my_f_y\n0,3,1,2\n", &["my_f"]).unwrap();
        assert_eq!(HandPlayer::new(script).position(0, 0.0), Some(Vector3::new(1.0, 2.0, 3.0)));
    }

    #[test]
    fn a_single_row_holds_for_ever() {
        let mut player = play("t,f0_x,f0_y,f0_z\n0.5,1,2,3\n");
        for time_s in [-1.0, 0.0, 0.5, 9.0] {
            assert_eq!(player.position(0, time_s), Some(Vector3::new(1.0, 2.0, 3.0)));
        }
    }

    #[test]
    fn mistakes_in_the_header_name_the_column_and_the_fingers() {
        assert_eq!(
            message("t,f2_x,f2_y,f2_z\n0,1,2,3\n"),
            "hands/lift.csv:1: column `f2_x`: found a column that is no finger's, allowed: `_x`, `_y` or `_z` \
             after one of f0, f1"
        );
        assert_eq!(
            message("t,f0_x,f0_z\n0,1,2\n"),
            "hands/lift.csv:1: column `f0_y`: found no such column, allowed: all three coordinates of finger \
             f0, or none"
        );
        assert!(message("t,f0_x,f0_y,f0_z,force\n0,1,2,3,4\n").contains("column `force`"));
        assert!(message("t\n0\n").contains("found no columns beside the time"));
    }

    #[test]
    fn mistakes_in_the_rows_name_line_and_column() {
        assert!(message("t,f0_x,f0_y,f0_z\n").contains("lift.csv:1: found the end of the file"));
        assert!(message("t,f0_x,f0_y,f0_z\n0,1,2,nan\n").contains("lift.csv:2: column `f0_z`: found `nan`"));
        assert!(message("t,f0_x,f0_y,f0_z\n1,1,2,3\n0,1,2,3\n").contains("lift.csv:3: column `t`"));
    }

    #[test]
    fn a_million_rows_are_read_and_played() {
        use std::fmt::Write;
        let mut text = String::from("t,f0_x,f0_y,f0_z\r\n");
        for row in 0..1_000_000 {
            writeln!(text, "{}.{:03},0.123456789,{row},-0.000123\r", row / 1000, row % 1000).unwrap();
        }
        let mut player = play(&text);
        for row in (0..1_000_000).step_by(997) {
            let y = player.position(0, f64::from(row) / 1000.0).unwrap().y;
            assert_eq!(y, f64::from(row));
        }
    }

    fn rows() -> impl Strategy<Value = Vec<(f64, [f64; 3])>> {
        let row = (1e-9..10.0_f64, prop::array::uniform3(-1e3..1e3_f64));
        prop::collection::vec(row, 1..50).prop_map(|mut rows| {
            let mut time_s = -5.0;
            for row in &mut rows {
                time_s += row.0;
                row.0 = time_s;
            }
            rows
        })
    }

    fn csv(rows: &[(f64, [f64; 3])]) -> String {
        let lines = rows.iter().map(|(t, [x, y, z])| format!("{t},{x},{y},{z}\n"));
        std::iter::once("t,f0_x,f0_y,f0_z\n".to_owned()).chain(lines).collect()
    }

    proptest! {
        #[test]
        fn at_the_time_of_a_row_the_position_is_bit_identical(mut rows in rows()) {
            rows[0].1[0] = -0.0;
            let mut player = play(&csv(&rows));
            for (time_s, point) in &rows {
                let position: [f64; 3] = player.position(0, *time_s).unwrap().into();
                prop_assert_eq!(position.map(f64::to_bits), point.map(f64::to_bits));
            }
        }

        /// Oracle: search the two rows from scratch; asked in any order of times.
        #[test]
        fn any_order_of_questions_gives_the_same_answers(
            rows in rows(), times in prop::collection::vec(-10.0..100.0_f64, 1..50),
        ) {
            let mut player = play(&csv(&rows));
            for time_s in times {
                let found = Vector3::from(slow_position(&rows, time_s));
                let difference = player.position(0, time_s).unwrap() - found;
                // Two ways to blend numbers up to 1000: a few units in the last place, times
                // three coordinates.
                prop_assert!(difference.norm() <= 16.0 * f64::EPSILON * 1e3);
            }
        }

        #[test]
        fn no_text_panics(text in any::<String>(), rest in "[t,f0_xyz1-9.e+\\- \r\n]{0,80}") {
            for text in [&text, &rest, &format!("t,f0_x,f0_y,f0_z\n{rest}")] {
                if let Ok(script) = parse(text, &["f0", "f1"]) {
                    let _ = HandPlayer::new(script).position(0, 0.5);
                }
            }
        }
    }

    fn slow_position(rows: &[(f64, [f64; 3])], time_s: f64) -> [f64; 3] {
        let Some(after) = rows.iter().position(|(t, _)| *t > time_s) else {
            return rows[rows.len() - 1].1;
        };
        let Some(before) = after.checked_sub(1) else { return rows[0].1 };
        let ((t0, a), (t1, b)) = (rows[before], rows[after]);
        std::array::from_fn(|i| (a[i] * (t1 - time_s) + b[i] * (time_s - t0)) / (t1 - t0))
    }
}
