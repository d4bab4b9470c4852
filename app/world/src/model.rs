//! Triangles from model files: Wavefront OBJ, STL, PLY, glTF 2.0, ASE and 3DS.
//!
//! Problem: such files come from everywhere, are cut short by full disks and written by programs that take liberties.
//! Whoever gets a message must find the place in a file of a million lines.
//!
//! Model: [`load`] opens the file; [`read_obj`], [`read_stl`] and the others take bytes. Nothing in a file is believed: every number
//! is checked to be one, every index to be in range, every length against what is there. What a reader returns is a
//! [`TriangleSoup`] with finite coordinates and valid indices; whether it makes a mesh is
//! [`haptics::mesh::Mesh::build`]'s business.
//!
//! Why parsers of our own: `tobj` 4.0 names neither line nor offender, lets NaN and free-form statements pass and cuts a
//! concave polygon as a fan; `stl_io` 0.11 takes a binary file whose header begins with "solid", which is common, for a
//! text, names no place, lets NaN pass, and takes as long for a million triangles as reading and building them does here.
//!
//! Units and axes: the file's own (glTF: metres, y up); a scene's `scale` makes metres of them, and its orientation turns them.
//! Cost: one pass; a million triangles take a fraction of a second.

mod appearance;
mod ase;
mod face_names;
mod foreign;
mod free_form;
#[allow(non_snake_case)] // Names carry their frame.
mod gltf;
mod obj;
mod patches;
mod ply;
mod polygon;
mod stl;
mod texture;
mod three_ds;
mod words;
mod write;

pub use appearance::{Appearance, Finish};
pub use ase::read_ase;
pub use face_names::FaceNames;
pub use free_form::read_free_form;
pub use gltf::read_gltf;
pub use obj::{line_of_face, read_obj, read_obj_with_uv};
pub use patches::{read_patches, write_patches};
pub use ply::read_ply;
pub use stl::read_stl;
pub use texture::{Texture, Wrap};
pub use three_ds::read_three_ds;
pub use write::write_obj;

use crate::error::SceneError;
use haptics::NurbsPatch;
use haptics::mesh::{CornerUv, TriangleSoup};
use rt_core::{input_file, separators};
use std::io;
use std::path::{Path, PathBuf};

/// The most a model file may have: a binary STL of twenty million triangles. The bound is there so that naming the
/// wrong file ends in a message.
pub const MAX_MODEL_BYTES: u64 = 1 << 30;

/// Enough of a text to know how its lines end.
const BEGIN_BYTES: usize = 1 << 16;

