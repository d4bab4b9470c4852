//! Which points closed forms touch at (Melder ch. 6.2.1): ends of edges, corners of faces, and what stands for a rim.
#![allow(non_snake_case)]

use crate::solids;

use std::collections::BTreeSet;
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, TAU};

use haptics::{
    Capsule, Cone, Cuboid, Cylinder, Ellipsoid, Form, Plane, Shape, Sphere, Surface, SurfacePoint, Torus,
};
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use physics::collide::{ContactPoint, ContactPoints, PairMemory, Solid, contact_points, is_collidable};
use solids::*;

const REACH: f64 = 1e-3;

fn ground() -> Form {
    Plane::new(Vector3::y(), 0.0).unwrap().into()
}

fn slab() -> Form {
    Cuboid::new([0.2, 0.1, 0.2]).unwrap().into()
}

/// Points of a form whose lowest point is 0.1 mm deep, on a plane and on a slab.
fn on_both(form: Form, turn: UnitQuaternion<f64>) -> [Vec<ContactPoint>; 2] {
    let lowest = deepest(&points(
        &form,
        &pose(turn, Vector3::zeros()),
        &ground(),
        &Isometry3::identity(),
        1.0,
        &mut PairMemory::default(),
    ));
    let X = pose(turn, Vector3::new(0.01, -lowest - 1e-4, 0.02));
    let down = Isometry3::translation(0.0, -0.05, 0.0);
    [
        points(&form, &X, &ground(), &Isometry3::identity(), REACH, &mut PairMemory::default()),
        points(&form, &X, &slab(), &down, REACH, &mut PairMemory::default()),
    ]
}

fn about(axis: Vector3<f64>, angle: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::from_scaled_axis(axis * angle)
}

#[test]
fn an_edge_gives_its_ends_a_face_its_corners_and_a_rim_four_points() {
    let (x, z) = (Vector3::x(), Vector3::z());
    let level = UnitQuaternion::identity();
    let corner = UnitQuaternion::rotation_between(&Vector3::new(1.0, 1.0, 1.0), &-Vector3::y()).unwrap();
    let cube: Form = Cuboid::new([0.04; 3]).unwrap().into();
    let cylinder: Form = Cylinder::new(0.02, 0.05).unwrap().into();
    let (cone, capsule): (Form, Form) =
        (Cone::new(0.02, 0.0, 0.05).unwrap().into(), Capsule::new(0.01, 0.05).unwrap().into());
    let torus: Form = Torus::new(0.03, 0.01).unwrap().into();
    let ellipsoid: Form = Ellipsoid::new([0.03, 0.015, 0.02]).unwrap().into();
    let side = (0.02_f64).atan2(0.05);
    let cases = [
        ("cube on a face", cube, level, 4),
        ("cube on an edge", cube, about(x, FRAC_PI_4), 2),
        ("cube on a corner", cube, corner, 1),
        ("cylinder on its cap", cylinder, level, 4),
        ("cylinder on its other cap", cylinder, about(x, 2.0 * FRAC_PI_2), 4),
        ("cylinder on its side", cylinder, about(x, FRAC_PI_2), 2),
        ("cylinder on its rim", cylinder, about(x, 0.7), 1),
        ("cone on its base", cone, level, 4),
        ("cone on its side", cone, about(z, FRAC_PI_2 + side), 2),
        ("cone on its tip", cone, about(z, 3.0), 1),
        ("capsule on its side", capsule, about(z, FRAC_PI_2), 2),
        ("capsule on an end", capsule, level, 1),
        ("torus lying", torus, level, 4),
        ("torus standing", torus, about(z, FRAC_PI_2), 1),
        ("ellipsoid", ellipsoid, about(z, 0.3), 1),
        ("ball", Sphere::new(0.02).unwrap().into(), level, 1),
    ];
    for (name, form, turn, expected) in cases {
        for found in on_both(form, turn) {
            assert_eq!(found.len(), expected, "{name}: {found:?}");
            for point in found {
                assert!((point.gap_m + 1e-4).abs() < 1e-12, "{name}: {point:?}");
                assert!((point.normal_W - Vector3::y()).norm() < 1e-9, "{name}: {point:?}");
                // On A's surface, at its depth.
                assert!((point.point_W.y + 1e-4).abs() < 1e-12, "{name}: {point:?}");
            }
        }
    }
}

