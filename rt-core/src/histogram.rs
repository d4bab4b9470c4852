//! Latencies in 1024 fixed buckets.
//!
//! Problem: percentiles of millions of ticks, without keeping them and without allocation.
//! Model: values below 32 ns have a bucket each; above, every octave `[2^e, 2^(e+1))` is cut into 32
//! equal buckets, for e = 5 to 35, which makes 32 + 31 * 32 = 1024. The last bucket also takes
//! everything from 2^36 ns (69 s) on.
//! Invariants: buckets are contiguous and ascending; a bucket is at most 1/32 of its lower bound
//! wide, so a percentile is at most 3.2 % above the true one and never below it; the greatest value
//! is exact.
//! Cost: recording is a shift, an addition and no branch that depends on history; 8 KiB of counts.
//! Fit for the loop, apart from building one and from [`Histogram::percentile`].

/// Number of buckets.
pub const BUCKETS: usize = 1024;

/// log2 of the buckets in an octave.
const SUB_BITS: u32 = 5;
/// Buckets in an octave, and the first value that shares its bucket.
const SUB_BUCKETS: u64 = 1 << SUB_BITS;

/// The bucket that counts `value`.
#[must_use]
pub const fn bucket_of(value: u64) -> usize {
    // Values below 32 fall in "octave 5 with shift 0" as well, and land on themselves.
    let shift = (63 - (value | SUB_BUCKETS).leading_zeros()) - SUB_BITS;
    let bucket = shift as usize * SUB_BUCKETS as usize + (value >> shift) as usize;
    if bucket < BUCKETS { bucket } else { BUCKETS - 1 }
}

/// The least value that bucket `bucket` counts.
///
/// # Panics
/// If there is no such bucket.
#[must_use]
pub const fn bucket_lower(bucket: usize) -> u64 {
    assert!(bucket < BUCKETS, "no such bucket");
    let shift = shift_of(bucket);
    (bucket as u64 - shift as u64 * SUB_BUCKETS) << shift
}

/// The greatest value that bucket `bucket` counts, itself included.
///
/// # Panics
/// If there is no such bucket.
#[must_use]
pub const fn bucket_upper(bucket: usize) -> u64 {
    if bucket == BUCKETS - 1 { u64::MAX } else { bucket_lower(bucket + 1) - 1 }
}

/// log2 of a bucket's width.
const fn shift_of(bucket: usize) -> u32 {
    (bucket as u32 / SUB_BUCKETS as u32).saturating_sub(1)
}

/// Counts of values, usually nanoseconds.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Histogram {
    counts: Box<[u64; BUCKETS]>,
    count: u64,
    sum: u128,
    max: u64,
}

/// The numbers one quotes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Summary {
    /// How many values there are; all else is 0 when this is.
    pub count: u64,
    /// Median.
    pub p50: u64,
    /// 99th percentile.
    pub p99: u64,
    /// 99.9th percentile.
    pub p999: u64,
    /// Greatest value, exact.
    pub max: u64,
}

impl Default for Histogram {
    fn default() -> Self {
        Self::new()
    }
}

impl Histogram {
    /// An empty histogram. Allocates: build it before the loop.
    #[must_use]
    pub fn new() -> Self {
        Self { counts: Box::new([0; BUCKETS]), count: 0, sum: 0, max: 0 }
    }

    /// From counts kept elsewhere, for instance in shared memory, and the greatest value seen.
    ///
    /// Any counts are taken: sums saturate. The mean is then that of the buckets' middles.
    #[must_use]
    pub fn from_counts(counts: &[u64; BUCKETS], max: u64) -> Self {
        let count = counts.iter().fold(0, |sum: u64, c| sum.saturating_add(*c));
        let sum = (0..BUCKETS).fold(0, |sum: u128, bucket| {
            sum.saturating_add(u128::from(counts[bucket]) * u128::from(middle(bucket, max)))
        });
        Self { counts: Box::new(*counts), count, sum, max }
    }

