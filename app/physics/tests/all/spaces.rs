//! Bodies behind doors: what is in another space is not there.
#![allow(non_snake_case)]

use crate::common;

use common::*;
use haptics::Cuboid;
use nalgebra::Isometry3;
use physics::Settings;

/// Two cubes at the same place, each in a space of its own, over a floor that is in the world's: heights after two seconds.
#[test]
fn bodies_rest_on_what_is_in_their_space_and_pass_through_all_else() {
    let cube = |y, space| {
        object(Cuboid::new([0.02; 3]).unwrap(), Isometry3::translation(0.0, y, 0.0), 5000.0, 0.5)
            .within(space)
    };
    let mut entities = vec![floor(0.0, 5000.0, 0.5), cube(0.05, 0), cube(0.05, 1), cube(0.1, 1)];
    // A shelf for the other space, 5 cm below the world's floor.
    entities.push(
        object(Cuboid::new([0.2, 0.02, 0.2]).unwrap(), Isometry3::translation(0.0, -0.06, 0.0), 5000.0, 0.5)
            .within(1),
    );
    let bodies: Vec<_> = (1..4).map(|index| (index, body(&entities[index], 0.05))).collect();
    let mut world = World::new(entities, &bodies, Settings::default(), 0);
    for _ in 0..2000 {
        world.step(&[]);
    }
    let heights: Vec<f64> = world.entities[1..4].iter().map(|entity| entity.X_WB.translation.y).collect();
    // On springs of 5000 N/m a corner, sunk by 0.1 mm at most.
    for (height, wanted) in heights.iter().zip([0.01, -0.04, -0.02]) {
        assert!((height - wanted).abs() < 1.5e-4, "{heights:?}");
    }
}
