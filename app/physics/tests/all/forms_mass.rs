//! Mass, centre of mass and inertia of closed forms, against sums over a fine grid and formulas from books.
#![allow(non_snake_case)]

use crate::solids;

use std::f64::consts::PI;

use haptics::{
    Capsule, Cone, Csg, CsgTree, Cuboid, Cylinder, Ellipsoid, Form, Plane, Shape, Sphere, Surface, Torus,
};
use nalgebra::{Matrix3, Vector3};
use physics::collide::{bounding_ball, can_move, is_collidable, name};
use physics::{BodyError, MassProperties};
use solids::*;

/// Volume, centre and inertia of 1 kg/m^3 about the origin, by asking a grid of points whether they are inside.
fn summed(form: &Form) -> (f64, Vector3<f64>, Matrix3<f64>) {
    let radius = bounding_ball(&(*form).into()).unwrap().1;
    let n = 160;
    let cell = 2.0 * radius / f64::from(n);
    let at = |i: i32| (f64::from(i) + 0.5) * cell - radius;
    let (mut volume, mut first, mut second) = (0.0, Vector3::zeros(), Matrix3::zeros());
    for i in 0..n {
        for j in 0..n {
            for k in 0..n {
                let p = Vector3::new(at(i), at(j), at(k));
                // What of the cell is inside, if the surface is flat there.
                let share = (0.5 - form.signed_distance(&p) / cell).clamp(0.0, 1.0);
                volume += share;
                first += p * share;
                second += p * p.transpose() * share;
            }
        }
    }
    let cell = cell.powi(3);
    let second = second * cell;
    (volume * cell, first / volume, Matrix3::identity() * second.trace() - second)
}

#[test]
fn mass_centre_and_inertia_are_those_of_a_sum_over_a_fine_grid() {
    for (name, form) in all().into_iter().chain(scaled()) {
        let (volume, centre, about_origin) = summed(&form);
        let density = 800.0;
        let mass = MassProperties::of_density(&form.into(), density).unwrap();
        // Cells of a 160th: at edges and where the distance is a bound only, a surface cell is wrong by a share of
        // itself, with either sign.
        let tolerance = if name.starts_with("scaled") { 3e-2 } else { 2e-3 };
        let off = (mass.mass_kg / (density * volume) - 1.0).abs();
        assert!(off < tolerance, "{name}: {} {}", mass.mass_kg, density * volume);
        assert!((mass.centre_B - centre).norm() < 1e-4, "{name}: {} {centre}", mass.centre_B);
        // Parallel axes: from the origin to the centre of mass.
        let c = mass.centre_B;
        let shift = Matrix3::identity() * c.norm_squared() - c * c.transpose();
        let inertia = about_origin * (mass.mass_kg / volume) - shift * mass.mass_kg;
        let off = (mass.inertia_B() - inertia).norm() / inertia.norm();
        assert!(off < tolerance, "{name}: {} {inertia}", mass.inertia_B());
        let given = MassProperties::of_shape(&form.into(), mass.mass_kg).unwrap();
        assert!((given.principal_kg_m2 - mass.principal_kg_m2).norm() < 1e-15, "{name}");
    }
}

#[test]
fn moments_are_those_of_the_books() {
    let m = 2.0;
    let moments = |form: Form| MassProperties::of_shape(&form.into(), m).unwrap().principal_kg_m2;
    let close = |found: Vector3<f64>, expected: [f64; 3]| {
        assert!((found - Vector3::from(expected)).norm() < 1e-15, "{found} {expected:?}");
    };
    let (r, l) = (0.03_f64, 0.1_f64);
    close(moments(Sphere::new(r).unwrap().into()), [0.4 * m * r * r; 3]);
    let side = m * (3.0 * r * r + l * l) / 12.0;
    close(moments(Cylinder::new(r, l).unwrap().into()), [side, 0.5 * m * r * r, side]);
    let (a, b, c) = (0.02, 0.05, 0.03);
    let [x, y, z] = [m * (b * b + c * c) / 5.0, m * (a * a + c * c) / 5.0, m * (a * a + b * b) / 5.0];
    close(moments(Ellipsoid::new([a, b, c]).unwrap().into()), [x, y, z]);
    close(moments(Cuboid::new([a, b, c]).unwrap().into()), [x, y, z].map(|moment| moment * 5.0 / 12.0));
    // About the centre of mass, a quarter of the height above the base.
    let side = m * (3.0 / 20.0 * r * r + 3.0 / 80.0 * l * l);
    let cone: Form = Cone::new(r, 0.0, l).unwrap().into();
    close(moments(cone), [side, 0.3 * m * r * r, side]);
    let centre = MassProperties::of_shape(&cone.into(), m).unwrap().centre_B;
    assert!((centre - Vector3::new(0.0, -0.25 * l, 0.0)).norm() < 1e-16, "{centre}");
    let (ring, tube) = (0.05_f64, 0.01_f64);
    let side = m * (4.0 * ring * ring + 5.0 * tube * tube) / 8.0;
    let axis = m * (ring * ring + 0.75 * tube * tube);
    close(moments(Torus::new(ring, tube).unwrap().into()), [side, axis, side]);
    // A capsule without a straight part is a ball, and a cut cone that does not taper a cylinder.
    close(moments(Capsule::new(r, 0.0).unwrap().into()), [0.4 * m * r * r; 3]);
    assert_eq!(moments(Cone::new(r, r, l).unwrap().into()), moments(Cylinder::new(r, l).unwrap().into()));
    let volume = MassProperties::of_density(&Shape::from(Sphere::new(r).unwrap()), 1.0).unwrap().mass_kg;
    assert!((volume - 4.0 / 3.0 * PI * r.powi(3)).abs() < 1e-19);
}

