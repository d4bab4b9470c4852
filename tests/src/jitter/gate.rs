//! Whether the hybrid wait is as much better than the reference as it should be.
//!
//! Model: for each gated percentile the ratio of the medians of the per-run percentiles, hybrid over reference,
//! from interleaved runs, against a limit. Never the maximum, never microseconds: on a machine that is shared
//! or virtual these are the machine's.
//! Invariant: fewer than [`LEAST_RUNS`] complete runs are no result, neither passed nor failed.

use crate::jitter::document::Document;
use crate::jitter::error::JitterError;
use crate::jitter::metric::Metric;
use crate::jitter::percentiles::{Level, us};
use crate::jitter::spread::Spread;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::fmt;
use std::path::Path;

/// One run says nothing, four say little.
pub const LEAST_RUNS: usize = 5;

/// The limits.
#[derive(Debug, Clone, PartialEq)]
pub struct Gate {
    /// How many interleaved runs there must be.
    pub runs_at_least: usize,
    limits: Vec<(Level, f64)>,
}

/// One ratio against its limit.
#[derive(Debug, Clone, PartialEq)]
pub struct Judgement {
    /// Of which percentile.
    pub level: Level,
    /// Median over the runs of the hybrid wait's (ns).
    pub ours_ns: f64,
    /// Of the reference's (ns).
    pub reference_ns: f64,
    /// What the ratio may be at most.
    pub at_most: f64,
}

/// All of them.
#[derive(Debug, Clone, PartialEq)]
pub struct Verdict {
    /// How many runs there were of each.
    pub runs: usize,
    /// One by one.
    pub judgements: Vec<Judgement>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Raw {
    runs_at_least: Option<usize>,
    ratio_at_most: BTreeMap<String, f64>,
}

impl Gate {
    /// Reads a file.
    ///
    /// # Errors
    /// If it cannot be read or makes no sense; with what is allowed.
    pub fn load(file: &Path) -> Result<Self, JitterError> {
        let text = std::fs::read_to_string(file)
            .map_err(|source| JitterError::Unreadable { file: file.into(), source })?;
        Self::parse(&text, file)
    }

    /// Reads a text; `file` is named in errors.
    ///
    /// # Errors
    /// As [`load`](Self::load).
    pub fn parse(text: &str, file: &Path) -> Result<Self, JitterError> {
        let bad = |detail: String| JitterError::BadFile { file: file.into(), what: "gate", detail };
        let raw: Raw = toml::from_str(text).map_err(|error| bad(error.to_string().trim_end().to_owned()))?;
        let runs_at_least = raw.runs_at_least.unwrap_or(LEAST_RUNS);
        if !(LEAST_RUNS..=10_000).contains(&runs_at_least) {
            return Err(bad(format!("runs_at_least is {runs_at_least}, allowed are {LEAST_RUNS} to 10000")));
        }
        let limit = |(name, ratio): (&String, &f64)| {
            let level = Level::ALL
                .into_iter()
                .filter(|level| *level != Level::Max)
                .find(|level| level.name() == name);
            let level = level.ok_or_else(|| {
                bad(format!(
                    "ratio_at_most has the key {name:?}; allowed are \"p50\", \"p90\", \"p99\", \"p99.9\" and \"p99.99\" \
                     (quoted, for the point); the maximum is the machine's and is never gated"
                ))
            })?;
            if !(ratio.is_finite() && *ratio > 0.0) {
                return Err(bad(format!("ratio_at_most.\"{name}\" is {ratio}, allowed is a number above 0")));
            }
            Ok((level, *ratio))
        };
        let mut limits: Vec<_> = raw.ratio_at_most.iter().map(limit).collect::<Result<_, _>>()?;
        limits.sort_by_key(|(level, _)| *level);
        if limits.is_empty() {
            return Err(bad("ratio_at_most is empty; give at least one percentile a limit".into()));
        }
        Ok(Self { runs_at_least, limits })
    }

    /// Judges a result.
    ///
    /// # Errors
    /// If there are too few complete runs, or one side is missing.
    pub fn judge(&self, document: &Document) -> Result<Verdict, String> {
        let side = |metric: Metric| {
            let series =
                document.series(metric).ok_or_else(|| format!("there is no series {}", metric.name()))?;
            Ok::<_, String>(series.complete_runs().map(|run| run.percentiles).collect::<Vec<_>>())
        };
        let (ours, reference) = (side(Metric::HybridWake)?, side(Metric::ReferenceWake)?);
        let runs = ours.len().min(reference.len());
        if runs < self.runs_at_least {
            return Err(format!(
                "there are {runs} complete interleaved runs, the gate wants {}",
                self.runs_at_least
            ));
        }
        let least = ours.iter().chain(&reference).map(|run| run.count).min().unwrap_or(0);
        if let Some((level, _)) = self.limits.iter().find(|(level, _)| least < level.needs()) {
            let (name, needs) = (level.name(), level.needs());
            return Err(format!(
                "a run has {least} values, {name} needs {needs} at least; make the slices longer"
            ));
        }
        let median = |side: &[crate::jitter::percentiles::Percentiles], level| {
            Spread::of(side.iter().map(|run| run.at(level) as f64)).map_or(0.0, |spread| spread.median)
        };
        let judgements = self.limits.iter().map(|(level, at_most)| Judgement {
            level: *level,
            ours_ns: median(&ours, *level),
            reference_ns: median(&reference, *level),
            at_most: *at_most,
        });
        Ok(Verdict { runs, judgements: judgements.collect() })
    }
}

impl Judgement {
    /// Ours over the reference's; infinite if the reference cannot be measured.
    pub fn ratio(&self) -> f64 {
        if self.reference_ns > 0.0 { self.ours_ns / self.reference_ns } else { f64::INFINITY }
    }

