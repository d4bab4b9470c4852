//! The results as one JSON file that holds everything: circumstances, configuration, figures, histograms, worst
//! events.
//!
//! Version rule: a reader refuses another `schema` or `schema_version`; whoever changes a field's name or meaning
//! raises the version. Units are in the names; without one, nanoseconds.
//! Invariant: what was read was validated: histograms lie on the buckets' borders and add up.

use crate::jitter::bank::{Bank, RunRow};
use crate::jitter::error::JitterError;
use crate::jitter::metric::{Metric, Style};
use crate::jitter::percentiles::Percentiles;
use crate::jitter::timeline::Row;
use crate::jitter::worst::Event;
use rt_core::histogram::{BUCKETS, Histogram, bucket_lower, bucket_of};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

/// What the file says it is.
pub const SCHEMA: &str = "phantom3-jitter";
/// Version of its layout.
pub const SCHEMA_VERSION: u32 = 1;
/// A result of days is some megabytes; anything beyond is not one.
const LARGEST_FILE: u64 = 1 << 30;

/// Everything.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Document {
    /// [`SCHEMA`].
    pub schema: String,
    /// [`SCHEMA_VERSION`].
    pub schema_version: u32,
    /// Version of the program that measured.
    pub program_version: String,
    /// When it began: UTC.
    pub started_utc: String,
    /// When this was written: UTC.
    pub written_utc: String,
    /// How long it had been going on (s).
    pub elapsed_s: f64,
    /// "running", "completed", "signal N" or what went wrong.
    pub end: String,
    /// The machine: what could explain a difference.
    pub machine: BTreeMap<String, String>,
    /// What was measured and how.
    pub configuration: BTreeMap<String, String>,
    /// What was asked of the operating system, by style, a line each.
    pub guarantees: BTreeMap<String, Vec<String>>,
    /// What one should know before believing the figures.
    pub notes: Vec<String>,
    /// Sums by style and name.
    pub counters: BTreeMap<String, BTreeMap<String, u64>>,
    /// The figures.
    pub series: Vec<Series>,
}

/// One metric.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Series {
    /// Which.
    pub metric: Metric,
    /// What it means.
    pub meaning: String,
    /// Of all values (ns).
    pub percentiles: Percentiles,
    /// Each slice by itself.
    pub runs: Vec<RunRow>,
    /// All values.
    pub histogram: Counts,
    /// The development.
    pub timeline: Vec<Row>,
    /// The worst first.
    pub worst: Vec<Event>,
}

/// A histogram without its empty buckets.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Counts {
    /// Least value of a bucket (ns), and its count; ascending.
    pub buckets: Vec<(u64, u64)>,
    /// The greatest value (ns).
    pub max_ns: u64,
}

/// What is known besides the figures.
#[derive(Debug, Clone, Default)]
pub struct Surroundings {
    /// The machine.
    pub machine: BTreeMap<String, String>,
    /// What was measured and how.
    pub configuration: BTreeMap<String, String>,
    /// Set-up reports by style.
    pub guarantees: BTreeMap<Style, Vec<String>>,
    /// Notes.
    pub notes: Vec<String>,
}

