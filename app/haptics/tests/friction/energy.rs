//! Friction takes energy from the hand and gives none back, on every closed form, for every model.

use crate::common::laws::{drift_free, drifting};
use crate::common::*;
use crate::solids::{self, Solid};
use haptics::{Contact, Friction};
use nalgebra::Vector3;

/// A finger that hurries from place to place in and about the solid, often right through its middle: `look` is shown
/// HIP, contact before and contact now of every tick that goes on with a contact.
fn hurry(solid: &Solid, law: &Friction, mut look: impl FnMut(Vector3<f64>, &Contact, &Contact)) {
    let entity = [entity(solid.form, law.clone())];
    let (mut finger, mut noise) = (point_finger(), Noise(7));
    let (mut hip, mut target) = (Vector3::y(), Vector3::y());
    for tick in 0..12_000 {
        if tick % 60 == 0 {
            let at = solid.point(noise.uniform(), noise.uniform());
            target = at - at.normalize() * noise.between(-0.002, 0.006);
        }
        hip += (target - hip) * 0.05 + noise.vector(2e-5);
        let before = finger.contact(0).copied();
        finger.step(&entity, &hip, DT);
        if let (Some(before), Some(now)) = (before, finger.contact(0)) {
            look(hip, &before, now);
        }
    }
}

#[test]
fn no_slide_stretches_the_spring_however_deep_the_finger_is() {
    let mut laws = drift_free();
    laws.extend(drifting());
    laws.push(("viscous", Friction::viscous(0.5).unwrap()));
    // Bonds that are bent the other way have energy of their own, and draw the god-object beyond S with it.
    laws.retain(|(name, _)| *name != "bristle");
    for solid in solids::all() {
        for (name, law) in &laws {
            let mut slides = 0;
            hurry(&solid, law, |hip, before, now| {
                let stretch = |contact: &Contact| (contact.god_object_W - hip).norm_squared();
                let is_pressed = before.normal_W.dot(&(before.god_object_W - hip)) > 0.0;
                if is_pressed && before.god_object_W != now.god_object_W {
                    slides += 1;
                    // The slide itself forgives a billionth.
                    let limit = stretch(before) * (1.0 + 2e-9) + 1e-24;
                    assert!(stretch(now) <= limit, "{} {name}: {before:?} {now:?} {hip:?}", solid.name);
                }
            });
            assert!(slides > 1000, "{} {name}: {slides}", solid.name);
        }
    }
}

#[test]
fn where_pieces_meet_viscous_friction_goes_on() {
    for solid in solids::all() {
        for law in [Friction::viscous(0.5).unwrap(), Friction::coulomb_viscous(MU_D, 0.5).unwrap()] {
            hurry(&solid, &law, |hip, _, now| {
                if now.normal_force_n > 0.0 {
                    let spring = (now.god_object_W - hip) * K;
                    let across = spring - now.normal_W * now.normal_W.dot(&spring);
                    let felt = now.force_on_user_W - now.normal_W * now.normal_force_n;
                    // What the search leaves is 1e-12 of the load; cut to its circle at rest, newtons would be missing.
                    let missing = (felt - across).norm();
                    assert!(missing <= 1e-9, "{} {law:?}: {missing} N, {now:?}", solid.name);
                }
            });
        }
    }
}
