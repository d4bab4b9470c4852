//! A finger's touch on a body: what rendering found, and what the tick makes of it.
//!
//! Model: rendering gives the force for where HIP and body are when the tick begins. What the body's velocity changes by
//! in the tick moves its end of the spring, `force - (k dt + b) (u - u_start)`: a body that goes on as it did, in step with
//! its hand, feels just the rendered force; a light one gives way before the force gets large. That is symplectic Euler
//! with `k dt^2` of mass added at the contact: stable for every k and m, without drag on a hand that carries. The user is
//! made to feel that force, the one which the body got.

use haptics::{
    Contact, ContactState, Entity, FeltMaterial, FrictionLaw, FrictionMemory, FrictionQuery, TouchPoint,
};
use nalgebra::Vector3;

use crate::row::{Held, Rolling, Row, Torsion};
use crate::solver::Motion;

/// One point at which a finger touches a body, in the world frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Touch {
    /// Index of the entity.
    pub entity: usize,
    /// Which finger's.
    pub finger: usize,
    /// Where \[m\].
    pub point_W: Vector3<f64>,
    /// Outward unit normal of the entity there.
    pub normal_W: Vector3<f64>,
    /// What the user feels \[N\]: as rendered, then as [`Manipulation::step`](crate::Manipulation::step) has it.
    pub force_on_user_W: Vector3<f64>,
    /// Whether its friction holds.
    pub is_sticking: bool,
    /// Stiffness with which it was rendered \[N/m\].
    pub stiffness_n_per_m: f64,
    /// Of the face that is touched ([`Entity::felt_material`]).
    pub label: u16,
    /// Answer of [`Manipulation::step`](crate::Manipulation::step): force, beyond their weight, with which bodies that are fixed
    /// only until they are stepped held this one and all that it is joined with by contacts \[N\]: their turn has not come, or
    /// they are on their way from elsewhere.
    pub held_by_waiting_n: f64,
}

impl Touch {
    /// A finger's whole contact, as at one point.
    pub fn of(contact: &Contact, finger: usize) -> Self {
        Self {
            entity: contact.entity,
            finger,
            point_W: contact.god_object_W,
            normal_W: contact.normal_W,
            force_on_user_W: contact.force_on_user_W,
            is_sticking: ContactState::from(contact.friction) == ContactState::Stick,
            stiffness_n_per_m: contact.stiffness_n_per_m,
            label: contact.label,
            held_by_waiting_n: 0.0,
        }
    }

    /// One of the points of a finger's contact.
    pub fn at(point: &TouchPoint, contact: &Contact, finger: usize) -> Self {
        let TouchPoint { point_W, normal_W, force_on_user_W } = *point;
        Self { point_W, normal_W, force_on_user_W, ..Self::of(contact, finger) }
    }

    /// Material of the entity there.
    pub(crate) fn material<'e>(&self, entity: &'e Entity) -> FeltMaterial<'e> {
        FeltMaterial { stiffness_n_per_m: self.stiffness_n_per_m, ..entity.felt_material(self.label) }
    }

    /// As a contact point of this body, whose centre is there and which moves like that when the tick begins.
    pub(crate) fn row(
        &self,
        body: usize,
        centre_W: &Vector3<f64>,
        motion: &Motion,
        entity: &Entity,
        dt_s: f64,
    ) -> Row {
        let arm_W = self.point_W - centre_W;
        let material = self.material(entity);
        let (k, b) = (material.stiffness_n_per_m, material.damping_n_s_per_m);
        let held = if self.is_sticking { Held::Stick } else { Held::Slip };
        let n = -self.normal_W;
        let force_W = -self.force_on_user_W;
        let mu = self.ratio(&force_W, &material);
        let mut row = Row {
            body,
            other: None,
            arms_W: [arm_W, Vector3::zeros()],
            normal_W: n,
            rest_W: force_W,
            stiffness: [k; 2],
            damping: [b; 2],
            mu_hold: mu,
            mu_slide: mu,
            held,
            force_W,
            torsion: Torsion::default(),
            rolling: Rolling::default(),
            turning_m: [0.0; 2],
            tie_n: None,
        };
        let velocity_W = motion.at(&arm_W);
        row.rest_W += force_W - row.trial_W(&(velocity_W * dt_s), &velocity_W);
        row
    }

    /// Ratio of tangential to normal force that friction allows: the law's while it holds, that which is while it slides.
    fn ratio(&self, force_W: &Vector3<f64>, material: &FeltMaterial<'_>) -> f64 {
        let n = -self.normal_W;
        let normal_n = n.dot(force_W);
        let across_n = (force_W - n * normal_n).norm();
        let is = if normal_n > 0.0 { across_n / normal_n } else { 0.0 };
        if !self.is_sticking {
            return is;
        }
        let load_m = (normal_n / material.stiffness_n_per_m).max(LEAST_LOAD_M);
        is.max(friction_circle_m(material, load_m) / load_m)
    }
}

/// Radius of the circle within which a material's friction holds a god-object that is pressed so deep (m).
pub(crate) fn friction_circle_m(material: &FeltMaterial<'_>, load_m: f64) -> f64 {
    let stiffness_n_per_m = material.stiffness_n_per_m;
    let query = FrictionQuery { load_m, stiffness_n_per_m, ..FrictionQuery::default() };
    let radius_m = material.friction.held_limit_m(&query, &FrictionMemory::default());
    if radius_m.is_finite() { radius_m.max(0.0) } else { 0.0 }
}

/// Of a touch without a force, the ratio at this depth counts.
const LEAST_LOAD_M: f64 = 1e-9;
