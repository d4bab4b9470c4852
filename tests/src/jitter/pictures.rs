//! The results as charts: histogram, tail, time line; SVG and PNG.

use crate::jitter::document::{Document, Series as Measured};
use crate::jitter::error::JitterError;
use crate::jitter::metric::Metric;
use crate::jitter::timeline::Row;
use plot::{Axis, Chart, Figure, Look, PlotError, Series};
use rt_core::histogram::{BUCKETS, bucket_lower};
use std::path::Path;

/// Buckets drawn as one: two steps an octave; finer ones make a thicket of rare values.
const GROUP: usize = 16;
/// Nothing is faster than reading the clock.
const LEAST_US: f64 = 0.01;

/// Writes `histogram`, `tail` and `timeline`, each as SVG and PNG.
///
/// # Errors
/// If one cannot be drawn or written.
pub fn write(document: &Document, directory: &Path) -> Result<(), JitterError> {
    let write = |name: &str, figure: Figure| {
        let file = directory.join(name);
        figure.write(&file).map_err(|error| match error {
            PlotError::Write { file, source } => JitterError::Write { file, detail: source.to_string() },
            other => JitterError::Write { file, detail: other.to_string() },
        })
    };
    let all: Vec<(&str, &Document)> = vec![("", document)];
    write("histogram", with_notes(Figure::new("Latency histogram", vec![histogram(&all)]), document))?;
    write("tail", with_notes(Figure::new("Latency tail", vec![tail(&all)]), document))?;
    let over_time = Figure { panel_height: 260, ..Figure::new("Latency over time", timelines(document)) };
    write("timeline", with_notes(over_time, document))
}

/// Both results overlaid: for each metric of both a panel with the tails.
pub fn comparison(a: &Document, b: &Document) -> Figure {
    let common =
        a.series.iter().filter(|series| b.series(series.metric).is_some()).map(|series| series.metric);
    let panel = |metric: Metric| {
        let both = [("A", a), ("B", b)].into_iter().filter_map(|(name, document)| {
            let series = document.series(metric)?;
            Some(Series::new(&format!("{name}: {}", document.started_utc), Look::Line, exceedance(series)))
        });
        let mut chart = tail_axes(metric.name());
        chart.series.extend(both.enumerate().map(|(index, series)| {
            let look = if index == 0 { Look::Dashed } else { Look::Line };
            Series { look, ..series }.coloured(index)
        }));
        chart
    };
    Figure::new("A and B: share of values above a latency", common.map(panel).collect())
        .note("Further left and further down is better.")
}

fn with_notes(figure: Figure, document: &Document) -> Figure {
    let get = |key: &str| document.machine.get(key).map_or("?", String::as_str);
    let runs = document.configuration.get("runs").map_or("?", String::as_str);
    let load = document.configuration.get("load").map_or("none", String::as_str);
    figure.note(format!(
        "{}; kernel {}; {}; {runs} runs, load {load}, {}",
        document.started_utc,
        get("kernel"),
        get("cpu model"),
        document.end
    ))
}

/// Names, with the document's own prefix where several are shown together.
fn every<'a>(
    documents: &'a [(&'a str, &'a Document)],
) -> impl Iterator<Item = (String, &'a Measured, usize)> {
    documents.iter().flat_map(|(prefix, document)| {
        let place = |metric| Metric::ALL.iter().position(|other| *other == metric).unwrap_or(0);
        document
            .series
            .iter()
            .map(move |series| (format!("{prefix}{}", series.metric.name()), series, place(series.metric)))
    })
}

fn histogram(documents: &[(&str, &Document)]) -> Chart {
    let share = Axis::log("share of the values, half an octave each", "");
    let mut chart = Chart::new("", Axis::log("latency", "us"), share);
    for (name, series, place) in every(documents) {
        chart.series.push(styled(Series::new(&name, Look::Steps, shares(series)), place));
    }
    chart
}

fn tail(documents: &[(&str, &Document)]) -> Chart {
    let mut chart = tail_axes("");
    for (name, series, place) in every(documents) {
        chart.series.push(styled(Series::new(&name, Look::Line, exceedance(series)), place));
    }
    chart
}

fn tail_axes(title: &str) -> Chart {
    Chart::new(title, Axis::log("latency", "us"), Axis::log("share of the values above it", ""))
}

/// What nearly coincides with another is dashed, so that both are seen.
fn styled(series: Series, place: usize) -> Series {
    let dashed = matches!(Metric::ALL[place], Metric::DriverWake | Metric::Cycle | Metric::ForceAge);
    let look = if dashed && series.look == Look::Line { Look::Dashed } else { series.look };
    Series { look, ..series }.coloured(place)
}

/// Left end of each group of buckets (us) and its share.
fn shares(series: &Measured) -> Vec<(f64, f64)> {
    let Ok(histogram) = series.histogram.histogram() else { return Vec::new() };
    let total = histogram.count().max(1) as f64;
    let groups = histogram.counts().chunks(GROUP).enumerate().map(|(group, counts)| {
        let lower = bucket_lower((group * GROUP).min(BUCKETS - 1)) as f64 / 1e3;
        (lower.max(LEAST_US), counts.iter().sum::<u64>() as f64 / total)
    });
    let all: Vec<_> = groups.collect();
    let first = all.iter().position(|(_, share)| *share > 0.0).unwrap_or(0);
    let last = all.iter().rposition(|(_, share)| *share > 0.0).unwrap_or(0);
    // With an empty group at either end, so that the first and the last step have both sides.
    all[first.saturating_sub(1)..(last + 2).min(all.len())].to_vec()
}