    /// Counts one value. Fit for the loop.
    pub fn record(&mut self, value: u64) {
        self.counts[bucket_of(value)] += 1;
        self.count += 1;
        self.sum += u128::from(value);
        self.max = self.max.max(value);
    }

    /// Adds all values of `other`.
    pub fn merge(&mut self, other: &Self) {
        for (mine, theirs) in self.counts.iter_mut().zip(other.counts.iter()) {
            *mine = mine.saturating_add(*theirs);
        }
        self.count = self.count.saturating_add(other.count);
        self.sum = self.sum.saturating_add(other.sum);
        self.max = self.max.max(other.max);
    }

    /// Forgets all values.
    pub fn clear(&mut self) {
        self.counts.fill(0);
        (self.count, self.sum, self.max) = (0, 0, 0);
    }

    /// A value that the fraction `q` (0 to 1) of all values does not exceed: the upper end of the
    /// bucket that holds the value of rank `ceil(q * count)`, clipped to the greatest value seen.
    /// None if nothing was counted or `q` is no number.
    #[must_use]
    pub fn percentile(&self, q: f64) -> Option<u64> {
        if self.count == 0 || q.is_nan() {
            return None;
        }
        let rank = ((q * self.count as f64).ceil() as u64).clamp(1, self.count);
        let mut below: u64 = 0;
        for (bucket, count) in self.counts.iter().enumerate() {
            below = below.saturating_add(*count);
            if below >= rank {
                return Some(bucket_upper(bucket).min(self.max));
            }
        }
        Some(self.max)
    }

    /// How many values were counted.
    #[must_use]
    pub fn count(&self) -> u64 {
        self.count
    }

    /// The greatest value, exact; 0 if nothing was counted.
    #[must_use]
    pub fn max(&self) -> u64 {
        self.max
    }

    /// The mean, exact unless the histogram came from [`Histogram::from_counts`].
    #[must_use]
    pub fn mean(&self) -> Option<f64> {
        (self.count > 0).then(|| self.sum as f64 / self.count as f64)
    }

    /// The counts of all buckets.
    #[must_use]
    pub fn counts(&self) -> &[u64; BUCKETS] {
        &self.counts
    }

    /// Count, median, tails and maximum.
    #[must_use]
    pub fn summary(&self) -> Summary {
        let at = |q| self.percentile(q).unwrap_or(0);
        Summary { count: self.count, p50: at(0.5), p99: at(0.99), p999: at(0.999), max: self.max }
    }
}

