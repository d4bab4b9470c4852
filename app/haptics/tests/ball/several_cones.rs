//! A friction cone per contact of a ball: god-object and each contact's force, against an oracle that goes contact by contact.

use std::slice::from_ref;

use crate::common::meshes::{self, built, icosphere, step, wedge};
use crate::common::*;
use crate::cones::{Coefficients, Cones, Wall};
use crate::trees::{self, v};
use haptics::mesh::TriangleSoup;
use haptics::{
    ContactState, CsgPart, CsgTree, Cuboid, Entity, FingerOutput, Friction, Plane, Stribeck, TouchPoint,
};
use nalgebra::{Isometry3, UnitQuaternion, Vector3};

const R: f64 = 0.01;
const MU: f64 = 0.4;
/// Positions of 0.1 m are known to 1e-17 m, and a groove of 20 degrees makes six times of it (m).
const SAME_PLACE: f64 = 1e-14;
/// That at 500 N/m, and roundings of 10 N (N).
const SAME_FORCE: f64 = 1e-11;

/// Through the origin, a ball in front of it.
fn wall(normal: Vector3<f64>) -> Wall {
    (normal.normalize(), R)
}

/// Two walls with this angle between them (degrees) that meet along z.
fn groove(degrees: f64) -> Vec<Wall> {
    let (s, c) = (0.5 * degrees).to_radians().sin_cos();
    vec![wall(v(c, s, 0.0)), wall(v(-c, s, 0.0))]
}

fn half_spaces(walls: &[Wall]) -> CsgTree {
    CsgTree::union(walls.iter().map(|wall| CsgPart::from(Plane::new(wall.0, 0.0).unwrap())))
}

/// Boxes of 0.4 m, each with the middle of a side in the origin.
fn boxes(walls: &[Wall]) -> CsgTree {
    CsgTree::union(walls.iter().map(|(normal, _)| {
        let turn = UnitQuaternion::rotation_between(&Vector3::y(), normal).unwrap();
        CsgPart::new(Cuboid::new([0.4; 3]).unwrap(), Isometry3::from_parts((normal * -0.2).into(), turn))
    }))
}

fn frictions() -> [(Friction, Coefficients); 2] {
    let coulomb = Coefficients { to_hold: MU, to_slide: MU, to_catch: 1.0 };
    let stick_slip = Coefficients { to_hold: MU_S, to_slide: MU_D, to_catch: 1.0 - haptics::RESTICK_MARGIN };
    [(Friction::coulomb(MU).unwrap(), coulomb), (stiction(), stick_slip)]
}

/// From above, then to and fro between random places of a box, slowly or fast.
fn roaming(seed: u64, from: Vector3<f64>, low: Vector3<f64>, high: Vector3<f64>) -> Vec<Vector3<f64>> {
    let mut noise = Noise(seed);
    let (mut hip, mut goal, mut step_m) = (from, 0.5 * (low + high), 3e-4);
    (0..2000)
        .map(|_| {
            let way: Vector3<f64> = goal - hip;
            if way.norm() < 2.0 * step_m {
                goal = Vector3::from_fn(|i, _| noise.between(low[i], high[i]));
                step_m = noise.between(2e-5, 4e-4);
            }
            hip += way * (step_m / way.norm().max(step_m)) + noise.vector(0.1 * step_m);
            hip
        })
        .collect()
}

/// How often it happened.
#[derive(Debug, Default)]
struct Seen {
    on_several: usize,
    met_while_sliding: usize,
    left: usize,
}

