//! Surfaces that attract and surfaces that hum.

use std::f64::consts::TAU;
use std::sync::Arc;

use crate::common::*;
use crate::effects::{Felt, limits, resting};
use haptics::mesh::{Mesh, make};
use haptics::{Cuboid, Entity, Finger, Friction, Magnetism, Shape, Torus, Vibration};
use nalgebra::{Isometry3, Vector3};

const F0: f64 = 1.0;
const D: f64 = 0.01;
const SIZE: [f64; 3] = [0.04, 0.03, 0.05];

fn magnet() -> Magnetism {
    Magnetism::new(F0, D, &limits()).unwrap()
}

fn magnetic(shape: impl Into<Shape>) -> Entity {
    entity(shape, Friction::None).with_magnetism(magnet())
}

fn alone(entity: Entity) -> Felt {
    Felt::new(vec![], vec![], vec![entity])
}

#[test]
fn a_magnet_pulls_as_its_closed_form_says() {
    let magnet = magnet();
    let cases =
        [(0.0, 0.0), (D / 3.0, F0), (0.5 * D, 27.0 / 32.0 * F0), (D, 0.0), (2.0 * D, 0.0), (-1e-3, 0.0)];
    for (d, expected) in cases {
        // A few products of numbers near 1.
        assert!((magnet.pull_n(d) - expected).abs() < 1e-15, "{d}");
        let mut felt = alone(magnetic(Cuboid::new(SIZE).unwrap()));
        let force = felt.beside(resting(Vector3::new(0.002, 0.015 + d, -0.001)));
        // d is the difference of numbers of 0.02, rounded to 3e-18, times the slope 27/4 F0 / D.
        assert!((force + Vector3::y() * expected).norm() < 1e-13, "{d}: {force}");
    }
    // Off an edge and off a corner it pulls towards them.
    for way in [Vector3::new(3.0, 4.0, 0.0) / 5.0, Vector3::new(1.0, 2.0, 2.0) / 3.0] {
        let corner = Vector3::new(0.02, 0.015, if way.z == 0.0 { 0.0 } else { 0.025 });
        let mut felt = alone(magnetic(Cuboid::new(SIZE).unwrap()));
        let force = felt.beside(resting(corner + way * (D / 3.0)));
        assert!((force + way * F0).norm() < 1e-12, "{way}: {force}");
    }
}

#[test]
fn the_pull_is_the_slope_of_the_potential_and_coming_takes_what_leaving_costs() {
    let magnet = magnet();
    let h = 1e-6;
    for i in 1..1100 {
        let d = 1e-5 * f64::from(i);
        let slope = (magnet.potential_j(d + h) - magnet.potential_j(d - h)) / (2.0 * h);
        // The third derivative of the potential is some 27 F0 / D^2, times h^2 / 6; where the reach ends the
        // second derivative has a corner, which h^0 does not see either since the force is 0 there.
        assert!((slope - magnet.pull_n(d)).abs() < 30.0 * F0 / (D * D) * h * h, "{d}");
    }
    assert!((magnet.potential_j(0.0) + 27.0 / 48.0 * F0 * D).abs() < 1e-17);
    assert_eq!(magnet.potential_j(D), 0.0);
}

/// From the air through the surface: the magnet ends where the contact begins, both with 0.
#[test]
fn from_out_of_reach_to_inside_the_force_has_no_step() {
    let mut felt = alone(magnetic(Cuboid::new(SIZE).unwrap()));
    let step_m = 1e-6;
    // The contact's spring, or the magnet at the surface, whichever is steeper.
    let steepest = K.max(6.75 * F0 / D);
    let (mut last, mut both) = (Vector3::zeros(), [false; 2]);
    for i in 0..13_000 {
        let d = 0.011 - step_m * f64::from(i);
        let force = felt.total(resting(Vector3::new(0.0, 0.015 + d, 0.0)));
        assert!((force - last).norm() <= 1.001 * steepest * step_m, "{d}: {last} {force}");
        both[usize::from(d < 0.0)] |= force.norm() > 0.5;
        last = force;
    }
    assert_eq!(both, [true, true], "pulled and pushed");
}

