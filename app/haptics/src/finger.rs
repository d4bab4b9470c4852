//! One finger against the entities near it: sums what its contacts render.
//!
//! Model: every entity that is touched or near has its own slot with its own god-object, so that a finger in a corner
//! feels both walls. Forces add. What a single line of a recording can show (entity, god-object, state)
//! is that of the primary contact: the one with the largest force, the lowest index among equals.
//!
//! Frames: world. Cost: linear in the number of entities that are near, which somebody else finds; slots are allocated
//! once, in `new`, and go from one entity to the next.
//!
//! A HIP that is not finite counts as lifted: zero force, all contacts end, and the next finite HIP
//! is treated as the first. The god-object reported is then the last finite HIP.

use nalgebra::Vector3;

use crate::contact::{Contact, RAMP_IN_S, Slot, Sweep};
use crate::door::{Crossing, WORLD};
use crate::entity::Entity;
use crate::error::{ParameterError, at_least_zero};
use crate::frame::is_finite;
use crate::friction_law::FrictionState;
use crate::hip::Hip;
use crate::slots::Slots;
use crate::surface::Feature;
use crate::touch_points::TouchPoints;

/// A finger and its contacts.
#[derive(Debug, Clone)]
pub struct Finger {
    radius_m: f64,
    /// Which space it is in.
    space: u32,
    ramp_in_s: f64,
    previous_hip_W: Option<Vector3<f64>>,
    last_finite_hip_W: Vector3<f64>,
    slots: Slots,
}

/// What a finger's friction does.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum ContactState {
    /// Touches nothing.
    #[default]
    Free,
    /// The primary contact holds.
    Stick,
    /// The primary contact slides.
    Slip,
}

impl From<FrictionState> for ContactState {
    fn from(state: FrictionState) -> Self {
        match state {
            FrictionState::Stick => Self::Stick,
            FrictionState::Slip => Self::Slip,
        }
    }
}

/// What a finger feels in one tick, in the world frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FingerOutput {
    /// Force the device renders \[N\], over all contacts.
    pub force_on_user_W: Vector3<f64>,
    /// Torque of the same forces about the centre of the finger \[N m\], over all contacts; zero for a point.
    pub torque_on_user_W: Vector3<f64>,
    /// God-object of the primary contact; the HIP in free space \[m\].
    pub god_object_W: Vector3<f64>,
    /// Index of the primary contact's entity.
    pub entity: Option<usize>,
    /// What the primary contact's god-object rests on.
    pub feature: Feature,
    /// What the primary contact's friction does.
    pub friction: ContactState,
}

impl Finger {
    /// A finger of this radius (0 for a point) that feels up to `capacity` entities at once.
    ///
    /// Of more than that those of the highest indices are not felt. Errors: a radius not finite or negative.
    pub fn new(radius_m: f64, capacity: usize) -> Result<Self, ParameterError> {
        let radius_m = at_least_zero("radius_m", radius_m)?;
        Ok(Self {
            radius_m,
            space: WORLD,
            ramp_in_s: RAMP_IN_S,
            previous_hip_W: None,
            last_finite_hip_W: Vector3::zeros(),
            slots: Slots::new(radius_m, capacity),
        })
    }

    /// A point that has room to [roll](crate::mesh::Mesh::point_radius_m) over all of these that ask for it; else over 16 at once.
    #[must_use]
    pub fn with_room_for(mut self, entities: &[Entity]) -> Self {
        if self.radius_m == 0.0 {
            let rolled = entities.iter().filter(|entity| entity.rolls_points()).count();
            self.slots.make_room_to_roll(rolled);
        }
        self
    }

    /// With another ramp for contacts that begin inside than [`RAMP_IN_S`]; 0 for none.
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

    /// Radius \[m\].
    pub fn radius_m(&self) -> f64 {
        self.radius_m
    }

    /// In this space; it feels no entity of another one.
    #[must_use]
    pub fn within(self, space: u32) -> Self {
        Self { space, ..self }
    }

    /// Which space it is in.
    pub fn space(&self) -> u32 {
        self.space
    }

    /// Where its HIP was in the last step (m); `None` where that was not known.
    pub fn last_hip_W(&self) -> Option<Vector3<f64>> {
        self.previous_hip_W
    }

    /// How many entities it feels at once.
    pub fn capacity(&self) -> usize {
        self.slots.capacity()
    }

    /// One tick: the HIP is where `hip` says, the entities at their current poses.
    ///
    /// An entity is known by its index: call [`Self::forget`] when another one takes its place. A
    /// `dt_s` that is not positive leaves out damping and speed-dependent friction. `hip` may be a [`Hip`] with a
    /// velocity, which damping then goes by, or `&Vector3`, a position alone.
    pub fn step(&mut self, entities: &[Entity], hip: impl Into<Hip>, dt_s: f64) -> FingerOutput {
        self.step_to(entities, 0..entities.len() as u32, &hip.into(), dt_s)
    }

    /// As [`Self::step`], where only the entities of these numbers (in ascending order) are near enough to be felt.
    ///
    /// What is in contact is stepped whether or not it is among them. An entity is best named a few ticks before it can be
    /// touched.
    pub fn step_near(
        &mut self,
        entities: &[Entity],
        near: &[u32],
        hip: impl Into<Hip>,
        dt_s: f64,
    ) -> FingerOutput {
        self.step_to(entities, near.iter().copied(), &hip.into(), dt_s)
    }

