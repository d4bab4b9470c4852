//! Balls on meshes: how near to the true surface, what energy they exchange, and what happens when things move, begin
//! inside, go fast or are no numbers.

use crate::common::meshes::{
    Roaming, built, bumpy_sphere, cube, plate, star, step, touchable, uv_sphere, wedge,
};
use crate::common::*;
use haptics::mesh::make;
use haptics::{ContactState, Cuboid, Finger, Friction};
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use path::{FINGER_M, Phase};

#[test]
fn on_a_million_triangles_a_ball_is_where_it_would_be_on_the_true_ball() {
    let entity = touchable(&uv_sphere(1000), Friction::None);
    let mut finger = finger(FINGER_M);
    let (mut squares, mut ticks): (f64, f64) = (0.0, 0.0);
    for (phase, hip) in path::standard_path(path::smooth_for_a_ball) {
        let out = step(&mut finger, &entity, &hip);
        if phase == Phase::Slide {
            let true_centre = hip.normalize() * (path::R + FINGER_M);
            squares += (out.god_object_W - true_centre).norm_squared();
            ticks += 1.0;
        }
    }
    let rms_m = (squares / ticks).sqrt();
    // Facets of 6.3 mrad tilt by up to 3.1 mrad in each of two directions, evenly spread: an rms of 3.1 sqrt(2/3) mrad,
    // which 5 mm under the surface is 12.8 um; meridians that meet at the poles make it less.
    assert!(rms_m < 13e-6, "{rms_m:e}");
}

/// What a finger gains on a closed way, from the second turn on.
fn gained(
    entity: &haptics::Entity,
    radius_m: f64,
    at: impl Fn(f64) -> Vector3<f64>,
    ticks: u32,
) -> (f64, f64) {
    let mut finger = finger(radius_m);
    let (mut work, mut bound) = (0.0, 0.0);
    for i in 0..2 * ticks {
        let turn = |i: u32| at(f64::from(i) / f64::from(ticks) * std::f64::consts::TAU);
        let out = step(&mut finger, entity, &turn(i));
        let way = turn(i + 1) - turn(i);
        if i >= ticks {
            work += out.force_on_user_W.dot(&way);
            // A force that is held for a tick lags behind by half of the way on average.
            bound += 0.5 * K * way.norm_squared();
        }
    }
    (work, bound)
}

#[test]
fn a_closed_way_without_friction_gains_nothing_but_what_holding_a_force_for_a_tick_makes() {
    let lying = |y: f64, a: f64, b: f64| {
        move |t: f64| Vector3::new(a * t.cos(), y + b * (2.0 * t).sin(), b * t.sin())
    };
    for (name, mesh, way) in [
        ("top of a cube", cube(), lying(0.057, 0.03, 2e-3)),
        ("groove", built(wedge(300.0)), lying(0.013, 6e-3, 2e-3)),
        ("fold", built(wedge(190.0)), lying(0.007, 0.02, 1e-3)),
        ("bumps", bumpy_sphere(200), lying(0.1, 0.012, 2e-3)),
    ] {
        let (work, bound) = gained(&touchable(&mesh, Friction::None), 0.01, way, 20_000);
        assert!(work < 1.05 * bound, "{name}: gained {work:e} J, of {bound:e} J that a tick explains");
        if name != "bumps" {
            // Convex or two walls: it does not snap either.
            assert!(work.abs() < 1.05 * bound, "{name}: {work:e} {bound:e}");
        }
    }
}

#[test]
fn with_friction_a_closed_way_costs_energy() {
    let way = |t: f64| Vector3::new(0.02 * t.cos(), 0.005, 0.02 * t.sin());
    for mu in [0.1, 0.5] {
        let entity = touchable(&built(wedge(190.0)), Friction::coulomb(mu).unwrap());
        let (work, bound) = gained(&entity, 0.01, way, 5000);
        assert!(work < -10.0 * bound, "{mu}: {work:e} {bound:e}");
    }
}

