//! More entities beside a finger than it has slots for: what it reaches is felt as if it were alone, and what it cannot feel
//! is told.

use nalgebra::Vector3;
use std::fmt::Write as _;
use system_tests::recording::Table;
use system_tests::workplace::{Workplace, hand};

type V = Vector3<f64>;

/// A thing of a crowd: its shape, and where it is (m).
struct Thing {
    shape: String,
    place: V,
}

/// A finger's way from place to place, half a second each.
fn way(places: &[[f64; 3]]) -> String {
    hand(places.iter().enumerate().map(|(at, place)| (0.5 * at as f64, *place)))
}

/// The crowd on a plate whose surface is at y = 0, with the plate as the last entity.
fn scene<'t>(radius_m: f64, things: impl Iterator<Item = (usize, &'t Thing)>) -> String {
    let mut text = format!("[[finger]]\nstart_m = [0.0, 0.05, 0.0]\nradius_m = {radius_m:?}\n");
    for (at, Thing { shape, place }) in things {
        let [x, y, z]: [f64; 3] = (*place).into();
        let _ = write!(
            text,
            "[[entity]]\nname = \"thing{at}\"\nshape = {{ {shape} }}\nposition_m = [{x:?}, {y:?}, {z:?}]\n\
             stiffness_n_per_m = 1000.0\n"
        );
    }
    text + "[[entity]]\nname = \"plate\"\nshape = { kind = \"plane\", normal = [0.0, 1.0, 0.0], offset_m = 0.0 }\n\
            stiffness_n_per_m = 1000.0\n"
}

/// Rows in a crowd are those with what is within reach of the way alone; these.
fn felt_as_if_alone(things: &[Thing], radius_m: f64, places: &[[f64; 3]], reach_m: f64) -> Table {
    let hand = way(places);
    let is_reached = |thing: &Thing| {
        let mut legs = places.windows(2).map(|leg| distance_m(&thing.place, leg));
        legs.any(|distance_m| distance_m < reach_m)
    };
    let reached: Vec<_> = things.iter().enumerate().filter(|(_, thing)| is_reached(thing)).collect();
    assert!((1..100).contains(&reached.len()), "{} things are within reach", reached.len());
    let [all, few] =
        [scene(radius_m, things.iter().enumerate()), scene(radius_m, reached.into_iter())].map(|scene| {
            let table = Workplace::new().play(&scene, &hand, &[]);
            (table.vectors("f0_force"), table.vectors("f0_god"), table)
        });
    assert!(all.0 == few.0 && all.1 == few.1);
    assert_eq!(all.2.texts("f0_entity"), few.2.texts("f0_entity"));
    all.2
}

/// From a place to a leg of the way.
fn distance_m(place: &V, leg: &[[f64; 3]]) -> f64 {
    let [from, to] = [leg[0], leg[1]].map(V::from);
    let along = to - from;
    let share = ((place - from).dot(&along) / along.norm_squared()).clamp(0.0, 1.0);
    (place - from - along * share).norm()
}

fn grid(side: usize, step_m: f64, y_m: f64, shape: &str) -> Vec<Thing> {
    let at = |index: usize| (index as f64 - 0.5 * (side - 1) as f64) * step_m;
    let place = |index: usize| V::new(at(index % side), y_m, at(index / side));
    (0..side * side).map(|index| Thing { shape: shape.into(), place: place(index) }).collect()
}

fn largest(table: &Table) -> f64 {
    table.vectors("f0_force").iter().map(V::norm).fold(0.0, f64::max)
}

fn names(table: &Table) -> Vec<String> {
    let mut names: Vec<String> = table.texts("f0_entity").iter().map(|name| (*name).to_owned()).collect();
    names.sort_unstable();
    names.dedup();
    names
}

#[test]
fn a_finger_between_many_dots_feels_dots_and_the_plate_below_them() {
    let dots = grid(21, 2.5e-3, 0.0, "kind = \"sphere\", radius_m = 0.0005");
    // Between dots, 0.4 mm into the plate; then across them.
    let places = [[1.25e-3, 0.01, 1.25e-3], [1.25e-3, -4e-4, 1.25e-3], [1.25e-3, -4e-4, 1.25e-3]];
    let table = felt_as_if_alone(&dots, 0.0, &places, 3e-3);
    let last = *table.vectors("f0_force").last().expect("rows");
    assert!((last - V::new(0.0, 0.4, 0.0)).norm() < 1e-6, "{last:?}");

    let across = [[-0.02, 0.01, 1e-4], [-0.02, 2e-4, 1e-4], [0.02, 2e-4, 1e-4], [0.02, -2e-4, 1e-4]];
    let table = felt_as_if_alone(&dots, 0.0, &across, 3e-3);
    assert!(names(&table).len() > 14, "{:?}", names(&table));
}

