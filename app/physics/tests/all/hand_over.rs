//! Islands that go from one to another that steps them: nothing is lost, and nobody can tell.

use crate::{common, meshes};

use common::{DT, body, floor, object};
use haptics::{Cuboid, Entity};
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use physics::{Body, Manipulation, Settings, Sleep, Standing};

const SIZE: f64 = 0.05;

/// A stack on a slope of so much (rad), and a cube that falls beside it.
fn entities(slope: f64) -> Vec<Entity> {
    let mut entities = vec![floor(slope, 2000.0, 0.5)];
    let lean = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), slope);
    for at in 0..3 {
        let place = lean * Vector3::new(0.0, SIZE * (f64::from(at) + 0.5) - 1e-4, 0.0);
        let pose = Isometry3::from_parts(place.into(), lean);
        entities.push(object(Cuboid::new([SIZE; 3]).unwrap(), pose, 1000.0, 0.5));
    }
    let falls = Isometry3::new(Vector3::new(-0.2, 0.3, 0.0), Vector3::new(0.3, 0.2, 0.1));
    entities.push(object(Cuboid::new([SIZE; 3]).unwrap(), falls, 1000.0, 0.5));
    entities
}

fn manipulation(entities: &[Entity], sleep: bool) -> Manipulation {
    let bodies: Vec<(usize, Body)> = (1..entities.len()).map(|at| (at, body(&entities[at], 0.1))).collect();
    let settings = Settings { sleep: sleep.then(Sleep::default), ..Settings::default() };
    Manipulation::new(entities, &bodies, settings).unwrap()
}

struct Side {
    entities: Vec<Entity>,
    manipulation: Manipulation,
}

/// Sends the island of a body from one side to the other one.
fn send(from: &mut Side, to: &mut Side, body: usize) {
    send_with_pauses(from, to, body, |_, _| ());
}

/// With something to do before each parcel.
fn send_with_pauses(
    from: &mut Side,
    to: &mut Side,
    body: usize,
    mut pause: impl FnMut(&mut Side, &mut Side),
) {
    let mut island = Vec::with_capacity(64);
    assert!(from.manipulation.island(body, &mut island));
    from.manipulation.release(&island, &from.entities);
    let mut arrived = Vec::new();
    let mut parcels = 0;
    while from.manipulation.is_releasing() {
        parcels += 1;
        assert!(parcels < 10_000, "it never ends");
        pause(from, to);
        assert!(arrived.is_empty());
        for &body in &island {
            assert_eq!(from.manipulation.standing(body), Standing::Elsewhere);
            assert!(to.manipulation.standing(body).is_away(), "nobody steps half an island");
        }
        let parcel = from.manipulation.next_parcel(&from.entities).unwrap();
        to.manipulation.accept(&parcel, &mut to.entities, |body| arrived.push(body));
    }
    assert!(from.manipulation.next_parcel(&from.entities).is_none());
    assert_eq!(arrived, island);
    for body in island {
        assert_eq!(from.manipulation.standing(body), Standing::Elsewhere);
        assert!(!to.manipulation.standing(body).is_away());
    }
}

/// As [`entities`], all of them meshes of many faces: their pairs remember places, too.
fn mesh_entities(slope: f64) -> Vec<Entity> {
    let mut entities = entities(slope);
    let block = meshes::build(meshes::block(4, SIZE, SIZE, |_, _| 0.0));
    for entity in &mut entities[1..] {
        // A block's frame is in the middle of its top.
        let pose = entity.X_WB * Isometry3::translation(0.0, 0.5 * SIZE, 0.0);
        *entity = object(block.clone(), pose, 1000.0, 0.5);
    }
    entities
}

/// Two sides, the first of which has all.
fn sides(entities: &[Entity]) -> [Side; 2] {
    [true, false].map(|has_all| {
        let entities = entities.to_vec();
        let mut manipulation = manipulation(&entities, false).without_those_elsewhere();
        if !has_all {
            (0..4).for_each(|body| manipulation.give_away(body, &entities));
        }
        Side { entities, manipulation }
    })
}