impl Document {
    /// What there is so far.
    pub fn new(bank: &Bank, surroundings: &Surroundings, end: &str) -> Self {
        let origin = bank.origin();
        let names = |counters: &BTreeMap<&'static str, u64>| {
            counters.iter().map(|(name, count)| ((*name).to_owned(), *count)).collect()
        };
        Self {
            schema: SCHEMA.into(),
            schema_version: SCHEMA_VERSION,
            program_version: env!("CARGO_PKG_VERSION").into(),
            started_utc: origin.start_utc(),
            written_utc: crate::jitter::origin::utc_now(),
            elapsed_s: origin.since_ns(rt_core::clock::monotonic_ns()) as f64 / 1e9,
            end: end.into(),
            machine: surroundings.machine.clone(),
            configuration: surroundings.configuration.clone(),
            guarantees: surroundings
                .guarantees
                .iter()
                .map(|(style, lines)| (style.name().to_owned(), lines.clone()))
                .collect(),
            notes: surroundings.notes.clone(),
            counters: bank
                .counters()
                .iter()
                .map(|(style, sums)| (style.name().into(), names(sums)))
                .collect(),
            series: bank
                .series()
                .iter()
                .map(|(metric, recorder)| Series {
                    metric: *metric,
                    meaning: metric.meaning().into(),
                    percentiles: Percentiles::of(&recorder.total),
                    runs: recorder.runs.clone(),
                    histogram: Counts::of(&recorder.total),
                    timeline: recorder.timeline.rows(),
                    worst: recorder.worst.events().to_vec(),
                })
                .collect(),
        }
    }

    /// Reads a file.
    ///
    /// # Errors
    /// If it cannot be read, is no such file, is of another version, or contradicts itself.
    pub fn load(file: &Path) -> Result<Self, JitterError> {
        let unreadable = |source| JitterError::Unreadable { file: file.into(), source };
        let length = std::fs::metadata(file).map_err(unreadable)?.len();
        if length > LARGEST_FILE {
            return Err(bad(file, format!("it has {length} bytes, at most {LARGEST_FILE} are believed")));
        }
        let bytes = std::fs::read(file).map_err(unreadable)?;
        Self::parse(&bytes, file)
    }

    /// Reads a text; `file` is named in errors.
    ///
    /// # Errors
    /// As [`load`](Self::load).
    pub fn parse(bytes: &[u8], file: &Path) -> Result<Self, JitterError> {
        #[derive(Deserialize)]
        struct Head {
            schema: Option<String>,
            schema_version: Option<u32>,
        }
        let head: Head = serde_json::from_slice(bytes).map_err(|error| {
            bad(file, format!("it is no JSON object of ours: {error}; give a result.json of `jitter`"))
        })?;
        if head.schema.as_deref() != Some(SCHEMA) {
            let found = head.schema.unwrap_or_else(|| "nothing".into());
            return Err(bad(file, format!("its \"schema\" is {found:?}, expected {SCHEMA:?}")));
        }
        if head.schema_version != Some(SCHEMA_VERSION) {
            let found = head.schema_version.map_or_else(|| "none".into(), |version| version.to_string());
            return Err(bad(
                file,
                format!(
                    "its \"schema_version\" is {found}, this program reads {SCHEMA_VERSION}; read it with the version of \
                     `jitter` that wrote it, or measure again"
                ),
            ));
        }
        let document: Self = serde_json::from_slice(bytes).map_err(|error| bad(file, error.to_string()))?;
        document.validate().map_err(|detail| bad(file, detail))?;
        Ok(document)
    }

    /// As it is written.
    pub fn to_json(&self) -> String {
        // Strings, numbers and maps with string keys: there is nothing that JSON cannot hold.
        serde_json::to_string(self).unwrap_or_default()
    }

    /// The series of a metric.
    pub fn series(&self, metric: Metric) -> Option<&Series> {
        self.series.iter().find(|series| series.metric == metric)
    }

    /// A counter; 0 if nobody counted.
    pub fn counter(&self, style: Style, name: &str) -> u64 {
        self.counters.get(style.name()).and_then(|sums| sums.get(name)).copied().unwrap_or(0)
    }

    fn validate(&self) -> Result<(), String> {
        for (index, series) in self.series.iter().enumerate() {
            let name = series.metric.name();
            if self.series[..index].iter().any(|other| other.metric == series.metric) {
                return Err(format!("the series {name} is there twice"));
            }
            let histogram =
                series.histogram.histogram().map_err(|detail| format!("series {name}: {detail}"))?;
            if histogram.count() != series.percentiles.count {
                let (held, said) = (histogram.count(), series.percentiles.count);
                return Err(format!(
                    "series {name}: its histogram holds {held} values, its count says {said}"
                ));
            }
        }
        Ok(())
    }
}

impl Series {
    /// Slices that lasted as long as they should.
    pub fn complete_runs(&self) -> impl Iterator<Item = &RunRow> {
        self.runs.iter().filter(|run| run.complete)
    }
}

impl Counts {
    /// Those of a histogram.
    pub fn of(histogram: &Histogram) -> Self {
        let counts = histogram.counts().iter().enumerate().filter(|(_, count)| **count > 0);
        let buckets = counts.map(|(bucket, count)| (bucket_lower(bucket), *count)).collect();
        Self { buckets, max_ns: histogram.max() }
    }

