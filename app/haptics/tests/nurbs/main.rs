//! Rational patches.
#![allow(non_snake_case)]

#[path = "../common/mod.rs"]
mod common;

mod corners;
mod curvo;
mod exact;
mod leaks;
mod quality;
mod starts;
