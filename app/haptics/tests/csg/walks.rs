//! Fingers that roam about trees of shapes: never through, never stuck, always at the nearest place.

use crate::common::meshes::Roaming;
use crate::common::*;
use crate::trees::{self, Tree, built, touchable};
use haptics::{Feature, Finger, Friction};
use nalgebra::Vector3;

fn step(finger: &mut Finger, entity: &haptics::Entity, hip: &Vector3<f64>) -> haptics::FingerOutput {
    finger.step(std::slice::from_ref(entity), hip, DT)
}

/// The god-object is on the boundary; the HIP, when free, outside; the force within the friction cone and finite.
fn roam(ticks: u32) {
    for (seed, friction) in [(1, Friction::None), (2, Friction::coulomb(0.3).unwrap()), (3, stiction())] {
        for Tree { name, tree, contains, size_m } in trees::all() {
            let (csg, entity) = (built(&tree), touchable(&tree, friction.clone()));
            let mut finger = point_finger();
            for step_m in [2e-4, 3e-3] {
                let mut roaming = Roaming::new(seed, 1.2 * size_m, step_m);
                let (mut touched, mut inside) = (0, 0);
                for tick in 0..ticks {
                    let hip = roaming.next();
                    let out = step(&mut finger, &entity, &hip);
                    assert!(out.force_on_user_W.iter().all(|x| x.is_finite()));
                    let where_ = || format!("{name} {friction:?} {step_m} tick {tick} {hip:?} {out:?}");
                    match finger.contact(0) {
                        Some(contact) => {
                            touched += 1;
                            let height = csg.signed_distance(&contact.god_object_W);
                            assert!(height.abs() < 1e-12, "{height} {}", where_());
                        }
                        None => assert!(!contains(&hip), "{}", where_()),
                    }
                    inside += u32::from(contains(&hip));
                }
                assert!(touched > ticks / 20 && touched >= inside, "{name} {touched} {inside}");
            }
        }
    }
}

#[test]
fn fingers_roam_without_popping_through() {
    roam(25_000);
}

/// `cargo test --release -p haptics --test csg walks:: -- --ignored`
#[test]
#[ignore = "a minute"]
fn fingers_roam_for_forty_million_ticks_without_popping_through() {
    roam(1_000_000);
}

/// No place nearby that is free is nearer to the HIP than the frictionless god-object.
#[test]
fn without_friction_the_god_object_is_the_nearest_free_place_around() {
    let mut noise = Noise(7);
    for Tree { name, tree, contains, size_m } in trees::all() {
        let entity = touchable(&tree, Friction::None);
        let mut finger = point_finger();
        let mut roaming = Roaming::new(11, 1.2 * size_m, 2e-4);
        let (mut looked, mut worst) = (0, 0.0f64);
        for tick in 0..50_000 {
            let hip = roaming.next();
            let out = step(&mut finger, &entity, &hip);
            let Some(contact) = finger.contact(0) else { continue };
            let god = contact.god_object_W;
            let here = (god - hip).norm();
            looked += 1;
            for radius in [1e-7] {
                for _ in 0..8 {
                    let p = god + noise.vector(1.0).normalize() * radius;
                    if !contains(&p) {
                        // To second order the distance falls by as much on a patch bent with this radius.
                        let gained = here - (p - hip).norm();
                        worst = worst.max(gained / radius);
                        assert!(
                            gained < 0.02 * radius,
                            "{name} tick {tick}: {gained} of {radius} {hip:?} {out:?} {contact:?}"
                        );
                    }
                }
            }
        }
        eprintln!("{name}: {looked} {worst}");
        assert!(looked > 1000, "{name}: {looked}");
    }
}

/// Approaches aimed at edges and corners: points where the answer of the expression changes in several directions.
#[test]
fn nothing_leaks_at_edges_and_corners() {
    let mut noise = Noise(13);
    for Tree { name, tree, contains, size_m } in trees::all() {
        let entity = touchable(&tree, Friction::None);
        let csg = built(&tree);
        // Edges are found by pushing a finger about: wherever a god-object rests on one.
        let mut places = Vec::new();
        let mut finger = point_finger();
        let mut roaming = Roaming::new(17, size_m, 3e-4);
        for _ in 0..100_000 {
            let out = step(&mut finger, &entity, &roaming.next());
            if matches!(out.feature, Feature::Edge | Feature::Vertex) {
                places.push(out.god_object_W);
            }
            // Of convex edges the god-object only passes by: where it changes the patch.
            if let Some(contact) = finger.contact(0) {
                let god = contact.god_object_W;
                let around = (0..4).map(|_| god + noise.vector(1e-4)).filter(contains).count();
                if around <= 1 {
                    places.push(god);
                }
            }
        }
        assert!(places.len() > 100, "{name}: {}", places.len());
        let (mut approaches, mut met) = (0, 0);
        while approaches < 40_000 {
            let aim = places[(noise.uniform() * places.len() as f64) as usize];
            let [beside_m, length_m] =
                [(-17.0, -4.0), (-4.5, -2.0)].map(|(a, b)| 10f64.powf(noise.between(a, b)));
            let offset = noise.vector(beside_m);
            let way = noise.vector(1.0).normalize() * length_m;
            let from = aim + offset + way;
            if contains(&from) {
                approaches += 1;
                continue;
            }
            approaches += 1;
            let mut finger = point_finger();
            step(&mut finger, &entity, &from);
            for share in [0.5, 0.9, 1.0, 1.1, 1.5, 2.0] {
                let hip = from - way * share;
                let out = step(&mut finger, &entity, &hip);
                let where_ = || format!("{name} {approaches} {aim:?} {offset:?} {way:?} {share} {out:?}");
                match finger.contact(0) {
                    Some(contact) => {
                        met += 1;
                        let height = csg.signed_distance(&contact.god_object_W);
                        assert!(height.abs() < 1e-12, "{height} {}", where_());
                    }
                    // A HIP that rounding could put on either side may be free.
                    None => assert!(!contains(&hip) || csg.signed_distance(&hip) > -1e-12, "{}", where_()),
                }
            }
        }
        assert!(met > 10_000, "{name}: {met}");
    }
}
