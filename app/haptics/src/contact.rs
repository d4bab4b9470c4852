//! One finger against one entity: begins, updates and ends the contact.
//!
//! Model: a contact begins where the HIP's path enters the material, both ends taken through the pose the entity had at
//! the time: a moving entity must not sweep past a resting finger. It lives until the frictionless god-object is free:
//! the HIP is outside, and was not pressed right through a thin part. A HIP that is inside without having entered
//! (first tick, entity placed over it) begins at the nearest surface point, with the force ramped in.
//!
//! Frames: in and out in W; the god-object lives in B and so travels with the entity.
//! Invariant: whatever is not finite ends the contact with zero force.
//! Cost: one friction cone update when inside, one signed distance when not.

use nalgebra::Vector3;

use crate::algorithm::{Algorithm, ContactAlgorithm, ContactMemory, Touch, TouchInput};
use crate::balls::Balls;
use crate::classic_god_object::ClassicGodObject;
use crate::contact_stiffness::ContactStiffness;
use crate::csg::CsgCone;
use crate::entity::Entity;
use crate::face_materials::FeltMaterial;
use crate::frame::{is_finite, point_into_body, point_into_world, vector_into_body, vector_into_world};
use crate::friction::Friction;
use crate::friction_cone::{ConeInput, FrictionCone};
use crate::friction_law::{FrictionLaw, FrictionState};
use crate::height_map::{FeltHeight, Over};
use crate::hip::Hip;
use crate::mesh::{BallOnMesh, Beginning, Mesh, MeshCone};
use crate::nurbs::NurbsCone;
use crate::onset::Onset;
use crate::shading::{Following, Shading};
use crate::shape::Shape;
use crate::surface::{Feature, Surface};
use crate::touch_points::TouchPoints;
use crate::vector_field::VectorField;

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
    /// Of a mesh's face on which it was when the tick began: what friction and damping go by
    /// ([`Entity::felt_material`]).
    pub label: u16,
    /// Stiffness in this tick \[N/m\].
    pub stiffness_n_per_m: f64,
    /// Whether it holds or slides.
    pub friction: FrictionState,
    /// Whether the god-object is farther from the HIP than a tick ago by more than finger and entity have moved: the force
    /// is cut to what that explains, and comes on with what they move.
    pub leapt: bool,
    /// How much was cut in the tick in which it leapt \[N\].
    pub missing_n: f64,
    /// By how much the force can have changed since the last tick for what finger and entity moved, and for what the entity
    /// is made of \[N\]; on top of that a force may fall, and turn as it does.
    pub explained_n: f64,
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
pub(crate) struct Sweep<'h> {
    pub(crate) previous_hip_W: Option<Vector3<f64>>,
    pub(crate) hip: &'h Hip,
    pub(crate) finger_radius_m: f64,
    pub(crate) ramp_in_s: f64,
    pub(crate) dt_s: f64,
}

/// A finger's place for one entity.
#[derive(Debug, Clone, Default)]
pub(crate) struct Slot {
    cone: Option<FrictionCone>,
    mesh: MeshCone,
    /// Of a ball; large, and points have none but on what they [roll](crate::mesh::Mesh::point_radius_m) over.
    balls: Option<Box<Balls>>,
    csg: CsgCone,
    nurbs: NurbsCone,
    own: ContactMemory,
    /// Whose state is kept.
    kept: Kept,
    /// Whether anything was noted here since it was new.
    is_used: bool,
    onset: Onset,
    /// Of the mesh's face that the god-object is on.
    label: u16,
    stiffness: ContactStiffness,
    following: Following,
    height: FeltHeight,
    /// The most that dampers made of the force in the last tick (N).
    damped_n: f64,
    /// Inside, but above a dent of the entity's height map: nothing is felt, and nothing begins anew.
    hovers: bool,
    pub(crate) contact: Option<Contact>,
}

/// Parts of a slot that the beginning of a contact changes.
struct Before {
    mesh: MeshCone,
    on_mesh: Option<BallOnMesh>,
    own: ContactMemory,
    kept: Kept,
    onset: Onset,
}

impl Before {
    fn of(slot: &Slot) -> Self {
        let on_mesh = slot.balls.as_ref().map(|balls| balls.on_mesh);
        Self { mesh: slot.mesh, on_mesh, own: slot.own, kept: slot.kept, onset: slot.onset }
    }

