//! The slow thread's turn: take what the fast thread left and hand it to the recorders and to those who want events.

use crate::control::desk::Desk;
use crate::record::{Recorded, Recorder};
use crate::row::Row;
use crate::row_queue::RowReceiver;
use std::fmt::Write;
use world::events::{Class, Filter, Hub};

/// The slow side of a run.
pub struct SlowSide {
    rows: RowReceiver,
    recorders: Vec<Recorder>,
    /// Who takes orders, if anybody gives them.
    desk: Option<Desk>,
    /// Who else wants to know what happens.
    pub events: Hub,
    /// The newest row, for whoever wants to look.
    pub newest: Option<Row>,
}

impl SlowSide {
    /// Takes rows and events from their queues into the recordings, if there are any.
    pub fn new(rows: RowReceiver, events: Hub, recorders: Vec<Recorder>) -> Self {
        let (mut recorders, mut events) = (recorders, events);
        subscribe(&mut recorders, &mut events);
        Self { rows, recorders, desk: None, events, newest: None }
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
            // A tick's events are there before its row is.
            self.events.deliver(row.run_tick);
            for recorder in &mut self.recorders {
                recorder.send(&row, bodies);
            }
            self.newest = Some(row);
        }
    }

    /// Takes the rest and closes the recordings. Returns what became of them, and what has happened.
    pub fn finish(mut self) -> (Vec<Recorded>, String) {
        self.step();
        self.events.deliver(u64::MAX);
        let told = summary(&self.events);
        (self.recorders.into_iter().map(Recorder::finish).collect(), told)
    }
}

/// The recordings want all events.
pub fn subscribe(recorders: &mut [Recorder], events: &mut Hub) {
    for feed in recorders.iter_mut().filter_map(Recorder::take_events) {
        events.subscribe(Filter::ALL, Box::new(feed));
    }
}

/// How many events of each class there were, and how many are missing.
fn summary(events: &Hub) -> String {
    let mut line = String::new();
    for (class, word) in Class::ALL.into_iter().filter(|(class, _)| *class != Class::Lost) {
        if events.count(class) > 0 {
            let comma = if line.is_empty() { "" } else { ", " };
            // A string takes everything.
            let _ = write!(line, "{comma}{} {word}", events.count(class));
        }
    }
    if line.is_empty() {
        line.push_str("none");
    }
    if events.lost() > 0 {
        let _ = write!(line, ", {} LOST: nobody took them in time", events.lost());
    }
    line
}
