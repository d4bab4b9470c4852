//! Which bodies there are, and which of them are stepped.
//!
//! Invariants: those that are awake are in ascending order and have consecutive places in a tick's arrays; whoever sleeps
//! does so in a ring of those that will wake together. No allocation after `new`.

use crate::body::Body;
use crate::sleep::Rest;

/// What a body does in a tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Standing {
    /// It is stepped.
    #[default]
    Awake,
    /// It rests, and is not stepped until something touches it.
    Asleep,
    /// It waits for its turn, since a tick has no time for all that moves: fixed until then, with the velocity that it had.
    Held,
    /// It has left the world, or was lost to a number that is none: it stays where it is for good.
    Parked,
    /// Somebody else steps it: it is as if it were fixed where that one said last.
    Elsewhere,
    /// On its way to here: fixed where it was when it left, until all of its island is here.
    Coming,
}

impl Standing {
    /// Whether it is not stepped here because it is elsewhere or on its way.
    pub fn is_away(self) -> bool {
        matches!(self, Self::Elsewhere | Self::Coming)
    }
}

/// All bodies, by their numbers.
#[derive(Debug, Clone)]
pub(crate) struct Roster {
    /// As they are at the end of a tick.
    pub(crate) bodies: Box<[Body]>,
    /// Of each body, which entity it is.
    pub(crate) entities: Box<[usize]>,
    /// Of each entity, which body it is.
    pub(crate) numbers: Box<[Option<u32>]>,
    standings: Box<[Standing]>,
    awake: Vec<usize>,
    /// Of each body that is awake, its place in the tick's arrays.
    places: Box<[usize]>,
    /// Of each body that sleeps, the next in its ring.
    next: Box<[usize]>,
    pub(crate) rests: Box<[Rest]>,
    /// What each has got that nobody has paid for (J).
    pub(crate) owed_j: Box<[f64]>,
}

impl Roster {
    /// The bodies of so many entities, all awake.
    pub(crate) fn new(entities: usize, bodies: &[(usize, Body)]) -> Self {
        let mut numbers = vec![None; entities];
        for (number, (entity, _)) in bodies.iter().enumerate() {
            numbers[*entity] = Some(number as u32);
        }
        let count = bodies.len();
        Self {
            bodies: bodies.iter().map(|(_, body)| *body).collect(),
            entities: bodies.iter().map(|(entity, _)| *entity).collect(),
            numbers: numbers.into(),
            standings: vec![Standing::Awake; count].into(),
            awake: (0..count).collect(),
            places: (0..count).collect(),
            next: (0..count).collect(),
            rests: vec![Rest::default(); count].into(),
            owed_j: vec![0.0; count].into(),
        }
    }

    pub(crate) fn standing(&self, body: usize) -> Standing {
        self.standings[body]
    }

    /// The numbers of those that are stepped.
    pub(crate) fn awake(&self) -> &[usize] {
        &self.awake
    }

    /// Where a body is in the tick's arrays, if it is stepped.
    pub(crate) fn place(&self, body: usize) -> Option<usize> {
        (*self.standings.get(body)? == Standing::Awake).then(|| self.places[body])
    }

    /// Where the body of an entity is in the tick's arrays, if there is one that is stepped.
    pub(crate) fn place_of_entity(&self, entity: usize) -> Option<usize> {
        self.place((*self.numbers.get(entity)?)? as usize)
    }

    /// Gives a body another standing; who begins to sleep does so alone.
    pub(crate) fn set(&mut self, body: usize, standing: Standing) {
        let was = std::mem::replace(&mut self.standings[body], standing);
        self.rests[body] = Rest::default();
        if standing == Standing::Asleep {
            self.next[body] = body;
        }
        if (was == Standing::Awake) == (standing == Standing::Awake) {
            return;
        }
        match self.awake.binary_search(&body) {
            Ok(at) => drop(self.awake.remove(at)),
            Err(at) => self.awake.insert(at, body),
        }
        for (place, &body) in self.awake.iter().enumerate() {
            self.places[body] = place;
        }
    }

    /// Gives many another standing at once; for how long each has rested stays what it is, and who begins to sleep does so alone.
    pub(crate) fn set_all(&mut self, bodies: impl Iterator<Item = (usize, Standing)>) {
        for (body, standing) in bodies {
            let was = std::mem::replace(&mut self.standings[body], standing);
            match standing {
                Standing::Asleep => self.next[body] = body,
                Standing::Awake if was != standing => self.awake.push(body),
                _ => {}
            }
        }
        let standings = &self.standings;
        self.awake.retain(|body| standings[*body] == Standing::Awake);
        self.awake.sort_unstable();
        for (place, &body) in self.awake.iter().enumerate() {
            self.places[body] = place;
        }
    }

    /// Somebody else steps all of them.
    pub(crate) fn set_all_elsewhere(&mut self) {
        self.standings.fill(Standing::Elsewhere);
        self.rests.fill(Rest::default());
        self.awake.clear();
    }

    /// Two that sleep will wake together.
    pub(crate) fn join(&mut self, one: usize, other: usize) {
        self.next.swap(one, other);
    }

    /// The next in the ring of a body that sleeps.
    pub(crate) fn next(&self, body: usize) -> usize {
        self.next[body]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mass::MassProperties;
    use haptics::{Shape, Sphere};
    use nalgebra::Isometry3;

    #[test]
    fn places_are_those_among_the_awake_whoever_comes_and_goes() {
        let ball = Shape::from(Sphere::new(0.1).unwrap());
        let body = Body::at_rest(MassProperties::of_shape(&ball, 1.0).unwrap(), &Isometry3::identity());
        let mut roster = Roster::new(6, &[(5, body), (2, body), (3, body), (0, body)]);
        roster.set(1, Standing::Asleep);
        roster.set(0, Standing::Elsewhere);
        assert_eq!(roster.awake(), [2, 3]);
        assert_eq!(
            [5, 2, 3, 0, 1].map(|entity| roster.place_of_entity(entity)),
            [None, None, Some(0), Some(1), None]
        );
        roster.set(2, Standing::Asleep);
        roster.join(1, 2);
        assert_eq!([roster.next(1), roster.next(2)], [2, 1]);
        roster.set(1, Standing::Awake);
        roster.set(0, Standing::Asleep);
        assert_eq!((roster.awake(), roster.place(3), roster.place(0)), (&[1, 3][..], Some(1), None));
    }
}
