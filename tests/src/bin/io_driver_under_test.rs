//! `io-driver`, for this package's tests: with a saboteur around its devices, an intruder in it if it is asked
//! for, and ended with its test.

#![forbid(unsafe_code)]

fn main() -> std::process::ExitCode {
    system_tests::programs::end_with_the_test();
    system_tests::intruder::start_if_asked();
    io_driver::cli::main_with(system_tests::faults::saboteur::Saboteur::fit)
}
