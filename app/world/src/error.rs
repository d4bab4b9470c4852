//! What can be wrong with a scene or layout file, one variant per cause.
//!
//! Every message stands alone in a terminal: `file:line: key: found ...; allowed: ...`. The
//! `file:line` form is the one editors jump to.

use std::fmt;
use std::io;
use std::path::PathBuf;

/// Where in a file a value stands, or should stand.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Location {
    /// The file, as it was named to us.
    pub file: PathBuf,
    /// Line, counted from 1. For a missing key: where the table that lacks it begins.
    pub line: usize,
    /// Full path of the key, such as `entity[1].shape.radius_m`; list positions count from 0.
    pub key: String,
}

impl fmt::Display for Location {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "{}:{}: {}", self.file.display(), self.line, self.key)
    }
}

/// Why a scene or layout file was refused.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SceneError {
    /// There is no such file.
    #[error("{}: no such file; name an existing TOML file", file.display())]
    NotFound {
        /// The file asked for.
        file: PathBuf,
    },
    /// The file is there, but the system does not let us read it.
    #[error("{}: cannot be read: {cause}", file.display())]
    Unreadable {
        /// The file asked for.
        file: PathBuf,
        /// What the system said.
        #[source]
        cause: io::Error,
    },
    /// The file is far larger than any scene.
    #[error("{}: larger than {limit_bytes} bytes, which is the most this file may have", file.display())]
    TooLarge {
        /// The file asked for.
        file: PathBuf,
        /// The most that is read.
        limit_bytes: u64,
    },
    /// The file is made of more values or tables than any scene.
    #[error("{}: more than {limit} {what}, which is the most this file may have", file.display())]
    TooMuch {
        /// The file asked for.
        file: PathBuf,
        /// The most that are read.
        limit: usize,
        /// Of what: `values`, `tables`.
        what: &'static str,
    },
    /// The file is not text.
    #[error("{}:{line}: byte {offset_bytes} is not UTF-8 text; save the file as UTF-8", file.display())]
    NotUtf8 {
        /// The file asked for.
        file: PathBuf,
        /// Line of the first byte that is not UTF-8, counted from 1.
        line: usize,
        /// Offset of that byte from the start of the file.
        offset_bytes: usize,
    },
    /// The text is not TOML.
    #[error("{}:{line}:{column}: not valid TOML: {message}", file.display())]
    Syntax {
        /// The file.
        file: PathBuf,
        /// Line, counted from 1.
        line: usize,
        /// Column in characters, counted from 1.
        column: usize,
        /// What the TOML parser said, on one line.
        message: String,
    },
    /// A key that no version knows.
    #[error("{at}: unknown key{}; allowed: {allowed}", did_you_mean(.suggestion.as_deref()))]
    UnknownKey {
        /// Where it stands.
        at: Box<Location>,
        /// The keys that may stand there.
        allowed: String,
        /// The key that was probably meant.
        suggestion: Option<String>,
    },
    /// A key of the scene format that this version does not implement.
    #[error("{at}: this key is not available in this version; available: {available}")]
    KeyNotAvailable {
        /// Where it stands.
        at: Box<Location>,
        /// The keys that may stand there.
        available: String,
    },
    /// A kind (of shape, of friction) that no version knows.
    #[error("{at}: unknown {what} `{found}`{}; allowed: {allowed}", did_you_mean(.suggestion.as_deref()))]
    UnknownKind {
        /// Where it stands.
        at: Box<Location>,
        /// What is being chosen: `shape kind` or `friction model`.
        what: &'static str,
        /// The word that was found.
        found: String,
        /// The words that may stand there.
        allowed: String,
        /// The word that was probably meant.
        suggestion: Option<String>,
    },
    /// A kind of the scene format that this version does not implement.
    #[error("{at}: {what} `{found}` is not available in this version; available: {available}")]
    KindNotAvailable {
        /// Where it stands.
        at: Box<Location>,
        /// What is being chosen: `shape kind` or `friction model`.
        what: &'static str,
        /// The word that was found.
        found: String,
        /// The words that may stand there.
        available: String,
    },
    /// A key that must be there is not.
    #[error("{at}: missing; allowed: {allowed}")]
    MissingKey {
        /// Where it should stand.
        at: Box<Location>,
        /// What may stand there.
        allowed: String,
    },
    /// A value of another type, such as a string for a number.
    #[error("{at}: found {found}; allowed: {allowed}")]
    WrongType {
        /// Where it stands.
        at: Box<Location>,
        /// What was found.
        found: String,
        /// What may stand there.
        allowed: String,
    },
    /// A number that is NaN or infinite.
    #[error("{at}: found {found}, which is not a finite number; allowed: {allowed}")]
    NotFinite {
        /// Where it stands.
        at: Box<Location>,
        /// What was found.
        found: String,
        /// What may stand there.
        allowed: String,
    },
    /// A value of the right type outside its range.
    #[error("{at}: found {found}; allowed: {allowed}")]
    OutOfRange {
        /// Where it stands.
        at: Box<Location>,
        /// What was found.
        found: String,
        /// What may stand there.
        allowed: String,
    },
    /// A direction of length zero.
    #[error("{at}: found the zero vector; allowed: a vector with a direction, of any length above 0")]
    NoDirection {
        /// Where it stands.
        at: Box<Location>,
    },
    /// An orientation that is no rotation.
    #[error(
        "{at}: found a quaternion of length {length}; allowed: w, x, y, z of length 1 (within {tolerance}){}",
        of_length_1(.wxyz)
    )]
    NotARotation {
        /// Where it stands.
        at: Box<Location>,
        /// What was found.
        wxyz: [f64; 4],
        /// Its length.
        length: f64,
        /// The difference from 1 that is taken as rounding in the file.
        tolerance: f64,
    },
    /// A matrix that no device's placement has.
    #[error(
        "{at}: found a matrix that stretches by {least:.3} to {most:.3} and makes a unit cube's volume {volume:.3}; allowed: stretches from {} to {}, and a positive volume (no reflection)",
        .allowed[0], .allowed[1]
    )]
    NotAPlacement {
        /// Where it stands.
        at: Box<Location>,
        /// Smallest singular value.
        least: f64,
        /// Largest singular value.
        most: f64,
        /// Determinant.
        volume: f64,
        /// What the singular values may be.
        allowed: [f64; 2],
    },
    /// Two ways to say how a device is turned.
    #[error(
        "{at}: found beside `orientation_wxyz`; allowed: one of the two, a matrix holds the turn as well"
    )]
    MatrixAndOrientation {
        /// Where the matrix stands.
        at: Box<Location>,
    },
    /// A name that would break the header of a recording.
    #[error("{at}: found the name {found}; allowed: 1 to {limit_bytes} of the characters A-Z a-z 0-9 _ -")]
    BadName {
        /// Where it stands.
        at: Box<Location>,
        /// The name, quoted.
        found: String,
        /// The most characters a name may have.
        limit_bytes: usize,
    },
    /// A name or device index that was already taken.
    #[error("{at}: found {found}, already taken {first}; allowed: a value used only once")]
    Duplicate {
        /// Where the second one stands.
        at: Box<Location>,
        /// The value, and whether it is a default.
        found: String,
        /// Where the first one stands: `on line 3`, or `in room.toml:3`.
        first: String,
    },
    /// A name that nothing has.
    #[error("{at}: found {found}; allowed: {allowed}")]
    NoSuchName {
        /// Where it stands.
        at: Box<Location>,
        /// The name, and perhaps the one that was meant.
        found: String,
        /// The names that there are.
        allowed: String,
    },
    /// Templates that build on each other without end.
    #[error(
        "{at}: found templates that build on each other in a circle, or more than {limit} deep; allowed: at most {limit}"
    )]
    TemplatesTooDeep {
        /// Where the template that is too much is named.
        at: Box<Location>,
        /// How many there may be.
        limit: usize,
    },
    /// An included file that cannot be read.
    #[error("{at}: {source}")]
    Included {
        /// Where it is included.
        at: Box<Location>,
        /// Why; names the file.
        source: Box<SceneError>,
    },
    /// A file that is a part of the scene already.
    #[error("{at}: found {}, which is {first}; allowed: each file once, since two things alike are two entities of a template", file.display())]
    IncludedTwice {
        /// Where it is included again.
        at: Box<Location>,
        /// The file.
        file: PathBuf,
        /// Where it came from: `the scene itself`, or who included it.
        first: String,
    },
    /// Files that include each other too deep.
    #[error("{at}: found a file included more than {limit} deep; allowed: at most {limit}")]
    IncludedTooDeep {
        /// Where the file that is too much is included.
        at: Box<Location>,
        /// How deep it may be.
        limit: usize,
    },
    /// Files that are too large together.
    #[error("{at}: found files of more than {limit_bytes} bytes together; allowed: at most that")]
    IncludedTooLarge {
        /// Place of the `include` that is too much.
        at: Box<Location>,
        /// The most that they may have.
        limit_bytes: u64,
    },
    /// A key that only the scene's own file can have.
    #[error("{at}: found in an included file, but it is for the scene's own file; allowed here: {allowed}")]
    OnlyInScene {
        /// Where it stands.
        at: Box<Location>,
        /// What may stand there.
        allowed: String,
    },
    /// More list entries than there can be.
    #[error("{at}: found {found} entries; allowed: at most {limit}")]
    TooMany {
        /// Where the first entry too many stands.
        at: Box<Location>,
        /// How many there are.
        found: usize,
        /// How many there may be.
        limit: usize,
    },
    /// A file of another kind.
    #[error("{at}: found a file of {found}, no scene; {advice}")]
    NotAScene {
        /// Where its first key stands that says so.
        at: Box<Location>,
        /// What it is a file of.
        found: &'static str,
        /// What it is for.
        advice: &'static str,
    },
    /// A scene nobody can touch.
    #[error("{}: no [[finger]]; allowed: 1 to {limit} of them", file.display())]
    NoFinger {
        /// The file.
        file: PathBuf,
        /// How many there may be.
        limit: usize,
    },
}

