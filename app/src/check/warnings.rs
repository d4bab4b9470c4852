//! What runs, but hardly as meant.

use super::{contacts, explicit, near, together};
use crate::rig::{Rig, in_words};
use crate::study::stiffness::bounds::Theory;
use crate::study::stiffness::case::{Axis, Case, Hand, Mode};
use crate::study::stiffness::search::Found;
use crate::study::stiffness::trial::Bench;
use haptics::{Door, Entity, Finger, Hip, Limits, MOST_FORCE_N, Passage, SLAB_M};
use io_driver::sim::hand::model_file::Firmness;
use physics::BroadPhase;
use std::collections::BTreeMap;
use std::path::Path;
use world::model;
use world::{Scene, SceneEntity, ShapeSpec};

/// All of them.
pub(super) fn all(rig: &Rig, whole: &Scene, entities: &[Entity]) -> Vec<String> {
    let mut stands = Stands::of(rig);
    let mut warnings = too_stiff(rig, &mut stands);
    warnings.extend(too_damped(rig));
    warnings.extend(too_loud(rig));
    warnings.extend(sways(rig, entities));
    warnings.extend(together::too_much(rig, entities, &mut stands));
    let boxes = BroadPhase::new(entities);
    let pairs = near::pairs(rig, entities, &boxes);
    warnings.extend(contacts::all(rig, entities, &pairs, &boxes));
    warnings.extend(explicit::all(rig, entities, &pairs));
    warnings.extend(inside(rig, entities));
    warnings.extend(closed(rig, entities));
    warnings.extend(idle_faces(rig));
    warnings.extend(unseen(whole));
    let unused = whole.templates.iter().filter(|template| template.entities == 0);
    warnings.extend(unused.map(|template| format!("no entity is made from template {}", template.name)));
    warnings
}

/// Tables of faces that change nothing.
fn idle_faces(rig: &Rig) -> Vec<String> {
    let mut told: Vec<String> = Vec::new();
    for faces in rig.idle_faces() {
        let line = format!(
            "{}: no face is left for {}: tables before it have all that it names; put it before them, or leave it out",
            faces.at,
            in_words(&faces.of)
        );
        // Several entities may be made of one table.
        if !told.contains(&line) {
            told.push(line);
        }
    }
    told
}

/// Surface that fingers feel: of an entity, or of faces of one with another material.
struct Surface {
    name: String,
    stiffness_n_per_m: f64,
    damping_n_s_per_m: f64,
}

fn surfaces(rig: &Rig) -> impl Iterator<Item = Surface> {
    let felt = rig.scene.entities.iter().filter(|entity| entity.is_haptic);
    felt.flat_map(|entity| {
        let whole = (entity.name.clone(), entity.stiffness_n_per_m, entity.damping_n_s_per_m);
        let faces = entity.faces.iter().map(|faces| {
            let name = format!("{} of {}", in_words(&faces.of), entity.name);
            (name, faces.stiffness_n_per_m, faces.damping_n_s_per_m)
        });
        let all = std::iter::once(whole).chain(faces);
        all.map(|(name, stiffness_n_per_m, damping_n_s_per_m)| Surface {
            name,
            stiffness_n_per_m,
            damping_n_s_per_m,
        })
    })
}

/// Against what the sampled linear loop stands, with a Premium held lightly that is answered in the same tick.
fn too_stiff(rig: &Rig, stands: &mut Stands) -> Vec<String> {
    let mut beyond: BTreeMap<u64, Vec<String>> = BTreeMap::new();
    for Surface { name, stiffness_n_per_m, damping_n_s_per_m } in surfaces(rig) {
        if stands.limit(damping_n_s_per_m).is_some_and(|limit| stiffness_n_per_m > limit) {
            let named = format!("{name} ({stiffness_n_per_m} N/m)");
            beyond.entry(damping_n_s_per_m.to_bits()).or_default().push(named);
        }
    }
    let rate_hz = 1e9 / rig.period_ns as f64;
    let told = beyond.into_iter().filter_map(|(damping, names)| {
        let (limit, damping) = (stands.limit(f64::from_bits(damping))?, f64::from_bits(damping));
        Some(format!(
            "{} may buzz: at {rate_hz} Hz and {damping} N s/m a lightly held Premium stands {limit:.0} N/m by the linear \
             loop; `passivity` of the finger keeps it quiet",
            in_words(&names)
        ))
    });
    told.collect()
}

