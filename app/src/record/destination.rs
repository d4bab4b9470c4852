//! Destination of a recording: its file's ending names the format, `-` is the standard output.
//!
//! Model: a name that ends in nothing known is refused before anything runs, since people find a table where they wanted
//! something else only after the experiment. What is there already and is no regular file (a pipe, a device) has
//! no need of an ending: it takes a table. A file that a shell leads a standard stream into is known by its device and inode.

use rustix::fs::{FileType, fstat};
use std::ffi::OsStr;
use std::io;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// What stands for the standard output.
pub const STANDARD_OUTPUT: &str = "-";

/// A link that leads to so many others leads nowhere.
const MOST_LINKS: u32 = 40;

/// Format of a file with the ticks of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RunFormat {
    /// A table.
    Csv,
    /// The table, and all that replays and shows the run.
    Mcap,
}

/// Format of a file with events alone.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EventFormat {
    /// A JSON object for each line.
    JsonLines,
    /// A table.
    Csv,
}

/// Format of a table for other tools.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TableFormat {
    /// Text.
    Csv,
    /// Columns.
    Parquet,
}

/// Why a name says no format.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum FormatError {
    /// Nothing is known by this ending.
    #[error("{file} has {found}; allowed: {allowed}")]
    Unknown {
        /// The file.
        file: PathBuf,
        /// Its ending, in words.
        found: String,
        /// The endings that are known.
        allowed: &'static str,
    },
    /// A run that is cut short would leave nothing.
    #[error(
        "{file}: a Parquet file cannot be read before its end is written, so that a run which is cut short would leave \
         nothing; record {mcap}, and then `phantom3 export {mcap} {file}`"
    )]
    ParquetOfRun {
        /// The file.
        file: PathBuf,
        /// The same as MCAP.
        mcap: PathBuf,
    },
}

const RUN_ENDINGS: &str =
    ".csv (a table), .mcap (all that replays and shows the run), - (CSV on the standard output)";
const EVENT_ENDINGS: &str =
    ".jsonl, .ndjson or .json (a JSON object for each line), .csv (a table), - (JSON on the standard output)";
const TABLE_ENDINGS: &str = ".csv, .parquet, - (CSV on the standard output)";

impl RunFormat {
    /// What a run is recorded as in this file.
    ///
    /// # Errors
    /// An ending that is not known.
    pub fn of(file: &Path) -> Result<Self, FormatError> {
        match ending(file).as_deref() {
            None | Some("csv") => Ok(Self::Csv),
            Some("mcap") => Ok(Self::Mcap),
            Some("parquet") => {
                Err(FormatError::ParquetOfRun { file: file.into(), mcap: file.with_extension("mcap") })
            }
            Some(_) => Err(unknown(file, RUN_ENDINGS)),
        }
    }
}

impl EventFormat {
    /// What events are written as in this file.
    ///
    /// # Errors
    /// An ending that is not known.
    pub fn of(file: &Path) -> Result<Self, FormatError> {
        match ending(file).as_deref() {
            None | Some("jsonl" | "ndjson" | "json") => Ok(Self::JsonLines),
            Some("csv") => Ok(Self::Csv),
            Some(_) => Err(unknown(file, EVENT_ENDINGS)),
        }
    }
}

impl TableFormat {
    /// What a recording is exported as into this file.
    ///
    /// # Errors
    /// An ending that is not known.
    pub fn of(file: &Path) -> Result<Self, FormatError> {
        match ending(file).as_deref() {
            None | Some("csv") => Ok(Self::Csv),
            Some("parquet") => Ok(Self::Parquet),
            Some(_) => Err(unknown(file, TABLE_ENDINGS)),
        }
    }
}

/// Whether this stands for the standard output.
pub fn is_standard_output(file: &Path) -> bool {
    file == Path::new(STANDARD_OUTPUT)
}

/// A standard stream of this process that a shell may have led into a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stream {
    /// Standard input.
    Input,
    /// Standard output, for a table or a report.
    Output,
    /// Standard error, for words meanwhile.
    Error,
}

impl Stream {
    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Input => "the standard input",
            Self::Output => "the standard output",
            Self::Error => "standard error",
        }
    }

    /// The first that is this regular file, by whichever name.
    pub fn that_is(file: &Path) -> Option<Self> {
        [Self::Output, Self::Error, Self::Input].into_iter().find(|stream| stream.is(file))
    }

    /// True if it is this regular file.
    pub fn is(self, file: &Path) -> bool {
        let named = file.metadata().ok().map(|file| (file.dev(), file.ino()));
        named.is_some() && named == self.identity()
    }

    /// True if both are one regular file.
    pub fn is_also(self, other: Self) -> bool {
        self.identity().is_some_and(|identity| other.identity() == Some(identity))
    }

    /// Device and inode, if it is a regular file.
    fn identity(self) -> Option<(u64, u64)> {
        let found = match self {
            Self::Input => fstat(io::stdin()),
            Self::Output => fstat(io::stdout()),
            Self::Error => fstat(io::stderr()),
        };
        let found = found.ok()?;
        (FileType::from_raw_mode(found.st_mode) == FileType::RegularFile)
            .then_some((found.st_dev, found.st_ino))
    }
}

