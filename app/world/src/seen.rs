//! What is to be seen of a scene: for whoever draws it (Melder 7.1.1, 7.2.4).
//!
//! Model: of each entity a list of parts, each a form in a frame of its own, a colour and a shadow. What is seen need not be
//! what is felt: a fine mesh over a coarse feel, or the reverse. Each file is read once, however many parts show it, and
//! is not touched by what is felt.
//! Frames: W world, B the entity's, V the part's: `X_WB * X_BV`, where `X_WB` is the entity's pose, or that which a run tells of
//! one that moves. A part within an environment is for eyes that are in it.

#![allow(non_snake_case)] // Names carry their frames: X_BV takes points of V to B.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use haptics::mesh::TriangleSoup;
use nalgebra::Isometry3;

use crate::camera::SceneCamera;
use crate::entity::SceneEntity;
use crate::error::Location;
use crate::light::SceneLight;
use crate::model::{self, ModelError};
use crate::scene::Scene;
use crate::shape::ShapeSpec;
use crate::visual::VisualSpec;

/// All that is to be seen of a scene.
#[derive(Debug, Clone)]
pub struct Seen<'s> {
    /// In the order of the scene's entities.
    pub parts: Vec<SeenPart<'s>>,
    /// The scene's.
    pub lights: &'s [SceneLight],
    /// The scene's.
    pub cameras: &'s [SceneCamera],
    /// What could not be read, each once: whoever shows it is not among the parts.
    pub unreadable: Vec<(&'s Location, Arc<ModelError>)>,
}

/// A part of what is seen of an entity.
#[derive(Debug, Clone)]
pub struct SeenPart<'s> {
    /// Whose it is.
    pub entity: &'s SceneEntity,
    /// Its form, in V.
    pub form: SeenForm<'s>,
    /// Its frame in the entity's.
    pub X_BV: Isometry3<f64>,
    /// Red, green, blue and opacity, 0 to 1.
    pub colour: [f64; 4],
    /// Whether it casts a shadow.
    pub casts_shadow: bool,
}

/// The form of a part.
#[derive(Debug, Clone)]
pub enum SeenForm<'s> {
    /// Triangles of a file, with the factors along V's axes that make metres of them.
    Triangles {
        /// As the file has them; one for all that show it.
        soup: Arc<TriangleSoup>,
        /// Above 0.
        scale: [f64; 3],
    },
    /// Closed forms, trees and patches: by their sizes.
    Shape(&'s ShapeSpec),
}

impl Scene {
    /// What is to be seen of it; reads the files of meshes.
    pub fn seen(&self) -> Seen<'_> {
        let mut seen =
            Seen { parts: Vec::new(), lights: &self.lights, cameras: &self.cameras, unreadable: Vec::new() };
        let mut files = BTreeMap::new();
        for entity in &self.entities {
            for visual in &entity.visuals {
                seen.add(entity, visual, &mut files);
            }
        }
        seen
    }
}

/// `None`: it was told that it cannot be read.
type Files<'s> = BTreeMap<&'s Path, Option<Arc<TriangleSoup>>>;

impl<'s> Seen<'s> {
    fn add(&mut self, entity: &'s SceneEntity, visual: &'s VisualSpec, files: &mut Files<'s>) {
        let form = match visual.shape.as_ref().unwrap_or(&entity.shape) {
            ShapeSpec::Mesh(mesh) => {
                let soup = files.entry(&mesh.file).or_insert_with(|| {
                    let read = model::read_file(&mesh.file).and_then(|bytes| model::read(&mesh.file, &bytes));
                    read.map_err(|error| self.unreadable.push((&mesh.at, Arc::new(error)))).ok().map(Arc::new)
                });
                let Some(soup) = soup else { return };
                SeenForm::Triangles { soup: soup.clone(), scale: mesh.scale }
            }
            shape => SeenForm::Shape(shape),
        };
        let VisualSpec { pose, colour, casts_shadow, .. } = *visual;
        self.parts.push(SeenPart { entity, form, X_BV: pose, colour, casts_shadow });
    }
}
