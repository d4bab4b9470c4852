//! Balls on shaded meshes: felt as shaded where they touch, and continuous where they touch at several places.

use crate::common::meshes::{built, bumpy_sphere, icosphere, step, touchable, wedge};
use crate::common::*;
use haptics::mesh::{Mesh, SHARPEST_CREASE_RAD};
use haptics::{Entity, Feature, Friction, Shading, ShadingForm, Shape, SurfacePoint};
use nalgebra::Vector3;
use std::sync::Arc;

const R: f64 = 0.1;
const FINGER_M: f64 = 2e-3;

fn shaded(mesh: &Arc<Mesh>, friction: Friction, crease_rad: f64) -> Entity {
    let shading = Shading::interpolated(mesh, crease_rad, ShadingForm::Rotate).unwrap();
    touchable(mesh, friction).with_shading(shading)
}

/// Largest angle between the force and the way from the ball's middle to the finger, on a spiral over the ball, and
/// the largest change of direction from one tick to the next \[rad\].
fn worst_angles(entity: &Entity) -> (f64, f64) {
    let mut finger = finger(FINGER_M);
    let (mut off, mut leap): (f64, f64) = (0.0, 0.0);
    let mut last: Option<Vector3<f64>> = None;
    for i in 0..20_000 {
        let theta = 0.1 + 2.9 * f64::from(i) / 20_000.0;
        let (u, depth) = (9.0 * theta, 1e-3);
        let way = Vector3::new(theta.sin() * u.cos(), theta.cos(), theta.sin() * u.sin());
        let force = step(&mut finger, entity, &(way * (R + FINGER_M - depth))).force_on_user_W;
        if force.norm() == 0.0 {
            // Over the middle of a facet, which is lower.
            last = None;
            continue;
        }
        off = off.max(force.angle(&way));
        leap = last.map_or(leap, |last| leap.max(force.angle(&last)));
        last = Some(force);
    }
    (off, leap)
}

/// How far the shaded normals at the vertices are from the true ball's \[rad\].
fn off_at_vertices(mesh: &Arc<Mesh>) -> f64 {
    let shading = Shading::interpolated(mesh, SHARPEST_CREASE_RAD, ShadingForm::Rotate).unwrap();
    let shape = Shape::from(Arc::clone(mesh));
    let corners =
        mesh.faces().iter().enumerate().flat_map(|(i, face)| face.vertices.map(|vertex| (i, vertex)));
    let angle = |(face, vertex): (usize, u32)| {
        let point_B = mesh.vertices()[vertex as usize];
        let at = SurfacePoint {
            point_B,
            normal_B: mesh.faces()[face].normal_B,
            feature: Feature::Face,
            piece: face as u32,
        };
        shading.normal_at(&shape, &at).angle(&point_B)
    };
    corners.map(angle).fold(0.0, f64::max)
}

#[test]
fn a_coarse_shaded_ball_feels_round_to_a_ball() {
    // Facets of 14 mm, tilted by up to 0.08 rad from the true ball.
    let mesh = built(icosphere(3, R));
    let (flat_off, _) = worst_angles(&touchable(&mesh, Friction::None));
    let (off, leap) = worst_angles(&shaded(&mesh, Friction::None, SHARPEST_CREASE_RAD));
    // Normals that are mixed of three vertices' are as true as these, and would be exact if these were. Besides, the
    // finger's foot is beside it by its height over the facet, 1 mm and the facet's sag of 0.4 mm, times the tilt.
    let bound = off_at_vertices(&mesh) + 0.1 * 1.4e-3 / R;
    assert!(off < bound, "{off} {bound}");
    assert!(bound < 0.01, "{bound}");
    assert!(flat_off > 0.05, "{flat_off}");
    // 10 ticks a milliradian and ten turns wide: the spiral takes 1.3 mrad of the ball a tick.
    assert!(leap < 3e-3, "{leap}");
}

#[test]
fn what_a_ball_feels_in_a_shaded_fold_changes_continuously() {
    // 20 degrees, which is no crease: 10 degrees at the fold, none at the far ends of the flanks.
    let entity = shaded(&built(wedge(200.0)), Friction::None, 0.5);
    let (slope, radius_m, depth_m, ticks) = (10_f64.to_radians().tan(), 0.01, 2e-3, 20_000);
    let at = |i: u32| {
        let x = 0.04 * (2.0 * f64::from(i) / f64::from(ticks) - 1.0);
        Vector3::new(x, slope * x.abs() + radius_m - depth_m, 0.0123)
    };
    let mut finger = finger(radius_m);
    let (mut last, mut leap): (Option<Vector3<f64>>, f64) = (None, 0.0);
    let mut ticks_with = [0; 4];
    for i in 0..=ticks {
        let out = step(&mut finger, &entity, &at(i));
        let points = finger.touch_points(std::slice::from_ref(&entity), 0);
        let all: Vector3<f64> = points.as_slice().iter().map(|point| point.force_on_user_W).sum();
        // Roundings of a newton.
        assert!((all - out.force_on_user_W).norm() < 1e-14, "{i}");
        ticks_with[points.as_slice().iter().filter(|point| point.force_on_user_W.norm() > 0.0).count()] += 1;
        leap = last.map_or(leap, |last| leap.max((out.force_on_user_W - last).norm()));
        last = Some(out.force_on_user_W);
    }
    assert!(ticks_with[1] > 1000 && ticks_with[2] > 100, "{ticks_with:?}");
    // The spring follows the way of a tick, 4 um; that the shaded normal turns by 0.17 rad over 0.1 m adds 2 mm of that.
    let way_m = (at(1) - at(0)).norm();
    assert!(leap < 1.05 * K * way_m, "{leap:e} {:e}", K * way_m);
}

