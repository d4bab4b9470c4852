//! Shapes drawn out along the axes of their frame (Melder ch. 7.4.7).
//!
//! Most results are shapes of a known kind: a drawn-out ball is an ellipsoid, a box stays a box. Those are returned as
//! what they are, so that they are felt exactly and by every finger that feels their kind. What is left is
//! [`ShapeSpec::Scaled`].

use nalgebra::{Unit, Vector3};

use crate::shape::ShapeSpec;

/// What a scale may be, for messages.
pub(crate) const IN_SIZE: &str = "factors whose product with every size of the shape is a finite number above 0";

/// `shape` times `scale` (all above 0); `None` if a size leaves the range of numbers.
pub(crate) fn scaled(shape: ShapeSpec, scale: [f64; 3]) -> Option<ShapeSpec> {
    let scaled = match shape {
        ShapeSpec::Plane { normal, offset_m } => return scaled_plane(&normal, offset_m, scale),
        ShapeSpec::Box { size_m } => ShapeSpec::Box { size_m: product(size_m, scale) },
        ShapeSpec::Ellipsoid { radii_m } => ShapeSpec::Ellipsoid { radii_m: product(radii_m, scale) },
        ShapeSpec::Mesh(mesh) => {
            let scale = product(mesh.scale, scale);
            ShapeSpec::Mesh(crate::shape::MeshSpec { scale, ..mesh })
        }
        shape => scaled_round(shape, scale),
    };
    sizes(&scaled).into_iter().all(|size| size.is_normal()).then_some(scaled)
}

/// Shapes with circles: these stay circles only where both of their directions are drawn out alike.
fn scaled_round(shape: ShapeSpec, scale: [f64; 3]) -> ShapeSpec {
    let [x, y, z] = scale;
    let (keeps_circles_about_y, is_uniform) = (x == z, x == y && y == z);
    match shape {
        ShapeSpec::Sphere { radius_m } if is_uniform => ShapeSpec::Sphere { radius_m: radius_m * x },
        ShapeSpec::Sphere { radius_m } => ShapeSpec::Ellipsoid { radii_m: scale.map(|s| radius_m * s) },
        ShapeSpec::Cylinder { radius_m, length_m } if keeps_circles_about_y => {
            ShapeSpec::Cylinder { radius_m: radius_m * x, length_m: length_m * y }
        }
        ShapeSpec::Cone { radius_bottom_m, radius_top_m, length_m } if keeps_circles_about_y => {
            let [radius_bottom_m, radius_top_m] = [radius_bottom_m, radius_top_m].map(|r| r * x);
            ShapeSpec::Cone { radius_bottom_m, radius_top_m, length_m: length_m * y }
        }
        ShapeSpec::Torus { ring_radius_m, tube_radius_m } if is_uniform => {
            ShapeSpec::Torus { ring_radius_m: ring_radius_m * x, tube_radius_m: tube_radius_m * x }
        }
        ShapeSpec::Capsule { radius_m, length_m } if is_uniform => {
            ShapeSpec::Capsule { radius_m: radius_m * x, length_m: length_m * x }
        }
        shape => ShapeSpec::Scaled { shape: Box::new(shape), scale },
    }
}

/// From `n . p <= o` with `p = q / scale` follows `(n / scale) . q <= o`, divided by the length of the new normal.
fn scaled_plane(normal: &Vector3<f64>, offset_m: f64, scale: [f64; 3]) -> Option<ShapeSpec> {
    let [x, y, z] = scale;
    if x == y && y == z {
        let offset_m = offset_m * x;
        let normal = Unit::new_unchecked(*normal);
        return offset_m.is_finite().then_some(ShapeSpec::Plane { normal, offset_m });
    }
    let (normal, length) = Unit::new_and_get(normal.component_div(&Vector3::from(scale)));
    let offset_m = offset_m / length;
    let is_sound = length.is_normal() && normal.iter().all(|n| n.is_finite()) && offset_m.is_finite();
    is_sound.then_some(ShapeSpec::Plane { normal, offset_m })
}

fn product(sizes: [f64; 3], scale: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|axis| sizes[axis] * scale[axis])
}

