//! What is to be seen of a scene: for whoever draws it (Melder 7.1.1, 7.2.4).
//!
//! Model: of each entity a list of parts, each a form in a frame of its own, a colour and a shadow. What is seen need not be
//! what is felt: a fine mesh over a coarse feel, or the reverse. Each file is read once, however many parts show it, and
//! is not touched by what is felt. Where the scene says no colour the file does, if its format has materials: a part then
//! shows the faces of one of them.
//! Frames: W world, B the entity's, V the part's: `X_WB * X_BV`, where `X_WB` is the entity's pose, or that which a run tells of
//! one that moves. A part within an environment is for eyes that are in it.

#![allow(non_snake_case)] // Names carry their frames: X_BV takes points of V to B.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use haptics::mesh::{CornerUv, TriangleSoup};
use nalgebra::Isometry3;

use crate::camera::SceneCamera;
use crate::entity::SceneEntity;
use crate::error::Location;
use crate::light::SceneLight;
use crate::model::{self, Appearance, ModelError, Texture};
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
    /// Materials and textures that could not be read, each once: whoever shows them is plain.
    pub plain: Vec<(&'s Location, String)>,
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
    /// True where scene or file say the colour.
    pub is_coloured: bool,
    /// Whether it casts a shadow.
    pub casts_shadow: bool,
}

impl SeenPart<'_> {
    /// Texture on its triangles.
    pub fn texture(&self) -> Option<Arc<Texture>> {
        match &self.form {
            SeenForm::Triangles { painting, .. } => {
                painting.as_ref().map(|painting| painting.texture.clone())
            }
            SeenForm::Shape(_) => None,
        }
    }
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
        /// Texture on them.
        painting: Option<Arc<Painting>>,
    },
    /// Closed forms, trees and patches: by their sizes.
    Shape(&'s ShapeSpec),
}

/// A texture, and where on it the corners of each triangle are.
#[derive(Debug, Clone, PartialEq)]
pub struct Painting {
    /// In pictures, from the upper left corner.
    pub uv: Vec<CornerUv>,
    /// Its colours are multiplied with the part's.
    pub texture: Arc<Texture>,
}

impl Scene {
    /// What is to be seen of it; reads the files of meshes.
    pub fn seen(&self) -> Seen<'_> {
        let mut seen = Seen {
            parts: Vec::new(),
            lights: &self.lights,
            cameras: &self.cameras,
            unreadable: Vec::new(),
            plain: Vec::new(),
        };
        let mut files = Files::default();
        for entity in &self.entities {
            for visual in &*entity.visuals {
                seen.add(entity, visual, &mut files);
            }
        }
        seen
    }
}

/// A file, and lists of names.
type Parting<'s> = (&'s Path, Vec<&'s [String]>);

/// Files that were read, and those that cannot be.
#[derive(Default)]
struct Files<'s> {
    /// `None`: it was told that it cannot be read.
    whole: BTreeMap<&'s Path, Option<Arc<TriangleSoup>>>,
    /// By materials; none where the file has none.
    finished: BTreeMap<&'s Path, Vec<Finished>>,
    /// By the names of faces; the first part has those that have none of them.
    parted: BTreeMap<Parting<'s>, Vec<Arc<TriangleSoup>>>,
}

impl<'s> Seen<'s> {
    fn add(&mut self, entity: &'s SceneEntity, visual: &'s VisualSpec, files: &mut Files<'s>) {
        let VisualSpec { pose, casts_shadow, .. } = *visual;
        let colour = visual.colour.unwrap_or(VisualSpec::DEFAULT_COLOUR);
        let is_coloured = visual.colour.is_some();
        let mesh = match visual.shape.as_ref().unwrap_or(&entity.shape) {
            ShapeSpec::Mesh(mesh) => mesh,
            shape => {
                let form = SeenForm::Shape(shape);
                self.parts.push(SeenPart { entity, form, X_BV: pose, colour, is_coloured, casts_shadow });
                return;
            }
        };
        let is_parted = visual.shape.is_none() && entity.faces.iter().any(|faces| faces.colour.is_some());
        let whole = files.whole.entry(&mesh.file).or_insert_with(|| {
            let read = model::read_file(&mesh.file).and_then(|bytes| model::read(&mesh.file, &bytes));
            read.map_err(|error| self.unreadable.push((&mesh.at, Arc::new(error)))).ok().map(Arc::new)
        });
        let Some(whole) = whole else { return };
        let finished = match is_parted || is_coloured {
            true => &[][..],
            false => files.finished.entry(&mesh.file).or_insert_with(|| {
                let (parts, said) = finished(&mesh.file, whole);
                self.plain.extend(said.into_iter().map(|said| (&mesh.at, said)));
                parts
            }),
        };
        let mut add = |soup: &Arc<TriangleSoup>, painting, colour, is_coloured| {
            let form = SeenForm::Triangles { soup: soup.clone(), scale: mesh.scale, painting };
            self.parts.push(SeenPart { entity, form, X_BV: pose, colour, is_coloured, casts_shadow });
        };
        for part in finished {
            add(&part.soup, part.painting.clone(), part.colour.unwrap_or(colour), part.colour.is_some());
        }
        if !is_parted {
            if finished.is_empty() {
                add(whole, None, colour, is_coloured);
            }
            return;
        }
        let names: Vec<&[String]> = entity.faces.iter().map(|faces| faces.of.as_slice()).collect();
        let parts = files
            .parted
            .entry((&mesh.file, names.clone()))
            .or_insert_with(|| parts(&mesh.file, whole, &names));
        let own = entity.faces.iter().map(|faces| faces.colour.unwrap_or(colour));
        let colours = std::iter::once(colour).chain(own);
        for (part, colour) in parts.iter().zip(colours).filter(|(part, _)| !part.faces.is_empty()) {
            add(part, None, colour, true);
        }
    }
}

