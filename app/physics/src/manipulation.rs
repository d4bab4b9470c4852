//! One tick of all bodies: contact points, forces, residual force and torque, motion.

use haptics::Entity;
use nalgebra::Vector3;

use crate::body::Body;
use crate::collide::{self, MAX_POINTS, can_move};
use crate::error::BodyError;
use crate::grasp::{self, GraspQuality};
use crate::grasp_axis::GraspAxis;
use crate::hand::{FingerSettings, FingerTick, Hand, HandStart};
use crate::integrator::explicit::{self, Kept};
use crate::integrator::rk4::Stages;
use crate::integrator::{Gets, Integrator, Limits, mean_angular_velocity_W};
use crate::pair::{End, Pair, Response, Start, Surfacing, fastest_point_m_s};
use crate::restitution::Restitution;
use crate::row::Row;
use crate::solver::{Motion, Solver};
use crate::touch::Touch;

/// What holds for all bodies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// \[m/s^2\], in W.
    pub gravity_W: Vector3<f64>,
    /// How forces become motion.
    pub integrator: Integrator,
    /// How contacts between entities answer.
    pub response: Response,
    /// Nothing moves faster \[m/s\].
    pub most_speed_m_s: f64,
    /// Nothing turns faster \[rad/s\].
    pub most_spin_rad_s: f64,
    /// A body farther than this from the origin has left the world and is parked \[m\].
    pub world_radius_m: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            gravity_W: Vector3::new(0.0, -9.81, 0.0),
            integrator: Integrator::default(),
            response: Response::default(),
            most_speed_m_s: 50.0,
            most_spin_rad_s: 2000.0,
            world_radius_m: 100.0,
        }
    }
}

/// All bodies, and what they remember of where they touch.
#[derive(Debug, Clone)]
pub struct Manipulation {
    settings: Settings,
    bodies: Box<[Body]>,
    /// Of each body, which entity it is.
    entities: Box<[usize]>,
    /// Of each body, whether it has left the world, or was lost to a number that is none.
    is_parked: Box<[bool]>,
    pairs: Box<[Pair]>,
    rows: Vec<Row>,
    motions: Vec<Motion>,
    speeds_m_s: Vec<f64>,
    /// Of each body, what a tick took from it \[J\].
    spare_j: Vec<f64>,
    solver: Solver,
    hand: Hand,
    restitution: Restitution,
    /// The first so many rows are fingers'.
    touching: usize,
    gets: Box<[Gets]>,
    stages: Stages,
    fixed: Vec<Kept>,
    parked: Vec<Parked>,
}

/// What a tick took and did.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Made {
    /// Contact points, those of fingers among them.
    pub rows: usize,
    /// Turns of the solver.
    pub sweeps: usize,
    /// Bodies that were parked in this tick: the last so many of [`Manipulation::parked`].
    pub parked: usize,
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
/// The most contact points between entities in a tick; more are left out.
const MAX_ROWS: usize = 2048;

impl Manipulation {
    /// The entities of these numbers are bodies; all others are fixed.
    ///
    /// # Errors
    /// A body whose contact points nobody can find.
    pub fn new(entities: &[Entity], bodies: &[(usize, Body)], settings: Settings) -> Result<Self, BodyError> {
        let body_of = |entity: usize| bodies.iter().position(|(of, _)| *of == entity);
        let mut pairs = Vec::new();
        for (number, &(a, _)) in bodies.iter().enumerate() {
            if !can_move(&entities[a].shape) {
                return Err(BodyError::NoContactPoints { shape: collide::name(&entities[a].shape) });
            }
            for b in 0..entities.len() {
                let other = body_of(b);
                // Of two bodies once.
                if b != a && other.is_none_or(|other| other > number) {
                    // Between two that move, springs answer: reflected velocities of many bodies at once are not found in
                    // a tick's turns.
                    let response = if other.is_some() { Response::Force } else { settings.response };
                    let surfacing = Surfacing::between(&entities[a], &entities[b], response);
                    pairs.push(Pair::new([a, b], (number, other), surfacing));
                }
            }
        }
        let room = (pairs.len() * MAX_POINTS).min(MAX_ROWS) + MAX_TOUCHES;
        Ok(Self {
            settings,
            bodies: bodies.iter().map(|(_, body)| *body).collect(),
            entities: bodies.iter().map(|(entity, _)| *entity).collect(),
            is_parked: vec![false; bodies.len()].into(),
            pairs: pairs.into(),
            rows: Vec::with_capacity(room),
            motions: Vec::with_capacity(bodies.len()),
            hand: Hand::new(&[], bodies.len()),
            speeds_m_s: Vec::with_capacity(bodies.len()),
            spare_j: Vec::with_capacity(bodies.len()),
            solver: Solver::with_capacity(room, bodies.len()),
            restitution: Restitution::with_capacity(room, bodies.len()),
            touching: 0,
            gets: vec![Gets::default(); bodies.len()].into(),
            stages: Stages::with_capacity(room, bodies.len()),
            fixed: Vec::with_capacity(room),
            parked: Vec::with_capacity(bodies.len()),
        })
    }