/// Midpoint sums of the force along closed ways outside: what is left is the rule's error, of second order.
#[test]
fn a_round_trip_in_a_magnets_reach_gives_nothing() {
    let mesh = Arc::new(Mesh::build(make::cuboid(SIZE)).unwrap().0);
    let shapes: [(&str, Shape); 3] = [
        ("box", Cuboid::new(SIZE).unwrap().into()),
        ("mesh", mesh.into()),
        ("torus", Torus::new(0.027, 0.007).unwrap().into()),
    ];
    for (name, shape) in shapes {
        let mut felt = alone(magnetic(shape));
        let mut noise = Noise(17);
        for _ in 0..5 {
            // A wavy ring around the shape, half a reach off it in places, and across its edges.
            let waves: Vec<f64> = (0..6).map(|_| 0.002 * noise.gaussian()).collect();
            let at = |turn: f64| {
                let wave = |i: usize| waves[i] * (TAU * turn * (i + 1) as f64).sin();
                let (sine, cosine) = (TAU * turn).sin_cos();
                Vector3::new(
                    0.041 * cosine + wave(0) + wave(3),
                    0.006 * (2.0 * TAU * turn).sin() + wave(1),
                    0.041 * sine + wave(2) + wave(4) + wave(5),
                )
            };
            let mut round = |steps: u32| {
                let (mut gained, mut moved) = (0.0, 0.0);
                for i in 0..steps {
                    let turn = |part: f64| (f64::from(i) + part) / f64::from(steps);
                    let (from, to) = (at(turn(0.0)), at(turn(1.0)));
                    let (contact, force) = felt.both(resting(at(turn(0.5))));
                    assert_eq!(contact, Vector3::zeros(), "{name}: outside all the way");
                    gained += force.dot(&(to - from));
                    moved += force.dot(&(to - from)).abs();
                }
                (gained, moved)
            };
            let ((coarse, moved), (fine, _)) = (round(2000), round(8000));
            assert!(moved > 1e-3 * F0 * D, "{name}: it does pull on the way: {moved} J");
            // Steps of 0.13 mm in forces that bend over some 3 mm: 1e-4 of what is moved at most, and a sixteenth
            // with a quarter of the step; the corners of the force at edges and at the reach's end leave less.
            assert!(coarse.abs() < 1e-3 * moved, "{name}: {coarse} of {moved} J");
            assert!(fine.abs() < 0.3 * coarse.abs() + 1e-6 * moved, "{name}: {coarse} {fine} J");
        }
    }
}

#[test]
fn a_mesh_attracts_as_the_form_that_it_is_made_of() {
    let mesh = Arc::new(Mesh::build(make::cuboid(SIZE)).unwrap().0);
    let (mut form, mut faces) = (alone(magnetic(Cuboid::new(SIZE).unwrap())), alone(magnetic(mesh)));
    let (mut noise, mut felt) = (Noise(4), 0);
    for _ in 0..5000 {
        let at = noise.vector(0.025);
        let (a, b) = (form.beside(resting(at)), faces.beside(resting(at)));
        // The nearest point of a triangle is rounded a dozen times, to 1e-17 m, times 27/4 F0 / D.
        assert!((a - b).norm() < 1e-12, "{at}: {a} {b}");
        felt += u32::from(a.norm() > 0.0);
    }
    assert!(felt > 1000, "{felt}");
}

