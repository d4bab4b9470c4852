//! The columns of a hand file's header: whose they are, and whether a finger has all that belong together.

use super::HandError;
use crate::table::{Cells, TableReader};
use rt_core::plain_text::listed;

/// Indices of a finger's columns.
#[derive(Debug, Clone, Copy)]
pub(super) struct FingerColumns {
    pub(super) position: [usize; 3],
    pub(super) orientation: Option<[usize; 4]>,
    pub(super) buttons: Option<usize>,
}

const AXES: [&str; 3] = ["_x", "_y", "_z"];
const QUATERNION: [&str; 4] = ["_qw", "_qx", "_qy", "_qz"];
const BUTTONS: &str = "_buttons";

pub(super) fn refuse_unknown(reader: &TableReader<'_>, fingers: &[&str]) -> Result<(), HandError> {
    let known =
        || if fingers.is_empty() { "no finger at all".to_owned() } else { listed(fingers.iter().copied()) };
    let belongs = |column: &str| {
        let mut suffixes = AXES.iter().chain(&QUATERNION).chain([&BUTTONS]);
        suffixes.any(|suffix| column.strip_suffix(suffix).is_some_and(|finger| fingers.contains(&finger)))
    };
    if reader.columns().is_empty() {
        return Err(HandError::NoFinger { at: reader.header_place(""), known: known() });
    }
    match reader.columns().iter().find(|column| !belongs(column)) {
        Some(column) => Err(HandError::UnknownColumn { at: reader.header_place(column), known: known() }),
        None => Ok(()),
    }
}

/// What the cells of a column may be.
pub(super) fn allowed(column: &str, fingers: &[&str]) -> Cells {
    match column.strip_suffix(BUTTONS) {
        Some(finger) if fingers.contains(&finger) => Cells::Integers(0..=i64::from(u32::MAX)),
        _ => Cells::Numbers,
    }
}

/// The columns of a finger; `None` if it has none at all.
pub(super) fn of(reader: &TableReader<'_>, finger: &str) -> Result<Option<FingerColumns>, HandError> {
    let column =
        |suffix: &str| reader.columns().iter().position(|name| name.strip_suffix(suffix) == Some(finger));
    let at = |suffix: &str| reader.header_place(&format!("{finger}{suffix}"));
    let position = all_or_none(AXES, AXES.map(column))
        .map_err(|axis| HandError::MissingCoordinate { at: at(axis), finger: finger.to_owned() })?;
    let orientation = all_or_none(QUATERNION, QUATERNION.map(column))
        .map_err(|part| HandError::MissingQuaternionPart { at: at(part), finger: finger.to_owned() })?;
    match (position, orientation, column(BUTTONS)) {
        (Some(position), orientation, buttons) => Ok(Some(FingerColumns { position, orientation, buttons })),
        (None, None, None) => Ok(None),
        _ => Err(HandError::NoPosition { at: at(AXES[0]), finger: finger.to_owned() }),
    }
}

/// What was found if everything was, `None` if nothing was, else the first name that is missing.
fn all_or_none<const N: usize>(
    names: [&'static str; N],
    found: [Option<usize>; N],
) -> Result<Option<[usize; N]>, &'static str> {
    if found == [None; N] {
        return Ok(None);
    }
    match names.into_iter().zip(found).find(|(_, column)| column.is_none()) {
        Some((name, _)) => Err(name),
        None => Ok(Some(found.map(Option::unwrap_or_default))),
    }
}
