//! One finger in contact with a tree of shapes, or near it: free space and the god-object's states of Melder fig. 9.4.
//!
//! Model: free, the HIP's path is followed through the patches nearby. In contact, the god-object holds or walks; beside it
//! walks its shadow, the frictionless god-object, as on meshes: while the shadow is held back, so is the finger.
//!
//! Frames: the solid's own, B.
//! Invariant: between two ticks the finger's path never enters the solid unnoticed.
//! Cost: free and far, two distances; else see [`super::walk`], twice with friction.

use nalgebra::Vector3;

use super::Csg;
use super::god::{Clearing, God};
use super::hit::first_hit;
use super::near::Neighbourhood;
use super::pressed_through::holds_outside;
use super::stand::{RELEASE, stand};
use super::walk::walk;
use super::way_out::way_out;
use crate::algorithm::{Touch, TouchInput};
use crate::friction::Friction;
use crate::friction_cone::{ConeForce, ConeInput, answer};
use crate::friction_law::{FrictionLaw, FrictionMemory, FrictionQuery, FrictionState, MEMORY_WORDS};
use crate::grip::{Grip, Pull};
use crate::mesh::Beginning;
use crate::slide::{Slid, Slider};
use crate::surface::SurfacePoint;

/// State of one finger towards one tree.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct CsgCone {
    /// Which tree the rest is about.
    csg: Option<u64>,
    touching: Option<Touching>,
    /// What is near a free finger.
    near: Option<Neighbourhood>,
}

/// A contact.
#[derive(Debug, Clone, Copy)]
struct Touching {
    god_object: God,
    normal_B: Vector3<f64>,
    /// The frictionless god-object; the same place where there is no friction.
    shadow: God,
    grip: Grip,
}

impl CsgCone {
    /// One tick; `None` while the finger is free.
    pub(crate) fn update(&mut self, csg: &Csg, input: &TouchInput<'_>) -> Option<(Touch, Beginning)> {
        if input.finger_radius_m != 0.0 {
            return None;
        }
        if self.csg != Some(csg.identity) {
            *self = Self { csg: Some(csg.identity), ..Self::default() };
        }
        let mut beginning = Beginning::Came;
        let touching = match &mut self.touching {
            Some(touching) => touching,
            None => {
                let (god, how) = self.meet(csg, input.previous_hip_B.as_ref(), &input.cone.hip_B)?;
                beginning = how;
                self.touching.insert(Touching::new(god))
            }
        };
        let before = [touching.shadow.clearing, touching.god_object.clearing];
        match touching.update(csg, input.friction, &input.cone) {
            Some(force) => {
                touching.look_ahead(csg, &before);
                let god_object = SurfacePoint {
                    point_B: touching.god_object.point_B,
                    normal_B: touching.normal_B,
                    feature: touching.god_object.feature(csg),
                    piece: touching.god_object.piece(),
                };
                let friction = touching.grip.state;
                let ConeForce { force_on_user_B, normal_force_n, .. } = force;
                Some((Touch { god_object, force_on_user_B, normal_force_n, friction }, beginning))
            }
            None => {
                self.touching = None;
                None
            }
        }
    }

    /// Ends the contact.
    pub(crate) fn let_go(&mut self) {
        if self.touching.is_some() {
            *self = Self::default();
        }
    }

    /// Free-space to primitive: where the path enters the solid, or the nearest way out of it.
    fn meet(
        &mut self,
        csg: &Csg,
        previous_hip_B: Option<&Vector3<f64>>,
        hip_B: &Vector3<f64>,
    ) -> Option<(God, Beginning)> {
        let found_inside = || way_out(csg, hip_B).map(|god| (god, Beginning::WasInside));
        let Some(from_B) = previous_hip_B else {
            return if csg.is_inside(hip_B) { found_inside() } else { None };
        };
        let length_m = (hip_B - from_B).norm();
        let near = match self.near.filter(|near| near.holds(from_B, length_m)) {
            Some(near) => near,
            None => {
                let clear_m = csg.signed_distance(from_B);
                let wish_m = clear_m.max(LARGER * length_m).max(COMMON * csg.extent_m);
                *self.near.insert(Neighbourhood::amid(csg, from_B, wish_m))
            }
        };
        if near.is_empty() && near.holds(from_B, length_m) {
            return None;
        }
        if let Some(hit) = first_hit(csg, &near, near.sides(csg, from_B), from_B, hip_B) {
            return Some((God::hit(&hit), Beginning::Came));
        }
        let is_inside =
            if near.holds(hip_B, 0.0) { near.is_solid(near.sides(csg, hip_B)) } else { csg.is_inside(hip_B) };
        if !is_inside {
            return None;
        }
        // Let go on the surface by rounding, it comes back to the contact that it had.
        let was_on_surface = csg.signed_distance(from_B).abs() <= RELEASE * csg.extent_m;
        let how = if was_on_surface { Beginning::Came } else { Beginning::WasInside };
        way_out(csg, hip_B).map(|god| (god, how))
    }
}

