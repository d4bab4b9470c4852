//! `[gimbal]`: three more encoders, which measure how a thimble or a stylus turns about the tip.
//!
//! Model: counters as wide as the joints', on the same card, one for each of yaw, pitch and roll (axes in
//! [`crate::kinematics::gimbal`]), zeroed together with the joints.
//! Invariant: no counter answers for two angles.

use std::f64::consts::TAU;

use serde::Deserialize;
use toml::Spanned;

use super::arm::{channels, signs};
use crate::encoders::EncoderSpec;
use crate::toml_report::{Allowed, SpannedList, TomlReport, TomlText};

/// The table as it is written.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawGimbal {
    counts_per_rev: Spanned<i64>,
    reduction: SpannedList,
    sign: Spanned<Vec<Spanned<i64>>>,
    channel: Spanned<Vec<Spanned<i64>>>,
    home_angles_rad: SpannedList,
}

/// The table as values; the joints' encoders tell the counters' width and which channels are taken.
pub(super) fn check(
    toml: &TomlText<'_>,
    raw: &RawGimbal,
    joints: &EncoderSpec,
) -> Result<EncoderSpec, TomlReport> {
    Ok(EncoderSpec {
        channel: channels(toml, &raw.channel, &joints.channel)?,
        counts_per_rev: toml.integer(&raw.counts_per_rev, 4..=10_000_000)? as u32,
        count_bits: joints.count_bits,
        sign: signs(toml, &raw.sign)?,
        reduction: toml.numbers(&raw.reduction, REDUCTION)?,
        home_joint_angles_rad: toml.numbers(&raw.home_angles_rad, ANGLE)?,
    })
}

/// `buttons`: how many the handle has.
pub(super) fn buttons(toml: &TomlText<'_>, key: Option<&Spanned<i64>>) -> Result<u32, TomlReport> {
    key.map_or(Ok(0), |number| Ok(toml.integer(number, 0..=32)? as u32))
}

/// An encoder may sit on the axis itself.
const REDUCTION: Allowed = Allowed { min: 0.1, max: 1000.0, unit: "encoder turns per turn of the axis" };
const ANGLE: Allowed = Allowed { min: -TAU, max: TAU, unit: "rad" };

#[cfg(test)]
mod tests {
    use crate::device_file::{ArmFile, DeviceFile, builtin};
    use std::path::Path;

    const GIMBAL: &str = "[gimbal]\ncounts_per_rev = 4000\nreduction = [1.0, 1.0, 5.18]\nsign = [1, -1, 1]\n\
                          channel = [3, 4, 5]\nhome_angles_rad = [0.0, 0.25, 0.0]\n";

    fn parse(gimbal: &str) -> Result<ArmFile, String> {
        let text = format!("{}\n{gimbal}", builtin("premium-1.5").unwrap());
        match DeviceFile::parse(&text, Path::new("handle.toml")) {
            Ok(DeviceFile::Arm(arm)) => Ok(*arm),
            Ok(other) => panic!("{other:?}"),
            Err(error) => Err(error.to_string()),
        }
    }

    #[test]
    fn a_gimbal_is_three_more_encoders_and_none_is_none() {
        assert_eq!(parse("").unwrap().gimbal, None);
        let arm = parse(GIMBAL).unwrap();
        let gimbal = arm.gimbal.unwrap();
        assert_eq!((gimbal.channel, gimbal.sign, gimbal.counts_per_rev), ([3, 4, 5], [1, -1, 1], 4000));
        assert_eq!(gimbal.count_bits, arm.encoders.count_bits, "the same card");
        assert_eq!(gimbal.home_joint_angles_rad, [0.0, 0.25, 0.0]);
    }

    #[test]
    fn a_handle_has_the_buttons_that_its_description_says_and_else_none() {
        assert_eq!(parse("").unwrap().buttons, 0);
        let with = |line: &str| {
            let text = format!("{line}\n{}", builtin("premium-1.5").unwrap());
            DeviceFile::parse(&text, Path::new("handle.toml"))
        };
        assert!(matches!(with("buttons = 2"), Ok(DeviceFile::Arm(arm)) if arm.buttons == 2));
        assert!(with("buttons = 33").unwrap_err().to_string().contains("33"));
    }

    #[test]
    fn a_counter_that_is_taken_and_numbers_that_no_gimbal_has_are_refused() {
        for (from, to, words) in [
            ("[3, 4, 5]", "[3, 2, 5]", "2, which another encoder has"),
            ("[3, 4, 5]", "[3, 4, 4]", "4 twice"),
            ("[3, 4, 5]", "[3, 4, 8]", "8"),
            ("[1, -1, 1]", "[1, 0, 1]", "1 or -1"),
            ("[1.0, 1.0, 5.18]", "[1.0, 0.0, 5.18]", "encoder turns per turn of the axis"),
            ("4000", "0", "0"),
            ("home_angles_rad", "home", "home"),
        ] {
            let error = parse(&GIMBAL.replace(from, to)).unwrap_err();
            assert!(error.contains(words) && error.contains("handle.toml"), "{error}");
        }
    }
}