#[test]
fn a_finger_with_a_radius_is_attracted_by_its_own_surface_and_a_moved_entity_from_where_it_is() {
    let X_WB = Isometry3::new(Vector3::new(0.1, 0.2, 0.3), Vector3::new(0.3, 0.2, -0.5));
    let radius = 0.004;
    let mut magnetic = magnetic(Cuboid::new(SIZE).unwrap());
    magnetic.move_to(X_WB);
    let mut felt = alone(magnetic);
    felt.finger = Finger::new(radius, 1).unwrap();
    for (d, expected) in [(D / 3.0, F0), (D, 0.0)] {
        let at_B = Vector3::new(0.0, 0.015 + radius + d, 0.0);
        let force = felt.beside(resting(X_WB.transform_point(&at_B.into()).coords));
        // Poses of up to 0.4 m are rounded to 6e-17 m, times 27/4 F0 / D.
        assert!((force + X_WB.rotation * Vector3::y() * expected).norm() < 1e-12, "{d}: {force}");
    }
}

const HZ: f64 = 137.0;
const AMPLITUDE: f64 = 0.3;
const FULL: f64 = 1.0;

fn humming(friction: Friction) -> Felt {
    alone(table(friction).with_vibration(Vibration::new(HZ, AMPLITUDE, FULL, &limits()).unwrap()))
}

/// Amplitude of each whole frequency up to half the rate, of a second at 1 kHz.
fn spectrum(signal: &[f64]) -> Vec<f64> {
    let n = signal.len();
    let bin = |k: usize| {
        let angle = |i: usize| TAU * ((k * i) % n) as f64 / n as f64;
        let sum = |part: fn(f64) -> f64| -> f64 {
            signal.iter().enumerate().map(|(i, x)| x * part(angle(i))).sum()
        };
        2.0 / n as f64 * sum(f64::cos).hypot(sum(f64::sin))
    };
    (0..n / 2).map(bin).collect()
}

#[test]
fn a_vibration_has_one_line_at_its_frequency_as_strong_as_the_load_allows() {
    for (load, expected) in [(0.25, 0.25 * AMPLITUDE), (1.0, AMPLITUDE), (4.0, AMPLITUDE)] {
        let mut felt = humming(Friction::None);
        let force: Vec<f64> = (0..1000).map(|_| felt.beside(resting(Vector3::y() * (-load / K))).y).collect();
        for (hz, strength) in spectrum(&force).into_iter().enumerate() {
            let line = if hz == HZ as usize { expected } else { 0.0 };
            // A second holds whole periods, so that nothing leaks; sums of a thousand roundings.
            assert!((strength - line).abs() < 1e-12, "{load} N, {hz} Hz: {strength}");
        }
    }
}

#[test]
fn a_vibration_goes_by_the_time_of_the_tick_whichever_ticks_were_missed() {
    let (mut every, mut some) = (humming(Friction::None), humming(Friction::None));
    let at = Vector3::y() * -0.004;
    let wave: Vec<f64> = (0..3000).map(|_| every.beside(resting(at)).y).collect();
    let mut noise = Noise(6);
    for tick in (0..3000).filter(|_| noise.uniform() < 0.5) {
        some.tick = tick as u64;
        assert_eq!(some.beside(resting(at)).y, wave[tick], "tick {tick}");
    }
    // A day later it is still the same sine: 8.64e7 s-thousandths times 137 Hz are rounded to 2e-9 periods.
    some.tick = 86_400_000;
    assert!((some.beside(resting(at)).y - wave[0]).abs() < AMPLITUDE * 2e-8);
}

#[test]
fn contact_and_vibration_together_never_pull_and_leave_free_space_alone() {
    let mut felt = humming(stiction());
    let mut noise = Noise(12);
    let (mut hip, mut pressed) = (Vector3::zeros(), 0);
    for _ in 0..20_000 {
        hip = hip * 0.99 + noise.vector(5e-4);
        let (contact, beside) = felt.both(&hip);
        if contact == Vector3::zeros() {
            assert_eq!(beside, Vector3::zeros());
        } else {
            assert!((contact + beside).y >= 0.0, "{contact} {beside}");
            assert_eq!((beside.x, beside.z), (0.0, 0.0), "along the normal alone");
            pressed += 1;
        }
    }
    assert!(pressed > 2000, "{pressed}");
}
