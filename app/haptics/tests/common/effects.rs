//! A finger with its effects, stepped together as an application does.
#![allow(dead_code, non_snake_case)]

use haptics::{Effects, Entity, Field, Finger, FingerEffects, Guide, Hip, Limits, Moment};
use nalgebra::Vector3;

/// Limits of the default device at 1 kHz.
pub(crate) fn limits() -> Limits {
    Limits::at(1e-3).unwrap()
}

pub(crate) struct Felt {
    pub(crate) effects: Effects,
    pub(crate) entities: Vec<Entity>,
    pub(crate) finger: Finger,
    pub(crate) state: FingerEffects,
    pub(crate) tick: u64,
    pub(crate) dt_s: f64,
}

impl Felt {
    /// A point finger that feels everything at once, at 1 kHz.
    pub(crate) fn new(fields: Vec<Field>, guides: Vec<Guide>, entities: Vec<Entity>) -> Self {
        let effects = Effects::new(fields, guides, &entities);
        let finger = Finger::new(0.0, entities.len()).unwrap().with_ramp_in(0.0).unwrap();
        let state = FingerEffects::new(&effects).with_ramp_in(0.0).unwrap();
        Self { effects, entities, finger, state, tick: 0, dt_s: 1e-3 }
    }

    /// The force of the effects alone (N).
    pub(crate) fn beside(&mut self, hip: impl Into<Hip>) -> Vector3<f64> {
        self.both(hip).1
    }

    /// The force of contact and effects together (N).
    pub(crate) fn total(&mut self, hip: impl Into<Hip>) -> Vector3<f64> {
        let (contact, beside) = self.both(hip);
        contact + beside
    }

    /// The force of contact, and that of the effects (N).
    pub(crate) fn both(&mut self, hip: impl Into<Hip>) -> (Vector3<f64>, Vector3<f64>) {
        let hip = hip.into();
        let out = self.finger.step(&self.entities, hip, self.dt_s);
        let moment = Moment { t_s: self.tick as f64 * 1e-3, dt_s: self.dt_s };
        self.tick += 1;
        let beside = self.state.step(&self.effects, &self.entities, &self.finger, hip, moment);
        (out.force_on_user_W, beside)
    }
}

/// A HIP here that moves so.
pub(crate) fn moving(position_W: Vector3<f64>, velocity_W: Vector3<f64>) -> Hip {
    Hip { position_W, velocity_W: Some(velocity_W) }
}

/// A HIP that rests, as far as anybody knows.
pub(crate) fn resting(position_W: Vector3<f64>) -> Hip {
    moving(position_W, Vector3::zeros())
}
