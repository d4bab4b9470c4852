//! Reads a text file whole, with an upper bound, and says what is wrong when it cannot.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use crate::SceneError;
use crate::document::line_of;

/// The most a scene or layout file may have. A scene of ten thousand entities has about 2 MB;
/// the bound is there so that naming the wrong file (a mesh, `/dev/zero`) ends in a message.
pub const MAX_FILE_BYTES: u64 = 16 << 20;

/// The text of `file`.
pub(crate) fn read_text(file: &Path) -> Result<String, SceneError> {
    let bytes = read_bounded(file).map_err(|cause| unreadable(file, cause))?;
    if bytes.len() as u64 > MAX_FILE_BYTES {
        return Err(SceneError::TooLarge { file: file.into(), limit_bytes: MAX_FILE_BYTES });
    }
    String::from_utf8(bytes).map_err(|error| {
        let offset_bytes = error.utf8_error().valid_up_to();
        let line = line_of(error.as_bytes(), offset_bytes);
        SceneError::NotUtf8 { file: file.into(), line, offset_bytes }
    })
}

/// One byte more than allowed is enough to know that there is too much.
fn read_bounded(file: &Path) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    File::open(file)?.take(MAX_FILE_BYTES + 1).read_to_end(&mut bytes)?;
    Ok(bytes)
}

fn unreadable(file: &Path, cause: io::Error) -> SceneError {
    match cause.kind() {
        io::ErrorKind::NotFound => SceneError::NotFound { file: file.into() },
        _ => SceneError::Unreadable { file: file.into(), cause },
    }
}
