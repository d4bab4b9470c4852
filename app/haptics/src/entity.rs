//! An object as the haptic step sees it: where it is, what it is made of.

use std::sync::Arc;

use nalgebra::Isometry3;

use crate::algorithm::Algorithm;
use crate::door::WORLD;
use crate::effects::{Magnetism, Vibration};
use crate::error::{ParameterError, above_zero, at_least_zero, share};
use crate::face_materials::{FaceMaterials, FeltMaterial};
use crate::friction::Friction;
use crate::friction_law::FrictionLaw;
use crate::height_map::HeightMap;
use crate::mesh::Mesh;
use crate::shading::Shading;
use crate::shape::Shape;
use crate::shared::Shared;
use crate::tessellated::tessellated;

/// How many times the stiffness and the damping of an entity fingers feel: what the keys of a running application change.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Felt {
    /// Of the stiffness, > 0.
    pub stiffness: f64,
    /// Of the damping, >= 0.
    pub damping: f64,
}

impl Default for Felt {
    fn default() -> Self {
        Self { stiffness: 1.0, damping: 1.0 }
    }
}

/// An object that fingers can touch.
#[derive(Debug, Clone, PartialEq)]
pub struct Entity {
    /// Its shape, in its own frame B.
    pub shape: Shape,
    /// Its pose in this tick.
    pub X_WB: Isometry3<f64>,
    /// Its pose in the last tick. The finger's last position is taken through it: otherwise a
    /// moving object sweeps past a resting finger unnoticed.
    pub previous_X_WB: Isometry3<f64>,
    /// k \[N/m\], > 0.
    pub stiffness_n_per_m: f64,
    /// b \[N s/m\], >= 0.
    pub damping_n_s_per_m: f64,
    /// What fingers feel of both; objects that meet it know nothing of this.
    pub felt: Felt,
    /// Friction of its surface.
    pub friction: Friction,
    /// Materials of a mesh's labelled faces.
    pub face_materials: Option<Shared<FaceMaterials>>,
    /// How much of an approaching velocity it gives back to what bounces off it, 0 to 1; no finger feels it. `None`: nobody
    /// says.
    pub restitution: Option<f64>,
    /// Of each point where another entity touches it \[N/m\], > 0; no finger feels it. `None`: nobody says.
    pub contact_stiffness_n_per_m: Option<f64>,
    /// Its stiffness is what somebody has chosen for it: between two such entities it counts, too.
    pub is_stiffness_said: bool,
    /// Torque about the normal, per normal force, up to which a contact with another entity does not spin \[m\]; no finger feels it.
    pub torsional_friction_m: f64,
    /// The like across the normal, up to which it does not roll \[m\].
    pub rolling_friction_m: f64,
    /// How contacts with it are rendered.
    pub algorithm: Algorithm,
    /// Whether its facets feel smooth.
    pub shading: Shading,
    /// What stands out of its surface.
    pub height_map: Option<Shared<HeightMap>>,
    /// How it attracts fingers that are near.
    pub magnetism: Option<Magnetism>,
    /// How it hums while it is touched.
    pub vibration: Option<Vibration>,
    /// In triangles, for balls to which the shape itself has nothing to offer; see [`Self::prepared_for`].
    pub for_balls: Option<Shared<Shape>>,
    /// Whether fingers feel it.
    pub is_haptic: bool,
    /// Whether other entities collide with it.
    pub is_collidable: bool,
    /// Which space it is in: what is in another one neither feels nor meets it; see [`crate::Door`].
    pub space: u32,
}

impl Entity {
    /// An entity at rest at `X_WB`, without damping or friction.
    ///
    /// Errors: a stiffness that is not finite or not positive.
    pub fn new(
        shape: impl Into<Shape>,
        X_WB: Isometry3<f64>,
        stiffness_n_per_m: f64,
    ) -> Result<Self, ParameterError> {
        Ok(Self {
            shape: shape.into(),
            X_WB,
            previous_X_WB: X_WB,
            stiffness_n_per_m: above_zero("stiffness_n_per_m", stiffness_n_per_m)?,
            damping_n_s_per_m: 0.0,
            felt: Felt::default(),
            friction: Friction::None,
            face_materials: None,
            restitution: None,
            contact_stiffness_n_per_m: None,
            is_stiffness_said: false,
            torsional_friction_m: 0.0,
            rolling_friction_m: 0.0,
            algorithm: Algorithm::FrictionCone,
            shading: Shading::None,
            height_map: None,
            magnetism: None,
            vibration: None,
            for_balls: None,
            is_haptic: true,
            is_collidable: true,
            space: WORLD,
        })
    }

    /// With this friction. Errors: a coefficient out of range.
    pub fn with_friction(self, friction: Friction) -> Result<Self, ParameterError> {
        Ok(Self { friction: friction.validated()?, ..self })
    }

    /// With this damping. Errors: a value that is not finite or negative.
    pub fn with_damping(self, damping_n_s_per_m: f64) -> Result<Self, ParameterError> {
        let damping_n_s_per_m = at_least_zero("damping_n_s_per_m", damping_n_s_per_m)?;
        Ok(Self { damping_n_s_per_m, ..self })
    }

    /// With this share of an approaching velocity given back. Errors: a share below 0 or above 1.
    pub fn with_restitution(self, restitution: f64) -> Result<Self, ParameterError> {
        Ok(Self { restitution: Some(share("restitution", restitution)?), ..self })
    }

