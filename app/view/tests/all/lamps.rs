//! Light from a place: facts about pixels. Where there is no graphics library they say so and pass.

use crate::common;

use common::{SIZE, colour, studio};
use haptics::{Entity, Plane, Shape, Sphere};
use nalgebra::Vector3;
use std::path::Path;
use view::{Eyes, Moment, Picture, Stage};
use world::{Scene, SceneCamera};

/// A ball five centimetres above a floor, a lamp somewhere.
fn floor(lamp: [f64; 3], attenuation: [f64; 3], casts_shadow: bool) -> Option<(SceneCamera, Picture)> {
    let scene = format!(
        r#"
name = "lamp"
[[finger]]
start_m = [0.0, 0.1, 0.0]
[[entity]]
name = "floor"
shape = {{ kind = "plane", normal = [0.0, 1.0, 0.0], offset_m = 0.0 }}
stiffness_n_per_m = 1000.0
visual = {{ colour = [0.8, 0.8, 0.8] }}
[[entity]]
name = "ball"
shape = {{ kind = "sphere", radius_m = 0.015 }}
position_m = [0.0, 0.05, 0.0]
stiffness_n_per_m = 1000.0
visual = {{ colour = [0.8, 0.1, 0.1] }}
[[camera]]
position_m = [0.0, 0.5, 0.5]
look_at_m = [0.0, 0.0, 0.0]
field_of_view_deg = 35.0
[[light]]
kind = "point"
position_m = {lamp:?}
diffuse = [0.6, 0.6, 0.6]
attenuation = {attenuation:?}
casts_shadow = {casts_shadow}
"#
    );
    let scene = Scene::parse(&scene, Path::new("lamp.toml")).unwrap();
    let shapes: [Shape; 2] =
        [Plane::new(Vector3::y(), 0.0).unwrap().into(), Sphere::new(0.015).unwrap().into()];
    let entities: Vec<Entity> = scene
        .entities
        .iter()
        .zip(shapes)
        .map(|(spec, shape)| Entity::new(shape, spec.pose, 1000.0).unwrap())
        .collect();
    let stage = Stage::new(&scene, &entities);
    let poses = entities.iter().map(|entity| entity.X_WB).collect();
    let moment = Moment { poses, ..Moment::default() };
    let mut studio = studio(&stage, SIZE)?;
    studio.painter().with_overlay = false;
    let picture = studio.take(&moment, &stage.cameras[0], &Eyes::default());
    Some((stage.cameras[0].clone(), picture))
}

/// How much light comes from a place of the floor: green, of the greatest.
fn light((camera, picture): &(SceneCamera, Picture), x: f64, z: f64) -> f64 {
    f64::from(colour(picture, camera, [x, 0.0, z])[1]) / 255.0
}

/// Half a step of 255 in brightness is 1 % of the power at the darkest place (0.31), and places are known to a pixel.
const ROUNDED: f64 = 0.02;
const UPPER_LEFT: [f64; 3] = [-0.1, 0.2, 0.0];
const EVEN: [f64; 3] = [1.0, 0.0, 0.0];

#[test]
fn a_lamps_shadow_lies_where_the_line_from_it_through_the_ball_meets_the_floor() {
    let Some(with) = floor(UPPER_LEFT, EVEN, true) else { return };
    let Some(without) = floor(UPPER_LEFT, EVEN, false) else { return };
    // From (-0.1, 0.2) through (0, 0.05) to the floor.
    let shadow = 0.1 / 3.0;
    assert!(light(&with, shadow, 0.0) < 0.1 * light(&without, shadow, 0.0));
    // The cone of light that the ball takes away is 0.0208 m wide there along z: 0.015 at 0.1803 m, seen at 0.2404 m.
    let rim = 0.2_f64.hypot(0.1 + shadow) / 0.15_f64.hypot(0.1) * 0.015;
    for z in [-0.9 * rim, 0.9 * rim] {
        assert!(light(&with, shadow, z) < 0.1 * light(&without, shadow, z), "{z}");
    }
    for (x, z) in [(shadow, 1.15 * rim), (-shadow, 0.0), (0.1, 0.0), (-0.15, 0.05), (0.15, -0.1)] {
        let (lit, same) = (light(&with, x, z), light(&without, x, z));
        assert!((lit - same).abs() < 0.02, "no place shades itself: {x} {z}: {lit} {same}");
    }
}

#[test]
fn shadows_are_right_on_all_sides_of_a_lamp() {
    for [x, z] in [[-0.1, 0.03], [0.1, 0.03], [0.03, -0.1], [-0.03, 0.1]] {
        let lamp = [x, 0.09, z];
        let Some(with) = floor(lamp, EVEN, true) else { return };
        let Some(without) = floor(lamp, EVEN, false) else { return };
        // The ball is five ninths as high as the lamp: 9 / 4 of the way to it is the floor.
        let at = |x: f64, z: f64| light(&with, x, z) / light(&without, x, z);
        let (shadow_x, shadow_z) = (x - 2.25 * x, z - 2.25 * z);
        assert!(at(shadow_x, shadow_z) < 0.2, "{lamp:?}: {}", at(shadow_x, shadow_z));
        for [x, z] in [[-shadow_x, shadow_z], [shadow_x, -shadow_z]] {
            assert!((at(x, z) - 1.0).abs() < 0.03, "{lamp:?}: {}", at(x, z));
        }
    }
}

#[test]
fn a_lamps_light_falls_off_with_distance_as_the_scene_says() {
    let Some(even) = floor(UPPER_LEFT, EVEN, true) else { return };
    let Some(falling) = floor(UPPER_LEFT, [0.5, 1.0, 20.0], true) else { return };
    for x in [-0.1, 0.1, 0.15] {
        let d = 0.2_f64.hypot(x + 0.1).hypot(0.08);
        let left = 1.0 / (0.5 + d + 20.0 * d * d);
        let ratio = power(light(&falling, x, 0.08)) / power(light(&even, x, 0.08));
        assert!((ratio / left - 1.0).abs() < ROUNDED, "{x}: {ratio} {left}");
    }
}

/// The power of light that is seen as so bright: sRGB's curve undone, and that of the tone mapping (ACES as fitted by
/// Narkowicz), y = x (2.51 x + 0.03) / (x (2.43 x + 0.59) + 0.14).
fn power(seen: f64) -> f64 {
    let y = ((seen + 0.055) / 1.055).powf(2.4);
    let (a, b, c) = (2.43 * y - 2.51, 0.59 * y - 0.03, 0.14 * y);
    (-b - (b * b - 4.0 * a * c).sqrt()) / (2.0 * a)
}
