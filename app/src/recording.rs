//! The recording of a run as CSV: a header, then one row per fast tick.
//!
//! Model: rows are formatted into a buffer and written in whole rows. Numbers are printed so that reading
//! them back gives the same f64 (the shortest such text).
//! Invariant: whatever goes wrong, the file on disk ends with a complete row: a write that failed half way
//! (a full disk) is cut back to the last row that fits.
//! Units: SI; world frame; forces are forces on the user.

pub use crate::columns::Names;
use crate::columns::{Cell, columns, each_cell};
use crate::record::Opened;
use crate::record::destination::{FormatError, STANDARD_OUTPUT, shown};
use crate::row::{BodyRow, Row};
use io_driver::device::run_time_s;
use std::fmt::Write as _;
use std::fs::File;
use std::io::{self, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use thiserror::Error;

/// Written at once when this much has come together.
const CHUNK_BYTES: usize = 256 * 1024;

/// Why a recording could not be made, or not to its end.
#[derive(Debug, Error)]
pub enum RecordingError {
    /// The file cannot be made.
    #[error(
        "cannot create the recording {file}: {source}; name a file in a directory that exists and can be written"
    )]
    Create {
        /// Which.
        file: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// Its name says no format.
    #[error("cannot tell the format of {0}")]
    Format(#[from] FormatError),
    /// It cannot be written any further.
    #[error(
        "cannot write the recording {file}: {source}; the run goes on without it; it is complete up to t = {until_s} s ({rows} rows)"
    )]
    Write {
        /// Which.
        file: PathBuf,
        /// What the system said.
        source: io::Error,
        /// Time of the last row on disk.
        until_s: f64,
        /// Rows on disk.
        rows: u64,
    },
}

impl RecordingError {
    /// Whether nobody reads the standard output any more: who has seen enough is no failure.
    pub fn is_of_a_reader_who_left(&self) -> bool {
        let is_pipe = |file: &Path| file == shown(Path::new(STANDARD_OUTPUT));
        matches!(self, Self::Write { file, source, .. } if source.kind() == io::ErrorKind::BrokenPipe && is_pipe(file))
    }
}

/// A recording being written.
#[derive(Debug)]
pub struct Recording {
    file: File,
    path: PathBuf,
    names: Names,
    period_ns: u64,
    /// Whole rows that are not on disk yet.
    buffer: String,
    /// End of each of these rows in the buffer, and its tick.
    ends: Vec<(usize, u64)>,
    written_bytes: u64,
    rows: u64,
    last_tick: u64,
}

impl Recording {
    /// Creates the file, or empties it, and writes the header.
    ///
    /// # Errors
    /// If the file cannot be made or its first line not be written.
    pub fn create(path: &Path, names: Names, period_ns: u64) -> Result<Self, RecordingError> {
        Self::begin(Opened::recording(path)?, names, period_ns)
    }

    /// Empties the file and writes the header.
    ///
    /// # Errors
    /// If its first line cannot be written.
    pub fn begin(file: Opened, names: Names, period_ns: u64) -> Result<Self, RecordingError> {
        let path = shown(file.path());
        let failed = |source| RecordingError::Create { file: path.clone(), source };
        let file = file.empty().map_err(failed)?;
        // Behind what others have written to a standard output that is a file.
        let written_bytes = file.metadata().map_err(failed)?.len();
        let mut recording = Self {
            file,
            path,
            buffer: String::with_capacity(2 * CHUNK_BYTES),
            ends: Vec::new(),
            written_bytes,
            rows: 0,
            last_tick: 0,
            period_ns,
            names,
        };
        recording.buffer = header(&recording.names);
        recording.flush().map_err(|error| match error {
            RecordingError::Write { file, source, .. } => RecordingError::Create { file, source },
            other => other,
        })?;
        Ok(recording)
    }

    /// Where it lies.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Takes over the entities and spaces that others have learnt of since: who reads a table back meets them one by one.
    pub fn learn_entities(&mut self, names: &Names) {
        if self.names.entities.len() < names.entities.len() {
            self.names.entities.clone_from(&names.entities);
        }
        if self.names.spaces != names.spaces {
            self.names.spaces.clone_from(&names.spaces);
        }
    }

    /// Appends a row and its bodies.
    ///
    /// # Errors
    /// If the rows before it, or it, cannot be written.
    pub fn append(&mut self, row: &Row, bodies: &[BodyRow]) -> Result<(), RecordingError> {
        write_row(&mut self.buffer, row, bodies, &self.names, self.period_ns);
        self.ends.push((self.buffer.len(), row.run_tick));
        if self.buffer.len() >= CHUNK_BYTES { self.flush() } else { Ok(()) }
    }

