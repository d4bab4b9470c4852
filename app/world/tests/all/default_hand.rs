//! The committed default hand does what the default scene is there to show.
//!
//! Whether a contact sticks or slips is decided here by a slow and obvious friction model, not by
//! the one that renders: the god-object stays while the finger is within the static friction
//! circle (radius mu_s times depth), else follows on the rim of the dynamic one until it no longer
//! has to move.

use std::path::{Path, PathBuf};

use nalgebra::{Point3, Vector3};
use world::{FrictionSpec, Scene, SceneEntity, ShapeSpec};

use crate::script;

fn config(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../config").join(path)
}

fn default_scene() -> Scene {
    Scene::load(config("scenes/default.toml")).unwrap_or_else(|error| panic!("{error}"))
}

/// The file's positions of both fingers at every millisecond.
fn ticks() -> Vec<[Point3<f64>; 2]> {
    let rows: Vec<Vec<f64>> = script::csv().lines().skip(1).map(numbers).collect();
    let finger = |row: &[f64], f: usize| Point3::new(row[1 + 3 * f], row[2 + 3 * f], row[3 + 3 * f]);
    let between = |pair: &[Vec<f64>], ms: u32| {
        let s = f64::from(ms) / f64::from(script::ROW_MS);
        [0, 1].map(|f| finger(&pair[0], f) + (finger(&pair[1], f) - finger(&pair[0], f)) * s)
    };
    rows.windows(2)
        .flat_map(|pair| (0..script::ROW_MS).map(|ms| between(pair, ms)).collect::<Vec<_>>())
        .collect()
}

fn numbers(line: &str) -> Vec<f64> {
    line.split(',').map(|number| number.parse().expect("a number")).collect()
}

/// Outward normal and depth (above 0 inside) at `p`.
fn surface(entity: &SceneEntity, p: &Point3<f64>) -> (Vector3<f64>, f64) {
    let in_body = entity.pose.inverse_transform_point(p);
    let (normal, depth) = match entity.shape {
        ShapeSpec::Plane { normal, offset_m } => {
            (normal.into_inner(), offset_m - normal.dot(&in_body.coords))
        }
        ShapeSpec::Sphere { radius_m } => (in_body.coords.normalize(), radius_m - in_body.coords.norm()),
        _ => panic!("the default scene has other shapes"),
    };
    (entity.pose.rotation * normal, depth)
}

#[derive(Clone, Copy, PartialEq, Debug)]
enum Contact {
    Free,
    Stick,
    Slip,
}

/// Contact and force on the user of one finger on one entity, tick by tick.
fn felt(entity: &SceneEntity, way: impl Iterator<Item = Point3<f64>>) -> Vec<(Contact, f64)> {
    let FrictionSpec::Stiction { mu_s, mu_d } = entity.friction else { panic!("stiction is shown") };
    let (mut contact, mut god_object) = (Contact::Free, Point3::origin());
    way.map(|hip| {
        let (normal, depth) = surface(entity, &hip);
        let surface_point = hip + normal * depth;
        if depth <= 0.0 {
            contact = Contact::Free;
            return (contact, 0.0);
        }
        if contact == Contact::Free {
            (contact, god_object) = (Contact::Stick, surface_point);
        }
        let offset: Vector3<f64> = god_object - surface_point;
        let offset = offset - normal * normal.dot(&offset);
        let radius = depth * if contact == Contact::Stick { mu_s } else { mu_d };
        contact = if offset.norm() > radius * (1.0 + 1e-9) { Contact::Slip } else { Contact::Stick };
        let kept = if contact == Contact::Slip { offset * (mu_d * depth / offset.norm()) } else { offset };
        god_object = surface_point + kept;
        let (out, height) = surface(entity, &god_object);
        god_object += out * height;
        (contact, entity.stiffness_n_per_m * (god_object - hip).norm())
    })
    .collect()
}

fn finger_on_entity(finger: usize, entity: &str) -> Vec<(Contact, f64)> {
    let scene = default_scene();
    let entity = scene.entities.iter().find(|e| e.name == entity).expect("the entity");
    felt(entity, ticks().iter().map(|fingers| fingers[finger]))
}