    fn restore(self, slot: &mut Slot) {
        (slot.mesh, slot.own, slot.kept, slot.onset) = (self.mesh, self.own, self.kept, self.onset);
        if let (Some(balls), Some(on_mesh)) = (&mut slot.balls, self.on_mesh) {
            balls.on_mesh = on_mesh;
        }
    }
}

/// Whoever looked after the contact in the last tick. The others know nothing of what happened since they did, and so
/// keep nothing.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
enum Kept {
    #[default]
    Nobodys,
    Surface,
    Mesh,
    Rolling,
    RollingOnCsg,
    Csg,
    Nurbs,
    Own,
}

/// A contact that begins inside reaches its whole force after this time \[s\]: slow enough that no hand is thrown, and
/// shorter than the driver's own ramp, so that a run's first tick is not weaker than its last.
pub const RAMP_IN_S: f64 = 0.1;

impl Slot {
    pub(crate) fn step(&mut self, index: usize, entity: &Entity, sweep: &Sweep<'_>) -> Option<&Contact> {
        self.is_used = true;
        self.contact = self.touch(index, entity, sweep);
        if !self.has_met() {
            self.let_go();
            self.following.reset();
            self.height.reset();
        }
        self.contact.as_ref()
    }

    fn let_go(&mut self) {
        match self.kept {
            Kept::Nobodys | Kept::Own => {}
            Kept::Surface => self.cone = None,
            Kept::Mesh => self.mesh.let_go(),
            Kept::Rolling => {
                if let Some(balls) = &mut self.balls {
                    balls.on_mesh.let_go();
                }
            }
            Kept::RollingOnCsg => {
                if let Some(balls) = &mut self.balls {
                    balls.on_csg.let_go();
                }
            }
            Kept::Csg => self.csg.let_go(),
            Kept::Nurbs => self.nurbs.let_go(),
        }
    }

    /// Forgets the contact with another kind of shape that the entity had: it may be met again where that one was left.
    #[inline(always)]
    fn keep(&mut self, kept: Kept) {
        if self.kept != kept {
            self.keep_other(kept);
        }
    }

    #[cold]
    #[inline(never)]
    fn keep_other(&mut self, kept: Kept) {
        self.let_go();
        self.kept = kept;
    }

    /// For a finger of this radius.
    pub(crate) fn new(finger_radius_m: f64) -> Self {
        let balls = (finger_radius_m > 0.0).then(Box::default);
        Self { balls, ..Self::default() }
    }

    /// Takes what a point rolls with, or gives it back.
    pub(crate) fn balls_mut(&mut self) -> &mut Option<Box<Balls>> {
        &mut self.balls
    }

    /// Forgets everything, if there is anything to forget.
    pub(crate) fn vacate(&mut self) {
        if self.is_used {
            let mut balls = self.balls.take();
            if let Some(balls) = &mut balls {
                **balls = Balls::default();
            }
            *self = Self { balls, ..Self::default() };
        }
    }

    /// The contact goes on with no more than this force (N).
    pub(crate) fn shorten(&mut self, most_n: f64) {
        if let Some(contact) = &self.contact {
            self.onset.shorten(most_n / contact.stiffness_n_per_m);
        }
    }

    /// Where the finger touches the entity, in this tick.
    pub(crate) fn touch_points(&self, entity: &Entity, finger_radius_m: f64) -> TouchPoints {
        let Some(contact) = &self.contact else { return TouchPoints::NONE };
        let rolls = self.balls.as_ref().filter(|balls| balls.is_touching());
        match rolls {
            Some(balls) => TouchPoints::of_shares(balls.shares(), entity, contact, self.onset.share()),
            None => TouchPoints::single(contact, finger_radius_m),
        }
    }

    /// Whether it goes on from the last tick.
    pub(crate) fn has_met(&self) -> bool {
        self.contact.is_some() || self.hovers
    }

    /// Nothing touches.
    fn part(&mut self) -> Option<Contact> {
        self.hovers = false;
        None
    }

