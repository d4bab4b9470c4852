//! Points of a closed form that may touch a mesh.
//!
//! Numbers: corners of a box 0 to 7; four of each rim; ends of an axis; else 0. Those of another mesh are its vertices.

use haptics::Form;
use nalgebra::{Isometry3, Point3, Vector3};

use super::PATCH_POINTS;
use super::convex::{Convex, Core};
use super::mesh_corner::Corner;

/// A point of the other one that may touch the mesh: the middle of a ball.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Own {
    pub(super) number: u32,
    pub(super) at_M: Vector3<f64>,
    pub(super) radius_m: f64,
    /// Of a mesh, which one.
    pub(super) corner: Option<Corner>,
}

/// Points of its own that look at the mesh.
pub(super) type Owns = [Option<Own>; PATCH_POINTS];

/// Those of a form that is placed there, seen this way.
pub(super) fn owns_of_form(form: &Form, X_MO: &Isometry3<f64>, way_M: &Vector3<f64>) -> Owns {
    let way = X_MO.inverse_transform_vector(way_M);
    let mut owns = Points { owns: [None; PATCH_POINTS], count: 0, X_MO };
    match form {
        Form::Sphere(sphere) => owns.push(0, Vector3::zeros(), sphere.radius_m()),
        Form::Cuboid(cuboid) => {
            let half = Vector3::from(cuboid.size_m()) * 0.5;
            for corner in 0..8_u32 {
                let sign = |bit: u32| if corner >> bit & 1 == 1 { 1.0 } else { -1.0 };
                owns.push(corner, half.component_mul(&Vector3::new(sign(0), sign(1), sign(2))), 0.0);
            }
        }
        Form::Capsule(capsule) => {
            for (end, sign) in [(0, 0.5), (1, -0.5)] {
                owns.push(end, Vector3::y() * (sign * capsule.length_m()), capsule.radius_m());
            }
        }
        Form::Cylinder(c) => {
            owns.rim(0, 0.5 * c.length_m(), c.radius_m(), 0.0, &way);
            owns.rim(4, -0.5 * c.length_m(), c.radius_m(), 0.0, &way);
        }
        Form::Cone(c) => {
            owns.rim(0, 0.5 * c.length_m(), c.radius_top_m(), 0.0, &way);
            owns.rim(4, -0.5 * c.length_m(), c.radius_bottom_m(), 0.0, &way);
        }
        Form::Torus(t) => owns.rim(0, 0.0, t.ring_radius_m(), t.tube_radius_m(), &way),
        _ => {
            if let Some(convex) = Convex::of(form, &Isometry3::identity()) {
                match convex.core {
                    Core::Segment { .. } | Core::Ellipsoid { .. } => {
                        owns.push(0, convex.support(&way), 0.0);
                    }
                    _ => (0..8_u32).for_each(|number| {
                        let part = |bit: u32| if number >> bit & 1 == 1 { 0.3 } else { -0.3 };
                        let aside = Vector3::new(part(0), part(1), part(2));
                        owns.push(number, convex.support(&(way + aside)), 0.0);
                    }),
                }
            }
        }
    }
    owns.owns
}

struct Points<'p> {
    owns: Owns,
    count: usize,
    X_MO: &'p Isometry3<f64>,
}

impl Points<'_> {
    fn push(&mut self, number: u32, at: Vector3<f64>, radius_m: f64) {
        if let Some(place) = self.owns.get_mut(self.count) {
            *place =
                Some(Own { number, at_M: (self.X_MO * Point3::from(at)).coords, radius_m, corner: None });
            self.count += 1;
        }
    }

    /// Four of a rim around the y axis, of which one looks there most.
    fn rim(&mut self, first: u32, y: f64, ring_m: f64, tube_m: f64, way: &Vector3<f64>) {
        if ring_m == 0.0 {
            self.push(first, Vector3::y() * y, tube_m);
            return;
        }
        let across = Vector3::new(way.x, 0.0, way.z);
        // Lying flat, none does: then the same as ever.
        let toward = if across.norm() > FLAT { across.normalize() } else { Vector3::x() };
        let beside = Vector3::y().cross(&toward);
        for (quarter, out) in [toward, beside, -toward, -beside].into_iter().enumerate() {
            self.push(first + quarter as u32, Vector3::y() * y + out * ring_m, tube_m);
        }
    }
}

/// Tilted by less, a rim lies flat \[rad\].
const FLAT: f64 = 1e-4;
