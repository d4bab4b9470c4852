//! The files that come with the program are good, and each mistake in them is named.

use std::path::Path;

use proptest::prelude::*;

use super::*;
use crate::kinematics::Mechanism;

mod builtin;
mod simulation;

const PREMIUM: &str = include_str!("../../../config/driver/devices/premium-1.5.toml");
const WOODEN: &str = include_str!("../../../config/driver/devices/wooden-haptics.toml");

fn parse(text: &str) -> Result<DeviceFile, DeviceFileError> {
    DeviceFile::parse(text, Path::new("lab/left.toml"))
}

fn arm(text: &str) -> ArmFile {
    match parse(text) {
        Ok(DeviceFile::Arm(arm)) => *arm,
        other => panic!("{other:?}"),
    }
}

fn premium() -> ArmFile {
    arm(PREMIUM)
}

/// The message for the premium's file with the value of `key` replaced.
fn message_with(table: &str, key: &str, value: &str) -> String {
    message_of(PREMIUM, table, key, value)
}

/// The message for a good file with the value of `key` replaced.
fn message_of(text: &str, table: &str, key: &str, value: &str) -> String {
    let (before, rest) = text.split_at(text.find(table).unwrap());
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
    assert_eq!(
        message,
        r#"lab/left.toml:2: `kind`: found "omni", allowed: "premium", "wooden-haptics" or "ideal""#
    );
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
        ("[bodies]", "mass_a_kg", "20.2", "`bodies.mass_a_kg`: found 20.2, allowed: 0 to 10 kg"),
        (
            "[bodies]",
            "inertia_a_kg_m2",
            "[1, 2]",
            "`bodies.inertia_a_kg_m2`: found 2 values, allowed: exactly 3",
        ),
        (
            "[bodies]",
            "inertia_be_kg_m2",
            "[0, 0, 11.09]",
            "`bodies.inertia_be_kg_m2[2]`: found 11.09, allowed: 0 to 1 kg m^2",
        ),
        ("[bodies]", "inertia_base_yy_kg_m2", "-1e-4", "`bodies.inertia_base_yy_kg_m2`: found -0.0001"),
        (
            "[simulation]",
            "coulomb_friction_nm",
            "[0, -1, 0]",
            "`simulation.coulomb_friction_nm[1]`: found -1, allowed: 0 to 10 N m",
        ),
        ("[simulation]", "viscous_friction_nm_s", "[0]", "found 1 values, allowed: exactly 3 values"),
        ("[simulation]", "stop_stiffness_nm_per_rad", "0", "found 0, allowed: 0.1 to 100000 N m/rad"),
        ("[simulation]", "stop_damping_nm_s", "nan", "`simulation.stop_damping_nm_s`: found NaN"),
        (
            "[simulation.motor]",
            "rotor_inertia_kg_m2",
            "10.3",
            "`simulation.motor.rotor_inertia_kg_m2`: found 10.3, allowed: 0 to 0.01 kg m^2",
        ),
        ("[simulation.motor]", "inductance_h", "0.238", "found 0.238, allowed: 0 to 0.1 H"),
        ("[simulation.motor]", "supply_v", "0", "found 0, allowed: 0.1 to 500 V"),
        ("[simulation.motor]", "watchdog_s", "100", "found 100, allowed: 0.0001 to 10 s"),
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
    for text in [PREMIUM, WOODEN] {
        let keys = text.lines().filter(|line| line.contains(" = ") && !line.starts_with('#'));
        let mut tried = 0;
        for line in keys {
            let without = text.replacen(&format!("{line}\n"), "", 1);
            assert!(parse(&without).is_err(), "nobody misses {line}");
            tried += 1;
        }
        assert!(tried >= 45, "{tried}");
    }
}

#[test]
fn the_wooden_arm_s_own_keys_are_checked_as_well() {
    for (key, value, expected) in [
        ("body_lengths_m", "[80, 205, 245]", "`linkage.body_lengths_m[0]`: found 80, allowed: 0.01 to 2 m"),
        ("origin_m", "[0.22]", "`linkage.origin_m`: found 1 values, allowed: exactly 2 values"),
        ("elbow_limits_rad", "[-0.1, 1]", "`linkage.elbow_limits_rad[0]`: found -0.1, allowed: 0 to 3.14"),
        ("home_joint_angles_rad", "[0, 0, 0]", "their third plus their second within `elbow_limits_rad`"),
    ] {
        let message = message_of(WOODEN, "[linkage]", key, value);
        assert!(message.contains(expected), "{message}\nlacks {expected}");
    }
    let message = parse(&WOODEN.replace("body_lengths_m", "link_lengths_m")).unwrap_err().to_string();
    assert!(message.contains("unknown field `link_lengths_m`"), "{message}");
}

proptest! {
    #[test]
    fn no_text_panics(text in any::<String>(), from in 0usize..8000, length in 0usize..40, patch in "[\\[\\]=.,'\"# \n0-9a-f-]{0,8}") {
        let _ = parse(&text);
        // The good file with a piece cut out and another put in.
        let from = from.min(PREMIUM.len());
        let to = (from + length).min(PREMIUM.len());
        if let (Some(head), Some(tail)) = (PREMIUM.get(..from), PREMIUM.get(to..)) {
            let _ = parse(&format!("{head}{patch}{tail}"));
        }
    }
}
