//! What a recording shows in three dimensions: the scene once, fingers and objects as they move.
//!
//! Model: every entity is drawn once in a frame of its own; that of an entity which moves is told anew many times a
//! second. Fingers are a ball at the HIP, a ball at the god-object and an arrow for the force on the user; where they touch,
//! an arrow along the normal and the friction circle.
//! Boxes, balls, cylinders and what is made of them are drawn exactly, everything else in triangles up to a limit.

use super::destination::RunFormat;
use super::foxglove::{Rgba, WORLD, arrow, cube, cylinder, frame_in_world, scene_entity, sphere, triangles};
use super::wire::Message;
use crate::columns::Names;
use crate::displaced::Placed;
use crate::per_shape::PerShape;
use crate::row::{BodyRow, FingerRow, Row};
use haptics::{Entity, Shape};
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use std::f64::consts::TAU;
use std::path::PathBuf;
use std::sync::Arc;
use view::Triangles;
use world::{Scene, ShapeSpec};

/// Triangles of a mesh that are drawn at most: a picture for people, and a megabyte and a half of the file.
const MOST_FACES: usize = 50_000;
/// How far a plane is drawn to each side (m).
const PLANE_REACH_M: f64 = 0.25;
/// A newton is drawn so long (m).
const METRES_PER_NEWTON: f64 = 0.02;
/// A finger without a radius is drawn with this one (m).
const POINT_RADIUS_M: f64 = 0.002;

/// A part of the scene's picture has so many bytes at most; an entity takes less (`MOST_FACES`).
const MOST_PART_BYTES: usize = 24 << 20;

const SOLID: Rgba = [0.55, 0.65, 0.75, 1.0];
const MOVING: Rgba = [0.85, 0.65, 0.35, 1.0];
const HIP: Rgba = [0.3, 0.8, 0.3, 0.5];
const GOD: Rgba = [0.9, 0.2, 0.2, 1.0];
const FORCE: Rgba = [0.9, 0.2, 0.2, 0.8];
const CIRCLE: Rgba = [0.15, 0.3, 0.9, 0.5];
/// So long is a contact's normal (m).
const NORMAL_M: f64 = 0.03;

/// What is drawn.
#[derive(Debug, Clone, Default)]
pub struct View {
    /// All entities, as one `foxglove.SceneUpdate` or, if that is too large, as several. One copy serves all recordings.
    pub(super) scene: Arc<[Vec<u8>]>,
    /// A `foxglove.FrameTransforms` of all that does not move by itself, where it is at first.
    pub(super) fixed: Arc<[u8]>,
    /// Names of the entities, where there is a picture.
    names: Arc<[String]>,
    /// Radius of each finger (m); 0 for a point.
    radii_m: Vec<f64>,
}

impl View {
    /// Of a scene, as it is rendered; its picture is made only for recordings that have one, for it may take long and much memory.
    pub fn new(scene: &Scene, entities: &[Entity], has_picture: bool) -> Self {
        let picture = || drawn(scene, entities, &mut Drawn::default(), MOST_PART_BYTES);
        let names = || scene.entities.iter().map(|spec| spec.name.clone()).collect::<Vec<_>>();
        Self {
            fixed: if has_picture { fixed(scene).into_bytes() } else { Vec::new() }.into(),
            names: has_picture.then(names).unwrap_or_default().into(),
            scene: has_picture.then(picture).unwrap_or_default().into(),
            radii_m: scene.fingers.iter().map(|finger| finger.radius_m).collect(),
        }
    }

    /// A `foxglove.FrameTransforms` of these bodies by their numbers, and of all fingers.
    pub(super) fn frames(
        &self,
        out: &mut Message,
        time_ns: u64,
        row: &Row,
        (bodies, seen): (&[BodyRow], impl Iterator<Item = usize>),
        names: &Names,
    ) {
        for (body, name) in seen.map(|at| (&bodies[at], &names.bodies[at])) {
            frame_in_world(out, time_ns, &frame_of(name), &body.position, &body.orientation);
        }
        for (finger, name) in row.fingers.iter().zip(&names.fingers) {
            let [w, x, y, z] = finger.orientation_wxyz;
            let turned = if finger.has_orientation { [w, x, y, z] } else { [1.0, 0.0, 0.0, 0.0] };
            let turned = nalgebra::Quaternion::new(turned[0], turned[1], turned[2], turned[3]);
            frame_in_world(out, time_ns, &format!("finger/{name}"), &finger.hip, &turned);
        }
    }

    /// A `foxglove.FrameTransforms` of what is no body and has been moved.
    pub(super) fn moved(&self, out: &mut Message, time_ns: u64, placed: &[Placed]) {
        for (entity, pose) in placed {
            if let Some(name) = self.names.get(*entity as usize) {
                let Isometry3 { translation, rotation } = pose;
                frame_in_world(out, time_ns, &frame_of(name), &translation.vector, rotation);
            }
        }
    }

