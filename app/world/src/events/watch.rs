//! What is new in a tick.
//!
//! Model: whoever steps tells, tick by tick, which fingers touch what ([`Watch::finger`]) and which entities press each other
//! ([`Watch::pairs`]); what differs from the tick before is sent. A finger's contact begins, slips and ends in the tick in
//! which rendering says so. A pair's begins with its first force and ends after [`QUIET_S`] without any, so that a box that
//! settles does not chatter; while both rest, asleep, it goes on. The same holds for grasps.
//!
//! Invariants: no allocation after `new`; in a tick at most [`MOST_TOLD`] events, more are counted as lost, and so is a
//! finger's contact without room. A pair or a grasp that finds no room is not watched. Where the sender's queue grows, so do the
//! room for pairs and the number of events.
//! Cost: linear in what touches, beside searches in what is sorted.

mod fingers;
mod grasps;
mod pairs;

use super::slow_pairs::{FastPairs, FromSlow};
use super::{Event, EventSender, Kind, Life};
use fingers::FingerWatch;
use grasps::Grasps;
use nalgebra::Vector3;
pub(super) use pairs::{PairLife, Pairs};

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

/// What was so in the tick before.
#[derive(Debug)]
pub struct Watch {
    fingers: Vec<FingerWatch>,
    pairs: Pairs,
    grasps: Grasps,
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
            last_tick: None,
            now: Now { period_s, ..Now::default() },
        }
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

    /// Which entities press each other, in a step of this length (s). `rests`: whether two that do not are asleep.
    pub fn pairs(
        &mut self,
        pairs: impl Iterator<Item = PairForce>,
        dt_s: f64,
        rests: impl Fn([u32; 2]) -> bool,
        out: &mut EventSender,
    ) {
        self.pairs.look(pairs, dt_s, rests, &mut Teller { now: &mut self.now, out });
    }

    /// Before [`Self::pairs`], where there is a slow list: takes up the pairs that come from there and what happened to those
    /// that are there, which is told in this tick.
    pub fn take_from_slow(&mut self, slow: &mut FastPairs, out: &mut EventSender) {
        let most = if out.grows() { usize::MAX } else { MOST_TOLD };
        for _ in 0..most {
            match slow.from_slow.pop() {
                Ok(FromSlow::Life(life)) => {
                    self.pairs.adopt(&life.seen_in(self.now.run_tick), out.grows());
                }
                Ok(FromSlow::Happened(kind)) => self.tell(kind, out),
                Err(_) => break,
            }
        }
    }

    /// The pairs that go to the slow list.
    pub fn go_to_slow(&mut self, slow: &mut FastPairs, goes: impl Fn([u32; 2]) -> bool) {
        let to_slow = &mut slow.to_slow;
        self.pairs.give_away(goes, |life| to_slow.push(life).is_ok());
    }

    /// After all fingers: who holds what.
    pub fn grasps(&mut self, out: &mut EventSender) {
        self.grasps.look(&self.fingers, &mut Teller { now: &mut self.now, out });
    }

    /// The world ends: with it all that touches, is held or tied. `next` watches the one that follows; what devices do goes on.
    pub fn end(&mut self, next: &mut Self, out: &mut EventSender) {
        let mut teller = Teller { now: &mut self.now, out };
        for (number, finger) in self.fingers.iter_mut().enumerate() {
            let buttons = finger.buttons();
            finger.look(number as u32, &[], &mut teller);
            finger.look_at_device(number as u32, buttons, None, &mut teller);
            if let Some(next) = next.fingers.get_mut(number) {
                next.go_on_from(buttons);
            }
        }
        self.pairs.end(&mut teller);
        self.grasps.end(&mut teller);
        next.last_tick = self.last_tick;
    }

    /// Something that the caller has found.
    pub fn tell(&mut self, kind: Kind, out: &mut EventSender) {
        Teller { now: &mut self.now, out }.tell(kind);
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
