//! Which entities are near: a register with a box around each of them.
//!
//! Problem: ten thousand entities, three fingers, a tick of a millisecond: most entities must not be looked at at all
//! (Melder ch. 7.2.10).
//!
//! Model: each bounded entity has a box in a [tree](tree) that is larger than needed by [`FAT_M`] and the way that it
//! will go soon; it is put in anew only when the entity has left it. So what rests costs nothing, and who remembers what
//! overlapped a box need not ask again before [`BroadPhase::version`] changes. Entities without an end are near everything.
//! Invariants: no allocation after [`BroadPhase::new`]; an entity is inside its box.
//! Cost: of an entity that moved a comparison, and a logarithmic change of the tree every few centimetres.

mod aabb;
mod tree;

use haptics::Entity;
use nalgebra::Vector3;

pub use aabb::Aabb;
use tree::Tree;

/// All entities, by their indices.
#[derive(Debug, Clone)]
pub struct BroadPhase {
    tree: Tree,
    /// Of each entity, where its box is.
    leaves: Box<[Option<u32>]>,
    /// Entities without an end, in order.
    boundless: Box<[u32]>,
    version: u64,
}

/// A box is larger than its entity by this on each side \[m\].
const FAT_M: f64 = 5e-3;
/// By as much as it moves in so many ticks, and if that is within the limits by no more than this \[m\]: a long box is near
/// much that its entity never meets.
const AHEAD_M: f64 = 10e-3;
const LEAST_TICKS_AHEAD: f64 = 3.0;
const MOST_TICKS_AHEAD: f64 = 16.0;

impl BroadPhase {
    /// Where the entities are now.
    pub fn new(entities: &[Entity]) -> Self {
        let mut tree = Tree::with_capacity(entities.len());
        let around = |(index, entity)| Some((index, Aabb::of_entity(entity)?.grown(FAT_M)));
        let mut boxes: Vec<(u32, Aabb)> = (0..).zip(entities).filter_map(around).collect();
        let mut leaves: Box<[Option<u32>]> = vec![None; entities.len()].into();
        tree.fill(&mut boxes, |index, leaf| leaves[index as usize] = Some(leaf));
        let is_boundless = |index: &u32| leaves[*index as usize].is_none();
        let boundless = (0..entities.len() as u32).filter(is_boundless).collect();
        Self { tree, leaves, boundless, version: 0 }
    }

    /// Takes note of an entity that moved by itself, and will move so much (m) in the next tick: it is in its box then, too.
    /// Says whether that changed.
    pub fn moved(&mut self, index: usize, entity: &Entity, way_W: &Vector3<f64>) -> bool {
        self.put_unless(index, entity, |around, tight| around.contains(&tight.swept(way_W)), way_W)
    }

    /// As [`Self::moved`], where the box may have been made [larger](Self::may_go).
    pub fn shrink(&mut self, index: usize, entity: &Entity, way_W: &Vector3<f64>) -> bool {
        self.put_unless(index, entity, |_, _| false, way_W)
    }

    /// Takes note of an entity that may go so far (m) in this tick, wherever to. Says whether its box changed.
    pub fn may_go(&mut self, index: usize, entity: &Entity, way_m: f64) -> bool {
        let is_within = |around: &Aabb, tight: &Aabb| around.contains(&tight.grown(way_m));
        self.change(index, entity, is_within, |tight| tight.grown(FAT_M + way_m))
    }

    /// Takes note of an entity that was put somewhere else, and will be moved by this (m). Says whether its box changed.
    pub fn was_put(&mut self, index: usize, entity: &Entity, ahead_W: &Vector3<f64>) -> bool {
        self.change(index, entity, Aabb::contains, |tight| tight.grown(FAT_M).swept(ahead_W))
    }

    fn put_unless(
        &mut self,
        index: usize,
        entity: &Entity,
        stays: impl Fn(&Aabb, &Aabb) -> bool,
        way_W: &Vector3<f64>,
    ) -> bool {
        let ticks = (AHEAD_M / way_W.norm()).clamp(LEAST_TICKS_AHEAD, MOST_TICKS_AHEAD);
        self.change(index, entity, stays, |tight| tight.grown(FAT_M).swept(&(way_W * ticks)))
    }

    /// Puts an entity into another box, unless it stays in its own, by that and the tight one.
    fn change(
        &mut self,
        index: usize,
        entity: &Entity,
        stays: impl Fn(&Aabb, &Aabb) -> bool,
        fat: impl Fn(&Aabb) -> Aabb,
    ) -> bool {
        let Some(Some(leaf)) = self.leaves.get(index).copied() else { return false };
        let Some(tight) = Aabb::of_entity(entity) else { return false };
        if stays(self.tree.around(leaf), &tight) {
            return false;
        }
        self.tree.remove(leaf);
        self.leaves[index] = self.tree.insert(index as u32, fat(&tight));
        self.version += 1;
        true
    }

    /// The box that an entity stays in until it is put into another one; `None` of one without an end.
    pub fn around(&self, index: usize) -> Option<&Aabb> {
        self.leaves.get(index).copied().flatten().map(|leaf| self.tree.around(leaf))
    }

    /// Visits all entities whose boxes overlap this one, and those without an end; in no order.
    pub fn near(&self, around: &Aabb, mut found: impl FnMut(usize)) {
        self.boundless.iter().for_each(|&index| found(index as usize));
        self.tree.visit(around, |index| found(index as usize));
    }

    /// Changes whenever a box does.
    pub fn version(&self) -> u64 {
        self.version
    }
}
