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

mod finger;
mod last_line;
mod near;
mod objects;
mod ordered;
mod watched;

pub use finger::DeviceFinger;
pub use last_line::Cut;
pub use objects::{HandFinger, Objects};
pub use ordered::{FADE_S, Hold, MOST_CALLED, MOST_SHARE};
pub use watched::EventTeller;

use crate::displaced::Placed;
use crate::lists_end::ListsEnd;
use crate::mount::Mount;
use crate::passive_port::{PassivePort, Rendering, Tick};
use crate::row::{BodyRow, Row};
use crate::slow_thread::SlowRemains;
use finger::{World, finite_or_zero};
use haptics::passivity::Passivity;
use haptics::{Door, Effects, Entity, Field, FingerEffects, Guide, Hip, Moment, Passage, RAMP_IN_S};
use last_line::{LastLine, Line};
use nalgebra::Vector3;
use near::Near;
use physics::{Begins, Body, BodyError, Manipulation, Room, Wanted};
use shm_abi::MAX_DEVICES;
use shm_abi::frame::DEVICE_POSITION_VALID;
use shm_abi::{Command, Frame};
use std::time::Duration;
use world::Layout;
use world::lists::{Handed, ListSettings, Lists, SlowList};

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
    /// Ticks of the run before those that frames count.
    offset_ticks: u64,
    last_tick: Option<u64>,
    driver_estimates: bool,
    /// Where each finger's tip was in its device's base (m), if that was known.
    tips_D: Vec<Option<[f64; 3]>>,
    /// How far each finger was carried through the world since the last tick (m): no device's velocity tells of it.
    carried_W: Vec<Vector3<f64>>,
    /// What keeps each finger passive, if anything does.
    passive_ports: Vec<Option<PassivePort>>,
    /// Of each finger.
    lines: Vec<LastLine>,
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
        let passive_ports = fingers.iter().map(|_| None).collect();
        let passages = vec![Passage::new(&[]); fingers.len()];
        let lines = fingers.iter().map(|own| LastLine::new(&own.finger)).collect();
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
            offset_ticks: 0,
            last_tick: None,
            driver_estimates: false,
            tips_D,
            carried_W,
            passive_ports,
            lines,
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
        let broad_phase = self.objects.manipulation.broad_phase();
        self.objects = if bodies.len() <= lists.fast_bodies {
            let begins = Begins { broad_phase: Some(broad_phase), ..Begins::default() };
            let manipulation = Manipulation::begin(&self.entities, bodies, settings, begins)?;
            Objects::new(manipulation, hand, wants_quality, self.period_s)
        } else {
            let Lists { fast, hand_over, slow } =
                Lists::among(&self.entities, bodies, settings, lists, broad_phase)?;
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

    /// Whether an entity moves.
    pub fn is_body(&self, entity: usize) -> bool {
        self.objects.manipulation().is_body(entity)
    }

    /// Frames count their ticks from here on in the run: of a driver that was restarted.
    pub fn count_from(&mut self, offset_ticks: u64) {
        self.offset_ticks = offset_ticks;
    }

    /// Its world takes over in this tick of the run.
    pub fn begin_at(&mut self, run_tick: u64) {
        self.objects.begin_at(run_tick);
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

    /// Entities that are no bodies and that somebody moves, as the last tick began; what is told once stays there.
    pub fn placed(&self) -> &[Placed] {
        self.objects.placed()
    }

    /// The entities that were parked in the last tick, because they left the world or were lost.
    pub fn parked_now(&self) -> &[physics::Parked] {
        self.objects.parked_now()
    }

    /// Whether there was more at a finger's place in the last tick than it has room for.
    pub fn is_crowded(&self) -> bool {
        self.near.iter().any(Near::is_crowded)
    }

    /// Room for contacts between entities that it should get before long ([`Manipulation::wanted_room`]).
    pub fn wanted_room(&self) -> Option<Wanted> {
        self.objects.manipulation.wanted_room()
    }

    /// Takes it ([`Manipulation::take_room`]).
    pub fn take_room(&mut self, room: Room) -> Room {
        self.objects.manipulation.take_room(room, &self.entities)
    }

    /// Makes and takes it, where a tick has no deadline.
    pub fn make_room(&mut self) {
        self.objects.manipulation.make_room(&self.entities);
    }

    /// Number of times that contacts between entities had no room so far, in the fast list.
    pub fn left_out(&self) -> u64 {
        self.objects.left_out()
    }

    /// Number of pairs of entities near each other in the fast list, and how many have room.
    pub fn pairs(&self) -> [usize; 2] {
        let manipulation = &self.objects.manipulation;
        [manipulation.pair_count(), manipulation.pair_room()]
    }

    /// What was cut from forces in the last tick, because nothing moved for it.
    pub fn cuts(&self) -> impl Iterator<Item = Cut> {
        let fingers = self.fingers.iter().zip(&self.lines).enumerate();
        fingers.flat_map(|(finger, (own, line))| {
            let leapt = own.finger.contacts().filter(|contact| contact.leapt);
            let leaps = leapt.map(move |contact| {
                let entity = Some(contact.entity as u32);
                Cut { finger, entity, force_n: contact.missing_n }
            });
            leaps.chain(line.cuts(finger))
        })
    }

    /// Of each finger, whether it felt less in the last tick than it pressed with, since what stopped it had not been handed over,
    /// or waited for its turn.
    pub fn gives_way(&self) -> &[bool] {
        &self.objects.gives_way
    }

    /// Time that the slow list's turn took in the last tick: no time of the fast step.
    pub fn slow_turn(&self) -> Duration {
        self.objects.slow_turn
    }

    /// From now on no more of what moves than this is stepped in a tick here ([`Manipulation::step_at_most`]).
    pub fn step_at_most(&mut self, bodies: usize) {
        self.objects.most_stepped = bodies;
    }

    /// What moving the entities took in the last tick.
    pub fn made(&self) -> physics::Made {
        self.objects.made
    }

    /// With fingers whose forces do not feed energy into the hand, one for each finger; `None`: as rendered.
    #[must_use]
    pub fn with_passivities(mut self, passivities: impl IntoIterator<Item = Option<Passivity>>) -> Self {
        for ((own, given), finger) in self.passive_ports.iter_mut().zip(passivities).zip(&self.fingers) {
            *own = given.map(|passivity| PassivePort::new(passivity, finger.finger.capacity()));
        }
        self
    }

    /// Number of devices that its fingers need.
    pub fn devices(&self) -> usize {
        self.fingers.iter().map(|finger| finger.device + 1).max().unwrap_or(0)
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
        let run_tick = row.run_tick.saturating_add(self.offset_ticks);
        self.objects.reach(&mut self.entities, reaches, run_tick);
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
        self.objects.note(&self.entities);
        if frame.run_tick >= 0 {
            let (entities, felt) = (&mut self.entities, &self.finger_effects);
            self.objects.step(entities, &self.fingers, felt, &mut row.fingers, dt_s);
        } else {
            self.objects.has_not_stepped();
        }
        self.objects.let_go(&self.entities, frame.run_tick >= 0);
        let tick = Tick::new(frame, dt_s);
        let guards = self.passive_ports.iter_mut().zip(&mut self.lines);
        let states = all_carried_W.iter().zip(self.finger_effects.iter().zip(guards));
        for (index, ((finger, row), (carried_W, (felt, (port, line))))) in
            self.fingers.iter().zip(&mut row.fingers).zip(states).enumerate()
        {
            let Some(device) = devices.get(finger.device) else {
                line.reset();
                continue;
            };
            row.force_on_user = finite_or_zero(row.force_on_user * self.strength);
            row.torque_on_user = finite_or_zero(row.torque_on_user * self.strength);
            let of = Line {
                index,
                finger: &finger.finger,
                felt,
                strength: self.strength,
                left_n: self.passages[index].begun_n(),
                dt_s,
                hip_W: row.hip,
            };
            row.force_on_user =
                finite_or_zero(line.hold(row.force_on_user, &of, &mut self.objects, &self.entities));
            if let Some(port) = port {
                let wanted_W = row.force_on_user;
                let of = Rendering { finger, felt, strength: self.strength };
                port.keep(&of, device, *carried_W, &tick, row);
                self.objects.owe(index, row.force_on_user - wanted_W, finger, felt);
            }
            command.devices[finger.device].force_on_user_n = finger.mount.force_to_device(row.force_on_user);
        }
        for (finger, entity, most_n) in self.objects.shortened() {
            self.fingers[finger].finger.shorten(entity, most_n);
        }
        for (finger, entity) in self.objects.given_up() {
            self.fingers[finger].finger.forget(entity);
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

    /// Distance of a fingertip from a point of the world (m), at most; `None` where no tip is known, as before a first frame.
    pub fn farthest_m(&self, place_W: &Vector3<f64>) -> Option<f64> {
        let both = self.fingers.iter().zip(&self.tips_D);
        let tips = both.filter_map(|(finger, tip_D)| Some(finger.mount.point_to_world((*tip_D)?)));
        tips.map(|tip_W| (tip_W - place_W).norm()).reduce(f64::max)
    }

    /// Forgets all contacts: the connection to the devices was lost meanwhile.
    pub fn reset(&mut self) {
        self.last_tick = None;
        self.tips_D.fill(None);
        self.carried_W.fill(Vector3::zeros());
        for finger in &mut self.fingers {
            finger.finger.reset();
        }
        self.passive_ports.iter_mut().flatten().for_each(PassivePort::reset);
        self.lines.iter_mut().for_each(LastLine::reset);
        self.finger_effects.iter_mut().for_each(FingerEffects::reset);
        self.passages.iter_mut().for_each(Passage::reset);
    }
}

/// How fast the devices may be carried through the world while a finger touches: a hand's own fastest.
const MOST_CARRIED_M_PER_S: f64 = 1.0;

#[cfg(test)]
mod beside;
#[cfg(test)]
mod carried;
#[cfg(test)]
mod cut;
#[cfg(test)]
mod damped;
#[cfg(test)]
mod passive;
