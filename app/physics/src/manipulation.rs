//! One tick of all bodies: contact points, forces, residual force and torque, motion.

mod driven;
mod hand_over;
mod ordered;
mod pressing;
mod rest;

pub use driven::MAX_DRIVEN;
pub use hand_over::Parcel;

use driven::Driven;
use haptics::Entity;
use nalgebra::Vector3;

use crate::body::Body;
use crate::broad_phase::BroadPhase;
use crate::collide::{self, MAX_POINTS, can_move};
use crate::error::BodyError;
use crate::grasp::{self, GraspQuality};
use crate::grasp_axis::GraspAxis;
use crate::hand::{FingerSettings, FingerTick, Hand, HandStart};
use crate::integrator::explicit::{self, Kept};
use crate::integrator::rk4::Stages;
use crate::integrator::{Gets, Integrator, Limits, mean_angular_velocity_W};
use crate::pair::{End, Response, Start, fastest_point_m_s};
use crate::pairs::{Key, Pairs, Who};
use crate::pull::{MAX_PULLS, Pull};
use crate::restitution::Restitution;
use crate::roster::{Roster, Standing};
use crate::row::Row;
use crate::settings::Settings;
use crate::sleep::Sets;
use crate::solver::{Islands, Motion, Solved, Solver};
use crate::touch::Touch;

/// All bodies, and what they remember of where they touch.
#[derive(Debug, Clone)]
pub struct Manipulation {
    settings: Settings,
    roster: Roster,
    broad_phase: BroadPhase,
    pairs: Pairs,
    /// Those that are awake, by their places: what a tick works on.
    bodies: Vec<Body>,
    /// Of each of them, which entity it is.
    entities: Vec<usize>,
    rows: Vec<Row>,
    motions: Vec<Motion>,
    speeds_m_s: Vec<f64>,
    /// Of each body, what a tick took from it \[J\].
    spare_j: Vec<f64>,
    solver: Solver,
    hand: Hand,
    restitution: Restitution,
    sets: Sets,
    /// The first so many rows are fingers', and the first so many of these press or hold.
    touching: usize,
    pressing: usize,
    gets: Vec<Gets>,
    stages: Stages,
    fixed: Vec<Kept>,
    parked: Vec<Parked>,
    ticks: u64,
    /// The first of the sleeping bodies that are arriving from elsewhere.
    arriving: Option<usize>,
    /// Room to list bodies that are near something.
    neighbours: Vec<u32>,
    /// Entities that somebody moves.
    driven: Vec<Driven>,
    /// Whether bodies that somebody else steps are not there.
    ignores_elsewhere: bool,
    /// Bodies that are not as they were, each once.
    changed: Vec<u32>,
    has_changed: Box<[bool]>,
}

/// What a tick took and did.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Made {
    /// Contact points, those of fingers among them.
    pub rows: usize,
    /// Rounds of the solver: of the island that took most.
    pub sweeps: usize,
    /// What was left of its equations, as a share of all forces ([`Solved::residual`]).
    pub residual: f64,
    /// Islands for which it found no answer.
    pub unsolved: usize,
    /// Bodies that were parked in this tick: the last so many of [`Manipulation::parked`].
    pub parked: usize,
    /// Bodies that were stepped.
    pub awake: usize,
}

/// A body that does not move any more.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Parked {
    /// Index of the entity.
    pub entity: usize,
    /// What became of it.
    pub why: Reason,
}

/// Why a body was parked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reason {
    /// It was farther from the origin than [`Settings::world_radius_m`].
    LeftTheWorld,
    /// Where it was or how it moved was no number any more.
    NotANumber,
}

