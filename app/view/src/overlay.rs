//! What is drawn over a scene: fingers, where they are felt to be, forces, and what the surface is like there.
//!
//! Model: what things hide is drawn first, faintly, where its depth is greater than theirs; then what they do not hide.

use crate::moment::{ContactMoment, FingerMoment, Moment};
use crate::painter::{mask, material, matrix, mesh_of};
use crate::shapes;
use haptics::Feature;
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use std::f64::consts::PI;
use three_d::{
    Blend, Context, DepthTest, Gm, Mat4, Mesh, Object, PhysicalMaterial, RenderStates, Srgba, WriteMask,
};
use world::ShapeSpec;

/// A newton is drawn so long (m).
pub(crate) const METRES_PER_NEWTON: f64 = 0.02;
/// A finger without a radius is drawn with this one (m).
pub(crate) const POINT_RADIUS_M: f64 = 0.003;
/// Of an arrow's shaft (m); its head is three times as thick.
const SHAFT_RADIUS_M: f64 = 0.0012;
/// Of the line along a contact's normal (m).
const NORMAL_M: f64 = 0.03;
const NORMAL_RADIUS_M: f64 = 0.0006;
/// Of the friction circle's line (m).
const CIRCLE_RADIUS_M: f64 = 0.0006;
/// What is left of the opacity of what things hide.
const HIDDEN: f32 = 0.3;

const HIP: [f64; 4] = [0.15, 0.55, 0.2, 0.55];
const GOD: [f64; 4] = [0.85, 0.15, 0.1, 1.0];
const FORCE: [f64; 4] = [0.95, 0.75, 0.05, 1.0];

/// Contacts on smooth surfaces are blue, on faces cyan, on edges orange, on vertices magenta.
fn colour_of(feature: Feature) -> Srgba {
    match feature {
        Feature::None | Feature::Surface => Srgba::new_opaque(40, 80, 230),
        Feature::Face => Srgba::new_opaque(0, 190, 210),
        Feature::Edge => Srgba::new_opaque(240, 110, 0),
        Feature::Vertex => Srgba::new_opaque(210, 0, 200),
    }
}

struct Model {
    drawn: Gm<Mesh, PhysicalMaterial>,
    is_seen: bool,
    opacity: u8,
}

/// The models of all fingers.
pub(crate) struct Overlay {
    fingers: Vec<FingerModels>,
}

struct FingerModels {
    context: Context,
    /// 0 for a point.
    radius_m: f64,
    hip: Model,
    god: Model,
    shaft: Model,
    head: Model,
    normal: Model,
    circle: Model,
    circle_radius_m: f64,
}

impl Overlay {
    pub(crate) fn new(context: &Context, radii_m: &[f64]) -> Self {
        Self { fingers: radii_m.iter().map(|radius_m| FingerModels::new(context, *radius_m)).collect() }
    }

    pub(crate) fn place(&mut self, moment: &Moment) {
        self.fingers.iter_mut().flat_map(FingerModels::all).for_each(|model| model.is_seen = false);
        for (models, finger) in self.fingers.iter_mut().zip(&moment.fingers) {
            models.place(finger);
        }
    }

    /// Lets only these of red, green and blue be drawn, and only what things hide, or what they do not.
    pub(crate) fn show(&mut self, channels: [bool; 3], is_hidden: bool) {
        for model in self.fingers.iter_mut().flat_map(FingerModels::all) {
            model.show(is_hidden);
            mask(&mut model.drawn.material, channels);
        }
    }

    pub(crate) fn objects(&self) -> impl Iterator<Item = &dyn Object> {
        let models =
            self.fingers.iter().flat_map(|FingerModels { hip, god, shaft, head, normal, circle, .. }| {
                [god, shaft, head, normal, circle, hip]
            });
        models.filter(|model| model.is_seen).map(|model| &model.drawn as &dyn Object)
    }
}

impl Model {
    fn new(context: &Context, shape: &ShapeSpec, colour: [f64; 4]) -> Self {
        // A closed form has its picture.
        let triangles = shapes::triangles(shape, None).unwrap_or_default();
        let drawn =
            Gm::new(Mesh::new(context, &mesh_of(&triangles)), material(context, colour, colour[3] < 1.0));
        let opacity = drawn.material.albedo.a;
        Self { drawn, is_seen: false, opacity }
    }

    fn put(&mut self, at: Mat4) {
        self.drawn.set_transformation(at);
        self.is_seen = true;
    }

    fn show(&mut self, is_hidden: bool) {
        let opacity = f32::from(self.opacity) * if is_hidden { HIDDEN } else { 1.0 };
        let is_transparent = opacity < 255.0;
        let material = &mut self.drawn.material;
        material.albedo.a = opacity as u8;
        material.is_transparent = is_transparent;
        material.render_states = RenderStates {
            depth_test: if is_hidden { DepthTest::Greater } else { DepthTest::Less },
            write_mask: if is_transparent { WriteMask::COLOR } else { WriteMask::COLOR_AND_DEPTH },
            blend: if is_transparent { Blend::TRANSPARENCY } else { Blend::Disabled },
            ..RenderStates::default()
        };
    }
}

