//! What is new in a tick.
//!
//! Model: whoever steps tells, tick by tick, which fingers touch what ([`Watch::finger`]) and which entities press each other
//! ([`Watch::pairs`]); what differs from the tick before is sent. A finger's contact begins, slips and ends in the tick in
//! which rendering says so; what slips when it ends has first stopped to slip. A pair's begins with its first force and ends after
//! [`QUIET_S`] without any, so that a box that settles does not chatter; while both rest, asleep, it goes on. The same holds
//! for grasps. When a world ends, all that it has begun does, in that tick.
//!
//! Invariants: no allocation after `new`; in a tick at most [`MOST_TOLD`] events, more are counted as lost, and so is a
//! finger's contact without room. A pair or a grasp that finds no room is not watched. Where the sender's queue grows, so do the
//! room for pairs and the number of events. A world that ends may have any number of contacts, in either list: its watch is
//! sent as a whole, and its last events are made where they are received.
//! Cost: linear in what touches, beside searches in what is sorted; of an end, constant.

mod fingers;
mod grasps;
mod pairs;

use super::bus::Unfold;
use super::slow_pairs::{FastPairs, FromSlow};
use super::{Event, EventSender, Kind, Life, growing_event_queue};
use fingers::FingerWatch;
use grasps::Grasps;
use nalgebra::Vector3;
pub(super) use pairs::{Pair, Pairs};
use physics::PairStanding;

/// The most events that a tick sends, unless the queue grows.
pub const MOST_TOLD: usize = 256;
/// A pair or a grasp that was not seen for so long has ended (s).
pub const QUIET_S: f64 = 0.005;

/// A finger's contact in a tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Touching {
    /// With which entity.
    pub entity: u32,
    /// Its force on the user (N).
    pub force_on_user_W: Vector3<f64>,
    /// Whether it slides.
    pub slips: bool,
    /// Whether the entity can move, and so be held.
    pub is_body: bool,
}

/// What two entities do to each other in a tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PairForce {
    /// Which two; the first can move.
    pub entities: [u32; 2],
    /// The force on the first (N).
    pub force_W: Vector3<f64>,
}

/// State of the tick before; without any finger or pair at first, if it is none of a world.
#[derive(Debug, Default)]
pub struct Watch {
    fingers: Vec<FingerWatch>,
    pairs: Pairs,
    grasps: Grasps,
    /// Watch of the slow list's pairs, if there is one.
    slow: Option<FastPairs>,
    last_tick: Option<u64>,
    now: Now,
}

/// The tick that is looked at.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Now {
    pub(super) run_tick: u64,
    /// Since the one before (s).
    pub(super) dt_s: f64,
    pub(super) period_s: f64,
    /// How many events it may still send.
    pub(super) left: usize,
}

impl Watch {
    /// Of so many fingers, which touch nothing yet and at most so many entities at once, and so many pairs.
    pub fn new(fingers: usize, most_touched: usize, pairs: usize, period_s: f64) -> Self {
        Self {
            // Each made anew: a clone of a list without entries has no room.
            fingers: (0..fingers).map(|_| FingerWatch::new(most_touched)).collect(),
            pairs: Pairs::with_capacity(pairs),
            grasps: Grasps::new(),
            slow: None,
            last_tick: None,
            now: Now { period_s, ..Now::default() },
        }
    }

    /// Beside a slow list, if there is one.
    #[must_use]
    pub fn with_slow(self, slow: Option<FastPairs>) -> Self {
        Self { slow, ..self }
    }

    /// Begins a tick of the run; before it all that is told was so in the one before.
    pub fn begin(&mut self, run_tick: u64) {
        let ticks = self.last_tick.map_or(1, |last| run_tick.saturating_sub(last).max(1));
        self.last_tick = Some(run_tick);
        let period_s = self.now.period_s;
        self.now = Now { run_tick, dt_s: ticks as f64 * period_s, period_s, left: MOST_TOLD };
    }

    /// Takes a finger's contacts, in order of the entities, the pressed buttons of its device, and the entity tied to it.
    pub fn finger(
        &mut self,
        finger: usize,
        touching: &[Touching],
        buttons: u64,
        tied: Option<u32>,
        out: &mut EventSender,
    ) {
        if let Some(watched) = self.fingers.get_mut(finger) {
            let mut teller = Teller { now: &mut self.now, out };
            watched.look(finger as u32, touching, &mut teller);
            watched.look_at_device(finger as u32, buttons, tied, &mut teller);
        }
    }

    /// Pairs of entities that press each other, in a step of this length (s). `standing`: why two others may not.
    pub fn pairs(
        &mut self,
        pairs: impl Iterator<Item = PairForce>,
        dt_s: f64,
        standing: impl Fn([u32; 2]) -> PairStanding,
        out: &mut EventSender,
    ) {
        self.pairs.look(pairs, dt_s, standing, &mut Teller { now: &mut self.now, out });
    }