/// The most touches of fingers in a tick.
const MAX_TOUCHES: usize = 64;
/// The most contact points between entities in a tick, or so many of each body if that is more; others are left out.
const MAX_ROWS: usize = 2048;
const ROWS_OF_BODY: usize = 8;
/// The box of a body is longer by the way of so many ticks than it need be.
const TICKS_AHEAD: f64 = 16.0;
/// The most pairs of entities that are near each other, or so many of each body if that is more; others are left out, and
/// counted.
const MAX_PAIRS: usize = 4096;
const PAIRS_OF_BODY: usize = 3;

impl Manipulation {
    /// The entities of these numbers are bodies; all others are fixed.
    ///
    /// # Errors
    /// A body whose contact points nobody can find.
    pub fn new(entities: &[Entity], bodies: &[(usize, Body)], settings: Settings) -> Result<Self, BodyError> {
        if let Some((entity, _)) = bodies.iter().find(|(entity, _)| !can_move(&entities[*entity].shape)) {
            return Err(BodyError::NoContactPoints { shape: collide::name(&entities[*entity].shape) });
        }
        Ok(Self::of(entities, bodies, settings))
    }

    /// Nothing moves; where the entities are is known all the same.
    pub fn of_none(entities: &[Entity]) -> Self {
        Self::of(entities, &[], Settings::default())
    }

    fn of(entities: &[Entity], bodies: &[(usize, Body)], settings: Settings) -> Self {
        let count = bodies.len();
        let places = count + MAX_DRIVEN;
        let pairs = count.saturating_mul(entities.len()).min(MAX_PAIRS.max(PAIRS_OF_BODY * count));
        let rows = MAX_ROWS.max(ROWS_OF_BODY * count);
        let room = (pairs * MAX_POINTS).min(rows) + MAX_TOUCHES + MAX_PULLS;
        let mut made = Self {
            settings,
            roster: Roster::new(entities.len(), bodies),
            broad_phase: BroadPhase::new(entities),
            pairs: Pairs::with_capacity(pairs),
            bodies: Vec::with_capacity(places),
            entities: Vec::with_capacity(places),
            rows: Vec::with_capacity(room),
            motions: Vec::with_capacity(places),
            speeds_m_s: Vec::with_capacity(places),
            spare_j: Vec::with_capacity(places),
            solver: Solver::with_capacity(room, places),
            hand: Hand::new(&[], count),
            restitution: Restitution::with_capacity(room, places),
            sets: Sets::with_capacity(count),
            touching: 0,
            pressing: 0,
            gets: Vec::with_capacity(places),
            stages: Stages::with_capacity(room, places),
            fixed: Vec::with_capacity(room),
            parked: Vec::with_capacity(count),
            ticks: 0,
            arriving: None,
            neighbours: Vec::with_capacity(count),
            driven: Vec::with_capacity(MAX_DRIVEN),
            ignores_elsewhere: false,
            changed: Vec::with_capacity(count),
            has_changed: vec![false; count].into(),
        };
        for body in 0..count {
            let who = who(&made.roster, entities, settings.response);
            made.pairs.meet(body, &who, &made.broad_phase);
        }
        made
    }

    /// With fingers that are more than points: soft, or with a button. What they are must have been
    /// [checked](crate::SoftFinger::validated); a finger beyond them is a point.
    #[must_use]
    pub fn with_fingers(mut self, fingers: &[FingerSettings]) -> Self {
        let bodies = self.roster.bodies.len();
        self.hand = Hand::new(fingers, bodies);
        let room = self.rows.capacity() + self.hand.most_rows();
        let places = bodies + MAX_DRIVEN;
        self.rows = Vec::with_capacity(room);
        self.solver = Solver::with_capacity(room, places);
        self.stages = Stages::with_capacity(room, places);
        self.restitution = Restitution::with_capacity(room, places);
        self.fixed = Vec::with_capacity(room);
        self
    }

    /// Such that bodies which somebody else steps are not there at all, instead of fixed.
    #[must_use]
    pub fn without_those_elsewhere(mut self) -> Self {
        self.ignores_elsewhere = true;
        self
    }

