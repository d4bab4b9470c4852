//! The slow side of the two lists: steps what is in it, gives away what is claimed, says where it stands.

use haptics::Entity;
use physics::{Made, Manipulation, PairStanding, Standing};

use super::link::{Came, Claim, Most, SlowEnd, send, take_in};
use super::places::{Hips, Stand, Untold};
use crate::events::{Kind, PairForce, SlowPairs};

/// The slow list.
pub struct SlowList {
    pub(super) manipulation: Manipulation,
    pub(super) entities: Vec<Entity>,
    pub(super) end: SlowEnd,
    pub(super) has_begun: bool,
    pub(super) is_paused: bool,
    /// Of each body, how often it came.
    stays: Box<[u32]>,
    /// Claimed, and not yet given away.
    claimed: Vec<Claim>,
    /// Of them the bodies that an order waits for.
    fetched: Vec<usize>,
    island: Vec<usize>,
    untold: Untold,
    /// Places of the fingers when this turn began.
    hips: Hips,
    stepped: u64,
    /// Time that is left of this turn (s).
    left_s: f64,
    /// Who wants to know which entities press each other here.
    watch: Option<SlowPairs>,
}

impl SlowList {
    pub(super) fn new(manipulation: Manipulation, entities: Vec<Entity>, end: SlowEnd) -> Self {
        let bodies = manipulation.bodies().len();
        let is_here = |body: usize| manipulation.standing(body) != Standing::Elsewhere;
        Self {
            stays: (0..bodies).map(|body| u32::from(is_here(body))).collect(),
            untold: Untold::new(manipulation.bodies()),
            manipulation,
            entities,
            end,
            has_begun: true,
            is_paused: false,
            claimed: Vec::with_capacity(bodies),
            fetched: Vec::with_capacity(bodies),
            island: Vec::with_capacity(bodies),
            hips: Hips::none(),
            stepped: 0,
            left_s: 0.0,
            watch: None,
        }
    }

    /// From now on somebody watches which entities press each other here.
    pub fn watch(&mut self, pairs: SlowPairs) {
        self.watch = Some(pairs);
    }

    /// A turn: takes in, gives away what is claimed, goes on by so many ticks of this length (s), and tells.
    pub fn turn(&mut self, ticks: u32, dt_s: f64) {
        self.turn_while(ticks, dt_s, |_| Some(usize::MAX));
    }

    /// The same, as long as whoever is asked before each tick, with what the last one took, says how many bodies it may step:
    /// of more those that are nearest to fingers, and all others in turns. Says how many ticks were made of which nothing was left
    /// undone.
    pub fn turn_while(
        &mut self,
        ticks: u32,
        dt_s: f64,
        mut most_bodies: impl FnMut(Option<&Made>) -> Option<usize>,
    ) -> u32 {
        self.take_orders();
        if !self.has_begun {
            return ticks;
        }
        self.take_in();
        while let Ok(hips) = self.end.hips.pop() {
            self.hips = hips;
        }
        if let Some(watch) = &self.watch {
            watch.begin_turn();
        }
        self.left_s = if self.is_paused { 0.0 } else { f64::from(ticks) * dt_s };
        self.give_away();
        let (mut whole, mut made) = (0, None);
        for tick in 0..ticks {
            if self.is_paused || (self.manipulation.awake().is_empty() && self.manipulation.held() == 0) {
                whole += ticks - tick;
                self.rest(ticks - tick, dt_s);
                break;
            }
            let Some(most) = most_bodies(made.as_ref()) else { break };
            self.manipulation.step_at_most(most, self.hips.places_W());
            self.manipulation.make_room(&self.entities);
            let step = self.manipulation.step(&mut self.entities, &mut [], dt_s);
            self.stepped += 1;
            self.look(step.parked, dt_s);
            self.left_s -= dt_s;
            // A tick of many bodies takes long, and a finger waits.
            self.give_away();
            whole += u32::from(step.held == 0);
            made = Some(step);
        }
        self.left_s = 0.0;
        self.tell();
        whole
    }

    /// Takes in everything that is on its way.
    pub fn take_in(&mut self) {
        let Self { end, manipulation, entities, stays, .. } = self;
        take_in(&mut end.back, manipulation, entities, Most::ALL, |came| {
            if let Came::Part(body) = came {
                stays[body] += 1;
            }
        });
    }

    /// Sends on what is leaving, as far as there is room; says whether nothing is left.
    pub(super) fn send(&mut self) -> bool {
        let Self { end, manipulation, entities, .. } = self;
        if manipulation.is_releasing() {
            send(&mut end.out, manipulation, entities, usize::MAX);
        }
        !manipulation.is_releasing()
    }

    /// All bodies; those that are not in this list as they were when they left it.
    pub fn manipulation(&self) -> &Manipulation {
        &self.manipulation
    }

