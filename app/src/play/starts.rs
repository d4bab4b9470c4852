//! Start positions of the fingers of a hand that people move.
//!
//! Model: where the scene says, if that is free; else at the nearest [free place](super::free_place). Fingers of which the
//! scene says nothing stand as an open hand does: around the others, or over what is in the scene.

use super::free_place::{FreePlaces, LEAST_M};
use crate::rig::{Rig, RigError, in_words};
use haptics::Entity;
use nalgebra::Vector3;
use physics::BroadPhase;
use view::hand::{Grip, middle};
use world::EntityKind;

/// So far over what is in a scene a hand is that nobody has said anything of (m).
const OVER_M: f64 = 0.06;

/// Where each finger begins (m), and of those that do not begin where they were to, why.
pub(super) fn starts(rig: &Rig) -> Result<(Vec<Vector3<f64>>, Vec<String>), RigError> {
    let step = rig.fast_step()?;
    let entities = step.entities();
    let mut told = Vec::new();
    let mut starts = wanted(rig, entities);
    for (finger, start) in rig.scene.fingers.iter().zip(&mut starts) {
        let space = rig.space(finger.within.as_ref());
        // Its radius was taken by a finger before.
        let Ok(mut places) = FreePlaces::new(entities, finger.radius_m, space) else { continue };
        if places.is_free(start, LEAST_M) {
            continue;
        }
        let names: Vec<&str> =
            places.touched(start).map(|entity| rig.scene.entities[entity].name.as_str()).collect();
        let why = if names.is_empty() {
            "close to something".into()
        } else {
            format!("inside of {}", in_words(&names))
        };
        let found = places.nearest(start);
        // What was chosen here nobody need be told of.
        if finger.has_start || found.is_none() {
            told.push(words(&finger.name, start, &why, found.as_ref()));
        }
        *start = found.unwrap_or(*start);
    }
    Ok((starts, told))
}

fn words(finger: &str, wanted: &Vector3<f64>, why: &str, found: Option<&Vector3<f64>>) -> String {
    let place = |place: &Vector3<f64>| format!("[{:.4}, {:.4}, {:.4}] m", place.x, place.y, place.z);
    match found {
        Some(found) => format!("{finger} at {}, since {} is {why}", place(found), place(wanted)),
        None => format!("{finger} at {}, which is {why}: no free place was found", place(wanted)),
    }
}

/// Where they would begin if nothing were in their way (m).
fn wanted(rig: &Rig, entities: &[Entity]) -> Vec<Vector3<f64>> {
    let fingers = &rig.scene.fingers;
    let said: Vec<Vector3<f64>> =
        fingers.iter().filter(|finger| finger.has_start).map(|finger| finger.start_m.coords).collect();
    let place =
        if said.is_empty() { over(rig, entities) } else { middle(&said[..said.len().min(Grip::MOST)]) };
    let grip = Grip::new(fingers.len());
    let wanted = fingers.iter().enumerate().map(|(number, finger)| {
        if finger.has_start { finger.start_m.coords } else { place + grip.stand(number) }
    });
    wanted.collect()
}

/// Over the middle of the scene's things, without what surrounds them (m).
fn over(rig: &Rig, entities: &[Entity]) -> Vector3<f64> {
    let broad_phase = BroadPhase::new(entities);
    let things = rig.scene.entities.iter().enumerate().filter(|(index, spec)| {
        spec.kind == EntityKind::Object
            && entities[*index].is_haptic
            && entities[*index].space == haptics::WORLD
    });
    let boxes = things.filter_map(|(index, _)| broad_phase.around(index));
    let corners = boxes.map(|around| [around.low_W, around.high_W]);
    let all = corners.reduce(|[least, most], [low, high]| [least.inf(&low), most.sup(&high)]);
    let [least, most] = all.unwrap_or_default();
    let centre = 0.5 * (least + most);
    Vector3::new(centre.x, most.y + OVER_M, centre.z)
}
