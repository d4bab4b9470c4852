//! The queue between fast and slow side: rows, each followed by those bodies that have changed.
//!
//! Model: how many entities move is known when a run begins, so two queues of fixed size hold them: one of rows, one of
//! bodies, a row's bodies being pushed before the row is. Whoever finds a row finds its bodies. A body that rests is sent
//! once; the receiver keeps all of them as they were last. What is not a body and was moved all the same comes with its row,
//! too.
//! Rows that found no room are counted, and each row tells how many were missing before it.
//! Each place has been written to once: where memory is not locked, the first touch would otherwise be a page fault of the
//! fast thread, every few ticks for eight seconds.

use crate::displaced::Placed;
use crate::row::{BodyRow, Row};
use nalgebra::Isometry3;
use rtrb::{Consumer, Producer, RingBuffer};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// Rows that may wait: eight seconds at 1 kHz, so that a slow disk costs nothing.
pub const ROW_QUEUE: usize = 8192;

/// Changed bodies that may wait, of all rows together (180 MB); where more than 128 change in each row, or of
/// [`MANY`] 32, fewer rows can.
const BODY_QUEUE: usize = 1 << 20;
/// The same of a world with more than so many, of which few change in a tick.
const MANY: usize = 4096;
const BODY_QUEUE_OF_MANY: usize = 1 << 18;

/// What is no body and was moved, for each row that may wait.
const PLACED_A_ROW: usize = 4;
/// No fewer of them may wait.
const PLACED_QUEUE: usize = 1024;

/// The fast side's end.
pub struct RowSender {
    rows: Producer<Waiting>,
    bodies: Producer<(u32, BodyRow)>,
    placed: Producer<Placed>,
    /// Rows that found no room.
    lost: Arc<AtomicU64>,
}

/// A row, how many bodies and how many others come with it, and how many rows had found no room by then.
type Waiting = (Row, [u32; 2], u64);

/// The slow side's end.
pub struct RowReceiver {
    rows: Consumer<Waiting>,
    bodies: Consumer<(u32, BodyRow)>,
    of_row: Vec<BodyRow>,
    /// Those that came with the last row.
    changed: Vec<u32>,
    placed: Consumer<Placed>,
    /// All that ever came, each entity once.
    stand: Vec<Placed>,
    lost: Arc<AtomicU64>,
    /// Of these, those that have been told.
    told: u64,
}

/// A queue for rows with so many bodies each.
pub fn row_queue(bodies: usize) -> (RowSender, RowReceiver) {
    row_queue_of(ROW_QUEUE, most_waiting(bodies), bodies)
}

/// The same for a thread that may meet page faults: what never waits takes no memory.
pub fn untouched_row_queue(bodies: usize) -> (RowSender, RowReceiver) {
    untouched_row_queue_of(ROW_QUEUE, most_waiting(bodies), bodies)
}

fn most_waiting(bodies: usize) -> usize {
    if bodies > MANY { BODY_QUEUE_OF_MANY } else { BODY_QUEUE }
}

/// A queue for so many rows with so many bodies each, and for no more of those, if they have changed, than `most` of all rows
/// together; but for those of two rows.
pub fn row_queue_of(places: usize, most: usize, bodies: usize) -> (RowSender, RowReceiver) {
    let (mut sender, mut receiver) = untouched_row_queue_of(places, most, bodies);
    touch(&mut sender.rows, &mut receiver.rows, (Row::empty(), [0; 2], 0));
    touch(&mut sender.bodies, &mut receiver.bodies, (0, BodyRow::default()));
    touch(&mut sender.placed, &mut receiver.placed, (0, Isometry3::identity()));
    (sender, receiver)
}

/// The same, as [`untouched_row_queue`].
pub fn untouched_row_queue_of(places: usize, most: usize, bodies: usize) -> (RowSender, RowReceiver) {
    let (rows, row_ends) = RingBuffer::new(places);
    let (bodies_in, bodies_out) = RingBuffer::new((places * bodies).min(most.max(2 * bodies)));
    let (placed_in, placed_out) = RingBuffer::new((PLACED_A_ROW * places).max(PLACED_QUEUE));
    let receiver = RowReceiver {
        rows: row_ends,
        bodies: bodies_out,
        of_row: vec![BodyRow::default(); bodies],
        changed: Vec::with_capacity(bodies),
        placed: placed_out,
        stand: Vec::new(),
        lost: Arc::default(),
        told: 0,
    };
    let lost = Arc::clone(&receiver.lost);
    (RowSender { rows, bodies: bodies_in, placed: placed_in, lost }, receiver)
}

fn touch<T: Clone>(producer: &mut Producer<T>, consumer: &mut Consumer<T>, with: T) {
    while producer.push(with.clone()).is_ok() {}
    while consumer.pop().is_ok() {}
}

impl RowSender {
    /// True if there is room for another row with so many bodies and so many others that were moved.
    pub fn has_room(&self, bodies: usize, others: usize) -> bool {
        let others = others.min(PLACED_QUEUE);
        !self.rows.is_full() && self.bodies.slots() >= bodies && self.placed.slots() >= others
    }

    /// Whether nobody will ever take a row.
    pub fn is_abandoned(&self) -> bool {
        self.rows.is_abandoned()
    }

