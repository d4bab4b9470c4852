//! What changes forces is spread over ticks.
//!
//! Model and bounds:
//! - Stiffness and damping change by a share in each tick, so small that the force of no finger changes by more than
//!   [`MOST_STEP_N`] for it, at the depth of the last tick, and never by more than [`MOST_SHARE`].
//! - What is moved goes along a smooth [path](super::path).
//! - Forces come and go with a world within [`FADE_S`]: in each tick by the tick's part of it.

use super::order::{Move, Scale};
use super::path::{MOST_PACE_PER_S, Next, Path, Tick};
use crate::fast_step::FastStep;
pub use crate::fast_step::{FADE_S, MOST_SHARE};
use physics::MAX_DRIVEN;

/// The most that a finger's force changes in a tick because stiffness and damping do \[N\].
pub const MOST_STEP_N: f64 = 0.05;
/// Stiffness and damping are between a part of what the scene says and as many times it.
pub const MOST_TIMES: f64 = 10.0;

/// What is on its way in a world.
pub struct Gradual {
    /// Of each entity, what its stiffness and damping are to be, in those of the scene.
    targets: Box<[[f64; 2]]>,
    is_scaling: bool,
    paths: Vec<Path>,
    /// Share of their speed with which all of them go.
    pace: f64,
    /// Whether somebody can only go on while no force is felt.
    needs_silence: bool,
    /// Orders that could not be done.
    undone: u64,
}

impl Gradual {
    /// For so many entities.
    pub fn new(entities: usize) -> Self {
        let paths = Vec::with_capacity(MAX_DRIVEN);
        Self {
            targets: vec![[1.0; 2]; entities].into(),
            is_scaling: false,
            paths,
            pace: 1.0,
            needs_silence: false,
            undone: 0,
        }
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
    pub(super) fn set_out(&mut self, moved: &Move) {
        if let Some(path) = self.paths.iter_mut().find(|path| path.entity == moved.entity) {
            path.then = Some(*moved);
        } else if self.paths.len() < MAX_DRIVEN {
            self.paths.push(Path::new(moved));
        } else {
            self.undone += 1;
        }
    }

    /// Whether somebody can only go on while no force is felt.
    pub(super) fn needs_silence(&self) -> bool {
        self.needs_silence
    }

    /// How many orders could not be done: too much was moved at once, or touched what was to be moved.
    pub(super) fn undone(&self) -> u64 {
        self.undone
    }

    /// The factors of the same scene before it was begun anew; nobody feels anything now, so they hold at once.
    pub(super) fn go_on_from(&mut self, before: &Self, step: &mut FastStep) {
        self.undone = before.undone;
        self.targets.copy_from_slice(&before.targets);
        for (entity, target) in self.targets.iter().enumerate() {
            step.set_felt(entity, *target);
        }
    }

    /// A tick of this length (s).
    pub(super) fn advance(&mut self, step: &mut FastStep, dt_s: f64, is_silent: bool) {
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
        let Self { paths, pace, needs_silence, undone, .. } = self;
        *needs_silence = false;
        // All at one pace: what belongs together stays together.
        let mut looked = (true, 1.0);
        for path in paths.iter_mut() {
            let (is_clear, share) = path.look(step, dt_s);
            looked = (looked.0 && is_clear, share.min(looked.1));
        }
        let (is_clear, share) = looked;
        let wanted: f64 = if is_clear { 1.0 } else { 0.0 };
        *pace = wanted.clamp(*pace - MOST_PACE_PER_S * dt_s, *pace + MOST_PACE_PER_S * dt_s);
        let stops = *pace == 0.0 && paths.iter().any(Path::meets_too_much);
        let tick = Tick { dt_s: pace.min(share) * dt_s, is_clear, stops, is_silent };
        paths.retain_mut(|path| {
            let next = path.advance(step, &tick);
            *needs_silence |= next == Next::NeedsSilence;
            *undone += u64::from(matches!(next, Next::Undone | Next::Stopped));
            !matches!(next, Next::Done | Next::Undone)
        });
    }
}

/// From one factor towards another one by no more than this share of it.
fn nearer(from: f64, to: f64, share: f64) -> f64 {
    to.clamp(from * (1.0 - share), from * (1.0 + share))
}

#[cfg(test)]
mod tests {
    use super::*;

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
