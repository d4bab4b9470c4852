//! `io-driver`, for this package's tests: with a saboteur around its devices, and ended with its test.

#![forbid(unsafe_code)]

fn main() -> std::process::ExitCode {
    system_tests::programs::end_with_the_test();
    io_driver::cli::main_with(system_tests::faults::saboteur::Saboteur::fit)
}