    /// Sends a row and the bodies that have changed since the last one that was sent, by their numbers; `false`, and nothing
    /// is sent, if there is no room.
    pub fn send(&mut self, row: Row, bodies: &[(u32, BodyRow)]) -> bool {
        self.send_with(row, bodies, &mut Vec::new())
    }

    /// The same with what else has been moved, which is taken out of `placed` if it is sent; but for more than may ever wait,
    /// which is left for the next row.
    pub fn send_with(&mut self, row: Row, bodies: &[(u32, BodyRow)], placed: &mut Vec<Placed>) -> bool {
        let others = placed.len().min(PLACED_QUEUE);
        if !self.has_room(bodies.len(), others) {
            return false;
        }
        for other in placed.drain(..others) {
            // There is room.
            let _ = self.placed.push(other);
        }
        for body in bodies {
            // There is room.
            let _ = self.bodies.push(*body);
        }
        let lost = self.lost.load(Ordering::Relaxed);
        self.rows.push((row, [bodies.len(), others].map(|count| count as u32), lost)).is_ok()
    }

    /// A row that found no room is given up.
    pub fn lose(&mut self) {
        self.lost.fetch_add(1, Ordering::Relaxed);
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

    /// Rows that were lost before the next one, or, if none waits, so far; each is told once.
    pub fn take_lost(&mut self) -> u64 {
        let lost = self.rows.peek().map_or_else(|_| self.lost.load(Ordering::Relaxed), |(.., lost)| *lost);
        let untold = lost.saturating_sub(self.told);
        self.told += untold;
        untold
    }

    /// The next row and all bodies, if one waits.
    pub fn receive(&mut self) -> Option<(Row, &[BodyRow])> {
        let (row, [bodies, others], _) = self.rows.pop().ok()?;
        self.changed.clear();
        for _ in 0..bodies {
            if let Ok((number, body)) = self.bodies.pop()
                && let Some(place) = self.of_row.get_mut(number as usize)
            {
                *place = body;
                self.changed.push(number);
            }
        }
        for _ in 0..others {
            let Ok(other) = self.placed.pop() else { break };
            match self.stand.iter_mut().find(|(entity, _)| *entity == other.0) {
                Some(known) => *known = other,
                None => self.stand.push(other),
            }
        }
        Some((row, &self.of_row))
    }

    /// All bodies as they were with the last row.
    pub fn bodies(&self) -> &[BodyRow] {
        &self.of_row
    }

    /// The bodies that came with the last row, by their numbers: no others have changed since the row before.
    pub fn changed(&self) -> &[u32] {
        &self.changed
    }

    /// What is no body and has been moved, where it stood with the last row.
    pub fn placed(&self) -> &[Placed] {
        &self.stand
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

    #[test]
    fn what_is_moved_beside_bodies_comes_with_its_row_and_stays_where_it_was_left() {
        let (mut sender, mut receiver) = row_queue_of(64, 0, 0);
        let at = |x: f64| Isometry3::translation(x, 0.0, 0.0);
        let mut waits: Vec<Placed> = vec![(3, at(0.1)), (1, at(0.2))];
        assert!(sender.send_with(Row::empty(), &[], &mut waits) && waits.is_empty());
        assert!(sender.send_with(Row::empty(), &[], &mut vec![(1, at(0.3))]));
        assert!(sender.send(Row::empty(), &[]));
        let mut received = || {
            receiver.receive().expect("a row");
            receiver.placed().to_vec()
        };
        assert_eq!(received(), [(3, at(0.1)), (1, at(0.2))]);
        assert_eq!(received(), [(3, at(0.1)), (1, at(0.3))]);
        assert_eq!(received(), [(3, at(0.1)), (1, at(0.3))]);
        // Of more than may ever wait each row brings some.
        let mut many: Vec<Placed> = (0..PLACED_QUEUE as u32 + 5).map(|entity| (entity, at(0.0))).collect();
        assert!(sender.send_with(Row::empty(), &[], &mut many) && many.len() == 5);
        assert!(
            !sender.send_with(Row::empty(), &[], &mut many) && many.len() == 5,
            "no room: nothing is lost"
        );
        assert!(receiver.receive().is_some());
        assert!(sender.send_with(Row::empty(), &[], &mut many) && many.is_empty());
    }

    #[test]
    fn of_a_crowd_that_rests_as_many_rows_wait_as_of_a_single_thing() {
        let (mut sender, _receiver) = untouched_row_queue_of(1000, 1 << 10, 10_000);
        assert!(
            sender.send(Row::empty(), &(0..10_000).map(|number| (number, body(0.0))).collect::<Vec<_>>())
        );
        let more = (1..2000).take_while(|_| sender.send(Row::empty(), &[(17, body(1.0))])).count();
        assert_eq!(more, 999);
    }

    #[test]
    fn rows_that_are_lost_are_told_before_the_next_one_or_at_the_end() {
        let (mut sender, mut receiver) = row_queue_of(2, 0, 0);
        let mut told = Vec::new();
        for round in 0..3 {
            for run_tick in 0..2 + round {
                if !sender.send(Row { run_tick, ..Row::empty() }, &[]) {
                    sender.lose();
                }
            }
            for _ in 0..receiver.waiting() {
                told.push(receiver.take_lost());
                receiver.receive();
            }
        }
        assert_eq!(told, [0, 0, 0, 0, 1, 0]);
        assert_eq!([receiver.take_lost(), receiver.take_lost()], [2, 0]);
    }
}