#[test]
fn a_shaded_ball_on_bumps_feels_what_each_place_does_and_all_together_no_more_than_the_facets() {
    let mesh = bumpy_sphere(60);
    let friction = Friction::coulomb(0.5).unwrap();
    let entities = [touchable(&mesh, friction.clone()), shaded(&mesh, friction, SHARPEST_CREASE_RAD)];
    let mut fingers = [finger(0.04), finger(0.04)];
    let (mut several, mut smaller, mut following) = (0, 0, 0);
    for i in 0..50_000 {
        let t = f64::from(i) / 50_000.0 * std::f64::consts::TAU;
        let hip = Vector3::new(t.cos(), 0.1 * (3.0 * t).sin(), t.sin()) * 0.125;
        let mut felt = [Vec::new(), Vec::new()];
        for ((finger, entity), felt) in fingers.iter_mut().zip(&entities).zip(&mut felt) {
            step(finger, entity, &hip);
            let points = finger.touch_points(std::slice::from_ref(entity), 0);
            felt.extend(points.as_slice().iter().map(|point| point.force_on_user_W));
        }
        let [flat, round] = &felt;
        assert_eq!(flat.len(), round.len());
        let [flat_n, round_n] = felt.each_ref().map(|felt| felt.iter().sum::<Vector3<f64>>().norm());
        let [flat_sum, round_sum] = felt.each_ref().map(|felt| felt.iter().map(Vector3::norm).sum::<f64>());
        if flat_sum == 0.0 {
            continue;
        }
        // Roundings, of a force of some newtons, once the places' forces are summed up and what is left is shared out.
        let size = round_sum / flat_sum;
        let are_alike = flat.iter().zip(round).all(|(a, b)| (a.norm() * size - b.norm()).abs() < 1e-12);
        if !are_alike || size > 1.0 + 1e-12 {
            // After a leap of the ball's foot the force follows.
            following += 1;
            continue;
        }
        several += u32::from(flat.len() > 1);
        smaller += u32::from(size < 0.999);
        assert!(round_n < flat_n + 1e-12, "{i}: {felt:?}");
    }
    assert!(several > 200 && smaller > 100 && following < 1000, "{several} {smaller} {following}");
}

#[test]
fn deep_below_a_shaded_mesh_what_a_ball_feels_is_continuous() {
    for (subdivisions, friction) in [
        (1, Friction::None),
        (2, Friction::None),
        (2, Friction::coulomb(0.5).unwrap()),
        (2, Friction::viscous(20.0).unwrap()),
    ] {
        let mesh = built(icosphere(subdivisions, R));
        let inner_m = mesh.faces().iter().fold(R, |least, face| least.min(face.offset_m));
        let rho = inner_m + FINGER_M - 5e-3;
        let largest_n = |entity: &Entity| {
            let mut finger = finger(FINGER_M);
            let (mut last, mut largest_n): (Option<Vector3<f64>>, f64) = (None, 0.0);
            step(&mut finger, entity, &Vector3::new(0.0, 2.0 * R, 0.0));
            for i in 0..60_000 {
                let t = 1e-5 * f64::from(i);
                let (theta, u) = (0.3 + 1.2 * t, 3.0 * t);
                let way = Vector3::new(theta.sin() * u.cos(), theta.cos(), theta.sin() * u.sin());
                let force = step(&mut finger, entity, &(way * rho)).force_on_user_W;
                largest_n = last.map_or(largest_n, |last| largest_n.max((force - last).norm()));
                // It begins as deep as it goes on; what comes to rest then is no leap.
                last = (i > 1000).then_some(force);
            }
            largest_n
        };
        let shaded_n = largest_n(&shaded(&mesh, friction.clone(), SHARPEST_CREASE_RAD));
        let flat_n = largest_n(&touchable(&mesh, friction.clone()));
        println!("{} triangles, {friction:?}: {shaded_n} N, in facets {flat_n} N", mesh.faces().len());
        // The way of a tick is 3 um around the ball; twice as much as that the shaded normal may turn the force.
        let way_m = 1e-5 * 1.2_f64.hypot(3.0) * R;
        assert!(shaded_n < 3.0 * K * way_m, "{shaded_n} N");
    }
}
