//! Greyscale PNG files become heights, and everything else is refused in words.

use drawn::{Depth, KINDS, encoded};
use png::{BitDepth, ColorType};
use std::path::Path;
use world::picture::{load_png, read_png};

use crate::drawn;

#[track_caller]
fn refused(bytes: &[u8], message: &str) {
    let found = read_png(bytes).expect_err("not a picture of heights").to_string();
    assert_eq!(found, message);
}

#[test]
fn eight_and_sixteen_bits_are_shares_of_white_row_by_row_from_the_top() {
    let eight = read_png(&encoded([3, 2], ColorType::Grayscale, BitDepth::Eight, &[0, 255, 51, 102, 1, 254]));
    let eight = eight.expect("a picture");
    assert_eq!(eight.size(), [3, 2]);
    // A quotient, rounded once.
    let expected = [0.0, 255.0, 51.0, 102.0, 1.0, 254.0].map(|x: f32| x / 255.0);
    assert_eq!(eight.values(), expected);
    assert_eq!(eight.range(), [0.0, 1.0]);
    // Big end first: 256 is 1, 0.
    let sixteen = encoded([2, 1], ColorType::Grayscale, BitDepth::Sixteen, &[1, 0, 255, 254]);
    assert_eq!(read_png(&sixteen).expect("a picture").values(), [256.0 / 65535.0, 65534.0 / 65535.0f32]);
}

#[test]
fn fewer_bits_than_eight_are_shares_of_white_too() {
    let one =
        read_png(&encoded([4, 1], ColorType::Grayscale, BitDepth::One, &[0b1010_0000])).expect("a picture");
    assert_eq!(one.values(), [1.0, 0.0, 1.0, 0.0]);
    let two =
        read_png(&encoded([4, 1], ColorType::Grayscale, BitDepth::Two, &[0b00_01_10_11])).expect("a picture");
    assert_eq!(two.values(), [0.0, 85.0 / 255.0, 170.0 / 255.0, 1.0f32]);
}

#[test]
fn colour_palettes_and_transparency_are_refused() {
    let of = |colour, pixels: &[u8]| encoded([1, 1], colour, BitDepth::Eight, pixels);
    let allowed = "allowed: greyscale of 1 to 16 bits without transparency, convert it to that";
    for (bytes, found) in [
        (of(ColorType::Rgb, &[1, 2, 3]), "a picture in colour"),
        // Grey in a file of colours may be meant as grey; but then its author can say so.
        (of(ColorType::Rgb, &[7, 7, 7]), "a picture in colour"),
        (of(ColorType::Rgba, &[1, 2, 3, 4]), "a picture in colour with transparency"),
        (of(ColorType::GrayscaleAlpha, &[1, 2]), "a greyscale picture with transparency"),
        (of(ColorType::Indexed, &[1]), "a picture with a palette of colours"),
    ] {
        refused(&bytes, &format!("found {found}; {allowed}"));
    }
}

#[test]
fn broken_files_are_refused_wherever_they_break() {
    refused(b"", "found an empty file; allowed: a PNG file");
    refused(
        b"\xff\xd8\xff\xe0 a JPEG",
        r"found a file that begins with `\xff\xd8\xff\xe0 a J`; allowed: a PNG file",
    );
    let whole = drawn::png(KINDS[0].1, 16, Depth::Sixteen);
    assert!(read_png(&whole).is_ok());
    for length in 8..whole.len() {
        let message = read_png(&whole[..length]).expect_err("cut short").to_string();
        assert!(
            message.starts_with("found a PNG file that is cut short or damaged ("),
            "{length}: {message}"
        );
        assert!(!message.contains('\n'));
    }
    let mut spoilt = whole.clone();
    for place in 8..whole.len() {
        spoilt[place] ^= 0x10;
        // Checksums find it, unless it is in a chunk that nobody needs; in any case nothing worse happens.
        if let Ok(grid) = read_png(&spoilt) {
            assert_eq!(grid.size(), [16, 16]);
        }
        spoilt[place] ^= 0x10;
    }
}

#[test]
fn more_texels_than_anybody_feels_are_refused_before_they_are_made() {
    // A header that promises 3 GB, and nothing behind it.
    let mut bytes = encoded([1, 1], ColorType::Grayscale, BitDepth::Sixteen, &[0, 0]);
    bytes[16..20].copy_from_slice(&40_000u32.to_be_bytes());
    bytes[20..24].copy_from_slice(&40_000u32.to_be_bytes());
    let sum = checksum(&bytes[12..29]);
    bytes[29..33].copy_from_slice(&sum.to_be_bytes());
    refused(&bytes, "a picture of 40000 x 40000 texels; allowed are 1 to 4096 along each side");
}

/// CRC-32 as PNG has it.
fn checksum(bytes: &[u8]) -> u32 {
    let step = |sum: u32, _| if sum & 1 == 1 { (sum >> 1) ^ 0xEDB8_8320 } else { sum >> 1 };
    !bytes.iter().fold(!0, |sum, byte| (0..8).fold(sum ^ u32::from(*byte), step))
}

#[test]
fn files_that_are_none_are_refused() {
    let place = tempfile::tempdir().expect("a directory");
    let missing = load_png(&place.path().join("bumps.png")).expect_err("not there").to_string();
    assert_eq!(missing, "no such file; name an existing PNG file");
    let directory = load_png(place.path()).expect_err("a directory").to_string();
    assert_eq!(directory, "it is a directory, no regular file; name a PNG file");
}

#[test]
fn the_committed_pictures_are_what_their_program_makes() {
    let pictures = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../config/pictures");
    for (kind, draw) in KINDS {
        let found =
            load_png(&pictures.join(format!("{kind}.png"))).unwrap_or_else(|error| panic!("{kind}: {error}"));
        assert_eq!(found.size(), [64, 64], "{kind}");
        for (found, made) in found.values().iter().zip(drawn::values(draw, 64)) {
            // Half a step of 16 bits, and what single precision makes of it (3e-8, 0.002 steps); sines may differ in
            // the last bit between machines and be rounded the other way.
            assert!((f64::from(*found) - made).abs() <= 0.505 / 65535.0, "{kind}: {found} {made}");
        }
    }
    let sizes: Vec<u64> = pictures
        .read_dir()
        .expect("the pictures")
        .map(|file| file.and_then(|file| file.metadata()).expect("a file").len())
        .collect();
    assert_eq!(sizes.len(), KINDS.len(), "each has its program");
    assert!(sizes.iter().sum::<u64>() < 50_000, "{sizes:?}");
}
