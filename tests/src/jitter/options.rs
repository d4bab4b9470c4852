//! The command line.

use clap::builder::{OsStringValueParser, RangedU64ValueParser, TypedValueParser};
use clap::{Args, Parser, Subcommand, ValueEnum};
use std::path::PathBuf;
use std::time::Duration;

const AFTER_HELP: &str = "\
Without options: 5 interleaved runs of 4 s each of the hybrid wait alone, of the reference (cyclictest where it is \
installed, else a plain sleep) and of the real driver with the real application; about a minute. With --duration \
that time is shared by all styles, in five runs or more if it is long enough; what comes of it is said before anything \
is measured. Results go to \
jitter-YYYYMMDD-HHMMSS (UTC): result.json (everything), runs.csv, timeline.csv, worst.csv, histogram, tail and \
timeline as SVG and PNG.

Examples:
  jitter --slice 10 --gate config/jitter/gate.toml        is the hybrid wait as good as it should be?
  jitter --load memory,disk,fork,loopback --out loaded    the same under load
  jitter --duration 5d --out five-days                    slices of a minute, saved every minute
  jitter --attach                                         look on at the driver that runs, without disturbing it
  jitter compare before/result.json after/result.json     which change helped?

Exit status: 0 done (gate passed); 1 the gate was not passed; 2 bad usage or input, nothing was measured; \
3 a fault, what was measured is written; 128 + n: signal n ended it early, what was measured is written.";

/// Measures how late real-time loops are: bare ones, a reference, and the driver with its application.
#[derive(Debug, Parser)]
#[command(name = "jitter", version, after_help = AFTER_HELP, args_conflicts_with_subcommands = true)]
pub struct Options {
    /// Measure, unless another command is given.
    #[command(flatten)]
    pub measure: Measure,
    /// What else.
    #[command(subcommand)]
    pub command: Option<Command>,
}

/// What can be done besides measuring.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Compare two results: which change helped?
    Compare(Compare),
    /// Make table, CSV and charts of a result anew, for instance after a crash
    Report(Report),
    /// Judge a result that is there by a gate
    Judge(Judge),
}

/// Options of a measurement.
#[derive(Debug, Args)]
pub struct Measure {
    /// Interleaved runs: how often each style has its turn [default: 5]
    #[arg(long, value_name = "N", value_parser = RangedU64ValueParser::<usize>::new().range(1..=10_000), conflicts_with = "duration")]
    pub runs: Option<usize>,
    /// Length of a turn in seconds [default: 4; with --duration from 1 on, from 1h on 60]; whole seconds where the reference takes part
    #[arg(long, value_name = "S", value_parser = parse_slice)]
    pub slice: Option<f64>,
    /// How long altogether, all styles with their warm-up, instead of --runs: 90s, 30m, 12h, 5d
    #[arg(long, value_name = "TIME", value_parser = parse_duration)]
    pub duration: Option<Duration>,
    /// What takes turns: hybrid, reference, driver
    #[arg(
        long,
        value_name = "LIST",
        value_delimiter = ',',
        default_value = "hybrid,reference,driver",
        conflicts_with = "attach"
    )]
    pub styles: Vec<String>,
    /// What the reference is
    #[arg(long, value_enum, default_value_t = ReferenceChoice::Auto, conflicts_with = "attach")]
    pub reference: ReferenceChoice,
    /// Look on at a driver that runs already, at this socket or the usual place; nothing else is started
    #[arg(long, value_name = "SOCKET", num_args = 0..=1, default_missing_value = "", value_parser = path_or_nothing(), conflicts_with_all = ["load", "gate", "config", "scene", "rate_hz", "cpu", "priority", "phase_us", "spin_margin_us"])]
    pub attach: Option<PathBuf>,
    /// Driver configuration (TOML) [default: two ideal devices that follow the default scene's hand]
    #[arg(long, value_name = "FILE", conflicts_with = "rate_hz")]
    pub config: Option<PathBuf>,
    /// Scene of the application (TOML) [default: the default scene]
    #[arg(long, value_name = "FILE")]
    pub scene: Option<PathBuf>,
    /// Ticks per second [default: 1000]
    #[arg(long, value_name = "HZ")]
    pub rate_hz: Option<f64>,
    /// CPU of the measured loop [default: the configuration's, else the last one]
    #[arg(long, value_name = "N")]
    pub cpu: Option<usize>,
    /// SCHED_FIFO priority of the measured loop, 0: none [default: the configuration's, else 80]
    #[arg(long, value_name = "P", value_parser = clap::value_parser!(u8).range(0..=98))]
    pub priority: Option<u8>,
    /// Phase of the deadlines against whole milliseconds, in microseconds [default: the configuration's, else 370]
    #[arg(long, value_name = "US")]
    pub phase_us: Option<u64>,
    /// How long before the deadline sleeping turns into spinning, in microseconds [default: the configuration's, else 150]
    #[arg(long, value_name = "US")]
    pub spin_margin_us: Option<u64>,
    /// Load the machine meanwhile: memory, disk, fork, loopback
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    pub load: Vec<String>,
    /// Processes of each kind of load
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = RangedU64ValueParser::<usize>::new().range(1..=64))]
    pub load_workers: usize,
    /// How many of the worst events of each series to keep with their circumstances
    #[arg(long, value_name = "N", default_value_t = 20, value_parser = RangedU64ValueParser::<usize>::new().range(0..=1000))]
    pub worst: usize,
    /// Judge by these limits at the end; at least 5 runs
    #[arg(long, value_name = "FILE")]
    pub gate: Option<PathBuf>,
    /// Directory of the results [default: jitter-YYYYMMDD-HHMMSS]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Between two looks at the frames and at the kernel's counters: finer circumstances, more disturbance
    #[arg(long, value_name = "MS", default_value_t = 50, value_parser = clap::value_parser!(u64).range(5..=200))]
    pub poll_ms: u64,
    /// Write the results so far every so many seconds
    #[arg(long, value_name = "S", default_value_t = 60, value_parser = clap::value_parser!(u64).range(1..=86_400))]
    pub save_every: u64,
    /// Say nothing but errors while measuring, and print no table
    #[arg(long)]
    pub quiet: bool,
}

