//! The pairs of entities that are near each other: a pool that changes as they move.
//!
//! Model: a pair begins when the boxes of a body and of another entity come to overlap ([`BroadPhase`]), and keeps what it
//! remembers of where they touch until they do not any more. Pairs without a body that is awake are kept apart: nobody looks
//! at them until one is woken.
//! Invariants: of two bodies there is one pair, whose first is the one of the lower number; pairs are gone through in
//! ascending order; no allocation after `with_capacity`. Where there is no room for one more it is left out, counted,
//! and begun when [there is more](Pairs::take). Who has no deadlines makes room when it is needed ([`Pairs::growing`]), and
//! leaves none out.
//! What has ended is not cleared: who begins in its place overwrites what is read.

mod pool;

use haptics::{Entity, Shape};

pub(crate) use pool::CHUNK;
use pool::{Chunk, Pool};

use crate::broad_phase::BroadPhase;
use crate::collide::bounding_ball;
use crate::contacts::Contacts;
use crate::pair::{self, Head, Pair, REACH_M, Surfacing};

/// The most pairs that there can be, two million: others are left out, and counted.
pub const MOST_PAIRS: usize = pool::MOST;

/// Pairs, and which bodies and entities they are of.
#[derive(Debug, Clone)]
pub(crate) struct Pairs {
    pool: Pool,
    unused: Vec<u32>,
    /// Those with a body that is awake.
    awake: Vec<Key>,
    /// The others.
    asleep: Vec<Key>,
    /// Room for those that begin in a tick.
    fresh: Vec<Key>,
    /// Number that was left out for want of room, in ticks in which they were missing.
    pub(crate) left_out: u64,
    /// Number that will be, if there is no room before the next one.
    pub(crate) missing: u64,
    /// True if any were since there was more room.
    lacks_some: bool,
    /// There are no more of them in the world.
    most: usize,
    /// Room is made when it is needed, whoever waits for that.
    grows: bool,
}

/// Room for more pairs than there were.
#[derive(Debug)]
pub(crate) struct MorePairs {
    chunks: Vec<Chunk>,
    unused: Vec<u32>,
    awake: Vec<Key>,
    asleep: Vec<Key>,
    fresh: Vec<Key>,
}

impl MorePairs {
    /// More by so many, for `pairs` in all.
    pub(crate) fn new(more: usize, pairs: usize) -> Self {
        let [awake, asleep, fresh] = [(); 3].map(|()| Vec::with_capacity(pairs));
        Self { chunks: pool::chunks(more), unused: Vec::with_capacity(pairs), awake, asleep, fresh }
    }
}

/// A pair, in the order in which they are gone through.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Key {
    /// A body.
    pub(crate) body: u32,
    /// An entity, which may be a body of a higher number.
    pub(crate) entity: u32,
    place: u32,
    /// True if they were near enough to touch in the last tick, or when the pair began if that was later.
    pub(crate) is_near: bool,
}

impl Key {
    /// Of two that are at this place in the pool.
    pub(crate) fn new([body, entity]: [u32; 2], is_near: bool, place: u32) -> Self {
        Self { body, entity, place, is_near }
    }
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
    pub(crate) contacts: Contacts,
}

impl Pairs {
    /// Room for so many, and there will never be more than `most`.
    pub(crate) fn with_capacity(pairs: usize, most: usize) -> Self {
        let pool = Pool::new(pool::chunks(pairs));
        let pairs = pool.len();
        Self {
            unused: (0..pairs as u32).rev().collect(),
            awake: Vec::with_capacity(pairs),
            asleep: Vec::with_capacity(pairs),
            fresh: Vec::with_capacity(pairs),
            left_out: 0,
            missing: 0,
            lacks_some: false,
            most: most.min(pool::MOST),
            grows: false,
            pool,
        }
    }

