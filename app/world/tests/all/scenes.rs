//! What a scene and a layout that are in order turn into.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use nalgebra::{Isometry3, Point3, Unit, UnitQuaternion, Vector3};
use world::{AlgorithmSpec, FrictionSpec, Layout, Scene, SceneEntity, ShapeSpec};

fn parsed(text: &str) -> Scene {
    Scene::parse(text, Path::new("dir/s.toml")).unwrap_or_else(|error| panic!("{error}"))
}

fn entity(keys: &str) -> SceneEntity {
    let sphere = "shape = { kind = \"sphere\", radius_m = 1 }";
    parsed(&format!("[[finger]]\n[[entity]]\n{sphere}\n{keys}\n")).entities.remove(0)
}

fn shape(shape: &str) -> ShapeSpec {
    parsed(&format!("[[finger]]\n[[entity]]\nshape = {shape}\n")).entities.remove(0).shape
}

fn plane(normal: [f64; 3], offset_m: f64) -> ShapeSpec {
    ShapeSpec::Plane { normal: Unit::new_unchecked(normal.into()), offset_m }
}

#[test]
fn every_key_of_a_full_scene_arrives() {
    let scene = parsed(
        r#"
        name = "a full scene"
        gravity_m_s2 = [0.0, 0.0, -1.62]
        hand = "hands/h.csv"

        [[finger]]
        name = "left-index"
        radius_m = 0.008
        start_m = [0.1, 0.2, -0.3]
        device = 1

        [[finger]]
        device = 0

        [[entity]]
        name = "table"
        shape = { kind = "plane", normal = [0.0, 1.0, 0.0], offset_m = 0.02 }
        position_m = [1, 2, 3]
        orientation_wxyz = [0.0, 0.0, 1.0, 0.0]
        stiffness_n_per_m = 2e3
        damping_n_s_per_m = 2.0
        friction = { model = "coulomb", mu = 0.5 }
        "#,
    );
    assert_eq!(scene.name, "a full scene");
    assert_eq!(scene.gravity_m_s2, Vector3::new(0.0, 0.0, -1.62));
    assert_eq!(scene.hand, Some(PathBuf::from("dir/hands/h.csv")));
    let left = &scene.fingers[0];
    assert_eq!((left.name.as_str(), left.radius_m, left.device), ("left-index", 0.008, 1));
    assert_eq!(left.start_m, Point3::new(0.1, 0.2, -0.3));
    assert_eq!((scene.fingers[1].name.as_str(), scene.fingers[1].device), ("f1", 0));
    let half_turn = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), std::f64::consts::PI);
    let table = &scene.entities[0];
    assert_eq!(table.name, "table");
    assert_eq!(table.shape, plane([0.0, 1.0, 0.0], 0.02));
    assert_eq!(table.pose.translation.vector, Vector3::new(1.0, 2.0, 3.0));
    // cos(pi/2) is 6e-17 in floating point, the file's is 0.
    assert!(table.pose.rotation.angle_to(&half_turn) < 1e-15);
    assert_eq!((table.stiffness_n_per_m, table.damping_n_s_per_m), (2000.0, 2.0));
    assert_eq!(table.friction, FrictionSpec::Coulomb { mu: 0.5 });
}

#[test]
fn what_is_left_out_takes_its_documented_default() {
    let scene = parsed("[[finger]]\n[[finger]]\n[[entity]]\nshape = { kind = \"sphere\", radius_m = 1 }\n");
    assert_eq!(scene.name, "s");
    assert_eq!(scene.gravity_m_s2, Vector3::new(0.0, -9.81, 0.0));
    assert_eq!(scene.hand, None);
    let finger = &scene.fingers[1];
    assert_eq!((finger.name.as_str(), finger.radius_m, finger.device), ("f1", 0.0, 1));
    assert_eq!(finger.start_m, Point3::origin());
    let entity = &scene.entities[0];
    assert_eq!(entity.name, "e0");
    assert_eq!(entity.pose, Isometry3::identity());
    assert_eq!((entity.stiffness_n_per_m, entity.damping_n_s_per_m), (1000.0, 0.0));
    assert_eq!(entity.friction, FrictionSpec::None);
    assert_eq!(entity.algorithm, AlgorithmSpec::FrictionCone);
}

