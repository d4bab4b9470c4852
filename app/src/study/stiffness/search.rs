//! Finds the largest stiffness below the first one that does not settle.
//!
//! Model: from the least one up by a factor until one fails; then halving, on a logarithmic scale, between the last
//! that settled and the one that failed. A stiffness above a failed one is never asked for: an island of quiet
//! beyond a buzz is of no use to anybody.

/// The least stiffness that is tried (N/m).
pub const LEAST_N_PER_M: f64 = 50.0;
/// The largest (N/m).
pub const MOST_N_PER_M: f64 = 100_000.0;
/// From one to the next on the way up.
const FACTOR: f64 = 1.25;
/// Ends when the two ends are so near.
const RESOLUTION: f64 = 1.01;

/// The way to the answer.
#[derive(Debug, Clone, Default)]
pub struct Search {
    /// All that settled, below the first that failed.
    settled: Vec<f64>,
    failed: Option<f64>,
}

/// The answer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Found {
    /// This one settles, one a percent larger does not (N/m).
    Limit(f64),
    /// Not even the least one settles.
    None,
    /// All of them settle.
    All,
}

impl Search {
    /// What to try next; `None`: it is found.
    pub fn next(&self) -> Option<f64> {
        match (self.highest_settled(), self.failed) {
            (None, None) => Some(LEAST_N_PER_M),
            (Some(settled), None) if settled >= MOST_N_PER_M => None,
            (Some(settled), None) => Some((settled * FACTOR).min(MOST_N_PER_M)),
            (Some(settled), Some(failed)) if failed / settled > RESOLUTION => Some((settled * failed).sqrt()),
            _ => None,
        }
    }

    /// What came of a stiffness, asked for or not: what is known already better is kept.
    pub fn learn(&mut self, stiffness: f64, settles: bool) {
        let lowest_failed = self.failed.unwrap_or(f64::INFINITY);
        if !settles {
            self.failed = Some(stiffness.min(lowest_failed));
            // What settled above it is an island.
            self.settled.retain(|settled| *settled < stiffness);
        } else if stiffness < lowest_failed {
            self.settled.push(stiffness);
        }
    }

    fn highest_settled(&self) -> Option<f64> {
        self.settled.iter().copied().max_by(f64::total_cmp)
    }

    /// The answer.
    pub fn found(&self) -> Found {
        match (self.highest_settled(), self.failed) {
            (None, _) => Found::None,
            (Some(settled), Some(_)) => Found::Limit(settled),
            (Some(_), None) => Found::All,
        }
    }
}

impl Found {
    /// For plots and comparisons (N/m).
    pub fn n_per_m(self) -> Option<f64> {
        match self {
            Self::Limit(stiffness) => Some(stiffness),
            Self::None => None,
            Self::All => Some(MOST_N_PER_M),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn search(settles: impl Fn(f64) -> bool) -> (Found, usize) {
        let mut search = Search::default();
        let mut tries = 0;
        while let Some(stiffness) = search.next() {
            search.learn(stiffness, settles(stiffness));
            tries += 1;
        }
        (search.found(), tries)
    }

    #[test]
    fn a_limit_is_found_within_a_percent() {
        for limit in [51.0, 333.0, 2222.0, 98_000.0] {
            let (found, tries) = search(|k| k <= limit);
            let Found::Limit(found) = found else { panic!("{found:?}") };
            assert!(found <= limit && limit <= found * RESOLUTION, "{found} {limit}");
            assert!(tries < 50, "{tries}");
        }
    }

    #[test]
    fn a_failure_below_what_settled_keeps_what_settled_below_it() {
        // Asked for by another search.
        let mut search = Search::default();
        for (k, settles) in [(1000.0, true), (1250.0, true), (1100.0, false)] {
            search.learn(k, settles);
        }
        assert_eq!(search.found(), Found::Limit(1000.0));
        assert_eq!(search.next(), Some(f64::sqrt(1000.0 * 1100.0)));
    }

    #[test]
    fn the_ends_are_told() {
        assert_eq!(search(|_| false).0, Found::None);
        assert_eq!(search(|_| true).0, Found::All);
    }

    #[test]
    fn quiet_beyond_a_buzz_does_not_count() {
        let Found::Limit(found) = search(|k| !(400.0..900.0).contains(&k)).0 else { panic!() };
        assert!((396.0..400.0).contains(&found), "{found}");
    }
}