    /// How many ticks it has stepped in which anything was awake.
    pub fn stepped(&self) -> u64 {
        self.stepped
    }

    /// How many bodies are in this list.
    pub fn here(&self) -> usize {
        let is_here = |body: &usize| self.manipulation.standing(*body) != Standing::Elsewhere;
        (0..self.manipulation.bodies().len()).filter(is_here).count()
    }

    /// After a tick of this length (s), in which so many bodies were parked.
    fn look(&mut self, parked: usize, dt_s: f64) {
        let (Some(watch), manipulation) = (&self.watch, &self.manipulation) else { return };
        let pairs = manipulation
            .pair_forces()
            .map(|(entities, force_W)| PairForce { entities: entities.map(|entity| entity as u32), force_W });
        watch.look(pairs, (1, dt_s), |entities| pair_standing(manipulation, entities));
        let all = manipulation.parked();
        for parked in &all[all.len().saturating_sub(parked)..] {
            watch.tell(Kind::Parked { entity: parked.entity as u32, why: parked.why.into() });
        }
    }

    /// After so many ticks of this length (s) in which nobody was awake. In a pause none passes.
    fn rest(&self, ticks: u32, dt_s: f64) {
        if let (Some(watch), manipulation, false) = (&self.watch, &self.manipulation, self.is_paused) {
            watch.look(std::iter::empty(), (ticks, dt_s), |entities| pair_standing(manipulation, entities));
        }
    }

    /// A body for which an order waits, be it parked.
    pub(super) fn fetch(&mut self, claim: Claim) {
        if !self.claimed.contains(&claim) {
            self.claimed.push(claim);
        }
        let body = claim.body as usize;
        if !self.fetched.contains(&body) {
            self.fetched.push(body);
        }
    }

    /// Answers what is claimed: the islands of these bodies go, one after the other.
    pub fn give_away(&mut self) {
        while let Ok(claim) = self.end.claims.pop() {
            self.claimed.push(claim);
        }
        let mut at = 0;
        while self.send()
            && let Some(claim) = self.claimed.get(at).copied()
        {
            if self.waits(&claim) {
                at += 1;
                continue;
            }
            self.claimed.swap_remove(at);
            let body = claim.body as usize;
            if self.has(body) && claim.stay == self.stays[body] {
                // There is room for all bodies.
                self.manipulation.island(body, &mut self.island);
                if self.manipulation.standing(body) == Standing::Parked {
                    self.island.push(body);
                }
                self.tell_who_goes();
                self.manipulation.release(&self.island, &self.entities);
                let Self { fetched, island, .. } = self;
                fetched.retain(|body| !island.contains(body));
            }
        }
    }

    /// Whether a body is here to be given away. Who was parked here stays, but is what it seems to the other side: fixed; unless
    /// an order waits for it.
    fn has(&self, body: usize) -> bool {
        match self.manipulation.standing(body) {
            Standing::Awake | Standing::Asleep | Standing::Held => true,
            Standing::Parked => self.fetched.contains(&body),
            Standing::Elsewhere | Standing::Coming => false,
        }
    }

    fn tell_who_goes(&mut self) {
        let Self { watch: Some(watch), manipulation, island, .. } = self else { return };
        let is_in = |entity: u32| manipulation.body_of(entity as usize).map(|body| island.contains(&body));
        // What is fixed goes along with everybody.
        let goes = |entities: [u32; 2]| entities.into_iter().filter_map(is_in).all(|is_in| is_in);
        let sleeps = |entities| pair_standing(manipulation, entities) == PairStanding::Asleep;
        watch.go(goes, sleeps, self.left_s);
    }

    /// Whether a body that is claimed is still on its way to here. One that is not, and not here either, has gone with
    /// another's island.
    fn waits(&self, claim: &Claim) -> bool {
        let is_late = claim.stay > self.stays[claim.body as usize];
        is_late || self.manipulation.standing(claim.body as usize) == Standing::Coming
    }

    /// Says where everything stands that has moved.
    fn tell(&mut self) {
        let Self { untold, manipulation, end, stays, hips, .. } = self;
        manipulation.changed().iter().for_each(|&body| untold.add(body as usize));
        manipulation.forget_changes();
        untold.tell(hips, &mut end.stands, |body| {
            let state = manipulation.bodies()[body];
            let standing = manipulation.standing(body);
            let rests = matches!(standing, Standing::Asleep | Standing::Parked);
            // It has made the tick that fingers were told in.
            let as_of = hips.run_tick + 1;
            let stand = Stand { body: body as u32, stay: stays[body], as_of, rests, state };
            (standing != Standing::Elsewhere).then_some(stand)
        });
    }
}

fn pair_standing(manipulation: &Manipulation, entities: [u32; 2]) -> PairStanding {
    manipulation.pair_standing(entities.map(|entity| entity as usize))
}
