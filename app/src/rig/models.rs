//! The meshes and patches of a scene: each file is read and built once for all entities that use it alike.
//!
//! What was repaired is told once, what cannot be used is refused with the place in the scene and in the model.

use super::entities::is_only_seen;
use super::face_labels::{self, Unknown};
use super::{Problems, RigError, material};
use haptics::mesh::{CloseHoles, CornerUv, FaceData, Finding, Mesh, MeshReport, TriangleSoup};
use haptics::{Nurbs, Shading};
use io_driver::say::say;
use nalgebra::Vector3;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use world::model::{self, ModelError};
use world::{FacesSpec, MeshSpec, Scene, SceneEntity, ShadingSpec, ShapeSpec};

/// From this size on it takes so long that somebody wonders: a third of a million triangles.
const WORTH_A_LINE_BYTES: usize = 16 << 20;

/// Meshes that are ready to be touched.
#[derive(Debug, Clone, Default)]
pub(super) struct Models {
    meshes: BTreeMap<Key, Arc<Mesh>>,
    shadings: Vec<(Key, ShadingSpec, Shading)>,
    nurbs: BTreeMap<Key, Arc<Nurbs>>,
    reports: Vec<(PathBuf, MeshReport)>,
    /// Tables of faces, by their places, that no face is left for.
    idle: BTreeMap<Key, Vec<usize>>,
    /// Entities whose meshes nobody feels.
    only_seen: BTreeSet<String>,
}

/// A file, the bits of the factors along its axes, whether a picture lies on it, whether it is felt from both sides, the
/// bits of the largest hole that is closed, and the names of faces that are made of something else.
type Key = (PathBuf, [u64; 3], bool, bool, Option<u64>, Vec<Vec<String>>);

impl Models {
    /// Loads every mesh that the scene's entities use; those that cannot be had are noted.
    pub(super) fn load(scene: &Scene, problems: &mut Problems) -> Self {
        let mut models = Self::default();
        let mut refused: BTreeMap<Key, Vec<Unknown>> = BTreeMap::new();
        for entity in &scene.entities {
            if is_drawn_from_its_file(scene, entity) {
                models.only_seen.insert(entity.name.clone());
                continue;
            }
            let has_picture = entity.height_map.is_some();
            let (ShapeSpec::Nurbs(spec) | ShapeSpec::Mesh(spec)) = &entity.shape else { continue };
            let key = key_of(spec, has_picture && matches!(entity.shape, ShapeSpec::Mesh(_)), &entity.faces);
            if let Some(unknown) = refused.get(&key) {
                note_unknown(unknown, spec, entity, problems);
                continue;
            }
            match models.add(entity, &key) {
                Err(Refusal::Model(problem)) => {
                    problems.note(*problem);
                    refused.insert(key, Vec::new());
                }
                Err(Refusal::Faces(unknown)) => {
                    note_unknown(&unknown, spec, entity, problems);
                    refused.insert(key, unknown);
                }
                Ok(()) if matches!(entity.shape, ShapeSpec::Mesh(_)) => models.shade(key, entity.shading),
                Ok(()) => {}
            }
        }
        models
    }

    /// Loads what is not there yet.
    fn add(&mut self, entity: &SceneEntity, key: &Key) -> Result<(), Refusal> {
        match &entity.shape {
            ShapeSpec::Nurbs(spec) if !self.nurbs.contains_key(key) => {
                self.nurbs.insert(key.clone(), Arc::new(join(spec)?));
            }
            ShapeSpec::Mesh(spec) if !self.meshes.contains_key(key) => {
                let Built { mesh, report, idle } = build(spec, key.2, &entity.faces)?;
                self.reports.push((spec.file.clone(), report));
                self.meshes.insert(key.clone(), Arc::new(mesh));
                self.idle.insert(key.clone(), idle);
            }
            _ => {}
        }
        Ok(())
    }

