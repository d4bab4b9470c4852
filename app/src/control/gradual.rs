//! What changes forces is spread over ticks.
//!
//! Model and bounds:
//! - Stiffness and damping change by a share in each tick, so small that the force of no finger changes by more than
//!   [`MOST_STEP_N`] for it, at the depth of the last tick, and never by more than [`MOST_SHARE`].
//! - What is moved goes along a path of least jerk, no faster than [`MOST_SPEED_M_S`] and sped up by no more than
//!   [`MOST_ACCELERATION_M_S2`]: where that takes longer than was asked for, it takes longer. A finger that stands in its way
//!   feels k times the way of a tick more in each tick, at most.
//! - Forces come and go with a world within [`FADE_S`]: in each tick by the tick's part of it.

use super::order::{Move, Scale};
use crate::fast_step::FastStep;
use nalgebra::{Isometry3, Vector3};
use physics::MAX_DRIVEN;

/// The most that a finger's force changes in a tick because stiffness and damping do \[N\].
pub const MOST_STEP_N: f64 = 0.05;
/// The most that either changes in a tick, as a share of itself.
pub const MOST_SHARE: f64 = 0.01;
/// How fast an entity is moved at most \[m/s\].
pub const MOST_SPEED_M_S: f64 = 0.5;
/// How much its speed changes at most \[m/s^2\].
pub const MOST_ACCELERATION_M_S2: f64 = 5.0;
/// How long forces take to go before a world is replaced, and to come after that \[s\].
pub const FADE_S: f64 = 0.1;
/// Stiffness and damping are between a part of what the scene says and as many times it.
pub const MOST_TIMES: f64 = 10.0;

/// What is on its way in a world.
pub struct Gradual {
    /// Of each entity, what its stiffness and damping are to be, in those of the scene.
    targets: Box<[[f64; 2]]>,
    is_scaling: bool,
    paths: Vec<Path>,
}

/// An entity's way.
#[derive(Debug, Clone, Copy)]
struct Path {
    entity: usize,
    from_W: Isometry3<f64>,
    to_W: Vector3<f64>,
    over_s: f64,
    passed_s: f64,
    /// Where it goes then: the newest order that came meanwhile.
    then: Option<Move>,
}

impl Gradual {
    /// For so many entities.
    pub fn new(entities: usize) -> Self {
        let paths = Vec::with_capacity(MAX_DRIVEN);
        Self { targets: vec![[1.0; 2]; entities].into(), is_scaling: false, paths }
    }

    /// Changes what stiffness or damping is to be.
    pub(super) fn scale(&mut self, scale: &Scale) {
        let targets = match scale.entity {
            Some(entity) => self.targets.get_mut(entity..=entity),
            None => Some(&mut self.targets[..]),
        };
        for target in targets.into_iter().flatten() {
            let factor = &mut target[scale.which as usize];
            *factor = (*factor * scale.by).clamp(MOST_TIMES.recip(), MOST_TIMES);
        }
        self.is_scaling = true;
    }

    /// An entity sets out, or will when it has come to where it is going.
    pub(super) fn set_out(&mut self, moved: &Move, step: &FastStep) {
        if let Some(path) = self.paths.iter_mut().find(|path| path.entity == moved.entity) {
            path.then = Some(*moved);
        } else if let Some(entity) = step.entities().get(moved.entity)
            && self.paths.len() < MAX_DRIVEN
        {
            self.paths.push(Path::new(moved, entity.X_WB));
        }
    }

    /// The factors of the same scene before it was begun anew; nobody feels anything now, so they hold at once.
    pub(super) fn go_on_from(&mut self, before: &Self, step: &mut FastStep) {
        self.targets.copy_from_slice(&before.targets);
        for (entity, target) in self.targets.iter().enumerate() {
            step.set_felt(entity, *target);
        }
    }