const PAIRS: [(usize, &str); 2] = [(0, "ball"), (1, "table")];

fn changes(felt: &[(Contact, f64)], from: Contact, to: Contact) -> usize {
    felt.windows(2).filter(|pair| (pair[0].0, pair[1].0) == (from, to)).count()
}

#[test]
fn the_committed_hand_file_is_what_the_script_prints() {
    let committed = std::fs::read_to_string(config("hands/default.csv")).expect("the hand file");
    let same = committed == script::csv();
    assert!(same, "run: cargo run -p world --example default_hand > config/hands/default.csv");
}

#[test]
fn the_script_knows_the_scene_it_is_for() {
    let scene = default_scene();
    let ball = &scene.entities[1];
    assert_eq!(ball.shape, ShapeSpec::Sphere { radius_m: script::BALL_RADIUS_M });
    assert_eq!(ball.pose.translation.vector, Vector3::from(script::BALL_CENTRE_M));
    assert_eq!(
        scene.hand.and_then(|hand| hand.canonicalize().ok()),
        config("hands/default.csv").canonicalize().ok()
    );
    let starts: Vec<_> = scene.fingers.iter().map(|finger| finger.start_m).collect();
    // Rounded to nanometres on the way into the file.
    for (start, at_zero) in starts.iter().zip([script::on_ball(0.0), script::on_table(0.0)]) {
        assert!((start - at_zero).norm() < 1e-9, "{start} {at_zero}");
    }
}

#[test]
fn both_fingers_start_and_end_in_free_space() {
    for (finger, entity) in PAIRS {
        let felt = finger_on_entity(finger, entity);
        let at_rest = 100;
        assert!(
            felt[..at_rest].iter().chain(&felt[felt.len() - at_rest..]).all(|(c, _)| *c == Contact::Free)
        );
    }
    assert_eq!(changes(&finger_on_entity(1, "table"), Contact::Free, Contact::Stick), 2);
}

#[test]
fn each_finger_touches_its_own_entity_only() {
    assert!(finger_on_entity(0, "table").iter().all(|(contact, _)| *contact == Contact::Free));
    assert!(finger_on_entity(1, "ball").iter().all(|(contact, _)| *contact == Contact::Free));
}

#[test]
fn each_finger_both_sticks_and_slips_several_times() {
    for (finger, entity) in PAIRS {
        let felt = finger_on_entity(finger, entity);
        let count = |contact| felt.iter().filter(|(c, _)| *c == contact).count();
        assert!(count(Contact::Stick) > 1500, "{entity}: {}", count(Contact::Stick));
        assert!(count(Contact::Slip) > 1500, "{entity}: {}", count(Contact::Slip));
        assert!(changes(&felt, Contact::Stick, Contact::Slip) >= 4, "{entity}");
        assert!(changes(&felt, Contact::Slip, Contact::Stick) >= 4, "{entity}");
    }
}

#[test]
fn the_circle_on_the_table_stays_within_the_friction_circle() {
    // The seventh leg of the script, from 2.7 s to 3.7 s.
    let felt = finger_on_entity(1, "table");
    assert!(felt[2701..3700].iter().all(|(contact, _)| *contact == Contact::Stick));
}

#[test]
fn the_force_stays_within_what_a_desktop_device_can_give() {
    for (finger, entity) in PAIRS {
        let peak = finger_on_entity(finger, entity).iter().map(|(_, force)| *force).fold(0.0, f64::max);
        assert!((3.0..8.0).contains(&peak), "{entity}: {peak} N");
    }
}

#[test]
fn the_fingers_move_at_the_speed_of_a_hand() {
    let ticks = ticks();
    for f in [0, 1] {
        let speed_m_s = |pair: &[[Point3<f64>; 2]]| (pair[1][f] - pair[0][f]).norm() / 1e-3;
        let peak = ticks.windows(2).map(speed_m_s).fold(0.0, f64::max);
        assert!((0.1..0.2).contains(&peak), "f{f}: {peak} m/s");
    }
}
