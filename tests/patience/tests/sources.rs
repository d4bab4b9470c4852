//! Tests wait with a limit: nothing in their sources blocks for ever.

use std::fs;
use std::path::{Path, PathBuf};

/// What blocks until something happens, and what to write instead.
const ENDLESS: [(&str, &str); 10] = [
    (".recv()", "bounded_recv"),
    (".join()", "bounded_join"),
    ("JoinHandle::join", "BoundedThread::bounded_join"),
    (".output()", "bounded_output"),
    (".status()", "bounded_status"),
    (".wait_with_output()", "bounded_output"),
    (".wait().unwrap()", "bounded_wait"),
    (".wait().expect(", "bounded_wait"),
    (".accept()", "accepted"),
    ("load(Ordering::Relaxed), None)", "a time limit"),
];

/// The directories of packages: their tests, and the unit tests in their sources.
const PACKAGES: [&str; 12] = [
    "shm-abi",
    "rt-core",
    "io-driver",
    "app",
    "app/calibration",
    "app/haptics",
    "app/physics",
    "app/plot",
    "app/view",
    "app/world",
    "tests/inputs",
    "tests",
];

/// Waits in time that loom invents; a program for laboratories, whose user sees what it waits for.
const OTHERS: [&str; 2] = ["shm-abi/tests/loom_protocol.rs", "tests/src/jitter"];

#[test]
fn no_test_waits_without_a_limit() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(2).unwrap();
    let mut files = Vec::new();
    for package in PACKAGES {
        collect(&root.join(package).join("src"), &mut files);
        let tests = root.join(package).join("tests");
        if tests.exists() {
            collect(&tests, &mut files);
        }
    }
    files.retain(|file| !OTHERS.iter().any(|other| file.starts_with(root.join(other))));
    assert!(files.len() > 600, "the scan found the sources: {}", files.len());
    let found: Vec<String> = files.iter().flat_map(|file| endless_waits(file, root)).collect();
    assert!(found.is_empty(), "waits without a limit; use the crate `patience`:\n{}", found.join("\n"));
}

fn endless_waits(file: &Path, root: &Path) -> Vec<String> {
    let text = fs::read_to_string(file).unwrap();
    let first = first_line_of_tests(file.strip_prefix(root).unwrap(), &text);
    let lines = text.lines().enumerate().skip(first).filter_map(|(number, line)| {
        let code = line.trim();
        // A type's own method that joins with a limit.
        let line = line.replace("self.join()", "");
        let (_, instead) = ENDLESS.iter().find(|(pattern, _)| line.contains(pattern))?;
        Some(format!("{}:{}: {code}\n    instead: {instead}", file.display(), number + 1))
    });
    lines.collect()
}

/// First line of the tests of a source: the first of all that is there for tests, else that of the module of tests.
fn first_line_of_tests(file: &Path, text: &str) -> usize {
    let is_for_tests = file.iter().any(|part| part == "tests")
        || file.file_name().is_some_and(|name| name.to_string_lossy().ends_with("tests.rs"));
    if is_for_tests {
        return 0;
    }
    let lines: Vec<&str> = text.lines().map(str::trim).collect();
    let is_module = |pair: &[&str]| pair[0] == "#[cfg(test)]" && pair[1].ends_with("mod tests {");
    lines.windows(2).position(is_module).unwrap_or(lines.len())
}

fn collect(directory: &Path, files: &mut Vec<PathBuf>) {
    for path in fs::read_dir(directory).unwrap().map(|entry| entry.unwrap().path()) {
        if path.is_dir() {
            collect(&path, files);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            files.push(path);
        }
    }
}