/// Things that two fingers hold swing between them, and less by e in `m / b`; more damping than the loop stands is no remedy.
fn sways(rig: &Rig, entities: &[Entity]) -> Option<String> {
    let limit = rig.limits(Limits::DEFAULT_DEVICE_MASS_KG).ok()?.damping_n_s_per_m();
    let long = |(index, mass_kg): (usize, f64)| {
        let spec = &rig.scene.entities[index];
        let damping = spec.damping_n_s_per_m;
        let is_long = mass_kg > MOST_SWAYING_S * damping && damping < 0.5 * limit;
        (spec.is_haptic && is_long).then_some((spec, mass_kg))
    };
    let all: Vec<_> = rig.masses(entities).filter_map(long).collect();
    let &(spec, mass_kg) = all.first()?;
    let lasts = |(spec, mass_kg): &(&SceneEntity, f64)| match spec.damping_n_s_per_m {
        0.0 => format!("{} (for ever)", spec.name),
        damping => format!("{} ({:.0} s)", spec.name, mass_kg / damping),
    };
    let names: Vec<_> = all.iter().map(lasts).collect();
    // Down to a tenth, so that it is stable as it is written.
    let more = ((mass_kg / SWAYING_S).min(limit) * 10.0).floor() / 10.0;
    Some(format!(
        "{} may swing between two fingers, less by a factor e after so long: {} N s/m are little for {mass_kg} kg; \
         `damping_n_s_per_m = {more:.1}` is more",
        in_words(&names),
        spec.damping_n_s_per_m
    ))
}

/// By the limit that effects' damping is refused above.
fn too_damped(rig: &Rig) -> Option<String> {
    let limit = rig.limits(Limits::DEFAULT_DEVICE_MASS_KG).ok()?.damping_n_s_per_m();
    let beyond = surfaces(rig).filter(|surface| surface.damping_n_s_per_m > limit);
    let named = |surface: Surface| format!("{} ({} N s/m)", surface.name, surface.damping_n_s_per_m);
    let names: Vec<String> = beyond.map(named).collect();
    let (rate_hz, mass_kg) = (1e9 / rig.period_ns as f64, Limits::DEFAULT_DEVICE_MASS_KG);
    (!names.is_empty()).then(|| {
        format!(
            "{} may swing: at {rate_hz} Hz a damping of {limit:.1} N s/m is stable on a device of {mass_kg} kg at its tip",
            in_words(&names)
        )
    })
}

/// By what one field may pull.
fn too_loud(rig: &Rig) -> Option<String> {
    let felt = rig.scene.entities.iter().filter(|entity| entity.is_haptic);
    let beyond = felt.filter_map(|entity| {
        let amplitude_n = entity.vibration.as_ref()?.amplitude_n;
        (amplitude_n > MOST_FORCE_N).then(|| format!("{} ({amplitude_n} N)", entity.name))
    });
    let names: Vec<String> = beyond.collect();
    (!names.is_empty()).then(|| {
        format!(
            "{} may hum too hard: a vibration of more than {MOST_FORCE_N:.1} N is more than a desktop device renders",
            in_words(&names)
        )
    })
}

/// What stiffness the loop stands, by the damping of what is touched.
pub(super) struct Stands {
    period_ns: u64,
    known: BTreeMap<u64, Option<f64>>,
}

impl Stands {
    fn of(rig: &Rig) -> Self {
        Self { period_ns: rig.period_ns, known: BTreeMap::new() }
    }

    /// `None`: nobody knows, or there is none.
    pub(super) fn limit(&mut self, damping_n_s_per_m: f64) -> Option<f64> {
        let period_ns = self.period_ns;
        *self.known.entry(damping_n_s_per_m.to_bits()).or_insert_with(|| limit(period_ns, damping_n_s_per_m))
    }
}

