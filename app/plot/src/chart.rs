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

    /// The unbroken stretches of points, as the look joins them.
    pub(crate) fn strokes(&self) -> Vec<Vec<(f64, f64)>> {
        let stretches = self.points.split(|(x, y)| !x.is_finite() || !y.is_finite());
        let stretches = stretches.filter(|stretch| !stretch.is_empty());
        match self.look {
            Look::Steps => stretches.map(steps).collect(),
            Look::Line | Look::Dashed | Look::Dots => stretches.map(<[_]>::to_vec).collect(),
        }
    }
}

fn steps(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let corners = points.windows(2).flat_map(|pair| [pair[0], (pair[1].0, pair[0].1)]);
    corners.chain(points.last().copied()).collect()
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
        assert_eq!(series.strokes(), [[(0.0, 1.0), (2.0, 1.0), (2.0, 5.0), (3.0, 5.0), (3.0, 0.0)]]);
    }

    #[test]
    fn a_value_that_is_no_number_breaks_the_line() {
        let points = vec![(0.0, 1.0), (1.0, f64::NAN), (2.0, 3.0), (3.0, 4.0)];
        let strokes = Series::new("s", Look::Line, points).strokes();
        assert_eq!(strokes, [vec![(0.0, 1.0)], vec![(2.0, 3.0), (3.0, 4.0)]]);
    }
}
