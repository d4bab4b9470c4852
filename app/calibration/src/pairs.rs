//! Pairs of points, and the files that hold them.
//!
//! Model: six numbers a line, the fiducial's x, y, z and the other device's, in metres, separated by commas,
//! semicolons or white space; what MATLAB's `save -ascii` writes and its `load` reads (Melder figure 5.2). A first
//! line of words is a header. Blank lines and comments (`%`, `#`) do not count. Lines keep their numbers, so that
//! a suspect pair can be looked up.

use nalgebra::Vector3;

use crate::error::{CalibrationError, PairsError};
use crate::unit::Unit;

/// One point, measured by both devices.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pair {
    /// Where it stands in its file, from 1.
    pub line: usize,
    /// As the fiducial measured it, in its base frame F (m).
    pub fiducial: Vector3<f64>,
    /// As the other device measured it, in its base frame N (m).
    pub other: Vector3<f64>,
}

/// The most pairs a file may have: more than a quarter of an hour of every tick at 1 kHz.
pub const MAX_PAIRS: usize = 1_000_000;
/// No desktop device reaches so far (m): such numbers are millimetres or counts.
pub const MAX_EXTENT_M: f64 = 5.0;
/// Points within such a box (m) are a device that nobody moved: directions would be those of its noise.
pub const MIN_EXTENT_M: f64 = 0.005;

/// Reads the pairs of a text.
///
/// # Errors
/// [`PairsError`] names the line of the first mistake and what is allowed there.
pub fn parse_pairs(text: &str) -> Result<Vec<Pair>, PairsError> {
    let text = text.trim_start_matches('\u{feff}');
    let lines = text.lines().enumerate().map(|(index, line)| (index + 1, content(line)));
    let mut rows = lines.filter(|(_, line)| !line.is_empty()).peekable();
    // Words before the first row are names of columns.
    rows.next_if(|(_, line)| is_header(line));
    let mut pairs = Vec::new();
    for (line, text) in rows {
        if pairs.len() == MAX_PAIRS {
            return Err(PairsError::TooMany { line, limit: MAX_PAIRS });
        }
        pairs.push(parse_row(line, text)?);
    }
    Ok(pairs)
}

fn parse_row(line: usize, text: &str) -> Result<Pair, PairsError> {
    let found = cells(text).count();
    if found != 6 {
        return Err(PairsError::RowLength { has_decimal_commas: has_decimal_commas(text), line, found });
    }
    let mut numbers = [0.0; 6];
    for (column, (number, cell)) in numbers.iter_mut().zip(cells(text)).enumerate() {
        *number = parse_cell(cell).ok_or_else(|| PairsError::BadCell {
            line,
            column: COLUMNS[column],
            found: beginning(cell),
        })?;
    }
    let [xf, yf, zf, xn, yn, zn] = numbers;
    Ok(Pair { line, fiducial: Vector3::new(xf, yf, zf), other: Vector3::new(xn, yn, zn) })
}

/// Enough of a cell to find it by.
fn beginning(cell: &str) -> String {
    match cell.char_indices().nth(LONGEST_QUOTE) {
        Some((end, _)) => format!("{}...", &cell[..end]),
        None => cell.into(),
    }
}

fn parse_cell(cell: &str) -> Option<f64> {
    cell.parse().ok().filter(|number: &f64| number.is_finite())
}

/// A line without its comment.
fn content(line: &str) -> &str {
    line.find(['%', '#']).map_or(line, |at| &line[..at]).trim()
}

/// With commas or semicolons an empty cell is a mistake; white space alone may be of any width.
fn cells(line: &str) -> impl Iterator<Item = &str> {
    let by_mark = line.contains([',', ';']);
    let parts: Vec<&str> =
        if by_mark { line.split([',', ';']).collect() } else { line.split_whitespace().collect() };
    // Some programs quote each cell.
    parts.into_iter().map(|part| part.trim().trim_matches('"').trim())
}

