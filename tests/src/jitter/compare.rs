//! Two results against each other: which change helped?
//!
//! Model: for each metric and percentile the medians of the per-run percentiles, their intervals (see
//! [`Spread`]) and the ratio B / A. "better" or "worse" is said only if the intervals have no value in common *and*
//! the ratio exceeds what the histograms can tell apart. Everything else is "no difference shown", which is not "the
//! same". Of some forty verdicts one or two are chance: a change that helped shows in several percentiles.

use crate::jitter::document::{Document, Series};
use crate::jitter::percentiles::{Level, us};
use crate::jitter::spread::Spread;
use std::collections::BTreeMap;
use std::fmt;

/// Below this a difference may be the histograms' buckets (3.2 %) or cyclictest's whole microseconds.
const RESOLUTION: f64 = 0.05;
/// Fewer runs have no spread worth the name.
const LEAST_RUNS: usize = 3;

/// Never twice the same, and no circumstance that somebody changed.
const VOLATILE: &str = "load average at start";

/// What can be said of one percentile.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Finding {
    /// B is lower than A, beyond the spread.
    Better,
    /// B is higher than A, beyond the spread.
    Worse,
    /// The difference is within the spread.
    NoneShown,
    /// The maximum: it grows with the length of a run, and on most machines it is somebody else's.
    NotJudged,
    /// Too few runs, or too few values in a run for this percentile.
    TooFew,
}

/// One line.
#[derive(Debug, Clone, PartialEq)]
pub struct Line {
    /// Of the metric.
    pub metric: &'static str,
    /// Which percentile.
    pub level: Level,
    /// Before.
    pub a: Option<Spread>,
    /// After.
    pub b: Option<Spread>,
    /// What can be said.
    pub finding: Finding,
}

/// All lines, and what else differs.
#[derive(Debug, Clone, PartialEq)]
pub struct Comparison {
    /// By metric and percentile.
    pub lines: Vec<Line>,
    /// Metrics that only one of the two has.
    pub only: Vec<String>,
    /// Circumstances that differ: what, A's, B's.
    pub differences: Vec<(String, String, String)>,
    /// Counters per million ticks: style and name, A's, B's.
    pub rates: Vec<(String, f64, f64)>,
}

/// Compares.
pub fn compare(a: &Document, b: &Document) -> Comparison {
    let pairs = a.series.iter().filter_map(|series| Some((series, b.series(series.metric)?)));
    let lines = pairs.flat_map(|(a, b)| Level::ALL.into_iter().map(move |level| line(a, b, level))).collect();
    let missing = |side: &str, of: &Document, from: &Document| {
        let alone = of.series.iter().filter(|series| from.series(series.metric).is_none());
        alone.map(|series| format!("{} is in {side} only", series.metric.name())).collect::<Vec<_>>()
    };
    let mut differences = differing("machine", &a.machine, &b.machine);
    differences.extend(differing("configuration", &a.configuration, &b.configuration));
    differences.extend(differing("guarantees", &joined(&a.guarantees), &joined(&b.guarantees)));
    Comparison {
        lines,
        only: [missing("A", a, b), missing("B", b, a)].concat(),
        differences,
        rates: rates(a, b),
    }
}

fn line(a: &Series, b: &Series, level: Level) -> Line {
    let spread = |series: &Series| {
        // A percentile of too few values is the maximum under another name.
        let runs = series.complete_runs().filter(|run| run.percentiles.count >= level.needs());
        Spread::of(runs.map(|run| run.percentiles.at(level) as f64))
    };
    let (before, after) = (spread(a), spread(b));
    let finding = match (before, after) {
        _ if level == Level::Max => Finding::NotJudged,
        (Some(a), Some(b)) if a.count >= LEAST_RUNS && b.count >= LEAST_RUNS => find(a, b),
        _ => Finding::TooFew,
    };
    Line { metric: a.metric.name(), level, a: before, b: after, finding }
}

fn find(a: Spread, b: Spread) -> Finding {
    let visible = (b.median - a.median).abs() > RESOLUTION * a.median.min(b.median);
    match (a.overlaps(&b), visible, b.median < a.median) {
        (false, true, true) => Finding::Better,
        (false, true, false) => Finding::Worse,
        _ => Finding::NoneShown,
    }
}

fn differing(
    what: &str,
    a: &BTreeMap<String, String>,
    b: &BTreeMap<String, String>,
) -> Vec<(String, String, String)> {
    let keys: std::collections::BTreeSet<&String> =
        a.keys().chain(b.keys()).filter(|key| *key != VOLATILE).collect();
    let get =
        |of: &BTreeMap<String, String>, key: &String| of.get(key).cloned().unwrap_or_else(|| "-".into());
    let pairs = keys.into_iter().map(|key| (format!("{what}: {key}"), get(a, key), get(b, key)));
    pairs.filter(|(_, a, b)| a != b).collect()
}

fn joined(lines: &BTreeMap<String, Vec<String>>) -> BTreeMap<String, String> {
    lines.iter().map(|(style, lines)| (style.clone(), lines.join("; "))).collect()
}

