//! The fast side of the two lists: claims, takes in, gives away.

use haptics::Entity;
use nalgebra::Vector3;
use physics::{Aabb, MAX_DRIVEN, Manipulation, Standing};

use super::ListSettings;
use super::SlowList;
use super::link::{Came, Claim, FastEnd, Most, send, take_in};
use super::order::SlowOrder;
use super::places::{Glides, Hips, MOST_FINGERS, Stand, take};
use super::waits::Waits;

/// Where a finger is and could be soon.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reach {
    /// Its HIP \[m\].
    pub hip_W: Vector3<f64>,
    /// How fast that moves \[m/s\].
    pub velocity_W: Vector3<f64>,
    /// \[m\]
    pub radius_m: f64,
}

/// What has been handed over so far.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Handed {
    /// Bodies that came from the slow list.
    pub came: u64,
    /// Bodies that went there.
    pub went: u64,
    /// Parcels in which they came, and in which they went.
    pub parcels: [u64; 2],
    /// Ticks from a claim until the body was stepped here.
    pub waits: Waits,
    /// Claims for which there was no room.
    pub unclaimed: u64,
}

/// What the fast side knows of who is where.
pub struct FastList {
    end: FastEnd,
    settings: ListSettings,
    tick: u64,
    /// Of each body, in which tick it was claimed; 0: it was not.
    claimed: Box<[u64]>,
    /// Of each, how often it went to the slow list.
    stays: Box<[u32]>,
    /// The bodies that are in the fast list, in no order.
    here: Vec<u32>,
    /// Which of these is looked at next for being given away.
    next: usize,
    /// The tick from which on it is.
    look_at: u64,
    island: Vec<usize>,
    /// Boxes in which fingers could be soon, and in which they are.
    soon: Vec<Aabb>,
    around: Vec<Aabb>,
    /// Boxes of entities that are being moved: what is near them belongs here.
    moved: Vec<Aabb>,
    /// Bodies that an order holds: they are elsewhere, and not in the slow list.
    held: Vec<u32>,
    /// Bodies that an order waits for.
    fetched: Vec<u32>,
    /// Places of the fingers.
    hips: Hips,
    glides: Glides,
    /// Of each body, the run's tick as of which it stands where it is here, and whether it rests there.
    as_of: Box<[(u64, bool)]>,
    handed: Handed,
}

impl FastList {
    pub(super) fn new(end: FastEnd, bodies: usize, all_slow: bool, settings: ListSettings) -> Self {
        Self {
            end,
            settings,
            tick: 0,
            claimed: vec![0; bodies].into(),
            stays: vec![u32::from(all_slow); bodies].into(),
            here: all_here(bodies, all_slow),
            next: 0,
            look_at: 0,
            island: Vec::with_capacity(bodies),
            soon: Vec::with_capacity(MOST_FINGERS + MAX_DRIVEN),
            around: Vec::with_capacity(MOST_FINGERS + MAX_DRIVEN),
            moved: Vec::with_capacity(MAX_DRIVEN),
            held: Vec::with_capacity(MAX_DRIVEN),
            fetched: Vec::with_capacity(MAX_DRIVEN),
            hips: Hips::none(),
            glides: Glides::new(bodies),
            as_of: vec![(0, false); bodies].into(),
            handed: Handed::default(),
        }
    }

    /// How many bodies are in the fast list.
    pub fn here(&self) -> usize {
        self.here.len()
    }

    /// What has been handed over so far.
    pub fn handed(&self) -> Handed {
        self.handed
    }

    /// What overlaps this box is to come here in the next tick, as what a finger is near does: something is moved there.
    pub fn call_over(&mut self, around: Aabb) {
        if self.moved.len() < MAX_DRIVEN {
            self.moved.push(around);
        }
    }

    /// An order takes a body that is here; it is elsewhere from now on, and nobody else's.
    pub fn hold(&mut self, body: usize) {
        if self.held.len() < MAX_DRIVEN {
            self.held.push(body as u32);
        }
    }

    /// The order is done with it.
    pub fn let_go(&mut self, body: usize) {
        self.held.retain(|held| *held as usize != body);
    }

    /// Sends an order to the slow side; gives it back if there is no room.
    ///
    /// # Errors
    /// The order.
    pub fn order(&mut self, order: SlowOrder) -> Result<(), SlowOrder> {
        self.end.orders.push(order).map_err(|rtrb::PushError::Full(order)| order)
    }

    /// Whether the slow side can be sent an order.
    pub fn can_order(&self) -> bool {
        !self.end.orders.is_full()
    }

    /// Whether an order has a body.
    pub fn holds(&self, body: usize) -> bool {
        self.held.contains(&(body as u32))
    }

