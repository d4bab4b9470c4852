//! A finger's slots: one for each entity that is touched or near.
//!
//! Invariants: a slot whose contact lives keeps its entity; entities are in ascending order, so that sums and what is
//! recorded do not depend on the order in which they were met; no allocation after `new`.

use crate::balls::Balls;
use crate::contact::{Slot, Sweep};
use crate::entity::Entity;
use crate::hip::Hip;

/// Slots, and which entity each belongs to.
#[derive(Debug, Clone)]
pub(crate) struct Slots {
    slots: Box<[Slot]>,
    /// Those in use, in ascending order of their entities.
    used: Vec<Used>,
    /// Those that are not.
    unused: Vec<u32>,
    /// Of a point: what it rolls with over [meshes](crate::mesh::Mesh::point_radius_m) that ask for it.
    balls: Vec<Box<Balls>>,
}

/// So many of these meshes may be near a point at once, if nobody says more; over others it walks.
const ROLLED: usize = 16;

#[derive(Debug, Clone, Copy)]
struct Used {
    entity: u32,
    slot: u32,
}

impl Slots {
    /// Of a finger of this radius.
    pub(crate) fn new(finger_radius_m: f64, capacity: usize) -> Self {
        Self {
            slots: (0..capacity).map(|_| Slot::new(finger_radius_m)).collect(),
            used: Vec::with_capacity(capacity),
            // The last one is taken first.
            unused: (0..capacity as u32).rev().collect(),
            balls: if finger_radius_m > 0.0 {
                Vec::new()
            } else {
                (0..capacity.min(ROLLED)).map(|_| Box::default()).collect()
            },
        }
    }

    /// Makes room to roll over so many meshes at once, where that is less.
    pub(crate) fn make_room_to_roll(&mut self, meshes: usize) {
        let wanted = meshes.min(self.capacity());
        let more = wanted.saturating_sub(self.balls.len());
        self.balls.extend((0..more).map(|_| Box::default()));
    }

    pub(crate) fn capacity(&self) -> usize {
        self.slots.len()
    }

    /// Gives slots to the entities that are near (in ascending order), and takes those of others that are not touched.
    pub(crate) fn go_to(
        &mut self,
        near: impl ExactSizeIterator<Item = u32> + Clone,
        entities: &[Entity],
        sweep: &Sweep<'_>,
    ) {
        let stays = self.used.len() == near.len().min(self.capacity())
            && self.used.iter().zip(near.clone()).all(|(used, near)| used.entity == near);
        let exists = self.used.last().is_none_or(|last| (last.entity as usize) < entities.len());
        if !(stays && exists) {
            self.change(near, entities, sweep);
        }
    }

    #[cold]
    #[inline(never)]
    fn change(&mut self, near: impl Iterator<Item = u32> + Clone, entities: &[Entity], sweep: &Sweep<'_>) {
        let mut named = near.clone().peekable();
        let Self { slots, unused, balls, .. } = self;
        self.used.retain(|used| {
            while named.next_if(|near| *near < used.entity).is_some() {}
            let slot = &mut slots[used.slot as usize];
            let exists = (used.entity as usize) < entities.len();
            // Entities that are gone take their contacts along.
            let stays = exists && (slot.has_met() || named.peek() == Some(&used.entity));
            if !stays {
                slot.vacate();
                if sweep.finger_radius_m == 0.0 {
                    balls.extend(slot.balls_mut().take());
                }
                unused.push(used.slot);
            }
            stays
        });
        for entity in near {
            let Some(given) = entities.get(entity as usize) else { break };
            let Err(at) = self.used.binary_search_by_key(&entity, |used| used.entity) else { continue };
            let Some(number) = self.unused.pop() else { break };
            self.used.insert(at, Used { entity, slot: number });
            let slot = &mut self.slots[number as usize];
            if given.rolls_points() && slot.balls_mut().is_none() {
                *slot.balls_mut() = self.balls.pop();
            }
            approach(slot, entity, given, sweep);
        }
    }

    /// How many are in use.
    pub(crate) fn len(&self) -> usize {
        self.used.len()
    }

    /// One of those in use, counted in the order of their entities, and its entity.
    pub(crate) fn at_mut(&mut self, at: usize) -> (usize, &mut Slot) {
        let Used { entity, slot } = self.used[at];
        (entity as usize, &mut self.slots[slot as usize])
    }

    /// In the order of their entities.
    pub(crate) fn iter(&self) -> impl Iterator<Item = &Slot> {
        self.used.iter().map(|used| &self.slots[used.slot as usize])
    }

    /// That of an entity, if it has one.
    pub(crate) fn of(&self, entity: usize) -> Option<&Slot> {
        self.place(entity).map(|slot| &self.slots[slot])
    }

    /// The same, to be changed.
    pub(crate) fn of_mut(&mut self, entity: usize) -> Option<&mut Slot> {
        self.place(entity).map(|slot| &mut self.slots[slot])
    }

    /// Forgets all about an entity.
    pub(crate) fn vacate(&mut self, entity: usize) {
        if let Some(slot) = self.place(entity) {
            self.slots[slot].vacate();
        }
    }