#[test]
fn four_points_of_a_rim_press_and_turn_like_all_of_it_however_it_leans() {
    let mut noise = Noise(3);
    for (form, radius, down) in [
        (Form::from(Cylinder::new(0.02, 0.05).unwrap()), 0.02, 0.025),
        (Cone::new(0.02, 0.0, 0.05).unwrap().into(), 0.02, 0.025),
        (Torus::new(0.03, 0.01).unwrap().into(), 0.03, 0.01),
    ] {
        for _ in 0..100 {
            // Leaning by up to 4e-3, it is everywhere less than 0.1 mm higher than where it is deepest at 0.4 mm.
            let axis = Vector3::new(noise.normal(), 0.0, noise.normal()).normalize();
            let turn = about(axis, noise.between(0.0, 2e-3)) * about(Vector3::y(), noise.between(0.0, TAU));
            let X = pose(turn, Vector3::new(0.0, down - 4e-4, 0.0));
            let found =
                points(&form, &X, &ground(), &Isometry3::identity(), REACH, &mut PairMemory::default());
            assert_eq!(found.len(), 4);
            let (mut force, mut torque) = (0.0, Vector3::zeros());
            for point in &found {
                force -= point.gap_m;
                torque -= (point.point_W - X.translation.vector).cross(&point.normal_W) * point.gap_m;
            }
            // A thousand points of the rim, as stiff as four.
            let (mut rim_force, mut rim_torque) = (0.0, Vector3::zeros());
            let n = 1000;
            for i in 0..n {
                let (sine, cosine) = (TAU * f64::from(i) / f64::from(n)).sin_cos();
                let mut at = turn * Vector3::new(radius * cosine, -down, radius * sine);
                if let Form::Torus(_) = form {
                    at = turn * Vector3::new(radius * cosine, 0.0, radius * sine) - Vector3::y() * down;
                }
                let depth = -(X.translation.y + at.y) * 4.0 / f64::from(n);
                rim_force += depth;
                rim_torque += at.cross(&Vector3::y()) * depth;
            }
            assert!((force - rim_force).abs() < 1e-15, "{force} {rim_force}");
            assert!((torque - rim_torque).norm() < 1e-16, "{torque} {rim_torque}");
            // One of them is the deepest point, unless it stands flat.
            if turn.inverse_transform_vector(&Vector3::y()).xz().norm() > 1e-4 {
                let lowest = deepest(&points(
                    &form,
                    &X,
                    &ground(),
                    &Isometry3::identity(),
                    1.0,
                    &mut PairMemory::default(),
                ));
                assert!((deepest(&found) - lowest).abs() < 1e-16);
                let tilt = turn.inverse_transform_vector(&Vector3::y()).xz().norm();
                let level = if let Form::Torus(_) = form { 1.0 } else { (1.0 - tilt * tilt).sqrt() };
                let exact = X.translation.y - radius * tilt - down * level;
                assert!((lowest - exact).abs() < 1e-15, "{lowest} {exact}");
            }
        }
    }
}

#[test]
fn a_rim_that_stands_flat_keeps_its_points_on_the_material() {
    for form in [Form::from(Cylinder::new(0.02, 0.05).unwrap()), Torus::new(0.03, 0.01).unwrap().into()] {
        for (b, X_WB) in
            [(ground(), Isometry3::identity()), (slab(), Isometry3::translation(0.0, -0.05, 0.0))]
        {
            let height = if let Form::Torus(_) = form { 0.01 } else { 0.025 };
            let mut memory = PairMemory::default();
            let mut noise = Noise(4);
            let leaning = about(Vector3::new(0.3, 0.0, 0.4), 2e-3);
            let at = |turn| pose(turn, Vector3::new(0.0, height - 3e-4, 0.0));
            let place = |points: &[ContactPoint], X: &Isometry3<f64>| {
                let first = points.iter().min_by_key(|point| point.id).unwrap();
                X.inverse_transform_point(&nalgebra::Point3::from(first.point_W)).coords
            };
            let X = at(leaning);
            let first = place(&points(&form, &X, &b, &X_WB, REACH, &mut memory), &X);
            for _ in 0..100 {
                // Noise of 5e-5 rad, and it spins.
                let noise = Vector3::new(noise.between(-3e-5, 3e-5), 0.0, noise.between(-3e-5, 3e-5));
                let X = at(UnitQuaternion::from_scaled_axis(noise));
                let now = place(&points(&form, &X, &b, &X_WB, REACH, &mut memory), &X);
                // Which of its own points of the tube is lowest changes with the tilt of the tube.
                assert!((now - first).norm() < 4e-5, "{form:?}: {now} {first}");
            }
        }
    }
}

