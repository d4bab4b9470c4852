//! How a latency developed over the run, in bounded memory.
//!
//! Problem: a row per second is half a million rows in five days, for each series.
//! Model: rows begin a second wide. When there are more than [`CAPACITY`], neighbours are merged in pairs and
//! new rows are as wide as the merged ones. While a row is filled it has its own histogram, so a row
//! that was never merged is exact to a bucket's width; of merged ones the maximum stays exact, p99 becomes the
//! greater of the two, an upper bound, and p50 their mean weighted by count.
//! Invariants: rows ascend and do not overlap; counts and the maximum of all rows are those of all values;
//! a row never spans two slices, so that nothing is said of the time in between.

use rt_core::histogram::Histogram;
use serde::{Deserialize, Serialize};

/// Most rows of a series: 17 minutes at full resolution, five days at some seven minutes a row.
pub const CAPACITY: usize = 2048;
const FIRST_WIDTH_NS: u64 = 1_000_000_000;

/// One stretch of time.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Row {
    /// When it began, since the start of the measurement (s).
    pub from_s: f64,
    /// When it ended (s).
    pub to_s: f64,
    /// Values in it.
    pub count: u64,
    /// Their median (ns).
    pub p50_ns: u64,
    /// Their 99th percentile (ns).
    pub p99_ns: u64,
    /// The greatest (ns).
    pub max_ns: u64,
    /// Slices that were merged into it; 1: none was.
    pub merged: u64,
}

/// Rows so far, and the one that is being filled.
#[derive(Debug, Clone)]
pub struct Timeline {
    rows: Vec<Row>,
    width_ns: u64,
    open: Option<Open>,
    histogram: Histogram,
}

#[derive(Debug, Clone, Copy)]
struct Open {
    from_ns: u64,
    to_ns: u64,
}

impl Default for Timeline {
    fn default() -> Self {
        Self { rows: Vec::new(), width_ns: FIRST_WIDTH_NS, open: None, histogram: Histogram::new() }
    }
}

impl Timeline {
    /// Adds a value at a time since the start of the measurement (ns).
    pub fn record(&mut self, at_ns: u64, value_ns: u64) {
        self.advance(at_ns);
        self.histogram.record(value_ns);
    }

    /// Adds many values that came at about one time.
    pub fn merge(&mut self, at_ns: u64, values: &Histogram) {
        if values.count() > 0 {
            self.advance(at_ns);
            self.histogram.merge(values);
        }
    }

    /// Adds a row whose values came between two times, nobody knows when.
    pub fn add_slice(&mut self, from_ns: u64, to_ns: u64, values: &Histogram) {
        self.end_slice();
        if values.count() > 0 {
            self.push(row(from_ns, to_ns, values));
        }
    }

    /// Nothing follows for a while: the row that is being filled ends here.
    pub fn end_slice(&mut self) {
        if let Some(open) = self.open.take().filter(|_| self.histogram.count() > 0) {
            self.push(row(open.from_ns, open.to_ns, &self.histogram));
        }
        self.histogram.clear();
    }

    /// All rows, the unfinished one included.
    pub fn rows(&self) -> Vec<Row> {
        let open = self.open.filter(|_| self.histogram.count() > 0);
        let open = open.map(|open| row(open.from_ns, open.to_ns, &self.histogram));
        self.rows.iter().copied().chain(open).collect()
    }

    fn advance(&mut self, at_ns: u64) {
        match &mut self.open {
            Some(open) if at_ns < open.from_ns + self.width_ns => open.to_ns = open.to_ns.max(at_ns),
            _ => {
                self.end_slice();
                self.open = Some(Open { from_ns: at_ns, to_ns: at_ns });
            }
        }
    }

    fn push(&mut self, row: Row) {
        self.rows.push(row);
        if self.rows.len() > CAPACITY {
            self.rows = self.rows.chunks(2).map(merge_pair).collect();
            self.width_ns = self.width_ns.saturating_mul(2);
        }
    }
}

fn row(from_ns: u64, to_ns: u64, values: &Histogram) -> Row {
    let summary = values.summary();
    Row {
        from_s: from_ns as f64 / 1e9,
        to_s: to_ns as f64 / 1e9,
        count: summary.count,
        p50_ns: summary.p50,
        p99_ns: summary.p99,
        max_ns: summary.max,
        merged: 1,
    }
}

fn merge_pair(pair: &[Row]) -> Row {
    let [a, b] = pair else { return pair[0] };
    let count = a.count + b.count;
    let weighted = a.p50_ns as f64 * a.count as f64 + b.p50_ns as f64 * b.count as f64;
    Row {
        from_s: a.from_s,
        to_s: b.to_s,
        count,
        p50_ns: (weighted / count.max(1) as f64) as u64,
        p99_ns: a.p99_ns.max(b.p99_ns),
        max_ns: a.max_ns.max(b.max_ns),
        merged: a.merged + b.merged,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const S: u64 = 1_000_000_000;

    #[test]
    fn seconds_become_rows_with_their_own_percentiles() {
        let mut timeline = Timeline::default();
        for second in 0..3 {
            (0..100).for_each(|i| timeline.record(second * S + i * S / 100, 10 * (second + 1)));
        }
        let rows = timeline.rows();
        assert_eq!(rows.len(), 3);
        assert_eq!(
            rows.iter().map(|r| (r.count, r.p50_ns, r.max_ns)).collect::<Vec<_>>(),
            [(100, 10, 10), (100, 20, 20), (100, 30, 30)]
        );
    }

    #[test]
    fn days_take_no_more_memory_than_minutes_and_nothing_is_forgotten() {
        let mut timeline = Timeline::default();
        // Five days, a few values a second, one spike on day four.
        let seconds = 5 * 86_400;
        for second in 0..seconds {
            timeline.record(second * S, 20);
            timeline.record(second * S + S / 2, if second == 300_000 { 4_000_000 } else { 30 });
        }
        let rows = timeline.rows();
        assert!((CAPACITY / 2..=CAPACITY + 1).contains(&rows.len()), "{}", rows.len());
        assert_eq!(rows.iter().map(|row| row.count).sum::<u64>(), 2 * seconds);
        assert!(rows.windows(2).all(|pair| pair[0].to_s <= pair[1].from_s));
        let worst = rows.iter().max_by_key(|row| row.max_ns).unwrap();
        assert_eq!(worst.max_ns, 4_000_000);
        assert!(worst.from_s <= 300_000.5 && 300_000.5 <= worst.to_s, "{worst:?}");
    }

    #[test]
    fn the_time_between_slices_belongs_to_no_row() {
        let mut timeline = Timeline::default();
        timeline.record(S / 4, 5);
        timeline.end_slice();
        timeline.record(S / 2, 7);
        let rows = timeline.rows();
        assert_eq!(rows.len(), 2);
        assert!(rows[0].to_s < rows[1].from_s);
    }

    #[test]
    fn merged_rows_keep_the_maximum_and_bound_the_99th_percentile() {
        let mut slow = Histogram::new();
        slow.record(900);
        let mut fast = Histogram::new();
        (0..3).for_each(|_| fast.record(4));
        let merged = merge_pair(&[row(0, S, &slow), row(S, 2 * S, &fast)]);
        assert_eq!((merged.count, merged.p50_ns, merged.max_ns, merged.merged), (4, 228, 900, 2));
        assert_eq!(merged.p99_ns, 900);
    }
}
