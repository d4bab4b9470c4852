//! The slow thread's turn: take what the fast thread left and write it down.

use crate::recording::{Recording, RecordingError};
use crate::row::Row;
use rtrb::{Consumer, Producer, RingBuffer};

/// Rows that may wait: eight seconds at 1 kHz, so that a slow disk costs nothing.
pub const ROW_QUEUE: usize = 8192;

/// The queue between fast and slow side. Each place has been written to once: where memory is not locked, the
/// first touch would otherwise be a page fault of the fast thread, every few ticks for eight seconds.
pub fn row_queue() -> (Producer<Row>, Consumer<Row>) {
    let (mut producer, mut consumer) = RingBuffer::new(ROW_QUEUE);
    while producer.push(Row::empty()).is_ok() {}
    while consumer.pop().is_ok() {}
    (producer, consumer)
}

/// The slow side of a run.
pub struct SlowSide {
    rows: Consumer<Row>,
    recording: Option<Recording>,
    /// The newest row, for whoever wants to look.
    pub newest: Option<Row>,
}

impl SlowSide {
    /// Takes rows from the queue into the recording, if there is one.
    pub fn new(rows: Consumer<Row>, recording: Option<Recording>) -> Self {
        Self { rows, recording, newest: None }
    }

    /// Takes everything that is there.
    ///
    /// # Errors
    /// If the recording cannot be written; rows are taken and thrown away from then on.
    pub fn step(&mut self) -> Result<(), RecordingError> {
        for _ in 0..self.rows.slots() {
            let Ok(row) = self.rows.pop() else { break };
            if let Some(recording) = &mut self.recording
                && let Err(error) = recording.append(&row)
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
