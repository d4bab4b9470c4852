//! The recording of a run as CSV: a header, then one row per fast tick.
//!
//! Model: rows are whole lines (`whole_lines.rs`), so that the file ends with a complete row whatever goes wrong. Numbers are
//! printed so that reading them back gives the same f64 (the shortest such text).
//! Units: SI; world frame; forces are forces on the user.

pub use crate::columns::Names;
use crate::columns::{Cell, columns, each_cell};
use crate::record::destination::{FormatError, STANDARD_OUTPUT, shown};
use crate::record::{Content, ContentState, Opened, OtherContent, WholeLines};
use crate::row::{BodyRow, Row};
use io_driver::device::run_time_s;
use std::fmt::Write as _;
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use thiserror::Error;

/// Why a recording could not be made, or not to its end.
#[derive(Debug, Error)]
pub enum RecordingError {
    /// The file cannot be made.
    #[error("cannot create the recording {file}: {source}; {}", remedy(.source))]
    Create {
        /// Which.
        file: PathBuf,
        /// The system's error.
        source: io::Error,
    },
    /// Nobody could write it.
    #[error("cannot record into {file}: {}", rt_core::limits::no_thread(.source))]
    NoThread {
        /// The file.
        file: PathBuf,
        /// The system's error.
        source: io::Error,
    },
    /// Another process holds a lock on it: it writes the file, or reads it.
    #[error(
        "cannot create the recording {file}: somebody holds a lock on it; name another file, or wait until it is released"
    )]
    Claimed {
        /// The file.
        file: PathBuf,
    },
    /// Its name says no format.
    #[error("cannot tell the format of {0}")]
    Format(#[from] FormatError),
    /// Nobody finds it by its name.
    #[error(
        "the recording {file} was removed or renamed during the run, or another file put in its place: its {rows} rows are not there"
    )]
    Removed {
        /// Its name.
        file: PathBuf,
        /// Rows that were in it.
        rows: u64,
    },
    /// Somebody else cut or wrote it.
    #[error(
        "another process cut the recording {file} during the run, or wrote to it: {found}; nothing more is written to it"
    )]
    OtherContent {
        /// Which.
        file: PathBuf,
        /// Length that it has and should have, or where its bytes are others.
        found: OtherContent,
    },
    /// Its first piece would not fit.
    #[error(
        "cannot write the recording {file}: {}; the run goes on without it, and what was in the file is as it was",
        rt_core::limits::with_remedy(.source)
    )]
    NotBegun {
        /// Which.
        file: PathBuf,
        /// The system's error.
        source: io::Error,
    },
    /// Nor did it, and behind the earlier content is some by which room was tried.
    #[error(
        "cannot write the recording {file}: {}; the run goes on without it; behind the earlier content of the file are {bytes} \
         bytes that could not be cut off",
        rt_core::limits::with_remedy(.source)
    )]
    Noise {
        /// Which.
        file: PathBuf,
        /// The system's error.
        source: io::Error,
        /// Length of the noise.
        bytes: u64,
    },
    /// The same of a file of events.
    #[error("{}", .0.to_string().replacen("the recording", "the file of events", 1))]
    OfEvents(Box<RecordingError>),
    /// It cannot be written any further.
    #[error(
        "cannot write the recording {file}: {source}; the run goes on without it; it is complete up to t = {until_s} s ({rows} rows)"
    )]
    Write {
        /// Which.
        file: PathBuf,
        /// The system's error.
        source: io::Error,
        /// Time of the last row on disk.
        until_s: f64,
        /// Rows on disk.
        rows: u64,
    },
}

impl RecordingError {
    /// The same, told of a file of events.
    pub(crate) fn of_events(self) -> Self {
        Self::OfEvents(Box::new(self))
    }

    /// Refusal of a write to a file that is complete up to the last of so many rows, by what the file has now.
    pub(crate) fn of_write(
        file: &Path,
        source: io::Error,
        content: &ContentState,
        (until_s, rows): (f64, u64),
    ) -> Self {
        let file = file.to_owned();
        if let Some(found) = OtherContent::of(&source) {
            return Self::OtherContent { file, found };
        }
        match content.load() {
            Content::Earlier => Self::NotBegun { file, source },
            Content::Noisy => Self::Noise { file, source, bytes: content.noise_bytes() },
            _ => Self::Write { file, source, until_s, rows },
        }
    }

