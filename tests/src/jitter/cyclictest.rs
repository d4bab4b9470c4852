//! The reference that everybody knows: `cyclictest` of the rt-tests, where it is installed.
//!
//! Model: one run of `cyclictest -q -m -aCPU -t1 -pPRIORITY -iPERIOD -DSECONDS -hBINS` for each slice; its
//! histogram is read from its standard output. It knows whole microseconds, rounded down, and so they are taken:
//! that favours it by half a microsecond on average, never us.
//! What it does not tell: when each value came. A slice is one row of the time line, and of its
//! worst events only the greatest is known, with the whole slice as its time.
//! Beyond its last bin it counts without values; those are taken as the last bin's upper end, one of them as the
//! maximum, which it tells exactly.

use rt_core::histogram::Histogram;
use std::fmt;
use std::process::Command;
use thiserror::Error;

/// Bins of a microsecond: anything above is an overflow, which is counted.
pub const BINS_US: u64 = 50_000;

/// What it measured.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Measured {
    /// All values (ns).
    pub histogram: Histogram,
    /// Values beyond its last bin.
    pub overflows: u64,
}

/// Its output is not what its manual shows.
#[derive(Debug, Error, PartialEq, Eq)]
pub enum ParseError {
    /// A line of the histogram is no pair of numbers.
    #[error("line {line} of cyclictest's output is {found:?}, expected two numbers, a latency and a count")]
    BadLine {
        /// Number of the line, from 1.
        line: usize,
        /// What it says.
        found: String,
    },
    /// There is no histogram at all.
    #[error("cyclictest printed no histogram; its output began with {found:?}")]
    NoHistogram {
        /// The first line.
        found: String,
    },
    /// The total is not that of the bins.
    #[error("cyclictest says that it counted {said}, its bins and overflows hold {held}")]
    WrongTotal {
        /// What it says.
        said: u64,
        /// What the bins and overflows hold.
        held: u64,
    },
    /// Something that must be there is not.
    #[error("cyclictest's output has no line {key:?}: it was cut")]
    Missing {
        /// What the line begins with.
        key: &'static str,
    },
}

/// Reads its standard output.
///
/// # Errors
/// If the output is cut, contradicts itself, or is another program's.
pub fn parse(text: &str) -> Result<Measured, ParseError> {
    let mut histogram = Histogram::new();
    let mut held = 0;
    let is_bin = |line: &str| line.starts_with(|c: char| c.is_ascii_digit());
    for (index, line) in text.lines().enumerate().filter(|(_, line)| is_bin(line)) {
        let bad = || ParseError::BadLine { line: index + 1, found: line.chars().take(80).collect() };
        let mut words = line.split_whitespace().map(str::parse::<u64>);
        let (Some(Ok(us)), Some(Ok(count)), None) = (words.next(), words.next(), words.next()) else {
            return Err(bad());
        };
        let ns = us.checked_mul(1000).ok_or_else(bad)?;
        held += count;
        record_many(&mut histogram, ns, count);
    }
    if !text.lines().any(is_bin) {
        let found = text.lines().next().unwrap_or("").chars().take(80).collect();
        return Err(ParseError::NoHistogram { found });
    }
    let value = |key: &'static str| {
        let line = text.lines().find_map(|line| line.strip_prefix(key));
        line.and_then(|rest| rest.trim().parse::<u64>().ok()).ok_or(ParseError::Missing { key })
    };
    let (said, max_us) = (value("# Total:")?, value("# Max Latencies:")?);
    let overflows = value("# Histogram Overflows:")?;
    // "Total" counts the bins alone.
    if said != held {
        return Err(ParseError::WrongTotal { said, held });
    }
    let last_bin_ns = text.lines().filter(|line| is_bin(line)).count() as u64 * 1000;
    record_many(&mut histogram, last_bin_ns, overflows.saturating_sub(1));
    if overflows > 0 {
        histogram.record(max_us.saturating_mul(1000));
    }
    Ok(Measured { histogram, overflows })
}

fn record_many(histogram: &mut Histogram, ns: u64, count: u64) {
    if count == 0 {
        return;
    }
    let mut counts = [0; rt_core::histogram::BUCKETS];
    counts[rt_core::histogram::bucket_of(ns)] = count;
    histogram.merge(&Histogram::from_counts(&counts, ns));
}

/// How it is called.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Call {
    /// Time between wake-ups.
    pub period_us: u64,
    /// SCHED_FIFO priority; `None`: an ordinary thread.
    pub priority: Option<u8>,
    /// CPU.
    pub cpu: Option<usize>,
}

impl Call {
    /// Its arguments for so many seconds.
    pub fn arguments(&self, seconds: u64) -> Vec<String> {
        self.with(&[format!("-D{seconds}"), format!("-h{BINS_US}")])
    }