/// Whether both names lead to the same bytes, by links of either kind.
pub fn is_same_file(a: &Path, b: &Path) -> bool {
    let identity = |path: &Path| path.metadata().map(|file| (file.dev(), file.ino()));
    matches!((identity(a), identity(b)), (Ok(a), Ok(b)) if a == b)
}

/// Whether what is written there replaces the other: the same file, or one that would be.
pub fn is_same_place(a: &Path, b: &Path) -> bool {
    match [a, b].map(is_standard_output) {
        [true, true] => true,
        [false, false] => is_same_file(a, b) || is_one_name(&place_of(a), &place_of(b)),
        _ => false,
    }
}

/// True for one name in one directory, which has two itself where it is mounted twice. Of what is there already
/// the file tells.
fn is_one_name(a: &Path, b: &Path) -> bool {
    let is_free = || !a.exists() && !b.exists();
    let is_one_directory = || matches!((a.parent(), b.parent()), (Some(a), Some(b)) if is_same_file(a, b));
    a == b || a.file_name() == b.file_name() && is_free() && is_one_directory()
}

/// Place at which a file of this name is, or would be made: at the end of all links, also of one that leads to nothing yet.
pub fn place_of(path: &Path) -> PathBuf {
    let mut place = path.to_path_buf();
    for _ in 0..MOST_LINKS {
        let Ok(target) = place.read_link() else { break };
        place = place.parent().unwrap_or(Path::new("")).join(target);
    }
    let place = std::path::absolute(&place).unwrap_or(place);
    let whole = place.canonicalize().ok();
    let beside = || Some(place.parent()?.canonicalize().ok()?.join(place.file_name()?));
    whole.or_else(beside).unwrap_or(place)
}

/// What people are told of where it goes.
pub fn shown(file: &Path) -> PathBuf {
    if is_standard_output(file) { "the standard output".into() } else { file.into() }
}

/// In lower case, empty without one; `None`: a stream, which needs none.
fn ending(file: &Path) -> Option<String> {
    let is_stream = |found: std::fs::Metadata| !found.is_file() && !found.is_dir();
    let ending = file.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    let is_stream = is_standard_output(file) || ending.is_empty() && file.metadata().is_ok_and(is_stream);
    (!is_stream).then_some(ending)
}

fn unknown(file: &Path, allowed: &'static str) -> FormatError {
    let found = match file.extension().and_then(OsStr::to_str) {
        Some(ending) => format!("the ending .{ending}"),
        None => "no ending that names a format".into(),
    };
    FormatError::Unknown { file: file.into(), found, allowed }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ending_names_the_format_in_either_case() {
        let run = |name: &str| RunFormat::of(Path::new(name));
        assert_eq!(
            [run("a/b.csv"), run("b.CSV"), run("-")],
            [Ok(RunFormat::Csv), Ok(RunFormat::Csv), Ok(RunFormat::Csv)]
        );
        assert_eq!([run("x.y.mcap"), run("é.MCAP")], [Ok(RunFormat::Mcap), Ok(RunFormat::Mcap)]);
        let events = |name: &str| EventFormat::of(Path::new(name));
        assert_eq!(
            [events("e.jsonl"), events("-")],
            [Ok(EventFormat::JsonLines), Ok(EventFormat::JsonLines)]
        );
        assert_eq!(events("e.csv"), Ok(EventFormat::Csv));
        let table = |name: &str| TableFormat::of(Path::new(name));
        assert_eq!([table("t.csv"), table("-")], [Ok(TableFormat::Csv), Ok(TableFormat::Csv)]);
        assert_eq!(table("t.Parquet"), Ok(TableFormat::Parquet));
    }

    #[test]
    fn every_other_ending_is_refused_with_those_that_are_known() {
        for name in ["out.xyz", "out", "out.", ".csv", "out.csv.gz", "dir/"] {
            let said = RunFormat::of(Path::new(name)).expect_err(name).to_string();
            assert!(said.contains(".csv (a table), .mcap") && said.contains(name), "{said}");
        }
        assert!(EventFormat::of(Path::new("e.mcap")).is_err());
        assert!(TableFormat::of(Path::new("t.mcap")).is_err());
        let said = RunFormat::of(Path::new("a/out.parquet")).expect_err("no end, no file").to_string();
        assert!(
            said.ends_with("record a/out.mcap, and then `phantom3 export a/out.mcap a/out.parquet`"),
            "{said}"
        );
    }

    #[test]
    fn a_device_takes_a_table_whatever_it_is_called() {
        assert_eq!(RunFormat::of(Path::new("/dev/null")), Ok(RunFormat::Csv));
        assert_eq!(TableFormat::of(Path::new("/dev/full")), Ok(TableFormat::Csv));
    }
}