    /// How well the fingers held a body in the last tick. Not part of a tick: it takes up to 20 microseconds.
    pub fn grasp_quality(&self, body: usize) -> Option<GraspQuality> {
        let state = self.roster.bodies.get(body)?;
        let Some(place) = self.roster.place(body) else { return Some(GraspQuality::default()) };
        let weight_W = self.settings.gravity_W * state.mass.mass_kg;
        // Arms are those of the tick's beginning: any centre will do.
        Some(grasp::quality(&self.rows, self.pressing, place, (&state.centre_W, &weight_W)))
    }

    /// The line between the two fingers that held a body in the last tick.
    pub fn grasp_axis(&self, body: usize) -> Option<GraspAxis> {
        self.roster.place(body).and_then(|_| self.hand.axis(body))
    }

    /// The bodies, in the order in which they were given.
    pub fn bodies(&self) -> &[Body] {
        &self.roster.bodies
    }

    /// The bodies that may not be as they were when [`Self::forget_changes`] was last called.
    pub fn changed(&self) -> &[u32] {
        &self.changed
    }

    /// How many pairs of entities that are near each other were left out for want of room, each time they came near.
    pub fn left_out(&self) -> u64 {
        self.pairs.left_out
    }

    /// Somebody has taken note of all changes.
    pub fn forget_changes(&mut self) {
        for body in self.changed.drain(..) {
            self.has_changed[body as usize] = false;
        }
    }

    fn note_change(&mut self, body: usize) {
        if !std::mem::replace(&mut self.has_changed[body], true) {
            self.changed.push(body as u32);
        }
    }

    /// Whether the entity of this number is a body.
    pub fn is_body(&self, entity: usize) -> bool {
        self.body_of(entity).is_some()
    }

    /// Which body the entity of this number is.
    pub fn body_of(&self, entity: usize) -> Option<usize> {
        self.roster.numbers.get(entity).copied().flatten().map(|body| body as usize)
    }

    /// Which entity a body is.
    pub fn entity_of(&self, body: usize) -> usize {
        self.roster.entities[body]
    }

    /// What becomes of a body in a tick.
    pub fn standing(&self, body: usize) -> Standing {
        self.roster.standing(body)
    }

    /// Where all entities are, roughly.
    pub fn broad_phase(&self) -> &BroadPhase {
        &self.broad_phase
    }

    /// The contact points of the last tick, with their forces. Their bodies are [places](Self::awake).
    pub fn rows(&self) -> &[Row] {
        &self.rows
    }

    /// Which bodies were in touch in the last tick, by their places among those that are awake.
    pub fn islands(&self) -> &Islands {
        self.solver.islands()
    }

    /// The numbers of the bodies that are stepped, in ascending order; their places here are what rows call bodies.
    pub fn awake(&self) -> &[usize] {
        self.roster.awake()
    }

    /// What the springs between entities hold after the last tick \[J\]; with the bodies' kinetic energy and gravity's it never
    /// grows while no finger presses.
    pub fn elastic_energy_j(&self) -> f64 {
        self.pairs.iter().map(|(_, pair)| pair.elastic_energy_j()).sum()
    }