    /// The same when nothing is behind the earlier content any more.
    pub(crate) fn without_noise(self) -> Self {
        match self {
            Self::Noise { file, source, .. } => Self::NotBegun { file, source },
            Self::OfEvents(error) => error.without_noise().of_events(),
            other => other,
        }
    }

    /// Failure of the write, of whichever kind of file.
    pub fn cause(&self) -> &Self {
        if let Self::OfEvents(error) = self { error.cause() } else { self }
    }

    /// True if nothing was recorded yet.
    pub fn is_of_the_start(&self) -> bool {
        matches!(
            self.cause(),
            Self::Create { .. } | Self::NoThread { .. } | Self::Claimed { .. } | Self::Format(_)
        )
    }

    /// The file that it is about.
    pub fn file(&self) -> &Path {
        match self {
            Self::Create { file, .. }
            | Self::NoThread { file, .. }
            | Self::Claimed { file }
            | Self::Removed { file, .. }
            | Self::OtherContent { file, .. }
            | Self::NotBegun { file, .. }
            | Self::Noise { file, .. }
            | Self::Write { file, .. } => file,
            Self::OfEvents(error) => error.file(),
            Self::Format(FormatError::Unknown { file, .. } | FormatError::ParquetOfRun { file, .. }) => file,
        }
    }

    /// Whether nobody reads the standard output any more: who has seen enough is no failure.
    pub fn is_of_a_reader_who_left(&self) -> bool {
        let is_pipe = |file: &Path| file == shown(Path::new(STANDARD_OUTPUT));
        matches!(self.cause(), Self::Write { file, source, .. } if source.kind() == io::ErrorKind::BrokenPipe && is_pipe(file))
    }
}

fn remedy(source: &io::Error) -> String {
    let known = rt_core::limits::remedy(source);
    known.unwrap_or_else(|| "name a file in a directory that exists and can be written".into())
}

/// A recording being written.
#[derive(Debug)]
pub struct Recording {
    lines: WholeLines,
    path: PathBuf,
    names: Names,
    period_ns: u64,
}

impl Recording {
    /// Creates the file and writes the header; a file that is there keeps its content until the first
    /// rows.
    ///
    /// # Errors
    /// If the file cannot be made or its first line not be written.
    pub fn create(path: &Path, names: Names, period_ns: u64) -> Result<Self, RecordingError> {
        Self::begin(Opened::recording(path)?, names, period_ns)
    }

    /// Writes the header; into what may wait for a reader or has content, with what follows.
    ///
    /// # Errors
    /// If its first line cannot be written.
    pub fn begin(file: Opened, names: Names, period_ns: u64) -> Result<Self, RecordingError> {
        let path = shown(file.path());
        let lines = WholeLines::begin(file, &header(&names))
            .map_err(|source| RecordingError::Create { file: path.clone(), source })?;
        Ok(Self { lines, path, names, period_ns })
    }

    /// No row has come, and the file has its earlier content.
    pub fn is_as_before(&self) -> bool {
        self.lines.is_as_before()
    }

    /// Content of the file, to be looked at from another thread.
    pub(crate) fn content(&self) -> Arc<ContentState> {
        self.lines.content()
    }

    /// Another handle of the file ([`Opened::second_handle`]).
    ///
    /// # Errors
    /// As there.
    pub(crate) fn second_handle(&self) -> io::Result<Option<File>> {
        self.lines.second_handle()
    }

    /// Rows in the file.
    pub fn rows(&self) -> u64 {
        self.lines.rows()
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
        let Self { lines, names, period_ns, .. } = self;
        let written = lines.append(row.run_tick, |line| write_row(line, row, bodies, names, *period_ns));
        written.map_err(|source| self.failed(source))
    }

