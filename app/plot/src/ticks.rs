//! Where an axis has its marks, and how their numbers are written.

/// Ends of a linear axis around the data, with a little air.
pub(crate) fn around(low: f64, high: f64) -> (f64, f64) {
    if low > high {
        return (0.0, 1.0);
    }
    if low == high {
        let air = if low == 0.0 { 1.0 } else { low.abs() / 2.0 };
        return (low - air, high + air);
    }
    // A quantity that begins near zero is shown from zero: differences are then not exaggerated.
    let from = if low >= 0.0 && low < 0.5 * high { 0.0 } else { low - 0.04 * (high - low) };
    (from, high + 0.04 * (high - low))
}

/// Ends of a logarithmic axis around the data: whole decades.
pub(crate) fn decades_around(low: f64, high: f64) -> (f64, f64) {
    if low > high {
        return (0.1, 10.0);
    }
    let from = low.log10().floor();
    let to = high.log10().ceil();
    (10_f64.powf(from), 10_f64.powf(if to > from { to } else { from + 1.0 }))
}

/// Marks at 1, 2 or 5 times a power of ten, about `wanted` of them.
pub(crate) fn linear(from: f64, to: f64, wanted: usize) -> Vec<f64> {
    let rough = (to - from) / wanted.max(2) as f64;
    let power = 10_f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].map(|n| n * power).into_iter().find(|step| *step >= rough);
    let step = step.unwrap_or(10.0 * power);
    if !(step.is_finite() && step > 0.0) {
        return vec![from, to];
    }
    let first = (from / step).ceil();
    let count = ((to / step).floor() - first) as usize + 1;
    (0..count.min(100)).map(|index| (first + index as f64) * step).collect()
}

/// Marks at the powers of ten; with `fine`, at their multiples too.
pub(crate) fn log(from: f64, to: f64, fine: bool) -> Vec<f64> {
    // The ends themselves are powers of ten only up to rounding.
    let inside = |value: &f64| *value >= from * (1.0 - 1e-9) && *value <= to * (1.0 + 1e-9);
    let decades = from.log10().floor() as i32..=to.log10().ceil() as i32;
    let multiples = if fine { 1..=9 } else { 1..=1 };
    decades
        .flat_map(|decade| multiples.clone().map(move |n| f64::from(n) * 10_f64.powi(decade)))
        .filter(inside)
        .take(400)
        .collect()
}

/// A mark's number, as short as it is unmistakable.
pub(crate) fn text(value: f64) -> String {
    if value == 0.0 {
        return "0".into();
    }
    let size = value.abs();
    if !(1e-3..1e6).contains(&size) {
        let exponent = size.log10().floor();
        let digits = tidy(format!("{:.2}", value / 10_f64.powf(exponent)));
        return format!("{digits}e{exponent:.0}");
    }
    // Four significant digits at least: neighbouring marks then differ in writing too.
    let decimals = (3.0 - size.log10().floor()).clamp(0.0, 6.0) as usize;
    tidy(format!("{value:.decimals$}"))
}

/// Without zeros behind the point.
fn tidy(text: String) -> String {
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').into() } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn linear_marks_are_round_and_inside() {
        assert_eq!(linear(0.0, 10.0, 5), [0.0, 2.0, 4.0, 6.0, 8.0, 10.0]);
        assert_eq!(linear(0.3, 1.1, 4), [0.4, 0.6000000000000001, 0.8, 1.0]);
        assert!(linear(0.0, f64::MIN_POSITIVE, 5).len() <= 100);
    }

    #[test]
    fn logarithmic_marks_are_decades_and_their_multiples() {
        assert_eq!(log(1.0, 100.0, false), [1.0, 10.0, 100.0]);
        assert_eq!(log(1.0, 10.0, true), [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0]);
    }

    #[test]
    fn numbers_are_short() {
        let written = [0.0, 0.001, 0.02, 1.5, 10.0, 2500.0, 123_456.0, 1e6, 2e-5, -0.5].map(text);
        assert_eq!(written, ["0", "0.001", "0.02", "1.5", "10", "2500", "123456", "1e6", "2e-5", "-0.5"]);
    }

    #[test]
    fn a_quantity_near_zero_is_shown_from_zero() {
        assert_eq!(around(1.0, 11.0).0, 0.0);
        assert!(around(10.0, 11.0).0 > 9.0);
    }
}