    /// Whether it holds.
    pub fn holds(&self) -> bool {
        self.ratio() <= self.at_most
    }
}

impl Verdict {
    /// Whether all hold.
    pub fn passed(&self) -> bool {
        self.judgements.iter().all(Judgement::holds)
    }
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let word = if self.passed() { "passed" } else { "FAILED" };
        write!(f, "gate {word}: hybrid over reference, medians of {} interleaved runs", self.runs)?;
        for judgement in &self.judgements {
            write!(
                f,
                "\n  {:6} {:>9} / {:>9} us = {:8.4}  allowed {:<6} {}",
                judgement.level.name(),
                us(judgement.ours_ns),
                us(judgement.reference_ns),
                judgement.ratio(),
                judgement.at_most,
                if judgement.holds() { "holds" } else { "DOES NOT HOLD" }
            )?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::jitter::document::tests::document;

    const COMMITTED: &str = include_str!("../../../config/jitter/gate.toml");

    fn committed() -> Gate {
        Gate::parse(COMMITTED, Path::new("gate.toml")).unwrap()
    }

    /// A run of 10,000 values: nearly all `usual`, 1.5 % `late`, 0.15 % `very_late`.
    fn run(usual: u64, late: u64, very_late: u64) -> Vec<u64> {
        (0..10_000)
            .map(|i| {
                if i < 15 {
                    very_late
                } else if i < 165 {
                    late
                } else {
                    usual
                }
            })
            .collect()
    }

    fn judged(ours: &[Vec<u64>], reference: &[Vec<u64>]) -> Result<Verdict, String> {
        committed().judge(&document(&[(Metric::HybridWake, ours), (Metric::ReferenceWake, reference)]))
    }

    #[test]
    fn the_committed_gate_says_what_the_documentation_says() {
        let gate = committed();
        assert_eq!(gate.runs_at_least, 5);
        assert_eq!(gate.limits, [(Level::P50, 0.01), (Level::P99, 0.25), (Level::P999, 1.25)]);
    }

    #[test]
    fn a_hybrid_wait_as_measured_on_a_good_day_passes() {
        let verdict =
            judged(&vec![run(25, 5_000, 300_000); 5], &vec![run(20_000, 60_000, 400_000); 5]).unwrap();
        assert!(verdict.passed(), "{verdict}");
        assert_eq!(verdict.runs, 5);
    }

    #[test]
    fn each_limit_alone_fails_the_gate() {
        let reference = vec![run(20_000, 60_000, 400_000); 5];
        for (spoilt, level) in [
            (run(300, 5_000, 300_000), Level::P50),
            (run(25, 20_000, 300_000), Level::P99),
            (run(25, 5_000, 600_000), Level::P999),
        ] {
            let verdict = judged(&vec![spoilt; 5], &reference).unwrap();
            let failed: Vec<_> = verdict.judgements.iter().filter(|j| !j.holds()).map(|j| j.level).collect();
            assert_eq!(failed, [level], "{verdict}");
            assert!(!verdict.passed());
        }
    }

    #[test]
    fn two_bad_runs_of_five_do_not_move_the_median_three_do() {
        let reference = vec![run(20_000, 60_000, 400_000); 5];
        let (good, bad) = (run(25, 5_000, 300_000), run(25, 5_000, 9_000_000));
        let mixed = |bads: usize| {
            (0..5).map(|i| if i < bads { bad.clone() } else { good.clone() }).collect::<Vec<_>>()
        };
        assert!(judged(&mixed(2), &reference).unwrap().passed());
        assert!(!judged(&mixed(3), &reference).unwrap().passed());
    }

    #[test]
    fn fewer_than_five_runs_or_too_short_ones_are_refused() {
        let (ours, reference) = (run(25, 5_000, 300_000), run(20_000, 60_000, 400_000));
        let few = judged(&vec![ours.clone(); 4], &vec![reference.clone(); 9]).unwrap_err();
        assert!(few.contains("4 complete interleaved runs, the gate wants 5"), "{few}");
        let short = judged(&vec![ours[..500].to_vec(); 5], &vec![reference; 5]).unwrap_err();
        assert!(short.contains("500 values, p99.9 needs 1000"), "{short}");
        assert!(committed().judge(&document(&[])).unwrap_err().contains("no series hybrid.wake_error"));
    }

    #[test]
    fn a_reference_of_zero_is_not_divided_by() {
        let verdict = judged(&vec![run(25, 50, 60); 5], &vec![run(0, 60_000, 400_000); 5]).unwrap();
        assert!(!verdict.passed(), "what cannot be measured cannot be beaten");
    }

    #[test]
    fn a_gate_that_makes_no_sense_is_refused_with_what_is_allowed() {
        let refusal = |text: &str| Gate::parse(text, Path::new("g.toml")).unwrap_err().to_string();
        assert!(refusal("[ratio_at_most]\nmax = 1.0").contains("never gated"));
        assert!(refusal("runs_at_least = 4\n[ratio_at_most]\np50 = 0.1").contains("allowed are 5 to 10000"));
        assert!(refusal("[ratio_at_most]\np50 = -1.0").contains("above 0"));
        assert!(refusal("[ratio_at_most]\np99.9 = 1.0").contains("g.toml is not a usable gate"));
        assert!(refusal("[ratio_at_most]").contains("is empty"));
        assert!(refusal("limit = 3").contains("unknown field `limit`"));
        assert!(refusal("\0").contains("g.toml"));
    }
}
