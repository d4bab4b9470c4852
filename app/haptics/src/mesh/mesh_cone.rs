//! The Friction Cone Algorithm on a mesh: one finger in contact with it, or near it.
//!
//! Model: free, the HIP's path is cast against the mesh each tick, unless it is known that nothing is near. In contact,
//! the god-object holds or walks. Beside it walks its shadow, the frictionless god-object: while the shadow is held
//! back, so is the finger; when it is free, the finger is round the corner, and friction must not hold it.
//!
//! Frames: the mesh's own, B.
//! Invariant: between two ticks the finger's path never crosses the mesh unnoticed, also where rounding put its end on
//! the wrong side.
//! Limit: a god-object does not see other parts that overlap its own. Let go inside of one, a finger is found there, by
//! the face nearest to it, or if that face is of another part, by one of its own part.
//! Cost: free and far, one comparison; free and near, one query of the hierarchy; in contact, independent of the mesh; let go or
//! found inside, some bounded queries more.

use nalgebra::Vector3;
use std::cell::Cell;

use super::Mesh;
use super::draw::{Against, Frictionless};
use super::place::Place;
use super::walk::{Walked, stand, walk};
use crate::friction::Friction;
use crate::friction_cone::{ConeForce, ConeInput, answer};
use crate::friction_law::{FrictionMemory, FrictionState};
use crate::grip::Grip;
use crate::surface::SurfacePoint;

/// State of one finger towards one mesh.
#[derive(Debug, Clone, Copy, Default)]
pub struct MeshCone {
    /// Which mesh the rest is about: indices of another one would lead nowhere.
    mesh: Option<u64>,
    touching: Option<Touching>,
    /// Where the HIP was in the last tick.
    last_hip_B: Option<Vector3<f64>>,
    clear: Clear,
}

/// A contact.
#[derive(Debug, Clone, Copy)]
struct Touching {
    god_object: Place,
    normal_B: Vector3<f64>,
    /// The frictionless god-object; the same place where there is no friction.
    shadow: Place,
    grip: Grip,
}

/// A ball around a place that no face reaches into.
#[derive(Debug, Clone, Copy)]
struct Clear {
    centre_B: Vector3<f64>,
    radius_m: f64,
}

/// How a finger came to touch a mesh.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Beginning {
    /// It touched already, or came from outside.
    Came,
    /// It was found inside.
    WasInside,
}

impl MeshCone {
    /// One tick; `None` while the finger is free. `previous_hip_B` is where the HIP was, taken through the pose that
    /// the mesh had then.
    #[inline(never)]
    pub fn update(
        &mut self,
        mesh: &Mesh,
        friction: &Friction,
        previous_hip_B: Option<Vector3<f64>>,
        input: &ConeInput,
    ) -> Option<(ConeForce, Beginning)> {
        let mesh_here = Some(mesh.identity);
        if self.mesh != mesh_here {
            *self = Self { mesh: mesh_here, ..Self::default() };
        }
        let last_hip_B = self.last_hip_B.replace(input.hip_B);
        let mut beginning = Beginning::Came;
        if self.touching.is_none() {
            let (place, how) = self.meet(mesh, previous_hip_B, last_hip_B, &input.hip_B)?;
            beginning = how;
            self.touching = Some(Touching::new(place));
        }
        match self.touching.as_mut()?.update(mesh, friction, input) {
            Some(force) => Some((force, beginning)),
            None => self.pass_on(mesh, friction, input),
        }
    }

    /// Let go by one of two parts that overlap, it may be inside the other, whose faces it never came through.
    #[cold]
    fn pass_on(
        &mut self,
        mesh: &Mesh,
        friction: &Friction,
        input: &ConeInput,
    ) -> Option<(ConeForce, Beginning)> {
        self.touching = None;
        // The one that is nearest may be of a surface that cuts through itself, and lead out of it again.
        for way_out in mesh.ways_out(&input.hip_B) {
            let mut touching = Touching::new(Place::nearest(&way_out));
            if let Some(force) = touching.update(mesh, friction, input) {
                self.touching = Some(touching);
                return Some((force, Beginning::WasInside));
            }
        }
        None
    }

    /// Whether a contact lives.
    pub fn is_touching(&self) -> bool {
        self.touching.is_some()
    }

    /// Ends a contact whose force nobody can use: the next tick is as a first one.
    pub(crate) fn let_go(&mut self) {
        if self.is_touching() {
            *self = Self::default();
        }
    }

