//! A recording, read back.
//!
//! Columns are found by their names, so that a recording may have more of them than this version knows.

use super::table::{Table, TableRow};
use crate::export::damaged;
use crate::outcome::RunFailure;
use crate::record::read::ReadError;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use rt_core::plain_text::{beginning, listed};
use rt_core::separators;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// A recording.
#[derive(Debug, Clone)]
pub(super) struct Recorded {
    file: PathBuf,
    /// Of each row (s).
    pub(super) times_s: Vec<f64>,
    pub(super) fingers: Vec<RecordedFinger>,
    pub(super) bodies: Vec<RecordedBody>,
    /// Why nothing is read behind the last of these rows, if something is wrong there.
    damage: Option<Damage>,
}

/// Something wrong behind good rows.
#[derive(Debug, Clone)]
struct Damage {
    why: String,
    rows: u64,
    until_s: f64,
}

/// What it says of a finger, row by row; world frame, SI.
#[derive(Debug, Clone, Default)]
pub(super) struct RecordedFinger {
    pub(super) name: String,
    pub(super) hips: Vec<Vector3<f64>>,
    /// On the user (N).
    pub(super) forces: Vec<Vector3<f64>>,
    /// What it touches; empty in free space.
    pub(super) entities: Vec<String>,
}

/// What it says of an entity that moves, row by row; world frame, SI.
#[derive(Debug, Clone, Default)]
pub(super) struct RecordedBody {
    pub(super) name: String,
    pub(super) positions: Vec<Vector3<f64>>,
    pub(super) orientations: Vec<UnitQuaternion<f64>>,
}

