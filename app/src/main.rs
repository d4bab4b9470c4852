//! Haptic rendering for several fingers; see `phantom3 --help`.

#![forbid(unsafe_code)]

fn main() -> std::process::ExitCode {
    phantom3::cli::main()
}