    /// Room for so many at first, of which more is made whenever it is needed: for who has no deadlines. None is left out then.
    pub(crate) fn growing(at_first: usize, most: usize) -> Self {
        Self { grows: true, ..Self::with_capacity(at_first, most) }
    }

    /// Room is made when it is needed, here and for contact points.
    pub(crate) fn grow(&self) -> bool {
        self.grows
    }

    /// A place for one more; of those that grow there is one.
    fn place(&mut self, is_full: bool) -> Option<u32> {
        if self.grows && self.unused.is_empty() {
            let begin = self.pool.len() as u32;
            if self.pool.grow() {
                self.unused.extend((begin..self.pool.len() as u32).rev());
            }
        }
        self.unused.pop_if(|_| self.grows || !is_full)
    }

    /// Number that has room.
    pub(crate) fn room(&self) -> usize {
        self.pool.len()
    }

    /// Number that should have room, if that is more than has: twice as many as are used.
    pub(crate) fn wanted(&self) -> Option<usize> {
        if self.grows {
            return None;
        }
        let room = self.pool.len();
        let used = room - self.unused.len() + (self.missing as usize).min(room);
        let wanted = (2 * used).max(room + room / 2).min(self.most).next_multiple_of(CHUNK);
        (wanted > room && 8 * used > 5 * room).then_some(wanted)
    }

    /// Takes more room; what it replaces is left behind. Says whether pairs are missing, which then have to be begun.
    pub(crate) fn take(&mut self, more: &mut MorePairs) -> bool {
        let begin = self.pool.len() as u32;
        self.pool.add(&mut more.chunks);
        more.unused.clear();
        more.unused.extend((begin..self.pool.len() as u32).rev());
        more.unused.extend_from_slice(&self.unused);
        std::mem::swap(&mut self.unused, &mut more.unused);
        std::mem::swap(&mut self.fresh, &mut more.fresh);
        for (own, more) in [(&mut self.awake, &mut more.awake), (&mut self.asleep, &mut more.asleep)] {
            more.extend_from_slice(own);
            std::mem::swap(own, more);
        }
        self.missing = 0;
        std::mem::take(&mut self.lacks_some)
    }

    /// How many have a body that is awake.
    pub(crate) fn awake_count(&self) -> usize {
        self.awake.len()
    }

    /// One of them, in order.
    pub(crate) fn awake_at(&mut self, at: usize) -> (Key, &mut Pair) {
        let key = self.awake[at];
        (key, &mut self.pool[key.place])
    }

    /// Takes note whether one of them is near enough to touch.
    pub(crate) fn set_near(&mut self, at: usize, is_near: bool) {
        self.awake[at].is_near = is_near;
    }

    /// One that is known by its key, wherever that is.
    pub(crate) fn of_key(&self, key: &Key) -> &Pair {
        &self.pool[key.place]
    }

    /// The keys of all pairs, those without an awake body last.
    pub(crate) fn keys(&self) -> impl Iterator<Item = &Key> {
        self.awake.iter().chain(&self.asleep)
    }

    /// Those with a body that is awake.
    pub(crate) fn awake_keys(&self) -> &[Key] {
        &self.awake
    }

    /// How many [`Self::keys`] there are.
    pub(crate) fn key_count(&self) -> usize {
        self.awake.len() + self.asleep.len()
    }

    /// One of them.
    pub(crate) fn key_at(&self, at: usize) -> &Key {
        self.awake.get(at).unwrap_or_else(|| &self.asleep[at - self.awake.len()])
    }

    /// Those that have a body that is awake, in order.
    pub(crate) fn iter_awake(&self) -> impl Iterator<Item = (Key, &Pair)> {
        self.awake.iter().map(|key| (*key, &self.pool[key.place]))
    }

    /// All pairs, those without an awake body last.
    pub(crate) fn iter(&self) -> impl Iterator<Item = (Key, &Pair)> {
        self.awake.iter().chain(&self.asleep).map(|key| (*key, &self.pool[key.place]))
    }