    /// Writes everything out to the disk itself. Returns the number of rows.
    ///
    /// # Errors
    /// If that fails.
    pub fn finish(mut self) -> Result<u64, RecordingError> {
        self.flush()?;
        match self.file.sync_data() {
            Ok(()) => Ok(self.rows),
            // A pipe or a character device has no disk to reach.
            Err(error) if error.kind() == io::ErrorKind::InvalidInput => Ok(self.rows),
            Err(source) => Err(self.failed(source)),
        }
    }

    /// Writes the rows that are not on disk yet.
    ///
    /// # Errors
    /// If that fails; rows that did reach the file are complete.
    pub fn flush(&mut self) -> Result<(), RecordingError> {
        let mut done = 0;
        let bytes = self.buffer.as_bytes();
        let failure = loop {
            if done == bytes.len() {
                break None;
            }
            match self.file.write(&bytes[done..]) {
                Ok(0) => break Some(io::ErrorKind::WriteZero.into()),
                Ok(more) => done += more,
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) => break Some(error),
            }
        };
        self.keep_whole_rows(done);
        self.buffer.clear();
        self.ends.clear();
        failure.map_or(Ok(()), |source| Err(self.failed(source)))
    }

    /// Counts what reached the file and cuts a row that did so only in part.
    fn keep_whole_rows(&mut self, done: usize) {
        let whole = self.ends.iter().take_while(|(end, _)| *end <= done).count();
        let mut kept = if done == self.buffer.len() { done } else { 0 };
        if whole > 0 {
            let (end, tick) = self.ends[whole - 1];
            self.rows += whole as u64;
            self.last_tick = tick;
            kept = kept.max(end);
        }
        self.written_bytes += kept as u64;
        if kept < done {
            // If even this fails, the message still says how many rows are good.
            let _ = self.file.set_len(self.written_bytes);
            let _ = self.file.seek(SeekFrom::Start(self.written_bytes));
        }
    }

    fn failed(&self, source: io::Error) -> RecordingError {
        let until_s = run_time_s(self.last_tick as i64, self.period_ns);
        RecordingError::Write { file: self.path.clone(), source, until_s, rows: self.rows }
    }
}

/// The names of all columns.
fn header(names: &Names) -> String {
    let mut line = columns(names).into_iter().map(|column| column.name).collect::<Vec<_>>().join(",");
    line.push('\n');
    line
}

fn write_row(line: &mut String, row: &Row, bodies: &[BodyRow], names: &Names, period_ns: u64) {
    let start = line.len();
    each_cell(row, bodies, names, period_ns, |cell| {
        if line.len() > start {
            line.push(',');
        }
        let _ = match cell {
            Cell::Number(number) => write!(line, "{number:?}"),
            Cell::Whole(number) => write!(line, "{number}"),
            Cell::Text(text) => line.write_str(text),
        };
    });
    line.push('\n');
}

#[cfg(test)]
mod tests {
    use super::*;
    use io_driver::device::Extras;
    use nalgebra::Vector3;

    fn names() -> Names {
        Names {
            fingers: vec!["a".into(), "b".into()],
            extras: Vec::new(),
            passive: Vec::new(),
            torques: Vec::new(),
            entities: vec!["table".into()],
            bodies: Vec::new(),
            ties: Vec::new(),
            grasp_quality: false,
            spaces: None,
            lists: false,
        }
    }

    fn row(run_tick: u64, number: f64) -> Row {
        let mut row = Row { run_tick, ..Row::empty() };
        row.fingers[0].hip = Vector3::new(number, -0.0, 1e-300);
        row.fingers[1].entity = Some(0);
        row
    }

    #[test]
    fn every_row_has_the_header_s_columns_and_numbers_read_back_as_they_were() {
        let directory = tempfile::tempdir().expect("a directory");
        let path = directory.path().join("r.csv");
        let mut recording = Recording::create(&path, names(), 1_000_000).expect("created");
        recording.append(&row(3, 0.1 + 0.2), &[]).expect("appended");
        assert_eq!(recording.finish().expect("finished"), 1);
        let text = std::fs::read_to_string(&path).expect("readable");
        let lines: Vec<Vec<&str>> = text.lines().map(|line| line.split(',').collect()).collect();
        assert_eq!(lines.len(), 2);
        assert_eq!(lines[0].len(), 1 + 2 * 15);
        assert_eq!(lines[1].len(), lines[0].len());
        assert_eq!(lines[0][..4], ["t", "a_hip_x", "a_hip_y", "a_hip_z"]);
        assert_eq!(lines[1][0], "0.003");
        let back: Vec<u64> =
            lines[1][1..4].iter().map(|n| n.parse::<f64>().expect("a number").to_bits()).collect();
        assert_eq!(back, [0.1 + 0.2, -0.0, 1e-300f64].map(f64::to_bits));
        let at = |name: &str| lines[0].iter().position(|column| *column == name).expect("a column");
        assert_eq!(lines[1][at("a_entity")], "");
        assert_eq!(lines[1][at("b_entity")], "table");
        assert_eq!(lines[1][at("b_feature")], "none");
        assert_eq!(lines[1][at("b_friction")], "free");
    }

