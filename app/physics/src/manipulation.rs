//! One tick of all bodies: contact points, forces, residual force and torque, motion.

mod advance;
mod arrival;
mod departure;
mod driven;
mod elsewhere;
mod forces;
mod gather;
mod island;
mod look;
mod made;
mod ordered;
mod parcel;
mod pressing;
mod rest;
mod room;
mod struck;
mod turns;

pub use driven::MAX_DRIVEN;
pub use made::{Made, Parked, Reason};
pub use parcel::Parcel;
pub use pressing::PairStanding;
pub use room::{Room, Wanted};

use arrival::Arrival;
use departure::Departure;
use driven::Driven;
use haptics::{Entity, Form, Shape};
use nalgebra::Vector3;

use crate::anchor::Anchor;
use crate::body::Body;
use crate::broad_phase::{Aabb, BroadPhase};
use crate::collide::{self, MAX_POINTS, can_move};
use crate::contacts::Contacts;
use crate::error::BodyError;
use crate::hand::{FingerSettings, FingerTick, Hand};
use crate::integrator::Gets;
use crate::pair::REACH_M;
use crate::pairs::{self, Key, Pairs, Who};
use crate::pull::{MAX_PULLS, Pull};
use crate::roster::Roster;
use crate::settings::Settings;
use crate::sleep::Sets;
use crate::solver::{Motion, Solved};
use crate::touch::Touch;
use room::{RowCounts, RowRoom};
use struck::{IN_A_ROW, Struck};
use turns::Turns;

/// All bodies, and what they remember of where they touch. There is no copy of one: it would not have its room.
#[derive(Debug)]
pub struct Manipulation {
    settings: Settings,
    contacts: Contacts,
    roster: Roster,
    broad_phase: BroadPhase,
    pairs: Pairs,
    /// Those that are awake, by their places: what a tick works on.
    bodies: Vec<Body>,
    /// Of each of them, which entity it is.
    entities: Vec<usize>,
    /// Contact points, and all that has a place for each of them.
    room: Box<RowRoom>,
    /// Those that become [`Self::room`] in the next tick, and those that were.
    next_room: Option<Box<RowRoom>>,
    used_room: Option<Box<RowRoom>>,
    motions: Vec<Motion>,
    /// By how much each of them changes its motion in the tick without contacts.
    changes: Vec<Motion>,
    speeds_m_s: Vec<f64>,
    struck: Struck,
    /// Of each body, what a tick took from it \[J\].
    spare_j: Vec<f64>,
    /// Of each island, what impulses put into it in a tick \[J\].
    impulses_j: Vec<f64>,
    /// Of each island, the force of bodies that wait on it \[N\].
    held_W: Vec<Vector3<f64>>,
    hand: Hand,
    sets: Sets,
    /// The first so many rows are fingers', and the first so many of these press or hold.
    touching: usize,
    pressing: usize,
    gets: Vec<Gets>,
    parked: Vec<Parked>,
    ticks: u64,
    /// What is on its way to here.
    arrival: Arrival,
    /// What is on its way from here.
    departure: Departure,
    /// Of each body, whether it is in the island that is looked at.
    is_marked: Box<[bool]>,
    /// Room for the anchors of a pair.
    last_anchors: [Anchor; MAX_POINTS],
    /// Room to list bodies that are near something.
    neighbours: Vec<u32>,
    /// Entities that somebody moves.
    driven: Vec<Driven>,
    /// Turns of those that are stepped, where not all can be.
    turns: Turns,
    /// Whether bodies that somebody else steps are not there.
    ignores_elsewhere: bool,
    /// Bodies that are not as they were, each once.
    changed: Vec<u32>,
    has_changed: Box<[bool]>,
}

/// Beginning of a manipulation.
#[derive(Debug, Clone, Copy)]
pub struct Begins<'b> {
    /// It steps the bodies; else somebody else does, all of them.
    pub are_here: bool,
    /// Its ticks allocate nothing. Where they may, room for pairs is made when it is needed: none is left out, and there is
    /// little more than is used.
    pub has_deadlines: bool,
    /// Boxes of the entities, where they are known already.
    pub broad_phase: Option<&'b BroadPhase>,
}

