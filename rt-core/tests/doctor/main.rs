//! The doctor: its checks, fix plans and probes.
//!
//! One program: each costs the time to link it, and tests of one program share the cores.

#[path = "../machines/mod.rs"]
mod machines;

mod checks;
mod garbage;
mod kinds;
mod live;
mod plan;
