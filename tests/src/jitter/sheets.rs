//! The results as CSV: runs, time line, worst events. Times in the units of the headings.

use crate::jitter::document::Document;
use crate::jitter::error::JitterError;
use crate::jitter::percentiles::Level;
use crate::jitter::save::write_atomically;
use std::fmt::Write;
use std::path::Path;

/// Writes `runs.csv`, `timeline.csv` and `worst.csv`.
///
/// # Errors
/// If one cannot be written.
pub fn write(document: &Document, directory: &Path) -> Result<(), JitterError> {
    let sheets =
        [("runs.csv", runs(document)), ("timeline.csv", timeline(document)), ("worst.csv", worst(document))];
    for (name, text) in sheets {
        let file = directory.join(name);
        write_atomically(&file, text.as_bytes())
            .map_err(|error| JitterError::Write { file, detail: error.to_string() })?;
    }
    Ok(())
}

fn runs(document: &Document) -> String {
    let levels: Vec<String> = Level::ALL.iter().map(|level| format!("{}_ns", level.name())).collect();
    let mut text = format!("metric,run,from_s,seconds,complete,count,{}\n", levels.join(","));
    for series in &document.series {
        for run in &series.runs {
            let values: Vec<_> =
                Level::ALL.iter().map(|level| run.percentiles.at(*level).to_string()).collect();
            let _ = writeln!(
                text,
                "{},{},{:.3},{:.3},{},{},{}",
                series.metric.name(),
                run.run,
                run.from_s,
                run.seconds,
                run.complete,
                run.percentiles.count,
                values.join(",")
            );
        }
    }
    text
}

fn timeline(document: &Document) -> String {
    let mut text = "metric,from_s,to_s,count,p50_ns,p99_ns,max_ns,merged\n".to_owned();
    for series in &document.series {
        for row in &series.timeline {
            let _ = writeln!(
                text,
                "{},{:.3},{:.3},{},{},{},{},{}",
                series.metric.name(),
                row.from_s,
                row.to_s,
                row.count,
                row.p50_ns,
                row.p99_ns,
                row.max_ns,
                row.merged
            );
        }
    }
    text
}

fn worst(document: &Document) -> String {
    let mut text =
        "metric,value_ns,tick,utc,at_s,run,cpu,interval_ms,minor_faults,major_faults,voluntary_switches,\
                    involuntary_switches,waited_for_cpu_us,steal_ticks,interrupt_ticks,interrupts,remarks\n"
            .to_owned();
    for series in &document.series {
        for event in &series.worst {
            let c = &event.circumstances;
            let interrupts: Vec<_> =
                c.interrupts.iter().map(|(name, count)| format!("{count} x {name}")).collect();
            let number = |count: Option<u64>| count.map_or_else(String::new, |count| count.to_string());
            let _ = writeln!(
                text,
                "{},{},{},{},{:.6},{},{},{:.1},{},{},{},{},{},{},{},{},{}",
                series.metric.name(),
                event.value_ns,
                number(event.tick),
                event.utc,
                event.at_s,
                event.run,
                number(c.cpu.map(|cpu| cpu as u64)),
                c.interval_ms,
                number(c.minor_faults),
                number(c.major_faults),
                number(c.voluntary_switches),
                number(c.involuntary_switches),
                c.waited_for_cpu_us.map_or_else(String::new, |us| format!("{us:.1}")),
                number(c.steal_ticks),
                number(c.interrupt_ticks),
                quoted(&interrupts.join("; ")),
                quoted(&c.remarks.join("; "))
            );
        }
    }
    text
}

/// RFC 4180.
fn quoted(text: &str) -> String {
    format!("\"{}\"", text.replace('"', "\"\""))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::jitter::document::tests::document;
    use crate::jitter::metric::Metric;

    #[test]
    fn every_row_has_as_many_fields_as_the_heading() {
        let document =
            document(&[(Metric::HybridWake, &[vec![20; 5]]), (Metric::RoundTrip, &[vec![9; 5], vec![8; 5]])]);
        for (text, rows) in [(runs(&document), 3), (timeline(&document), 3), (worst(&document), 6)] {
            let mut lines = text.lines();
            let fields = lines.next().unwrap().split(',').count();
            assert!(lines.clone().all(|line| line.split(',').count() == fields), "{text}");
            assert_eq!(lines.count(), rows, "{text}");
        }
    }
}