/// Tick by tick: where the centre is, and at each wall the force.
fn follows_the_cones(entity: &Entity, walls: &[Wall], mu: Coefficients, path: &[Vector3<f64>]) -> Seen {
    let (mut finger, mut cones) = (finger(R), Cones::new(walls.to_vec(), mu));
    let (mut seen, mut count_before) = (Seen::default(), 0);
    for (i, hip) in path.iter().enumerate() {
        let out = step(&mut finger, entity, hip);
        let force = cones.step(hip) * K;
        let centre = cones.centre.unwrap_or(*hip);
        let apart = (out.god_object_W - centre).norm();
        assert!(apart < SAME_PLACE, "{i}: {apart:e} apart, {} and {centre} at {hip}", out.god_object_W);
        assert!((out.force_on_user_W - force).norm() < SAME_FORCE, "{i}: {} {force}", out.force_on_user_W);
        let points = finger.touch_points(from_ref(entity), 0);
        is_inside_its_cones(&out, points.as_slice(), mu.to_hold);
        // Of more than three walls that meet in one place the loads are not unique.
        let touched = walls.iter().filter(|(normal, offset)| normal.dot(&centre) - offset < 1e-12).count();
        for cone in cones.pressed.iter().filter(|_| touched <= 3) {
            let own = (cone.normal * cone.load + cone.tangential) * K;
            let point = points.as_slice().iter().find(|point| (point.normal_W - cone.normal).amax() < 1e-9);
            let felt = point.map_or_else(Vector3::zeros, |point| point.force_on_user_W);
            assert!((felt - own).norm() < SAME_FORCE, "{i}: {felt} {own} at {}", cone.normal);
        }
        let count = cones.pressed.len();
        seen.on_several += usize::from(count > 1);
        let slides = out.friction == ContactState::Slip;
        seen.met_while_sliding += usize::from(slides && count > count_before && count_before > 0);
        seen.left += usize::from(count < count_before && count > 0);
        count_before = count;
    }
    seen
}

/// Each contact pushes, and lies within `mu` times its own load; together they are what is felt.
fn is_inside_its_cones(out: &FingerOutput, points: &[TouchPoint], mu: f64) {
    let mut sum = Vector3::zeros();
    for point in points {
        let normal_n = point.force_on_user_W.dot(&point.normal_W);
        let tangential_n = (point.force_on_user_W - point.normal_W * normal_n).norm();
        assert!(normal_n >= 0.0 && tangential_n <= mu * normal_n + 1e-14, "{point:?}");
        sum += point.force_on_user_W;
    }
    assert!((sum - out.force_on_user_W).norm() < 1e-13, "{sum} {}", out.force_on_user_W);
}

#[test]
fn in_grooves_each_contact_does_what_its_own_cone_says() {
    for degrees in [20.0_f64, 60.0, 90.0, 140.0, 175.0] {
        let walls = groove(degrees);
        // Where the ball lies on the ground of it.
        let lowest = R / (0.5 * degrees).to_radians().sin();
        let (low, high) = (v(-6e-3, lowest - 1e-2, -1e-2), v(6e-3, lowest + 2e-3, 1e-2));
        let path = roaming(7, v(0.0, lowest + 0.02, 0.0), low, high);
        for (friction, mu) in frictions() {
            let mesh = meshes::touchable(&built(wedge(360.0 - degrees)), friction.clone());
            let solid = trees::touchable(&half_spaces(&walls), friction.clone());
            let joined = trees::touchable(&boxes(&walls), friction);
            for entity in [mesh, solid, joined] {
                let seen = follows_the_cones(&entity, &walls, mu, &path);
                let happens = degrees < 170.0;
                assert!(!happens || seen.on_several > 100, "{degrees}: {seen:?}");
                assert!(!happens || seen.left > 0, "{degrees}: {seen:?}");
            }
        }
    }
}

#[test]
fn in_corners_of_three_walls_each_contact_does_what_its_own_cone_says() {
    let skew = [v(1.0, 0.2, 0.1), v(-0.3, 1.0, 0.2), v(-0.2, 0.3, 1.0)];
    for normals in [[Vector3::x(), Vector3::y(), Vector3::z()], skew] {
        let walls = normals.map(wall);
        let path = roaming(11, Vector3::repeat(0.04), Vector3::repeat(0.0), Vector3::repeat(0.02));
        for (friction, mu) in frictions() {
            for tree in [half_spaces(&walls), boxes(&walls)] {
                let seen = follows_the_cones(&trees::touchable(&tree, friction.clone()), &walls, mu, &path);
                assert!(seen.on_several > 100 && seen.met_while_sliding > 0 && seen.left > 0, "{seen:?}");
            }
        }
    }
}

