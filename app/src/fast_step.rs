//! One tick of haptic rendering: from the driver's frame to the command that answers it.
//!
//! Model: each finger's HIP is taken into the world, steps against the entities, and its force goes back
//! into its device's base frame. Damping goes by the driver's estimate of the HIP's velocity; a driver of before
//! 1.1 gives none, and then by the difference of its positions. What is felt beside contacts (fields, guides, magnets,
//! vibration) is added to their force. Entities that move are moved by these forces ([`Objects`]) and give way to them; fields
//! and guides are the world's, and push nothing but fingers. The same step serves all three clocks.
//!
//! Frames and signs: forces are forces on the user.
//! Invariants: no allocation, clock, lock or panic; the command answers the frame's tick; a device whose
//! position is not valid gets zero force and forgets its contacts.
//! Cost: linear in what is near a finger or moves; what is neither costs nothing.

#![allow(non_snake_case)] // Frames are capital letters: tip_D is the tip in D.

mod near;
mod objects;
mod watched;

pub use objects::{HandFinger, Objects};
pub use watched::EventTeller;

use crate::lists_end::ListsEnd;
use crate::mount::Mount;
use crate::passive_port::{Tick, keep_passive};
use crate::row::{BodyRow, FingerRow, Row};
use crate::slow_thread::SlowRemains;
use haptics::passivity::Passivity;
use haptics::{
    Door, Effects, Entity, Felt, Field, Finger, FingerEffects, Guide, Hip, Moment, Passage, RAMP_IN_S,
};
use nalgebra::{Isometry3, Vector3};
use near::Near;
use physics::{Body, BodyError, Manipulation};
use shm_abi::MAX_DEVICES;
use shm_abi::frame::{DEVICE_ORIENTATION_MEASURED, DEVICE_POSITION_VALID};
use shm_abi::{Command, DeviceFrame, Frame};
use world::Layout;
use world::lists::{Handed, ListSettings, Lists, Reach, SlowList};

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

/// The state of rendering from tick to tick.
pub struct FastStep {
    fingers: Vec<DeviceFinger>,
    entities: Vec<Entity>,
    /// Those that move, and where all are.
    objects: Objects,
    /// Of each finger, what it could touch.
    near: Vec<Near>,
    effects: Effects,
    /// Of each finger.
    finger_effects: Vec<FingerEffects>,
    period_s: f64,
    last_tick: Option<u64>,
    driver_estimates: bool,
    /// Where each finger's tip was in its device's base (m), if that was known.
    tips_D: Vec<Option<[f64; 3]>>,
    /// How far each finger was carried through the world since the last tick (m): no device's velocity tells of it.
    carried_W: Vec<Vector3<f64>>,
    /// What keeps each finger passive, if anything does.
    passivities: Vec<Option<Passivity>>,
    /// How much of the forces is felt, 0 to 1.
    strength: f64,
    doors: Vec<Door>,
    /// Of each finger.
    passages: Vec<Passage>,
}

/// The first minor version of the shared-memory contract whose frames tell velocities.
const MINOR_WITH_VELOCITIES: u32 = 1;

impl FastStep {
    /// Fingers that have touched nothing yet.
    pub fn new(fingers: Vec<DeviceFinger>, entities: Vec<Entity>, period_ns: u64) -> Self {
        let (tips_D, carried_W) = (vec![None; fingers.len()], vec![Vector3::zeros(); fingers.len()]);
        let period_s = period_ns as f64 / 1e9;
        let passivities = vec![None; fingers.len()];
        let passages = vec![Passage::new(&[]); fingers.len()];
        // Each made anew: a clone of a list without entries has no room.
        let near = fingers.iter().map(|_| Near::new(entities.len())).collect();
        let objects = Objects::new(Manipulation::of_none(&entities), &[], false, period_s);
        Self {
            fingers,
            entities,
            objects,
            near,
            effects: Effects::default(),
            finger_effects: Vec::new(),
            period_s,
            last_tick: None,
            driver_estimates: false,
            tips_D,
            carried_W,
            passivities,
            strength: 1.0,
            doors: Vec::new(),
            passages,
        }
        .with_effects(Vec::new(), Vec::new())
    }

