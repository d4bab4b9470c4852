//! Greyscale pictures of heights, from PNG files.
//!
//! Problem: pictures come from cameras, painting programs and elevation models. A reader that makes grey of a colour, or
//! 8 bits of 16, would silently make other heights than somebody drew.
//!
//! Model: greyscale of 1, 2, 4, 8 or 16 bits, interlaced or not; black becomes 0, white 1, and every value between what
//! it is as a share of white. 16 bits are kept: at 8 bits a step of a millimetre-high picture is 4 micrometres, which a
//! finger feels as grain on gentle slopes. Refused, since heights have neither: colour (also a palette) and transparency.
//! Notes on gamma or colour profiles are not followed: values are heights, not light.
//!
//! Cost: one pass; memory for the file, its bytes once more and four bytes a texel.

use haptics::{HeightGrid, HeightMapError, MAX_GRID_SIDE};
use png::{BitDepth, ColorType, Decoder, DecodingError, Limits, Transformations};
use rt_core::input_file;
use std::io::{self, Cursor};
use std::path::Path;

/// The most a picture file may have: the largest picture, uncompressed, and some room.
pub const MAX_PICTURE_BYTES: u64 = 2 * (MAX_GRID_SIDE * MAX_GRID_SIDE) as u64 + (1 << 20);

/// Why a picture file was refused. The file itself is named by whoever asked for it.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PictureError {
    /// There is no such file.
    #[error("no such file; name an existing PNG file")]
    NotFound,
    /// The file is there, but the system does not let us read it.
    #[error("cannot be read: {0}")]
    Unreadable(#[source] io::Error),
    /// A directory, a pipe or a device.
    #[error("{0}; name a PNG file")]
    NotAFile(#[source] io::Error),
    /// Larger than any picture we read.
    #[error("larger than {limit_bytes} bytes; allowed: at most so many")]
    TooLarge {
        /// The most that is read.
        limit_bytes: u64,
    },
    /// Another kind of file.
    #[error("found {found}; allowed: a PNG file")]
    NotPng {
        /// How it begins.
        found: String,
    },
    /// The file is cut short or spoilt.
    #[error("found a PNG file that is cut short or damaged ({cause}); allowed: a whole one, save it again")]
    Damaged {
        /// What the decoder said.
        cause: String,
    },
    /// It has more than heights.
    #[error("found {found}; allowed: greyscale of 1 to 16 bits without transparency, convert it to that")]
    NotGrey {
        /// What its pixels are.
        found: &'static str,
    },
    /// Too many texels.
    #[error(transparent)]
    Size(#[from] HeightMapError),
}

/// The heights in a picture file.
///
/// # Errors
/// The file cannot be read, or [`read_png`] refuses what is in it.
pub fn load_png(file: &Path) -> Result<HeightGrid, PictureError> {
    read_png(&input_file::read(file, MAX_PICTURE_BYTES).map_err(unreadable)?)
}

/// The heights in the bytes of a PNG file.
///
/// # Errors
/// It is no PNG, damaged, not greyscale, or too large.
pub fn read_png(bytes: &[u8]) -> Result<HeightGrid, PictureError> {
    if !bytes.starts_with(SIGNATURE) {
        return Err(PictureError::NotPng { found: begins_with(bytes) });
    }
    let mut decoder = Decoder::new_with_limits(Cursor::new(bytes), Limits { bytes: DECODER_BYTES });
    decoder.set_transformations(Transformations::EXPAND);
    let mut reader = decoder.read_info().map_err(|cause| damaged(&cause))?;
    let (width, height) = (reader.info().width as usize, reader.info().height as usize);
    let (colour, depth) = reader.output_color_type();
    if let Some(found) = more_than_grey(reader.info().color_type, colour) {
        return Err(PictureError::NotGrey { found });
    }
    let sides = 1..=MAX_GRID_SIDE;
    if !sides.contains(&width) || !sides.contains(&height) {
        // Before anything is made of that size.
        return Err(HeightMapError::Side { found: [width, height], allowed: MAX_GRID_SIDE }.into());
    }
    let bytes_each = if depth == BitDepth::Sixteen { 2 } else { 1 };
    let mut pixels = vec![0; width * height * bytes_each];
    reader.next_frame(&mut pixels).map_err(|cause| damaged(&cause))?;
    reader.finish().map_err(|cause| damaged(&cause))?;
    let values = if depth == BitDepth::Sixteen {
        let share = |pair: &[u8]| f32::from(u16::from_be_bytes([pair[0], pair[1]])) / f32::from(u16::MAX);
        pixels.chunks_exact(2).map(share).collect()
    } else {
        pixels.iter().map(|&byte| f32::from(byte) / f32::from(u8::MAX)).collect()
    };
    Ok(HeightGrid::new(width, height, values)?)
}

const SIGNATURE: &[u8] = b"\x89PNG\r\n\x1a\n";

/// What the decoder may take for itself, beside the picture.
const DECODER_BYTES: usize = 64 << 20;

/// What a file has that heights have not.
fn more_than_grey(found: ColorType, expanded: ColorType) -> Option<&'static str> {
    match (found, expanded) {
        (ColorType::Grayscale, ColorType::Grayscale) => None,
        (ColorType::Grayscale | ColorType::GrayscaleAlpha, _) => {
            Some("a greyscale picture with transparency")
        }
        (ColorType::Indexed, _) => Some("a picture with a palette of colours"),
        (ColorType::Rgb, _) => Some("a picture in colour"),
        (ColorType::Rgba, _) => Some("a picture in colour with transparency"),
    }
}

fn begins_with(bytes: &[u8]) -> String {
    match bytes {
        [] => "an empty file".into(),
        _ => format!("a file that begins with `{}`", bytes[..bytes.len().min(8)].escape_ascii()),
    }
}

fn damaged(cause: &DecodingError) -> PictureError {
    // On one line, whatever the decoder says.
    let cause = cause.to_string().split_whitespace().collect::<Vec<_>>().join(" ");
    PictureError::Damaged { cause }
}

fn unreadable(cause: io::Error) -> PictureError {
    match cause.kind() {
        io::ErrorKind::NotFound => PictureError::NotFound,
        io::ErrorKind::InvalidInput => PictureError::NotAFile(cause),
        io::ErrorKind::FileTooLarge => PictureError::TooLarge { limit_bytes: MAX_PICTURE_BYTES },
        _ => PictureError::Unreadable(cause),
    }
}
