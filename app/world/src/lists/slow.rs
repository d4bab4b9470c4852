//! The slow side of the two lists: steps what is in it, gives away what is claimed, says where it stands.

use haptics::Entity;
use physics::{Manipulation, Standing};

use super::link::{Came, Claim, Most, SlowEnd, Stand, send, take_in};

/// The slow list.
pub struct SlowList {
    manipulation: Manipulation,
    entities: Vec<Entity>,
    end: SlowEnd,
    /// Of each body, how often it came.
    stays: Box<[u32]>,
    /// Claimed, and not yet given away.
    claimed: Vec<Claim>,
    island: Vec<usize>,
    /// Bodies whose place has not been told since it changed, each once.
    untold: Vec<usize>,
    is_untold: Box<[bool]>,
    stepped: u64,
}

impl SlowList {
    pub(super) fn new(manipulation: Manipulation, entities: Vec<Entity>, end: SlowEnd) -> Self {
        let bodies = manipulation.bodies().len();
        let is_here = |body: usize| manipulation.standing(body) != Standing::Elsewhere;
        Self {
            stays: (0..bodies).map(|body| u32::from(is_here(body))).collect(),
            manipulation,
            entities,
            end,
            claimed: Vec::with_capacity(bodies),
            island: Vec::with_capacity(bodies),
            untold: Vec::with_capacity(bodies),
            is_untold: vec![false; bodies].into(),
            stepped: 0,
        }
    }

    /// A turn: takes in, gives away what is claimed, goes on by so many ticks of this length (s), and tells.
    pub fn turn(&mut self, ticks: u32, dt_s: f64) {
        self.take_in();
        self.give_away();
        for _ in 0..ticks {
            if self.manipulation.awake().is_empty() {
                break;
            }
            self.manipulation.step(&mut self.entities, &mut [], dt_s);
            self.stepped += 1;
            // A tick of many bodies takes long, and a finger waits.
            self.give_away();
        }
        self.tell();
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
            let is_here = matches!(self.manipulation.standing(body), Standing::Awake | Standing::Asleep);
            if is_here && claim.stay == self.stays[body] {
                // There is room for all bodies.
                self.manipulation.island(body, &mut self.island);
                self.manipulation.release(&self.island, &self.entities);
            }
        }
    }

    /// Whether a body that is claimed is still on its way to here. One that is not, and not here either, has gone with
    /// another's island; and who was parked here stays, but is what it seems to the other side: fixed.
    fn waits(&self, claim: &Claim) -> bool {
        let is_late = claim.stay > self.stays[claim.body as usize];
        is_late || self.manipulation.standing(claim.body as usize) == Standing::Coming
    }

    /// Says where everything stands that has moved.
    fn tell(&mut self) {
        for &body in self.manipulation.changed() {
            if !std::mem::replace(&mut self.is_untold[body as usize], true) {
                self.untold.push(body as usize);
            }
        }
        self.manipulation.forget_changes();
        let Self { untold, is_untold, manipulation, end, stays, .. } = self;
        untold.retain(|&body| {
            let stand = Stand { body: body as u32, stay: stays[body], state: manipulation.bodies()[body] };
            let is_here = manipulation.standing(body) != Standing::Elsewhere;
            let waits = is_here && end.stands.push(stand).is_err();
            is_untold[body] = waits;
            waits
        });
    }
}
