//! Trees of shapes against their boolean expressions, and against closed forms.

use std::sync::Arc;

use crate::common::*;
use crate::trees::{self, Tree, built, cuboid, touchable, v};
use haptics::mesh::{Mesh, make};
use haptics::{Csg, CsgPart, CsgTree, Finger, Friction, Plane, Shape, Surface};
use nalgebra::Vector3;

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
        for _ in 0..24_000 {
            let mut random = || Vector3::from_fn(|_, _| noise.between(-1.3, 1.3) * size_m);
            let (from, to) = (random(), random());
            if contains(&from) {
                continue;
            }
            let mut finger = point_finger();
            step(&mut finger, &entity, &from);
            let out = step(&mut finger, &entity, &to);
            if contains(&to) {
                assert!(out.entity.is_some(), "{name}: {from:?} {to:?}");
            }
            // Samples are looked at where somebody says that there is a surface.
            let mut way = (0..=4000).map(|i| from + (to - from) * (f64::from(i) / 4000.0));
            if let Some(contact) = finger.contact(0)
                && way.any(|p| contains(&p))
            {
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

/// More flanks than a neighbourhood lists meet in the tip.
#[test]
fn nothing_leaks_at_a_tip_of_many_flanks() {
    let flanks = |count: u32| {
        (0..count).map(move |i| {
            let angle = std::f64::consts::TAU * f64::from(i) / f64::from(count);
            CsgPart::from(Plane::new(v(angle.cos(), 1.0, angle.sin()), 0.02).unwrap())
        })
    };
    let mut noise = Noise(4);
    for count in [3, 4, 5, 8, 12, 24] {
        let tree = CsgTree::intersection(flanks(count).chain([cuboid([0.1; 3]).into()]));
        let csg = built(&tree);
        for friction in [Friction::None, stiction()] {
            let entity = touchable(&tree, friction);
            let mut met = 0;
            for _ in 0..2000 {
                let aim = v(0.0, 0.02, 0.0) + noise.vector(1e-5);
                let from = aim + noise.vector(1e-2);
                let mut finger = point_finger();
                for share in [0.0, 0.8, 1.0, 1.2, 1.5, 2.0] {
                    let hip = from.lerp(&aim, share);
                    step(&mut finger, &entity, &hip);
                    match finger.contact(0) {
                        Some(contact) => {
                            met += 1;
                            let height = csg.signed_distance(&contact.god_object_W);
                            // With twelve flanks and more, the tip is as blunt as the smallest neighbourhood.
                            let tolerance = if count > 8 { 1e-8 } else { 1e-12 };
                            assert!(height.abs() < tolerance, "{count} {height} {contact:?}");
                        }
                        None => assert!(csg.signed_distance(&hip) > -1e-12, "{count} {from:?} {hip:?}"),
                    }
                }
            }
            assert!(met > 1000, "{met}");
        }
    }
}

#[test]
fn what_is_no_solid_is_refused_with_what_is_allowed() {
    let ball = || CsgPart::from(trees::ball(0.05));
    let says = |tree: CsgTree, text: &str| {
        let message = Csg::build(&tree).unwrap_err().to_string();
        assert!(message.contains(text), "{message}");
    };
    says(CsgTree::union(Vec::<CsgPart>::new()), "no parts; allowed is at least one");
    says(CsgTree::union((0..257).map(|_| ball())), "more than 256 leaves");
    let nested = (0..16).fold(ball(), |inner, _| CsgTree::union([inner]).into());
    says(CsgTree::union([nested]), "more than 16 trees lie within each other");
    says(CsgTree::union([ball().scaled([1.0, 0.0, 1.0])]), "scale is 0");
    says(CsgTree::union([CsgPart::at(trees::ball(0.05), v(f64::NAN, 0.0, 0.0))]), "not finite");
    let grown = Surface::grown(&cuboid([0.1; 3]), 0.01).unwrap();
    says(CsgTree::union([grown]), "grown by a ball's radius");
    let deepest = (0..15).fold(ball(), |inner, _| CsgTree::union([inner]).into());
    assert!(Csg::build(&CsgTree::union([deepest])).is_ok());
}

#[test]
fn fingers_with_a_radius_feel_trees() {
    let entity = touchable(&trees::bored_box().tree, Friction::None);
    assert!(entity.shape.is_felt_by(0.0) && entity.shape.is_felt_by(1e-3));
    let mut finger = finger(1e-3);
    let out = step(&mut finger, &entity, &v(0.04, 0.0, 0.0));
    assert!((out.god_object_W - v(0.051, 0.0, 0.0)).norm() < 1e-12, "{}", out.god_object_W);
}

/// As a mesh, as patches, as a plane: whatever it is for a while, the contact of before would pull back across the solid.
#[test]
fn an_entity_that_is_something_else_for_a_while_is_met_anew_as_a_tree() {
    let friction = || Friction::stiction(0.7, 0.3).unwrap();
    let tree = touchable(&CsgTree::union([cuboid([0.1; 3])]), friction());
    let mesh = Arc::new(Mesh::build(make::cuboid([0.1; 3])).unwrap().0);
    let nurbs = Arc::new(haptics::Nurbs::build(&haptics::nurbs::make::sphere(0.05)).unwrap().0);
    let shapes = [Shape::from(mesh), Shape::from(nurbs), Shape::from(Plane::new(Vector3::y(), 0.0).unwrap())];
    let whiles = shapes.map(|shape| entity(shape, friction()));
    for first in whiles.iter().chain([&tree]) {
        for other in whiles.iter().chain([&tree]).filter(|other| !std::ptr::eq(*other, first)) {
            let mut finger = point_finger();
            step(&mut finger, first, &v(0.0, 0.06, 0.0));
            step(&mut finger, first, &v(0.0, -0.001, 0.0));
            step(&mut finger, other, &v(0.0, -0.002, 0.0));
            step(&mut finger, other, &v(0.049, -0.003, 0.0));
            let met_anew = step(&mut finger, first, &v(0.049, -0.001, 0.0));
            let mut new = point_finger();
            step(&mut new, other, &v(0.049, -0.003, 0.0));
            let fresh = step(&mut new, first, &v(0.049, -0.001, 0.0));
            // The same steps by the same code, but for the ramp, which starts with a contact and not with a shape.
            let off_m = (met_anew.god_object_W - fresh.god_object_W).norm();
            assert!(off_m < 1e-12, "{first:?} {other:?} {met_anew:?} {fresh:?}");
        }
    }
}
