//! Entities that begin near each other.
//!
//! Cost: a logarithmic search for each thing that moves ([`BroadPhase`]), and contact points of what is found.

#![allow(non_snake_case)] // Frames are capital letters.

use crate::rig::Rig;
use haptics::Entity;
use nalgebra::Vector3;
use physics::collide::{ContactPoints, PairMemory, Solid, bounding_ball, contact_points, is_collidable};
use physics::{Aabb, BroadPhase};

/// Two that stand on each other or overlap; the first one moves.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Pair {
    pub(super) one: usize,
    pub(super) other: usize,
    /// Negative where they overlap.
    pub(super) gap_m: f64,
    /// There, to the first one.
    pub(super) normal_W: Vector3<f64>,
}

/// All that are no farther from each other than [`TOUCH_M`], in the order in which they begin along x.
pub(super) fn pairs(rig: &Rig, entities: &[Entity], boxes: &BroadPhase) -> Vec<Pair> {
    let mut pairs = Vec::new();
    for [one, other] in near_pairs(rig, entities, boxes) {
        let (gap_m, normal_W) = nearest(&entities[one], &entities[other], TOUCH_M);
        if gap_m <= TOUCH_M {
            pairs.push(Pair { one, other, gap_m, normal_W });
        }
    }
    pairs
}

/// Each pair of which one moves, whose boxes and whose bounding balls meet, once; the one that moves first, and of two that do
/// the one that begins later along x.
fn near_pairs(rig: &Rig, entities: &[Entity], boxes: &BroadPhase) -> Vec<[usize; 2]> {
    let is_body = |index: usize| rig.scene.entities[index].motion.is_some();
    let ball = |entity: &Entity| {
        bounding_ball(&entity.shape).map(|(c, r)| (entity.X_WB.transform_point(&c.into()).coords, r))
    };
    let balls: Vec<_> = entities.iter().map(ball).collect();
    let mut order: Vec<usize> = (0..entities.len()).filter(|&index| entities[index].is_collidable).collect();
    // What has no end is near to everything.
    let begin = |index: usize| balls[index].map_or(f64::NEG_INFINITY, |(centre, radius)| centre.x - radius);
    order.sort_by(|&a, &b| begin(a).total_cmp(&begin(b)).then(a.cmp(&b)));
    let mut ranks = vec![0; entities.len()];
    order.iter().enumerate().for_each(|(rank, &index)| ranks[index] = rank);
    let mut pairs = Vec::new();
    for &own in order.iter().filter(|&&index| is_body(index)) {
        let mut meet = |other: usize| {
            let apart = balls[other].zip(balls[own]).is_some_and(|((p, r), (q, s))| (p - q).norm() > r + s);
            let is_found_by_other = other == own || is_body(other) && ranks[other] > ranks[own];
            let may_meet = entities[other].is_collidable && entities[other].space == entities[own].space;
            if may_meet && !apart && !is_found_by_other {
                pairs.push([own, other]);
            }
        };
        match Aabb::of_entity(&entities[own]) {
            Some(around) => boxes.near(&around.grown(TOUCH_M), &mut meet),
            None => (0..entities.len()).for_each(&mut meet),
        }
    }
    pairs.sort_by_key(|both| {
        let [a, b] = both.map(|index| ranks[index]);
        (a.max(b), a.min(b))
    });
    pairs
}

/// Distance of the two where they are nearest to each other (m), and the normal to the first one there; infinite where that is
/// more than they reach (m).
pub(super) fn nearest(a: &Entity, b: &Entity, reach_m: f64) -> (f64, Vector3<f64>) {
    let far = (f64::INFINITY, Vector3::zeros());
    let is_turned = !is_collidable(&a.shape, &b.shape);
    let (a, b) = if is_turned { (b, a) } else { (a, b) };
    if !is_collidable(&a.shape, &b.shape) {
        return far;
    }
    let (mut memory, mut points) = (PairMemory::default(), ContactPoints::default());
    let solid = |entity| -> Solid<'_> {
        let entity: &Entity = entity;
        Solid { shape: &entity.shape, X_W: &entity.X_WB }
    };
    contact_points(solid(a), solid(b), reach_m, &mut memory, &mut points);
    let nearest = points.as_slice().iter().min_by(|a, b| a.gap_m.total_cmp(&b.gap_m));
    nearest.map_or(far, |point| (point.gap_m, if is_turned { -point.normal_W } else { point.normal_W }))
}

