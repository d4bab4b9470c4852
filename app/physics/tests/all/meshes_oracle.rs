//! Contact points of meshes against a search through all triangles and vertices; and that finding them never allocates.
#![allow(non_snake_case)]

use crate::{counting, meshes};

use std::sync::Arc;

use counting::CALLS;
use haptics::mesh::{Mesh, make};
use haptics::{Capsule, Cone, Cuboid, Cylinder, Ellipsoid, Plane, Shape, Sphere, Surface, Torus};
use meshes::{build, terrain};
use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use physics::collide::{ContactPoint, ContactPoints, PairMemory, Solid, contact_points};

struct Random(u64);

impl Random {
    fn number(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as f64 / f64::from(1_u32 << 31) * 2.0 - 1.0
    }

    fn vector(&mut self, scale: f64) -> Vector3<f64> {
        Vector3::new(self.number(), self.number(), self.number()) * scale
    }

    fn turn(&mut self) -> UnitQuaternion<f64> {
        UnitQuaternion::from_scaled_axis(self.vector(3.0))
    }
}

fn touch(a: (&Shape, &Isometry3<f64>), b: (&Shape, &Isometry3<f64>), reach: f64) -> Vec<ContactPoint> {
    let mut memory = PairMemory::default();
    let mut found = ContactPoints::default();
    // What the first tick chose, the second one may better.
    for _ in 0..2 {
        found = ContactPoints::default();
        let (a, b) = (Solid { shape: a.0, X_W: a.1 }, Solid { shape: b.0, X_W: b.1 });
        contact_points(a, b, reach, &mut memory, &mut found);
    }
    found.as_slice().to_vec()
}

/// Nearest point of a triangle, by trying its inside, its edges and its corners.
fn nearest_on([a, b, c]: [Vector3<f64>; 3], p: &Vector3<f64>) -> Vector3<f64> {
    let n = (b - a).cross(&(c - a)).normalize();
    let foot = p - n * n.dot(&(p - a));
    let is_left = |u: &Vector3<f64>, v: &Vector3<f64>| (v - u).cross(&(foot - u)).dot(&n) >= 0.0;
    if is_left(&a, &b) && is_left(&b, &c) && is_left(&c, &a) {
        return foot;
    }
    let on_edge = |u: Vector3<f64>, v: Vector3<f64>| {
        let along = v - u;
        u + along * (along.dot(&(p - u)) / along.norm_squared()).clamp(0.0, 1.0)
    };
    let all = [on_edge(a, b), on_edge(b, c), on_edge(c, a)];
    *all.iter().min_by(|x, y| (*x - p).norm().total_cmp(&(*y - p).norm())).unwrap()
}

fn distance(mesh: &Mesh, p: &Vector3<f64>) -> f64 {
    let faces = mesh.faces().iter();
    let corners = faces.map(|face| face.vertices.map(|vertex| mesh.vertices()[vertex as usize]));
    corners.map(|corners| (nearest_on(corners, p) - p).norm()).fold(f64::INFINITY, f64::min)
}

fn signed_distance(mesh: &Mesh, p: &Vector3<f64>) -> f64 {
    if mesh.is_inside_unbounded(p) { -distance(mesh, p) } else { distance(mesh, p) }
}