    /// A tick of this length (s).
    pub(super) fn advance(&mut self, step: &mut FastStep, dt_s: f64) {
        if self.is_scaling {
            // Both may change at once: each has half of what is allowed.
            let share = (0.5 * MOST_STEP_N / step.touch_load_n()).min(MOST_SHARE);
            self.is_scaling = false;
            for (entity, target) in self.targets.iter().enumerate() {
                let Some(felt) = step.felt(entity) else { continue };
                let nearer = [0, 1].map(|which| nearer(felt[which], target[which], share));
                step.set_felt(entity, nearer);
                self.is_scaling |= nearer != *target;
            }
        }
        self.paths.retain_mut(|path| path.advance(step, dt_s));
    }
}

/// From one factor towards another one by no more than this share of it.
fn nearer(from: f64, to: f64, share: f64) -> f64 {
    to.clamp(from * (1.0 - share), from * (1.0 + share))
}

impl Path {
    fn new(moved: &Move, from_W: Isometry3<f64>) -> Self {
        let way_m = (moved.to_W - from_W.translation.vector).norm();
        let over_s = moved.over_s.max(least_s(way_m));
        Self { entity: moved.entity, from_W, to_W: moved.to_W, over_s, passed_s: 0.0, then: None }
    }

    /// Goes on by a tick; says whether it goes on after that.
    fn advance(&mut self, step: &mut FastStep, dt_s: f64) -> bool {
        self.passed_s += dt_s;
        let is_there = self.passed_s >= self.over_s;
        let to_W = if is_there { self.to_W } else { self.place_W() };
        step.drive(self.entity, Isometry3::from_parts(to_W.into(), self.from_W.rotation));
        if !is_there {
            return true;
        }
        let Some(next) = self.then else { return false };
        *self = Self::new(&next, Isometry3::from_parts(to_W.into(), self.from_W.rotation));
        true
    }

    fn place_W(&self) -> Vector3<f64> {
        let from_W = self.from_W.translation.vector;
        from_W + (self.to_W - from_W) * least_jerk(self.passed_s / self.over_s)
    }
}

/// Which part of a way is behind one after this part of its time.
fn least_jerk(t: f64) -> f64 {
    t * t * t * (10.0 - 15.0 * t + 6.0 * t * t)
}

/// The least time for a way of this length (s): the path's fastest is 15/8 of its mean, and its largest acceleration
/// 10 / sqrt(3) of way over time squared.
pub fn least_s(way_m: f64) -> f64 {
    let by_speed_s = 1.875 * way_m / MOST_SPEED_M_S;
    by_speed_s.max((10.0 / 3.0_f64.sqrt() * way_m / MOST_ACCELERATION_M_S2).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shortest_ways_in_time_are_as_fast_or_as_sharp_as_allowed_and_never_more() {
        for way_m in [1e-3, 0.02, 0.1, 0.5, 2.0] {
            let (over_s, n) = (least_s(way_m), 100_000_u32);
            let place = |i: u32| way_m * least_jerk(f64::from(i) / f64::from(n));
            let dt_s = over_s / f64::from(n);
            let speed = (0..n).map(|i| (place(i + 1) - place(i)) / dt_s).fold(0.0, f64::max);
            // Second differences of steps of 1e-5: rounding is 1e-16 / 1e-10 of the mean.
            let coarse = (1..100_u32).map(|i| {
                (place(1000 * (i + 1)) - 2.0 * place(1000 * i) + place(1000 * (i - 1)))
                    / (1000.0 * dt_s).powi(2)
            });
            let sharpest = coarse.fold(0.0, f64::max);
            let (used_speed, used_sharp) = (speed / MOST_SPEED_M_S, sharpest / MOST_ACCELERATION_M_S2);
            assert!(
                used_speed <= 1.0 + 1e-9 && used_sharp <= 1.0 + 1e-9,
                "{way_m}: {used_speed} {used_sharp}"
            );
            // Of a hundred points one is nearly where it is sharpest.
            assert!(used_speed.max(used_sharp) > 0.999, "{way_m}: {used_speed} {used_sharp}");
        }
    }

    #[test]
    fn a_factor_comes_to_where_it_goes_to_the_bit() {
        let mut factor = 1.0;
        for tick in 0.. {
            factor = nearer(factor, 0.37, 0.01);
            if factor == 0.37 {
                // ln 0.37 / ln 0.99
                assert_eq!(tick, 98);
                break;
            }
        }
    }
}
