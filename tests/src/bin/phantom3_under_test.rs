//! `phantom3`, for this package's tests; ended with its test.

#![forbid(unsafe_code)]

fn main() -> std::process::ExitCode {
    system_tests::programs::end_with_the_test();
    phantom3::cli::main()
}