#[test]
fn what_one_face_covers_of_another_has_the_corners_of_both() {
    let X_WB = Isometry3::translation(0.0, -0.05, 0.0);
    let cube: Form = Cuboid::new([0.04; 3]).unwrap().into();
    let found = |at: Vector3<f64>, turn: f64, b: &Form, X_WB: &Isometry3<f64>| {
        let X = pose(about(Vector3::y(), turn), at);
        points(&cube, &X, b, X_WB, REACH, &mut PairMemory::default())
    };
    // Over an edge: two of its corners, and two crossings.
    let over = found(Vector3::new(0.1, 0.0199, 0.0), 0.0, &slab(), &X_WB);
    let mut xs: Vec<f64> = over.iter().map(|point| point.point_W.x).collect();
    xs.sort_by(f64::total_cmp);
    assert_eq!(over.len(), 4);
    for (x, expected) in xs.iter().zip([0.08, 0.08, 0.1, 0.1]) {
        assert!((x - expected).abs() < 1e-12, "{xs:?}");
    }
    // Over a corner: a quarter of the face.
    let corner = found(Vector3::new(0.1, 0.0199, 0.1), 0.0, &slab(), &X_WB);
    assert_eq!(corner.len(), 4, "{corner:?}");
    assert!(corner.iter().any(|point| (point.point_W - Vector3::new(0.1, -1e-4, 0.1)).norm() < 1e-12));
    // On a smaller one: the corners of that.
    let small: Form = Cuboid::new([0.02, 0.1, 0.02]).unwrap().into();
    let on_small = found(Vector3::new(0.005, 0.0199, 0.0), 0.3, &small, &X_WB);
    assert_eq!(on_small.len(), 4);
    assert!(on_small.iter().all(|point| (point.point_W.x.abs() - 0.01).abs() < 1e-12), "{on_small:?}");
    // Turned on one of its own size: an octagon.
    let same: Form = Cuboid::new([0.04, 0.1, 0.04]).unwrap().into();
    let octagon = found(Vector3::new(0.0, 0.0199, 0.0), FRAC_PI_4, &same, &X_WB);
    assert_eq!(octagon.len(), 8, "{octagon:?}");
    // On a column: the points of the rim, and on a wide one its own corners.
    let column: Form = Cylinder::new(0.01, 0.1).unwrap().into();
    assert_eq!(found(Vector3::new(0.0, 0.0199, 0.0), 0.3, &column, &X_WB).len(), 4);
    let wide: Form = Cylinder::new(0.1, 0.1).unwrap().into();
    let on_wide = found(Vector3::new(0.0, 0.0199, 0.0), 0.3, &wide, &X_WB);
    let ids: BTreeSet<u32> = on_wide.iter().map(|point| point.id).collect();
    assert_eq!(ids.len(), 4);
    for point in corner.iter().chain(&over).chain(&on_small).chain(&octagon).chain(&on_wide) {
        assert!((point.gap_m + 1e-4).abs() < 1e-12 && (point.normal_W - Vector3::y()).norm() < 1e-12);
    }
}

