//! Pictures without a display: facts about their pixels. Where there is no graphics library they say so and pass.

use crate::common;

use common::{SIZE, colour, studio};
use haptics::{Cuboid, Cylinder, Entity, Plane, Shape, Torus};
use nalgebra::{Isometry3, Vector3};
use std::path::Path;
use view::{Eyes, FingerMoment, Moment, Picture, Stage, Studio};
use world::Scene;

const SCENE: &str = r#"
name = "table"
[[finger]]
start_m = [0.0, 0.1, 0.0]
[[entity]]
name = "table"
shape = { kind = "plane", normal = [0.0, 1.0, 0.0], offset_m = 0.0 }
stiffness_n_per_m = 1000.0
visual = { colour = [0.8, 0.8, 0.8] }
[[entity]]
name = "cube"
shape = { kind = "box", size_m = [0.05, 0.05, 0.05] }
position_m = [0.0, 0.025, 0.0]
stiffness_n_per_m = 1000.0
visual = { colour = [0.8, 0.1, 0.1] }
[[entity]]
name = "can"
shape = { kind = "cylinder", radius_m = 0.02, length_m = 0.08 }
position_m = [0.1, 0.04, 0.0]
stiffness_n_per_m = 1000.0
visual = { colour = [0.1, 0.2, 0.8] }
[[entity]]
name = "ring"
shape = { kind = "torus", ring_radius_m = 0.03, tube_radius_m = 0.01 }
position_m = [-0.1, 0.01, 0.0]
stiffness_n_per_m = 1000.0
visual = { colour = [0.1, 0.6, 0.2] }
[[camera]]
position_m = [0.05, 0.3, 0.5]
look_at_m = [0.0, 0.03, 0.0]
field_of_view_deg = 35.0
"#;

fn shapes() -> Vec<Shape> {
    vec![
        Plane::new(Vector3::y(), 0.0).unwrap().into(),
        Cuboid::new([0.05; 3]).unwrap().into(),
        Cylinder::new(0.02, 0.08).unwrap().into(),
        Torus::new(0.03, 0.01).unwrap().into(),
    ]
}

fn table() -> (Stage, Moment) {
    let scene = Scene::parse(SCENE, Path::new("table.toml")).unwrap();
    let entities: Vec<Entity> = scene
        .entities
        .iter()
        .zip(shapes())
        .map(|(spec, shape)| Entity::new(shape, spec.pose, 1000.0).unwrap())
        .collect();
    let poses: Vec<Isometry3<f64>> = entities.iter().map(|entity| entity.X_WB).collect();
    let finger = FingerMoment {
        hip: Vector3::new(0.0, 0.048, 0.01),
        god_object: Vector3::new(0.0, 0.05, 0.01),
        force: Vector3::new(0.0, 2.0, 0.0),
        entity: Some(1),
        contact: None,
        space: 0,
    };
    (Stage::new(&scene, &entities), Moment { poses, fingers: vec![finger], ..Moment::default() })
}

/// Of the table, after this change to who draws. `None`, and said so: there are none here.
fn pictures(change: impl Fn(&mut Studio)) -> Option<(Stage, Picture)> {
    let (stage, moment) = table();
    let mut studio = studio(&stage, SIZE)?;
    change(&mut studio);
    let picture = studio.take(&moment, &stage.cameras[0], &Eyes::default());
    Some((stage, picture))
}