#[test]
fn a_moving_cube_of_triangles_meets_a_resting_ball_as_a_box_does() {
    for friction in [Friction::None, Friction::coulomb(0.5).unwrap()] {
        let mut mesh = touchable(&cube(), friction.clone());
        let mut form = entity(Cuboid::new([0.1; 3]).unwrap(), friction);
        let mut fingers = [finger(0.01), finger(0.01)];
        let hip = Vector3::new(0.0, 0.0, 0.0);
        let mut touched = 0;
        for i in 0..2000 {
            let t = f64::from(i) * DT;
            let turned = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 0.05 * (3.0 * t).sin());
            let pose = Isometry3::from_parts(
                Translation3::new(0.01 * t, -0.061 + 5e-3 * (8.0 * t).sin(), 0.0),
                turned,
            );
            mesh.move_to(pose);
            form.move_to(pose);
            let [a, b] = [step(&mut fingers[0], &mesh, &hip), step(&mut fingers[1], &form, &hip)];
            assert_eq!((a.entity, a.friction), (b.entity, b.friction), "{i}");
            // Entries of the swept path are found to a billionth of the radius, times 500 N/m.
            assert!((a.force_on_user_W - b.force_on_user_W).norm() < 1e-8, "{i}: {a:?} {b:?}");
            touched += u32::from(a.entity.is_some());
        }
        assert!(touched > 500 && touched < 1900, "{touched}");
    }
}

#[test]
fn a_ball_found_inside_is_pushed_out_the_shortest_way_and_slowly() {
    let entity = touchable(&cube(), Friction::None);
    for (hip, way) in [
        (Vector3::new(0.0, 0.045, 0.01), Vector3::y()),
        (Vector3::new(-0.057, 0.0, 0.01), -Vector3::x()),
        (Vector3::new(0.01, 0.02, -0.048), -Vector3::z()),
    ] {
        let mut finger = Finger::new(0.01, 1).unwrap();
        let depth = 0.06 - hip.dot(&way);
        for i in 1..=150 {
            let out = step(&mut finger, &entity, &hip);
            let strength = (f64::from(i) / 100.0).min(1.0);
            // Sums of 100 steps of 0.01, and roundings of centimetres at 500 N/m.
            let expected = way * (K * depth * strength);
            assert!(
                (out.force_on_user_W - expected).norm() < 1e-10,
                "{i}: {} {expected}",
                out.force_on_user_W
            );
        }
    }
}

#[test]
fn however_fast_a_ball_does_not_pass_a_thin_plate() {
    let mut noise = Noise(5);
    for radius_m in [5e-4, 2e-3, 0.01] {
        let entity = touchable(&plate(), Friction::None);
        for _ in 0..500 {
            let mut finger = finger(radius_m);
            let above = Vector3::new(
                noise.between(-0.03, 0.03),
                noise.between(0.02, 0.1),
                noise.between(-0.03, 0.03),
            );
            step(&mut finger, &entity, &above);
            let below = Vector3::new(noise.between(-0.03, 0.03), -above.y, noise.between(-0.03, 0.03));
            for _ in 0..20 {
                let out = step(&mut finger, &entity, &below);
                assert_eq!(out.entity, Some(0));
                assert!((out.god_object_W.y - 1e-3 - radius_m).abs() < 1e-9, "{}", out.god_object_W);
            }
        }
    }
}

#[test]
fn a_sheet_holds_a_ball_on_either_side() {
    let [a, b, c, d] = [[-0.05, 0.0, -0.05], [0.05, 0.0, -0.05], [0.05, 0.0, 0.05], [-0.05, 0.0, 0.05]];
    let vertices = [a, b, c, d].map(Vector3::from).to_vec();
    let sheet = built(haptics::mesh::TriangleSoup { vertices, faces: vec![[0, 1, 2], [0, 2, 3]] });
    for friction in [Friction::None, stiction()] {
        for side in [1.0, -1.0] {
            let entity = touchable(&sheet, friction.clone());
            let mut finger = finger(4e-3);
            for i in 0..200 {
                let y = side * (0.02 - 1e-3 * f64::from(i.min(60)));
                let out = step(&mut finger, &entity, &Vector3::new(0.01, y, 0.02));
                let depth = (4e-3 - side * y).max(0.0);
                // Roundings of centimetres at 500 N/m.
                assert!(
                    (out.force_on_user_W.y - side * K * depth).abs() < 1e-11,
                    "{i}: {}",
                    out.force_on_user_W
                );
            }
        }
    }
}