#[test]
fn a_box_keeps_the_names_of_its_corners_while_it_slides_and_turns() {
    let cube: Form = Cuboid::new([0.04; 3]).unwrap().into();
    let X_WB = Isometry3::translation(0.0, -0.05, 0.0);
    let mut memory = PairMemory::default();
    let mut names: Option<Vec<(u32, Vector3<f64>)>> = None;
    for step in 0..1000 {
        let part = f64::from(step) * 1e-3;
        // Leaning now to one side and now to the other by 1e-3.
        let lean = Vector3::new((30.0 * part).sin(), 0.0, (40.0 * part).cos()) * 1e-3;
        let turn = UnitQuaternion::from_scaled_axis(lean) * about(Vector3::y(), 3.0 * part);
        let X = pose(turn, Vector3::new(0.05 * part, 0.0197, 0.0));
        let found = points(&cube, &X, &slab(), &X_WB, REACH, &mut memory);
        let now: Vec<_> = found
            .iter()
            .map(|point| (point.id, X.inverse_transform_point(&nalgebra::Point3::from(point.point_W)).coords))
            .collect();
        for ((id, at), (first_id, first)) in now.iter().zip(names.get_or_insert(now.clone())) {
            assert!(id == first_id && (*at - *first).norm() < 1e-12, "{step}: {now:?}");
        }
        assert_eq!(now.len(), 4);
    }
}

#[test]
fn edges_that_cross_touch_in_one_point_and_parallel_ones_in_two() {
    let bar: Form = Cuboid::new([0.02, 0.02, 0.1]).unwrap().into();
    let top = 0.01 * 2.0_f64.sqrt();
    let roof = about(Vector3::z(), FRAC_PI_4);
    let depth = 2e-4;
    for (turn, expected) in [(FRAC_PI_2, 1), (1.0, 1), (0.0, 2)] {
        let X = pose(about(Vector3::y(), turn) * roof, Vector3::new(0.0, 2.0 * top - depth, 0.02));
        // It came from above.
        let mut memory = PairMemory::default();
        points(
            &bar,
            &pose(X.rotation, X.translation.vector + Vector3::y() * 0.01),
            &bar,
            &pose(roof, Vector3::zeros()),
            1.0,
            &mut memory,
        );
        let found = points(&bar, &X, &bar, &pose(roof, Vector3::zeros()), REACH, &mut memory);
        let deep: Vec<_> = found.iter().filter(|point| point.gap_m < -1e-9).collect();
        assert_eq!(deep.len(), expected, "{turn}: {found:?}");
        for point in deep {
            assert!((point.normal_W - Vector3::y()).norm() < 1e-6, "{turn}: {point:?}");
            assert!((point.gap_m + depth).abs() < 1e-9, "{turn}: {point:?}");
        }
    }
}

#[test]
fn a_ball_in_the_hole_of_a_ring_touches_it_all_around() {
    let (ball, ring): (Form, Form) =
        (Sphere::new(0.03).unwrap().into(), Torus::new(0.03, 0.01).unwrap().into());
    // 4 cm between the ball's centre and the tube's middle line.
    let height = (0.04_f64 * 0.04 - 0.03 * 0.03).sqrt();
    let X = Isometry3::translation(0.0, height - 1e-4, 0.0);
    let found = points(&ball, &X, &ring, &Isometry3::identity(), REACH, &mut PairMemory::default());
    assert_eq!(found.len(), 4, "{found:?}");
    let sum: Vector3<f64> = found.iter().map(|point| point.normal_W * -point.gap_m).sum();
    assert!(sum.xz().norm() < 1e-15 && sum.y > 0.0, "{sum}");
}

/// A half-space that is somebody's own.
#[derive(Debug, Clone)]
struct Own(Plane);

impl Surface for Own {
    fn signed_distance(&self, point_B: &Vector3<f64>) -> f64 {
        // Only its sign is promised.
        3.0 * self.0.signed_distance(point_B)
    }
    fn nearest(&self, point_B: &Vector3<f64>) -> SurfacePoint {
        self.0.nearest(point_B)
    }
    fn entry(&self, from_B: &Vector3<f64>, to_B: &Vector3<f64>) -> Option<SurfacePoint> {
        self.0.entry(from_B, to_B)
    }
    fn settle(&self, from: &SurfacePoint, on_tangent_plane_B: &Vector3<f64>) -> SurfacePoint {
        self.0.settle(from, on_tangent_plane_B)
    }
    fn grown(&self, _radius_m: f64) -> Option<Self> {
        None
    }
}

