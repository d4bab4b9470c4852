//! Balls on solids joined of closed forms: loads, friction and torque, energy, smooth turns, long walks, fast hands, bad numbers.

use std::f64::consts::TAU;
use std::slice::from_ref;

use crate::common::meshes::{Roaming, step};
use crate::common::*;
use crate::trees::{self, touchable, v};
use haptics::{
    ContactState, Csg, CsgPart, CsgTree, Cuboid, Cylinder, Entity, Feature, Finger, Friction, Plane,
};
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

const R: f64 = 0.01;

fn half_space(normal: Vector3<f64>) -> CsgPart {
    Plane::new(normal.normalize(), 0.0).unwrap().into()
}

/// Two walls that rise to both sides of z, 60 degrees between them.
fn groove() -> CsgTree {
    let (s, c) = (0.5, 0.75_f64.sqrt());
    CsgTree::union([half_space(v(c, s, 0.0)), half_space(v(-c, s, 0.0))])
}

/// A slot of this width along z in a block whose top is y = 0.
fn slot(width_m: f64) -> CsgTree {
    CsgTree::difference([
        CsgPart::at(Cuboid::new([0.1, 0.05, 0.1]).unwrap(), v(0.0, -0.025, 0.0)),
        CsgPart::at(Cuboid::new([width_m, 0.02, 0.2]).unwrap(), v(0.0, 0.0, 0.0)),
    ])
}

/// From above to a place, and there for a while.
fn lowered(entity: &Entity, radius_m: f64, hip: Vector3<f64>) -> (Finger, haptics::FingerOutput) {
    let mut finger = finger(radius_m);
    let mut out = None;
    for i in 0..150 {
        let above = 0.05 * (1.0 - f64::from(i.min(100)) / 100.0);
        out = Some(step(&mut finger, entity, &(hip + Vector3::y() * above)));
    }
    (finger, out.unwrap())
}

#[test]
fn in_a_groove_the_loads_follow_from_the_triangle_of_forces() {
    let entity = touchable(&groove(), Friction::None);
    let hip = v(0.001, 0.012, 0.004);
    let (finger, out) = lowered(&entity, R, hip);
    // The centre of a ball between walls that make 30 degrees with the vertical: r / sin 30 above the edge.
    let centre = v(0.0, 2.0 * R, hip.z);
    assert!((out.god_object_W - centre).norm() < 1e-14, "{}", out.god_object_W);
    let (sum, difference) = ((2.0 * R - hip.y) / 0.5, hip.x / 0.75_f64.sqrt());
    let points = finger.touch_points(from_ref(&entity), 0);
    assert_eq!(points.as_slice().len(), 2);
    for point in points.as_slice() {
        let load = 0.5 * (sum - point.normal_W.x.signum() * difference);
        assert!((point.force_on_user_W - point.normal_W * (K * load)).norm() < 1e-11);
        assert!((point.point_W - (centre - point.normal_W * R)).norm() < 1e-14);
    }
    assert!((out.force_on_user_W - (centre - hip) * K).norm() < 1e-11);
}

#[test]
fn in_a_corner_three_walls_push_each_by_its_own_depth() {
    let walls = [Vector3::x(), Vector3::y(), Vector3::z()].map(half_space);
    let entity = touchable(&CsgTree::union(walls), Friction::None);
    let hip = v(0.004, 0.006, 0.007);
    let mut finger = finger(R);
    let mut out = None;
    for i in 0..=100 {
        out = Some(step(&mut finger, &entity, &(hip + Vector3::repeat(0.03) * (1.0 - f64::from(i) / 100.0))));
    }
    assert!((out.unwrap().god_object_W - Vector3::repeat(R)).norm() < 1e-14);
    let points = finger.touch_points(from_ref(&entity), 0);
    assert_eq!(points.as_slice().len(), 3);
    for point in points.as_slice() {
        let axis = point.normal_W.iamax();
        assert!((point.force_on_user_W - Vector3::ith(axis, (R - hip[axis]) * K)).norm() < 1e-11);
    }
}

