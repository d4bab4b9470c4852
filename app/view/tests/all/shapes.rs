//! The triangles of shapes: closed, with the outside outside, and as large as the shape.

use haptics::{Csg, CsgPart, CsgTree, Cuboid, Shape, Sphere};
use nalgebra::{Point3, Vector3};
use std::f64::consts::PI;
use std::sync::Arc;
use view::shapes::triangles;
use world::{CsgSpec, ShapeSpec};

/// A polygon of 48 corners misses 1 - sin(2 pi / 48) / (2 pi / 48) of a circle, 0.29 %; across a ball another 0.3 %.
const MISSED: f64 = 0.01;

#[test]
fn closed_forms_enclose_their_volume_with_their_normals_outside() {
    let (r, h) = (0.03, 0.1);
    let forms = [
        (ShapeSpec::Box { size_m: [0.1, 0.2, 0.3] }, 0.1 * 0.2 * 0.3),
        (ShapeSpec::Sphere { radius_m: r }, 4.0 / 3.0 * PI * r.powi(3)),
        (ShapeSpec::Ellipsoid { radii_m: [0.01, 0.02, 0.03] }, 4.0 / 3.0 * PI * 6e-6),
        (ShapeSpec::Capsule { radius_m: r, length_m: h }, PI * r * r * h + 4.0 / 3.0 * PI * r.powi(3)),
        (ShapeSpec::Cylinder { radius_m: r, length_m: h }, PI * r * r * h),
        (ShapeSpec::Cone { radius_bottom_m: r, radius_top_m: 0.0, length_m: h }, PI * r * r * h / 3.0),
        (
            ShapeSpec::Cone { radius_bottom_m: r, radius_top_m: 2.0 * r, length_m: h },
            PI * r * r * h * 7.0 / 3.0,
        ),
        (ShapeSpec::Torus { ring_radius_m: 0.05, tube_radius_m: 0.02 }, 2.0 * PI * PI * 0.05 * 4e-4),
    ];
    for (spec, volume) in forms {
        let made = triangles(&spec, None).unwrap();
        let ratio = made.volume_m3() / volume;
        assert!(ratio > 1.0 - MISSED && ratio < 1.0 + 1e-9, "{spec:?}: {ratio}");
        for corners in &made.corners {
            let [a, b, c] = corners.map(|corner| made.places[corner as usize]);
            let face = (b - a).cross(&(c - a));
            // Triangles at a pole or an apex have no area.
            for corner in corners.iter().filter(|_| face.norm() > 1e-12) {
                let normal = made.normals[*corner as usize];
                assert!((normal.norm() - 1.0).abs() < 1e-12);
                assert!(face.normalize().dot(&normal) > 0.9, "{spec:?}");
            }
        }
    }
}

#[test]
fn a_joined_solid_has_its_volume_and_its_sharp_edges() {
    let (a, r) = (0.1, 0.03);
    let ball = CsgPart::at(Sphere::new(r).unwrap(), Vector3::x() * (0.5 * a));
    let csg = Csg::build(&CsgTree::difference([Cuboid::new([a; 3]).unwrap().into(), ball])).unwrap();
    let spec = ShapeSpec::Csg(CsgSpec { op: world::CsgOp::Difference, children: Vec::new() });
    let made = triangles(&spec, Some(&Shape::Csg(Arc::new(csg).into()))).unwrap();
    let volume = a.powi(3) - 2.0 / 3.0 * PI * r.powi(3);
    assert!((made.volume_m3() / volume - 1.0).abs() < 2e-3, "{}", made.volume_m3() / volume);
    let corner = Point3::new(-0.5 * a, 0.5 * a, 0.5 * a);
    let nearest = made.places.iter().map(|place| (place - corner).norm()).fold(f64::INFINITY, f64::min);
    assert!(nearest < 1e-6, "{nearest}");
}

#[test]
fn a_joined_solid_that_is_scaled_looks_as_it_is_felt() {
    let spec = CsgSpec { op: world::CsgOp::Union, children: Vec::new() };
    let spec = ShapeSpec::Scaled { shape: Box::new(ShapeSpec::Csg(spec)), scale: [2.0, 1.0, 1.0] };
    let part = CsgPart::from(Cuboid::new([0.1; 3]).unwrap()).scaled([2.0, 1.0, 1.0]);
    let felt = Shape::Csg(Arc::new(Csg::build(&CsgTree::union([part])).unwrap()).into());
    let made = triangles(&spec, Some(&felt)).expect("it is drawn");
    assert!((made.volume_m3() / 2e-3 - 1.0).abs() < 2e-3, "{}", made.volume_m3());
}
