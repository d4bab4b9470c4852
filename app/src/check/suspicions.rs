//! Numbers of a wrong unit, by what they would mean.
//!
//! Problem: lengths in millimetres, masses in grams and angles in degrees make a scene that can be run and in which nothing
//! is felt, or everything is thrown out.
//! Model: things as large as a house or finer than a hair, denser than any metal or lighter than air, farther away than any
//! arm reaches, or turning faster than a drill are told, with the number that was probably meant.

use super::measures::{Measures, short};
use crate::rig::{Rig, in_words};
use nalgebra::{Point3, Quaternion, Vector3};
use world::{Scene, ShapeSpec};

/// All of them.
pub(super) fn all(rig: &Rig, measures: &[Measures]) -> Vec<String> {
    let mut found: Vec<String> = measures.iter().filter_map(|it| length(rig, it)).collect();
    found.extend(measures.iter().filter_map(mass));
    found.extend(far(rig, measures));
    found.extend(fingers(&rig.scene));
    found.extend(rates(&rig.scene));
    found.extend(gravity(&rig.scene));
    found.truncate(MOST);
    found
}

fn length(rig: &Rig, it: &Measures) -> Option<String> {
    let (name, length_m) = (&it.name, it.length_m()?);
    if length_m >= HOUSE_M && !it.is_around {
        let instead = match file_of(rig, name) {
            Some(file) => format!("its file {file} may be in millimetres: give the shape `scale = 0.001`"),
            None => {
                format!("lengths are in metres: if millimetres were meant, write {}", short(length_m * 1e-3))
            }
        };
        return Some(format!("{name} is {} m long, as large as a house; {instead}", short(length_m)));
    }
    (length_m < HAIR_M)
        .then(|| format!("{name} is {} m long, finer than a hair; lengths are in metres", short(length_m)))
}

fn file_of(rig: &Rig, name: &str) -> Option<String> {
    let entity = rig.scene.entities.iter().find(|entity| entity.name == *name)?;
    match &entity.shape {
        ShapeSpec::Mesh(model) | ShapeSpec::Nurbs(model) => Some(model.file.display().to_string()),
        _ => None,
    }
}

fn mass(it: &Measures) -> Option<String> {
    let (name, mass_kg, density) = (&it.name, it.mass_kg?, it.density_kg_m3?);
    let told = format!("{name} has {} kg, {} kg/m^3", short(mass_kg), short(density));
    if density > DENSEST_KG_M3 {
        let grams = short(mass_kg * 1e-3);
        Some(format!(
            "{told}, denser than any metal; masses are in kilograms: if grams were meant, write {grams}"
        ))
    } else if density < AIR_KG_M3 && it.length_m()? < HOUSE_M {
        Some(format!("{told}, lighter than air; masses are in kilograms, densities in kg/m^3"))
    } else {
        None
    }
}

/// Nobody reaches it.
fn far(rig: &Rig, measures: &[Measures]) -> Option<String> {
    let starts: Vec<Point3<f64>> = rig.scene.fingers.iter().map(|finger| finger.start_m).collect();
    let paths = rig.hand.iter().flat_map(|hand| hand.bounds.iter().flatten().flatten());
    let fingers: Vec<Vector3<f64>> = starts.iter().map(|start| start.coords).chain(paths.copied()).collect();
    let distance_m = |it: &&Measures| {
        let half_m = it.size_m.map_or(f64::INFINITY, |size| 0.5 * Vector3::from(size).norm());
        let from = |finger: &Vector3<f64>| (Vector3::from(it.middle_m) - finger).norm() - half_m;
        fingers.iter().map(from).fold(f64::INFINITY, f64::min)
    };
    let names: Vec<String> =
        measures.iter().filter(|it| distance_m(it) > FAR_M).map(|it| it.name.clone()).collect();
    (!names.is_empty()).then(|| {
        format!("more than {FAR_M} m away from every finger: {}; places are in metres", in_words(&names))
    })
}

fn fingers(scene: &Scene) -> Vec<String> {
    let large = scene.fingers.iter().filter(|finger| finger.radius_m > THUMB_M);
    let told = large.map(|finger| {
        let radius_m = finger.radius_m;
        let instead = short(radius_m * 1e-3);
        format!(
            "finger {} has a radius of {} m; if millimetres were meant, write {instead}",
            finger.name,
            short(radius_m)
        )
    });
    told.collect()
}

/// Angles in degrees, and quaternions with their real part last.
fn rates(scene: &Scene) -> Vec<String> {
    let mut told = Vec::new();
    for entity in &scene.entities {
        let rate = entity.motion.map_or(0.0, |motion| motion.angular_velocity_rad_s.norm());
        if rate > DRILL_RAD_S {
            told.push(format!(
                "{} turns at {} rad/s, {} times a second; if degrees were meant, write {}",
                entity.name,
                short(rate),
                short(rate / std::f64::consts::TAU),
                short(rate.to_radians())
            ));
        }
        if *entity.pose.rotation.quaternion() == Quaternion::new(0.0, 0.0, 0.0, 1.0) {
            told.push(format!(
                "{} is turned by 180 degrees about z; if no turn was meant, orientation_wxyz is [1.0, 0.0, 0.0, 0.0], w first",
                entity.name
            ));
        }
    }
    told
}

fn gravity(scene: &Scene) -> Option<String> {
    let gravity = scene.gravity_m_s2.norm();
    (gravity > STRONGEST_M_S2).then(|| format!("gravity is {} m/s^2; on Earth it is 9.81", short(gravity)))
}

/// The longest side of what stands on a table, and more than twice that of the table.
const HOUSE_M: f64 = 10.0;
const HAIR_M: f64 = 5e-5;
/// Osmium has 22,600.
const DENSEST_KG_M3: f64 = 25_000.0;
const AIR_KG_M3: f64 = 1.2;
/// No arm reaches a tenth of it.
const FAR_M: f64 = 10.0;
/// A finger of a giant.
const THUMB_M: f64 = 0.2;
/// Five turns a second are more than fingers bring about; a drill has fifty.
const DRILL_RAD_S: f64 = 100.0;
/// Ten times the Earth's.
const STRONGEST_M_S2: f64 = 100.0;
/// More would hide the rest.
const MOST: usize = 20;
