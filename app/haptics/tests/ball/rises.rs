//! Strokes over ugly meshes: no tick's force rises by more than the hand's way and the god-object's lag explain.

use std::slice::from_ref;
use std::sync::Arc;

use crate::common::meshes::{touchable, unit_vector};
use crate::common::ugly;
use crate::common::*;
use crate::mesh_oracle::corners;
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

/// Where the god-object lags behind, all of the spring's force may come with one change of the feature: a wall that is met
/// turns the normal towards the HIP. It is no more than the lag before, with what the hand moved; a part inside which the
/// finger was let go begins with the ramp.
fn stroke_over(name: &str, mesh: &Arc<Mesh>, friction: Friction, radius_m: f64, strokes: usize, seed: u64) {
    let entity = touchable(mesh, friction);
    let mut noise = Noise(seed);
    let mut touched = 0;
    for stroke_number in 0..strokes {
        let mut finger = Finger::new(radius_m, 1).unwrap();
        let mut before: Option<(Vector3<f64>, f64)> = None;
        for (tick, hip) in stroke(mesh, &mut noise, radius_m).into_iter().enumerate() {
            let out = finger.step(from_ref(&entity), &hip, DT);
            let lag_m = (out.god_object_W - hip).norm();
            if let Some((last_hip, last_lag_m)) = before {
                let way_m = (hip - last_hip).norm();
                let most_n = K * (last_lag_m + way_m + lag_m * DT / RAMP_IN_S);
                let force_n = out.force_on_user_W.norm();
                touched += usize::from(force_n > 0.0);
                assert!(
                    force_n <= most_n * (1.0 + 1e-9) + 1e-6,
                    "{name}, {radius_m} m, stroke {stroke_number}, tick {tick}: {force_n} N, explained {most_n} N"
                );
            }
            before = Some((hip, lag_m));
        }
    }
    assert!(touched > 20 * strokes, "{name}, {radius_m} m: {touched}");
}

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
fn no_tick_adds_more_force_than_the_lag_and_the_hands_way() {
    stroke_over_ugly_meshes(1..2, 12);
}

/// Two hundred million ticks.
#[test]
#[ignore = "half an hour"]
fn no_tick_of_long_strokes_adds_more_force_than_the_lag_and_the_hands_way() {
    stroke_over_ugly_meshes(2..32, 300);
}