    /// With this stiffness towards other entities. Errors: a stiffness that is not finite or not positive.
    pub fn with_contact_stiffness(self, stiffness_n_per_m: f64) -> Result<Self, ParameterError> {
        let stiffness_n_per_m = above_zero("contact_stiffness_n_per_m", stiffness_n_per_m)?;
        Ok(Self { contact_stiffness_n_per_m: Some(stiffness_n_per_m), ..self })
    }

    /// With a stiffness that somebody has chosen for it.
    #[must_use]
    pub fn with_said_stiffness(self, is_stiffness_said: bool) -> Self {
        Self { is_stiffness_said, ..self }
    }

    /// With this resistance to turning in its contacts with other entities: torsional friction (about the normal) and rolling
    /// friction (across it) are that many times the normal force (m). Errors: a length that is not from 0 to 1.
    pub fn with_turning_friction(self, torsional_m: f64, rolling_m: f64) -> Result<Self, ParameterError> {
        let torsional_friction_m = share("torsional_friction_m", torsional_m)?;
        let rolling_friction_m = share("rolling_friction_m", rolling_m)?;
        Ok(Self { torsional_friction_m, rolling_friction_m, ..self })
    }

    /// Rendered by this algorithm.
    pub fn with_algorithm(self, algorithm: Algorithm) -> Self {
        Self { algorithm, ..self }
    }

    /// With facets that feel like this.
    pub fn with_shading(self, shading: Shading) -> Self {
        Self { shading, ..self }
    }

    /// With these heights on its surface.
    pub fn with_height_map(self, height_map: Arc<HeightMap>) -> Self {
        Self { height_map: Some(height_map.into()), ..self }
    }

    /// With a surface that attracts; of shapes that [`Magnetism::suits`].
    pub fn with_magnetism(self, magnetism: Magnetism) -> Self {
        Self { magnetism: Some(magnetism), ..self }
    }

    /// With a surface that hums.
    pub fn with_vibration(self, vibration: Vibration) -> Self {
        Self { vibration: Some(vibration), ..self }
    }

    /// One that fingers pass through, feeling nothing; other entities may still meet it.
    pub fn without_fingers(self) -> Self {
        Self { is_haptic: false, ..self }
    }

    /// One that other entities pass through; fingers may still feel it.
    pub fn without_collisions(self) -> Self {
        Self { is_collidable: false, ..self }
    }

    /// In this space.
    pub fn within(self, space: u32) -> Self {
        Self { space, ..self }
    }

    /// With triangles beside its shape where a finger of this radius could not feel it otherwise: a torus whose hole is too
    /// small for the ball, and scaled forms. They are less than 2e-4 of the form's radii from it.
    ///
    /// Takes a fraction of a second and up to 40 MB for such a form, and is nothing to do within a tick.
    pub fn prepared_for(mut self, finger_radius_m: f64) -> Self {
        if let (Shape::Form(form), false) = (&self.shape, self.shape.is_felt_by(finger_radius_m)) {
            let mesh = tessellated(form).and_then(|soup| Mesh::build(soup).ok());
            self.for_balls = mesh.map(|(mesh, _)| Arc::new(Shape::from(Arc::new(mesh))).into());
        }
        self
    }

    /// With which a finger that touches it is pushed out \[N/m\].
    #[inline]
    pub fn felt_stiffness_n_per_m(&self) -> f64 {
        self.stiffness_n_per_m * self.felt.stiffness
    }

    /// With which a finger that touches it is damped \[N s/m\].
    #[inline]
    pub fn felt_damping_n_s_per_m(&self) -> f64 {
        self.damping_n_s_per_m * self.felt.damping
    }

    /// Whether what is felt of it changes with the way of the finger alone: it does not turn, damp, drag or have heights.
    #[inline]
    pub(crate) fn is_plain(&self, material: &FeltMaterial<'_>) -> bool {
        self.height_map.is_none()
            && material.damping_n_s_per_m == 0.0
            && !material.friction.drags()
            && self.X_WB.rotation == self.previous_X_WB.rotation
    }

    /// The shape that a finger of this radius feels.
    #[inline]
    pub(crate) fn shape_for(&self, finger_radius_m: f64) -> &Shape {
        match &self.for_balls {
            Some(triangles) if !self.shape.is_felt_by(finger_radius_m) => triangles,
            _ => &self.shape,
        }
    }

    /// Whether a finger of this radius can feel it, rendered as it is.
    pub fn is_felt_by(&self, finger_radius_m: f64) -> bool {
        let shape = self.shape_for(finger_radius_m);
        let is_ball_on_mesh = finger_radius_m != 0.0 && matches!(shape, Shape::Mesh(_));
        // That baseline walks with points alone.
        let is_lost = is_ball_on_mesh && self.algorithm == Algorithm::ClassicGodObject;
        !is_lost && shape.is_felt_by(finger_radius_m)
    }

    /// True if points [roll](crate::mesh::Mesh::point_radius_m) over it.
    pub(crate) fn rolls_points(&self) -> bool {
        matches!(&self.shape, Shape::Mesh(mesh) if mesh.point_radius_m() > 0.0)
    }

    /// One tick on: the current pose becomes the previous one.
    pub fn move_to(&mut self, X_WB: Isometry3<f64>) {
        self.previous_X_WB = self.X_WB;
        self.X_WB = X_WB;
    }
}