/// Why a file is no recording, or not the one that is asked for.
#[derive(Debug, Error)]
pub(super) enum RecordedError {
    #[error("cannot read the recording {file}: {source}")]
    Read { file: PathBuf, source: Box<dyn std::error::Error + Send + Sync> },
    #[error(transparent)]
    Run(#[from] ReadError),
    #[error("{file}: no column {column}; is this a recording that `phantom3 run --record` wrote?{hint}")]
    NoColumn { file: PathBuf, column: String, hint: &'static str },
    #[error("{file}:{line}: {column} is {found:?}; allowed: a number")]
    NoNumber { file: PathBuf, line: u64, column: String, found: String },
    #[error("{file}:{line}: {why}")]
    BadTime { file: PathBuf, line: u64, why: String },
    #[error("{file}:{line}: {why}")]
    BadText { file: PathBuf, line: u64, why: String },
    #[error("{file}: it has no rows")]
    NoRows { file: PathBuf },
    #[error("{file}: no row between {from_s} s and {to_s} s; it lasts from {first_s} s to {last_s} s")]
    NothingThere { file: PathBuf, from_s: f64, to_s: f64, first_s: f64, last_s: f64 },
    #[error("{file}: no finger {name:?}; there are: {known}")]
    NoFinger { file: PathBuf, name: String, known: String },
    #[error("{file}: nothing moves in this recording; leave --objects out")]
    NoBody { file: PathBuf },
}

/// Where a finger's numbers stand in a row.
struct Columns {
    hip: [usize; 3],
    force: [usize; 3],
    entity: usize,
}

impl Recorded {
    pub(super) fn read(file: &Path) -> Result<Self, RecordedError> {
        let mut table = Table::open(file)?;
        let header = table.columns().to_vec();
        let at = |column: &str| {
            let no_column = || RecordedError::NoColumn {
                file: file.into(),
                column: beginning(column).into(),
                hint: separators::hint_for_header(&header.join(",")),
            };
            header.iter().position(|name| name == column).ok_or_else(no_column)
        };
        let time = at("t")?;
        let names: Vec<_> = header.iter().filter_map(|column| column.strip_suffix("_hip_x")).collect();
        if names.is_empty() {
            at("f0_hip_x")?;
        }
        let mut fingers: Vec<_> =
            names.iter().map(|name| RecordedFinger { name: (*name).into(), ..Default::default() }).collect();
        let columns: Vec<_> = names.iter().map(|name| Columns::of(name, &at)).collect::<Result<_, _>>()?;
        let moving: Vec<_> = header.iter().filter_map(|column| column.strip_suffix("_qw")).collect();
        // Fingers' devices may tell how they are turned, too.
        let moving: Vec<_> = moving.into_iter().filter(|name| !names.contains(name)).collect();
        let mut bodies: Vec<_> =
            moving.iter().map(|name| RecordedBody { name: (*name).into(), ..Default::default() }).collect();
        let places: Vec<_> = moving.iter().map(|name| places(name, &at)).collect::<Result<_, _>>()?;
        let mut times_s = Vec::new();
        let mut damage = None;
        loop {
            let row = table.next_row().and_then(|row| {
                row.map(|row| Sample::read(&mut table, &row, time, &columns, &places)).transpose()
            });
            match row {
                Ok(Some(sample)) => {
                    times_s.push(sample.time_s);
                    sample.append_to(&mut fingers, &mut bodies);
                }
                Ok(None) => break,
                Err(error) => {
                    let Some(&until_s) = times_s.last() else { return Err(error) };
                    damage = Some(Damage { why: error.to_string(), rows: times_s.len() as u64, until_s });
                    break;
                }
            }
        }
        Ok(Self { file: file.into(), times_s, fingers, bodies, damage })
    }

    /// The fault that damage behind its rows is.
    pub(super) fn damage(&self) -> Option<RunFailure> {
        self.damage.as_ref().map(|found| damaged(&found.why, found.rows, found.until_s))
    }

    /// What a legend calls it: the file's name without folders and ending.
    pub(super) fn label(&self) -> String {
        self.file.file_stem().unwrap_or_default().to_string_lossy().into_owned()
    }

    /// The rows from one time to another (s).
    pub(super) fn between(self, from_s: f64, to_s: f64) -> Result<Self, RecordedError> {
        let (Some(&first_s), Some(&last_s)) = (self.times_s.first(), self.times_s.last()) else {
            return Err(RecordedError::NoRows { file: self.file });
        };
        let is_kept: Vec<_> = self.times_s.iter().map(|t| (from_s..=to_s).contains(t)).collect();
        if !is_kept.contains(&true) {
            return Err(RecordedError::NothingThere { file: self.file, from_s, to_s, first_s, last_s });
        }
        let finger = |finger: &RecordedFinger| RecordedFinger {
            name: finger.name.clone(),
            hips: kept(&finger.hips, &is_kept),
            forces: kept(&finger.forces, &is_kept),
            entities: kept(&finger.entities, &is_kept),
        };
        let fingers = self.fingers.iter().map(finger).collect();
        let body = |body: &RecordedBody| RecordedBody {
            name: body.name.clone(),
            positions: kept(&body.positions, &is_kept),
            orientations: kept(&body.orientations, &is_kept),
        };
        let bodies = self.bodies.iter().map(body).collect();
        let times_s = kept(&self.times_s, &is_kept);
        Ok(Self { times_s, fingers, bodies, ..self })
    }

    /// The entities that move.
    pub(super) fn moving(&self) -> Result<&[RecordedBody], RecordedError> {
        if self.bodies.is_empty() {
            return Err(RecordedError::NoBody { file: self.file.clone() });
        }
        Ok(&self.bodies)
    }

    /// The finger of this name; without one, all.
    pub(super) fn choose(&self, name: Option<&str>) -> Result<Vec<RecordedFinger>, RecordedError> {
        let chosen: Vec<_> = self
            .fingers
            .iter()
            .filter(|finger| name.is_none_or(|name| name == finger.name))
            .cloned()
            .collect();
        if !chosen.is_empty() {
            return Ok(chosen);
        }
        Err(RecordedError::NoFinger {
            file: self.file.clone(),
            name: name.unwrap_or_default().into(),
            known: listed(self.fingers.iter().map(|finger| finger.name.as_str())),
        })
    }
}

/// Where an entity's numbers stand in a row: where it is, and how it is turned.
fn places(
    body: &str,
    at: &impl Fn(&str) -> Result<usize, RecordedError>,
) -> Result<[usize; 7], RecordedError> {
    let mut places = [0; 7];
    for (place, quantity) in places.iter_mut().zip(["x", "y", "z", "qw", "qx", "qy", "qz"]) {
        *place = at(&format!("{body}_{quantity}"))?;
    }
    Ok(places)
}

fn kept<T: Clone>(all: &[T], is_kept: &[bool]) -> Vec<T> {
    all.iter().zip(is_kept).filter(|(_, is_kept)| **is_kept).map(|(one, _)| one.clone()).collect()
}

impl Columns {
    fn of(finger: &str, at: &impl Fn(&str) -> Result<usize, RecordedError>) -> Result<Self, RecordedError> {
        let axes = |quantity: &str| -> Result<[usize; 3], RecordedError> {
            let of = |axis| at(&format!("{finger}_{quantity}_{axis}"));
            Ok([of("x")?, of("y")?, of("z")?])
        };
        Ok(Self { hip: axes("hip")?, force: axes("force")?, entity: at(&format!("{finger}_entity"))? })
    }
}

/// A row, and what it takes to say what is wrong with it.
struct Row<'t> {
    table: &'t Table,
    row: &'t TableRow,
}

impl Row<'_> {
    fn number(&self, column: usize) -> Result<f64, RecordedError> {
        self.table.number(self.row, column)
    }

    fn vector(&self, columns: [usize; 3]) -> Result<Vector3<f64>, RecordedError> {
        let [x, y, z] = columns;
        Ok(Vector3::new(self.number(x)?, self.number(y)?, self.number(z)?))
    }
}

/// What a whole row says.
struct Sample {
    time_s: f64,
    fingers: Vec<(Vector3<f64>, Vector3<f64>, String)>,
    bodies: Vec<(Vector3<f64>, UnitQuaternion<f64>)>,
}

