//! Numbers in columns, whatever their value.

/// With sign, `width` wide as long as that can be; a number too long for it is told by its power of ten.
pub(super) fn signed(value: f64, width: usize, decimals: usize) -> String {
    let text = format!("{value:+width$.decimals$}");
    if text.len() <= width { text } else { format!("{value:+width$.0e}") }
}

/// Nanoseconds as microseconds, 8 wide.
pub(super) fn microseconds(ns: u64) -> String {
    let us = ns as f64 / 1e3;
    match us {
        _ if us < 1e4 => format!("{us:8.2}"),
        _ if us < 1e8 => format!("{us:8.0}"),
        _ => format!("{us:8.1e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_keep_their_width_for_any_value() {
        assert_eq!(signed(-0.04567, 8, 4), " -0.0457");
        for value in [0.0, -1e300, 1e-300, f64::NAN, f64::INFINITY, f64::NEG_INFINITY, f64::MAX, 99_999.9] {
            assert_eq!(signed(value, 8, 4).len(), 8, "{value}");
        }
        assert_eq!(microseconds(12_345), "   12.35");
        for ns in [0, 999, 9_999_999, 10_000_000, 1 << 36, u64::MAX] {
            assert_eq!(microseconds(ns).len(), 8, "{ns}");
        }
    }
}
