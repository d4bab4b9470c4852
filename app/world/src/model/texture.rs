//! Pictures in colour that lie on models, from PNG and JPEG files.
//!
//! Model: every picture becomes red, green, blue and opacity of eight bits each; what is larger than a window shows is made
//! smaller by halves. Nothing is believed: sizes are checked before memory is taken, and a decoder that panics has refused.

use std::io::Cursor;
use std::panic::{AssertUnwindSafe, catch_unwind};

use png::{ColorType, Decoder, DecodingError, Limits, Transformations};
use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

/// A picture that lies on triangles.
#[derive(Clone, PartialEq, Eq)]
pub struct Texture {
    /// Columns and rows.
    pub size: [u32; 2],
    /// Red, green, blue and opacity of each place, as screens show them (sRGB); rows from above.
    pub texels: Vec<[u8; 4]>,
    /// Continuation beyond its edges, along its rows and along its columns.
    pub wraps: [Wrap; 2],
    /// True if light goes through where it is not opaque.
    pub is_clear: bool,
}

/// Continuation beyond the edge of a picture.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Wrap {
    /// The picture again.
    #[default]
    Repeat,
    /// Its mirror image.
    Mirror,
    /// The edge's own colour.
    Edge,
}

impl std::fmt::Debug for Texture {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { size: [columns, rows], wraps, .. } = self;
        write!(f, "Texture({columns} x {rows}, {wraps:?})")
    }
}

/// Pictures that may be there, for messages.
pub(super) const ALLOWED: &str = "a PNG or JPEG file of at most 67 million places, 16384 on a side";
/// Columns, or rows, of a picture that is read at most.
const MOST_SIDE: usize = 16_384;
/// Places of a picture that is read at most: half a gigabyte while it is made smaller.
const MOST_TEXELS: usize = 1 << 26;
/// Columns, or rows, that are kept at most.
const MOST_SIDE_KEPT: u32 = 4096;
/// Bytes that a decoder may take for itself.
const DECODER_BYTES: usize = 64 << 20;

impl Texture {
    /// The picture in the bytes of a PNG or JPEG file; repeated beyond its edges.
    ///
    /// # Errors
    /// Words for that which was found in place of one.
    pub fn read(bytes: &[u8]) -> Result<Self, String> {
        let read = match bytes {
            [0x89, b'P', b'N', b'G', ..] => read_png,
            [0xff, 0xd8, ..] => read_jpeg,
            [] => return Err("nothing".into()),
            _ => return Err(kind(bytes).into()),
        };
        let decoded = catch_unwind(AssertUnwindSafe(|| read(bytes)));
        let mut texture = decoded.unwrap_or_else(|_| Err("a damaged file".into()))?;
        while texture.size.iter().any(|side| *side > MOST_SIDE_KEPT) {
            texture = texture.halved();
        }
        Ok(texture)
    }

    fn new([columns, rows]: [usize; 2], texels: Vec<[u8; 4]>) -> Result<Self, String> {
        if texels.is_empty() || texels.len() != columns * rows {
            return Err("a damaged file".into());
        }
        let wraps = [Wrap::default(); 2];
        Ok(Self { size: [columns as u32, rows as u32], texels, wraps, is_clear: false })
    }

    /// Lets light through: as much as its places say, or all and nothing where these are on either side of `cutoff`.
    #[must_use]
    pub(super) fn cleared(mut self, cutoff: Option<f64>) -> Self {
        if let Some(cutoff) = cutoff {
            for texel in &mut self.texels {
                texel[3] = if f64::from(texel[3]) / 255.0 < cutoff { 0 } else { 255 };
            }
        }
        self.is_clear = self.texels.iter().any(|texel| texel[3] < 255);
        self
    }

    /// Lets no light through, whatever its places say.
    #[must_use]
    pub(super) fn opaque(mut self) -> Self {
        self.texels.iter_mut().for_each(|texel| texel[3] = 255);
        self
    }

