//! A case of the study: one way of replying, rate, damping and hand.

use clap::ValueEnum;
use io_driver::config::ReplyMode;
use io_driver::sim::hand::model_file::Firmness;
use nalgebra::{Unit, Vector3};
use rt_core::plain_text::Plain;
use std::path::PathBuf;
use std::str::FromStr;

/// A case.
#[derive(Debug, Clone, PartialEq)]
pub struct Case {
    /// How the driver waits for replies.
    pub mode: Mode,
    /// Ticks per second (Hz).
    pub rate_hz: f64,
    /// Contact damping of the wall (N s/m).
    pub damping_n_s_per_m: f64,
    /// Who holds the arm.
    pub hand: Hand,
}

/// Who holds the arm, and how tightly: `NAME` or `NAME:FIRMNESS`.
#[derive(Debug, Clone, PartialEq)]
pub struct Hand {
    /// A built-in hand's name, a file, or `nobody`.
    pub model: PathBuf,
    /// How tightly.
    pub firmness: Firmness,
}

/// How the driver waits for replies.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Mode {
    /// Motors are written when the reply is there, microseconds after the reading.
    SameTick,
    /// Motors are written half a tick after the reading.
    FixedPhase,
    /// Motors are written a tick after the reading, as in the thesis.
    NextTick,
}

/// The wall's normal, in the device's frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Axis {
    /// To the right.
    X,
    /// Up: the wall is a table.
    Y,
    /// To the user.
    Z,
}

impl Case {
    /// Length of a tick (s).
    pub fn period_s(&self) -> f64 {
        1.0 / self.rate_hz
    }
}

impl Hand {
    /// For people.
    pub fn name(&self) -> String {
        let model = Plain(self.model.file_stem().unwrap_or_default().display()).to_string();
        if model == "nobody" { model } else { format!("{model} {}", self.firmness.name()) }
    }
}

impl FromStr for Hand {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let Some((model, word)) = text.rsplit_once(':') else {
            return Ok(Self { model: text.into(), firmness: Firmness::Usual });
        };
        let firmness = Firmness::from_name(word)
            .ok_or_else(|| format!("found {word} behind the colon, allowed: light, usual, firm"))?;
        Ok(Self { model: model.into(), firmness })
    }
}

impl Mode {
    /// The configuration's word for it.
    pub fn reply_mode(self) -> ReplyMode {
        match self {
            Self::SameTick => ReplyMode::OnArrival,
            Self::FixedPhase => ReplyMode::FixedPhase,
            Self::NextTick => ReplyMode::NextTick,
        }
    }

    /// The name that a person reads and writes.
    pub fn name(self) -> &'static str {
        match self {
            Self::SameTick => "same-tick",
            Self::FixedPhase => "fixed-phase",
            Self::NextTick => "next-tick",
        }
    }
}

impl Axis {
    /// Away from the wall.
    pub fn normal(self) -> Unit<Vector3<f64>> {
        match self {
            Self::X => Vector3::x_axis(),
            Self::Y => Vector3::y_axis(),
            Self::Z => Vector3::z_axis(),
        }
    }
}

/// All of them, the rate changing fastest.
pub fn all(modes: &[Mode], rates_hz: &[f64], dampings: &[f64], hands: &[Hand]) -> Vec<Case> {
    let mut cases = Vec::new();
    for hand in hands {
        for &damping_n_s_per_m in dampings {
            for &mode in modes {
                for &rate_hz in rates_hz {
                    cases.push(Case { mode, rate_hz, damping_n_s_per_m, hand: hand.clone() });
                }
            }
        }
    }
    cases
}
