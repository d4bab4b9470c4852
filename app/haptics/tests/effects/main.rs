//! Forces that no contact makes.
#![allow(non_snake_case)]

#[path = "../common/mod.rs"]
mod common;
#[path = "../common/effects.rs"]
mod effects;
#[path = "../common/solids.rs"]
mod solids;

mod fields;
mod guides;
mod limits;
mod paths;
mod surfaces;
