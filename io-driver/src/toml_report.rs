//! Reads a TOML file and says of every mistake where it is and what would be right.
//!
//! Problem: a description file is written by hand in a laboratory. A report has to name file,
//! line and key, what was found there and what is allowed, or somebody searches for an hour.
//! Model: serde checks names and types, the caller the values; every value that can be wrong is a
//! [`Spanned`], whose byte offset leads back to line and key.
//! Invariants: unknown keys are refused if the types say `deny_unknown_fields`; no text panics.
//! Cost: start-up only; a report parses the text a second time to find the key.

use std::fmt::{self, Display};
use std::ops::{Range, RangeInclusive};
use std::path::{Path, PathBuf};

use rt_core::likeness::nearest;
use rt_core::toml_slips;
use rt_core::type_words::type_in_words;
use serde::de::DeserializeOwned;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// The most a description or a configuration may have: such files have some kilobytes, and whatever is larger is another
/// file. A tree of tables takes up to a kilobyte for two bytes of it.
pub const MAX_TOML_BYTES: u64 = 1 << 16;

/// A list of numbers of which each remembers its place.
pub type SpannedList = Spanned<Vec<Spanned<f64>>>;

/// Characters of a value that are repeated to whoever wrote it.
const MOST_REPEATED: usize = 200;

/// The beginning of a value that is longer than that.
fn shortened(found: &str) -> String {
    match found.char_indices().nth(MOST_REPEATED) {
        Some((end, _)) => format!("{}...", &found[..end]),
        None => found.to_owned(),
    }
}

/// One mistake in a TOML file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TomlReport {
    /// File as the user named it.
    pub file: PathBuf,
    /// Line of the mistake, from 1.
    pub line: usize,
    /// Dotted path of the key, empty where there is none.
    pub key: String,
    /// What was found and what is allowed.
    pub problem: String,
}

/// A TOML text together with the file it came from.
#[derive(Debug, Clone, Copy)]
pub struct TomlText<'a> {
    text: &'a str,
    file: &'a Path,
}

/// What a number may be; both ends belong to it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Allowed {
    /// Smallest value.
    pub min: f64,
    /// Largest value.
    pub max: f64,
    /// Unit as a reader writes it, such as "m".
    pub unit: &'static str,
}

impl Display for TomlReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}: ", self.file.display(), self.line)?;
        if !self.key.is_empty() {
            write!(f, "`{}`: ", self.key)?;
        }
        f.write_str(&self.problem)
    }
}

impl std::error::Error for TomlReport {}

impl Display for Allowed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} to {} {}", self.min, self.max, self.unit)
    }
}

impl<'a> TomlText<'a> {
    /// `file` is only named in reports, never opened.
    pub fn new(text: &'a str, file: &'a Path) -> Self {
        Self { text, file }
    }

    /// The whole text as a `T`.
    ///
    /// # Errors
    /// Reports wrong syntax, wrong types and missing or unknown keys.
    pub fn read<T: DeserializeOwned>(&self) -> Result<T, TomlReport> {
        toml::from_str(self.text).map_err(|error| {
            let start = error.span().map_or(0, |span| span.start);
            let problem = match single_table(error.message(), &key_at(self.text, start)) {
                Some([found, allowed]) => format!("found {found}, allowed: {allowed}"),
                // What is TOML has no such slips: its types or keys are wrong.
                None if DeTable::parse(self.text).is_ok() => in_words(error.message()),
                None => toml_slips::explain(self.text, start, error.message()),
            };
            // What the whole text lacks has an empty place, and is not missing in the key that stands first.
            if error.span().is_none_or(|span| span.is_empty()) && error.message().starts_with("missing field")
            {
                TomlReport { key: String::new(), ..self.report(None, problem) }
            } else {
                self.report(error.span(), problem)
            }
        })
    }

    /// Refuses the value at `span`.
    pub fn refuse(&self, span: Range<usize>, found: impl Display, allowed: impl Display) -> TomlReport {
        let found = shortened(&found.to_string());
        self.report(Some(span), format!("found {found}, allowed: {allowed}"))
    }

    /// A finite number within `allowed`.
    ///
    /// # Errors
    /// Reports a number outside; NaN always is.
    pub fn number(&self, number: &Spanned<f64>, allowed: Allowed) -> Result<f64, TomlReport> {
        let value = *number.get_ref();
        if allowed.min <= value && value <= allowed.max && value.is_finite() {
            Ok(value)
        } else {
            Err(self.refuse(number.span(), value, allowed))
        }
    }