    /// With fingers that are more than points: soft, or with a button. What they are must have been
    /// [checked](crate::SoftFinger::validated); a finger beyond them is a point.
    #[must_use]
    pub fn with_fingers(mut self, fingers: &[FingerSettings]) -> Self {
        self.hand = Hand::new(fingers, self.bodies.len());
        let room = self.rows.capacity() + self.hand.most_rows();
        let bodies = self.bodies.len();
        self.rows = Vec::with_capacity(room);
        self.solver = Solver::with_capacity(room, bodies);
        self.stages = Stages::with_capacity(room, bodies);
        self.restitution = Restitution::with_capacity(room, bodies);
        self.fixed = Vec::with_capacity(room);
        self
    }

    /// How well the fingers held a body in the last tick. Not part of a tick: it takes up to 20 microseconds.
    pub fn grasp_quality(&self, body: usize) -> Option<GraspQuality> {
        let state = self.bodies.get(body)?;
        let weight_W = self.settings.gravity_W * state.mass.mass_kg;
        // Arms are those of the tick's beginning: any centre will do.
        Some(grasp::quality(&self.rows, self.touching, body, (&state.centre_W, &weight_W)))
    }

    /// The line between the two fingers that held a body in the last tick.
    pub fn grasp_axis(&self, body: usize) -> Option<GraspAxis> {
        self.hand.axis(body)
    }

    /// The bodies, in the order in which they were given.
    pub fn bodies(&self) -> &[Body] {
        &self.bodies
    }

    /// Whether the entity of this number is a body.
    pub fn is_body(&self, entity: usize) -> bool {
        self.entities.contains(&entity)
    }

    /// The contact points of the last tick, with their forces.
    pub fn rows(&self) -> &[Row] {
        &self.rows
    }

    /// What the springs between entities hold after the last tick \[J\]; with the bodies' kinetic energy and gravity's it never
    /// grows while no finger presses.
    pub fn elastic_energy_j(&self) -> f64 {
        self.pairs.iter().map(Pair::elastic_energy_j).sum()
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
        if !(dt_s > 0.0 && dt_s.is_finite()) {
            return Made::default();
        }
        self.fall_freely(dt_s);
        let touch_rows = self.gather(entities, touches, fingers, dt_s);
        let sweeps = self.find_forces(dt_s);
        for (touch, row) in touches.iter_mut().zip(touch_rows) {
            if let Some(row) = row {
                touch.force_on_user_W = -self.rows[row].force_W;
            }
        }
        self.hand.settle(&self.rows, &self.motions, &self.entities, fingers, dt_s);
        self.settle_pairs(entities, dt_s);
        self.sum_up();
        let parked = self.advance(entities, dt_s);
        Made { rows: self.rows.len(), sweeps, parked }
    }

    /// How the bodies would move without anything that touches them.
    fn fall_freely(&mut self, dt_s: f64) {
        self.motions.clear();
        let fall_W = self.settings.gravity_W * dt_s;
        for (body, &is_parked) in self.bodies.iter().zip(&self.is_parked) {
            let mut motion = moving(body);
            if is_parked {
                (motion.inverse_mass, motion.inverse_inertia_W) = (0.0, nalgebra::Matrix3::zeros());
            } else {
                motion.velocity_W += fall_W;
                if self.settings.integrator.is_implicit() {
                    motion.angular_velocity_W = mean_angular_velocity_W(body, dt_s);
                }
            }
            self.motions.push(motion);
        }
    }