    /// Whether the model of an entity is there, if it needs one.
    pub(super) fn has(&self, entity: &SceneEntity) -> bool {
        match &entity.shape {
            ShapeSpec::Mesh(_) if self.only_seen.contains(&entity.name) => true,
            ShapeSpec::Mesh(spec) => self.mesh(spec, entity).is_some(),
            ShapeSpec::Nurbs(spec) => self.nurbs(spec).is_some(),
            _ => true,
        }
    }

    /// The tables of an entity's faces that no face is left for.
    pub(super) fn idle_faces<'a>(&'a self, entity: &'a SceneEntity) -> impl Iterator<Item = &'a FacesSpec> {
        let tables = match &entity.shape {
            ShapeSpec::Mesh(spec) => self.idle.get(&key_in(spec, entity)),
            _ => None,
        };
        tables.into_iter().flatten().filter_map(|&table| entity.faces.get(table))
    }

    /// The meshes, each with its file and what was found in it, in the order in which they were loaded.
    pub(crate) fn reports(&self) -> &[(PathBuf, MeshReport)] {
        &self.reports
    }

    /// Shades a mesh, once for all entities that are shaded alike.
    fn shade(&mut self, key: Key, shading: ShadingSpec) {
        if shading == ShadingSpec::None || self.shading_of(&key, shading).is_some() {
            return;
        }
        let mesh = &self.meshes[&key];
        // What the reader of scenes let through is not refused; if it were, the entity would not be available.
        if let Ok(made) = material::mesh_shading(shading, mesh) {
            self.shadings.push((key, shading, made));
        }
    }

    /// The shading of a mesh that was loaded.
    pub(super) fn shading(&self, spec: &MeshSpec, entity: &SceneEntity) -> Option<&Shading> {
        self.shading_of(&key_in(spec, entity), entity.shading)
    }

    fn shading_of(&self, key: &Key, shading: ShadingSpec) -> Option<&Shading> {
        self.shadings.iter().find(|(of, by, _)| of == key && *by == shading).map(|(.., made)| made)
    }

    /// A mesh that was loaded, as this entity uses it.
    pub(super) fn mesh(&self, spec: &MeshSpec, entity: &SceneEntity) -> Option<&Arc<Mesh>> {
        self.meshes.get(&key_in(spec, entity))
    }

    /// Patches that were loaded.
    pub(super) fn nurbs(&self, spec: &MeshSpec) -> Option<&Arc<Nurbs>> {
        self.nurbs.get(&key_of(spec, false, &[]))
    }
}

/// Why a model cannot be had.
enum Refusal {
    Model(Box<RigError>),
    /// No face has these names.
    Faces(Vec<Unknown>),
}

impl From<RigError> for Refusal {
    fn from(error: RigError) -> Self {
        Self::Model(Box::new(error))
    }
}

/// Several entities may be made of one table.
fn note_unknown(unknown: &[Unknown], spec: &MeshSpec, entity: &SceneEntity, problems: &mut Problems) {
    unknown
        .iter()
        .filter_map(|unknown| unknown.told(&spec.file, &entity.faces))
        .for_each(|problem| problems.note_once(problem));
}

/// A mesh that was read.
struct Built {
    mesh: Mesh,
    report: MeshReport,
    /// Tables of faces that no face is left for.
    idle: Vec<usize>,
}

/// A mesh that nobody feels is not built: its file need not hold one that can be felt.
fn is_drawn_from_its_file(scene: &Scene, entity: &SceneEntity) -> bool {
    matches!(entity.shape, ShapeSpec::Mesh(_)) && is_only_seen(scene, entity)
}

fn key_in(spec: &MeshSpec, entity: &SceneEntity) -> Key {
    key_of(spec, entity.height_map.is_some(), &entity.faces)
}

fn key_of(spec: &MeshSpec, has_picture: bool, faces: &[FacesSpec]) -> Key {
    (
        spec.file.clone(),
        spec.scale.map(f64::to_bits),
        has_picture,
        spec.hollow,
        spec.close_holes_m.map(f64::to_bits),
        faces.iter().map(|faces| faces.of.clone()).collect(),
    )
}