    /// Friction is another one from now on, to which what the last one remembered means nothing.
    pub(crate) fn forget_friction(&mut self) {
        if let Some(touching) = &mut self.touching {
            touching.grip.memory = FrictionMemory::default();
        }
    }

    /// Where the god-object is, with the normal and the feature there.
    pub fn god_object(&self) -> Option<SurfacePoint> {
        self.touching.as_ref().map(|touching| SurfacePoint {
            point_B: touching.god_object.point_B,
            normal_B: touching.normal_B,
            feature: touching.god_object.feature(),
            piece: touching.god_object.face(),
        })
    }

    /// Whether friction holds it.
    pub fn state(&self) -> FrictionState {
        self.touching.as_ref().map_or(FrictionState::Stick, |touching| touching.grip.state)
    }

    #[inline(never)]
    fn meet(
        &mut self,
        mesh: &Mesh,
        previous_hip_B: Option<Vector3<f64>>,
        last_hip_B: Option<Vector3<f64>>,
        hip_B: &Vector3<f64>,
    ) -> Option<(Place, Beginning)> {
        // A mesh that was placed elsewhere was not met on the way there.
        let is_elsewhere = |from_B: &Vector3<f64>| {
            last_hip_B.is_none_or(|last_B| (from_B - last_B).amax() > SAME_PLACE * mesh.extent_m())
        };
        let Some(from_B) = previous_hip_B.filter(|from_B| !is_elsewhere(from_B)) else {
            self.clear = Clear::default();
            let way_out = mesh.ways_out(hip_B).next()?;
            return Some((Place::nearest(&way_out), Beginning::WasInside));
        };
        if self.clear.has(&from_B) && self.clear.has(hip_B) {
            return None;
        }
        if let Some(hit) = mesh.first_hit(&from_B, hip_B) {
            return Some((Place::hit(&hit), Beginning::Came));
        }
        self.clear = Clear { centre_B: *hip_B, radius_m: mesh.clearance(hip_B, mesh.extent_m()) };
        None
    }
}

impl Touching {
    fn new(place: Place) -> Self {
        Self { god_object: place, normal_B: Vector3::y(), shadow: place, grip: Grip::default() }
    }

    #[inline(always)]
    fn update(&mut self, mesh: &Mesh, friction: &Friction, input: &ConeInput) -> Option<ConeForce> {
        if matches!(friction, Friction::None) {
            let here = stand(mesh, self.god_object, input)?;
            let walked = walk(mesh, here, &Frictionless, input)?;
            self.shadow = walked.place;
            self.grip.state = FrictionState::Slip;
            return Some(self.answer(&walked, input));
        }
        let shadow = stand(mesh, self.shadow, input)?;
        self.shadow = walk(mesh, shadow, &Frictionless, input)?.place;
        // Held in a corner by a face that the HIP has left, it would be held by what is not in its way.
        let (place, view) = stand(mesh, self.god_object.anew(), input)?;
        let pull = self.grip.begin_tick(&view, input);
        if let Some(tangential_B) = self.grip.hold(friction, &view, &pull, input) {
            return Some(self.answer(&Walked { place, view, tangential_B, changes: 0 }, input));
        }
        let slides_with = Cell::new(None);
        let draw = Against { friction, memory: &self.grip.memory, pull: &pull, input, slides_with };
        let mut walked = walk(mesh, (place, view), &draw, input)?;
        walked.tangential_B += self.grip.drag(friction, &walked.tangential_B, &walked.view, &pull, input);
        Some(self.answer(&walked, input))
    }

    fn answer(&mut self, walked: &Walked, input: &ConeInput) -> ConeForce {
        self.god_object = walked.place;
        self.normal_B = walked.view.normal_B;
        answer(&walked.view, &walked.tangential_B, walked.changes, input)
    }
}

impl Default for Clear {
    /// A ball without a point in it: nothing is known.
    fn default() -> Self {
        Self { centre_B: Vector3::zeros(), radius_m: -1.0 }
    }
}

impl Clear {
    fn has(&self, point_B: &Vector3<f64>) -> bool {
        self.radius_m > 0.0 && (point_B - self.centre_B).norm_squared() < self.radius_m * self.radius_m
    }
}

/// Positions that differ by less than this share of the mesh are the same, seen through two equal poses.
const SAME_PLACE: f64 = 1e-9;
