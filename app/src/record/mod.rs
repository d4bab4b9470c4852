//! Recordings: written while a run goes on, and read again.
//!
//! Problem: people who felt something want to see it, plot it, publish it and feel it again; and neither a slow disk, a
//! full one nor a killed process may disturb what is felt or cost what was recorded before.
//!
//! Model: the fast thread leaves rows (`row_queue.rs`); the slow side hands them to a [`Recorder`] for each file, which
//! writes on a thread of its own. The format goes by the file's ending ([`destination`]): a table (CSV, `recording.rs`), or
//! [`McapFile`], which has the events, a picture and the run's inputs beside the rows. [`read`] reads both.

mod about;
pub(crate) mod backpressure;
mod changes;
mod content;
mod descriptor;
pub mod destination;
mod event_line;
mod events_file;
mod files;
mod foxglove;
mod marks;
mod mcap_file;
mod on_disk;
mod opened;
pub mod read;
mod record_file;
mod recorder;
mod schema;
mod tick;
mod view;
mod whole_lines;
mod wire;

pub use about::{About, Beginning, InputFile};
pub use backpressure::Backpressure;
pub(crate) use content::{Content, ContentState};
pub use events_file::EventsFile;
pub use files::Files;
pub use mcap_file::McapFile;
pub use opened::{Opened, OtherContent, begin_all};
pub use record_file::RecordFile;
pub use recorder::{EventFeed, Recorded, Recorder};
pub use view::{View, shows_scene};
pub(crate) use whole_lines::WholeLines;

use crate::book::Book;
use crate::recording::{Names, Recording, RecordingError};
use destination::RunFormat;
use std::path::Path;

/// Empties the file and begins the recording in the format that its name ends with; of the scene of this number in a run
/// that has several.
///
/// # Errors
/// If that cannot be done, or its name says no format.
pub fn create(
    file: Opened,
    names: Names,
    period_ns: u64,
    about: &About,
    view: &View,
    scene: (&Book, u32),
) -> Result<RecordFile, RecordingError> {
    Ok(match RunFormat::of(file.path())? {
        RunFormat::Csv => RecordFile::Csv(Box::new(Recording::begin(file, names, period_ns)?)),
        RunFormat::Mcap => {
            let file = McapFile::create(file, names, period_ns, about, view.clone())?.of_scene(scene);
            RecordFile::Mcap(Box::new(file))
        }
    })
}

/// The same of a recording that begins in the middle of its scene, when the run has come to this tick.
///
/// # Errors
/// If it cannot be made.
pub fn create_under_way(
    path: &Path,
    names: Names,
    period_ns: u64,
    about: &About,
    view: &View,
    (scene, begins): ((&Book, u32), u64),
) -> Result<RecordFile, RecordingError> {
    let file = Opened::recording(path)?;
    if RunFormat::of(path)? == RunFormat::Mcap {
        let file = McapFile::create_at(file, names, period_ns, about, view.clone(), begins)?;
        return Ok(RecordFile::Mcap(Box::new(file.of_scene(scene).under_way())));
    }
    create(file, names, period_ns, about, view, scene)
}

/// Begins a file of events alone: a line each, as JSON or, with the ending `.csv`, as a table.
///
/// # Errors
/// If it cannot be made.
pub fn create_events(
    file: Opened,
    names: Names,
    period_ns: u64,
    book: &Book,
) -> Result<RecordFile, RecordingError> {
    Ok(RecordFile::Events(Box::new(EventsFile::create(file, names, period_ns, book.clone())?)))
}
