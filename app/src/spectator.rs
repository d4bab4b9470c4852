//! A window on a run: tells it what happens, and does what people there ask for.
//!
//! Model: the slow side's turn. Rows come in from the fast thread's queue; the window is told of them some sixty times a
//! second, and what it asks for becomes orders, as if somebody had written them.

use crate::book::Book;
use crate::control::desk::Desk;
use crate::control::words::{self, Words};
use crate::moments::Moments;
use crate::row::{BodyRow, Row};
use nalgebra::Vector3;
use std::collections::VecDeque;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::{Duration, Instant};
use view::{Ask, Glimpse, News, Note, OpenWindow, Sample};
use world::events::{Event, Kind, Subscriber};

/// Between two glimpses.
const GLIMPSE: Duration = Duration::from_millis(12);

/// Who looks on.
pub struct Spectator {
    window: OpenWindow,
    moments: Moments,
    samples: Vec<Sample>,
    newest: Option<(Row, Vec<BodyRow>)>,
    told: Instant,
    /// What orders give to read, as they are taken.
    notes: (Sender<Note>, Receiver<Note>),
    /// Those that the window had no time for.
    untold: VecDeque<Note>,
    wants_end: bool,
}

impl Spectator {
    /// For a window that is open.
    pub fn new(window: OpenWindow, moments: Moments) -> Self {
        Self {
            window,
            moments,
            samples: Vec::new(),
            newest: None,
            told: Instant::now(),
            notes: channel(),
            untold: VecDeque::new(),
            wants_end: false,
        }
    }

    /// Who finds what there is to read among the orders of this book, as they are taken.
    pub fn reader(&self, book: Book) -> Box<dyn Subscriber> {
        reader(book, self.notes.0.clone())
    }

    /// A tick, as it began.
    pub fn look(&mut self, row: &Row, bodies: &[BodyRow]) {
        let fingers = row.fingers[..self.moments.fingers()].iter();
        let depth_m = |hip: &Vector3<f64>, god: Vector3<f64>| (hip - god).norm();
        let felt = fingers
            .map(|finger| [finger.force_on_user.norm(), depth_m(&finger.hip, finger.god_object)])
            .collect();
        self.samples.push(Sample { t_s: self.moments.time_s(row), fingers: felt });
        let newest = self.newest.get_or_insert_with(|| (*row, Vec::new()));
        newest.0 = *row;
        newest.1.clear();
        newest.1.extend_from_slice(bodies);
    }

    /// The slow side's turn.
    pub fn step(&mut self, desk: Option<&mut Desk>) {
        if self.told.elapsed() >= GLIMPSE
            && let Some((row, bodies)) = &self.newest
        {
            self.told = Instant::now();
            let moment = self.moments.moment(row, bodies);
            let samples = std::mem::take(&mut self.samples);
            self.window.tell(News::Glimpse(Box::new(Glimpse { moment, samples, ..Glimpse::default() })));
        }
        self.give_to_read();
        self.answer(desk);
    }

    /// Moments may be left out, what people are to read may not.
    fn give_to_read(&mut self) {
        self.untold.extend(self.notes.1.try_iter());
        while let Some(note) = self.untold.pop_front() {
            if let Some(News::Text(note)) = self.window.tell(News::Text(note)) {
                self.untold.push_front(note);
                break;
            }
        }
    }

    fn answer(&mut self, mut desk: Option<&mut Desk>) {
        let asked: Vec<Ask> = self.window.asked().collect();
        for ask in asked {
            match ask {
                Ask::Order(line) => {
                    let done = desk.as_mut().map(|desk| desk.order_now(&line));
                    if let Some(Err(error)) = done {
                        self.untold.push_back(error.into());
                    }
                }
                Ask::Record(_) => {}
                Ask::End => self.wants_end = true,
            }
        }
        self.wants_end |= !self.window.is_open();
    }

    /// Whether the run shall end.
    pub fn wants_end(&self) -> bool {
        self.wants_end
    }
}

fn reader(book: Book, notes: Sender<Note>) -> Box<dyn Subscriber> {
    Box::new(move |event: &Event| {
        if let Kind::Order { number } = event.kind
            && let Ok(Some(Words::Text(note))) = words::parse(&book.order(number))
        {
            // Nobody looks on any more.
            let _ = notes.send(note);
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_orders_give_to_read_is_read_when_they_are_taken() {
        let book = Book::default();
        for order in ["pause", "text 0.5 0.2 3 Press the cube", "key 32 down"] {
            book.add_order(order);
        }
        let (sender, notes) = channel();
        let mut reader = reader(book, sender);
        for (number, expected) in [(0, None), (1, Some("Press the cube")), (2, None), (3, None)] {
            reader.event(&Event { run_tick: 5, kind: Kind::Order { number } });
            assert_eq!(notes.try_iter().next().map(|note| note.text).as_deref(), expected);
        }
    }
}
