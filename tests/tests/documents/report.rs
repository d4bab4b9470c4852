//! README.md explains the lines that a run tells at its end; the table is complete.

use crate::root;
use std::collections::BTreeSet;
use std::fs;

/// The words at the beginning of a line, before two spaces at least.
fn label(line: &str) -> Option<&str> {
    let (label, _) = line.split_once("  ")?;
    let is_word = |word: &str| !word.is_empty() && word.bytes().all(|byte| byte.is_ascii_lowercase());
    label.split(' ').all(is_word).then_some(label)
}

#[test]
fn the_table_of_a_report_explains_each_of_its_lines_and_no_others() {
    let source = fs::read_to_string(root().join("app/src/report.rs")).expect("a source");
    let code = source.split("#[cfg(test)]").next().unwrap_or_default();
    let mut lines: BTreeSet<&str> = code.split('"').skip(1).step_by(2).filter_map(label).collect();
    // Many lines under a heading.
    lines.insert("guarantees");
    assert!(lines.len() > 10, "{lines:?}");
    let readme = fs::read_to_string(root().join("README.md")).expect("README.md");
    let (_, table) = readme.split_once("\n| clock | ").expect("the table of a report");
    let (table, _) = table.split_once("\n\n").expect("its end");
    let rows = table.lines().skip(1).filter_map(|row| row.split('|').nth(1));
    let told: BTreeSet<&str> = rows.map(str::trim).chain(["clock"]).collect();
    assert_eq!(told, lines);
}
