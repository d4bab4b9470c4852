//! Takes typed values out of a TOML tree, so that every refusal is a message of ours.
//!
//! A derived deserialiser stops at the first surprise with a message of its own and no key path.
//! Here a [`Table`] and a [`Value`] know their path and place, and each accessor says in full
//! what it would have accepted.

use std::fmt;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};
use std::rc::Rc;

use rt_core::plain_text::{beginning, quoted};
use rt_core::toml_slips;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::document::Document;
use crate::error::{Location, SceneError};
use crate::units::most_at;
use crate::vocabulary::{Verdict, Vocabulary};

/// A table and where it stands, perhaps laid over another one whose values hold where it has none.
#[derive(Debug, Clone)]
pub(crate) struct Table<'d> {
    document: Document<'d>,
    path: String,
    offset: usize,
    entries: &'d DeTable<'d>,
    beneath: Option<Rc<Table<'d>>>,
}

impl<'d> Table<'d> {
    /// The whole file.
    pub(crate) fn root(document: Document<'d>, root: &'d Spanned<DeTable<'d>>) -> Self {
        Self { document, path: String::new(), offset: 0, entries: root.get_ref(), beneath: None }
    }

    /// This table, with the values of another where it has none.
    ///
    /// Tables in both are laid over each other in turn, unless the upper one says what it is (`kind`, `model`): a
    /// sphere has no use for the sizes of a box. A key also hides those that exclude it.
    pub(crate) fn over(self, beneath: Table<'d>) -> Self {
        Self { beneath: Some(Rc::new(beneath)), ..self }
    }