impl SceneError {
    /// Its place, if it has one key in one file.
    pub fn location(&self) -> Option<&Location> {
        match self {
            Self::UnknownKey { at, .. }
            | Self::NotAScene { at, .. }
            | Self::KeyNotAvailable { at, .. }
            | Self::UnknownKind { at, .. }
            | Self::KindNotAvailable { at, .. }
            | Self::MissingKey { at, .. }
            | Self::WrongType { at, .. }
            | Self::NotFinite { at, .. }
            | Self::OutOfRange { at, .. }
            | Self::NoDirection { at }
            | Self::NotARotation { at, .. }
            | Self::NotAPlacement { at, .. }
            | Self::MatrixAndOrientation { at }
            | Self::BadName { at, .. }
            | Self::Duplicate { at, .. }
            | Self::NoSuchName { at, .. }
            | Self::TemplatesTooDeep { at, .. }
            | Self::Included { at, .. }
            | Self::IncludedTwice { at, .. }
            | Self::IncludedTooDeep { at, .. }
            | Self::IncludedTooLarge { at, .. }
            | Self::OnlyInScene { at, .. }
            | Self::TooMany { at, .. } => Some(at),
            _ => None,
        }
    }
}

/// What to write instead: the same direction, or no turn at all.
fn of_length_1(wxyz: &[f64; 4]) -> String {
    let most = wxyz.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    if most == 0.0 {
        return ": no turn is [1.0, 0.0, 0.0, 0.0]".into();
    }
    let length = wxyz.iter().map(|x| (x / most).powi(2)).sum::<f64>().sqrt() * most;
    let [w, x, y, z] = wxyz.map(|x| x / length);
    format!(": this direction is [{w:.6}, {x:.6}, {y:.6}, {z:.6}]; angles are not taken")
}

fn did_you_mean(suggestion: Option<&str>) -> String {
    suggestion.map_or_else(String::new, |word| format!(" (did you mean {word}?)"))
}