#[test]
fn every_shape_kind_is_read() {
    for (written, expected) in [
        ("kind = \"box\", size_m = [1, 2, 3]", ShapeSpec::Box { size_m: [1.0, 2.0, 3.0] }),
        (
            "kind = \"cylinder\", radius_m = 1, length_m = 2",
            ShapeSpec::Cylinder { radius_m: 1.0, length_m: 2.0 },
        ),
        (
            "kind = \"cone\", radius_bottom_m = 1, radius_top_m = 0, length_m = 2",
            ShapeSpec::Cone { radius_bottom_m: 1.0, radius_top_m: 0.0, length_m: 2.0 },
        ),
        (
            "kind = \"torus\", ring_radius_m = 2, tube_radius_m = 1",
            ShapeSpec::Torus { ring_radius_m: 2.0, tube_radius_m: 1.0 },
        ),
        (
            "kind = \"capsule\", radius_m = 1, length_m = 0",
            ShapeSpec::Capsule { radius_m: 1.0, length_m: 0.0 },
        ),
        ("kind = \"ellipsoid\", radii_m = [1, 2, 3]", ShapeSpec::Ellipsoid { radii_m: [1.0, 2.0, 3.0] }),
        (
            "kind = \"sphere\", radius_m = 1, scale = 2",
            ShapeSpec::Scaled { shape: Box::new(ShapeSpec::Sphere { radius_m: 1.0 }), scale: [2.0; 3] },
        ),
        (
            "kind = \"box\", size_m = [1, 1, 1], scale = [1, 2, 0.5]",
            ShapeSpec::Scaled {
                shape: Box::new(ShapeSpec::Box { size_m: [1.0; 3] }),
                scale: [1.0, 2.0, 0.5],
            },
        ),
    ] {
        let read = shape(&format!("{{ {written} }}"));
        assert_eq!(read, expected);
        assert!(written.contains(&format!("\"{}\"", read.kind())));
    }
}

#[test]
fn a_mesh_file_is_relative_to_the_scene_file_and_knows_where_it_was_named() {
    let mesh = |rest: &str| {
        let ShapeSpec::Mesh(mesh) = shape(&format!("{{ kind = \"mesh\", {rest} }}")) else {
            panic!("a mesh")
        };
        mesh
    };
    let plain = mesh("file = \"../meshes/a.obj\"");
    assert_eq!((plain.file, plain.scale), (PathBuf::from("dir/../meshes/a.obj"), [1.0; 3]));
    assert_eq!(plain.at.to_string(), "dir/s.toml:3: entity[0].shape.file");
    assert_eq!(mesh("file = \"/b.stl\", scale = 0.001").scale, [0.001; 3]);
    assert_eq!(mesh("file = \"/b.stl\", scale = 0.001").file, PathBuf::from("/b.stl"));
    assert_eq!(mesh("file = \"b\", scale = [1, 2, 3]").scale, [1.0, 2.0, 3.0]);
}

#[test]
fn every_algorithm_is_read() {
    let algorithm = |name: &str| entity(&format!("algorithm = \"{name}\"")).algorithm;
    assert_eq!(algorithm("friction-cone"), AlgorithmSpec::FrictionCone);
    assert_eq!(algorithm("vector-field"), AlgorithmSpec::VectorField);
    assert_eq!(algorithm("classic"), AlgorithmSpec::ClassicGodObject);
}

#[test]
fn a_scene_may_have_no_entities() {
    assert!(parsed("[[finger]]\n").entities.is_empty());
}

#[test]
fn fingers_and_entities_may_share_a_name() {
    let sphere = "shape = { kind = \"sphere\", radius_m = 1 }";
    parsed(&format!("[[finger]]\nname = \"a\"\n[[entity]]\nname = \"a\"\n{sphere}\n"));
}

#[test]
fn dotted_keys_and_inline_lists_say_the_same_as_tables() {
    let inline = "finger = [{}]\nentity = [{ shape = { kind = \"sphere\", radius_m = 2 } }]\n";
    let dotted = "[[finger]]\n[[entity]]\nshape.kind = \"sphere\"\nshape.radius_m = 2.0\n";
    assert_eq!(parsed(inline), parsed(dotted));
}

