//! Edits one device's entry in a layout file and leaves the rest as its author wrote it.

use super::CalibrateArgs;
use calibration::Fit;
use rt_core::replacement::Replacement;
use rt_core::{input_file, limits};
use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use thiserror::Error;
use toml_edit::{Array, ArrayOfTables, DocumentMut, Item, Table, Value};
use world::{Layout, MAX_FILE_BYTES, Placement, SceneError};

/// Why there is no new layout.
#[derive(Debug, Error)]
pub enum LayoutFileError {
    /// Two layouts would have to become one.
    #[error(
        "--write {} would replace that layout by an edited {}; leave out --layout to edit the former, or name another file",
        file.display(), given.display()
    )]
    WouldReplace {
        /// What is there.
        file: PathBuf,
        /// What was given.
        given: PathBuf,
    },
    /// It cannot be read.
    #[error(transparent)]
    Read(#[from] SceneError),
    /// It is a device, a pipe or a directory, which a new file would take the place of.
    #[error("--write {}: found something else than a file; allowed: a file, or a name that is free", file.display())]
    NotAFile {
        /// What is there.
        file: PathBuf,
    },
    /// It cannot be edited.
    #[error("{}: cannot be edited: {detail}; write `device` as [[device]] tables", file.display())]
    NotEditable {
        /// The file.
        file: PathBuf,
        /// Why.
        detail: String,
    },
    /// It cannot be written.
    #[error(
        "{}: cannot be written: {}", file.display(),
        limits::with_remedy_or(.source, "name a file in a directory that can be written")
    )]
    Write {
        /// The file.
        file: PathBuf,
        /// Why.
        source: io::Error,
    },
}

/// The text of a layout that has been read and found to be in order.
///
/// # Errors
/// It cannot be read, or is no layout.
pub(super) fn read(file: &Path) -> Result<String, SceneError> {
    // Read as every layout is, bounded and checked, so that the messages are the same.
    Layout::load(file)?;
    input_file::read_text(file, MAX_FILE_BYTES)
        .map_err(|cause| SceneError::Unreadable { file: file.into(), cause })
}

/// Refuses what a file may not take the place of: root could replace `/dev/null` for everybody.
///
/// # Errors
/// There is something, and it is no file.
pub(super) fn refuse_other_than_file(file: &Path) -> Result<(), LayoutFileError> {
    match fs::metadata(file) {
        Ok(found) if !found.is_file() => Err(LayoutFileError::NotAFile { file: file.into() }),
        _ => Ok(()),
    }
}

/// The text with another entry for the device; checked by reading it as a layout.
pub(super) fn with_entry(
    base: &str,
    file: &Path,
    args: &CalibrateArgs,
    entry: &Placement,
    in_world: &Placement,
    fit: &Fit,
) -> Result<String, LayoutFileError> {
    let not_editable = |detail: String| LayoutFileError::NotEditable { file: file.into(), detail };
    let mut document: DocumentMut =
        base.parse().map_err(|error: toml_edit::TomlError| not_editable(error.message().to_owned()))?;
    let devices =
        devices_of(&mut document).ok_or_else(|| not_editable("`device` is no list of tables".into()))?;
    while devices.len() <= args.device {
        devices.push(Table::new());
    }
    let table = devices.get_mut(args.device).ok_or_else(|| not_editable("no such entry".into()))?;
    set_entry(table, entry, &remark(args, fit));
    let text = document.to_string();
    let written = Layout::parse(&text, file)?.placement(args.device);
    if !is_near(&written, in_world) {
        return Err(not_editable(format!(
            "device {} does not stand where it should afterwards",
            args.device
        )));
    }
    Ok(text)
}

/// Puts the text into the file in one step: whoever reads meanwhile has the old one or the new one.
pub(super) fn replace(file: &Path, text: &str) -> Result<(), LayoutFileError> {
    write_beside(file, text).map_err(|source| LayoutFileError::Write { file: file.into(), source })
}

fn write_beside(file: &Path, text: &str) -> io::Result<()> {
    let directory = file.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
    fs::create_dir_all(directory)?;
    // A link goes on leading to its file, also to one that is not there yet.
    let replacement = Replacement::begin(file)?;
    if !replacement.is_beside() {
        return Err(io::Error::other("its directory takes no other file beside it"));
    }
    let mut written = replacement.file()?;
    written.write_all(text.as_bytes())?;
    written.sync_all()?;
    replacement.keep()
}

/// The list of devices, made where there is none, and turned into tables where it stands in one line.
fn devices_of(document: &mut DocumentMut) -> Option<&mut ArrayOfTables> {
    let item = document.entry("device").or_insert_with(|| Item::ArrayOfTables(ArrayOfTables::new()));
    if !item.is_array_of_tables() {
        *item = Item::ArrayOfTables(std::mem::take(item).into_array_of_tables().ok()?);
    }
    item.as_array_of_tables_mut()
}

fn set_entry(table: &mut Table, entry: &Placement, remark: &str) {
    let mut position = Value::from(Array::from_iter(entry.position_m().iter().copied()));
    position.decor_mut().set_suffix(remark);
    table.insert("position_m", Item::Value(position));
    match entry.rigid() {
        Some(pose) => {
            table.remove("matrix");
            let q = pose.rotation;
            set(table, "orientation_wxyz", Value::from(Array::from_iter([q.w, q.i, q.j, q.k])));
        }
        None => {
            table.remove("orientation_wxyz");
            let matrix = entry.matrix();
            let rows = matrix.row_iter().map(|row| Value::from(Array::from_iter(row.iter().copied())));
            set(table, "matrix", Value::from(Array::from_iter(rows)));
        }
    }
}

/// Keeps the comment behind the old value.
fn set(table: &mut Table, key: &str, value: Value) {
    let mut value = value;
    if let Some(old) = table.get(key).and_then(Item::as_value) {
        *value.decor_mut() = old.decor().clone();
    }
    table.insert(key, Item::Value(value));
}

/// What somebody who opens the file wants to know of the numbers.
fn remark(args: &CalibrateArgs, fit: &Fit) -> String {
    let model = if args.affine { "affine" } else { "rigid" };
    let rms_mm = fit.residuals.rms_m * 1e3;
    format!(
        "   # calibrated against device {}: {model}, {} pairs, RMS {rms_mm:.3} mm",
        args.fiducial, fit.count
    )
}

/// Quaternions are normalised when read; products round.
fn is_near(a: &Placement, b: &Placement) -> bool {
    (a.matrix() - b.matrix()).amax() < 1e-9 && (a.position_m() - b.position_m()).amax() < 1e-9
}