#[test]
fn a_ball_that_does_not_fit_into_a_slot_rests_on_both_of_its_edges() {
    let width_m = 0.012;
    let entity = touchable(&slot(width_m), Friction::None);
    let height = (R * R - 0.25 * width_m * width_m).sqrt();
    let (finger, out) = lowered(&entity, R, v(1e-3, height - 4e-3, 0.01));
    assert!((out.god_object_W - v(0.0, height, 0.01)).norm() < 1e-12, "{}", out.god_object_W);
    assert_eq!(out.feature, Feature::Edge);
    assert_eq!(finger.touch_points(from_ref(&entity), 0).as_slice().len(), 2);
    // One that fits lies on the ground of it.
    let (_, out) = lowered(&entity, 0.005, v(0.0, -6e-3, 0.0));
    assert!((out.god_object_W - v(0.0, -5e-3, 0.0)).norm() < 1e-12, "{}", out.god_object_W);
}

#[test]
fn round_the_rim_of_a_half_ball_the_force_turns_as_the_hip_does() {
    let entity = touchable(&trees::half_ball().tree, Friction::None);
    let (rim, deep) = (v(0.05, 0.0, 0.0), 0.004);
    let mut finger = finger(R);
    let at = |degrees: f64| v(degrees.to_radians().sin(), degrees.to_radians().cos(), 0.0);
    step(&mut finger, &entity, &(rim + at(0.0) * 0.03));
    let mut last: Option<Vector3<f64>> = None;
    // From the flat top, round the rim, and to where the ball begins: there the arc ends.
    for i in 0..=360 {
        let out_of_edge = at(0.25 * f64::from(i));
        let out = step(&mut finger, &entity, &(rim + out_of_edge * (R - deep)));
        assert!((out.force_on_user_W - out_of_edge * (K * deep)).norm() < 1e-9, "{i}");
        let direction = out.force_on_user_W.normalize();
        assert!(last.is_none_or(|last| direction.angle(&last) < 0.2501_f64.to_radians()), "{i}");
        last = Some(direction);
    }
    // All along the flank of the ball, and back over the rim with the HIP deep inside.
    for i in 0..2000 {
        let t = f64::from(i) * 5e-3;
        let hip = v(0.0, -0.012, 0.0) + v(t.cos(), 0.2 * (0.3 * t).sin(), t.sin()) * 0.055;
        let out = step(&mut finger, &entity, &hip);
        // Nothing of the half ball is nearer: its own nearest point, by its equation.
        let c = out.god_object_W;
        let flat = c.x.hypot(c.z).min(0.05);
        let nearest =
            if c.y <= 0.0 { c.normalize() * 0.05 } else { v(c.x, 0.0, c.z) * (flat / c.x.hypot(c.z)) };
        assert!((c - nearest).norm() > R * (1.0 - 2e-9), "{i} {c}");
    }
}

#[test]
fn friction_in_a_groove_is_that_of_both_loads_and_turns_the_ball() {
    let mu = 0.3;
    let entity = touchable(&groove(), Friction::coulomb(mu).unwrap());
    let (mut finger, _) = lowered(&entity, R, v(0.0, 0.016, 0.0));
    let mut out = None;
    for i in 0..200 {
        out = Some(step(&mut finger, &entity, &v(0.0, 0.016, 1e-4 * f64::from(i))));
    }
    let out = out.unwrap();
    // 4 mm deep, walls at 30 degrees: loads of 4 mm each, whose friction adds.
    assert_eq!(out.friction, ContactState::Slip);
    assert!((out.force_on_user_W.z + mu * K * 8e-3).abs() < 1e-9, "{}", out.force_on_user_W);
    // Both points lie r / 2 below the centre.
    assert!(
        (out.torque_on_user_W - v(0.5 * R * mu * K * 8e-3, 0.0, 0.0)).norm() < 1e-11,
        "{}",
        out.torque_on_user_W
    );
}