    /// With these fields and guides beside the entities, and what the entities' surfaces do.
    #[must_use]
    pub fn with_effects(mut self, fields: Vec<Field>, guides: Vec<Guide>) -> Self {
        self.effects = Effects::new(fields, guides, &self.entities);
        self.finger_effects = vec![FingerEffects::new(&self.effects); self.fingers.len()];
        self
    }

    /// With doors that fingers go through.
    #[must_use]
    pub fn with_doors(mut self, doors: Vec<Door>) -> Self {
        self.passages.fill(Passage::new(&doors));
        self.doors = doors;
        self
    }

    /// With entities that move, held by fingers that are this (one for each). `wants_quality`: each tick is to tell how
    /// they are grasped.
    ///
    /// # Errors
    /// What [`Manipulation::new`] refuses.
    pub fn with_objects(
        mut self,
        bodies: &[(usize, Body)],
        settings: physics::Settings,
        lists: ListSettings,
        hand: &[HandFinger],
        wants_quality: bool,
    ) -> Result<Self, BodyError> {
        self.objects = if bodies.len() <= lists.fast_bodies {
            let manipulation = Manipulation::new(&self.entities, bodies, settings)?;
            Objects::new(manipulation, hand, wants_quality, self.period_s)
        } else {
            let Lists { fast, hand_over, slow } = Lists::new(&self.entities, bodies, settings, lists)?;
            Objects::new(fast, hand, wants_quality, self.period_s).with_lists(hand_over, slow)
        };
        Ok(self)
    }

    /// The slow list, to be stepped by another thread; see [`Objects::take_slow`].
    pub fn take_slow(&mut self) -> Option<SlowList> {
        self.objects.take_slow()
    }

    /// Ends the two lists, of which the slow one is given by who [took](Self::take_slow) it; `None` where there is no slow list.
    pub fn end_lists(&mut self, slow: Option<SlowRemains>) -> Option<ListsEnd> {
        self.objects.end_lists(&mut self.entities, slow)
    }

    /// How many bodies are in the fast list, and what has been handed over; `None` where there is no slow list.
    pub fn handed(&self) -> Option<(usize, Handed)> {
        self.objects.handed()
    }

    /// All entities.
    pub fn entities(&self) -> &[Entity] {
        &self.entities
    }

    /// The entities that move, as the last tick began.
    pub fn bodies(&self) -> &[BodyRow] {
        self.objects.rows()
    }

    /// Those of [`Self::bodies`] that are not as they were a tick before.
    pub fn changed_bodies(&self) -> &[u32] {
        self.objects.changed()
    }

    /// The entities that were parked in the last tick, because they left the world or were lost.
    pub fn parked_now(&self) -> &[physics::Parked] {
        self.objects.parked_now()
    }

    /// What moving the entities took in the last tick.
    pub fn made(&self) -> physics::Made {
        self.objects.made
    }

    /// With fingers whose forces do not feed energy into the hand, one for each finger; `None`: as rendered.
    #[must_use]
    pub fn with_passivities(mut self, passivities: impl IntoIterator<Item = Option<Passivity>>) -> Self {
        for (own, given) in self.passivities.iter_mut().zip(passivities) {
            *own = given;
        }
        self
    }

    /// Which minor version of the contract the driver speaks, and over how many ticks it lets forces come on.
    ///
    /// Until that is told, nothing is expected of it that 1.0 did not have. A finger that is found inside an entity
    /// when a run begins has its whole force before the driver lets all of it through: so a run's first row is like
    /// its others.
    pub fn meet_driver(&mut self, abi_minor: u32, ramp_in_ticks: u64) {
        self.driver_estimates = abi_minor >= MINOR_WITH_VELOCITIES;
        let ramp_in_s = (0.5 * ramp_in_ticks as f64 * self.period_s).min(RAMP_IN_S);
        for finger in &mut self.fingers {
            // No product of an integer and a period is out of range.
            let _ = finger.finger.set_ramp_in(ramp_in_s);
        }
        for felt in &mut self.finger_effects {
            let _ = felt.set_ramp_in(ramp_in_s);
        }
    }

