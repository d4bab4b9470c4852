//! Nothing is gained by contacts that are made and lost on purpose: the steps of the proof in `pair/ledger.rs`.
//!
//! Bodies of all shapes among plates that somebody drives at random, from touching to not touching and back in each tick, faster
//! than is fair. What contacts hold and bodies have, less what bodies owe, grows by no more than the plates work, to rounding:
//! what turning under an angular momentum that stands still makes of the kinetic energy is known exactly, and taken out.
//!
//! A thousand cages: `cargo test --release -p physics --test all ledger:: -- --ignored` (a minute).
#![allow(non_snake_case)]

use crate::{common, noise, thrown};

use std::ops::Range;

use common::*;
use haptics::{Cuboid, Entity, Shape, Sphere};
use nalgebra::{Isometry3, Vector3};
use noise::Noise;
use physics::collide::{ContactPoints, PairMemory, Solid, contact_points};
use physics::{Body, Contacts, Manipulation, Row, Settings, Sleep, Surfacing};
use thrown::KINDS;

/// The ways in which the plates of a cage lie.
const WAYS: [[f64; 3]; PLATES] =
    [[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -1.0]];
const PLATES: usize = 6;
const THICK: f64 = 0.04;
const WIDE: f64 = 0.3;

/// What is done to bodies in a cage besides driving its plates.
#[derive(Debug, Clone, Copy, Default)]
struct Schedule {
    /// Plates are also put elsewhere at once.
    puts: bool,
    /// Plates rest for long enough to let bodies sleep.
    sleeps: bool,
}

/// Bodies among plates.
struct Cage {
    world: World,
    noise: Noise,
    schedule: Schedule,
    gravity_m_s2: f64,
    /// No plate goes farther in a tick (m).
    most_way: f64,
    tick: usize,
    /// What plates worked in the last tick, what turning made of kinetic energy, and what was put into contacts (J).
    driven_j: f64,
    turned_j: f64,
    placed_j: f64,
}

fn any_shape(noise: &mut Noise) -> Shape {
    let kind = KINDS[noise.below(KINDS.len())];
    thrown::shape(kind, noise)
}

/// The same inertia about all axes.
fn even_shape(noise: &mut Noise) -> Shape {
    let size = noise.within(0.01, 0.05);
    if noise.chance(0.3) {
        return Sphere::new(0.5 * size).unwrap().into();
    }
    Cuboid::new([size; 3]).unwrap().into()
}

/// 100 to 20,000 N/m, with and without friction and damping.
fn surface(shape: impl Into<Shape>, X_WB: Isometry3<f64>, noise: &mut Noise) -> Entity {
    let mu = if noise.chance(0.3) { 0.0 } else { noise.within(0.0, 2.0) };
    let damping = if noise.chance(0.6) { 0.0 } else { noise.within(0.0, 1.0) };
    object(shape, X_WB, noise.log_within(100.0, 20_000.0), mu).with_damping(damping).unwrap()
}

impl Cage {
    /// One to three bodies of these shapes, 0.1 g to 1 kg.
    fn new(seed: u64, shape: fn(&mut Noise) -> Shape, schedule: Schedule) -> Self {
        let mut noise = Noise::new(seed);
        let n = &mut noise;
        let (mut entities, mut bodies) = (Vec::new(), Vec::new());
        for way in WAYS {
            let edges = way.map(|along| if along == 0.0 { WIDE } else { THICK });
            let pose = Isometry3::from(Vector3::from(way) * 0.08);
            entities.push(surface(Cuboid::new(edges).unwrap(), pose, n));
        }
        for at in 0..1 + n.below(3) {
            let place = Vector3::x() * (0.05 * at as f64) + n.vector(0.002);
            let thing = surface(shape(n), Isometry3::from_parts(place.into(), n.turn()), n);
            let state = body(&thing, n.log_within(1e-4, 1.0)).moving(n.vector(1.0), n.vector(100.0));
            bodies.push((entities.len(), state));
            entities.push(thing);
        }
        let gravity_m_s2 = if schedule.sleeps || n.chance(0.5) { G } else { 0.0 };
        let settings = Settings {
            gravity_W: Vector3::y() * -gravity_m_s2,
            sleep: schedule.sleeps.then(Sleep::default),
            ..Settings::default()
        };
        let world = World::new(entities, &bodies, settings, 0);
        let (most_way, [driven_j, turned_j, placed_j]) = (n.log_within(1e-4, 2e-2), [0.0; 3]);
        Self { world, noise, schedule, gravity_m_s2, most_way, tick: 0, driven_j, turned_j, placed_j }
    }