#[test]
fn what_has_no_inertia_is_refused_by_its_name() {
    let plane: Shape = Plane::new(Vector3::y(), 0.0).unwrap().into();
    for found in [MassProperties::of_shape(&plane, 1.0), MassProperties::of_density(&plane, 1.0)] {
        assert_eq!(found, Err(BodyError::NoInertia { shape: "plane" }));
    }
    let ball: Shape = Sphere::new(0.1).unwrap().into();
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(MassProperties::of_shape(&ball, bad).is_err());
        assert!(MassProperties::of_density(&ball, bad).is_err());
    }
    // 1e-305 m^3 at 1e-10 kg/m^3 weigh nothing that is a number.
    let speck: Shape = Sphere::new(1e-102).unwrap().into();
    assert!(MassProperties::of_density(&speck, 1e-30).is_err());
}

#[test]
fn a_ball_around_a_form_holds_all_of_it_and_little_else() {
    for (name, form) in all().into_iter().chain(scaled()) {
        let (centre, radius) = bounding_ball(&form.into()).unwrap();
        let n = 100;
        let farthest = (0..n * n)
            .map(|i| {
                surface_point(&form, f64::from(i % n) / f64::from(n), f64::from(i / n) / f64::from(n - 1))
            })
            .map(|point| (point - centre).norm())
            .fold(0.0, f64::max);
        assert!(farthest <= radius * (1.0 + 1e-12), "{name}: {farthest} {radius}");
        // Scaled forms take the largest factor for all directions.
        let slack = if name.starts_with("scaled") { 2.0 } else { 1.01 };
        assert!(radius <= slack * farthest, "{name}: {farthest} {radius}");
    }
    assert_eq!(bounding_ball(&Plane::new(Vector3::y(), 0.0).unwrap().into()), None);
    let ball = || Form::from(Sphere::new(0.1).unwrap());
    let tree = |tree: CsgTree| Shape::from(std::sync::Arc::new(Csg::build(&tree).unwrap()));
    let ground = Form::from(Plane::new(Vector3::new(1.0, 2.0, 0.5), 0.0).unwrap());
    assert!(bounding_ball(&tree(CsgTree::intersection([ball(), ground]))).is_some());
    assert_eq!(bounding_ball(&tree(CsgTree::union([ball(), ground]))), None);
}

#[test]
fn it_can_be_asked_what_can_move_and_what_can_be_met() {
    let plane: Shape = Plane::new(Vector3::y(), 0.0).unwrap().into();
    assert!(!can_move(&plane));
    for (_, a) in all().into_iter().chain(scaled()) {
        assert!(can_move(&a.into()));
        assert!(is_collidable(&a.into(), &plane));
        assert!(!is_collidable(&plane, &a.into()));
        for (_, b) in all() {
            assert!(is_collidable(&b.into(), &b.into()), "{}", name(&b.into()));
        }
    }
    let ring: Shape =
        haptics::Scaled::new(Torus::new(0.03, 0.01).unwrap().into(), [1.0, 2.0, 1.0]).unwrap().into();
    assert!(!can_move(&ring));
    assert!(is_collidable(&Sphere::new(0.01).unwrap().into(), &ring));
    assert!(!is_collidable(&Cuboid::new([0.01; 3]).unwrap().into(), &ring));
    assert_eq!(name(&ring), "torus scaled by different factors");
}