    /// Before [`Self::pairs`], where there is a slow list: takes up the pairs that come from there and what happened to those
    /// that are there, which is told in this tick.
    pub fn take_from_slow(&mut self, out: &mut EventSender) {
        // What happens here has the rest of the tick's events: it does not wait.
        let most = if out.grows() { usize::MAX } else { self.now.left / 2 };
        for _ in 0..most {
            let Some(Ok(next)) = self.slow.as_mut().map(|slow| slow.from_slow.pop()) else { break };
            self.take(next, out);
        }
    }

    fn take(&mut self, next: FromSlow, out: &mut EventSender) {
        match next {
            FromSlow::Goes(pair) => {
                // Its end will be missing.
                if !self.pairs.adopt(&pair.seen_in(self.now.run_tick), out.grows()) {
                    out.lose();
                }
            }
            FromSlow::Happened(kind) => self.tell(kind, out),
        }
    }

    /// The pairs that have gone to the slow list after a step of this length (s). Nobody knows their forces in it any more: they
    /// are taken to be those of the step before. The slow list's next turn goes on from so much earlier (s).
    pub fn go_to_slow(&mut self, (dt_s, ahead_s): (f64, f64), goes: impl Fn([u32; 2]) -> bool) {
        let Self { pairs, slow: Some(slow), now, .. } = self else { return };
        let tick = (now.run_tick, now.period_s);
        pairs.give_away(goes, |pair| slow.to_slow.push(pair.once_more(dt_s, ahead_s, tick)).is_ok());
    }

    /// After all fingers: who holds what.
    pub fn grasps(&mut self, out: &mut EventSender) {
        self.grasps.look(&self.fingers, &mut Teller { now: &mut self.now, out });
    }

    /// Before it ends: `next` watches the world that follows, and what devices do goes on.
    pub fn hand_on(&self, next: &mut Self) {
        for (finger, next) in self.fingers.iter().zip(&mut next.fingers) {
            next.go_on_from(finger.buttons());
        }
        next.last_tick = self.last_tick;
    }

    /// The world ends in this tick of the run: with it all that touches, is held or tied, in both lists. The watch comes back if
    /// there is no room for it, and what it knows to be lost is counted.
    ///
    /// # Errors
    /// The watch.
    pub fn end(self: Box<Self>, run_tick: u64, out: &mut EventSender) -> Result<(), Box<Self>> {
        out.send_whole(run_tick, self).inspect_err(|watch| {
            let of_fingers: usize = watch.fingers.iter().map(FingerWatch::open).sum();
            out.lose_all((of_fingers + watch.pairs.open() + watch.grasps.open()) as u64);
        })
    }

    /// The tick that was looked at last.
    pub fn last_tick(&self) -> Option<u64> {
        self.last_tick
    }

    /// Something that the caller has found.
    pub fn tell(&mut self, kind: Kind, out: &mut EventSender) {
        Teller { now: &mut self.now, out }.tell(kind);
    }
}

impl Unfold for Watch {
    fn unfold(mut self: Box<Self>, run_tick: u64) -> Vec<Event> {
        let (mut out, mut told) = growing_event_queue(0);
        self.begin(run_tick);
        let mut teller = Teller { now: &mut self.now, out: &mut out };
        for (number, finger) in (0..).zip(&mut self.fingers) {
            let buttons = finger.buttons();
            finger.look(number, &[], &mut teller);
            finger.look_at_device(number, buttons, None, &mut teller);
        }
        self.grasps.end(&mut teller);
        self.end_pairs(&mut out);
        std::iter::from_fn(|| told.receive(u64::MAX)).collect()
    }
}

impl Watch {
    /// First those of the slow list, some of which may be on their way to here.
    fn end_pairs(&mut self, out: &mut EventSender) {
        if let Some(mut slow) = self.slow.take() {
            let mut last = slow.end();
            while let Ok(next) = slow.from_slow.pop() {
                self.take(next, out);
            }
            last.told.drain(..).for_each(|next| self.take(next, out));
            last.pairs.end(&mut Teller { now: &mut self.now, out });
        }
        self.pairs.end(&mut Teller { now: &mut self.now, out });
    }
}

/// Sends what is new in a tick.
pub(super) struct Teller<'t> {
    pub(super) now: &'t mut Now,
    pub(super) out: &'t mut EventSender,
}

impl Teller<'_> {
    fn tell(&mut self, kind: Kind) {
        let event = Event { run_tick: self.now.run_tick, kind };
        let left = if self.grows() { Some(self.now.left) } else { self.now.left.checked_sub(1) };
        match left {
            Some(left) => {
                self.now.left = left;
                self.out.send(event);
            }
            None => self.out.lose(),
        }
    }

    /// There is room for whatever happens.
    fn grows(&self) -> bool {
        self.out.grows()
    }

    /// How long so many ticks are (s).
    fn time_s(&self, ticks: u64) -> f64 {
        ticks as f64 * self.now.period_s
    }
}