#[test]
fn a_bed_of_nine_hundred_balls_is_felt_ball_by_ball() {
    let balls = grid(30, 0.01, 5e-3, "kind = \"sphere\", radius_m = 0.005");
    for radius_m in [0.0, 4e-3] {
        let y_m = 9.5e-3 + radius_m;
        let across = [[0.0, 0.03, 0.001], [0.0, y_m, 0.001], [0.08, y_m, 0.011], [0.08, 0.03, 0.011]];
        let table = felt_as_if_alone(&balls, radius_m, &across, 0.016 + radius_m);
        assert!(names(&table).len() > 4 && largest(&table) > 0.2, "{:?} {}", names(&table), largest(&table));
    }
}

#[test]
fn a_floor_of_tiles_is_felt_tile_by_tile() {
    let tiles = grid(40, 4e-3, 1e-3, "kind = \"box\", size_m = [0.004, 0.002, 0.004]");
    for radius_m in [0.0, 4e-3] {
        let y_m = 1.6e-3 + radius_m;
        let across = [[0.0, 0.03, 0.001], [0.0, y_m, 0.001], [0.06, y_m, 0.014], [0.06, 0.03, 0.014]];
        let table = felt_as_if_alone(&tiles, radius_m, &across, 0.006 + radius_m);
        assert!(names(&table).len() > 8, "{:?}", names(&table));
        assert!(largest(&table) > 0.39, "{}", largest(&table));
    }
}

/// The finger is held by the plate while it is out of its box, and when it comes back.
#[test]
fn a_thing_that_a_finger_is_pushed_through_is_no_crowd() {
    let place = Workplace::new();
    let plate = "[[finger]]\n[[entity]]\nshape = { kind = \"box\", size_m = [0.1, 0.01, 0.1] }\n";
    place.write("scene.toml", plate);
    place.write(
        "hand.csv",
        hand([0.05, -0.05, 0.05].into_iter().enumerate().map(|(k, y)| (k as f64, [0.0, y, 0.0]))),
    );
    let said = place.run(["run", "scene.toml", "--hand", "hand.csv", "--clock", "virtual", "--headless"]);
    assert_eq!(said.status, Some(0), "{}", said.err);
    assert!(said.out.contains(" 1 contact") && !said.out.contains("crowded"), "{}", said.out);
}

/// All at one place: nobody can look at them all within a tick. The finger comes into all of their boxes, and touches none.
#[test]
fn a_crowd_that_is_too_large_is_told_and_what_has_no_end_is_felt_in_it() {
    let place = Workplace::new();
    let shells: Vec<Thing> = (0..1500)
        .map(|at| Thing {
            shape: format!("kind = \"sphere\", radius_m = {:?}", 0.01 + 1e-6 * f64::from(at)),
            place: V::new(0.0, 0.0, 0.0),
        })
        .collect();
    place.write("scene.toml", scene(0.0, shells.iter().enumerate()));
    place.write(
        "hand.csv",
        way(&[[0.0, 0.05, 0.0], [9.5e-3, 9.5e-3, 0.0], [0.1, 0.05, 0.0], [0.1, -1e-3, 0.0]]),
    );
    let run = ["run", "scene.toml", "--hand", "hand.csv", "--clock", "virtual", "--headless"];
    let said = place.run(run.iter().chain(&["--record", "rows.csv", "--events", "events.csv"]));
    assert_eq!(said.status, Some(0), "{}", said.err);
    let crowded = said.out.lines().find_map(|line| line.strip_prefix("crowded      "));
    let ticks = crowded.and_then(|line| line.split(' ').next()?.parse::<u64>().ok());
    assert!(ticks.is_some_and(|ticks| ticks > 0), "{}", said.out);
    let events = Table::read(&place.path("events.csv"));
    let crowds: Vec<_> = events.texts("kind").into_iter().filter(|kind| *kind == "crowded").collect();
    assert!((1..4).contains(&crowds.len()), "{}", crowds.len());
    let rows = Table::read(&place.path("rows.csv"));
    let last = *rows.vectors("f0_force").last().expect("rows");
    let depth_m = -rows.vectors("f0_hip").last().expect("rows").y;
    assert!(depth_m > 0.5e-3 && (last - V::new(0.0, 1000.0 * depth_m, 0.0)).norm() < 1e-6, "{last:?}");
}