/// Why a model file was refused. The file itself is named by whoever asked for it.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ModelError {
    /// There is no such file.
    #[error("no such file; name an existing one")]
    NotFound,
    /// The file is there, but the system does not let us read it.
    #[error("cannot be read: {0}")]
    Unreadable(#[source] io::Error),
    /// A directory, a pipe or a device.
    #[error("{0}; name a file")]
    NotAFile(#[source] io::Error),
    /// Larger than any model we build.
    #[error("larger than {limit_bytes} bytes; allowed: at most so many")]
    TooLarge {
        /// The most that is read.
        limit_bytes: u64,
    },
    /// Neither its name nor its content says what it is.
    #[error("of no kind that is read, by its name and by its beginning; allowed: {KINDS} files")]
    UnknownFormat,
    /// What is in it is of another kind than its name says.
    #[error(
        "found {found} in a file whose name says {named}; allowed: a name that ends in .{ending} for that"
    )]
    Misnamed {
        /// Kind by its content.
        found: &'static str,
        /// Kind by its name.
        named: &'static str,
        /// Of the names of what was found.
        ending: &'static str,
    },
    /// A kind of model file that is not read.
    #[error("found a file of {kind}, which is not read; {advice}")]
    Foreign {
        /// Name of the format.
        kind: &'static str,
        /// Way to get a file that is read.
        advice: &'static str,
    },
    /// Something wrong in a text.
    #[error("line {line}: found {found}; allowed: {allowed}")]
    Line {
        /// Counted from 1.
        line: usize,
        /// Found in its place.
        found: String,
        /// Allowed there.
        allowed: String,
    },
    /// Something wrong in a binary file.
    #[error("byte {offset}: found {found}; allowed: {allowed}")]
    Byte {
        /// Counted from 0.
        offset: usize,
        /// Found in its place.
        found: String,
        /// Allowed there.
        allowed: String,
    },
    /// Something wrong in a file whose parts have names or numbers.
    #[error("{place}: found {found}; allowed: {allowed}")]
    Place {
        /// As the format calls it.
        place: String,
        /// Found in its place.
        found: String,
        /// Allowed there.
        allowed: String,
    },
    /// A picture is to lie on a model that cannot say where.
    #[error(
        "found no OBJ file, and of others no texture coordinates are read; allowed under a height map: an OBJ file with `vt`"
    )]
    NoTexture,
    /// Something wrong in a TOML file of patches; the message names the file.
    #[error(transparent)]
    Toml(#[from] Box<SceneError>),
    /// A file of patches is TOML or OBJ.
    #[error("neither TOML nor OBJ by its name; allowed: a file of patches that ends in .toml or .obj")]
    UnknownPatches,
    /// There is no surface in it.
    #[error("found no free-form surface in it; allowed: at least one")]
    NoPatch,
    /// There is nothing to touch in it.
    #[error("found no triangle in it{}; allowed: at least one", only_points(*.points))]
    NoTriangle {
        /// Points that there are instead.
        points: usize,
    },
}

fn only_points(points: usize) -> String {
    match points {
        0 => String::new(),
        1 => ", only a point, which has no surface".into(),
        _ => format!(
            ", only {points} points, which have no surface until a program for meshes makes one through them"
        ),
    }
}

/// A soup with something to touch.
fn with_triangles(soup: TriangleSoup) -> Result<TriangleSoup, ModelError> {
    if soup.faces.is_empty() { Err(ModelError::NoTriangle { points: soup.vertices.len() }) } else { Ok(soup) }
}

/// Names of the kinds of files that are read, for messages.
pub(crate) const KINDS: &str = "OBJ, STL, PLY, glTF, ASE or 3DS";

/// How a model is written down.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// Wavefront OBJ: text.
    Obj,
    /// STL: text or binary.
    Stl,
    /// PLY: text or binary.
    Ply,
    /// glTF 2.0: JSON, or binary as GLB.
    Gltf,
    /// ASCII scene export of 3D Studio MAX: text.
    Ase,
    /// 3D Studio: binary.
    ThreeDs,
}

impl Format {
    /// True of bytes that begin with lines of text, which end in line feeds.
    fn is_lines(self, bytes: &[u8]) -> bool {
        match self {
            Self::Obj | Self::Ply => true,
            Self::Stl => stl::is_text(bytes),
            Self::Gltf | Self::Ase | Self::ThreeDs => false,
        }
    }

    /// By the file's ending, in any case; where that says nothing, by its content.
    pub fn of(file: &Path, bytes: &[u8]) -> Option<Self> {
        let ending = file.extension().unwrap_or_default();
        let named = ENDINGS.iter().find(|(name, _)| ending.eq_ignore_ascii_case(name));
        named.map(|(_, format)| *format).or_else(|| Self::by_content(bytes))
    }

    /// And the ending of its files' names.
    fn name(self) -> (&'static str, &'static str) {
        match self {
            Self::Obj => ("OBJ", "obj"),
            Self::Stl => ("STL", "stl"),
            Self::Ply => ("PLY", "ply"),
            Self::Gltf => ("glTF", "gltf or .glb"),
            Self::Ase => ("ASE", "ase"),
            Self::ThreeDs => ("3DS", "3ds"),
        }
    }

    fn by_content(bytes: &[u8]) -> Option<Self> {
        let found = LOOKS.iter().find(|(looks_like_it, _)| looks_like_it(bytes));
        found.map(|(_, format)| *format)
    }
}

