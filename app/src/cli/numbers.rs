//! Numbers of the command line: what is found where it is out of range, and what is allowed.

use crate::rig::LONGEST_RUN_S;
use rt_core::separators;

pub(super) fn parse_seconds(text: &str) -> Result<f64, String> {
    parse_number(text, "seconds", f64::MIN_POSITIVE, LONGEST_RUN_S)
}

pub(crate) fn parse_rate(text: &str) -> Result<f64, String> {
    parse_number(text, "Hz", 10.0, 20_000.0)
}

pub(super) fn parse_grace(text: &str) -> Result<f64, String> {
    parse_number(text, "seconds", 0.0, 3600.0)
}

pub(super) fn parse_seed(text: &str) -> Result<u64, String> {
    text.parse().map_err(|_| format!("found {text}, allowed: a whole number from 0 to {}", u64::MAX))
}

fn parse_number(text: &str, unit: &str, min: f64, max: f64) -> Result<f64, String> {
    let allowed = if min == f64::MIN_POSITIVE {
        format!("more than 0, at most {max} {unit}")
    } else {
        format!("{min} to {max} {unit}")
    };
    match text.parse::<f64>() {
        Ok(number) if (min..=max).contains(&number) => Ok(number),
        _ => Err(format!("found {text}, allowed: {allowed}{}", separators::hint_for_cell(text))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_out_of_range_name_what_is_allowed() {
        assert_eq!(parse_rate("0").unwrap_err(), "found 0, allowed: 10 to 20000 Hz");
        assert_eq!(parse_seconds("0").unwrap_err(), "found 0, allowed: more than 0, at most 86400 seconds");
        assert_eq!(
            parse_seconds("nan").unwrap_err(),
            "found nan, allowed: more than 0, at most 86400 seconds"
        );
        let comma = parse_seconds("1,5").unwrap_err();
        assert!(comma.ends_with("; a decimal number has a point, as in 0.1"), "{comma}");
        assert_eq!(parse_seconds("-1").unwrap_err(), "found -1, allowed: more than 0, at most 86400 seconds");
    }
}
