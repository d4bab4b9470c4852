//! What a finger feels beside its contacts, and what it remembers of it.
//!
//! Invariants: a HIP that is not finite resets all of it and gives zero force; after a reset the force comes on
//! within the ramp; whatever is not finite in the sum becomes zero.

use nalgebra::Vector3;

use super::acceleration::AccelerationFilter;
use super::guide::Hold;
use super::{Effects, Motion};
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
        let motion = self.motion(&hip, moment.dt_s);
        let mut force_W = self.of_fields(effects, &motion) + self.of_guides(effects, &motion);
        force_W += of_surfaces(effects, entities, finger, &hip.position_W, moment.t_s);
        self.come_on(moment.dt_s);
        if is_finite(&force_W) { force_W * self.strength } else { Vector3::zeros() }
    }

    /// Whether it is held by this guide.
    pub fn is_captured(&self, guide: usize) -> bool {
        self.holds.get(guide).is_some_and(|hold| hold.is_captured)
    }

    /// Forgets all: the next step is a first one.
    pub fn reset(&mut self) {
        self.strength = 0.0;
        self.previous_hip_W = None;
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
        Motion { position_W: hip.position_W, velocity_W, dt_s }
    }

    fn of_fields(&mut self, effects: &Effects, motion: &Motion) -> Vector3<f64> {
        let felt = effects.fields().iter().zip(&mut self.filters);
        felt.map(|(field, filter)| field.force_on_user_W(motion, filter)).sum()
    }

    fn of_guides(&mut self, effects: &Effects, motion: &Motion) -> Vector3<f64> {
        let felt = effects.guides().iter().zip(&mut self.holds);
        felt.map(|(guide, hold)| guide.force_on_user_W(motion, hold)).sum()
    }

    fn come_on(&mut self, dt_s: f64) {
        if self.strength < 1.0 {
            let step = dt_s / self.ramp_in_s;
            // Where time is unknown or no ramp wanted, there is none.
            self.strength = if step > 0.0 { (self.strength + step).min(1.0) } else { 1.0 };
        }
    }
}

fn of_surfaces(
    effects: &Effects,
    entities: &[Entity],
    finger: &Finger,
    hip_W: &Vector3<f64>,
    t_s: f64,
) -> Vector3<f64> {
    let mut force_W = Vector3::zeros();
    for &index in &effects.magnetic {
        let Some(entity) = entities.get(index) else { continue };
        if let (Some(magnetism), None) = (&entity.magnetism, finger.contact(index)) {
            force_W += magnetism.force_on_user_W(entity, hip_W, finger.radius_m());
        }
    }
    for &index in &effects.vibrating {
        let Some(entity) = entities.get(index) else { continue };
        if let (Some(vibration), Some(contact)) = (&entity.vibration, finger.contact(index)) {
            force_W += vibration.force_on_user_W(contact, t_s);
        }
    }
    force_W
}
