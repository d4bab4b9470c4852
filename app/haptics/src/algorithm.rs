//! How a contact is rendered: by the Friction Cone Algorithm, by a baseline to compare it with, or by somebody's own.
//!
//! An own algorithm answers for all of a contact: when it begins and ends, where the god-object is, which force is
//! felt. The finger does the rest: frames, sums, finite numbers, and the ramp of a contact that begins without the
//! HIP having entered the shape. [`TouchInput`] asks every kind of shape the same few questions.

use std::fmt;
use std::sync::Arc;

use nalgebra::Vector3;

use crate::friction::Friction;
use crate::friction_cone::ConeInput;
use crate::friction_law::{FrictionMemory, FrictionState};
use crate::mesh::Mesh;
use crate::shape::Shape;
use crate::shared::Shared;
use crate::surface::{Feature, Surface, SurfacePoint};

/// How the contact with an entity is rendered.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum Algorithm {
    /// The Friction Cone Algorithm (Melder ch. 4).
    #[default]
    FrictionCone,
    /// A baseline without memory or friction: pushed out by the shortest way, see [`crate::VectorField`].
    VectorField,
    /// A baseline with memory, without friction: Zilles and Salisbury's, see [`crate::ClassicGodObject`].
    ClassicGodObject,
    /// Somebody's own.
    Own(Shared<dyn ContactAlgorithm>),
}

impl Algorithm {
    /// Somebody's own algorithm.
    pub fn own(algorithm: impl ContactAlgorithm + 'static) -> Self {
        let algorithm: Arc<dyn ContactAlgorithm> = Arc::new(algorithm);
        Self::Own(algorithm.into())
    }
}

/// A way to render a contact: implement it to plug in your own.
///
/// A tick must not allocate, panic or loop without a constant bound. Answers that are not finite end the contact.
pub trait ContactAlgorithm: fmt::Debug + Send + Sync {
    /// One tick of one finger against one entity; `None` while they do not touch.
    fn touch(&self, input: &TouchInput<'_>, memory: &mut ContactMemory) -> Option<Touch>;
}

/// What an algorithm is told, in the entity's frame B.
#[derive(Debug, Clone, Copy)]
pub struct TouchInput<'e> {
    /// The entity's shape.
    pub shape: &'e Shape,
    /// The entity's friction.
    pub friction: &'e Friction,
    /// Radius of the finger \[m\].
    pub finger_radius_m: f64,
    /// Where the HIP was in the last tick \[m\], taken through the pose that the entity had then; `None` at first.
    pub previous_hip_B: Option<Vector3<f64>>,
    /// Where the HIP is, and what the entity's material is like.
    pub cone: ConeInput,
}

/// What is asked of every shape alike, for this finger.
impl TouchInput<'_> {
    /// Whether the HIP is inside the material, or on its surface. Open meshes have no inside.
    ///
    /// Of a mesh as [`Mesh::is_inside`] says, at a cost that a tick can bear.
    pub fn is_inside(&self) -> bool {
        match self.shape {
            Shape::Mesh(mesh) => {
                let (hip_B, radius_m) = (&self.cone.hip_B, self.finger_radius_m);
                mesh.is_inside(hip_B) || radius_m > 0.0 && mesh.nearest_within(hip_B, radius_m) != Ok(None)
            }
            Shape::Csg(csg) => self.finger_radius_m == 0.0 && csg.is_inside(&self.cone.hip_B),
            _ => self.of_surface(|surface| surface.signed_distance(&self.cone.hip_B) <= 0.0).unwrap_or(false),
        }
    }

    /// How far the HIP has moved since the last tick, in the entity's frame \[m\].
    pub(crate) fn way_m(&self) -> f64 {
        self.previous_hip_B.map_or(0.0, |previous_B| (self.cone.hip_B - previous_B).norm())
    }

    /// How far the finger would have to go to touch nothing, at least; 0 outside \[m\].
    pub(crate) fn overlap_m(&self) -> f64 {
        let (hip_B, radius_m) = (&self.cone.hip_B, self.finger_radius_m);
        let depth_m = match self.shape {
            Shape::Mesh(mesh) => {
                let (nearest, is_inside) = mesh.nearest_and_side(hip_B);
                radius_m + if is_inside { nearest.distance_m } else { -nearest.distance_m }
            }
            Shape::Csg(csg) => csg.overlap_m(hip_B, radius_m),
            _ => self.of_surface(|surface| -surface.signed_distance(hip_B)).unwrap_or(0.0),
        };
        depth_m.max(0.0)
    }

    /// The surface point nearest to the HIP; `None` if a finger of this size cannot feel the shape.
    ///
    /// Where very many faces of a mesh are about as near, as at the centre of a ball, it is on one of these: not
    /// necessarily on the very nearest, which no tick has the time to find.
    pub fn nearest(&self) -> Option<SurfacePoint> {
        let hip_B = &self.cone.hip_B;
        match self.shape {
            Shape::Mesh(mesh) => {
                let at = nearest_of_mesh(mesh, hip_B);
                Some(SurfacePoint { point_B: at.point_B + at.normal_B * self.finger_radius_m, ..at })
            }
            _ => self.of_surface(|surface| surface.nearest(hip_B)),
        }
    }

    /// Where the HIP's last step entered the material first; `None` for a finger with a radius and a mesh.
    pub fn entry(&self) -> Option<SurfacePoint> {
        let (from_B, to_B) = (self.previous_hip_B?, self.cone.hip_B);
        match self.shape {
            Shape::Mesh(_) if self.finger_radius_m != 0.0 => None,
            Shape::Mesh(mesh) => {
                let hit = mesh.first_hit(&from_B, &to_B)?;
                let normal_B = mesh.faces()[hit.face as usize].normal_B;
                Some(SurfacePoint {
                    point_B: hit.point_B,
                    normal_B: if hit.is_front { normal_B } else { -normal_B },
                    feature: Feature::Face,
                    piece: hit.face,
                })
            }
            _ => self.of_surface(|surface| surface.entry(&from_B, &to_B))?,
        }
    }

    /// Asks the surface on which the finger's centre rolls; `None` for a mesh or a tree of shapes, and if it cannot feel the shape.
    pub fn of_surface<R>(&self, ask: impl FnOnce(&dyn Surface) -> R) -> Option<R> {
        match self.shape {
            Shape::Form(form) if self.finger_radius_m == 0.0 => Some(ask(form)),
            Shape::Form(form) => form.grown(self.finger_radius_m).map(|grown| ask(&grown)),
            Shape::Own(surface) if self.finger_radius_m == 0.0 => Some(ask(&**surface)),
            Shape::Own(surface) => {
                let (mut ask, mut answer) = (Some(ask), None);
                surface.show_grown(self.finger_radius_m, &mut |grown| {
                    answer = ask.take().map(|ask| ask(grown));
                });
                answer
            }
            Shape::Nurbs(nurbs) => Some(ask(&nurbs.surface(self.finger_radius_m))),
            Shape::Mesh(_) | Shape::Csg(_) => None,
        }
    }
}