#[test]
fn a_ball_at_rest_neither_drifts_nor_chatters() {
    for (tree, hip) in [
        (trees::bored_box().tree, v(0.017, 0.01, 0.003)),
        (trees::bored_box().tree, v(0.022, 0.022, 0.0)),
        (groove(), v(5e-4, 6e-3, 0.0)),
        (slot(8e-3), v(5e-4, 1e-3, 0.01)),
        (trees::lens().tree, v(0.0405, 1e-3, 0.0)),
    ] {
        let entity = touchable(&tree, stiction());
        let mut finger = finger(5e-3);
        let from =
            hip + if hip.x < 0.02 && hip.y < 0.011 { v(-0.015, 0.03, 0.0) } else { v(0.01, 0.04, 0.0) };
        let way = [from, v(hip.x - if hip.x < 0.02 { 4e-3 } else { 0.0 }, hip.y.max(0.012), hip.z), hip];
        for i in 0..600 {
            let t = (f64::from(i) / 150.0).min(1.999);
            let at = t as usize;
            step(&mut finger, &entity, &(way[at] + (way[at + 1] - way[at]) * (t - at as f64)));
        }
        let mut noise = Noise(4);
        // A quarter of a millimetre back, well into the friction circle: there it sticks again. A tenth of a micrometre of
        // tremor is far inside of it.
        let hip = hip + (way[0] - way[2]).normalize() * 2.5e-4;
        let mut tremble = |finger: &mut Finger| step(finger, &entity, &(hip + noise.vector(1e-7)));
        for _ in 0..200 {
            tremble(&mut finger);
        }
        let first = tremble(&mut finger);
        assert!(first.entity.is_some(), "{hip}");
        for _ in 0..20_000 {
            let out = tremble(&mut finger);
            assert_eq!(out.friction, ContactState::Stick, "{hip}");
            assert_eq!(out.god_object_W, first.god_object_W, "{hip}");
        }
    }
}

/// What a finger gains on a closed way, from the second turn on, and what a force that is held for a tick explains.
fn gained(entity: &Entity, radius_m: f64, at: impl Fn(f64) -> Vector3<f64>, ticks: u32) -> (f64, f64) {
    let mut finger = finger(radius_m);
    let (mut work, mut bound) = (0.0, 0.0);
    for i in 0..2 * ticks {
        let turn = |i: u32| at(f64::from(i) / f64::from(ticks) * TAU);
        let out = step(&mut finger, entity, &turn(i));
        let way = turn(i + 1) - turn(i);
        if i >= ticks {
            work += out.force_on_user_W.dot(&way);
            bound += 0.5 * K * way.norm_squared();
        }
    }
    (work, bound)
}

#[test]
fn a_closed_way_without_friction_gains_nothing_but_what_holding_a_force_for_a_tick_makes() {
    let round = |x: f64, y: f64, a: f64, b: f64| {
        move |t: f64| v(x + a * t.cos(), y + b * (2.0 * t).sin(), 0.7 * a * t.sin())
    };
    for (name, tree, radius_m, way) in [
        ("over the bore's rim", trees::bored_box().tree, 5e-3, round(0.022, 0.0235, 4e-3, 1e-3)),
        ("on a rim all around", trees::bored_box().tree, 0.025, round(0.0, 0.033, 4e-3, 1e-3)),
        ("groove", groove(), R, round(0.0, 0.013, 6e-3, 2e-3)),
        ("edge of a lens", trees::lens().tree, 4e-3, round(0.042, 0.0, 2e-3, 2e-3)),
        ("between balls", trees::two_balls().tree, 6e-3, round(0.0, 0.045, 0.01, 2e-3)),
    ] {
        let (work, bound) = gained(&touchable(&tree, Friction::None), radius_m, way, 20_000);
        assert!(work < 1.05 * bound, "{name}: gained {work:e} J, of {bound:e} J that a tick explains");
    }
    let (work, bound) = gained(
        &touchable(&groove(), Friction::coulomb(0.3).unwrap()),
        R,
        round(0.0, 0.013, 6e-3, 2e-3),
        5000,
    );
    assert!(work < -10.0 * bound, "friction costs energy: {work:e} {bound:e}");
}

/// Whether the solid has material within a radius, by its own equations: as a bound that only tells for sure where it is
/// exact, at points of a dense shell.
fn is_buried(csg: &Csg, centre: &Vector3<f64>, radius_m: f64, directions: &[Vector3<f64>]) -> bool {
    csg.is_inside(centre)
        || directions.iter().any(|d| csg.is_inside(&(centre + d * (radius_m * (1.0 - 1e-6)))))
}

