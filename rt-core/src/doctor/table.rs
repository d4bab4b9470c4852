//! The findings as a person reads them: one line each, and what to do about those that did not pass.

use super::machine::LoopSpec;
use super::{Finding, Tally, Verdict};
use std::fmt;

/// Findings with the loop they are about.
#[derive(Clone, Copy, Debug)]
pub struct Table<'a> {
    /// The findings, grouped.
    pub findings: &'a [Finding],
    /// The loop.
    pub spec: &'a LoopSpec,
}

/// Where the text behind the title begins.
const TEXT_COLUMN: usize = 42;
/// As wide as a line may be.
const WIDTH: usize = 110;

impl fmt::Display for Table<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}", headline(self.spec))?;
        for group in self.findings.chunk_by(|a, b| a.group == b.group) {
            writeln!(f, "\n{}", group[0].group)?;
            group.iter().try_for_each(|finding| write_finding(f, finding))?;
        }
        write!(f, "\n{}", summary(self.findings))
    }
}

fn headline(spec: &LoopSpec) -> String {
    let rate_hz = (1e12 / spec.period_ns as f64).round() / 1e3;
    let policy =
        spec.priority.map_or_else(|| "no real-time priority".to_owned(), |p| format!("SCHED_FIFO {p}"));
    format!("Is this machine ready for a loop on CPU {}, {policy}, {rate_hz} Hz?", spec.cpu)
}

fn write_finding(f: &mut fmt::Formatter<'_>, finding: &Finding) -> fmt::Result {
    let judgement = &finding.judgement;
    let title = match &judgement.subject {
        Some(subject) => format!("{} {subject}", finding.title),
        None => finding.title.to_owned(),
    };
    let head = format!("  {:<10}  {title:<27}", mark(judgement.verdict));
    write_wrapped(f, &head, &judgement.found)?;
    if judgement.verdict != Verdict::Pass {
        write_wrapped(f, "              why", finding.why)?;
    }
    match &judgement.remedy {
        Some(remedy) => write_wrapped(f, "              remedy", &remedy.text),
        None => Ok(()),
    }
}

/// Failures catch the eye.
fn mark(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Fail => "FAIL",
        other => other.name(),
    }
}

/// Words behind a head, continued in the same column.
fn write_wrapped(f: &mut fmt::Formatter<'_>, head: &str, text: &str) -> fmt::Result {
    let column = if head.len() > 24 { TEXT_COLUMN } else { 22 };
    let mut line = format!("{head:<width$}", width = column - 1);
    let mut is_empty = true;
    for word in text.split_whitespace() {
        if !is_empty && line.chars().count() + 1 + word.chars().count() > WIDTH {
            writeln!(f, "{}", line.trim_end())?;
            line = " ".repeat(column - 1);
        }
        line.push(' ');
        line.push_str(word);
        is_empty = false;
    }
    writeln!(f, "{}", line.trim_end())
}

fn summary(findings: &[Finding]) -> String {
    let Tally { pass, warn, fail, unreadable } = Tally::of(findings);
    let advice = match (fail, warn) {
        (0, 0) => "ready",
        (0, _) => "usable; the warnings cost time in the worst ticks",
        _ => "not ready: the failures first",
    };
    format!(
        "{} checks: {pass} pass, {warn} warn, {fail} fail, {unreadable} unreadable: {advice}.\n",
        findings.len()
    )
}
