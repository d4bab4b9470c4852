//! Pairs of entities that the slow list steps: what they do to each other is told by the fast side, as all that happens.
//!
//! Model: each side watches the pairs that it steps. When an island changes lists its pairs' lives go along, in a queue of
//! their own: a contact goes on, and is told to begin and to end once. What the slow side finds it keeps back for a turn,
//! since the life of a pair may arrive a little after the pair itself.
//! Invariant: the fast end neither waits nor allocates. What finds no room on the way to it waits at the slow end, in order.

use super::bus::{EventReceiver, EventSender, growing_event_queue};
use super::watch::{Now, PairForce, PairLife, Pairs, Teller};
use super::{Change, Event, Kind};
use rtrb::{Consumer, Producer, RingBuffer};
use std::collections::VecDeque;

/// Pairs that the slow side has room for at first.
const FIRST_PAIRS: usize = 8192;
/// Lives, and events, that may be on their way.
const ON_THE_WAY: usize = 4096;

/// From the slow side.
#[derive(Debug, Clone, Copy)]
pub(super) enum FromSlow {
    /// A pair goes on being stepped by the fast side, or soon will.
    Life(PairLife),
    /// Something happened there.
    Happened(Kind),
}

/// The fast side's end.
#[derive(Debug)]
pub struct FastPairs {
    pub(super) to_slow: Producer<PairLife>,
    pub(super) from_slow: Consumer<FromSlow>,
}

/// The slow side's: its watch.
#[derive(Debug)]
pub struct SlowPairs {
    pairs: Pairs,
    now: Now,
    from_fast: Consumer<PairLife>,
    to_fast: Producer<FromSlow>,
    /// News that have found no room there yet.
    waiting: VecDeque<FromSlow>,
    /// What this turn finds, and what the turn before found.
    found: (EventSender, EventReceiver),
    adopted: Vec<PairLife>,
}

/// Both ends.
pub fn pair_link() -> (FastPairs, SlowPairs) {
    let (to_slow, from_fast) = RingBuffer::new(ON_THE_WAY);
    let (to_fast, from_slow) = RingBuffer::new(ON_THE_WAY);
    let slow = SlowPairs {
        pairs: Pairs::with_capacity(FIRST_PAIRS),
        now: Now::default(),
        from_fast,
        to_fast,
        waiting: VecDeque::with_capacity(ON_THE_WAY),
        found: growing_event_queue(ON_THE_WAY),
        adopted: Vec::with_capacity(ON_THE_WAY),
    };
    (FastPairs { to_slow, from_slow }, slow)
}

impl SlowPairs {
    /// Before a turn: sends what the last one found, but for what is no news to the fast side.
    pub fn begin_turn(&mut self) {
        self.adopted.clear();
        while let Ok(life) = self.from_fast.pop() {
            self.pairs.adopt(&life.seen_in(self.now.run_tick), true);
            self.adopted.push(life);
        }
        while let Some(event) = self.found.1.receive(u64::MAX) {
            let kind = match event.kind {
                Kind::PairTouch { entities, change, life } => {
                    match self.adopted.iter().find(|adopted| adopted.entities == entities) {
                        Some(_) if change == Change::Begins => continue,
                        Some(before) => {
                            Kind::PairTouch { entities, change, life: before.life.followed_by(&life) }
                        }
                        None => event.kind,
                    }
                }
                kind => kind,
            };
            self.waiting.push_back(FromSlow::Happened(kind));
        }
        self.send_waiting();
    }

    /// Something else has happened there.
    pub fn tell(&mut self, kind: Kind) {
        self.found.0.send(Event { run_tick: self.now.run_tick, kind });
    }

    /// In order: a pair that goes over begins before it ends.
    fn send_waiting(&mut self) {
        while self.to_fast.slots() > 0
            && let Some(next) = self.waiting.pop_front()
        {
            let _ = self.to_fast.push(next);
        }
    }

    /// After a tick of this length (s).
    pub fn look(
        &mut self,
        pairs: impl Iterator<Item = PairForce>,
        dt_s: f64,
        rests: impl Fn([u32; 2]) -> bool,
    ) {
        self.now = Now { run_tick: self.now.run_tick + 1, dt_s, period_s: dt_s, left: 0 };
        self.pairs.look(pairs, dt_s, rests, &mut Teller { now: &mut self.now, out: &mut self.found.0 });
    }

    /// Before entities go to the fast side: so do the lives of their pairs.
    pub fn go(&mut self, goes: impl Fn([u32; 2]) -> bool) {
        let waiting = &mut self.waiting;
        self.pairs.give_away(goes, |life| {
            waiting.push_back(FromSlow::Life(life));
            true
        });
        self.send_waiting();
    }
}
