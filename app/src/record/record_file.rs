//! A recording in one of its formats, as its thread writes it. Its first row or event starts it ([`Opened::start`]).
//!
//! [`Opened::start`]: super::Opened

use super::content::ContentState;
use super::events_file::EventsFile;
use super::mcap_file::McapFile;
use crate::displaced::Placed;
use crate::recording::{Recording, RecordingError};
use crate::row::{BodyRow, Row};
use std::fs::File;
use std::io;
use std::sync::Arc;
use world::events::Event;

/// A recording in one of its formats.
pub enum RecordFile {
    /// A table.
    Csv(Box<Recording>),
    /// Everything.
    Mcap(Box<McapFile>),
    /// Events alone.
    Events(Box<EventsFile>),
}

impl RecordFile {
    /// Writes what stands before the first row, where creating it did not: into what may wait for a reader.
    pub(super) fn begin(&mut self) -> Result<(), RecordingError> {
        match self {
            Self::Csv(file) => file.flush(),
            Self::Mcap(file) => file.flush(),
            Self::Events(file) => file.flush(),
        }
    }

    /// No row has come, and the file has its earlier content.
    pub(super) fn is_as_before(&self) -> bool {
        match self {
            Self::Csv(file) => file.is_as_before(),
            Self::Mcap(file) => file.is_as_before(),
            Self::Events(file) => file.is_as_before(),
        }
    }

    /// Content of the file, to be looked at from another thread.
    pub(super) fn content(&self) -> Arc<ContentState> {
        match self {
            Self::Csv(file) => file.content(),
            Self::Mcap(file) => file.content(),
            Self::Events(file) => file.content(),
        }
    }

    /// Another handle of the file, to bring it to the disk; `None`: there is no disk to reach, or it was taken.
    ///
    /// # Errors
    /// If the system has none.
    pub(super) fn take_second_handle(&mut self) -> io::Result<Option<File>> {
        match self {
            Self::Csv(file) => file.second_handle(),
            Self::Mcap(file) => Ok(file.take_second_handle()),
            Self::Events(file) => file.second_handle(),
        }
    }

    /// Nothing more is written to it.
    pub(super) fn give_up(self) {
        // What lines have gathered goes with them.
        if let Self::Mcap(file) = self {
            file.give_up();
        }
    }

    /// Rows in the file itself, or events.
    pub(super) fn rows(&self) -> u64 {
        match self {
            Self::Csv(file) => file.rows(),
            Self::Mcap(file) => file.rows(),
            Self::Events(file) => file.rows(),
        }
    }

    pub(super) fn append(
        &mut self,
        row: &Row,
        bodies: (&[BodyRow], &[u32]),
        placed: &[Placed],
    ) -> Result<(), RecordingError> {
        match self {
            Self::Csv(file) => file.append(row, bodies.0),
            Self::Mcap(file) => file.append(row, bodies, placed),
            Self::Events(file) => {
                file.start();
                Ok(())
            }
        }
    }

    pub(super) fn flush(&mut self) -> Result<(), RecordingError> {
        match self {
            Self::Csv(file) => file.flush(),
            // Its chunks are its own, and the same on every clock.
            Self::Mcap(_) => Ok(()),
            Self::Events(file) => file.flush(),
        }
    }

    pub(super) fn event(&mut self, event: &Event) -> Result<(), RecordingError> {
        match self {
            // Rows alone.
            Self::Csv(_) => {}
            Self::Mcap(file) => file.event(event),
            Self::Events(file) => file.event(event)?,
        }
        Ok(())
    }

    pub(super) fn tell_lost(&mut self, run_tick: u64, count: u64) {
        if let Self::Mcap(file) = self {
            file.tell_lost(run_tick, count);
        }
    }

    pub(super) fn finish(self) -> Result<u64, RecordingError> {
        match self {
            Self::Csv(file) => file.finish(),
            Self::Mcap(file) => file.finish(),
            Self::Events(file) => file.finish(),
        }
    }
}
