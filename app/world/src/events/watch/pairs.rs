//! Contacts between entities.
//!
//! Model: while two sleep in touch, what they did to each other in the last tick before goes on: that was the force of their
//! rest, or none if they had just parted. Who waits for its turn has no time meanwhile, and nothing is added.

use super::{Life, PairForce, QUIET_S, Teller};
use crate::events::{Change, Kind};
use nalgebra::Vector3;
use physics::PairStanding;

/// Pairs that touch, in ascending order.
#[derive(Debug, Default)]
pub(in crate::events) struct Pairs {
    touching: Vec<Pair>,
    most: usize,
}

/// A contact; as such it goes over to the other side when its island does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::events) struct Pair {
    pub(in crate::events) entities: [u32; 2],
    pub(in crate::events) life: Life,
    /// The force in the tick that was looked at last.
    force_W: Vector3<f64>,
    /// Its last tick with a force, as this side counts.
    pressed: u64,
    /// For how long it has had none, awake (s).
    quiet_s: f64,
    /// It came from the other side, and its bodies may still be on their way.
    is_coming: bool,
    /// Nobody steps it, since it rests.
    is_asleep: bool,
    /// Part of its sleep that this side will count and the other one has counted (s).
    ahead_s: f64,
}

impl Pair {
    /// As a side knows it that takes it up in this tick.
    pub(in crate::events) fn seen_in(self, run_tick: u64) -> Self {
        Self { pressed: run_tick, is_coming: true, ..self }
    }

    /// After another tick of this length (s) with the same force, and no other than this side's last one. The other side will
    /// count so much time before that (s) as well.
    pub(super) fn once_more(mut self, dt_s: f64, ahead_s: f64, (run_tick, period_s): (u64, f64)) -> Self {
        if self.force_W != Vector3::zeros() {
            let since_s = run_tick.saturating_sub(self.pressed) as f64 * period_s;
            self.life.go_on(&self.force_W, dt_s, since_s);
        }
        Self { ahead_s, ..self }
    }

    /// After it has slept for so much longer (s).
    pub(in crate::events) fn after_sleep(mut self, for_s: f64) -> Self {
        if for_s > 0.0 {
            self.rest(for_s, for_s, self.pressed);
        }
        self
    }

    /// State before that, too.
    pub(in crate::events) fn after(self, before: &Self) -> Self {
        Self { life: before.life.followed_by(&self.life), ..self }
    }

    fn press(&mut self, force_W: &Vector3<f64>, dt_s: f64, since_s: f64, run_tick: u64) {
        self.life.go_on(force_W, dt_s, since_s);
        (self.force_W, self.pressed, self.quiet_s, self.ahead_s) = (*force_W, run_tick, 0.0, 0.0);
        (self.is_coming, self.is_asleep) = (false, false);
    }

    /// Goes on with the force that it had, if it has not just been taken up.
    fn rest(&mut self, dt_s: f64, since_s: f64, run_tick: u64) {
        let counted_s = self.ahead_s.min(dt_s);
        self.ahead_s -= counted_s;
        if self.force_W != Vector3::zeros() && since_s > 0.0 {
            self.life.go_on(&self.force_W, dt_s - counted_s, since_s - counted_s);
            self.pressed = run_tick;
        }
        (self.quiet_s, self.is_asleep) = (0.0, true);
    }

    /// A tick in which nobody says that it presses; whether it goes on.
    fn go_on(&mut self, standing: PairStanding, dt_s: f64, since_s: f64, run_tick: u64) -> bool {
        match standing {
            PairStanding::Asleep => self.rest(dt_s, since_s, run_tick),
            PairStanding::Waiting => self.quiet_s = 0.0,
            PairStanding::Away if self.is_coming => {
                if self.is_asleep {
                    self.rest(dt_s, since_s, run_tick);
                }
                return true;
            }
            PairStanding::Stepped | PairStanding::Away => {
                (self.force_W, self.is_asleep, self.ahead_s) = (Vector3::zeros(), false, 0.0);
                self.quiet_s += dt_s;
            }
        }
        self.is_coming = false;
        self.quiet_s < QUIET_S
    }

    fn tell(&self, change: Change, teller: &mut Teller<'_>) {
        teller.tell(Kind::PairTouch { entities: self.entities, change, life: self.life });
    }
}

impl Pairs {
    /// Takes up one that the other side has watched until now, if there is room or there may be more: says whether.
    pub(in crate::events) fn adopt(&mut self, from: &Pair, grows: bool) -> bool {
        match self.touching.binary_search_by_key(&from.entities, |pair| pair.entities) {
            Ok(at) => self.touching[at] = self.touching[at].after(from),
            Err(at) if grows || self.touching.len() < self.most => self.touching.insert(at, *from),
            Err(_) => return false,
        }
        true
    }

    /// Gives those away that the other side will watch, as far as it takes them.
    pub(in crate::events) fn give_away(
        &mut self,
        goes: impl Fn([u32; 2]) -> bool,
        mut give: impl FnMut(Pair) -> bool,
    ) {
        self.touching.retain(|pair| !(goes(pair.entities) && give(*pair)));
    }

    pub(in crate::events) fn with_capacity(most: usize) -> Self {
        Self { touching: Vec::with_capacity(most), most }
    }

    pub(in crate::events) fn look(
        &mut self,
        pairs: impl Iterator<Item = PairForce>,
        dt_s: f64,
        standing: impl Fn([u32; 2]) -> PairStanding,
        teller: &mut Teller<'_>,
    ) {
        let mut hint = 0;
        for pair in pairs.filter(|pair| pair.force_W != Vector3::zeros()) {
            hint = self.press(&pair, hint, dt_s, teller);
        }
        let now = teller.now.run_tick;
        self.touching.retain_mut(|pair| {
            if pair.pressed == now && !pair.is_coming {
                return true;
            }
            let since_s = teller.time_s(now.saturating_sub(pair.pressed));
            let stays = pair.go_on(standing(pair.entities), dt_s, since_s, now);
            if !stays {
                pair.tell(Change::Ends, teller);
            }
            stays
        });
    }

    /// Number of them.
    pub(super) fn open(&self) -> usize {
        self.touching.len()
    }

    /// All of them end.
    pub(in crate::events) fn end(&mut self, teller: &mut Teller<'_>) {
        for pair in self.touching.drain(..) {
            pair.tell(Change::Ends, teller);
        }
    }

    /// Says where the next one is likely to be.
    fn press(&mut self, pair: &PairForce, hint: usize, dt_s: f64, teller: &mut Teller<'_>) -> usize {
        let PairForce { entities, force_W } = *pair;
        let found = match self.touching.get(hint) {
            Some(next) if next.entities == entities => Ok(hint),
            _ => self.touching.binary_search_by_key(&entities, |pair| pair.entities),
        };
        let now = teller.now.run_tick;
        match found {
            Ok(at) => {
                let since_s = teller.time_s(now.saturating_sub(self.touching[at].pressed));
                self.touching[at].press(&force_W, dt_s, since_s, now);
                at + 1
            }
            Err(at) if teller.grows() || self.touching.len() < self.most => {
                let mut begun = Pair {
                    entities,
                    life: Life::default(),
                    force_W,
                    pressed: now,
                    quiet_s: 0.0,
                    is_coming: false,
                    is_asleep: false,
                    ahead_s: 0.0,
                };
                begun.press(&force_W, dt_s, dt_s, now);
                begun.tell(Change::Begins, teller);
                self.touching.insert(at, begun);
                at + 1
            }
            Err(at) => at,
        }
    }
}
