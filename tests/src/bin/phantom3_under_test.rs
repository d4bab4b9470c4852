//! `phantom3`, for this package's tests.

#![forbid(unsafe_code)]

fn main() -> std::process::ExitCode {
    phantom3::cli::main()
}
