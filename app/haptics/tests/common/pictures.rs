//! Pictures of heights for the tests, and what is known of them by formula.
#![allow(dead_code, non_snake_case)]

use haptics::{Entity, Finger, FingerOutput, HeightGrid, HeightMap, PictureScale};
use nalgebra::Vector3;
use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use crate::common::{DT, Noise};

/// Texels along a side.
pub(crate) const SIDE: usize = 64;

/// A picture by its value at each place, `(u, v)` from its lower left corner.
pub(crate) fn picture(side: usize, value: impl Fn(f64, f64) -> f64) -> Arc<HeightGrid> {
    let middle = |i: usize| (i as f64 + 0.5) / side as f64;
    let texel = |i: usize| value(middle(i % side), 1.0 - middle(i / side)) as f32;
    Arc::new(HeightGrid::new(side, side, (0..side * side).map(texel).collect()).unwrap())
}

/// One wave to the right.
pub(crate) fn wave() -> Arc<HeightGrid> {
    picture(SIDE, |u, _| 0.5 + 0.5 * (TAU * u).sin())
}

/// One wave up.
pub(crate) fn wave_up() -> Arc<HeightGrid> {
    picture(SIDE, |_, v| 0.5 + 0.5 * (TAU * v).sin())
}

/// What the spline between texels leaves of a wave over a whole picture: sinc^3 of a texel's share of it.
pub(crate) fn kept() -> f64 {
    let angle = PI / SIDE as f64;
    (angle.sin() / angle).powi(3)
}

/// Beside the wave itself a spline through its texels has waves of 64 m - 1 and 64 m + 1 times its frequency, with
/// the inverse cubes of these of its height: over all m 9.2e-6. Single precision of the texels adds 3e-8.
pub(crate) const WAVE_ERROR: f64 = 1e-5;
/// Of slopes the inverse squares: 8.04e-4.
pub(crate) const SLOPE_ERROR: f64 = 8.1e-4;

/// Hills at random, as rough as a picture can be; all values between 0 and 1, and both are there.
pub(crate) fn rough(side: usize, seed: u64) -> Arc<HeightGrid> {
    let mut noise = Noise(seed);
    let texel = |i: usize| match i {
        0 => 0.0,
        1 => 1.0,
        _ => noise.uniform() as f32,
    };
    Arc::new(HeightGrid::new(side, side, (0..side * side).map(texel).collect()).unwrap())
}

/// Black or white throughout.
pub(crate) fn even(value: f32) -> Arc<HeightGrid> {
    Arc::new(HeightGrid::new(2, 2, vec![value; 4]).unwrap())
}

/// One picture of this size, white so high.
pub(crate) fn sized(picture: &Arc<HeightGrid>, amplitude_m: f64, size_m: f64) -> HeightMap {
    HeightMap::new(Arc::clone(picture), amplitude_m, PictureScale::Size([size_m; 2])).unwrap()
}

/// So many pictures.
pub(crate) fn repeated(picture: &Arc<HeightGrid>, amplitude_m: f64, times: [f64; 2]) -> HeightMap {
    HeightMap::new(Arc::clone(picture), amplitude_m, PictureScale::Repeat(times)).unwrap()
}

pub(crate) fn with(entity: Entity, map: HeightMap) -> Entity {
    entity.with_height_map(Arc::new(map))
}

/// A tick against one entity.
pub(crate) fn tick(finger: &mut Finger, entity: &Entity, hip: &Vector3<f64>) -> FingerOutput {
    finger.step(std::slice::from_ref(entity), hip, DT)
}

/// The force where a finger comes to rest that was put there; without friction that is all there is to it.
pub(crate) fn force_at(entity: &Entity, hip: &Vector3<f64>) -> Vector3<f64> {
    let mut finger = crate::common::point_finger();
    tick(&mut finger, entity, hip);
    tick(&mut finger, entity, hip).force_on_user_W
}