fn limit(period_ns: u64, damping_n_s_per_m: f64) -> Option<f64> {
    let bench = Bench::new(Path::new("premium-1.5"), Axis::Y, [1e-3, 1e-3]).ok()?;
    let hand = Hand { model: "pen-grip".into(), firmness: Firmness::Light };
    let case = Case { mode: Mode::SameTick, rate_hz: 1e9 / period_ns as f64, damping_n_s_per_m, hand };
    match Theory::of(&bench, &case).ok()?.linear {
        Found::Limit(limit) => Some(limit),
        Found::None => Some(0.0),
        Found::All => None,
    }
}

/// Fingers that begin inside of something: they are pushed out as the run begins.
fn inside(rig: &Rig, entities: &[Entity]) -> Vec<String> {
    let touched = |finger: &world::SceneFinger| {
        let mut probe =
            Finger::new(finger.radius_m, entities.len()).ok()?.within(rig.space(finger.within.as_ref()));
        let hip = Hip { position_W: finger.start_m.coords, velocity_W: None };
        probe.step(entities, hip, 1e-3);
        let names: Vec<String> =
            probe.contacts().map(|contact| rig.scene.entities[contact.entity].name.clone()).collect();
        (!names.is_empty()).then(|| format!("finger {} starts inside of {}", finger.name, in_words(&names)))
    };
    // A hand that says otherwise puts it elsewhere at once.
    let rests = |(index, _): &(usize, &world::SceneFinger)| {
        rig.hand.as_ref().is_none_or(|hand| hand.bounds.get(*index).copied().flatten().is_none())
    };
    rig.scene.fingers.iter().enumerate().filter(rests).filter_map(|(_, finger)| touched(finger)).collect()
}

/// Doors whose middle nobody comes through.
fn closed(rig: &Rig, entities: &[Entity]) -> Vec<String> {
    let by_whom = |door: &Door| {
        let [front, behind] = door.spaces();
        let by = |(space, height_m): (u32, f64)| {
            let mut finger = Finger::new(0.0, entities.len()).ok()?.within(space);
            let mut passage = Passage::new(std::slice::from_ref(door));
            for height_m in [height_m, -height_m] {
                let step =
                    |finger: &mut Finger| finger.step(entities, &door.before_W(entities, height_m), 1e-3);
                passage.step(&mut finger, (entities, std::slice::from_ref(door)), 1e-3, |_| false, step);
                if let Some(contact) = finger.contacts().next() {
                    return Some(contact.entity);
                }
            }
            None
        };
        [(front, TRIED_M), (behind, -TRIED_M)].into_iter().find_map(by)
    };
    let told = rig.doors().flatten().filter_map(|door| {
        let name = |entity: usize| &rig.scene.entities[entity].name;
        Some(format!("the door of {} is closed by {}", name(door.hull()), name(by_whom(&door)?)))
    });
    told.collect()
}

/// Models that are only seen are not loaded for a run; the window will want them.
fn unseen(whole: &Scene) -> Vec<String> {
    let mut files = BTreeMap::new();
    for entity in &whole.entities {
        // What is felt is refused, and not only warned of.
        let of_itself = (!entity.is_met() && entity.motion.is_none()).then_some(&entity.shape);
        let shapes = entity.visuals.iter().filter_map(|visual| visual.shape.as_ref().or(of_itself));
        for shape in shapes {
            if let ShapeSpec::Mesh(mesh) = shape {
                files.entry(&mesh.file).or_insert(&mesh.at);
            }
        }
    }
    let wrong = |(file, at): (&std::path::PathBuf, &world::Location)| {
        let error = model::load(file).err()?;
        Some(format!("{at}: {}: {error}; it is for the window only", file.display()))
    };
    let unread: Vec<String> = files.into_iter().filter_map(wrong).collect();
    // Of those that are felt, too.
    let plain = whole.seen().plain.into_iter();
    let plain = plain.map(|(at, error)| format!("{at}: {error}; it is for the window only"));
    unread.into_iter().chain(plain).collect()
}

/// Time from which on swinging between fingers is told \[s\], and a good one.
const MOST_SWAYING_S: f64 = 5.0;
const SWAYING_S: f64 = 2.0;
/// Doors are tried from so far to so far (m).
const TRIED_M: f64 = 2.0 * SLAB_M;
