//! The slow side of the two lists: steps what is in it, gives away what is claimed, says where it stands.

use haptics::Entity;
use physics::{Manipulation, Standing};

use super::link::{SlowEnd, Stand};

/// The slow list.
pub struct SlowList {
    manipulation: Manipulation,
    entities: Vec<Entity>,
    end: SlowEnd,
    /// Of each body, how often it came.
    stays: Box<[u32]>,
    /// Claimed, and not yet given away.
    claimed: Vec<usize>,
    island: Vec<usize>,
    /// Bodies whose place has not been told since it changed, each once.
    untold: Vec<usize>,
    is_untold: Box<[bool]>,
    /// Bodies that were claimed, and whose island no queue has room for.
    too_large: Vec<usize>,
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
            too_large: Vec::new(),
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
        while let Ok(parcel) = self.end.back.pop() {
            if let Some(body) = parcel.body() {
                self.stays[body] += 1;
            }
            self.manipulation.accept(&parcel, &mut self.entities);
        }
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

    /// How many bodies were claimed that are part of too large an island to be sent: fingers feel them fixed.
    pub fn too_large(&self) -> usize {
        self.too_large.len()
    }

    fn give_away(&mut self) {
        while let Ok(body) = self.end.claims.pop() {
            self.claimed.push(body as usize);
        }
        let Self { claimed, manipulation, entities, end, island, too_large, .. } = self;
        claimed.retain(|&body| {
            if manipulation.standing(body) == Standing::Elsewhere {
                return false;
            }
            // Who was parked here stays, but is what it seems to the other side: fixed.
            if manipulation.standing(body) == Standing::Parked {
                return false;
            }
            manipulation.island(body, island);
            let parcels = manipulation.parcels(island);
            let goes = parcels <= end.out.slots();
            if parcels > end.out.buffer().capacity() && !too_large.contains(&body) {
                too_large.push(body);
            }
            if goes {
                // There is room.
                manipulation.release(island, entities, |parcel| drop(end.out.push(parcel)));
            }
            !goes
        });
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