    /// Asks once for a body by itself, whatever it is doing there, asleep or parked for good.
    pub fn fetch(&mut self, body: usize) {
        let claim = Claim { body: body as u32, stay: self.stays[body] };
        let is_asked = self.fetched.contains(&claim.body) || self.fetched.len() == self.fetched.capacity();
        if !is_asked && self.order(SlowOrder::Fetch(claim)).is_ok() {
            self.fetched.push(claim.body);
            self.claimed[body] = self.tick.max(1);
        }
    }

    /// The world begins in this tick of the run, and was never before.
    pub fn begin_at(&mut self, run_tick: u64) {
        self.as_of.fill((run_tick, false));
    }

    /// The tick of the run as of which a body that is in the slow list stands where it is here, unless it rests.
    pub fn as_of(&self, body: usize) -> Option<u64> {
        let (tick, rests) = self.as_of[body];
        (!rests).then_some(tick)
    }

    /// Before a tick, the run's of this number and length (s): takes in what has come, and claims what the fingers, or what is
    /// awake here, could reach.
    pub fn begin_tick(
        &mut self,
        manipulation: &mut Manipulation,
        entities: &mut [Entity],
        fingers: impl Iterator<Item = Reach>,
        (run_tick, dt_s): (u64, f64),
    ) {
        self.tick += 1;
        self.soon.clear();
        self.around.clear();
        // A driver that was restarted counts from the beginning: no place is to be taken for an older one.
        self.hips.clear(run_tick.max(self.hips.run_tick));
        for finger in fingers.take(MOST_FINGERS).filter(is_finite) {
            self.hips.push(finger.hip_W);
            let now = Aabb::of_ball(&finger.hip_W, finger.radius_m);
            self.soon
                .push(now.swept(&(finger.velocity_W * self.settings.ahead_s)).grown(self.settings.near_m));
            self.around.push(now.grown(self.settings.far_m));
        }
        for moved in self.moved.drain(..) {
            self.soon.push(moved);
            self.around.push(moved);
        }
        // Where there is no room, the slow side knows where they were a few ticks ago.
        let _ = self.end.hips.push(self.hips);
        self.take_in(manipulation, entities, dt_s);
        if self.here.len() < self.claimed.len() {
            self.claim_what_is_near(manipulation, entities);
        }
    }

    /// After a tick: gives an island away that nobody is near, if there is more here than there should be.
    pub fn end_tick(&mut self, manipulation: &mut Manipulation, entities: &[Entity]) {
        let is_too_soon = self.tick < self.look_at;
        if !self.send(manipulation, entities) || self.here.len() <= self.settings.fast_bodies || is_too_soon {
            return;
        }
        for _ in 0..LOOKED_AT.min(self.here.len()) {
            self.next = (self.next + 1) % self.here.len();
            let body = self.here[self.next] as usize;
            if self.may_go(body, manipulation) {
                self.give_away(body, manipulation, entities);
                return;
            }
        }
    }

    /// When both threads have ended: everything that is on its way arrives, if the slow side is there.
    pub fn end(
        &mut self,
        manipulation: &mut Manipulation,
        entities: &mut [Entity],
        mut slow: Option<&mut SlowList>,
    ) {
        loop {
            let mut all_sent = self.send(manipulation, entities);
            if let Some(slow) = &mut slow {
                slow.take_in();
                all_sent &= slow.send();
            }
            while self.end.back.slots() > 0 {
                self.take_in_parcels(manipulation, entities);
            }
            if slow.is_none() || (all_sent && self.end.out.slots() == self.end.out.buffer().capacity()) {
                return;
            }
        }
    }

    fn take_in(&mut self, manipulation: &mut Manipulation, entities: &mut [Entity], dt_s: f64) {
        let Self { end, held, stays, hips, glides, as_of, settings, .. } = self;
        let is_there =
            |stand: &Stand| !held.contains(&stand.body) && stays[stand.body as usize] == stand.stay;
        for stand in take(&mut end.stands) {
            let body = stand.body as usize;
            let (was_told, _) = as_of[body];
            let is_newest = stand.as_of >= was_told;
            if is_newest && is_there(&stand) && manipulation.standing(body) == Standing::Elsewhere {
                let now = (&manipulation.bodies()[body], was_told);
                if let Some(stand) = glides.take(stand, now, hips) {
                    as_of[body] = (stand.as_of, stand.rests);
                    manipulation.stands_elsewhere(body, &stand.state, entities, settings.ahead_s);
                }
            }
        }
        let goes_on = |stand: &Stand, standing: Standing| is_there(stand) && standing == Standing::Elsewhere;
        let lengths_s = (dt_s, settings.ahead_s);
        glides.step((manipulation, entities), lengths_s, hips, goes_on, |stand, tick| {
            as_of[stand.body as usize] = (tick, stand.rests && tick == stand.as_of);
        });
        self.take_in_parcels(manipulation, entities);
    }

