//! The scene files of the thesis' own program, with the content of its figures 7.2 and 7.3.

use std::collections::BTreeSet;
use std::path::Path;

use nalgebra::Vector3;
use world::thesis::{Conversion, Converted, KEYS, ObjectKind, read_list, read_object};
use world::{MassSpec, Scene, SceneEntity, ShapeSpec};

const FIGURE_7_2: &str = include_str!("../../../../config/scenes/thesis/objects.ini");
const FIGURE_7_3: &str = include_str!("../../../../config/scenes/thesis/objects/Mesh_01.ini");

fn converted(kind: ObjectKind, text: &str) -> Converted {
    let object = read_object(text, Path::new("Thing.ini")).unwrap_or_else(|error| panic!("{error}"));
    let mut conversion = Conversion::new("thesis", "meshes/");
    conversion.add(kind, &object, &[]).unwrap_or_else(|error| panic!("{error}"));
    conversion.finish(true)
}

fn entity(text: &str) -> (SceneEntity, Vec<String>) {
    let converted = converted(ObjectKind::GameObject, text);
    let scene = Scene::parse(&converted.toml, Path::new("s.toml"));
    let mut scene = scene.unwrap_or_else(|error| panic!("{error}\n{}", converted.toml));
    (scene.entities.remove(0), converted.told)
}

fn refused(text: &str) -> String {
    let object = match read_object(text, Path::new("Thing.ini")) {
        Ok(object) => object,
        Err(error) => return error.to_string(),
    };
    Conversion::of_part("").add(ObjectKind::GameObject, &object, &[]).expect_err("it is wrong").to_string()
}

#[test]
fn figure_7_2_is_a_list_of_eight_objects_and_three_comments() {
    let list = read_list(FIGURE_7_2, Path::new("objects.ini")).expect("the figure");
    let names: Vec<_> = list.iter().map(|entry| (entry.line, entry.object.as_str())).collect();
    assert_eq!(
        names,
        [
            (2, "Camera_01"),
            (3, "EnvironmentMixed_01"),
            (5, "Light_01"),
            (6, "Sphere_01"),
            (7, "Mesh_01"),
            (8, "Mesh_02"),
            (9, "Mesh_03"),
            (10, "Phantom_01"),
            (11, "Phantom_02")
        ]
    );
    assert_eq!(list[0].kind, ObjectKind::Camera);
    assert_eq!(list[8].kind, ObjectKind::Phantom);
}

#[test]
fn figure_7_3_is_a_red_half_kilogram_cube_that_does_not_turn() {
    let (cube, told) = entity(FIGURE_7_3);
    assert_eq!(cube.name, "Mesh_01");
    let ShapeSpec::Mesh(mesh) = &cube.shape else { panic!("{:?}", cube.shape) };
    assert_eq!((mesh.file.as_path(), mesh.scale), (Path::new("meshes/cube.obj"), [1.0; 3]));
    assert_eq!(cube.pose.translation.vector, Vector3::new(0.3, 0.05, -0.5));
    assert_eq!(cube.pose.rotation.angle(), 0.0);
    let motion = cube.motion.expect("it has a mass");
    assert_eq!((motion.mass, motion.rotation_locked), (MassSpec::Mass(0.5), true));
    // InertiaY is not in the figure, and what is there fits no such cube.
    assert_eq!(motion.inertia_kg_m2, None);
    assert_eq!(cube.visuals.len(), 1);
    assert_eq!((cube.visuals[0].colour, &cube.visuals[0].shape), (Some([0.7, 0.0, 0.0, 0.25]), &None));
    assert_eq!(
        told,
        [
            "Thing.ini: a moment of inertia is missing: that of the shape and the mass is taken",
            "Thing.ini: Inputtable: at the window keys move whatever is chosen there, and orders move it; nothing has to be said for that",
            "no Phantom in the list: a finger was added, since a scene needs one",
        ]
    );
}

#[test]
fn the_manual_says_of_what_has_no_counterpart_what_a_conversion_says() {
    let manual = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/scenes.md");
    let manual = std::fs::read_to_string(manual).expect("the manual");
    let (_, told) = entity("Shape=Sphere\nRadius=1\nInputtable=True\n");
    let told = told.iter().find(|told| told.contains("Inputtable")).expect("it is told");
    assert!(
        told.contains("at the window keys move whatever is chosen there")
            && told.contains("nothing has to be said")
    );
    let said =
        "so is `Inputtable`, which needs none: at the window the arrow keys move whatever a click has chosen";
    assert!(manual.contains(said), "docs/scenes.md does not say: {said}");
    let keys = |list: &str| list.split(", ").map(str::to_owned).collect::<BTreeSet<_>>();
    let (_, rest) =
        manual.split_once("The thesis prints the keys of one object: `").expect("the list of keys");
    let printed = KEYS.iter().filter(|(_, _, is_printed)| *is_printed).flat_map(|(_, list, _)| keys(list));
    assert_eq!(keys(rest.split('`').next().expect("the list")), printed.collect());
}

#[test]
fn what_is_seen_and_what_is_felt_may_be_two_meshes() {
    let (thing, _) = entity("Mesh=fine.obj\nHapticMesh=coarse.obj\nScale=0.5\n");
    let file_of = |shape: &ShapeSpec| match shape {
        ShapeSpec::Mesh(mesh) => (mesh.file.display().to_string(), mesh.scale[0]),
        other => panic!("{other:?}"),
    };
    assert_eq!(file_of(&thing.shape), ("meshes/coarse.obj".into(), 0.5));
    assert_eq!(thing.visuals[0].shape.as_ref().map(file_of), Some(("meshes/fine.obj".into(), 0.5)));
}

