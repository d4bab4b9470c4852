//! From a description to bytes and files.

use crate::draw::Sheet;
use crate::figure::Figure;
use crate::font;
use plotters::prelude::{BitMapBackend, DrawingBackend, IntoDrawingArea, SVGBackend};
use rt_core::replacement;
use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use thiserror::Error;

/// Pixels of a PNG for each unit of the description.
const PNG_SCALE: f64 = 2.0;
/// Maker, as pictures tell it.
const MADE_BY: &str = "drawn by phantom3";
/// That is among the first so many bytes.
const MARKED_BYTES: u64 = 512;
/// A larger picture is a mistake: half a gigabyte of pixels.
const MOST_PIXELS: u64 = 1 << 27;

/// Why there is no picture.
#[derive(Debug, Error)]
pub enum PlotError {
    /// The built-in font was not accepted.
    #[error("the built-in font cannot be used; this build is broken")]
    Font,
    /// The drawing library failed.
    #[error("cannot draw the chart: {0}")]
    Drawing(String),
    /// Too large.
    #[error("a picture of {width} x {height} pixels was asked for; at most {MOST_PIXELS} pixels are drawn")]
    TooLarge {
        /// Its width (px).
        width: u64,
        /// Its height (px).
        height: u64,
    },
    /// The encoder failed.
    #[error("cannot encode the picture: {0}")]
    Encoding(#[from] png::EncodingError),
    /// The file could not be written.
    #[error("cannot write {file}: {}", rt_core::limits::with_remedy(.source))]
    Write {
        /// Which.
        file: PathBuf,
        /// What the system said.
        source: io::Error,
    },
}

pub(crate) fn svg(figure: &Figure) -> Result<String, PlotError> {
    let mut text = String::new();
    render(figure, SVGBackend::with_string(&mut text, figure.size()), 1.0)?;
    let ours = format!("font-family=\"{}\"", font::FAMILY);
    let text = text.replace(&ours, &format!("font-family=\"{}\"", font::SVG_FAMILIES));
    // Behind the first tag.
    let (tag, rest) = text.split_once('>').unwrap_or((&text, ""));
    Ok(format!("{tag}>\n<!-- {MADE_BY} -->{rest}"))
}

/// True if this file is a picture that a [`Figure`] wrote.
///
/// # Errors
/// If it cannot be read.
pub fn is_drawn_here(file: &Path) -> io::Result<bool> {
    let mut first = Vec::new();
    File::open(file)?.take(MARKED_BYTES).read_to_end(&mut first)?;
    let marks = [format!("<!-- {MADE_BY} -->"), format!("Software\0{MADE_BY}")];
    Ok(marks.iter().any(|mark| first.windows(mark.len()).any(|bytes| bytes == mark.as_bytes())))
}

pub(crate) fn png(figure: &Figure) -> Result<Vec<u8>, PlotError> {
    let (width, height) = figure.size();
    let [width, height] = [width, height].map(|length| (f64::from(length) * PNG_SCALE) as u64);
    if width * height > MOST_PIXELS {
        return Err(PlotError::TooLarge { width, height });
    }
    let (width, height) = (width as u32, height as u32);
    let mut pixels = vec![255; width as usize * height as usize * 3];
    render(figure, BitMapBackend::with_buffer(&mut pixels, (width, height)), PNG_SCALE)?;
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.add_text_chunk("Software".into(), MADE_BY.into())?;
    encoder.write_header()?.write_image_data(&pixels)?;
    Ok(bytes)
}

pub(crate) fn write_png(figure: &Figure, stem: &Path) -> Result<(), PlotError> {
    write_file(stem, ".png", &figure.png()?)
}

pub(crate) fn write_svg(figure: &Figure, stem: &Path) -> Result<(), PlotError> {
    write_file(stem, ".svg", figure.svg()?.as_bytes())
}

fn write_file(stem: &Path, suffix: &str, bytes: &[u8]) -> Result<(), PlotError> {
    // `with_extension` would cut a stem that holds a point.
    let mut name = stem.as_os_str().to_owned();
    name.push(suffix);
    let file = PathBuf::from(name);
    replacement::write(&file, bytes).map_err(|source| PlotError::Write { file, source })
}

fn render<DB: DrawingBackend>(figure: &Figure, backend: DB, scale: f64) -> Result<(), PlotError> {
    font::register()?;
    let root = backend.into_drawing_area();
    figure.draw(&root, Sheet { scale }).map_err(PlotError::Drawing)?;
    root.present().map_err(|error| PlotError::Drawing(error.to_string()))
}
