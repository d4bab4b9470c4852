//! What was found, for people.

use super::Checked;
use super::capacities::Capacities;
use super::summary::Summary;
use rt_core::plain_text::Plain;
use std::fmt::{Display, Write};
use std::path::Path;

/// Problems and warnings, then what is in the scene.
pub(super) fn text(checked: &Checked, file: &Path) -> String {
    let mut text = String::new();
    for problem in &checked.problems {
        line(&mut text, &problem.message);
    }
    for warning in &checked.warnings {
        line(&mut text, format_args!("warning: {warning}"));
    }
    if let Some(summary) = &checked.summary {
        table(&mut text, summary);
    }
    let (problems, warnings) = (checked.problems.len(), checked.warnings.len());
    let verdict = if problems == 0 { "can be run" } else { "cannot be run" };
    line(
        &mut text,
        format_args!("{}: {verdict}; problems: {problems}, warnings: {warnings}", file.display()),
    );
    text
}

fn table(text: &mut String, summary: &Summary) {
    row(text, "scene", &summary.name);
    rows(text, "included", summary.included.iter().map(|file| file.display().to_string()));
    let total: usize = summary.entities.iter().map(|(_, count)| count).sum();
    let kinds = summary
        .entities
        .iter()
        .filter(|(_, count)| *count > 0)
        .map(|(what, count)| format!("{count} {what}"));
    row(text, "entities", format_args!("{total}: {}", joined(kinds)));
    row(text, "shapes", joined(summary.shapes.iter().map(|(kind, count)| format!("{count} {kind}"))));
    rows(
        text,
        "templates",
        summary.templates.iter().map(|(name, count)| format!("{name}: of {count} entities")),
    );
    rows(
        text,
        "environments",
        summary.environments.iter().map(|(name, kind, parts)| format!("{name}: {kind}, {parts} parts")),
    );
    for (file, report) in &summary.meshes {
        let told = report.to_string();
        row(text, "mesh", format_args!("{}: {}", file.display(), told.lines().next().unwrap_or_default()));
        told.lines().skip(1).for_each(|finding| row(text, "", format_args!("  {}", finding.trim())));
    }
    rows(text, "fingers", summary.fingers.iter().map(finger));
    let sizes = sizes(summary);
    let more = summary.measures.len() - sizes.len();
    rows(text, "sizes", sizes.into_iter());
    if more > 0 {
        row(text, "", format_args!("and {more} more, which --json tells"));
    }
    rows(
        text,
        "passes through",
        summary.passing.iter().map(|it| format!("{} ({}): {}", it.names, it.kind, it.through.join(", "))),
    );
    rows(
        text,
        "lights",
        summary.lights.iter().map(|(name, kind)| format!("{name}: {kind} (for the window)")),
    );
    rows(
        text,
        "cameras",
        summary.cameras.iter().map(|(name, deg)| format!("{name}: {deg} degrees (for the window)")),
    );
    rows(text, "capacities", summary.capacities.iter().flat_map(Capacities::lines));
    if let Some([now, most]) = summary.memory {
        row(text, "memory", format_args!("{} MB, at most {} MB while it was loaded", now >> 20, most >> 20));
    }
}

fn finger((name, radius_m, device): &(String, f64, usize)) -> String {
    match *radius_m {
        0.0 => format!("{name}: a point, device {device}"),
        radius_m => format!("{name}: a ball of {radius_m} m, device {device}"),
    }
}

/// The first few things, and all whose numbers look like those of another unit.
fn sizes(summary: &Summary) -> Vec<String> {
    let things = summary.measures.iter().zip(&summary.suspected).enumerate();
    let told = things.filter(|(index, (_, is_suspected))| *index < FEW || **is_suspected);
    told.map(|(_, (it, _))| it.to_string()).collect()
}

/// Ten thousand lines would hide the rest.
const FEW: usize = 20;

fn joined(items: impl Iterator<Item = String>) -> String {
    items.collect::<Vec<_>>().join(", ")
}

/// The name stands beside the first one only.
fn rows(text: &mut String, name: &str, items: impl Iterator<Item = String>) {
    for (index, item) in items.enumerate() {
        row(text, if index == 0 { name } else { "" }, item);
    }
}

fn row(text: &mut String, name: &str, value: impl Display) {
    line(text, format_args!("{name:<14} {value}"));
}

fn line(text: &mut String, value: impl Display) {
    // Writing to a string cannot fail.
    let _ = writeln!(text, "{}", Plain(value));
}
