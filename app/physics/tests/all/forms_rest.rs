//! Closed forms on a floor: they come to rest where statics says, and stay.
//!
//! More drops, and a minute: `cargo test --release -p physics --test all forms_rest:: -- --ignored` (half a minute).
#![allow(non_snake_case)]

use crate::{common, solids};

use common::*;
use haptics::{Form, Plane};
use nalgebra::{Isometry3, Vector3};
use physics::Settings;
use physics::collide::PairMemory;
use solids::*;

const MASS: f64 = 0.1;
const MU: f64 = 0.5;
const STIFFNESS: f64 = 1000.0;
/// In series with the floor's.
const SERIES: f64 = 1000.0 * 2000.0 / 3000.0;

/// A form whose lowest point is this high above the floor.
fn above_floor(form: Form, turn: nalgebra::UnitQuaternion<f64>, height: f64) -> World {
    let ground: Form = Plane::new(Vector3::y(), 0.0).unwrap().into();
    let X = pose(turn, Vector3::zeros());
    let low = deepest(&points(&form, &X, &ground, &Isometry3::identity(), 1.0, &mut PairMemory::default()));
    let thing = object(form, pose(turn, Vector3::y() * (height - low)), STIFFNESS, MU);
    let body = body(&thing, MASS);
    World::new(vec![floor(0.0, 2000.0, MU), thing], &[(1, body)], Settings::default(), 0)
}

/// How high the middle of a form at rest is, by statics: how many points carry it is known for each way to lie.
fn height_at_rest(name: &str, form: &Form, world: &World) -> f64 {
    let sink = |points: f64| MASS * G / (points * SERIES);
    let axis = world.entities[1].X_WB.rotation.inverse() * Vector3::y();
    let stands = axis.y.abs() > 0.9;
    match form {
        Form::Sphere(s) => s.radius_m() - sink(1.0),
        Form::Cuboid(c) => 0.5 * Vector3::from(c.size_m()).dot(&axis.abs()) - sink(4.0),
        Form::Capsule(c) => c.radius_m() - sink(2.0),
        Form::Torus(t) => t.tube_radius_m() - sink(4.0),
        Form::Cylinder(c) if stands => 0.5 * c.length_m() - sink(4.0),
        Form::Cylinder(c) => c.radius_m() - sink(2.0),
        Form::Cone(c) if stands => 0.5 * c.length_m() - sink(4.0),
        Form::Cone(c) => {
            // On its side: two ends carry as a lever has it. The middle of the axis and the centre of mass are above
            // these places of the line, from the wide end on.
            let (a, b, l) = (c.radius_bottom_m(), c.radius_top_m(), c.length_m());
            let slant = l.hypot(a - b);
            let place = |up: f64| ((up + 0.5 * l) * l + a * (a - b)) / (slant * slant);
            let load = place(world.body().mass.centre_B.y);
            let middle = place(0.0);
            let sinks = ((1.0 - load) * (1.0 - middle) + load * middle) * MASS * G / SERIES;
            0.5 * (a + b) * l / slant - sinks
        }
        _ => panic!("{name}"),
    }
}

/// Drops each form so often, and looks at it for so many seconds once it rests.
fn drop_all(drops: usize, seconds: u32) {
    for (seed, (name, form)) in (1..).zip(all()).filter(|(_, (name, _))| *name != "ellipsoid") {
        let mut noise = Noise(seed);
        for _ in 0..drops {
            let mut world = above_floor(form, noise.turn(), 0.02);
            let is_still = |world: &World| {
                let body = world.body();
                body.velocity_W.norm() < 1e-6 && body.angular_velocity_W().norm() < 1e-6 / 0.01
            };
            // Nothing damps a cylinder that rolls but its landing.
            let mut waited_s = 0;
            while !is_still(&world) {
                assert!(waited_s < 20, "{name}: {:?}", world.body());
                (0..1000).for_each(|_| drop(world.step(&[])));
                waited_s += 1;
            }
            (0..5000).for_each(|_| drop(world.step(&[])));
            let at = world.entities[1].X_WB;
            let expected = height_at_rest(name, &form, &world);
            // One end of a cone sinks deeper by less than 1 mm, a slope of 2e-2 that moves the centre of mass by as
            // much of its height of 1 cm towards that end: 1 % of the load and of what it sinks.
            let off = (at.translation.y - expected).abs();
            assert!(
                off < if name.contains("cone") { 1e-5 } else { 1e-8 },
                "{name}: {} {expected}",
                at.translation.y
            );
            let rolls = world.body().velocity_W.norm() + 0.05 * world.body().angular_velocity_W().norm();
            (0..1000 * seconds).for_each(|_| drop(world.step(&[])));
            let after = world.entities[1].X_WB;
            let crept = (after.translation.vector - at.translation.vector).norm();
            let turned = after.rotation.angle_to(&at.rotation);
            // What lies on its round side goes on rolling at what is left of its speed; all else holds to what the
            // solver leaves open.
            assert!(crept < 1e-8 + f64::from(seconds) * rolls, "{name}: {crept} {rolls}");
            assert!(turned < 1e-7 + f64::from(seconds) * rolls / 0.01, "{name}: {turned} {rolls}");
            if world.made.rows > 2 {
                assert!(rolls < 1e-10, "{name}: {rolls}");
            }
        }
    }
}

