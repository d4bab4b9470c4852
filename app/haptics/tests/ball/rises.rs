//! Strokes over ugly meshes: no tick's force rises by more than the hand's way explains; nothing inside is unfelt.

use std::slice::from_ref;
use std::sync::Arc;

use crate::common::meshes::{touchable, unit_vector};
use crate::common::ugly;
use crate::common::*;
use crate::mesh_oracle::{corners, distance};
use haptics::mesh::Mesh;
use haptics::{Finger, Friction, RAMP_IN_S};
use nalgebra::Vector3;

/// Where the hand goes: down onto a face, and then along, two millimetres deep, whatever is in the way.
fn stroke(mesh: &Mesh, noise: &mut Noise, radius_m: f64) -> Vec<Vector3<f64>> {
    let face = (noise.uniform() * mesh.faces().len() as f64) as usize;
    let [a, b, c] = corners(mesh, face);
    let normal = mesh.faces()[face].normal_B;
    let side = unit_vector(noise);
    let along = (side - normal * normal.dot(&side)).normalize();
    let down = (0..60).map(|i| radius_m + 1e-3 - 5e-5 * f64::from(i)).map(|height| normal * height);
    let across = (0..250).map(|i| normal * (radius_m - 2e-3) + along * (2e-4 * f64::from(i)));
    down.chain(across).map(|way| (a + b + c) / 3.0 + way + noise.vector(1e-5)).collect()
}

/// A tick's force is the last one's and what the hand moved; a contact that began inside, and one whose god-object came to
/// rest late, add their ramp. The god-object is outside, and whatever is inside is felt.
fn stroke_over(name: &str, mesh: &Arc<Mesh>, friction: Friction, radius_m: f64, strokes: usize, seed: u64) {
    let entity = touchable(mesh, friction);
    let mut noise = Noise(seed);
    let mut touched = 0;
    let is_in = |p: &Vector3<f64>| mesh.has_inside() && mesh.is_inside(p) && distance(mesh, p) > INSIDE_M;
    for stroke_number in 0..strokes {
        let mut finger = Finger::new(radius_m, 1).unwrap();
        let mut before: Option<(Vector3<f64>, f64)> = None;
        for (tick, hip) in stroke(mesh, &mut noise, radius_m).into_iter().enumerate() {
            let out = finger.step(from_ref(&entity), &hip, DT);
            let here = || format!("{name}, {radius_m} m, stroke {stroke_number}, tick {tick}");
            let lag_m = (out.god_object_W - hip).norm();
            let force_n = out.force_on_user_W.norm();
            if let Some((last_hip, last_n)) = before {
                let way_m = (hip - last_hip).norm();
                // Both ramps at once: one that began inside may also come to rest late.
                let most_n = last_n + K * (way_m + 2.0 * lag_m * DT / RAMP_IN_S);
                touched += usize::from(force_n > 0.0);
                assert!(
                    force_n <= most_n * (1.0 + 1e-9) + K * SLACK_M,
                    "{}: {force_n} N, explained {most_n} N",
                    here()
                );
            }
            // The oracle goes over all faces: not in every tick.
            if tick % 10 == 0 {
                match finger.contact(0) {
                    Some(_) => assert!(!is_in(&out.god_object_W), "{}: god-object inside", here()),
                    None => assert!(!is_in(&hip), "{}: inside and not felt", here()),
                }
            }
            before = Some((hip, force_n));
        }
    }
    assert!(touched > 20 * strokes, "{name}, {radius_m} m: {touched}");
}

/// Far above rounding on a mesh of this size, far below what a finger notices.
const INSIDE_M: f64 = 1e-6;
/// Resolution of walks over surfaces: less is not counted as a leap.
const SLACK_M: f64 = 1e-6;

fn stroke_over_ugly_meshes(seeds: std::ops::Range<u64>, strokes: usize) {
    for seed in seeds {
        for (name, soup) in ugly::all(seed) {
            let mesh = Arc::new(Mesh::build(soup).unwrap().0);
            for friction in [Friction::None, stiction()] {
                for radius_m in [0.0, 2e-4, 1e-3, 5e-3, 0.02] {
                    stroke_over(name, &mesh, friction.clone(), radius_m, strokes, seed);
                }
            }
        }
    }
}

#[test]
fn no_tick_adds_more_force_than_the_hands_way() {
    stroke_over_ugly_meshes(1..2, 12);
}

/// Two hundred million ticks.
#[test]
#[ignore = "half an hour"]
fn no_tick_of_long_strokes_adds_more_force_than_the_hands_way() {
    stroke_over_ugly_meshes(2..32, 300);
}
