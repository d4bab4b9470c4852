//! Effects under every input: finite, bounded, without allocation, and nothing where there is nothing.
#![allow(non_snake_case)]

use crate::{common, counting, effects};

use std::sync::{Arc, OnceLock};

use common::*;
use counting::CALLS;
use effects::{Felt, limits};
use haptics::mesh::{Mesh, make};
use haptics::{Cuboid, Entity, Field, Guide, Hip, MOST_FORCE_N, Magnetism, Region, Sphere, Track, Vibration};
use nalgebra::{Isometry3, Vector3};
use proptest::prelude::*;

/// One of everything.
fn all() -> Felt {
    let limits = limits();
    let ball =
        Region::within(Sphere::new(0.05).unwrap(), Isometry3::translation(0.02, 0.0, 0.0), 0.005).unwrap();
    let fields = vec![
        Field::viscous([3.0, 0.0, 1.0], ball, &limits).unwrap(),
        Field::inertial(0.2, 10.0, ball, &limits).unwrap(),
        Field::constant([0.0, -1.0, 0.0], Region::everywhere()).unwrap(),
    ];
    let path = Track::path(&[Vector3::zeros(), Vector3::x() * 0.05, Vector3::y() * 0.05]).unwrap();
    let guide = |track| Guide::new(track, 500.0, 2.0, &limits).unwrap();
    let guides = vec![
        guide(path).with_deadband(0.001).unwrap().with_break_away(2.0).unwrap(),
        guide(Track::line(Vector3::zeros(), Vector3::x()).unwrap()),
    ];
    let magnet = Magnetism::new(1.0, 0.01, &limits).unwrap();
    let hum = Vibration::new(100.0, 0.3, 1.0, &limits).unwrap();
    // Built once for all cases.
    static MESH: OnceLock<Arc<Mesh>> = OnceLock::new();
    let mesh =
        MESH.get_or_init(|| Arc::new(Mesh::build(make::bumpy_sphere(60, 31, 0.02)).unwrap().0)).clone();
    let dressed = |entity: Entity| entity.with_magnetism(magnet).with_vibration(hum);
    let cube = Cuboid::new([0.02; 3]).unwrap();
    Felt::new(fields, guides, vec![dressed(entity(cube, stiction())), dressed(entity(mesh, stiction()))])
}

/// Three fields and two guides of at most 10 N, two magnets of 1 N and two vibrations of 0.3 N.
const MOST_N: f64 = 5.0 * MOST_FORCE_N + 2.6;

#[test]
fn effects_never_allocate() {
    let mut felt = all();
    let mut noise = Noise(10);
    let (mut captured, mut hummed) = (0, 0);
    let before = CALLS.get();
    for i in 0..50_000 {
        let t = f64::from(i) * DT;
        let hip = Vector3::new(0.03 * (2.0 * t).sin(), 0.03 * (3.0 * t).cos(), 0.002 * t.sin())
            + noise.vector(1e-5);
        let (contact, beside) = felt.both(&hip);
        captured += u32::from(felt.state.is_captured(0));
        hummed += u32::from(contact != Vector3::zeros() && beside != Vector3::zeros());
        if i % 10_000 == 0 {
            felt.state.reset();
        }
    }
    assert_eq!(CALLS.get() - before, 0);
    assert!((1000..49_000).contains(&captured) && hummed > 1000, "{captured} {hummed}");
    drop(vec![0u8; 16]);
    assert!(CALLS.get() > before, "the counter counts");
}

fn any_size() -> impl Strategy<Value = f64> {
    prop_oneof![
        4 => -0.1..0.1f64,
        1 => prop::num::f64::ANY,
        1 => prop::sample::select(vec![f64::MAX, f64::MIN, f64::MIN_POSITIVE, 5e-324, -0.0, 1e154, 1e-160, f64::NAN]),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(500))]

    #[test]
    fn whatever_comes_in_a_bounded_force_comes_out(
        hips in prop::collection::vec(prop::array::uniform3(any_size()), 1..20),
        v in prop::array::uniform3(any_size()), dt in any_size(), shift in prop::array::uniform3(any_size()),
        is_told: bool,
    ) {
        let mut felt = all();
        felt.dt_s = dt;
        for hip in hips {
            let velocity_W = is_told.then(|| Vector3::from(v));
            let force = felt.beside(Hip { position_W: hip.into(), velocity_W });
            prop_assert!(force.norm() <= MOST_N, "{force} at {hip:?}");
            for entity in &mut felt.entities {
                entity.move_to(Isometry3::translation(shift[0], shift[1], shift[2]));
            }
        }
        // And it recovers; a contact that began at a jump would live on.
        felt.finger.reset();
        felt.dt_s = DT;
        let sane = Vector3::new(0.06, 0.2, 0.0);
        for entity in &mut felt.entities {
            entity.X_WB = Isometry3::identity();
        }
        for _ in 0..2000 {
            felt.beside(&sane);
        }
        // The constant field, the line's guide at its limit; all else is out of reach.
        let force = felt.beside(&sane);
        prop_assert!((force - Vector3::new(0.0, -6.0, 0.0)).norm() < 1e-9 || felt.state.is_captured(0), "{force}");
    }
}

#[test]
fn a_hip_that_is_not_finite_resets_the_effects() {
    let mut felt = all();
    for _ in 0..100 {
        felt.beside(&Vector3::zeros());
    }
    assert!(felt.state.is_captured(0) && felt.state.is_captured(1));
    assert_eq!(felt.beside(&Vector3::new(f64::NAN, 0.0, 0.0)), Vector3::zeros());
    assert!(!felt.state.is_captured(0) && !felt.state.is_captured(1));
}

#[test]
fn without_effects_there_is_no_force_and_what_is_made_for_others_is_harmless() {
    let mut felt = Felt::new(vec![], vec![], vec![table(stiction())]);
    assert!(felt.effects.is_empty());
    assert_eq!(felt.beside(&Vector3::new(0.0, -0.004, 0.0)), Vector3::zeros());
    // A state without room for these effects, and entities that are gone.
    felt.effects = all().effects;
    felt.entities.clear();
    assert_eq!(felt.beside(&Vector3::zeros()), Vector3::zeros());
}