    fn touch(&mut self, index: usize, entity: &Entity, sweep: &Sweep<'_>) -> Option<Contact> {
        let hip_B = point_into_body(&entity.X_WB, &sweep.hip.position_W);
        if !is_finite(&hip_B) {
            return self.part();
        }
        let previous_B = sweep.previous_hip_W.map(|p_W| point_into_body(&entity.previous_X_WB, &p_W));
        let previous_B = previous_B.filter(is_finite);
        if entity.face_materials.is_some() {
            self.touch_labelled(index, entity, sweep, (hip_B, previous_B))
        } else {
            let material = entity.felt_material(0);
            self.touch_of(index, entity, sweep, (hip_B, previous_B), &material)
        }
    }

    /// Of a mesh of several materials.
    #[inline(never)]
    fn touch_labelled(
        &mut self,
        index: usize,
        entity: &Entity,
        sweep: &Sweep<'_>,
        way: (Vector3<f64>, Option<Vector3<f64>>),
    ) -> Option<Contact> {
        let begins = !self.has_met();
        // Where a contact begins, the face that is met says what is felt: nobody knows before.
        let before = begins.then(|| Before::of(self));
        let label = self.label;
        let own = entity.felt_material(label);
        if begins {
            self.stiffness = ContactStiffness::new(own.stiffness_n_per_m);
        }
        let mut material = own;
        let along_m = self.way_along_m(entity, &way);
        material.stiffness_n_per_m = self.stiffness.step(own.stiffness_n_per_m, along_m, sweep.dt_s);
        let contact = self.touch_again(index, entity, sweep, way, &material)?;
        if self.label == label {
            return Some(contact);
        }
        let Some(before) = before else {
            self.forget_friction();
            return Some(contact);
        };
        before.restore(self);
        let material = entity.felt_material(self.label);
        self.stiffness = ContactStiffness::new(material.stiffness_n_per_m);
        self.touch_again(index, entity, sweep, way, &material)
    }

    /// Not inlined twice.
    #[inline(never)]
    fn touch_again(
        &mut self,
        index: usize,
        entity: &Entity,
        sweep: &Sweep<'_>,
        way: (Vector3<f64>, Option<Vector3<f64>>),
        material: &FeltMaterial<'_>,
    ) -> Option<Contact> {
        self.touch_of(index, entity, sweep, way, material)
    }

    /// Way of the finger along the surface since the last tick (m).
    fn way_along_m(&self, entity: &Entity, way: &(Vector3<f64>, Option<Vector3<f64>>)) -> f64 {
        let (Some(previous_B), Some(contact)) = (way.1, &self.contact) else { return 0.0 };
        let way_B = way.0 - previous_B;
        let normal_B = vector_into_body(&entity.X_WB, &contact.normal_W);
        (way_B - normal_B * normal_B.dot(&way_B)).norm()
    }

    fn forget_friction(&mut self) {
        match self.kept {
            Kept::Mesh => self.mesh.forget_friction(),
            Kept::Rolling => {
                if let Some(balls) = &mut self.balls {
                    balls.on_mesh.forget_friction();
                }
            }
            _ => {}
        }
    }

    #[inline(always)]
    fn touch_of(
        &mut self,
        index: usize,
        entity: &Entity,
        sweep: &Sweep<'_>,
        (hip_B, previous_B): (Vector3<f64>, Option<Vector3<f64>>),
        material: &FeltMaterial<'_>,
    ) -> Option<Contact> {
        // Nobody else looks at it.
        let is_asked_for = material.damping_n_s_per_m != 0.0 || entity.algorithm != Algorithm::FrictionCone;
        let cone = ConeInput {
            hip_B,
            hip_velocity_B: if is_asked_for {
                hip_velocity(entity, hip_B, previous_B, sweep)
            } else {
                Vector3::zeros()
            },
            stiffness_n_per_m: material.stiffness_n_per_m,
            damping_n_s_per_m: material.damping_n_s_per_m,
            dt_s: sweep.dt_s,
        };
        let lift_m = match &entity.height_map {
            Some(height_map) => height_map.lift_m(&entity.shape, sweep.finger_radius_m),
            None => {
                self.hovers = false;
                0.0
            }
        };
        let rolls_m = match (&entity.algorithm, &entity.shape) {
            (Algorithm::FrictionCone, Shape::Mesh(mesh)) if self.balls.is_some() => mesh.point_radius_m(),
            _ => 0.0,
        };
        let input = TouchInput {
            shape: entity.shape_for(sweep.finger_radius_m),
            // Above a dent nothing holds the god-object back.
            friction: if self.hovers { &Friction::None } else { material.friction },
            finger_radius_m: (sweep.finger_radius_m + lift_m).max(rolls_m),
            previous_hip_B: previous_B,
            cone,
        };
        // Apart from the others, whose answers take as long to copy as this one to find.
        let is_point = input.finger_radius_m == 0.0;
        if let (Algorithm::FrictionCone, Shape::Mesh(mesh), true) =
            (&entity.algorithm, &entity.shape, is_point)
        {
            let Some(touch) = self.touch_mesh(mesh, &input) else { return self.part() };
            return self.feel(index, entity, touch, &input, (sweep, material));
        }
        let Some(touch) = self.touch_by_any(entity, &input) else { return self.part() };
        self.feel(index, entity, touch, &input, (sweep, material))
    }

