//! The files that come with the program are good, and each mistake in them is named.

use std::path::Path;

use proptest::prelude::*;

use super::*;
use crate::kinematics::Mechanism;

const PREMIUM: &str = include_str!("../../../config/driver/devices/premium-1.5.toml");

fn parse(text: &str) -> Result<DeviceFile, DeviceFileError> {
    DeviceFile::parse(text, Path::new("lab/left.toml"))
}

fn premium() -> ArmFile {
    match parse(PREMIUM) {
        Ok(DeviceFile::Arm(premium)) => *premium,
        other => panic!("{other:?}"),
    }
}

/// The message for the premium's file with the value of `key` replaced.
fn message_with(table: &str, key: &str, value: &str) -> String {
    let (before, rest) = PREMIUM.split_at(PREMIUM.find(table).unwrap());
    let start = rest.find(&format!("\n{key} =")).unwrap() + 1;
    let line_end = rest[start..].find('\n').unwrap() + start;
    let text = format!("{before}{}{key} = {value}{}", &rest[..start], &rest[line_end..]);
    let line = text[..before.len() + start].matches('\n').count() + 1;
    let message = parse(&text).unwrap_err().to_string();
    assert!(message.starts_with(&format!("lab/left.toml:{line}: `")), "{message}");
    message
}

#[test]
fn the_builtin_files_are_good_and_no_others_exist() {
    for name in BUILTIN_NAMES {
        parse(builtin(name).unwrap()).unwrap();
    }
    assert_eq!(builtin("omni"), None);
}

#[test]
fn the_premium_is_the_one_of_the_paper() {
    let premium = premium();
    let Kinematics::Premium(mechanism) = premium.mechanism else { panic!("its kind says so") };
    assert_eq!(mechanism.link_lengths_m(), [0.215, 0.170]);
    assert_eq!(premium.encoders.reduction, [175.0 / 13.0, 11.3, 11.3]);
    assert_eq!(premium.motors.reduction, premium.encoders.reduction);
    assert_eq!((premium.peak_force_n, premium.continuous_force_n), (8.5, 1.4));
    assert_eq!(premium.joint_map().counts_to_angles([0; 3]), [0.0; 3]);
    assert_eq!(premium.motor_map().zero_codes(), [2048; 3]);
}

#[test]
fn the_stops_are_the_published_degrees() {
    let limits = premium().mechanism.joint_limits();
    let degrees = |i: crate::kinematics::Interval| [i.min.to_degrees(), i.max.to_degrees()];
    let found = [limits.joints[0], limits.joints[1], limits.joints[2], limits.elbow].map(degrees);
    let published = [[-90.0, 90.0], [-61.0, 113.0], [-23.0, 167.0], [-53.0, 54.0]];
    for (found, published) in found.as_flattened().iter().zip(published.as_flattened()) {
        // The file gives 16 digits.
        assert!((found - published).abs() < 1e-13, "{found} {published}");
    }
}

#[test]
fn most_of_the_workspace_is_within_the_stops() {
    let ArmFile { mechanism, workspace, .. } = premium();
    let inside = (0..9261).filter(|k| {
        let steps = [k % 21, k / 21 % 21, k / 441].map(|i| f64::from(i) / 20.0 - 0.5);
        let tip: [f64; 3] = std::array::from_fn(|i| workspace.centre_m[i] + workspace.size_m[i] * steps[i]);
        mechanism.inverse(tip.into()).is_ok_and(|q| mechanism.joint_limits().contains(q))
    });
    // The file claims nine tenths; corners are out of reach.
    let part = inside.count() as f64 / 9261.0;
    assert!(part > 0.9 && part < 1.0, "{part}");
}

#[test]
fn the_current_the_file_claims_gives_the_forces_it_claims() {
    let premium = premium();
    let peak = premium.motor_map().peak_joint_torque();
    // Home: x by the turret over l1, y by the upper arm l1, z by the forearm l2.
    let forces_n = [peak[0] / 0.215, peak[1] / 0.215, peak[2] / 0.170];
    for (found, claimed) in forces_n.iter().zip([8.1, 6.8, 8.6]) {
        assert!((found - claimed).abs() < 0.05, "{forces_n:?}");
    }
}

#[test]
fn an_ideal_device_needs_a_name_only() {
    let file = parse("kind = 'ideal'\nname = 'left'\n").unwrap();
    assert_eq!((file.name(), file.peak_force_n()), ("left", None));
    assert_eq!(file.kinematics(), Kinematics::Ideal(Ideal));
    assert_eq!(parse("kind = 'ideal'\nname = ''\npeak_force_n = 5\n").unwrap().peak_force_n(), Some(5.0));
    let message = parse("kind = 'ideal'\nname = ''\npeak_force_n = 0\n").unwrap_err().to_string();
    assert_eq!(message, "lab/left.toml:3: `peak_force_n`: found 0, allowed: 0.001 to 1000000 N");
}

#[test]
fn an_ideal_device_has_no_motors() {
    let message = parse("kind = 'ideal'\nname = ''\n[motors]\n").unwrap_err().to_string();
    assert!(message.starts_with("lab/left.toml:3: `motors`: unknown field `motors`"), "{message}");
}