fn build(spec: &MeshSpec, has_picture: bool, faces: &[FacesSpec]) -> Result<Built, Refusal> {
    let file = &spec.file;
    let unreadable = |source| RigError::Model { at: Box::new(spec.at.clone()), file: file.clone(), source };
    let bytes = model::read_file(file).map_err(unreadable)?;
    let (soup, uv) = read(file, &bytes, has_picture).map_err(unreadable)?;
    let labels = if faces.is_empty() {
        None
    } else {
        let names = model::read_names(file, &bytes).map_err(unreadable)?;
        Some(face_labels::labels(names.as_ref(), faces).map_err(Refusal::Faces)?)
    };
    let idle = labels.as_ref().map_or_else(Vec::new, |labels| face_labels::idle(labels, faces.len()));
    let soup = scaled(soup, &spec.scale);
    let holes = spec.close_holes_m.map_or(CloseHoles::Small, CloseHoles::UpTo);
    let of_faces = FaceData { uv: uv.as_deref(), labels: labels.as_deref() };
    let (mesh, report) = Mesh::build_with(soup, of_faces, holes).map_err(|source| RigError::Mesh {
        at: Box::new(spec.at.clone()),
        file: file.clone(),
        source: Box::new(source),
    })?;
    tell(file, &report);
    Ok(Built { mesh: if spec.hollow { mesh.into_sheet() } else { mesh }, report, idle })
}

/// Reads and joins the patches of a file.
fn join(spec: &MeshSpec) -> Result<Nurbs, RigError> {
    let file = &spec.file;
    let at = || Box::new(spec.at.clone());
    let bytes = model::read_file(file);
    let read = bytes.and_then(|bytes| model::read_nurbs(file, &bytes));
    let mut patches = read.map_err(|source| match source {
        // It names the file itself.
        ModelError::Toml(source) => RigError::Patches { at: at(), said: source.to_string() },
        source => RigError::Model { at: at(), file: file.clone(), source },
    })?;
    for point in patches.iter_mut().flat_map(|patch| &mut patch.points) {
        point.iter_mut().zip(spec.scale).for_each(|(x, factor)| *x *= factor);
    }
    let (nurbs, report) = Nurbs::build(&patches).map_err(|source| {
        let said = format!("{}: {source}", file.display());
        RigError::Patches { at: at(), said }
    })?;
    if report.turned > 0 || report.rims > 0 || report.is_one_sided || report.without_area > 0 {
        say(format_args!("phantom3: {}: {report}", file.display()));
    }
    Ok(nurbs)
}

/// Texture coordinates only where a picture needs them.
fn read(
    file: &Path,
    bytes: &[u8],
    has_picture: bool,
) -> Result<(TriangleSoup, Option<Vec<CornerUv>>), ModelError> {
    if bytes.len() >= WORTH_A_LINE_BYTES {
        say(format_args!("phantom3: loading {} ({} MB)", file.display(), bytes.len() / 1_000_000));
    }
    if has_picture {
        return model::read_with_uv(file, bytes).map(|(soup, uv)| (soup, Some(uv)));
    }
    Ok((model::read(file, bytes)?, None))
}

fn scaled(mut soup: TriangleSoup, scale: &[f64; 3]) -> TriangleSoup {
    if *scale != [1.0; 3] {
        let scale = Vector3::from(*scale);
        soup.vertices.iter_mut().for_each(|vertex| vertex.component_mul_assign(&scale));
    }
    soup
}

/// Nothing about a mesh without defects. That equal vertices were merged is none: STL has no other way to share them.
fn tell(file: &Path, report: &MeshReport) {
    if report.is_clean() {
        return;
    }
    let report = MeshReport { welded_vertices: Finding::default(), ..*report };
    for (index, line) in report.to_string().lines().enumerate() {
        let indent = if index == 0 { "" } else { "  " };
        say(format_args!("phantom3: {}: {indent}{line}", file.display()));
    }
}