    fn with(&self, rest: &[String]) -> Vec<String> {
        let mut all: Vec<String> = ["-q", "-t1"].map(str::to_owned).to_vec();
        all.extend(self.cpu.map(|cpu| format!("-a{cpu}")));
        // Locked memory needs the same rights as a priority, more or less; without them it would refuse to run.
        if let Some(priority) = self.priority {
            all.extend(["-m".to_owned(), format!("-p{priority}")]);
        }
        all.push(format!("-i{}", self.period_us));
        all.extend(rest.iter().cloned());
        all
    }

    /// Whether it is installed and runs with these arguments; ten cycles. The error says why not.
    ///
    /// # Errors
    /// What it said, or that it is not installed.
    pub fn try_out(&self) -> Result<(), String> {
        let arguments = self.with(&["-l10".into(), "-h10".into()]);
        let output =
            Command::new("cyclictest").args(&arguments).output().map_err(|error| match error.kind() {
                std::io::ErrorKind::NotFound => "cyclictest is not installed (Debian: rt-tests)".to_owned(),
                _ => format!("cyclictest does not start: {error}"),
            })?;
        if output.status.success() && parse(&String::from_utf8_lossy(&output.stdout)).is_ok() {
            return Ok(());
        }
        let said = String::from_utf8_lossy(&[output.stderr, output.stdout].concat()).into_owned();
        let said = said.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with('#'));
        Err(format!(
            "cyclictest refuses to run ({}): {}",
            output.status,
            said.take(3).collect::<Vec<_>>().join(" ")
        ))
    }
}

impl fmt::Display for Call {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "cyclictest {}", self.with(&["-D..".into(), format!("-h{BINS_US}")]).join(" "))
    }
}

/// Its version, for the record.
pub fn version() -> Option<String> {
    let output = Command::new("cyclictest").arg("--help").output().ok()?;
    let said = [output.stdout, output.stderr].concat();
    String::from_utf8_lossy(&said)
        .lines()
        .next()
        .map(|line| line.trim().to_owned())
        .filter(|line| line.contains('V'))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::jitter::percentiles::Percentiles;

    /// cyclictest 2.40, `-q -m -a1 -t1 -p80 -i1000 -D2 -h100`, empty bins left out here and there.
    const RECORDED: &str = include_str!("../../recorded/cyclictest-2.40.txt");

    #[test]
    fn a_recorded_run_is_read_with_its_overflows() {
        let measured = parse(RECORDED).unwrap();
        let found = Percentiles::of(&measured.histogram);
        assert_eq!((found.count, measured.overflows), (1905 + 5, 5));
        // Half of 1910 lie at 20 us and below: 363 + 325 + 190 + 55 + ... reach 1232 there.
        assert_eq!(
            found.p50,
            20_000.max(rt_core::histogram::bucket_upper(rt_core::histogram::bucket_of(20_000)))
        );
        assert_eq!(found.max, 32_266_000);
        assert!(found.p999 >= 100_000, "five overflows of 1910 are more than a thousandth");
    }

    #[test]
    fn output_that_was_cut_or_is_another_programs_is_refused() {
        let cut = RECORDED.split("# Max").next().unwrap();
        assert_eq!(parse(cut), Err(ParseError::Missing { key: "# Max Latencies:" }));
        assert!(matches!(parse("Unable to change\n"), Err(ParseError::NoHistogram { .. })));
        let broken = RECORDED.replace("000020 000296", "000020 many");
        assert!(matches!(parse(&broken), Err(ParseError::BadLine { line: 23, .. })), "{:?}", parse(&broken));
        let short = RECORDED.replace("000020 000296", "000020 000295");
        assert_eq!(parse(&short), Err(ParseError::WrongTotal { said: 1905, held: 1904 }));
    }

    #[test]
    fn a_run_without_overflows_has_its_greatest_bin_as_maximum() {
        let text = "# Histogram\n000000 000001\n000001 000003\n# Total: 000000004\n# Min Latencies: 00000\n# Avg Latencies: 00001\n# Max Latencies: 00001\n# Histogram Overflows: 00000\n";
        let measured = parse(text).unwrap();
        assert_eq!((measured.histogram.count(), measured.histogram.max()), (4, 1000));
    }

    #[test]
    fn without_a_priority_no_rights_are_asked_for() {
        let call = Call { period_us: 250, priority: None, cpu: Some(3) };
        assert_eq!(call.arguments(7).join(" "), "-q -t1 -a3 -i250 -D7 -h50000");
        let call = Call { priority: Some(80), ..call };
        assert_eq!(call.arguments(7).join(" "), "-q -t1 -a3 -m -p80 -i250 -D7 -h50000");
    }
}
