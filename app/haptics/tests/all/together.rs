//! Features that were made one by one, on one entity.
#![allow(non_snake_case)]

use crate::{common, effects, trees};

use common::pictures::{sized, wave};
use common::*;
use effects::{Felt, limits, resting};
use haptics::mesh::{Mesh, make};
use haptics::{
    Algorithm, Cuboid, Entity, Finger, Friction, Guide, HeightForm, Magnetism, Shape, Sphere, Track,
    Vibration, nurbs,
};
use nalgebra::Vector3;
use std::sync::Arc;

const F0: f64 = 1.0;
const D: f64 = 0.01;
const AMPLITUDE_M: f64 = 5e-4;

fn magnet() -> Magnetism {
    Magnetism::new(F0, D, &limits()).unwrap()
}

/// Waves of 12 mm over a block, which attracts.
fn waves(shape: impl Into<Shape>, form: HeightForm, zero_level: f64) -> Entity {
    let map = sized(&wave(), AMPLITUDE_M, 0.012).with_form(form).with_zero_level(zero_level).unwrap();
    entity(shape, Friction::None).with_height_map(Arc::new(map)).with_magnetism(magnet())
}

#[test]
fn a_magnet_under_a_raised_surface_has_no_step_where_the_finger_comes_down_on_it() {
    let step_m = 1e-6;
    // Spring and magnet add at most, and a slope of 0.26 pushes sideways by so much of either.
    let most_n = (K + 27.0 / 4.0 * F0 / D) * step_m * 1.3;
    for radius_m in [0.0, 0.003] {
        for zero_level in [0.0, 0.4, 1.0] {
            for x in [0.0, 0.002, 0.003, 0.007, 0.009, 0.011] {
                let block = waves(Cuboid::new([0.06; 3]).unwrap(), HeightForm::Gradient, zero_level);
                let mut felt = Felt::new(vec![], vec![], vec![block]);
                felt.finger = Finger::new(radius_m, 1).unwrap();
                let (mut last, mut pulled_n, mut pushed_n) = (None, 0.0_f64, 0.0_f64);
                for i in 0..14_000 {
                    let y = 0.03 + radius_m + D + 1e-3 - step_m * f64::from(i);
                    let force = felt.total(resting(Vector3::new(x, y, 0.001)));
                    let jump = last.map_or(0.0, |last: Vector3<f64>| (force - last).norm());
                    assert!(jump <= most_n, "{radius_m}, {zero_level}, {x}, at {y}: {jump}");
                    last = Some(force);
                    (pulled_n, pushed_n) = (pulled_n.min(force.y), pushed_n.max(force.y));
                }
                assert!((pulled_n + F0).abs() < 1e-3, "the magnet was there: {pulled_n}");
                assert!(pushed_n > 0.5, "the block was there: {pushed_n}");
            }
        }
    }
}

#[test]
fn what_guides_and_magnets_say_they_hold_is_what_they_give_back() {
    let ground = || Track::plane(Vector3::zeros(), Vector3::y()).unwrap();
    let guide = || Guide::new(ground(), 500.0, 0.0, &limits()).unwrap();
    let magnetic = entity(Cuboid::new([0.06; 3]).unwrap(), Friction::None).with_magnetism(magnet());
    let cases = [
        // A spring, one that reaches its limit of 2 N after 4 mm, one that begins after 2 mm, a magnet.
        (vec![guide()], vec![], 0.0, 0.009),
        (vec![guide().with_force_limit(2.0).unwrap()], vec![], 0.0, 0.009),
        (vec![guide().with_deadband(0.002).unwrap()], vec![], 0.0, 0.009),
        (vec![], vec![magnetic], 0.03, 0.0399),
    ];
    for (guides, entities, down_m, up_m) in cases {
        let mut felt = Felt::new(vec![], guides, entities);
        // Until a guide has taken hold.
        for _ in 0..100 {
            felt.total(resting(Vector3::new(0.0, up_m, 0.0)));
        }
        let ticks = 1000;
        let mut given_j = 0.0;
        let (held_j, mut last) = (felt.state.stored_j(), felt.total(resting(Vector3::new(0.0, up_m, 0.0))));
        for i in 1..=ticks {
            let way_m = (up_m - down_m) / f64::from(ticks);
            let now = felt.total(resting(Vector3::new(0.0, up_m - way_m * f64::from(i), 0.0)));
            given_j -= 0.5 * (last + now).y * way_m;
            last = now;
        }
        // By trapezia: a thousandth of the way squared, of a curve that bends once, and at kinks as much of a step.
        assert!((given_j - held_j).abs() < 1e-5 * held_j, "{given_j} J given, {held_j} J held");
        assert!(held_j > 1e-3 && felt.state.stored_j().abs() < 1e-9, "{held_j} {}", felt.state.stored_j());
        felt.state.reset();
        assert_eq!(felt.state.stored_j(), 0.0);
    }
}

