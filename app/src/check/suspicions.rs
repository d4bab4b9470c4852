//! Numbers of a wrong unit, by what they would mean.
//!
//! Problem: lengths in millimetres, masses in grams, times in milliseconds and angles in degrees make a scene that can be
//! run and in which nothing is felt, or everything is thrown out.
//! Model: things as large as a house or finer than a hair, denser than any metal or lighter than air, farther away than any
//! arm reaches, turning faster than a drill, or written down twice a second at most while hardly moving are told, with the
//! number that was probably meant.

#![allow(non_snake_case)] // Frames are capital letters.

use super::measures::{Measures, short};
use super::remainder::Remainder;
use crate::rig::{Rig, in_words};
use nalgebra::{Quaternion, Vector3};
use world::{MassSpec, Scene, SceneEntity, ShapeSpec};

/// All of them.
pub(super) fn all(rig: &Rig, measures: &[Measures]) -> Vec<String> {
    let measured = || rig.scene.entities.iter().zip(measures);
    let mut found: Vec<String> = measured().filter_map(|(spec, it)| length(spec, it)).collect();
    found.extend(measures.iter().filter_map(not_drawn));
    found.extend(measures.iter().filter_map(mass));
    found.extend(measured().flat_map(|(spec, it)| turning(spec, it)));
    found.extend(measured().filter_map(|(spec, it)| spread(spec, it)));
    found.extend(densities(&rig.scene));
    found.extend(far(rig, measures));
    found.extend(fingers(&rig.scene));
    found.extend(starts(&rig.scene));
    found.extend(of_the_hand(rig));
    found.extend(devices(rig));
    found.extend(rates(&rig.scene));
    found.extend(gravity(&rig.scene));
    found
}

/// Those of the hand file's numbers.
pub(super) fn of_the_hand(rig: &Rig) -> Vec<String> {
    let mut found = paths(rig);
    found.extend(times(rig));
    found
}

/// Of each thing, whether one of them is about its size, its mass or its place.
pub(super) fn suspected(rig: &Rig, measures: &[Measures]) -> Vec<bool> {
    let boxes = reached(rig);
    let is_suspected = |(spec, it): (&SceneEntity, &Measures)| {
        length(spec, it).is_some() || mass(it).is_some() || is_far(it, &boxes)
    };
    rig.scene.entities.iter().zip(measures).map(is_suspected).collect()
}

fn length(spec: &SceneEntity, it: &Measures) -> Option<String> {
    let (name, length_m) = (&it.name, it.length_m()?);
    if length_m >= HOUSE_M && !it.is_around {
        let instead = match file_of(spec) {
            Some(file) => format!("its file {file} may be in millimetres: give the shape `scale = 0.001`"),
            None => match keys_in_millimetres(&spec.shape) {
                Some(keys) => format!("lengths are in metres: if millimetres were meant, write {keys}"),
                None => "lengths are in metres".to_owned(),
            },
        };
        return Some(format!("{name} is {} m long, as large as a house; {instead}", short(length_m)));
    }
    (length_m < HAIR_M)
        .then(|| format!("{name} is {} m long, finer than a hair; lengths are in metres", short(length_m)))
}

fn not_drawn(it: &Measures) -> Option<String> {
    let (name, remainder) = (&it.name, it.undrawn?);
    let why = "of a difference the first child is what the others are taken away from, and all children of an intersection \
               have to meet";
    Some(match remainder {
        Remainder::Nothing => format!("of {name} nothing is left, and nobody feels it; {why}"),
        Remainder::Something => format!("{name} is felt but not drawn, for all of it is too thin"),
        Remainder::Unknown => {
            format!("of {name} nothing is drawn, for nothing is left or all of it is too thin; {why}")
        }
    })
}