    /// Bodies that do not move any more, in the order in which they were parked: the last [`Made::parked`] of them in the last
    /// tick.
    pub fn parked(&self) -> &[Parked] {
        &self.parked
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
        self.ticks += 1;
        for touch in touches.iter() {
            self.wake_entity(touch.entity, entities);
        }
        for pull in pulls.iter() {
            self.wake_entity(pull.entity, entities);
        }
        self.wake_near_driven(entities);
        self.line_up(entities, dt_s);
        if self.wake_what_is_met(entities, dt_s) {
            self.line_up(entities, dt_s);
        }
        self.line_up_driven(entities, dt_s);
        let (touch_rows, pull_rows) = self.gather(entities, touches, pulls, fingers, dt_s);
        let Solved { sweeps, residual, unsolved } = self.find_forces(dt_s);
        for (touch, row) in touches.iter_mut().zip(touch_rows) {
            if let Some(row) = row {
                touch.force_on_user_W = -self.rows[row].force_W;
            }
        }
        for (at, pull) in pulls.iter_mut().enumerate() {
            // What somebody else steps is as good as fixed.
            let body = self.body_of(pull.entity);
            if body.is_none_or(|body| self.roster.standing(body) != Standing::Elsewhere) {
                let row = pull_rows.get(at).copied().flatten();
                pull.force_on_user_W = row.map_or(Vector3::zeros(), |row| -self.rows[row].force_W);
            }
        }
        self.hand.settle(&self.rows, &self.motions, &self.roster, fingers, dt_s);
        self.settle_pairs(entities, dt_s);
        self.sum_up();
        let (awake, parked) = (self.roster.awake().len(), self.advance(entities, dt_s));
        self.advance_driven(entities);
        self.keep_up(entities, dt_s);
        self.rest(entities, touches, dt_s);
        Made { rows: self.rows.len(), sweeps, residual, unsolved, parked, awake }
    }

    /// How the bodies that are awake would move without anything that touches them; behind them those that others
    /// may lean on.
    fn line_up(&mut self, entities: &[Entity], dt_s: f64) {
        self.bodies.clear();
        self.entities.clear();
        self.motions.clear();
        self.speeds_m_s.clear();
        let fall_W = self.settings.gravity_W * dt_s;
        for &number in self.roster.awake() {
            let (body, entity) = (self.roster.bodies[number], self.roster.entities[number]);
            let mut motion = moving(&body);
            motion.velocity_W += fall_W;
            if self.settings.integrator.is_implicit() {
                motion.angular_velocity_W = mean_angular_velocity_W(&body, dt_s);
            }
            self.speeds_m_s.push(fastest_point_m_s(&entities[entity], &body, &motion));
            self.bodies.push(body);
            self.entities.push(entity);
            self.motions.push(motion);
        }
    }

    /// All contact points of the tick; says which rows are whose touch and pull.
    fn gather(
        &mut self,
        entities: &[Entity],
        touches: &[Touch],
        pulls: &[Pull],
        fingers: &[FingerTick],
        dt_s: f64,
    ) -> ([Option<usize>; MAX_TOUCHES], [Option<usize>; MAX_PULLS]) {
        self.rows.clear();
        let mut touch_rows = [None; MAX_TOUCHES];
        // Fingers first: they are never left out.
        for (touch, row) in touches.iter().zip(&mut touch_rows) {
            let Some(place) = self.roster.place_of_entity(touch.entity) else { continue };
            let (state, motion) = (&self.bodies[place], moving(&self.bodies[place]));
            *row = Some(self.rows.len());
            self.rows.push(touch.row(place, &state.centre_W, &motion, &entities[touch.entity], dt_s));
        }
        self.hand.gather(
            &HandStart {
                touches,
                touch_rows: &touch_rows,
                entities,
                roster: &self.roster,
                bodies: &self.bodies,
                gravity_W: self.settings.gravity_W,
                dt_s,
            },
            fingers,
            &mut self.rows,
        );
        self.pressing = self.rows.len();
        let pull_rows = self.gather_pulls(pulls, dt_s);
        self.touching = self.rows.len();
        self.restitution.meetings.clear();
        for at in 0..self.pairs.awake_count() {
            let (key, _) = self.pairs.awake_at(at);
            let other = self.roster.place_of_entity(key.entity as usize);
            let other = other.or_else(|| self.place_of_driven(key.entity as usize));
            if self.ignores_elsewhere && self.is_elsewhere(&key) {
                self.pairs.awake_at(at).1.pass_by();
                continue;
            }
            // Of two of which only the second is awake the first is what it leans on.
            let first = match self.roster.place(key.body as usize) {
                Some(place) => place,
                None => self.lean_on(key.body as usize),
            };
            let (_, pair) = self.pairs.awake_at(at);
            let start = Start {
                entities,
                bodies: &self.bodies,
                motions: &self.motions,
                speeds_m_s: &self.speeds_m_s,
                dt_s,
                is_implicit: self.settings.integrator.is_implicit(),
            };
            pair.bodies = (first, other);
            pair.gather(&start, &mut self.rows, &mut self.restitution.meetings);
        }
        (touch_rows, pull_rows)
    }

