//! What fields, guides, surfaces and materials that are in order turn into.

use std::path::Path;

use haptics::Material;
use nalgebra::{Isometry3, Vector3};
use world::{
    FieldKindSpec, FrictionSpec, MagnetismSpec, Scene, SceneEntity, ShapeSpec, TrackSpec, VibrationSpec,
};

fn parsed(text: &str) -> Scene {
    Scene::parse(&format!("[[finger]]\n{text}\n"), Path::new("s.toml"))
        .unwrap_or_else(|error| panic!("{error}"))
}

fn entity(keys: &str) -> SceneEntity {
    parsed(&format!("[[entity]]\nshape = {{ kind = \"sphere\", radius_m = 1 }}\n{keys}")).entities.remove(0)
}

#[test]
fn a_scene_without_effects_has_none() {
    let scene = parsed("[[entity]]\nshape = { kind = \"sphere\", radius_m = 1 }");
    assert!(scene.fields.is_empty() && scene.guides.is_empty());
    let entity = &scene.entities[0];
    assert_eq!((entity.material, entity.magnetism, entity.vibration), (None, None, None));
}

#[test]
fn every_key_of_a_field_arrives() {
    let scene = parsed(
        r#"
        [[field]]
        kind = "viscous"
        damping_n_s_per_m = [1, 2.5, 0]
        shape = { kind = "box", size_m = [0.1, 0.2, 0.3] }
        position_m = [1, 2, 3]
        orientation_wxyz = [0, 1, 0, 0]
        rim_m = 0.01
        device_mass_kg = 0.5
        [[field]]
        kind = "inertial"
        mass_kg = 0.2
        [[field]]
        kind = "constant"
        force_n = [0, -1, 0]
        [[field]]
        kind = "viscous"
        damping_n_s_per_m = 2
        "#,
    );
    let field = &scene.fields[0];
    assert_eq!(field.line, 3);
    assert_eq!(field.kind, FieldKindSpec::Viscous { damping_n_s_per_m: [1.0, 2.5, 0.0] });
    assert_eq!(field.shape, Some(ShapeSpec::Box { size_m: [0.1, 0.2, 0.3] }));
    assert_eq!(field.pose.translation.vector, Vector3::new(1.0, 2.0, 3.0));
    assert_eq!(field.pose.rotation.i, 1.0);
    assert_eq!((field.rim_m, field.device_mass_kg), (0.01, 0.5));
    let field = &scene.fields[1];
    assert_eq!(field.kind, FieldKindSpec::Inertial { mass_kg: 0.2, cutoff_hz: 10.0 });
    assert_eq!((field.shape.as_ref(), field.pose), (None, Isometry3::identity()));
    assert_eq!((field.rim_m, field.device_mass_kg), (0.005, 0.03));
    assert_eq!(scene.fields[2].kind, FieldKindSpec::Constant { force_n: -Vector3::y() });
    assert_eq!(scene.fields[3].kind, FieldKindSpec::Viscous { damping_n_s_per_m: [2.0; 3] });
}

#[test]
fn every_key_of_a_guide_arrives() {
    let scene = parsed(
        r#"
        [[guide]]
        kind = "line"
        point_m = [0, 0.1, 0]
        direction = [0, 0, 2]
        stiffness_n_per_m = 300
        damping_n_s_per_m = 1
        deadband_m = 0.001
        capture_m = 0.004
        break_away_n = 2.5
        force_limit_n = 3
        device_mass_kg = 0.1
        [[guide]]
        kind = "plane"
        point_m = [0, 0.1, 0]
        normal = [0, 3, 0]
        [[guide]]
        kind = "segment"
        from_m = [0, 0, 0]
        to_m = [0.1, 0, 0]
        [[guide]]
        kind = "path"
        points_m = [[0, 0, 0], [0.1, 0, 0], [0.1, 0.1, 0]]
        "#,
    );
    let guide = &scene.guides[0];
    assert_eq!(guide.line, 3);
    let TrackSpec::Line { point_m, direction } = &guide.track else { panic!("{guide:?}") };
    assert_eq!((point_m, direction.into_inner()), (&Vector3::new(0.0, 0.1, 0.0), Vector3::z()));
    assert_eq!((guide.stiffness_n_per_m, guide.damping_n_s_per_m, guide.deadband_m), (300.0, 1.0, 0.001));
    assert_eq!((guide.capture_m, guide.break_away_n), (Some(0.004), Some(2.5)));
    assert_eq!((guide.force_limit_n, guide.device_mass_kg), (3.0, 0.1));
    let guide = &scene.guides[1];
    assert!(matches!(guide.track, TrackSpec::Plane { normal, .. } if normal.into_inner() == Vector3::y()));
    assert_eq!((guide.stiffness_n_per_m, guide.damping_n_s_per_m, guide.deadband_m), (500.0, 2.0, 0.0));
    assert_eq!((guide.capture_m, guide.break_away_n, guide.force_limit_n), (None, None, 5.0));
    assert_eq!(scene.guides[2].track, TrackSpec::Path(vec![Vector3::zeros(), Vector3::x() * 0.1]));
    assert!(matches!(&scene.guides[3].track, TrackSpec::Path(points) if points.len() == 3));
}

#[test]
fn a_surfaces_effects_arrive() {
    let entity = entity(
        "magnetism = { force_n = 0.5, distance_m = 0.02 }\nvibration = { frequency_hz = 150, amplitude_n = 0.3 }",
    );
    assert_eq!(entity.magnetism, Some(MagnetismSpec { force_n: 0.5, distance_m: 0.02 }));
    let vibration = VibrationSpec { frequency_hz: 150.0, amplitude_n: 0.3, full_load_n: 1.0 };
    assert_eq!(entity.vibration, Some(vibration));
    let strong = self::entity("vibration = { frequency_hz = 150, amplitude_n = 2 }").vibration.unwrap();
    assert_eq!(strong.full_load_n, 2.0, "it never pulls");
}

#[test]
fn a_material_fills_in_what_the_entity_does_not_say() {
    for material in Material::ALL {
        let entity = entity(&format!("material = \"{}\"", material.name));
        assert_eq!(entity.material, Some(material.name));
        assert_eq!(entity.stiffness_n_per_m, material.stiffness_n_per_m);
        assert_eq!(entity.damping_n_s_per_m, material.damping_n_s_per_m);
        let friction = FrictionSpec::Stiction { mu_s: material.mu_s, mu_d: material.mu_d };
        assert_eq!(entity.friction, friction);
    }
    let entity = entity(
        "material = \"rubber\"\nstiffness_n_per_m = 333\nfriction = { model = \"coulomb\", mu = 0.1 }\n\
         damping_n_s_per_m = 0",
    );
    assert_eq!((entity.stiffness_n_per_m, entity.damping_n_s_per_m), (333.0, 0.0), "what it says wins");
    assert_eq!(entity.friction, FrictionSpec::Coulomb { mu: 0.1 });
    let bare = self::entity("material = \"rubber\"\nfriction = { model = \"none\" }");
    assert_eq!(bare.friction, FrictionSpec::None);
    assert_eq!(bare.stiffness_n_per_m, Material::named("rubber").unwrap().stiffness_n_per_m);
}
