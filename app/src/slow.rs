//! The slow thread's turn: take what the fast thread left and hand it to the recorders.

use crate::control::desk::Desk;
use crate::record::{Recorded, Recorder};
use crate::row::Row;
use crate::row_queue::RowReceiver;

/// The slow side of a run.
pub struct SlowSide {
    rows: RowReceiver,
    recorders: Vec<Recorder>,
    /// Who takes orders, if anybody gives them.
    desk: Option<Desk>,
    /// The newest row, for whoever wants to look.
    pub newest: Option<Row>,
}

impl SlowSide {
    /// Takes rows from the queue into the recordings, if there are any.
    pub fn new(rows: RowReceiver, recorders: Vec<Recorder>) -> Self {
        Self { rows, recorders, desk: None, newest: None }
    }

    /// With somebody who takes orders.
    #[must_use]
    pub fn with_desk(self, desk: Option<Desk>) -> Self {
        Self { desk, ..self }
    }

    /// Takes everything that is there. A recording that cannot be written tells so itself, and the run goes on.
    pub fn step(&mut self) {
        self.desk.iter_mut().for_each(Desk::step);
        for _ in 0..self.rows.waiting() {
            let Some((row, bodies)) = self.rows.receive() else { break };
            for recorder in &mut self.recorders {
                recorder.send(&row, bodies);
            }
            self.newest = Some(row);
        }
    }

    /// Takes the rest and closes the recordings. Returns what became of them.
    pub fn finish(mut self) -> Vec<Recorded> {
        self.step();
        self.recorders.into_iter().map(Recorder::finish).collect()
    }
}
