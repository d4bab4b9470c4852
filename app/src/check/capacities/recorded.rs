//! Bytes that recordings of a scene take, by writing some rows into memory.

use crate::record::{About, McapFile, Opened, View};
use crate::recording::Recording;
use crate::rig::Rig;
use crate::row::{BodyRow, Row};
use haptics::Entity;
use io_driver::device::Extras;
use rustix::fs::{MemfdFlags, memfd_create};
use std::fs::File;
use std::path::Path;
use std::time::{Duration, Instant};

/// A table and an MCAP of the same rows; `None`: it cannot be written.
pub(super) struct Bytes {
    csv: Option<Written<Recording>>,
    mcap: Option<Written<McapFile>>,
    /// The most rows of the table.
    most: usize,
    /// Time that is left for the MCAP.
    left: Duration,
}

/// A recording, its file, and how long that was without rows.
struct Written<R> {
    recording: R,
    file: File,
    begins: u64,
    rows: usize,
}

impl Bytes {
    /// Nothing yet, of rows with so many bodies.
    pub(super) fn new(rig: &Rig, entities: &[Entity], bodies: usize) -> Self {
        let names = rig.names(&vec![Extras::default(); rig.device_count()]);
        let period_ns = rig.period_ns;
        let csv = in_memory().and_then(|(file, opened)| {
            let mut recording = Recording::begin(opened, names.clone(), period_ns).ok()?;
            recording.flush().ok()?;
            Written::begin(recording, file)
        });
        let view = View::new(&rig.scene, entities, false);
        let mcap = in_memory().and_then(|(file, opened)| {
            let mut recording = McapFile::create(opened, names, period_ns, &About::default(), view).ok()?;
            recording.flush().ok()?;
            Written::begin(recording, file)
        });
        let most = (MOST_BODIES / bodies.max(1)).clamp(LEAST_ROWS, MOST_ROWS);
        Self { csv, mcap, most, left: MCAP_BUDGET }
    }

    /// Takes in a row and its bodies, unless there are enough.
    pub(super) fn add(&mut self, row: &Row, bodies: &[BodyRow]) {
        if let Some(csv) = self.csv.as_mut().filter(|csv| csv.rows < self.most) {
            csv.rows += 1;
            if csv.recording.append(row, bodies).is_err() {
                self.csv = None;
            }
        }
        let has_time = !self.left.is_zero();
        if let Some(mcap) = self.mcap.as_mut().filter(|mcap| has_time && mcap.rows < MOST_ROWS) {
            let begin = Instant::now();
            mcap.rows += 1;
            if mcap.recording.append(row, bodies, &[]).is_err() {
                self.mcap = None;
            }
            self.left = self.left.saturating_sub(begin.elapsed());
        }
    }

    /// In the mean, of the table and of the MCAP; `None` where that could not be written.
    pub(super) fn a_row(mut self) -> [Option<f64>; 2] {
        let csv = self.csv.as_mut().and_then(|csv| {
            csv.recording.flush().ok()?;
            csv.of_row()
        });
        let mcap = self.mcap.as_mut().and_then(|mcap| {
            mcap.recording.flush().ok()?;
            mcap.of_row()
        });
        [csv, mcap]
    }
}

impl<R> Written<R> {
    fn begin(recording: R, file: File) -> Option<Self> {
        let begins = file.metadata().ok()?.len();
        Some(Self { recording, file, begins, rows: 0 })
    }

    /// Bytes of a row in the mean.
    fn of_row(&self) -> Option<f64> {
        let bytes = self.file.metadata().ok()?.len().checked_sub(self.begins)?;
        (self.rows > 0).then(|| bytes as f64 / self.rows as f64)
    }
}

/// A file in memory, twice.
fn in_memory() -> Option<(File, Opened)> {
    let file = File::from(memfd_create("capacities", MemfdFlags::CLOEXEC).ok()?);
    let opened = Opened::of(file.try_clone().ok()?, Path::new("memory")).ok()?;
    Some((file, opened))
}

/// Rows of a table with more bodies are fewer; those of an MCAP tell what has changed.
const MOST_BODIES: usize = 100_000;
const LEAST_ROWS: usize = 2;
/// An MCAP has a new beginning after as many.
const MOST_ROWS: usize = 500;
const MCAP_BUDGET: Duration = Duration::from_millis(150);