/// The lower part of a ball of triangles, from inside; askew, or five walls would meet in one place and hide each other.
fn cup(subdivisions: u32, radius_m: f64) -> (Vec<Wall>, TriangleSoup) {
    let TriangleSoup { vertices, mut faces } = icosphere(subdivisions, radius_m);
    let askew = |p: &Vector3<f64>| v(p.x + 0.1 * p.y, p.y, 1.1 * p.z - 0.07 * p.x);
    let vertices: Vec<_> = vertices.iter().map(askew).collect();
    let corners = |face: &[u32; 3]| face.map(|i| vertices[i as usize]);
    faces.retain(|face| corners(face).iter().all(|corner| corner.y < 0.3 * radius_m));
    let walls = faces.iter().map(|face| {
        let [a, b, c] = corners(face);
        let normal = (c - a).cross(&(b - a)).normalize();
        (normal, normal.dot(&a) + R)
    });
    (walls.collect(), TriangleSoup { vertices: vertices.clone(), faces })
}

#[test]
fn in_a_cup_of_many_faces_each_contact_does_what_its_own_cone_says() {
    let mut several = 0;
    for (subdivisions, radius_m) in [(0, 0.03), (1, 0.03), (2, 0.05), (2, 0.03)] {
        let (walls, soup) = cup(subdivisions, radius_m);
        let low = v(-0.02, -radius_m, -0.02);
        let path = roaming(13, Vector3::zeros(), low, v(0.02, -0.3 * radius_m, 0.02));
        let mesh = built(soup);
        for (friction, mu) in frictions() {
            let seen = follows_the_cones(&meshes::touchable(&mesh, friction), &walls, mu, &path);
            several += seen.on_several;
        }
    }
    assert!(several > 100, "{several}");
}

/// In a groove of 90 degrees, by hand.
#[test]
fn a_wall_that_is_met_while_sliding_is_slid_on_from_where_it_is_met() {
    let walls = groove(90.0);
    let [(a, _), (b, _)] = [walls[0], walls[1]];
    let mesh = meshes::touchable(&built(wedge(270.0)), stiction());
    let tree = trees::touchable(&boxes(&walls), stiction());
    for entity in [mesh, tree] {
        let mut finger = finger(R);
        let depth = 2e-3;
        // Its foot on wall a, `away` from wall b; and pressed there.
        let over = |depth: f64, away: f64, z: f64| a * (R - depth) + b * (R + away) + v(0.0, 0.0, z);
        step(&mut finger, &entity, &over(-1e-3, 5e-3, 0.0));
        step(&mut finger, &entity, &over(depth, 5e-3, 0.0));
        // In one leap through wall b, and along the groove.
        let out = step(&mut finger, &entity, &over(depth, -2e-3, 7e-3));
        // Straight towards (-2, 7) mm from (5, 0) mm it meets the other wall at (0, 5) mm.
        let met = over(0.0, 0.0, 5e-3);
        // 2 mm are left along the groove, of which both walls bear 0.3 * (2 + 2) mm: it slides on by 0.8 mm.
        let rests = met + v(0.0, 0.0, 2e-3 - MU_D * (depth + 2e-3));
        assert!((out.god_object_W - rests).norm() < 1e-11, "{} {rests}", out.god_object_W);
        assert_eq!(out.friction, ContactState::Slip);
        for point in finger.touch_points(from_ref(&entity), 0).as_slice() {
            // A cone that began to stick would hold the whole of it: 0.7 * 4 mm are more than 2.
            let own = (point.normal_W - v(0.0, 0.0, MU_D)) * (K * 2e-3);
            assert!((point.force_on_user_W - own).norm() < 1e-8, "{} {own}", point.force_on_user_W);
        }
    }
}

