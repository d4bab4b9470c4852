//! A finger in the fast step: from its device's frame to what it feels.

#![allow(non_snake_case)] // Frames are capital letters.

use super::Objects;
use super::near::{Near, Room};
use crate::mount::Mount;
use crate::row::FingerRow;
use haptics::{Contact, Door, Effects, Entity, Finger, FingerEffects, FrictionState, Hip, Moment, Passage};
use nalgebra::Vector3;
use shm_abi::DeviceFrame;
use shm_abi::frame::{DEVICE_ORIENTATION_MEASURED, DEVICE_POSITION_VALID};
use world::lists::Reach;

/// A finger and the device that is it.
#[derive(Debug, Clone)]
pub struct DeviceFinger {
    /// The finger.
    pub finger: Finger,
    /// Index of its device.
    pub device: usize,
    /// Where the device stands.
    pub mount: Mount,
}

/// What fingers step against.
pub(super) struct World<'a> {
    pub(super) entities: &'a [Entity],
    pub(super) doors: &'a [Door],
    pub(super) objects: &'a Objects,
}

impl DeviceFinger {
    /// The device's own velocity, and that with which it is carried (m/s). A device that stands still passes every bit
    /// through.
    pub(super) fn velocity_W(&self, device: &DeviceFrame, carried_W: Vector3<f64>) -> Vector3<f64> {
        let own_W = self.mount.velocity_to_world(device.velocity_m_per_s_estimated);
        if carried_W == Vector3::zeros() { own_W } else { own_W + carried_W }
    }

    /// Where it is and how fast it moves; by its last position `last_D`, if that is known.
    pub(super) fn reach(&self, device: &DeviceFrame, last_D: Option<&[f64; 3]>, dt_s: f64) -> Option<Reach> {
        if device.flags & DEVICE_POSITION_VALID == 0 {
            return None;
        }
        let hip_W = self.mount.point_to_world(device.position_m_measured);
        let from_W = last_D.map_or(hip_W, |last_D| self.mount.point_to_world(*last_D));
        Some(Reach { hip_W, velocity_W: (hip_W - from_W) / dt_s, radius_m: self.finger.radius_m() })
    }

    pub(super) fn step(
        &mut self,
        device: &DeviceFrame,
        world: &World<'_>,
        (near, passage): (&mut Near, &mut Passage),
        dt_s: f64,
        velocity_W: Option<Vector3<f64>>,
    ) -> FingerRow {
        let hip = self.mount.point_to_world(device.position_m_measured);
        let orientation_wxyz = self.mount.orientation_to_world(device.orientation_wxyz_measured);
        let seen = FingerRow {
            hip,
            velocity: velocity_W.unwrap_or_default(),
            god_object: hip,
            orientation_wxyz,
            has_orientation: device.flags & DEVICE_ORIENTATION_MEASURED != 0,
            buttons: device.buttons,
            space: self.finger.space(),
            ..FingerRow::default()
        };
        if device.flags & DEVICE_POSITION_VALID == 0 {
            self.finger.reset();
            passage.reset();
            return seen;
        }
        let &World { entities, doors, objects } = world;
        let step = |finger: &mut Finger| {
            let from = finger.last_hip_W().unwrap_or(hip);
            let around = (objects.broad_phase(), entities);
            let room = Room {
                slots: finger.capacity(),
                touched: finger.contacts().count(),
                is_touched: |entity| finger.contacts().any(|contact| contact.entity == entity as usize),
            };
            let near = near.update(around, (finger.space(), &room), &from, &hip, finger.radius_m());
            finger.step_near(entities, near, Hip { position_W: hip, velocity_W }, dt_s)
        };
        let moves = |entity| objects.manipulation().is_body(entity);
        let (output, _) = passage.step(&mut self.finger, (entities, doors), dt_s, moves, step);
        let touched = output.entity.and_then(|entity| self.finger.contact(entity).zip(entities.get(entity)));
        let (normal, friction_radius_m) = touched.map_or_else(Default::default, |(contact, entity)| {
            (contact.normal_W, friction_radius_m(contact, entity, &hip))
        });
        FingerRow {
            normal,
            friction_radius_m,
            god_object: output.god_object_W,
            force_on_user: finite_or_zero(output.force_on_user_W),
            torque_on_user: finite_or_zero(output.torque_on_user_W),
            entity: output.entity.map(|index| index as u32),
            feature: output.feature,
            friction: output.friction,
            space: self.finger.space(),
            ..seen
        }
    }

    /// The force of what is felt beside contacts (N); nothing without a `hip`.
    pub(super) fn feel(
        &self,
        felt: &mut FingerEffects,
        effects: &Effects,
        entities: &[Entity],
        hip: Option<Hip>,
        moment: Moment,
    ) -> Vector3<f64> {
        match hip {
            Some(hip) => felt.step(effects, entities, &self.finger, hip, moment),
            None => {
                felt.reset();
                Vector3::zeros()
            }
        }
    }
}

/// Of the circle around the HIP's foot on the tangent plane (m): on its rim the god-object slides, within it it is held.
fn friction_radius_m(contact: &Contact, entity: &Entity, hip_W: &Vector3<f64>) -> f64 {
    match contact.friction {
        FrictionState::Stick => {
            let stiffness_n_per_m = contact.stiffness_n_per_m;
            let load_m = contact.normal_force_n / stiffness_n_per_m;
            entity
                .felt_material(contact.label)
                .friction
                .circle_m(load_m, stiffness_n_per_m)
                .unwrap_or_default()
        }
        FrictionState::Slip => {
            let gap_W = contact.god_object_W - hip_W;
            (gap_W - contact.normal_W * contact.normal_W.dot(&gap_W)).norm()
        }
    }
}

/// The driver refuses a command that is not finite as a whole; zero for one finger is milder.
pub(super) fn finite_or_zero(force: Vector3<f64>) -> Vector3<f64> {
    if force.iter().all(|component| component.is_finite()) { force } else { Vector3::zeros() }
}