/// As a spreadsheet writes them where semicolons separate: then a comma is no separator.
fn has_decimal_commas(line: &str) -> bool {
    let cells: Vec<&str> = if line.contains(';') {
        line.split(';').map(str::trim).collect()
    } else {
        line.split_whitespace().collect()
    };
    if cells.len() == 6 {
        return cells.iter().all(|cell| parse_cell(&cell.replacen(',', ".", 1)).is_some());
    }
    // Or commas between columns as well, and no point anywhere.
    let parts: Vec<&str> = line.split(',').map(str::trim).collect();
    let is_whole_part = |part: &&str| part.trim_start_matches(['+', '-']).parse::<u64>().is_ok();
    (8..=12).contains(&parts.len()) && parts.iter().all(is_whole_part)
}

/// Names, none of which is a number: half a header is a broken row.
fn is_header(line: &str) -> bool {
    cells(line).all(|cell| cell.parse::<f64>().is_err() && cell.contains(char::is_alphabetic))
}

/// Refuses what no transform can be found from, whichever it is.
pub(crate) fn check(pairs: &[Pair]) -> Result<(), CalibrationError> {
    for pair in pairs {
        if !pair.fiducial.iter().chain(pair.other.iter()).all(|number| number.is_finite()) {
            return Err(CalibrationError::NotFinite { line: pair.line });
        }
    }
    let reaches = [reach_m(pairs, |pair| pair.fiducial), reach_m(pairs, |pair| pair.other)];
    let ratio = reaches[0] / reaches[1];
    check_extent(FIDUCIAL, pairs, |pair| pair.fiducial, ratio)?;
    check_extent(OTHER, pairs, |pair| pair.other, 1.0 / ratio)?;
    for (whose, ratio) in [(FIDUCIAL, ratio), (OTHER, 1.0 / ratio)] {
        if ratio > MOST_RATIO {
            return Err(CalibrationError::OtherUnit { whose, ratio, unit: Unit::of_ratio(ratio) });
        }
    }
    Ok(())
}

const FIDUCIAL: &str = "fiducial";
const OTHER: &str = "other device";
/// Beyond that no two devices measure the same lengths, whatever their links: one of them counts in another unit. A
/// layout takes half of it.
const MOST_RATIO: f64 = 4.0;

/// Median distance of points from their middle, which a few that do not belong leave as it is.
fn reach_m(pairs: &[Pair], point: impl Fn(&Pair) -> Vector3<f64>) -> f64 {
    let points: Vec<Vector3<f64>> = pairs.iter().map(point).collect();
    let middle = Vector3::from_fn(|axis, _| median(points.iter().map(|point| point[axis]).collect()));
    median(points.iter().map(|point| (point - middle).norm()).collect())
}

fn median(mut numbers: Vec<f64>) -> f64 {
    let middle = numbers.len() / 2;
    if numbers.is_empty() { 0.0 } else { *numbers.select_nth_unstable_by(middle, f64::total_cmp).1 }
}

fn check_extent(
    whose: &'static str,
    pairs: &[Pair],
    point: impl Fn(&Pair) -> Vector3<f64>,
    ratio: f64,
) -> Result<(), CalibrationError> {
    let Some(first) = pairs.first().map(&point) else { return Ok(()) };
    let corners = |(low, high): (Vector3<f64>, Vector3<f64>), p: Vector3<f64>| (low.inf(&p), high.sup(&p));
    let (low, high) = pairs.iter().map(&point).fold((first, first), corners);
    let extent_m = (high - low).norm();
    let furthest_m = low.amax().max(high.amax());
    if extent_m > MAX_EXTENT_M || furthest_m > MAX_EXTENT_M {
        let found = extent_m.max(furthest_m);
        let unit = Unit::of_ratio(ratio).or_else(|| Unit::of_extent(found));
        return Err(CalibrationError::TooWide { whose, found, unit });
    }
    if extent_m < MIN_EXTENT_M {
        return Err(CalibrationError::HardlyMoved { whose, extent_m });
    }
    Ok(())
}

const COLUMNS: [&str; 6] = ["fiducial x", "fiducial y", "fiducial z", "other x", "other y", "other z"];
/// Enough of a cell to find it again.
const LONGEST_QUOTE: usize = 40;
