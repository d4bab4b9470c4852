//! Trees of shapes against shapes and trees that must feel the same.

use crate::common::laws::drift_free;
use crate::common::meshes::Roaming;
use crate::common::*;
use crate::trees::{self, ball, cuboid, touchable, v};
use haptics::{
    Capsule, Cone, CsgPart, CsgTree, Cylinder, Ellipsoid, Entity, Finger, FingerOutput, Form, Friction,
    Plane, Scaled, Sphere, Torus,
};
use nalgebra::{Isometry3, Vector3};

fn step(finger: &mut Finger, entity: &Entity, hip: &Vector3<f64>) -> FingerOutput {
    finger.step(std::slice::from_ref(entity), hip, DT)
}

/// Largest difference of forces of two entities under a finger that roams; contact must agree.
fn largest_difference(one: &Entity, other: &Entity, seed: u64, size_m: f64, step_m: f64) -> f64 {
    let (mut a, mut b) = (point_finger(), point_finger());
    let mut roaming = Roaming::new(seed, 1.1 * size_m, step_m);
    let (mut worst, mut touched) = (0.0f64, 0);
    for tick in 0..40_000 {
        let hip = roaming.next();
        let (here, there) = (step(&mut a, one, &hip), step(&mut b, other, &hip));
        assert_eq!(here.entity, there.entity, "tick {tick} {hip:?} {here:?} {there:?}");
        touched += u32::from(here.entity.is_some());
        let difference = (here.force_on_user_W - there.force_on_user_W).norm();
        assert!(difference < 1e-6, "tick {tick} {hip:?} {here:?} {there:?}");
        worst = worst.max(difference);
    }
    assert!(touched > 1000, "{touched}");
    worst
}

/// The seam is no boundary, their common faces are one: no ridge, no slit, no ghost.
#[test]
fn two_boxes_side_by_side_feel_as_one() {
    for (name, friction) in drift_free() {
        let whole = entity(cuboid([0.1, 0.05, 0.08]), friction.clone());
        let halves = touchable(&trees::halves(), friction.clone());
        let worst = largest_difference(&whole, &halves, 5, 0.06, 2e-4);
        // Positions of 0.1 m round by 1e-17, times K; a few of them.
        assert!(worst < 1e-12, "{name}: {worst}");
    }
}

#[test]
fn what_only_touches_takes_nothing_away() {
    let friction = stiction();
    let whole = entity(cuboid([0.1, 0.05, 0.08]), friction.clone());
    let beside = CsgPart::at(cuboid([0.04, 0.05, 0.08]), v(0.07, 0.0, 0.0));
    let touched =
        touchable(&CsgTree::difference([CsgPart::from(cuboid([0.1, 0.05, 0.08])), beside]), friction);
    assert!(largest_difference(&whole, &touched, 6, 0.06, 2e-4) < 1e-12);
}