    /// How much of the forces is felt from the next tick on, 0 to 1; objects get all of them.
    pub fn set_strength(&mut self, strength: f64) {
        self.strength = strength;
    }

    /// In the next tick this entity goes to this pose; `false`: it is a body, or nothing here moves it.
    pub fn drive(&mut self, entity: usize, to_W: Isometry3<f64>) -> bool {
        self.objects.drive(entity, to_W)
    }

    /// Whether [`Self::drive`] moves an entity, when not too many are driven at once.
    pub fn can_drive(&self, entity: usize) -> bool {
        self.objects.can_drive(entity)
    }

    /// How many times the stiffness and damping of an entity fingers feel.
    pub fn felt(&self, entity: usize) -> Option<[f64; 2]> {
        self.entities.get(entity).map(|entity| [entity.felt.stiffness, entity.felt.damping])
    }

    /// Changes that, from the next tick on.
    pub fn set_felt(&mut self, entity: usize, [stiffness, damping]: [f64; 2]) {
        if let Some(entity) = self.entities.get_mut(entity) {
            entity.felt = Felt { stiffness, damping };
        }
    }

    /// How much the contacts of a finger pressed in the last tick, all together (N); of the finger for which that is most.
    pub fn touch_load_n(&self) -> f64 {
        let of_finger = |finger: &DeviceFinger| -> f64 {
            finger.finger.contacts().map(|contact| contact.force_on_user_W.norm()).sum()
        };
        self.fingers.iter().map(of_finger).fold(0.0, f64::max)
    }

    /// Renders a frame into the command that answers it, and into a row.
    pub fn step(&mut self, frame: &Frame, command: &mut Command, row: &mut Row) {
        // Ticks that the driver skipped, or that were missed here, are time that passed all the same.
        let ticks = self.last_tick.map_or(1, |last| frame.tick.saturating_sub(last).max(1));
        self.last_tick = Some(frame.tick);
        let dt_s = ticks as f64 * self.period_s;
        row.run_tick = frame.run_tick.max(0).unsigned_abs();
        let devices = frame.present_devices();
        let moment = Moment { t_s: row.run_tick as f64 * self.period_s, dt_s };
        let reaches =
            self.fingers.iter().zip(&self.tips_D).filter_map(|(finger, last_D)| {
                finger.reach(devices.get(finger.device)?, last_D.as_ref(), dt_s)
            });
        self.objects.reach(&mut self.entities, reaches);
        let world = World { entities: &self.entities, doors: &self.doors, objects: &self.objects };
        let mut all_carried_W = [Vector3::zeros(); MAX_DEVICES];
        let moved = self.tips_D.iter_mut().zip(&mut self.carried_W).zip(&mut all_carried_W);
        let own = self.near.iter_mut().zip(&mut self.passages);
        let states = moved.zip(self.finger_effects.iter_mut().zip(own));
        for ((finger, row), (((tip_D, carried_W), was_carried_W), (felt, own))) in
            self.fingers.iter_mut().zip(&mut row.fingers).zip(states)
        {
            let Some(device) = devices.get(finger.device) else {
                felt.reset();
                continue;
            };
            let is_valid = device.flags & DEVICE_POSITION_VALID != 0;
            *tip_D = is_valid.then_some(device.position_m_measured);
            *was_carried_W = std::mem::take(carried_W);
            let velocity_W = self.driver_estimates.then(|| finger.velocity_W(device, *was_carried_W / dt_s));
            *row = finger.step(device, &world, own, dt_s, velocity_W);
            if !self.effects.is_empty() {
                let hip = is_valid.then_some(Hip { position_W: row.hip, velocity_W });
                row.force_on_user += finger.feel(felt, &self.effects, &self.entities, hip, moment);
            }
        }
        self.objects.note();
        if frame.run_tick >= 0 {
            let (entities, felt) = (&mut self.entities, &self.finger_effects);
            self.objects.step(entities, &self.fingers, felt, &mut row.fingers, dt_s);
        }
        self.objects.let_go(&self.entities, frame.run_tick >= 0);
        let tick = Tick::new(frame, &self.entities, dt_s);
        let states = all_carried_W.iter().zip(self.finger_effects.iter().zip(&mut self.passivities));
        for ((finger, row), (carried_W, (felt, passivity))) in
            self.fingers.iter().zip(&mut row.fingers).zip(states)
        {
            let Some(device) = devices.get(finger.device) else { continue };
            row.force_on_user = finite_or_zero(row.force_on_user * self.strength);
            row.torque_on_user = finite_or_zero(row.torque_on_user * self.strength);
            if let Some(passivity) = passivity {
                keep_passive(passivity, finger, felt, device, *carried_W, &tick, row);
            }
            command.devices[finger.device].force_on_user_n = finger.mount.force_to_device(row.force_on_user);
        }
    }