#[test]
fn a_ball_held_by_friction_is_let_go_when_it_is_round_the_corner() {
    let entity = touchable(&cube(), Friction::coulomb(3.0).unwrap());
    let mut finger = finger(0.005);
    // Onto the top near the edge, then out sideways and down: always within the friction cone of the first place.
    for (from, to, ticks) in [
        (Vector3::new(0.045, 0.08, 0.0), Vector3::new(0.045, 0.045, 0.0), 100),
        (Vector3::new(0.045, 0.045, 0.0), Vector3::new(0.07, 0.045, 0.0), 100),
    ] {
        for i in 0..=ticks {
            let hip = from + (to - from) * (f64::from(i) / f64::from(ticks));
            let out = step(&mut finger, &entity, &hip);
            // On the right side nothing is nearer than the radius any more.
            if hip.y < 0.05 && hip.x > 0.055 + 1e-6 {
                assert_eq!(out.friction, ContactState::Free, "{hip}");
            }
        }
    }
}

#[test]
fn what_is_no_number_or_huge_ends_the_contact_and_nothing_else() {
    let mesh = star();
    let mut noise = Noise(23);
    for friction in [Friction::None, stiction()] {
        for radius_m in [1e-12, 1e-3, 1.0, 1e12] {
            let entity = touchable(&mesh, friction.clone());
            let mut finger = finger(radius_m);
            for _ in 0..300 {
                let strange = [f64::NAN, f64::INFINITY, 1e300, -1e18, 1e-300, 0.0, 0.05, -0.02, 0.03];
                let pick = |noise: &mut Noise| strange[(noise.uniform() * 9.0) as usize];
                let hip = Vector3::from_fn(|_, _| pick(&mut noise));
                let out = step(&mut finger, &entity, &hip);
                assert!(out.force_on_user_W.iter().chain(&out.god_object_W).all(|x| x.is_finite()));
                assert!(out.torque_on_user_W.iter().all(|x| x.is_finite()));
            }
        }
    }
}

#[test]
fn a_ball_meets_another_mesh_anew() {
    let (cube, star) = (cube(), star());
    let mut finger = finger(3e-3);
    let mut roaming = Roaming::new(1, 0.06, 1e-3);
    for i in 0..2000 {
        let mesh = if (i / 50) % 2 == 0 { &cube } else { &star };
        let out = step(&mut finger, &touchable(mesh, stiction()), &roaming.next());
        if out.entity.is_some() {
            assert!(mesh.nearest(&out.god_object_W).distance_m > 3e-3 * (1.0 - 1e-7));
        }
    }
}

#[test]
fn two_parts_that_pass_through_each_other_hold_a_ball_in_the_groove_between_them() {
    let mut soup = make::cuboid([0.1; 3]);
    let other = make::cuboid([0.05, 0.2, 0.05]);
    let shift = soup.vertices.len() as u32;
    soup.vertices.extend(other.vertices);
    soup.faces.extend(other.faces.iter().map(|face| face.map(|corner| corner + shift)));
    let entity = touchable(&built(soup), Friction::None);
    let mut finger = finger(4e-3);
    let mut out = None;
    for i in 0..100 {
        let way = f64::from(i) / 99.0;
        out = Some(step(&mut finger, &entity, &Vector3::new(0.04 - 0.02 * way, 0.07 - 0.03 * way, 0.0)));
    }
    // Between the pillar's side x = 0.025 and the cube's top y = 0.05, which the pillar's faces pass through.
    let expected = Vector3::new(0.029, 0.054, 0.0);
    assert!((out.unwrap().god_object_W - expected).norm() < 1e-11, "{}", out.unwrap().god_object_W);
}
