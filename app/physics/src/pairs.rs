//! The pairs of entities that are near each other: a pool that changes as they move.
//!
//! Model: a pair begins when the boxes of a body and of another entity come to overlap ([`BroadPhase`]), and keeps what it
//! remembers of where they touch until they do not any more. Pairs without a body that is awake are kept apart: nobody looks
//! at them until one is woken.
//! Invariants: of two bodies there is one pair, whose first is the one of the lower number; pairs are gone through in
//! ascending order; no allocation after `with_capacity`. Where there is no room for one more it is left out, and counted.

use haptics::Entity;

use crate::broad_phase::BroadPhase;
use crate::pair::{Pair, Response, Surfacing};

/// Pairs, and which bodies and entities they are of.
#[derive(Debug, Clone)]
pub(crate) struct Pairs {
    pool: Box<[Pair]>,
    unused: Vec<u32>,
    /// Those with a body that is awake.
    awake: Vec<Key>,
    /// The others.
    asleep: Vec<Key>,
    /// How many were left out for want of room.
    pub(crate) left_out: u64,
}

/// A pair, in the order in which they are gone through.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Key {
    /// A body.
    pub(crate) body: u32,
    /// An entity, which may be a body of a higher number.
    pub(crate) entity: u32,
    place: u32,
}

/// Who is who.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Who<'w> {
    /// All of them.
    pub(crate) all: &'w [Entity],
    /// Of each body, its entity.
    pub(crate) entities: &'w [usize],
    /// Of each entity, its body.
    pub(crate) bodies: &'w [Option<u32>],
    /// How contacts between entities answer.
    pub(crate) response: Response,
}

impl Pairs {
    pub(crate) fn with_capacity(pairs: usize) -> Self {
        Self {
            pool: vec![Pair::default(); pairs].into(),
            unused: (0..pairs as u32).rev().collect(),
            awake: Vec::with_capacity(pairs),
            asleep: Vec::with_capacity(pairs),
            left_out: 0,
        }
    }

    /// How many have a body that is awake.
    pub(crate) fn awake_count(&self) -> usize {
        self.awake.len()
    }

    /// One of them, in order.
    pub(crate) fn awake_at(&mut self, at: usize) -> (Key, &mut Pair) {
        let key = self.awake[at];
        (key, &mut self.pool[key.place as usize])
    }

    /// Those that have a body that is awake, in order.
    pub(crate) fn iter_awake(&self) -> impl Iterator<Item = (Key, &Pair)> {
        self.awake.iter().map(|key| (*key, &self.pool[key.place as usize]))
    }

    /// All pairs, those without an awake body last.
    pub(crate) fn iter(&self) -> impl Iterator<Item = (Key, &Pair)> {
        self.awake.iter().chain(&self.asleep).map(|key| (*key, &self.pool[key.place as usize]))
    }

    /// Begins and ends pairs of a body whose box has changed.
    pub(crate) fn follow(&mut self, body: usize, who: &Who<'_>, broad_phase: &BroadPhase) {
        let own = who.entities[body];
        let overlap = |key: &Key| {
            let boxes = [who.entities[key.body as usize], key.entity as usize]
                .map(|entity| broad_phase.around(entity));
            matches!(boxes, [Some(one), Some(other)] if one.overlaps(other)) || boxes.contains(&None)
        };
        let is_of_body = |key: &Key| key.body as usize == body || key.entity as usize == own;
        let (pool, unused) = (&mut self.pool, &mut self.unused);
        self.awake.retain(|key| {
            let stays = !is_of_body(key) || overlap(key);
            if !stays {
                pool[key.place as usize] = Pair::default();
                unused.push(key.place);
            }
            stays
        });
        self.meet(body, who, broad_phase);
    }

    /// Begins the pairs of a body that are missing.
    pub(crate) fn meet(&mut self, body: usize, who: &Who<'_>, broad_phase: &BroadPhase) {
        if let Some(around) = broad_phase.around(who.entities[body]) {
            broad_phase.near(around, |entity| self.begin(body, entity, who));
        }
    }

