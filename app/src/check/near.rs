//! Entities that begin near each other.

#![allow(non_snake_case)] // Frames are capital letters.

use crate::rig::Rig;
use haptics::Entity;
use nalgebra::Vector3;
use physics::collide::{ContactPoints, PairMemory, Solid, bounding_ball, contact_points, is_collidable};

/// Two that are near each other; the first one moves.
pub(super) struct Pair {
    pub(super) one: usize,
    pub(super) other: usize,
    /// Negative where they overlap; infinite where they are farther apart than [`TOUCH_M`].
    pub(super) gap_m: f64,
    /// There, to the first one.
    pub(super) normal_W: Vector3<f64>,
}

impl Pair {
    pub(super) fn touches(&self) -> bool {
        self.gap_m <= TOUCH_M
    }
}

/// All that are near each other.
pub(super) fn pairs(rig: &Rig, entities: &[Entity]) -> Vec<Pair> {
    let mut pairs = Vec::new();
    near_pairs(rig, entities, |a, b| {
        let (gap_m, normal_W) = nearest(&entities[a], &entities[b], TOUCH_M);
        pairs.push(Pair { one: a, other: b, gap_m, normal_W });
    });
    pairs
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
