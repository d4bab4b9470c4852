//! What touches what, and what stands still, as events tell.
//!
//! Model: contacts begin and end by events, so what touches now is what began and has not ended. Where events are missing all
//! of that is forgotten: that something touches is told only where it is known.

use crate::book::Book;
use crate::control::words::{self, Words};
use std::collections::BTreeSet;
use world::events::{Change, Class, Event, EventReceiver, Filter, Hub, Kind};

/// Events that may wait.
const PLACES: usize = 8192;

/// What has happened so far.
pub(super) struct Happened {
    events: EventReceiver,
    book: Book,
    so_far: SoFar,
}

/// What follows of events.
#[derive(Debug, Default)]
pub(super) struct SoFar {
    /// Of each finger, what it touches.
    fingers: Vec<BTreeSet<usize>>,
    /// The lesser number first.
    pairs: BTreeSet<[usize; 2]>,
    /// Whether nothing moves by itself.
    pub(super) is_paused: bool,
    /// True while bodies wait for their turn.
    pub(super) is_overloaded: bool,
    /// Orders that were taken, by their numbers, in the order in which they were.
    orders: Vec<u64>,
}

impl Happened {
    /// From now on listens here; orders are in this book.
    pub(super) fn new(hub: &mut Hub, book: Book) -> Self {
        let filter = Filter::of(&[Class::Contact, Class::Pair, Class::Overload, Class::Reset, Class::Order]);
        Self { events: hub.subscribe_queue(filter, PLACES), book, so_far: SoFar::default() }
    }

    /// Takes what came in.
    pub(super) fn step(&mut self) {
        while let Some(event) = self.events.receive(u64::MAX) {
            self.so_far.take(&event, |order| self.book.order(order));
        }
    }

    /// What is so now.
    pub(super) fn so_far(&self) -> &SoFar {
        &self.so_far
    }

    /// The orders that were taken, in words.
    pub(super) fn ordered(&self) -> Vec<String> {
        self.so_far.orders.iter().map(|number| self.book.order(*number)).collect()
    }
}

impl SoFar {
    fn take(&mut self, event: &Event, words_of: impl FnOnce(u64) -> String) {
        match event.kind {
            Kind::FingerTouch { finger, entity, change, .. } => {
                let (finger, entity) = (finger as usize, entity as usize);
                if self.fingers.len() <= finger {
                    self.fingers.resize_with(finger + 1, BTreeSet::new);
                }
                match change {
                    Change::Begins => self.fingers[finger].insert(entity),
                    Change::Ends => self.fingers[finger].remove(&entity),
                    Change::Slips | Change::Sticks => false,
                };
            }
            Kind::PairTouch { entities, change, .. } => {
                let mut pair = entities.map(|entity| entity as usize);
                pair.sort_unstable();
                match change {
                    Change::Ends => self.pairs.remove(&pair),
                    _ => self.pairs.insert(pair),
                };
            }
            Kind::Overload { change, .. } => self.is_overloaded = change != Change::Ends,
            Kind::Order { number } => {
                self.orders.push(number);
                if let Ok(Some(Words::Pause(is_paused))) = words::parse(&words_of(number)) {
                    self.is_paused = is_paused;
                }
            }
            // A reset goes on standing still.
            Kind::Scene { .. } => {
                *self = Self { orders: std::mem::take(&mut self.orders), ..Self::default() };
            }
            Kind::Reset | Kind::Lost { .. } => {
                self.fingers.clear();
                self.pairs.clear();
                self.is_overloaded = false;
            }
            _ => {}
        }
    }

    /// What a finger touches, in ascending order; `rendered` is what its newest row tells, which is never missing.
    pub(super) fn felt(&self, finger: usize, rendered: Option<usize>) -> Vec<usize> {
        let mut felt = self.fingers.get(finger).cloned().unwrap_or_default();
        felt.extend(rendered);
        felt.into_iter().collect()
    }