    fn bodies(&self) -> &[Body] {
        self.world.manipulation.bodies()
    }

    fn of_bodies_j(&self) -> f64 {
        let of =
            |body: &Body| body.kinetic_energy_j() + body.mass.mass_kg * self.gravity_m_s2 * body.centre_W.y;
        self.bodies().iter().map(of).sum()
    }

    /// Kinetic energy, gravity's, and what contacts hold less what bodies owe (J).
    fn energy_j(&self) -> f64 {
        self.of_bodies_j() + self.world.manipulation.elastic_energy_j()
    }

    /// What numbers are subtracted from each other in a tick (J).
    fn scale_j(&self) -> f64 {
        let of = |body: &Body| {
            body.kinetic_energy_j() + body.mass.mass_kg * self.gravity_m_s2 * body.centre_W.y.abs()
        };
        let held_j: f64 = self.world.manipulation.springs().map(|(_, held_j, _)| held_j).sum();
        self.bodies().iter().map(of).sum::<f64>() + held_j + self.driven_j.abs() + self.placed_j
    }

    /// One tick, in which plates go towards where they touch a body, or to where they do not.
    fn step(&mut self) {
        self.tick += 1;
        let before = self.bodies().to_vec();
        let mut ways_W = [Vector3::zeros(); PLATES];
        self.placed_j = 0.0;
        let rests = self.schedule.sleeps && self.tick % 2000 > 500;
        for plate in (0..PLATES).filter(|_| !rests) {
            let way_W = Vector3::from(WAYS[plate]);
            let whom = &before[self.tick / 200 % before.len()];
            let from_W = self.world.entities[plate].X_WB.translation.vector;
            let to = whom.centre_W.dot(&way_W) + self.noise.within(0.005, 0.04) + 0.5 * THICK;
            let along = (to - from_W.dot(&way_W)).clamp(-self.most_way, self.most_way);
            if self.schedule.puts && self.noise.chance(0.02) {
                self.put(plate, from_W + way_W * along);
                continue;
            }
            ways_W[plate] = way_W * along;
            let to_W = Isometry3::from(from_W + ways_W[plate]);
            assert!(self.world.manipulation.drive(plate, to_W));
        }
        self.world.step(&[]);
        let driven_j = |(pair, _, rows): ([usize; 2], f64, &[Row])| -> f64 {
            let way_W = pair.iter().find_map(|&entity| ways_W.get(entity)).copied().unwrap_or_default();
            rows.iter().map(|row| row.force_W.dot(&way_W)).sum()
        };
        self.driven_j = self.world.manipulation.springs().map(driven_j).sum();
        let turned_j = |(before, after): (&Body, &Body)| {
            let unturned = Body { orientation: before.orientation, ..*after };
            after.kinetic_energy_j() - unturned.kinetic_energy_j()
        };
        self.turned_j = before.iter().zip(self.bodies()).map(turned_j).sum();
    }

    /// Puts a plate somewhere; what it overlaps there it presses with.
    fn put(&mut self, plate: usize, to_W: Vector3<f64>) {
        let was_j = self.world.manipulation.elastic_energy_j();
        let World { entities, manipulation, .. } = &mut self.world;
        // It is there, and has not come from anywhere.
        (0..2).for_each(|_| entities[plate].move_to(to_W.into()));
        manipulation.was_moved(plate, entities);
        let lost_j = was_j - manipulation.elastic_energy_j();
        assert!(lost_j >= -ROUNDING * was_j.abs(), "{lost_j}");
        self.placed_j +=
            (PLATES..self.world.entities.len()).map(|body| self.overlap_j(body, plate)).sum::<f64>();
    }

