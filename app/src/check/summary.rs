//! What is in a scene.

use super::capacities::Capacities;
use super::measures::Measures;
use crate::rig::{Passing, Rig};
use haptics::Entity;
use haptics::mesh::MeshReport;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::PathBuf;
use world::{EntityKind, LightKind, Scene, SceneEntity};

/// What is in a scene, counted.
#[derive(Debug)]
pub(super) struct Summary {
    pub(super) name: String,
    pub(super) included: Vec<PathBuf>,
    /// Fixed objects, moving objects, parts of environments, behind doors, only seen.
    pub(super) entities: [(&'static str, usize); 5],
    pub(super) shapes: BTreeMap<&'static str, usize>,
    /// Name and how many entities are made from it.
    pub(super) templates: Vec<(String, usize)>,
    /// Name, kind and how many parts.
    pub(super) environments: Vec<(String, &'static str, usize)>,
    pub(super) meshes: Vec<(PathBuf, MeshReport)>,
    pub(super) lights: Vec<(String, &'static str)>,
    pub(super) cameras: Vec<(String, f64)>,
    /// Name, radius (m), device.
    pub(super) fingers: Vec<(String, f64, usize)>,
    /// Sizes and masses.
    pub(super) measures: Vec<Measures>,
    /// Of each of them, whether its numbers look like those of another unit.
    pub(super) suspected: Vec<bool>,
    pub(super) passing: Vec<Passing>,
    /// What is in the process's memory now, and the most that was (bytes); `None`: the system does not say.
    pub(super) memory: Option<[u64; 2]>,
    pub(super) capacities: Option<Capacities>,
}

impl Summary {
    /// Of a scene and of what of it can be run.
    pub(super) fn of(
        rig: &Rig,
        whole: &Scene,
        entities: &[Entity],
        measures: Vec<Measures>,
        suspected: Vec<bool>,
    ) -> Self {
        let count =
            |is: &dyn Fn(&SceneEntity) -> bool| whole.entities.iter().filter(|entity| is(entity)).count();
        let is_outside = |entity: &SceneEntity| entity.within.is_none();
        let is_object = |entity: &SceneEntity| is_outside(entity) && entity.kind == EntityKind::Object;
        let mut shapes = BTreeMap::new();
        for entity in &whole.entities {
            *shapes.entry(entity.shape.kind()).or_default() += 1;
        }
        Self {
            name: whole.name.clone(),
            included: whole.included.clone(),
            entities: [
                ("fixed", count(&|entity| is_object(entity) && entity.motion.is_none() && entity.is_met())),
                ("moving", count(&|entity| is_object(entity) && entity.motion.is_some())),
                (
                    "of environments",
                    count(&|entity| is_outside(entity) && entity.kind == EntityKind::Environment),
                ),
                ("behind doors", count(&|entity| !is_outside(entity))),
                (
                    "only seen",
                    count(&|entity| is_object(entity) && entity.motion.is_none() && !entity.is_met()),
                ),
            ],
            shapes,
            templates: whole
                .templates
                .iter()
                .map(|template| (template.name.clone(), template.entities))
                .collect(),
            environments: whole
                .environments
                .iter()
                .map(|environment| {
                    (environment.name.clone(), environment.kind.name(), environment.parts.len())
                })
                .collect(),
            meshes: rig.mesh_reports().to_vec(),
            lights: whole.lights.iter().map(|light| (light.name.clone(), kind_of(light.kind))).collect(),
            cameras: whole
                .cameras
                .iter()
                .map(|camera| (camera.name.clone(), camera.field_of_view_deg))
                .collect(),
            fingers: whole
                .fingers
                .iter()
                .map(|finger| (finger.name.clone(), finger.radius_m, finger.device))
                .collect(),
            measures,
            suspected,
            passing: rig.what_passes(entities),
            memory: memory(),
            capacities: None,
        }
    }

    pub(super) fn to_json(&self) -> Value {
        let named = |names: &[(String, &'static str)]| -> Vec<Value> {
            names.iter().map(|(name, kind)| json!({ "name": name, "kind": kind })).collect()
        };
        json!({
            "name": self.name,
            "included": self.included.iter().map(|file| file.display().to_string()).collect::<Vec<_>>(),
            "entities": self.entities.iter().map(|(what, count)| ((*what).to_owned(), json!(count)))
                .collect::<serde_json::Map<_, _>>(),
            "shapes": self.shapes,
            "templates": self.templates.iter().map(|(name, entities)| json!({ "name": name, "entities": entities }))
                .collect::<Vec<_>>(),
            "environments": self.environments.iter()
                .map(|(name, kind, parts)| json!({ "name": name, "kind": kind, "parts": parts })).collect::<Vec<_>>(),
            "meshes": self.meshes.iter().map(|(file, report)| json!({
                "file": file.display().to_string(), "triangles": report.faces, "vertices": report.vertices,
                "parts": report.components, "is_clean": report.is_clean(), "report": report.to_string(),
            })).collect::<Vec<_>>(),
            "lights": named(&self.lights),
            "cameras": self.cameras.iter()
                .map(|(name, angle_deg)| json!({ "name": name, "field_of_view_deg": angle_deg })).collect::<Vec<_>>(),
            "fingers": self.fingers.iter()
                .map(|(name, radius_m, device)| json!({ "name": name, "radius_m": radius_m, "device": device }))
                .collect::<Vec<_>>(),
            "measures": self.measures.iter().map(Measures::to_json).collect::<Vec<_>>(),
            "passing": self.passing.iter()
                .map(|passing| json!({ "names": passing.names, "kind": passing.kind, "through": passing.through }))
                .collect::<Vec<_>>(),
            "capacities": self.capacities.as_ref().map(Capacities::to_json),
            "memory_bytes": self.memory.map(|[now, most]| json!({ "now": now, "most": most })),
        })
    }
}

fn kind_of(kind: LightKind) -> &'static str {
    match kind {
        LightKind::Ambient => "ambient",
        LightKind::Directional { .. } => "directional",
        LightKind::Point { .. } => "point",
    }
}

/// As the system counts it: with everything that the program itself takes, some ten megabytes.
fn memory() -> Option<[u64; 2]> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let bytes = |name: &str| {
        let line = status.lines().find_map(|line| line.strip_prefix(name))?;
        Some(1024 * line.split_whitespace().next()?.parse::<u64>().ok()?)
    };
    Some([bytes("VmRSS:")?, bytes("VmHWM:")?])
}