    pub(crate) fn document(&self) -> &Document<'d> {
        &self.document
    }

    /// Where it begins, in bytes from the start of the file.
    pub(crate) fn offset(&self) -> usize {
        self.offset
    }

    /// Refuses the first key, in the order of the file, that is not available.
    pub(crate) fn check_keys(&self, keys: &Vocabulary) -> Result<(), SceneError> {
        self.wrong_keys(keys).into_iter().next().map_or(Ok(()), Err)
    }

    /// All keys that are not available, in the order of the file.
    pub(crate) fn wrong_keys(&self, keys: &Vocabulary) -> Vec<SceneError> {
        let mut written: Vec<_> = self.entries.keys().collect();
        written.sort_by_key(|key| key.span().start);
        let wrong = written.into_iter().filter_map(|key| {
            let at = || self.document.location(key.span().start, self.path_of(key.get_ref()));
            match keys.judge(key.get_ref()) {
                Verdict::Available(_) => None,
                Verdict::Later => Some(SceneError::KeyNotAvailable { at: at(), available: keys.list() }),
                Verdict::Unknown(suggestion) => {
                    Some(SceneError::UnknownKey { at: at(), allowed: keys.list(), suggestion })
                }
            }
        });
        let beneath = self.beneath.iter().flat_map(|beneath| beneath.wrong_keys(keys));
        wrong.chain(beneath).collect()
    }

    pub(crate) fn get(&self, key: &str) -> Option<Value<'d>> {
        let beneath = self.beneath.as_ref().filter(|_| !self.hides(key)).and_then(|table| table.get(key));
        match self.own(key) {
            Some(own) => Some(Value { beneath: beneath.map(Box::new), ..own }),
            None => beneath,
        }
    }

    /// The value of a key of this very table, whatever lies beneath.
    pub(crate) fn own(&self, key: &str) -> Option<Value<'d>> {
        let value = self.entries.get(key)?;
        Some(Value { document: self.document, path: self.path_of(key), value, beneath: None })
    }

    /// The keys of this very table, in no order.
    pub(crate) fn own_keys(&self) -> impl Iterator<Item = &str> {
        self.entries.keys().map(|key| key.get_ref().as_ref())
    }

    /// Whether it has a key that excludes this one.
    fn hides(&self, key: &str) -> bool {
        let has = |rival: &str| self.entries.contains_key(rival);
        let is_fixed = || self.own("movable").and_then(|value| value.truth_if_any()) == Some(false);
        RIVALS.iter().any(|[a, b]| *a == key && has(b) || *b == key && has(a))
            || OF_MOVING.contains(&key) && is_fixed()
    }

    /// Whether it says what it is, so that nothing else can be added to it.
    fn is_whole(&self) -> bool {
        OF_ITS_OWN.iter().any(|key| self.entries.contains_key(*key))
    }

    /// The value of `key`; `allowed` says what may stand there if nothing does.
    pub(crate) fn require(&self, key: &str, allowed: impl fmt::Display) -> Result<Value<'d>, SceneError> {
        self.get(key).ok_or_else(|| self.missing(key, allowed))
    }

    /// That `key` should be there, and what could stand there.
    pub(crate) fn missing(&self, key: &str, allowed: impl fmt::Display) -> SceneError {
        SceneError::MissingKey { at: self.at(key), allowed: allowed.to_string() }
    }

    pub(crate) fn number(&self, key: &str, bound: Bound) -> Result<f64, SceneError> {
        self.require(key, bound)?.number(bound)
    }

    pub(crate) fn number_or(&self, key: &str, bound: Bound, default: f64) -> Result<f64, SceneError> {
        self.get(key).map_or(Ok(default), |value| value.number(bound))
    }

    pub(crate) fn whole_or(
        &self,
        key: &str,
        range: RangeInclusive<u64>,
        default: u64,
    ) -> Result<u64, SceneError> {
        self.get(key).map_or(Ok(default), |value| value.whole(range))
    }

    pub(crate) fn numbers_or<const N: usize>(
        &self,
        key: &str,
        default: [f64; N],
    ) -> Result<[f64; N], SceneError> {
        self.get(key).map_or(Ok(default), |value| value.numbers())
    }

    /// The tables of a list such as `[[finger]]`; none if the key is absent.
    pub(crate) fn tables(&self, key: &str) -> Result<Vec<Table<'d>>, SceneError> {
        self.get(key).map_or(Ok(Vec::new()), |value| value.tables(key))
    }

    /// The tables of a list that can only be so long; refused at the first entry too many.
    pub(crate) fn tables_up_to(&self, limit: usize, key: &str) -> Result<Vec<Table<'d>>, SceneError> {
        let tables = self.tables(key)?;
        let Some(first_too_many) = tables.get(limit) else { return Ok(tables) };
        let at = self.document.location(first_too_many.offset, first_too_many.path.clone());
        Err(SceneError::TooMany { at, found: tables.len(), limit })
    }

    /// Where `key` stands in this table, or where the table begins if it has no such key.
    pub(crate) fn at(&self, key: &str) -> Box<Location> {
        if let Some(value) = self.get(key) {
            return value.at();
        }
        self.document.location(self.offset, self.path_of(key))
    }

    /// Where it begins.
    pub(crate) fn here(&self) -> Box<Location> {
        self.document.location(self.offset, self.path.clone())
    }

    fn path_of(&self, key: &str) -> String {
        let dot = if self.path.is_empty() { "" } else { "." };
        format!("{}{dot}{}", self.path, shown_key(key))
    }
}

/// A value and where it stands.
#[derive(Debug, Clone)]
pub(crate) struct Value<'d> {
    document: Document<'d>,
    path: String,
    value: &'d Spanned<DeValue<'d>>,
    /// What the same key has in a table beneath.
    beneath: Option<Box<Value<'d>>>,
}

impl<'d> Value<'d> {
    /// Its line and key, for messages.
    pub(crate) fn at(&self) -> Box<Location> {
        self.document.location(self.value.span().start, self.path.clone())
    }

    /// Where it begins, in bytes from the start of the file.
    pub(crate) fn offset(&self) -> usize {
        self.value.span().start
    }

