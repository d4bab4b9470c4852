//! Places for fingers outside of everything that they feel.
//!
//! Problem: a finger that begins inside of a thing is pushed out of it as the run begins.
//! Model: a place is free if a finger that begins there touches nothing, nor does one that begins a little beside it. That
//! is asked of a finger itself: so every shape, picture and algorithm counts as it will in the run. The nearest free place
//! is looked for on spheres around the wanted one, the smallest first, then back towards it, and then to all sides by ever
//! shorter ways: a bay that is deeper than wide is not on the way back.
//! Cost: first steps of a finger against what is near, before a run begins: on each of 135 spheres 256 places with up to
//! seven of them. Where nothing is free that is 34,560 of them at least and 241,920 at most. To all sides it is 256 places
//! in each of 64 rounds at most, of which half are nearer and asked for.

#![allow(non_snake_case)] // Names carry their frame: place_W is a place in W.

use haptics::{Entity, Finger, Hip, ParameterError};
use nalgebra::Vector3;
use physics::{Aabb, BroadPhase};
use std::f64::consts::PI;

/// Nearer to a thing than this no finger is left (m).
pub(super) const LEAST_M: f64 = 1e-3;
/// A finger that is put elsewhere is put so far from things (m).
pub(super) const BESIDE_M: f64 = 5e-3;
/// The first sphere, how much larger each is than the one before, and the last one (m).
const FIRST_M: f64 = 2e-3;
const GROWTH: f64 = 1.06;
const LAST_M: f64 = 5.0;
/// Places on each sphere.
const DIRECTIONS: u32 = 256;
/// Halvings of what lies between two spheres: down to a 250th of it.
const HALVINGS: u32 = 8;
/// To all sides: the first way, in parts of how far the place is; the shortest (m); how often.
const ASIDE: f64 = 0.25;
const LEAST_ASIDE_M: f64 = 1e-4;
const ROUNDS: u32 = 64;
/// No more things are near a finger at once.
const MOST_NEAR: usize = 1024;

/// A scene's things, and a finger to try places with.
pub(super) struct FreePlaces<'e> {
    entities: &'e [Entity],
    broad_phase: BroadPhase,
    probe: Finger,
    near: Vec<u32>,
}

impl<'e> FreePlaces<'e> {
    /// Among these entities, for a finger of this radius (m) in this space.
    ///
    /// # Errors
    /// A radius that is none.
    pub(super) fn new(entities: &'e [Entity], radius_m: f64, space: u32) -> Result<Self, ParameterError> {
        let probe = Finger::new(radius_m, entities.len().min(MOST_NEAR))?.within(space);
        Ok(Self { entities, broad_phase: BroadPhase::new(entities), probe, near: Vec::new() })
    }

    /// What a finger touches that begins here.
    pub(super) fn touched(&mut self, place_W: &Vector3<f64>) -> impl Iterator<Item = usize> + '_ {
        let (entities, near, space) = (self.entities, &mut self.near, self.probe.space());
        near.clear();
        self.broad_phase.near(&Aabb::of_ball(place_W, self.probe.radius_m()), |entity| {
            if entities[entity].is_haptic && entities[entity].space == space {
                near.push(entity as u32);
            }
        });
        near.sort_unstable();
        self.probe.reset();
        self.probe.step_near(entities, near, Hip { position_W: *place_W, velocity_W: None }, 1e-3);
        self.probe.contacts().map(|contact| contact.entity)
    }

    /// Whether a finger that begins here, or so far beside (m), touches nothing.
    pub(super) fn is_free(&mut self, place_W: &Vector3<f64>, beside_m: f64) -> bool {
        let beside =
            [-1.0, 1.0].into_iter().flat_map(|side| (0..3).map(move |axis| Vector3::ith(axis, side)));
        let mut all = std::iter::once(Vector3::zeros()).chain(beside);
        all.all(|way| self.touched(&(place_W + beside_m * way)).next().is_none())
    }

    /// A free place from which none that is nearer to this one is seen; `None`: there is none within metres.
    pub(super) fn nearest(&mut self, wanted_W: &Vector3<f64>) -> Option<Vector3<f64>> {
        for radius_m in radii_m() {
            let mut on_sphere = (0..DIRECTIONS).map(direction);
            let free = on_sphere.find(|way| self.is_free(&(wanted_W + radius_m * way), BESIDE_M));
            if let Some(way) = free {
                let back_W = self.back(wanted_W, &way, radius_m);
                return Some(self.aside(wanted_W, back_W));
            }
        }
        None
    }

    /// Nearer to the wanted place, by ways to all sides.
    fn aside(&mut self, wanted_W: &Vector3<f64>, mut place_W: Vector3<f64>) -> Vector3<f64> {
        let mut aside_m = ASIDE * (place_W - wanted_W).norm();
        for _ in 0..ROUNDS {
            let far_m = (place_W - wanted_W).norm();
            let mut nearer: Vec<(f64, Vector3<f64>)> = (0..DIRECTIONS)
                .map(|number| place_W + aside_m * direction(number))
                .map(|next_W| ((next_W - wanted_W).norm(), next_W))
                .filter(|(next_m, _)| *next_m < far_m)
                .collect();
            nearer.sort_by(|a, b| a.0.total_cmp(&b.0));
            match nearer.into_iter().find(|(_, next_W)| self.is_free(next_W, BESIDE_M)) {
                Some((_, next_W)) => place_W = next_W,
                None if aside_m < LEAST_ASIDE_M => break,
                None => aside_m *= 0.5,
            }
        }
        place_W
    }

    /// Towards the wanted place, as far as it stays free.
    fn back(&mut self, wanted_W: &Vector3<f64>, way: &Vector3<f64>, radius_m: f64) -> Vector3<f64> {
        let (mut taken_m, mut free_m) = (radius_m / GROWTH, radius_m);
        for _ in 0..HALVINGS {
            let middle_m = 0.5 * (taken_m + free_m);
            let is_free = self.is_free(&(wanted_W + middle_m * way), BESIDE_M);
            *(if is_free { &mut free_m } else { &mut taken_m }) = middle_m;
        }
        wanted_W + free_m * way
    }
}

