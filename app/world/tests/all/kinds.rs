//! What a scene has beside fingers and entities that are felt: environments, visuals, lights, cameras, flags.

#![allow(non_snake_case)] // Frames are capital letters: up_W is in the world.

use std::path::Path;

use nalgebra::{Isometry3, Point3, Vector3};
use world::{EntityKind, EnvironmentKind, LightKind, Scene, SceneEntity, ShapeSpec, VisualSpec};

fn parsed(text: &str) -> Scene {
    Scene::parse(&format!("[[finger]]\n{text}"), Path::new("dir/s.toml"))
        .unwrap_or_else(|error| panic!("{error}"))
}

#[track_caller]
fn refused(text: &str, message: &str) {
    let error = Scene::parse(&format!("[[finger]]\n{text}"), Path::new("s.toml")).expect_err("it is wrong");
    assert_eq!(error.to_string(), message);
}

fn ball(keys: &str) -> String {
    format!("[[entity]]\nname = \"ball\"\nshape = {{ kind = \"sphere\", radius_m = 0.05 }}\n{keys}\n")
}

fn signed_distance(wall: &SceneEntity, point: [f64; 3]) -> f64 {
    let ShapeSpec::Plane { normal, offset_m } = &wall.shape else { panic!("{:?}", wall.shape) };
    let point_B = wall.pose.inverse_transform_point(&Point3::from(point));
    normal.dot(&point_B.coords) - offset_m
}

#[test]
fn a_room_is_six_walls_that_face_inwards() {
    let scene = parsed(
        "[[environment]]\nname = \"room\"\nkind = \"room\"\nsize_m = [0.6, 0.4, 0.2]\nposition_m = [0.0, 0.2, 0.0]\n\
         stiffness_n_per_m = 800\n",
    );
    let names: Vec<_> = scene.entities.iter().map(|entity| entity.name.as_str()).collect();
    assert_eq!(names, ["room_floor", "room_ceiling", "room_left", "room_right", "room_back", "room_front"]);
    assert_eq!(scene.environments[0].parts, names);
    // From (0.1, 0.05, 0.02): heights above each wall, by hand.
    let heights = [0.05, 0.35, 0.4, 0.2, 0.12, 0.08];
    for (wall, height_m) in scene.entities.iter().zip(heights) {
        // Sums of numbers below 1.
        assert!((signed_distance(wall, [0.1, 0.05, 0.02]) - height_m).abs() < 1e-15, "{}", wall.name);
        assert_eq!((wall.kind, wall.motion, wall.stiffness_n_per_m), (EntityKind::Environment, None, 800.0));
    }
}

#[test]
fn a_wall_says_what_differs_or_is_left_out() {
    let scene = parsed(
        "[[environment]]\nname = \"room\"\nkind = \"room\"\nsize_m = [1, 1, 1]\nmaterial = \"wood\"\n\
         floor = { material = \"rubber\" }\nceiling = false\nfront = true\n",
    );
    let materials: Vec<_> =
        scene.entities.iter().map(|entity| (entity.name.as_str(), entity.material.unwrap())).collect();
    assert_eq!(
        materials,
        [
            ("room_floor", "rubber"),
            ("room_left", "wood"),
            ("room_right", "wood"),
            ("room_back", "wood"),
            ("room_front", "wood")
        ]
    );
}

#[test]
fn environments_are_planes_meshes_and_mixtures_too() {
    let scene = parsed(
        "[[environment]]\nname = \"ground\"\nkind = \"plane\"\n\
         [[environment]]\nname = \"cave\"\nkind = \"mesh\"\nfile = \"cave.obj\"\nscale = 0.01\n\
         [[environment]]\nkind = \"mixed\"\nposition_m = [1, 0, 0]\nmaterial = \"steel\"\n\
         [[environment.part]]\nname = \"pillar\"\nposition_m = [0, 2, 0]\nshape = { kind = \"cylinder\", radius_m = 0.1, length_m = 1 }\n\
         [[environment.part]]\nmaterial = \"ice\"\nshape = { kind = \"box\", size_m = [1, 1, 1] }\n",
    );
    let kinds: Vec<_> = scene.environments.iter().map(|environment| environment.kind).collect();
    assert_eq!(kinds, [EnvironmentKind::Plane, EnvironmentKind::Mesh, EnvironmentKind::Mixed]);
    let [ground, cave, pillar, step] = &scene.entities[..] else { panic!("{:?}", scene.entities) };
    assert_eq!(signed_distance(ground, [3.0, 0.25, 7.0]), 0.25);
    let ShapeSpec::Mesh(mesh) = &cave.shape else { panic!("{:?}", cave.shape) };
    assert!(mesh.hollow && mesh.scale == [0.01; 3] && mesh.file == Path::new("dir/cave.obj"), "{mesh:?}");
    assert_eq!((pillar.name.as_str(), pillar.material), ("environment2_pillar", Some("steel")));
    assert_eq!(pillar.pose.translation.vector, Vector3::new(1.0, 2.0, 0.0));
    assert_eq!((step.name.as_str(), step.material), ("environment2_1", Some("ice")));
}