#[test]
fn every_form_that_is_dropped_comes_to_rest_where_statics_says_and_stays_there() {
    drop_all(3, 10);
}

#[test]
#[ignore = "half a minute; see the top of the file"]
fn every_form_that_is_dropped_often_comes_to_rest_where_statics_says_and_stays_for_a_minute() {
    drop_all(12, 60);
}

#[test]
fn what_rocks_on_a_round_belly_never_gains_energy_and_never_leaves_the_floor() {
    let rocking = all().into_iter().filter(|(name, _)| *name == "ellipsoid").chain(scaled());
    for (seed, (name, form)) in (1..).zip(rocking) {
        let mut world = above_floor(form, Noise(seed).turn(), 0.005);
        let energy = |world: &World| {
            let springs: f64 =
                world.manipulation.rows().iter().map(|row| row.force_W.norm_squared() / (2.0 * SERIES)).sum();
            world.body().kinetic_energy_j() + MASS * G * world.body().centre_W.y + springs
        };
        (0..2000).for_each(|_| drop(world.step(&[])));
        let mut last = energy(&world);
        for second in 0..20 {
            (0..1000).for_each(|_| drop(world.step(&[])));
            let now = energy(&world);
            // Rolling loses nothing but to the damping of what it presses; the energy of a tick is known to what it
            // moves in one, 1e-3 of what it has.
            assert!(now < last + 1e-3 * (last - MASS * G * 0.005).abs(), "{name} {second}: {now} {last}");
            last = now.min(last);
            assert!(world.made.rows > 0, "{name} hops");
        }
    }
}

#[test]
fn forms_that_fall_on_each_other_never_gain_energy() {
    for (seed, (name_a, a)) in (1..).zip(all()) {
        for (name_b, b) in all() {
            let mut noise = Noise(seed * 31);
            let lower = object(b, pose(noise.turn(), Vector3::new(0.0, 0.06, 0.0)), STIFFNESS, MU);
            let upper = object(a, pose(noise.turn(), Vector3::new(0.004, 0.16, 0.003)), STIFFNESS, MU);
            let bodies = [(1, body(&lower, 0.2)), (2, body(&upper, MASS))];
            let mut world =
                World::new(vec![floor(0.0, 2000.0, MU), lower, upper], &bodies, Settings::default(), 0);
            let energy = |world: &World| -> f64 {
                let bodies = world.manipulation.bodies().iter();
                bodies.map(|body| body.kinetic_energy_j() + body.mass.mass_kg * G * body.centre_W.y).sum()
            };
            let start = energy(&world);
            for tick in 0..1500 {
                world.step(&[]);
                let now = energy(&world);
                // Springs that were stretched in one direction and are released in another may give what a contact's
                // depth of a millimetre changes by: 1000 N/m (1 mm)^2 / 2.
                assert!(now < start + 5e-4, "{name_a} on {name_b} at {tick}: {now} {start}");
                let body = world.body();
                assert!(body.is_finite() && body.velocity_W.norm() < 3.0, "{name_a} on {name_b}: {body:?}");
            }
            assert!(energy(&world) < 0.6 * start, "{name_a} on {name_b}: {}", energy(&world) / start);
            // Nobody fell through: lower than half of the thinnest lies nothing.
            let lowest = world.manipulation.bodies().iter().map(|body| body.centre_W.y).fold(1.0, f64::min);
            assert!(lowest > 0.005, "{name_a} on {name_b}: {lowest}");
        }
    }
}