/// The keys that give a shape its size, with the values that they have if millimetres were meant.
fn keys_in_millimetres(shape: &ShapeSpec) -> Option<String> {
    let key = |(name, length_m): (&str, f64)| format!("`{name} = {}`", short(length_m * 1e-3));
    let keys = |keys: &[(&str, f64)]| keys.iter().copied().map(key).collect::<Vec<_>>().join(", ");
    let list = |name: &str, lengths_m: &[f64; 3]| {
        format!("`{name} = [{}]`", lengths_m.map(|length_m| short(length_m * 1e-3)).join(", "))
    };
    Some(match shape {
        ShapeSpec::Box { size_m } => list("size_m", size_m),
        ShapeSpec::Ellipsoid { radii_m } => list("radii_m", radii_m),
        ShapeSpec::Sphere { radius_m } => keys(&[("radius_m", *radius_m)]),
        ShapeSpec::Capsule { radius_m, length_m } | ShapeSpec::Cylinder { radius_m, length_m } => {
            keys(&[("radius_m", *radius_m), ("length_m", *length_m)])
        }
        ShapeSpec::Cone { radius_bottom_m, radius_top_m, length_m } => keys(&[
            ("radius_bottom_m", *radius_bottom_m),
            ("radius_top_m", *radius_top_m),
            ("length_m", *length_m),
        ]),
        ShapeSpec::Torus { ring_radius_m, tube_radius_m } => {
            keys(&[("ring_radius_m", *ring_radius_m), ("tube_radius_m", *tube_radius_m)])
        }
        _ => return None,
    })
}