#[test]
fn along_a_groove_each_contact_bears_at_every_speed_what_its_law_says_of_its_own_load() {
    // So flat that there is one solution at most: at 5 mm it falls by 0.2 over 1 m/s.
    let stribeck = Stribeck::new(0.5, 0.3, 1.0, 0.05).unwrap();
    let viscous = Friction::coulomb_viscous(0.2, 1.0).unwrap();
    on_its_curve(&Friction::Stribeck(stribeck), |speed| stribeck.ratio_at(speed));
    on_its_curve(&viscous, |speed| 0.2 + speed);
}

fn on_its_curve(friction: &Friction, ratio_at: impl Fn(f64) -> f64) {
    for entity in [
        meshes::touchable(&built(wedge(300.0)), friction.clone()),
        trees::touchable(&half_spaces(&groove(60.0)), friction.clone()),
    ] {
        let (mut finger, mut last, mut slid) = (finger(R), Vector3::zeros(), 0);
        for i in 0..400 {
            let down = f64::from(i).min(100.0) * 1e-2;
            let along = 0.02 * (0.02 * f64::from(i - 100).max(0.0)).sin();
            let hip = v(1e-3 * down, 2.0 * R + 0.01 - 0.015 * down, along);
            let out = step(&mut finger, &entity, &hip);
            let speed = (out.god_object_W - last).norm() / DT;
            last = out.god_object_W;
            if i <= 101 || speed == 0.0 {
                continue;
            }
            slid += 1;
            let points = finger.touch_points(from_ref(&entity), 0);
            assert_eq!(points.as_slice().len(), 2);
            for point in points.as_slice() {
                let normal_n = point.force_on_user_W.dot(&point.normal_W);
                let tangential_n = (point.force_on_user_W - point.normal_W * normal_n).norm();
                // A place 0.02 m away is known to 3e-18 m, its speed to 1e-14 m/s; a slide ends at 1e-12 of the load.
                let (ratio, expected) = (tangential_n / normal_n, ratio_at(speed));
                assert!((ratio - expected).abs() < 1e-11, "{i}: {ratio} {expected}");
            }
        }
        assert!(slid > 100, "{slid}");
    }
}

/// Loads that friction may raise hold a ball in a narrow groove against any pull: these two cones bear it by themselves,
/// with nothing that presses. So the loads are those of the contacts without friction.
#[test]
fn a_narrow_groove_lets_go_though_friction_alone_could_hold_there() {
    let walls = groove(20.0);
    let (s, c) = 10.0_f64.to_radians().sin_cos();
    let pull = v(0.0, 100.0, 0.0);
    let load = 0.5 * pull.y / (MU * c - s);
    let down = |normal: &Vector3<f64>| v(normal.x.signum() * s, -c, 0.0);
    let held: Vector3<f64> = walls.iter().map(|(n, _)| (n + down(n) * MU) * load).sum();
    assert!(load > 0.0 && walls.iter().all(|(n, _)| n.dot(&down(n)).abs() < 1e-14));
    assert!((held + pull).norm() < 1e-12, "any pull is borne: {held}");

    for entity in [
        meshes::touchable(&built(wedge(340.0)), Friction::coulomb(MU).unwrap()),
        trees::touchable(&half_spaces(&walls), Friction::coulomb(MU).unwrap()),
    ] {
        let (mut finger, lowest) = (finger(R), R / s);
        for i in 0..=200 {
            // 10 mm in, and out again.
            let height = (1e-4 * f64::from(i - 100)).abs() - 1e-2 + 2.5e-4;
            let out = step(&mut finger, &entity, &v(0.0, lowest + height, 0.0));
            assert!(out.force_on_user_W.y >= 0.0, "{i}: nothing pulls: {}", out.force_on_user_W);
            assert_eq!(out.entity.is_some(), height < 0.0, "{i}: {height}");
        }
    }
}

