//! What is behind doors: facts about pixels. Where there is no graphics library they say so and pass.

use crate::common;

use common::{SIZE, colour, studio};
use haptics::{Cuboid, Entity};
use nalgebra::Vector3;
use std::path::Path;
use view::{Eyes, FingerMoment, Moment, Stage};
use world::Scene;

/// A hull with a door to a room in which a console stands, larger than the hull.
const SCENE: &str = r#"
name = "box"
[[finger]]
start_m = [0.0, 0.06, 0.2]
[[entity]]
name = "hull"
shape = { kind = "box", size_m = [0.1, 0.12, 0.1] }
position_m = [0.0, 0.06, 0.0]
visual = { colour = [0.1, 0.1, 0.8] }
[[environment]]
name = "inside"
kind = "room"
size_m = [0.4, 0.3, 0.4]
position_m = [0.0, 0.15, -0.15]
door = { of = "hull", position_m = [0.0, 0.0, 0.05], size_m = [0.05, 0.1] }
[[entity]]
name = "console"
within = "inside"
shape = { kind = "box", size_m = [0.2, 0.04, 0.1] }
position_m = [0.0, 0.02, -0.05]
visual = { colour = [0.8, 0.1, 0.1] }
[[camera]]
position_m = [0.0, 0.1, 0.6]
look_at_m = [0.0, 0.1, 0.0]
field_of_view_deg = 35.0
"#;

#[test]
fn who_is_behind_a_door_sees_what_is_there_and_nobody_else_does() {
    let scene = Scene::parse(SCENE, Path::new("box.toml")).unwrap();
    let entities: Vec<Entity> = scene
        .entities
        .iter()
        .map(|spec| {
            let space = u32::from(spec.within.is_some());
            Entity::new(Cuboid::new([0.01; 3]).unwrap(), spec.pose, 1000.0).unwrap().within(space)
        })
        .collect();
    let stage = Stage::new(&scene, &entities);
    let Some(mut studio) = studio(&stage, SIZE) else { return };
    let poses: Vec<_> = entities.iter().map(|entity| entity.X_WB).collect();
    let mut look = |spaces: [u32; 2], place| {
        // Out of sight themselves.
        let finger =
            |space| FingerMoment { hip: Vector3::new(0.0, 0.0, 5.0), space, ..FingerMoment::default() };
        let moment =
            Moment { poses: poses.clone(), fingers: spaces.map(finger).to_vec(), ..Moment::default() };
        colour(&studio.take(&moment, &stage.cameras[0], &Eyes::default()), &stage.cameras[0], place)
    };
    let (hull, console) = ([0.0, 0.08, 0.05], [-0.08, 0.02, 0.0]);
    let is_blue = |[red, _, blue]: [i32; 3]| blue > red + 60;
    let is_red = |[red, _, blue]: [i32; 3]| red > blue + 60;
    assert!(is_blue(look([0, 0], hull)) && !is_red(look([0, 0], console)), "outside");
    for spaces in [[1, 0], [0, 1]] {
        assert!(!is_blue(look(spaces, hull)), "the hull is no longer in the way: {:?}", look(spaces, hull));
        // Through the front wall.
        assert!(is_red(look(spaces, console)), "{:?}", look(spaces, console));
    }
}
