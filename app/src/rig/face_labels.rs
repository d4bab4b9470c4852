//! Labels of a mesh's faces, by the names that a scene asks for.

use super::RigError;
use rt_core::likeness::nearest;
use rt_core::plain_text::{beginning, listed};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use world::FacesSpec;
use world::model::FaceNames;

/// A name in a table that no face has.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Unknown {
    /// Number of the table, from 0.
    table: usize,
    found: String,
    allowed: String,
}

impl Unknown {
    /// In the tables of an entity, which ask for the names of this file.
    pub(super) fn told(&self, file: &Path, faces: &[FacesSpec]) -> Option<RigError> {
        let at = Box::new(faces.get(self.table)?.at.clone());
        let (found, allowed) = (self.found.clone(), self.allowed.clone());
        Some(RigError::FaceName { at, file: file.to_path_buf(), found, allowed })
    }
}

/// The label of each face of the file: the number, from 1, of the first of these that names it, or 0.
///
/// # Errors
/// All names that no face has.
pub(super) fn labels(names: Option<&FaceNames>, faces: &[FacesSpec]) -> Result<Vec<u16>, Vec<Unknown>> {
    let all = names.map(FaceNames::all).unwrap_or_default();
    if let (Some(first), true) = (faces.first(), names.is_some_and(FaceNames::is_cut)) {
        return Err(vec![Unknown {
            table: 0,
            found: listed(first.of.iter().map(String::as_str)),
            allowed: "files whose names take 64 MB at most: join its parts, or shorten their names".into(),
        }]);
    }
    let mut unknown = Vec::new();
    for (table, spec) in faces.iter().enumerate() {
        for name in spec.of.iter().filter(|name| !all.contains_key(name.as_str())) {
            unknown.push(Unknown { table, found: beginning(name).into(), allowed: allowed(name, &all) });
        }
    }
    if !unknown.is_empty() {
        return Err(unknown);
    }
    Ok(names.map_or_else(Vec::new, |names| {
        let lists: Vec<&[String]> = faces.iter().map(|spec| spec.of.as_slice()).collect();
        names.labels(&lists)
    }))
}

/// The tables, of so many and from 0, that label no face: those before them have all faces that they name.
pub(super) fn idle(labels: &[u16], tables: usize) -> Vec<usize> {
    let used: BTreeSet<usize> = labels.iter().map(|&label| usize::from(label)).collect();
    (0..tables).filter(|table| !used.contains(&(table + 1))).collect()
}

fn allowed(name: &str, all: &BTreeMap<&str, usize>) -> String {
    if all.is_empty() {
        return "none, since the file names no faces; OBJ, glTF, ASE and 3DS files can".into();
    }
    let meant = nearest(&name.to_lowercase(), all.keys().copied());
    let meant = meant.map_or_else(String::new, |meant| format!(" (did you mean `{}`?)", beginning(meant)));
    format!("the names in the file{meant}: {}", listed(all.keys().copied()))
}