    /// Adds what the motors were made to render to the row of the tick before `next`.
    pub fn complete(&self, row: &mut Row, next: &Frame) {
        let devices = next.present_devices();
        for (finger, row) in self.fingers.iter().zip(&mut row.fingers) {
            if let Some(device) = devices.get(finger.device) {
                row.applied_on_user = finger.mount.force_to_world(device.force_on_user_n_applied);
            }
        }
    }

    /// Takes the devices' placements from a layout, between two ticks: the camera that they are attached to has
    /// moved. Says whether it did.
    ///
    /// A finger that touches feels the move as one of its own hand, and its contacts live on: the god-objects stay
    /// where they are on their surfaces, and friction drags or holds. That only holds for moves that a hand could make
    /// in a tick. A finger put further would be pulled back by a spring of any length, or be through a thin wall; so
    /// while any finger touches, a layout that moves one of them by more than `MOST_CARRIED_M_PER_S` allows is refused
    /// as a whole (the devices' places relative to each other are the calibration and may not change on the way), and
    /// the caller offers one that is nearer. If none touches, any layout is taken; after a far move nobody is swept
    /// through what lies between: the next step is a first one.
    pub fn set_layout(&mut self, layout: &Layout) -> bool {
        let mount_of = |finger: &DeviceFinger| Mount::placed(&layout.placement(finger.device));
        let carried = |finger: &DeviceFinger, tip_D: &Option<[f64; 3]>| {
            let (to, from) = (mount_of(finger), finger.mount);
            tip_D.map_or(Vector3::zeros(), |tip_D| to.point_to_world(tip_D) - from.point_to_world(tip_D))
        };
        let both = self.fingers.iter().zip(&self.tips_D);
        let furthest_m = both.map(|(finger, tip_D)| carried(finger, tip_D).norm()).fold(0.0, f64::max);
        let is_near = furthest_m <= MOST_CARRIED_M_PER_S * self.period_s;
        let touches = self.fingers.iter().any(|finger| finger.finger.contacts().next().is_some());
        if touches && !is_near {
            return false;
        }
        let known = self.tips_D.iter().zip(&mut self.carried_W).zip(&mut self.finger_effects);
        for (finger, ((tip_D, carried_W), felt)) in self.fingers.iter_mut().zip(known) {
            *carried_W += carried(finger, tip_D);
            finger.mount = mount_of(finger);
            if !is_near {
                finger.finger.reset();
                felt.reset();
            }
        }
        if !is_near {
            self.passages.iter_mut().for_each(Passage::reset);
        }
        true
    }

    /// Forgets all contacts: the connection to the devices was lost meanwhile.
    pub fn reset(&mut self) {
        self.last_tick = None;
        self.tips_D.fill(None);
        self.carried_W.fill(Vector3::zeros());
        for finger in &mut self.fingers {
            finger.finger.reset();
        }
        self.passivities.iter_mut().flatten().for_each(Passivity::reset);
        self.finger_effects.iter_mut().for_each(FingerEffects::reset);
        self.passages.iter_mut().for_each(Passage::reset);
    }
}

/// What fingers step against.
struct World<'a> {
    entities: &'a [Entity],
    doors: &'a [Door],
    objects: &'a Objects,
}

/// How fast the devices may be carried through the world while a finger touches: a hand's own fastest.
const MOST_CARRIED_M_PER_S: f64 = 1.0;