impl FingerModels {
    fn new(context: &Context, radius_m: f64) -> Self {
        let model = |shape: &ShapeSpec, colour| Model::new(context, shape, colour);
        let ball = || ShapeSpec::Sphere { radius_m: 1.0 };
        let line = || ShapeSpec::Cylinder { radius_m: 1.0, length_m: 1.0 };
        Self {
            context: context.clone(),
            radius_m,
            hip: model(&ball(), HIP),
            god: model(&ball(), GOD),
            shaft: model(&line(), FORCE),
            head: model(&ShapeSpec::Cone { radius_bottom_m: 1.0, radius_top_m: 0.0, length_m: 1.0 }, FORCE),
            normal: model(&line(), GOD),
            circle: model(&ball(), GOD),
            circle_radius_m: 0.0,
        }
    }

    fn all(&mut self) -> [&mut Model; 6] {
        let Self { hip, god, shaft, head, normal, circle, .. } = self;
        [hip, god, shaft, head, normal, circle]
    }

    fn place(&mut self, finger: &FingerMoment) {
        let seen_m = self.radius_m.max(POINT_RADIUS_M);
        let ball = |at: &Vector3<f64>, radius_m: f64| {
            at_size(at, &UnitQuaternion::identity(), &Vector3::repeat(radius_m))
        };
        self.hip.put(ball(&finger.hip, seen_m));
        if finger.entity.is_some() {
            self.god.put(ball(&finger.god_object, 0.95 * seen_m));
        }
        let long_m = METRES_PER_NEWTON * finger.force.norm();
        if long_m > 1e-4 {
            self.point(&finger.god_object, &finger.force.normalize(), long_m);
        }
        if let Some(contact) = &finger.contact {
            self.mark(finger, contact);
        }
    }

    /// Draws what the surface is like.
    fn mark(&mut self, finger: &FingerMoment, contact: &ContactMoment) {
        let ContactMoment { normal, friction_radius_m, feature } = contact;
        let turned = turned_to(normal);
        let touched = finger.god_object - normal * self.radius_m;
        let size = Vector3::new(NORMAL_RADIUS_M, NORMAL_M, NORMAL_RADIUS_M);
        self.normal.put(at_size(&(touched + normal * (0.5 * NORMAL_M)), &turned, &size));
        self.normal.drawn.material.albedo = colour_of(*feature);
        let Some(radius_m) = friction_radius_m.filter(|radius_m| *radius_m > CIRCLE_RADIUS_M) else { return };
        self.bend(radius_m);
        let foot = finger.hip + normal * normal.dot(&(finger.god_object - finger.hip));
        self.circle.put(at_size(&(foot - normal * self.radius_m), &turned, &Vector3::repeat(1.0)));
        self.circle.drawn.material.albedo = colour_of(*feature);
    }

    /// A circle that is scaled would have a thicker line.
    fn bend(&mut self, radius_m: f64) {
        if (radius_m - self.circle_radius_m).abs() > 0.01 * radius_m {
            let ring = ShapeSpec::Torus { ring_radius_m: radius_m, tube_radius_m: CIRCLE_RADIUS_M };
            let triangles = shapes::triangles(&ring, None).unwrap_or_default();
            self.circle.drawn.geometry = Mesh::new(&self.context, &mesh_of(&triangles));
            self.circle_radius_m = radius_m;
        }
    }

    /// Draws an arrow from here.
    fn point(&mut self, from: &Vector3<f64>, way: &Vector3<f64>, long_m: f64) {
        let turned = turned_to(way);
        let head_m = (8.0 * SHAFT_RADIUS_M).min(0.5 * long_m);
        let shaft_m = long_m - head_m;
        let thick = |radius_m: f64, long_m: f64| Vector3::new(radius_m, long_m, radius_m);
        let shaft = at_size(&(from + way * (0.5 * shaft_m)), &turned, &thick(SHAFT_RADIUS_M, shaft_m));
        let head =
            at_size(&(from + way * (shaft_m + 0.5 * head_m)), &turned, &thick(3.0 * SHAFT_RADIUS_M, head_m));
        self.shaft.put(shaft);
        self.head.put(head);
    }
}

/// From y to there.
fn turned_to(way: &Vector3<f64>) -> UnitQuaternion<f64> {
    UnitQuaternion::rotation_between(&Vector3::y(), way)
        .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector3::x_axis(), PI))
}

fn at_size(at: &Vector3<f64>, turned: &UnitQuaternion<f64>, size: &Vector3<f64>) -> Mat4 {
    let [x, y, z] = [size.x, size.y, size.z].map(|part| part as f32);
    matrix(&Isometry3::from_parts((*at).into(), *turned)) * Mat4::from_nonuniform_scale(x, y, z)
}
