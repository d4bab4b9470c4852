//! Balls around entities: what two of them are asked first.

use haptics::{Form, Shape};
use nalgebra::Vector3;

use super::mesh;

/// A ball around an entity: its centre in the entity's frame and its radius (m); `None` where it has no end or nobody
/// knows it.
pub fn bounding_ball(shape: &Shape) -> Option<(Vector3<f64>, f64)> {
    match shape {
        Shape::Form(form) => Some((Vector3::zeros(), radius_m(form)?)),
        Shape::Mesh(mesh) => mesh::bounding_ball(mesh),
        Shape::Csg(csg) => around(csg.extent_m()).filter(|_| csg.has_end()),
        Shape::Nurbs(nurbs) => around(nurbs.extent_m()),
        Shape::Own(_) => None,
    }
}

/// Around all that has no coordinate larger than this.
fn around(extent_m: f64) -> Option<(Vector3<f64>, f64)> {
    Some((Vector3::zeros(), extent_m * 3.0_f64.sqrt())).filter(|(_, radius_m)| radius_m.is_finite())
}

/// Around the origin of the form's frame.
fn radius_m(form: &Form) -> Option<f64> {
    Some(match form {
        Form::Plane(_) => return None,
        Form::Sphere(sphere) => sphere.radius_m(),
        Form::Cuboid(cuboid) => 0.5 * Vector3::from(cuboid.size_m()).norm(),
        Form::Cylinder(c) => c.radius_m().hypot(0.5 * c.length_m()),
        Form::Cone(c) => c.radius_bottom_m().max(c.radius_top_m()).hypot(0.5 * c.length_m()),
        Form::Capsule(c) => c.radius_m() + 0.5 * c.length_m(),
        Form::Torus(t) => t.ring_radius_m() + t.tube_radius_m(),
        Form::Ellipsoid(ellipsoid) => Vector3::from(ellipsoid.radii_m()).max(),
        // No point of it is moved farther than by the largest factor.
        Form::Scaled(scaled) => radius_m(&scaled.unscaled())? * Vector3::from(scaled.factors()).max(),
    })
}