    /// Writes everything out to the disk itself. Returns the number of rows.
    ///
    /// # Errors
    /// If that fails, or nobody would find it.
    pub fn finish(mut self) -> Result<u64, RecordingError> {
        self.lines.keep().and_then(|()| self.lines.sync()).map_err(|source| self.failed(source))?;
        let rows = self.lines.rows();
        if self.lines.is_removed() {
            Err(RecordingError::Removed { file: self.path, rows })
        } else {
            Ok(rows)
        }
    }

    /// Writes the rows that are not on disk yet.
    ///
    /// # Errors
    /// If that fails; rows that did reach the file are complete.
    pub fn flush(&mut self) -> Result<(), RecordingError> {
        self.lines.flush().map_err(|source| self.failed(source))
    }

    fn failed(&self, source: io::Error) -> RecordingError {
        let until_s = run_time_s(self.lines.last_tick().cast_signed(), self.period_ns);
        RecordingError::of_write(&self.path, source, &self.content(), (until_s, self.lines.rows()))
    }
}

/// The names of all columns.
fn header(names: &Names) -> String {
    columns(names).into_iter().map(|column| column.name).collect::<Vec<_>>().join(",")
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
            as_of: false,
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
        let added = ",b_qw,b_qx,b_qy,b_qz,b_buttons";
        assert_eq!(header(&names), plain + added, "behind the last finger's others");
        let mut told = row(0, 1.0);
        told.fingers[1].orientation_wxyz = [0.5, -0.5, 0.5, -0.5];
        told.fingers[1].buttons = 5;
        let mut line = String::new();
        write_row(&mut line, &told, &[], &names, 1_000_000);
        assert!(line.ends_with(",0.5,-0.5,0.5,-0.5,5"), "{line}");
        assert_eq!(line.matches(',').count(), header(&names).matches(',').count());
    }

    #[test]
    fn only_a_finger_that_is_kept_passive_tells_its_energy() {
        let plain = header(&names());
        let names = Names { passive: vec![false, true], ..names() };
        assert_eq!(header(&names), plain + ",b_energy,b_controlled");
        let mut told = row(0, 1.0);
        (told.fingers[1].energy_j, told.fingers[1].controlled_n) = (-1.5e-3, 0.25);
        let mut line = String::new();
        write_row(&mut line, &told, &[], &names, 1_000_000);
        assert!(line.ends_with(",-0.0015,0.25"), "{line}");
        assert_eq!(line.matches(',').count(), header(&names).matches(',').count());
    }

    #[test]
    fn only_a_finger_with_a_radius_has_columns_for_its_torque() {
        let plain = header(&names());
        let names = Names { torques: vec![false, true], ..names() };
        let added = ",b_torque_x,b_torque_y,b_torque_z";
        assert_eq!(header(&names), plain + added, "behind the last finger's others");
        let mut told = row(0, 1.0);
        told.fingers[1].torque_on_user = Vector3::new(0.5, -0.25, 0.0);
        let mut line = String::new();
        write_row(&mut line, &told, &[], &names, 1_000_000);
        assert!(line.ends_with(",0.5,-0.25,0.0"), "{line}");
    }

    #[test]
    fn what_moves_tells_its_pose_and_how_it_moves_behind_all_fingers() {
        let plain = header(&names());
        let names = Names { bodies: vec!["cube".into()], ..names() };
        let added = "cube_x,cube_y,cube_z,cube_qw,cube_qx,cube_qy,cube_qz,cube_vx,cube_vy,cube_vz,cube_wx,cube_wy,cube_wz";
        assert_eq!(header(&names), format!("{plain},{added}"));
        let body = BodyRow {
            position: Vector3::new(1.0, 2.0, 3.0),
            orientation: nalgebra::Quaternion::new(0.5, -0.5, 0.5, -0.25),
            velocity: Vector3::new(4.0, 5.0, 6.0),
            angular_velocity: Vector3::new(7.0, 8.0, 9.0),
            ..BodyRow::default()
        };
        let mut line = String::new();
        write_row(&mut line, &row(0, 1.0), &[body], &names, 1_000_000);
        assert!(line.ends_with(",1.0,2.0,3.0,0.5,-0.5,0.5,-0.25,4.0,5.0,6.0,7.0,8.0,9.0"), "{line}");
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
}
