//! One finger against one entity: begins, updates and ends the contact.
//!
//! Model: a contact begins when the HIP is inside (on the surface counts) and lives until it is
//! outside. It begins where the HIP's path entered, both ends taken through the pose the entity had
//! at the time; a HIP that is inside without having entered (first tick, object placed over it)
//! begins at the nearest surface point.
//!
//! Frames: in and out in W; the god-object lives in B and so travels with the entity.
//! Invariant: whatever is not finite ends the contact with zero force.
//! Cost: one friction cone update when inside, one signed distance when not.

use nalgebra::Vector3;

use crate::entity::Entity;
use crate::frame::{is_finite, point_into_body, point_into_world, vector_into_body, vector_into_world};
use crate::friction_cone::{ConeForce, ConeInput, FrictionCone};
use crate::friction_law::FrictionState;
use crate::shape::Shape;
use crate::surface::{Feature, Surface, SurfacePoint};

/// What a finger feels of one entity in one tick, in the world frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contact {
    /// Index of the entity.
    pub entity: usize,
    /// Force the device renders \[N\]; points out of the material.
    pub force_on_user_W: Vector3<f64>,
    /// Normal part of it \[N\], >= 0.
    pub normal_force_n: f64,
    /// Where the god-object is \[m\]; of a spherical finger, its centre.
    pub god_object_W: Vector3<f64>,
    /// Outward unit normal there.
    pub normal_W: Vector3<f64>,
    /// What it rests on.
    pub feature: Feature,
    /// Whether it holds or slides.
    pub friction: FrictionState,
}

impl Contact {
    /// Force of the user on the entity \[N\].
    pub fn force_on_object_W(&self) -> Vector3<f64> {
        -self.force_on_user_W
    }

    /// Where the surface of a finger of this radius touches the entity \[m\].
    pub fn touch_point_W(&self, finger_radius_m: f64) -> Vector3<f64> {
        self.god_object_W - self.normal_W * finger_radius_m
    }
}

/// The finger's part of a tick.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sweep {
    pub(crate) previous_hip_W: Option<Vector3<f64>>,
    pub(crate) hip_W: Vector3<f64>,
    /// If it is known better than by the difference of the two.
    pub(crate) hip_velocity_W: Option<Vector3<f64>>,
    pub(crate) finger_radius_m: f64,
    pub(crate) dt_s: f64,
}

/// A finger's place for one entity.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Slot {
    cone: Option<FrictionCone>,
    pub(crate) contact: Option<Contact>,
}

impl Slot {
    pub(crate) fn step(&mut self, index: usize, entity: &Entity, sweep: &Sweep) -> Option<Contact> {
        self.contact = self.touch(index, entity, sweep);
        if self.contact.is_none() {
            self.cone = None;
        }
        self.contact
    }

    fn touch(&mut self, index: usize, entity: &Entity, sweep: &Sweep) -> Option<Contact> {
        let hip_B = point_into_body(&entity.X_WB, &sweep.hip_W);
        let previous_B = sweep.previous_hip_W.map(|p_W| point_into_body(&entity.previous_X_WB, &p_W));
        let previous_B = previous_B.filter(is_finite);
        let surface = entity.shape.grown(sweep.finger_radius_m);
        // Not a number is outside, too.
        if !is_finite(&hip_B) || surface.signed_distance(&hip_B).is_nan() {
            return None;
        }
        if surface.signed_distance(&hip_B) > 0.0 {
            return None;
        }
        let input = ConeInput {
            hip_B,
            hip_velocity_B: hip_velocity(entity, hip_B, previous_B, sweep),
            stiffness_n_per_m: entity.stiffness_n_per_m,
            damping_n_s_per_m: entity.damping_n_s_per_m,
            dt_s: sweep.dt_s,
        };
        let begin = || FrictionCone::new(begin(&surface, previous_B, &hip_B));
        let cone = self.cone.get_or_insert_with(begin);
        let force = cone.update(&surface, &entity.friction, &input);
        let contact = in_world(index, entity, cone, &force);
        let usable = is_finite(&contact.force_on_user_W) && is_finite(&contact.god_object_W);
        usable.then_some(contact)
    }
}

/// Where a contact begins.
fn begin(surface: &Shape, previous_B: Option<Vector3<f64>>, hip_B: &Vector3<f64>) -> SurfacePoint {
    let entered = previous_B.and_then(|previous_B| surface.entry(&previous_B, hip_B));
    entered.unwrap_or_else(|| surface.nearest(hip_B))
}

/// Seen from the entity, so that a finger riding along on a moving one is not damped.
///
/// Of the difference of two positions in B the entity's part is exact, since its poses are. Only the HIP's own part,
/// the difference of two positions in W, is replaced where something better is known; where that is the very same
/// difference, no bit changes.
fn hip_velocity(
    entity: &Entity,
    hip_B: Vector3<f64>,
    previous_B: Option<Vector3<f64>>,
    sweep: &Sweep,
) -> Vector3<f64> {
    let (Some(previous_B), Some(previous_W)) = (previous_B, sweep.previous_hip_W) else {
        return Vector3::zeros();
    };
    if sweep.dt_s.is_nan() || sweep.dt_s <= 0.0 {
        return Vector3::zeros();
    }
    let difference_B = (hip_B - previous_B) / sweep.dt_s;
    let Some(velocity_W) = sweep.hip_velocity_W else { return difference_B };
    let correction_W = velocity_W - (sweep.hip_W - previous_W) / sweep.dt_s;
    difference_B + vector_into_body(&entity.X_WB, &correction_W)
}

fn in_world(entity_index: usize, entity: &Entity, cone: &FrictionCone, force: &ConeForce) -> Contact {
    let god_object = cone.god_object();
    Contact {
        entity: entity_index,
        force_on_user_W: vector_into_world(&entity.X_WB, &force.force_on_user_B),
        normal_force_n: force.normal_force_n,
        god_object_W: point_into_world(&entity.X_WB, &god_object.point_B),
        normal_W: vector_into_world(&entity.X_WB, &god_object.normal_B),
        feature: god_object.feature,
        friction: cone.state(),
    }
}
