//! Pairs of entities that the slow list steps: what they do to each other is told by the fast side, as all that happens.
//!
//! Model: each side watches the pairs that it steps. When an island changes lists its pairs' lives go along, in a queue of
//! their own: a contact goes on, and is told to begin and to end once. What the slow side finds it keeps back for a turn,
//! since the life of a pair may arrive a little after the pair itself; but for what it gives away, whose life has come by
//! then. When the world ends, whoever takes the last events from its watch takes those of this side, too.
//! Invariant: the fast end neither waits nor allocates, nor takes the lock. What finds no room on the way to it waits at the
//! slow end, in order.

use super::bus::{EventReceiver, EventSender, growing_event_queue};
use super::watch::{Now, Pair, PairForce, Pairs, Teller};
use super::{Change, Event, Kind};
use physics::PairStanding;
use rtrb::{Consumer, Producer, RingBuffer};
use std::collections::hash_map::Entry;
use std::collections::{HashMap, VecDeque};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Pairs that the slow side has room for at first.
const FIRST_PAIRS: usize = 8192;
/// Lives, and events, that may be on their way.
const ON_THE_WAY: usize = 4096;

/// From the slow side.
#[derive(Debug, Clone, Copy)]
pub(super) enum FromSlow {
    /// A pair goes on being stepped by the fast side, or soon will.
    Goes(Pair),
    /// Something happened there.
    Happened(Kind),
}

/// The fast side's end.
#[derive(Debug)]
pub struct FastPairs {
    pub(super) to_slow: Producer<Pair>,
    pub(super) from_slow: Consumer<FromSlow>,
    slow: SlowPairs,
}

/// The slow side's: its watch.
#[derive(Debug, Clone)]
pub struct SlowPairs(Arc<Mutex<SlowWatch>>);

/// Remains of the slow side when its world ends.
pub(super) struct LastPairs {
    /// Things that it had to tell.
    pub(super) told: VecDeque<FromSlow>,
    /// Those that still touch.
    pub(super) pairs: Pairs,
}

#[derive(Debug)]
struct SlowWatch {
    pairs: Pairs,
    now: Now,
    from_fast: Consumer<Pair>,
    to_fast: Producer<FromSlow>,
    /// News that have found no room there yet.
    waiting: VecDeque<FromSlow>,
    /// What this turn finds, and what the turn before found.
    found: (EventSender, EventReceiver),
    /// All that was found, while it is looked through.
    looked_through: Vec<Event>,
    /// Lives that came, until what was found has been looked through.
    came: HashMap<[u32; 2], Pair>,
    /// The world has ended.
    is_over: bool,
}

/// Both ends.
pub fn pair_link() -> (FastPairs, SlowPairs) {
    let (to_slow, from_fast) = RingBuffer::new(ON_THE_WAY);
    let (to_fast, from_slow) = RingBuffer::new(ON_THE_WAY);
    let watch = SlowWatch {
        pairs: Pairs::with_capacity(FIRST_PAIRS),
        now: Now::default(),
        from_fast,
        to_fast,
        waiting: VecDeque::with_capacity(ON_THE_WAY),
        found: growing_event_queue(ON_THE_WAY),
        looked_through: Vec::with_capacity(ON_THE_WAY),
        came: HashMap::with_capacity(ON_THE_WAY),
        is_over: false,
    };
    let slow = SlowPairs(Arc::new(Mutex::new(watch)));
    (FastPairs { to_slow, from_slow, slow: slow.clone() }, slow)
}

impl FastPairs {
    /// Ends the slow side, which may be stepped on for a while. No real-time thread may.
    pub(super) fn end(&mut self) -> LastPairs {
        let mut watch = self.slow.lock();
        watch.settle(None);
        watch.is_over = true;
        LastPairs { told: std::mem::take(&mut watch.waiting), pairs: std::mem::take(&mut watch.pairs) }
    }
}

