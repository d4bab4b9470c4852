//! The queue between fast and slow side: rows, each followed by those bodies that have changed.
//!
//! Model: how many entities move is known when a run begins, so two queues of fixed size hold them: one of rows, one of
//! bodies, a row's bodies being pushed before the row is. Whoever finds a row finds its bodies. A body that rests is sent
//! once; the receiver keeps all of them as they were last.
//! Each place has been written to once: where memory is not locked, the first touch would otherwise be a page fault of the
//! fast thread, every few ticks for eight seconds.

use crate::row::{BodyRow, Row};
use rtrb::{Consumer, Producer, RingBuffer};

/// Rows that may wait: eight seconds at 1 kHz, so that a slow disk costs nothing.
pub const ROW_QUEUE: usize = 8192;

/// Bodies that may wait, of all rows together (100 MB); with more than 128 of them in a row, fewer rows can.
const BODY_QUEUE: usize = 1 << 20;

/// The fast side's end.
pub struct RowSender {
    rows: Producer<Waiting>,
    bodies: Producer<(u32, BodyRow)>,
}

/// A row, and how many bodies come with it.
type Waiting = (Row, u32);

/// The slow side's end.
pub struct RowReceiver {
    rows: Consumer<Waiting>,
    bodies: Consumer<(u32, BodyRow)>,
    of_row: Vec<BodyRow>,
}

/// A queue for rows with so many bodies each.
pub fn row_queue(bodies: usize) -> (RowSender, RowReceiver) {
    let places = BODY_QUEUE.checked_div(bodies).map_or(ROW_QUEUE, |places| places.clamp(2, ROW_QUEUE));
    row_queue_of(places, bodies)
}

/// A queue for so many rows with so many bodies each.
pub fn row_queue_of(places: usize, bodies: usize) -> (RowSender, RowReceiver) {
    let (rows, row_ends) = touched(places, (Row::empty(), 0));
    let (bodies_in, bodies_out) = touched(places * bodies, (0, BodyRow::default()));
    let receiver =
        RowReceiver { rows: row_ends, bodies: bodies_out, of_row: vec![BodyRow::default(); bodies] };
    (RowSender { rows, bodies: bodies_in }, receiver)
}

fn touched<T: Clone>(places: usize, with: T) -> (Producer<T>, Consumer<T>) {
    let (mut producer, mut consumer) = RingBuffer::new(places);
    while producer.push(with.clone()).is_ok() {}
    while consumer.pop().is_ok() {}
    (producer, consumer)
}

impl RowSender {
    /// Whether there is no room for another row.
    pub fn is_full(&self) -> bool {
        self.rows.is_full()
    }

    /// Whether nobody will ever take a row.
    pub fn is_abandoned(&self) -> bool {
        self.rows.is_abandoned()
    }

    /// Sends a row and the bodies that have changed since the last one that was sent, by their numbers; `false`, and nothing
    /// is sent, if there is no room.
    pub fn send(&mut self, row: Row, bodies: &[(u32, BodyRow)]) -> bool {
        if self.rows.is_full() || self.bodies.slots() < bodies.len() {
            return false;
        }
        for body in bodies {
            // There is room.
            let _ = self.bodies.push(*body);
        }
        self.rows.push((row, bodies.len() as u32)).is_ok()
    }
}

impl RowReceiver {
    /// How many rows wait.
    pub fn waiting(&self) -> usize {
        self.rows.slots()
    }

    /// Which tick of the run the next row is of, if one waits.
    pub fn next_tick(&self) -> Option<u64> {
        Some(self.rows.peek().ok()?.0.run_tick)
    }

    /// All bodies, as they were in the row that was received last.
    pub fn bodies(&self) -> &[BodyRow] {
        &self.of_row
    }

    /// The next row and all bodies, if one waits.
    pub fn receive(&mut self) -> Option<(Row, &[BodyRow])> {
        let (row, bodies) = self.rows.pop().ok()?;
        for _ in 0..bodies {
            if let Ok((number, body)) = self.bodies.pop()
                && let Some(place) = self.of_row.get_mut(number as usize)
            {
                *place = body;
            }
        }
        Some((row, &self.of_row))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    fn body(number: f64) -> BodyRow {
        BodyRow { position: Vector3::repeat(number), ..BodyRow::default() }
    }

    #[test]
    fn a_row_comes_with_its_own_bodies_however_full_the_queue_was() {
        let (mut sender, mut receiver) = row_queue(300);
        let bodies = |row: u64| (0..300).map(|i| body((1000 * row + i) as f64)).collect::<Vec<_>>();
        let numbered = |row: u64| (0..300).zip(bodies(row)).collect::<Vec<_>>();
        let mut sent = 0;
        while sender.send(Row { run_tick: sent, ..Row::empty() }, &numbered(sent)) {
            sent += 1;
        }
        assert_eq!(sent, (BODY_QUEUE / 300) as u64);
        assert_eq!(receiver.waiting(), sent as usize);
        for row in 0..sent {
            let (found, of_row) = receiver.receive().expect("a row");
            assert_eq!(found.run_tick, row);
            assert_eq!(of_row, bodies(row), "row {row}");
        }
        assert!(receiver.receive().is_none());
        let of_one = [(7, body(-1.0))];
        assert!(sender.send(Row::empty(), &of_one));
        let (_, of_row) = receiver.receive().expect("a row");
        let mut expected = bodies(sent - 1);
        expected[7] = of_one[0].1;
        assert_eq!(of_row, expected, "the others are as they were");
    }
}
