//! Simulated devices and hands.

pub mod dynamics;
pub mod script;
pub mod spec;