impl Touching {
    fn new(god: God) -> Self {
        Self { god_object: god, normal_B: Vector3::y(), shadow: god, grip: Grip::default() }
    }

    fn update(&mut self, csg: &Csg, friction: &Friction, input: &ConeInput) -> Option<ConeForce> {
        if matches!(friction, Friction::None) {
            let walked = walk_freely(csg, &mut self.god_object, input)?;
            self.shadow = self.god_object;
            self.grip.state = FrictionState::Slip;
            return Some(self.answer(&walked, input));
        }
        walk_freely(csg, &mut self.shadow, input)?;
        let stood = stand(csg, &mut self.god_object, input)?;
        let view = &stood.view;
        let pull = self.grip.begin_tick(view, input);
        if let Some(tangential_B) = self.grip.hold(friction, view, &pull, input) {
            return Some(self.answer(&Slid { view: stood.view, tangential_B, rounds: 0 }, input));
        }
        let slider = Slider {
            friction,
            memory: &self.grip.memory,
            pull: &pull,
            input,
            start_B: self.god_object.point_B,
        };
        let mut slid = walk(csg, &mut self.god_object, stood, &slider)?;
        slid.tangential_B += self.grip.drag(friction, &slid.tangential_B, &slid.view, &pull, input);
        Some(self.answer(&slid, input))
    }

    /// In a tick in which both have stayed in their clearings one of them, if it must soon, looks around: so that it need not in
    /// a tick that leads around an edge.
    #[inline(always)]
    fn look_ahead(&mut self, csg: &Csg, before: &[Clearing; 2]) {
        if !self.shadow.clearing.is_around(&before[0]) || !self.god_object.clearing.is_around(&before[1]) {
            return;
        }
        if self.god_object.sees_an_end() {
            self.god_object.look_ahead(csg);
        } else if self.shadow.sees_an_end() {
            self.shadow.look_ahead(csg);
        }
    }

    fn answer(&mut self, slid: &Slid, input: &ConeInput) -> ConeForce {
        self.normal_B = slid.view.normal_B;
        answer(&slid.view, &slid.tangential_B, slid.rounds, input)
    }
}

/// The frictionless god-object; `None` if the finger is free.
#[inline(always)]
fn walk_freely(csg: &Csg, god: &mut God, input: &ConeInput) -> Option<Slid> {
    let stood = stand(csg, god, input)?;
    let slider = Slider {
        friction: &Frictionless,
        memory: &NOTHING,
        pull: &Pull::default(),
        input,
        start_B: god.point_B,
    };
    let slid = walk(csg, god, stood, &slider)?;
    holds_outside(csg, god, &slid.view, input).then_some(slid)
}

/// [`Friction::None`] without its name being looked up.
struct Frictionless;

impl FrictionLaw for Frictionless {
    fn holds(&self, _query: &FrictionQuery, _memory: &mut FrictionMemory) -> bool {
        false
    }

    fn slide(&self, query: &FrictionQuery, _memory: &FrictionMemory) -> f64 {
        query.gap_m
    }

    fn held_limit_m(&self, _query: &FrictionQuery, _memory: &FrictionMemory) -> f64 {
        0.0
    }
}

const NOTHING: FrictionMemory = FrictionMemory { words: [0.0; MEMORY_WORDS] };
/// A neighbourhood is asked for this much larger than a tick's path, at least.
const LARGER: f64 = 1.5;
/// Radius of a common neighbourhood, in terms of the extent.
const COMMON: f64 = 0.02;