impl DeviceFinger {
    /// The device's own velocity, and that with which it is carried (m/s). A device that stands still passes every bit
    /// through.
    fn velocity_W(&self, device: &DeviceFrame, carried_W: Vector3<f64>) -> Vector3<f64> {
        let own_W = self.mount.velocity_to_world(device.velocity_m_per_s_estimated);
        if carried_W == Vector3::zeros() { own_W } else { own_W + carried_W }
    }

    /// Where it is and how fast it moves; by its last position `last_D`, if that is known.
    fn reach(&self, device: &DeviceFrame, last_D: Option<&[f64; 3]>, dt_s: f64) -> Option<Reach> {
        if device.flags & DEVICE_POSITION_VALID == 0 {
            return None;
        }
        let hip_W = self.mount.point_to_world(device.position_m_measured);
        let from_W = last_D.map_or(hip_W, |last_D| self.mount.point_to_world(*last_D));
        Some(Reach { hip_W, velocity_W: (hip_W - from_W) / dt_s, radius_m: self.finger.radius_m() })
    }

    fn step(
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
            let near = near.update(around, finger.space(), &from, &hip, finger.radius_m());
            finger.step_near(entities, near, Hip { position_W: hip, velocity_W }, dt_s)
        };
        let moves = |entity| objects.manipulation().is_body(entity);
        let (output, _) = passage.step(&mut self.finger, (entities, doors), dt_s, moves, step);
        FingerRow {
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
}

impl DeviceFinger {
    /// The force of what is felt beside contacts (N); nothing without a `hip`.
    fn feel(
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

/// The driver refuses a command that is not finite as a whole; zero for one finger is milder.
fn finite_or_zero(force: Vector3<f64>) -> Vector3<f64> {
    if force.iter().all(|component| component.is_finite()) { force } else { Vector3::zeros() }
}

#[cfg(test)]
mod beside;

#[cfg(test)]
mod damped {
    use super::*;
    use bytemuck::Zeroable;
    use haptics::Plane;
    use nalgebra::UnitQuaternion;

    const PERIOD_NS: u64 = 1_000_000;
    const K: f64 = 1000.0;
    const B: f64 = 5.0;

    /// A finger over a damped floor, its device upside down.
    fn step() -> FastStep {
        let floor = Entity::new(Plane::new(Vector3::y(), 0.0).unwrap(), Isometry3::identity(), K);
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), std::f64::consts::PI);
        let finger = DeviceFinger {
            finger: Finger::new(0.0, 1).unwrap().with_ramp_in(0.0).unwrap(),
            device: 0,
            mount: Mount::new(Isometry3::from_parts(Vector3::zeros().into(), turn)),
        };
        FastStep::new(vec![finger], vec![floor.unwrap().with_damping(B).unwrap()], PERIOD_NS)
    }

    /// The force upwards (N) at this height (m), told to rise at this speed (m/s) in the world.
    fn force(step: &mut FastStep, tick: u64, height: f64, rising: f64) -> f64 {
        let mut frame = Frame::zeroed();
        (frame.tick, frame.device_count) = (tick, 1);
        frame.devices[0].flags = DEVICE_POSITION_VALID;
        // The device stands on its head.
        frame.devices[0].position_m_measured[1] = -height;
        frame.devices[0].velocity_m_per_s_estimated[1] = -rising;
        let mut command = Command::zero(tick, 1, 1);
        step.step(&frame, &mut command, &mut Row::empty());
        -command.devices[0].force_on_user_n[1]
    }

    #[test]
    fn every_finger_feels_the_floor() {
        let floor = Entity::new(Plane::new(Vector3::y(), 0.0).unwrap(), Isometry3::identity(), K);
        let finger = |device| DeviceFinger {
            finger: Finger::new(0.0, 1).unwrap().with_ramp_in(0.0).unwrap(),
            device,
            mount: Mount::new(Isometry3::identity()),
        };
        let mut step = FastStep::new((0..3).map(finger).collect(), vec![floor.unwrap()], PERIOD_NS);
        let mut frame = Frame::zeroed();
        (frame.tick, frame.device_count) = (1, 3);
        for device in &mut frame.devices[..3] {
            device.flags = DEVICE_POSITION_VALID;
            device.position_m_measured[1] = -1e-3;
        }
        let mut command = Command::zero(1, 1, 3);
        step.step(&frame, &mut command, &mut Row::empty());
        // A product of two numbers.
        assert!(
            command.devices[..3].iter().all(|device| (device.force_on_user_n[1] - K * 1e-3).abs() < 1e-15)
        );
    }

