//! Places that fields, guides and entities have in common.
//!
//! Model: a place is led to where each of a group is felt, in turn and over again; if they overlap, it ends where all of
//! them are felt (of convex ones always, by alternating projections). A group is made greedily: from one effect, or from each
//! pair of a few, it takes every other one that is felt there with the rest.
//! Cost: effects times effects times the size of a group; entities are asked once for each effect with an end, and led to where
//! that one reaches them.

#![allow(non_snake_case)] // Frames are capital letters.

use haptics::{Entity, Field, Gains, Guide, Shape, Surface};
use nalgebra::Vector3;
use physics::collide::bounding_ball;

/// A thing of the world that fingers feel.
#[derive(Debug, Clone, Copy)]
pub(super) enum Effect<'a> {
    Field(&'a Field),
    Guide(&'a Guide),
}

impl Effect<'_> {
    fn led(&self, place_W: &Vector3<f64>) -> Vector3<f64> {
        match self {
            Self::Field(field) => field.region().felt_near(place_W),
            Self::Guide(guide) => guide.felt_near(place_W),
        }
    }

    fn is_everywhere(&self) -> bool {
        matches!(self, Self::Field(field) if field.region().is_everywhere())
    }

    fn is_felt_at(&self, place_W: &Vector3<f64>) -> bool {
        match self {
            Self::Field(field) => field.region().weight(place_W) > LEAST_WEIGHT,
            Self::Guide(guide) => guide.gains_at(place_W) != Gains::default(),
        }
    }
}

/// Places where as many as can be found meet of those constant fields whose force has a part along that of one of them: in what
/// pulls the other way, and beside that.
pub(super) fn forceful_places(pulls: &[(&Field, Vector3<f64>)]) -> Vec<Vector3<f64>> {
    let mut places = Vec::new();
    for (at, (_, along_W)) in pulls.iter().enumerate() {
        let is_with = |pull_W: &Vector3<f64>| pull_W.dot(along_W) > 0.0;
        let (with, against): (Vec<_>, Vec<_>) = pulls.iter().partition(|(_, pull_W)| is_with(pull_W));
        // If all are with it, it is a group as others.
        if with.len() < 2 || against.is_empty() {
            continue;
        }
        let with: Vec<Effect<'_>> = with.iter().map(|(field, _)| Effect::Field(field)).collect();
        let first = pulls[..at].iter().filter(|(_, pull_W)| is_with(pull_W)).count();
        let Some((group, place_W)) = group_from(&with, vec![first]) else { continue };
        places.push(place_W);
        let against: Vec<&Field> = against.iter().map(|(field, _)| *field).collect();
        places.extend(ways_out(&against, &place_W).filter_map(|out_W| meeting(&with, &group, out_W)));
    }
    places
}

/// Places about where none of these is felt any more, on ways in all directions; none where they are not felt at all.
fn ways_out(fields: &[&Field], from_W: &Vector3<f64>) -> impl Iterator<Item = Vector3<f64>> {
    let is_free = |p_W: &Vector3<f64>| fields.iter().all(|field| field.region().weight(p_W) == 0.0);
    let out = move |along: Vector3<f64>| {
        let lengths = (0..DOUBLINGS).map(|doubling| BELOW_M * f64::from(1 << doubling));
        lengths.map(|length_m| from_W + along * length_m).find(is_free)
    };
    let all = (!is_free(from_W)).then(directions);
    all.into_iter().flatten().filter_map(out)
}

/// To the corners, edges and faces of a cube.
pub(super) fn directions() -> impl Iterator<Item = Vector3<f64>> {
    let signs = [-1.0, 0.0, 1.0];
    let all = signs.into_iter().flat_map(move |x| {
        signs.into_iter().flat_map(move |y| signs.into_iter().map(move |z| Vector3::new(x, y, z)))
    });
    all.filter(|d| *d != Vector3::zeros()).map(|d| d.normalize())
}