    /// Half as large along each side of more than one place.
    fn halved(&self) -> Self {
        let [columns, rows] = self.size;
        let size = self.size.map(|side| (side / 2).max(1));
        let places = (0..size[1]).flat_map(|row| (0..size[0]).map(move |column| [column, row]));
        let texels = places.map(|[column, row]| {
            let from = [[0, 0], [1, 0], [0, 1], [1, 1]].map(|[right, down]| {
                let column = (2 * column + right).min(columns - 1);
                let row = (2 * row + down).min(rows - 1);
                self.texels[(row * columns + column) as usize]
            });
            std::array::from_fn(|k| (from.iter().map(|texel| u16::from(texel[k])).sum::<u16>() / 4) as u8)
        });
        Self { size, texels: texels.collect(), ..*self }
    }
}

/// Kind of a file that is no picture that can be read.
fn kind(bytes: &[u8]) -> &'static str {
    let kinds: [(&[u8], _); 7] = [
        (b"RIFF", "a WebP file"),
        (b"\xabKTX", "a KTX file"),
        (b"GIF8", "a GIF file"),
        (b"BM", "a BMP file"),
        (b"II*\0", "a TIFF file"),
        (b"MM\0*", "a TIFF file"),
        (b"DDS ", "a DDS file"),
    ];
    let found = kinds.iter().find(|(begin, _)| bytes.starts_with(begin));
    found.map_or("a file of another kind", |(_, kind)| kind)
}

fn checked([columns, rows]: [usize; 2]) -> Result<[usize; 2], String> {
    let is_small = [columns, rows].iter().all(|side| (1..=MOST_SIDE).contains(side));
    if is_small && columns * rows <= MOST_TEXELS {
        return Ok([columns, rows]);
    }
    Err(format!("a picture of {columns} x {rows}"))
}

fn read_png(bytes: &[u8]) -> Result<Texture, String> {
    let damaged = |cause: DecodingError| format!("a damaged PNG file ({cause})");
    let mut decoder = Decoder::new_with_limits(Cursor::new(bytes), Limits { bytes: DECODER_BYTES });
    decoder.set_transformations(Transformations::EXPAND | Transformations::STRIP_16);
    let mut reader = decoder.read_info().map_err(damaged)?;
    let size = checked([reader.info().width as usize, reader.info().height as usize])?;
    let (colour, _) = reader.output_color_type();
    let mut bytes = vec![0; size[0] * size[1] * colour.samples()];
    reader.next_frame(&mut bytes).map_err(damaged)?;
    let texels = match colour {
        ColorType::Grayscale => bytes.iter().map(|&grey| [grey, grey, grey, 255]).collect(),
        ColorType::GrayscaleAlpha => {
            bytes.as_chunks().0.iter().map(|&[grey, opacity]| [grey, grey, grey, opacity]).collect()
        }
        ColorType::Rgb => bytes.as_chunks().0.iter().map(|&[r, g, b]| [r, g, b, 255]).collect(),
        _ => bytes.as_chunks().0.to_vec(),
    };
    Texture::new(size, texels)
}

fn read_jpeg(bytes: &[u8]) -> Result<Texture, String> {
    // The decoder makes grey of what is missing.
    if !has_jpeg_end(bytes) {
        return Err("a JPEG file that is cut short".into());
    }
    let options = DecoderOptions::default()
        .set_max_width(MOST_SIDE)
        .set_max_height(MOST_SIDE)
        .jpeg_set_out_colorspace(ColorSpace::RGB);
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(bytes), options);
    let damaged = |cause| format!("a damaged JPEG file ({cause})");
    decoder.decode_headers().map_err(damaged)?;
    let info = decoder.info().ok_or("a damaged JPEG file")?;
    let size = checked([usize::from(info.width), usize::from(info.height)])?;
    let pixels = decoder.decode().map_err(damaged)?;
    let texels = match decoder.output_colorspace() {
        Some(ColorSpace::Luma) => pixels.iter().map(|&grey| [grey, grey, grey, 255]).collect(),
        _ => pixels.as_chunks().0.iter().map(|&[r, g, b]| [r, g, b, 255]).collect(),
    };
    Texture::new(size, texels)
}