fn come_and_go_at_random(mut stays: Vec<Entity>, ticks: u32) -> Vec<Body> {
    let mut sides = sides(&stays);
    let mut staying = manipulation(&stays, false);
    let mut seed = 7_u64;
    for tick in 0..ticks {
        staying.step(&mut stays, &mut [], DT);
        for side in &mut sides {
            side.manipulation.step(&mut side.entities, &mut [], DT);
        }
        for body in 0..4 {
            let here = sides
                .iter()
                .position(|side| side.manipulation.standing(body) != Standing::Elsewhere)
                .unwrap();
            assert_eq!(
                sides[1 - here].manipulation.standing(body),
                Standing::Elsewhere,
                "in one list, tick {tick}"
            );
            assert_eq!(
                sides[here].manipulation.bodies()[body],
                staying.bodies()[body],
                "body {body}, tick {tick}"
            );
        }
        seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        let body = (seed >> 33) as usize % 4;
        let [one, other] = &mut sides;
        match one.manipulation.standing(body) {
            Standing::Elsewhere => send(other, one, body),
            _ => send(one, other, body),
        }
    }
    staying.bodies().to_vec()
}

#[test]
fn islands_that_come_and_go_move_like_those_that_stay_to_the_bit() {
    let bodies = come_and_go_at_random(entities(0.2), 6000);
    // It fell and slid; and the stack, whose springs let it lean, has toppled.
    assert!(bodies[2].centre_W.y < 0.1);
    assert!(bodies[3].centre_W.y < 0.2);
}

#[test]
fn meshes_that_come_and_go_move_like_those_that_stay_to_the_bit() {
    let bodies = come_and_go_at_random(mesh_entities(0.1), 1500);
    assert!(bodies[3].centre_W.y < 0.2, "it fell and slid");
}

#[test]
fn an_island_that_comes_parcel_by_parcel_stands_still_meanwhile_and_goes_on_to_the_bit() {
    let begin = mesh_entities(0.2);
    let [mut one, mut other] = sides(&begin);
    let mut stays = begin.clone();
    let mut staying = manipulation(&stays, false);
    let mut seen_on_the_way = 0;
    for round in 0..40 {
        // The fourth falls apart from them, all the time.
        for _ in 0..1 + round % 3 {
            staying.step(&mut stays, &mut [], DT);
            for side in [&mut one, &mut other] {
                side.manipulation.step(&mut side.entities, &mut [], DT);
            }
        }
        let (from, to) = if round % 2 == 0 { (&mut one, &mut other) } else { (&mut other, &mut one) };
        let before = from.manipulation.bodies()[..3].to_vec();
        send_with_pauses(from, to, 0, |from, to| {
            for side in [from, to] {
                side.manipulation.step(&mut side.entities, &mut [], DT);
                assert!(side.manipulation.awake().iter().all(|body| *body == 3));
                seen_on_the_way += 1;
            }
        });
        assert_eq!(to.manipulation.bodies()[..3], before);
        assert_eq!(to.manipulation.bodies()[..3], staying.bodies()[..3], "round {round}");
    }
    // A block that stands on a block has dozens of points.
    assert!(seen_on_the_way > 40 * 20, "{seen_on_the_way}");
}

#[test]
fn an_island_that_sleeps_goes_on_sleeping_and_wakes_as_one() {
    let new = |has_all: bool| {
        let entities = entities(0.05);
        let mut manipulation = manipulation(&entities, true);
        if !has_all {
            (0..4).for_each(|body| manipulation.give_away(body, &entities));
        }
        Side { entities, manipulation }
    };
    let [mut one, mut other] = [new(true), new(false)];
    for _ in 0..20_000 {
        one.manipulation.step(&mut one.entities, &mut [], DT);
    }
    assert!(one.manipulation.awake().is_empty(), "{:?}", one.manipulation.awake());
    let mut island = Vec::with_capacity(8);
    one.manipulation.island(1, &mut island);
    assert_eq!(island, [0, 1, 2]);
    send(&mut one, &mut other, 1);
    let asleep = [0, 1, 2].map(|body| other.manipulation.standing(body));
    assert_eq!(asleep, [Standing::Asleep; 3]);
    let before: Vec<_> = other.entities.iter().map(|entity| entity.X_WB).collect();
    other.manipulation.wake(2, &other.entities);
    assert_eq!(other.manipulation.awake(), [0, 1, 2]);
    for _ in 0..1000 {
        other.manipulation.step(&mut other.entities, &mut [], DT);
    }
    for (entity, before) in other.entities.iter().zip(before).take(4) {
        // It went half a micrometre at most in its last half second, and goes on ever slower.
        let moved = (entity.X_WB.translation.vector - before.translation.vector).norm();
        assert!(moved < 5e-7, "{moved:e}");
    }
}

