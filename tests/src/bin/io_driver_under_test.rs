//! `io-driver`, for this package's tests.

#![forbid(unsafe_code)]

fn main() -> std::process::ExitCode {
    io_driver::cli::main()
}
