//! Scenes that say nothing of cameras and colours: facts about their stages.

use haptics::{Entity, Sphere};
use std::path::Path;
use view::Stage;
use world::{Scene, ShapeSpec, VisualSpec};

/// Where things are is the scene's; what they feel like does not matter here.
fn stage(scene: &Scene) -> Stage {
    let ball = || Sphere::new(0.01).unwrap();
    let entities: Vec<Entity> =
        scene.entities.iter().map(|spec| Entity::new(ball(), spec.pose, 1000.0).unwrap()).collect();
    Stage::new(scene, &entities)
}

fn scene(name: &str) -> Scene {
    let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../config/scenes");
    Scene::load(scenes.join(name).with_extension("toml")).unwrap()
}

#[test]
fn the_usual_camera_sees_all_that_has_an_end_of_the_scenes_that_come_with_us() {
    for name in ["default", "gallery", "lift", "shapes", "sphere", "ten"] {
        let scene = scene(name);
        let stage = stage(&scene);
        let camera = &stage.cameras[0];
        let tangent = (0.5 * camera.field_of_view_deg).to_radians().tan();
        let mut highest = 0.0_f64;
        for thing in &stage.things {
            let spec = &scene.entities[thing.entity];
            if matches!(spec.shape, ShapeSpec::Plane { .. }) {
                continue;
            }
            for place in &thing.triangles.places {
                let at = camera.pose.inverse() * spec.pose * thing.pose * place;
                assert!(-at.z > camera.near_m && -at.z < camera.far_m, "{name}: {}", spec.name);
                // A square picture sees the least.
                let out = at.x.abs().max(at.y.abs()) / (-at.z * tangent);
                assert!(out < 1.0, "{name}: {} at {out} of the picture's half", spec.name);
                highest = highest.max(out);
            }
        }
        assert!(highest > 0.3, "{name}: all of it is small, {highest} of the picture's half");
    }
}

#[test]
fn things_are_told_apart_unless_a_scene_says_a_colour() {
    let shapes = scene("shapes");
    let colours: Vec<[f64; 4]> = stage(&shapes).things.iter().map(|thing| thing.colour).collect();
    let grey = |colour: &&[f64; 4]| **colour == VisualSpec::DEFAULT_COLOUR;
    assert_eq!(colours.iter().filter(grey).count(), 1, "the floor");
    assert!(colours.windows(2).all(|both| both[0] != both[1]));
    for colour in [[0.8, 0.1, 0.1], [0.8, 0.8, 0.8]] {
        let said = r#"
name = "said"
[[finger]]
start_m = [0.0, 0.1, 0.0]
[[entity]]
name = "red"
shape = { kind = "sphere", radius_m = 0.01 }
visual = { colour = COLOUR }
[[entity]]
name = "grey"
shape = { kind = "sphere", radius_m = 0.01 }
"#;
        let said = said.replace("COLOUR", &format!("{colour:?}"));
        let said = stage(&Scene::parse(&said, Path::new("said.toml")).unwrap());
        let [r, g, b] = colour;
        assert_eq!(said.things[0].colour, [r, g, b, 1.0]);
        assert_eq!(said.things[1].colour, VisualSpec::DEFAULT_COLOUR);
    }
}
