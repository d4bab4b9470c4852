//! The most bytes that recordings of a scene take, by writing some rows into memory in which everything moves.

use crate::record::{About, McapFile, Opened, View};
use crate::recording::Recording;
use crate::rig::Rig;
use crate::row::{BodyRow, Row};
use haptics::Entity;
use io_driver::device::Extras;
use rustix::fs::{MemfdFlags, memfd_create};
use std::fs::File;
use std::path::Path;

/// A recording, its file, and how long that was without rows.
struct Written<R> {
    recording: R,
    file: File,
    begins: u64,
    rows: usize,
}

/// Bytes of a row in the mean, of a table and of an MCAP, where all that moves does so; `None` where that cannot be written.
pub(super) fn most_bytes_a_row(rig: &Rig, entities: &[Entity], mut bodies: Vec<BodyRow>) -> [Option<f64>; 2] {
    let names = rig.names(&vec![Extras::default(); rig.device_count()]);
    let (period_ns, rows) = (rig.period_ns, (MOST_BODIES / bodies.len().max(1)).clamp(LEAST_ROWS, MOST_ROWS));
    let mut csv = in_memory().and_then(|(file, opened)| {
        let mut recording = Recording::begin(opened, names.clone(), period_ns).ok()?;
        recording.flush().ok()?;
        Written::begin(recording, file)
    });
    let view = View::new(&rig.scene, entities, false);
    let mut mcap = in_memory().and_then(|(file, opened)| {
        let mut recording = McapFile::create(opened, names, period_ns, &About::default(), view).ok()?;
        recording.flush().ok()?;
        Written::begin(recording, file)
    });
    let mut row = Row::empty();
    let mut digits = Digits(1);
    let all: Vec<u32> = (0..bodies.len() as u32).collect();
    for run_tick in 0..rows as u64 {
        row.run_tick = run_tick;
        for finger in row.fingers.iter_mut().take(rig.scene.fingers.len()) {
            let vectors = [&mut finger.hip, &mut finger.god_object, &mut finger.velocity];
            vectors.into_iter().for_each(|vector| digits.fill(vector.iter_mut()));
            digits.fill(finger.force_on_user.iter_mut().chain(finger.applied_on_user.iter_mut()));
        }
        for body in &mut bodies {
            digits.fill(body.position.iter_mut().chain(body.velocity.iter_mut()));
            digits.fill(body.orientation.coords.iter_mut().chain(body.angular_velocity.iter_mut()));
        }
        csv = csv.and_then(|mut csv| {
            csv.recording.append(&row, &bodies).ok()?;
            Some(Written { rows: csv.rows + 1, ..csv })
        });
        mcap = mcap.and_then(|mut mcap| {
            mcap.recording.append(&row, (&bodies, &all), &[]).ok()?;
            Some(Written { rows: mcap.rows + 1, ..mcap })
        });
    }
    let csv = csv.and_then(|mut csv| {
        csv.recording.flush().ok()?;
        csv.of_row()
    });
    let mcap = mcap.and_then(|mut mcap| {
        mcap.recording.flush().ok()?;
        mcap.of_row()
    });
    [csv, mcap]
}

/// Numbers with all of their digits.
struct Digits(u64);

impl Digits {
    fn fill<'n>(&mut self, numbers: impl Iterator<Item = &'n mut f64>) {
        for number in numbers {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            *number = 0.5 - (self.0 >> 11) as f64 / (1_u64 << 53) as f64;
        }
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

/// Of more bodies rows are fewer.
const MOST_BODIES: usize = 50_000;
/// Pictures are in every twentieth at 1 kHz.
const LEAST_ROWS: usize = 4;
const MOST_ROWS: usize = 400;