    fn take_in_parcels(&mut self, manipulation: &mut Manipulation, entities: &mut [Entity]) {
        let Self { end, here, handed, claimed, fetched, tick, .. } = self;
        let taken = take_in(&mut end.back, manipulation, entities, TAKEN_A_TICK, |came| {
            let Came::Whole(body) = came else { return };
            here.push(body as u32);
            handed.came += 1;
            fetched.retain(|fetched| *fetched as usize != body);
            let claimed = std::mem::take(&mut claimed[body]);
            if claimed > 0 {
                handed.waits.add(tick.saturating_sub(claimed));
            }
        });
        self.handed.parcels[0] += taken as u64;
    }

    fn claim_what_is_near(&mut self, manipulation: &Manipulation, entities: &[Entity]) {
        let Self { soon, claimed, stays, end, handed, tick, settings, held, .. } = self;
        let mut claim = |body: usize| {
            if claimed[body] == 0
                && !held.contains(&(body as u32))
                && manipulation.standing(body) == Standing::Elsewhere
            {
                match end.claims.push(Claim { body: body as u32, stay: stays[body] }) {
                    Ok(()) => claimed[body] = *tick,
                    Err(_) => handed.unclaimed += 1,
                }
            }
        };
        for around in soon.iter() {
            manipulation.broad_phase().near(around, |entity| {
                if let Some(body) = manipulation.body_of(entity) {
                    claim(body);
                }
            });
        }
        manipulation.for_each_met_elsewhere(entities, settings.ahead_s, &mut claim);
    }

    /// Whether a body is here, and nothing but its neighbours is against its going.
    fn may_go(&self, body: usize, manipulation: &Manipulation) -> bool {
        let standing = manipulation.standing(body);
        let is_here = matches!(standing, Standing::Awake | Standing::Asleep | Standing::Held);
        let around = manipulation.broad_phase().around(manipulation.entity_of(body));
        let is_near =
            |around: &Aabb| self.around.iter().chain(&self.soon).any(|finger| finger.overlaps(around));
        is_here && around.is_some_and(|around| !is_near(around)) && !manipulation.is_held(body)
    }

    fn give_away(&mut self, body: usize, manipulation: &mut Manipulation, entities: &[Entity]) {
        let mut island = std::mem::take(&mut self.island);
        let goes = manipulation.island_if(body, &mut island, |all, body| self.may_go(body, all))
            && !manipulation.is_met(&island, entities, self.settings.ahead_s);
        if goes {
            for &body in &island {
                self.stays[body] += 1;
                let rests = manipulation.standing(body) == Standing::Asleep;
                self.as_of[body] = (self.hips.run_tick + 1, rests);
            }
            self.here.retain(|body| island.binary_search(&(*body as usize)).is_err());
            self.handed.went += island.len() as u64;
            manipulation.release(&island, entities);
            self.send(manipulation, entities);
        } else {
            self.look_at = self.tick + (manipulation.pair_count() / KEYS_A_TICK) as u64;
        }
        self.island = island;
    }

    /// Sends on what is leaving, as much as a tick may; says whether nothing is left.
    fn send(&mut self, manipulation: &mut Manipulation, entities: &[Entity]) -> bool {
        if manipulation.is_releasing() {
            let sent = send(&mut self.end.out, manipulation, entities, PARCELS_A_TICK);
            self.handed.parcels[1] += sent as u64;
        }
        !manipulation.is_releasing()
    }
}

/// Room for all bodies, and all of them unless they are in the slow list.
fn all_here(bodies: usize, all_slow: bool) -> Vec<u32> {
    let mut here = Vec::with_capacity(bodies);
    if !all_slow {
        here.extend(0..bodies as u32);
    }
    here
}

fn is_finite(finger: &Reach) -> bool {
    finger.hip_W.iter().chain(finger.velocity_W.iter()).all(|x| x.is_finite())
}

/// An island is looked for among all pairs: where one may not go the next one waits, so that a tick pays for so many.
const KEYS_A_TICK: usize = 128;
/// So many bodies are looked at in a tick for being given away.
const LOOKED_AT: usize = 4;
/// So many parcels are sent in a tick.
const PARCELS_A_TICK: usize = 64;
/// So many are taken in: two cubes on a floor, or as much of a large island as is sent.
const TAKEN_A_TICK: Most = Most { parcels: PARCELS_A_TICK, with_an_end: 6 };
