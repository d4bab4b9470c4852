//! Turns of bodies, where a tick has no time for all that moves.
#![allow(non_snake_case)]

use crate::{common, counting};

use common::*;
use counting::CALLS;
use haptics::{Cuboid, Entity, Sphere};
use nalgebra::{Isometry3, Vector3};
use physics::{Settings, Standing, Touch};

/// Things of 20 mm, so many by so many, in layers, 1 mm apart, on a floor between walls.
fn heap(side: usize, layers: usize, with_balls: bool) -> World {
    let mut entities = vec![floor(0.0, 2000.0, 0.5)];
    let half_m = 0.0105 * side as f64 + 1e-3;
    for (x, z) in [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)] {
        let size = if x == 0.0 { [4.0 * half_m, 0.4, 0.02] } else { [0.02, 0.4, 4.0 * half_m] };
        let at = Isometry3::translation(x * (half_m + 0.01), 0.2, z * (half_m + 0.01));
        entities.push(object(Cuboid::new(size).unwrap(), at, 2000.0, 0.5));
    }
    let first = entities.len();
    for at in 0..side * side * layers {
        let place = [at % side, at / side % side, at / (side * side)].map(|part| 0.021 * part as f64);
        let middle_m = 0.0105 * (side as f64 - 1.0);
        let at_W = Isometry3::translation(place[0] - middle_m, 0.0105 + place[2], place[1] - middle_m);
        let thing: Entity = match with_balls && at % 2 == 1 {
            false => object(Cuboid::new([0.02, 0.018, 0.016]).unwrap(), at_W, 1000.0, 0.5),
            true => object(Sphere::new(0.0095).unwrap(), at_W, 1000.0, 0.5),
        };
        entities.push(thing);
    }
    let bodies: Vec<_> = (first..entities.len()).map(|index| (index, body(&entities[index], 0.01))).collect();
    let settings = Settings {
        contact_stiffness: physics::ContactStiffness::ByMass { damping_ratio: 1.0 },
        sleep: Some(physics::Sleep::default()),
        ..Settings::default()
    };
    World::new(entities, &bodies, settings, 1)
}

fn lowest_m(world: &World) -> f64 {
    world.manipulation.bodies().iter().map(|body| body.centre_W.y).fold(f64::INFINITY, f64::min)
}

#[test]
fn in_a_heap_no_more_are_stepped_than_may_be_and_all_come_to_rest() {
    let mut world = heap(4, 4, true);
    let (count, most) = (world.manipulation.bodies().len(), 12);
    let (mut waited, mut over) = (0, 0);
    for _ in 0..30_000 {
        world.manipulation.step_at_most(most, std::iter::empty());
        world.step(&[]);
        waited += usize::from(world.made.held > 0);
        // What is met or struck in the tick is stepped, too.
        over = over.max(world.made.awake.saturating_sub(most));
        assert!(world.made.awake + world.made.held <= count);
    }
    assert!(waited > 5000 && over <= most, "{waited} {over}");
    assert!(lowest_m(&world) > 0.0075, "{}", lowest_m(&world));
    // Without a limit it is at rest soon: it was nearly.
    let begin_W: Vec<_> = world.manipulation.bodies().iter().map(|body| body.centre_W).collect();
    for _ in 0..5000 {
        world.manipulation.step_at_most(usize::MAX, std::iter::empty());
        world.step(&[]);
    }
    assert!(world.made.held == 0 && world.made.awake < count / 4, "{:?}", world.made);
    let moved =
        world.manipulation.bodies().iter().zip(begin_W).map(|(body, was)| (body.centre_W - was).norm());
    assert!(moved.fold(0.0, f64::max) < 0.01);
}