    /// What springs between two hold at their full length (J).
    fn overlap_j(&self, body: usize, plate: usize) -> f64 {
        let entities = &self.world.entities;
        let [a, b] = [body, plate].map(|at| Solid { shape: &entities[at].shape, X_W: &entities[at].X_WB });
        let mut found = ContactPoints::default();
        contact_points(a, b, 1e-3, &mut PairMemory::default(), &mut found);
        let k = Surfacing::between(&entities[body], &entities[plate], &Contacts::default()).stiffness_n_per_m;
        0.5 * k * found.as_slice().iter().map(|p| p.share * p.depth_m().powi(2)).sum::<f64>()
    }
}

/// Some hundred roundings of all that is added up in a tick.
const ROUNDING: f64 = 1e-12;

/// What the springs held that pressed in the last tick, when it began (J).
fn pressing_j(rows: &[Row]) -> f64 {
    let of = |row: &Row| {
        let rest_n = row.normal_W.dot(&row.rest_W);
        let across_n = (row.rest_W - row.normal_W * rest_n).norm();
        0.5 * (rest_n.max(0.0).powi(2) / row.stiffness[0] + across_n.powi(2) / row.stiffness[1])
    };
    rows.iter().map(of).sum()
}

/// What a cage went through.
#[derive(Debug, Default)]
struct Seen {
    /// Contacts that ended.
    ended: usize,
    /// The most that bodies owed, as a share of all that there was.
    owed: f64,
    asleep: usize,
    placed: usize,
}

/// Plays for so many ticks, and panics in the first in which anything is gained.
fn play(seed: u64, shape: fn(&mut Noise) -> Shape, schedule: Schedule, ticks: usize, seen: &mut Seen) {
    let mut cage = Cage::new(seed, shape, schedule);
    // In the first tick accounts begin with what overlaps.
    cage.step();
    let mut pressed = Vec::new();
    for tick in 1..ticks {
        let was_j = cage.energy_j();
        let held: Vec<_> =
            cage.world.manipulation.springs().map(|(pair, held_j, _)| (pair, held_j)).collect();
        cage.step();
        let slack_j = ROUNDING * (cage.scale_j() + was_j.abs());
        let grown_j = cage.energy_j() - was_j - cage.driven_j - cage.turned_j - cage.placed_j;
        assert!(grown_j <= slack_j, "{seed}, tick {tick}: {grown_j} J of {was_j} J, {schedule:?}");
        let is_pressed = |rows: &[Row]| rows.iter().any(|row| row.force_W != Vector3::zeros());
        for (pair, held_j, rows) in cage.world.manipulation.springs() {
            assert!(held_j >= 0.0, "{seed}, tick {tick}, {pair:?}: {held_j} J are held");
            let known_j = held.iter().find(|(known, _)| *known == pair).map_or(0.0, |known| known.1);
            let of_springs_j = pressing_j(rows);
            assert!(
                of_springs_j <= known_j + cage.placed_j + slack_j,
                "{seed}, tick {tick}, {pair:?}: {of_springs_j} J press of {known_j} J"
            );
        }
        let now: Vec<_> =
            cage.world.manipulation.springs().filter(|pair| is_pressed(pair.2)).map(|pair| pair.0).collect();
        seen.ended += pressed.iter().filter(|pair| !now.contains(pair)).count();
        pressed = now;
        seen.owed = seen.owed.max(cage.world.manipulation.owed_j() / cage.scale_j());
        seen.asleep += usize::from(cage.world.made.awake == 0);
        seen.placed += usize::from(cage.placed_j > 0.0);
    }
}

#[test]
fn nothing_is_gained_by_contacts_that_are_made_and_lost_in_every_tick() {
    let mut seen = Seen::default();
    (0..40).for_each(|seed| play(seed, any_shape, Schedule::default(), 800, &mut seen));
    assert!(seen.ended > 5000 && seen.owed > 1e-5, "{seen:?}");
}