/// A leaf alone is the form: whatever way its patches went.
#[test]
fn every_leaf_alone_feels_as_its_form() {
    let forms: [(&str, Form, f64); 9] = [
        ("sphere", Sphere::new(0.05).unwrap().into(), 0.05),
        ("cuboid", cuboid([0.1, 0.05, 0.08]).into(), 0.05),
        ("cylinder", Cylinder::new(0.03, 0.08).unwrap().into(), 0.05),
        ("bucket", Cone::new(0.05, 0.02, 0.06).unwrap().into(), 0.05),
        ("capsule", Capsule::new(0.03, 0.04).unwrap().into(), 0.05),
        ("ellipsoid", Ellipsoid::new([0.05, 0.03, 0.04]).unwrap().into(), 0.05),
        ("torus", Torus::new(0.04, 0.015).unwrap().into(), 0.055),
        ("plane", Plane::new(v(0.6, 0.8, 0.0), 0.0).unwrap().into(), 0.05),
        ("column", Scaled::new(Cylinder::new(0.03, 0.08).unwrap().into(), [1.5, 1.0, 1.0]).unwrap(), 0.05),
    ];
    for (name, form, size_m) in forms {
        for friction in [Friction::None, Friction::coulomb(0.3).unwrap()] {
            let (alone, tree) =
                (entity(form, friction.clone()), touchable(&CsgTree::union([form]), friction.clone()));
            // Slides end within 1e-12 of the load. A scaled patch is come back to by another way than the scaled form,
            // and friction holds wherever that leads: to second order of a tick's 0.1 mm, over radii of 30 mm, times K.
            let is_scaled = matches!(form, Form::Ellipsoid(_) | Form::Scaled(_));
            let tolerance = if is_scaled && friction != Friction::None { 2e-4 } else { 1e-12 };
            let mut noise = Noise(3);
            let mut worst = 0.0f64;
            // Presses of a few millimetres with a stroke to the side, all around.
            for press in 0..300 {
                let away = noise.vector(1.0).normalize() * 2.0 * size_m;
                let Some(at) = haptics::Surface::entry(&form, &away, &-away) else { continue };
                let aside = at.normal_B.cross(&noise.vector(1.0)).normalize();
                let (mut a, mut b) = (point_finger(), point_finger());
                for tick in 0..40 {
                    let t = f64::from(tick) / 40.0;
                    let hip = at.point_B + at.normal_B * (1e-3 - 3e-3 * t) + aside * (4e-3 * t);
                    let (here, there) = (step(&mut a, &alone, &hip), step(&mut b, &tree, &hip));
                    assert_eq!(here.entity, there.entity, "{name} {press} {tick} {hip:?} {here:?} {there:?}");
                    worst = worst.max((here.force_on_user_W - there.force_on_user_W).norm());
                    assert!(
                        worst < tolerance,
                        "{name} {friction:?} {press} {tick} {worst} {here:?} {there:?}"
                    );
                }
            }
        }
    }
}

#[test]
fn the_order_of_the_parts_is_not_felt() {
    let reversed = |tree: &CsgTree| {
        let mut parts = tree.parts.clone();
        let keep = usize::from(tree.op == haptics::CsgOp::Difference);
        parts[keep..].reverse();
        CsgTree { op: tree.op, parts }
    };
    for tree in trees::all() {
        for friction in [Friction::None, stiction()] {
            let (one, other) =
                (touchable(&tree.tree, friction.clone()), touchable(&reversed(&tree.tree), friction.clone()));
            let worst = largest_difference(&one, &other, 9, tree.size_m, 3e-4);
            assert!(worst < 1e-9, "{}: {worst}", tree.name);
        }
    }
}

/// `a - b` is what is in `a` and outside of `b`: with half-spaces both can be said.
#[test]
fn a_difference_is_an_intersection_with_what_is_outside() {
    let up = |offset| Plane::new(Vector3::y(), offset).unwrap();
    let down = |offset: f64| Plane::new(-Vector3::y(), -offset).unwrap();
    let taken = CsgTree::difference([CsgPart::from(ball(0.05)), up(-0.01).into()]);
    let joined = CsgTree::intersection([CsgPart::from(ball(0.05)), down(-0.01).into()]);
    let friction = stiction();
    let worst = largest_difference(
        &touchable(&taken, friction.clone()),
        &touchable(&joined, friction),
        3,
        0.05,
        3e-4,
    );
    assert!(worst < 1e-12, "{worst}");
}

