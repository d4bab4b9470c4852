//! The fast and the slow list: every body is in one of them, whatever happens.
//!
//! `cargo test --release -p world --test all lists:: -- --include-ignored` adds a million hand-overs (ten seconds, of a debug build a minute).
#![allow(non_snake_case)] // Names carry their frame.

use haptics::{Cuboid, Entity, Friction, Plane, Shape, Sphere};
use nalgebra::{Isometry3, Vector3};
use physics::{Body, Manipulation, MassProperties, Settings, Sleep, Standing};
use world::lists::{ListSettings, Lists, Reach, SlowOrder};

const DT: f64 = 1e-3;
const SIZE: f64 = 0.04;

fn object(shape: impl Into<Shape>, at: Vector3<f64>) -> Entity {
    let entity = Entity::new(shape, Isometry3::translation(at.x, at.y, at.z), 1000.0).unwrap();
    entity.with_friction(Friction::coulomb(0.5).unwrap()).unwrap().with_damping(1.0).unwrap()
}

/// A table with stacks of two cubes, 0.2 m from each other, and a ball beside each stack.
fn table(stacks: usize) -> (Vec<Entity>, Vec<(usize, Body)>) {
    let floor = Plane::new(Vector3::y(), 0.0).unwrap();
    let mut entities = vec![Entity::new(floor, Isometry3::identity(), 2000.0).unwrap()];
    for stack in 0..stacks {
        let x = 0.2 * stack as f64;
        let cube = || Cuboid::new([SIZE; 3]).unwrap();
        entities.push(object(cube(), Vector3::new(x, 0.5 * SIZE, 0.0)));
        entities.push(object(cube(), Vector3::new(x, 1.5 * SIZE, 0.0)));
        entities.push(object(Sphere::new(0.02).unwrap(), Vector3::new(x + 0.1, 0.02, 0.0)));
    }
    let body = |at: usize| {
        let entity: &Entity = &entities[at];
        Body::at_rest(MassProperties::of_shape(&entity.shape, 0.05).unwrap(), &entity.X_WB)
    };
    let bodies = (1..entities.len()).map(|at| (at, body(at))).collect();
    (entities, bodies)
}

/// Both sides, stepped in turns as the virtual clock does it.
struct World {
    entities: Vec<Entity>,
    lists: Lists,
    tick: u64,
}

impl World {
    fn new(stacks: usize, settings: ListSettings) -> Self {
        let (entities, bodies) = table(stacks);
        let physics = Settings { sleep: Some(Sleep::default()), ..Settings::default() };
        let lists = Lists::new(&entities, &bodies, physics, settings).unwrap();
        Self { entities, lists, tick: 0 }
    }

    /// A tick with fingers that touch nothing, and every tenth tick a turn of the slow side, unless it stalls.
    fn step(&mut self, fingers: &[Reach], slow_runs: bool) {
        let Lists { fast, hand_over, slow } = &mut self.lists;
        hand_over.begin_tick(fast, &mut self.entities, fingers.iter().copied(), (self.tick, DT));
        fast.step(&mut self.entities, &mut [], DT);
        hand_over.end_tick(fast, &self.entities);
        self.tick += 1;
        if slow_runs && self.tick.is_multiple_of(10) {
            slow.turn(10, DT);
        }
    }

    fn standings(&self, body: usize) -> [Standing; 2] {
        [&self.lists.fast, self.lists.slow.manipulation()].map(|side: &Manipulation| side.standing(body))
    }

    /// No body is in both lists; says how many are in neither.
    fn on_their_way(&self) -> usize {
        let is_away = |body: usize| {
            let standings = self.standings(body);
            assert!(
                standings.iter().any(|standing| standing.is_away()),
                "in both lists: body {body}, tick {}",
                self.tick
            );
            standings.iter().all(|standing| standing.is_away())
        };
        (0..self.lists.fast.bodies().len()).filter(|&body| is_away(body)).count()
    }

    /// Ends as a run does: whatever is on its way is taken in.
    fn end(&mut self) {
        let Lists { fast, hand_over, slow } = &mut self.lists;
        hand_over.end(fast, &mut self.entities, Some(slow));
    }
}

fn finger_at(x: f64, velocity: f64) -> Reach {
    Reach { hip_W: Vector3::new(x, SIZE, 0.1), velocity_W: Vector3::new(velocity, 0.0, 0.0), radius_m: 0.0 }
}