#[test]
fn what_is_seen_need_not_be_what_is_felt() {
    let visuals = |keys: &str| parsed(&ball(keys)).entities.remove(0).visuals;
    assert_eq!(*visuals(""), [VisualSpec::default()]);
    assert!(visuals("visual = false").is_empty());
    let red = VisualSpec { colour: Some([0.7, 0.0, 0.0, 1.0]), ..VisualSpec::default() };
    assert_eq!(*visuals("visual = { colour = [0.7, 0.0, 0.0] }"), [red]);
    let several = visuals(
        "visual = [{ shape = { kind = \"mesh\", file = \"fine.obj\" }, colour = [1, 1, 1, 0.25] }, \
         { position_m = [0, 0.1, 0], casts_shadow = false }]",
    );
    assert!(
        matches!(&several[0].shape, Some(ShapeSpec::Mesh(mesh)) if mesh.file == Path::new("dir/fine.obj"))
    );
    assert_eq!(several[0].colour.map(|colour| colour[3]), Some(0.25));
    assert_eq!(several[1].pose, Isometry3::translation(0.0, 0.1, 0.0));
    assert!(!several[1].casts_shadow && several[1].shape.is_none());
}

#[test]
fn an_entity_is_haptic_collidable_both_or_neither() {
    for (keys, haptic, collidable) in [
        ("", true, true),
        ("haptic = false", false, true),
        ("collidable = false", true, false),
        ("haptic = false\ncollidable = false", false, false),
    ] {
        let entity = parsed(&ball(keys)).entities.remove(0);
        assert_eq!((entity.is_haptic, entity.is_collidable), (haptic, collidable), "{keys}");
    }
}

#[test]
fn lights_shine_from_everywhere_from_far_and_from_a_place() {
    let scene = parsed(
        "[[light]]\nkind = \"ambient\"\nambient = [0.2, 0.2, 0.2]\n\
         [[light]]\nname = \"sun\"\nkind = \"directional\"\ndirection = [0, -2, 0]\ndiffuse = [1, 0.9, 0.8]\n\
         [[light]]\nkind = \"point\"\nposition_m = [1, 2, 3]\nattenuation = [1, 0.5, 0.25]\ncasts_shadow = false\n",
    );
    let [ambient, sun, lamp] = &scene.lights[..] else { panic!("{:?}", scene.lights) };
    assert_eq!((ambient.kind, ambient.ambient, ambient.casts_shadow), (LightKind::Ambient, [0.2; 3], false));
    assert_eq!((sun.diffuse, sun.specular, sun.casts_shadow), ([1.0, 0.9, 0.8], [1.0, 0.9, 0.8], true));
    assert!(
        matches!(sun.kind, LightKind::Directional { direction } if direction.into_inner() == -Vector3::y())
    );
    let place = LightKind::Point { position_m: Point3::new(1.0, 2.0, 3.0), attenuation: [1.0, 0.5, 0.25] };
    assert_eq!((lamp.name.as_str(), lamp.kind, lamp.casts_shadow), ("l2", place, false));
}

#[test]
fn a_camera_looks_along_minus_z_at_what_it_is_told_to_look_at() {
    let scene = parsed(
        "[[camera]]\nposition_m = [0.3, 0.4, 0.5]\nlook_at_m = [0.0, 0.1, 0.0]\nfar_m = 2\n[[camera]]\n",
    );
    let camera = &scene.cameras[0];
    let target_C: Point3<f64> = camera.pose.inverse_transform_point(&Point3::new(0.0, 0.1, 0.0));
    let distance_m = Vector3::<f64>::new(0.3, 0.3, 0.5).norm();
    // Rotations of lengths below 1.
    assert!((target_C - Point3::new(0.0, 0.0, -distance_m)).norm() < 1e-15, "{target_C}");
    let (right_W, up_W): (Vector3<f64>, Vector3<f64>) =
        (camera.pose * Vector3::x(), camera.pose * Vector3::y());
    assert!(up_W.y > 0.0 && right_W.y.abs() < 1e-15, "level, and not upside down");
    assert_eq!((camera.near_m, camera.far_m, camera.field_of_view_deg), (0.01, 2.0, 30.0));
    assert_eq!((scene.cameras[1].name.as_str(), scene.cameras[1].pose), ("c1", Isometry3::identity()));
}