#[test]
fn sliding_ratios_are_exact_on_every_kind_of_wall() {
    let mu = 0.25;
    let entity = touchable(&trees::bored_box().tree, Friction::coulomb(mu).unwrap());
    let strokes: [(&str, Vector3<f64>, Vector3<f64>); 3] = [
        ("top", v(0.03, 0.017, 0.03), v(0.04, 0.017, 0.02)),
        ("bore", v(0.023, -0.01, 0.0), v(0.023, 0.01, 0.0)),
        ("around the bore", v(0.023, 0.0, 0.0), v(0.0, 0.0, 0.023)),
    ];
    for (name, from, to) in strokes {
        let mut finger = point_finger();
        step(&mut finger, &entity, &v(0.0, 0.0, 0.0));
        if name == "top" {
            step(&mut finger, &entity, &(from + Vector3::y() * 0.01));
        }
        let mut slipping = 0;
        for i in 0..=500 {
            let t = f64::from(i) / 500.0;
            let hip = if name == "around the bore" {
                let angle = t * std::f64::consts::FRAC_PI_2;
                v(0.023 * angle.cos(), 0.0, 0.023 * angle.sin())
            } else {
                from.lerp(&to, t)
            };
            let out = step(&mut finger, &entity, &hip);
            let contact = finger.contact(0).unwrap();
            let normal_n = out.force_on_user_W.dot(&contact.normal_W);
            let ratio = (out.force_on_user_W - contact.normal_W * normal_n).norm() / normal_n;
            if contact.friction == haptics::FrictionState::Slip && i > 150 {
                slipping += 1;
                assert!((ratio - mu).abs() < 1e-9, "{name} {i} {ratio} {out:?}");
            }
        }
        assert!(slipping > 200, "{name}: {slipping}");
    }
}

/// Without friction the force is that of a spring to the nearest place: a closed way through edges, creases and corners
/// gives back what it took.
#[test]
fn a_closed_loop_without_friction_takes_no_energy() {
    let corner = |x: f64, y: f64| v(x, y, 0.013);
    // Over the inside of a room: floor, crease, wall and back; all the while pressed in.
    let walls =
        [Vector3::x(), Vector3::y(), Vector3::z()].map(|n| CsgPart::from(Plane::new(n, 0.0).unwrap()));
    let balls = trees::two_balls().tree;
    for (name, tree, centre, start) in [
        ("room", CsgTree::union(walls), corner(0.0, 0.0), v(0.03, 0.03, 0.03)),
        ("two balls", balls, v(0.0075, 0.028, 0.0), v(0.0075, 0.06, 0.0)),
    ] {
        let entity = touchable(&tree, Friction::None);
        let loop_at =
            |angle: f64| centre + v(angle.cos() * 4e-3, angle.sin() * 3e-3, (2.0 * angle).sin() * 2e-3);
        let mut results = [0.0; 2];
        for (result, ticks) in results.iter_mut().zip([2000, 8000]) {
            let mut finger = point_finger();
            step(&mut finger, &entity, &start);
            let angle = |i: u32| std::f64::consts::TAU * f64::from(i) / f64::from(ticks);
            let mut last = (loop_at(0.0), step(&mut finger, &entity, &loop_at(0.0)).force_on_user_W);
            let (mut work, mut turnover) = (0.0, 0.0);
            for i in 1..=ticks {
                let hip = loop_at(angle(i));
                let force = step(&mut finger, &entity, &hip).force_on_user_W;
                let done = 0.5 * (force + last.1).dot(&(hip - last.0));
                (work, turnover) = (work + done, turnover + f64::abs(done));
                last = (hip, force);
            }
            assert!(turnover > 1e-4, "{name}: it does press");
            *result = work.abs() / turnover;
        }
        // The trapezoidal rule: kinks of the force at the edges leave an error of the step's square.
        assert!(results[0] < 1e-5 && results[1] < 1e-6, "{name}: {results:?}");
    }
}

/// Friction takes energy and gives none.
#[test]
fn closed_loops_with_friction_take_energy() {
    for tree in trees::all() {
        let entity = touchable(&tree.tree, stiction());
        let mut finger = point_finger();
        let mut roaming = Roaming::new(21, tree.size_m, 2e-4);
        let (mut work, mut last) = (0.0, None::<(Vector3<f64>, Vector3<f64>)>);
        for _ in 0..100_000 {
            let hip = roaming.next();
            let force = step(&mut finger, &entity, &hip).force_on_user_W;
            if let Some((last_hip, last_force)) = last {
                work -= 0.5 * (force + last_force).dot(&(hip - last_hip));
            }
            last = Some((hip, force));
        }
        let held = step(&mut finger, &entity, &v(1.0, 1.0, 1.0)).entity;
        assert_eq!(held, None);
        assert!(work > 0.0, "{}: {work}", tree.name);
    }
}

