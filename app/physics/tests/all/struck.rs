//! Things that are struck, and what stands so near behind them that they come there within the same tick.
#![allow(non_snake_case)]

use crate::noise::Noise;
use crate::{common, meshes};

use common::*;
use haptics::{Cuboid, Entity, Shape, Sphere};
use nalgebra::{Isometry3, Vector3};
use physics::{Body, ContactStiffness, Response, Settings};

const RADIUS: f64 = 0.01;
/// Of the plates.
const THICK: f64 = 0.005;

fn weightless(restitution: f64) -> [Settings; 2] {
    let by_mass = ContactStiffness::ByMass { damping_ratio: 1.0 };
    [Response::Bounce { restitution }, Response::Impulse { restitution }].map(|response| Settings {
        gravity_W: Vector3::zeros(),
        response,
        contact_stiffness: by_mass,
        ..Settings::default()
    })
}

fn ball(x: f64) -> Entity {
    object(Sphere::new(RADIUS).unwrap(), Isometry3::translation(x, 0.0, 0.0), 1000.0, 0.0)
}

/// A plate whose face that looks against x is there.
fn plate(x: f64) -> Entity {
    let size = [THICK, 0.2, 0.2];
    object(Cuboid::new(size).unwrap(), Isometry3::translation(x + 0.5 * THICK, 0.0, 0.0), 1000.0, 0.0)
}

/// Two plates in one mesh, the second one there: a ball touches the first one all the time.
fn floor_with_wall(x: f64) -> Entity {
    let block = |at: [f64; 3], size: [f64; 3]| {
        let mut soup = meshes::block(1, 1.0, 1.0, |_, _| 0.0);
        for v in &mut soup.vertices {
            *v = Vector3::from(at) + v.component_mul(&Vector3::from(size));
        }
        soup
    };
    // Tops: the floor's, and of the wall.
    let mut both = block([0.0, -RADIUS, 0.0], [0.6, THICK, 0.2]);
    let wall = block([x + 0.5 * THICK, 0.1, 0.0], [THICK, 0.1, 0.2]);
    let first = both.vertices.len() as u32;
    both.vertices.extend(wall.vertices);
    both.faces.extend(wall.faces.iter().map(|face| face.map(|corner| corner + first)));
    object(Shape::from(meshes::build(both)), Isometry3::identity(), 1000.0, 0.0)
}

fn energy_j(world: &World) -> f64 {
    world.manipulation.bodies().iter().map(Body::kinetic_energy_j).sum::<f64>()
}

/// A heavy ball comes so fast and strikes a light one, which something stands behind; how far that is when they have parted.
fn play(behind: Vec<Entity>, movable_kg: Option<f64>, v: f64, gap: f64, settings: Settings) -> World {
    let mut entities = vec![ball(-0.021), ball(0.0)];
    let coming = body(&entities[0], 1.0).moving(Vector3::x() * v, Vector3::zeros());
    let mut bodies = vec![(0, coming), (1, body(&entities[1], 0.01))];
    if let Some(kg) = movable_kg {
        bodies.push((2, body(&behind[0], kg)));
    }
    entities.extend(behind);
    let mut world = World::new(entities, &bodies, settings, 0);
    let begin_j = energy_j(&world);
    for tick in 0..40 {
        world.step(&[]);
        let now_j = energy_j(&world) + world.manipulation.elastic_energy_j();
        assert!(now_j < begin_j * (1.0 + 1e-9), "{v} m/s, {gap} m, tick {tick}: {now_j} J of {begin_j} J");
    }
    world
}

#[test]
fn what_is_struck_does_not_fly_through_what_stands_behind_it() {
    for settings in [0.0, 0.5, 0.9, 1.0].into_iter().flat_map(weightless) {
        for v in [1.0, 3.0, 6.0, 12.0, 25.0, 50.0] {
            if v > 25.0 && settings.response == (Response::Bounce { restitution: 0.0 }) {
                // A heavy one presses what does not bounce through the plate by its springs, which are as stiff as what is light.
                continue;
            }
            for gap in [0.0, 0.002, 0.004, 0.012, 0.02, 0.03, 0.045, 0.07] {
                let x = RADIUS + gap;
                let fixed = play(vec![plate(x)], None, v, gap, settings);
                let by_mesh = play(vec![floor_with_wall(x)], None, v, gap, settings);
                for (what, world) in [("plate", fixed), ("mesh", by_mesh)] {
                    for body in world.manipulation.bodies() {
                        // The heavy one presses the light one against the plate, or both have gone.
                        let through_m = body.centre_W.x + RADIUS - x;
                        assert!(
                            through_m < 0.5 * RADIUS,
                            "{what} {v} m/s, {gap} m: {through_m} m, {settings:?}"
                        );
                    }
                }
                for (kg, behind) in [(0.2, plate(x)), (0.01, ball(x + RADIUS))] {
                    let world = play(vec![behind], Some(kg), v, gap, settings);
                    let at = |body: usize| world.manipulation.bodies()[body].centre_W.x;
                    assert!(at(1) < at(2), "{kg} kg {v} m/s, {gap} m: {} m {} m, {settings:?}", at(1), at(2));
                }
            }
        }
    }
}