/// True if the marker of the end comes behind the last scan, in whose data no marker can be.
fn has_jpeg_end(bytes: &[u8]) -> bool {
    let last = |marker: [u8; 2]| bytes.windows(2).rposition(|pair| pair == marker);
    last([0xff, 0xd9]) > last([0xff, 0xda])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn png(size: [u32; 2], colour: ColorType, bytes: &[u8]) -> Vec<u8> {
        let mut made = Vec::new();
        let mut encoder = png::Encoder::new(&mut made, size[0], size[1]);
        encoder.set_color(colour);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.write_header().unwrap().write_image_data(bytes).unwrap();
        made
    }

    #[test]
    fn pictures_of_all_kinds_of_png_have_four_values_a_place() {
        for (colour, bytes, texels) in [
            (ColorType::Grayscale, &[7, 9][..], [[7, 7, 7, 255], [9, 9, 9, 255]]),
            (ColorType::GrayscaleAlpha, &[7, 1, 9, 2], [[7, 7, 7, 1], [9, 9, 9, 2]]),
            (ColorType::Rgb, &[1, 2, 3, 4, 5, 6], [[1, 2, 3, 255], [4, 5, 6, 255]]),
            (ColorType::Rgba, &[1, 2, 3, 4, 5, 6, 7, 8], [[1, 2, 3, 4], [5, 6, 7, 8]]),
        ] {
            let read = Texture::read(&png([2, 1], colour, bytes)).unwrap();
            assert_eq!((read.size, &read.texels[..]), ([2, 1], &texels[..]), "{colour:?}");
        }
    }

    /// Eight by eight places of one colour, by the standard's tables: Y and Cr are 40 above the middle, Cb is there.
    fn jpeg() -> Vec<u8> {
        let segment = |kind: u8, inner: &[u8]| [&[0xff, kind, 0, inner.len() as u8 + 2][..], inner].concat();
        // Of Huffman codes 0 and 10, or 0 alone, what they stand for.
        let codes = |table: u8, counts: [u8; 2], of: &[u8]| {
            segment(0xc4, &[&[table][..], &counts, &[0; 14], of].concat())
        };
        let parts = [1, 2, 3].map(|part| [part, 0x11, 0]);
        let scanned = [1, 2, 3].map(|part| [part, 0]);
        [
            vec![0xff, 0xd8],
            segment(0xdb, &[&[0][..], &[8; 64]].concat()),
            segment(0xc0, &[&[8, 0, 8, 0, 8, 3][..], parts.as_flattened()].concat()),
            codes(0x00, [1, 1], &[6, 0]),
            codes(0x10, [1, 0], &[0]),
            segment(0xda, &[&[3][..], scanned.as_flattened(), &[0, 63, 0]].concat()),
            // 0 101000 0, 10 0, 0 101000 0, and ones.
            vec![0x50, 0x8a, 0x1f, 0xff, 0xd9],
        ]
        .concat()
    }

    #[test]
    fn a_jpeg_has_the_colours_that_its_standard_says() {
        let read = Texture::read(&jpeg()).unwrap();
        assert_eq!((read.size, read.texels.len()), ([8, 8], 64));
        // 168 + 1.402 * 40, 168 - 0.714136 * 40, 168: decoders round in their own ways.
        for texel in read.texels {
            let off = std::iter::zip(texel, [224, 139, 168, 255]).map(|(found, right)| found.abs_diff(right));
            assert!(off.max() <= Some(1), "{texel:?}");
        }
    }

    #[test]
    fn a_wide_picture_is_halved_until_a_window_can_show_it() {
        let wide: Vec<u8> = (0..5000).map(|column| (column / 2 % 200) as u8).collect();
        let read = Texture::read(&png([5000, 1], ColorType::Grayscale, &wide)).unwrap();
        assert_eq!(read.size, [2500, 1]);
        assert!((0..2500).all(|k| read.texels[k][0] == (k % 200) as u8));
    }

    #[test]
    fn what_is_no_picture_is_told_as_what_it_is() {
        let whole = png([2, 1], ColorType::Rgb, &[1, 2, 3, 4, 5, 6]);
        for (bytes, words) in [
            (&b""[..], "nothing"),
            (b"%PDF", "a file of another kind"),
            (b"RIFF....WEBP", "a WebP file"),
            (&jpeg()[..40], "a JPEG file that is cut short"),
            (&jpeg()[..jpeg().len() - 2], "a JPEG file that is cut short"),
            (&[&jpeg()[..40], &[0xff, 0xd9]].concat(), "a damaged JPEG file"),
            (&whole[..whole.len() / 2], "a damaged PNG file"),
        ] {
            let said = Texture::read(bytes).unwrap_err();
            assert!(said.starts_with(words), "{words}: {said}");
        }
    }
}