    #[inline(never)]
    fn touch_by_any(&mut self, entity: &Entity, input: &TouchInput<'_>) -> Option<Touch> {
        match &entity.algorithm {
            Algorithm::FrictionCone => self.touch_shape(input),
            Algorithm::VectorField => self.touch_by(&VectorField, input),
            Algorithm::ClassicGodObject => self.touch_by(&ClassicGodObject, input),
            Algorithm::Own(algorithm) => self.touch_by(&**algorithm, input),
        }
    }

    fn touch_by(&mut self, algorithm: &dyn ContactAlgorithm, input: &TouchInput<'_>) -> Option<Touch> {
        self.keep(Kept::Own);
        let begins = !self.has_met();
        if begins {
            self.own = ContactMemory::default();
        }
        let touch = algorithm.touch(input, &mut self.own)?;
        if begins {
            self.onset = if input.entry().is_some() { Onset::AT_ONCE } else { Onset::INSIDE };
        }
        Some(touch)
    }

    fn touch_shape(&mut self, input: &TouchInput<'_>) -> Option<Touch> {
        match input.shape {
            Shape::Form(form) if input.finger_radius_m == 0.0 => self.touch_surface(form, input),
            Shape::Form(form) => self.touch_surface(&form.grown(input.finger_radius_m)?, input),
            Shape::Own(surface) if input.finger_radius_m == 0.0 => self.touch_surface(&**surface, input),
            Shape::Own(_) => input.of_surface(|grown| self.touch_surface(grown, input))?,
            Shape::Mesh(mesh) => {
                self.keep(Kept::Rolling);
                let touched = self.balls.as_mut()?.on_mesh.update(&**mesh, input);
                self.begun(touched)
            }
            Shape::Nurbs(nurbs) => {
                self.keep(Kept::Nurbs);
                let touched = self.nurbs.update(nurbs, input);
                self.begun(touched)
            }
            Shape::Csg(csg) if input.finger_radius_m != 0.0 => {
                self.keep(Kept::RollingOnCsg);
                let touched = self.balls.as_mut()?.on_csg.update(csg, input);
                self.begun(touched)
            }
            Shape::Csg(csg) => {
                self.keep(Kept::Csg);
                let touched = self.csg.update(csg, input);
                self.begun(touched)
            }
        }
    }

    #[inline(always)]
    fn touch_mesh(&mut self, mesh: &Mesh, input: &TouchInput<'_>) -> Option<Touch> {
        self.keep(Kept::Mesh);
        let was_touching = self.mesh.is_touching();
        let (force, beginning) = self.mesh.update(mesh, input.friction, input.previous_hip_B, &input.cone)?;
        match beginning {
            Beginning::WasInside => self.onset = Onset::INSIDE,
            Beginning::Came if !was_touching => self.onset = Onset::AT_ONCE,
            Beginning::Came => {}
        }
        Some(Touch {
            god_object: self.mesh.god_object()?,
            force_on_user_B: force.force_on_user_B,
            normal_force_n: force.normal_force_n,
            friction: self.mesh.state(),
        })
    }