    pub(crate) fn document(&self) -> &Document<'d> {
        &self.document
    }

    /// A finite number within `bound` and within what its unit may have; integers count as numbers.
    pub(crate) fn number(&self, bound: Bound) -> Result<f64, SceneError> {
        let (number, most) = (self.finite_number(bound)?, most_at(&self.path));
        if number.abs() <= most {
            return Ok(number);
        }
        Err(self.out_of_range(format_args!("{bound}, {most:e} at most in size")))
    }

    /// A finite number within `bound`, whatever its unit.
    pub(crate) fn finite_number(&self, bound: Bound) -> Result<f64, SceneError> {
        let number: f64 = match self.value.get_ref() {
            DeValue::Float(float) => float.as_str().parse().unwrap_or(f64::NAN),
            DeValue::Integer(_) => self.integer().ok_or_else(|| self.out_of_range(WIDE_INTEGER))? as f64,
            _ => return Err(self.no_number(bound)),
        };
        if !number.is_finite() {
            let (found, allowed) = (self.found(), bound.to_string());
            Err(SceneError::NotFinite { at: self.at(), found, allowed })
        } else if bound.holds(number) {
            Ok(number)
        } else {
            Err(self.out_of_range(bound))
        }
    }

    /// Exactly `N` finite numbers.
    pub(crate) fn numbers<const N: usize>(&self) -> Result<[f64; N], SceneError> {
        self.numbers_in(Bound::Any)
    }

    /// Exactly `N` finite numbers, each within `bound`.
    pub(crate) fn numbers_in<const N: usize>(&self, bound: Bound) -> Result<[f64; N], SceneError> {
        let allowed = format!("an array of {N} {}", bound.of_several());
        let DeValue::Array(items) = self.value.get_ref() else { return Err(self.wrong_type(allowed)) };
        if items.len() != N {
            return Err(self.wrong_type(allowed));
        }
        let mut numbers = [0.0; N];
        for (i, (number, value)) in numbers.iter_mut().zip(items.iter()).enumerate() {
            *number = self.item(i, value).number(bound)?;
        }
        Ok(numbers)
    }

    /// Finite numbers within `bound`, at least one of them.
    pub(crate) fn list(&self, bound: Bound) -> Result<Vec<f64>, SceneError> {
        let allowed = || format!("an array of {}, with at least one of them", bound.of_several());
        match self.value.get_ref() {
            DeValue::Array(items) if !items.is_empty() => {
                items.iter().enumerate().map(|(i, value)| self.item(i, value).number(bound)).collect()
            }
            _ => Err(self.wrong_type(allowed())),
        }
    }

    /// A list of values, at least one of them.
    pub(crate) fn items(&self, allowed: &str) -> Result<Vec<Value<'d>>, SceneError> {
        match self.value.get_ref() {
            DeValue::Array(items) if !items.is_empty() => {
                Ok(items.iter().enumerate().map(|(i, value)| self.item(i, value)).collect())
            }
            _ => Err(self.wrong_type(allowed)),
        }
    }

    /// How many items a list has; 0 if it is none.
    pub(crate) fn length(&self) -> usize {
        if let DeValue::Array(items) = self.value.get_ref() { items.len() } else { 0 }
    }

    /// Factors along three axes: one number for all, or an array of three; above 0.
    pub(crate) fn factors(&self) -> Result<[f64; 3], SceneError> {
        self.along_axes(Bound::Positive)
    }

    /// A number within `bound` for each of three axes: one for all, or an array of three.
    pub(crate) fn along_axes(&self, bound: Bound) -> Result<[f64; 3], SceneError> {
        match self.value.get_ref() {
            DeValue::Array(items) if items.len() == 3 => self.numbers_in(bound),
            DeValue::Integer(_) | DeValue::Float(_) => Ok([self.number(bound)?; 3]),
            _ => Err(self.no_number(format!("{bound}, or an array of 3 {}", bound.of_several()))),
        }
    }

    /// `N` rows of `N` finite numbers.
    pub(crate) fn rows<const N: usize>(&self) -> Result<[[f64; N]; N], SceneError> {
        let allowed = format!("an array of {N} rows of {N} numbers");
        let DeValue::Array(items) = self.value.get_ref() else { return Err(self.wrong_type(allowed)) };
        if items.len() != N {
            return Err(self.wrong_type(allowed));
        }
        let mut rows = [[0.0; N]; N];
        for (i, (row, value)) in rows.iter_mut().zip(items.iter()).enumerate() {
            *row = self.item(i, value).numbers()?;
        }
        Ok(rows)
    }

    /// Any number of points of three finite numbers.
    pub(crate) fn points(&self, allowed: &str) -> Result<Vec<[f64; 3]>, SceneError> {
        let DeValue::Array(items) = self.value.get_ref() else { return Err(self.wrong_type(allowed)) };
        items.iter().enumerate().map(|(i, value)| self.item(i, value).numbers()).collect()
    }

    /// A whole number below `limit`.
    pub(crate) fn index(&self, limit: usize) -> Result<usize, SceneError> {
        self.whole(0..=limit as u64 - 1).map(|index| index as usize)
    }

    /// A whole number within `range`.
    pub(crate) fn whole(&self, range: RangeInclusive<u64>) -> Result<u64, SceneError> {
        let allowed = format!("a whole number from {} to {}", range.start(), range.end());
        let DeValue::Integer(_) = self.value.get_ref() else { return Err(self.no_number(allowed)) };
        let whole = self.integer().and_then(|integer| u64::try_from(integer).ok());
        whole.filter(|whole| range.contains(whole)).ok_or_else(|| self.out_of_range(allowed))
    }

    /// A string that is not empty.
    pub(crate) fn text(&self, allowed: &str) -> Result<&'d str, SceneError> {
        match self.value.get_ref() {
            DeValue::String(text) if !text.is_empty() => Ok(text),
            DeValue::String(_) => Err(self.out_of_range(allowed)),
            _ => Err(self.wrong_type(allowed)),
        }
    }

    /// The name of a file. A line break or an escape in it, or a megabyte, would spoil every message that names the file.
    pub(crate) fn path(&self, allowed: &str) -> Result<&'d str, SceneError> {
        let path = self.text(allowed)?;
        if path.contains(char::is_control) {
            return Err(self.out_of_range(format_args!("{allowed}, without control characters")));
        }
        if path.len() > MOST_PATH_BYTES {
            return Err(self.out_of_range(format_args!("{allowed}, of at most {MOST_PATH_BYTES} bytes")));
        }
        Ok(path)
    }

    /// Yes or no.
    pub(crate) fn truth(&self) -> Result<bool, SceneError> {
        self.truth_if_any().ok_or_else(|| self.wrong_type("true or false"))
    }

    /// One of the words that this version implements.
    pub(crate) fn choose(&self, what: &'static str, words: &Vocabulary) -> Result<&'static str, SceneError> {
        let available = words.list();
        let word = self.text(&available)?;
        let found = || beginning(word).escape_debug().to_string();
        match words.judge(word) {
            Verdict::Available(word) => Ok(word),
            Verdict::Later => {
                Err(SceneError::KindNotAvailable { at: self.at(), what, found: found(), available })
            }
            Verdict::Unknown(suggestion) => {
                let (at, found, allowed) = (self.at(), found(), available);
                Err(SceneError::UnknownKind { at, what, found, allowed, suggestion })
            }
        }
    }

    /// `true` or `false`; `None`: it is something else.
    pub(crate) fn truth_if_any(&self) -> Option<bool> {
        if let DeValue::Boolean(truth) = self.value.get_ref() { Some(*truth) } else { None }
    }

    pub(crate) fn table(&self, allowed: &str) -> Result<Table<'d>, SceneError> {
        let DeValue::Table(entries) = self.value.get_ref() else { return Err(self.wrong_type(allowed)) };
        let (path, offset) = (self.path.clone(), self.value.span().start);
        let table = Table { document: self.document, path, offset, entries, beneath: None };
        match self.beneath.as_ref().and_then(|beneath| beneath.table("").ok()) {
            Some(beneath) if !table.is_whole() => Ok(table.over(beneath)),
            _ => Ok(table),
        }
    }

    /// Whether it is a list.
    pub(crate) fn is_list(&self) -> bool {
        matches!(self.value.get_ref(), DeValue::Array(_))
    }

    /// The name of a file that is given relative to the one that it is written in.
    pub(crate) fn file(&self, allowed: &str) -> Result<PathBuf, SceneError> {
        let beside = self.document.file().parent().unwrap_or(Path::new(""));
        Ok(beside.join(self.path(allowed)?))
    }

    pub(crate) fn tables(&self, key: &str) -> Result<Vec<Table<'d>>, SceneError> {
        let allowed = toml_slips::tables(key);
        let items = match self.value.get_ref() {
            DeValue::Array(items) => items,
            DeValue::Table(_) => {
                let [found, allowed] = toml_slips::single_table(key);
                return Err(SceneError::WrongType { at: self.at(), found, allowed });
            }
            _ => return Err(self.wrong_type(allowed)),
        };
        items.iter().enumerate().map(|(i, value)| self.item(i, value).table(&allowed)).collect()
    }

    pub(crate) fn out_of_range(&self, allowed: impl fmt::Display) -> SceneError {
        SceneError::OutOfRange { at: self.at(), found: self.found(), allowed: allowed.to_string() }
    }

    fn wrong_type(&self, allowed: impl fmt::Display) -> SceneError {
        SceneError::WrongType { at: self.at(), found: self.found(), allowed: allowed.to_string() }
    }

    /// The same where a number is expected: people write it with its unit, or between quotes.
    fn no_number(&self, allowed: impl fmt::Display) -> SceneError {
        match self.value.get_ref() {
            DeValue::String(text) => {
                self.wrong_type(format_args!("{allowed}{}", toml_slips::hint_for_text(text)))
            }
            _ => self.wrong_type(allowed),
        }
    }

    fn item(&self, i: usize, value: &'d Spanned<DeValue<'d>>) -> Value<'d> {
        Value { document: self.document, path: format!("{}[{i}]", self.path), value, beneath: None }
    }

    /// One of an array.
    pub(crate) fn nth(&self, i: usize) -> Option<Value<'d>> {
        let DeValue::Array(items) = self.value.get_ref() else { return None };
        Some(self.item(i, items.get(i)?))
    }

    fn integer(&self) -> Option<i64> {
        let DeValue::Integer(integer) = self.value.get_ref() else { return None };
        i64::from_str_radix(integer.as_str(), integer.radix()).ok()
    }

    /// The value in words, short enough for a message.
    fn found(&self) -> String {
        match self.value.get_ref() {
            DeValue::String(text) => format!("the string {}", quoted(text)),
            DeValue::Integer(integer) => beginning(&integer.to_string()).into_owned(),
            DeValue::Float(float) => beginning(float.as_str()).into_owned(),
            DeValue::Boolean(truth) => format!("the boolean {truth}"),
            DeValue::Datetime(date) => format!("the date {date}"),
            DeValue::Array(items) => format!("an array of length {}", items.len()),
            DeValue::Table(_) => "a table".into(),
        }
    }
}

