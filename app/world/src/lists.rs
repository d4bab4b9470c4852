//! The fast and the slow list of what moves (Melder ch. 7.2.3): one thread steps what fingers touch or could touch soon,
//! another one all the rest.
//!
//! Problem: a tick has a millisecond, a world thousands of things that move. And nothing that a finger comes to may be
//! missing, late or in two places, whatever the slow thread is doing.
//!
//! Model: both threads know all entities; each steps those bodies that are in its list ([`physics::Manipulation`], the same
//! functions). Whole islands change lists, by value, through queues of fixed size, with all that their contact points
//! remember. The fast side decides: it claims an island before a finger can reach it, as the finger's speed has it, or
//! something that is awake in its list; and gives one away that nobody is near, when it has more than it is to have. What is
//! in the slow list stands for the fast side where that one said last: a finger that comes to it before it was handed over
//! feels it fixed there, never absent. For the slow side what is in the fast list is not there at all.
//!
//! Invariants: each body is in one list or on its way; the fast side allocates, frees and waits for nothing, and does a
//! bounded amount of this in a tick; without a finger's or another's claim, nothing of it happens where all fits into the
//! fast list.

#![allow(non_snake_case)] // Names carry their frame: hip_W is the HIP in W.

mod fast;
mod link;
mod order;
mod places;
mod slow;
mod waits;

pub use fast::{FastList, Handed, Reach};
pub use order::SlowOrder;
pub use slow::SlowList;
pub use waits::Waits;

use haptics::Entity;
use physics::{Begins, Body, BodyError, BroadPhase, Manipulation, Settings};

/// When islands change lists.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ListSettings {
    /// What is nearer than this to where a finger could be soon is claimed \[m\].
    pub near_m: f64,
    /// What is farther than this from all fingers may go \[m\].
    pub far_m: f64,
    /// Soon is within this time \[s\]: longer than the slow side takes for a turn, twice.
    pub ahead_s: f64,
    /// The fast list gives nothing away while it has no more bodies than this.
    pub fast_bodies: usize,
}

impl Default for ListSettings {
    fn default() -> Self {
        Self { near_m: 0.01, far_m: 0.05, ahead_s: 0.05, fast_bodies: 64 }
    }
}

/// Both sides of a world: what the fast thread steps, its end of the queues, and the slow side.
pub struct Lists {
    /// The fast list.
    pub fast: Manipulation,
    /// What changes lists, as the fast side sees it.
    pub hand_over: FastList,
    /// The slow list.
    pub slow: SlowList,
}

impl Lists {
    /// A world whose bodies are all in the fast list, if that may have so many; else all are in the slow one, and those
    /// that fingers are near are claimed in the first tick.
    ///
    /// # Errors
    /// As of [`Manipulation::new`].
    pub fn new(
        entities: &[Entity],
        bodies: &[(usize, Body)],
        settings: Settings,
        lists: ListSettings,
    ) -> Result<Self, BodyError> {
        Self::among(entities, bodies, settings, lists, &BroadPhase::new(entities))
    }

    /// The same, of entities of which it is known where they are.
    ///
    /// # Errors
    /// As of [`Manipulation::new`].
    pub fn among(
        entities: &[Entity],
        bodies: &[(usize, Body)],
        settings: Settings,
        lists: ListSettings,
        broad_phase: &BroadPhase,
    ) -> Result<Self, BodyError> {
        let all_slow = bodies.len() > lists.fast_bodies;
        let begins = |are_here: bool, has_deadlines: bool| {
            let begins = Begins { are_here, has_deadlines, broad_phase: Some(broad_phase) };
            Manipulation::begin(entities, bodies, settings, begins)
        };
        let fast = begins(!all_slow, true)?;
        let slow = begins(all_slow, false)?.without_those_elsewhere();
        let (fast_end, slow_end) = link::link(bodies.len());
        Ok(Self {
            fast,
            hand_over: FastList::new(fast_end, bodies.len(), all_slow, lists),
            slow: SlowList::new(slow, entities.to_vec(), slow_end),
        })
    }
}