/// Everything goes that nobody is near.
const STRICT: ListSettings = ListSettings { near_m: 0.11, far_m: 0.13, ahead_s: 0.03, fast_bodies: 0 };

fn random(seed: &mut u64) -> f64 {
    *seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
    (*seed >> 11) as f64 / (1u64 << 53) as f64
}

/// Fingers that appear here and there, until so many bodies have changed lists.
fn hand_over_at_random(changes: u64) {
    let mut world = World::new(8, STRICT);
    let bodies = world.lists.fast.bodies().len();
    let mut seed = 3;
    let mut fingers = [finger_at(0.0, 0.0); 3];
    let handed = |world: &World| {
        let handed = world.lists.hand_over.handed();
        handed.came + handed.went
    };
    let mut ticks = 0;
    while handed(&world) < changes {
        ticks += 1;
        // Each change takes some.
        assert!(ticks < 1000 * changes, "{} of {changes} changes", handed(&world));
        if random(&mut seed) < 0.05 {
            let which = (random(&mut seed) * 3.0) as usize;
            fingers[which] = finger_at(1.6 * random(&mut seed) - 0.1, random(&mut seed) - 0.5);
        }
        world.step(&fingers, random(&mut seed) < 0.9);
        assert!(world.on_their_way() <= bodies);
        let here = (0..bodies).filter(|&body| !world.standings(body)[0].is_away()).count();
        assert_eq!(here, world.lists.hand_over.here());
    }
    world.end();
    assert_eq!(world.on_their_way(), 0, "nothing is lost");
    for body in 0..bodies {
        let side = usize::from(world.standings(body)[0].is_away());
        let state = [&world.lists.fast, world.lists.slow.manipulation()][side].bodies()[body];
        let (_, began) = table(8);
        // They rested all the time, but for the springs' own settling: m g / k of 0.25 mm and less.
        let moved = (state.centre_W - began[body].1.centre_W).norm();
        assert!(moved < 1e-3, "body {body} moved {moved}");
    }
}

#[test]
fn bodies_that_change_lists_at_random_are_in_one_of_them_or_on_their_way() {
    hand_over_at_random(20_000);
}

#[test]
#[ignore = "ten seconds and more"]
fn a_million_hand_overs_lose_nobody() {
    hand_over_at_random(1_000_000);
}

#[test]
fn a_finger_that_comes_near_has_what_it_could_touch_in_the_fast_list_in_time() {
    let mut world = World::new(3, STRICT);
    (0..2000).for_each(|_| world.step(&[], true));
    assert_eq!(world.lists.hand_over.here(), 0, "all are out of reach");
    // At 0.5 m/s along the table: within reach in time, and let go behind it.
    let mut most_here = 0;
    for tick in 0..2000 {
        let x = -0.3 + 0.5e-3 * f64::from(tick);
        world.step(&[finger_at(x, 0.5)], true);
        for body in 0..9 {
            let near = (world.lists.fast.bodies()[body].centre_W.x - x).abs() < 0.05;
            assert!(!near || !world.standings(body)[0].is_away(), "body {body} at {x}");
        }
        most_here = most_here.max(world.lists.hand_over.here());
    }
    assert!((3..=7).contains(&most_here), "{most_here}");
    let handed = world.lists.hand_over.handed();
    // The slow side has a turn every ten ticks.
    assert!(handed.came >= 9 && handed.waits.most_ticks() <= 11, "{handed:?}");
    (0..100).for_each(|_| world.step(&[], true));
    assert_eq!(world.lists.hand_over.here(), 0);
}

#[test]
fn a_stack_that_changes_lists_does_not_twitch() {
    let mut world = World::new(1, STRICT);
    (0..3000).for_each(|_| world.step(&[], true));
    let rests = |world: &World, side: usize| {
        let side = [&world.lists.fast, world.lists.slow.manipulation()][side];
        side.bodies().iter().map(|body| body.centre_W).collect::<Vec<_>>()
    };
    let before = rests(&world, 1);
    for tick in 0..2000 {
        let finger = [finger_at(0.0, 0.0)];
        world.step(if tick / 100 % 2 == 0 { &finger } else { &[] }, true);
        for (body, before) in before.iter().enumerate().take(2) {
            let side = usize::from(world.standings(body)[0].is_away());
            if world.standings(body).iter().all(|standing| standing.is_away()) {
                continue;
            }
            let moved = (rests(&world, side)[body] - before).norm();
            // It sleeps all along; where it woke it would go on settling by less than 1e-6 m/s.
            assert!(moved < 1e-9, "tick {tick}: {moved:e}");
        }
    }
    assert!(world.lists.hand_over.handed().came >= 20);
    // What was given away asleep rests: it is as new as any tick.
    (0..50).for_each(|_| world.step(&[], true));
    assert!((0..2).all(|body| world.standings(body)[0].is_away()));
    assert_eq!([0, 1].map(|body| world.lists.hand_over.as_of(body)), [None; 2]);
}

