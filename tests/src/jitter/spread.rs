//! A median and how sure it is, from few runs.
//!
//! Model: order statistics, which need no distribution. Of n values the interval from the j-th smallest to the j-th
//! greatest covers the true median with probability 1 - 2 P(B(n, 1/2) < j). The greatest j that keeps 95 % is
//! taken; with fewer than six runs none does, and the whole range serves (five runs: 94 %).

/// Median, and the interval that covers the true one with 95 % (or as much as so few values can).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spread {
    /// Of the values.
    pub median: f64,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
    /// How many values.
    pub count: usize,
}

impl Spread {
    /// Of some values; `None` of none.
    pub fn of(values: impl Iterator<Item = f64>) -> Option<Self> {
        let mut sorted: Vec<f64> = values.filter(|value| value.is_finite()).collect();
        sorted.sort_by(f64::total_cmp);
        let count = sorted.len();
        let last = count.checked_sub(1)?;
        let median = (sorted[last / 2] + sorted[count / 2]) / 2.0;
        let cut = trimmed(count);
        Some(Self { median, low: sorted[cut], high: sorted[last - cut], count })
    }

    /// Whether the two intervals have a value in common.
    pub fn overlaps(&self, other: &Self) -> bool {
        self.low <= other.high && other.low <= self.high
    }
}

/// How many values may be left out at either end.
fn trimmed(count: usize) -> usize {
    let mut below = 0.0;
    // P(B(n, 1/2) = k), by logarithm: 0.5^n vanishes for long series.
    let mut log_term = -(count as f64) * 2_f64.ln();
    for k in 0..count / 2 {
        below += log_term.exp();
        if 2.0 * below > 0.05 {
            return k.saturating_sub(1);
        }
        log_term += ((count - k) as f64).ln() - ((k + 1) as f64).ln();
    }
    (count / 2).saturating_sub(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_interval_is_that_of_the_tables_of_the_sign_test() {
        // Ranks of the 95 % interval of the median: n = 5: all (94 %), 6: 1..6, 9: 2..8, 20: 6..15, 100: 40..61.
        let ranks = |n: usize| (trimmed(n) + 1, n - trimmed(n));
        assert_eq!([5, 6, 9, 20, 100].map(ranks), [(1, 5), (1, 6), (2, 8), (6, 15), (40, 61)]);
        assert_eq!([1, 2].map(ranks), [(1, 1), (1, 2)]);
        assert!(trimmed(100_000) < 50_000);
    }

    #[test]
    fn the_median_of_an_even_number_lies_between_the_two_middle_ones() {
        assert_eq!(Spread::of([4.0, 1.0, 3.0, 2.0].into_iter()).unwrap().median, 2.5);
        assert_eq!(Spread::of([f64::NAN].into_iter()), None);
    }
}
