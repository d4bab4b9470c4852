//! The legend: a strip above the data, in as many rows as it needs.

use crate::chart::Chart;
use crate::draw::{Sheet, sample};
use crate::font;
use crate::palette::INK;
use plotters::coord::Shift;
use plotters::prelude::{DrawingArea, DrawingBackend, Text};

/// Of text and sample (px, unscaled).
const TEXT: u32 = 14;
const SAMPLE: i32 = 30;
const GAP: i32 = 8;
/// An SVG's viewer may have a wider font than ours.
const AIR: f64 = 1.15;
/// Height of a row.
const ROW: i32 = 22;

/// An entry's place: row, left end, series.
struct Entry {
    row: i32,
    left: i32,
    series: usize,
}

/// How high the strip is (px).
pub(crate) fn height<DB: DrawingBackend>(chart: &Chart, area: &DrawingArea<DB, Shift>, sheet: Sheet) -> i32 {
    layout(chart, area, sheet).last().map_or(0, |entry| (entry.row + 1) * sheet.px(ROW))
}

/// Draws it at the top of `area`, from `left` on.
pub(crate) fn draw<DB: DrawingBackend>(
    chart: &Chart,
    area: &DrawingArea<DB, Shift>,
    left: i32,
    sheet: Sheet,
) -> Result<(), String> {
    for entry in layout(chart, area, sheet) {
        let (x, y) = (left + entry.left, entry.row * sheet.px(ROW) + sheet.px(ROW) / 2);
        sample(area, (x, y), sheet.px(SAMPLE), chart, entry.series, sheet)?;
        let at = (x + sheet.px(SAMPLE + GAP), y - sheet.px(TEXT as i32 / 2 - 2));
        let text = Text::new(chart.series[entry.series].name.clone(), at, font::style(sheet.text(TEXT), INK));
        area.draw(&text).map_err(|error| error.to_string())?;
    }
    Ok(())
}

fn layout<DB: DrawingBackend>(chart: &Chart, area: &DrawingArea<DB, Shift>, sheet: Sheet) -> Vec<Entry> {
    let style = font::style(sheet.text(TEXT), INK);
    // The strip begins where the plot does; some room is kept for that.
    let room = area.dim_in_pixel().0 as i32 - sheet.px(110);
    let mut entries: Vec<Entry> = Vec::new();
    let (mut row, mut left) = (0, 0);
    for (series, name) in
        chart.series.iter().map(|s| &s.name).enumerate().filter(|(_, name)| !name.is_empty())
    {
        let text = area.estimate_text_size(name, &style).map_or(0, |(width, _)| width);
        let width = sheet.px(SAMPLE + 3 * GAP) + (f64::from(text) * AIR) as i32;
        if left > 0 && left + width > room {
            (row, left) = (row + 1, 0);
        }
        entries.push(Entry { row, left, series });
        left += width;
    }
    entries
}
