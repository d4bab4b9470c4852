//! One axis: what it measures, and where a value lies on it.

use crate::ticks;
use plotters::coord::ranged1d::{DefaultFormatting, KeyPointHint, Ranged};
use std::ops::Range;

/// How values are spread along an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scale {
    /// Equal differences, equal lengths.
    Linear,
    /// Equal ratios, equal lengths; values not above zero lie at the lower rim.
    Log,
}

/// What an axis shows.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    /// The quantity, such as "wake-up error".
    pub quantity: String,
    /// Its unit, such as "us"; empty for a pure number.
    pub unit: String,
    /// How values are spread.
    pub scale: Scale,
    /// From and to; `None`: as the data need it.
    pub range: Option<(f64, f64)>,
}

impl Axis {
    /// A linear axis that fits the data.
    #[must_use]
    pub fn linear(quantity: &str, unit: &str) -> Self {
        Self { quantity: quantity.into(), unit: unit.into(), scale: Scale::Linear, range: None }
    }

    /// A logarithmic axis that fits the data.
    #[must_use]
    pub fn log(quantity: &str, unit: &str) -> Self {
        Self { scale: Scale::Log, ..Self::linear(quantity, unit) }
    }

    /// The same axis, from and to given values.
    #[must_use]
    pub fn within(self, from: f64, to: f64) -> Self {
        Self { range: Some((from, to)), ..self }
    }

    /// What stands beside the axis.
    pub(crate) fn label(&self) -> String {
        if self.unit.is_empty() {
            self.quantity.clone()
        } else {
            format!("{} ({})", self.quantity, self.unit)
        }
    }

    /// The axis with its ends, which are finite and apart whatever the data are.
    pub(crate) fn fit(&self, data: impl Iterator<Item = f64>) -> FittedAxis {
        let usable = |value: &f64| value.is_finite() && (self.scale == Scale::Linear || *value > 0.0);
        let ends = self.range.filter(|(from, to)| usable(from) && usable(to) && from < to);
        let (from, to) = ends.unwrap_or_else(|| {
            let (low, high) =
                data.filter(usable).fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
                    (low.min(value), high.max(value))
                });
            match self.scale {
                Scale::Linear => ticks::around(low, high),
                Scale::Log => ticks::decades_around(low, high),
            }
        });
        FittedAxis { scale: self.scale, from, to }
    }
}

/// An axis whose ends are known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct FittedAxis {
    pub(crate) scale: Scale,
    pub(crate) from: f64,
    pub(crate) to: f64,
}

impl FittedAxis {
    /// Where a value lies between the ends, 0 to 1.
    fn share(&self, value: f64) -> f64 {
        let share = match self.scale {
            Scale::Linear => (value - self.from) / (self.to - self.from),
            Scale::Log if value > 0.0 => (value / self.from).ln() / (self.to / self.from).ln(),
            Scale::Log => 0.0,
        };
        share.clamp(0.0, 1.0)
    }
}

impl Ranged for FittedAxis {
    type FormatOption = DefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, limit: (i32, i32)) -> i32 {
        limit.0 + (self.share(*value) * f64::from(limit.1 - limit.0)).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, hint: Hint) -> Vec<f64> {
        let fine = hint.weight().allow_light_points();
        match self.scale {
            Scale::Linear => ticks::linear(self.from, self.to, hint.bold_points()),
            Scale::Log => ticks::log(self.from, self.to, fine),
        }
    }

    fn range(&self) -> Range<f64> {
        self.from..self.to
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_lie_where_the_scale_puts_them_and_strangers_at_the_rim() {
        let linear = Axis::linear("x", "m").within(0.0, 10.0).fit([].into_iter());
        assert_eq!([0.0, 2.5, 10.0, 99.0, -1.0].map(|v| linear.map(&v, (0, 100))), [0, 25, 100, 100, 0]);
        let log = Axis::log("x", "s").within(1.0, 100.0).fit([].into_iter());
        assert_eq!([1.0, 10.0, 100.0, 0.0, -5.0].map(|v| log.map(&v, (0, 100))), [0, 50, 100, 0, 0]);
    }

    #[test]
    fn an_axis_without_usable_data_still_has_two_ends() {
        for axis in [Axis::linear("x", ""), Axis::log("x", "")] {
            for data in [vec![], vec![f64::NAN], vec![0.0], vec![3.0, 3.0]] {
                let fitted = axis.fit(data.into_iter());
                assert!(
                    fitted.from.is_finite() && fitted.to.is_finite() && fitted.from < fitted.to,
                    "{fitted:?}"
                );
            }
        }
    }

    #[test]
    fn a_range_that_is_none_is_not_obeyed() {
        let axis = Axis::log("x", "").within(-1.0, 5.0);
        assert_eq!(axis.fit([2.0, 50.0].into_iter()), FittedAxis { scale: Scale::Log, from: 1.0, to: 100.0 });
    }
}