/// Moved together, finger and entity feel what they feel at rest.
#[test]
fn a_moving_tree_feels_as_one_at_rest() {
    for tree in trees::all() {
        let resting = touchable(&tree.tree, stiction());
        let mut moving = resting.clone();
        let (mut a, mut b) = (point_finger(), point_finger());
        let mut roaming = Roaming::new(8, tree.size_m, 2e-4);
        let mut touched = 0;
        for i in 0..20_000 {
            let t = f64::from(i) * DT;
            let pose = Isometry3::new(v(0.1 * t.sin(), 0.05 * t, 0.02), v(0.3 * t, t.cos(), 0.1));
            moving.move_to(pose);
            let hip_B = roaming.next();
            let here = step(&mut a, &resting, &hip_B);
            let there = step(&mut b, &moving, &(pose * nalgebra::Point3::from(hip_B)).coords);
            assert_eq!(here.entity, there.entity, "{} {i}", tree.name);
            touched += u32::from(here.entity.is_some());
            let difference = here.force_on_user_W - pose.rotation.inverse() * there.force_on_user_W;
            // A turn rounds positions by 1e-16, and where the walk then takes another way by what its rest leaves.
            assert!(difference.norm() < 1e-8, "{} {i} {hip_B:?} {here:?} {there:?}", tree.name);
        }
        assert!(touched > 1000, "{}: {touched}", tree.name);
    }
}

#[test]
fn a_tree_that_sweeps_over_a_resting_finger_takes_it_along() {
    let mut plate = touchable(&trees::thin_plate().tree, Friction::None);
    let mut finger = point_finger();
    let hip = v(-0.01, 0.02, -0.04);
    for i in 0..20 {
        plate.move_to(Isometry3::translation(0.0, 4e-3 * f64::from(i), 0.0));
        let out = step(&mut finger, &plate, &hip);
        let top = 4e-3 * f64::from(i) + 5e-4;
        assert_eq!(out.entity.is_some(), top >= 0.02, "{i} {out:?}");
        if top >= 0.02 {
            assert!((out.force_on_user_W.y - K * (top - 0.02)).abs() < 1e-12, "{i} {out:?}");
        }
    }
}

#[test]
fn a_finger_found_inside_is_pushed_out_by_the_nearest_way_and_slowly() {
    let entity = touchable(&trees::bored_box().tree, Friction::None);
    for (hip, god) in [
        (v(0.035, 0.018, 0.0), v(0.035, 0.02, 0.0)),
        (v(0.022, 0.0, 0.0), v(0.02, 0.0, 0.0)),
        (v(0.047, 0.0, 0.0), v(0.05, 0.0, 0.0)),
        (v(0.0, 0.0, -0.021), v(0.0, 0.0, -0.02)),
    ] {
        let mut finger = Finger::new(0.0, 1).unwrap().with_ramp_in(0.1).unwrap();
        let first = step(&mut finger, &entity, &hip);
        assert!((first.god_object_W - god).norm() < 1e-16, "{hip:?} {first:?}");
        // A tick is a hundredth of the ramp.
        assert!((first.force_on_user_W - (god - hip) * K * 0.01).norm() < 1e-13, "{first:?}");
        for _ in 0..100 {
            step(&mut finger, &entity, &hip);
        }
        let full = step(&mut finger, &entity, &hip);
        assert!((full.force_on_user_W - (god - hip) * K).norm() < 1e-12, "{full:?}");
    }
}

