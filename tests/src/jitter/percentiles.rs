//! The numbers that are quoted of a histogram.

use rt_core::histogram::Histogram;
use serde::{Deserialize, Serialize};

/// Count, percentiles and maximum, in nanoseconds; zeros where nothing was counted.
///
/// A percentile is the upper end of its histogram bucket, at most 3.2 % above the true one.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Percentiles {
    /// Values.
    pub count: u64,
    /// Half are not above this.
    pub p50: u64,
    /// 90 % are not above this.
    pub p90: u64,
    /// 99 % are not above this.
    pub p99: u64,
    /// 99.9 % are not above this.
    pub p999: u64,
    /// 99.99 % are not above this.
    pub p9999: u64,
    /// None is above this.
    pub max: u64,
}

/// One of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Level {
    /// The median.
    P50,
    /// 90 %.
    P90,
    /// 99 %.
    P99,
    /// 99.9 %.
    P999,
    /// 99.99 %.
    P9999,
    /// The greatest.
    Max,
}

impl Level {
    /// All, ascending.
    pub const ALL: [Self; 6] = [Self::P50, Self::P90, Self::P99, Self::P999, Self::P9999, Self::Max];

    /// What people call it.
    pub fn name(self) -> &'static str {
        match self {
            Self::P50 => "p50",
            Self::P90 => "p90",
            Self::P99 => "p99",
            Self::P999 => "p99.9",
            Self::P9999 => "p99.99",
            Self::Max => "max",
        }
    }

    /// How many values there must be for it to be more than the greatest of them.
    pub fn needs(self) -> u64 {
        match self {
            Self::P50 => 2,
            Self::P90 => 10,
            Self::P99 => 100,
            Self::P999 => 1000,
            Self::P9999 => 10_000,
            Self::Max => 1,
        }
    }
}

impl Percentiles {
    /// Those of a histogram.
    pub fn of(histogram: &Histogram) -> Self {
        let at = |q| histogram.percentile(q).unwrap_or(0);
        Self {
            count: histogram.count(),
            p50: at(0.5),
            p90: at(0.9),
            p99: at(0.99),
            p999: at(0.999),
            p9999: at(0.9999),
            max: histogram.max(),
        }
    }

    /// One of them (ns).
    pub fn at(&self, level: Level) -> u64 {
        match level {
            Level::P50 => self.p50,
            Level::P90 => self.p90,
            Level::P99 => self.p99,
            Level::P999 => self.p999,
            Level::P9999 => self.p9999,
            Level::Max => self.max,
        }
    }
}

/// A duration as people write it (us), with as many digits as it deserves.
pub fn us(ns: f64) -> String {
    let us = ns / 1e3;
    match us.abs() {
        size if size < 10.0 => format!("{us:.2}"),
        size if size < 1000.0 => format!("{us:.1}"),
        _ => format!("{us:.0}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_agree_with_the_sorted_values_to_a_buckets_width() {
        // 1.0007^i covers 1 ns to 1 s, so that every octave has its share.
        let mut values: Vec<u64> = (0..29_600).map(|i| 1.0007_f64.powi(i) as u64).collect();
        let mut histogram = Histogram::new();
        values.iter().for_each(|value| histogram.record(*value));
        values.sort_unstable();
        let found = Percentiles::of(&histogram);
        for (level, q) in Level::ALL.into_iter().zip([0.5, 0.9, 0.99, 0.999, 0.9999, 1.0]) {
            let rank = ((q * values.len() as f64).ceil() as usize).clamp(1, values.len());
            let exact = values[rank - 1];
            // The upper end of a bucket is at most a 32nd above any value in it.
            assert!((exact..=exact + exact / 32).contains(&found.at(level)), "{} {exact}", level.name());
        }
        assert_eq!((found.count, found.max), (29_600, values[29_599]));
    }

    #[test]
    fn durations_have_as_many_digits_as_they_deserve() {
        assert_eq!([21.0, 9_994.0, 14_250.0, 2_300_000.0].map(us), ["0.02", "9.99", "14.2", "2300"]);
    }
}