/// Of the spheres, the smallest first.
fn radii_m() -> impl Iterator<Item = f64> {
    std::iter::successors(Some(FIRST_M), |radius_m| Some(radius_m * GROWTH))
        .take_while(|radius_m| *radius_m < LAST_M)
}

/// Evenly over a sphere, along a spiral from straight up to straight down.
fn direction(number: u32) -> Vector3<f64> {
    let golden_rad = PI * (3.0 - 5.0f64.sqrt());
    let height = 1.0 - 2.0 * f64::from(number) / f64::from(DIRECTIONS - 1);
    let (sin, cos) = (golden_rad * f64::from(number)).sin_cos();
    let level = (1.0 - height * height).max(0.0).sqrt();
    Vector3::new(level * cos, height, level * sin)
}

#[cfg(test)]
mod tests {
    use super::*;
    use haptics::{Cuboid, Plane, Shape, Sphere};
    use nalgebra::Isometry3;

    fn entity(shape: impl Into<Shape>, place: [f64; 3]) -> Entity {
        Entity::new(shape.into(), Isometry3::translation(place[0], place[1], place[2]), 1000.0)
            .expect("a thing")
    }

    #[test]
    fn the_nearest_free_place_is_above_a_floor_and_beside_a_ball() {
        let entities = [
            entity(Plane::new(Vector3::y(), 0.0).unwrap(), [0.0; 3]),
            entity(Sphere::new(0.05).unwrap(), [0.3, 0.2, 0.0]),
        ];
        let mut places = FreePlaces::new(&entities, 0.0, 0).unwrap();
        let above = places.nearest(&Vector3::new(0.0, -0.02, 0.0)).expect("above the floor");
        assert!(above.xz().norm() < 2e-3 && (above.y - BESIDE_M).abs() < 1e-3, "{above}");
        let centre = Vector3::new(0.3, 0.2, 0.0);
        let out_m =
            (places.nearest(&(centre + Vector3::new(0.04, 0.0, 0.0))).expect("beside it") - centre).norm();
        // Along the axes 5 mm are free; between them some tenths of a millimetre less is enough.
        assert!((0.053..0.0565).contains(&out_m), "{out_m}");
        assert!(places.is_free(&Vector3::new(0.0, 0.0011, 0.0), LEAST_M));
        assert!(!places.is_free(&Vector3::new(0.0, 0.0009, 0.0), LEAST_M));
    }

    #[test]
    fn a_ball_does_not_stay_in_a_slot_that_is_narrower_and_what_it_passes_through_is_in_nobody_s_way() {
        let wall = |x| entity(Cuboid::new([0.02, 0.04, 0.04]).unwrap(), [x, 0.0, 0.0]);
        let walls = [wall(-0.0155), wall(0.0155)];
        let mut places = FreePlaces::new(&walls, 0.006, 0).unwrap();
        let out = places.nearest(&Vector3::zeros()).expect("out of the slot");
        assert!(out.norm() > 0.02 && places.is_free(&out, LEAST_M), "{out}");
        let ghosts = walls.map(Entity::without_fingers);
        assert!(FreePlaces::new(&ghosts, 0.006, 0).unwrap().is_free(&Vector3::zeros(), LEAST_M));
    }

    #[test]
    fn a_place_is_looked_for_on_so_many_spheres_as_the_cost_says() {
        assert_eq!(radii_m().count(), 135);
        assert_eq!(radii_m().count() as u32 * DIRECTIONS, 34_560);
    }

    #[test]
    fn directions_are_spread_evenly() {
        for way in [Vector3::x(), -Vector3::z(), Vector3::new(0.6, -0.8, 0.0)] {
            let nearest = (0..DIRECTIONS).map(|number| direction(number).dot(&way)).fold(-1.0, f64::max);
            assert!(nearest > 10f64.to_radians().cos(), "{way} {nearest}");
        }
        assert_eq!(direction(0), Vector3::y());
    }
}
