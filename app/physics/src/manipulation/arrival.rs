//! An island on its way from another thread, parcel by parcel.
//!
//! Model: what comes is put where it will be, but is [`Standing::Coming`]: nobody steps it, and whoever is awake leans on it
//! as if it were fixed. With the last parcel all of it is stepped at once. So no tick sees half an island, however many ticks
//! it takes to come.
//! Invariant: no allocation.

use haptics::Entity;

use super::parcel::{Content, Leaver, Parcel};
use super::{Manipulation, who};
use crate::pairs::Key;
use crate::roster::Standing;

/// What has come of an island that is not whole yet.
#[derive(Debug, Clone)]
pub(super) struct Arrival {
    /// Who has come, and what it will be.
    bodies: Vec<(u32, Standing)>,
    keys: Vec<Key>,
    /// The pair that came last, if there was room for it.
    pair: Option<u32>,
}

impl Arrival {
    pub(super) fn with_capacity(bodies: usize, pairs: usize) -> Self {
        Self { bodies: Vec::with_capacity(bodies), keys: Vec::with_capacity(pairs), pair: None }
    }

    /// Goes on with this room, which is larger; what it had is left there.
    pub(super) fn move_to(&mut self, keys: &mut Vec<Key>) {
        keys.extend_from_slice(&self.keys);
        std::mem::swap(&mut self.keys, keys);
    }
}

impl Manipulation {
    /// Takes a parcel in. With the last one of an island all of its bodies have `arrived`.
    pub fn accept(&mut self, parcel: &Parcel, entities: &mut [Entity], arrived: impl FnMut(usize)) {
        match &parcel.0 {
            Content::Body(leaver) => self.let_come(leaver, entities),
            Content::Pair { body, entity, is_near, head } => {
                self.arrival.pair = self.pairs.begin_as(head);
                if let Some(place) = self.arrival.pair {
                    self.arrival.keys.push(Key::new([*body, *entity], *is_near, place));
                }
            }
            Content::Anchors { first, anchors } => {
                if let Some(place) = self.arrival.pair {
                    self.pairs.at_place(place).put_anchors(*first as usize, anchors);
                }
            }
            Content::Place { number, place } => {
                if let Some(pair) = self.arrival.pair {
                    self.pairs.at_place(pair).put_place(*number as usize, place);
                }
            }
            Content::End => self.let_in(entities, arrived),
        }
    }

    fn let_come(&mut self, leaver: &Leaver, entities: &mut [Entity]) {
        let body = leaver.body as usize;
        self.stand(body, &leaver.state, entities, 0.0);
        // What moved in the last tick drags friction along in this one.
        entities[self.roster.entities[body]].previous_X_WB = leaver.previous_X_WB;
        self.roster.set(body, Standing::Coming);
        (self.roster.rests[body], self.roster.owed_j[body]) = (leaver.rest, leaver.owed_j);
        let will_be = if leaver.is_asleep { Standing::Asleep } else { Standing::Awake };
        self.arrival.bodies.push((leaver.body, will_be));
    }

    /// All of the island is here.
    fn let_in(&mut self, entities: &[Entity], mut arrived: impl FnMut(usize)) {
        let Self { arrival: Arrival { bodies, keys, .. }, roster, pairs, broad_phase, turns, .. } = self;
        let are_enough = turns.are_enough(roster.awake().len() + bodies.len().saturating_sub(1));
        for (body, standing) in bodies.iter_mut().filter(|(_, standing)| *standing == Standing::Awake) {
            if are_enough {
                *standing = Standing::Held;
                turns.hold(*body as usize);
                turns.change();
            }
        }
        roster.set_all(bodies.iter().map(|&(body, standing)| (body as usize, standing)));
        let mut sleeper = None;
        for &(body, _) in bodies.iter().filter(|(_, standing)| *standing == Standing::Asleep) {
            // A ring of all that sleep.
            match sleeper {
                Some(first) => roster.join(first, body as usize),
                None => sleeper = Some(body as usize),
            }
        }
        let who = who(roster, entities, self.contacts);
        pairs.let_in(keys, |body| roster.standing(body) == Standing::Awake, &who);
        for &(body, standing) in &*bodies {
            if standing == Standing::Awake {
                pairs.meet(body as usize, &who, broad_phase, true);
            }
            arrived(body as usize);
        }
        keys.clear();
        // Whoever waits for its turn from now on is in another list, too.
        while let Some((body, _)) = self.arrival.bodies.pop() {
            self.note_change(body as usize);
        }
    }
}