    /// A whole number within `allowed`.
    ///
    /// # Errors
    /// Reports a number outside.
    pub fn integer(&self, number: &Spanned<i64>, allowed: RangeInclusive<i64>) -> Result<i64, TomlReport> {
        let value = *number.get_ref();
        if allowed.contains(&value) {
            Ok(value)
        } else {
            let (min, max) = allowed.into_inner();
            Err(self.refuse(number.span(), value, format_args!("a whole number from {min} to {max}")))
        }
    }

    /// Exactly `N` finite numbers within `allowed`.
    ///
    /// # Errors
    /// Reports another count, or the first number outside.
    pub fn numbers<const N: usize>(
        &self,
        list: &SpannedList,
        allowed: Allowed,
    ) -> Result<[f64; N], TomlReport> {
        let items: &[Spanned<f64>; N] = self.exactly(list)?;
        let mut values = [0.0; N];
        for (value, item) in values.iter_mut().zip(items) {
            *value = self.number(item, allowed)?;
        }
        Ok(values)
    }

    /// Exactly `N` items.
    ///
    /// # Errors
    /// Reports another count. (serde's own arrays would let surplus items pass unseen.)
    pub fn exactly<'b, T, const N: usize>(
        &self,
        list: &'b Spanned<Vec<T>>,
    ) -> Result<&'b [T; N], TomlReport> {
        let items = list.get_ref();
        items.as_slice().try_into().map_err(|_| {
            self.refuse(
                list.span(),
                format_args!("{} values", items.len()),
                format_args!("exactly {N} values"),
            )
        })
    }

    fn report(&self, span: Option<Range<usize>>, problem: String) -> TomlReport {
        let start = span.map_or(0, |span| span.start);
        let key = key_at(self.text, start);
        TomlReport { file: self.file.to_owned(), line: line_at(self.text, start), key, problem }
    }
}

/// serde's message, with the word that was probably meant, or the type that it expected in words instead of Rust's.
fn in_words(message: &str) -> String {
    if let Some(meant) = meant(message) {
        return format!("{message} (did you mean `{meant}`?)");
    }
    let Some((found, expected)) = message.rsplit_once(", expected ") else { return message.to_owned() };
    let Some(words) = type_in_words(expected) else { return message.to_owned() };
    let text = found.strip_prefix("invalid type: string \"").and_then(|text| text.strip_suffix('"'));
    let hint = text.filter(|_| words.contains("number")).map_or_else(String::new, toml_slips::hint_for_text);
    format!("{found}, expected {words}{hint}")
}

/// Of "unknown field `nmae`, expected one of `name`, `mass_kg`" and the like, the word that was meant.
fn meant(message: &str) -> Option<&str> {
    let unknown = message.strip_prefix("unknown field `").or(message.strip_prefix("unknown variant `"))?;
    let (found, expected) = unknown.rsplit_once("`, expected ")?;
    nearest(&found.to_lowercase(), expected.split('`').skip(1).step_by(2))
}

/// What is found and allowed where serde met `[key]` and wanted a list.
fn single_table(message: &str, key: &str) -> Option<[String; 2]> {
    let is_one = message.starts_with("invalid type: map, expected a sequence") && !key.is_empty();
    is_one.then(|| toml_slips::single_table(key))
}

/// Line, from 1, of a byte offset; offsets beyond the end belong to the last line.
pub fn line_at(text: &str, offset: usize) -> usize {
    let end = offset.min(text.len());
    1 + text.as_bytes()[..end].iter().filter(|&&byte| byte == b'\n').count()
}

/// Dotted path of the innermost key whose name or value covers a byte offset; empty where there
/// is none. Works on broken text as far as that can be read.
pub fn key_at(text: &str, offset: usize) -> String {
    let (document, _) = DeTable::parse_recoverable(text);
    let mut path = String::new();
    find_in_table(document.get_ref(), offset, &mut path);
    path
}

