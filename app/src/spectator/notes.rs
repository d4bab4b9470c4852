//! What orders give to read, as they are taken.

use crate::book::Book;
use crate::control::words::{self, Words};
use std::sync::mpsc::{Receiver, Sender, channel};
use view::Note;
use world::events::{Class, Event, Filter, Hub, Kind, Subscriber};

/// What there is to read.
pub(super) struct Notes(Receiver<Note>);

impl Notes {
    /// From now on listens here; orders are in this book.
    pub(super) fn new(hub: &mut Hub, book: Book) -> Self {
        let (sender, notes) = channel();
        hub.subscribe(Filter::of(&[Class::Order]), reader(book, sender));
        Self(notes)
    }

    /// What came in.
    pub(super) fn taken(&self) -> impl Iterator<Item = Note> {
        self.0.try_iter()
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