impl Sample {
    fn read(
        table: &mut Table,
        row: &TableRow,
        time: usize,
        columns: &[Columns],
        places: &[[usize; 7]],
    ) -> Result<Self, RecordedError> {
        let time_s = table.time(row, time)?;
        let row = Row { table, row };
        let finger = |columns: &Columns| -> Result<_, RecordedError> {
            let entity = row.row.text(columns.entity).to_owned();
            Ok((row.vector(columns.hip)?, row.vector(columns.force)?, entity))
        };
        let body = |&[x, y, z, qw, qx, qy, qz]: &[usize; 7]| -> Result<_, RecordedError> {
            let turned = Quaternion::from_parts(row.number(qw)?, row.vector([qx, qy, qz])?);
            Ok((row.vector([x, y, z])?, UnitQuaternion::new_normalize(turned)))
        };
        Ok(Self {
            time_s,
            fingers: columns.iter().map(finger).collect::<Result<_, _>>()?,
            bodies: places.iter().map(body).collect::<Result<_, _>>()?,
        })
    }

    fn append_to(self, fingers: &mut [RecordedFinger], bodies: &mut [RecordedBody]) {
        for (finger, (hip, force, entity)) in fingers.iter_mut().zip(self.fingers) {
            finger.hips.push(hip);
            finger.forces.push(force);
            finger.entities.push(entity);
        }
        for (body, (position, orientation)) in bodies.iter_mut().zip(self.bodies) {
            body.positions.push(position);
            body.orientations.push(orientation);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEADER: &str = "t,a_hip_x,a_hip_y,a_hip_z,a_force_x,a_force_y,a_force_z,a_entity,later\n";

    fn read(text: &str) -> Result<Recorded, RecordedError> {
        let directory = tempfile::tempdir().expect("a directory");
        let file = directory.path().join("r.csv");
        std::fs::write(&file, text).expect("written");
        Recorded::read(&file)
    }

    #[test]
    fn columns_are_found_by_name_and_more_of_them_do_not_matter() {
        let recorded = read(&format!("{HEADER}\"0.5\",1,2,3,4,5,6,\"ball\",x\n")).expect("a recording");
        assert_eq!(recorded.times_s, [0.5]);
        let finger = &recorded.fingers[0];
        assert_eq!((finger.name.as_str(), finger.entities[0].as_str()), ("a", "ball"));
        assert_eq!(finger.hips, [Vector3::new(1.0, 2.0, 3.0)]);
        assert_eq!(finger.forces, [Vector3::new(4.0, 5.0, 6.0)]);
    }

    #[test]
    fn what_is_no_recording_is_refused_with_file_line_and_column() {
        for (text, says) in [
            ("x,y\n1,2\n", "no column t"),
            ("t,y\n1,2\n", "no column f0_hip_x"),
            (&*HEADER.replace(",a_force_y", ""), "no column a_force_y"),
            ("t;a_hip_x\n0,5;1,2\n", "it has semicolons"),
            (&*format!("{HEADER}0.1,1,2,3,four,5,6,,\n"), "r.csv:2: a_force_x is \"four\""),
            (&*format!("{HEADER}0,1,2\n"), "r.csv:2: found 3 cells, expected 9"),
            (&*format!("{HEADER}\n0,1,2,3,4,5,6,,\n"), "r.csv:2: found an empty line"),
            (&*format!("{HEADER}\"0,1,2,3,4,5,6,,\n"), "r.csv:2: t is \"\\\"0\"; allowed: a number"),
        ] {
            let error = read(text).expect_err("refused").to_string();
            assert!(error.contains(says), "{error}");
        }
    }

    #[test]
    fn rows_before_a_bad_one_are_read_and_the_bad_one_is_a_fault() {
        let good = format!("{HEADER}0,1,2,3,4,5,6,ball,\n0.1,1,2,3,4,5,6,ball,\n");
        assert!(read(&good).expect("a recording").damage().is_none());
        for bad in ["0.2,1,2,3,4,5,six,ball,\n0.3,1,2,3,4,5,6,ball,\n", "0.2,1\n"] {
            let recorded = read(&format!("{good}{bad}")).expect("two rows").between(0.05, 1.0).expect("one");
            assert_eq!((&*recorded.times_s, recorded.fingers[0].hips.len()), (&[0.1][..], 1));
            let fault = recorded.damage().expect("a fault");
            assert_eq!(fault.exit_status(), 3);
            assert!(fault.to_string().ends_with("2 rows, up to t = 0.1 s"), "{fault}");
        }
    }

    #[test]
    fn a_part_that_is_not_there_and_a_finger_that_is_not_there_are_told() {
        let recorded = read(&format!("{HEADER}0,1,2,3,4,5,6,,\n1,1,2,3,4,5,6,,\n")).expect("a recording");
        assert_eq!(recorded.clone().between(0.5, 2.0).expect("a row").times_s, [1.0]);
        let error = recorded.clone().between(3.0, 4.0).expect_err("nothing").to_string();
        assert!(error.contains("from 0 s to 1 s"), "{error}");
        let error = read(HEADER).expect("a header").between(0.0, 1.0).expect_err("nothing").to_string();
        assert!(error.ends_with("r.csv: it has no rows"), "{error}");
        let error = recorded.choose(Some("b")).expect_err("no such finger").to_string();
        assert!(error.contains("there are: a"), "{error}");
    }
}