#[test]
fn long_walks_never_leak() {
    let mut noise = Noise(77);
    let directions: Vec<_> = (0..150).map(|_| noise.vector(1.0).normalize()).collect();
    for (i, tree) in trees::all().into_iter().enumerate() {
        let csg = trees::built(&tree.tree);
        for friction in [Friction::None, stiction()] {
            let radius_m = [1e-3, 2.5e-3, 6e-3][i % 3];
            let entity = touchable(&tree.tree, friction);
            let mut finger = finger(radius_m);
            let mut roaming = Roaming::new(5, tree.size_m + radius_m, 3e-4);
            let mut touched = 0_u32;
            for tick in 0..100_000 {
                let hip = roaming.next();
                let out = step(&mut finger, &entity, &hip);
                assert!(out.force_on_user_W.iter().all(|x| x.is_finite()), "{} {tick}", tree.name);
                let Some(_) = out.entity else {
                    assert!(
                        tick % 16 != 0 || !is_buried(&csg, &hip, radius_m, &directions),
                        "{} {tick} {hip}",
                        tree.name
                    );
                    continue;
                };
                touched += 1;
                // A ball that were nearer to what it touches than its radius would be pushed too far.
                let apart = (out.god_object_W - hip).norm();
                assert!(out.force_on_user_W.norm() <= K * apart * (1.0 + 1e-6), "{} {tick}", tree.name);
                for point in finger.touch_points(from_ref(&entity), 0).as_slice() {
                    let distance = (point.point_W - out.god_object_W).norm();
                    assert!((distance / radius_m - 1.0).abs() < 1e-6, "{} {tick} {distance}", tree.name);
                }
                assert!(
                    tick % 16 != 0 || !is_buried(&csg, &out.god_object_W, radius_m, &directions),
                    "{} {tick} {}",
                    tree.name,
                    out.god_object_W
                );
            }
            assert!(touched > 10_000, "{} {touched}", tree.name);
        }
    }
}

#[test]
fn however_fast_a_ball_does_not_pass_a_thin_plate() {
    let plate = CsgTree::intersection([CsgPart::from(Cuboid::new([0.1, 1e-3, 0.1]).unwrap())]);
    let mut noise = Noise(5);
    for radius_m in [5e-4, 2e-3, 0.01] {
        let entity = touchable(&plate, Friction::None);
        for _ in 0..300 {
            let mut finger = finger(radius_m);
            let above = v(noise.between(-0.03, 0.03), noise.between(0.02, 0.1), noise.between(-0.03, 0.03));
            step(&mut finger, &entity, &above);
            let below = v(noise.between(-0.03, 0.03), -above.y, noise.between(-0.03, 0.03));
            for _ in 0..20 {
                let out = step(&mut finger, &entity, &below);
                assert_eq!(out.entity, Some(0));
                assert!((out.god_object_W.y - 5e-4 - radius_m).abs() < 1e-9, "{}", out.god_object_W);
            }
        }
    }
}

#[test]
fn the_smaller_the_ball_the_more_it_is_a_point() {
    // Slowly over plate, rim and wall of the bore, 1 mm deep.
    let way = |i: u32| {
        let t = f64::from(i) * 1e-4;
        v(0.03 + 0.0108 * (-t).cos(), 0.0205 - 1.5e-3 * (0.7 * t).sin().powi(2), 4e-3 * (1.3 * t).sin())
    };
    let felt = |radius_m: f64| {
        let entity = touchable(&trees::bored_box().tree, Friction::None);
        let mut finger = finger(radius_m);
        for i in 0..100 {
            step(&mut finger, &entity, &(way(0) + v(0.0, 0.02 * (1.0 - f64::from(i) / 100.0), 0.0)));
        }
        (0..30_000).map(|i| step(&mut finger, &entity, &way(i)).force_on_user_W).collect::<Vec<_>>()
    };
    let point = felt(0.0);
    let mut last = f64::INFINITY;
    for radius_m in [1e-3, 1e-4, 1e-5] {
        let ball = felt(radius_m);
        let apart = point.iter().zip(&ball).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
        // A ball's surface is lower than the point's by the radius, and round what is sharp by a few.
        assert!(apart < 3.0 * K * radius_m + 1e-9 && apart < last, "{radius_m}: {apart}");
        last = apart;
    }
}

