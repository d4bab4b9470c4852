//! Contacts between entities.

use super::{Life, PairForce, QUIET_S, Teller};
use crate::events::{Change, Kind};
use nalgebra::Vector3;

/// Pairs that touch, in ascending order.
#[derive(Debug)]
pub(in crate::events) struct Pairs {
    touching: Vec<Pair>,
    most: usize,
}

#[derive(Debug, Clone, Copy)]
struct Pair {
    entities: [u32; 2],
    life: Life,
    /// Its last tick with a force.
    pressed: u64,
    /// For how long it has had none, awake (s).
    quiet_s: f64,
}

/// A contact that goes on on the other side.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::events) struct PairLife {
    pub(in crate::events) entities: [u32; 2],
    pub(in crate::events) life: Life,
    quiet_s: f64,
    /// Its last tick with a force, as that side counts.
    pressed: u64,
}

impl PairLife {
    /// As a side knows it whose tick this is.
    pub(in crate::events) fn seen_in(self, run_tick: u64) -> Self {
        Self { pressed: run_tick, ..self }
    }
}

impl Pairs {
    /// Takes up one that the other side has watched until now, if there is room or there may be more.
    pub(in crate::events) fn adopt(&mut self, from: &PairLife, grows: bool) {
        let PairLife { entities, life, quiet_s, pressed } = *from;
        match self.touching.binary_search_by_key(&entities, |pair| pair.entities) {
            Ok(at) => self.touching[at].life = life.followed_by(&self.touching[at].life),
            Err(at) if grows || self.touching.len() < self.most => {
                self.touching.insert(at, Pair { entities, life, pressed, quiet_s });
            }
            Err(_) => {}
        }
    }

    /// Gives those away that the other side will watch, as far as it takes them.
    pub(in crate::events) fn give_away(
        &mut self,
        goes: impl Fn([u32; 2]) -> bool,
        mut give: impl FnMut(PairLife) -> bool,
    ) {
        self.touching.retain(|pair| {
            let Pair { entities, life, quiet_s, pressed } = *pair;
            !(goes(entities) && give(PairLife { entities, life, quiet_s, pressed }))
        });
    }

    pub(in crate::events) fn with_capacity(most: usize) -> Self {
        Self { touching: Vec::with_capacity(most), most }
    }

    pub(in crate::events) fn look(
        &mut self,
        pairs: impl Iterator<Item = PairForce>,
        dt_s: f64,
        rests: impl Fn([u32; 2]) -> bool,
        teller: &mut Teller<'_>,
    ) {
        let mut hint = 0;
        for pair in pairs.filter(|pair| pair.force_W != Vector3::zeros()) {
            hint = self.press(&pair, hint, dt_s, teller);
        }
        let now = teller.now.run_tick;
        self.touching.retain_mut(|pair| {
            if pair.pressed == now {
                return true;
            }
            pair.quiet_s = if rests(pair.entities) { 0.0 } else { pair.quiet_s + dt_s };
            let stays = pair.quiet_s < QUIET_S;
            if !stays {
                pair.tell(Change::Ends, teller);
            }
            stays
        });
    }

    /// All of them end.
    pub(super) fn end(&mut self, teller: &mut Teller<'_>) {
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
                let known = &mut self.touching[at];
                known.life.go_on(&force_W, dt_s, since_s);
                (known.pressed, known.quiet_s) = (now, 0.0);
                at + 1
            }
            Err(at) if teller.grows() || self.touching.len() < self.most => {
                let mut begun = Pair { entities, life: Life::default(), pressed: now, quiet_s: 0.0 };
                begun.life.go_on(&force_W, dt_s, dt_s);
                begun.tell(Change::Begins, teller);
                self.touching.insert(at, begun);
                at + 1
            }
            Err(at) => at,
        }
    }
}

impl Pair {
    fn tell(&self, change: Change, teller: &mut Teller<'_>) {
        teller.tell(Kind::PairTouch { entities: self.entities, change, life: self.life });
    }
}
