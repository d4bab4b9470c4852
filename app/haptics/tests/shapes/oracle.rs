//! Every closed form against a slow and obvious description of the same solid.

use crate::common::*;
use crate::solids;
use haptics::{Friction, Surface};
use nalgebra::Vector3;

/// A point within 1.5 sizes of the middle.
fn anywhere(noise: &mut Noise, size: f64) -> Vector3<f64> {
    Vector3::from_fn(|_, _| noise.between(-1.5, 1.5)) * size
}

#[test]
fn inside_and_outside_are_those_of_the_equation() {
    for solid in solids::all() {
        let mut noise = Noise(11);
        let mut inside = 0;
        for _ in 0..200_000 {
            let p = anywhere(&mut noise, solid.size_m);
            let distance = solid.form.signed_distance(&p);
            // Nearer than rounding no equation can tell.
            if distance.abs() > 1e-15 {
                assert_eq!(distance < 0.0, (solid.contains)(&p), "{} at {p:?}: {distance}", solid.name);
            }
            inside += u32::from(distance < 0.0);
        }
        assert!(inside > 2000, "{}: {inside}", solid.name);
    }
}

#[test]
fn a_path_enters_where_samples_of_it_first_meet_the_material() {
    for solid in solids::all() {
        let mut noise = Noise(12);
        let (mut entered, mut through) = (0, 0);
        for i in 0..500 {
            let from = anywhere(&mut noise, solid.size_m);
            // A third of them as short as ticks.
            let to = if i % 3 == 0 {
                from + noise.vector(0.1 * solid.size_m)
            } else {
                anywhere(&mut noise, solid.size_m)
            };
            if (solid.contains)(&from) {
                assert!(solid.form.entry(&from, &to).is_none(), "{}: it was inside", solid.name);
                continue;
            }
            let expected = solid.first_crossing(&from, &to);
            let entry = solid.form.entry(&from, &to);
            let Some(fraction) = expected else {
                // Between two samples a path may graze the material to a depth of (1e-4 of its length)^2 over the
                // diameter of curvature, which is at least a centimetre.
                if let Some(at) = entry {
                    let depth = ((to - from).norm() * 1e-4).powi(2) / 1e-2;
                    let skimmed = (0..=10_000)
                        .map(|i| solid.form.signed_distance(&(from + (to - from) * (f64::from(i) * 1e-4))))
                        .fold(f64::INFINITY, f64::min);
                    assert!(skimmed <= depth.max(1e-7), "{}: {at:?} without a crossing", solid.name);
                }
                continue;
            };
            entered += 1;
            through += u32::from(!(solid.contains)(&to));
            let at = entry.unwrap_or_else(|| panic!("{}: missed {from:?} -> {to:?}", solid.name));
            let crossing = from + (to - from) * fraction;
            // A path that meets the surface at a slope s reaches it 1/s times as inexactly; grazing ones (below 1e-3)
            // as the root of the rounding.
            let slope = -(to - from).normalize().dot(&at.normal_B);
            let tolerance = if slope > 1e-3 { 4e-16 * solid.size_m.max(1.0) / slope } else { 1e-7 };
            let off = (at.point_B - crossing).norm();
            assert!(off <= tolerance, "{}: off by {off}, slope {slope}", solid.name);
        }
        assert!(entered > 40 && through > 12, "{}: {entered} {through}", solid.name);
    }
}

#[test]
fn the_nearest_point_is_no_farther_than_the_best_of_a_grid() {
    for solid in solids::all() {
        let (mut noise, grid) = (Noise(13), solid.grid());
        let mut compared = 0;
        while compared < 30 {
            let p = anywhere(&mut noise, solid.size_m);
            if !(solid.contains)(&p) {
                continue;
            }
            compared += 1;
            let at = solid.form.nearest(&p);
            let (found, expected) = ((at.point_B - p).norm(), solid.distance(&grid, &p));
            // The grid's best is above the true minimum; on edges the search stops 1e-9 sizes before it.
            assert!(
                found <= expected + 1e-9 * solid.size_m,
                "{}: {found} vs {expected} at {p:?}",
                solid.name
            );
            assert!(solid.form.signed_distance(&at.point_B).abs() < 1e-15, "{}", solid.name);
        }
    }
}

#[test]
fn normals_are_those_of_the_surface_and_point_out_of_the_material() {
    for solid in solids::all() {
        let mut noise = Noise(14);
        for _ in 0..2000 {
            let at = solid.form.nearest(&solid.point(noise.uniform(), noise.uniform()));
            assert!((at.normal_B.norm() - 1.0).abs() < 1e-15, "{}", solid.name);
            let h = 1e-6 * solid.size_m;
            // At a step of 1e-6 sizes the tangent plane leaves the surface by 1e-12 sizes over radii of 1e-2 sizes.
            assert!(!(solid.contains)(&(at.point_B + at.normal_B * h)), "{} {at:?}", solid.name);
            assert!((solid.contains)(&(at.point_B - at.normal_B * h)), "{} {at:?}", solid.name);
            let tangent = at.normal_B.cross(&noise.vector(1.0)).normalize();
            for side in [-1.0, 1.0] {
                let beside = at.point_B + tangent * (side * h);
                let off = solid.form.signed_distance(&beside);
                // Beside an edge the tangent plane of one piece runs out of the material: above is always right.
                assert!(off > -1e-9 * solid.size_m, "{}: {off}", solid.name);
            }
            // The offset of the tangent plane, known without the point: three products of numbers below 0.1.
            let offset = solid.form.tangent_offset(&at);
            assert!((offset - at.normal_B.dot(&at.point_B)).abs() < 5e-17, "{}", solid.name);
        }
    }
}

#[test]
fn without_friction_no_surface_point_near_the_god_object_is_nearer_to_the_finger() {
    for solid in solids::all() {
        let entity = entity(solid.form, Friction::None);
        let mut noise = Noise(15);
        let (mut finger, mut compared) = (point_finger(), 0);
        while compared < 300 {
            let surface = solid.point(noise.uniform(), noise.uniform());
            let mut hip = surface * 1.05;
            finger.step(std::slice::from_ref(&entity), &hip, DT);
            for _ in 0..20 {
                hip += (surface * 0.97 - hip) * 0.2 + noise.vector(5e-4);
                let out = finger.step(std::slice::from_ref(&entity), &hip, DT);
                let Some(contact) = finger.contact(0) else { continue };
                if !(solid.contains)(&hip) || noise.uniform() > 0.1 {
                    continue;
                }
                compared += 1;
                let found = (out.god_object_W - hip).norm();
                let nearest = solid.distance_near(&hip, &out.god_object_W);
                // Both are minima: distances agree to second order in what the two searches leave (1e-9 of a turn).
                assert!(
                    found <= nearest + 1e-11,
                    "{}: {found} vs {nearest}, {contact:?} {hip:?}",
                    solid.name
                );
            }
        }
    }
}
