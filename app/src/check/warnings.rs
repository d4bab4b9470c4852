//! What runs, but hardly as meant.

use super::together;
use crate::rig::{Rig, in_words};
use crate::study::stiffness::bounds::Theory;
use crate::study::stiffness::case::{Axis, Case, Hand, Mode};
use crate::study::stiffness::search::Found;
use crate::study::stiffness::trial::Bench;
use haptics::{Door, Entity, Finger, Hip, Limits, Passage, SLAB_M};
use io_driver::sim::hand::model_file::Firmness;
use physics::collide::{ContactPoints, PairMemory, Solid, bounding_ball, contact_points, is_collidable};
use std::collections::BTreeMap;
use std::path::Path;
use world::model;
use world::{MassSpec, Scene, ShapeSpec};

/// All of them.
pub(super) fn all(rig: &Rig, whole: &Scene, entities: &[Entity]) -> Vec<String> {
    let mut stands = Stands::of(rig);
    let mut warnings = too_stiff(rig, &mut stands);
    warnings.extend(too_damped(rig));
    warnings.extend(together::too_much(rig, entities, &mut stands));
    warnings.extend(overlaps(rig, entities));
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

/// Things that move and begin deeper in others than their weight brings them.
fn overlaps(rig: &Rig, entities: &[Entity]) -> Vec<String> {
    let mut found = Vec::new();
    let mut pairs = 0_usize;
    near_pairs(rig, entities, |a, b| {
        let depth_m = depth(&entities[a], &entities[b]);
        if depth_m > depth_of_weight(rig, a, entities).max(LEAST_DEPTH_M) {
            pairs += 1;
            if found.len() < MOST_OVERLAPS {
                let [a, b] = [a, b].map(|index| &rig.scene.entities[index].name);
                found.push(format!("{a} begins {:.2} mm deep in {b}, and will be thrown out", depth_m * 1e3));
            }
        }
    });
    if pairs > found.len() {
        found.push(format!("and {} more pairs begin in each other", pairs - found.len()));
    }
    found
}

/// Each pair of which one moves, whose bounding balls meet, once; the one that moves first.
fn near_pairs(rig: &Rig, entities: &[Entity], mut meet: impl FnMut(usize, usize)) {
    let is_body = |index: usize| rig.scene.entities[index].motion.is_some();
    let balls: Vec<_> = entities
        .iter()
        .map(|entity| {
            bounding_ball(&entity.shape).map(|(c, r)| (entity.X_WB.transform_point(&c.into()).coords, r))
        })
        .collect();
    // Swept along x: what has no end is near to everything.
    let mut order: Vec<usize> = (0..entities.len()).filter(|&index| entities[index].is_collidable).collect();
    let begin = |index: usize| balls[index].map_or(f64::NEG_INFINITY, |(centre, radius)| centre.x - radius);
    let end = |index: usize| balls[index].map_or(f64::INFINITY, |(centre, radius)| centre.x + radius);
    order.sort_by(|&a, &b| begin(a).total_cmp(&begin(b)).then(a.cmp(&b)));
    let mut open: Vec<usize> = Vec::new();
    for &next in &order {
        open.retain(|&other| end(other) >= begin(next));
        for &other in &open {
            let apart = balls[other].zip(balls[next]).is_some_and(|((p, r), (q, s))| (p - q).norm() > r + s);
            match (is_body(next), is_body(other)) {
                _ if apart || entities[other].space != entities[next].space => {}
                (true, _) => meet(next, other),
                (false, true) => meet(other, next),
                _ => {}
            }
        }
        open.push(next);
    }
}

fn depth(a: &Entity, b: &Entity) -> f64 {
    let (a, b) = if is_collidable(&a.shape, &b.shape) { (a, b) } else { (b, a) };
    if !is_collidable(&a.shape, &b.shape) {
        return 0.0;
    }
    let (mut memory, mut points) = (PairMemory::default(), ContactPoints::default());
    let solid = |entity| -> Solid<'_> {
        let entity: &Entity = entity;
        Solid { shape: &entity.shape, X_W: &entity.X_WB }
    };
    contact_points(solid(a), solid(b), 0.0, &mut memory, &mut points);
    points.as_slice().iter().map(|point| -point.gap_m).fold(0.0, f64::max)
}

/// How deep its weight alone would bring it into something as soft as itself, on one point.
fn depth_of_weight(rig: &Rig, body: usize, entities: &[Entity]) -> f64 {
    let mass_kg = match rig.scene.entities[body].motion.map(|motion| motion.mass) {
        Some(MassSpec::Mass(mass_kg)) => mass_kg,
        _ => 0.0,
    };
    2.0 * mass_kg * rig.scene.gravity_m_s2.norm() / entities[body].stiffness_n_per_m
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

/// A tenth of a millimetre is what rounding in a file leaves.
const LEAST_DEPTH_M: f64 = 1e-4;
/// Doors are tried from so far to so far (m).
const TRIED_M: f64 = 2.0 * SLAB_M;
const MOST_OVERLAPS: usize = 10;