    /// Begins and ends pairs of a body whose box has changed. Whether somebody has put it where it is, or what it meets there.
    pub(crate) fn follow(&mut self, body: usize, who: &Who<'_>, broad_phase: &BroadPhase, was_put: bool) {
        let own = who.entities[body];
        self.end_apart(who, broad_phase, |key| key.body as usize == body || key.entity as usize == own);
        self.meet(body, who, broad_phase, was_put);
    }

    /// Begins the pairs of a body that are missing.
    pub(crate) fn meet(&mut self, body: usize, who: &Who<'_>, broad_phase: &BroadPhase, was_put: bool) {
        if let Some(around) = broad_phase.around(who.entities[body]) {
            broad_phase.near(around, |entity| self.begin(body, entity, who, was_put));
        }
    }

    /// Ends all of them.
    pub(crate) fn clear(&mut self) {
        self.unused.extend(self.awake.drain(..).chain(self.asleep.drain(..)).map(|key| key.place));
    }

    /// As [`Self::follow`], of all bodies that have moved by themselves, which are marked.
    pub(crate) fn follow_all(
        &mut self,
        moved: &[u32],
        is_moved: &[bool],
        who: &Who<'_>,
        broad_phase: &BroadPhase,
    ) {
        let has_moved = |entity: usize| who.bodies[entity].is_some_and(|body| is_moved[body as usize]);
        self.end_apart(who, broad_phase, |key| is_moved[key.body as usize] || has_moved(key.entity as usize));
        let mut fresh = std::mem::take(&mut self.fresh);
        for body in moved.iter().map(|&body| body as usize) {
            let Some(around) = broad_phase.around(who.entities[body]) else { continue };
            broad_phase.near(around, |entity| {
                // Of two that have moved the first one finds the other.
                let is_found = who.bodies[entity].is_some_and(|other| (other as usize) < body);
                if !(is_found && has_moved(entity))
                    && let Some((_, key)) = self.begun(body, entity, who, false)
                {
                    fresh.push(key);
                }
            });
        }
        merge(&mut self.awake, &mut fresh);
        self.fresh = fresh;
    }

    /// Ends those whose boxes do not overlap any more, among these; what touched in this tick ends later.
    fn end_apart(&mut self, who: &Who<'_>, broad_phase: &BroadPhase, among: impl Fn(&Key) -> bool) {
        let overlap = |key: &Key| {
            let boxes = [who.entities[key.body as usize], key.entity as usize]
                .map(|entity| broad_phase.around(entity));
            matches!(boxes, [Some(one), Some(other)] if one.overlaps(other)) || boxes.contains(&None)
        };
        let Self { unused, pool, .. } = self;
        self.awake.retain(|key| {
            // Whoever touched in this tick is still asked what it did.
            let stays = !among(key) || overlap(key) || pool[key.place].touches();
            if !stays {
                unused.push(key.place);
            }
            stays
        });
    }

    fn begin(&mut self, body: usize, entity: usize, who: &Who<'_>, was_put: bool) {
        if let Some((at, key)) = self.begun(body, entity, who, was_put) {
            self.awake.insert(at, key);
        }
    }

