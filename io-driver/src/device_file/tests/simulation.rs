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

#[test]
fn cable_and_noise_are_there_if_the_file_has_them() {
    let without = premium().simulation.unwrap();
    assert_eq!((without.cable, without.noise), (None, Default::default()));
    let uncommented: String = PREMIUM
        .lines()
        .map(|line| match line.strip_prefix("# ") {
            Some(key) if key.starts_with("[simulation.") || key.contains("_rms = ") => key,
            Some(key) if key.starts_with("stiffness_") || key.starts_with("damping_") => key,
            _ => line,
        })
        .flat_map(|line| [line, "\n"])
        .collect();
    let with = arm(&uncommented).simulation.unwrap();
    assert_eq!(with.cable.unwrap().stiffness_nm_per_rad, [160.0, 160.0, 100.0]);
    assert_eq!((with.noise.encoder_counts_rms, with.noise.current_a_rms), (0.1, 0.003));
    let message = message_of(&uncommented, "[simulation.cable]", "damping_nm_s", "[0, 0, -1]");
    assert!(message.contains("`simulation.cable.damping_nm_s[2]`: found -1, allowed: 0 to 100"), "{message}");
    let message = message_of(&uncommented, "[simulation.noise]", "encoder_counts_rms", "1000");
    assert!(message.contains("`simulation.noise.encoder_counts_rms`: found 1000"), "{message}");
}