#[test]
fn a_shape_that_is_exchanged_under_a_finger_leaves_nothing_of_the_old_one() {
    let mesh = Arc::new(Mesh::build(make::uv_sphere(60, 31, 0.03)).unwrap().0);
    let tree = haptics::CsgTree::union([haptics::CsgPart::new(
        Sphere::new(0.03).unwrap(),
        nalgebra::Isometry3::identity(),
    )]);
    let patches = Arc::new(haptics::Nurbs::build(&nurbs::make::sphere(0.03)).unwrap().0);
    let shapes: [Shape; 4] =
        [Sphere::new(0.03).unwrap().into(), mesh.into(), trees::built(&tree).into(), patches.into()];
    let mut noise = Noise(5);
    for algorithm in [Algorithm::FrictionCone, Algorithm::VectorField] {
        let mut finger = Finger::new(0.0, 1).unwrap().with_ramp_in(0.0).unwrap();
        for i in 0..4000 {
            let of = &shapes[(noise.uniform() * 4.0) as usize % 4];
            let ball = entity(of.clone(), stiction()).with_algorithm(algorithm.clone());
            for _ in 0..3 {
                let t = f64::from(i) * DT;
                let hip =
                    Vector3::new((3.0 * t).sin(), (5.0 * t).cos(), (2.0 * t).sin() * 0.5).normalize() * 0.028;
                let force = finger.step(std::slice::from_ref(&ball), &hip, DT).force_on_user_W;
                // 2 mm deep, a chord's 0.1 mm aside; held where another shape let go, at most a tick's way and friction
                // beside it. It points outwards, but for friction's cone of 0.7 and facets.
                assert!(force.norm() < 2.0 * K * 2e-3, "{algorithm:?} {i}: {force}");
                assert!(force.dot(&hip) >= 0.0, "{algorithm:?} {i}: {force}");
            }
        }
    }
}

#[test]
fn what_hums_on_a_raised_surface_never_pulls_and_comes_on_with_the_load() {
    let hum = Vibration::new(150.0, 0.3, 1.0, &limits()).unwrap();
    let block = waves(Cuboid::new([0.06; 3]).unwrap(), HeightForm::Gradient, 0.0).with_vibration(hum);
    let mut felt = Felt::new(vec![], vec![], vec![block]);
    for i in 0..5000 {
        let t = f64::from(i) * DT;
        // In and out of the waves, not so high that the magnet has it.
        let hip = Vector3::new(0.02 * t.sin(), 0.0301 + 4e-4 * (9.0 * t).sin(), 0.0);
        let (contact, beside) = felt.both(resting(hip));
        let out = felt.finger.contact(0).map(|contact| contact.normal_W);
        match out {
            Some(normal_W) => {
                assert!((contact + beside).dot(&normal_W) >= -1e-12, "{i}");
                assert!(beside.norm() <= 0.3 * contact.dot(&normal_W) + 1e-12, "{i}");
            }
            // Above a dent the magnet rests too, and below the highest place there is none; its texel is half a one off the
            // crest, 1.2e-3 of the wave.
            None => {
                assert!(hip.y > 0.03 + 0.998 * AMPLITUDE_M || beside == Vector3::zeros(), "{i}: {beside}");
            }
        }
    }
}
