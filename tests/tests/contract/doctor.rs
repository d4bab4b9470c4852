//! The doctor is the same in both programs.

use patience::prelude::*;
use serde_json::Value;
use std::process::Command;
use system_tests::programs::{io_driver, phantom3, said};

/// Ids and subjects of all findings; verdicts may change between two runs on a busy machine.
fn ids(mut command: Command) -> Vec<(String, Value)> {
    let place = tempfile::tempdir().expect("a directory");
    command.args(["doctor", "--json"]).env("PHANTOM3_SOCKET", place.path().join("driver.sock"));
    let (status, out, err) = said(&command.bounded_output().expect("it runs"));
    assert!(matches!(status, Some(0 | 1)) && err.is_empty(), "{status:?} {err}");
    let value: Value = serde_json::from_str(&out).expect("one JSON object");
    let findings = value["findings"].as_array().expect("findings");
    findings.iter().map(|finding| (finding["id"].to_string(), finding["subject"].clone())).collect()
}

#[test]
fn phantom3_driver_doctor_asks_what_io_driver_doctor_asks() {
    let mut phantom3 = phantom3();
    phantom3.arg("driver");
    assert_eq!(ids(phantom3), ids(io_driver()));
}