/// Two sheets that meet along z, this much from a plane (rad).
fn fold(angle: f64) -> TriangleSoup {
    let rise = 0.1 * (0.5 * angle).tan();
    let line = |x: f64, y: f64| [v(x, y, -0.1), v(x, y, 0.1)];
    let vertices = [line(-0.1, rise), line(0.0, 0.0), line(0.1, rise)].concat();
    TriangleSoup { vertices, faces: vec![[0, 1, 3], [0, 3, 2], [2, 3, 5], [2, 5, 4]] }
}

#[test]
fn near_a_fold_that_is_nearly_flat_nothing_of_friction_is_lost() {
    for angle in [0.1, 1e-2, 1e-3, 1e-4] {
        let entity = meshes::touchable(&built(fold(angle)), Friction::coulomb(MU).unwrap());
        let (mut noise, mut on_both) = (Noise(3), 0);
        for _ in 0..500 {
            let (mut finger, depth) = (finger(R), noise.between(1e-3, 5e-3));
            step(&mut finger, &entity, &v(noise.between(-1e-3, 1e-3), R + 1e-3, 0.0));
            for i in 0..40 {
                // Every other tick where both sheets push.
                let both = 0.6 * depth * angle;
                let width = if i % 2 == 0 { both } else { 3e-3 };
                let hip = v(noise.between(-width, width), R - depth, noise.between(-1e-3, 1e-3));
                let out = step(&mut finger, &entity, &hip);
                let points = finger.touch_points(from_ref(&entity), 0);
                is_inside_its_cones(&out, points.as_slice(), MU);
                on_both += usize::from(points.as_slice().len() == 2);
                // What it touches it may miss by 1e-9 of its radius, and the sheets' crossing by that over the angle.
                let missed = K * (1e-9 * R + 1e-13) / angle.sin();
                let whole = (out.god_object_W - hip) * K;
                assert!(
                    (out.force_on_user_W - whole).norm() < 2.0 * missed + 1e-12,
                    "{angle} {i}: {out:?} {whole}"
                );
            }
        }
        assert!(angle < 1e-3 || on_both > 0, "{angle}: {on_both}");
    }
}

#[test]
fn on_more_walls_than_it_needs_each_contact_has_its_cone() {
    let pit = [v(1.0, 1.0, 0.0), v(-1.0, 1.0, 0.0), v(0.0, 1.0, 1.0), v(0.0, 1.0, -1.0)].map(wall);
    // Its floor touches the ball that the walls hold.
    let c = 0.75_f64.sqrt();
    let trough =
        [v(c, 0.5, 0.0), v(-c, 0.5, 0.0), v(0.0, 1.0, 0.0)].map(|n| (n, n.dot(&v(0.0, 2.0 * R, 0.0))));
    let mut lowest = [2.0_f64.sqrt() * R, 2.0 * R].into_iter();
    for walls in [&pit[..], &trough[..]] {
        let parts = walls.iter().map(|(n, offset)| CsgPart::from(Plane::new(*n, offset - R).unwrap()));
        let low = v(0.0, lowest.next().unwrap(), 0.0);
        let path =
            roaming(17, low + v(0.0, 0.02, 0.0), low - Vector3::repeat(8e-3), low + v(8e-3, 2e-3, 8e-3));
        for (friction, mu) in frictions() {
            let entity = trees::touchable(&CsgTree::union(parts.clone()), friction);
            let (mut finger, mut most) = (finger(R), 0);
            for hip in &path {
                let out = step(&mut finger, &entity, hip);
                let points = finger.touch_points(from_ref(&entity), 0);
                is_inside_its_cones(&out, points.as_slice(), mu.to_hold);
                // What is felt is the whole spring, however the walls share it.
                let whole =
                    if out.entity.is_some() { (out.god_object_W - hip) * K } else { Vector3::zeros() };
                assert!((out.force_on_user_W - whole).norm() < 1e-7, "{out:?} {whole}");
                most = most.max(points.as_slice().len());
            }
            assert!(most >= 2, "{most}");
        }
    }
}