fn rates(a: &Document, b: &Document) -> Vec<(String, f64, f64)> {
    let mut found = Vec::new();
    for (style, sums) in &a.counters {
        let Some(others) = b.counters.get(style) else { continue };
        let per_million = |sums: &BTreeMap<String, u64>, name: &str| {
            let of = |name: &str| sums.get(name).copied().unwrap_or(0) as f64;
            (of("ticks") > 0.0).then(|| 1e6 * of(name) / of("ticks"))
        };
        for name in ["overruns", "replies_missed", "frames_lost", "samples_lost", "faults"] {
            if let (Some(a), Some(b)) = (per_million(sums, name), per_million(others, name))
                && a + b > 0.0
            {
                found.push((format!("{style} {}", name.replace('_', " ")), a, b));
            }
        }
    }
    found
}

impl Finding {
    fn words(self) -> &'static str {
        match self {
            Self::Better => "BETTER",
            Self::Worse => "WORSE",
            Self::NoneShown => "no difference shown",
            Self::NotJudged => "not judged",
            Self::TooFew => "too few runs or values",
        }
    }
}

impl fmt::Display for Comparison {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "medians of the runs (us), the interval that holds the true median with 95 % where there are 6 runs or more,\n\
             else the range of the runs"
        )?;
        writeln!(f, "{:24} {:6} {:>30} {:>30} {:>8}", "", "", "A", "B", "B / A")?;
        for line in &self.lines {
            let ratio = line.a.zip(line.b).filter(|(a, _)| a.median > 0.0);
            let ratio = ratio.map_or_else(|| "-".into(), |(a, b)| format!("{:.3}", b.median / a.median));
            writeln!(
                f,
                "{:24} {:6} {:>30} {:>30} {ratio:>8}  {}",
                line.metric,
                line.level.name(),
                interval(line.a),
                interval(line.b),
                line.finding.words()
            )?;
        }
        for only in &self.only {
            writeln!(f, "{only}")?;
        }
        for (name, a, b) in &self.rates {
            writeln!(f, "{name} per million ticks: A {a:.1}, B {b:.1}")?;
        }
        if self.differences.is_empty() {
            return write!(f, "machine and configuration do not differ");
        }
        writeln!(f, "what differs besides:")?;
        let lines: Vec<_> =
            self.differences.iter().map(|(what, a, b)| format!("  {what}\n    A {a}\n    B {b}")).collect();
        write!(f, "{}", lines.join("\n"))
    }
}

fn interval(spread: Option<Spread>) -> String {
    spread.map_or_else(|| "-".into(), |s| format!("{} [{} .. {}]", us(s.median), us(s.low), us(s.high)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::jitter::document::tests::document;
    use crate::jitter::metric::Metric;

    /// Five runs of 200 values around the given medians.
    fn runs(medians: [u64; 5]) -> Vec<Vec<u64>> {
        medians.map(|median| (0..200).map(|i| median + i % 3).collect()).to_vec()
    }

    fn finding(a: [u64; 5], b: [u64; 5]) -> Finding {
        let of = |medians| document(&[(Metric::HybridWake, &runs(medians))]);
        let found = compare(&of(a), &of(b));
        found.lines.iter().find(|line| line.level == Level::P50).unwrap().finding
    }

    #[test]
    fn a_change_beyond_the_spread_is_told_in_its_direction() {
        let (slow, fast) = ([20_000, 21_000, 22_000, 19_000, 20_500], [9_000, 9_500, 10_000, 11_000, 9_100]);
        assert_eq!(finding(slow, fast), Finding::Better);
        assert_eq!(finding(fast, slow), Finding::Worse);
        assert_eq!(finding(fast, fast), Finding::NoneShown);
    }

    #[test]
    fn medians_that_differ_within_the_spread_show_nothing() {
        assert_eq!(
            finding([9_000, 10_000, 30_000, 12_000, 11_000], [5_000, 6_000, 5_500, 9_500, 7_000]),
            Finding::NoneShown
        );
    }

    #[test]
    fn a_difference_below_the_resolution_shows_nothing_however_steady() {
        assert_eq!(finding([20_000; 5], [20_900; 5]), Finding::NoneShown);
    }

    #[test]
    fn percentiles_that_the_runs_are_too_short_for_are_not_judged() {
        let a = document(&[(Metric::HybridWake, &runs([20_000; 5]))]);
        let found = compare(&a, &a);
        let of = |level| found.lines.iter().find(|line| line.level == level).unwrap().finding;
        assert_eq!(of(Level::P99), Finding::NoneShown);
        assert_eq!(of(Level::P999), Finding::TooFew, "200 values have no 99.9th percentile");
        assert_eq!(of(Level::Max), Finding::NotJudged);
        let two = document(&[(Metric::HybridWake, &runs([20_000; 5])[..2])]);
        let lines = compare(&a, &two).lines;
        assert!(lines.iter().all(|line| line.level == Level::Max || line.finding == Finding::TooFew));
    }

    #[test]
    fn what_else_differs_is_told() {
        let mut a = document(&[(Metric::HybridWake, &runs([20_000; 5])), (Metric::Cycle, &runs([700; 5]))]);
        let mut b = document(&[(Metric::HybridWake, &runs([20_000; 5]))]);
        a.machine.insert("governor".into(), "powersave".into());
        b.machine.insert("governor".into(), "performance".into());
        b.configuration.insert("load".into(), "memory".into());
        let text = compare(&a, &b).to_string();
        for expected in [
            "driver.cycle is in A only",
            "machine: governor\n    A powersave\n    B performance",
            "load\n    A -",
        ] {
            assert!(text.contains(expected), "{text}");
        }
    }
}
