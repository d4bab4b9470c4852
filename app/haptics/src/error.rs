//! Refuses parameters that no surface, friction law or finger can have.
//!
//! Every message names the parameter, what was found and what is allowed. Only set-up returns
//! errors; a tick always produces an output.

use std::fmt;

/// A parameter outside its allowed range.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum ParameterError {
    /// A single value outside its range.
    OutOfRange {
        /// Name of the parameter, with its unit.
        parameter: &'static str,
        /// What was found.
        value: f64,
        /// What is allowed, in words.
        allowed: &'static str,
    },
    /// A static friction coefficient below the dynamic one: breaking away would raise the force.
    StaticBelowDynamic {
        /// Static coefficient found.
        mu_s: f64,
        /// Dynamic coefficient found.
        mu_d: f64,
    },
    /// A point of a friction curve that cannot follow the one before, or has no possible ratio.
    CurvePoint {
        /// Which point, from 0.
        index: usize,
        /// Its speed found.
        speed_m_s: f64,
        /// Its friction ratio found.
        mu: f64,
        /// What is allowed, in words.
        allowed: &'static str,
    },
    /// A value above what is stable or can be rendered.
    AboveLimit {
        /// Name of the parameter, with its unit.
        parameter: &'static str,
        /// What was found.
        value: f64,
        /// The largest that is allowed.
        limit: f64,
        /// Where that comes from, in words.
        limit_is: &'static str,
    },
    /// A vector that should give a direction has no usable length.
    NoDirection {
        /// Name of the parameter.
        parameter: &'static str,
        /// Components found.
        value: [f64; 3],
    },
}

impl fmt::Display for ParameterError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::OutOfRange { parameter, value, allowed } => {
                write!(f, "{parameter} is {value}; allowed is {allowed}")
            }
            Self::StaticBelowDynamic { mu_s, mu_d } => {
                write!(f, "mu_s is {mu_s}; allowed is a finite number >= mu_d, which is {mu_d}")
            }
            Self::CurvePoint { index, speed_m_s, mu, allowed } => {
                write!(f, "point {index} of the curve is ({speed_m_s} m/s, {mu}); allowed are {allowed}")
            }
            Self::AboveLimit { parameter, value, limit, limit_is } => {
                write!(f, "{parameter} is {value}; allowed is at most {limit:.4}, {limit_is}")
            }
            Self::NoDirection { parameter, value: [x, y, z] } => {
                write!(f, "{parameter} is [{x}, {y}, {z}]; allowed is a finite vector that is not zero")
            }
        }
    }
}

impl std::error::Error for ParameterError {}

pub(crate) fn at_least_zero(parameter: &'static str, value: f64) -> Result<f64, ParameterError> {
    if value.is_finite() && value >= 0.0 {
        return Ok(value);
    }
    Err(ParameterError::OutOfRange { parameter, value, allowed: "a finite number >= 0" })
}

/// Two friction coefficients, of which the static one is not the lower.
pub(crate) fn static_at_least(mu_s: f64, mu_d: f64) -> Result<(), ParameterError> {
    at_least_zero("mu_s", mu_s)?;
    at_least_zero("mu_d", mu_d)?;
    if mu_s < mu_d { Err(ParameterError::StaticBelowDynamic { mu_s, mu_d }) } else { Ok(()) }
}

pub(crate) fn above_zero(parameter: &'static str, value: f64) -> Result<f64, ParameterError> {
    if value.is_finite() && value > 0.0 {
        return Ok(value);
    }
    Err(ParameterError::OutOfRange { parameter, value, allowed: "a finite number > 0" })
}

/// A share is finite and from 0 to 1.
pub(crate) fn share(parameter: &'static str, value: f64) -> Result<f64, ParameterError> {
    let allowed = "a number from 0 to 1";
    if (0.0..=1.0).contains(&value) {
        Ok(value)
    } else {
        Err(ParameterError::OutOfRange { parameter, value, allowed })
    }
}

pub(crate) fn finite(parameter: &'static str, value: f64) -> Result<f64, ParameterError> {
    if value.is_finite() {
        return Ok(value);
    }
    Err(ParameterError::OutOfRange { parameter, value, allowed: "a finite number" })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_names_the_parameter_the_value_and_what_is_allowed() {
        let message = at_least_zero("mu", -0.5).unwrap_err().to_string();
        assert_eq!(message, "mu is -0.5; allowed is a finite number >= 0");
        let message = ParameterError::StaticBelowDynamic { mu_s: 0.1, mu_d: 0.3 }.to_string();
        assert_eq!(message, "mu_s is 0.1; allowed is a finite number >= mu_d, which is 0.3");
    }
}
