//! Tests wait with a limit: nothing in their sources blocks for ever.

use std::fs;
use std::path::{Path, PathBuf};

/// What blocks until something happens, and what to write instead.
const ENDLESS: [(&str, &str); 9] = [
    (".recv()", "bounded_recv"),
    (".join()", "bounded_join"),
    ("JoinHandle::join", "BoundedThread::bounded_join"),
    (".output()", "bounded_output"),
    (".status()", "bounded_status"),
    (".wait_with_output()", "bounded_output"),
    (".wait().unwrap()", "bounded_wait"),
    (".wait().expect(", "bounded_wait"),
    (".accept()", "accepted"),
];

/// The directories of tests, and what they are helped by.
const PARTS: [&str; 13] = [
    "shm-abi/tests",
    "rt-core/tests",
    "io-driver/tests",
    "app/tests",
    "app/calibration/tests",
    "app/haptics/tests",
    "app/physics/tests",
    "app/plot/tests",
    "app/view/tests",
    "app/world/tests",
    "tests/inputs",
    "tests/src",
    "tests/tests",
];

/// Waits in time that loom invents; a program for laboratories, whose user sees what it waits for.
const OTHERS: [&str; 2] = ["shm-abi/tests/loom_protocol.rs", "tests/src/jitter"];

#[test]
fn no_test_waits_without_a_limit() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(2).unwrap();
    let mut files = Vec::new();
    PARTS.iter().for_each(|part| collect(&root.join(part), &mut files));
    files.retain(|file| !OTHERS.iter().any(|other| file.starts_with(root.join(other))));
    assert!(files.len() > 200, "the scan found the tests: {}", files.len());
    let found: Vec<String> = files.iter().flat_map(|file| endless_waits(file)).collect();
    assert!(found.is_empty(), "waits without a limit; use the crate `patience`:\n{}", found.join("\n"));
}

fn endless_waits(file: &Path) -> Vec<String> {
    let text = fs::read_to_string(file).unwrap();
    let lines = text.lines().enumerate().filter_map(|(number, line)| {
        let code = line.trim();
        // A type's own method that joins with a limit.
        let line = line.replace("self.join()", "");
        let (_, instead) = ENDLESS.iter().find(|(pattern, _)| line.contains(pattern))?;
        Some(format!("{}:{}: {code}\n    instead: {instead}", file.display(), number + 1))
    });
    lines.collect()
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