impl Default for Begins<'_> {
    fn default() -> Self {
        Self { are_here: true, has_deadlines: true, broad_phase: None }
    }
}

/// Pairs that have room at first even where more is made when it is needed: of a small world all.
const FEW_PAIRS: usize = 512;
/// The most touches of fingers in a tick.
const MAX_TOUCHES: usize = 64;
/// Contact points between entities that have room at first, or so many of each body if that is more; until there is
/// [more](room) others are left out, and counted; who has no deadlines makes room as they come. A quarter is for those with what does not move: nothing falls through a floor
/// for want of room.
const ROWS: usize = 8192;
const ROWS_OF_BODY: usize = 8;
/// Pairs of entities near each other that have room at first, or so many of each body if that is more, likewise.
const PAIRS: usize = 4096;
const PAIRS_OF_BODY: usize = 3;

impl Manipulation {
    /// The entities of these numbers are bodies; all others are fixed.
    ///
    /// # Errors
    /// A body whose contact points nobody can find.
    pub fn new(entities: &[Entity], bodies: &[(usize, Body)], settings: Settings) -> Result<Self, BodyError> {
        check(entities, bodies)?;
        Self::begin(entities, bodies, settings, Begins::default())
    }

    /// The same, as it is said how it begins.
    ///
    /// # Errors
    /// As of [`Self::new`].
    pub fn begin(
        entities: &[Entity],
        bodies: &[(usize, Body)],
        settings: Settings,
        begins: Begins<'_>,
    ) -> Result<Self, BodyError> {
        check(entities, bodies)?;
        Ok(Self::of(entities, bodies, settings, begins))
    }

    /// The same of bodies that somebody else steps, all of them.
    ///
    /// # Errors
    /// As of [`Self::new`].
    pub fn of_those_elsewhere(
        entities: &[Entity],
        bodies: &[(usize, Body)],
        settings: Settings,
    ) -> Result<Self, BodyError> {
        Self::begin(entities, bodies, settings, Begins { are_here: false, ..Begins::default() })
    }

    /// Nothing moves; where the entities are is known all the same.
    pub fn of_none(entities: &[Entity]) -> Self {
        Self::of(entities, &[], Settings::default(), Begins::default())
    }