#[test]
fn a_ball_lies_on_surfaces_of_ones_own_and_on_patches() {
    let own = Shape::own(Own(Plane::new(Vector3::y(), 0.0).unwrap()));
    let (nurbs, _) = haptics::Nurbs::build(&haptics::nurbs::make::sphere(0.05)).unwrap();
    let patches = Shape::from(std::sync::Arc::new(nurbs));
    let ball: Shape = Sphere::new(0.02).unwrap().into();
    let below = Isometry3::translation(0.0, -0.05, 0.0);
    for (surface, X_WB) in [(own, Isometry3::identity()), (patches, below)] {
        assert!(is_collidable(&ball, &surface));
        assert!(!is_collidable(&Cuboid::new([0.02; 3]).unwrap().into(), &surface));
        for height in [0.0205, 0.0199, 0.015] {
            let X = Isometry3::translation(0.0, height, 0.0);
            let (a, b) = (Solid { shape: &ball, X_W: &X }, Solid { shape: &surface, X_W: &X_WB });
            let mut found = ContactPoints::default();
            contact_points(a, b, REACH, &mut PairMemory::default(), &mut found);
            let [point] = found.as_slice() else { panic!("{found:?}") };
            // Patches find their nearest point to 1e-9 m.
            assert!((point.gap_m - (height - 0.02)).abs() < 1e-8, "{point:?}");
            assert!((point.normal_W - Vector3::y()).norm() < 1e-6, "{point:?}");
        }
    }
}

#[test]
fn however_small_a_form_is_all_its_corners_carry() {
    for size in [1e-4, 1e-3, 1e-2, 1.0] {
        let small = [
            (Form::from(Cuboid::new([size; 3]).unwrap()), 0.5 * size),
            (Cylinder::new(0.5 * size, size).unwrap().into(), 0.5 * size),
            (Torus::new(0.5 * size, 0.1 * size).unwrap().into(), 0.1 * size),
        ];
        for (form, height) in small {
            for (b, X_WB) in
                [(ground(), Isometry3::identity()), (slab(), Isometry3::translation(0.0, -0.05, 0.0))]
            {
                // A slab of 0.2 m carries what is of its size on its own edges.
                if size == 1.0 && matches!(b, Form::Cuboid(_)) {
                    continue;
                }
                let X = Isometry3::translation(0.0, height - 1e-3 * size, 0.0);
                let found = points(&form, &X, &b, &X_WB, REACH, &mut PairMemory::default());
                let deep: Vec<_> = found.iter().filter(|point| point.gap_m < 0.0).collect();
                assert_eq!(deep.len(), 4, "{form:?}: {found:?}");
                for point in deep {
                    assert!((point.gap_m + 1e-3 * size).abs() < 1e-12, "{form:?}: {point:?}");
                }
            }
        }
    }
}

/// Edges that are nearly parallel cross anywhere: a face has the stiffness of its corners all the same.
#[test]
fn boxes_of_one_size_stand_on_each_other_on_four_corners_however_they_are_turned() {
    let cube: Form = Cuboid::new([0.02; 3]).unwrap().into();
    for turned in [0.0, 1e-9, -1e-7, 3e-6, -1e-4, 1e-3, -0.02] {
        for aside in [[0.0, 0.0], [1e-7, -3e-8], [2e-6, 1e-6], [-1e-5, 3e-5]] {
            let at = Vector3::new(aside[0], 0.02 - 1e-5, aside[1]);
            let X = pose(about(Vector3::y(), turned), at);
            let found = points(&cube, &X, &cube, &Isometry3::identity(), REACH, &mut PairMemory::default());
            let corners: f64 = found.iter().map(|point| point.share).sum();
            // Beside them, a crossing of an edge and its neighbour counts as far as the outline turns there.
            let most = 4.0 + 4.0 * f64::abs(turned) / 0.3 + 1e-6;
            assert!((3.99..=most).contains(&corners), "{turned} {aside:?}: {corners}");
            let whole = found.iter().filter(|point| point.share > 0.5).count();
            assert_eq!(whole, 4, "{turned} {aside:?}");
        }
    }
}