#[test]
fn an_orientation_is_a_matrix_by_rows() {
    let (thing, _) = entity("Shape=Sphere\nRadius=1\nOrientation=0,0,1,0,1,0,-1,0,0\n");
    // A quarter turn about y takes x to -z. Rotations of lengths 1.
    assert!((thing.pose.rotation * Vector3::x() + Vector3::z()).norm() < 1e-15);
}

#[test]
fn every_parametric_shape_has_its_counterpart() {
    for (text, kind) in [
        ("Shape=Cube\nSize=1,2,3\n", "box"),
        ("Shape=Cylinder\nRadius=1\nLength=2\n", "cylinder"),
        ("Shape=Plane\nNormal=0,0,1\n", "plane"),
        ("Shape=Sphere\nRadius=1\n", "sphere"),
        ("Shape=Torus\nRingRadius=2\nTubeRadius=1\n", "torus"),
        ("Shape=Sphere\nRadius=1\nScale=2\n", "sphere"),
    ] {
        assert_eq!(entity(text).0.shape.kind(), kind, "{text}");
    }
}

#[test]
fn all_three_moments_are_taken_unless_no_body_has_them() {
    let moments = |x: &str| {
        let (thing, told) =
            entity(&format!("Shape=Sphere\nRadius=1\nMass=1\nInertiaX={x}\nInertiaY=1\nInertiaZ=2\n"));
        (thing.motion.and_then(|motion| motion.inertia_kg_m2), told.len() - 1)
    };
    assert_eq!(moments("2"), (Some([2.0, 1.0, 2.0]), 0));
    assert_eq!(moments("4"), (None, 1), "4 is more than 1 + 2");
}

#[test]
fn what_has_no_counterpart_stands_in_the_scene_as_a_comment() {
    let converted =
        converted(ObjectKind::GameObject, "Shape=Sphere\nRadius=1\nMesh=\n\nSmell=roses // and more\n");
    assert!(
        converted.told.iter().any(|told| told == "Thing.ini:5: Smell=roses has no counterpart"),
        "{converted:?}"
    );
    assert!(converted.toml.contains("# Thing.ini:5: Smell=roses has no counterpart\n"), "{}", converted.toml);
}

#[test]
fn lights_and_cameras_arrive() {
    let scene = |kind, text| {
        let converted = converted(kind, text);
        Scene::parse(&converted.toml, Path::new("s.toml"))
            .unwrap_or_else(|error| panic!("{error}\n{}", converted.toml))
    };
    let light =
        scene(ObjectKind::Light, "Direction=0,-1,0\nDiffuse=1,1,0.5\nCastShadow=False\n").lights.remove(0);
    assert_eq!((light.diffuse, light.casts_shadow), ([1.0, 1.0, 0.5], false));
    let ambient = scene(ObjectKind::Light, "LightType=Ambient\nAmbient=0.1,0.1,0.1\n").lights.remove(0);
    assert_eq!(ambient.ambient, [0.1; 3]);
    let camera = scene(ObjectKind::Camera, "FieldOfView=45\nNearPlane=0.1\nFarPlane=20\n").cameras.remove(0);
    assert_eq!((camera.field_of_view_deg, camera.near_m, camera.far_m), (45.0, 0.1, 20.0));
}

#[test]
fn what_is_wrong_is_told_with_file_and_line() {
    let list = |text| read_list(text, Path::new("objects.ini")).expect_err("it is wrong").to_string();
    assert_eq!(
        list("GameObject Mesh_01\nTeapot T_01\n"),
        "objects.ini:2: found \"Teapot\"; allowed: Camera, Environment, EnvironmentMesh, EnvironmentMixed, EnvironmentEntity, \
         Light, GameObject, Phantom"
    );
    assert_eq!(
        list("Phantom Phantom 03\n"),
        "objects.ini:1: found \"Phantom Phantom 03\"; allowed: a kind and an object file, such as `GameObject Mesh_01`"
    );
    assert_eq!(
        refused("Name\n"),
        "Thing.ini:1: found \"Name\"; allowed: `Key=Value`, or a comment behind //"
    );
    assert_eq!(
        refused("Mass=1\nMass=2\n"),
        "Thing.ini:2: found Mass, already given on line 1; allowed: each key once"
    );
    let ball = |rest: &str| refused(&format!("Shape=Sphere\nRadius=1\n{rest}"));
    assert_eq!(ball("Mass=-1\n"), "Thing.ini:3: found \"Mass=-1\"; allowed: a number above 0");
    assert_eq!(
        ball("Position=1,2\n"),
        "Thing.ini:3: found \"Position=1,2\"; allowed: 3 numbers between commas"
    );
    assert_eq!(
        ball("Orientation=1,0,0,0,1,0,0,0,2\n"),
        "Thing.ini:3: found \"Orientation=1,0,0,0,1,0,0,0,2\"; allowed: the 9 numbers of a rotation matrix, row by row"
    );
    assert_eq!(
        refused("Mass=1\n"),
        "Thing.ini: Shape is missing; allowed: Cube, Cylinder, Plane, Sphere, Torus; or a Mesh or HapticMesh"
    );
}