#[test]
fn a_tardis_has_a_hull_with_a_door_and_a_larger_room_behind_it() {
    let scene = parsed(&format!(
        "{}[[environment]]\nname = \"inside\"\nkind = \"room\"\nsize_m = [0.4, 0.3, 0.4]\n\
         door = {{ of = \"ball\", position_m = [0, 0, 0.05], size_m = [0.04, 0.06] }}\n\
         [[entity]]\nname = \"console\"\nwithin = \"inside\"\nshape = {{ kind = \"sphere\", radius_m = 0.02 }}\n",
        ball("")
    ));
    let door = scene.environments[0].door.as_ref().expect("a door");
    assert_eq!((door.of.as_str(), door.size_m), ("ball", [0.04, 0.06]));
    let within: Vec<_> = scene.entities.iter().map(|entity| entity.within.as_deref()).collect();
    assert_eq!(
        within[..3],
        [None, Some("inside"), Some("inside")],
        "outside the hull; the console and the walls behind"
    );
    assert!(within[3..].iter().all(|within| *within == Some("inside")));
}

#[test]
fn what_is_wrong_with_them_is_told_with_line_and_key() {
    for (text, message) in [
        (
            "[[environment]]\nkind = \"cave\"\n".to_owned(),
            "s.toml:3: environment[0].kind: unknown environment `cave`; allowed: plane, room, mesh, mixed",
        ),
        (
            "[[environment]]\nkind = \"room\"\n".to_owned(),
            "s.toml:2: environment[0].size_m: missing; allowed: an array of 3 numbers above 0, the inner size of the room",
        ),
        (
            ball("visual = { colour = [1, 0, 2] }"),
            "s.toml:5: entity[0].visual.colour: found [1.0, 0.0, 2.0], which looks like numbers from 0 to 255; allowed: an array of \
             3 numbers from 0 to 1: write [0.004, 0.0, 0.008]",
        ),
        (
            ball("within = \"inside\""),
            "s.toml:2: within: found \"inside\", which no [[environment]] with a door is called; allowed: none, since there is none",
        ),
        (
            "[[environment]]\nkind = \"plane\"\ndoor = { of = \"hull\", size_m = [1, 1] }\n".to_owned(),
            "s.toml:4: environment[0].door.of: found \"hull\", which no entity is called; allowed: environment0",
        ),
        (
            format!(
                "{}[[environment]]\nname = \"inside\"\nkind = \"plane\"\ndoor = {{ of = \"ball\", size_m = [1, 1] }}\n",
                ball("within = \"inside\"")
            ),
            "s.toml:2: within: found \"inside\", whose door this entity has; allowed: the world, or another environment",
        ),
        (
            "[[camera]]\nnear_m = 1\nfar_m = 0.5\n".to_owned(),
            "s.toml:4: camera[0].far_m: found 0.5; allowed: a number above near_m = 1",
        ),
        (
            "[[camera]]\nlook_at_m = [0, 1, 0]\n".to_owned(),
            "s.toml:3: camera[0].look_at_m: found an array of length 3; allowed: a place that is not straight along `up` from the camera, or another `up`",
        ),
        (
            "[[camera]]\nposition_m = [0, 1, 0]\nlook_at_m = [0, 1, 0]\n".to_owned(),
            "s.toml:4: camera[0].look_at_m: found an array of length 3; allowed: another place than the camera's own `position_m`",
        ),
        (
            "[[light]]\nkind = \"point\"\nattenuation = [0, 1, 0]\n".to_owned(),
            "s.toml:4: light[0].attenuation: found an array of length 3; allowed: an array of 3 numbers, 0 or more, the first above 0",
        ),
        (
            format!("{}[[environment]]\nname = \"ball\"\nkind = \"plane\"\n", ball("")),
            "s.toml:7: environment[0].name: found \"ball\" (of an environment), already taken on line 3; allowed: a value used only once",
        ),
    ] {
        refused(&text, message);
    }
}
