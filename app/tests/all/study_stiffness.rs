//! The stiffness study against theory that shares no line with the simulation.

use io_driver::device_file::builtin;
use io_driver::sim::hand::model_file::Firmness;
use phantom3::study::stiffness::bounds::Theory;
use phantom3::study::stiffness::case::{Axis, Case, Hand, Mode};
use phantom3::study::stiffness::search::{Found, Search};
use phantom3::study::stiffness::trial::{Bench, Outcome};
use std::path::{Path, PathBuf};

/// The hand wants to be 2 mm behind the surface, then 1 mm more.
const PUSH_M: [f64; 2] = [2e-3, 1e-3];

fn case(mode: Mode, rate_hz: f64) -> Case {
    let hand = Hand { model: PathBuf::from("pen-grip"), firmness: Firmness::Light };
    Case { mode, rate_hz, damping_n_s_per_m: 0.0, hand }
}

fn limit(bench: &Bench, case: &Case, is_good: impl Fn(&Outcome) -> bool) -> f64 {
    let mut search = Search::default();
    while let Some(stiffness) = search.next() {
        let outcome = bench.open(case, stiffness).expect("a trial").run().expect("an outcome");
        search.learn(stiffness, is_good(&outcome));
    }
    match search.found() {
        Found::Limit(stiffness) => stiffness,
        other => panic!("{case:?}: {other:?}"),
    }
}

/// A Premium that neither sticks nor counts in steps that matter, and whose force may change as fast as any.
fn smooth_premium(directory: &Path) -> PathBuf {
    let replaced = [
        ("counts_per_rev = 4096 ", "counts_per_rev = 4096000 "),
        ("count_bits = 16 ", "count_bits = 32 "),
        ("dac_bits = 12 ", "dac_bits = 16 "),
        ("slew_n_per_s = 5000.0 ", "slew_n_per_s = 10000.0 "),
        ("coulomb_friction_nm = [0.0086, 0.0086, 0.0068]", "coulomb_friction_nm = [0.0, 0.0, 0.0]"),
    ];
    let text =
        replaced.iter().fold(builtin("premium-1.5").expect("built in").to_owned(), |text, (from, to)| {
            assert!(text.contains(from), "the description has changed: no `{from}`");
            text.replace(from, to)
        });
    let file = directory.join("smooth.toml");
    std::fs::write(&file, text).expect("room");
    file
}

#[test]
fn without_friction_and_steps_the_whole_system_buzzes_where_the_linear_loop_does() {
    let directory = tempfile::tempdir().expect("room");
    let bench = Bench::new(&smooth_premium(directory.path()), Axis::Y, PUSH_M).expect("a bench");
    for (mode, rate_hz) in [
        (Mode::SameTick, 1000.0),
        (Mode::FixedPhase, 1000.0),
        (Mode::NextTick, 1000.0),
        (Mode::NextTick, 4000.0),
    ] {
        let case = case(mode, rate_hz);
        let Found::Limit(linear) = Theory::of(&bench, &case).expect("a model").linear else { panic!() };
        // A thousand counts here are one there: the same 0.06 mm.
        let found = limit(&bench, &case, |outcome| !outcome.is_fault && outcome.ripple_counts < 2000);
        // Two searches to a percent each; what grows or dies by less than that changes little in two seconds.
        assert!(
            (0.98..1.02).contains(&(found / linear)),
            "{mode:?} {rate_hz} Hz: {found} N/m, linear {linear}"
        );
    }
}

#[test]
fn friction_holds_what_the_linear_loop_would_blow_up_and_late_replies_cost_stiffness() {
    let bench = Bench::new(Path::new("premium-1.5"), Axis::Y, PUSH_M).expect("a bench");
    let limits = [Mode::SameTick, Mode::FixedPhase, Mode::NextTick].map(|mode| {
        let case = case(mode, 1000.0);
        let theory = Theory::of(&bench, &case).expect("a model");
        let settled = limit(&bench, &case, Outcome::settles);
        let Found::Limit(linear) = theory.linear else { panic!() };
        assert!(settled > linear, "{mode:?}: {settled} N/m, linear {linear}");
        // Abbott and Okamura's condition is sufficient: below it no step of the encoder keeps anything moving.
        let quiet = limit(&bench, &case, Outcome::is_quiet);
        assert!(quiet >= theory.friction.min(linear), "{mode:?}: quiet to {quiet} N/m, {theory:?}");
        settled
    });
    assert!(limits[0] > 1.2 * limits[1] && limits[1] > 1.2 * limits[2], "{limits:?}");
}

#[test]
fn a_trial_has_the_same_outcome_every_time() {
    let bench = Bench::new(Path::new("premium-1.5"), Axis::Z, PUSH_M).expect("a bench");
    let case = case(Mode::SameTick, 1000.0);
    let outcomes: Vec<_> =
        (0..3).map(|_| bench.open(&case, 20_000.0).expect("a trial").run().expect("an outcome")).collect();
    assert!(outcomes.iter().all(|outcome| *outcome == outcomes[0]), "{outcomes:?}");
    assert!(!outcomes[0].settles(), "far beyond what this arm stands: {outcomes:?}");
}

#[test]
fn the_rules_of_thumb_are_what_they_say() {
    let bench = Bench::new(Path::new("premium-1.5"), Axis::Y, PUSH_M).expect("a bench");
    // Viscous 2.3e-4 N m s/rad over a lever of 0.215 m; the light pen grip damps with 0.63 * 3.609 N s/m; the amplifiers
    // are 1 / (2 pi 1000 Hz) late, a round trip 5 us.
    let (own, grasp) = (2.3e-4 / 0.215f64.powi(2), 0.63 * 3.609);
    let amplifier_s = 1.0 / (std::f64::consts::TAU * 1000.0);
    for (mode, late_s) in [(Mode::SameTick, 5e-6), (Mode::FixedPhase, 0.25e-3), (Mode::NextTick, 0.505e-3)] {
        let theory = |damping_n_s_per_m| {
            Theory::of(&bench, &Case { damping_n_s_per_m, ..case(mode, 2000.0) }).expect("a model")
        };
        let phase_s = 0.25e-3 + late_s + amplifier_s;
        let near = |found: f64, wanted: f64| (found / wanted - 1.0).abs() < 1e-9;
        let (bare, damped) = (theory(0.0), theory(2.0));
        assert!(near(bare.damped, (own + grasp) / phase_s), "{mode:?}: {bare:?}");
        assert!(near(damped.damped, (own + grasp + 2.0) / phase_s), "{mode:?}: {damped:?}");
        assert!(near(bare.passive, own / phase_s), "{mode:?}: {bare:?}");
        assert_eq!(damped.passive, 0.0, "the wall damps more than the arm");
        // Both are 0.04 N to the digits of the joint friction: 0.0086 N m.
        let friction = 2.0 * (0.0086 / 0.215) / (std::f64::consts::TAU / 4096.0 / 11.3 * 0.215);
        assert!(near(bare.friction, friction) && bare.friction == damped.friction, "{bare:?}");
    }
}