    /// Forgets everything.
    pub(crate) fn vacate_all(&mut self) {
        for used in &self.used {
            self.slots[used.slot as usize].vacate();
        }
    }

    fn place(&self, entity: usize) -> Option<usize> {
        let at = self.used.binary_search_by_key(&entity, |used| used.entity as usize).ok()?;
        Some(self.used[at].slot as usize)
    }
}

/// Notes where the HIP was in the last tick: algorithms that tell a finger's way from an entity's being placed elsewhere
/// believe in no way that they did not see the beginning of.
fn approach(slot: &mut Slot, number: u32, entity: &Entity, sweep: &Sweep<'_>) {
    let Some(from_W) = sweep.previous_hip_W else { return };
    let hip = Hip::from(&from_W);
    slot.step(number as usize, entity, &Sweep { previous_hip_W: None, hip: &hip, ..*sweep });
    if slot.has_met() {
        // It was inside all the time, and nobody said that it is near.
        slot.vacate();
    }
}

#[cfg(test)]
mod tests {
    use crate::mesh::Mesh;
    use crate::mesh::make;
    use crate::{Cuboid, Entity, Finger, Shape, Sphere};
    use nalgebra::{Isometry3, Vector3};
    use std::sync::Arc;

    /// Balls and a box of triangles in a row, 0.1 m from each other.
    fn row() -> Vec<Entity> {
        let (mesh, _) = Mesh::build(make::cuboid([0.04; 3])).expect("a box of triangles");
        let mesh = Shape::from(Arc::new(mesh));
        let shape = |at: u32| if at == 2 { mesh.clone() } else { Sphere::new(0.02).unwrap().into() };
        let entity =
            |at: u32| Entity::new(shape(at), Isometry3::translation(0.1 * f64::from(at), 0.0, 0.0), 500.0);
        (0..5).map(|at| entity(at).unwrap()).collect()
    }

    #[test]
    fn a_finger_that_is_told_what_is_near_feels_what_it_feels_of_all() {
        let entities = row();
        let (mut all, mut told) = (Finger::new(0.0, 5).unwrap(), Finger::new(0.0, 2).unwrap());
        let mut touched = [false; 5];
        for tick in 0..20_000 {
            let t = f64::from(tick);
            let hip = Vector3::new(0.2 - 0.25 * (t * 1e-3).cos(), 0.03 * (t * 0.013).sin(), 0.005);
            // Named from 30 mm before it is touched.
            let is_near = |at: &u32| (entities[*at as usize].X_WB.translation.vector - hip).norm() < 0.06;
            let near: Vec<u32> = (0..5).filter(is_near).collect();
            let felt = told.step_near(&entities, &near, &hip, 1e-3);
            assert_eq!(felt, all.step(&entities, &hip, 1e-3), "tick {tick}");
            felt.entity.iter().for_each(|&entity| touched[entity] = true);
        }
        assert_eq!(touched, [true; 5]);
    }

    #[test]
    fn what_is_touched_is_felt_though_nobody_names_it_and_its_slot_is_free_afterwards() {
        let entities = row();
        let mut finger = Finger::new(0.0, 1).unwrap();
        finger.step_near(&entities, &[0], &Vector3::new(0.0, 0.03, 0.0), 1e-3);
        let hip = Vector3::new(0.0, 0.015, 0.0);
        // Both in reach, room for one: it stays with what it touches.
        for near in [&[0][..], &[], &[4], &[0, 4]] {
            let felt = finger.step_near(&entities, near, &hip, 1e-3);
            assert!((felt.force_on_user_W.y - 2.5).abs() < 1e-12, "500 N/m, 5 mm: {felt:?}");
        }
        finger.step_near(&entities, &[4], &Vector3::new(0.4, 0.03, 0.0), 1e-3);
        finger.step_near(&entities, &[4], &Vector3::new(0.4, 0.03, 0.0), 1e-3);
        let felt = finger.step_near(&entities, &[4], &Vector3::new(0.4, 0.015, 0.0), 1e-3);
        assert_eq!(felt.entity, Some(4));
    }

    #[test]
    fn a_leap_through_a_plate_that_was_named_late_is_held_back() {
        let plates: [Shape; 2] = [
            Cuboid::new([1.0, 1e-3, 1.0]).unwrap().into(),
            Arc::new(Mesh::build(make::cuboid([1.0, 1e-3, 1.0])).unwrap().0).into(),
        ];
        for plate in plates {
            let entities = [Entity::new(plate, Isometry3::identity(), 500.0).unwrap()];
            let mut finger = Finger::new(0.0, 1).unwrap();
            finger.step_near(&entities, &[], &Vector3::new(0.1, 0.2, 0.1), 1e-3);
            let felt = finger.step_near(&entities, &[0], &Vector3::new(0.1, -0.3, 0.1), 1e-3);
            assert_eq!(felt.entity, Some(0));
            assert!((felt.force_on_user_W.y - 500.0 * 0.3005).abs() < 1e-9, "{felt:?}");
        }
    }
}