#[test]
fn what_is_nearest_moves_as_if_there_was_no_limit_and_what_is_far_more_slowly() {
    let scene = || {
        let mut entities = vec![floor(0.0, 2000.0, 0.5)];
        for at in 0..20 {
            let at_W = Isometry3::translation(0.1 * f64::from(at), 0.5, 0.0);
            entities.push(object(Sphere::new(0.01).unwrap(), at_W, 1000.0, 0.5));
        }
        let bodies: Vec<_> = (1..entities.len()).map(|index| (index, body(&entities[index], 0.01))).collect();
        World::new(entities, &bodies, Settings::default(), 0)
    };
    let (mut all, mut some) = (scene(), scene());
    for _ in 0..250 {
        all.step(&[]);
        some.manipulation.step_at_most(8, std::iter::once(Vector3::new(0.0, 0.2, 0.0)));
        some.step(&[]);
    }
    let [fell, fell_at_most_8] = [&all, &some].map(|world| {
        world.manipulation.bodies().iter().map(|body| 0.5 - body.centre_W.y).collect::<Vec<_>>()
    });
    for near in 0..6 {
        assert_eq!(fell[near], fell_at_most_8[near], "{near}");
    }
    // Two places for fourteen: each has had a seventh of the time, to one turn.
    for far in 6..20 {
        let slower = (fell_at_most_8[far] / fell[far]).sqrt();
        assert!((1.0 / 7.0 - slower).abs() < 16.0 / 250.0, "{far}: {slower}");
        assert!(some.manipulation.bodies()[far].velocity_W.y < 0.0, "{far}");
    }
}

#[test]
fn a_heap_that_sleeps_wakes_no_farther_than_there_is_time_for_and_nothing_allocates() {
    let mut world = heap(4, 3, false);
    (0..3000).for_each(|_| drop(world.step(&[])));
    assert!(world.manipulation.awake().is_empty());
    let top = (0..world.manipulation.bodies().len())
        .max_by(|a, b| {
            let height = |body: &usize| world.manipulation.bodies()[*body].centre_W.y;
            height(a).total_cmp(&height(b))
        })
        .unwrap();
    let entity = world.manipulation.entity_of(top);
    let at_W = world.manipulation.bodies()[top].centre_W;
    let mut counted = 0;
    for tick in 0..2000 {
        // Comes down on it, and presses.
        let hip = at_W + Vector3::new(0.0, 0.012 - 4e-6 * f64::from(tick), 0.0);
        world.fingers[0].step(&world.entities, &hip, DT);
        world.touches.clear();
        world.touches.extend(world.fingers[0].contacts().map(|contact| Touch::of(contact, 0)));
        let is_touched = world.touches.iter().any(|touch| touch.entity == entity);
        let before = CALLS.get();
        world.manipulation.step_at_most(6, std::iter::once(hip));
        world.made = world.manipulation.step(&mut world.entities, &mut world.touches, DT);
        counted += CALLS.get() - before;
        assert!(world.made.awake <= 8, "{tick}: {:?}", world.made);
        assert!(!is_touched || world.manipulation.standing(top) == Standing::Awake, "{tick}");
    }
    assert!(world.made.held > 3, "{:?}", world.made);
    assert_eq!(counted, 0);
}

#[test]
fn a_touch_tells_with_how_much_those_that_wait_hold_its_body() {
    // A row of cubes, of which the last one leans on a wall, and one that stands apart.
    let scene = || {
        let mut entities = vec![floor(0.0, 2000.0, 0.5)];
        let wall_at_W = Isometry3::translation(0.28, 0.05, 0.0);
        entities.push(object(Cuboid::new([0.04, 0.1, 0.1]).unwrap(), wall_at_W, 2000.0, 0.5));
        for at in 0..7 {
            let at_W = Isometry3::translation(if at < 6 { 0.04 * f64::from(at) } else { -0.5 }, 0.02, 0.0);
            entities.push(object(Cuboid::new([0.04; 3]).unwrap(), at_W, 1000.0, 0.5));
        }
        let bodies: Vec<_> = (2..entities.len()).map(|index| (index, body(&entities[index], 0.1))).collect();
        World::new(entities, &bodies, Settings::default(), 1)
    };
    let leans = |most: usize, first_m: f64| {
        let (mut world, mut leaning, mut touched) = (scene(), 0, 0);
        for tick in 0..500 {
            let hip = Vector3::new(first_m + 5e-5 * f64::from(tick), 0.02, 0.0);
            world.manipulation.step_at_most(most, std::iter::once(hip));
            world.step(&[hip]);
            touched += world.touches.len();
            leaning += world.touches.iter().filter(|touch| touch.held_by_waiting_n > 0.0).count();
        }
        assert!(touched > 400, "{touched}");
        leaning
    };
    // What is fixed for good is a wall.
    assert_eq!(leans(usize::MAX, -0.021), 0);
    assert!(leans(4, -0.021) > 300, "{}", leans(4, -0.021));
    // It pushes nobody.
    assert_eq!(leans(4, -0.521), 0);
}

