//! The latencies: percentiles and a small histogram each.

use crate::monitor::bar;
use crate::monitor::look::Latencies;
use crate::monitor::number::microseconds;
use ratatui_core::style::Stylize;
use ratatui_core::text::{Line, Span};
use rt_core::histogram::Histogram;

/// Beyond this a histogram tells no more.
const MOST_CELLS: usize = 50;
/// From this width on, names are whole and histograms have cells.
const WIDE: usize = 60;
/// Four columns with a gap before each.
const COLUMNS: usize = 4 * 9;

/// A heading and a row for each.
pub(super) fn lines(latencies: &Latencies, width: usize) -> Vec<Line<'static>> {
    let is_wide = width >= WIDE;
    let names =
        if is_wide { ["us", "wake error", "round trip", "work"] } else { ["us", "wake", "trip", "work"] };
    let name_width = if is_wide { 10 } else { 4 };
    let cells = width.saturating_sub(name_width + COLUMNS + 2).min(MOST_CELLS);
    let columns: String = ["p50", "p99", "p99.9", "max"].map(|title| format!(" {title:>8}")).concat();
    let heading = format!("{:<name_width$}{columns}  {}", names[0], bar::axis(cells));
    let mut lines = vec![Line::raw(heading).dark_gray()];
    let histograms = [&latencies.wake_error, &latencies.round_trip, &latencies.work];
    for (name, histogram) in names[1..].iter().zip(histograms) {
        let name = format!("{name:<name_width$}");
        lines.push(Line::from(vec![
            Span::raw(name),
            Span::raw(numbers(histogram)),
            Span::raw(format!("  {}", bar::histogram(histogram, cells))).cyan(),
        ]));
    }
    lines
}

fn numbers(histogram: &Histogram) -> String {
    // Of an interval the exact maximum is not known; its bucket's upper end is.
    let at = |q| histogram.percentile(q).map(|ns| format!(" {}", microseconds(ns)));
    let all: Option<String> = [0.5, 0.99, 0.999, 1.0].into_iter().map(at).collect();
    all.unwrap_or_else(|| format!(" {:<1$}", "nothing recorded", COLUMNS - 1))
}