    /// Pairs that touch, in ascending order.
    pub(super) fn pairs(&self) -> impl Iterator<Item = [usize; 2]> {
        self.pairs.iter().copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use world::events::Life;

    fn told(kinds: &[Kind]) -> SoFar {
        let mut so_far = SoFar::default();
        let words = ["pause", "stiffness 2", "resume", "move a to 0 0 0 in 1"];
        for &kind in kinds {
            so_far.take(&Event { run_tick: 0, kind }, |order| words[order as usize].into());
        }
        so_far
    }

    fn finger(finger: u32, entity: u32, change: Change) -> Kind {
        Kind::FingerTouch { finger, entity, change, life: Life::default() }
    }

    fn pair(a: u32, b: u32, change: Change) -> Kind {
        Kind::PairTouch { entities: [a, b], change, life: Life::default() }
    }

    fn pairs(so_far: &SoFar) -> Vec<[usize; 2]> {
        so_far.pairs().collect()
    }

    #[test]
    fn what_began_and_has_not_ended_touches() {
        use Change::{Begins, Ends, Slips, Sticks};
        let so_far = told(&[
            finger(1, 4, Begins),
            finger(0, 4, Begins),
            finger(0, 2, Begins),
            finger(0, 4, Slips),
            finger(0, 4, Sticks),
            finger(1, 4, Ends),
            pair(3, 0, Begins),
            pair(5, 4, Begins),
            pair(4, 5, Ends),
        ]);
        assert_eq!([0, 1, 2].map(|number| so_far.felt(number, None)), [vec![2, 4], vec![], vec![]]);
        assert_eq!(so_far.felt(1, Some(7)), [7], "as its row says");
        assert_eq!(so_far.felt(0, Some(4)), [2, 4], "once");
        assert_eq!(pairs(&so_far), [[0, 3]]);
    }

    #[test]
    fn nothing_is_told_to_touch_whose_end_may_be_missing() {
        let so_far = told(&[
            Kind::Order { number: 0 },
            finger(0, 4, Change::Begins),
            pair(3, 0, Change::Begins),
            Kind::Lost { count: 1 },
            pair(3, 1, Change::Begins),
            // Of one whose beginning is missing.
            finger(0, 4, Change::Ends),
        ]);
        assert_eq!((so_far.felt(0, None), pairs(&so_far)), (vec![], vec![[1, 3]]));
        assert!(so_far.is_paused);
    }

    #[test]
    fn things_wait_for_their_turn_until_all_fit_into_a_tick_again_or_the_world_is_another() {
        let overload = |change| Kind::Overload { change, waiting: 3 };
        assert!(told(&[overload(Change::Begins)]).is_overloaded);
        for end in [overload(Change::Ends), Kind::Reset, Kind::Scene { number: 1 }] {
            assert!(!told(&[overload(Change::Begins), end]).is_overloaded, "{end:?}");
        }
    }

    #[test]
    fn pauses_are_known_by_the_orders_that_were_taken() {
        assert!(told(&[Kind::Order { number: 0 }, Kind::Order { number: 1 }]).is_paused);
        assert!(!told(&[Kind::Order { number: 0 }, Kind::Order { number: 2 }]).is_paused);
        let reset = told(&[Kind::Order { number: 0 }, pair(1, 0, Change::Begins), Kind::Reset]);
        assert!(reset.is_paused && reset.pairs.is_empty(), "a reset keeps the pause");
        let other = told(&[Kind::Order { number: 0 }, Kind::Scene { number: 1 }]);
        assert_eq!((other.is_paused, other.orders), (false, vec![0]));
    }

    #[test]
    fn what_was_ordered_is_what_was_taken_in_its_own_order() {
        // One for now went past others of a script, of which the last still waits.
        let so_far = told(&[Kind::Order { number: 2 }, Kind::Order { number: 0 }]);
        assert_eq!(so_far.orders, [2, 0]);
    }
}