    #[test]
    fn only_a_device_that_tells_more_has_more_columns() {
        let extras = vec![Extras::default(), Extras { orientation: true, buttons: true }];
        let plain = header(&names());
        let names = Names { extras, ..names() };
        let added = ",b_qw,b_qx,b_qy,b_qz,b_buttons\n";
        assert_eq!(header(&names), plain.trim_end().to_owned() + added, "behind the last finger's others");
        let mut told = row(0, 1.0);
        told.fingers[1].orientation_wxyz = [0.5, -0.5, 0.5, -0.5];
        told.fingers[1].buttons = 5;
        let mut line = String::new();
        write_row(&mut line, &told, &[], &names, 1_000_000);
        assert!(line.ends_with(",0.5,-0.5,0.5,-0.5,5\n"), "{line}");
        assert_eq!(line.matches(',').count(), header(&names).matches(',').count());
    }

    #[test]
    fn only_a_finger_that_is_kept_passive_tells_its_energy() {
        let plain = header(&names());
        let names = Names { passive: vec![false, true], ..names() };
        assert_eq!(header(&names), plain.trim_end().to_owned() + ",b_energy,b_controlled\n");
        let mut told = row(0, 1.0);
        (told.fingers[1].energy_j, told.fingers[1].controlled_n) = (-1.5e-3, 0.25);
        let mut line = String::new();
        write_row(&mut line, &told, &[], &names, 1_000_000);
        assert!(line.ends_with(",-0.0015,0.25\n"), "{line}");
        assert_eq!(line.matches(',').count(), header(&names).matches(',').count());
    }

    #[test]
    fn only_a_finger_with_a_radius_has_columns_for_its_torque() {
        let plain = header(&names());
        let names = Names { torques: vec![false, true], ..names() };
        let added = ",b_torque_x,b_torque_y,b_torque_z\n";
        assert_eq!(header(&names), plain.trim_end().to_owned() + added, "behind the last finger's others");
        let mut told = row(0, 1.0);
        told.fingers[1].torque_on_user = Vector3::new(0.5, -0.25, 0.0);
        let mut line = String::new();
        write_row(&mut line, &told, &[], &names, 1_000_000);
        assert!(line.ends_with(",0.5,-0.25,0.0\n"), "{line}");
    }

    #[test]
    fn what_moves_tells_its_pose_and_how_it_moves_behind_all_fingers() {
        let plain = header(&names());
        let names = Names { bodies: vec!["cube".into()], ..names() };
        let added = "cube_x,cube_y,cube_z,cube_qw,cube_qx,cube_qy,cube_qz,cube_vx,cube_vy,cube_vz,cube_wx,cube_wy,cube_wz";
        assert_eq!(header(&names), format!("{},{added}\n", plain.trim_end()));
        let body = BodyRow {
            position: Vector3::new(1.0, 2.0, 3.0),
            orientation: nalgebra::Quaternion::new(0.5, -0.5, 0.5, -0.25),
            velocity: Vector3::new(4.0, 5.0, 6.0),
            angular_velocity: Vector3::new(7.0, 8.0, 9.0),
            ..BodyRow::default()
        };
        let mut line = String::new();
        write_row(&mut line, &row(0, 1.0), &[body], &names, 1_000_000);
        assert!(line.ends_with(",1.0,2.0,3.0,0.5,-0.5,0.5,-0.25,4.0,5.0,6.0,7.0,8.0,9.0\n"), "{line}");
        assert_eq!(line.matches(',').count(), header(&names).matches(',').count());
    }

    #[test]
    fn a_full_disk_leaves_complete_rows_and_says_how_many() {
        // /dev/full refuses every byte: the header already fails, as on a disk full from the start.
        let error = Recording::create(Path::new("/dev/full"), names(), 1_000_000).expect_err("full");
        assert!(
            error.to_string().starts_with("cannot create the recording /dev/full: No space left"),
            "{error}"
        );
    }

    #[test]
    fn a_row_that_reached_the_file_only_in_part_is_cut_off() {
        let directory = tempfile::tempdir().expect("a directory");
        let path = directory.path().join("r.csv");
        let mut recording = Recording::create(&path, names(), 1_000_000).expect("created");
        recording.append(&row(0, 1.0), &[]).expect("appended");
        recording.append(&row(1, 2.0), &[]).expect("appended");
        let bytes = recording.buffer.clone().into_bytes();
        let half = recording.ends[0].0 + 5;
        recording.file.write_all(&bytes[..half]).expect("written");
        recording.keep_whole_rows(half);
        let text = std::fs::read_to_string(&path).expect("readable");
        assert_eq!(text.lines().count(), 2, "header and one row");
        assert!(text.ends_with('\n'));
        assert_eq!((recording.rows, recording.last_tick), (1, 0));
    }
}
