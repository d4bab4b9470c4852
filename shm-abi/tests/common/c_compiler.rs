//! The C compiler, where there is one.

use super::c_header::{CHeader, directory_of};
use super::golden::is_real_in_disguise;
use patience::prelude::*;
use std::path::{Path, PathBuf};
use std::process::Command;

const FLAGS: [&str; 6] = ["-std=c11", "-Wall", "-Wextra", "-Werror", "-O2", "-pedantic"];

/// `$CC`, or the linker driver that Rust itself needs; `None` (and a line why) if it does not run.
pub(crate) fn compiler() -> Option<Command> {
    let named = std::env::var("CC").unwrap_or_else(|_| "cc".into());
    // "ccache gcc" is a usual value.
    let mut words = named.split_whitespace();
    let program = words.next().expect("CC is empty");
    let words: Vec<&str> = words.collect();
    if let Err(error) = Command::new(program).args(&words).arg("--version").bounded_output() {
        println!("skipped: no C compiler: {named}: {error}");
        return None;
    }
    let mut compiler = Command::new(program);
    compiler.args(words);
    Some(compiler)
}

/// `tests/c_reader.c` with the headers of a version; `None` without a compiler.
pub(crate) fn reader_of(version: &str, into: &Path) -> Option<PathBuf> {
    let mut compiler = compiler()?;
    let header = CHeader::of(version);
    for structure in ["PhantomFrame", "PhantomDriverHeader", "PhantomDeviceDescription", "PhantomCounters"] {
        let lines = header.leaves(structure).into_iter().map(|leaf| {
            let kind = if is_real_in_disguise(structure, &leaf.path) { "bits" } else { &leaf.c_type };
            format!("FIELD({kind}, \"{0}\", {0})\n", leaf.path)
        });
        std::fs::write(into.join(format!("{structure}.inc")), lines.collect::<String>()).unwrap();
    }
    let program = into.join(format!("reader-{version}"));
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/c_reader.c");
    compiler.args(FLAGS).arg("-I").arg(directory_of(version)).arg("-I").arg(into);
    let compiled = compiler.arg(source).arg("-o").arg(&program).bounded_output().unwrap();
    assert!(compiled.status.success(), "{}", String::from_utf8_lossy(&compiled.stderr));
    Some(program)
}