    #[test]
    fn damping_goes_by_what_the_driver_estimates_however_many_ticks_were_missed() {
        let mut step = step();
        step.meet_driver(2, 0);
        force(&mut step, 1, -1e-3, 0.0);
        for tick in [2, 3, 10] {
            // A sum of numbers near 1; the turn by pi leaves 1e-16 of each axis in the others.
            assert!((force(&mut step, tick, -1e-3, -0.1) - (K * 1e-3 + B * 0.1)).abs() < 1e-12);
        }
    }

    #[test]
    fn a_driver_that_tells_no_velocities_is_not_taken_for_one_at_rest() {
        let mut step = step();
        step.meet_driver(0, 0);
        force(&mut step, 1, -1.0e-3, 0.0);
        assert!((force(&mut step, 2, -1.1e-3, 0.0) - (K * 1.1e-3 + B * 0.1)).abs() < 1e-12);
        let after_a_gap = force(&mut step, 12, -2.1e-3, 0.0);
        assert!((after_a_gap - (K * 2.1e-3 + B * 0.1)).abs() < 1e-12, "1 mm in ten ticks");
        step.meet_driver(1, 0);
        assert!((force(&mut step, 13, -2.2e-3, 0.0) - K * 2.2e-3).abs() < 1e-12, "1.1 tells");
    }
}

#[cfg(test)]
mod passive {
    use super::*;
    use bytemuck::Zeroable;
    use haptics::Plane;
    use haptics::passivity::PassivitySpec;
    use nalgebra::UnitQuaternion;

    const PERIOD_NS: u64 = 1_000_000;
    const K: f64 = 1000.0;

