//! `jitter`: measures latencies; see `jitter --help`.

#![forbid(unsafe_code)]

fn main() -> std::process::ExitCode {
    system_tests::jitter::cli::main()
}