impl SlowPairs {
    fn lock(&self) -> MutexGuard<'_, SlowWatch> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The watch, as long as its world lives.
    fn alive(&self) -> Option<MutexGuard<'_, SlowWatch>> {
        Some(self.lock()).filter(|watch| !watch.is_over)
    }

    /// Before a turn: sends what the last one found, but for what is no news to the fast side.
    pub fn begin_turn(&self) {
        if let Some(mut watch) = self.alive() {
            watch.settle(None);
            watch.send_waiting();
        }
    }

    /// Something else has happened there.
    pub fn tell(&self, kind: Kind) {
        if let Some(mut watch) = self.alive() {
            watch.tell(kind);
        }
    }

    /// After a step of a tick of this length (s), or after so many in which all slept.
    pub fn look(
        &self,
        pairs: impl Iterator<Item = PairForce>,
        (ticks, period_s): (u32, f64),
        standing: impl Fn([u32; 2]) -> PairStanding,
    ) {
        if let Some(mut watch) = self.alive() {
            let SlowWatch { pairs: known, now, found, .. } = &mut *watch;
            let dt_s = f64::from(ticks) * period_s;
            *now = Now { run_tick: now.run_tick + u64::from(ticks), dt_s, period_s, left: 0 };
            known.look(pairs, dt_s, standing, &mut Teller { now, out: &mut found.0 });
        }
    }

    /// Before entities go to the fast side: so do the lives of their pairs, behind what was found of them. Those that sleep would
    /// have slept for so much longer (s) in this turn.
    pub fn go(&self, goes: impl Fn([u32; 2]) -> bool, sleeps: impl Fn([u32; 2]) -> bool, for_s: f64) {
        if let Some(mut watch) = self.alive() {
            watch.settle(Some(&goes));
            let SlowWatch { pairs, waiting, .. } = &mut *watch;
            pairs.give_away(goes, |pair| {
                let pair = if sleeps(pair.entities) { pair.after_sleep(for_s) } else { pair };
                waiting.push_back(FromSlow::Goes(pair));
                true
            });
            watch.send_waiting();
        }
    }
}

impl SlowWatch {
    fn tell(&mut self, kind: Kind) {
        self.found.0.send(Event { run_tick: self.now.run_tick, kind });
    }

    /// Makes news of what was found of these pairs, or of all that was: of a pair whose life has come it is no news that it
    /// begins. Lives of pairs that have not ended meanwhile go on here.
    fn settle(&mut self, of: Option<&dyn Fn([u32; 2]) -> bool>) {
        while let Ok(pair) = self.from_fast.pop() {
            let pair = pair.seen_in(self.now.run_tick);
            self.came.entry(pair.entities).and_modify(|was| *was = pair.after(was)).or_insert(pair);
        }
        self.looked_through.extend(std::iter::from_fn(|| self.found.1.receive(u64::MAX)));
        for event in self.looked_through.drain(..) {
            let Kind::PairTouch { entities, change, life } = event.kind else {
                if of.is_some() {
                    self.found.0.send(event);
                } else {
                    self.waiting.push_back(FromSlow::Happened(event.kind));
                }
                continue;
            };
            if of.as_ref().is_some_and(|of| !of(entities)) {
                self.found.0.send(event);
                continue;
            }
            let kind = match self.came.entry(entities) {
                Entry::Occupied(_) if change == Change::Begins => continue,
                Entry::Occupied(before) => {
                    let life = before.remove().life.followed_by(&life);
                    Kind::PairTouch { entities, change, life }
                }
                Entry::Vacant(_) => event.kind,
            };
            self.waiting.push_back(FromSlow::Happened(kind));
        }
        let pairs = &mut self.pairs;
        self.came.retain(|entities, pair| {
            let is_due = of.as_ref().is_none_or(|of| of(*entities));
            if is_due {
                pairs.adopt(pair, true);
            }
            !is_due
        });
    }

    /// In order: a pair that goes over begins before it ends.
    fn send_waiting(&mut self) {
        while self.to_fast.slots() > 0
            && let Some(next) = self.waiting.pop_front()
        {
            let _ = self.to_fast.push(next);
        }
    }
}
