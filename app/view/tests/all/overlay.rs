//! What is drawn of contacts: facts about pixels. Where there is no graphics library they say so and pass.

use crate::common;

use common::{SIZE, colour, studio};
use haptics::{Cuboid, Entity, Feature};
use nalgebra::Vector3;
use std::path::Path;
use view::{ContactMoment, Eyes, FingerMoment, Moment, Picture, Stage, Studio};
use world::Scene;

const SCENE: &str = r#"
name = "block"
[[finger]]
start_m = [0.0, 0.1, 0.0]
[[entity]]
name = "block"
shape = { kind = "box", size_m = [0.1, 0.1, 0.1] }
position_m = [0.0, -0.05, 0.0]
stiffness_n_per_m = 1000.0
visual = { colour = [0.3, 0.3, 0.35] }
[[entity]]
name = "other"
shape = { kind = "box", size_m = [0.02, 0.02, 0.02] }
position_m = [0.08, -0.01, 0.0]
stiffness_n_per_m = 1000.0
visual = { colour = [0.3, 0.3, 0.35] }
[[camera]]
position_m = [0.0, 0.2, 0.25]
look_at_m = [0.0, 0.0, 0.0]
field_of_view_deg = 35.0
"#;

/// Presses this deep into the middle of the upper face (m).
const DEEP_M: f64 = 0.02;

struct Set {
    stage: Stage,
    moment: Moment,
    studio: Studio,
}

/// `None`, and said so: there are no pictures here.
fn set() -> Option<Set> {
    let scene = Scene::parse(SCENE, Path::new("block.toml")).unwrap();
    let entity = |size, index: usize| {
        Entity::new(Cuboid::new([size; 3]).unwrap(), scene.entities[index].pose, 1000.0).unwrap()
    };
    let entities = [entity(0.1, 0), entity(0.02, 1)];
    let stage = Stage::new(&scene, &entities);
    let finger = FingerMoment {
        hip: Vector3::new(0.0, -DEEP_M, 0.0),
        god_object: Vector3::zeros(),
        entity: Some(0),
        ..FingerMoment::default()
    };
    let poses = entities.iter().map(|entity| entity.X_WB).collect();
    let moment = Moment { poses, fingers: vec![finger], ..Moment::default() };
    let studio = studio(&stage, SIZE)?;
    Some(Set { stage, moment, studio })
}

impl Set {
    fn take(&mut self) -> Picture {
        self.studio.take(&self.moment, &self.stage.cameras[0], &Eyes::default())
    }

    fn touch(&mut self, feature: Feature, friction_radius_m: Option<f64>) -> Picture {
        self.moment.fingers[0].contact =
            Some(ContactMoment { normal: Vector3::y(), friction_radius_m, feature });
        self.take()
    }

    fn at(&self, picture: &Picture, place: [f64; 3]) -> [i32; 3] {
        colour(picture, &self.stage.cameras[0], place)
    }
}

/// How far apart two colours are, at most of red, green and blue.
fn apart(a: [i32; 3], b: [i32; 3]) -> i32 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).max().unwrap_or(0)
}

#[test]
fn the_friction_circle_lies_in_the_tangent_plane_around_the_hips_foot() {
    let Some(mut set) = set() else { return };
    let without = set.touch(Feature::Face, None);
    for radius_m in [0.01, 0.03] {
        let with = set.touch(Feature::Face, Some(radius_m));
        for (x, z) in [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.6, 0.8), (-0.8, 0.6)] {
            let difference = |share: f64| {
                let place = [share * radius_m * x, 0.0, share * radius_m * z];
                apart(set.at(&with, place), set.at(&without, place))
            };
            assert!(difference(1.0) > 60, "{radius_m} {x} {z}: {}", difference(1.0));
            // Its line is 1.2 mm wide.
            assert!(difference(0.85) < 10 && difference(1.15) < 10, "{radius_m} {x} {z}");
        }
    }
}

#[test]
fn a_contacts_normal_is_a_line_whose_colour_tells_the_feature() {
    let Some(mut set) = set() else { return };
    let none = set.take();
    let features = [Feature::Surface, Feature::Face, Feature::Edge, Feature::Vertex];
    let colours = features.map(|feature| {
        let picture = set.touch(feature, None);
        let beyond = [0.0, 0.033, 0.0];
        assert!(apart(set.at(&picture, beyond), set.at(&none, beyond)) < 3, "it is three centimetres long");
        set.at(&picture, [0.0, 0.02, 0.0])
    });
    for (k, colour) in colours.iter().enumerate() {
        for other in colours[..k].iter().copied().chain([set.at(&none, [0.0, 0.02, 0.0])]) {
            assert!(apart(*colour, other) > 60, "{colours:?}");
        }
    }
}

