//! An island on its way to another thread, parcel by parcel.
//!
//! Model: from [`Manipulation::release`] on nobody steps the island; where it stands it is as if it were fixed, for its time
//! stands still until it is whole on the other side. Its bodies and pairs stay here until they are asked for
//! ([`Manipulation::next_parcel`]), so that a queue of any size and a bounded number of parcels in a tick take islands of
//! any size. Only whole [islands](Manipulation::island) may go: whoever stays is not touched by them.
//! Invariants: no allocation; one island at a time; nothing is lost however long the other side does not look.

use haptics::Entity;

use super::Manipulation;
use super::parcel::{Content, Leaver, Parcel};
use super::who;
use crate::pair::ANCHORS_AT_ONCE;
use crate::pairs::Key;
use crate::roster::Standing;

/// What has still to go.
#[derive(Debug, Clone)]
pub(super) struct Departure {
    is_on: bool,
    /// Who goes, and whether it sleeps.
    bodies: Vec<(u32, bool)>,
    keys: Vec<Key>,
    /// How many of the bodies are gone, and of the pairs.
    gone: [usize; 2],
    next: Next,
}

/// What of a pair goes next.
#[derive(Debug, Clone, Copy)]
enum Next {
    Head,
    Anchors(usize),
    Places(usize),
}

impl Departure {
    pub(super) fn with_capacity(bodies: usize, pairs: usize) -> Self {
        Self {
            is_on: false,
            bodies: Vec::with_capacity(bodies),
            keys: Vec::with_capacity(pairs),
            gone: [0; 2],
            next: Next::Head,
        }
    }

    /// Goes on with this room, which is larger; what it had is left there.
    pub(super) fn move_to(&mut self, keys: &mut Vec<Key>) {
        keys.extend_from_slice(&self.keys);
        std::mem::swap(&mut self.keys, keys);
    }
}

impl Manipulation {
    /// Gives a whole [island](Self::island) away, in the parcels that come next. No other one may be [on its
    /// way](Self::is_releasing).
    pub fn release(&mut self, island: &[usize], entities: &[Entity]) {
        debug_assert!(!self.is_releasing(), "one at a time");
        let Departure { is_on, bodies, keys, gone, next } = &mut self.departure;
        (*is_on, *gone, *next) = (true, [0; 2], Next::Head);
        let roster = &self.roster;
        bodies.clear();
        bodies.extend(island.iter().map(|&body| (body as u32, roster.standing(body) == Standing::Asleep)));
        self.roster.set_all(island.iter().map(|&body| (body, Standing::Elsewhere)));
        for &body in island {
            self.is_marked[body] = true;
        }
        let (roster, is_marked) = (&self.roster, &self.is_marked);
        let is_awake = |body: usize| roster.standing(body) == Standing::Awake;
        keys.clear();
        let who = who(roster, entities, self.contacts);
        self.pairs.take_out(|body| is_marked[body], is_awake, &who, keys);
        self.unmark(island);
        for &body in island {
            self.note_change(body);
        }
    }

    /// Whether parts of an island have still to go.
    pub fn is_releasing(&self) -> bool {
        self.departure.is_on
    }

    /// The next part of the island that is on its way.
    pub fn next_parcel(&mut self, entities: &[Entity]) -> Option<Parcel> {
        if !self.departure.is_on {
            return None;
        }
        let content = self.next_body(entities).or_else(|| self.next_of_pairs());
        self.departure.is_on = content.is_some();
        Some(Parcel(content.unwrap_or(Content::End)))
    }

    fn next_body(&mut self, entities: &[Entity]) -> Option<Content> {
        let departure = &mut self.departure;
        let (body, is_asleep) = *departure.bodies.get(departure.gone[0])?;
        departure.gone[0] += 1;
        let at = body as usize;
        Some(Content::Body(Leaver {
            body,
            is_asleep,
            rest: self.roster.rests[at],
            owed_j: self.roster.owed_j[at],
            state: self.roster.bodies[at],
            previous_X_WB: entities[self.roster.entities[at]].previous_X_WB,
        }))
    }

    fn next_of_pairs(&mut self) -> Option<Content> {
        let Departure { keys, gone: [_, gone], next, .. } = &mut self.departure;
        while let Some(key) = keys.get(*gone) {
            let pair = self.pairs.of_key(key);
            match *next {
                Next::Head => {
                    *next = Next::Anchors(0);
                    let Key { body, entity, is_near, .. } = *key;
                    return Some(Content::Pair { body, entity, is_near, head: pair.head() });
                }
                Next::Anchors(first) => {
                    if let Some(anchors) = pair.anchors_from(first) {
                        *next = Next::Anchors(first + ANCHORS_AT_ONCE);
                        return Some(Content::Anchors { first: first as u32, anchors });
                    }
                    *next = Next::Places(0);
                }
                Next::Places(first) => {
                    if let Some((number, place)) = pair.place_from(first) {
                        *next = Next::Places(number + 1);
                        return Some(Content::Place { number: number as u32, place });
                    }
                    self.pairs.end(key);
                    (*next, *gone) = (Next::Head, *gone + 1);
                }
            }
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use haptics::{Entity, Sphere};
    use nalgebra::Isometry3;

    use super::Manipulation;
    use crate::body::Body;
    use crate::mass::MassProperties;
    use crate::settings::Settings;

    #[test]
    fn what_a_body_owes_goes_along() {
        let ball = Entity::new(Sphere::new(0.02).unwrap(), Isometry3::identity(), 1000.0).unwrap();
        let state = Body::at_rest(MassProperties::of_shape(&ball.shape, 0.1).unwrap(), &ball.X_WB);
        let mut entities = vec![ball];
        let new =
            |entities: &[Entity]| Manipulation::new(entities, &[(0, state)], Settings::default()).unwrap();
        let (mut here, mut there) = (new(&entities), new(&entities));
        there.give_away(0, &entities);
        here.roster.owed_j[0] = 0.5;
        here.release(&[0], &entities);
        while let Some(parcel) = here.next_parcel(&entities) {
            there.accept(&parcel, &mut entities, |_| ());
        }
        assert_eq!((here.owed_j(), there.owed_j()), (0.0, 0.5));
        assert_eq!(there.elastic_energy_j(), -0.5);
    }
}