    fn touch_surface<S: Surface + ?Sized>(&mut self, surface: &S, input: &TouchInput<'_>) -> Option<Touch> {
        self.keep(Kept::Surface);
        let distance_m = surface.signed_distance(&input.cone.hip_B);
        let cone = match &mut self.cone {
            Some(cone) => cone,
            None => {
                let entry = |from_B| surface.entry(&from_B, &input.cone.hip_B);
                let entered = input.previous_hip_B.and_then(entry);
                if entered.is_none() && (distance_m > 0.0 || distance_m.is_nan()) {
                    return None;
                }
                self.onset = if entered.is_some() { Onset::AT_ONCE } else { Onset::INSIDE };
                let at = entered.unwrap_or_else(|| surface.nearest(&input.cone.hip_B));
                self.cone.insert(FrictionCone::new(at))
            }
        };
        // Not a number is outside, too.
        let is_inside = distance_m <= 0.0;
        if !is_inside && !cone.is_held_back(surface, &input.cone) {
            return None;
        }
        let force = cone.update(surface, input.friction, &input.cone);
        Some(Touch {
            god_object: *cone.god_object(),
            force_on_user_B: force.force_on_user_B,
            normal_force_n: force.normal_force_n,
            friction: cone.state(),
        })
    }

    /// Takes note of how a contact began.
    fn begun(&mut self, touched: Option<(Touch, Beginning)>) -> Option<Touch> {
        let (touch, beginning) = touched?;
        match beginning {
            Beginning::WasInside => self.onset = Onset::INSIDE,
            Beginning::Came if !self.has_met() => self.onset = Onset::AT_ONCE,
            Beginning::Came => {}
        }
        Some(touch)
    }

    /// A contact that began inside comes on slowly.
    #[inline(always)]
    fn feel(
        &mut self,
        index: usize,
        entity: &Entity,
        mut touch: Touch,
        input: &TouchInput<'_>,
        (sweep, material): (&Sweep<'_>, &FeltMaterial<'_>),
    ) -> Option<Contact> {
        let label = self.label;
        let share = self.onset.share_of(&touch, input, [sweep.dt_s, sweep.ramp_in_s]);
        let regained_n = self.stiffness.regained_n(input.way_m());
        let spring_n = input.cone.stiffness_n_per_m * input.way_m() + regained_n;
        let share =
            if entity.face_materials.is_some() { share * self.share_of_faces(&touch, input) } else { share };
        let is_rolling_point =
            sweep.finger_radius_m == 0.0 && input.finger_radius_m > 0.0 && entity.height_map.is_none();
        let share = if is_rolling_point { share * let_down(&mut touch, input) } else { share };
        let is_plain = self.onset.came_on_n() == 0.0 && entity.is_plain(material);
        let mut explained_n =
            if is_plain { spring_n } else { self.explained_n(entity, material, &touch, input, spring_n) };
        // Apart, so that a touch that stays as it is stays in registers.
        if !matches!(entity.shading, Shading::None) || entity.height_map.is_some() {
            let (shaded, raised_n) =
                self.shade_and_raise(entity, touch, sweep, (input.cone.stiffness_n_per_m, input.way_m()))?;
            touch = shaded;
            explained_n += raised_n;
        }
        if share != 1.0 {
            touch.force_on_user_B *= share;
            touch.normal_force_n *= share;
        }
        in_world(index, entity, &touch, &self.onset, (explained_n, label, input.cone.stiffness_n_per_m))
    }

    /// What a change of the force is explained by, if not by the spring's end alone, which moved by so much force (N).
    #[inline(never)]
    fn explained_n(
        &mut self,
        entity: &Entity,
        material: &FeltMaterial<'_>,
        touch: &Touch,
        input: &TouchInput<'_>,
        spring_n: f64,
    ) -> f64 {
        let cone = &input.cone;
        let force_n = touch.force_on_user_B.norm();
        // A damper answers to both velocities, since it is silent where the spring is relaxed.
        // What is dragged is along the surface, and only where friction is rendered.
        let drags = material.friction.drags() && entity.algorithm == Algorithm::FrictionCone;
        let across_n = (force_n * force_n - touch.normal_force_n * touch.normal_force_n).max(0.0).sqrt();
        let dragged_n = if drags { across_n } else { 0.0 };
        let damped_n = cone.damping_n_s_per_m * cone.hip_velocity_B.norm() + dragged_n;
        let damped_n = damped_n + std::mem::replace(&mut self.damped_n, damped_n);
        // The force turns with the entity.
        let turn = entity.previous_X_WB.rotation.rotation_to(&entity.X_WB.rotation).angle();
        spring_n + damped_n + force_n * turn + self.onset.came_on_n()
    }

