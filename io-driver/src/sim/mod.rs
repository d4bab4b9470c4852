//! Simulated devices and hands.

pub mod hand;
pub mod script;
pub mod split_mix;