    /// A `foxglove.SceneUpdate` of the fingers.
    pub(super) fn fingers(&self, out: &mut Message, time_ns: u64, row: &Row, names: &Names) {
        for ((finger, name), radius_m) in row.fingers.iter().zip(&names.fingers).zip(&self.radii_m) {
            scene_entity(out, time_ns, WORLD, &format!("finger/{name}"), |out| {
                let at = |p: Vector3<f64>| Isometry3::translation(p.x, p.y, p.z);
                let ball = Vector3::repeat(2.0 * radius_m.max(POINT_RADIUS_M));
                sphere(out, &at(finger.hip), ball, HIP);
                if finger.entity.is_some() {
                    sphere(out, &at(finger.god_object), 0.9 * ball, GOD);
                }
                if finger.normal != Vector3::zeros() {
                    touched(out, finger, *radius_m);
                }
                let length = METRES_PER_NEWTON * finger.force_on_user;
                if length.norm() > 0.0 {
                    arrow(out, &finger.hip, &length, 0.001, FORCE);
                }
            });
        }
    }
}

/// True if one of these recordings has a picture of the scene.
pub fn shows_scene(files: &[PathBuf]) -> bool {
    files.iter().any(|file| RunFormat::of(file).is_ok_and(|format| format == RunFormat::Mcap))
}

/// A `foxglove.SceneUpdate` of all entities; several, if it would have more bytes than this. An entity is in one of them.
fn drawn<'e>(scene: &Scene, entities: &'e [Entity], made: &mut Drawn<'e>, most_bytes: usize) -> Vec<Vec<u8>> {
    let (mut parts, mut out) = (Vec::new(), Message::new());
    for (spec, entity) in scene.entities.iter().zip(entities) {
        let rgba = if spec.motion.is_some() { MOVING } else { SOLID };
        let before = out.bytes().len();
        scene_entity(&mut out, 0, &frame_of(&spec.name), &spec.name, |out| {
            draw(out, &spec.shape, &entity.shape, made, (&Isometry3::identity(), rgba));
        });
        if before > 0 && out.bytes().len() > most_bytes {
            parts.push(out.cut(before));
        }
    }
    parts.push(out.into_bytes());
    parts
}

/// A `foxglove.FrameTransforms` of all entities that do not move by themselves: orders may move them.
fn fixed(scene: &Scene) -> Message {
    let mut out = Message::new();
    for spec in scene.entities.iter().filter(|spec| spec.motion.is_none()) {
        let Isometry3 { translation, rotation } = &spec.pose;
        frame_in_world(&mut out, 0, &frame_of(&spec.name), &translation.vector, rotation);
    }
    out
}

/// What the surface is like where a finger of this radius touches it: the normal, and the friction circle in the tangent plane.
fn touched(out: &mut Message, finger: &FingerRow, radius_m: f64) {
    let FingerRow { normal, god_object, hip, friction_radius_m, .. } = finger;
    arrow(out, god_object, &(NORMAL_M * normal), 0.0006, CIRCLE);
    if *friction_radius_m > 0.0 {
        let up = UnitQuaternion::rotation_between(&Vector3::y(), normal)
            .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 0.5 * TAU));
        let foot = hip + normal * (normal.dot(&(god_object - hip)) - radius_m);
        cylinder(out, &Isometry3::from_parts(foot.into(), up), [*friction_radius_m; 2], 2e-4, CIRCLE);
    }
}

/// No object's frame is called as the world's, however the object is called.
fn frame_of(object: &str) -> String {
    format!("object/{object}")
}

/// Triangles made so far; `None`: a shape has none.
type Drawn<'e> = PerShape<'e, Option<Arc<Triangles>>>;