    /// A finger over a floor, its device upside down, kept passive by a bound of 1 uJ.
    fn step() -> FastStep {
        let floor = Entity::new(Plane::new(Vector3::y(), 0.0).unwrap(), Isometry3::identity(), K).unwrap();
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), std::f64::consts::PI);
        let finger = DeviceFinger {
            finger: Finger::new(0.0, 1).unwrap().with_ramp_in(0.0).unwrap(),
            device: 0,
            mount: Mount::new(Isometry3::from_parts(Vector3::zeros().into(), turn)),
        };
        let spec = PassivitySpec::for_motion(1e-3, 0.0, 0.0).with_bound(1e-6);
        let spec = PassivitySpec { device_friction_n: 0.0, ..spec };
        FastStep::new(vec![finger], vec![floor], PERIOD_NS)
            .with_passivities([Passivity::new(spec, 1e-3).ok()])
    }

    /// The finger at this height (m), where motors held this force upwards (N), of the command of that tick.
    fn feel(
        step: &mut FastStep,
        tick: u64,
        height: f64,
        applied: f64,
        command_tick: u64,
    ) -> (FingerRow, f64) {
        let mut frame = Frame::zeroed();
        (frame.tick, frame.device_count) = (tick, 1);
        (frame.previous.authority, frame.previous.command_tick) = (1.0, command_tick);
        frame.devices[0].flags = DEVICE_POSITION_VALID;
        frame.devices[0].position_m_measured[1] = -height;
        frame.devices[0].force_on_user_n_applied[1] = -applied;
        let (mut command, mut row) = (Command::zero(tick, 1, 1), Row::empty());
        step.step(&frame, &mut command, &mut row);
        (row.fingers[0], -command.devices[0].force_on_user_n[1])
    }

    #[test]
    fn what_counts_is_the_force_that_the_motors_held_and_the_command_is_what_is_left() {
        let mut step = step();
        feel(&mut step, 1, 1e-3, 0.0, 0);
        let (pressed, commanded) = feel(&mut step, 2, -1e-3, 0.0, 1);
        assert_eq!((pressed.energy_j, pressed.controlled_n), (0.0, 0.0));
        assert!((commanded - 1.0).abs() < 1e-12, "pressed in by 2 mm a tick, it takes energy: {commanded}");
        // It wanted a newton, of which the driver let 0.4 N through; out by half a millimetre.
        let (released, commanded) = feel(&mut step, 3, -0.5e-3, 0.4, 2);
        assert!((released.energy_j - 0.2e-3).abs() < 1e-15, "{released:?}");
        // More than the bound: nothing is left of 0.5 N.
        assert_eq!((commanded, released.force_on_user), (0.0, Vector3::zeros()));
        assert!((released.controlled_n - 0.5).abs() < 1e-12, "{released:?}");
    }

    #[test]
    fn a_device_that_is_carried_does_no_work_and_one_that_is_lost_moved_nowhere() {
        let mut step = step();
        feel(&mut step, 1, -1e-3, 0.0, 0);
        feel(&mut step, 2, -1e-3, 1.0, 1);
        let camera = Isometry3::translation(0.0, 0.5e-3, 0.0);
        let text = "master = 0\nattached_to = \"camera\"\n[[device]]\norientation_wxyz = [0, 0, 0, 1]\n";
        let layout = Layout::parse(text, std::path::Path::new("l.toml")).unwrap();
        assert!(step.set_layout(&layout.with_camera(camera)));
        assert!(feel(&mut step, 3, -1e-3, 1.0, 2).0.energy_j.abs() < 1e-15);
        let mut lost = Frame::zeroed();
        (lost.tick, lost.device_count) = (4, 1);
        step.step(&lost, &mut Command::zero(4, 1, 1), &mut Row::empty());
        assert!(feel(&mut step, 5, -0.2e-3, 1.0, 4).0.energy_j.abs() < 1e-15);
    }

    #[test]
    fn a_driver_that_writes_a_tick_late_is_told_from_one_that_does_not() {
        // It comes out by 0.5 mm a tick and wants 0.5 N. Of a microjoule that makes 2 mN; but where the newton of the tick
        // before is still to come, that alone may feed half a millijoule.
        for (late, left) in [(0, 2e-3), (1, 0.0)] {
            let mut step = step();
            feel(&mut step, 2, 1e-3, 0.0, 1 - late);
            feel(&mut step, 3, -1e-3, 0.0, 2 - late);
            let (_, commanded) = feel(&mut step, 4, -0.5e-3, 0.0, 3 - late);
            // The margin of the multiplier.
            assert!((commanded - left).abs() < 1e-8, "{late}: {commanded}");
        }
    }
}

#[cfg(test)]
mod carried {
    use super::*;
    use bytemuck::Zeroable;
    use haptics::{Friction, Plane, Shape};
    use std::path::Path;

    const PERIOD_NS: u64 = 1_000_000;

    /// Two fingers 0.1 m apart over a table with much friction, attached to the camera.
    fn step_and_layout() -> (FastStep, Layout) {
        let text = "master = 0\nattached_to = \"camera\"\n[[device]]\n[[device]]\nposition_m = [0.1, 0, 0]\n";
        let layout = Layout::parse(text, Path::new("l.toml")).unwrap();
        let table: Shape = Plane::new([0.0, 1.0, 0.0].into(), 0.0).unwrap().into();
        let table = Entity::new(table, Isometry3::identity(), 1000.0).unwrap();
        let table = table.with_friction(Friction::Coulomb { mu: 2.0 }).unwrap();
        let finger = |device| DeviceFinger {
            finger: Finger::new(0.0, 1).unwrap().with_ramp_in(0.0).unwrap(),
            device,
            mount: Mount::placed(&layout.placement(device)),
        };
        (FastStep::new(vec![finger(0), finger(1)], vec![table], PERIOD_NS), layout)
    }

    fn frame(tick: u64, tip_D: [f64; 3]) -> Frame {
        let mut frame = Frame::zeroed();
        (frame.tick, frame.device_count) = (tick, 2);
        for device in &mut frame.devices[..2] {
            (device.flags, device.position_m_measured) = (DEVICE_POSITION_VALID, tip_D);
        }
        frame
    }

