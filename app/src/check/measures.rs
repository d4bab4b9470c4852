//! Sizes and masses of what is in a scene.
//!
//! Model: the size of a thing is that of the box around it along its own axes; of a mesh by its vertices, of patches and of
//! solids that are joined by the triangles that are drawn of them. A mesh that is only seen is not among what runs; its
//! file is read for its vertices. The mass is the one that a run has, also where the
//! scene gives a density. What entities share is measured once.

use super::remainder::Remainder;
use crate::per_shape::PerShape;
use crate::rig::Rig;
use haptics::{Csg, Entity, Shape};
use nalgebra::{Point3, Vector3};
use physics::collide::bounding_ball;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::PathBuf;
use view::shapes::triangles;
use world::{EntityKind, MeshSpec, SceneEntity, ShapeSpec, model};

/// What can be measured of an entity.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Measures {
    pub(super) name: String,
    pub(super) kind: &'static str,
    /// Part of an environment, in which fingers are.
    pub(super) is_around: bool,
    /// Along its own axes (m); `None`: it has no end, or is not known.
    pub(super) size_m: Option<[f64; 3]>,
    /// Whether it has none.
    is_endless: bool,
    /// Of a solid joined of others of which nothing is drawn, what is left.
    pub(super) undrawn: Option<Remainder>,
    /// The middle of that, in the world (m).
    pub(super) middle_m: [f64; 3],
    /// `None`: it is fixed.
    pub(super) mass_kg: Option<f64>,
    pub(super) density_kg_m3: Option<f64>,
}

impl Measures {
    /// Of all entities.
    pub(super) fn all(rig: &Rig, entities: &[Entity]) -> Vec<Self> {
        let mut masses = vec![None; entities.len()];
        for (index, mass_kg) in rig.masses(entities) {
            masses[index] = Some(mass_kg);
        }
        let mut measured = Measured::default();
        let pairs = rig.scene.entities.iter().zip(entities).zip(masses);
        pairs.map(|((spec, entity), mass_kg)| Self::of(spec, entity, mass_kg, &mut measured)).collect()
    }

    fn of<'e>(
        spec: &SceneEntity,
        entity: &'e Entity,
        mass_kg: Option<f64>,
        measured: &mut Measured<'e>,
    ) -> Self {
        let only_seen = match (&spec.shape, &entity.shape) {
            (ShapeSpec::Mesh(_), Shape::Mesh(_)) => None,
            (ShapeSpec::Mesh(mesh), _) => Some(mesh),
            _ => None,
        };
        let around = match only_seen {
            Some(mesh) => measured.seen.corners(mesh),
            None => measured.felt.of(&entity.shape, || corners(&spec.shape, &entity.shape)),
        };
        let undrawn = match &entity.shape {
            Shape::Csg(csg) if around.is_none() => measured.undrawn.of(&entity.shape, || undrawn(csg)),
            _ => None,
        };
        let middle = around.map_or_else(Vector3::zeros, |[least, most]| 0.5 * (least + most));
        // A unit of density makes what the volume is.
        let mass_of_one = || Some(physics::MassProperties::of_density(&entity.shape, 1.0).ok()?.mass_kg);
        let volume_m3 = mass_kg.and_then(|_| measured.volumes_m3.of(&entity.shape, mass_of_one));
        Self {
            name: spec.name.clone(),
            kind: spec.shape.kind(),
            is_around: spec.kind == EntityKind::Environment,
            size_m: around.map(|[least, most]| (most - least).into()),
            is_endless: around.is_none() && only_seen.is_none() && undrawn.is_none(),
            undrawn,
            middle_m: (spec.pose * Point3::from(middle)).coords.into(),
            mass_kg,
            density_kg_m3: mass_kg.zip(volume_m3).map(|(mass_kg, volume_m3)| mass_kg / volume_m3),
        }
    }

    /// The longest side (m); `None`: it has no end, or is not known.
    pub(super) fn length_m(&self) -> Option<f64> {
        self.size_m.map(|size| size.into_iter().fold(0.0, f64::max))
    }

    pub(super) fn to_json(&self) -> Value {
        json!({
            "name": self.name, "kind": self.kind, "size_m": self.size_m, "middle_m": self.middle_m,
            "mass_kg": self.mass_kg, "density_kg_m3": self.density_kg_m3,
        })
    }
}

