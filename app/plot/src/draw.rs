//! A chart onto an area, whatever is behind it.

use crate::axis::{FittedAxis, Scale};
use crate::chart::{Chart, Look};
use crate::font;
use crate::legend;
use crate::palette::{FINE_GRID, GRID, INK, Rgb};
use crate::ticks;
use plotters::coord::Shift;
use plotters::prelude::{
    Cartesian2d, ChartBuilder, ChartContext, Circle, Color, DashedLineSeries, DrawingArea, DrawingBackend,
    LineSeries, PathElement, RGBColor, ShapeStyle, Text,
};

/// Of text and rims (px, unscaled).
const TITLE: u32 = 17;
const TITLE_ROW: i32 = 28;
const AXIS_NAME: u32 = 15;
const MARK: u32 = 14;
const LEFT: i32 = 78;
const BELOW: i32 = 52;
const RIM: i32 = 42;
const AIR: i32 = 8;

/// How many pixels one unit of the description is.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sheet {
    pub(crate) scale: f64,
}

impl Sheet {
    /// A length (px).
    pub(crate) fn px(self, length: i32) -> i32 {
        (f64::from(length) * self.scale).round() as i32
    }

    /// A height of text (px).
    pub(crate) fn text(self, height: u32) -> u32 {
        (f64::from(height) * self.scale).round() as u32
    }

    fn line(self, colour: Rgb, width: f64) -> ShapeStyle {
        solid(colour).stroke_width(((width * self.scale).round() as u32).max(1))
    }
}

fn solid(colour: Rgb) -> ShapeStyle {
    RGBColor(colour.0, colour.1, colour.2).filled()
}

/// Draws a chart over the whole of `area`: title, legend, axes, data.
pub(crate) fn chart<DB: DrawingBackend>(
    chart: &Chart,
    area: &DrawingArea<DB, Shift>,
    sheet: Sheet,
) -> Result<(), String> {
    let mut area = area.clone();
    if !chart.title.is_empty() {
        let (top, rest) = area.split_vertically(sheet.px(TITLE_ROW));
        let at = (sheet.px(LEFT + AIR), sheet.px(6));
        draw_text(&top, &chart.title, at, TITLE, sheet)?;
        area = rest;
    }
    let (strip, body) = area.split_vertically(legend::height(chart, &area, sheet) + sheet.px(4));
    legend::draw(chart, &strip, sheet.px(LEFT + AIR), sheet)?;
    let xs = chart.series.iter().flat_map(|series| series.points.iter().map(|point| point.0));
    let ys = chart.series.iter().flat_map(|series| series.points.iter().map(|point| point.1));
    let (x, y) = (chart.x.fit(xs), chart.y.fit(ys));
    let mut context = ChartBuilder::on(&body)
        .margin_right(sheet.px(RIM))
        .margin_left(sheet.px(AIR))
        .margin_top(sheet.px(AIR))
        .margin_bottom(sheet.px(AIR))
        .x_label_area_size(sheet.px(BELOW))
        .y_label_area_size(sheet.px(LEFT))
        .build_cartesian_2d(x, y)
        .map_err(|error| error.to_string())?;
    mesh(chart, &mut context, sheet)?;
    // On a logarithmic axis "none" has no place: nothing is drawn along the rim.
    let floor = (y.scale == Scale::Log).then_some(y.from);
    (0..chart.series.len()).try_for_each(|index| series(chart, index, floor, &mut context, sheet))
}

pub(crate) fn draw_text<DB: DrawingBackend>(
    area: &DrawingArea<DB, Shift>,
    text: &str,
    at: (i32, i32),
    height: u32,
    sheet: Sheet,
) -> Result<(), String> {
    let style = font::style(sheet.text(height), INK);
    area.draw(&Text::new(text.to_owned(), at, style)).map_err(|error| error.to_string())
}

type Context<'a, DB> = ChartContext<'a, DB, Cartesian2d<FittedAxis, FittedAxis>>;

fn mesh<DB: DrawingBackend>(
    chart: &Chart,
    context: &mut Context<'_, DB>,
    sheet: Sheet,
) -> Result<(), String> {
    let number = |value: &f64| ticks::text(*value);
    context
        .configure_mesh()
        .bold_line_style(sheet.line(GRID, 1.0))
        .light_line_style(sheet.line(FINE_GRID, 1.0))
        .axis_style(sheet.line(INK, 1.0))
        .x_label_formatter(&number)
        .y_label_formatter(&number)
        .x_desc(chart.x.label())
        .y_desc(chart.y.label())
        .axis_desc_style(font::style(sheet.text(AXIS_NAME), INK))
        .label_style(font::style(sheet.text(MARK), INK))
        .set_all_tick_mark_size(sheet.px(4))
        .draw()
        .map_err(|error| error.to_string())
}

fn series<DB: DrawingBackend>(
    chart: &Chart,
    index: usize,
    floor: Option<f64>,
    context: &mut Context<'_, DB>,
    sheet: Sheet,
) -> Result<(), String> {
    let (series, colour) = (&chart.series[index], chart.colour(index));
    let stroke = sheet.line(colour, 1.7);
    for points in series.strokes(floor) {
        let drawn = match series.look {
            Look::Line | Look::Steps if points.len() > 1 => {
                context.draw_series(LineSeries::new(points, stroke)).map(|_| ())
            }
            Look::Dashed if points.len() > 1 => {
                let (dash, gap) = (sheet.px(7), sheet.px(4));
                context.draw_series(DashedLineSeries::new(points, dash, gap, stroke)).map(|_| ())
            }
            // A lone point has no line to be seen by.
            _ => {
                let radius = sheet.px(2);
                let dots = points.into_iter().map(|point| Circle::new(point, radius, solid(colour)));
                context.draw_series(dots).map(|_| ())
            }
        };
        drawn.map_err(|error| error.to_string())?;
    }
    Ok(())
}

/// A piece of a series, for the legend.
pub(crate) fn sample<DB: DrawingBackend>(
    area: &DrawingArea<DB, Shift>,
    (x, y): (i32, i32),
    width: i32,
    chart: &Chart,
    index: usize,
    sheet: Sheet,
) -> Result<(), String> {
    let (look, colour) = (chart.series[index].look, chart.colour(index));
    let stroke = sheet.line(colour, 2.6);
    let part = |from: i32, to: i32| PathElement::new(vec![(x + from, y), (x + to, y)], stroke);
    let drawn = match look {
        Look::Line | Look::Steps => area.draw(&part(0, width)),
        Look::Dashed => {
            let parts = [part(0, width / 4), part(3 * width / 8, 5 * width / 8), part(3 * width / 4, width)];
            parts.iter().try_for_each(|part| area.draw(part))
        }
        Look::Dots => area.draw(&Circle::new((x + width / 2, y), sheet.px(4), solid(colour))),
    };
    drawn.map_err(|error| error.to_string())
}
