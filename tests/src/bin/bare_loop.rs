//! The bare reference loop as a process, for this package's tests.

#![forbid(unsafe_code)]

fn main() -> std::process::ExitCode {
    system_tests::bare_loop::main()
}
