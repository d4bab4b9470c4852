//! What happened in a run, and nothing else: a line for each event.

use super::content::ContentState;
use super::destination::{EventFormat, shown};
use super::event_line::{KEYS, csv, json, said};
use super::opened::Opened;
use super::whole_lines::WholeLines;
use crate::book::Book;
use crate::columns::Names;
use crate::recording::RecordingError;
use io_driver::device::run_time_s;
use std::fs::File;
use std::io;
use std::path::PathBuf;
use std::sync::Arc;
use world::events::{Event, Kind};

/// A file of events being written.
pub struct EventsFile {
    lines: WholeLines,
    path: PathBuf,
    names: Names,
    book: Book,
    period_ns: u64,
    is_table: bool,
    /// Lines that tell of events that are missing.
    losses: u64,
}

impl EventsFile {
    /// Begins the file, which keeps what it has until it is started.
    ///
    /// # Errors
    /// If that cannot be done, or its name says no format.
    pub fn create(file: Opened, names: Names, period_ns: u64, book: Book) -> Result<Self, RecordingError> {
        let path = shown(file.path());
        let is_table = EventFormat::of(file.path())? == EventFormat::Csv;
        let header = if is_table { KEYS.join(",") } else { String::new() };
        let lines = WholeLines::begin(file, &header)
            .map_err(|source| RecordingError::Create { file: path.clone(), source }.of_events())?;
        Ok(Self { lines, path, names, book, period_ns, is_table, losses: 0 })
    }

    /// The run goes: a file without events is a result, too.
    pub fn start(&mut self) {
        self.lines.start();
    }

    /// No tick has come, and the file has its earlier content.
    pub fn is_as_before(&self) -> bool {
        self.lines.is_as_before()
    }

    /// Events in the file.
    pub fn rows(&self) -> u64 {
        self.lines.rows().saturating_sub(self.losses)
    }

    /// Content of the file, to be looked at from another thread.
    pub(super) fn content(&self) -> Arc<ContentState> {
        self.lines.content()
    }

    /// Another handle of the file ([`Opened::second_handle`]).
    ///
    /// # Errors
    /// As there.
    pub(super) fn second_handle(&self) -> io::Result<Option<File>> {
        self.lines.second_handle()
    }

    /// Appends an event.
    ///
    /// # Errors
    /// If it or what was before it cannot be written.
    pub fn event(&mut self, event: &Event) -> Result<(), RecordingError> {
        self.losses += u64::from(matches!(event.kind, Kind::Lost { .. }));
        let mut said = said(event, &self.book);
        if let Some((_, names)) = said.1.take() {
            self.names = names;
        }
        let line = if self.is_table { csv } else { json }(event, &said.0, &self.names, self.period_ns);
        self.lines.append(event.run_tick, |lines| lines.push_str(&line)).map_err(|source| self.failed(source))
    }

    /// Hands over to the system what has not been.
    ///
    /// # Errors
    /// If that fails.
    pub fn flush(&mut self) -> Result<(), RecordingError> {
        self.lines.flush().map_err(|source| self.failed(source))
    }

    /// Writes the rest out to the disk itself; says how many events there are.
    ///
    /// # Errors
    /// If that fails, or nobody would find it.
    pub fn finish(mut self) -> Result<u64, RecordingError> {
        self.lines.keep().and_then(|()| self.lines.sync()).map_err(|source| self.failed(source))?;
        let rows = self.rows();
        if self.lines.is_removed() {
            Err(RecordingError::Removed { file: self.path, rows }.of_events())
        } else {
            Ok(rows)
        }
    }

    fn failed(&self, source: io::Error) -> RecordingError {
        let until_s = run_time_s(self.lines.last_tick().cast_signed(), self.period_ns);
        let rows = self.lines.rows();
        RecordingError::of_write(&self.path, source, &self.content(), (until_s, rows)).of_events()
    }
}