/// The middle of a bucket; of the last one, of the part up to the greatest value seen.
fn middle(bucket: usize, max: u64) -> u64 {
    let (lower, upper) = (bucket_lower(bucket), bucket_upper(bucket).min(max));
    lower + upper.saturating_sub(lower) / 2
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn buckets_tile_all_values_without_gap() {
        assert_eq!(bucket_lower(0), 0);
        assert_eq!(bucket_upper(BUCKETS - 1), u64::MAX);
        for bucket in 0..BUCKETS {
            assert_eq!(bucket_of(bucket_lower(bucket)), bucket);
            assert_eq!(bucket_of(bucket_upper(bucket)), bucket);
            if bucket > 0 {
                assert_eq!(bucket_lower(bucket), bucket_upper(bucket - 1) + 1);
            }
        }
    }

    #[test]
    fn the_landmarks_of_the_layout_are_where_the_documentation_says() {
        assert_eq!((bucket_of(0), bucket_of(31), bucket_of(32)), (0, 31, 32));
        assert_eq!((bucket_lower(64), bucket_upper(64)), (64, 65));
        assert_eq!(bucket_of((1 << 36) - 1), BUCKETS - 1);
        assert_eq!(bucket_of(1 << 36), BUCKETS - 1);
        assert_eq!(bucket_of(u64::MAX), BUCKETS - 1);
    }

    #[test]
    fn a_bucket_is_at_most_one_32nd_of_its_values_wide() {
        for bucket in 0..BUCKETS - 1 {
            let width = bucket_upper(bucket) - bucket_lower(bucket) + 1;
            assert!(bucket < 32 && width == 1 || width * 32 <= bucket_lower(bucket));
        }
    }

    #[test]
    fn an_empty_histogram_has_no_percentiles() {
        let empty = Histogram::new();
        assert_eq!((empty.percentile(0.5), empty.mean(), empty.max()), (None, None, 0));
        assert_eq!(empty.summary(), Summary::default());
    }

    #[test]
    fn percentiles_outside_zero_to_one_are_clamped_and_nan_is_none() {
        let mut histogram = Histogram::new();
        (1..=9).for_each(|v| histogram.record(v));
        assert_eq!(histogram.percentile(-1.0), Some(1));
        assert_eq!(histogram.percentile(7.0), Some(9));
        assert_eq!(histogram.percentile(f64::NAN), None);
    }

    #[test]
    fn garbage_counts_from_elsewhere_saturate() {
        let mut histogram = Histogram::from_counts(&[u64::MAX; BUCKETS], 5);
        assert_eq!(histogram.count(), u64::MAX);
        assert_eq!(histogram.percentile(1.0), Some(0), "bucket 0 alone holds them all");
        let twin = histogram.clone();
        histogram.merge(&twin);
        assert!(histogram.mean().unwrap().is_finite());
    }

    fn histogram_of(values: &[u64]) -> Histogram {
        let mut histogram = Histogram::new();
        values.iter().for_each(|v| histogram.record(*v));
        histogram
    }

    /// Values over all octaves alike, not only the large ones.
    fn latencies() -> impl Strategy<Value = Vec<u64>> {
        prop::collection::vec((0..36_u32, any::<u64>()).prop_map(|(bits, v)| v & ((2 << bits) - 1)), 1..300)
    }

    proptest! {
        #[test]
        fn percentiles_lie_within_a_bucket_above_those_of_the_sorted_values(
            mut values in latencies(),
            q in 0.0..=1.0_f64,
        ) {
            let found = histogram_of(&values).percentile(q).unwrap();
            values.sort_unstable();
            let rank = ((q * values.len() as f64).ceil() as usize).clamp(1, values.len());
            let exact = values[rank - 1];
            prop_assert!(found >= exact);
            // Upper end minus any value of one bucket < its width <= value / 32.
            prop_assert!(found - exact <= exact / 32, "{} for {}", found, exact);
        }

        #[test]
        fn count_mean_and_max_are_exact(values in latencies()) {
            let histogram = histogram_of(&values);
            let sum: u128 = values.iter().map(|v| u128::from(*v)).sum();
            prop_assert_eq!(histogram.count(), values.len() as u64);
            prop_assert_eq!(histogram.max(), *values.iter().max().unwrap());
            prop_assert_eq!(histogram.mean(), Some(sum as f64 / values.len() as f64));
        }

        #[test]
        fn merging_equals_recording_everything_in_one(a in latencies(), b in latencies()) {
            let mut merged = histogram_of(&a);
            merged.merge(&histogram_of(&b));
            prop_assert_eq!(merged, histogram_of(&[a, b].concat()));
        }

        #[test]
        fn counts_kept_elsewhere_give_the_same_percentiles_and_nearly_the_same_mean(values in latencies()) {
            let original = histogram_of(&values);
            let copy = Histogram::from_counts(original.counts(), original.max());
            prop_assert_eq!(copy.summary(), original.summary());
            // Each value moves to its bucket's middle: by half a bucket, 1/64 of it; plus the middle
            // of two neighbours rounded down, half a nanosecond.
            let (mean, estimate) = (original.mean().unwrap(), copy.mean().unwrap());
            prop_assert!((mean - estimate).abs() <= mean / 64.0 + 0.5);
        }
    }
}