fn file_of(spec: &SceneEntity) -> Option<String> {
    match &spec.shape {
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

/// Resistance to rolling and spinning as a number, as it stands in tables: it is a length.
fn turning(spec: &SceneEntity, it: &Measures) -> Vec<String> {
    let Some(length_m) = it.length_m() else { return Vec::new() };
    let lengths = [
        ("rolling_friction_m", spec.rolling_friction_m),
        ("torsional_friction_m", spec.torsional_friction_m),
    ];
    let beyond = lengths.into_iter().filter(|(_, value_m)| *value_m > 0.5 * length_m);
    let told = beyond.map(|(key, value_m)| {
        format!(
            "{}: {key} is {} m, larger than it is itself, and it will hardly turn; it is a length, of tenths of \
             millimetres: of a coefficient of rolling, that times the radius, {}",
            it.name,
            short(value_m),
            short(value_m * 0.5 * length_m)
        )
    });
    told.collect()
}

/// A centre of mass that is not in the box around it, and moments that no mass in that box has.
fn spread(spec: &SceneEntity, it: &Measures) -> Option<String> {
    let (motion, size_m, mass_kg) = (spec.motion?, Vector3::from(it.size_m?), it.mass_kg?);
    let middle_B = spec.pose.inverse_transform_point(&it.middle_m.into()).coords;
    let centre_B = motion.centre_of_mass_m.map_or(middle_B, Vector3::from);
    let from_middle_m = (centre_B - middle_B).abs();
    let outside_m = (from_middle_m - size_m * 0.5).max();
    if outside_m > 1e-6 * size_m.max() {
        return Some(format!(
            "{}: its centre of mass is {} m outside of it; centre_of_mass_m is in metres, in the frame of the entity",
            it.name,
            short(outside_m)
        ));
    }
    // All of it in the corner that is farthest away.
    let squares_m2 = (from_middle_m + size_m * 0.5).map(|part_m| part_m * part_m);
    let axis = |axis: usize| {
        let most = mass_kg * (squares_m2.sum() - squares_m2[axis]);
        let moment = motion.inertia_kg_m2?[axis];
        (moment > most).then(|| {
                format!(
                    "{}: inertia_kg_m2 about {} is {}, more than {}, which is all of its mass at its farthest corner; if \
                     kg mm^2 were meant, write {}",
                    it.name,
                    ["x", "y", "z"][axis],
                    short(moment),
                    short(most),
                    short(1e-6 * moment)
                )
            })
    };
    (0..3).find_map(axis)
}

/// Densities in grams per cubic centimetre.
fn densities(scene: &Scene) -> Vec<String> {
    let told = scene.entities.iter().filter_map(|entity| {
        let MassSpec::Density(density) = entity.motion?.mass else { return None };
        let name = &entity.name;
        // What is lighter than air is told already.
        (AIR_KG_M3..1e-3 * DENSEST_KG_M3).contains(&density).then(|| {
            format!(
                "{name} has {} kg/m^3, as light as foam; densities are in kg/m^3: if g/cm^3 were meant, write {}",
                short(density),
                short(1e3 * density)
            )
        })
    });
    told.collect()
}

/// Nobody reaches it.
fn far(rig: &Rig, measures: &[Measures]) -> Option<String> {
    let boxes = reached(rig);
    let names: Vec<String> =
        measures.iter().filter(|it| is_far(it, &boxes)).map(|it| it.name.clone()).collect();
    (!names.is_empty()).then(|| {
        format!("more than {FAR_M} m away from every finger: {}; places are in metres", in_words(&names))
    })
}

/// Where fingers begin and go: opposite corners (m).
fn reached(rig: &Rig) -> Vec<[Vector3<f64>; 2]> {
    let starts = rig.scene.fingers.iter().map(|finger| [finger.start_m.coords; 2]);
    let paths = rig.hand.iter().flat_map(|hand| hand.bounds.iter().copied().flatten());
    starts.chain(paths).collect()
}

fn is_far(it: &Measures, boxes: &[[Vector3<f64>; 2]]) -> bool {
    let half_m = it.size_m.map_or(f64::INFINITY, |size| 0.5 * Vector3::from(size).norm());
    let middle = Vector3::from(it.middle_m);
    let from = |[least, most]: &[Vector3<f64>; 2]| (middle - middle.sup(least).inf(most)).norm() - half_m;
    boxes.iter().map(from).fold(f64::INFINITY, f64::min) > FAR_M
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

/// Fingers that begin where no arm reaches.
fn starts(scene: &Scene) -> Vec<String> {
    let far = scene.fingers.iter().filter(|finger| finger.start_m.coords.amax() > FAR_M);
    let told = far.map(|finger| {
        let [x, y, z] = finger.start_m.coords.map(short).into();
        format!(
            "finger {} begins at ({x}, {y}, {z}) m, farther than an arm reaches; places are in metres: if millimetres were \
             meant, divide them by 1000",
            finger.name
        )
    });
    told.collect()
}

/// Hands that go farther than arms are long, or are elsewhere.
fn paths(rig: &Rig) -> Vec<String> {
    let Some(hand) = &rig.hand else { return Vec::new() };
    let told = rig.scene.fingers.iter().zip(&hand.bounds).filter_map(|(finger, bounds)| {
        let [least, most] = (*bounds)?;
        let (side_m, away_m) = ((most - least).max(), least.amax().max(most.amax()));
        let found = if side_m > ARM_M {
            format!("goes along {} m", short(side_m))
        } else if away_m > FAR_M {
            format!("goes as far as {} m from the origin", short(away_m))
        } else {
            return None;
        };
        Some(format!(
            "finger {} {found} in {}, farther than an arm reaches; places are in metres: if millimetres were meant, divide \
             them by 1000",
            finger.name,
            hand.path.display()
        ))
    });
    told.collect()
}

/// Times in milliseconds.
fn times(rig: &Rig) -> Option<String> {
    let hand = rig.hand.as_ref()?;
    let (duration_s, rows) = (hand.duration_s, hand.rows);
    let is_sparse = duration_s >= SLOW_S * rows as f64 && (rows >= MANY_ROWS || duration_s >= LONG_S);
    let sides_m = hand.bounds.iter().flatten().map(|[least, most]| (most - least).max());
    let is_slow = is_sparse && sides_m.fold(0.0, f64::max) < CREEP_M_S * duration_s;
    is_slow.then(|| {
        let (file, duration_s) = (hand.path.display(), short(duration_s));
        format!(
            "the hand takes {duration_s} s for {rows} rows in {file}; times are in seconds: if milliseconds were meant, divide \
             them by 1000"
        )
    })
}

/// Devices that a layout puts where no hand reaches them.
fn devices(rig: &Rig) -> Vec<String> {
    if rig.layout.is_none() {
        return Vec::new();
    }
    let told = (0..rig.device_count()).filter_map(|device| {
        let place = rig.base_in_world(device).translation.vector;
        let [x, y, z] = [place.x, place.y, place.z].map(short);
        let instead = [place.x, place.y, place.z].map(|length_m| short(length_m * 1e-3)).join(", ");
        (place.norm() > FAR_M).then(|| {
            format!(
                "device {device} stands at ({x}, {y}, {z}) m, farther away than any arm reaches; places are in metres: if \
                 millimetres were meant, it is at ({instead})"
            )
        })
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
/// Nobody writes down more slowly how a hand moves.
const SLOW_S: f64 = 0.5;
/// Hands that explore go the whole of their way several times faster.
const CREEP_M_S: f64 = 2e-3;
/// Fewer may be written by hand.
const MANY_ROWS: usize = 50;
/// Longer than what is written by hand.
const LONG_S: f64 = 600.0;
/// No arm reaches a tenth of it.
const FAR_M: f64 = 10.0;
/// Both arms stretched out are less.
const ARM_M: f64 = 3.0;
/// A finger of a giant.
const THUMB_M: f64 = 0.2;
/// Five turns a second are more than fingers bring about; a drill has fifty.
const DRILL_RAD_S: f64 = 100.0;
/// Ten times the Earth's.
const STRONGEST_M_S2: f64 = 100.0;
