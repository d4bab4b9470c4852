//! The classic god-object of Zilles and Salisbury, as a yardstick.
//!
//! Model: without friction the god-object is the surface point nearest to the HIP (Melder ch. 8.1
//! says that the Friction Cone Algorithm must reduce to it when both coefficients are zero). It is
//! written from the shapes' equations, on purpose without [`crate::Surface`], so that comparing
//! the two means something.

use nalgebra::Vector3;

use crate::shape::{Form, Shape};

/// The frictionless god-object of a point in the shape's frame, or `None` outside.
///
/// At a sphere's centre it is the topmost point (+y).
pub fn classic_god_object(shape: &Shape, hip_B: &Vector3<f64>) -> Option<Vector3<f64>> {
    match shape {
        Shape::Form(Form::Plane(plane)) => {
            let (normal_B, offset_m) = (plane.normal_B(), plane.offset_m());
            let depth_m = offset_m - normal_B.dot(hip_B);
            (depth_m >= 0.0).then(|| hip_B + normal_B * depth_m)
        }
        Shape::Form(Form::Sphere(sphere)) => {
            let (r, rho) = (sphere.radius_m(), hip_B.norm());
            let at = if rho > 0.0 { hip_B * (r / rho) } else { Vector3::y() * r };
            (rho <= r).then_some(at)
        }
        Shape::Form(_) | Shape::Mesh(_) | Shape::Own(_) => None,
    }
}