    /// All contact points of the tick; says which are whose touch.
    fn gather(
        &mut self,
        entities: &[Entity],
        touches: &[Touch],
        fingers: &[FingerTick],
        dt_s: f64,
    ) -> [Option<usize>; MAX_TOUCHES] {
        self.rows.clear();
        let mut touch_rows = [None; MAX_TOUCHES];
        // Fingers first: they are never left out.
        for (touch, place) in touches.iter().zip(&mut touch_rows) {
            let Some(body) = self.entities.iter().position(|&entity| entity == touch.entity) else {
                continue;
            };
            let (state, motion) = (&self.bodies[body], moving(&self.bodies[body]));
            *place = Some(self.rows.len());
            self.rows.push(touch.row(body, &state.centre_W, &motion, &entities[touch.entity], dt_s));
        }
        self.hand.gather(
            &HandStart {
                touches,
                touch_rows: &touch_rows,
                entities,
                bodies_are: &self.entities,
                bodies: &self.bodies,
                is_parked: &self.is_parked,
                gravity_W: self.settings.gravity_W,
                dt_s,
            },
            fingers,
            &mut self.rows,
        );
        self.touching = self.rows.len();
        self.restitution.impacts.clear();
        self.speeds_m_s.clear();
        let moving = self.entities.iter().zip(&self.bodies).zip(&self.motions);
        self.speeds_m_s.extend(
            moving.map(|((&entity, body), motion)| fastest_point_m_s(&entities[entity], body, motion)),
        );
        let start = Start {
            entities,
            bodies: &self.bodies,
            motions: &self.motions,
            speeds_m_s: &self.speeds_m_s,
            dt_s,
            is_implicit: self.settings.integrator.is_implicit(),
        };
        for pair in &mut self.pairs {
            pair.gather(&start, &mut self.rows, &mut self.restitution.impacts);
        }
        touch_rows
    }

    /// What all contact points do in the tick; returns the turns of the solver.
    fn find_forces(&mut self, dt_s: f64) -> usize {
        for (gets, &is_parked) in self.gets.iter_mut().zip(&self.is_parked) {
            *gets = Gets { gravity_W: self.settings.gravity_W, is_parked, ..Gets::default() };
        }
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
        let sweeps = self.restitution.solve(&mut self.solver, &mut self.rows, &mut self.motions, dt_s);
        explicit::release(&mut self.rows, &mut self.fixed);
        sweeps
    }

    /// Tells the pairs how the tick ended, and what its being finite took from the bodies: with the velocity of its end for all of
    /// it, half of the mass times the velocity's change squared.
    fn settle_pairs(&mut self, entities: &[Entity], dt_s: f64) {
        self.spare_j.clear();
        self.spare_j.extend(self.bodies.iter().zip(&self.motions).map(|(body, motion)| {
            0.5 * body.mass.mass_kg * (motion.velocity_W - body.velocity_W).norm_squared()
        }));
        let end = End { rows: &self.rows, motions: &self.motions, entities, dt_s };
        for pair in &mut self.pairs {
            pair.settle(&end, &mut self.spare_j);
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
        let settings = &self.settings;
        let limits = Limits { speed_m_s: settings.most_speed_m_s, spin_rad_s: settings.most_spin_rad_s };
        let before_parked = self.parked.len();
        for (number, body) in self.bodies.iter_mut().enumerate() {
            let entity = &mut entities[self.entities[number]];
            if self.is_parked[number] {
                entity.move_to(entity.X_WB);
                continue;
            }
            let before = *body;
            settings.integrator.advance(body, &self.gets[number], &limits, dt_s);
            let why = if !body.is_finite() {
                Some(Reason::NotANumber)
            } else {
                (body.centre_W.norm() > settings.world_radius_m).then_some(Reason::LeftTheWorld)
            };
            if let Some(why) = why {
                *body = Body { velocity_W: Vector3::zeros(), angular_momentum_W: Vector3::zeros(), ..before };
                self.is_parked[number] = true;
                self.parked.push(Parked { entity: self.entities[number], why });
            }
            entity.move_to(body.pose());
        }
        self.parked.len() - before_parked
    }
}

fn moving(body: &Body) -> Motion {
    Motion {
        velocity_W: body.velocity_W,
        angular_velocity_W: body.angular_velocity_W(),
        inverse_mass: body.mass.mass_kg.recip(),
        inverse_inertia_W: body.inverse_inertia_W(),
    }
}