    fn feel(step: &mut FastStep, tick: u64, tip_D: [f64; 3]) -> Row {
        let (mut command, mut row) = (Command::zeroed(), Row::empty());
        step.step(&frame(tick, tip_D), &mut command, &mut row);
        row
    }

    const ABOVE: [f64; 3] = [0.0, 0.01, 0.0];
    const INSIDE: [f64; 3] = [0.0, -0.005, 0.0];

    fn at(x: f64, y: f64) -> Isometry3<f64> {
        Isometry3::translation(x, y, 0.0)
    }

    #[test]
    fn a_camera_that_moves_like_a_hand_carries_touching_fingers_along_and_keeps_their_contacts() {
        let (mut step, layout) = step_and_layout();
        feel(&mut step, 1, ABOVE);
        let before = feel(&mut step, 2, INSIDE).fingers[0];
        let mut row = Row::empty();
        for tick in 1..=4 {
            assert!(step.set_layout(&layout.clone().with_camera(at(tick as f64 * 0.9e-3, 0.0))));
            row = feel(&mut step, 2 + tick, INSIDE);
        }
        for (index, finger) in row.fingers[..2].iter().enumerate() {
            let x = index as f64 * 0.1;
            // A sum of two numbers of about 0.1.
            assert!((finger.hip.x - x - 3.6e-3).abs() < 1e-15);
            // mu d = 10 mm: the god-object sticks where the finger came in, and the spring of 3.6 mm is felt.
            assert!((finger.god_object.x - x).abs() < 1e-15, "{finger:?}");
            // 1000 N/m, depth 5 mm.
            assert!((finger.force_on_user - Vector3::new(-3.6, 5.0, 0.0)).norm() < 1e-12, "{finger:?}");
        }
        assert_eq!(before.god_object.y, row.fingers[0].god_object.y);
    }

    #[test]
    fn a_finger_that_is_carried_into_a_damped_table_is_damped() {
        let (step, layout) = step_and_layout();
        let damped = step.entities[0].clone().with_damping(5.0).unwrap();
        let mut step = FastStep::new(step.fingers, vec![damped], PERIOD_NS);
        step.meet_driver(MINOR_WITH_VELOCITIES, 0);
        feel(&mut step, 1, ABOVE);
        feel(&mut step, 2, INSIDE);
        assert!(step.set_layout(&layout.with_camera(at(0.0, -0.5e-3))));
        // 0.5 m/s downwards, though the device says that it rests: 2.5 N beside the spring's 5.5 N; then it does rest.
        for (tick, force) in [(3, 8.0), (4, 5.5)] {
            let row = feel(&mut step, tick, INSIDE);
            assert!((row.fingers[0].force_on_user.y - force).abs() < 1e-12, "{:?}", row.fingers[0]);
        }
    }

    #[test]
    fn a_jump_is_refused_while_a_finger_touches_and_changes_nothing() {
        let (mut step, layout) = step_and_layout();
        feel(&mut step, 1, ABOVE);
        let before = feel(&mut step, 2, INSIDE);
        assert!(!step.set_layout(&layout.with_camera(at(0.0, 0.5))));
        assert_eq!(feel(&mut step, 3, INSIDE).fingers[..2], before.fingers[..2]);
    }

    #[test]
    fn a_jump_in_free_space_sweeps_nobody_through_the_table() {
        let (mut step, layout) = step_and_layout();
        feel(&mut step, 1, ABOVE);
        // To 0.3 m aside and 3 mm into the table. Swept, the finger would have come in near x = 0.23, and the spring
        // to there would be felt; as a first step it comes in straight above.
        assert!(step.set_layout(&layout.with_camera(at(0.3, -0.013))));
        let finger = feel(&mut step, 2, ABOVE).fingers[0];
        assert!((finger.hip - Vector3::new(0.3, -0.003, 0.0)).norm() < 1e-15);
        assert!((finger.force_on_user - Vector3::new(0.0, 3.0, 0.0)).norm() < 1e-12, "{finger:?}");
    }
}