/// A tray of a floor and four walls, driven as orders do it: all of them, or none while one of them is held up.
#[test]
fn what_lies_in_a_tray_that_is_driven_stays_in_it_however_few_are_stepped() {
    const WAY_M: f64 = 0.1;
    let (inner_m, thick_m) = (0.09, 0.01);
    let tray = [[0.0, 0.0], [1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]].map(|[x, z]| {
        let long_m = 2.0 * (inner_m + thick_m);
        let (size, y) = match (x, z) {
            (0.0, 0.0) => ([long_m, thick_m, long_m], -0.5 * thick_m),
            (_, 0.0) => ([thick_m, 0.06, long_m], 0.03),
            _ => ([long_m, 0.06, thick_m], 0.03),
        };
        let middle_m = inner_m + 0.5 * thick_m;
        object(Cuboid::new(size).unwrap(), Isometry3::translation(x * middle_m, y, z * middle_m), 2000.0, 0.5)
    });
    let mut entities = Vec::from(tray);
    for at in 0..49 {
        let [x, z] = [at % 7, at / 7].map(|at| 0.024 * f64::from(at) - 0.072);
        entities.push(object(
            Cuboid::new([0.02; 3]).unwrap(),
            Isometry3::translation(x, 0.01, z),
            1000.0,
            0.4,
        ));
    }
    let bodies: Vec<_> = (5..entities.len()).map(|index| (index, body(&entities[index], 0.02))).collect();
    let settings = Settings {
        contact_stiffness: physics::ContactStiffness::ByMass { damping_ratio: 1.0 },
        sleep: Some(physics::Sleep::default()),
        ..Settings::default()
    };
    let mut world = World::new(entities, &bodies, settings, 1);
    let begin_W: Vec<_> = world.entities[..5].iter().map(|part| part.X_WB.translation.vector).collect();
    let (mut t, mut waited, mut x_m) = (0.0_f64, 0, 0.0);
    for tick in 0..40_000 {
        world.manipulation.step_at_most(12, std::iter::empty());
        let pace = (0..5).map(|part| world.manipulation.pace_of_driven(part)).fold(1.0, f64::min);
        if tick >= 1000 {
            t = (t + pace * DT).min(1.0);
            x_m = WAY_M * t * t * t * (10.0 - 15.0 * t + 6.0 * t * t);
        }
        waited += u32::from(pace < 1.0);
        for (part, from_W) in begin_W.iter().enumerate() {
            let to_W = Isometry3::from(nalgebra::Translation3::from(from_W + Vector3::x() * x_m));
            assert!(world.manipulation.drive(part, to_W));
        }
        world.step(&[]);
        for (number, body) in world.manipulation.bodies().iter().enumerate() {
            let in_tray = body.centre_W - Vector3::x() * x_m;
            // Half of an edge's length from where it would be half in a wall, or in the floor.
            let is_in = in_tray.x.abs() < inner_m && in_tray.z.abs() < inner_m && in_tray.y > 0.0;
            assert!(is_in, "{number} in tick {tick}: {in_tray:?}");
        }
    }
    assert!(t == 1.0 && waited > 1000, "{t} {waited}");
}