    /// The rows of pulls; says which are whose.
    fn gather_pulls(&mut self, pulls: &[Pull], dt_s: f64) -> [Option<usize>; MAX_PULLS] {
        let mut pull_rows = [None; MAX_PULLS];
        for (pull, place) in pulls.iter().zip(&mut pull_rows) {
            let Some(body) = self.roster.place_of_entity(pull.entity) else { continue };
            let (state, motion) = (&self.bodies[body], moving(&self.bodies[body]));
            if let Some(row) = pull.row(body, &state.centre_W, &motion, dt_s) {
                *place = Some(self.rows.len());
                self.rows.push(row);
            }
        }
        pull_rows
    }

    /// Whether one of a pair is stepped by somebody else.
    fn is_elsewhere(&self, key: &Key) -> bool {
        let other = self.roster.numbers[key.entity as usize].map(|other| other as usize);
        [Some(key.body as usize), other]
            .into_iter()
            .flatten()
            .any(|body| self.roster.standing(body) == Standing::Elsewhere)
    }

    /// The place of a body that others may lean on: as if it were fixed.
    fn lean_on(&mut self, number: usize) -> usize {
        let (awake, entity) = (self.roster.awake().len(), self.roster.entities[number]);
        if let Some(known) = self.entities[awake..].iter().position(|known| *known == entity) {
            return awake + known;
        }
        let zero = Vector3::zeros();
        let still = Body { velocity_W: zero, angular_momentum_W: zero, ..self.roster.bodies[number] };
        let inverse_inertia_W = nalgebra::Matrix3::zeros();
        self.motions.push(Motion { inverse_mass: 0.0, inverse_inertia_W, ..moving(&still) });
        self.bodies.push(still);
        self.entities.push(entity);
        self.speeds_m_s.push(0.0);
        self.entities.len() - 1
    }

    /// What all contact points do in the tick; says how well they were found.
    fn find_forces(&mut self, dt_s: f64) -> Solved {
        self.gets.clear();
        self.gets.resize(self.bodies.len(), Gets { gravity_W: self.settings.gravity_W, ..Gets::default() });
        self.gets[self.roster.awake().len()..].iter_mut().for_each(|gets| gets.is_fixed = true);
        // Impulses are always solved for.
        let springs = match self.settings.response {
            Response::Force => self.rows.len(),
            Response::Impulse { .. } => self.touching,
        };
        match self.settings.integrator {
            Integrator::Implicit => {}
            Integrator::Rk4 => {
                self.stages.run(&self.bodies, &self.rows, self.touching, springs, &mut self.gets, dt_s);
                for at in 0..springs {
                    let (force_W, torque_nm) = self.stages.means(at);
                    explicit::fix(&mut self.rows, at, &force_W, torque_nm, &mut self.fixed);
                }
            }
            Integrator::ThesisEuler | Integrator::ThesisEulerGyroscopic => {
                for at in 0..springs {
                    let (force_W, torque_nm) =
                        explicit::at_start(&self.rows[at], &self.bodies, at < self.touching, dt_s);
                    explicit::fix(&mut self.rows, at, &force_W, torque_nm, &mut self.fixed);
                }
            }
        }
        let solved = self.restitution.solve(
            &mut self.solver,
            &mut self.rows,
            &mut self.motions,
            (&self.settings.gravity_W, dt_s),
        );
        explicit::release(&mut self.rows, &mut self.fixed);
        solved
    }

