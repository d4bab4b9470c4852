//! Reads a text file whole, with an upper bound, and says what is wrong when it cannot.

use std::io;
use std::path::Path;

use rt_core::{file_kind, input_file};

use crate::SceneError;
use crate::document::line_of;

/// The most a scene or layout file may have. A scene of ten thousand entities has about 2 MB;
/// the bound is there so that naming the wrong file (a mesh) ends in a message.
pub const MAX_FILE_BYTES: u64 = 16 << 20;

/// The text of `file`.
pub(crate) fn read_text(file: &Path) -> Result<String, SceneError> {
    let bytes = input_file::read(file, MAX_FILE_BYTES).map_err(|cause| unreadable(file, cause))?;
    if input_file::is_utf16(&bytes) {
        return Err(unreadable(file, io::Error::new(io::ErrorKind::InvalidData, input_file::UTF16)));
    }
    if let Some(words) = file_kind::mistaken_for_text(&bytes) {
        return Err(unreadable(file, io::Error::new(io::ErrorKind::InvalidData, words)));
    }
    String::from_utf8(bytes).map_err(|error| {
        let offset_bytes = error.utf8_error().valid_up_to();
        let line = line_of(error.as_bytes(), offset_bytes);
        SceneError::NotUtf8 { file: file.into(), line, offset_bytes }
    })
}

fn unreadable(file: &Path, cause: io::Error) -> SceneError {
    match cause.kind() {
        io::ErrorKind::NotFound => SceneError::NotFound { file: file.into() },
        io::ErrorKind::FileTooLarge => {
            SceneError::TooLarge { file: file.into(), limit_bytes: MAX_FILE_BYTES }
        }
        _ => SceneError::Unreadable { file: file.into(), cause },
    }
}
