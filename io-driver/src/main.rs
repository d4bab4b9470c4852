//! The haptic driver; see `io-driver --help`.

#![forbid(unsafe_code)]

fn main() -> std::process::ExitCode {
    io_driver::cli::main()
}
