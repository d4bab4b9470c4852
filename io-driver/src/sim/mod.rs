//! Simulated devices and hands.

pub mod script;