/// An entity that changes its shape is met anew: patches of one tree mean nothing to another.
#[test]
fn another_tree_in_the_same_place_is_met_anew() {
    let mut entity = touchable(&trees::two_balls().tree, stiction());
    let mut finger = point_finger();
    step(&mut finger, &entity, &v(0.0075, 0.06, 0.0));
    assert!(step(&mut finger, &entity, &v(0.0075, 0.02, 0.0)).entity.is_some());
    entity.shape = touchable(&trees::half_ball().tree, stiction()).shape;
    let out = step(&mut finger, &entity, &v(0.0075, 0.02, 0.0));
    assert_eq!(out.entity, None, "above the cut: {out:?}");
    entity.shape = touchable(&trees::die().tree, stiction()).shape;
    let out = step(&mut finger, &entity, &v(0.0075, 0.02, 0.0));
    assert!((out.god_object_W - v(0.0075, 0.025, 0.0)).norm() < 1e-16, "{out:?}");
}

/// Five planes, of which four meet so far away and are 10 mm from the middle: only corners tell how far it reaches.
#[test]
fn a_needle_of_planes_alone_is_felt_to_its_tip_and_known_to_reach_there() {
    for length_m in [0.1, 1.0, 10.0] {
        let side = |angle: f64| {
            let normal = v(0.0101 / length_m, angle.cos(), angle.sin()).normalize();
            (normal, normal.x * length_m)
        };
        let sides = [0.3, 1.87, 3.44, 5.01].map(side);
        let wall =
            |(normal, offset_m)| CsgPart::new(Plane::new(normal, offset_m).unwrap(), Isometry3::identity());
        let walls = sides.into_iter().chain([(-Vector3::x(), 0.0)]);
        let tree = CsgTree::intersection(walls.map(wall));
        let solid = trees::built(&tree);
        assert!(solid.has_end() && (solid.extent_m() / length_m - 1.0).abs() < 1e-9, "{}", solid.extent_m());
        // Without its foot it goes on for ever.
        let open = trees::built(&CsgTree::intersection(sides.map(wall)));
        assert!(!open.has_end());
        let needle = touchable(&tree, Friction::None);
        for share in [0.05, 0.3, 0.6, 0.9, 0.99] {
            let x = share * length_m;
            let mut finger = point_finger();
            for at in 0..=50 {
                let hip = v(x, 0.02 * (1.0 - f64::from(at) / 50.0) + 1e-4, 0.0);
                let is_felt = step(&mut finger, &needle, &hip).entity.is_some();
                let depths = sides.iter().map(|(normal, offset_m)| offset_m - normal.dot(&hip));
                let depth_m = depths.fold(f64::MAX, f64::min);
                assert_eq!(is_felt, depth_m > 0.0, "{length_m} m, at {x} m: {depth_m} m deep");
            }
        }
    }
}

/// Oblique, so that no axis leads into it: it had been taken for as small as its planes are near the middle.
#[test]
fn what_goes_on_for_ever_in_any_direction_has_no_end() {
    let wall = |normal: [f64; 3]| {
        CsgPart::new(Plane::new(Vector3::from(normal).normalize(), 0.01).unwrap(), Isometry3::identity())
    };
    let sides = [[1.0, -1.0, 0.0], [-1.0, 1.0, 0.0], [1.0, 1.0, -2.0], [-1.0, -1.0, 2.0]];
    // A bar along the diagonal of space; with two ends; with one.
    let with = |ends: &[[f64; 3]]| {
        trees::built(&CsgTree::intersection(sides.iter().chain(ends).map(|normal| wall(*normal)))).has_end()
    };
    assert!(!with(&[]) && !with(&[[1.0, 1.0, 1.0]]) && with(&[[1.0, 1.0, 1.0], [-1.0, -1.0, -1.0]]));
    let room = CsgTree::difference([wall([0.0, 1.0, 0.0]), CsgPart::at(cuboid([0.1; 3]), Vector3::zeros())]);
    assert!(!trees::built(&room).has_end());
    let cut = CsgTree::difference([CsgPart::at(cuboid([0.1; 3]), Vector3::zeros()), wall([0.0, 1.0, 0.0])]);
    assert!(trees::built(&cut).has_end());
}