#[test]
fn a_ball_touches_the_nearest_triangle_and_every_point_told_is_locally_nearest() {
    let (mut random, mut several) = (Random(1), 0);
    let bumpy = terrain(12, 0.1, |x, z| 0.01 * (90.0 * x).sin() * (70.0 * z).cos());
    for mesh in
        [build(make::bumpy_sphere(30, 16, 0.05)), build(make::star(5, 0.05, 0.02, 0.03)), build(bumpy)]
    {
        for _ in 0..500 {
            let radius = 0.012;
            let at = random.vector(0.07);
            let far = distance(&mesh, &at);
            if !(radius * 0.7..radius + 1e-3).contains(&far) || mesh.is_inside_unbounded(&at) {
                continue;
            }
            let (pose, ball) =
                (Isometry3::from_parts(random.vector(1.0).into(), random.turn()), Sphere::new(radius));
            let ball = Shape::from(ball.unwrap());
            let shape = Shape::from(Arc::clone(&mesh));
            let X_WA = pose * Isometry3::translation(at.x, at.y, at.z);
            let found = touch((&ball, &X_WA), (&shape, &pose), 1e-3);
            // Rounding of coordinates of a metre.
            let near = |a: f64, b: f64| (a - b).abs() < 1e-13;
            let centre_W = X_WA.translation.vector;
            let is_nearest = |point: &ContactPoint| {
                let on_mesh = point.point_W - point.normal_W * point.gap_m;
                near((centre_W - point.point_W).norm(), radius)
                    && distance(&mesh, &(pose.inverse() * Point3::from(on_mesh)).coords) < 0.3 * radius
            };
            assert!(found.iter().all(is_nearest), "{found:?}");
            let deepest = found.iter().map(|point| point.gap_m).fold(f64::INFINITY, f64::min);
            if found.len() == 1 {
                assert!(near(deepest, far - radius), "{deepest:e} {far} {found:?}");
            } else {
                several += 1;
                // Depths that are shared are no deeper than the nearest point, and together press as much along its normal.
                assert!(deepest > far - radius - 1e-12);
                let pressed: Vec<_> = found.iter().filter(|point| point.gap_m < 0.0).collect();
                for point in &pressed {
                    let foot = centre_W - point.normal_W * radius;
                    assert!((foot - point.point_W).norm() < 1e-12);
                }
                let most = pressed
                    .iter()
                    .map(|one| {
                        pressed
                            .iter()
                            .map(|other| -other.gap_m * one.normal_W.dot(&other.normal_W).max(0.0))
                            .sum::<f64>()
                    })
                    .fold(0.0, f64::max);
                assert!(most > radius - far - 1e-9, "{most:e} {:e} {found:?}", radius - far);
            }
            // The same seen from the other side.
            let swapped = touch((&shape, &pose), (&ball, &X_WA), 1e-3);
            assert_eq!(swapped.len(), found.len());
            for (one, other) in found.iter().zip(&swapped) {
                assert!((one.normal_W + other.normal_W).norm() < 1e-12 && near(one.gap_m, other.gap_m));
                // Where depths are shared, points are farther apart than they count.
                assert!(
                    found.len() > 1
                        || (one.point_W - one.normal_W * one.gap_m - other.point_W).norm() < 1e-12
                );
            }
        }
    }
    assert!(several > 10, "{several}");
}

#[test]
fn a_ball_pushed_through_a_wall_is_pressed_back_to_where_it_came_from() {
    let radius = 0.01;
    let ball = Shape::from(Sphere::new(radius).unwrap());
    let here = Isometry3::identity();
    let plate = meshes::block(10, 0.2, 0.002, |_, _| 0.0);
    for wall in [build(plate), build(terrain(10, 0.2, |_, _| 0.0))].map(Shape::from) {
        for way in [1.0, -1.0] {
            // The plate's lower face is 2 mm below.
            let surface = if way < 0.0 && matches!(&wall, Shape::Mesh(mesh) if mesh.vertices().len() > 200) {
                -0.002
            } else {
                0.0
            };
            let mut memory = PairMemory::default();
            for step in 0..40 {
                let height = 0.0105 - 5e-4 * f64::from(step);
                let pose = Isometry3::translation(0.0123, surface + way * height, 0.0077);
                let mut found = ContactPoints::default();
                let (a, b) = (Solid { shape: &ball, X_W: &pose }, Solid { shape: &wall, X_W: &here });
                contact_points(a, b, 1e-3, &mut memory, &mut found);
                let [point] = found.as_slice() else { panic!("{step}: {found:?}") };
                // Rounding of what was gone since.
                assert!((point.normal_W - Vector3::y() * way).norm() < 1e-9, "{step}: {point:?}");
                assert!((point.gap_m - (height - radius)).abs() < 1e-12, "{step}: {point:?}");
            }
        }
    }
}

