//! Rational patches.
#![allow(non_snake_case)]

#[path = "../common/mod.rs"]
mod common;

#[path = "../mesh_oracle/mod.rs"]
mod mesh_oracle;

mod corners;
mod curvo;
mod exact;
mod grooves;
mod leaks;
mod quality;
mod starts;