#[test]
fn a_moving_box_in_a_tree_meets_a_resting_ball_as_a_box_does() {
    for friction in [Friction::None, Friction::coulomb(0.5).unwrap()] {
        let mut tree =
            touchable(&CsgTree::union([CsgPart::from(Cuboid::new([0.1; 3]).unwrap())]), friction.clone());
        let mut form = entity(Cuboid::new([0.1; 3]).unwrap(), friction);
        let mut fingers = [finger(0.01), finger(0.01)];
        let mut touched = 0;
        for i in 0..2000 {
            let t = f64::from(i) * DT;
            let turned = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 0.05 * (3.0 * t).sin());
            let place = Translation3::new(0.01 * t, -0.061 + 5e-3 * (8.0 * t).sin(), 0.0);
            let pose = Isometry3::from_parts(place, turned);
            tree.move_to(pose);
            form.move_to(pose);
            let [a, b] = [
                step(&mut fingers[0], &tree, &Vector3::zeros()),
                step(&mut fingers[1], &form, &Vector3::zeros()),
            ];
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
    let entity = touchable(&CsgTree::union([CsgPart::from(Cuboid::new([0.1; 3]).unwrap())]), Friction::None);
    for (hip, way) in [
        (v(0.0, 0.045, 0.01), Vector3::y()),
        (v(-0.057, 0.0, 0.01), -Vector3::x()),
        (v(0.01, 0.02, -0.048), -Vector3::z()),
    ] {
        let mut finger = Finger::new(0.01, 1).unwrap();
        let depth = 0.06 - hip.dot(&way);
        for i in 1..=150 {
            let out = step(&mut finger, &entity, &hip);
            let expected = way * (K * depth * (f64::from(i) / 100.0).min(1.0));
            assert!(
                (out.force_on_user_W - expected).norm() < 1e-10,
                "{i}: {} {expected}",
                out.force_on_user_W
            );
        }
    }
}

#[test]
fn a_ball_held_by_friction_is_let_go_when_it_is_round_the_corner() {
    let cube = CsgTree::union([CsgPart::from(Cuboid::new([0.1; 3]).unwrap())]);
    let entity = touchable(&cube, Friction::coulomb(3.0).unwrap());
    let mut finger = finger(0.005);
    for (from, to) in
        [(v(0.045, 0.08, 0.0), v(0.045, 0.045, 0.0)), (v(0.045, 0.045, 0.0), v(0.07, 0.045, 0.0))]
    {
        for i in 0..=100 {
            let hip = from + (to - from) * (f64::from(i) / 100.0);
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
    let mut noise = Noise(23);
    for tree in [trees::everything().tree, trees::die().tree] {
        for friction in [Friction::None, stiction()] {
            for radius_m in [1e-12, 1e-3, 1.0, 1e12] {
                let entity = touchable(&tree, friction.clone());
                let mut finger = finger(radius_m);
                for _ in 0..200 {
                    let strange = [f64::NAN, f64::INFINITY, 1e300, -1e18, 1e-300, 0.0, 0.05, -0.02, 0.03];
                    let hip = Vector3::from_fn(|_, _| strange[(noise.uniform() * 9.0) as usize]);
                    let out = step(&mut finger, &entity, &hip);
                    assert!(out.force_on_user_W.iter().chain(&out.god_object_W).all(|x| x.is_finite()));
                    assert!(out.torque_on_user_W.iter().all(|x| x.is_finite()));
                }
            }
        }
    }
}

#[test]
fn cones_are_rolled_over_and_a_countersink_holds_a_ball_all_around() {
    // Over the tip: round it a sphere.
    let cone = CsgTree::union([CsgPart::from(haptics::Cone::new(0.02, 0.0, 0.03).unwrap())]);
    let entity = touchable(&cone, Friction::None);
    let (_, out) = lowered(&entity, R, v(1e-3, 0.021, -5e-4));
    let tip = v(0.0, 0.015, 0.0);
    let expected = tip + (v(1e-3, 0.021, -5e-4) - tip).normalize() * R;
    assert!((out.god_object_W - expected).norm() < 1e-10, "{}", out.god_object_W);
    // A hole that narrows by 45 degrees: the centre lies r sqrt 2 above the apex of its walls.
    let sink = CsgTree::difference([
        CsgPart::from(Cuboid::new([0.1, 0.04, 0.1]).unwrap()),
        CsgPart::at(haptics::Cone::new(0.0, 0.03, 0.03).unwrap(), v(0.0, 0.01, 0.0)),
        Cylinder::new(2e-3, 0.1).unwrap().into(),
    ]);
    let entity = touchable(&sink, Friction::None);
    let height = -5e-3 + R * 2f64.sqrt();
    for aside in [v(0.0, 0.0, 0.0), v(1e-3, 0.0, 3e-4)] {
        let (_, out) = lowered(&entity, R, v(0.0, height - 5e-3, 0.0) + aside);
        assert!((out.god_object_W - v(0.0, height, 0.0)).norm() < 1e-8, "{}", out.god_object_W);
    }
}