/// What the reference is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ReferenceChoice {
    /// cyclictest if it is installed, else a plain sleep
    Auto,
    /// cyclictest (Debian: rt-tests)
    Cyclictest,
    /// clock_nanosleep to absolute deadlines, our own
    Sleep,
}

/// Two results.
#[derive(Debug, Args)]
pub struct Compare {
    /// Before
    pub a: PathBuf,
    /// After
    pub b: PathBuf,
    /// Write the overlaid charts here, as STEM.svg and STEM.png [default: comparison]
    #[arg(long, value_name = "STEM")]
    pub out: Option<PathBuf>,
    /// Make no chart
    #[arg(long, conflicts_with = "out")]
    pub no_chart: bool,
}

/// One result.
#[derive(Debug, Args)]
pub struct Report {
    /// The result
    pub result: PathBuf,
    /// Directory of CSV and charts [default: that of the result]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
}

/// A gate and a result.
#[derive(Debug, Args)]
pub struct Judge {
    /// The gate (TOML)
    pub gate: PathBuf,
    /// The result
    pub result: PathBuf,
}

/// Clap's own paths are never empty, not even by default.
fn path_or_nothing() -> impl TypedValueParser<Value = PathBuf> {
    OsStringValueParser::new().map(PathBuf::from)
}

fn parse_slice(text: &str) -> Result<f64, String> {
    let seconds: f64 = text.parse().map_err(|_| "expected a number of seconds".to_owned())?;
    if (0.1..=80_000.0).contains(&seconds) { Ok(seconds) } else { Err("allowed are 0.1 to 80000 s".into()) }
}

fn parse_duration(text: &str) -> Result<Duration, String> {
    let expected = || "expected a number with s, m, h or d behind it, such as 90s or 5d".to_owned();
    let unit = text.chars().last().ok_or_else(expected)?;
    let factor = match unit {
        's' => 1.0,
        'm' => 60.0,
        'h' => 3600.0,
        'd' => 86_400.0,
        _ => return Err(expected()),
    };
    let number: f64 = text[..text.len() - 1].parse().map_err(|_| expected())?;
    let seconds = number * factor;
    if (1.0..=366.0 * 86_400.0).contains(&seconds) {
        Ok(Duration::from_secs_f64(seconds))
    } else {
        Err("allowed are 1s to 366d".into())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_consistent() {
        Options::command().debug_assert();
    }

    #[test]
    fn times_are_read_with_their_unit_and_only_so() {
        assert_eq!(parse_duration("5d"), Ok(Duration::from_secs(432_000)));
        assert_eq!(parse_duration("1.5m"), Ok(Duration::from_secs(90)));
        for wrong in ["", "5", "d", "5y", "0s", "1e9d", "-3h", "5µ"] {
            assert!(parse_duration(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn the_socket_to_look_on_at_may_be_left_out() {
        for (words, socket) in
            [(&["--attach"][..], ""), (&["--attach", "--quiet"], ""), (&["--attach", "x.sock"], "x.sock")]
        {
            let options = Options::try_parse_from([&["jitter"], words].concat()).expect("as --help says");
            assert_eq!(options.measure.attach, Some(PathBuf::from(socket)), "{words:?}");
        }
    }

    #[test]
    fn looking_on_excludes_whatever_would_disturb() {
        for disturbing in [["--load", "memory"], ["--styles", "hybrid"], ["--priority", "80"]] {
            let words = ["jitter", "--attach", "x.sock"].into_iter().chain(disturbing);
            assert!(Options::try_parse_from(words).is_err(), "{disturbing:?}");
        }
    }
}