    /// A pair that is missing, and where it belongs among those awake.
    fn begun(&mut self, body: usize, entity: usize, who: &Who<'_>, was_put: bool) -> Option<(usize, Key)> {
        let own = who.entities[body];
        let other = who.bodies[entity].map(|other| other as usize);
        let (one, two) = (&who.all[own], &who.all[entity]);
        let meet = one.is_collidable && two.is_collidable && one.space == two.space;
        if other == Some(body) || !meet {
            return None;
        }
        let [first, second] = match other {
            Some(other) if other < body => [other, own],
            _ => [body, entity],
        };
        let at = |keys: &[Key]| {
            keys.binary_search_by_key(&(first, second), |key| (key.body as usize, key.entity as usize))
        };
        let place_in_order = at(&self.awake).err()?;
        if at(&self.asleep).is_ok() {
            return None;
        }
        let is_full = other.is_some() && self.unused.len() <= self.pool.len() / 4;
        let Some(place) = self.place(is_full) else {
            self.missing += 1;
            self.lacks_some = true;
            return None;
        };
        let entities = [who.entities[first], second];
        let both = entities.map(|entity| &who.all[entity]);
        let surfacing = Surfacing::between(both[0], both[1], &who.contacts);
        let has_mesh = both.iter().any(|entity| matches!(entity.shape, Shape::Mesh(_)));
        self.pool[place].begin(entities, has_mesh, surfacing, was_put);
        let way_m: f64 = both.map(way_m).iter().sum();
        let is_near = pair::is_near(both[0], both[1], REACH_M + way_m);
        Some((place_in_order, Key::new([first as u32, second as u32], is_near, place)))
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
        self.follow(body, who, broad_phase, true);
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

    /// Takes up the pairs of bodies that are awake now, and puts those aside of which none is any more. No box has changed.
    pub(crate) fn regroup(&mut self, is_awake: impl Fn(usize) -> bool, who: &Who<'_>) {
        let Self { awake, asleep, fresh, .. } = self;
        let is_awake = |key: &Key| {
            let other = who.bodies[key.entity as usize];
            is_awake(key.body as usize) || other.is_some_and(|other| is_awake(other as usize))
        };
        move_out(awake, fresh, |key| !is_awake(key));
        merge(asleep, fresh);
        move_out(asleep, fresh, is_awake);
        merge(awake, fresh);
    }

    /// Begins a pair as it was elsewhere, in none of the lists: `None` where there is no room.
    pub(crate) fn begin_as(&mut self, head: &Head) -> Option<u32> {
        let Some(place) = self.place(false) else {
            self.missing += 1;
            return None;
        };
        self.pool[place].begin_as(head);
        Some(place)
    }

    /// What the surface of an entity makes of those that it meets is another thing now.
    pub(crate) fn resurface(&mut self, entity: usize, who: &Who<'_>) {
        for key in self.awake.iter().chain(&self.asleep) {
            let pair = &mut self.pool[key.place];
            if pair.entities.contains(&entity) {
                pair.resurface(who);
            }
        }
    }

    /// These entities were driven while these bodies waited for their turn.
    pub(crate) fn were_driven_among(&mut self, moved: &[u32], concerns: impl Fn(u32) -> bool, who: &Who<'_>) {
        if moved.is_empty() {
            return;
        }
        for key in &self.awake {
            let [own, other] = [who.entities[key.body as usize] as u32, key.entity];
            let body_of = |entity: u32| who.bodies[entity as usize];
            let is_met =
                |moved_one: u32, met: u32| moved.contains(&moved_one) && body_of(met).is_some_and(&concerns);
            if is_met(own, other) || is_met(other, own) {
                self.pool[key.place].was_pushed();
            }
        }
    }

    /// An entity was put somewhere else by somebody.
    pub(crate) fn was_put(&mut self, entity: usize) {
        for key in self.awake.iter().chain(&self.asleep) {
            let pair = &mut self.pool[key.place];
            if pair.entities.contains(&entity) {
                pair.was_put();
            }
        }
    }

    /// One that was [begun](Self::begin_as) there.
    pub(crate) fn at_place(&mut self, place: u32) -> &mut Pair {
        &mut self.pool[place]
    }

    /// Puts pairs into the lists that were [begun](Self::begin_as) apart, which are sorted by it; one that is there already becomes
    /// what comes.
    pub(crate) fn let_in(&mut self, coming: &mut [Key], is_awake: impl Fn(usize) -> bool, who: &Who<'_>) {
        coming.sort_unstable();
        let of = |key: &Key| (key.body, key.entity);
        let Self { pool, unused, awake, asleep, fresh, .. } = self;
        for keys in [&mut *awake, &mut *asleep] {
            keys.retain(|key| {
                let is_known = coming.binary_search_by_key(&of(key), of).is_ok();
                if is_known {
                    unused.push(key.place);
                }
                !is_known
            });
        }
        for is_of_awake in [true, false] {
            for key in &*coming {
                let other = who.bodies[key.entity as usize];
                let has_awake =
                    is_awake(key.body as usize) || other.is_some_and(|other| is_awake(other as usize));
                if has_awake == is_of_awake {
                    // Whoever sent it may not know yet what is known here.
                    pool[key.place].resurface(who);
                    fresh.push(*key);
                }
            }
            merge(if is_of_awake { &mut *awake } else { &mut *asleep }, fresh);
        }
    }

    /// Ends the pairs of a body that is elsewhere from now on, but for those with who is awake.
    pub(crate) fn leave(&mut self, body: usize, is_awake: impl Fn(usize) -> bool, who: &Who<'_>) {
        let unused = &mut self.unused;
        for keys in [&mut self.awake, &mut self.asleep] {
            keys.retain(|key| {
                let first = key.body as usize;
                let other = who.bodies[key.entity as usize].map(|other| other as usize);
                let stays = match (first == body, other == Some(body)) {
                    (true, _) => other.is_some_and(&is_awake),
                    (_, true) => is_awake(first),
                    _ => true,
                };
                if !stays {
                    unused.push(key.place);
                }
                stays
            });
        }
    }

    /// Takes the pairs of bodies that leave out of the lists: `taken` are those that go along, with what is fixed and with each
    /// other. Those with who is awake and stays go on, all others end.
    pub(crate) fn take_out(
        &mut self,
        leaves: impl Fn(usize) -> bool,
        is_awake: impl Fn(usize) -> bool,
        who: &Who<'_>,
        taken: &mut Vec<Key>,
    ) {
        let unused = &mut self.unused;
        for keys in [&mut self.awake, &mut self.asleep] {
            keys.retain(|key| {
                let first = key.body as usize;
                let other = who.bodies[key.entity as usize].map(|other| other as usize);
                let stays = match (leaves(first), other.map(&leaves)) {
                    (false, None | Some(false)) => true,
                    (true, None | Some(true)) => {
                        taken.push(*key);
                        return false;
                    }
                    (true, Some(false)) => other.is_some_and(&is_awake),
                    (false, Some(true)) => is_awake(first),
                };
                if !stays {
                    unused.push(key.place);
                }
                stays
            });
        }
    }

    /// Ends one that was [taken out](Self::take_out).
    pub(crate) fn end(&mut self, key: &Key) {
        self.unused.push(key.place);
    }
}

/// Moves those keys out that go.
/// Longest way of a point of an entity in the last tick \[m\].
fn way_m(entity: &Entity) -> f64 {
    let (was, is) = (&entity.previous_X_WB, &entity.X_WB);
    let arm_m = bounding_ball(&entity.shape).map_or(0.0, |(middle, radius_m)| middle.norm() + radius_m);
    (is.translation.vector - was.translation.vector).norm() + arm_m * is.rotation.angle_to(&was.rotation)
}

fn move_out(keys: &mut Vec<Key>, to: &mut Vec<Key>, goes: impl Fn(&Key) -> bool) {
    keys.retain(|key| {
        let goes = goes(key);
        if goes {
            to.push(*key);
        }
        !goes
    });
}

/// Puts keys into others that are in order; none is in both.
fn merge(keys: &mut Vec<Key>, fresh: &mut Vec<Key>) {
    fresh.sort_unstable();
    let mut at = keys.len() + fresh.len();
    let mut old = keys.len();
    keys.extend_from_slice(fresh);
    // From behind, so that each has its place.
    while let Some(&new) = fresh.last() {
        at -= 1;
        if old > 0 && keys[old - 1] > new {
            old -= 1;
            keys[at] = keys[old];
        } else {
            keys[at] = new;
            fresh.pop();
        }
    }
}