#[test]
fn a_slow_side_that_stalls_leaves_its_bodies_standing_where_they_were() {
    let mut world = World::new(2, STRICT);
    (0..2000).for_each(|_| world.step(&[], true));
    let poses: Vec<_> = world.entities.iter().map(|entity| entity.X_WB).collect();
    for _ in 0..5000 {
        world.step(&[finger_at(0.0, 0.0)], false);
        assert_eq!(world.lists.hand_over.here(), 0, "claimed, and nobody answers");
        assert!(world.entities.iter().zip(&poses).all(|(entity, was)| entity.X_WB == *was));
    }
    // It goes on: what was claimed comes, after as many ticks as it stalled.
    (0..20).for_each(|_| world.step(&[finger_at(0.0, 0.0)], true));
    let handed = world.lists.hand_over.handed();
    assert!(world.lists.hand_over.here() >= 2 && handed.waits.most_ticks() >= 5000, "{handed:?}");
}

/// As a driver that was restarted: it begins anew, and the slow list goes on.
#[test]
fn where_the_count_of_ticks_begins_anew_slow_things_are_seen_going_on() {
    let (mut entities, bodies) = falling();
    let Lists { mut fast, mut hand_over, mut slow } =
        Lists::new(&entities, &bodies, Settings::default(), STRICT).unwrap();
    let mut y = 0.5;
    for tick in 0..300_u64 {
        hand_over.begin_tick(&mut fast, &mut entities, std::iter::empty(), (tick % 150, DT));
        fast.step(&mut entities, &mut [], DT);
        hand_over.end_tick(&mut fast, &entities);
        slow.turn(1, DT);
        let now = entities[2].X_WB.translation.vector.y;
        // Of what was given away in the first tick the first places come in the next ones.
        assert!(tick < 10 || now < y, "tick {tick}: {now}");
        y = now;
    }
    let fallen = 0.5 * 9.81 * 0.299_f64.powi(2);
    assert!((0.5 - y - fallen).abs() < 9.81 * 0.3 * 5.0 * DT, "{y}");
}

/// A cube on the floor, and one that falls on it from half a metre.
fn falling() -> (Vec<Entity>, Vec<(usize, Body)>) {
    let floor = Plane::new(Vector3::y(), 0.0).unwrap();
    let cube = || Cuboid::new([SIZE; 3]).unwrap();
    let entities = vec![
        Entity::new(floor, Isometry3::identity(), 2000.0).unwrap(),
        object(cube(), Vector3::new(0.0, 0.5 * SIZE, 0.0)),
        object(cube(), Vector3::new(0.0, 0.5, 0.0)),
    ];
    let body =
        |entity: &Entity| Body::at_rest(MassProperties::of_shape(&entity.shape, 0.05).unwrap(), &entity.X_WB);
    let bodies = (1..3).map(|at| (at, body(&entities[at]))).collect();
    (entities, bodies)
}

