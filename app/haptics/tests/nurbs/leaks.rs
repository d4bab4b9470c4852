//! Nobody gets into a surface of patches unnoticed, nor is held where nothing is.

use crate::common::*;
use haptics::mesh::Sides;
use haptics::nurbs::make;
use haptics::{Finger, Friction, Nurbs, NurbsPatch, Surface};
use nalgebra::Vector3;
use std::sync::Arc;

fn scaled(patches: Vec<NurbsPatch>, factors: [f64; 3]) -> Vec<NurbsPatch> {
    let scale = |[x, y, z, w]: [f64; 4]| [x * factors[0], y * factors[1], z * factors[2], w];
    patches
        .into_iter()
        .map(|patch| NurbsPatch { points: patch.points.iter().copied().map(scale).collect(), ..patch })
        .collect()
}

fn built(patches: &[NurbsPatch]) -> Arc<Nurbs> {
    Arc::new(Nurbs::build(patches).unwrap().0)
}

/// Solids of about 0.1 m: with poles, with seams, with creases, hollow.
fn solids() -> Vec<(&'static str, Vec<NurbsPatch>)> {
    vec![
        ("ball", make::sphere(0.05)),
        ("ring", make::torus(0.05, 0.02)),
        ("cylinder", make::cylinder(0.03, 0.08)),
        ("vase", make::vase(0.1)),
        ("mouse", make::mouse(0.1)),
    ]
}

/// A place on the surface: anywhere, on a seam, at a corner or a pole, or within rounding of these.
fn place(nurbs: &Nurbs, noise: &mut Noise) -> (Vector3<f64>, Vector3<f64>) {
    let part = (noise.uniform() * nurbs.parts() as f64) as usize;
    let mut parameter = || match (noise.uniform() * 6.0) as u32 {
        0 => 0.0,
        1 => 1.0,
        2 => 10f64.powf(noise.between(-16.0, -3.0)),
        _ => noise.uniform(),
    };
    let (u, v) = (parameter(), parameter());
    nurbs.at(part, u, v)
}

#[test]
fn no_approach_leaks_at_any_scale() {
    for (name, patches) in solids() {
        for scale in [0.1, 1.0, 10.0] {
            let nurbs = built(&scaled(patches.clone(), [scale; 3]));
            let size = 0.1 * scale;
            let entities = [entity(nurbs.clone(), Friction::None)];
            let mut noise = Noise(7);
            let mut straight_in = 0;
            for trial in 0..2500 {
                let (point, normal) = place(&nurbs, &mut noise);
                // Wherever it comes from, so far that it is outside for certain.
                let from = point + noise.vector(1.0).normalize() * (3.0 * size);
                let deep = point - normal * (size * 10f64.powf(noise.between(-8.0, -2.0)));
                // Below a crease along one side's normal is on the other side.
                if nurbs.surface(0.0).signed_distance(&deep) > -1e-12 * size {
                    assert_eq!(name, "cylinder", "{point:?} {normal:?} {deep:?}");
                    continue;
                }
                let ticks = [1, 1, 2, 7, 50][(noise.uniform() * 5.0) as usize];
                let mut finger = point_finger();
                finger.step(&entities, &from, DT);
                for tick in 1..=ticks {
                    finger.step(&entities, &from.lerp(&deep, f64::from(tick) / f64::from(ticks)), DT);
                }
                assert!(finger.contact(0).is_some(), "{name} x {scale}, {trial}: {from:?} -> {deep:?}");
                // Held where it came in, not where it would have been found.
                straight_in += u32::from(ticks == 1);
            }
            assert!(straight_in > 350, "{straight_in}");
        }
    }
}

#[test]
fn a_creeping_approach_does_not_leak() {
    for (name, patches) in solids() {
        let nurbs = built(&patches);
        let entities = [entity(nurbs.clone(), Friction::None)];
        let mut noise = Noise(8);
        for trial in 0..300 {
            let (point, normal) = place(&nurbs, &mut noise);
            let mut finger = point_finger();
            let step = 10f64.powf(noise.between(-17.0, -6.0));
            // From above, in steps down to below rounding, and a little sideways.
            let aside = normal.cross(&noise.vector(1.0)) * (step * noise.between(0.0, 3.0));
            for tick in -20..40 {
                let hip = point - normal * (f64::from(tick) * step) + aside * f64::from(tick);
                finger.step(&entities, &hip, DT);
            }
            let deep = point - normal * 1e-5;
            finger.step(&entities, &deep, DT);
            let is_inside = nurbs.surface(0.0).signed_distance(&deep) < -1e-9;
            assert!(is_inside || name == "cylinder");
            assert!(!is_inside || finger.contact(0).is_some(), "{name} {trial} {step:e}");
        }
    }
}