/// Draws a shape somewhere in a colour; `felt` has what files hold of it.
fn draw<'e>(
    out: &mut Message,
    shape: &ShapeSpec,
    felt: &'e Shape,
    made: &mut Drawn<'e>,
    (at, rgba): (&Isometry3<f64>, Rgba),
) {
    match shape {
        ShapeSpec::Plane { normal, offset_m } => {
            let turned = UnitQuaternion::rotation_between(&Vector3::y(), normal)
                .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 0.5 * TAU));
            let thin = 1e-3;
            let middle = normal.into_inner() * (offset_m - 0.5 * thin);
            let pose = at * Isometry3::from_parts(middle.into(), turned);
            cube(out, &pose, Vector3::new(2.0 * PLANE_REACH_M, thin, 2.0 * PLANE_REACH_M), rgba);
        }
        ShapeSpec::Sphere { radius_m } => sphere(out, at, Vector3::repeat(2.0 * radius_m), rgba),
        ShapeSpec::Ellipsoid { radii_m } => sphere(out, at, 2.0 * Vector3::from(*radii_m), rgba),
        ShapeSpec::Box { size_m } => cube(out, at, (*size_m).into(), rgba),
        ShapeSpec::Cylinder { radius_m, length_m } => cylinder(out, at, [*radius_m; 2], *length_m, rgba),
        ShapeSpec::Cone { radius_bottom_m, radius_top_m, length_m } => {
            cylinder(out, at, [*radius_bottom_m, *radius_top_m], *length_m, rgba);
        }
        ShapeSpec::Capsule { radius_m, length_m } => {
            if *length_m > 0.0 {
                cylinder(out, at, [*radius_m; 2], *length_m, rgba);
            }
            for end in [-0.5 * length_m, 0.5 * length_m] {
                sphere(out, &(at * Translation3::new(0.0, end, 0.0)), Vector3::repeat(2.0 * radius_m), rgba);
            }
        }
        ShapeSpec::Mesh(_) => draw_mesh(out, felt, at, rgba),
        // What has no form of its own there, as pictures have it.
        other => {
            let make = || view::shapes::triangles(other, Some(felt)).map(Arc::new);
            if let Some(looks) = made.of(felt, make).filter(|looks| looks.corners.len() <= MOST_FACES) {
                let places = looks.places.iter().map(|place| place.coords);
                triangles(out, at, places, looks.corners.as_flattened(), rgba);
            }
        }
    }
}

fn draw_mesh(out: &mut Message, felt: &Shape, at: &Isometry3<f64>, rgba: Rgba) {
    let Shape::Mesh(mesh) = felt else { return };
    if mesh.faces().len() > MOST_FACES {
        return;
    }
    let indices: Vec<u32> = mesh.faces().iter().flat_map(|face| face.vertices).collect();
    triangles(out, at, mesh.vertices().iter().copied(), &indices, rgba);
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;
    use world::CsgOp;

    #[test]
    fn what_has_no_picture_of_the_scene_makes_none() {
        let text = "[[finger]]\n[[entity]]\nname = \"a\"\nshape = { kind = \"sphere\", radius_m = 0.05 }\n";
        let scene = Scene::parse(text, Path::new("scene.toml")).unwrap();
        let ball = haptics::Sphere::new(0.05).unwrap();
        let entities = [Entity::new(ball, Isometry3::identity(), 1000.0).unwrap()];
        assert_eq!(View::new(&scene, &entities, true).scene.len(), 1);
        let without = View::new(&scene, &entities, false);
        assert_eq!((without.scene.len(), without.radii_m.len()), (0, 1));
        let of = |files: &[&str]| shows_scene(&files.iter().map(|file| (*file).into()).collect::<Vec<_>>());
        assert_eq!([of(&[]), of(&["a.csv", "-"]), of(&["a.csv", "b.mcap"])], [false, false, true]);
    }

    #[test]
    fn the_triangles_of_a_solid_are_made_once_for_all_that_have_it() {
        let entity = |name: &str| {
            format!(
                "[[entity]]\nname = \"{name}\"\nshape = {{ kind = \"csg\", op = \"union\", children = [\
                 {{ shape = {{ kind = \"sphere\", radius_m = 0.05 }} }}] }}\n"
            )
        };
        let text = format!("[[finger]]\n{}{}{}", entity("a"), entity("b"), entity("c"));
        let scene = Scene::parse(&text, Path::new("scene.toml")).unwrap();
        assert!(matches!(&scene.entities[0].shape, ShapeSpec::Csg(spec) if spec.op == CsgOp::Union));
        let ball = haptics::Sphere::new(0.05).unwrap();
        let csg = || Arc::new(haptics::Csg::build(&haptics::CsgTree::union([ball])).unwrap());
        let entity = |csg: &Arc<_>| Entity::new(Arc::clone(csg), Isometry3::identity(), 1000.0).unwrap();
        let (shared, own) = (csg(), csg());
        let entities = [entity(&shared), entity(&shared), entity(&own)];
        let mut made = Drawn::default();
        let all = drawn(&scene, &entities, &mut made, usize::MAX);
        assert_eq!(made.count(), 2);
        let alone = [entity(&own), entity(&own), entity(&own)];
        assert_eq!(all, drawn(&scene, &alone, &mut Drawn::default(), usize::MAX));
        let [all] = &all[..] else { panic!("{} parts", all.len()) };
        // All have names of one letter.
        let each = all.len() / 3;
        for (most_bytes, parts) in [(0, 3), (each, 3), (2 * each, 2), (3 * each - 1, 2), (3 * each, 1)] {
            let cut = drawn(&scene, &alone, &mut Drawn::default(), most_bytes);
            assert_eq!((cut.len(), &cut.concat()), (parts, all), "{most_bytes}");
            assert!(cut.iter().all(|part| part.len() <= most_bytes.max(each)), "{most_bytes}");
        }
        assert_eq!(drawn(&scene, &[], &mut Drawn::default(), 0), [Vec::<u8>::new()], "an empty one");
    }
}