fn find_in_table(table: &DeTable<'_>, offset: usize, path: &mut String) -> bool {
    table.iter().any(|(key, value)| {
        let length = path.len();
        if length > 0 {
            path.push('.');
        }
        path.push_str(key.get_ref());
        let found = find_in_value(value, offset, path) || covers(&key.span(), offset);
        if !found {
            path.truncate(length);
        }
        found
    })
}

fn find_in_value(value: &Spanned<DeValue<'_>>, offset: usize, path: &mut String) -> bool {
    let inside = match value.get_ref() {
        DeValue::Table(table) => find_in_table(table, offset, path),
        DeValue::Array(items) => items.iter().enumerate().any(|(index, item)| {
            let length = path.len();
            path.push_str(&format!("[{index}]"));
            let found = find_in_value(item, offset, path);
            if !found {
                path.truncate(length);
            }
            found
        }),
        _ => false,
    };
    inside || covers(&value.span(), offset)
}

fn covers(span: &Range<usize>, offset: usize) -> bool {
    span.contains(&offset)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use serde::Deserialize;

    const TEXT: &str =
        "a = 1\r\n# ä comment\n[motor]\ncurrent = [1.0, 99.0]\nname = 'x'\n\n[[axis]]\nsign = 2\n";

    #[derive(Debug, Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Motor {
        current: SpannedList,
    }

    #[derive(Debug, Deserialize)]
    struct Document {
        motor: Motor,
    }

    fn read(text: &str) -> Result<Document, TomlReport> {
        TomlText::new(text, Path::new("lab/m.toml")).read()
    }

    #[test]
    fn an_offset_leads_to_its_line_and_key() {
        let at = |needle: &str| {
            let offset = TEXT.find(needle).unwrap();
            (line_at(TEXT, offset), key_at(TEXT, offset))
        };
        assert_eq!(at("a ="), (1, "a".into()));
        assert_eq!(at("1\r"), (1, "a".into()));
        assert_eq!(at("99"), (4, "motor.current[1]".into()));
        assert_eq!(at("current"), (4, "motor.current".into()));
        assert_eq!(at("2\n"), (8, "axis[0].sign".into()));
        assert_eq!(at("# "), (2, String::new()));
    }

    #[test]
    fn a_report_names_file_line_key_found_and_allowed() {
        let text = "[motor]\ncurrent = [1.0, 99.0]\n";
        let document = read(text).unwrap();
        let allowed = Allowed { min: 0.0, max: 10.0, unit: "A" };
        let toml = TomlText::new(text, Path::new("lab/m.toml"));
        let report = toml.numbers::<2>(&document.motor.current, allowed).unwrap_err();
        assert_eq!(report.to_string(), "lab/m.toml:2: `motor.current[1]`: found 99, allowed: 0 to 10 A");
        let report = toml.numbers::<3>(&document.motor.current, allowed).unwrap_err();
        assert_eq!(
            report.to_string(),
            "lab/m.toml:2: `motor.current`: found 2 values, allowed: exactly 3 values"
        );
    }

    #[test]
    fn unknown_keys_wrong_types_and_broken_syntax_name_their_line() {
        let report = read("[motor]\ncurrent = []\ncurent = 3\n").unwrap_err();
        assert_eq!((report.line, report.key.as_str()), (3, "motor.curent"));
        assert!(report.problem.contains("expected `current`"), "{report}");

        let report = read("[motor]\ncurrent = [1, 'two']\n").unwrap_err();
        assert_eq!((report.line, report.key.as_str()), (2, "motor.current[1]"));
        assert!(report.problem.contains("two"), "{report}");

        assert_eq!(read("\n\n[motor\n").unwrap_err().line, 3);
    }

    #[test]
    fn usual_slips_are_told_with_what_to_write_instead() {
        let text = "[motor]\ncurrent = [.5]\n";
        assert!(read(text).unwrap_err().problem.ends_with("as in 0.05"), "{}", read(text).unwrap_err());

        let of_another_type = read("[motor]\ncurrent = true\n").unwrap_err();
        assert!(of_another_type.problem.contains("invalid type: boolean"), "{of_another_type}");

        #[derive(Debug, Deserialize)]
        struct Axes {
            #[serde(rename = "axis")]
            _axis: Spanned<Vec<Spanned<Motor>>>,
        }
        let report =
            TomlText::new("\n[axis]\ncurrent = []\n", Path::new("lab/m.toml")).read::<Axes>().unwrap_err();
        assert_eq!((report.line, report.key.as_str()), (2, "axis"));
        let says = "found a single table, as `[axis]` makes it, allowed: a list of tables, each under its own [[axis]]";
        assert!(report.problem.starts_with(says), "{report}");
    }

    #[test]
    fn a_key_that_the_whole_text_lacks_is_not_said_to_be_missing_in_its_first_key() {
        for text in ["a = 1\n", "a = 1", "# first\na = 1\nb = 'x'\n", "[other]\nb = 2\n", ""] {
            let report = read(text).unwrap_err();
            assert_eq!(report.key, "", "{text:?}: {report}");
            assert_eq!(report.problem, "missing field `motor`", "{text:?}");
        }
        // A text that is nothing but a table lacks what that table lacks.
        for text in ["[motor]", "[motor]\n"] {
            assert_eq!(read(text).unwrap_err().key, "motor", "{text:?}");
        }
    }

    #[test]
    fn types_are_told_in_words_and_not_in_those_of_rust() {
        #[derive(Debug, Deserialize)]
        #[allow(dead_code)]
        struct Numbers {
            size: Option<f64>,
            count: Option<u64>,
            change: Option<i64>,
        }
        let problem =
            |text: &str| TomlText::new(text, Path::new("lab/m.toml")).read::<Numbers>().unwrap_err().problem;
        assert_eq!(
            problem("size = '1 kHz'\n"),
            "invalid type: string \"1 kHz\", expected a number; numbers have no units, the name of the key tells the unit"
        );
        assert!(problem("count = '2'\n").ends_with("; a number stands without quotes"));
        assert!(problem("size = 1 kHz\n").starts_with("found 1 kHz, allowed: a number alone"));
        assert_eq!(
            problem("count = 'two'\n"),
            "invalid type: string \"two\", expected a whole number, 0 or more"
        );
        assert_eq!(problem("change = 1.5\n"), "invalid type: floating point `1.5`, expected a whole number");
        // What a file says is repeated as it stands.
        assert_eq!(
            problem("size = ', expected f64'\n"),
            "invalid type: string \", expected f64\", expected a number"
        );
    }

    #[test]
    fn a_slip_of_a_key_is_answered_with_the_key_that_was_meant() {
        let report = read("[motor]\ncurrent = []\ncurrnet = 3\n").unwrap_err();
        assert_eq!(report.problem, "unknown field `currnet`, expected `current` (did you mean `current`?)");

        #[derive(Debug, Deserialize)]
        #[serde(rename_all = "kebab-case")]
        enum Clock {
            Real,
            Lockstep,
        }
        #[derive(Debug, Deserialize)]
        #[allow(dead_code)]
        struct Config {
            clock: Clock,
        }
        let problem =
            |text: &str| TomlText::new(text, Path::new("lab/m.toml")).read::<Config>().unwrap_err().problem;
        assert_eq!(
            problem("clock = 'Lock-step'\n"),
            "unknown variant `Lock-step`, expected `real` or `lockstep` (did you mean `lockstep`?)"
        );
        assert!(problem("clock = 'sundial'\n").ends_with("expected `real` or `lockstep`"));
        // What was written may hold anything.
        assert!(!problem("clock = '`, expected `r'\n").is_empty());
    }

    #[test]
    fn a_missing_key_is_reported_at_its_table() {
        let report = read("\n[motor]\n").unwrap_err();
        assert_eq!((report.line, report.key.as_str()), (2, "motor"));
        assert!(report.problem.contains("current"), "{report}");
    }

    #[test]
    fn nan_and_infinity_are_never_allowed() {
        let text = "[motor]\ncurrent = [nan, inf]\n";
        let list = read(text).unwrap().motor.current;
        let toml = TomlText::new(text, Path::new("m.toml"));
        let anything = Allowed { min: f64::NEG_INFINITY, max: f64::INFINITY, unit: "" };
        for item in list.get_ref() {
            assert!(toml.number(item, anything).is_err());
        }
    }

    proptest! {
        #[test]
        fn no_text_panics(text in any::<String>(), toml_like in "[\\[\\]{}a-c=.,'\"# \n\r0-9-]{0,60}", offset: usize) {
            for text in [&text, &toml_like] {
                let _ = read(text);
                let _ = (line_at(text, offset), key_at(text, offset % (text.len() + 1)));
            }
        }
    }
}
