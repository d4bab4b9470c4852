//! What a finger could touch within the next ticks.
//!
//! Model: all entities that fingers feel and whose boxes overlap a box around the HIP. It is large, so that it need not be looked for again until
//! the HIP has gone a few millimetres or some entity's box has changed.
//! Invariants: no allocation in `update`; numbers in ascending order.

use haptics::Entity;
use nalgebra::Vector3;
use physics::{Aabb, BroadPhase};

/// The entities near a finger.
#[derive(Debug)]
pub(super) struct Near {
    entities: Vec<u32>,
    /// Where they were looked for, in which version of the register and in which space.
    looked: Option<(Aabb, u64, u32)>,
}

/// They are looked for so far around the finger (m).
const AROUND_M: f64 = 0.02;
/// And again when it comes so near to where they were not (m). What moves has a box that is ahead of it.
const LEAST_M: f64 = 5e-3;

impl Near {
    /// Room for all of so many entities.
    pub(super) fn new(entities: usize) -> Self {
        Self { entities: Vec::with_capacity(entities), looked: None }
    }

    /// What is near a finger of this radius (m), and in its space, that has come from there to here.
    pub(super) fn update(
        &mut self,
        (broad_phase, entities): (&BroadPhase, &[Entity]),
        space: u32,
        from_W: &Vector3<f64>,
        to_W: &Vector3<f64>,
        radius_m: f64,
    ) -> &[u32] {
        let way = Aabb::of_ball(to_W, radius_m).swept(&(from_W - to_W));
        let version = broad_phase.version();
        let is_known = |(around, of, within): &(Aabb, u64, u32)| {
            (*of, *within) == (version, space) && around.contains(&way.grown(LEAST_M))
        };
        if !self.looked.as_ref().is_some_and(is_known) {
            let around = way.grown(AROUND_M);
            let found = &mut self.entities;
            found.clear();
            broad_phase.near(&around, |entity| {
                let is_felt = |entity: &Entity| entity.space == space && entity.is_haptic;
                let is_here = entities.get(entity).is_some_and(is_felt);
                if is_here && found.len() < found.capacity() {
                    found.push(entity as u32);
                }
            });
            found.sort_unstable();
            self.looked = Some((around, version, space));
        }
        &self.entities
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

    fn at(x: f64) -> Vector3<f64> {
        Vector3::new(x, 0.0, 0.0)
    }

    #[test]
    fn what_is_near_is_what_has_no_end_and_what_the_way_comes_to() {
        let entities = entities();
        let broad_phase = BroadPhase::new(&entities);
        let mut near = Near::new(11);
        assert_eq!(near.update((&broad_phase, &entities), 0, &at(0.05), &at(0.05), 0.0), [0]);
        assert_eq!(near.update((&broad_phase, &entities), 0, &at(0.05), &at(0.075), 0.0), [0, 2]);
        assert_eq!(
            near.update((&broad_phase, &entities), 0, &at(0.075), &at(0.375), 0.0),
            [0, 2, 3, 4, 5],
            "a leap"
        );
        assert_eq!(
            near.update((&broad_phase, &entities), 0, &at(0.55), &at(0.55), 0.03),
            [0, 6, 7],
            "a ball of 30 mm"
        );
    }

    #[test]
    fn what_moves_is_found_again() {
        let mut entities = entities();
        let mut broad_phase = BroadPhase::new(&entities);
        let mut near = Near::new(11);
        assert_eq!(near.update((&broad_phase, &entities), 0, &at(0.05), &at(0.05), 0.0), [0]);
        entities[10].move_to(Isometry3::translation(0.05, 0.03, 0.0));
        broad_phase.moved(10, &entities[10], &Vector3::zeros());
        assert_eq!(near.update((&broad_phase, &entities), 0, &at(0.05), &at(0.05), 0.0), [0, 10]);
    }

    #[test]
    fn what_fingers_pass_through_is_not_near() {
        let mut entities = entities();
        entities[1] = entities[1].clone().without_fingers();
        let broad_phase = BroadPhase::new(&entities);
        let mut near = Near::new(11);
        assert_eq!(near.update((&broad_phase, &entities), 0, &at(0.05), &at(0.06), 0.03), [0, 2]);
    }

    #[test]
    fn what_is_in_another_space_is_not_near() {
        let mut entities = entities();
        entities[1] = entities[1].clone().within(1);
        let broad_phase = BroadPhase::new(&entities);
        let mut near = Near::new(11);
        let mut update =
            |space| near.update((&broad_phase, &entities), space, &at(0.05), &at(0.06), 0.03).to_vec();
        assert_eq!((update(0), update(1)), (vec![0, 2], vec![1]), "from one tick to the next");
    }
}