#[test]
fn an_unknown_or_missing_kind_lists_those_that_exist() {
    let message = parse("\nkind = 'omni'\n").unwrap_err().to_string();
    assert_eq!(message, r#"lab/left.toml:2: `kind`: found "omni", allowed: "premium" or "ideal""#);
    let message = parse("name = 'x'\n").unwrap_err().to_string();
    assert!(message.starts_with("lab/left.toml:1: ") && message.contains("kind"), "{message}");
}

#[test]
fn every_value_out_of_range_names_file_line_key_found_and_allowed() {
    for (table, key, value, expected) in [
        ("kind", "peak_force_n", "850", "`peak_force_n`: found 850, allowed: 0.001 to 100 N"),
        ("kind", "continuous_force_n", "9.0", "found 9, allowed: at most `peak_force_n`, 8.5 N"),
        ("kind", "workspace_m", "[381, 267, 191]", "`workspace_m[0]`: found 381, allowed: 0.01 to 2 m"),
        ("kind", "workspace_centre_m", "[0, 1, 0]", "found a workspace without the tip's home position"),
        (
            "[linkage]",
            "link_lengths_m",
            "[0.215]",
            "`linkage.link_lengths_m`: found 1 values, allowed: exactly 2",
        ),
        (
            "[linkage]",
            "cable_reduction",
            "[1, 2, nan]",
            "`linkage.cable_reduction[2]`: found NaN, allowed: 0.1 to",
        ),
        ("[linkage]", "cable_reduction", "[1, 2, 3, 4]", "found 4 values, allowed: exactly 3 values"),
        ("[linkage]", "home_joint_angles_rad", "[0, 1, 0]", "found [0.0, 1.0, 0.0], allowed: angles within"),
        (
            "[linkage]",
            "elbow_limits_rad",
            "[0.9, -0.9]",
            "found [0.9, -0.9], allowed: the smaller angle first",
        ),
        (
            "[linkage]",
            "elbow_limits_rad",
            "[-53, 54]",
            "`linkage.elbow_limits_rad[0]`: found -53, allowed: -1.57",
        ),
        (
            "[encoders]",
            "counts_per_rev",
            "0",
            "`encoders.counts_per_rev`: found 0, allowed: a whole number from 4 to",
        ),
        (
            "[encoders]",
            "count_bits",
            "64",
            "`encoders.count_bits`: found 64, allowed: a whole number from 8 to 32",
        ),
        ("[encoders]", "sign", "[1, 0, 1]", "`encoders.sign[1]`: found 0, allowed: 1 or -1"),
        (
            "[encoders]",
            "channel",
            "[0, 1, 1]",
            "`encoders.channel[2]`: found 1 twice, allowed: a channel of its own",
        ),
        (
            "[motors]",
            "channel",
            "[0, 1, 8]",
            "`motors.channel[2]`: found 8, allowed: a whole number from 0 to 7",
        ),
        ("[motors]", "torque_constant_nm_per_a", "23.4", "found 23.4, allowed: 0.0001 to 10 N m/A"),
        ("[motors]", "peak_current_a", "inf", "`motors.peak_current_a`: found inf, allowed: 0.001 to 100 A"),
        ("[motors]", "continuous_current_a", "6", "found 6, allowed: at most `peak_current_a`, 5.5 A"),
        ("[motors]", "winding_time_constant_s", "0", "found 0, allowed: 0.1 to 10000 s"),
        ("[motors]", "dac_bits", "24", "`motors.dac_bits`: found 24, allowed: a whole number from 8 to 16"),
    ] {
        let message = message_with(table, key, value);
        assert!(message.contains(expected), "{message}\nlacks {expected}");
    }
}

#[test]
fn wrong_types_and_unknown_keys_name_their_line_and_key() {
    let message = message_with("[motors]", "dac_bits", "'twelve'");
    assert!(message.contains("`motors.dac_bits`: ") && message.contains("twelve"), "{message}");
    let text = PREMIUM.replace("\ndac_bits", "\ngear = 3\ndac_bits");
    let line = text[..text.find("gear").unwrap()].lines().count() + 1;
    let message = parse(&text).unwrap_err().to_string();
    let expected = format!("lab/left.toml:{line}: `motors.gear`: unknown field `gear`, expected one of");
    assert!(message.starts_with(&expected), "{message}");
}

#[test]
fn a_missing_key_is_named_at_the_line_of_its_table() {
    let text = PREMIUM.replace("\ndac_bits = 12", "\n");
    let line = text[..text.find("[motors]").unwrap()].lines().count() + 1;
    let message = parse(&text).unwrap_err().to_string();
    assert_eq!(message, format!("lab/left.toml:{line}: `motors`: missing field `dac_bits`"));
}

#[test]
fn a_limit_with_three_joints_but_one_number_is_named() {
    let text = PREMIUM.replace("[-1.0646508437165410, 1.9722220547535925]", "[-1.0]");
    let message = parse(&text).unwrap_err().to_string();
    assert!(message.contains("`linkage.joint_limits_rad[1]`: found 1 values"), "{message}");
}

#[test]
fn every_key_is_needed() {
    let keys = PREMIUM.lines().filter(|line| line.contains(" = ") && !line.starts_with('#'));
    let mut tried = 0;
    for line in keys {
        let without = PREMIUM.replacen(&format!("{line}\n"), "", 1);
        assert!(parse(&without).is_err(), "nobody misses {line}");
        tried += 1;
    }
    assert!(tried >= 20, "{tried}");
}

proptest! {
    #[test]
    fn no_text_panics(text in any::<String>(), from in 0usize..6000, length in 0usize..40, patch in "[\\[\\]=.,'\"# \n0-9a-f-]{0,8}") {
        let _ = parse(&text);
        // The good file with a piece cut out and another put in.
        let from = from.min(PREMIUM.len());
        let to = (from + length).min(PREMIUM.len());
        if let (Some(head), Some(tail)) = (PREMIUM.get(..from), PREMIUM.get(to..)) {
            let _ = parse(&format!("{head}{patch}{tail}"));
        }
    }
}
