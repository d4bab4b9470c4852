//! Describes a hand in a TOML file.
//!
//! Model: one file is one way of holding, with every number at the usual strength; `[light]` and `[firm]` tell by what
//! stiffness and damping of grasp and arm are multiplied when somebody holds loosely or tightly.
//! Units: each key carries its own; lists are along the user's x (right), y (up) and z (towards the user).
//! Invariants: a [`HandModel`] that comes out has been checked: all numbers are finite and in ranges in which the
//! simulation is stable. Unknown keys are refused. Files are not opened here.
//! Cost: start-up only.

use std::path::Path;

use nalgebra::Vector3;
use serde::Deserialize;
use toml::Spanned;

use super::{GripSpec, HandModel, ImpedanceSpec, IntentionSpec, SpringDamper, TremorSpec};
use crate::toml_report::{Allowed, SpannedList, TomlReport, TomlText};

/// Names of the files that come with the program, see [`builtin`].
pub const BUILTIN_NAMES: [&str; 2] = ["pen-grip", "fingertip"];

/// How tightly somebody holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Firmness {
    /// Loosely.
    Light,
    /// As people did in the experiment that the numbers are from.
    #[default]
    Usual,
    /// Tightly.
    Firm,
}

/// Text of a hand model that comes with the program, so that an installed one finds it.
pub fn builtin(name: &str) -> Option<&'static str> {
    match name {
        "pen-grip" => Some(include_str!("../../../../config/hands/models/pen-grip.toml")),
        "fingertip" => Some(include_str!("../../../../config/hands/models/fingertip.toml")),
        _ => None,
    }
}

/// Reads and checks a hand model; `file` is only named in errors, never opened.
///
/// # Errors
/// Names file, line and key of the first mistake, what was found and what is allowed.
pub fn parse(text: &str, file: &Path, firmness: Firmness) -> Result<HandModel, TomlReport> {
    let toml = TomlText::new(text, file);
    let raw: Raw = toml.read()?;
    let usual = raw.impedance.check(&toml)?;
    // Both are checked whichever is wanted: a mistake must not wait for the day on which somebody holds firmly.
    let (light, firm) = (raw.light.check(&toml)?, raw.firm.check(&toml)?);
    let impedance = match firmness {
        Firmness::Light => light.of(&usual),
        Firmness::Usual => usual,
        Firmness::Firm => firm.of(&usual),
    };
    let tremor = match &raw.tremor {
        Some(tremor) => tremor.check(&toml)?,
        None => TremorSpec { rms_m: Vector3::zeros(), band_hz: [8.0, 12.0] },
    };
    Ok(HandModel {
        name: match firmness {
            Firmness::Light => format!("{}, light", raw.name),
            Firmness::Usual => raw.name,
            Firmness::Firm => format!("{}, firm", raw.name),
        },
        impedance,
        intention: raw.intention.check(&toml)?,
        tremor,
        minds_slip: raw.grip.minds_slip,
        grip: raw.grip.check(&toml)?,
    })
}

impl Firmness {
    /// From "light", "usual" or "firm".
    pub fn from_name(name: &str) -> Option<Self> {
        [Self::Light, Self::Usual, Self::Firm].into_iter().find(|firmness| firmness.name() == name)
    }

