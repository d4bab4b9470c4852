//! Labels of a mesh's faces, by the names that a scene asks for.

use super::RigError;
use rt_core::likeness::nearest;
use std::collections::BTreeMap;
use std::path::Path;
use world::FacesSpec;
use world::model::FaceNames;

/// The label of each face of the file: the number, from 1, of the first of these that names it, or 0.
///
/// # Errors
/// A name that no face has.
pub(super) fn labels(
    file: &Path,
    names: Option<&FaceNames>,
    faces: &[FacesSpec],
) -> Result<Vec<u16>, RigError> {
    let all = names.map(FaceNames::all).unwrap_or_default();
    if let (Some(first), true) = (faces.first(), names.is_some_and(FaceNames::is_cut)) {
        return Err(RigError::FaceName {
            at: Box::new(first.at.clone()),
            file: file.to_path_buf(),
            found: first.of.join(", "),
            allowed: "files whose names take 64 MB at most: join its parts, or shorten their names".into(),
        });
    }
    for spec in faces {
        if let Some(name) = spec.of.iter().find(|name| !all.contains_key(name.as_str())) {
            return Err(RigError::FaceName {
                at: Box::new(spec.at.clone()),
                file: file.to_path_buf(),
                found: name.clone(),
                allowed: allowed(name, &all),
            });
        }
    }
    Ok(names.map_or_else(Vec::new, |names| {
        let lists: Vec<&[String]> = faces.iter().map(|spec| spec.of.as_slice()).collect();
        names.labels(&lists)
    }))
}

fn allowed(name: &str, all: &BTreeMap<&str, usize>) -> String {
    if all.is_empty() {
        return "none, since the file names no faces; OBJ, glTF, ASE and 3DS files can".into();
    }
    let meant = nearest(&name.to_lowercase(), all.keys().copied());
    let meant = meant.map_or_else(String::new, |meant| format!(" (did you mean `{meant}`?)"));
    let mut shown: Vec<&str> = all.keys().copied().take(MOST_SHOWN).collect();
    if all.len() > MOST_SHOWN {
        shown.push("...");
    }
    format!("the names in the file{meant}: {}", shown.join(", "))
}

/// Of the names, in a message.
const MOST_SHOWN: usize = 20;