impl std::fmt::Display for Measures {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}: {}", self.name, self.kind)?;
        match self.size_m {
            Some([x, y, z]) => write!(f, ", {} x {} x {} m", short(x), short(y), short(z))?,
            None if self.is_endless => write!(f, ", without an end")?,
            None if self.undrawn == Some(Remainder::Nothing) => {
                write!(f, ", nothing is left of it")?;
            }
            None => write!(f, ", size not measured")?,
        }
        // Triangles of solids that are drawn lie beside their places by roundings.
        let least_m = ROUNDING * self.length_m().unwrap_or(0.0);
        let [x, y, z] = self.middle_m.map(|x_m| short(if x_m.abs() < least_m { 0.0 } else { x_m }));
        write!(f, ", at ({x}, {y}, {z}) m")?;
        if let Some(mass_kg) = self.mass_kg {
            write!(f, ", {} kg", short(mass_kg))?;
        }
        self.density_kg_m3.map_or(Ok(()), |density| write!(f, " ({} kg/m^3)", short(density)))
    }
}

/// Measures so far.
#[derive(Debug, Default)]
struct Measured<'e> {
    /// The boxes around what runs, in its own frame (m); `None`: it has no end.
    felt: PerShape<'e, Option<[Vector3<f64>; 2]>>,
    undrawn: PerShape<'e, Option<Remainder>>,
    volumes_m3: PerShape<'e, Option<f64>>,
    seen: SeenMeshes,
}

/// The boxes around meshes that are only seen (m), each file read once; `None`: it cannot be read, which is warned of.
#[derive(Debug, Default)]
struct SeenMeshes(BTreeMap<PathBuf, Option<[Vector3<f64>; 2]>>);

impl SeenMeshes {
    fn corners(&mut self, mesh: &MeshSpec) -> Option<[Vector3<f64>; 2]> {
        let measure = || around(model::load(&mesh.file).ok()?.vertices.into_iter());
        let corners = (*self.0.entry(mesh.file.clone()).or_insert_with(measure))?;
        let scale = Vector3::from(mesh.scale);
        around(corners.into_iter().map(|corner| corner.component_mul(&scale)))
    }
}

/// `None`: it is not drawn because it has no end.
fn undrawn(csg: &Csg) -> Option<Remainder> {
    csg.has_end().then(|| Remainder::of(csg))
}

/// Of a thing's length.
const ROUNDING: f64 = 1e-9;

/// Four digits.
pub(super) fn short(number: f64) -> String {
    format!("{number:.3e}").parse::<f64>().unwrap_or(number).to_string()
}

/// Opposite corners of the box around a shape in its own frame (m); `None`: it has no end.
fn corners(spec: &ShapeSpec, shape: &Shape) -> Option<[Vector3<f64>; 2]> {
    let half = match spec {
        ShapeSpec::Plane { .. } => return None,
        ShapeSpec::Box { size_m } => 0.5 * Vector3::from(*size_m),
        ShapeSpec::Sphere { radius_m } => Vector3::repeat(*radius_m),
        ShapeSpec::Ellipsoid { radii_m } => (*radii_m).into(),
        ShapeSpec::Capsule { radius_m, length_m } => {
            Vector3::new(*radius_m, radius_m + 0.5 * length_m, *radius_m)
        }
        ShapeSpec::Cylinder { radius_m, length_m } => Vector3::new(*radius_m, 0.5 * length_m, *radius_m),
        ShapeSpec::Cone { radius_bottom_m, radius_top_m, length_m } => {
            let radius_m = radius_bottom_m.max(*radius_top_m);
            Vector3::new(radius_m, 0.5 * length_m, radius_m)
        }
        ShapeSpec::Torus { ring_radius_m, tube_radius_m } => {
            Vector3::new(ring_radius_m + tube_radius_m, *tube_radius_m, ring_radius_m + tube_radius_m)
        }
        ShapeSpec::Scaled { shape: inner, scale } if spec.is_closed_form() => {
            let scale = Vector3::from(*scale);
            return corners(inner, shape).map(|corners| corners.map(|corner| corner.component_mul(&scale)));
        }
        _ => return drawn_corners(spec, shape),
    };
    Some([-half, half])
}