    /// "light", "usual" or "firm".
    pub fn name(self) -> &'static str {
        match self {
            Self::Light => "light",
            Self::Usual => "usual",
            Self::Firm => "firm",
        }
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Raw {
    name: String,
    impedance: RawImpedance,
    light: RawScale,
    firm: RawScale,
    intention: RawIntention,
    tremor: Option<RawTremor>,
    grip: RawGrip,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawImpedance {
    mass_kg: SpannedList,
    grasp_stiffness_n_per_m: SpannedList,
    grasp_damping_n_s_per_m: SpannedList,
    arm_stiffness_n_per_m: SpannedList,
    arm_damping_n_s_per_m: SpannedList,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawScale {
    grasp_stiffness_times: Spanned<f64>,
    grasp_damping_times: Spanned<f64>,
    arm_stiffness_times: Spanned<f64>,
    arm_damping_times: Spanned<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawIntention {
    bandwidth_hz: Spanned<f64>,
    speed_limit_m_per_s: Spanned<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawTremor {
    rms_m: SpannedList,
    band_hz: SpannedList,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawGrip {
    minds_slip: bool,
    believed_friction: Spanned<f64>,
    margin: Spanned<f64>,
    spare_n: Spanned<f64>,
    latency_s: Spanned<f64>,
    rise_n_per_s: Spanned<f64>,
    ease_n_per_s: Spanned<f64>,
    max_force_n: Spanned<f64>,
}

/// Factors of stiffness and damping.
struct Scale {
    grasp: [f64; 2],
    arm: [f64; 2],
}

// A fingertip has some grams, an arm some kilograms.
const MASS: Allowed = Allowed { min: 1e-3, max: 10.0, unit: "kg" };
const STIFFNESS: Allowed = Allowed { min: 1.0, max: 1e4, unit: "N/m" };
const DAMPING: Allowed = Allowed { min: 0.0, max: 100.0, unit: "N s/m" };
// With the above at most 400 N s/m on a tip of some ten grams: a plant that takes the grasp's force explicitly still
// is stable with sub-steps of 62 us.
const TIMES: Allowed = Allowed { min: 0.05, max: 4.0, unit: "times the usual" };
const BANDWIDTH: Allowed = Allowed { min: 0.1, max: 30.0, unit: "Hz" };
const SPEED: Allowed = Allowed { min: 0.01, max: 10.0, unit: "m/s" };
const AMPLITUDE: Allowed = Allowed { min: 0.0, max: 0.01, unit: "m" };
const TREMOR_BAND: Allowed = Allowed { min: 0.5, max: 30.0, unit: "Hz" };
const FRICTION: Allowed = Allowed { min: 0.05, max: 3.0, unit: "(friction coefficient)" };
const MARGIN: Allowed = Allowed { min: 0.05, max: 2.0, unit: "(share)" };
const SPARE: Allowed = Allowed { min: 0.0, max: 5.0, unit: "N" };
const LATENCY: Allowed = Allowed { min: 0.0, max: 1.0, unit: "s" };
const FORCE_RATE: Allowed = Allowed { min: 0.1, max: 100.0, unit: "N/s" };
const FORCE: Allowed = Allowed { min: 0.1, max: 50.0, unit: "N" };

impl RawImpedance {
    fn check(&self, toml: &TomlText<'_>) -> Result<ImpedanceSpec, TomlReport> {
        let axes = |list: &SpannedList, allowed| toml.numbers(list, allowed).map(Vector3::from);
        Ok(ImpedanceSpec {
            mass_kg: axes(&self.mass_kg, MASS)?,
            grasp: SpringDamper {
                stiffness_n_per_m: axes(&self.grasp_stiffness_n_per_m, STIFFNESS)?,
                damping_n_s_per_m: axes(&self.grasp_damping_n_s_per_m, DAMPING)?,
            },
            arm: SpringDamper {
                stiffness_n_per_m: axes(&self.arm_stiffness_n_per_m, STIFFNESS)?,
                damping_n_s_per_m: axes(&self.arm_damping_n_s_per_m, DAMPING)?,
            },
        })
    }
}

impl RawScale {
    fn check(&self, toml: &TomlText<'_>) -> Result<Scale, TomlReport> {
        let times = |number| toml.number(number, TIMES);
        Ok(Scale {
            grasp: [times(&self.grasp_stiffness_times)?, times(&self.grasp_damping_times)?],
            arm: [times(&self.arm_stiffness_times)?, times(&self.arm_damping_times)?],
        })
    }
}

impl Scale {
    fn of(&self, usual: &ImpedanceSpec) -> ImpedanceSpec {
        let times = |pair: &SpringDamper, [stiffness, damping]: [f64; 2]| SpringDamper {
            stiffness_n_per_m: pair.stiffness_n_per_m * stiffness,
            damping_n_s_per_m: pair.damping_n_s_per_m * damping,
        };
        ImpedanceSpec {
            mass_kg: usual.mass_kg,
            grasp: times(&usual.grasp, self.grasp),
            arm: times(&usual.arm, self.arm),
        }
    }
}

impl RawIntention {
    fn check(&self, toml: &TomlText<'_>) -> Result<IntentionSpec, TomlReport> {
        Ok(IntentionSpec {
            bandwidth_hz: toml.number(&self.bandwidth_hz, BANDWIDTH)?,
            speed_limit_m_per_s: toml.number(&self.speed_limit_m_per_s, SPEED)?,
        })
    }
}

impl RawTremor {
    fn check(&self, toml: &TomlText<'_>) -> Result<TremorSpec, TomlReport> {
        let band_hz: [f64; 2] = toml.numbers(&self.band_hz, TREMOR_BAND)?;
        if band_hz[0] > band_hz[1] {
            let found = format_args!("{} to {} Hz", band_hz[0], band_hz[1]).to_string();
            return Err(toml.refuse(self.band_hz.span(), found, "the lower frequency first"));
        }
        Ok(TremorSpec { rms_m: toml.numbers(&self.rms_m, AMPLITUDE)?.into(), band_hz })
    }
}

impl RawGrip {
    fn check(&self, toml: &TomlText<'_>) -> Result<GripSpec, TomlReport> {
        Ok(GripSpec {
            believed_friction: toml.number(&self.believed_friction, FRICTION)?,
            margin: toml.number(&self.margin, MARGIN)?,
            spare_n: toml.number(&self.spare_n, SPARE)?,
            latency_s: toml.number(&self.latency_s, LATENCY)?,
            rise_n_per_s: toml.number(&self.rise_n_per_s, FORCE_RATE)?,
            ease_n_per_s: toml.number(&self.ease_n_per_s, FORCE_RATE)?,
            max_force_n: toml.number(&self.max_force_n, FORCE)?,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [Firmness; 3] = [Firmness::Light, Firmness::Usual, Firmness::Firm];

    fn read(text: &str) -> Result<HandModel, String> {
        parse(text, Path::new("lab/hand.toml"), Firmness::Usual).map_err(|report| report.to_string())
    }

    fn built_in(name: &str, firmness: Firmness) -> HandModel {
        parse(builtin(name).unwrap(), Path::new(name), firmness).unwrap()
    }

    #[test]
    fn the_builtin_files_are_good_at_every_firmness_and_no_others_exist() {
        for name in BUILTIN_NAMES {
            let [light, usual, firm] = ALL.map(|firmness| built_in(name, firmness));
            for axis in 0..3 {
                let stiffness = [&light, &usual, &firm].map(|model| model.impedance.static_stiffness()[axis]);
                assert!(stiffness.is_sorted() && stiffness[0] < stiffness[2], "{name}: {stiffness:?}");
            }
            assert!(!usual.minds_slip && usual.tremor.rms_m.norm() > 0.0);
            assert_eq!(firm.name, format!("{}, firm", usual.name));
        }
        assert_eq!(builtin("fist"), None);
    }

    #[test]
    fn the_pen_grip_has_the_numbers_of_the_paper() {
        let pen = built_in("pen-grip", Firmness::Usual).impedance;
        assert_eq!(pen.mass_kg, Vector3::new(0.218, 0.269, 0.204));
        assert_eq!(pen.grasp.stiffness_n_per_m, Vector3::new(379.5, 552.4, 769.9));
        assert_eq!(pen.grasp.damping_n_s_per_m, Vector3::new(1.839, 3.609, 0.776));
        assert_eq!(pen.arm.stiffness_n_per_m, Vector3::new(78.75, 105.3, 271.7));
        assert_eq!(pen.arm.damping_n_s_per_m, Vector3::new(4.645, 6.430, 18.06));
    }

    #[test]
    fn the_fingertip_spans_what_was_measured_on_fingers() {
        let ends = [(Firmness::Light, 200.0, 2.0), (Firmness::Firm, 1500.0, 6.0)];
        for (firmness, stiffness, damping) in ends {
            let tip = built_in("fingertip", firmness).impedance;
            assert!((0.005..=0.006).contains(&tip.mass_kg.x));
            // The factors are written with three digits.
            assert!((tip.static_stiffness().x / stiffness - 1.0).abs() < 0.005, "{firmness:?}");
            assert!((tip.arm.damping_n_s_per_m.x / damping - 1.0).abs() < 0.005, "{firmness:?}");
        }
    }

    #[test]
    fn each_mistake_names_file_line_key_found_and_allowed() {
        let pen = builtin("pen-grip").unwrap();
        let line = |needle: &str| 1 + pen[..pen.find(needle).unwrap()].matches('\n').count();
        for (from, to, key, found) in [
            ("0.218,", "218.0,", "impedance.mass_kg[0]", "found 218, allowed: 0.001 to 10 kg"),
            ("[379.5, 552.4, 769.9]", "[379.5]", "impedance.grasp_stiffness_n_per_m", "found 1 values"),
            ("bandwidth_hz = 5.0", "bandwidth_hz = 500.0", "intention.bandwidth_hz", "0.1 to 30 Hz"),
            ("band_hz = [8.0, 12.0]", "band_hz = [12.0, 8.0]", "tremor.band_hz", "the lower frequency first"),
            ("latency_s = 0.075", "latency_s = 75", "grip.latency_s", "found 75, allowed: 0 to 1 s"),
            ("minds_slip = false", "minds_slip = 0", "grip.minds_slip", "boolean"),
            ("margin = 0.4", "margn = 0.4", "grip.margn", "margin"),
            ("arm_stiffness_times = 1.5", "arm_stiffness_times = nan", "firm.arm_stiffness_times", "NaN"),
        ] {
            assert_eq!(pen.matches(from).count(), 1, "{from}");
            let message = read(&pen.replace(from, to)).unwrap_err();
            let place = format!("lab/hand.toml:{}: `{key}`: ", line(from));
            assert!(message.starts_with(&place) && message.contains(found), "{message} // {place} {found}");
        }
    }

    #[test]
    fn without_a_tremor_the_hand_is_calm_and_firmness_has_a_name() {
        let pen = builtin("pen-grip").unwrap();
        let (start, end) = (pen.find("[tremor]").unwrap(), pen.find("[grip]").unwrap());
        let calm = read(&format!("{}{}", &pen[..start], &pen[end..])).unwrap();
        assert_eq!(calm.tremor.rms_m, Vector3::zeros());
        for firmness in ALL {
            assert_eq!(Firmness::from_name(firmness.name()), Some(firmness));
        }
        assert_eq!(Firmness::from_name("tight"), None);
    }
}