#[test]
fn things_are_seen_where_the_cameras_geometry_says_in_their_colours() {
    let Some((stage, picture)) = pictures(|studio| studio.painter().with_overlay = false) else { return };
    let colour = |place| colour(&picture, &stage.cameras[0], place);
    let is_red = |[r, g, b]: [i32; 3]| r > 2 * g && r > 2 * b;
    let is_blue = |[r, _, b]: [i32; 3]| b > 2 * r;
    let is_green = |[r, g, _]: [i32; 3]| g > 2 * r;
    let is_grey = |[r, g, b]: [i32; 3]| (r - g).abs() < 8 && (g - b).abs() < 8;
    // Two millimetres within the rims of what looks at the camera, and two beyond them.
    let (near, half) = (0.025, 0.023);
    for (x, y) in [(-half, 0.002), (half, 0.002), (half, 0.048), (-half, 0.048)] {
        assert!(is_red(colour([x, y, near])), "{x} {y}: {:?}", colour([x, y, near]));
    }
    assert!(!is_red(colour([-0.028, 0.002, near])) && !is_red(colour([0.0, -0.003, near])));
    assert!(is_blue(colour([0.1, 0.04, 0.02])) && is_green(colour([-0.1, 0.02, 0.03])));
    // Through the ring the table is seen.
    assert!(is_grey(colour([-0.1, 0.0, -0.013])), "{:?}", colour([-0.1, 0.0, -0.013]));
}

#[test]
fn shadows_lie_on_the_floor_away_from_the_light() {
    let bright = |picture: &Picture, stage: &Stage, place| {
        colour(picture, &stage.cameras[0], place).iter().sum::<i32>()
    };
    // Light goes right and back: x grows by 0.45 and z falls by 0.35 on the way down from a place to its shadow.
    let (behind, before) = ([0.034, 0.0, 0.0], [-0.034, 0.0, 0.0]);
    let Some((stage, with)) = pictures(|_| ()) else { return };
    let (dark, lit) = (bright(&with, &stage, behind), bright(&with, &stage, before));
    assert!(dark < lit - 60, "{dark} {lit}");
    let Some((stage, without)) = pictures(|studio| studio.painter().with_shadows = false) else { return };
    assert!((bright(&without, &stage, behind) - bright(&without, &stage, before)).abs() < 10);
}

#[test]
fn the_overlay_shows_the_force_as_an_arrow_and_can_be_taken_away() {
    let Some((stage, with)) = pictures(|_| ()) else { return };
    let Some((_, without)) = pictures(|studio| studio.painter().with_overlay = false) else { return };
    // Two newtons reach four centimetres up from where they act.
    let colour = |picture, up: f64| colour(picture, &stage.cameras[0], [0.0, 0.05 + up, 0.01]);
    let is_yellow = |[r, g, b]: [i32; 3]| r > 2 * b && g > 2 * b;
    assert!(
        is_yellow(colour(&with, 0.02)) && is_yellow(colour(&with, 0.038)) && !is_yellow(colour(&with, 0.043))
    );
    assert!(!is_yellow(colour(&without, 0.02)));
}

#[test]
fn what_collides_looks_other_than_what_a_finger_touches_and_both_other_than_what_nothing_does() {
    let (stage, mut moment) = table();
    let Some(mut studio) = studio(&stage, SIZE) else { return };
    // The front of the cube, and the can's, from the camera.
    let [cube, can] = [[0.0, 0.02, 0.025], [0.1, 0.03, 0.02]];
    let camera = stage.cameras[0].clone();
    let mut look = |moment: &Moment| {
        let picture = studio.take(moment, &camera, &Eyes::default());
        [cube, can].map(|at| colour(&picture, &camera, at))
    };
    moment.fingers[0].entity = None;
    let [free, other] = look(&moment);
    moment.colliding = vec![1];
    let [collides, beside] = look(&moment);
    moment.fingers[0].entity = Some(1);
    let [both, _] = look(&moment);
    moment.colliding.clear();
    let [touched, _] = look(&moment);
    assert_eq!(other, beside, "the can touches nothing");
    let differ = |a: [i32; 3], b: [i32; 3]| a.iter().zip(b).any(|(a, b)| (a - b).abs() > 12);
    let looks = [free, collides, touched, both];
    for (at, a) in looks.iter().enumerate() {
        assert!(looks[at + 1..].iter().all(|b| differ(*a, *b)), "{looks:?}");
    }
    // The mark of what collides is purple, that of what is touched yellow.
    assert!(collides[2] > free[2] + 12 && touched[2] < collides[2] && touched[1] > collides[1], "{looks:?}");
}