#[test]
fn a_plate_of_patches_is_not_pushed_through_however_thin() {
    for thickness in [1e-2, 1e-4, 1e-5, 1e-6, 1e-7] {
        let nurbs = built(&scaled(make::mouse(0.1), [1.0, thickness, 1.0]));
        let entities = [entity(nurbs, Friction::coulomb(0.2).unwrap())];
        let mut noise = Noise(9);
        for _ in 0..2000 {
            let aside = Vector3::new(noise.between(-0.01, 0.01), 0.0, noise.between(-0.01, 0.01));
            let up = if noise.uniform() < 0.5 { 1.0 } else { -1.0 };
            let mut finger = point_finger();
            finger.step(&entities, &(aside + Vector3::y() * (0.05 * up)), DT);
            // Both walls in one tick.
            let out = finger.step(&entities, &(aside - Vector3::y() * (noise.between(1e-3, 0.02) * up)), DT);
            assert!(out.force_on_user_W.y * up > 0.0, "{thickness} {aside:?} {out:?}");
        }
    }
}

#[test]
fn random_walks_never_pop_through_and_never_stick() {
    for (name, patches) in solids() {
        let nurbs = built(&patches);
        let surface = nurbs.surface(0.0);
        for (seed, friction) in [(1, Friction::None), (2, Friction::coulomb(0.4).unwrap()), (3, stiction())] {
            let entities = [entity(nurbs.clone(), friction)];
            let (mut finger, mut noise) = (point_finger(), Noise(seed));
            let (mut hip, mut drift) = (Vector3::new(0.0, 0.2, 0.0), Vector3::zeros());
            let (mut held, mut was_outside) = (0, true);
            for i in 0..8000 {
                if i % 200 == 0 {
                    // Towards some place of the surface or beyond it.
                    let (point, normal) = place(&nurbs, &mut noise);
                    drift = (point - normal * noise.between(-0.01, 0.01) - hip) / 150.0;
                }
                hip += drift + noise.vector(2e-5);
                let out = finger.step(&entities, &hip, DT);
                assert!(out.force_on_user_W.iter().all(|x| x.is_finite()));
                let distance = surface.signed_distance(&hip);
                let is_held = out.entity.is_some();
                // Inside it is always held; outside only where it was pressed through, which takes having been in.
                assert!(distance >= -1e-12 || is_held, "{name} {seed} {i}: {distance:e} inside and free");
                assert!(
                    distance <= 1e-12 || !is_held || !was_outside,
                    "{name} {seed} {i}: grabbed at {distance:e}"
                );
                if let Some(contact) = finger.contact(0) {
                    let off = surface.nearest(&contact.god_object_W).point_B - contact.god_object_W;
                    assert!(off.norm() < 1e-14, "{name} {seed} {i}: off the surface by {:e}", off.norm());
                    assert!(out.force_on_user_W.dot(&contact.normal_W) >= 0.0, "{name} {seed} {i}");
                }
                held += u32::from(is_held);
                was_outside = distance > 1e-12 && !is_held;
            }
            // Pulled away it is free.
            let out = finger.step(&entities, &Vector3::new(0.3, 0.4, 0.5), DT);
            assert!(out.entity.is_none(), "{name}");
            assert!((400..7600).contains(&held), "{name} {seed} {held}");
        }
    }
}