#[test]
fn what_falls_in_the_slow_list_is_seen_falling_and_caught_by_what_is_fast() {
    // How deep it goes where there is one list only.
    let (mut alone, bodies) = falling();
    let mut all = Manipulation::new(&alone, &bodies, Settings::default()).unwrap();
    let mut lowest = f64::INFINITY;
    for _ in 0..1500 {
        all.step(&mut alone, &mut [], DT);
        lowest = lowest.min(alone[2].X_WB.translation.vector.y);
    }
    let (mut entities, bodies) = falling();
    let settings = ListSettings { far_m: 0.2, ..STRICT };
    let mut lists = Lists::new(&entities, &bodies, Settings::default(), settings).unwrap();
    // The lower one is held in the fast list by a finger beside it; the upper one falls on it.
    let finger = Reach { hip_W: Vector3::new(0.06, 0.02, 0.0), velocity_W: Vector3::zeros(), radius_m: 0.0 };
    let mut was_apart = false;
    for tick in 1..1500 {
        let Lists { fast, hand_over, slow } = &mut lists;
        hand_over.begin_tick(fast, &mut entities, [finger].into_iter(), (tick, DT));
        fast.step(&mut entities, &mut [], DT);
        hand_over.end_tick(fast, &entities);
        if tick % 10 == 0 {
            slow.turn(10, DT);
        }
        let standings = [0, 1].map(|body| fast.standing(body));
        was_apart |= standings == [Standing::Awake, Standing::Elsewhere];
        let y = entities[2].X_WB.translation.vector.y;
        if tick == 200 {
            // g t^2 / 2 as of a turn or two ago.
            let fallen = 0.5 * 9.81 * 0.2_f64.powi(2);
            assert!((0.5 - y - fallen).abs() < 9.81 * 0.2 * 0.03, "{y}");
        }
        // The lower one has settled a little longer.
        assert!(y > lowest - 0.5e-3, "tick {tick}: {y}, alone {lowest}");
    }
    assert!(was_apart);
    let [y, alone] = [&entities, &alone].map(|entities| entities[2].X_WB.translation.vector.y);
    assert!((y - alone).abs() < 1e-4, "it lies on the other one: {y}, {alone}");
}

/// So many cubes in a row that touch each other, on a floor.
fn row_of(cubes: usize) -> (Vec<Entity>, Vec<(usize, Body)>) {
    let floor = Plane::new(Vector3::y(), 0.0).unwrap();
    let mut entities = vec![Entity::new(floor, Isometry3::identity(), 2000.0).unwrap()];
    for at in 0..cubes {
        let x = SIZE * at as f64;
        entities.push(object(Cuboid::new([SIZE; 3]).unwrap(), Vector3::new(x, 0.5 * SIZE, 0.0)));
    }
    let body = |at: usize| {
        let entity: &Entity = &entities[at];
        // Into each other, so that there are forces between them.
        let mass = MassProperties::of_shape(&entity.shape, 0.05).unwrap();
        let speed = 0.02 * ((cubes as f64) / 2.0 - at as f64) / cubes as f64;
        Body::at_rest(mass, &entity.X_WB).moving(Vector3::new(speed, 0.0, 0.0), Vector3::zeros())
    };
    let bodies = (1..=cubes).map(|at| (at, body(at))).collect();
    (entities, bodies)
}

#[test]
fn an_island_that_takes_many_ticks_to_come_is_whole_or_stands_still_and_goes_on_to_the_bit() {
    const CUBES: usize = 60;
    let (mut entities, bodies) = row_of(CUBES);
    let settings = ListSettings { near_m: 0.05, far_m: 0.06, ahead_s: 0.01, fast_bodies: 0 };
    let mut lists = Lists::new(&entities, &bodies, Settings::default(), settings).unwrap();
    let mut staying = entities.clone();
    let mut alone = Manipulation::new(&staying, &bodies, Settings::default()).unwrap();
    let finger = Reach { hip_W: Vector3::new(0.0, SIZE, 0.04), velocity_W: Vector3::zeros(), radius_m: 0.0 };
    let (mut stepped, mut alone_ticks, mut on_the_way) = (0_u32, 0_u32, 0_u32);
    for tick in 0..1500 {
        let Lists { fast, hand_over, slow } = &mut lists;
        // Comes and goes.
        let fingers = (tick / 100 % 2 == 0).then_some(finger);
        hand_over.begin_tick(fast, &mut entities, fingers.into_iter(), (tick, DT));
        fast.step(&mut entities, &mut [], DT);
        stepped += u32::from(!fast.awake().is_empty());
        hand_over.end_tick(fast, &entities);
        let before = slow.stepped();
        // A tick now and then, as far as it keeps up.
        slow.turn(u32::from(tick % 3 == 0), DT);
        stepped += (slow.stepped() - before) as u32;
        let sides = [&lists.fast, lists.slow.manipulation()];
        let here = sides.map(|side| side.awake().len());
        assert!([[CUBES, 0], [0, CUBES], [0, 0]].contains(&here), "half an island, tick {tick}: {here:?}");
        on_the_way += u32::from(here == [0, 0]);
        while alone_ticks < stepped {
            alone.step(&mut staying, &mut [], DT);
            alone_ticks += 1;
        }
        if let Some(side) = here.iter().position(|count| *count == CUBES) {
            assert_eq!(sides[side].bodies(), alone.bodies(), "tick {tick}");
        }
    }
    let handed = lists.hand_over.handed();
    assert!(handed.came >= 5 * CUBES as u64 && handed.went >= 5 * CUBES as u64, "{handed:?}");
    // More than 64 parcels go in no tick: each island is on its way for several.
    assert!(handed.parcels[0] > 3 * 64 * handed.came / CUBES as u64, "{handed:?}");
    assert!(on_the_way > 20, "{on_the_way}");
}

