//! Charts as SVG and PNG from one description.
//!
//! Problem: a measurement is believed when it can be seen, on a machine without display, system fonts or a
//! spreadsheet, and in two formats: one for the paper, one for the mail.
//! Model: a [`Figure`] is a title over panels, a [`Chart`] is axes and [`Series`]; [`Figure::svg`] and
//! [`Figure::png`] draw the same description. The font travels with the program; an SVG names a family and
//! leaves the glyphs to whoever shows it.
//! Conventions: an axis names its quantity and its unit; a value that is not finite breaks a line; what lies
//! outside an axis is drawn at its rim. The legend stands above the data, never over it.
//! Cost: milliseconds a panel and ten thousand points; allocates freely. Not for a loop.

#![forbid(unsafe_code)]

mod axis;
mod chart;
mod draw;
mod figure;
mod font;
mod legend;
mod output;
pub mod palette;
mod ticks;

pub use axis::{Axis, Scale};
pub use chart::{Chart, Look, Series};
pub use figure::Figure;
pub use output::{PlotError, is_drawn_here};
