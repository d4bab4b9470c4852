//! `io-driver`, for this package's tests, which may ask for an intruder in it.

#![forbid(unsafe_code)]

fn main() -> std::process::ExitCode {
    system_tests::intruder::start_if_asked();
    io_driver::cli::main()
}