/// Balls in a row before a plate, one of which comes: they stay in their order, and those of one mass pass on velocities.
#[test]
fn balls_in_a_row_before_a_plate_stay_in_their_order() {
    let mut noise = Noise::new(7);
    for case in 0..300 {
        let settings = weightless(1.0)[case % 2];
        let count = 2 + (noise.unit() * 3.0) as usize;
        let are_equal = case % 3 == 0;
        let v = 40.0 * noise.unit().powi(2) + 0.5;
        let (mut entities, mut bodies, mut x) = (vec![plate(0.0)], Vec::new(), -RADIUS);
        for place in 0..count {
            x -= 0.03 * noise.unit().powi(2);
            entities.push(ball(x));
            let kg = if are_equal { 0.1 } else { 10.0_f64.powf(2.0 * noise.unit() - 2.0) };
            let velocity_W = if place + 1 == count { Vector3::x() * v } else { Vector3::zeros() };
            bodies.push((place + 1, body(&entities[place + 1], kg).moving(velocity_W, Vector3::zeros())));
            x -= 2.0 * RADIUS;
        }
        let mut world = World::new(entities, &bodies, settings, 0);
        let begin_j = energy_j(&world);
        for _ in 0..400 {
            world.step(&[]);
            let places: Vec<f64> = world.manipulation.bodies().iter().map(|body| body.centre_W.x).collect();
            assert!(places[0] < 0.0 && places.is_sorted_by(|a, b| a > b), "{case}: {v} m/s {places:?}");
        }
        let now_j = energy_j(&world);
        assert!(now_j < begin_j * (1.0 + 1e-9), "{case}: {now_j} J of {begin_j} J");
        if are_equal {
            let speeds: Vec<f64> = world.manipulation.bodies().iter().map(|body| body.velocity_W.x).collect();
            // It goes in and out again by the last one, whatever the gaps.
            for (place, speed) in speeds.iter().enumerate() {
                let leaves = if place + 1 == count { -v } else { 0.0 };
                assert!((speed - leaves).abs() < 1e-5 * v, "{case}: {v} m/s {speeds:?}");
            }
        }
    }
}

/// It looks far for as long as something fast passes, and no longer: each box that is larger is near more.
#[test]
fn the_box_of_what_may_be_struck_becomes_small_again() {
    let [settings, _] = weightless(0.5);
    // It passes in 35 mm, of which 15 are between them; what is between their boxes is less.
    let resting = ball(0.0);
    let coming = Isometry3::translation(-0.1 - 0.0247, 0.0, -0.1 + 0.0247);
    let coming = object(Sphere::new(RADIUS).unwrap(), coming, 1000.0, 0.0);
    let passes = body(&coming, 0.1).moving(Vector3::new(17.7, 0.0, 17.7), Vector3::zeros());
    let bodies = vec![(0, body(&resting, 0.1)), (1, passes)];
    let mut world = World::new(vec![resting, coming], &bodies, settings, 0);
    let size_m = |world: &World| {
        let around = world.manipulation.broad_phase().around(0).unwrap();
        (around.high_W - around.low_W).max()
    };
    let (before_m, mut largest_m) = (size_m(&world), 0.0_f64);
    for _ in 0..40 {
        world.step(&[]);
        largest_m = largest_m.max(size_m(&world));
    }
    assert_eq!(world.manipulation.bodies()[0].velocity_W, Vector3::zeros());
    // On each side what comes by in a tick: both weigh the same.
    assert!(largest_m > before_m + 2.0 * 0.025 && size_m(&world) == before_m, "{before_m} m, {largest_m} m");
}

/// Two balls, of which one flies past the other: within a tick a contact has one normal, that of its beginning.
#[test]
fn what_passes_nearer_than_its_way_in_a_tick_explains_meets_what_it_passes() {
    let [settings, _] = weightless(1.0);
    for v in [1.0, 2.0, 5.0, 10.0] {
        let (way, mut met) = (v * DT, [0; 2]);
        let bound = way * way / (4.0 * RADIUS);
        for (which, clearance) in [0.8 * bound, 1.02 * bound].into_iter().enumerate() {
            for phase in 0..20 {
                let x = -0.05 - way * f64::from(phase) / 20.0;
                let at = Isometry3::translation(x, 0.0, 2.0 * RADIUS + clearance);
                let coming = object(Sphere::new(RADIUS).unwrap(), at, 1000.0, 0.0);
                let passes = body(&coming, 0.1).moving(Vector3::x() * v, Vector3::zeros());
                let bodies = vec![(0, body(&ball(0.0), 0.1)), (1, passes)];
                let mut world = World::new(vec![ball(0.0), coming], &bodies, settings, 0);
                for _ in 0..(0.1 / way) as u32 {
                    world.step(&[]);
                }
                met[which] += u32::from(world.manipulation.bodies()[0].velocity_W != Vector3::zeros());
            }
        }
        assert!(met[0] > 0 && met[1] == 0, "{v} m/s: {met:?}");
    }
}

/// In an explosion everything may strike everything: who looked for all of that would leave out contacts for want of room.
#[test]
fn in_an_explosion_no_contact_is_left_out() {
    let [settings, _] = weightless(1.0);
    let mut noise = Noise::new(3);
    let (mut entities, mut bodies) = (Vec::new(), Vec::new());
    for place in 0..300_u32 {
        let [x, y, z] = [place % 7, place / 7 % 7, place / 49].map(|at| 0.025 * f64::from(at) - 0.075);
        let at = Isometry3::from_parts(Vector3::new(x, y, z).into(), noise.turn());
        let shape: Shape = if place % 2 == 0 {
            Cuboid::new([0.012; 3]).unwrap().into()
        } else {
            Sphere::new(0.008).unwrap().into()
        };
        let thing = object(shape, at, 1000.0, 0.3);
        let flies = body(&thing, noise.log_within(0.005, 0.05)).moving(noise.vector(8.0), noise.vector(20.0));
        bodies.push((place as usize, flies));
        entities.push(thing);
    }
    let mut world = World::new(entities, &bodies, settings, 0);
    for _ in 0..60 {
        world.step(&[]);
    }
    assert_eq!(world.manipulation.left_out(), 0);
}
