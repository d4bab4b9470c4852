//! C programs of the tests, compiled with a version of the headers.

use patience::prelude::*;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The headers of today, as a path below the workspace.
pub const HEADERS: &str = "shm-abi/include";

/// Compiles `tests/c/NAME.c` into `directory`; `None` (and a line why) without a C compiler.
pub fn compiled(name: &str, headers: &str, directory: &Path) -> Option<PathBuf> {
    compiled_with(name, headers, directory, &["-pthread"])
}

/// The same as a library to be loaded before all others.
pub fn library(name: &str, directory: &Path) -> Option<PathBuf> {
    compiled_with(name, HEADERS, directory, &["-shared", "-fPIC"])
}

fn compiled_with(name: &str, headers: &str, directory: &Path, options: &[&str]) -> Option<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let program = directory.join(name);
    let named = std::env::var("CC").unwrap_or_else(|_| "cc".into());
    // "ccache gcc" is a usual value.
    let mut words = named.split_whitespace();
    let mut compiler = Command::new(words.next().expect("CC is empty"));
    compiler.args(words).args(["-std=c11", "-O2", "-Wall", "-Wextra", "-Werror"]).args(options);
    compiler.arg("-I").arg(root.join("..").join(headers));
    compiler.arg(root.join(format!("tests/c/{name}.c"))).arg("-o").arg(&program);
    match compiler.bounded_output() {
        Err(error) => {
            println!("skipped: no C compiler: {named}: {error}");
            None
        }
        Ok(output) => {
            assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
            Some(program)
        }
    }
}
