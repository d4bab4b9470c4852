//! Pairs of entities that the slow list steps: what they do to each other is told by the fast side, as all that happens.
//!
//! Model: each side watches the pairs that it steps. When an island changes lists its pairs' lives go along, in a queue of
//! their own: a contact goes on, and is told to begin and to end once. What the slow side finds it keeps back for a turn,
//! since the life of a pair may arrive a little after the pair itself.
//! Invariant: neither end waits or allocates. What finds no room is counted, and told as lost.

use super::bus::{EventReceiver, EventSender, event_queue};
use super::watch::{MOST_TOLD, Now, PairForce, PairLife, Pairs, Teller};
use super::{Change, Event, Kind};
use rtrb::{Consumer, Producer, RingBuffer};

/// Pairs that the slow side watches at once.
const MOST_PAIRS: usize = 8192;
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
    /// What this turn finds, and what the turn before found.
    found: (EventSender, EventReceiver),
    adopted: Vec<PairLife>,
    /// Events that found no room and have not been told.
    lost: u64,
}

/// Both ends.
pub fn pair_link() -> (FastPairs, SlowPairs) {
    let (to_slow, from_fast) = RingBuffer::new(ON_THE_WAY);
    let (to_fast, from_slow) = RingBuffer::new(ON_THE_WAY);
    let slow = SlowPairs {
        pairs: Pairs::with_capacity(MOST_PAIRS),
        now: Now::default(),
        from_fast,
        to_fast,
        found: event_queue(ON_THE_WAY),
        adopted: Vec::with_capacity(ON_THE_WAY),
        lost: 0,
    };
    (FastPairs { to_slow, from_slow }, slow)
}

impl SlowPairs {
    /// Before a turn: sends what the last one found, but for what is no news to the fast side.
    pub fn begin_turn(&mut self) {
        self.adopted.clear();
        while let Ok(life) = self.from_fast.pop() {
            self.pairs.adopt(&life.seen_in(self.now.run_tick));
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
            self.send(kind);
        }
    }

    /// Something else has happened there.
    pub fn tell(&mut self, kind: Kind) {
        self.found.0.send(Event { run_tick: self.now.run_tick, kind });
    }

    /// What finds no room is counted, and told when there is some.
    fn send(&mut self, kind: Kind) {
        if self.to_fast.slots() < 2 {
            self.lost += 1;
            return;
        }
        if self.lost > 0 {
            let count = std::mem::take(&mut self.lost);
            let _ = self.to_fast.push(FromSlow::Happened(Kind::Lost { count }));
        }
        let _ = self.to_fast.push(FromSlow::Happened(kind));
    }

    /// After a tick of this length (s).
    pub fn look(
        &mut self,
        pairs: impl Iterator<Item = PairForce>,
        dt_s: f64,
        rests: impl Fn([u32; 2]) -> bool,
    ) {
        self.now = Now { run_tick: self.now.run_tick + 1, dt_s, period_s: dt_s, left: MOST_TOLD };
        self.pairs.look(pairs, dt_s, rests, &mut Teller { now: &mut self.now, out: &mut self.found.0 });
    }

    /// Before entities go to the fast side: so do the lives of their pairs.
    pub fn go(&mut self, goes: impl Fn([u32; 2]) -> bool) {
        let to_fast = &mut self.to_fast;
        self.pairs.give_away(goes, |life| to_fast.push(FromSlow::Life(life)).is_ok());
    }
}