    fn of(entities: &[Entity], bodies: &[(usize, Body)], settings: Settings, begins: Begins<'_>) -> Self {
        // Contacts ask for them of each body, and of what is convex.
        let movable = bodies.iter().map(|(entity, _)| (&entities[*entity], true));
        let touched = entities.iter().filter(|_| !bodies.is_empty()).map(|entity| (entity, false));
        for (entity, is_body) in movable.chain(touched) {
            if let Shape::Mesh(mesh) = &entity.shape
                && (is_body || mesh.convex_inner_m().is_some())
            {
                mesh.find_extremes();
            }
        }
        let count = bodies.len();
        let places = count + MAX_DRIVEN;
        let most_pairs = count.saturating_mul(entities.len());
        // Of those elsewhere few come here at once; more room is made when they do.
        let Begins { are_here, has_deadlines, broad_phase } = begins;
        let here = if are_here { count } else { 0 };
        let at_first = most_pairs.min(PAIRS.max(PAIRS_OF_BODY * here));
        let pairs = if has_deadlines {
            Pairs::with_capacity(at_first, most_pairs)
        } else {
            Pairs::growing(at_first.min(FEW_PAIRS), most_pairs)
        };
        let rows_of_bodies = if has_deadlines { ROWS_OF_BODY * here } else { 0 };
        let rows = RowCounts {
            of_pairs: (at_first.next_multiple_of(pairs::CHUNK) * MAX_POINTS).min(ROWS.max(rows_of_bodies)),
            of_fingers: MAX_TOUCHES + MAX_PULLS,
            bodies: count,
            integrator: settings.integrator,
        };
        let heaviest_kg = bodies.iter().map(|(_, body)| body.mass.mass_kg).fold(0.0, f64::max);
        let mut made = Self {
            settings,
            contacts: settings.contacts(heaviest_kg),
            roster: Roster::new(entities.len(), bodies),
            broad_phase: broad_phase.cloned().unwrap_or_else(|| BroadPhase::new(entities)),
            bodies: Vec::with_capacity(places),
            entities: Vec::with_capacity(places),
            room: Box::new(RowRoom::new(rows)),
            next_room: None,
            used_room: None,
            motions: Vec::with_capacity(places),
            changes: Vec::with_capacity(places),
            speeds_m_s: Vec::with_capacity(places),
            struck: Struck::new(count, places),
            spare_j: Vec::with_capacity(places),
            impulses_j: Vec::with_capacity(places),
            held_W: Vec::with_capacity(places),
            hand: Hand::new(&[], count),
            sets: Sets::with_capacity(count),
            touching: 0,
            pressing: 0,
            gets: Vec::with_capacity(places),
            parked: Vec::with_capacity(count),
            ticks: 0,
            arrival: Arrival::with_capacity(count, pairs.room()),
            departure: Departure::with_capacity(count, pairs.room()),
            pairs,
            is_marked: vec![false; count].into(),
            last_anchors: Default::default(),
            neighbours: Vec::with_capacity(count),
            driven: Vec::with_capacity(MAX_DRIVEN),
            turns: Turns::new(count),
            ignores_elsewhere: false,
            changed: Vec::with_capacity(count),
            has_changed: vec![false; count].into(),
        };
        if are_here {
            for body in 0..count {
                let who = who(&made.roster, entities, made.contacts);
                made.pairs.meet(body, &who, &made.broad_phase, true);
            }
            made.make_room(entities);
            let of_pairs = made.pairs.keys().map(|key| likely_points(key, entities, &made.roster)).sum();
            if !has_deadlines {
                made.room.rows.reserve_exact(of_pairs);
            } else if of_pairs > made.room.counts.of_pairs {
                made.room = Box::new(RowRoom::new(RowCounts { of_pairs, ..made.room.counts }));
            }
        } else {
            made.give_all_away();
        }
        made
    }

    /// With fingers that are more than points: soft, or with a button. What they are must have been
    /// [checked](crate::SoftFinger::validated); a finger beyond them is a point.
    #[must_use]
    pub fn with_fingers(mut self, fingers: &[FingerSettings]) -> Self {
        let bodies = self.roster.bodies.len();
        self.hand = Hand::new(fingers, bodies);
        let of_fingers = self.room.counts.of_fingers + self.hand.most_rows();
        self.room = Box::new(RowRoom::new(RowCounts { of_fingers, ..self.room.counts }));
        self
    }

    /// Such that bodies which somebody else steps are not there at all, instead of fixed.
    #[must_use]
    pub fn without_those_elsewhere(mut self) -> Self {
        self.ignores_elsewhere = true;
        self
    }

    /// One tick: moves the bodies and their entities; of each touch, `force_on_user_W` becomes what the body got, times -1.
    pub fn step(&mut self, entities: &mut [Entity], touches: &mut [Touch], dt_s: f64) -> Made {
        self.step_with(entities, touches, &mut [], dt_s)
    }

    /// As [`Self::step`], with what the fingers do besides touching, by their numbers; their answers are filled in.
    pub fn step_with(
        &mut self,
        entities: &mut [Entity],
        touches: &mut [Touch],
        fingers: &mut [FingerTick],
        dt_s: f64,
    ) -> Made {
        self.step_pulled(entities, touches, &mut [], fingers, dt_s)
    }