/// Things that are nearer stand on each other \[m\].
pub(super) const TOUCH_M: f64 = 1e-3;

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::rig::HandMode;
    use std::path::Path;
    use std::time::{Duration, Instant};
    use world::Scene;

    /// Rig of a finger and these entities, and what runs of them.
    fn rig(entities: &str) -> (Rig, Vec<Entity>) {
        let file = Path::new("scene.toml");
        let scene = Scene::parse(&format!("[[finger]]\nstart_m = [0, 1, 0]\n{entities}"), file).unwrap();
        let rig = Rig::new(file, scene, None, None, HandMode::Kinematic, 1_000_000).unwrap();
        let entities = rig.fast_step().unwrap().entities().to_vec();
        (rig, entities)
    }

    /// Boxes and balls of several sizes in a crowd, some of them fixed, some in each other, above a floor.
    pub(in super::super) fn heap() -> (Rig, Vec<Entity>) {
        let mut text =
            "[[entity]]\nname = \"floor\"\nshape = { kind = \"plane\", normal = [0, 1, 0], offset_m = 0 }\n"
                .to_owned();
        for at in 0..120_u32 {
            let part = |factor: u32| f64::from(at * factor % 121) / 121.0;
            let size_m = 0.01 + 0.05 * part(17);
            let shape = match at % 3 {
                0 => format!("{{ kind = \"sphere\", radius_m = {size_m} }}"),
                1 => format!("{{ kind = \"box\", size_m = [{size_m}, 0.03, {size_m}] }}"),
                _ => format!("{{ kind = \"capsule\", radius_m = 0.01, length_m = {size_m} }}"),
            };
            let mass = if at % 5 == 0 { "" } else { "mass_kg = 0.1\n" };
            let [x, y, z] = [part(37) * 0.3, 0.02 + part(53) * 0.3, part(71) * 0.3];
            text += &format!(
                "[[entity]]\nname = \"e{at}\"\nshape = {shape}\nposition_m = [{x}, {y}, {z}]\n{mass}"
            );
        }
        rig(&text)
    }

    #[test]
    fn pairs_are_those_that_are_found_among_all() {
        let (rig, entities) = heap();
        let found = pairs(&rig, &entities, &BroadPhase::new(&entities));
        let is_body = |index: usize| rig.scene.entities[index].motion.is_some();
        let (mut expected, mut counted) = (0, 0);
        for (one, other) in (0..entities.len()).flat_map(|one| (0..one).map(move |other| (one, other))) {
            let own: Vec<&Pair> = found
                .iter()
                .filter(|pair| [(one, other), (other, one)].contains(&(pair.one, pair.other)))
                .collect();
            counted += own.len();
            if is_body(one) || is_body(other) {
                let touches = nearest(&entities[one], &entities[other], TOUCH_M).0 <= TOUCH_M;
                expected += usize::from(touches);
                assert_eq!(own.len(), usize::from(touches), "{one} {other}");
            }
        }
        assert!(counted == expected && expected > 50, "{counted} {expected}");
        assert!(found.iter().all(|pair| is_body(pair.one)));
    }

    #[test]
    fn ten_thousand_things_on_long_boards_are_paired_in_no_time() {
        let mut text = String::new();
        for board in 0..100 {
            let y = f64::from(board) * 0.1;
            text += &format!(
                "[[entity]]\nname = \"b{board}\"\nshape = {{ kind = \"box\", size_m = [5, 0.02, 1] }}\nposition_m = [2.5, {y}, 0]\n"
            );
            for cube in 0..100 {
                let (x, y) = (f64::from(cube) * 0.05, y + 0.02);
                text += &format!(
                    "[[entity]]\nname = \"c{board}-{cube}\"\nshape = {{ kind = \"sphere\", radius_m = 0.01 }}\n\
                     position_m = [{x}, {y}, 0]\nmass_kg = 0.1\n"
                );
            }
        }
        let (rig, entities) = rig(&text);
        let boxes = BroadPhase::new(&entities);
        let begin = Instant::now();
        let near = near_pairs(&rig, &entities, &boxes);
        // A hundred times as many by their balls alone.
        assert!((10_000..30_000).contains(&near.len()), "{}", near.len());
        assert_eq!(pairs(&rig, &entities, &boxes).len(), 10_000);
        assert!(begin.elapsed() < Duration::from_secs(20), "{:?}", begin.elapsed());
    }
}