#[test]
fn one_that_is_elsewhere_is_leaned_on_where_it_was_last_said_to_be() {
    let entities = vec![
        object(Cuboid::new([SIZE; 3]).unwrap(), Isometry3::identity(), 1000.0, 0.5),
        object(Cuboid::new([SIZE; 3]).unwrap(), Isometry3::translation(0.0, SIZE, 0.0), 1000.0, 0.5),
    ];
    for upper in [0, 1] {
        let mut entities = entities.clone();
        entities.swap(0, 1 - upper);
        let bodies: Vec<_> = (0..2).map(|at| (at, body(&entities[at], 0.1))).collect();
        let mut manipulation = Manipulation::new(&entities, &bodies, Settings::default()).unwrap();
        let lower = 1 - upper;
        manipulation.give_away(lower, &entities);
        for _ in 0..3000 {
            manipulation.step(&mut entities, &mut [], DT);
        }
        // m g / (4 k / 2) below where it stood: springs in series, on four corners.
        let rests = SIZE - 0.1 * 9.81 / (4.0 * 500.0);
        assert!((manipulation.bodies()[upper].centre_W.y - rests).abs() < 1e-9, "{upper}");
        let mut lowered = manipulation.bodies()[lower];
        lowered.centre_W.y = -0.1;
        manipulation.stands_elsewhere(lower, &lowered, &mut entities, DT);
        manipulation.step(&mut entities, &mut [], DT);
        manipulation.step(&mut entities, &mut [], DT);
        assert!(manipulation.bodies()[upper].velocity_W.y < -0.009, "falls");
    }
}

#[test]
fn boxes_side_by_side_on_a_shelf_are_islands_of_their_own_until_they_touch() {
    for (apart, is_one) in [(0.01, false), (0.0, true)] {
        let mut entities = vec![floor(0.0, 2000.0, 0.5)];
        for at in 0..4 {
            let pose = Isometry3::translation((SIZE + apart) * f64::from(at), 0.5 * SIZE, 0.0);
            entities.push(object(Cuboid::new([SIZE; 3]).unwrap(), pose, 1000.0, 0.5));
        }
        let mut manipulation = manipulation(&entities, true);
        let mut island = Vec::with_capacity(8);
        // Before the first tick, in which pairs are looked at, as well as after it.
        for _ in 0..2 {
            assert!(manipulation.island(1, &mut island));
            assert_eq!(island, if is_one { vec![0, 1, 2, 3] } else { vec![1] }, "{apart}");
            manipulation.step(&mut entities, &mut [], DT);
        }
    }
}

#[test]
fn an_island_that_comes_where_all_that_may_be_is_stepped_waits_and_is_told_to_have_changed() {
    let mut entities = vec![floor(0.0, 2000.0, 0.5)];
    for at in 0..3 {
        let pose = Isometry3::translation(SIZE * f64::from(at), 0.5 * SIZE, 0.0);
        entities.push(object(Cuboid::new([SIZE; 3]).unwrap(), pose, 1000.0, 0.5));
    }
    let side = || Side { entities: entities.clone(), manipulation: manipulation(&entities, true) };
    let [mut one, mut other] = [side(), side()];
    (0..3).for_each(|body| other.manipulation.give_away(body, &other.entities));
    other.manipulation.step_at_most(1, std::iter::empty());
    other.manipulation.step(&mut other.entities, &mut [], DT);
    other.manipulation.forget_changes();
    send(&mut one, &mut other, 1);
    let standings = [0, 1, 2].map(|body| other.manipulation.standing(body));
    assert_eq!(standings, [Standing::Held; 3]);
    let mut changed = other.manipulation.changed().to_vec();
    changed.sort_unstable();
    assert_eq!(changed, [0, 1, 2]);
}