/// Places of groups of effects.
pub(super) fn common_places(effects: &[Effect<'_>]) -> Vec<Vector3<f64>> {
    let mut places = Vec::new();
    for at in 0..effects.len() {
        let alone = vec![at];
        let begins: Vec<Vec<usize>> = if effects.len() > FEW {
            vec![alone]
        } else {
            (at + 1..effects.len()).map(|other| vec![at, other]).chain([alone]).collect()
        };
        let place = |begin| Some(group_from(effects, begin)?.1);
        places.extend(begins.into_iter().filter_map(place));
    }
    places
}

/// Places of effects with entities; what is felt everywhere leads to the same.
pub(super) fn places_in(effects: &[Effect<'_>], entities: &[Entity]) -> Vec<Vector3<f64>> {
    let everywhere = effects.iter().find(|effect| effect.is_everywhere());
    let looked_at = effects.iter().filter(|effect| !effect.is_everywhere()).chain(everywhere);
    looked_at.flat_map(|effect| entities.iter().filter_map(|entity| place_in(effect, entity))).collect()
}

/// Places beside one at which guides pull most: in all directions, as far off as they do.
pub(super) fn strained_places(guides: &[Guide]) -> Vec<Vector3<f64>> {
    let mut distances: Vec<f64> = guides.iter().map(Guide::strained_m).collect();
    distances.sort_by(f64::total_cmp);
    distances.dedup();
    let every = distances.len().div_ceil(MOST_DISTANCES).max(1);
    let distances: Vec<f64> = distances.into_iter().rev().step_by(every).collect();
    let effects: Vec<Effect<'_>> = guides.iter().map(Effect::Guide).collect();
    let about = |at: usize| Some(group_from(&effects, vec![at])?.1);
    let off = |place_W: Vector3<f64>| {
        let all = distances.iter().flat_map(move |far_m| directions().map(move |along| along * *far_m));
        all.map(move |off_W| place_W + off_W)
    };
    let every_guide = guides.len().div_ceil(MOST_STRAINED).max(1);
    (0..guides.len()).step_by(every_guide).filter_map(about).flat_map(off).collect()
}

/// Places spread evenly over each of these fields that has an end, of which a force is largest: one in each, and of all together.
/// The fewer fields there are, the more places are looked at.
pub(super) fn spread_places(fields: &[&Field], force_n: impl Fn(&Vector3<f64>) -> f64) -> Vec<Vector3<f64>> {
    let each = (MOST_SPREAD / (fields.len() * fields.len()).max(1)).min(MOST_IN_FIELD);
    let (mut best, mut all) = (Vec::new(), Vec::new());
    for [low, high] in fields.iter().filter_map(|field| extents(field)) {
        let shares = |at: usize| GOLDEN.map(|step| (0.5 + at as f64 * step).fract());
        let place = |at: usize| low + (high - low).component_mul(&Vector3::from(shares(at)));
        let mut here: Vec<(f64, Vector3<f64>)> =
            (0..each).map(place).map(|place_W| (force_n(&place_W), place_W)).collect();
        here.sort_by(|a, b| b.0.total_cmp(&a.0));
        best.extend(here.first().copied());
        all.extend(here.into_iter().skip(1).take(MOST_OF_ALL));
    }
    for found in [&mut best, &mut all] {
        found.sort_by(|a, b| b.0.total_cmp(&a.0));
    }
    best.truncate(MOST_BEST);
    let found = best.into_iter().chain(all.into_iter().take(MOST_OF_ALL));
    // Each is climbed from, which asks all fields again.
    let most = (MOST_ASKED / fields.len().max(1)).max(MOST_OF_ALL);
    found.take(most).map(|(_, place_W)| place_W).collect()
}

/// The box around the places where a field is felt in full, its lowest corner and its highest; `None` if it has no end.
fn extents(field: &Field) -> Option<[Vector3<f64>; 2]> {
    let region = field.region();
    if region.is_everywhere() {
        return None;
    }
    let middle_W = region.felt_near(&Vector3::zeros());
    let mut ends = directions().map(|along| region.felt_near(&(middle_W + along * FAR_M)));
    let first = ends.next()?;
    let [low, high] = ends.fold([first; 2], |[low, high], end| [low.inf(&end), high.sup(&end)]);
    ((high - low).amax() < FAR_M).then_some([low, high])
}

/// The place to which a force leads from another one: always to the neighbour with the larger one, near or far.
pub(super) fn climbed(force_n: impl Fn(&Vector3<f64>) -> f64, from_W: &Vector3<f64>) -> Vector3<f64> {
    let (mut place_W, mut most_n) = (*from_W, force_n(from_W));
    for halving in 0..CLIMBS {
        let step_m = FARTHEST_M / f64::from(1 << halving);
        for _ in 0..STEPS {
            let beside =
                directions().map(|along| place_W + along * step_m).map(|at_W| (at_W, force_n(&at_W)));
            let Some((at_W, here_n)) = beside.max_by(|a, b| a.1.total_cmp(&b.1)) else { break };
            if here_n <= most_n * (1.0 + LEAST_GAIN) {
                break;
            }
            (place_W, most_n) = (at_W, here_n);
        }
    }
    place_W
}

/// These and as many others as can be found that are felt at one place, and the place; `None`: these have none in common.
fn group_from(effects: &[Effect<'_>], mut group: Vec<usize>) -> Option<(Vec<usize>, Vector3<f64>)> {
    let mut place_W = meeting(effects, &group, Vector3::zeros())?;
    for other in 0..effects.len() {
        if group.contains(&other) {
            continue;
        }
        group.push(other);
        match meeting(effects, &group, place_W) {
            Some(at_W) => place_W = at_W,
            None => drop(group.pop()),
        }
    }
    Some((group, place_W))
}

fn meeting(effects: &[Effect<'_>], group: &[usize], from_W: Vector3<f64>) -> Option<Vector3<f64>> {
    let mut place_W = from_W;
    for _ in 0..ROUNDS {
        let before_W = place_W;
        place_W = group.iter().fold(place_W, |place_W, &at| effects[at].led(&place_W));
        if (place_W - before_W).norm() < ARRIVED_M {
            break;
        }
    }
    group.iter().all(|&at| effects[at].is_felt_at(&place_W)).then_some(place_W)
}

/// In an entity, just below its surface, where an effect is felt.
fn place_in(effect: &Effect<'_>, entity: &Entity) -> Option<Vector3<f64>> {
    let Shape::Form(form) = &entity.shape else { return None };
    let (centre_B, radius_m) = bounding_ball(&entity.shape).unwrap_or((Vector3::zeros(), f64::INFINITY));
    let centre_W = entity.X_WB.transform_point(&centre_B.into()).coords;
    if !entity.is_haptic || (effect.led(&centre_W) - centre_W).norm() > radius_m {
        return None;
    }
    let below = |p_W: &Vector3<f64>| {
        let at = form.nearest(&entity.X_WB.inverse_transform_point(&(*p_W).into()).coords);
        entity.X_WB.transform_point(&(at.point_B - at.normal_B * BELOW_M).into()).coords
    };
    let mut place_W = centre_W;
    for _ in 0..ROUNDS {
        let before_W = place_W;
        place_W = below(&effect.led(&place_W));
        if (place_W - before_W).norm() < ARRIVED_M {
            break;
        }
    }
    effect.is_felt_at(&place_W).then_some(place_W)
}

/// Each pair of so many effects begins a group.
const FEW: usize = 16;
/// Different distances at which guides are strained, the largest among them.
const MOST_DISTANCES: usize = 4;
/// Guides beside whose places others are looked for.
const MOST_STRAINED: usize = 32;
/// Steps of climbing, each half as long as the one before, and how often one is made.
const CLIMBS: u32 = 10;
const STEPS: usize = 8;
/// The first of them (m).
const FARTHEST_M: f64 = 0.1;
/// Of a force: less is no climb.
const LEAST_GAIN: f64 = 1e-6;
/// Fields that are asked at places which are spread over them; and such places in each.
const MOST_SPREAD: usize = 2_000_000;
const MOST_IN_FIELD: usize = 4000;
/// Of these places the best, one in each field; and of all together.
const MOST_BEST: usize = 48;
const MOST_OF_ALL: usize = 16;
/// Fields times places from which is climbed.
const MOST_ASKED: usize = 8192;
/// Powers of the plastic number's like in three dimensions: places of this sequence lie evenly (M. Roberts 2018).
const GOLDEN: [f64; 3] = [0.819_172_513_396_164_4, 0.671_043_606_703_789_2, 0.549_700_477_901_970_3];
/// Farther than fields with an end reach (m).
const FAR_M: f64 = 1e3;
/// Of leading a place.
const ROUNDS: usize = 20;
const ARRIVED_M: f64 = 1e-6;
/// Of a way out of fields: up to 130 m.
const DOUBLINGS: u32 = 18;
/// With less a field is hardly felt.
const LEAST_WEIGHT: f64 = 0.25;
/// As deep as a finger presses.
const BELOW_M: f64 = 1e-3;
