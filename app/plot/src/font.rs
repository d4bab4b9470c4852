//! The font that travels with the program: Ubuntu Light, under the Ubuntu Font Licence 1.0.

use crate::output::PlotError;
use crate::palette::Rgb;
use plotters::style::{Color, FontDesc, FontFamily, FontStyle, RGBColor, TextStyle, register_font};

/// What an SVG asks its viewer for, if that has no Ubuntu.
pub(crate) const SVG_FAMILIES: &str = "Ubuntu, 'DejaVu Sans', Arial, sans-serif";
/// What plotters calls the registered font, and writes into an SVG.
pub(crate) const FAMILY: &str = "sans-serif";

/// Makes the font known to the drawing library; doing it again changes nothing.
pub(crate) fn register() -> Result<(), PlotError> {
    register_font(FAMILY, FontStyle::Normal, epaint_default_fonts::UBUNTU_LIGHT).map_err(|_| PlotError::Font)
}

/// Text of this height (px) in this colour.
pub(crate) fn style(height: u32, colour: Rgb) -> TextStyle<'static> {
    let font = FontDesc::new(FontFamily::SansSerif, f64::from(height), FontStyle::Normal);
    let color = RGBColor(colour.0, colour.1, colour.2).to_backend_color();
    TextStyle { color, ..TextStyle::from(font) }
}
