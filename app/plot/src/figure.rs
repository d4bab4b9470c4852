//! A title over one or several charts.

use crate::chart::Chart;
use crate::draw::{self, Sheet};
use crate::font;
use crate::output::{self, PlotError};
use crate::palette::PENCIL;
use plotters::coord::Shift;
use plotters::prelude::{DrawingArea, DrawingBackend, Text, WHITE};
use std::path::Path;

const TITLE: u32 = 21;
const SUBTITLE: u32 = 14;
const TITLE_ROW: i32 = 36;
const SUBTITLE_ROW: i32 = 22;
const LEFT: i32 = 16;

/// What one file shows.
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    /// The first line.
    pub title: String,
    /// Lines under it, smaller: circumstances, sources.
    pub notes: Vec<String>,
    /// From top to bottom, of equal height.
    pub panels: Vec<Chart>,
    /// Width of the whole (px).
    pub width: u32,
    /// Height of a panel (px).
    pub panel_height: u32,
}

impl Figure {
    /// A figure of usual size.
    #[must_use]
    pub fn new(title: &str, panels: Vec<Chart>) -> Self {
        let panel_height = if panels.len() > 1 { 330 } else { 520 };
        Self { title: title.into(), notes: Vec::new(), panels, width: 980, panel_height }
    }

    /// The same with a line under the title.
    #[must_use]
    pub fn note(mut self, note: impl Into<String>) -> Self {
        self.notes.push(note.into());
        self
    }

    /// As SVG.
    ///
    /// # Errors
    /// If the drawing library fails.
    pub fn svg(&self) -> Result<String, PlotError> {
        output::svg(self)
    }

    /// As PNG, with twice the pixels in each direction, so that it is sharp where screens are.
    ///
    /// # Errors
    /// If the drawing library or the encoder fails.
    pub fn png(&self) -> Result<Vec<u8>, PlotError> {
        output::png(self)
    }

    /// Writes `stem.svg` and `stem.png`.
    ///
    /// # Errors
    /// If one cannot be made or written; the message names the file.
    pub fn write(&self, stem: &Path) -> Result<(), PlotError> {
        self.write_svg(stem)?;
        self.write_png(stem)
    }

    /// Writes `stem.svg` alone.
    ///
    /// # Errors
    /// If it cannot be made or written; the message names the file.
    pub fn write_svg(&self, stem: &Path) -> Result<(), PlotError> {
        output::write_svg(self, stem)
    }

    /// Writes `stem.png` alone.
    ///
    /// # Errors
    /// If it cannot be made or written; the message names the file.
    pub fn write_png(&self, stem: &Path) -> Result<(), PlotError> {
        output::write_png(self, stem)
    }

    /// Width and height (px), unscaled.
    pub(crate) fn size(&self) -> (u32, u32) {
        (self.width, self.head() as u32 + self.panel_height * self.panels.len() as u32)
    }

    fn head(&self) -> i32 {
        TITLE_ROW + SUBTITLE_ROW * self.notes.len() as i32 + 6
    }

    /// Draws everything onto `root`.
    pub(crate) fn draw<DB: DrawingBackend>(
        &self,
        root: &DrawingArea<DB, Shift>,
        sheet: Sheet,
    ) -> Result<(), String> {
        root.fill(&WHITE).map_err(|error| error.to_string())?;
        let (head, body) = root.split_vertically(sheet.px(self.head()));
        draw::draw_text(&head, &self.title, (sheet.px(LEFT), sheet.px(10)), TITLE, sheet)?;
        for (index, note) in self.notes.iter().enumerate() {
            let at = (sheet.px(LEFT), sheet.px(TITLE_ROW + SUBTITLE_ROW * index as i32));
            let text = Text::new(note.clone(), at, font::style(sheet.text(SUBTITLE), PENCIL));
            head.draw(&text).map_err(|error| error.to_string())?;
        }
        let areas = body.split_evenly((self.panels.len().max(1), 1));
        self.panels.iter().zip(&areas).try_for_each(|(panel, area)| draw::chart(panel, area, sheet))
    }
}
