//! Units of lengths that people write where metres are meant.
//!
//! Model: by how much points reach too far, or further than the same points measured by the other device, tells their unit
//! where that is near the size of one.

/// A unit of length, smaller than the metre.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unit {
    /// A hundredth of a metre.
    Centimetre,
    /// 25.4 mm.
    Inch,
    /// A thousandth of a metre.
    Millimetre,
}

impl Unit {
    /// Units in a metre, the plural, and the factor as people write it.
    fn told(self) -> (f64, &'static str, &'static str) {
        match self {
            Self::Inch => (1.0 / 0.0254, "inches", "39.37"),
            Self::Centimetre => (100.0, "centimetres", "100"),
            Self::Millimetre => (1000.0, "millimetres", "1000"),
        }
    }

    /// The unit of which a metre has so many, give or take a fifth.
    pub(crate) fn of_ratio(ratio: f64) -> Option<Self> {
        let is_near = |unit: &Self| (ratio / unit.told().0 - 1.0).abs() < 0.2;
        [Self::Inch, Self::Centimetre, Self::Millimetre].into_iter().find(is_near)
    }

    /// The unit of points that reach so far, where only one makes a desktop device of them.
    pub(crate) fn of_extent(found: f64) -> Option<Self> {
        (found > MOST_CENTIMETRES).then_some(Self::Millimetre)
    }
}

/// In so many centimetres no desktop device's points lie.
const MOST_CENTIMETRES: f64 = 150.0;

/// Question to the user, and advice.
pub(crate) fn ask_unit(unit: Option<Unit>) -> String {
    match unit.map(Unit::told) {
        Some((_, name, factor)) => {
            format!("Are they {name}? The columns are metres: divide them by {factor}")
        }
        None => "The columns are metres: divide centimetres by 100, millimetres by 1000".into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_unit_is_known_by_its_size_and_told_with_its_factor() {
        for (ratio, words) in [
            (1003.0, "millimetres? The columns are metres: divide them by 1000"),
            (98.0, "centimetres? The columns are metres: divide them by 100"),
            (39.4, "inches? The columns are metres: divide them by 39.37"),
            (7.0, "divide centimetres by 100, millimetres by 1000"),
        ] {
            assert!(ask_unit(Unit::of_ratio(ratio)).ends_with(words), "{ratio}");
        }
        assert_eq!((Unit::of_extent(34.0), Unit::of_extent(340.0)), (None, Some(Unit::Millimetre)));
    }
}