/// Latency (us) and the share of values above it; down to one value.
fn exceedance(series: &Measured) -> Vec<(f64, f64)> {
    let Ok(histogram) = series.histogram.histogram() else { return Vec::new() };
    let total = histogram.count().max(1) as f64;
    let mut above = histogram.count();
    let mut points = Vec::new();
    for (bucket, count) in histogram.counts().iter().enumerate().filter(|(_, count)| **count > 0) {
        let lower = (bucket_lower(bucket) as f64 / 1e3).max(LEAST_US);
        points.push((lower, above as f64 / total));
        above -= count;
    }
    points.push((histogram.max() as f64 / 1e3, 1.0 / total));
    points
}

/// A panel for each metric that is worth one: p50, p99 and maximum.
fn timelines(document: &Document) -> Vec<Chart> {
    let longest =
        document.series.iter().flat_map(|series| &series.timeline).map(|row| row.to_s).fold(0.0, f64::max);
    let (unit, seconds) = match longest {
        s if s < 600.0 => ("s", 1.0),
        s if s < 3.0 * 3600.0 => ("min", 60.0),
        s if s < 3.0 * 86_400.0 => ("h", 3600.0),
        _ => ("d", 86_400.0),
    };
    let values = document.series.iter().flat_map(|series| &series.timeline);
    let highest = values.map(|row| row.max_ns as f64 / 1e3).fold(1.0, f64::max);
    // The same for all panels, so that they can be compared.
    let us = Axis::log("latency", "us").within(LEAST_US, 10_f64.powf(highest.log10().ceil()));
    let shown = [
        Metric::HybridWake,
        Metric::ReferenceWake,
        Metric::DeadlineToRead,
        Metric::RoundTrip,
        Metric::EndToEnd,
    ];
    let panel = |metric: Metric| {
        let series = document.series(metric)?;
        let line = |name: &str, look, value: fn(&Row) -> u64| {
            Series::new(name, look, over_time(&series.timeline, seconds, value))
        };
        let time = Axis::linear("time", unit).within(0.0, (longest / seconds).max(1e-3));
        Some(
            Chart::new(metric.name(), time, us.clone())
                .with(line("p50", Look::Line, |row| row.p50_ns).coloured(0))
                .with(line("p99", Look::Dashed, |row| row.p99_ns).coloured(2))
                .with(Series::new("max", Look::Dots, greatest(&series.timeline, seconds)).coloured(1)),
        )
    };
    shown.into_iter().filter_map(panel).collect()
}

/// A row is drawn from its beginning to its end; between rows that are apart the line is broken.
fn over_time(rows: &[Row], seconds: f64, value: fn(&Row) -> u64) -> Vec<(f64, f64)> {
    let mut points = Vec::with_capacity(2 * rows.len());
    let mut last_end = f64::NEG_INFINITY;
    for row in rows {
        let us = (value(row) as f64 / 1e3).max(LEAST_US);
        if row.from_s - last_end > 0.5 * (row.to_s - row.from_s).max(0.5) {
            points.push((f64::NAN, f64::NAN));
        }
        points.extend([(row.from_s / seconds, us), (row.to_s / seconds, us)]);
        last_end = row.to_s;
    }
    points
}

/// In the middle of each row: the row does not tell when.
fn greatest(rows: &[Row], seconds: f64) -> Vec<(f64, f64)> {
    let middle = |row: &Row| (row.from_s + row.to_s) / 2.0 / seconds;
    rows.iter().map(|row| (middle(row), (row.max_ns as f64 / 1e3).max(LEAST_US))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::jitter::document::tests::document;

    #[test]
    fn shares_add_up_and_the_tail_ends_at_the_maximum_with_one_value() {
        let document = document(&[(Metric::HybridWake, &[(1..=1000).map(|i| i * 50).collect()])]);
        let series = document.series(Metric::HybridWake).unwrap();
        let sum: f64 = shares(series).iter().map(|point| point.1).sum();
        assert!((sum - 1.0).abs() < 1e-9, "rounding of a thousand shares");
        assert_eq!(exceedance(series).last(), Some(&(50.0, 0.001)));
        assert!(exceedance(series).windows(2).all(|pair| pair[0].1 >= pair[1].1));
    }

    #[test]
    fn rows_that_are_apart_are_not_joined() {
        let row = |from_s: f64, to_s: f64| Row {
            from_s,
            to_s,
            count: 1,
            p50_ns: 1000,
            p99_ns: 1,
            max_ns: 1,
            merged: 1,
        };
        let points = over_time(&[row(0.0, 1.0), row(1.0, 2.0), row(9.0, 10.0)], 1.0, |row| row.p50_ns);
        let breaks: Vec<_> = points.iter().map(|point| point.0.is_nan()).collect();
        assert_eq!(breaks, [true, false, false, false, false, true, false, false]);
    }

    #[test]
    fn charts_are_made_of_a_result_without_values_too() {
        let directory = tempfile::tempdir().unwrap();
        write(&document(&[]), directory.path()).unwrap();
        assert_eq!(std::fs::read_dir(directory.path()).unwrap().count(), 6);
    }
}
