//! What a finger feels beside its contacts, and what it remembers of it.
//!
//! Invariants: a HIP that is not finite resets all of it and gives zero force; after a reset the force comes on
//! within the ramp; whatever is not finite in the sum becomes zero.

use nalgebra::Vector3;

use super::acceleration::AccelerationFilter;
use super::guide::Hold;
use super::reaction::{Reaction, Reactions};
use super::{Effects, Motion, Pull};
use crate::contact::RAMP_IN_S;
use crate::entity::Entity;
use crate::error::{ParameterError, at_least_zero};
use crate::finger::Finger;
use crate::frame::is_finite;
use crate::hip::Hip;

/// The state of a finger's effects.
#[derive(Debug, Clone)]
pub struct FingerEffects {
    ramp_in_s: f64,
    /// How much of the force is rendered, 0 to 1.
    strength: f64,
    previous_hip_W: Option<Vector3<f64>>,
    filters: Box<[AccelerationFilter]>,
    holds: Box<[Hold]>,
    /// Speed in the last tick (m/s).
    speed_m_s: f64,
    /// What springs and magnets hold (J).
    stored_j: f64,
    /// By how much the force can have changed in the last tick (N).
    explained_n: f64,
    /// What of the force came from entities.
    reactions: Reactions,
}

/// When a tick is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moment {
    /// Since the run began \[s\]; vibrations go by it.
    pub t_s: f64,
    /// Since the tick before \[s\].
    pub dt_s: f64,
}

impl FingerEffects {
    /// A finger that has felt nothing yet, with room for these effects.
    pub fn new(effects: &Effects) -> Self {
        Self {
            ramp_in_s: RAMP_IN_S,
            strength: 0.0,
            previous_hip_W: None,
            filters: vec![AccelerationFilter::default(); effects.fields().len()].into(),
            holds: vec![Hold::default(); effects.guides().len()].into(),
            speed_m_s: 0.0,
            stored_j: 0.0,
            explained_n: 0.0,
            reactions: Reactions::with_room(effects.most_reactions()),
        }
    }

    /// With another ramp after a reset than [`RAMP_IN_S`]; 0 for none.
    ///
    /// Errors: a time not finite or negative.
    pub fn with_ramp_in(mut self, ramp_in_s: f64) -> Result<Self, ParameterError> {
        self.set_ramp_in(ramp_in_s)?;
        Ok(self)
    }

    /// As [`Self::with_ramp_in`], also between two ticks.
    ///
    /// Errors: a time not finite or negative, and nothing is changed.
    pub fn set_ramp_in(&mut self, ramp_in_s: f64) -> Result<(), ParameterError> {
        self.ramp_in_s = at_least_zero("ramp_in_s", ramp_in_s)?;
        Ok(())
    }

    /// One tick, after the finger's own: the force on the user of all effects \[N\], in the world.
    ///
    /// `effects` are those that it was made for, `entities` those that `finger` stepped against. A `dt_s` that is not
    /// positive leaves out what depends on speed.
    pub fn step(
        &mut self,
        effects: &Effects,
        entities: &[Entity],
        finger: &Finger,
        hip: impl Into<Hip>,
        moment: Moment,
    ) -> Vector3<f64> {
        let hip = hip.into();
        if !is_finite(&hip.position_W) {
            self.reset();
            return Vector3::zeros();
        }
        let last_hip_W = self.previous_hip_W.unwrap_or(hip.position_W);
        let motion = self.motion(&hip, moment.dt_s);
        self.reactions.clear();
        let mut pull = self.of_guides(effects, &motion);
        pull.add(&self.of_fields(effects, &motion));
        pull.add(&self.of_magnets(effects, entities, finger, [&hip.position_W, &last_hip_W]));
        pull.add(&self.of_vibrations(effects, entities, finger, moment));
        let before = self.strength;
        self.come_on(moment.dt_s);
        if !(is_finite(&pull.force_on_user_W) && pull.stored_j.is_finite()) {
            pull = Pull::default();
            self.reactions.clear();
        }
        self.reactions.scale(self.strength);
        self.stored_j = pull.stored_j * self.strength;
        let came_on_n = pull.force_on_user_W.norm() * (self.strength - before);
        self.explained_n = pull.explained_n * self.strength + came_on_n;
        pull.force_on_user_W * self.strength
    }

