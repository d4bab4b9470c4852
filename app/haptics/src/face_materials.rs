//! Materials of a mesh's faces: friction and stiffness that go by where a finger touches.
//!
//! Problem: a thing is made of several materials, and its file says which face is of which (Melder ch. 4.1: the
//! coefficient of friction is the polygon's).
//!
//! Model: each face has a label ([`Mesh::label`]); 0 stands for what the entity itself is made of. A tick goes by the face
//! on which the god-object was when it began, and where a contact begins, by that which it meets.
//!
//! [`Mesh::label`]: crate::mesh::Mesh::label

use crate::entity::Entity;
use crate::error::{ParameterError, above_zero, at_least_zero};
use crate::friction::Friction;
use crate::shared::Shared;
use std::sync::Arc;

/// Material of some of a mesh's faces.
#[derive(Debug, Clone, PartialEq)]
pub struct FaceMaterial {
    friction: Friction,
    stiffness_n_per_m: f64,
    damping_n_s_per_m: f64,
}

/// Those of a mesh, by label.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FaceMaterials(Vec<FaceMaterial>);

/// Material of an entity as fingers feel it at a place.
#[derive(Debug, Clone, Copy)]
pub struct FeltMaterial<'e> {
    /// Friction there.
    pub friction: &'e Friction,
    /// With which a finger is pushed out \[N/m\].
    pub stiffness_n_per_m: f64,
    /// With which it is damped \[N s/m\].
    pub damping_n_s_per_m: f64,
}

impl FaceMaterial {
    /// Errors: friction out of range, a stiffness that is not above 0, a damping below 0.
    pub fn new(
        friction: Friction,
        stiffness_n_per_m: f64,
        damping_n_s_per_m: f64,
    ) -> Result<Self, ParameterError> {
        Ok(Self {
            friction: friction.validated()?,
            stiffness_n_per_m: above_zero("stiffness_n_per_m", stiffness_n_per_m)?,
            damping_n_s_per_m: at_least_zero("damping_n_s_per_m", damping_n_s_per_m)?,
        })
    }
}

impl FaceMaterials {
    /// The first is that of label 1, and so on.
    pub fn new(of_labels: Vec<FaceMaterial>) -> Self {
        Self(of_labels)
    }

    /// Of faces with this label; `None`: what the entity itself is made of.
    fn of(&self, label: u16) -> Option<&FaceMaterial> {
        self.0.get(usize::from(label).checked_sub(1)?)
    }
}

impl Entity {
    /// Whose faces are made of these, by their labels.
    pub fn with_face_materials(self, materials: impl Into<Arc<FaceMaterials>>) -> Self {
        Self { face_materials: Some(Shared::from(materials.into())), ..self }
    }

    /// Material that fingers feel on faces of this label.
    #[inline]
    pub fn felt_material(&self, label: u16) -> FeltMaterial<'_> {
        match self.face_materials.as_ref().and_then(|materials| materials.of(label)) {
            None => FeltMaterial {
                friction: &self.friction,
                stiffness_n_per_m: self.felt_stiffness_n_per_m(),
                damping_n_s_per_m: self.felt_damping_n_s_per_m(),
            },
            Some(material) => FeltMaterial {
                friction: &material.friction,
                stiffness_n_per_m: material.stiffness_n_per_m * self.felt.stiffness,
                damping_n_s_per_m: material.damping_n_s_per_m * self.felt.damping,
            },
        }
    }
}