    /// Tells the pairs how the tick ended, and what its being finite took from the bodies: with the velocity of its end for all of
    /// it, half of the mass times the velocity's change squared.
    fn settle_pairs(&mut self, entities: &[Entity], dt_s: f64) {
        self.spare_j.clear();
        self.spare_j.extend(self.bodies.iter().zip(&self.motions).map(|(body, motion)| {
            0.5 * body.mass.mass_kg * (motion.velocity_W - body.velocity_W).norm_squared()
        }));
        let end = End { rows: &self.rows, motions: &self.motions, entities, dt_s };
        for at in 0..self.pairs.awake_count() {
            let has_met = |row| self.restitution.has_met(row);
            self.pairs.awake_at(at).1.settle(&end, has_met, &mut self.spare_j);
        }
    }

    /// What each body gets: the Residual Force and Torque Algorithms.
    fn sum_up(&mut self) {
        self.gets.iter_mut().for_each(|gets| gets.is_free = true);
        for row in &self.rows {
            let torque_W = row.normal_W * row.torsion.torque_nm;
            let sides = [(Some(row.body), 1.0), (row.other, -1.0)];
            for ((body, sign), arm_W) in sides.into_iter().zip(&row.arms_W) {
                let Some(body) = body else { continue };
                let gets = &mut self.gets[body];
                gets.wrench.add(&(row.force_W * sign), arm_W);
                gets.wrench.torque_W += torque_W * sign;
                gets.is_free &= row.force_W == Vector3::zeros() && torque_W == Vector3::zeros();
            }
        }
    }

    /// Takes the bodies to the end of the tick; says how many had to be parked.
    fn advance(&mut self, entities: &mut [Entity], dt_s: f64) -> usize {
        let settings = self.settings;
        let limits = Limits { speed_m_s: settings.most_speed_m_s, spin_rad_s: settings.most_spin_rad_s };
        let before_parked = self.parked.len();
        for place in 0..self.roster.awake().len() {
            let number = self.roster.awake()[place];
            let (before, mut body) = (self.bodies[place], self.bodies[place]);
            settings.integrator.advance(&mut body, &self.gets[place], &limits, dt_s);
            let why = if !body.is_finite() {
                Some(Reason::NotANumber)
            } else {
                (body.centre_W.norm() > settings.world_radius_m).then_some(Reason::LeftTheWorld)
            };
            if let Some(why) = why {
                body = Body { velocity_W: Vector3::zeros(), angular_momentum_W: Vector3::zeros(), ..before };
                self.parked.push(Parked { entity: self.entities[place], why });
            }
            entities[self.entities[place]].move_to(body.pose());
            self.roster.bodies[number] = body;
            self.note_change(number);
        }
        for at in before_parked..self.parked.len() {
            let Some(body) = self.body_of(self.parked[at].entity) else { continue };
            self.roster.set(body, Standing::Parked);
        }
        self.parked.len() - before_parked
    }

    /// Finds who is near whom now.
    fn keep_up(&mut self, entities: &[Entity], dt_s: f64) {
        for &body in self.roster.awake() {
            let entity = self.roster.entities[body];
            let ahead_W = self.roster.bodies[body].velocity_W * (dt_s * TICKS_AHEAD);
            if self.broad_phase.moved(entity, &entities[entity], &ahead_W) {
                let who = who(&self.roster, entities, self.settings.response);
                self.pairs.follow(body, &who, &self.broad_phase);
            }
        }
    }
}

fn who<'w>(roster: &'w Roster, all: &'w [Entity], response: Response) -> Who<'w> {
    Who { all, entities: &roster.entities, bodies: &roster.numbers, response }
}

fn moving(body: &Body) -> Motion {
    Motion {
        velocity_W: body.velocity_W,
        angular_velocity_W: body.angular_velocity_W(),
        inverse_mass: body.mass.mass_kg.recip(),
        inverse_inertia_W: body.inverse_inertia_W(),
    }
}