    /// What the springs of guides and the magnets held in the last tick \[J\]: what they give back when the finger goes
    /// to the track or the surface. Of a magnet that is out of reach, and of fields, nothing.
    pub fn stored_j(&self) -> f64 {
        self.stored_j
    }

    /// By how much the force can have changed since the tick before \[N\] for what the finger, the entities and time did, but
    /// where two places of a track or of a surface are equally near.
    pub fn explained_n(&self) -> f64 {
        self.explained_n
    }

    /// What of the last tick's force came from which entity: each gets its part with the sign turned. Of fields and guides
    /// there is none.
    pub fn reactions(&self) -> &[Reaction] {
        self.reactions.as_slice()
    }

    /// Whether it is held by this guide.
    pub fn is_captured(&self, guide: usize) -> bool {
        self.holds.get(guide).is_some_and(|hold| hold.is_captured)
    }

    /// Forgets all: the next step is a first one.
    pub fn reset(&mut self) {
        (self.strength, self.stored_j, self.explained_n) = (0.0, 0.0, 0.0);
        self.previous_hip_W = None;
        self.reactions.clear();
        self.filters.fill(AccelerationFilter::default());
        self.holds.fill(Hold::default());
    }

    fn motion(&mut self, hip: &Hip, dt_s: f64) -> Motion {
        let previous_W = self.previous_hip_W.replace(hip.position_W);
        let by_difference = || {
            let speed_W = (hip.position_W - previous_W?) / dt_s;
            (dt_s > 0.0 && is_finite(&speed_W)).then_some(speed_W)
        };
        let known_W = hip.velocity_W.filter(|v_W| is_finite(v_W) && dt_s > 0.0);
        let velocity_W = known_W.or_else(by_difference).unwrap_or_default();
        let speed_m_s = velocity_W.norm();
        let speeds_m_s = speed_m_s + std::mem::replace(&mut self.speed_m_s, speed_m_s);
        let way_m = previous_W.map_or(0.0, |previous_W| (hip.position_W - previous_W).norm());
        Motion { position_W: hip.position_W, velocity_W, dt_s, way_m, speeds_m_s }
    }

    fn of_fields(&mut self, effects: &Effects, motion: &Motion) -> Pull {
        let mut pull = Pull::default();
        for (field, filter) in effects.fields().iter().zip(&mut self.filters) {
            pull.add(&field.pull(motion, filter));
        }
        pull
    }

    fn of_guides(&mut self, effects: &Effects, motion: &Motion) -> Pull {
        let mut pull = Pull::default();
        for (guide, hold) in effects.guides().iter().zip(&mut self.holds) {
            pull.add(&guide.pull(motion, hold));
        }
        pull
    }

    fn of_magnets(
        &mut self,
        effects: &Effects,
        entities: &[Entity],
        finger: &Finger,
        [hip_W, last_hip_W]: [&Vector3<f64>; 2],
    ) -> Pull {
        let mut total = Pull::default();
        for &index in &effects.magnetic {
            let Some(entity) = entities.get(index).filter(|entity| entity.space == finger.space()) else {
                continue;
            };
            if let (Some(magnetism), None) = (&entity.magnetism, finger.contact(index))
                && let Some((pull, reaction)) =
                    magnetism.pull((index, entity), hip_W, last_hip_W, finger.radius_m())
            {
                total.add(&pull);
                self.reactions.add(reaction);
            }
        }
        total
    }

    fn of_vibrations(
        &mut self,
        effects: &Effects,
        entities: &[Entity],
        finger: &Finger,
        moment: Moment,
    ) -> Pull {
        let mut total = Pull::default();
        for &index in &effects.vibrating {
            let Some(entity) = entities.get(index) else { continue };
            if let (Some(vibration), Some(contact)) = (&entity.vibration, finger.contact(index)) {
                let hum = vibration.hum(contact, finger.radius_m(), moment.t_s);
                total.force_on_user_W += hum.force_on_user_W;
                total.explained_n += vibration.explained_n(contact, moment.dt_s);
                self.reactions.add(hum);
            }
        }
        total
    }

    fn come_on(&mut self, dt_s: f64) {
        if self.strength < 1.0 {
            let step = dt_s / self.ramp_in_s;
            // Where time is unknown or no ramp wanted, there is none.
            self.strength = if step > 0.0 { (self.strength + step).min(1.0) } else { 1.0 };
        }
    }
}
