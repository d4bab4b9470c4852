//! The slow thread's turn: take what the fast thread left and write it down.

use crate::recording::{Recording, RecordingError};
use crate::row::Row;
use crate::row_queue::RowReceiver;

/// The slow side of a run.
pub struct SlowSide {
    rows: RowReceiver,
    recording: Option<Recording>,
    /// The newest row, for whoever wants to look.
    pub newest: Option<Row>,
}

impl SlowSide {
    /// Takes rows from the queue into the recording, if there is one.
    pub fn new(rows: RowReceiver, recording: Option<Recording>) -> Self {
        Self { rows, recording, newest: None }
    }

    /// Takes everything that is there.
    ///
    /// # Errors
    /// If the recording cannot be written; rows are taken and thrown away from then on.
    pub fn step(&mut self) -> Result<(), RecordingError> {
        for _ in 0..self.rows.waiting() {
            let Some((row, bodies)) = self.rows.receive() else { break };
            if let Some(recording) = &mut self.recording
                && let Err(error) = recording.append(&row, bodies)
            {
                self.recording = None;
                return Err(error);
            }
            self.newest = Some(row);
        }
        Ok(())
    }

    /// Takes the rest and closes the recording. Returns how many rows it has, if there is one.
    ///
    /// # Errors
    /// If it cannot be written to the end.
    pub fn finish(mut self) -> Result<Option<u64>, RecordingError> {
        self.step()?;
        self.recording.map(Recording::finish).transpose()
    }
}