#[test]
fn what_is_told_of_solids_is_as_deep_as_they_are_and_the_deepest_is_not_missed() {
    let mut random = Random(2);
    let meshes = [build(make::cuboid([0.05; 3])), build(make::bumpy_sphere(30, 16, 0.03))];
    let cuboid = Cuboid::new([0.04, 0.05, 0.06]).unwrap();
    let shape = Shape::from(cuboid);
    let half = Vector3::new(0.02, 0.025, 0.03);
    let corners =
        (0..8).map(|i| Vector3::from_fn(|axis, _| if i >> axis & 1 == 1 { half[axis] } else { -half[axis] }));
    let corners: Vec<Vector3<f64>> = corners.collect();
    let (mut tried, mut missed) = (0, 0);
    for mesh in &meshes {
        for _ in 0..600 {
            let X_MO = Isometry3::from_parts(random.vector(0.08).into(), random.turn());
            // All corners and all vertices, one by one.
            let of_corners =
                corners.iter().map(|corner| signed_distance(mesh, &(X_MO * Point3::from(*corner)).coords));
            let of_vertices = mesh.vertices().iter().map(|vertex| {
                cuboid.signed_distance(&X_MO.inverse_transform_point(&Point3::from(*vertex)).coords)
            });
            let deepest = of_corners.chain(of_vertices).fold(f64::INFINITY, f64::min);
            if !(-2e-3..-1e-4).contains(&deepest) {
                continue;
            }
            tried += 1;
            let here = Isometry3::identity();
            let found = touch((&shape, &X_MO), (&Shape::from(Arc::clone(mesh)), &here), 1e-3);
            let told = found.iter().map(|point| point.gap_m).fold(f64::INFINITY, f64::min);
            // Along the face that was come in by a corner may be deeper than along the shortest way out.
            missed += usize::from(told > 0.8 * deepest);
            for point in &found {
                assert!((point.normal_W.norm() - 1.0).abs() < 1e-12);
                // On the surface of the box to the depth.
                let on_a = X_MO.inverse_transform_point(&Point3::from(point.point_W)).coords;
                assert!(
                    cuboid.signed_distance(&on_a).abs() < 1e-9,
                    "{point:?} {}",
                    cuboid.signed_distance(&on_a)
                );
            }
        }
    }
    assert!(tried > 30 && missed * 10 < tried, "{missed} of {tried}");
}

#[test]
fn finding_contact_points_never_allocates() {
    let shapes: Vec<Shape> = vec![
        build(make::bumpy_sphere(100, 51, 0.03)).into(),
        build(make::cuboid([0.05; 3])).into(),
        build(terrain(50, 0.1, |x, z| 0.3 * x * z)).into(),
        Sphere::new(0.02).unwrap().into(),
        Cuboid::new([0.03, 0.04, 0.05]).unwrap().into(),
        Cylinder::new(0.02, 0.04).unwrap().into(),
        Cone::new(0.02, 0.01, 0.04).unwrap().into(),
        Capsule::new(0.01, 0.04).unwrap().into(),
        Torus::new(0.03, 0.01).unwrap().into(),
        Ellipsoid::new([0.03, 0.01, 0.02]).unwrap().into(),
        Plane::new(Vector3::y(), 0.0).unwrap().into(),
    ];
    let mut random = Random(3);
    let (mut points, mut ids, mut calls) = (0, 0, 0);
    for a in 0..3 {
        for b in &shapes {
            let mut memory = PairMemory::default();
            let (mut pose, here) = (Isometry3::identity(), Isometry3::identity());
            for _ in 0..100 {
                pose.translation.vector = pose.translation.vector * 0.9 + random.vector(0.01);
                pose.rotation = UnitQuaternion::from_scaled_axis(random.vector(0.05)) * pose.rotation;
                let mut found = ContactPoints::default();
                let (a, b) = (Solid { shape: &shapes[a], X_W: &pose }, Solid { shape: b, X_W: &here });
                let before = CALLS.get();
                contact_points(a, b, 2e-3, &mut memory, &mut found);
                calls += CALLS.get() - before;
                let all = found.as_slice();
                points += all.len();
                ids += all
                    .iter()
                    .enumerate()
                    .filter(|(at, point)| all[..*at].iter().any(|one| one.id == point.id))
                    .count();
            }
        }
    }
    assert_eq!(calls, 0);
    assert!(points > 3000, "{points}");
    assert_eq!(ids, 0, "no two points of a pair have one name");
}
