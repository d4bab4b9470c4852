//! What is drawn over a scene: fingers, where they are felt to be, and forces.

use crate::moment::Moment;
use crate::painter::{mask, material, matrix, mesh_of};
use crate::shapes;
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use std::f64::consts::PI;
use three_d::{Context, Gm, Mat4, Mesh, Object, PhysicalMaterial};
use world::ShapeSpec;

/// A newton is drawn so long (m).
pub(crate) const METRES_PER_NEWTON: f64 = 0.02;
/// A finger without a radius is drawn with this one (m).
pub(crate) const POINT_RADIUS_M: f64 = 0.003;
/// Of an arrow's shaft (m); its head is three times as thick.
const SHAFT_RADIUS_M: f64 = 0.0012;

const HIP: [f64; 4] = [0.15, 0.55, 0.2, 0.55];
const GOD: [f64; 4] = [0.85, 0.15, 0.1, 1.0];
const FORCE: [f64; 4] = [0.95, 0.75, 0.05, 1.0];

type Model = Gm<Mesh, PhysicalMaterial>;

/// The models of all fingers.
pub(crate) struct Overlay {
    fingers: Vec<FingerModels>,
}

struct FingerModels {
    radius_m: f64,
    hip: Model,
    god: Model,
    shaft: Model,
    head: Model,
    is_touching: bool,
    is_pushed: bool,
}

impl Overlay {
    pub(crate) fn new(context: &Context, radii_m: &[f64]) -> Self {
        let model = |shape: ShapeSpec, colour| {
            // A closed form has its picture.
            let triangles = shapes::triangles(&shape, None).unwrap_or_default();
            Gm::new(Mesh::new(context, &mesh_of(&triangles)), material(context, colour))
        };
        let finger = |radius_m: &f64| FingerModels {
            radius_m: radius_m.max(POINT_RADIUS_M),
            hip: model(ShapeSpec::Sphere { radius_m: 1.0 }, HIP),
            god: model(ShapeSpec::Sphere { radius_m: 1.0 }, GOD),
            shaft: model(ShapeSpec::Cylinder { radius_m: 1.0, length_m: 1.0 }, FORCE),
            head: model(ShapeSpec::Cone { radius_bottom_m: 1.0, radius_top_m: 0.0, length_m: 1.0 }, FORCE),
            is_touching: false,
            is_pushed: false,
        };
        Self { fingers: radii_m.iter().map(finger).collect() }
    }

    pub(crate) fn place(&mut self, moment: &Moment) {
        for (models, finger) in self.fingers.iter_mut().zip(&moment.fingers) {
            let ball = |at: &Vector3<f64>, radius_m: f64| {
                at_size(at, &UnitQuaternion::identity(), &Vector3::repeat(radius_m))
            };
            models.hip.set_transformation(ball(&finger.hip, models.radius_m));
            models.god.set_transformation(ball(&finger.god_object, 0.95 * models.radius_m));
            models.is_touching = finger.entity.is_some();
            let long_m = METRES_PER_NEWTON * finger.force.norm();
            models.is_pushed = long_m > 1e-4;
            if models.is_pushed {
                models.point(&finger.god_object, &finger.force.normalize(), long_m);
            }
        }
    }

    /// Lets only these of red, green and blue be drawn.
    pub(crate) fn mask(&mut self, channels: [bool; 3]) {
        for FingerModels { hip, god, shaft, head, .. } in &mut self.fingers {
            [hip, god, shaft, head].into_iter().for_each(|model| mask(&mut model.material, channels));
        }
    }

    pub(crate) fn objects(&self) -> impl Iterator<Item = &dyn Object> {
        self.fingers.iter().flat_map(|models| {
            let touching = models.is_touching.then_some(&models.god as &dyn Object);
            let pushed = models.is_pushed.then_some([&models.shaft as &dyn Object, &models.head]);
            touching.into_iter().chain(pushed.into_iter().flatten()).chain([&models.hip as &dyn Object])
        })
    }
}

impl FingerModels {
    /// Draws an arrow from here.
    fn point(&mut self, from: &Vector3<f64>, way: &Vector3<f64>, long_m: f64) {
        let turned = UnitQuaternion::rotation_between(&Vector3::y(), way)
            .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector3::x_axis(), PI));
        let head_m = (8.0 * SHAFT_RADIUS_M).min(0.5 * long_m);
        let shaft_m = long_m - head_m;
        let thick = |radius_m: f64, long_m: f64| Vector3::new(radius_m, long_m, radius_m);
        let shaft = at_size(&(from + way * (0.5 * shaft_m)), &turned, &thick(SHAFT_RADIUS_M, shaft_m));
        let head =
            at_size(&(from + way * (shaft_m + 0.5 * head_m)), &turned, &thick(3.0 * SHAFT_RADIUS_M, head_m));
        self.shaft.set_transformation(shaft);
        self.head.set_transformation(head);
    }
}

fn at_size(at: &Vector3<f64>, turned: &UnitQuaternion<f64>, size: &Vector3<f64>) -> Mat4 {
    let [x, y, z] = [size.x, size.y, size.z].map(|part| part as f32);
    matrix(&Isometry3::from_parts((*at).into(), *turned)) * Mat4::from_nonuniform_scale(x, y, z)
}
