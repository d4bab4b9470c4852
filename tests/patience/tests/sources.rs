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

/// Waits in time that loom invents.
const OTHERS: [&str; 1] = ["shm-abi/tests/loom_protocol.rs"];

/// A program for laboratories, whose user sees what it waits for: of its sources the unit tests count.
const PROGRAMS: [&str; 1] = ["tests/src/jitter"];

/// What a loop does that looks again and again.
const PAUSES: [&str; 4] = ["yield_now(", "sleep(", "spin_loop(", "park("];

/// What a loop asks that ends in time: a clock, or the flag that whoever waits for this thread raises.
const ENDS: [&str; 4] = ["elapsed()", "Instant::now()", "monotonic_ns()", "stop.load("];

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
    let polls = endless_polls(&text, first);
    let polls =
        polls.map(|line| format!("{}:{line}: a loop\n    instead: until, or watched", file.display()));
    let lines = text.lines().enumerate().skip(first).filter_map(|(number, line)| {
        let code = line.trim();
        // A type's own method that joins with a limit, and a clock, which comes to its next tick by itself.
        let line = line.replace("self.join()", "").replace("waiter.wait()", "");
        let (_, instead) = ENDLESS.iter().find(|(pattern, _)| line.contains(pattern))?;
        Some(format!("{}:{}: {code}\n    instead: {instead}", file.display(), number + 1))
    });
    lines.chain(polls).collect()
}

/// Numbers of the lines that begin a loop which looks again and again, has no end in time and is not watched.
fn endless_polls(text: &str, first: usize) -> impl Iterator<Item = usize> {
    let lines: Vec<&str> = text.lines().collect();
    let has = |block: &[&str], words: &[&str]| {
        block.iter().any(|line| words.iter().any(|word| line.contains(word)))
    };
    let is_endless = move |begin: &usize| {
        let body = block(&lines, *begin);
        let function = (0..*begin)
            .rev()
            .find(|line| is_function(lines[*line]) && indentation(lines[*line]) < indentation(lines[*begin]));
        let is_watched = function.is_some_and(|line| has(block(&lines, line), &["watched("]));
        is_loop(lines[*begin]) && has(body, &PAUSES) && !has(body, &ENDS) && !is_watched
    };
    (first..text.lines().count()).filter(is_endless).map(|line| line + 1).collect::<Vec<_>>().into_iter()
}

/// From a line to the one that closes what it opens, as the sources are formatted.
fn block<'a>(lines: &'a [&'a str], begin: usize) -> &'a [&'a str] {
    if lines[begin].trim_end().ends_with('}') {
        return &lines[begin..=begin];
    }
    let closes =
        |line: &&str| line.trim_start().starts_with('}') && indentation(line) == indentation(lines[begin]);
    let length = lines[begin + 1..].iter().position(closes).unwrap_or(0);
    &lines[begin..=begin + length]
}

fn is_loop(line: &str) -> bool {
    let code = line.trim_start();
    // After a label.
    let code = code.strip_prefix('\'').and_then(|code| code.split_once(": ")).map_or(code, |(_, code)| code);
    code.starts_with("while ") || code.starts_with("loop {")
}

fn is_function(line: &str) -> bool {
    let code = line.trim_start();
    code.starts_with("fn ") || code.starts_with("pub fn ") || code.starts_with("pub(crate) fn ")
}

fn indentation(line: &str) -> usize {
    line.len() - line.trim_start().len()
}

#[test]
fn a_loop_that_polls_without_a_limit_is_found_and_one_with_a_limit_is_none() {
    let found = |text: &str| endless_polls(text, 0).collect::<Vec<_>>();
    let polls = "fn test() {\n    while !is_done() {\n        std::thread::yield_now();\n    }\n}\n";
    assert_eq!(found(polls), [2]);
    assert_eq!(found(&polls.replace("while !is_done()", "'outer: loop")), [2]);
    assert_eq!(found(&polls.replace("yield_now()", "sleep(PAUSE)")), [2]);
    assert_eq!(found(&polls.replace("std::thread::yield_now();", "count += 1;")), []);
    assert_eq!(found(&polls.replace("is_done()", "stop.load(Ordering::Relaxed)")), []);
    assert_eq!(found(&polls.replace("!is_done()", "begun.elapsed() < HANG")), []);
    let watched = "fn test() {\n    watched(limit(), \"it\", || {\n        loop {\n            sleep(PAUSE);\n        }\n    });\n}\n";
    assert_eq!(found(watched), []);
    assert_eq!(found(&watched.replace("watched", "thread")), [3]);
}

/// First line of the tests of a source: the first of all that is there for tests, else that of the module of tests.
fn first_line_of_tests(file: &Path, text: &str) -> usize {
    let is_program = PROGRAMS.iter().any(|program| file.starts_with(program));
    let is_for_tests = file.iter().any(|part| part == "tests") && !is_program
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