#[test]
fn a_plane_keeps_its_surface_whatever_the_length_of_its_normal() {
    // n . p <= c with n = (0, 2, 0), c = 0.1 is the half-space y <= 0.05.
    let written = "{ kind = \"plane\", normal = [0, 2, 0], offset_m = 0.1 }";
    assert_eq!(shape(written), plane([0.0, 1.0, 0.0], 0.05));
    // Lengths whose square over- or underflows; 3-4-5, so the unit normal is exact to rounding.
    for written in [
        "{ kind = \"plane\", normal = [3e200, 4e200, 0], offset_m = 5e200 }",
        "{ kind = \"plane\", normal = [3e-200, 4e-200, 0], offset_m = 5e-200 }",
    ] {
        let ShapeSpec::Plane { normal, offset_m } = shape(written) else { panic!("a plane") };
        assert!((normal.into_inner() - Vector3::new(0.6, 0.8, 0.0)).norm() < 1e-15);
        assert!((offset_m - 1.0).abs() < 1e-15);
    }
}

#[test]
fn a_quaternion_rounded_in_the_file_becomes_a_rotation() {
    let pose = entity("orientation_wxyz = [0.7071, 0.7071, 0, 0]").pose;
    let quarter_turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::FRAC_PI_2);
    // Both components are rounded alike, so the direction is exact but for floating point.
    assert!(pose.rotation.angle_to(&quarter_turn) < 1e-15);
    assert!((pose.rotation.norm() - 1.0).abs() < 1e-15);
}

#[test]
fn every_friction_model_of_this_version_is_read() {
    let friction = |table: &str| entity(&format!("friction = {{ {table} }}")).friction;
    assert_eq!(friction("model = \"none\""), FrictionSpec::None);
    assert_eq!(friction("model = \"coulomb\", mu = 0"), FrictionSpec::Coulomb { mu: 0.0 });
    assert_eq!(
        friction("model = \"stiction\", mu_s = 0.7, mu_d = 0.3"),
        FrictionSpec::Stiction { mu_s: 0.7, mu_d: 0.3 }
    );
    assert_eq!(
        friction("model = \"viscous\", mu_v_s_per_m = 2"),
        FrictionSpec::Viscous { mu_v_s_per_m: 2.0 }
    );
    assert_eq!(
        friction("model = \"coulomb-viscous\", mu = 0.5, mu_v_s_per_m = 2"),
        FrictionSpec::CoulombViscous { mu: 0.5, mu_v_s_per_m: 2.0 }
    );
}

#[test]
fn the_models_with_an_inner_state_are_read_with_their_documented_defaults() {
    let friction = |table: &str| entity(&format!("friction = {{ {table} }}")).friction;
    assert_eq!(
        friction("model = \"stribeck\", mu_s = 0.7, mu_d = 0.3, v_s_m_s = 0.02"),
        FrictionSpec::Stribeck { mu_s: 0.7, mu_d: 0.3, v_s_m_s: 0.02, mu_v_s_per_m: 0.0 }
    );
    assert_eq!(
        friction("model = \"karnopp\", mu_s = 0.7, mu_d = 0.3"),
        FrictionSpec::Karnopp { mu_s: 0.7, mu_d: 0.3, v_min_m_s: 0.005, mu_v_s_per_m: 0.0 }
    );
    assert_eq!(friction("model = \"dahl\", mu = 0.5"), FrictionSpec::Dahl { mu: 0.5 });
    let (mu_s, mu_d, v_s_m_s) = (0.7, 0.3, 0.01);
    assert_eq!(
        friction("model = \"lugre\", mu_s = 0.7, mu_d = 0.3"),
        FrictionSpec::LuGre { mu_s, mu_d, v_s_m_s, mu_v_s_per_m: 0.0, damping_n_s_per_m: 0.0 }
    );
    assert_eq!(
        friction(
            "model = \"lugre\", mu_s = 0.7, mu_d = 0.3, v_s_m_s = 1, mu_v_s_per_m = 2, damping_n_s_per_m = 3"
        ),
        FrictionSpec::LuGre { mu_s, mu_d, v_s_m_s: 1.0, mu_v_s_per_m: 2.0, damping_n_s_per_m: 3.0 }
    );
    assert_eq!(
        friction("model = \"curve\", speed_m_s = [0, 0.1], mu = [0.5, 0.2], mu_s = 0.7"),
        FrictionSpec::Curve { speed_m_s: vec![0.0, 0.1], mu: vec![0.5, 0.2], mu_s: 0.7 }
    );
    assert_eq!(
        friction("model = \"curve\", speed_m_s = [0.1], mu = [0.5]"),
        FrictionSpec::Curve { speed_m_s: vec![0.1], mu: vec![0.5], mu_s: 0.5 }
    );
    assert_eq!(
        friction("model = \"bristle\", mu = 0.5"),
        FrictionSpec::Bristle { mu: 0.5, bonds: 20, seed: 0 }
    );
    assert_eq!(
        friction("model = \"reset-integrator\", mu_s = 0.7, mu_d = 0.3"),
        FrictionSpec::ResetIntegrator { mu_s: 0.7, mu_d: 0.3, damping_n_s_per_m: 0.0 }
    );
    assert_eq!(
        friction("model = \"hayward\", mu = 0.5"),
        FrictionSpec::Hayward { mu: 0.5, stick_fraction: 0.5 }
    );
    assert_eq!(
        friction("model = \"fixed-cone\", friction_n = 2"),
        FrictionSpec::FixedCone { friction_n: 2.0, static_n: 2.0 }
    );
}