/// What must stay a finite number above 0. (An apex and a straight part of length 0 stay what they are.)
fn sizes(shape: &ShapeSpec) -> Vec<f64> {
    match *shape {
        ShapeSpec::Plane { .. } => Vec::new(),
        ShapeSpec::Sphere { radius_m } => vec![radius_m],
        ShapeSpec::Box { size_m: sizes } | ShapeSpec::Ellipsoid { radii_m: sizes } => sizes.into(),
        ShapeSpec::Cylinder { radius_m, length_m } => vec![radius_m, length_m],
        ShapeSpec::Cone { radius_bottom_m, radius_top_m, length_m } => {
            vec![radius_bottom_m, radius_top_m + length_m, length_m]
        }
        ShapeSpec::Torus { ring_radius_m, tube_radius_m } => vec![ring_radius_m, tube_radius_m],
        ShapeSpec::Capsule { radius_m, length_m } => vec![radius_m, radius_m + length_m],
        ShapeSpec::Mesh(ref mesh) => mesh.scale.into(),
        ShapeSpec::Scaled { ref shape, scale } => {
            let largest = scale.into_iter().fold(0.0, f64::max);
            let smallest = scale.into_iter().fold(f64::INFINITY, f64::min);
            sizes(shape).into_iter().flat_map(|size| [size * smallest, size * largest]).collect()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_known_kind_describes_becomes_that_kind() {
        let cylinder = ShapeSpec::Cylinder { radius_m: 1.0, length_m: 2.0 };
        let drawn = ShapeSpec::Cylinder { radius_m: 3.0, length_m: 1.0 };
        assert_eq!(scaled(cylinder.clone(), [3.0, 0.5, 3.0]), Some(drawn));
        let oval = ShapeSpec::Scaled { shape: Box::new(cylinder.clone()), scale: [3.0, 3.0, 1.0] };
        assert_eq!(scaled(cylinder, [3.0, 3.0, 1.0]), Some(oval));
        let ball = ShapeSpec::Sphere { radius_m: 2.0 };
        assert_eq!(scaled(ball.clone(), [0.5; 3]), Some(ShapeSpec::Sphere { radius_m: 1.0 }));
        let lozenge = ShapeSpec::Ellipsoid { radii_m: [2.0, 1.0, 4.0] };
        assert_eq!(scaled(ball, [1.0, 0.5, 2.0]), Some(lozenge));
        let torus = ShapeSpec::Torus { ring_radius_m: 2.0, tube_radius_m: 1.0 };
        let twice = ShapeSpec::Torus { ring_radius_m: 4.0, tube_radius_m: 2.0 };
        assert_eq!(scaled(torus, [2.0; 3]), Some(twice));
        let cone = ShapeSpec::Cone { radius_bottom_m: 1.0, radius_top_m: 0.0, length_m: 1.0 };
        assert!(matches!(scaled(cone.clone(), [2.0, 1.0, 2.0]), Some(ShapeSpec::Cone { .. })));
        assert!(matches!(scaled(cone, [2.0, 1.0, 1.0]), Some(ShapeSpec::Scaled { .. })));
    }

    #[test]
    fn a_scaled_plane_holds_the_scaled_points() {
        let normal = Unit::new_normalize(Vector3::new(1.0, 2.0, -0.5));
        let scale = [2.0, 0.25, 3.0];
        let (on_plane, beside) = (normal.into_inner() * 0.3, normal.cross(&Vector3::x()));
        let Some(ShapeSpec::Plane { normal, offset_m }) =
            scaled(ShapeSpec::Plane { normal, offset_m: 0.3 }, scale)
        else {
            panic!("a plane stays one")
        };
        for point in [on_plane, on_plane + beside, on_plane - beside * 2.0] {
            let height_m = normal.dot(&point.component_mul(&Vector3::from(scale))) - offset_m;
            // A dozen roundings of lengths of a few metres.
            assert!(height_m.abs() < 1e-14, "{height_m} m");
        }
    }

    #[test]
    fn a_size_that_leaves_the_range_of_numbers_is_refused() {
        for scale in [1e-200, 1e200] {
            let ball = ShapeSpec::Sphere { radius_m: scale };
            assert_eq!(scaled(ball, [scale; 3]), None);
            let oval = ShapeSpec::Cylinder { radius_m: scale, length_m: 1.0 };
            assert_eq!(scaled(oval, [scale, 1.0, 1.0]), None);
            let plane = ShapeSpec::Plane { normal: Vector3::y_axis(), offset_m: 1e200 };
            assert_eq!(scaled(plane, [1.0, 1e200, 1.0]), None);
        }
    }
}