/// Each is drawn by itself.
const MOST_MATERIALS: usize = 1000;

/// The faces of a material.
struct Finished {
    soup: Arc<TriangleSoup>,
    colour: Option<[f64; 4]>,
    painting: Option<Arc<Painting>>,
}

/// The faces of each material that says how they look; and what could not be read of that.
fn finished(file: &Path, whole: &TriangleSoup) -> (Vec<Finished>, Vec<String>) {
    if !model::may_have_appearance(file) {
        return (Vec::new(), Vec::new());
    }
    let read = model::read_file(file).and_then(|bytes| model::read_appearance(file, &bytes));
    let Appearance { finishes, of_face, uv, unread } = match read {
        Ok(Some(told)) if told.is_told() && told.of_face.len() == whole.faces.len() => told,
        Ok(told) => return (Vec::new(), told.map_or_else(Vec::new, |told| told.unread)),
        Err(error) => return (Vec::new(), vec![error.to_string()]),
    };
    let mut faces = vec![Vec::new(); finishes.len()];
    of_face.iter().enumerate().for_each(|(face, finish)| faces[*finish as usize].push(face));
    let count = faces.iter().filter(|faces| !faces.is_empty()).count();
    if count > MOST_MATERIALS {
        let said =
            format!("found {count} materials with faces; allowed: {MOST_MATERIALS} at most, to be seen");
        return (Vec::new(), vec![said]);
    }
    let mut numbers = vec![None; whole.vertices.len()];
    let parts = finishes.into_iter().zip(faces).filter(|(_, faces)| !faces.is_empty());
    let parts = parts.map(|(finish, faces)| Finished {
        soup: Arc::new(used(whole, faces.iter().map(|&face| whole.faces[face]), &mut numbers)),
        colour: finish.colour,
        painting: finish
            .texture
            .map(|texture| Arc::new(Painting { uv: faces.iter().map(|&face| uv[face]).collect(), texture })),
    });
    (parts.collect(), unread)
}

/// The faces that none of these names, and those that each of them does.
fn parts(file: &Path, whole: &Arc<TriangleSoup>, names: &[&[String]]) -> Vec<Arc<TriangleSoup>> {
    let of_file = model::read_file(file).and_then(|bytes| model::read_names(file, &bytes)).ok().flatten();
    let labels = of_file.map_or_else(Vec::new, |of_file| of_file.labels(names));
    if labels.len() != whole.faces.len() {
        return vec![whole.clone()];
    }
    let part = |label: usize| {
        let own = whole.faces.iter().zip(&labels).filter(|(_, own)| usize::from(**own) == label);
        Arc::new(used(whole, own.map(|(face, _)| *face), &mut vec![None; whole.vertices.len()]))
    };
    (0..=names.len()).map(part).collect()
}

/// These faces of a soup, with the vertices that they use. `numbers`: a place for each vertex of the soup, empty before and
/// after.
fn used(
    of: &TriangleSoup,
    faces: impl Iterator<Item = [u32; 3]>,
    numbers: &mut [Option<u32>],
) -> TriangleSoup {
    let mut own = Vec::new();
    let faces = faces.map(|face| {
        face.map(|vertex| {
            *numbers[vertex as usize].get_or_insert_with(|| {
                own.push(vertex);
                own.len() as u32 - 1
            })
        })
    });
    let faces = faces.collect();
    own.iter().for_each(|&vertex| numbers[vertex as usize] = None);
    TriangleSoup { vertices: own.iter().map(|&vertex| of.vertices[vertex as usize]).collect(), faces }
}
