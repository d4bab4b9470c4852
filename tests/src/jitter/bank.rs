//! Everything measured so far, in bounded memory.
//!
//! Model: a [`Recorder`] for each series that ever got a value: all values in one histogram, those of the slice at
//! hand in another, a row per finished slice, a time line, the worst events. Counters are named sums per style.
//! Invariant: the histogram of all values is the sum of those of the slices.

use crate::jitter::circumstances::Circumstances;
use crate::jitter::metric::{Metric, Style};
use crate::jitter::origin::Origin;
use crate::jitter::percentiles::Percentiles;
use crate::jitter::timeline::Timeline;
use crate::jitter::worst::{Event, WorstKeeper};
use rt_core::histogram::Histogram;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// One finished slice of a series.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RunRow {
    /// Number of the run, from 1.
    pub run: usize,
    /// When the slice began, since the start of the measurement (s).
    pub from_s: f64,
    /// How long it lasted (s).
    pub seconds: f64,
    /// It lasted as long as it should.
    pub complete: bool,
    /// Its values (ns).
    pub percentiles: Percentiles,
}

/// One series.
#[derive(Debug)]
pub struct Recorder {
    /// All values.
    pub total: Histogram,
    /// Those of the slice at hand.
    slice: Histogram,
    /// Finished slices.
    pub runs: Vec<RunRow>,
    /// The development over time.
    pub timeline: Timeline,
    /// The worst.
    pub worst: WorstKeeper,
}

/// One value with its place in time.
#[derive(Debug, Clone, Copy)]
pub struct Sample {
    /// Of the loop.
    pub tick: u64,
    /// When it began, monotonic (ns).
    pub from_ns: u64,
    /// How long it was (ns).
    pub value_ns: u64,
}

/// All series and counters.
#[derive(Debug)]
pub struct Bank {
    origin: Origin,
    worst: usize,
    run: usize,
    series: BTreeMap<Metric, Recorder>,
    counters: BTreeMap<Style, BTreeMap<&'static str, u64>>,
}

impl Bank {
    /// Nothing yet; `worst` events are kept of each series.
    pub fn new(origin: Origin, worst: usize) -> Self {
        Self { origin, worst, run: 0, series: BTreeMap::new(), counters: BTreeMap::new() }
    }

    /// What times are counted from.
    pub fn origin(&self) -> Origin {
        self.origin
    }

    /// All series with values.
    pub fn series(&self) -> &BTreeMap<Metric, Recorder> {
        &self.series
    }

    /// All counters.
    pub fn counters(&self) -> &BTreeMap<Style, BTreeMap<&'static str, u64>> {
        &self.counters
    }

    /// A slice of run `run` begins.
    pub fn begin_slice(&mut self, run: usize) {
        self.run = run;
    }

    /// Adds to a counter.
    pub fn count(&mut self, style: Style, name: &'static str, more: u64) {
        *self.counters.entry(style).or_default().entry(name).or_default() += more;
    }

    /// Records a value; `explain` is asked only if it is among the worst.
    pub fn record(&mut self, metric: Metric, sample: Sample, explain: impl FnOnce() -> Circumstances) {
        let (origin, run) = (self.origin, self.run);
        let recorder = self.recorder(metric);
        recorder.total.record(sample.value_ns);
        recorder.slice.record(sample.value_ns);
        recorder.timeline.record(origin.since_ns(sample.from_ns), sample.value_ns);
        if recorder.worst.wants(sample.value_ns) {
            recorder.worst.offer(Event {
                value_ns: sample.value_ns,
                tick: Some(sample.tick),
                utc: origin.utc(sample.from_ns),
                at_s: origin.since_ns(sample.from_ns) as f64 / 1e9,
                run,
                circumstances: explain(),
            });
        }
    }

    /// Records values of which only counts are known, at about this time.
    pub fn merge(&mut self, metric: Metric, at_ns: u64, values: &Histogram) {
        let at = self.origin.since_ns(at_ns);
        let recorder = self.recorder(metric);
        recorder.total.merge(values);
        recorder.slice.merge(values);
        recorder.timeline.merge(at, values);
    }

    /// Records a slice of which only the whole is known.
    pub fn add_slice(&mut self, metric: Metric, from_ns: u64, to_ns: u64, values: &Histogram) {
        let (origin, run) = (self.origin, self.run);
        let recorder = self.recorder(metric);
        recorder.total.merge(values);
        recorder.slice.merge(values);
        recorder.timeline.add_slice(origin.since_ns(from_ns), origin.since_ns(to_ns), values);
        if values.count() > 0 && recorder.worst.wants(values.max()) {
            let remarks = vec!["somewhere in the slice: the reference tells no more".to_owned()];
            let interval_ms = to_ns.saturating_sub(from_ns) as f64 / 1e6;
            recorder.worst.offer(Event {
                value_ns: values.max(),
                tick: None,
                utc: origin.utc(from_ns),
                at_s: origin.since_ns(from_ns) as f64 / 1e9,
                run,
                circumstances: Circumstances { interval_ms, remarks, ..Circumstances::default() },
            });
        }
    }

    /// The slice that began at `from_ns` ends now.
    pub fn end_slice(&mut self, from_ns: u64, complete: bool) {
        let (from, now) =
            (self.origin.since_ns(from_ns), self.origin.since_ns(rt_core::clock::monotonic_ns()));
        for recorder in self.series.values_mut() {
            recorder.timeline.end_slice();
            if recorder.slice.count() > 0 {
                recorder.runs.push(RunRow {
                    run: self.run,
                    from_s: from as f64 / 1e9,
                    seconds: now.saturating_sub(from) as f64 / 1e9,
                    complete,
                    percentiles: Percentiles::of(&recorder.slice),
                });
                recorder.slice.clear();
            }
        }
    }

    fn recorder(&mut self, metric: Metric) -> &mut Recorder {
        let most = self.worst;
        self.series.entry(metric).or_insert_with(|| Recorder {
            total: Histogram::new(),
            slice: Histogram::new(),
            runs: Vec::new(),
            timeline: Timeline::default(),
            worst: WorstKeeper::new(most),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_slices_add_up_to_the_whole() {
        let origin = Origin::now();
        let mut bank = Bank::new(origin, 2);
        for run in 1..=3 {
            bank.begin_slice(run);
            for tick in 0..100 * run as u64 {
                let sample = Sample { tick, from_ns: origin.monotonic_ns() + tick, value_ns: tick };
                bank.record(Metric::HybridWake, sample, Circumstances::default);
            }
            bank.end_slice(origin.monotonic_ns(), run < 3);
        }
        let recorder = &bank.series()[&Metric::HybridWake];
        assert_eq!(
            recorder.runs.iter().map(|run| run.percentiles.count).collect::<Vec<_>>(),
            [100, 200, 300]
        );
        assert_eq!(recorder.total.count(), 600);
        assert_eq!(recorder.timeline.rows().iter().map(|row| row.count).sum::<u64>(), 600);
        assert_eq!(
            recorder.worst.events().iter().map(|e| (e.run, e.value_ns)).collect::<Vec<_>>(),
            [(3, 299), (3, 298)]
        );
        assert!(!recorder.runs[2].complete);
    }
}