    /// As [`Self::step_with`], with what acts between fingers and bodies without a touch; of each pull, `force_on_user_W`
    /// becomes what the body got, times -1.
    pub fn step_pulled(
        &mut self,
        entities: &mut [Entity],
        touches: &mut [Touch],
        pulls: &mut [Pull],
        fingers: &mut [FingerTick],
        dt_s: f64,
    ) -> Made {
        if !(dt_s > 0.0 && dt_s.is_finite()) {
            return Made::default();
        }
        if self.ticks == 0 {
            // How long a tick is nobody knew before.
            self.keep_up(entities, dt_s);
        }
        self.ticks += 1;
        for touch in touches.iter() {
            self.wake_entity(touch.entity, entities);
        }
        for pull in pulls.iter() {
            self.wake_entity(pull.entity, entities);
        }
        self.wake_near_driven(entities);
        self.take_turns(entities, touches);
        self.line_up(entities, dt_s);
        if self.wake_what_is_met(entities, dt_s) {
            self.line_up(entities, dt_s);
        }
        self.line_up_driven(entities, dt_s);
        for _ in 0..IN_A_ROW {
            if !self.look_behind_struck(entities, dt_s) {
                break;
            }
            if self.wake_what_is_met(entities, dt_s) {
                self.line_up(entities, dt_s);
                self.line_up_driven(entities, dt_s);
            }
        }
        let (touch_rows, pull_rows) = self.gather(entities, touches, pulls, fingers, dt_s);
        let Solved { sweeps, residual, unsolved } = self.find_forces(dt_s);
        for (touch, row) in touches.iter_mut().zip(touch_rows) {
            if let Some(row) = row {
                touch.force_on_user_W = -self.room.rows[row].force_W;
            }
        }
        self.find_what_waiting_holds(touches);
        for (at, pull) in pulls.iter_mut().enumerate() {
            // What somebody else steps is as good as fixed.
            let body = self.body_of(pull.entity);
            if body.is_none_or(|body| !self.roster.standing(body).is_away()) {
                let row = pull_rows.get(at).copied().flatten();
                pull.force_on_user_W = row.map_or(Vector3::zeros(), |row| -self.room.rows[row].force_W);
            }
        }
        self.hand.settle(&self.room.rows, &self.motions, &self.roster, fingers, dt_s);
        self.sum_up();
        self.settle_pairs(entities, dt_s);
        let (awake, parked) = (self.roster.awake().len(), self.advance(entities, dt_s));
        self.advance_driven(entities);
        self.keep_up(entities, dt_s);
        self.rest(entities, touches, dt_s);
        Made { rows: self.room.rows.len(), sweeps, residual, unsolved, parked, awake, held: self.held() }
    }
}

/// Contact points that two are likely to have when they touch.
fn likely_points(key: &Key, entities: &[Entity], roster: &Roster) -> usize {
    let both = [roster.entities[key.body as usize], key.entity as usize].map(|entity| &entities[entity]);
    let are_apart = match both.map(Aabb::of_entity) {
        [Some(one), Some(other)] => !one.grown(REACH_M).overlaps(&other),
        _ => false,
    };
    let is_round = |entity: &Entity| matches!(entity.shape, Shape::Form(Form::Sphere(_)));
    match both {
        _ if are_apart => 0,
        both if both.into_iter().any(is_round) => 1,
        _ => 4,
    }
}

fn check(entities: &[Entity], bodies: &[(usize, Body)]) -> Result<(), BodyError> {
    match bodies.iter().find(|(entity, _)| !can_move(&entities[*entity].shape)) {
        Some((entity, _)) => {
            Err(BodyError::NoContactPoints { shape: collide::name(&entities[*entity].shape) })
        }
        None => Ok(()),
    }
}

fn who<'w>(roster: &'w Roster, all: &'w [Entity], contacts: Contacts) -> Who<'w> {
    Who { all, entities: &roster.entities, bodies: &roster.numbers, contacts }
}

fn moving(body: &Body) -> Motion {
    let inverse_inertia_W = body.inverse_inertia_W();
    Motion {
        velocity_W: body.velocity_W,
        angular_velocity_W: inverse_inertia_W * body.angular_momentum_W,
        inverse_mass: body.mass.mass_kg.recip(),
        inverse_inertia_W,
    }
}