#[test]
fn a_claim_that_overtakes_what_is_claimed_is_kept_until_that_has_come() {
    let mut world = World::new(1, STRICT);
    (0..200).for_each(|_| world.step(&[finger_at(0.0, 0.0)], true));
    assert_eq!(world.lists.hand_over.here(), 3);
    // The slow side has just taken in; then the finger is away for a tick, and there again.
    let goes = |world: &World| world.lists.hand_over.handed().went;
    for _ in 0..10_000 {
        if goes(&world) > 0 {
            break;
        }
        world.step(&[], false);
    }
    assert!(goes(&world) > 0, "nobody goes");
    world.step(&[finger_at(0.0, 0.0)], false);
    world.lists.slow.give_away();
    for _ in 0..30 {
        world.step(&[finger_at(0.0, 0.0)], true);
    }
    assert_eq!(world.on_their_way(), 0);
    assert_eq!(
        world.lists.hand_over.here(),
        3,
        "all that it could touch has come: {:?}",
        world.lists.hand_over.handed()
    );
}

#[test]
fn a_turn_that_has_no_time_answers_claims_and_says_what_it_left_undone() {
    let mut world = World::new(100, STRICT);
    let bodies = world.lists.slow.manipulation().bodies().len();
    // A tick a turn, and a tenth of all bodies in it.
    let mut made = 0;
    for tick in 0..400 {
        let Lists { fast, hand_over, slow } = &mut world.lists;
        let finger = (tick >= 200).then(|| finger_at(4.0, 0.0));
        hand_over.begin_tick(fast, &mut world.entities, finger.into_iter(), (tick, DT));
        fast.step(&mut world.entities, &mut [], DT);
        hand_over.end_tick(fast, &world.entities);
        let mut stepped = None;
        let whole = slow.turn_while(10, DT, |last| {
            stepped = last.copied();
            last.is_none().then_some(bodies / 10)
        });
        let step = stepped.expect("a tick");
        assert!(step.awake + step.held <= bodies && step.awake <= bodies / 5, "{step:?}");
        assert!(whole == 0, "{tick}: {whole}");
        made += 1;
    }
    assert_eq!(made, 400);
    // What is asked for within a turn goes before that is over.
    let Lists { fast, hand_over, slow } = &mut world.lists;
    let mut ticks = 0;
    slow.turn_while(10, DT, |_| {
        if ticks == 5 {
            hand_over.begin_tick(fast, &mut world.entities, std::iter::once(finger_at(12.0, 0.0)), (400, DT));
        }
        ticks += 1;
        Some(bodies / 10)
    });
    // The lower cube of the stack at 12 m.
    assert_eq!((ticks, slow.manipulation().standing(3 * 60)), (10, Standing::Elsewhere));
    let waits = world.lists.hand_over.handed().waits;
    assert!(waits.count() > 0 && waits.most_ticks() <= 2, "{waits:?}");
}

#[test]
fn while_time_stands_still_the_slow_list_steps_nothing_and_then_goes_on() {
    let mut world = World::new(1, STRICT);
    let Lists { hand_over, slow, .. } = &mut world.lists;
    let mut steps_of = |order: Option<SlowOrder>| {
        if let Some(order) = order {
            hand_over.order(order).expect("room");
        }
        let before = slow.stepped();
        slow.turn(10, DT);
        slow.stepped() - before
    };
    assert_eq!(steps_of(None), 10, "what was let go has yet to come to rest");
    assert_eq!(steps_of(Some(SlowOrder::Pause(true))), 0);
    assert_eq!(steps_of(None), 0);
    assert_eq!(steps_of(Some(SlowOrder::Pause(false))), 10);
}