/// Its normal is the face's; on edges and vertices that of the shortest way through the surface.
fn nearest_of_mesh(mesh: &Mesh, hip_B: &Vector3<f64>) -> SurfacePoint {
    let (nearest, is_inside) = mesh.nearest_and_side(hip_B);
    let face_normal_B = mesh.faces()[nearest.face as usize].normal_B;
    let way_B = nearest.point_B - hip_B;
    // So close to the surface that the way is mostly rounding.
    let is_on_it = nearest.distance_m.is_nan() || nearest.distance_m <= 1e-9 * mesh.extent_m();
    let normal_B = if is_on_it || nearest.feature == Feature::Face || nearest.distance_m.is_infinite() {
        face_normal_B
    } else if is_inside {
        way_B / nearest.distance_m
    } else {
        -way_B / nearest.distance_m
    };
    SurfacePoint { point_B: nearest.point_B, normal_B, feature: nearest.feature, piece: nearest.face }
}

/// What an algorithm answers, in the entity's frame B.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Touch {
    /// Where the finger is held.
    pub god_object: SurfacePoint,
    /// Force the device renders \[N\].
    pub force_on_user_B: Vector3<f64>,
    /// Normal part of it \[N\], >= 0.
    pub normal_force_n: f64,
    /// Whether friction holds.
    pub friction: FrictionState,
}

impl Touch {
    /// The force of a spring (and damper) of this length along the normal, cut so that it never pulls.
    ///
    /// The damper is silent where the spring is relaxed, as the Friction Cone Algorithm's is.
    pub fn frictionless(god_object: SurfacePoint, depth_m: f64, cone: &ConeInput) -> Self {
        let approach_m_s = -god_object.normal_B.dot(&cone.hip_velocity_B);
        let damped_m = depth_m + cone.damping_s() * approach_m_s;
        let load_m = if depth_m > 0.0 { damped_m.max(0.0) } else { 0.0 };
        let normal_force_n = cone.stiffness_n_per_m * load_m;
        Self {
            god_object,
            force_on_user_B: god_object.normal_B * normal_force_n,
            normal_force_n,
            friction: FrictionState::Slip,
        }
    }
}

/// What an algorithm remembers of one contact from tick to tick; all zero when the finger meets the entity.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ContactMemory {
    /// Whatever the algorithm makes of them.
    pub words: [f64; CONTACT_WORDS],
    /// What the entity's [`Friction`] remembers of the contact, for algorithms that ask it.
    pub friction: FrictionMemory,
}

/// Most algorithms remember a point; where it is kept is their own business.
impl ContactMemory {
    /// Three numbers from `first` on. Panics if there are not as many.
    pub fn vector(&self, first: usize) -> Vector3<f64> {
        Vector3::from_column_slice(&self.words[first..first + 3])
    }

    /// Remembers three numbers from `first` on. Panics if there are not as many.
    pub fn set_vector(&mut self, first: usize, v: &Vector3<f64>) {
        self.words[first..first + 3].copy_from_slice(v.as_slice());
    }
}

/// Numbers in a [`ContactMemory`].
pub const CONTACT_WORDS: usize = 16;
