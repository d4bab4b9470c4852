//! `io-driver emulate` as a user meets it: wrong words are refused, and a driver without a card says what to do.

use system_tests::faults::process::{End, Running};
use system_tests::programs;

fn refused(arguments: &[&str]) -> String {
    // One that is not refused would play for ever; its end is waited for with a limit.
    let End { status, out, err, .. } = Running::start(programs::io_driver().args(arguments)).end();
    assert_eq!((status, out.as_str()), (Some(2), ""), "{arguments:?}: {err}");
    err
}

#[test]
fn wrong_words_are_refused_with_what_was_found_and_what_is_allowed() {
    let place = tempfile::tempdir().unwrap();
    let card = place.path().join("card").to_string_lossy().into_owned();
    let cases: [(&[&str], &str); 16] = [
        (&["--yield", "-3"], "--yield: found -3, allowed: 0.001 N m s/rad and more"),
        (&["--peak-n", "nan"], "--peak-n: found NaN, allowed: 0 N and more"),
        (&["--step-n", "-1"], "--step-n: found -1, allowed: 0 N and more"),
        (&["--poll-us", "0"], "--poll-us: found 0, allowed: more than 0"),
        (&["--watchdog-ms", "inf"], "--watchdog-ms: found inf, allowed: more than 0"),
        (&["--description", "ideal"], "ideal describes no mechanism"),
        (&["--description", "nowhere.toml"], "cannot read nowhere.toml"),
        (&["--trace", "t.csv", "--yield", "1"], "cannot be used with"),
        (&["--simulated", "--yield", "1"], "cannot be used with"),
        (
            &["--simulated", "--hold", "1,0,0"],
            "the hand begins at [1.0, 0.0, 0.0] m, which the arm does not reach",
        ),
        (&["--simulated", "--hold", "1,0"], "found 1,0, allowed: three numbers of metres"),
        (&["--simulated", "--firmness", "weak"], "found weak, allowed: light, usual, firm"),
        (&["--simulated", "--hand-model", "none"], "cannot read none"),
        (&["--hold", "0,0,0"], "--simulated"),
        (&["--simulated", "--hand", "Cargo.toml", "--finger", "f9"], "Cargo.toml"),
        (&["--simulated", "--finger", "f9"], "--hand"),
    ];
    for (arguments, expected) in cases {
        let said = refused(&[&["emulate", "--card", &card], arguments].concat());
        assert!(said.contains(expected), "{arguments:?}: {said}");
    }
    let nowhere = refused(&["emulate", "--card", "/nowhere/card"]);
    assert!(nowhere.contains("cannot make the emulated card /nowhere/card"), "{nowhere}");
    assert!(!place.path().join("card").exists(), "nothing was started");
}

#[test]
fn a_driver_whose_card_nobody_plays_says_how_to_play_it() {
    let place = tempfile::tempdir().unwrap();
    let file = place.path().join("driver.toml");
    let device = "[[device]]\nbackend = \"emulated\"\ndescription = \"premium-1.5\"\ncard = \"card\"\n";
    std::fs::write(&file, device).unwrap();
    let said = refused(&["run", "--config", &file.to_string_lossy()]);
    assert!(
        said.contains("there is no emulated card") && said.contains("io-driver emulate --card"),
        "{said}"
    );
}