#[test]
fn numbers_may_be_written_in_every_way_toml_has() {
    for (written, newton_per_metre) in
        [("1_000", 1000.0), ("0x3e8", 1000.0), ("1e3", 1000.0), ("+1_000.5", 1000.5)]
    {
        let keys = format!("stiffness_n_per_m = {written}");
        assert_eq!(entity(&keys).stiffness_n_per_m, newton_per_metre);
    }
}

#[test]
fn a_hand_file_is_relative_to_the_scene_file() {
    let hand = |file: &str, hand: &str| {
        let text = format!("hand = \"{hand}\"\n[[finger]]\n");
        Scene::parse(&text, Path::new(file)).ok().and_then(|scene| scene.hand)
    };
    assert_eq!(hand("s.toml", "h.csv"), Some("h.csv".into()));
    assert_eq!(hand("/a/s.toml", "../h.csv"), Some("/a/../h.csv".into()));
    assert_eq!(hand("/a/s.toml", "/b/h.csv"), Some("/b/h.csv".into()));
}

#[test]
fn a_layout_gives_each_device_its_pose_and_the_others_identity() {
    let text = "[[device]]\nposition_m = [0.1, 0, 0]\norientation_wxyz = [0, 0, 1, 0]\n[[device]]\n";
    let layout = Layout::parse(text, Path::new("l.toml")).expect("nothing is wrong");
    // Turned half about y, a device 0.1 m to the right sees its own x axis point to the left.
    let tip = layout.pose(0) * Point3::new(0.03, 0.0, 0.0);
    assert!((tip - Point3::new(0.07, 0.0, 0.0)).norm() < 1e-15);
    assert_eq!(layout.pose(1), Isometry3::identity());
    assert_eq!(layout.pose(2), Isometry3::identity());
    assert_eq!(Layout::parse("", Path::new("l.toml")).expect("empty is fine"), Layout::default());
}

#[test]
fn every_committed_scene_is_in_order_and_its_hand_file_exists() {
    let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../config/scenes");
    let directories = [scenes.clone(), scenes.join("thesis"), scenes.join("kinds")];
    let files = directories.iter().flat_map(|directory| directory.read_dir().expect("the scenes"));
    let is_scene = |file: &PathBuf| file.extension().is_some_and(|ending| ending == "toml");
    for file in files.map(|entry| entry.expect("an entry").path()).filter(is_scene) {
        let scene = Scene::load(&file).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(Some(scene.name.as_str()), file.file_stem().and_then(|stem| stem.to_str()));
        assert!(scene.hand.is_none_or(|hand| hand.is_file()), "{}", file.display());
    }
}

/// How long a scene of so many entities of this shape takes to read, at best.
fn shortest_reading(shape: &str, entities: usize) -> Duration {
    let text = format!("[[finger]]\n{}", format!("[[entity]]\nshape = {{ {shape} }}\n").repeat(entities));
    let once = || {
        let begin = Instant::now();
        assert_eq!(Scene::parse(&text, Path::new("many.toml")).unwrap().entities.len(), entities);
        begin.elapsed()
    };
    (0..3).map(|_| once()).min().unwrap()
}

#[test]
fn ten_thousand_meshes_are_read_about_as_fast_as_ten_thousand_balls() {
    let meshes = shortest_reading("kind = \"mesh\", file = \"cube.obj\"", 10_000);
    let balls = shortest_reading("kind = \"sphere\", radius_m = 0.0123", 10_000);
    // Each mesh keeps its line for messages. Were the lines counted from the start of the file for each, it would
    // take more than ten times as long; four times leaves room for a busy machine.
    assert!(meshes < 4 * balls, "{meshes:?} for meshes, {balls:?} for balls");
}
