//! Entities within a finger's reach: the nearest, where there are more than it has room for.
//!
//! Model: all entities that fingers feel and whose boxes overlap a box around the HIP's way. It is large, so that it need not be
//! looked for again until the HIP has gone a few millimetres or some entity's box has changed. Where that finds more
//! entities than the finger has slots for, the box shrinks, down to the way itself; then the entities' own tight boxes count,
//! in every tick. Of boxes that overlap the way and are too many even so, those count whose middles are nearest to the HIP,
//! after what has no end. What is left out is farther away than what is not.
//! Invariants: no allocation in `update`; numbers in ascending order.
//! Cost: one query of the broad phase every few millimetres; in a crowd up to seven, in each tick.

use haptics::Entity;
use nalgebra::Vector3;
use physics::{Aabb, BroadPhase};

/// The entities near a finger.
#[derive(Debug)]
pub(super) struct Near {
    entities: Vec<u32>,
    /// Of a crowd, how far each is.
    distances: Vec<(f64, u32)>,
    looked: Option<Looked>,
    is_crowded: bool,
}

/// Slots of a finger. What is touched keeps its own, near or not.
pub(super) struct Room<F> {
    pub(super) slots: usize,
    /// Number of touched entities.
    pub(super) touched: usize,
    pub(super) is_touched: F,
}

impl<F: Fn(u32) -> bool> Room<F> {
    /// Number of these and of those that are touched beyond its slots.
    fn excess(&self, found: &[u32]) -> usize {
        let most = found.len() + self.touched;
        if most <= self.slots {
            return 0;
        }
        let both = found.iter().filter(|&&entity| (self.is_touched)(entity)).count();
        (most - both).saturating_sub(self.slots)
    }
}

/// Where entities were looked for.
#[derive(Debug)]
struct Looked {
    around: Aabb,
    /// They are looked for again when the way comes so near to the rim (m). What moves has a box that is ahead of it.
    least_m: f64,
    /// Of the broad phase.
    version: u64,
    space: u32,
}

/// How far around the finger's way entities are looked for (m).
const AROUND_M: [f64; 6] = [0.02, 0.01, 5e-3, 2.5e-3, 1.25e-3, 0.0];
/// Of that, what is left when they are looked for again.
const LEAST: f64 = 0.25;

impl Near {
    /// Room for all of so many entities.
    pub(super) fn new(entities: usize) -> Self {
        Self {
            entities: Vec::with_capacity(entities),
            distances: Vec::with_capacity(entities),
            looked: None,
            is_crowded: false,
        }
    }

    /// Whether there was more at the finger's place in the last tick than it has room for.
    pub(super) fn is_crowded(&self) -> bool {
        self.is_crowded
    }

    /// Entities near a finger of this radius (m), and in its space, that has come from there to here: no more than it
    /// has room for.
    pub(super) fn update(
        &mut self,
        of: (&BroadPhase, &[Entity]),
        (space, room): (u32, &Room<impl Fn(u32) -> bool>),
        from_W: &Vector3<f64>,
        to_W: &Vector3<f64>,
        radius_m: f64,
    ) -> &[u32] {
        let way = Aabb::of_ball(to_W, radius_m).swept(&(from_W - to_W));
        let version = of.0.version();
        let is_known = |looked: &Looked| {
            (looked.version, looked.space) == (version, space)
                && looked.around.contains(&way.grown(looked.least_m))
        };
        self.is_crowded = false;
        if room.excess(&self.entities) > 0 || !self.looked.as_ref().is_some_and(is_known) {
            self.looked = self.look(of, (space, room), &way);
            let excess = room.excess(&self.entities);
            if excess > 0 {
                self.is_crowded = true;
                let most = self.entities.len().saturating_sub(excess);
                self.keep_nearest(of.1, (most, &room.is_touched), to_W);
            }
        }
        &self.entities
    }

