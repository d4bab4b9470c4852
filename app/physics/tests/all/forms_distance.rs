//! Contact points of closed forms against slow and obvious descriptions of where they are.
#![allow(non_snake_case)]

use crate::solids;

use haptics::Form;
use nalgebra::{Isometry3, Vector3};
use physics::collide::{PairMemory, is_collidable};
use solids::*;

/// So far that everything is reported.
const FAR: f64 = 1.0;

/// Two poses at which two forms do not overlap, some centimetres apart, with what the oracle says.
fn apart(a: &Form, b: &Form, noise: &mut Noise) -> (Isometry3<f64>, Isometry3<f64>, f64) {
    loop {
        let X_WB = pose(noise.turn(), Vector3::new(0.3, -0.2, 0.1));
        let away = noise.direction() * noise.between(0.02, 0.12);
        let X_WA = pose(noise.turn(), X_WB.translation.vector + away);
        let gap = distance(a, &X_WA, b, &X_WB);
        if gap > 1e-4 && gap < 0.05 {
            return (X_WA, X_WB, gap);
        }
    }
}

/// The oracle knows distances to all that is not scaled.
fn is_known(a: &Form, b: &Form) -> bool {
    let is_scaled = |form: &Form| matches!(form, Form::Scaled(_));
    is_collidable(&(*a).into(), &(*b).into()) && !(is_scaled(a) && is_scaled(b))
}

#[test]
fn the_smallest_gap_of_forms_that_are_apart_is_their_distance() {
    let mut noise = Noise(1);
    let forms: Vec<_> = all().into_iter().chain(scaled()).collect();
    for (name_a, a) in &forms {
        for (name_b, b) in forms.iter().filter(|(_, b)| is_known(a, b)) {
            for _ in 0..12 {
                let (X_WA, X_WB, gap) = apart(a, b, &mut noise);
                let found = points(a, &X_WA, b, &X_WB, FAR, &mut PairMemory::default());
                let deepest = deepest(&found);
                // The compass search ends 1e-10 of the form's size before an edge, and in the valley of a long one
                // 1e-7 m above its bottom.
                let is_same = (deepest - gap).abs() < 1e-7;
                assert!(is_same, "{name_a} on {name_b}: {deepest} {gap} {found:?} {X_WA} {X_WB}");
            }
        }
    }
}