#[test]
fn a_sheet_is_felt_from_both_sides_and_left_over_its_rim() {
    let nurbs = built(&make::sheet(6, 0.1, 0.004));
    assert_eq!(nurbs.sides(), Sides::Sheet);
    let entities = [entity(nurbs.clone(), Friction::coulomb(0.3).unwrap())];
    let mut noise = Noise(11);
    for trial in 0..5000 {
        let (point, normal) = nurbs.at(0, noise.between(0.05, 0.95), noise.between(0.05, 0.95));
        let side = if trial % 2 == 0 { 1.0 } else { -1.0 };
        let mut finger = point_finger();
        finger.step(&entities, &(point + normal * (0.02 * side)), DT);
        let pressed = point - normal * (1e-3 * side);
        let out = finger.step(&entities, &pressed, DT);
        assert!(out.force_on_user_W.dot(&normal) * side > 0.0, "{trial} {out:?}");
        // Back to the side it came from, it is free at once, and not held from behind.
        for height in [1e-15, 1e-9, 1e-3] {
            let out = finger.step(&entities, &(point + normal * (height * side)), DT);
            assert!(height < 1e-12 || out.entity.is_none(), "{trial} {height:e} {out:?}");
        }
        // Pressed again, and drawn over the rim, it is free, however deep.
        finger.step(&entities, &pressed, DT);
        let ticks = 100;
        let outside = pressed + Vector3::new(0.2, 0.0, 0.0);
        for tick in 1..=ticks {
            finger.step(&entities, &pressed.lerp(&outside, f64::from(tick) / f64::from(ticks)), DT);
        }
        assert!(finger.contact(0).is_none(), "{trial}");
    }
}

/// A ball touches one place of a set at a time. Over the rim of a floor it comes with a wall in it, which it then feels as one
/// that it was found in.
#[test]
fn a_ball_that_one_sheet_lets_go_in_another_feels_that_under_the_ramp() {
    let flat = |corners: [[f64; 3]; 4]| NurbsPatch {
        degree: [1, 1],
        knots: [vec![0.0, 0.0, 1.0, 1.0], vec![0.0, 0.0, 1.0, 1.0]],
        points: corners.map(|[x, y, z]| [x, y, z, 1.0]).to_vec(),
    };
    let floor = flat([[-0.1, 0.0, -0.1], [0.0, 0.0, -0.1], [-0.1, 0.0, 0.1], [0.0, 0.0, 0.1]]);
    let wall = flat([[0.004, -0.1, -0.1], [0.004, 0.1, -0.1], [0.004, -0.1, 0.1], [0.004, 0.1, 0.1]]);
    let entities = [entity(built(&[floor, wall]), Friction::None)];
    let ramp_in_s = 0.1;
    let mut finger = Finger::new(0.005, 1).unwrap().with_ramp_in(ramp_in_s).unwrap();
    let (mut on_floor, mut before_n, mut overlap_m) = (0, 0.0, 0.0);
    for tick in 0..300 {
        let down_m = 1e-4 * f64::from(tick.min(15));
        // It stops where it has just left the floor.
        let along_m = 5e-5 * f64::from((tick.min(145) - 15).max(0));
        let hip = Vector3::new(-0.004 + along_m, 0.006 - down_m, 0.0);
        let force = finger.step(&entities, &hip, DT).force_on_user_W;
        on_floor += usize::from(force.y > 0.1);
        overlap_m = hip.x + 0.005 - 0.004;
        // The way of a tick, the ramp over an overlap of no more than the ball, and roundings.
        let most_n = before_n + K * (1e-4 + 0.005 * DT / ramp_in_s) + 1e-9;
        assert!(force.norm() <= most_n, "tick {tick}: {force:?} after {before_n} N");
        before_n = force.norm();
    }
    assert!(on_floor > 50 && overlap_m > 3e-3, "{on_floor} {overlap_m}");
    // Roundings of a force of newtons.
    assert!((before_n - K * overlap_m).abs() < 1e-12, "{before_n} N of {} N", K * overlap_m);
}

#[test]
fn a_pit_is_felt_however_many_patches_meet_in_its_tip() {
    for patches in [8, 512, 4096] {
        let entities = [entity(built(&pit(patches)), Friction::None)];
        let mut noise = Noise(31);
        for trial in 0..200 {
            let aside = 10f64.powf(noise.between(-12.0, -2.5));
            let aside = Vector3::new(noise.between(-1.0, 1.0), 0.0, noise.between(-1.0, 1.0)) * aside;
            let from = Vector3::new(noise.between(-0.01, 0.01), 0.02, noise.between(-0.01, 0.01));
            let mut finger = point_finger();
            finger.step(&entities, &from, DT);
            finger.step(&entities, &(aside - Vector3::y() * 2e-3), DT);
            assert!(finger.contact(0).is_some(), "{patches}, {trial}: {from:?} {aside:?}");
        }
    }
}