#[test]
fn who_turns_evenly_owes_nothing_and_gains_nothing_but_what_is_put_into_it() {
    let mut seen = Seen::default();
    (0..20).for_each(|seed| play(seed, even_shape, Schedule { puts: true, sleeps: false }, 800, &mut seen));
    assert!(seen.placed > 300 && seen.owed < ROUNDING, "{seen:?}");
}

#[test]
fn nothing_is_gained_by_falling_asleep_and_being_woken() {
    let mut seen = Seen::default();
    (0..5).for_each(|seed| play(seed, any_shape, Schedule { puts: false, sleeps: true }, 6000, &mut seen));
    assert!(seen.asleep > 300, "{seen:?}");
}

#[test]
#[ignore = "a minute; see the top of the file"]
fn nothing_is_gained_in_a_thousand_cages() {
    let mut seen = Seen::default();
    (40..1000).for_each(|seed| play(seed, any_shape, Schedule::default(), 800, &mut seen));
    (5..50).for_each(|seed| play(seed, any_shape, Schedule { puts: false, sleeps: true }, 6000, &mut seen));
    assert!(seen.ended > 100_000 && seen.owed > 1e-4 && seen.asleep > 3000, "{seen:?}");
    let mut seen = Seen::default();
    (20..300).for_each(|seed| play(seed, even_shape, Schedule { puts: true, sleeps: false }, 800, &mut seen));
    assert!(seen.placed > 5000 && seen.owed < ROUNDING, "{seen:?}");
    owe_no_more_than_turning_gives(20..300);
    change_hands(14..150);
}

/// `d J d / 2`, where d is by how much a body that nothing touches turns faster in a tick than when it begins (J).
fn given_by_turning_j(body: &Body, shape: &Shape) -> f64 {
    let alone = Entity::new(shape.clone(), body.pose(), 1.0).unwrap();
    let settings = Settings { gravity_W: Vector3::zeros(), ..Settings::default() };
    let mut world = World::new(vec![alone], &[(0, *body)], settings, 0);
    world.step(&[]);
    let mean_W = (world.body().orientation * body.orientation.inverse()).scaled_axis() / DT;
    let faster_W = mean_W - body.angular_velocity_W();
    0.5 * faster_W.dot(&(body.inertia_W() * faster_W))
}

fn owe_no_more_than_turning_gives(seeds: Range<u64>) {
    let mut worst = 0.0_f64;
    for seed in seeds {
        let mut cage = Cage::new(seed, any_shape, Schedule::default());
        for tick in 0..400 {
            let was_j = cage.world.manipulation.owed_j();
            let things = cage.world.entities[PLATES..].iter();
            let most_j: f64 = cage
                .bodies()
                .iter()
                .zip(things)
                .map(|(body, thing)| given_by_turning_j(body, &thing.shape))
                .sum();
            cage.step();
            let more_j = cage.world.manipulation.owed_j() - was_j;
            assert!(
                more_j <= most_j + ROUNDING * cage.scale_j(),
                "{seed}, tick {tick}: {more_j} J more are owed, not {most_j}"
            );
            worst = worst.max(more_j / most_j.max(ROUNDING * cage.scale_j()));
        }
    }
    // The bound is met when a contact turns the body back by half of what it turns by itself.
    assert!(worst > 0.5, "{worst}");
}

#[test]
fn a_tick_gives_a_body_no_more_than_its_turning_does_and_that_is_owed() {
    owe_no_more_than_turning_gives(0..20);
}

