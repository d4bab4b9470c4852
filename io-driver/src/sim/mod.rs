//! Simulated devices and hands.

pub mod arm;
pub mod dynamics;
pub mod encoder;
pub mod hand;
pub mod joint_friction;
pub mod motor;
pub mod script;
pub mod spec;
pub mod split_mix;
pub mod tip_board;
