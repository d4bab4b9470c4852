//! Height maps that no finger feels as they are drawn.
//!
//! Model: heights are looked at all over the surface that they lie on ([`haptics::HeightMap::survey`]), and against its
//! thickness. Small steep places, such as the rims of letters, are not told.

use super::measures::{Measures, short};
use crate::rig::Rig;
use haptics::{Entity, HeightMap, HeightSurvey};

/// Suspicions of each, the measures being those of the entities.
pub(super) fn all(rig: &Rig, entities: &[Entity], measures: &[Measures]) -> Vec<String> {
    let felt = rig.scene.entities.iter().zip(entities).zip(measures).filter(|((spec, _), _)| spec.is_haptic);
    felt.flat_map(|((_, entity), it)| {
        let map = entity.height_map.as_deref();
        map.into_iter().flat_map(|map| [steep(entity, map, it), deep(map, it), step(entity, map, it)])
    })
    .flatten()
    .collect()
}

fn steep(entity: &Entity, map: &HeightMap, it: &Measures) -> Option<String> {
    let HeightSurvey { steepest, too_steep } = map.survey(&entity.shape)?;
    let degrees = |slope: f64| slope.atan().to_degrees();
    (too_steep > RIMS).then(|| {
        format!(
            "the height map of {} rises by more than {felt:.0} degrees on {:.0} % of it, by {:.0} at most, and is felt as {felt:.0} \
             there, where strokes may gain energy; with a smaller `amplitude_m` or a larger picture it is felt as it is drawn",
            it.name,
            100.0 * too_steep,
            degrees(steepest),
            felt = degrees(HeightMap::STEEPEST),
        )
    })
}

fn deep(map: &HeightMap, it: &Measures) -> Option<String> {
    let [low_m, high_m] = map.range_m();
    let size_m = it.size_m?;
    let (thin_m, long_m) = (size_m.into_iter().fold(f64::INFINITY, f64::min), it.length_m()?);
    let lengths_m = "`amplitude_m` is in metres";
    if -low_m > thin_m {
        let (deep, thin) = (short(-low_m), short(thin_m));
        return Some(format!(
            "the height map of {} is {deep} m deep, and the thing {thin} m thick: the bottom of its dents is felt beyond its \
             other side; {lengths_m}",
            it.name
        ));
    }
    (high_m > long_m).then(|| {
        let (high, long) = (short(high_m), short(long_m));
        format!("the height map of {} is {high} m high, and the thing {long} m long; {lengths_m}", it.name)
    })
}

/// Touch that begins at the surface below the heights.
fn step(entity: &Entity, map: &HeightMap, it: &Measures) -> Option<String> {
    let [_, high_m] = map.range_m();
    let step_n = if map.lift_m(&entity.shape, 0.0) > 0.0 { 0.0 } else { entity.stiffness_n_per_m * high_m };
    (step_n > BLOW_N).then(|| {
        format!(
            "{} is met with a step of up to {} N, since what its height map raises by {} m is felt from the surface below it only; \
             carved with `zero_level = 1.0` it begins at zero",
            it.name,
            short(step_n),
            short(high_m)
        )
    })
}

/// The rims of letters cover about as much.
const RIMS: f64 = 0.05;
/// Clearly felt as a knock (N).
const BLOW_N: f64 = 2.0;
