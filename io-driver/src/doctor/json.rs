//! The findings for programs. Ids and verdicts are stable; titles and texts may change.

use rt_core::doctor::machine::LoopSpec;
use rt_core::doctor::{Finding, Tally};
use serde::Serialize;

/// Raised when a field changes its meaning or goes away.
const SCHEMA: u32 = 1;

#[derive(Serialize)]
struct Document<'a> {
    schema: u32,
    #[serde(rename = "loop")]
    spec: Spec,
    summary: Summary,
    findings: Vec<Item<'a>>,
}

#[derive(Serialize)]
struct Spec {
    cpu: usize,
    fifo_priority: Option<u8>,
    period_ns: u64,
    phase_offset_ns: u64,
}

#[derive(Serialize)]
struct Summary {
    pass: usize,
    warn: usize,
    fail: usize,
    unreadable: usize,
}

#[derive(Serialize)]
struct Item<'a> {
    id: &'a str,
    group: &'a str,
    title: &'a str,
    subject: Option<&'a str>,
    verdict: &'a str,
    found: &'a str,
    why: &'a str,
    remedy: Option<&'a str>,
}

/// One object, indented.
pub fn to_json(findings: &[Finding], spec: &LoopSpec) -> String {
    let Tally { pass, warn, fail, unreadable } = Tally::of(findings);
    let document = Document {
        schema: SCHEMA,
        spec: Spec {
            cpu: spec.cpu,
            fifo_priority: spec.priority,
            period_ns: spec.period_ns,
            phase_offset_ns: spec.phase_offset_ns,
        },
        summary: Summary { pass, warn, fail, unreadable },
        findings: findings.iter().map(item).collect(),
    };
    // Strings and numbers alone: it cannot fail.
    serde_json::to_string_pretty(&document).unwrap_or_default()
}

fn item(finding: &Finding) -> Item<'_> {
    let judgement = &finding.judgement;
    Item {
        id: finding.id,
        group: finding.group,
        title: finding.title,
        subject: judgement.subject.as_deref(),
        verdict: judgement.verdict.name(),
        found: &judgement.found,
        why: finding.why,
        remedy: judgement.remedy.as_ref().map(|remedy| remedy.text.as_str()),
    }
}
