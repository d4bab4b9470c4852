//! What a person sees while it runs.
//!
//! Model: on a terminal a few lines, drawn anew; elsewhere a plain line now and then, so that a log of days stays
//! readable. On standard error: the table at the end is the output.

use crate::jitter::bank::Bank;
use crate::jitter::metric::{Metric, Style};
use crate::jitter::percentiles::{Percentiles, us};
use io_driver::say::say;
use std::io::{IsTerminal, Write};
use std::time::{Duration, Instant};

const REDRAW: Duration = Duration::from_millis(500);
/// Without a terminal: often enough for a short run, seldom enough for a long one.
const PLAIN_SHORT: Duration = Duration::from_secs(15);
const PLAIN_LONG: Duration = Duration::from_secs(600);
const LONG: Duration = Duration::from_secs(3600);

const UNKNOWN_WIDTH: usize = 100;

/// How much is said.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Manner {
    Silent,
    Plain,
    Redrawn,
}

/// The view.
#[derive(Debug)]
pub struct Live {
    manner: Manner,
    begun: Instant,
    expected: Duration,
    runs: usize,
    run: usize,
    style: Style,
    shown: Instant,
    /// Lines on the terminal that are drawn over.
    lines: usize,
}

impl Live {
    /// A view of a measurement that is expected to take so long.
    pub fn new(quiet: bool, expected: Duration, runs: usize) -> Self {
        let manner = match (quiet, std::io::stderr().is_terminal()) {
            (true, _) => Manner::Silent,
            (false, true) => Manner::Redrawn,
            (false, false) => Manner::Plain,
        };
        let now = Instant::now();
        Self { manner, begun: now, expected, runs, run: 0, style: Style::Hybrid, shown: now, lines: 0 }
    }

    /// The next slice.
    pub fn begin_slice(&mut self, run: usize, style: Style) {
        (self.run, self.style) = (run, style);
    }

    /// Shows how it stands, if it is time.
    pub fn show(&mut self, bank: &Bank) {
        let every = match self.manner {
            Manner::Silent => return,
            Manner::Redrawn => REDRAW,
            Manner::Plain if self.expected < LONG => PLAIN_SHORT,
            Manner::Plain => PLAIN_LONG,
        };
        if self.shown.elapsed() < every {
            return;
        }
        self.shown = Instant::now();
        let head = self.head(bank);
        let figures: Vec<String> = SHOWN.iter().filter_map(|metric| figures(bank, *metric)).collect();
        if self.manner == Manner::Plain {
            return say(format_args!("jitter: {head} | {}", figures.join(" | ")));
        }
        let lines: Vec<String> = [head].into_iter().chain(figures).chain(worst(bank)).collect();
        self.redraw(&lines);
    }

    /// Says something that stays.
    pub fn tell(&mut self, what: &str) {
        if self.manner != Manner::Silent {
            self.redraw(&[]);
        }
        say(format_args!("jitter: {what}"));
    }

    /// Leaves the terminal clean.
    pub fn end(&mut self) {
        self.redraw(&[]);
    }

    fn redraw(&mut self, lines: &[String]) {
        if self.manner != Manner::Redrawn {
            return;
        }
        let width =
            rustix::termios::tcgetwinsize(std::io::stderr()).map_or(0, |size| usize::from(size.ws_col));
        let width = if width == 0 { UNKNOWN_WIDTH } else { width };
        // A line that wraps would be two, and the cursor would not find the first again.
        let cut = |line: &String| line.chars().take(width.max(20) - 1).collect::<String>();
        let up = if self.lines > 0 { format!("\x1b[{}A", self.lines) } else { String::new() };
        let body: String = lines.iter().map(|line| format!("\x1b[2K{}\n", cut(line))).collect();
        let _ = std::io::stderr().write_all(format!("{up}\r{body}\x1b[J").as_bytes());
        self.lines = lines.len();
    }

    fn head(&self, bank: &Bank) -> String {
        let elapsed = self.begun.elapsed();
        let left = self.expected.saturating_sub(elapsed);
        let of = |style: Style, name: &str| {
            bank.counters().get(&style).and_then(|sums| sums.get(name)).copied().unwrap_or(0)
        };
        let driver = Style::Driver;
        format!(
            "{} gone, {} to go, run {}/{} {}, driver: overruns {}, missed {}, lost {}",
            duration(elapsed),
            duration(left),
            self.run,
            self.runs,
            self.style.name(),
            of(driver, "overruns"),
            of(driver, "replies_missed"),
            of(driver, "frames_lost"),
        )
    }
}

/// The others are in the table at the end.
const SHOWN: [Metric; 4] = [Metric::HybridWake, Metric::ReferenceWake, Metric::RoundTrip, Metric::EndToEnd];

fn figures(bank: &Bank, metric: Metric) -> Option<String> {
    let found = Percentiles::of(&bank.series().get(&metric)?.total);
    let [p50, p99, p999, max] = [found.p50, found.p99, found.p999, found.max].map(|ns| us(ns as f64));
    Some(format!("{} p50 {p50} p99 {p99} p99.9 {p999} max {max} us", metric.name()))
}

fn worst(bank: &Bank) -> Option<String> {
    let events = bank
        .series()
        .iter()
        .filter_map(|(metric, series)| series.worst.events().first().map(|event| (*metric, event)));
    let (metric, event) = events.max_by_key(|(_, event)| event.value_ns)?;
    let value = us(event.value_ns as f64);
    Some(format!("worst: {} {value} us at {}: {}", metric.name(), event.utc, event.circumstances.in_short()))
}

fn duration(of: Duration) -> String {
    let seconds = of.as_secs();
    let (days, hours, minutes) = (seconds / 86_400, seconds / 3600 % 24, seconds / 60 % 60);
    match (days, hours) {
        (0, 0) => format!("{minutes}:{:02}", seconds % 60),
        (0, _) => format!("{hours}:{minutes:02}:{:02}", seconds % 60),
        _ => format!("{days} d {hours}:{minutes:02}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn durations_read_as_on_a_clock() {
        let written = [59, 61, 3_700, 90_061].map(|seconds| duration(Duration::from_secs(seconds)));
        assert_eq!(written, ["0:59", "1:01", "1:01:40", "1 d 1:01"]);
    }
}
