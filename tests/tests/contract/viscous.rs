//! Friction that grows with speed, felt through scene file, hand file and recording alone.

use system_tests::recording::Sample;
use system_tests::workplace::{felt, hand};

const STIFFNESS_N_PER_M: f64 = 1000.0;

fn table(friction: &str) -> String {
    format!(
        "[[finger]]\n[[entity]]\nname = \"table\"\nstiffness_n_per_m = {STIFFNESS_N_PER_M:?}\n\
         shape = {{ kind = \"plane\", normal = [0.0, 1.0, 0.0], offset_m = 0.0 }}\nfriction = {friction}\n"
    )
}

/// From rest at this depth along x at a constant speed, with so many ticks.
fn drag(depth_m: f64, speed_m_s: f64, ticks: u32) -> String {
    let seconds = f64::from(ticks) / 1000.0;
    hand([(0.0, [0.0, -depth_m, 0.0]), (seconds, [speed_m_s * seconds, -depth_m, 0.0])])
}

/// What friction must be after `lag` ticks: the gap relaxes by c / (1 + c) in every tick towards its rest,
/// c being mu_v d / dt, which is the implicit solution of "gap = d (mu + mu_v v)".
fn expected_n(mu: f64, mu_v_s_per_m: f64, depth_m: f64, samples: &[Sample]) -> Vec<f64> {
    let c = mu_v_s_per_m * depth_m / 1e-3;
    let mut god_x = 0.0;
    let mut force = |s: &Sample| {
        let over_m = s.hip.x - god_x - mu * depth_m;
        if over_m > 0.0 {
            god_x += over_m / (1.0 + c);
        }
        STIFFNESS_N_PER_M * (s.hip.x - god_x)
    };
    samples.iter().map(&mut force).collect()
}

/// The differences of the force from tick to tick never grow and never change sign, but for rounding.
fn assert_no_chatter(samples: &[Sample], about: &str) {
    let largest_n = samples.iter().map(|s| s.force.x.abs()).fold(0.0, f64::max);
    // Force is k times the difference of two positions that carry a rounding each.
    let far_m = samples.iter().map(|s| s.hip.x.abs()).fold(0.0, f64::max);
    let rounding_n = 8.0 * f64::EPSILON * (largest_n + STIFFNESS_N_PER_M * far_m);
    let steps: Vec<f64> = samples.windows(2).map(|pair| pair[0].force.x - pair[1].force.x).collect();
    for (tick, pair) in steps.windows(2).enumerate() {
        assert!(pair[1] >= -rounding_n, "{about}: the force falls in tick {tick}: {pair:?} N");
        assert!(pair[1] <= pair[0] + rounding_n, "{about}: the force speeds up in tick {tick}: {pair:?} N");
    }
}

#[test]
fn viscous_friction_settles_at_its_closed_form_without_chatter_over_seven_decades() {
    for exponent in -3..=4 {
        let mu_v_s_per_m = 10f64.powi(exponent);
        // At 0.1 mm and 1e4 s/m the gap takes 1000 ticks per e-fold; 23 of them are ten digits.
        let (depth_m, speed_m_s) = (1e-4, 0.01);
        let c = mu_v_s_per_m * depth_m / 1e-3;
        let ticks = 200 + (23.1 * (1.0 + c)) as u32;
        let scene = table(&format!("{{ model = \"viscous\", mu_v_s_per_m = {mu_v_s_per_m:?} }}"));
        let seconds = f64::from(ticks) / 1000.0;
        let samples = felt(&scene, &drag(depth_m, speed_m_s, ticks), &["--seconds", &seconds.to_string()]);
        assert!(samples.iter().all(|s| s.friction == "slip"), "it has no static friction");
        assert_no_chatter(&samples, &format!("mu_v = {mu_v_s_per_m}"));
        check_against(&samples, &expected_n(0.0, mu_v_s_per_m, depth_m, &samples));
        let (last, steady_n) =
            (&samples[samples.len() - 1], STIFFNESS_N_PER_M * depth_m * mu_v_s_per_m * speed_m_s);
        // Ten digits of settling, and the recording's own speed, which two positions of up to 0.3 m give
        // with an error of 1e-16 m / 1e-5 m.
        assert!((-last.force.x / steady_n - 1.0).abs() < 1e-9, "k d mu_v v = {steady_n} N: {last:?}");
    }
}

fn check_against(samples: &[Sample], expected_n: &[f64]) {
    let far_m = samples.iter().map(|s| s.hip.x.abs()).fold(0.0, f64::max);
    for (s, expected) in samples.iter().zip(expected_n) {
        // Both are recurrences whose roundings die out like the gap does, so a few stay: nine digits of
        // the force, and the rounding of the positions.
        let tolerance_n = 1e-9 * expected.abs() + 64.0 * f64::EPSILON * STIFFNESS_N_PER_M * far_m;
        assert!((-s.force.x - expected).abs() <= tolerance_n, "{} N, not {expected} N: {s:?}", -s.force.x);
    }
}

#[test]
fn viscous_friction_at_working_depth_does_not_chatter_where_the_printed_form_does() {
    // At 5 mm and 1 kHz the explicit form chatters from 0.1 s/m on.
    for mu_v_s_per_m in [0.05, 0.1, 0.2, 1.0, 5.0, 20.0] {
        let scene = table(&format!("{{ model = \"viscous\", mu_v_s_per_m = {mu_v_s_per_m:?} }}"));
        let samples = felt(&scene, &drag(5e-3, 0.1, 4000), &[]);
        assert_no_chatter(&samples, &format!("mu_v = {mu_v_s_per_m}"));
        check_against(&samples, &expected_n(0.0, mu_v_s_per_m, 5e-3, &samples));
    }
}

#[test]
fn coulomb_viscous_friction_holds_up_to_mu_and_adds_the_speed_beyond() {
    let (mu, depth_m) = (0.4, 5e-3);
    for (mu_v_s_per_m, speed_m_s) in [(0.01, 0.0613), (0.5, 0.0613), (2.0, 0.0113)] {
        let scene = table(&format!(
            "{{ model = \"coulomb-viscous\", mu = {mu:?}, mu_v_s_per_m = {mu_v_s_per_m:?} }}"
        ));
        let samples = felt(&scene, &drag(depth_m, speed_m_s, 3000), &[]);
        for s in &samples {
            assert_eq!(s.friction == "stick", s.hip.x <= mu * depth_m, "{s:?}");
            if s.friction == "stick" {
                assert_eq!(s.god.x, 0.0, "{s:?}");
            }
        }
        check_against(&samples, &expected_n(mu, mu_v_s_per_m, depth_m, &samples));
        let steady_n = STIFFNESS_N_PER_M * depth_m * (mu + mu_v_s_per_m * speed_m_s);
        let last = &samples[samples.len() - 1];
        // 3000 ticks are at least 250 times 1 + c: settled to rounding.
        assert!((-last.force.x / steady_n - 1.0).abs() < 1e-9, "{steady_n} N: {last:?}");
    }
}
