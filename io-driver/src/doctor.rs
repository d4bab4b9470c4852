//! `io-driver doctor`: is this machine ready to drive haptic devices?
//!
//! Problem: see [`rt_core::doctor`], whose checks know nothing of haptics; here are added the cards that
//! drive haptic devices and the driver's own socket, and everything is put into words, JSON or a script.
//! Invariant: changes nothing, takes no lease, and yields to a driver that runs.

mod card;
pub mod cli;
pub mod device;
mod json;
pub mod segment;
mod user;

pub use cli::plan_names;
pub use json::to_json;

use rt_core::doctor::Finding;
use rt_core::doctor::machine::Machine;
use segment::Answer;

/// Asks every question, in the order of the output.
pub fn examine(machine: &Machine<'_>, socket: &str, answer: &Answer) -> Vec<Finding> {
    let mut findings = rt_core::doctor::examine(machine);
    findings.extend(device::examine(machine));
    findings.extend(segment::examine(machine, socket, answer));
    findings
}