fn drawn_corners(spec: &ShapeSpec, shape: &Shape) -> Option<[Vector3<f64>; 2]> {
    if let Shape::Mesh(mesh) = shape {
        return around(mesh.vertices().iter().copied());
    }
    bounding_ball(shape)?;
    around(triangles(spec, Some(shape))?.places.iter().map(|place| place.coords))
}

pub(super) fn around(mut points: impl Iterator<Item = Vector3<f64>>) -> Option<[Vector3<f64>; 2]> {
    let first = points.next()?;
    Some(points.fold([first; 2], |[least, most], point| [least.inf(&point), most.sup(&point)]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rig::HandMode;
    use std::path::Path;
    use world::Scene;

    /// A rig of a finger and these entities.
    fn rig(entities: &str) -> Rig {
        let file = Path::new("scene.toml");
        let scene = Scene::parse(&format!("[[finger]]\nstart_m = [0, 1, 0]\n{entities}"), file).unwrap();
        Rig::new(file, scene, None, None, HandMode::Kinematic, 1_000_000).unwrap()
    }

    /// A cube with a hole in it, of this name, and so much larger.
    fn cube_with_hole(name: &str, scale: f64) -> String {
        format!(
            "[[entity]]\nname = \"{name}\"\nposition_m = [{}, 0, 0]\n\
             shape = {{ kind = \"csg\", op = \"difference\", scale = {scale:?}, children = [\
             {{ shape = {{ kind = \"box\", size_m = [0.1, 0.1, 0.1] }} }}, \
             {{ shape = {{ kind = \"cylinder\", radius_m = 0.02, length_m = 0.2 }} }}] }}\n",
            name.len()
        )
    }

    #[test]
    fn solids_that_are_alike_are_built_and_measured_once() {
        let names = ["a", "bb", "ccc", "dddd"];
        let alike: String = names.iter().map(|name| cube_with_hole(name, 1.0)).collect();
        let rig = rig(&(alike + &cube_with_hole("other", 0.5)));
        let step = rig.fast_step().unwrap();
        let entities = step.entities();
        // Such shapes are equal if they are the same one.
        assert!(entities[1..4].iter().all(|entity| entity.shape == entities[0].shape));
        assert!(entities[4].shape != entities[0].shape);
        let mut measured = Measured::default();
        let pairs = rig.scene.entities.iter().zip(entities);
        let all: Vec<Measures> =
            pairs.map(|(spec, entity)| Measures::of(spec, entity, None, &mut measured)).collect();
        let sizes: Vec<f64> = all.iter().filter_map(Measures::length_m).collect();
        assert_eq!(measured.felt.count(), 2);
        let expected = [0.1, 0.1, 0.1, 0.1, 0.05];
        assert!(
            sizes.len() == 5 && sizes.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-9),
            "{sizes:?}"
        );
        assert_eq!(all[0].to_string(), "a: csg, 0.1 x 0.1 x 0.1 m, at (1, 0, 0) m");
    }

    #[test]
    fn numbers_are_as_short_as_four_digits_allow() {
        assert_eq!(
            [0.05, 1.0 / 3.0, 1234.56, 1e-7, 0.0].map(short),
            ["0.05", "0.3333", "1235", "0.0000001", "0"]
        );
    }
}
