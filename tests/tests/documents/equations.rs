//! Every equation of the thesis that a line implements is tested, and every test of one has a line that implements it.
//!
//! The line carries `//= melder#4.6`, its test `//= melder#4.6 type=test` (numbers as printed in N. Melder's thesis).

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

const MARK: &str = "//= melder#";

/// Where an equation is cited.
#[derive(Default)]
struct Cited {
    by_code: Vec<PathBuf>,
    by_tests: Vec<PathBuf>,
}

#[test]
fn every_equation_that_is_cited_has_both_a_line_and_a_test() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let mut cited = BTreeMap::new();
    for part in ["app", "io-driver", "rt-core", "shm-abi"] {
        read_tree(&root.join(part), &mut cited);
    }
    assert!(cited.len() > 30, "the scan found the sources: {}", cited.len());
    let lonely: Vec<String> = cited
        .iter()
        .filter(|(_, cited)| cited.by_code.is_empty() || cited.by_tests.is_empty())
        .map(|(equation, Cited { by_code, by_tests })| {
            format!("{equation}: lines in {by_code:?}, tests in {by_tests:?}")
        })
        .collect();
    assert!(lonely.is_empty(), "{}", lonely.join("\n"));
}

fn read_tree(folder: &Path, cited: &mut BTreeMap<String, Cited>) {
    for entry in fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()) {
        if entry.is_dir() {
            if !entry.ends_with("target") {
                read_tree(&entry, cited);
            }
        } else if entry.extension().is_some_and(|extension| extension == "rs") {
            read_file(&entry, cited);
        }
    }
}

fn read_file(file: &Path, cited: &mut BTreeMap<String, Cited>) {
    let text = fs::read_to_string(file).unwrap();
    for mark in text.lines().filter_map(|line| line.trim().strip_prefix(MARK)) {
        let (equation, kind) = mark.split_once(' ').unwrap_or((mark, ""));
        let cited = cited.entry(equation.to_owned()).or_default();
        match kind {
            "" => cited.by_code.push(file.into()),
            "type=test" => cited.by_tests.push(file.into()),
            other => panic!("{}: {MARK}{mark}: `{other}` is not `type=test`", file.display()),
        }
    }
}