/// The range a number must lie in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Bound {
    Any,
    NotNegative,
    Positive,
}

impl Bound {
    fn holds(self, number: f64) -> bool {
        match self {
            Self::Any => true,
            Self::NotNegative => number >= 0.0,
            Self::Positive => number > 0.0,
        }
    }

    fn of_several(self) -> &'static str {
        match self {
            Self::Any => "numbers",
            Self::NotNegative => "numbers, 0 or more",
            Self::Positive => "numbers above 0",
        }
    }
}

impl fmt::Display for Bound {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str(match self {
            Self::Any => "a number",
            Self::NotNegative => "a number, 0 or more",
            Self::Positive => "a number above 0",
        })
    }
}

fn shown_key(key: &str) -> String {
    let is_bare = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    if !key.is_empty() && key.chars().all(is_bare) { beginning(key).into_owned() } else { quoted(key) }
}

/// Keys of which a table can have one only: the upper table's hides the other beneath.
const RIVALS: [[&str; 2]; 4] = [
    ["mass_kg", "density_kg_m3"],
    ["size_m", "repeat"],
    ["damping_n_s_per_m", "damping_ratio"],
    ["density_kg_m3", "damping_ratio"],
];
/// Keys that `movable = false` hides: a fixed one of a template that moves.
const OF_MOVING: [&str; 8] = [
    "damping_ratio",
    "mass_kg",
    "density_kg_m3",
    "inertia_kg_m2",
    "centre_of_mass_m",
    "velocity_m_s",
    "angular_velocity_rad_s",
    "rotation_locked",
];
/// Keys that say what a table is, so that what lies beneath it is of no use to it.
const OF_ITS_OWN: [&str; 2] = ["kind", "model"];
/// Longest path that the kernel takes, without its end (bytes).
const MOST_PATH_BYTES: usize = 4095;
const WIDE_INTEGER: &str = "an integer of at most 64 bits, or a number with a point or an exponent";
