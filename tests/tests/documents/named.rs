//! SAFETY.md names the tests that show each guard, ARCHITECTURE.md sources, README.md the lines of a report; each of them is
//! there.

use crate::root;
use std::fs;
use std::path::Path;

/// All Rust sources of the project, and the names of their files.
fn sources(directory: &Path, text: &mut String, files: &mut Vec<String>) {
    for entry in fs::read_dir(directory).expect("a directory").flatten() {
        let path = entry.path();
        let name = entry.file_name().to_string_lossy().into_owned();
        if path.is_dir() && name != "target" && !name.starts_with('.') {
            sources(&path, text, files);
        } else if let Some(stem) = name.strip_suffix(".rs") {
            files.push(stem.to_owned());
            text.push_str(&fs::read_to_string(&path).expect("a source"));
        }
    }
}

/// True of a file of tests, named by its program and itself.
fn is_module(name: &str) -> bool {
    name.contains("::") && root().join("tests/tests").join(name.replace("::", "/") + ".rs").is_file()
}

#[test]
fn every_test_that_the_safety_document_names_is_there() {
    let (mut text, mut files) = (String::new(), Vec::new());
    sources(&root(), &mut text, &mut files);
    let document = fs::read_to_string(root().join("SAFETY.md")).expect("SAFETY.md");
    let rows: Vec<&str> = document.lines().filter(|line| line.starts_with("| ")).skip(1).collect();
    assert!(rows.len() > 15);
    for row in rows {
        let shown_by = row.trim_end_matches(" |").rsplit(" | ").next().expect("a last column");
        let names: Vec<&str> = shown_by.split('`').skip(1).step_by(2).collect();
        assert!(!names.is_empty(), "nothing shows: {row}");
        for name in names {
            let is_there = text.contains(&format!("fn {name}("))
                || files.iter().any(|file| file == name)
                || is_module(name);
            assert!(is_there, "SAFETY.md names {name}, which is no test and no file of tests");
        }
    }
}