    /// Share of the spring that stiffer faces leave; notes the label for the next tick.
    #[inline(never)]
    fn share_of_faces(&mut self, touch: &Touch, input: &TouchInput<'_>) -> f64 {
        if let Shape::Mesh(mesh) = input.shape {
            self.label = mesh.label(touch.god_object.piece);
        }
        // Along the normal: what friction holds back is no part of what is pressed in.
        let god_object = &touch.god_object;
        self.stiffness.share((god_object.point_B - input.cone.hip_B).dot(&god_object.normal_B).max(0.0))
    }

    /// The touch as the entity's facets and heights have it, and the change of the force that heights explain (N); `None` above
    /// a dent.
    #[inline(never)]
    fn shade_and_raise(
        &mut self,
        entity: &Entity,
        mut touch: Touch,
        sweep: &Sweep<'_>,
        (stiffness_n_per_m, way_m): (f64, f64),
    ) -> Option<(Touch, f64)> {
        let mut raised_n = 0.0;
        if !matches!(entity.shading, Shading::None) {
            let plain_B = touch.force_on_user_B;
            match self.balls.as_ref().filter(|balls| balls.is_touching()) {
                Some(balls) => entity.shading.turn_shares(&entity.shape, balls.shares(), &mut touch),
                None => entity.shading.turn(&entity.shape, &mut touch),
            }
            if entity.shading.is_continuous() {
                self.following.follow(plain_B, &mut touch, way_m, stiffness_n_per_m);
            }
        }
        if let Some(height_map) = &entity.height_map {
            let over = Over {
                shape: &entity.shape,
                stiffness_n_per_m,
                finger_radius_m: sweep.finger_radius_m,
                hip_B: point_into_body(&entity.X_WB, &sweep.hip.position_W),
                way_m,
            };
            let raised = height_map.raise(&over, &mut self.height, &mut touch);
            self.hovers = raised.is_none();
            if self.hovers {
                // Whoever comes down from here comes from outside.
                self.onset.end();
                self.following.reset();
            }
            raised_n = raised?;
        }
        Some((touch, raised_n))
    }
}

/// Brings a point that rolls as a ball down onto what it rolls on; says which share of the spring that leaves.
#[cold]
fn let_down(touch: &mut Touch, input: &TouchInput<'_>) -> f64 {
    let god_object = &mut touch.god_object;
    let spring_m = (god_object.point_B - input.cone.hip_B).norm();
    god_object.point_B -= god_object.normal_B * input.finger_radius_m;
    if spring_m > input.finger_radius_m { 1.0 - input.finger_radius_m / spring_m } else { 0.0 }
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
    sweep: &Sweep<'_>,
) -> Vector3<f64> {
    let (Some(previous_B), Some(previous_W)) = (previous_B, sweep.previous_hip_W) else {
        return Vector3::zeros();
    };
    if sweep.dt_s.is_nan() || sweep.dt_s <= 0.0 {
        return Vector3::zeros();
    }
    let difference_B = (hip_B - previous_B) / sweep.dt_s;
    let Some(velocity_W) = sweep.hip.velocity_W.filter(is_finite) else { return difference_B };
    let correction_W = velocity_W - (sweep.hip.position_W - previous_W) / sweep.dt_s;
    difference_B + vector_into_body(&entity.X_WB, &correction_W)
}

#[inline(always)]
fn in_world(
    entity_index: usize,
    entity: &Entity,
    touch: &Touch,
    onset: &Onset,
    (explained_n, label, stiffness_n_per_m): (f64, u16, f64),
) -> Option<Contact> {
    let god_object = &touch.god_object;
    let contact = Contact {
        entity: entity_index,
        force_on_user_W: vector_into_world(&entity.X_WB, &touch.force_on_user_B),
        normal_force_n: touch.normal_force_n,
        god_object_W: point_into_world(&entity.X_WB, &god_object.point_B),
        normal_W: vector_into_world(&entity.X_WB, &god_object.normal_B),
        feature: god_object.feature,
        label,
        stiffness_n_per_m,
        friction: touch.friction,
        leapt: onset.leapt(),
        missing_n: onset.missing_n(),
        explained_n,
    };
    (is_finite(&contact.force_on_user_W) && is_finite(&contact.god_object_W)).then_some(contact)
}
