//! The same walls with a finger that is kept passive: how stiff they may be, and what that costs.
//!
//! Model: the limit is searched for as without. Beside it stand two walls of the case: one half as stiff as what is quiet
//! without a controller, where it should do nothing, and one twice as stiff as what settles, where it has to.

use super::case::Case;
use super::search::{Found, LEAST_N_PER_M, MOST_N_PER_M, Search};
use super::trial::{Bench, Outcome};
use crate::outcome::RunFailure;
use rt_core::signals::StopSignals;

/// What a controller makes of a case.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Kept {
    /// Up to where it settles.
    pub settled: Found,
    /// Half as stiff as is quiet without.
    pub half: Wall,
    /// Twice as stiff as settles without.
    pub twice: Wall,
}

/// One wall, without and with a controller.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wall {
    /// Its stiffness (N/m).
    pub stiffness_n_per_m: f64,
    /// Without.
    pub bare: Outcome,
    /// With.
    pub kept: Outcome,
}

impl Kept {
    /// Of a case that is quiet and settles up to here without.
    ///
    /// # Errors
    /// If a trial cannot be opened.
    pub fn of(
        bench: &Bench,
        case: &Case,
        [quiet, settled]: [Found; 2],
        signals: &StopSignals,
    ) -> Result<Self, RunFailure> {
        let mut search = Search::default();
        while let Some(stiffness) = search.next() {
            if signals.requested().is_some() {
                break;
            }
            search.learn(stiffness, bench.open_kept(case, stiffness)?.run()?.settles());
        }
        let limit = |found: Found| found.n_per_m().unwrap_or(LEAST_N_PER_M);
        let wall = |stiffness_n_per_m: f64| -> Result<Wall, RunFailure> {
            let stiffness_n_per_m = stiffness_n_per_m.min(MOST_N_PER_M);
            let bare = bench.open(case, stiffness_n_per_m)?.run()?;
            Ok(Wall { stiffness_n_per_m, bare, kept: bench.open_kept(case, stiffness_n_per_m)?.run()? })
        };
        Ok(Self {
            settled: search.found(),
            half: wall(0.5 * limit(quiet))?,
            twice: wall(2.0 * limit(settled))?,
        })
    }
}