    /// Ends all of them.
    pub(crate) fn clear(&mut self) {
        for key in self.awake.drain(..).chain(self.asleep.drain(..)) {
            self.pool[key.place as usize] = Pair::default();
            self.unused.push(key.place);
        }
    }

    fn begin(&mut self, body: usize, entity: usize, who: &Who<'_>) {
        let own = who.entities[body];
        let other = who.bodies[entity].map(|other| other as usize);
        let (one, two) = (&who.all[own], &who.all[entity]);
        let meet = one.is_collidable && two.is_collidable && one.space == two.space;
        if other == Some(body) || !meet {
            return;
        }
        let [first, second] = match other {
            Some(other) if other < body => [other, own],
            _ => [body, entity],
        };
        let at = |keys: &[Key]| {
            keys.binary_search_by_key(&(first, second), |key| (key.body as usize, key.entity as usize))
        };
        let Err(place_in_order) = at(&self.awake) else { return };
        if at(&self.asleep).is_ok() {
            return;
        }
        let Some(place) = self.unused.pop() else {
            self.left_out += 1;
            return;
        };
        let entities = [who.entities[first], second];
        let surfacing = Surfacing::between(&who.all[entities[0]], &who.all[second], who.response);
        self.pool[place as usize] = Pair::new(entities, surfacing);
        self.awake.insert(place_in_order, Key { body: first as u32, entity: second as u32, place });
    }

    /// Takes up the pairs of a body that was woken, and begins those that are missing.
    pub(crate) fn wake(&mut self, body: usize, who: &Who<'_>, broad_phase: &BroadPhase) {
        let own = who.entities[body];
        let awake = &mut self.awake;
        self.asleep.retain(|key| {
            let is_woken = key.body as usize == body || key.entity as usize == own;
            if is_woken {
                let at = awake.partition_point(|other| other < key);
                awake.insert(at, *key);
            }
            !is_woken
        });
        self.follow(body, who, broad_phase);
    }

    /// Puts those aside of which no body is awake any more.
    pub(crate) fn put_to_sleep(&mut self, is_awake: impl Fn(usize) -> bool, who: &Who<'_>) {
        let asleep = &mut self.asleep;
        self.awake.retain(|key| {
            let other = who.bodies[key.entity as usize];
            let stays = is_awake(key.body as usize) || other.is_some_and(|other| is_awake(other as usize));
            if !stays {
                let at = asleep.partition_point(|other| other < key);
                asleep.insert(at, *key);
            }
            stays
        });
    }

    /// Puts a pair that comes from elsewhere, with all that it remembers; one that is there already becomes it.
    pub(crate) fn put(&mut self, key: Key, pair: &Pair, is_awake: impl Fn(usize) -> bool, who: &Who<'_>) {
        let other = who.bodies[key.entity as usize];
        let is_awake = is_awake(key.body as usize) || other.is_some_and(|other| is_awake(other as usize));
        let at =
            |keys: &[Key]| keys.binary_search_by_key(&(key.body, key.entity), |key| (key.body, key.entity));
        let known = [&self.awake, &self.asleep].into_iter().find_map(|keys| Some(keys[at(keys).ok()?].place));
        if let Some(place) = known {
            self.pool[place as usize] = pair.clone();
            return;
        }
        let Some(place) = self.unused.pop() else {
            self.left_out += 1;
            return;
        };
        self.pool[place as usize] = pair.clone();
        let keys = if is_awake { &mut self.awake } else { &mut self.asleep };
        let Err(at) = at(keys) else { return };
        keys.insert(at, Key { place, ..key });
    }

    /// Ends all pairs of a body.
    pub(crate) fn leave(&mut self, body: usize, who: &Who<'_>) {
        let own = who.entities[body];
        let (pool, unused) = (&mut self.pool, &mut self.unused);
        for keys in [&mut self.awake, &mut self.asleep] {
            keys.retain(|key| {
                let goes = key.body as usize == body || key.entity as usize == own;
                if goes {
                    pool[key.place as usize] = Pair::default();
                    unused.push(key.place);
                }
                !goes
            });
        }
    }
}