const ENDINGS: [(&str, Format); 7] = [
    ("obj", Format::Obj),
    ("stl", Format::Stl),
    ("ply", Format::Ply),
    ("gltf", Format::Gltf),
    ("glb", Format::Gltf),
    ("ase", Format::Ase),
    ("3ds", Format::ThreeDs),
];

/// Test of bytes for a format.
type Looks = fn(&[u8]) -> bool;

/// Those whose first bytes leave no doubt come first.
const LOOKS: [(Looks, Format); 6] = [
    (ply::looks_like_ply, Format::Ply),
    (gltf::looks_like_gltf, Format::Gltf),
    (ase::looks_like_ase, Format::Ase),
    (three_ds::looks_like_three_ds, Format::ThreeDs),
    (stl::looks_like_stl, Format::Stl),
    (obj::looks_like_obj, Format::Obj),
];

/// Whether the name is that of a model, of a kind that is read or of one that is refused as such.
pub fn is_named(file: &Path) -> bool {
    let ending = file.extension().unwrap_or_default();
    ENDINGS.iter().any(|(name, _)| ending.eq_ignore_ascii_case(name)) || foreign::foreign(file, b"").is_some()
}

/// True for a model: its name says so, or says neither that nor that it is a scene, and its content does.
pub fn is_model(file: &Path) -> bool {
    let is_toml = file.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("toml"));
    is_named(file) || !is_toml && read_file(file).is_ok_and(|bytes| Format::by_content(&bytes).is_some())
}

/// The bytes of a model file.
///
/// # Errors
/// The file cannot be read, is none, or is too large.
pub fn read_file(file: &Path) -> Result<Vec<u8>, ModelError> {
    input_file::read(file, MAX_MODEL_BYTES).map_err(unreadable)
}

/// The triangles in `bytes`, whose format `file`'s name or they themselves say.
///
/// # Errors
/// The first thing found to be wrong, with its place.
pub fn read(file: &Path, bytes: &[u8]) -> Result<TriangleSoup, ModelError> {
    match format(file, bytes)? {
        Format::Obj => read_obj(bytes),
        Format::Stl => read_stl(bytes),
        Format::Ply => read_ply(bytes),
        Format::Gltf => read_gltf(bytes, directory_of(file)),
        Format::Ase => read_ase(bytes),
        Format::ThreeDs => read_three_ds(bytes),
    }
}

fn directory_of(file: &Path) -> Option<&Path> {
    Some(file.parent().unwrap_or(Path::new("")))
}

/// Names of the faces that [`read`] reads; `None`: the format has no names for them.
///
/// # Errors
/// As [`read`].
pub fn read_names(file: &Path, bytes: &[u8]) -> Result<Option<FaceNames>, ModelError> {
    Ok(match format(file, bytes)? {
        Format::Obj => Some(obj::read_obj_names(bytes)?),
        Format::Stl | Format::Ply => None,
        Format::Gltf => Some(gltf::read_gltf_names(bytes, directory_of(file))?),
        Format::Ase => Some(ase::read_ase_names(bytes)?),
        Format::ThreeDs => Some(three_ds::read_three_ds_names(bytes)?),
    })
}

/// True if a file of this name may say how its faces look.
pub fn may_have_appearance(file: &Path) -> bool {
    Format::of(file, b"").is_none_or(|format| format == Format::Gltf)
}

/// The files that a model consists of beside itself (buffers and pictures of glTF), by their paths from its directory;
/// none of a file that cannot be read.
pub fn files_beside(file: &Path) -> Vec<PathBuf> {
    if !may_have_appearance(file) {
        return Vec::new();
    }
    let bytes = read_file(file).unwrap_or_default();
    match format(file, &bytes) {
        Ok(Format::Gltf) => gltf::names_beside(&bytes),
        _ => Vec::new(),
    }
}

/// Looks of the faces that [`read`] reads; `None`: the format has nothing on that, or nothing of it is read.
///
/// # Errors
/// As [`read`].
pub fn read_appearance(file: &Path, bytes: &[u8]) -> Result<Option<Appearance>, ModelError> {
    Ok(match format(file, bytes)? {
        Format::Gltf => Some(gltf::read_gltf_appearance(bytes, directory_of(file))?),
        _ => None,
    })
}

