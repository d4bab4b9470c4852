//! The results as a table for people.

use crate::jitter::document::{Document, Series};
use crate::jitter::metric::Style;
use crate::jitter::percentiles::{Level, us};
use crate::jitter::spread::Spread;
use std::fmt::Write;

/// Shown of each series; the file has them all.
const EVENTS: usize = 3;

/// Percentiles, counters, worst events, guarantees, notes.
pub fn text(document: &Document) -> String {
    let mut out = String::new();
    let _ = writeln!(
        out,
        "{} to {}, {:.0} s, {}",
        document.started_utc, document.written_utc, document.elapsed_s, document.end
    );
    percentiles(document, &mut out);
    counters(document, &mut out);
    worst(document, &mut out);
    guarantees(document, &mut out);
    for note in &document.notes {
        let _ = writeln!(out, "note: {note}");
    }
    out
}

fn percentiles(document: &Document, out: &mut String) {
    let _ = write!(out, "\n{:24} {:>10}", "microseconds", "values");
    for level in Level::ALL {
        let _ = write!(out, " {:>9}", level.name());
    }
    out.push('\n');
    for series in &document.series {
        let _ = write!(out, "{:24} {:>10}", series.metric.name(), series.percentiles.count);
        for level in Level::ALL {
            let _ = write!(out, " {:>9}", us(series.percentiles.at(level) as f64));
        }
        out.push('\n');
        medians(series, out);
    }
}

/// What the runs say: the median over them, which one bad run does not move.
fn medians(series: &Series, out: &mut String) {
    let runs = series.complete_runs().count();
    if runs < 2 {
        return;
    }
    let _ = write!(out, "{:24} {:>10}", "  median of the runs", runs);
    for level in Level::ALL {
        let spread = Spread::of(series.complete_runs().map(|run| run.percentiles.at(level) as f64));
        let _ = write!(out, " {:>9}", spread.map_or_else(|| "-".into(), |spread| us(spread.median)));
    }
    out.push('\n');
}

fn counters(document: &Document, out: &mut String) {
    out.push('\n');
    for (style, sums) in &document.counters {
        let words: Vec<String> =
            sums.iter().map(|(name, count)| format!("{} {count}", name.replace('_', " "))).collect();
        let _ = writeln!(out, "{style:10} {}", words.join(", "));
    }
    let lost = document.counter(Style::Driver, "frames_lost");
    if lost > 0 {
        let _ = writeln!(
            out,
            "{lost} frames were overwritten before they could be observed: their figures are missing"
        );
    }
}

fn worst(document: &Document, out: &mut String) {
    out.push('\n');
    for series in &document.series {
        for event in series.worst.iter().take(EVENTS) {
            let tick = event.tick.map_or_else(|| "slice".into(), |tick| format!("tick {tick}"));
            let _ = writeln!(
                out,
                "worst {:24} {:>9} us  {}  run {} {tick}: {}",
                series.metric.name(),
                us(event.value_ns as f64),
                event.utc,
                event.run,
                event.circumstances.in_short()
            );
        }
    }
}

/// What is missing, once; what was obtained is in the file.
fn guarantees(document: &Document, out: &mut String) {
    out.push('\n');
    let mut said: Vec<&String> = Vec::new();
    for (style, lines) in &document.guarantees {
        for line in lines.iter().filter(|line| line.starts_with("MISSING")) {
            if !said.contains(&line) {
                let _ = writeln!(out, "{style:10} {line}");
                said.push(line);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::jitter::document::tests::document;
    use crate::jitter::metric::Metric;

    #[test]
    fn the_table_has_a_line_of_all_values_and_one_of_the_medians_of_the_runs() {
        let text = super::text(&document(&[(Metric::HybridWake, &[vec![2_000; 10], vec![2_000; 10]])]));
        let words: Vec<String> =
            text.lines().map(|line| line.split_whitespace().collect::<Vec<_>>().join(" ")).collect();
        for expected in [
            "microseconds values p50 p90 p99 p99.9 p99.99 max",
            "hybrid.wake_error 20 2.00 2.00 2.00 2.00 2.00 2.00",
            "median of the runs 2 2.00 2.00 2.00 2.00 2.00 2.00",
        ] {
            assert!(words.iter().any(|line| line == expected), "{text}");
        }
    }
}
