//! Room for more pairs and contact points than a scene seemed to need when it was loaded.
//!
//! Model: while five eighths of its room are used, a manipulation [says](Manipulation::wanted_room) what it should have.
//! A thread without deadlines [makes](Wanted::make) it, and between two ticks it is [taken](Manipulation::take_room). Who has
//! no deadlines does all of it at once ([`Manipulation::make_room`]).
//! Invariants: taking room allocates nothing and frees nothing. Pairs that had no room begin when there is some.

use haptics::Entity;

use super::{MAX_DRIVEN, Manipulation, who};
use crate::collide::MAX_POINTS;
use crate::integrator::Integrator;
use crate::integrator::explicit::Kept;
use crate::integrator::rk4::Stages;
use crate::pairs::{Key, MorePairs};
use crate::restitution::Restitution;
use crate::row::Row;
use crate::solver::Solver;

/// Room that a manipulation should have.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Wanted {
    /// For so many pairs, instead of so many.
    pairs: Option<[usize; 2]>,
    rows: Option<RowCounts>,
}

/// Numbers of rows that there may be in a tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct RowCounts {
    pub(super) of_pairs: usize,
    pub(super) of_fingers: usize,
    pub(super) bodies: usize,
    /// Decides which lists a tick needs.
    pub(super) integrator: Integrator,
}

/// Room that was made, or that was replaced by what was made.
#[derive(Debug)]
pub struct Room {
    wanted: Wanted,
    pairs: Option<PairRoom>,
    rows: Option<Box<RowRoom>>,
}

#[derive(Debug)]
struct PairRoom {
    pairs: MorePairs,
    arrival: Vec<Key>,
    departure: Vec<Key>,
}

/// Lists with a place for each contact point of a tick.
#[derive(Debug)]
pub(super) struct RowRoom {
    pub(super) counts: RowCounts,
    pub(super) rows: Vec<Row>,
    pub(super) solver: Solver,
    pub(super) stages: Stages,
    pub(super) restitution: Restitution,
    pub(super) fixed: Vec<Kept>,
}

impl RowRoom {
    pub(super) fn new(counts: RowCounts) -> Self {
        let (rows, places) = (counts.of_pairs + counts.of_fingers, counts.bodies + MAX_DRIVEN);
        let is_explicit = counts.integrator != Integrator::Implicit;
        let has_stages = counts.integrator == Integrator::Rk4;
        Self {
            counts,
            rows: Vec::with_capacity(rows),
            solver: Solver::with_capacity(rows, places),
            stages: if has_stages { Stages::with_capacity(rows, places) } else { Stages::default() },
            restitution: Restitution::with_capacity(rows, places),
            fixed: Vec::with_capacity(if is_explicit { rows } else { 0 }),
        }
    }
}

impl Wanted {
    /// The room, made by whoever may allocate.
    pub fn make(self) -> Room {
        let pairs = self.pairs.map(|[pairs, before]| PairRoom {
            pairs: MorePairs::new(pairs - before, pairs),
            arrival: Vec::with_capacity(pairs),
            departure: Vec::with_capacity(pairs),
        });
        Room { wanted: self, pairs, rows: self.rows.map(|counts| Box::new(RowRoom::new(counts))) }
    }
}

impl Manipulation {
    /// Room that it should get before long, if it should have more.
    pub fn wanted_room(&self) -> Option<Wanted> {
        let has = self.room.counts.of_pairs;
        let wants_rows = self.next_room.is_none()
            && !self.pairs.grow()
            && has < self.pairs.room() * MAX_POINTS
            && 8 * self.room.rows.len() > 5 * has;
        let wanted = Wanted {
            pairs: self.pairs.wanted().map(|pairs| [pairs, self.pairs.room()]),
            rows: wants_rows.then_some(self.more_rows()),
        };
        (wanted.pairs.is_some() || wanted.rows.is_some()).then_some(wanted)
    }

    fn more_rows(&self) -> RowCounts {
        RowCounts { of_pairs: 2 * self.room.counts.of_pairs, ..self.room.counts }
    }

    /// Takes the room that it [wanted](Self::wanted_room); what it replaces comes back, to be freed by whoever may. So does
    /// room that another one wanted.
    pub fn take_room(&mut self, mut room: Room, entities: &[Entity]) -> Room {
        let fits = room.wanted.pairs.is_none_or(|[_, before]| before == self.pairs.room())
            && room.wanted.rows.is_none_or(|rows| rows == self.more_rows());
        if !fits {
            return room;
        }
        if let Some(PairRoom { pairs, arrival, departure }) = &mut room.pairs {
            self.arrival.move_to(arrival);
            self.departure.move_to(departure);
            if self.pairs.take(pairs) {
                // Only what a scene begins with was put there; what was left out since has come by itself, however deep it is.
                let was_put = self.ticks == 0;
                for at in 0..self.roster.awake().len() {
                    let body = self.roster.awake()[at];
                    let who = who(&self.roster, entities, self.contacts);
                    self.pairs.meet(body, &who, &self.broad_phase, was_put);
                }
            }
        }
        // The rows of the last tick are asked for until the next one.
        if let Some(rows) = room.rows.take() {
            room.rows = self.next_room.replace(rows);
        }
        if room.rows.is_none() {
            room.rows = self.used_room.take();
        }
        room
    }

    /// Has the room that it should have; for who has no deadlines.
    pub fn make_room(&mut self, entities: &[Entity]) {
        while let Some(wanted) = self.wanted_room() {
            self.take_room(wanted.make(), entities);
        }
        self.used_room = None;
    }

    /// A tick begins: whatever has a place for each contact point is not asked for any more.
    pub(super) fn move_in(&mut self) {
        if let Some(mut next) = self.next_room.take() {
            std::mem::swap(&mut self.room, &mut next);
            self.used_room = Some(next);
        }
    }
}