#[test]
fn what_is_inside_an_object_shines_through_faintly() {
    let Some(mut set) = set() else { return };
    let hip = [0.0, -DEEP_M, 0.0];
    let inside = set.take();
    set.studio.painter().with_overlay = false;
    let bare = set.take();
    set.studio.painter().with_overlay = true;
    set.studio.painter().with_highlight = false;
    let unmarked = set.take();
    set.moment.poses[0].translation.vector.x += 0.5;
    let outside = set.take();
    let faint = apart(set.at(&unmarked, hip), set.at(&bare, hip));
    assert!(faint > 8, "it is seen: {faint}");
    let green = |picture: &Picture| {
        let [r, g, b] = set.at(picture, hip);
        2 * g - r - b
    };
    assert!(green(&outside) > 2 * green(&unmarked), "{} {}", green(&outside), green(&unmarked));
    assert!(green(&inside) > green(&bare));
}

#[test]
fn a_thing_changes_its_colour_while_it_is_touched_and_others_do_not() {
    let Some(mut set) = set() else { return };
    let touched = set.take();
    set.moment.fingers[0].entity = None;
    let free = set.take();
    set.moment.fingers[0].entity = Some(0);
    set.studio.painter().with_highlight = false;
    let unmarked = set.take();
    let (own, other) = ([0.04, 0.0, 0.02], [0.08, 0.0, 0.0]);
    assert!(apart(set.at(&touched, own), set.at(&free, own)) > 30);
    assert_eq!(set.at(&unmarked, own), set.at(&free, own));
    assert_eq!(set.at(&touched, other), set.at(&free, other));
}

#[test]
fn the_chosen_thing_is_marked_otherwise_than_one_that_is_touched() {
    let Some(mut set) = set() else { return };
    set.moment.fingers[0].entity = None;
    let (own, other) = ([0.04, 0.0, 0.02], [0.08, 0.0, 0.0]);
    let free = set.take();
    set.studio.painter().chosen = Some(0);
    let chosen = set.take();
    set.moment.fingers[0].entity = Some(0);
    let both = set.take();
    set.studio.painter().chosen = None;
    let touched = set.take();
    let looks = [&free, &chosen, &both, &touched].map(|picture| set.at(picture, own));
    for (k, look) in looks.iter().enumerate() {
        assert!(looks[..k].iter().all(|other| apart(*look, *other) > 20), "{looks:?}");
    }
    for picture in [&chosen, &both, &touched] {
        assert_eq!(set.at(picture, other), set.at(&free, other));
    }
}

#[test]
fn shadows_go_where_the_sun_is_turned_away_from() {
    let Some(mut set) = set() else { return };
    set.moment.fingers.clear();
    // Above the block, so that its shadow is on it: straight below, and a hand's breadth beside.
    set.moment.poses[1].translation.vector = Vector3::new(-0.02, 0.03, 0.0);
    set.stage.lights.iter().for_each(|light| assert!(light.diffuse.iter().all(|share| *share <= 1.0)));
    let begun = set.take();
    // The usual sun shines to +x and away; turned about z it shines to -x.
    set.studio.painter().sun =
        nalgebra::UnitQuaternion::from_axis_angle(&Vector3::z_axis(), -2.0 * f64::atan(0.45));
    let turned = set.take();
    // 2 cm above, towards +x and -z by 0.45 and 0.35 of the height of its middle.
    let there = |x: f64| [-0.02 + x * 0.45 * 0.03, 0.0, -0.35 * 0.03];
    let light = |picture: &Picture, x| set.at(picture, there(x)).iter().sum::<i32>();
    assert!(light(&begun, 1.2) + 60 < light(&turned, 1.2), "{} {}", light(&begun, 1.2), light(&turned, 1.2));
    assert!(
        light(&turned, -1.2) + 60 < light(&begun, -1.2),
        "{} {}",
        light(&turned, -1.2),
        light(&begun, -1.2)
    );
}
