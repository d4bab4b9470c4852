//! A description serves without what only a simulation needs, and not with a part of it.

use super::*;

/// A file from before there was a simulation: everything from this line on is missing.
fn up_to_line_with(needle: &str) -> &'static str {
    &PREMIUM[..PREMIUM.find(needle).unwrap()]
}

#[test]
fn an_arm_that_nobody_simulates_needs_neither_moments_nor_a_table_for_it() {
    let without = arm(up_to_line_with("# Moments of inertia"));
    assert_eq!(without.simulation, None);
    assert_eq!(without.gravity, premium().gravity);
    let with_moments = arm(up_to_line_with("# What only a simulated"));
    assert_eq!(with_moments.simulation, None);
    let bare = arm(up_to_line_with("[bodies]"));
    assert_eq!((bare.gravity, bare.simulation), (None, None));
}

#[test]
fn a_simulation_without_moments_of_inertia_is_refused() {
    let simulation = &PREMIUM[PREMIUM.find("[simulation]").unwrap()..];
    for known in ["[bodies]", "# Moments of inertia"] {
        let text = format!("{}{simulation}", up_to_line_with(known));
        let line = text[..text.find("[simulation]").unwrap()].lines().count() + 1;
        let message = parse(&text).unwrap_err().to_string();
        let expected =
            format!("lab/left.toml:{line}: `simulation`: found a table [simulation] of an arm without");
        assert!(message.starts_with(&expected) && message.contains("`inertia_a_kg_m2`"), "{message}");
    }
}

#[test]
fn some_moments_of_inertia_are_no_moments() {
    let text = PREMIUM.replace("\ninertia_c_kg_m2", "\n# inertia_c_kg_m2");
    let message = parse(&text).unwrap_err().to_string();
    let expected = "`bodies`: found moments of inertia without `inertia_c_kg_m2`, allowed: all five, or none";
    assert!(message.contains(expected), "{message}");
}

/// With the tables that are comments in the built-in file.
fn uncommented() -> String {
    PREMIUM
        .lines()
        .map(|line| match line.strip_prefix("# ") {
            Some(key) if key.starts_with("[simulation.") || key.contains("_rms = ") => key,
            Some(key) if key.starts_with("stiffness_") || key.starts_with("damping_") => key,
            _ => line,
        })
        .flat_map(|line| [line, "\n"])
        .collect()
}

#[test]
fn cable_and_noise_are_there_if_the_file_has_them() {
    let without = premium().simulation.unwrap();
    assert_eq!((without.cable, without.noise), (None, Default::default()));
    let uncommented = uncommented();
    let with = arm(&uncommented).simulation.unwrap();
    assert_eq!(with.cable.unwrap().stiffness_nm_per_rad, [160.0, 160.0, 100.0]);
    assert_eq!((with.noise.encoder_counts_rms, with.noise.current_a_rms), (0.1, 0.003));
    let message = message_of(&uncommented, "[simulation.cable]", "damping_nm_s", "[0, 0, -1]");
    assert!(message.contains("`simulation.cable.damping_nm_s[2]`: found -1, allowed: 0 to 100"), "{message}");
    let message = message_of(&uncommented, "[simulation.noise]", "encoder_counts_rms", "1000");
    assert!(message.contains("`simulation.noise.encoder_counts_rms`: found 1000"), "{message}");
}

#[test]
fn what_no_step_of_the_simulation_could_follow_is_refused() {
    let cable = uncommented();
    for (text, table, key, value, words) in [
        (
            PREMIUM,
            "[simulation]",
            "stop_stiffness_nm_per_rad",
            "1e5",
            "stop_stiffness_nm_per_rad`: found 100000",
        ),
        (PREMIUM, "[simulation]", "stop_damping_nm_s", "50", "stop_damping_nm_s`: found 50"),
        (
            PREMIUM,
            "[simulation]",
            "viscous_friction_nm_s",
            "[0, 0, 30]",
            "viscous_friction_nm_s[2]`: found 30",
        ),
        (
            &cable,
            "[simulation.cable]",
            "stiffness_nm_per_rad",
            "[1, 2e4, 1]",
            "stiffness_nm_per_rad[1]`: found 20000",
        ),
        (&cable, "[simulation.cable]", "damping_nm_s", "[0, 0, 5]", "damping_nm_s[2]`: found 5"),
    ] {
        let message = message_of(text, table, key, value);
        assert!(
            message.contains(words) && message.contains("which steps of 62.5 us can follow"),
            "{message}"
        );
    }
    let message = message_of(&cable, "[simulation.motor]", "rotor_inertia_kg_m2", "0");
    assert!(message.contains("rotor_inertia_kg_m2`: found 0, allowed: more than 0"), "{message}");
}

#[test]
fn an_arm_without_inertia_is_refused() {
    let mut text = PREMIUM.replace("rotor_inertia_kg_m2 = 10.3e-7", "rotor_inertia_kg_m2 = 0");
    assert!(parse(&text).is_ok(), "that of the links is enough");
    for body in ["a", "c", "be", "df"] {
        let line =
            text.lines().find(|line| line.starts_with(&format!("inertia_{body}_kg_m2"))).unwrap().to_owned();
        text = text.replace(&line, &format!("inertia_{body}_kg_m2 = [0, 0, 0]"));
    }
    let line = text.lines().find(|line| line.starts_with("inertia_base_yy_kg_m2")).unwrap().to_owned();
    text = text.replace(&line, "inertia_base_yy_kg_m2 = 0");
    assert!(parse(&text).is_ok(), "masses on levers are inertia, too");
    for mass in ["mass_a_kg = 0.0202", "mass_c_kg = 0.0249"] {
        text = text.replace(mass, &format!("{} 0", &mass[..11]));
    }
    let message = parse(&text).unwrap_err().to_string();
    assert!(message.contains("`simulation`: found an arm that has no inertia"), "{message}");
}