    /// The histogram again.
    ///
    /// # Errors
    /// If the buckets are none of ours.
    pub fn histogram(&self) -> Result<Histogram, String> {
        let mut counts = Box::new([0; BUCKETS]);
        for (lower_ns, count) in &self.buckets {
            let bucket = bucket_of(*lower_ns);
            if bucket_lower(bucket) != *lower_ns || counts[bucket] > 0 {
                return Err(format!(
                    "no bucket of the histogram begins at {lower_ns} ns, or it is there twice"
                ));
            }
            counts[bucket] = *count;
        }
        Ok(Histogram::from_counts(&counts, self.max_ns))
    }
}

fn bad(file: &Path, detail: String) -> JitterError {
    JitterError::BadFile { file: file.into(), what: "result of jitter", detail }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::jitter::bank::Sample;
    use crate::jitter::circumstances::Circumstances;
    use crate::jitter::origin::Origin;

    /// A result with one run for each list of values.
    pub(crate) fn document(metrics: &[(Metric, &[Vec<u64>])]) -> Document {
        let origin = Origin::now();
        let mut bank = Bank::new(origin, 3);
        let most = metrics.iter().map(|(_, runs)| runs.len()).max().unwrap_or(0);
        for run in 0..most {
            bank.begin_slice(run + 1);
            for (metric, runs) in metrics {
                for (tick, value_ns) in runs.get(run).into_iter().flatten().enumerate() {
                    let from_ns = origin.monotonic_ns() + (run * 1000 + tick) as u64 * 1_000_000;
                    let sample = Sample { tick: tick as u64, from_ns, value_ns: *value_ns };
                    bank.record(*metric, sample, Circumstances::default);
                }
            }
            bank.end_slice(origin.monotonic_ns(), true);
        }
        Document::new(&bank, &Surroundings::default(), "completed")
    }

    fn refusal(text: &str) -> String {
        Document::parse(text.as_bytes(), Path::new("x.json")).unwrap_err().to_string()
    }

    #[test]
    fn a_result_survives_being_written_and_read() {
        let written = document(&[(Metric::HybridWake, &[vec![20, 30, 4_000_000], vec![25; 100]])]);
        let read = Document::parse(written.to_json().as_bytes(), Path::new("x.json")).unwrap();
        assert_eq!(read, written);
        let series = read.series(Metric::HybridWake).unwrap();
        assert_eq!(Percentiles::of(&series.histogram.histogram().unwrap()), series.percentiles);
        assert_eq!(series.runs.len(), 2);
    }

    #[test]
    fn garbage_and_other_versions_are_refused_with_what_was_found() {
        let good = document(&[(Metric::HybridWake, &[vec![20]])]).to_json();
        assert!(refusal("\0\u{1}garbage").contains("no JSON"));
        assert!(refusal("[]").contains("no JSON object of ours"));
        assert!(refusal("{}").contains("expected \"phantom3-jitter\""));
        let newer = good.replace("\"schema_version\":1", "\"schema_version\":7");
        assert!(refusal(&newer).contains("is 7, this program reads 1"), "{}", refusal(&newer));
        assert!(refusal(&good[..good.len() / 2]).contains("x.json is not a usable result"));
        assert!(refusal(&good.replace("\"notes\"", "\"remarks\"")).contains("unknown field `remarks`"));
        assert!(refusal(&good.replace("hybrid.wake_error", "hybrid.luck")).contains("unknown variant"));
        let wrong = good.replace("\"buckets\":[[20,1]]", "\"buckets\":[[20,2]]");
        assert!(refusal(&wrong).contains("holds 2 values, its count says 1"), "{}", refusal(&wrong));
        let none = good.replace("\"buckets\":[[20,1]]", "\"buckets\":[[65,1]]");
        assert!(refusal(&none).contains("begins at 65 ns"), "{}", refusal(&none));
    }

    #[test]
    fn a_file_that_is_not_there_is_named() {
        let error = Document::load(Path::new("/nowhere/result.json")).unwrap_err();
        assert!(error.to_string().contains("/nowhere/result.json"));
    }
}