    /// Fills in what is near; `None` if that holds for this tick alone.
    fn look(
        &mut self,
        (broad_phase, entities): (&BroadPhase, &[Entity]),
        (space, room): (u32, &Room<impl Fn(u32) -> bool>),
        way: &Aabb,
    ) -> Option<Looked> {
        let mut find = |around: &Aabb, is_tight: bool| {
            let found = &mut self.entities;
            found.clear();
            broad_phase.near(around, |entity| {
                let is_felt = |entity: &Entity| entity.space == space && entity.is_haptic;
                let is_there = |entity: &Entity| {
                    !is_tight || Aabb::of_entity(entity).is_none_or(|tight| tight.overlaps(around))
                };
                let is_here = entities.get(entity).is_some_and(|entity| is_felt(entity) && is_there(entity));
                if is_here && found.len() < found.capacity() {
                    found.push(entity as u32);
                }
            });
            found.sort_unstable();
            room.excess(found)
        };
        for around_m in AROUND_M {
            let around = way.grown(around_m);
            if find(&around, false) == 0 {
                let least_m = LEAST * around_m;
                return Some(Looked { around, least_m, version: broad_phase.version(), space });
            }
        }
        find(way, true);
        None
    }

    /// All are at the finger's place by their boxes.
    fn keep_nearest(
        &mut self,
        entities: &[Entity],
        (most, is_touched): (usize, &impl Fn(u32) -> bool),
        hip_W: &Vector3<f64>,
    ) {
        let Self { entities: found, distances, .. } = self;
        let distance_m = |entity: u32| {
            if is_touched(entity) {
                return -2.0;
            }
            // What has no end comes first of the others.
            let tight = entities.get(entity as usize).and_then(Aabb::of_entity);
            tight.map_or(-1.0, |tight| (tight.middle_W() - hip_W).norm())
        };
        distances.clear();
        distances.extend(found.drain(..).map(|entity| (distance_m(entity), entity)));
        distances.sort_unstable_by(|(near_m, _), (far_m, _)| near_m.total_cmp(far_m));
        found.extend(distances.iter().take(most).map(|&(_, entity)| entity));
        found.sort_unstable();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use haptics::{Plane, Sphere};
    use nalgebra::Isometry3;

    /// A floor, and balls of 10 mm along x, 0.1 m from each other.
    fn entities() -> Vec<Entity> {
        let floor = Plane::new(Vector3::y(), 0.0).unwrap();
        let mut entities = vec![Entity::new(floor, Isometry3::identity(), 1000.0).unwrap()];
        for at in 0..10 {
            let pose = Isometry3::translation(0.1 * f64::from(at), 0.0, 0.0);
            entities.push(Entity::new(Sphere::new(0.01).unwrap(), pose, 1000.0).unwrap());
        }
        entities
    }

    /// Of a finger that touches nothing.
    fn slots(slots: usize) -> Room<fn(u32) -> bool> {
        Room { slots, touched: 0, is_touched: |_| false }
    }

    fn at(x: f64) -> Vector3<f64> {
        Vector3::new(x, 0.0, 0.0)
    }

    #[test]
    fn what_is_near_is_what_has_no_end_and_what_the_way_comes_to() {
        let entities = entities();
        let broad_phase = BroadPhase::new(&entities);
        let mut near = Near::new(11);
        assert_eq!(near.update((&broad_phase, &entities), (0, &slots(11)), &at(0.05), &at(0.05), 0.0), [0]);
        assert_eq!(
            near.update((&broad_phase, &entities), (0, &slots(11)), &at(0.05), &at(0.075), 0.0),
            [0, 2]
        );
        assert_eq!(
            near.update((&broad_phase, &entities), (0, &slots(11)), &at(0.075), &at(0.375), 0.0),
            [0, 2, 3, 4, 5],
            "a leap"
        );
        assert_eq!(
            near.update((&broad_phase, &entities), (0, &slots(11)), &at(0.55), &at(0.55), 0.03),
            [0, 6, 7],
            "a ball of 30 mm"
        );
    }

    /// 21 x 21 dots, 2.5 mm from each other, and the floor below them, which comes last.
    #[test]
    fn of_a_crowd_the_nearest_are_found() {
        let dot = Sphere::new(1e-3).unwrap();
        let place = |at: u32| Vector3::new(2.5e-3 * f64::from(at % 21), 0.0, 2.5e-3 * f64::from(at / 21));
        let put = |at| Entity::new(dot, Isometry3::from_parts(place(at).into(), Default::default()), 1000.0);
        let mut entities: Vec<Entity> = (0..441).map(|at| put(at).unwrap()).collect();
        entities.push(
            Entity::new(Plane::new(Vector3::y(), 0.0).unwrap(), Isometry3::identity(), 1000.0).unwrap(),
        );
        let broad_phase = BroadPhase::new(&entities);
        let mut near = Near::new(442);
        for most in [5, 20, 128] {
            for at in 0..441 {
                let hip = place(at);
                let found = near.update((&broad_phase, &entities), (0, &slots(most)), &hip, &hip, 0.0);
                assert!(
                    found.contains(&at) && found.contains(&441) && found.len() <= most,
                    "{at} of {most}: {found:?}"
                );
            }
        }
        assert!(!near.is_crowded());
        let found = near.update((&broad_phase, &entities), (0, &slots(1)), &place(7), &place(7), 0.0);
        assert_eq!(found, [441], "what has no end, of two at one place");
        assert!(near.is_crowded());
        let found = near.update((&broad_phase, &entities), (0, &slots(2)), &place(7), &place(7), 0.0);
        assert_eq!(found, [7, 441]);
        assert!(!near.is_crowded());
    }

    /// A touched entity is there with its box or without, and takes one slot.
    #[test]
    fn what_is_touched_crowds_nobody_out_when_it_is_near_again() {
        let entities = entities();
        let broad_phase = BroadPhase::new(&entities);
        let mut near = Near::new(11);
        let room = Room { slots: 2, touched: 1, is_touched: |entity| entity == 4 };
        for (x_m, found) in [(0.55, &[0][..]), (0.3, &[0, 4]), (0.55, &[0])] {
            assert_eq!(near.update((&broad_phase, &entities), (0, &room), &at(x_m), &at(x_m), 0.0), found);
            assert!(!near.is_crowded(), "{x_m}");
        }
        // There is another one, and the touched one has its slot already.
        assert_eq!(near.update((&broad_phase, &entities), (0, &room), &at(0.4), &at(0.4), 0.0), [0]);
        assert!(near.is_crowded());
        let room = Room { slots: 1, ..room };
        assert_eq!(near.update((&broad_phase, &entities), (0, &room), &at(0.3), &at(0.3), 0.0), [4]);
    }

    /// A finger of 20 mm on the same dots, more of which its box overlaps than it has room for.
    #[test]
    fn of_boxes_at_one_place_those_with_the_nearest_middles_are_found() {
        let dot = Sphere::new(1e-3).unwrap();
        let x_m = |at: u32| 2.5e-3 * f64::from(at);
        let put = |at| Entity::new(dot, Isometry3::translation(x_m(at), 0.0, 0.0), 1000.0).unwrap();
        let entities: Vec<Entity> = (0..40).map(put).collect();
        let broad_phase = BroadPhase::new(&entities);
        let mut near = Near::new(40);
        for middle in 4..36 {
            let hip = at(x_m(middle) + 1e-4);
            let found = near.update((&broad_phase, &entities), (0, &slots(5)), &hip, &hip, 0.02);
            assert_eq!(found, [middle - 2, middle - 1, middle, middle + 1, middle + 2]);
            assert!(near.is_crowded());
        }
    }

    #[test]
    fn what_moves_is_found_again() {
        let mut entities = entities();
        let mut broad_phase = BroadPhase::new(&entities);
        let mut near = Near::new(11);
        assert_eq!(near.update((&broad_phase, &entities), (0, &slots(11)), &at(0.05), &at(0.05), 0.0), [0]);
        entities[10].move_to(Isometry3::translation(0.05, 0.03, 0.0));
        broad_phase.was_put(10, &entities[10], &Vector3::zeros());
        assert_eq!(
            near.update((&broad_phase, &entities), (0, &slots(11)), &at(0.05), &at(0.05), 0.0),
            [0, 10]
        );
    }

    #[test]
    fn what_fingers_pass_through_is_not_near() {
        let mut entities = entities();
        entities[1] = entities[1].clone().without_fingers();
        let broad_phase = BroadPhase::new(&entities);
        let mut near = Near::new(11);
        assert_eq!(
            near.update((&broad_phase, &entities), (0, &slots(11)), &at(0.05), &at(0.06), 0.03),
            [0, 2]
        );
    }

    #[test]
    fn what_is_in_another_space_is_not_near() {
        let mut entities = entities();
        entities[1] = entities[1].clone().within(1);
        let broad_phase = BroadPhase::new(&entities);
        let mut near = Near::new(11);
        let mut update = |space| {
            near.update((&broad_phase, &entities), (space, &slots(11)), &at(0.05), &at(0.06), 0.03).to_vec()
        };
        assert_eq!((update(0), update(1)), (vec![0, 2], vec![1]), "from one tick to the next");
    }
}
