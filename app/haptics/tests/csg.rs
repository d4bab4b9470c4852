//! Trees of shapes against their boolean expressions, and against closed forms.
#![allow(non_snake_case)]

mod common;
#[path = "common/trees.rs"]
mod trees;

use common::*;
use haptics::{CsgTree, Finger, Friction};
use nalgebra::Vector3;
use trees::{Tree, built, cuboid, touchable, v};

fn step(finger: &mut Finger, entity: &haptics::Entity, hip: &Vector3<f64>) -> haptics::FingerOutput {
    finger.step(std::slice::from_ref(entity), hip, DT)
}

#[test]
fn what_is_inside_a_tree_is_what_its_expression_says() {
    let mut noise = Noise(1);
    for Tree { name, tree, contains, size_m } in trees::all() {
        let csg = built(&tree);
        let mut inside = 0;
        for _ in 0..100_000 {
            let p = Vector3::from_fn(|_, _| noise.between(-1.2, 1.2) * size_m);
            assert_eq!(csg.is_inside(&p), contains(&p), "{name} at {p:?}");
            inside += u32::from(contains(&p));
        }
        assert!(inside > 500, "{name}: {inside}");
    }
}

/// Every finger that comes from outside and ends inside is in contact, and whatever is in contact has its god-object on
/// the boundary.
#[test]
fn a_path_into_a_tree_meets_its_boundary() {
    let mut noise = Noise(2);
    for Tree { name, tree, contains, size_m } in trees::all() {
        let entity = touchable(&tree, Friction::None);
        let csg = built(&tree);
        let (mut met, mut through) = (0, 0);
        for _ in 0..20_000 {
            let mut random = || Vector3::from_fn(|_, _| noise.between(-1.3, 1.3) * size_m);
            let (from, to) = (random(), random());
            if contains(&from) {
                continue;
            }
            let mut finger = point_finger();
            step(&mut finger, &entity, &from);
            let out = step(&mut finger, &entity, &to);
            let first =
                (0..=4000).map(|i| from + (to - from) * (f64::from(i) / 4000.0)).find(|p| contains(p));
            if contains(&to) {
                assert!(out.entity.is_some(), "{name}: {from:?} {to:?}");
            }
            if let (Some(_), Some(contact)) = (first, finger.contact(0)) {
                met += 1;
                through += u32::from(!contains(&to));
                // Positions of 0.1 m round by 1e-17; where patches meet at small angles ten times and more of that.
                assert!(
                    csg.signed_distance(&contact.god_object_W).abs() < 1e-13,
                    "{name}: {contact:?} {from:?} {to:?}"
                );
            }
        }
        assert!(met > 1000, "{name}: {met} {through}");
    }
}

#[test]
fn a_box_of_planes_is_the_box() {
    let form = cuboid([0.1, 0.06, 0.08]);
    for friction in [Friction::None, Friction::coulomb(0.4).unwrap(), stiction()] {
        let (tree, form) = (touchable(&CsgTree::union([form]), friction.clone()), entity(form, friction));
        let (mut by_tree, mut by_form) = (point_finger(), point_finger());
        let mut noise = Noise(3);
        let (mut hip, mut touched) = (v(0.0, 0.05, 0.0), 0);
        let mut goal = hip;
        for i in 0..200_000 {
            if i % 300 == 0 {
                goal = Vector3::from_fn(|axis, _| noise.between(-1.0, 1.0) * [0.065, 0.045, 0.055][axis]);
            }
            hip += (goal - hip) * 0.01 + noise.vector(2e-5);
            let (a, b) = (step(&mut by_tree, &tree, &hip), step(&mut by_form, &form, &hip));
            assert_eq!(a.entity, b.entity, "{i} {hip:?} {a:?} {b:?}");
            // Positions of 0.1 m round by 1e-17, times K.
            let difference = (a.force_on_user_W - b.force_on_user_W).norm();
            assert!(difference < 1e-12, "{i} {hip:?} {difference} {a:?} {b:?}");
            touched += u32::from(a.entity.is_some());
        }
        assert!(touched > 20_000, "{touched}");
    }
}
