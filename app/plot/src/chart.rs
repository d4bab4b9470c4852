//! One pair of axes and what is drawn between them.

use crate::axis::Axis;
use crate::palette::{self, Rgb};

/// How a series looks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Look {
    /// Points joined by straight lines.
    Line,
    /// The same, dashed.
    Dashed,
    /// Each value holds until the next point's place: a histogram, a setting over time.
    Steps,
    /// Points alone.
    Dots,
}

/// Named points.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// What the legend calls it; empty: not in the legend.
    pub name: String,
    /// Points in the units of the axes; one that is not finite breaks the line.
    pub points: Vec<(f64, f64)>,
    /// How it looks.
    pub look: Look,
    /// Its colour; `None`: the palette's next.
    pub colour: Option<Rgb>,
}

impl Series {
    /// A series in the palette's next colour.
    #[must_use]
    pub fn new(name: &str, look: Look, points: Vec<(f64, f64)>) -> Self {
        Self { name: name.into(), points, look, colour: None }
    }

    /// The same in the colour number `index` of the palette.
    #[must_use]
    pub fn coloured(self, index: usize) -> Self {
        Self { colour: Some(palette::colour(index)), ..self }
    }

    /// The unbroken stretches of points, as the look joins them, without what runs along the floor.
    pub(crate) fn strokes(&self, floor: Option<f64>) -> Vec<Vec<(f64, f64)>> {
        let stretches = self.points.split(|(x, y)| !x.is_finite() || !y.is_finite());
        let drawn = stretches.filter(|stretch| !stretch.is_empty()).map(|stretch| match self.look {
            Look::Steps => steps(stretch),
            Look::Line | Look::Dashed | Look::Dots => stretch.to_vec(),
        });
        match floor {
            Some(floor) => drawn.flat_map(|stroke| above(&stroke, floor)).collect(),
            None => drawn.collect(),
        }
    }
}

fn steps(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let corners = points.windows(2).flat_map(|pair| [pair[0], (pair[1].0, pair[0].1)]);
    corners.chain(points.last().copied()).collect()
}

/// The parts of a stroke that rise above the floor, with their feet on it.
fn above(stroke: &[(f64, f64)], floor: f64) -> Vec<Vec<(f64, f64)>> {
    let low = |index: usize| stroke.get(index).is_none_or(|point| point.1 <= floor);
    let hidden = |index: usize| low(index.wrapping_sub(1)) && low(index) && low(index + 1);
    let mut parts = vec![Vec::new()];
    for (index, point) in stroke.iter().enumerate() {
        if hidden(index) {
            parts.push(Vec::new());
        } else {
            if let Some(part) = parts.last_mut() {
                part.push(*point);
            }
            // Down and up again are two feet: the way between them lies on the floor.
            if low(index) && low(index + 1) {
                parts.push(Vec::new());
            }
        }
    }
    parts.retain(|part| !part.is_empty());
    parts
}

/// Axes with series; a panel of a [`Figure`](crate::Figure).
#[derive(Debug, Clone, PartialEq)]
pub struct Chart {
    /// Above the panel; may be empty.
    pub title: String,
    /// The horizontal axis.
    pub x: Axis,
    /// The vertical axis.
    pub y: Axis,
    /// What is drawn, in this order: the last lies on top.
    pub series: Vec<Series>,
}

impl Chart {
    /// Axes without series yet.
    #[must_use]
    pub fn new(title: &str, x: Axis, y: Axis) -> Self {
        Self { title: title.into(), x, y, series: Vec::new() }
    }

    /// The same with one more series.
    #[must_use]
    pub fn with(mut self, series: Series) -> Self {
        self.series.push(series);
        self
    }

    /// The colour of series `index`.
    pub(crate) fn colour(&self, index: usize) -> Rgb {
        self.series[index].colour.unwrap_or_else(|| palette::colour(index))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_hold_each_value_until_the_next() {
        let series = Series::new("s", Look::Steps, vec![(0.0, 1.0), (2.0, 5.0), (3.0, 0.0)]);
        assert_eq!(series.strokes(None), [[(0.0, 1.0), (2.0, 1.0), (2.0, 5.0), (3.0, 5.0), (3.0, 0.0)]]);
    }

    #[test]
    fn nothing_is_drawn_along_the_floor_of_a_logarithmic_axis() {
        let at = |ys: &[f64]| ys.iter().enumerate().map(|(i, y)| (i as f64, *y)).collect::<Vec<_>>();
        let series = Series::new("s", Look::Line, at(&[0.0, 0.0, 5.0, 0.0, 0.0, 0.0, 7.0]));
        let strokes = series.strokes(Some(0.1));
        assert_eq!(strokes, [vec![(1.0, 0.0), (2.0, 5.0), (3.0, 0.0)], vec![(5.0, 0.0), (6.0, 7.0)]]);
        assert!(Series::new("s", Look::Line, at(&[0.0; 4])).strokes(Some(0.1)).is_empty());
    }

    #[test]
    fn a_value_that_is_no_number_breaks_the_line() {
        let points = vec![(0.0, 1.0), (1.0, f64::NAN), (2.0, 3.0), (3.0, 4.0)];
        let strokes = Series::new("s", Look::Line, points).strokes(None);
        assert_eq!(strokes, [vec![(0.0, 1.0)], vec![(2.0, 3.0), (3.0, 4.0)]]);
    }
}
