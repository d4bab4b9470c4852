//! Counting into shared memory, where everybody can read along.
//!
//! There is one writer, so a load and a store do; no locked instruction is needed.

use rt_core::histogram::{BUCKETS, Histogram, bucket_of};
use shm_abi::layout::{HISTOGRAM_BUCKETS, HistogramBlock};
use std::sync::atomic::{AtomicU64, Ordering};

const _: () = assert!(BUCKETS == HISTOGRAM_BUCKETS, "the ABI's buckets are rt-core's");

/// Adds one.
#[inline]
pub fn bump(counter: &AtomicU64) {
    add(counter, 1);
}

/// Adds some.
#[inline]
pub fn add(counter: &AtomicU64, more: u64) {
    counter.store(counter.load(Ordering::Relaxed).wrapping_add(more), Ordering::Relaxed);
}

/// Records a duration.
#[inline]
pub fn record(block: &HistogramBlock, ns: u64) {
    bump(&block.count);
    add(&block.sum_ns, ns);
    bump(&block.buckets[bucket_of(ns)]);
    if ns > block.max_ns.load(Ordering::Relaxed) {
        block.max_ns.store(ns, Ordering::Relaxed);
    }
}

/// Reads a histogram out of shared memory; a value recorded meanwhile may be in or not.
pub fn read(block: &HistogramBlock) -> Histogram {
    let mut counts = Box::new([0; BUCKETS]);
    for (count, bucket) in counts.iter_mut().zip(&block.buckets) {
        *count = bucket.load(Ordering::Relaxed);
    }
    Histogram::from_counts(&counts, block.max_ns.load(Ordering::Relaxed))
}

/// Values recorded between two readings of one histogram. The largest value of the interval is known exactly if it is the
/// largest of all; else it is the upper end of its highest bucket, or the overall one if that is smaller.
pub fn since(before: &Histogram, after: &Histogram) -> Histogram {
    let mut counts = Box::new([0; BUCKETS]);
    for (count, (new, old)) in counts.iter_mut().zip(after.counts().iter().zip(before.counts())) {
        *count = new.saturating_sub(*old);
    }
    let between = Histogram::from_counts(&counts, after.max());
    if after.max() > before.max() {
        return between;
    }
    Histogram::from_counts(&counts, between.percentile(1.0).unwrap_or(0))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn block() -> HistogramBlock {
        HistogramBlock {
            count: AtomicU64::new(0),
            max_ns: AtomicU64::new(0),
            sum_ns: AtomicU64::new(0),
            reserved: Default::default(),
            buckets: std::array::from_fn(|_| AtomicU64::new(0)),
        }
    }

    #[test]
    fn what_is_recorded_is_read_back() {
        let block = block();
        for ns in [3, 3, 40_000, 1_000_000_000_000] {
            record(&block, ns);
        }
        let histogram = read(&block);
        assert_eq!(histogram.count(), 4);
        assert_eq!(histogram.max(), 1_000_000_000_000);
        assert_eq!(histogram.percentile(0.5), Some(3));
        assert_eq!(block.sum_ns.load(Ordering::Relaxed), 1_000_000_040_006);
    }

    #[test]
    fn an_interval_forgets_what_was_before_it() {
        let block = block();
        record(&block, 40_000);
        let before = read(&block);
        assert_eq!(since(&before, &before).max(), 0);
        record(&block, 9);
        let between = since(&before, &read(&block));
        assert_eq!((between.percentile(1.0), between.max()), (Some(9), 9));
        record(&block, 50_001);
        assert_eq!(since(&before, &read(&block)).max(), 50_001);
    }
}