/// A ball of a gram before a wall is hit by one of a kilogram, so hard that it comes to the wall within the tick.
#[test]
fn what_is_hit_so_hard_that_it_comes_to_a_wall_within_the_tick_gains_nothing() {
    let mut deepest = 0.0_f64;
    for gap in [2e-3, 4e-3, 8e-3, 12e-3, 16e-3] {
        for is_endless in [false, true] {
            let smooth = |shape: Shape, x: f64| {
                let entity = object(shape, Isometry3::translation(x, 0.0, 0.0), 5000.0, 0.0);
                entity.with_damping(0.0).unwrap()
            };
            let wall: Shape = match is_endless {
                true => haptics::Plane::new(Vector3::x(), 0.1).unwrap().into(),
                false => Cuboid::new([0.2; 3]).unwrap().into(),
            };
            let radius = 0.005;
            let ball = || -> Shape { Sphere::new(radius).unwrap().into() };
            let entities = vec![
                smooth(wall, 0.0),
                smooth(ball(), 0.1 + gap + radius),
                smooth(ball(), 0.101 + gap + 3.0 * radius),
            ];
            let light = body(&entities[1], 1e-3);
            let heavy = body(&entities[2], 1.0).moving(Vector3::x() * -20.0, Vector3::zeros());
            let settings = Settings { gravity_W: Vector3::zeros(), ..Settings::default() };
            let mut world = World::new(entities, &[(1, light), (2, heavy)], settings, 0);
            let mut was_j = heavy.kinetic_energy_j();
            for tick in 0..40 {
                world.step(&[]);
                let kinetic_j: f64 = world.manipulation.bodies().iter().map(Body::kinetic_energy_j).sum();
                let now_j = kinetic_j + world.manipulation.elastic_energy_j();
                assert!(
                    now_j <= was_j * (1.0 + ROUNDING),
                    "{gap}, {is_endless}, {tick}: {now_j} J of {was_j}"
                );
                was_j = now_j;
                let of_wall = world.manipulation.springs().find(|(pair, ..)| *pair == [1, 0]);
                if of_wall.is_none_or(|(_, _, rows)| rows.is_empty()) {
                    deepest = deepest.max(0.1 + radius - world.manipulation.bodies()[0].centre_W.x);
                }
            }
        }
    }
    // Nobody who is in the wall has not been looked at.
    assert_eq!(deepest, 0.0);
}

/// Sends all bodies from one that steps them to another one.
fn send(from: &mut Manipulation, entities: &[Entity], to: &mut Manipulation, there: &mut [Entity]) {
    // Plates are where they are.
    for (plate, entity) in entities.iter().enumerate().take(PLATES) {
        (there[plate].X_WB, there[plate].previous_X_WB) = (entity.X_WB, entity.previous_X_WB);
        to.was_moved(plate, there);
    }
    let mut island = Vec::with_capacity(8);
    for body in 0..from.bodies().len() {
        if from.standing(body).is_away() {
            continue;
        }
        assert!(from.island(body, &mut island));
        from.release(&island, entities);
        while let Some(parcel) = from.next_parcel(entities) {
            to.accept(&parcel, there, |_| ());
        }
    }
}

fn change_hands(seeds: Range<u64>) {
    let mut owed_j = 0.0_f64;
    for seed in seeds {
        let [mut stays, mut goes] = [0; 2].map(|_| Cage::new(seed, any_shape, Schedule::default()));
        // Boxes are 5 mm larger than they need be: nobody is found later for having come.
        let most_way = stays.most_way.min(2e-3);
        (stays.most_way, goes.most_way) = (most_way, most_way);
        let mut there = goes.world.entities.clone();
        let mut other = Cage::new(seed, any_shape, Schedule::default()).world.manipulation;
        (0..goes.bodies().len()).for_each(|body| other.give_away(body, &there));
        for tick in 0..400 {
            [&mut stays, &mut goes].into_iter().for_each(Cage::step);
            assert_eq!(stays.bodies(), goes.bodies(), "{seed}, tick {tick}");
            let [one_j, other_j] = [&stays, &goes].map(|cage| cage.world.manipulation.owed_j());
            assert_eq!(one_j, other_j, "{seed}, tick {tick}");
            owed_j = owed_j.max(one_j);
            send(&mut goes.world.manipulation, &goes.world.entities, &mut other, &mut there);
            assert_eq!(goes.world.manipulation.owed_j(), 0.0);
            std::mem::swap(&mut goes.world.manipulation, &mut other);
            std::mem::swap(&mut goes.world.entities, &mut there);
        }
    }
    assert!(owed_j > 0.0);
}

#[test]
fn what_is_held_and_owed_goes_along_when_bodies_change_hands_in_every_tick() {
    change_hands(0..14);
}