fn format(file: &Path, bytes: &[u8]) -> Result<Format, ModelError> {
    let format = Format::of(file, bytes).ok_or_else(|| match foreign::foreign(file, bytes) {
        Some((kind, advice)) => ModelError::Foreign { kind, advice },
        None => ModelError::UnknownFormat,
    })?;
    if input_file::is_utf16(bytes) && !matches!(format, Format::Stl | Format::ThreeDs) {
        let cause = io::Error::new(io::ErrorKind::InvalidData, input_file::UTF16);
        return Err(ModelError::Unreadable(cause));
    }
    let begin = bytes[..bytes.len().min(BEGIN_BYTES)].utf8_chunks().next().map_or("", |chunk| chunk.valid());
    if let Some(words) = separators::mistaken_ends(begin).filter(|_| format.is_lines(bytes)) {
        return Err(ModelError::Unreadable(io::Error::new(io::ErrorKind::InvalidData, words)));
    }
    let looks_like_it = LOOKS.iter().any(|(looks, of)| *of == format && looks(bytes));
    match Format::by_content(bytes) {
        Some(other) if !looks_like_it => {
            let [(found, ending), (named, _)] = [other, format].map(Format::name);
            Err(ModelError::Misnamed { found, named, ending })
        }
        _ => Ok(format),
    }
}

/// The triangles in `bytes` and the texture coordinates of their corners.
///
/// # Errors
/// As [`read`]; a format or a face without texture coordinates.
pub fn read_with_uv(file: &Path, bytes: &[u8]) -> Result<(TriangleSoup, Vec<CornerUv>), ModelError> {
    match format(file, bytes)? {
        Format::Obj => read_obj_with_uv(bytes),
        _ => Err(ModelError::NoTexture),
    }
}

/// The rational patches in `bytes`, as `file`'s ending says: TOML of ours, or OBJ's free-form surfaces.
///
/// # Errors
/// The first thing found to be wrong, with its place.
pub fn read_nurbs(file: &Path, bytes: &[u8]) -> Result<Vec<NurbsPatch>, ModelError> {
    let ending = file.extension().unwrap_or_default();
    if ending.eq_ignore_ascii_case("toml") {
        read_patches(file, bytes)
    } else if ending.eq_ignore_ascii_case("obj") {
        read_free_form(bytes)
    } else {
        Err(ModelError::UnknownPatches)
    }
}

/// The triangles in the file `file`.
///
/// # Errors
/// As [`read_file`] and [`read`].
pub fn load(file: &Path) -> Result<TriangleSoup, ModelError> {
    read(file, &read_file(file)?)
}

fn unreadable(cause: io::Error) -> ModelError {
    match cause.kind() {
        io::ErrorKind::NotFound => ModelError::NotFound,
        io::ErrorKind::InvalidInput => ModelError::NotAFile(cause),
        io::ErrorKind::FileTooLarge => ModelError::TooLarge { limit_bytes: MAX_MODEL_BYTES },
        _ => ModelError::Unreadable(cause),
    }
}

/// A number of a text file; not a number and infinity are none.
fn number(word: &[u8]) -> Option<f64> {
    let number: f64 = std::str::from_utf8(word).ok()?.parse().ok()?;
    number.is_finite().then_some(number)
}

/// What is allowed where this is no number.
fn a_number(word: Option<&[u8]>) -> String {
    let word = word.and_then(|word| std::str::from_utf8(word).ok()).unwrap_or_default();
    format!("a finite number{}", separators::hint_for_cell(word))
}

/// A piece of a file, short enough and harmless for a message.
fn shown(bytes: &[u8]) -> String {
    const LONGEST_BYTES: usize = 40;
    let (shown, rest) = bytes.split_at(bytes.len().min(LONGEST_BYTES));
    let dots = if rest.is_empty() { "" } else { "..." };
    format!("`{}{dots}`", shown.escape_ascii())
}