    fn step_to(
        &mut self,
        entities: &[Entity],
        near: impl ExactSizeIterator<Item = u32> + Clone,
        hip: &Hip,
        dt_s: f64,
    ) -> FingerOutput {
        let hip_W = &hip.position_W;
        if !is_finite(hip_W) {
            self.reset();
            return free(self.last_finite_hip_W);
        }
        let sweep = Sweep {
            previous_hip_W: self.previous_hip_W,
            hip,
            finger_radius_m: self.radius_m,
            ramp_in_s: self.ramp_in_s,
            dt_s,
        };
        self.slots.go_to(near, entities, &sweep);
        self.previous_hip_W = Some(*hip_W);
        self.last_finite_hip_W = *hip_W;
        let mut total = Total::default();
        for at in 0..self.slots.len() {
            let (index, slot) = self.slots.at_mut(at);
            let Some(entity) = entities.get(index) else { continue };
            if !entity.is_haptic || entity.space != self.space {
                slot.vacate();
                continue;
            }
            if let Some(contact) = slot.step(index, entity, &sweep) {
                total.add(contact);
                if self.radius_m > 0.0 {
                    total.turn(slot, entity, self.radius_m);
                }
            }
        }
        total.output(&self.slots, hip_W)
    }

    /// Goes on in another space: all contacts with this one end, and the next step is one from where the crossing
    /// says.
    pub fn go_through(&mut self, crossing: &Crossing) {
        self.slots.vacate_all();
        self.space = crossing.to;
        self.previous_hip_W = Some(crossing.begins_W);
    }

    /// What it feels now, after contacts of the last tick were [forgotten](Self::forget).
    pub fn output(&self, entities: &[Entity]) -> FingerOutput {
        let mut total = Total::default();
        for slot in self.slots.iter() {
            if let Some(contact) = &slot.contact {
                total.add(contact);
                if let (true, Some(entity)) = (self.radius_m > 0.0, entities.get(contact.entity)) {
                    total.turn(slot, entity, self.radius_m);
                }
            }
        }
        total.output(&self.slots, &self.last_finite_hip_W)
    }

    /// The contacts of the last tick, in order of their entities.
    pub fn contacts(&self) -> impl Iterator<Item = &Contact> {
        self.slots.iter().filter_map(|slot| slot.contact.as_ref())
    }

    /// The contact of the last tick with one entity.
    pub fn contact(&self, entity: usize) -> Option<&Contact> {
        self.slots.of(entity)?.contact.as_ref()
    }

    /// Where the finger touched this entity in the last tick, which must be as it was then.
    ///
    /// A ball in a groove or a corner touches it at two or three points; together they make the contact's force.
    pub fn touch_points(&self, entities: &[Entity], entity: usize) -> TouchPoints {
        match (self.slots.of(entity), entities.get(entity)) {
            (Some(slot), Some(entity)) => slot.touch_points(entity, self.radius_m),
            _ => TouchPoints::NONE,
        }
    }

    /// Ends the contact with one entity, because it is gone or another one has its index.
    pub fn forget(&mut self, entity: usize) {
        self.slots.vacate(entity);
    }

    /// The contact with one entity goes on with no more than this force (N, >= 0): what its spring is longer by is forgotten until the
    /// finger is out, as of what gave way for good. The force grows from there with what finger and entity move.
    pub fn shorten(&mut self, entity: usize, most_n: f64) {
        if let Some(slot) = self.slots.of_mut(entity) {
            slot.shorten(most_n.max(0.0));
        }
    }

    /// Ends all contacts and forgets where the finger was: the next step is a first one, in the same space.
    pub fn reset(&mut self) {
        self.previous_hip_W = None;
        self.slots.vacate_all();
    }
}

/// Sum and primary contact of a tick.
#[derive(Default)]
struct Total {
    force_on_user_W: Vector3<f64>,
    torque_on_user_W: Vector3<f64>,
    /// Square of the largest force, and whose it is.
    primary: Option<(f64, usize)>,
}

impl Total {
    fn add(&mut self, contact: &Contact) {
        self.force_on_user_W += contact.force_on_user_W;
        let force = contact.force_on_user_W.norm_squared();
        if self.primary.is_none_or(|(largest, _)| force > largest) {
            self.primary = Some((force, contact.entity));
        }
    }

    #[inline(never)]
    fn turn(&mut self, slot: &Slot, entity: &Entity, radius_m: f64) {
        if let Some(contact) = &slot.contact {
            let points = slot.touch_points(entity, radius_m);
            self.torque_on_user_W += points.torque_on_user_about_W(&contact.god_object_W);
        }
    }

    fn output(&self, slots: &Slots, hip_W: &Vector3<f64>) -> FingerOutput {
        let primary = self.primary.and_then(|(_, entity)| slots.of(entity)?.contact.as_ref());
        let Some(primary) = primary else { return free(*hip_W) };
        // Finite forces can overflow in the sum; zero is the safe one.
        let force_on_user_W =
            if is_finite(&self.force_on_user_W) { self.force_on_user_W } else { Vector3::zeros() };
        let torque_on_user_W =
            if is_finite(&self.torque_on_user_W) { self.torque_on_user_W } else { Vector3::zeros() };
        FingerOutput {
            force_on_user_W,
            torque_on_user_W,
            god_object_W: primary.god_object_W,
            entity: Some(primary.entity),
            feature: primary.feature,
            friction: primary.friction.into(),
        }
    }
}

fn free(hip_W: Vector3<f64>) -> FingerOutput {
    FingerOutput {
        force_on_user_W: Vector3::zeros(),
        torque_on_user_W: Vector3::zeros(),
        god_object_W: hip_W,
        entity: None,
        feature: Feature::None,
        friction: ContactState::Free,
    }
}
